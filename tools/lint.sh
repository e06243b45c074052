# Check the form of the sources:  sh tools/lint.sh MAKE [-jN]
#
# Every check runs, also after one that failed. The last line is the verdict.
make=${1:-make}
parallel=$2
bin=.venv/bin
passed=0
failed=
log=$(mktemp "${TMPDIR:-/tmp}/perigeo-lint.XXXXXX") || exit 1
trap 'rm -f "$log"' EXIT

# stage NAME COMMAND...: run a check; what it says is shown only where it fails.
stage() {
  name=$1
  shift
  if "$@" >"$log" 2>&1; then
    echo "  ok      $name"
    passed=$((passed + 1))
  else
    echo "  FAILED  $name"
    grep -v '^  compile  ' "$log" | sed -n '1,60s/^/    /p; 61s/.*/    .../p'
    failed="$failed, $name"
  fi
}

compiler_warnings() {
  $make --no-print-directory BUILD=lint PFUNIT_DIR= $parallel -k objects units
}

layers() {
  sh tools/check_layers.sh --self-test &&
    sh tools/check_layers.sh src $($make -s --no-print-directory layers)
}

# Text files of our own, one a line.
text_files() {
  find . \( -name .git -o -name .venv -o -name build -o -name bin -o -name results -o \
    -name '*.egg-info' -o -name '.*_cache' -o -name shared \) -prune -o -type f \
    \( -name '*.f90' -o -name '*.in' -o -name '*.pf' -o -name '*.py' -o -name '*.sh' -o \
    -name '*.awk' -o -name '*.nml' -o -name '*.toml' -o -name '*.md' -o -name '*.cff' -o \
    -name Makefile -o -path './.ci/run' \) -print
}

# In a suite an assert has to stand on one line, so that Fortran's own limit holds there; a link in
# a text may be as long as it is.
layout() {
  text_files | while read -r file; do
    awk -v tabs="$(case $file in */Makefile) echo 1 ;; esac)" '
      BEGIN { limit = ARGV[1] ~ /\.pf$/ ? 132 : 100 }
      length($0) > limit && FILENAME !~ /\.(md|cff)$/ {
        print FILENAME ":" FNR ": " length($0) " columns; at most " limit
        bad = 1
      }
      /[ \t\r]$/ { print FILENAME ":" FNR ": blanks at the end of the line"; bad = 1 }
      /\t/ && !tabs { print FILENAME ":" FNR ": a tab"; bad = 1 }
      END { exit bad }' "$file" || echo bad >> "$log.bad"
  done
  if [ -e "$log.bad" ]; then
    rm -f "$log.bad"
    return 1
  fi
}

shell_scripts() {
  for script in tools/*.sh .ci/run; do
    bash -n "$script" || return 1
  done
}

echo "Lint"
stage "compiler warnings" compiler_warnings
stage "fortitude" $bin/fortitude check --no-show-fixes src tests
stage "layers" layers
stage "layers of perigeo_post" $bin/python tools/check_python_layers.py
stage "layout of the text" layout
stage "shell scripts" shell_scripts
stage "ruff" $bin/ruff check .
# Only Python: ruff would also lay out the examples in texts.
stage "ruff format" $bin/ruff format --check --diff --extend-exclude '*.md' .
stage "mypy" sh -c "cd postproc && ../$bin/mypy perigeo_post"

if [ -n "$failed" ]; then
  echo "lint: failed:${failed#,}"
  exit 1
fi
echo "lint: all $passed checks passed"
