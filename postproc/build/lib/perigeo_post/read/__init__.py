"""Read what perigeo writes: result files, their frames and fields, and the history.

Needs numpy and h5py and nothing else.
"""

from .fields import About, Field
from .file import SCHEMA, SCHEMA_VERSIONS
from .history import Column, History, read_history
from .points import PointSet
from .run import Frame, Run

__all__ = [
    "SCHEMA",
    "SCHEMA_VERSIONS",
    "About",
    "Column",
    "Field",
    "Frame",
    "History",
    "PointSet",
    "Run",
    "read_history",
]
