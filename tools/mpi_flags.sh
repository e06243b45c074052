# Print the flags that a program with MPI's Fortran interface needs:
#
#   sh tools/mpi_flags.sh compile|link
#
# They come from MPI's compiler wrapper: $MPIFC, or mpifort. What pkg-config says of Open MPI lacks
# the folder of mpi_f08.mod. Prints nothing where there is no wrapper.
what=$1
wrapper=${MPIFC:-mpifort}
command -v "$wrapper" >/dev/null 2>&1 || exit 0
words=$("$wrapper" --showme:"$what" 2>/dev/null) || words=$("$wrapper" -show 2>/dev/null) || exit 0
# Lists of flags are split into words on purpose.
set -f
# shellcheck disable=SC2086
set -- $words
flags=
for word; do
  case $what:$word in
    compile:-I*) flags="$flags $word" ;;
    link:-L* | link:-l* | link:-Wl,*) flags="$flags $word" ;;
  esac
done
echo "${flags# }"
