"""Numbers in words: with the digits that they need, however large, small or far away they are."""

from __future__ import annotations

import math


def fixed(value: float, places: int) -> str:
    """A number with so many decimals, unless they would show less than two of its digits.

    A number beyond ten million has an exponent; one that is none is not known.
    """
    if not math.isfinite(value):
        return "not known"
    if value != 0.0 and not 10.0 ** (1 - places) <= abs(value) < 1e7:
        return f"{value:.5g}"
    return f"{value:.{places}f}"


def place(x: float, y: float, length: float, digits: int = 4) -> str:
    """A point as (x, y), with so many digits, or as many as tell a thousandth of a length."""
    return f"({_coordinate(x, length, digits)}, {_coordinate(y, length, digits)})"


def _coordinate(value: float, length: float, digits: int) -> str:
    text = f"{value:.{digits}g}"
    close = abs(float(text) - value) <= 1e-3 * length
    if length <= 0.0 or (close and "e+" not in text):
        return text
    text = f"{value:.{max(1, 3 - math.floor(math.log10(length)))}f}"
    return text.rstrip("0").rstrip(".")
