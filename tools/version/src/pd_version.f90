!> What this library was built from, where fpm has built it. The Makefile writes one of its own.
module pd_version
  use, intrinsic :: iso_fortran_env, only: compiler_options, compiler_version
  implicit none
  private

  character(*), parameter, public :: code_version = '0.1.0'
  character(*), parameter, public :: git_hash = 'unknown'
  character(*), parameter, public :: compiler_name = compiler_version()
  character(*), parameter, public :: build_flags = compiler_options()
end module pd_version
