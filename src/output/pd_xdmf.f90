!> The XDMF file of a result file: ParaView needs it to open the result.
!>
!> It holds no numbers, only their paths in the HDF5 file, which is named without a folder so that
!> both can be moved together. Vectors in the plane get a third component 0, which ParaView's
!> filters (warp, glyph) ask for; tensors become one scalar per component.
module pd_xdmf
  use pd_errors, only: error_list_t
  use pd_files, only: write_whole_file
  use pd_kinds, only: wp
  use pd_labels, only: field_label_t
  use pd_text, only: integer_text
  implicit none
  private

  public :: xdmf_grid, write_xdmf

  character(*), parameter :: nl = new_line('a')

contains

  !> Write the XDMF file of a result anew, from the grids of its frames one after the other.
  !>
  !> Errors: it cannot be written or put in place.
  subroutine write_xdmf(path, grids, errors)
    character(*),       intent(in)    :: path, grids
    type(error_list_t), intent(inout) :: errors

    call write_whole_file(path, '<?xml version="1.0" ?>'//nl//'<Xdmf Version="2.0">'//nl &
      //'<Domain>'//nl//'<Grid Name="frames" GridType="Collection" CollectionType="Temporal">' &
      //nl//grids//'</Grid>'//nl//'</Domain>'//nl//'</Xdmf>', errors)
  end subroutine write_xdmf

  !> The grid of one frame.
  pure function xdmf_grid(data_file, n, fields, index_of_frame, at_time, yields) result(text)
    character(*),  intent(in) :: data_file        !! name of the HDF5 file, without its folder
    integer,       intent(in) :: n                !! number of points
    type(field_label_t), intent(in) :: fields(:)
    integer,       intent(in) :: index_of_frame   !! k of /frames/k, written with six digits
    real(wp),      intent(in) :: at_time          !! [s]
    logical,       intent(in) :: yields           !! the points have a yield stress
    character(:), allocatable :: text, source
    character(24) :: time
    character(6)  :: group
    integer :: i

    write (time, '(es24.16e3)') at_time
    write (group, '(i6.6)') index_of_frame
    source = escaped(data_file)//':/points/'
    text = '<Grid Name="'//group//'" GridType="Uniform">'//nl &
      //'<Time Value="'//trim(adjustl(time))//'"/>'//nl &
      //'<Topology TopologyType="Polyvertex" NodesPerElement="1" NumberOfElements="' &
      //integer_text(n)//'"/>'//nl//'<Geometry GeometryType="XY">'//nl &
      //whole_item(source//'position', integer_text(n)//' 2', 'Float', 8)//'</Geometry>'//nl &
      //attribute('volume', 'Scalar', whole_item(source//'volume', integer_text(n), 'Float', 8)) &
      //attribute('boundary', 'Scalar', whole_item(source//'boundary', integer_text(n), 'Int', 4))
    if (yields) text = text//attribute('yield_stress', 'Scalar', &
      whole_item(source//'yield_stress', integer_text(n), 'Float', 8))
    source = escaped(data_file)//':/frames/'//group//'/'
    do i = 1, size(fields)
      text = text//field_text(source//trim(fields(i)%name), n, fields(i))
    end do
    text = text//'</Grid>'//nl
  end function xdmf_grid

  pure function field_text(source, n, field) result(text)
    character(*),  intent(in) :: source
    integer,       intent(in) :: n
    type(field_label_t), intent(in) :: field
    character(:), allocatable :: text
    integer :: c

    if (field%width() == 1) then
      text = attribute(trim(field%name), 'Scalar', whole_item(source, integer_text(n), 'Float', 8))
    else if (field%width() == 2) then
      text = attribute(trim(field%name), 'Vector', '<DataItem ItemType="Function" ' &
        //'Function="JOIN($0, $1, 0 * $1)" Dimensions="'//integer_text(n)//' 3">'//nl &
        //column_item(source, n, 2, 1)//column_item(source, n, 2, 2)//'</DataItem>'//nl)
    else
      text = ''
      do c = 1, field%width()
        text = text//attribute(trim(field%name)//'_'//field%component(c), 'Scalar', &
          column_item(source, n, field%width(), c))
      end do
    end if
  end function field_text

  pure function attribute(name, kind_of_field, item) result(text)
    character(*), intent(in) :: name, kind_of_field, item
    character(:), allocatable :: text

    text = '<Attribute Name="'//name//'" AttributeType="'//kind_of_field//'" Center="Node">'//nl &
      //item//'</Attribute>'//nl
  end function attribute

  pure function whole_item(source, dimensions, number_type, bytes) result(text)
    character(*), intent(in) :: source, dimensions, number_type
    integer,      intent(in) :: bytes
    character(:), allocatable :: text

    text = '<DataItem Dimensions="'//dimensions//'" NumberType="'//number_type//'" Precision="' &
      //integer_text(bytes)//'" Format="HDF">'//source//'</DataItem>'//nl
  end function whole_item

  !> Column c of an array of shape (n,width).
  pure function column_item(source, n, width, c) result(text)
    character(*), intent(in) :: source
    integer,      intent(in) :: n, width, c
    character(:), allocatable :: text

    text = '<DataItem ItemType="HyperSlab" Dimensions="'//integer_text(n)//'">'//nl &
      //'<DataItem Dimensions="3 2" Format="XML">0 '//integer_text(c - 1)//' 1 1 ' &
      //integer_text(n)//' 1</DataItem>'//nl &
      //whole_item(source, integer_text(n)//' '//integer_text(width), 'Float', 8)//'</DataItem>'//nl
  end function column_item

  !> A name as XML text.
  pure function escaped(name) result(text)
    character(*), intent(in) :: name
    character(:), allocatable :: text
    character(5), parameter :: entities(3) = ['&amp;', '&lt; ', '&gt; ']
    integer :: i, k

    text = ''
    do i = 1, len(name)
      k = index('&<>', name(i:i))
      if (k > 0) then
        text = text//trim(entities(k))
      else
        text = text//name(i:i)
      end if
    end do
  end function escaped

end module pd_xdmf
