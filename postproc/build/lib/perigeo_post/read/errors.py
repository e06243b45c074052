"""Errors that a user can do something about.

Each carries one line of text and the exit status that the command line returns for it; the
numbers follow those of the program: 1 for what was asked, 2 for the file that was read, 5 for a
file that cannot be written.
"""

from __future__ import annotations


class PostError(Exception):
    """Base of all errors of this package."""

    exit_status = 1


class RequestError(PostError):
    """What was asked for does not exist in the result, or makes no sense."""


class FrameNotFoundError(RequestError):
    """No frame at the requested strain, time or number."""


class FieldNotFoundError(RequestError):
    """No field or history column of that name."""


class NoBandError(RequestError):
    """The frame holds no shear band that could be measured."""


class ResultError(PostError):
    """The result file, or the history beside it, cannot be read."""

    exit_status = 2


class SchemaError(ResultError):
    """The file is not a perigeo result, or of a version that this package does not know."""


class OutputError(PostError):
    """A figure, table or animation cannot be written."""

    exit_status = 5
