#!/bin/sh
# Find what perigeo needs and install what is missing:  sh tools/setup.sh [run|test|lint|site|mpi]
#
#   run   compiler, make, HDF5, Python with perigeo-post in .venv (the default)
#   test  also what the tests need          lint  also the linters
#   site  what makes the pages of `make site`
#   mpi   what `make MPI=1` needs, and no Python
#
# System packages are installed only where that takes no question: as root, or with a sudo that
# asks for no password (Homebrew and an active conda environment need neither). Elsewhere this
# stops with the command to type. NO_INSTALL=1 never installs anything. It may be run any number
# of times: what is there stays as it is.
level=${1:-run}
case $level in
  run | test | lint | site | mpi) ;;
  *) echo "usage: sh tools/setup.sh [run|test|lint|site|mpi]" >&2; exit 1 ;;
esac
cd "$(dirname "$0")/.." || exit 1
compiler=${FC:-gfortran}

# ------------------------------------------------------------------------- what is missing

has() { command -v "$1" >/dev/null 2>&1; }

# Compiling a small program is the one proof that compiler, library and modules fit together.
hdf5_works() {
  folder=$(mktemp -d "${TMPDIR:-/tmp}/perigeo-setup.XXXXXX") || return 1
  cat > "$folder/try.f90" <<'FORTRAN'
program try
  use hdf5, only: h5open_f
  implicit none
  integer :: status
  call h5open_f(status)
end program try
FORTRAN
  link=$(sh tools/hdf5_flags.sh link "$compiler")
  # The lists of flags are split on purpose.
  # shellcheck disable=SC2046,SC2086
  [ -n "$link" ] && $compiler $(sh tools/hdf5_flags.sh compile "$compiler") -J"$folder" \
    "$folder/try.f90" -o "$folder/try" $link >"$folder/log" 2>&1 && "$folder/try"
  works=$?
  rm -rf "$folder"
  return $works
}

mpi_works() {
  folder=$(mktemp -d "${TMPDIR:-/tmp}/perigeo-setup.XXXXXX") || return 1
  cat > "$folder/try.f90" <<'FORTRAN'
program try
  use mpi_f08, only: mpi_init, mpi_finalize
  implicit none
  call mpi_init()
  call mpi_finalize()
end program try
FORTRAN
  link=$(sh tools/mpi_flags.sh link)
  # The lists of flags are split on purpose.
  # shellcheck disable=SC2046,SC2086
  [ -n "$link" ] && has mpirun && $compiler $(sh tools/mpi_flags.sh compile) -J"$folder" \
    "$folder/try.f90" -o "$folder/try" $link >"$folder/log" 2>&1
  works=$?
  rm -rf "$folder"
  return $works
}

# Sets `missing` to a list of: compiler make hdf5 mpi python
find_missing() {
  missing=
  has make || missing="$missing make"
  if has "${compiler%% *}"; then
    hdf5_works || missing="$missing hdf5"
  else
    missing="$missing compiler"
    # Without a compiler only the wrapper can be looked for.
    if ! has "${H5FC:-h5fc}" && ! has h5pfc; then missing="$missing hdf5"; fi
  fi
  if [ "$level" = mpi ]; then
    mpi_works || missing="$missing mpi"
    return
  fi
  [ -n "$(sh tools/find_python.sh)" ] || missing="$missing python"
}

# ------------------------------------------------------------------------- who installs it

# Sets `system`: which package manager to use.
find_system() {
  system=unknown
  if [ -n "${CONDA_PREFIX:-}" ] && has conda && [ "$(id -u)" != 0 ]; then
    system=conda
  elif [ "$(uname -s)" = Darwin ]; then
    system=brew
  else
    for manager in apt-get dnf pacman; do
      if has $manager; then
        system=$manager
        break
      fi
    done
  fi
}

# The package names of what is missing, one case for each manager.
package() {
  case $system:$1 in
    apt-get:compiler) echo gfortran libc6-dev ;;
    apt-get:hdf5) echo libhdf5-dev ;;
    apt-get:mpi) echo libopenmpi-dev openmpi-bin ;;
    apt-get:python) echo python3 python3-venv ;;
    dnf:compiler) echo gcc-gfortran ;;
    dnf:hdf5) echo hdf5-devel ;;
    dnf:mpi) echo openmpi-devel ;;
    dnf:python) echo python3 python3-pip ;;
    pacman:compiler) echo gcc-fortran ;;
    pacman:hdf5) echo hdf5 ;;
    pacman:mpi) echo openmpi ;;
    pacman:python) echo python ;;
    brew:compiler) echo gcc ;;
    brew:hdf5) echo hdf5 ;;
    brew:mpi) echo open-mpi ;;
    brew:python) echo python ;;
    conda:compiler) echo gfortran ;;
    conda:hdf5) echo hdf5 ;;
    conda:mpi) echo openmpi ;;
    conda:python) echo python ;;
    *:make) echo make ;;
  esac
}

# Prints the commands that install the packages named, one a line, without sudo.
install_commands() {
  case $system in
    apt-get)
      echo "apt-get update -qq"
      echo "env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $*"
      ;;
    dnf) echo "dnf install -y -q $*" ;;
    # A refreshed list with old packages breaks a system, so pacman upgrades with it.
    pacman) echo "pacman -Syu --needed --noconfirm $*" ;;
    brew) echo "brew install --quiet $*" ;;
    conda) echo "conda install -y -q -c conda-forge $*" ;;
  esac
}

# Sets `prefix` to what goes before a command; leaves with 1 where a password would be asked for.
find_rights() {
  prefix=
  case $system in
    brew) has brew; return ;;
    # The base environment holds conda itself: that one is the user's own business.
    conda) [ "${CONDA_DEFAULT_ENV:-base}" != base ]; return ;;
  esac
  [ "$(id -u)" = 0 ] && return
  prefix="sudo -n "
  has sudo && sudo -n true 2>/dev/null
}

# What needs no rights of root comes first; on clusters there are modules.
show_without_root() {
  echo "  conda create -n perigeo -c conda-forge gfortran hdf5 make python"
  echo "  conda activate perigeo"
  echo "or, on a cluster, modules with the same in them (module avail), such as"
  echo "  module load gcc hdf5 python"
  echo "or, as root:"
}

show_by_hand() {
  echo "To install it, type:"
  case $system in
    unknown)
      echo "  (the command of your system for: gfortran, make, HDF5 with its Fortran interface,"
      echo "  python3 3.9 or later with venv)"
      ;;
    conda | brew)
      if [ $system = brew ] && ! has brew; then
        echo "  (first Homebrew itself, as its own pages say)"
      fi
      if [ "$system:${CONDA_DEFAULT_ENV:-base}" = conda:base ]; then
        echo "  conda create -n perigeo -c conda-forge gfortran hdf5 make python"
        echo "  conda activate perigeo"
      else
        install_commands "$packages" | sed 's/^/  /'
      fi
      ;;
    *)
      if [ "$(id -u)" = 0 ]; then as_root=; else as_root="sudo "; fi
      [ "$(id -u)" = 0 ] || show_without_root
      install_commands "$packages" | sed -e 's/^env [^ ]* //' -e 's/ -qq*//' -e "s/^/  $as_root/"
      ;;
  esac
}

# ------------------------------------------------------------------------- the work itself

find_missing
for attempt in first second; do
  [ -n "$missing" ] || break
  echo "Missing:$missing"
  find_system
  packages=
  for item in $missing; do packages="$packages $(package "$item")"; done
  packages=${packages# }

  if [ "${NO_INSTALL:-0}" = 1 ]; then
    echo "NO_INSTALL=1 forbids installing."
    show_by_hand
    exit 1
  fi
  if [ $system = unknown ] || ! find_rights; then
    echo "This cannot be installed from here without asking you."
    show_by_hand
    exit 1
  fi

  echo "Installing with ${system%-get}: $packages"
  log=$(mktemp "${TMPDIR:-/tmp}/perigeo-setup.XXXXXX") || exit 1
  install_commands "$packages" > "$log.commands"
  while read -r command; do
    echo "  $prefix$command"
    # An update may fail for one foreign source and yet serve: what counts is the result below.
    # shellcheck disable=SC2086   # words of a command
    $prefix$command </dev/null >>"$log" 2>&1 || true
  done < "$log.commands"
  hash -r

  # Without a compiler HDF5 could not be tried, so that it may turn out only now that it is missing.
  before=$missing
  find_missing
  if [ "$missing" = "$before" ] || { [ -n "$missing" ] && [ $attempt = second ]; }; then
    tail -n 20 "$log"
    rm -f "$log" "$log.commands"
    echo "Still missing after the installation:$missing"
    case $missing in
      *hdf5*)
        echo "If the h5fc of another HDF5 comes first in PATH, name the right one:"
        echo "  H5FC=/usr/bin/h5fc"
        ;;
    esac
    show_by_hand
    exit 1
  fi
  rm -f "$log" "$log.commands"
done

[ "$level" = mpi ] || sh tools/python_env.sh "$level" || exit 1
