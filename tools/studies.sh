# Do the studies named, one after another:  sh tools/studies.sh NAME...
#
# A study that fails does not keep the others from being done; it is named at the end. A signal ends
# all of it. Whatever is done already is not done again.
trap : INT TERM HUP
number=0
failed=
for name; do
  number=$((number + 1))
  if [ $# -gt 1 ]; then echo "Study $number of $#"; fi
  .venv/bin/perigeo-post study "studies/$name.toml"
  status=$?
  case $status in
    0) ;;
    129 | 130 | 143) exit $status ;;
    *) failed="$failed $name" ;;
  esac
done
if [ -n "$failed" ]; then
  echo "Not all of it succeeded; see above:$failed" >&2
  exit 1
fi
