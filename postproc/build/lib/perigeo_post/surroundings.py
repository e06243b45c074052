"""Where perigeo-post is used: what notebooks and settings of others must not change."""

from __future__ import annotations

import os
import sys

BACKEND = "MPLBACKEND"


def import_matplotlib() -> None:
    """Import matplotlib, also where the environment names a backend that is not there.

    A notebook tells all programs that it starts to draw in it. An installation that does not know
    that backend refuses to be imported at all, though figures here are files and need none.
    """
    if "matplotlib" in sys.modules:
        return
    backend = os.environ.pop(BACKEND, None)
    try:
        import matplotlib
    finally:
        if backend is not None:
            os.environ[BACKEND] = backend
    if backend:
        try:
            matplotlib.rcParams["backend"] = backend  # as matplotlib does it
        except ValueError:
            return
