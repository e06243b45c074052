"""How results show themselves on a Python prompt: short, whatever they hold."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

_LONGEST = 60  # letters of one value


class Short:
    """For dataclasses with ``repr=False``: arrays by their shape, long values cut."""

    def __repr__(self) -> str:
        told: Any = self
        parts = [
            f"{field.name}={_shown(getattr(self, field.name))}"
            for field in dataclasses.fields(told)
            if field.repr
        ]
        return f"{type(self).__name__}({', '.join(parts)})"


def _shown(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"<{' x '.join(map(str, value.shape))} numbers>"
    if isinstance(value, (float, np.floating)):
        return f"{float(value):.6g}"
    if dataclasses.is_dataclass(value):
        return f"<{type(value).__name__}>"
    text = repr(value)
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."
