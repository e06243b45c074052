#!/bin/sh
# Called by conda-build in a copy of the source, with PREFIX, PYTHON and the compilers set.
set -eu
make install PREFIX="$PREFIX" POST=0 MARCH= FC="$FC" H5FC="$PREFIX/bin/h5fc"
"$PYTHON" -m pip install --no-deps --no-build-isolation ./postproc
