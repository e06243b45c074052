# Print the first Python of version 3.9 or later that can make virtual environments, or nothing.
# $PYTHON goes first. A python3 that comes first in PATH may lack venv where the system's has it.
for python in ${PYTHON:-} python3 /usr/bin/python3 /opt/homebrew/bin/python3 \
  python3.14 python3.13 python3.12 python3.11 python3.10 python3.9
do
  command -v "$python" >/dev/null 2>&1 || continue
  "$python" - 2>/dev/null <<'PYTHON' || continue
import sys
import ensurepip, venv
sys.exit(sys.version_info < (3, 9))
PYTHON
  echo "$python"
  exit 0
done
