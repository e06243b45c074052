# Check that the folders of src/ are layers, and that tests/unit mirrors them:
#
#   sh tools/check_layers.sh SRC UNIT LAYER...    the layers in order, the lowest first
#   sh tools/check_layers.sh --self-test          does it find every fault it is there to find?
#
# - A module uses only modules of its own folder and of the folders before it; within a folder the
#   uses form no circle.
# - Every folder of SRC is in the list and every entry of the list has a folder. Every file stands
#   in one of these folders and holds one module (or program) of the same name.
# - The suite of a module is UNIT/its layer/test_<module>.pf.
# - Voids and shares, which belong to the form of the operators, are mentioned nowhere else.
generated=pd_version

# Who may mention voids and shares: folders (with a slash) and files, relative to SRC.
may_know_voids="operators/"

check() {
  src=$1
  unit=$2
  shift 2
  # Every folder and source file, in the order of their names.
  folders=$(cd "$src" && find . -type d | sed -e 's|^\./||' -e '/^\.$/d' | sort)
  sources=$(find "$src" -name '*.f90' | sort)
  if [ -z "$sources" ]; then
    echo "$src: no sources"
    return 1
  fi
  suites=$(cd "$unit" && find . -type f | sed 's|^\./||' | sort)
  # The names of files are names of modules, without blanks; awk takes no text of several lines.
  # shellcheck disable=SC2086
  awk -v src="$src" -v unit="$unit" -v list="$*" -v folders="$(printf '%s ' $folders)" \
    -v suites="$(printf '%s ' $suites)" -v generated="$generated" -v may_know="$may_know_voids" '
    BEGIN {
      count = split(list, names, " ")
      for (i = 1; i <= count; i++) layer[names[i]] = i
      check_folders()
      for (i = 1; i < ARGC; i++) enter(ARGV[i])
      check_suites()
    }

    FNR == 1 { user = stem(FILENAME); defined = 0 }
    { line = tolower($0) }
    # Here the comment counts too: whoever has to mention voids has to know them.
    !allowed(FILENAME) && knows_voids(line) {
      complain(FILENAME ":" FNR, "voids and shares are the business of: " may_know)
    }
    { sub(/!.*/, "", line) }

    line ~ /^[ \t]*(module|program)[ \t]+[a-z0-9_]+[ \t]*$/ {
      split(line, word, " ")
      if (word[2] == "procedure") next
      if (defined++)
        complain(FILENAME ":" FNR, "holds " word[2] " as well; one module in a file")
      else if (word[2] != user)
        complain(FILENAME ":" FNR, "holds " word[2] "; file and module must have one name")
    }

    line ~ /^[ \t]*use[ \t,:]/ && line !~ /^[ \t]*use[ \t]*,[ \t]*intrinsic/ {
      sub(/^[ \t]*use[ \t]*(,[^:]*)?(::)?[ \t]*/, "", line)
      match(line, /^[a-z0-9_]*/)
      used = substr(line, 1, RLENGTH)
      if (used == generated) next
      if (!(used in home)) {
        if (used ~ /^pd_/) complain(FILENAME ":" FNR, "uses " used ", which has no file in " src)
      } else if (home[used] == home[user]) {
        if (!((user, used) in edge)) uses[user] = uses[user] " " used
        edge[user, used] = FILENAME ":" FNR
      } else if (layer[home[used]] > layer[home[user]])
        complain(FILENAME ":" FNR, user " (" home[user] ") uses " used " (" home[used] \
          "), which is not in a layer below it")
    }

    END {
      for (i = 1; i <= n_modules; i++) visit(modules[i])
      exit bad
    }

    function check_folders(    all, n, i, there) {
      n = split(folders, all, " ")
      for (i = 1; i <= n; i++) {
        there[all[i]] = 1
        if (!(all[i] in layer))
          complain(src "/" all[i], "not in the list of layers in the Makefile")
      }
      for (i = 1; i <= count; i++)
        if (!(names[i] in there))
          complain(src, "no folder for the layer " names[i] " of the list in the Makefile")
    }

    # Enter a source file as the home of its module.
    function enter(path,    name, folder) {
      name = stem(path)
      folder = substr(path, length(src) + 2)
      if (!sub(/\/[^\/]*$/, "", folder)) {
        complain(path, "stands in no layer")
        folder = ""
      }
      if (name in home) complain(path, "there is a file of this name in " home[name] " too")
      home[name] = folder
      modules[++n_modules] = name
    }

    function check_suites(    all, n, i, part, name) {
      n = split(suites, all, " ")
      for (i = 1; i <= n; i++) {
        # Files next to the folders hold what suites share.
        if (split(all[i], part, "/") == 1 && all[i] ~ /\.f90$/) continue
        name = part[2]
        if (part[1] == all[i] || !(part[1] in layer) || !sub(/^test_/, "", name) || \
            !sub(/\.pf$/, "", name) || name ~ /\//)
          complain(unit "/" all[i], "not a suite LAYER/test_<module>.pf; it is not built")
        else if (!(name in home))
          complain(unit "/" all[i], "there is no module " name)
        else if (home[name] != part[1])
          complain(unit "/" all[i], "its module is in the layer " home[name])
      }
    }

    # Follow the uses within a folder; a module met again on its own path closes a circle.
    function visit(name,    next_ones, n, i) {
      if (state[name] == "done") return
      state[name] = "open"
      path[++depth] = name
      n = split(uses[name], next_ones, " ")
      for (i = 1; i <= n; i++) {
        if (state[next_ones[i]] == "open")
          complain(edge[name, next_ones[i]], "uses in a circle: " circle(next_ones[i]))
        else
          visit(next_ones[i])
      }
      depth--
      state[name] = "done"
    }

    function circle(first,    i, text) {
      for (i = depth; path[i] != first; i--) text = path[i] " " text
      return first " " text first
    }

    function knows_voids(text) {
      return text ~ /(^|[^a-z0-9_])voids?([^a-z0-9_]|$)/ || \
        text ~ /%[ ]*(share_of|weighs|weighed|weigh_in|weigh_block)([^a-z0-9_]|$)/
    }

    function allowed(path,    all, n, i, place) {
      place = substr(path, length(src) + 2)
      n = split(may_know, all, " ")
      for (i = 1; i <= n; i++)
        if (place == all[i] || (all[i] ~ /\/$/ && index(place, all[i]) == 1)) return 1
      return 0
    }

    function stem(path) { sub(/.*\//, "", path); sub(/\.f90$/, "", path); return path }
    function complain(place, text) { print place ": " text; bad = 1 }
  ' $sources
}

self_test() {
  folder=$(mktemp -d "${TMPDIR:-/tmp}/perigeo-layers.XXXXXX") || exit 1
  trap 'rm -rf "$folder"' EXIT
  src=$folder/src
  unit=$folder/unit

  # write FILE [LINE [MODULE]]: a module that holds this line.
  write() {
    name=${1##*/}
    name=${3:-${name%.f90}}
    printf '%s\n' "module $name" "  ${2:-implicit none}" "end module $name" > "$src/$1"
  }
  # Sound sources: three layers, uses within a folder and downwards, a suite, what suites share.
  sound() {
    rm -rf "$src" "$unit"
    mkdir -p "$src/low" "$src/operators" "$src/high" "$unit/low"
    write low/pd_a.f90 'use, intrinsic :: iso_c_binding, only: c_int'
    write low/pd_b.f90 'use pd_a, only: x'
    write operators/pd_c.f90 'use pd_version, only: code_version   ! voids are known here'
    write high/pd_d.f90 'call model%operators%share()   ! avoids nothing'
    : > "$unit/low/test_pd_a.pf"
    : > "$unit/samples.f90"
  }
  # expect clean|wrong TEXT WHAT [LAYER...]: what the check must say of the sources as they are.
  expect() {
    wanted=$1
    text=$2
    what=$3
    shift 3
    [ $# != 0 ] || set -- low operators high
    found=clean
    ( check "$src" "$unit" "$@" ) > "$folder/said" 2>&1 || found=wrong
    if [ $found != "$wanted" ] || { [ -n "$text" ] && ! grep -q "$text" "$folder/said"; }; then
      echo "the layer check is broken: $what: expected $wanted, found $found" >&2
      cat "$folder/said" >&2
      exit 1
    fi
  }

  sound
  expect clean '' 'sound sources'

  write low/pd_a.f90 'use pd_d, only: x'
  expect wrong 'pd_a (low) uses pd_d (high)' 'an upward use'
  write low/pd_a.f90 'USE :: PD_D'
  expect wrong 'pd_a (low) uses pd_d (high)' 'an upward use in another spelling'
  write low/pd_a.f90 'use pd_nowhere, only: x'
  expect wrong 'uses pd_nowhere' 'an unknown module'
  write low/pd_a.f90 'use pd_b, only: x'
  expect wrong 'uses in a circle: pd_a pd_b pd_a' 'a circle within a folder'
  write low/pd_a.f90 'use pd_a, only: x'
  expect wrong 'uses in a circle: pd_a pd_a' 'a module that uses itself'

  sound
  write low/pd_a.f90 '' pd_other
  expect wrong 'holds pd_other;' 'a file that is not named after its module'
  sound
  printf '%s\n' 'module pd_e' 'end module pd_e' >> "$src/low/pd_a.f90"
  expect wrong 'holds pd_e as well' 'two modules in a file'
  sound
  write high/pd_a.f90
  expect wrong 'low/pd_a.f90: there is a file of this name' 'two files of one name'
  sound
  write pd_e.f90
  expect wrong 'src/pd_e.f90: stands in no layer' 'a file outside the folders'
  sound
  expect wrong 'src/high: not in the list' 'a folder that is not in the list' low operators
  expect wrong 'no folder for the layer top' 'a layer without a folder' low operators high top
  mkdir "$src/low/deep"
  write low/deep/pd_e.f90
  expect wrong 'src/low/deep: not in the list' 'a folder within a layer'

  sound
  mkdir "$unit/high"
  mv "$unit/low/test_pd_a.pf" "$unit/high"
  expect wrong 'test_pd_a.pf: its module is in the layer low' 'a suite in another folder'
  sound
  : > "$unit/low/test_pd_e.pf"
  expect wrong 'there is no module pd_e' 'a suite of no module'
  sound
  : > "$unit/test_pd_a.pf"
  expect wrong 'unit/test_pd_a.pf: not a suite' 'a suite outside the folders'
  sound
  : > "$unit/low/pd_a.pf"
  expect wrong 'unit/low/pd_a.pf: not a suite' 'a suite without its name'

  rm -rf "$src"
  mkdir "$src"
  expect wrong 'no sources' 'an empty folder'

  sound
  for line in 'x = 0   ! Voids stay zero' 'if (owner == void) cycle' \
    'x = model%operators%share_of(i)' 'call operators%weigh_block(1, n, a)' \
    'if (operators%weighs) return'; do
    write high/pd_d.f90 "$line"
    expect wrong 'high/pd_d.f90:2: voids and shares' "what only operators may know: $line"
  done
}

if [ "$1" = --self-test ]; then self_test; else check "$@"; fi
