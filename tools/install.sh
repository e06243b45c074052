#!/bin/sh
# Install perigeo, or take it away again:  sh tools/install.sh install|uninstall PROGRAM
#
# PREFIX is where it goes (/usr/local), DESTDIR what stands before it while a package is made.
# Program, inputs, studies, documents and licence are copied, manual pages and completions made from
# --help. perigeo-post is copied too, with a command that calls the Python that has what it needs:
# PYTHON where it is given, else python3, else a virtual environment in PREFIX/lib/perigeo, which
# takes a network. POST=0 leaves perigeo-post out; so does what cannot be had, with a word.
#
# Everything that is written stands in PREFIX/share/perigeo/installed; uninstall takes just that.
set -u
cd "$(dirname "$0")/.." || exit 1
prefix=${PREFIX:-/usr/local}
case $prefix in
  /*) ;;
  *) prefix=$(pwd)/$prefix ;;
esac
root=${DESTDIR:-}$prefix
share=$root/share/perigeo
list=$share/installed
needs='numpy, h5py, matplotlib, PIL, pydantic, simpleeval, jinja2'

fail() { echo "install: $*" >&2; exit 1; }

# What is gone already is no error; folders go where they are empty. The list itself comes last.
uninstall() {
  [ -f "$list" ] || { echo "there is no perigeo in $root"; return; }
  [ -w "$share" ] || fail "$share cannot be written"
  cp "$list" "$work/before" || exit 1
  while read -r name; do
    case $name in
      '' | /* | *..*) ;;
      lib/perigeo/venv) rm -rf "${root:?}/lib/perigeo/venv" ;;
      *) echo "$name" ;;
    esac
  done < "$work/before" > "$work/files"
  (cd "$root" && tr '\n' '\0' < "$work/files" | xargs -0 rm -f)
  # The folders, the deepest first.
  sed -n 's|/[^/]*$||p' "$work/before" | awk '{ while ($0 != "") { if (!seen[$0]++) print length, $0
    if (!sub("/[^/]*$", "")) $0 = "" } }' | sort -rn | cut -d' ' -f2- > "$work/folders"
  while read -r folder; do
    case $folder in lib/perigeo/*) rm -rf "${root:?}/$folder/__pycache__" ;; esac
    rmdir "$root/$folder" 2>/dev/null
  done < "$work/folders"
  echo "perigeo is gone from $root"
}

# put MODE FILE NAME: one file, into the list too.
put() {
  mkdir -p "$root/$(dirname "$3")" || fail "$root cannot be written"
  cp "$2" "$root/$3" || fail "$root/$3 cannot be written"
  chmod "$1" "$root/$3"
  echo "$3" >> "$work/list"
}

# put_all FROM PLACE: the files that are named on standard input, from one folder to another.
put_all() {
  cat > "$work/names"
  mkdir -p "$root/$2" || fail "$root cannot be written"
  (cd "$1" && tar cf - -T "$work/names") | (cd "$root/$2" && tar xof - && tr '\n' '\0' \
    < "$work/names" | xargs -0 chmod 644) || fail "$root/$2 cannot be written"
  sed "s|^|$2/|" "$work/names" >> "$work/list"
}

# Sets `python` to what has all that perigeo-post needs; leaves with 1 where there is none.
find_python() {
  for python in "${PYTHON:-}" python3; do
    [ -n "$python" ] || continue
    python=$(command -v "$python") || continue
    "$python" -c "import $needs" 2>/dev/null && return
    [ -z "${PYTHON:-}" ] || { echo "$python lacks some of: $needs"; return 1; }
  done
  if [ -n "${DESTDIR:-}" ] || [ "${NO_INSTALL:-0}" = 1 ]; then return 1; fi
  base=$(sh tools/find_python.sh)
  [ -n "$base" ] || return 1
  echo "Python: making $prefix/lib/perigeo/venv"
  mkdir -p "$root/lib/perigeo" && "$base" -m venv "$root/lib/perigeo/venv" || return 1
  echo lib/perigeo/venv >> "$work/list"
  python=$prefix/lib/perigeo/venv/bin/python
  # The package brings its needs; what is called is the copy beside it.
  cp -R postproc "$work/source" &&
    "$python" -m pip install --quiet --disable-pip-version-check "$work/source[study,report]" &&
    "$python" -m pip uninstall --quiet --yes perigeo-post
}

install_post() {
  if ! find_python; then
    echo "perigeo-post is not installed. Elsewhere:  pip install './postproc[study,report]'"
    return
  fi
  (cd postproc && find perigeo_post -type f ! -name '*.pyc' | sort) | \
    put_all postproc lib/perigeo/python
  sed -e "s|@PYTHON@|$python|" -e "s|@FOLDER@|$prefix/lib/perigeo/python|" \
    tools/perigeo-post.in > "$work/perigeo-post"
  put 755 "$work/perigeo-post" bin/perigeo-post
  PYTHONPATH=postproc PYTHONDONTWRITEBYTECODE=1 COLUMNS=1000 \
    "$python" tools/command_pages.py "$work/pages" perigeo-post
}

install_all() {
  program=$1
  [ -x "$program" ] || fail "$program is not there; make builds it"
  uninstall > /dev/null
  put 755 "$program" "bin/$(basename "$program")"
  find LICENSE README.md CHANGELOG.md CITATION.cff input studies doc -type f ! -name '.*' | sort | \
    put_all . share/perigeo
  python3=$(command -v python3)
  if [ -n "$python3" ]; then
    "$python3" tools/command_pages.py "$work/pages" perigeo "$program"
  else
    echo "no python3: without manual page and completion"
  fi
  [ "${POST:-1}" = 0 ] || install_post
  if [ -d "$work/pages" ]; then
    (cd "$work/pages" && find ./* -type f | sed 's|^\./||' | sort) | put_all "$work/pages" share
  fi
  echo share/perigeo/installed >> "$work/list"
  cp "$work/list" "$list" || fail "$list cannot be written"
  echo "perigeo is in $root/bin, inputs, studies and documents are in $share"
  case :$PATH: in
    *:$prefix/bin:*) ;;
    *) [ -n "${DESTDIR:-}" ] || echo "$prefix/bin is not on PATH" ;;
  esac
}

work=$(mktemp -d "${TMPDIR:-/tmp}/perigeo-install.XXXXXX") || exit 1
trap 'rm -rf "$work"' EXIT
trap 'exit 1' INT TERM
case ${1:-} in
  install) install_all "$2" ;;
  uninstall) uninstall ;;
  *) echo "usage: sh tools/install.sh install|uninstall PROGRAM" >&2; exit 1 ;;
esac
