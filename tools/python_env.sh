# Put perigeo-post and what it needs into .venv:  sh tools/python_env.sh run|test|lint|site|view
#
#   run   the package, with studies and report     test   also what the tests need, and, where it
#                                                         can be had, what runs a notebook
#   lint  also the linters                         site   what makes the pages of `make site`
#   view  what opens the report in a browser
#
# Says nothing when everything is there already, and then needs no network. Leaves with 1, after a
# message, where Python or the network is missing. NO_INSTALL=1 never installs.
level=${1:-run}
venv=.venv
stamp=.venv/.perigeo-$level

case $level in
  run) package='./postproc[study,report]' ;;
  test) package='./postproc[study,report,test]' ;;
  lint) package='./postproc[study,report,test,lint]' ;;
  site) package='./postproc[site]' ;;
  view) package='./postproc[view]' ;;
  *) echo "tools/python_env.sh: '$level': it must be run, test, lint, site or view" >&2; exit 1 ;;
esac

if [ ! -f postproc/pyproject.toml ]; then
  echo "Python: postproc/pyproject.toml is missing; this is not a complete copy of perigeo." >&2
  exit 1
fi

# The environment does not survive a move of the folder or of its Python: both are in the stamp.
wanted="$level $(pwd -P) $(cksum < postproc/pyproject.toml)"
installed='import sys, importlib.util as u; sys.exit(not u.find_spec("perigeo_post"))'
if [ -x $venv/bin/python ] && [ "$(cat "$stamp" 2>/dev/null)" = "$wanted" ] &&
    $venv/bin/python -c "$installed" 2>/dev/null; then
  exit 0
fi

if [ "${NO_INSTALL:-0}" = 1 ]; then
  echo "Python: .venv is not complete, and NO_INSTALL=1 forbids installing. To complete it:" >&2
  echo "  sh tools/python_env.sh $level" >&2
  exit 1
fi

python=$(sh tools/find_python.sh)
if [ -z "$python" ]; then
  echo "Python: no python3 of version 3.9 or later that can make virtual environments." >&2
  exit 1
fi

if ! $venv/bin/python -c 'import pip' 2>/dev/null ||
    ! head -1 $venv/bin/pip 2>/dev/null | grep -q "$(pwd -P)/"; then
  echo "Python: making .venv with $python"
  rm -rf $venv
  if ! "$python" -m venv $venv; then
    rm -rf $venv
    echo "Python: $python could not make a virtual environment." >&2
    exit 1
  fi
fi

echo "Python: installing into .venv: -e $package"
# An unsuccessful try must not count as done the next time.
rm -f "$stamp"
if ! $venv/bin/python -m pip install --quiet --disable-pip-version-check --retries 2 -e "$package"
then
  echo "Python: the packages could not be installed (see above; is there a network?)." >&2
  exit 1
fi
# The notebook of the tutorials has many packages of its own, and one test.
if [ "$level" = test ] &&
    ! $venv/bin/python -m pip install --quiet --disable-pip-version-check --retries 2 \
      -e './postproc[notebook]'
then
  echo "Python: what runs a notebook could not be installed; the test of the notebook is left out."
fi
echo "$wanted" > "$stamp"
