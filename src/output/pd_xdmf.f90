!> The XDMF file of a result file: ParaView, pyvista and meshio open the result by it.
!>
!> It holds no numbers, only their paths in the HDF5 file, which is named without a folder so that
!> both can be moved together. All readers take whole data sets alone, so there is one attribute
!> for each. Readers of VTK give a vector of two components the third that their filters ask for.
!> Those of some versions take the components of a matrix from all dimensions but the first, those
!> of others from the last: a tensor is therefore said to be of 1 x 4 numbers at every point.
!>
!> Besides, VTK gets one scalar per component of a tensor, by name. meshio can read no part of a
!> data set, and would give up: these attributes stand in a name space, which VTK disregards.
!>
!> Behind its end there is room for all frames, in blanks, which XML ignores there. A frame is
!> written over the end, with a new end behind it, in one call of the operating system: the cost of
!> a frame does not depend on how many there are, and the disk cannot be full.
module pd_xdmf
  use pd_errors, only: error_list_t
  use pd_files, only: cut_file, open_output, output_file_t, patch_file, publish_output, &
    size_of_file, write_line
  use pd_kinds, only: i8, wp
  use pd_labels, only: field_label_t
  use pd_text, only: integer_text
  implicit none
  private

  public :: xdmf_t, new_xdmf

  character(*), parameter :: nl = new_line('a')
  character(*), parameter :: head = '<?xml version="1.0" ?>'//nl//'<Xdmf Version="3.0" '// &
    'xmlns:component="urn:perigeo:component">'//nl//'<Domain>'//nl// &
    '<Grid Name="frames" GridType="Collection" CollectionType="Temporal">'//nl
  character(*), parameter :: tail = '</Grid>'//nl//'</Domain>'//nl//'</Xdmf>'//nl

  !> The XDMF file of a result that is being written.
  type :: xdmf_t
    private
    character(:), allocatable :: path, data_file
    integer :: n = 0                     !! points
    type(field_label_t), allocatable :: fields(:)
    logical :: yields = .false.          !! the points have a yield stress
    integer :: frames = 0                !! so far
    real(wp), allocatable :: times(:)    !! of the frames for which there is room [s]
    integer(i8) :: filled = 0            !! bytes up to the end of the last frame
    integer(i8) :: bytes = -1            !! of the file
  contains
    procedure :: note
    procedure :: write => write_xdmf
    procedure :: add_frame
    procedure :: finish
    procedure, private :: grid_of
  end type xdmf_t

contains

  !> The XDMF file that belongs to a result file, without frames.
  type(xdmf_t) function new_xdmf(path, data_path, n, fields, room, yields) result(xdmf)
    character(*),        intent(in) :: path, data_path   !! of this file, of the result file
    integer,             intent(in) :: n                 !! number of points
    type(field_label_t), intent(in) :: fields(:)
    integer,             intent(in) :: room              !! frames that will come
    logical,             intent(in) :: yields            !! the points have a yield stress

    xdmf%path = path
    xdmf%data_file = data_path(index(data_path, '/', back=.true.) + 1:)
    xdmf%n = n
    allocate (xdmf%fields, source=fields)
    xdmf%yields = yields
    allocate (xdmf%times(room))
  end function new_xdmf

  !> Take note of the next frame; the file stays as it is.
  subroutine note(self, time)
    class(xdmf_t), intent(inout) :: self
    real(wp),      intent(in)    :: time   !! [s]

    self%frames = self%frames + 1
    self%times(self%frames) = time
  end subroutine note

  !> Write the whole file anew, beside its name, and put it in place.
  !>
  !> Errors: it cannot be written or put in place.
  subroutine write_xdmf(self, errors)
    class(xdmf_t),      intent(inout) :: self
    type(error_list_t), intent(inout) :: errors
    type(output_file_t) :: file
    character(:), allocatable :: text
    integer :: k, before

    before = errors%count()
    self%bytes = -1
    call open_output(file, self%path//'.tmp', .false., errors)
    call write_line(file, head(:len(head) - 1), errors)
    self%filled = len(head)
    text = self%grid_of(0, 0.0_wp)
    do k = 1, self%frames
      text = self%grid_of(k - 1, self%times(k))
      call write_line(file, text(:len(text) - 1), errors)
      self%filled = self%filled + len(text)
    end do
    call write_line(file, tail(:len(tail) - 1), errors)
    do k = self%frames + 1, size(self%times)
      call write_line(file, repeat(' ', len(text) - 1), errors)
    end do
    call publish_output(file, self%path, errors)
    if (errors%count() == before) self%bytes = size_of_file(self%path)
  end subroutine write_xdmf

  !> Add a frame in place. The file is written anew where it is not what was written.
  !>
  !> Errors: it cannot be written.
  subroutine add_frame(self, time, errors)
    class(xdmf_t),      intent(inout) :: self
    real(wp),           intent(in)    :: time   !! [s]
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: text

    call self%note(time)
    text = self%grid_of(self%frames - 1, time)
    if (size_of_file(self%path) == self%bytes &
      .and. self%filled + len(text) + len(tail) <= self%bytes) then
      call patch_file(self%path, self%filled, text//tail, errors)
      self%filled = self%filled + len(text)
    else
      call self%write(errors)
    end if
  end subroutine add_frame

  !> Give back the room that is left.
  !>
  !> Errors: the file cannot be written.
  subroutine finish(self, errors)
    class(xdmf_t),      intent(inout) :: self
    type(error_list_t), intent(inout) :: errors

    if (size_of_file(self%path) /= self%bytes) call self%write(errors)
    if (self%bytes >= 0) call cut_file(self%path, self%filled + len(tail), errors)
  end subroutine finish

  !> The grid of one frame.
  pure function grid_of(self, index_of_frame, at_time) result(text)
    class(xdmf_t), intent(in) :: self
    integer,       intent(in) :: index_of_frame   !! k of /frames/k, written with six digits
    real(wp),      intent(in) :: at_time          !! [s]
    character(:), allocatable :: text, source, n
    character(24) :: time
    character(6)  :: group
    integer :: i

    n = integer_text(self%n)
    write (time, '(es24.16e3)') at_time
    write (group, '(i6.6)') index_of_frame
    source = escaped(self%data_file)//':/points/'
    text = '<Grid Name="'//group//'" GridType="Uniform">'//nl &
      //'<Time Value="'//trim(adjustl(time))//'"/>'//nl &
      //'<Topology TopologyType="Polyvertex" NodesPerElement="1" NumberOfElements="'//n &
      //'">'//nl//whole_item(source//'number', n//' 1', 'Int', 4)//'</Topology>'//nl &
      //'<Geometry GeometryType="XY">'//nl &
      //whole_item(source//'position', n//' 2', 'Float', 8)//'</Geometry>'//nl &
      //attribute('volume', 'Scalar', whole_item(source//'volume', n, 'Float', 8)) &
      //attribute('boundary', 'Scalar', whole_item(source//'boundary', n, 'Int', 4))
    if (self%yields) text = text//attribute('yield_stress', 'Scalar', &
      whole_item(source//'yield_stress', n, 'Float', 8))
    source = escaped(self%data_file)//':/frames/'//group//'/'
    do i = 1, size(self%fields)
      text = text//field_text(source//trim(self%fields(i)%name), self%n, &
        self%fields(i))
    end do
    text = text//'</Grid>'//nl
  end function grid_of

  pure function field_text(source, n, field) result(text)
    character(*),  intent(in) :: source
    integer,       intent(in) :: n
    type(field_label_t), intent(in) :: field
    character(:), allocatable :: text, points
    integer :: c

    points = integer_text(n)
    if (field%width() == 1) then
      text = attribute(trim(field%name), 'Scalar', whole_item(source, points, 'Float', 8))
    else if (field%width() == 2) then
      text = attribute(trim(field%name), 'Vector', whole_item(source, points//' 2', 'Float', 8))
    else
      text = attribute(trim(field%name), 'Matrix', whole_item(source, &
        points//' 1 '//integer_text(field%width()), 'Float', 8))
      do c = 1, field%width()
        text = text//attribute(trim(field%name)//'_'//field%component(c), 'Scalar', &
          column_item(source, n, field%width(), c), 'component:')
      end do
    end if
  end function field_text

  pure function attribute(name, kind_of_field, item, name_space) result(text)
    character(*), intent(in) :: name, kind_of_field, item
    character(*), intent(in), optional :: name_space
    character(:), allocatable :: text, tag

    tag = 'Attribute'
    if (present(name_space)) tag = name_space//tag
    text = '<'//tag//' Name="'//name//'" AttributeType="'//kind_of_field//'" Center="Node">'//nl &
      //item//'</'//tag//'>'//nl
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
