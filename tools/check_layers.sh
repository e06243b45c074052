# Check that a module uses only modules that stand before it in the list of the Makefile:
#
#   sh tools/check_layers.sh FOLDER MODULE...     the modules in the order of the layers
#   sh tools/check_layers.sh --self-test          does it find what it is there to find?
#
# Also: every file holds the module (or program) it is named after, every file is in the list, and
# every module of the list has a file.
generated=pd_version

check() {
  folder=$1
  shift
  awk -v list="$*" -v generated="$generated" -v folder="$folder" '
    BEGIN {
      count = split(list, names, " ")
      for (i = 1; i <= count; i++) layer[names[i]] = i
      for (i = 1; i < ARGC; i++) there[stem(ARGV[i])] = 1
      for (i = 1; i <= count; i++)
        if (!(names[i] in there) && names[i] != generated)
          complain(folder, "no file for the module " names[i] " of the list in the Makefile")
      for (name in there)
        if (!(name in layer))
          complain(folder "/" name ".f90", "not in the list of modules in the Makefile")
    }

    FNR == 1 { defined = 0 }
    { line = tolower($0); sub(/!.*/, "", line) }

    line ~ /^[ \t]*(module|program)[ \t]+[a-z0-9_]+[ \t]*$/ {
      split(line, word, " ")
      if (word[2] == "procedure") next
      if (!defined++ && word[2] != stem(FILENAME))
        complain(FILENAME ":" FNR, "holds " word[2] "; file and module must have one name")
    }

    line ~ /^[ \t]*use[ \t,:]/ && line !~ /^[ \t]*use[ \t]*,[ \t]*intrinsic/ {
      sub(/^[ \t]*use[ \t]*(,[^:]*)?(::)?[ \t]*/, "", line)
      match(line, /^[a-z0-9_]*/)
      used = substr(line, 1, RLENGTH)
      user = stem(FILENAME)
      if (used ~ /^pd_/ && !(used in layer))
        complain(FILENAME ":" FNR, "uses " used ", which is not in the list of modules")
      else if (used in layer && user in layer && layer[used] >= layer[user])
        complain(FILENAME ":" FNR, user " uses " used ", which is not in a layer above it")
    }

    function stem(path) { sub(/.*\//, "", path); sub(/\.f90$/, "", path); return path }
    function complain(place, text) { print place ": " text; bad = 1 }
    END { exit bad }
  ' "$folder"/*.f90
}

self_test() {
  folder=$(mktemp -d "${TMPDIR:-/tmp}/perigeo-layers.XXXXXX") || exit 1
  trap 'rm -rf "$folder"' EXIT
  write() { printf '%s\n' "module $2" "  ${3:-implicit none}" "end module $2" > "$folder/$1.f90"; }
  expect() {
    found=clean
    check "$folder" pd_a pd_b pd_version pd_c > "$folder/said" || found=wrong
    if [ $found != "$1" ] ||
        { [ -n "$2" ] && ! grep -q "$2" "$folder/said"; }; then
      echo "the layer check is broken: $3: expected $1, found $found" >&2
      cat "$folder/said" >&2
      exit 1
    fi
  }
  write pd_a pd_a 'use, intrinsic :: iso_c_binding, only: c_int'
  write pd_b pd_b 'use pd_a, only: x'
  write pd_c pd_c 'use pd_version, only: code_version'
  expect clean '' 'sound modules'
  write pd_a pd_a 'use pd_b, only: x'
  expect wrong 'pd_a uses pd_b' 'an upward use'
  write pd_a pd_a 'USE :: PD_C'
  expect wrong 'pd_a uses pd_c' 'an upward use in another spelling'
  write pd_a pd_a 'use pd_nowhere, only: x'
  expect wrong 'uses pd_nowhere' 'an unknown module'
  write pd_a pd_other
  expect wrong 'holds pd_other' 'a file that is not named after its module'
  write pd_a pd_a
  write pd_d pd_d
  expect wrong 'pd_d.f90: not in the list' 'a file that is not in the list'
  rm "$folder/pd_d.f90" "$folder/pd_b.f90"
  expect wrong 'no file for the module pd_b' 'a module without a file'
}

if [ "$1" = --self-test ]; then self_test; else check "$@"; fi
