# Print the flags that a program with HDF5's Fortran interface needs:
#
#   sh tools/hdf5_flags.sh compile|link COMPILER
#
# They come from HDF5's compiler wrapper: $H5FC, or h5fc, or h5pfc. The shared libraries are taken
# where there are any: the static ones would ask for the development files of all their own
# libraries. Prints nothing where there is no wrapper.
#
# Lists of flags are split into words on purpose.
# shellcheck disable=SC2086
what=$1
compiler=$2
for wrapper in ${H5FC:-h5fc h5pfc}; do
  command -v "$wrapper" >/dev/null 2>&1 && break
  wrapper=
done
[ -n "$wrapper" ] || exit 0

words=$("$wrapper" -shlib -show 2>/dev/null) || words=
case " $words " in
  *hdf5_fortran*) ;;
  *) words=$("$wrapper" -show 2>/dev/null) || exit 0 ;;
esac
# What stands before the first option is the compiler that built HDF5.
set -f
set -- $words

if [ "$what" = compile ]; then
  flags=
  for word; do
    case $word in
      -I*) case " $flags " in *" $word "*) ;; *) flags="$flags $word" ;; esac ;;
    esac
  done
  echo $flags
  exit 0
fi

# The folder that holds the shared library, in the order of the linker.
folder=
for word; do
  case $word in
    -L*) candidate=${word#-L} ;;
    *libhdf5_fortran.*) candidate=${word%/*} ;;
    *) continue ;;
  esac
  for ending in so dylib; do
    if [ -z "$folder" ] && [ -e "$candidate/libhdf5_fortran.$ending" ]; then folder=$candidate; fi
  done
done
if [ -z "$folder" ]; then
  for ending in so dylib; do
    found=$($compiler -print-file-name=libhdf5_fortran.$ending 2>/dev/null)
    case $found in /*) folder=${found%/*} ;; esac
  done
fi

if [ -n "$folder" ]; then
  case $folder in
    /usr/lib | /usr/lib64 | /lib | /lib64 | /usr/lib/*-linux-gnu*) rpath= ;;
    *) rpath=-Wl,-rpath,$folder ;;
  esac
  # The parallel build of the library needs MPI as well, which its wrapper adds by itself.
  mpi=
  for word; do
    case $word in -lmpi* | -lopen-*) mpi="$mpi $word" ;; esac
  done
  echo -L$folder $rpath -lhdf5_fortran -lhdf5 $mpi
else
  flags=
  for word; do
    case $word in
      -L* | -l* | -Wl,* | *.a | *.so | *.dylib) flags="$flags $word" ;;
    esac
  done
  echo $flags
fi
