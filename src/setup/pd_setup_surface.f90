!> The surface that pressures act on: edges of the bodies, and the part of N_i that belongs to each.
!>
!> Source: doc/theory.md, section 7.
module pd_setup_surface
  use pd_edge_weights, only: find_edge_weights
  use pd_edges, only: bare_edges, edge_t, material_t, outline_edges, rim_edges
  use pd_input_shapes, only: is_bearing, outline
  use pd_input_types, only: boundary_input_t, input_t
  use pd_kinds, only: wp
  use pd_model, only: model_t
  use pd_polygons, only: inside
  use pd_pressure, only: surface_t, surface_vectors
  use pd_stages, only: stage_t
  implicit none
  private

  public :: find_surface, edges_of, taken

  type :: polygon_t
    real(wp), allocatable :: vertices(:, :)   !! (2,n) [m]
    logical :: solid = .true.                 !! else a hole
  end type polygon_t

  !> The bodies of a stage; the last one that holds a place decides.
  type, extends(material_t) :: bodies_t
    type(polygon_t), allocatable :: list(:)
  contains
    procedure :: holds
  end type bodies_t

contains

  !> The edges of body and layers, and what belongs to each. Bodies that are all rectangles have
  !> those of their outline, unless a pressure names a body.
  subroutine find_surface(input, stage, model, surface)
    type(input_t),   intent(in)    :: input
    type(stage_t),   intent(in)    :: stage
    type(model_t),   intent(inout) :: model
    type(surface_t), intent(out)   :: surface
    type(edge_t), allocatable :: edges(:)
    real(wp),     allocatable :: vectors(:, :)   ! N in the rows of fields (n,2) [m]
    integer :: i

    allocate (vectors(model%operators%n, 2), source=0.0_wp)
    call surface_vectors(model%operators, model%points%volume, vectors)
    associate (body => model%body)
      surface%spacing = model%spacing
      surface%delta = model%delta
      surface%position = body%position
      surface%in_body = body%boundary == 0
      allocate (surface%free(body%n, 2), source=.true.)
      do i = 1, body%n
        if (body%boundary(i) == 0) cycle
        associate (b => input%boundaries(body%boundary(i)))
          surface%free(i, :) = .not. (taken(b) .or. is_bearing(b))
        end associate
      end do
      if (all_rectangles(input) .and. .not. any_names_body(input)) then
        call outline_edges(body, model%spacing, edges)
      else
        call find_bare_edges(input, stage, model, edges)
      end if
      ! N_i is felt where families touch cut ones
      call find_edge_weights(edges, body%position, vectors(model%operators%storage%row(), :), &
        surface%free, 2.0_wp * model%delta + model%spacing, model%spacing, surface%weights)
    end associate
  end subroutine find_surface

  !> What of the edges of the bodies is surface.
  subroutine find_bare_edges(input, stage, model, edges)
    type(input_t), intent(in) :: input
    type(stage_t), intent(in) :: stage
    type(model_t), intent(in) :: model
    type(edge_t), allocatable, intent(out) :: edges(:)
    type(edge_t), allocatable :: given(:)
    type(bodies_t)  :: bodies
    type(polygon_t) :: polygon   ! gfortran loses the parts of a result in a constructor
    integer :: k

    allocate (given(0), bodies%list(0))
    do k = 1, size(input%bodies)
      polygon%vertices = outline(input%bodies(k), model%spacing)
      polygon%solid = input%bodies(k)%role /= 'hole'
      if (stage%has_body(k)) bodies%list = [bodies%list, polygon]
      given = [given, rim_edges(outline(input%bodies(k), model%spacing), &
        input%bodies(k)%role == 'hole')]
    end do
    call bare_edges(given, bodies, model%body, model%spacing, edges)
  end subroutine find_bare_edges

  !> Whether the last body that holds x is solid.
  pure logical function holds(self, x)
    class(bodies_t), intent(in) :: self
    real(wp),        intent(in) :: x(2)   !! [m]
    integer :: k

    holds = .false.
    do k = size(self%list), 1, -1
      if (.not. inside(self%list(k)%vertices, x)) cycle
      holds = self%list(k)%solid
      return
    end do
  end function holds

  !> Which edges of a surface are those of a body, or one of them.
  pure function edges_of(input, spacing, body, edge, numbers) result(chosen)
    type(input_t), intent(in) :: input
    real(wp),      intent(in) :: spacing      !! dx [m]
    integer,       intent(in) :: body         !! number of the body
    integer,       intent(in) :: edge         !! of its edge; 0: all
    integer,       intent(in) :: numbers(:)   !! of the edges
    logical :: chosen(size(numbers))
    integer :: before, k

    before = 0
    do k = 1, body - 1
      before = before + size(outline(input%bodies(k), spacing), 2)
    end do
    if (edge > 0) then
      chosen = numbers == before + edge
    else
      chosen = numbers > before .and. numbers <= before &
        + size(outline(input%bodies(body), spacing), 2)
    end if
  end function edges_of

  !> Whether a pressure acts on edges of a body.
  pure logical function any_names_body(input)
    type(input_t), intent(in) :: input
    integer :: k

    any_names_body = .false.
    do k = 1, size(input%pressures)
      any_names_body = any_names_body .or. input%pressures(k)%body /= ''
    end do
  end function any_names_body

  !> Whether all bodies are rectangles.
  pure logical function all_rectangles(input)
    type(input_t), intent(in) :: input
    integer :: k

    all_rectangles = .true.
    do k = 1, size(input%bodies)
      all_rectangles = all_rectangles .and. input%bodies(k)%shape == 'rectangle'
    end do
  end function all_rectangles

  !> The components in which a boundary transfers forces; in the others the body slides.
  pure function taken(boundary)
    type(boundary_input_t), intent(in) :: boundary
    logical :: taken(2)

    taken = .true.
    if (boundary%contact == 'smooth') taken = [1, 2] == boundary%axis
  end function taken

end module pd_setup_surface
