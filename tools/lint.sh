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
  # No word where there is no -j; $make may be several.
  # shellcheck disable=SC2086
  $make --no-print-directory BUILD=lint PFUNIT_DIR= $parallel -k objects units
}

# Where there is MPI, the form of the ranks with messages is compiled too.
ranks_with_messages() {
  [ -z "$(sh tools/mpi_flags.sh link)" ] ||
    $make --no-print-directory BUILD=lint MPI=1 build/lint-mpi/pd_ranks.o
}

layers() {
  # One word for each layer.
  # shellcheck disable=SC2046
  sh tools/check_layers.sh --self-test &&
    sh tools/check_layers.sh src tests/unit $($make -s --no-print-directory layers)
}

limits() {
  $bin/python tools/check_limits.py --self-test && $bin/python tools/check_limits.py
}

# Text files of our own, one on each line.
text_files() {
  find . \( -name .git -o -name .venv -o -name build -o -name bin -o -name results -o \
    -name '*.egg-info' -o -name '.*_cache' -o -name shared \) -prune -o -type f \
    \( -name '*.f90' -o -name '*.in' -o -name '*.pf' -o -name '*.py' -o -name '*.sh' -o \
    -name '*.awk' -o -name '*.nml' -o -name '*.toml' -o -name '*.md' -o -name '*.cff' -o \
    -name '*.yaml' -o -name '*.html' -o -name '*.css' -o -name '*.js' -o -name .editorconfig -o \
    -name .codespellrc -o -name Makefile -o -path './.ci/run' \) -print
}

layout() {
  text_files | xargs sh tools/check_layout.sh
}

shell_scripts() {
  $bin/shellcheck --shell=sh tools/*.sh && $bin/shellcheck .ci/run
}

# Its settings are in .codespellrc.
spelling() {
  text_files | xargs $bin/codespell
}

echo "Lint"
stage "compiler warnings" compiler_warnings
stage "ranks with messages" ranks_with_messages
stage "fortitude" $bin/fortitude check --no-show-fixes src mpi tests
stage "layers" layers
stage "limits" limits
stage "layers of perigeo_post" $bin/python tools/check_python_layers.py
stage "layout of the text" layout
stage "spelling" spelling
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
