# Build the program with other compilers:  sh tests/proof/compilers.sh MAKE
#
# Every gfortran that is installed builds all modules, with warnings as errors, and a program; where
# its module files fit the HDF5 library it is linked and runs --check. flang compiles every module
# whose modules are there: those that need HDF5 wait for a library of its own. To have them:
#   apt-get install gfortran-11 gfortran-12 flang-19
make=${1:-make}
log=$(mktemp "${TMPDIR:-/tmp}/perigeo-compilers.XXXXXX") || exit 1
trap 'rm -f "$log"' EXIT
passed=0
failed=0

verdict() {
  if [ "$1" = 0 ]; then
    passed=$((passed + 1))
    echo "  ok      $2"
  else
    failed=$((failed + 1))
    echo "  FAILED  $2"
    grep -iE 'error|fatal' "$log" | head -n 5 | sed 's/^/            /'
  fi
}

for compiler in gfortran-11 gfortran-12 gfortran-13 gfortran-14 gfortran-15; do
  command -v $compiler >/dev/null 2>&1 || continue
  folder=build/compilers/$compiler
  # One word for each flag of make.
  # shellcheck disable=SC2086
  $make --no-print-directory -k FC=$compiler MARCH= FFLAGS=-O1 build="$folder" \
    program="$folder/perigeo" program >"$log" 2>&1 &&
    "$folder/perigeo" --check input/compression_quick.nml >>"$log" 2>&1
  verdict $? "$compiler builds the program, which passes --check"
done

# In the order of their needs: what cannot be compiled yet is tried again after the others.
for compiler in flang-new-19 flang-new-16 flang-new flang-19 flang; do
  command -v $compiler >/dev/null 2>&1 || continue
  folder=build/compilers/$compiler
  rm -rf "$folder"
  mkdir -p "$folder"
  left=$(find src -name '*.f90' | sort)
  all=$(echo "$left" | wc -l)
  : >"$log"
  progress=yes
  while [ -n "$progress" ]; do
    progress=
    still=
    for source in $left; do
      if $compiler -c -O1 -fopenmp -module-dir "$folder" -I"$folder" "$source" \
        -o "$folder/$(basename "$source" .f90).o" >"$folder/last" 2>&1; then
        progress=yes
      else
        still="$still $source"
        cp "$folder/last" "$folder/$(basename "$source" .f90).log"
      fi
    done
    left=$still
  done
  # Those left must be HDF5's, or wait for one of these.
  wrong=
  number=0
  for source in $left; do
    number=$((number + 1))
    said=$folder/$(basename "$source" .f90).log
    grep -q 'Cannot \(read\|parse\) module file\|Cannot find module' "$said" && continue
    grep -qi 'error' "$said" || continue
    wrong="$wrong $source"
    cat "$said" >>"$log"
  done
  [ -z "$wrong" ]
  verdict $? "$compiler compiles $((all - number)) of $all modules; the others need HDF5"
  break
done

echo "$passed passed, $failed failed"
[ $failed = 0 ] && [ $passed != 0 ]
