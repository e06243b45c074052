# Print the module pd_version:  sh tools/version.sh COMPILER FLAGS
#
# The git hash is 'unknown' outside git, also in a source archive unpacked inside another
# repository, and ends in -dirty where a tracked file differs from the commit.
compiler=$1
flags=$2

hash=unknown
top=$(git rev-parse --show-toplevel 2>/dev/null)
if [ -n "$top" ] && [ "$(cd "$top" && pwd -P)" = "$(pwd -P)" ]; then
  hash=$(git rev-parse --short=12 HEAD 2>/dev/null) || hash=unknown
  if [ "$hash" != unknown ] && [ -n "$(git status --porcelain --untracked-files=no)" ]; then
    hash=$hash-dirty
  fi
fi
name=$($compiler --version 2>/dev/null | sed -n 1p)

# Quotes are doubled, and long texts go on in the next line, as Fortran wants them.
fortran_text() {
  printf '%s\n' "$1" | awk '{
    gsub(/\047/, "\047\047")
    while (length($0) > 60) {
      n = 60
      while (n > 1 && substr($0, n, 1) != " ") n--
      if (n == 1) n = 60
      printf "%s\047// \\&\\n    \047", substr($0, 1, n)
      $0 = substr($0, n + 1)
    }
    print
  }' | sed 's/[|]/\\|/g'
}

sed -e "s|@VERSION@|$(cat VERSION)|" -e "s|@GIT_HASH@|$hash|" \
  -e "s|@COMPILER@|$(fortran_text "$name")|" -e "s|@FLAGS@|$(fortran_text "$flags")|" \
  tools/version.f90.in
