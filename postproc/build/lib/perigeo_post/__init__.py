"""Results of perigeo in Python: reader, measures and figures.

Example::

    from perigeo_post import Run, measure_band, contour_figure, save_figure

    run = Run("results/compression/compression.h5")
    print(measure_band(run, strain=0.01).as_dict())
    save_figure(contour_figure(run.frames()[1:]), "bands.pdf")

Everything that the command line does is a function here. The names and their modules are listed
in __init__.pyi; a module is imported when one of its names is asked for, so that reading a result
needs neither matplotlib nor the study engine.
"""

import re
from importlib import import_module
from pathlib import Path
from typing import Any

_STUB = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")
_HOMES = {name: home for home, name in re.findall(r"^from (\S+) import (\w+) as", _STUB, re.M)}

__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name], __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
