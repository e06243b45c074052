"""Checks by pydantic, with mistakes in words: what is due, where, and what was found."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError, ValidatorFunctionWrapHandler, WrapValidator
from pydantic_core import PydanticCustomError

_DUE = {
    "list_type": "a list",
    "dict_type": "a table",
    "model_type": "a table",
    "model_attributes_type": "a table",
}


@dataclass(frozen=True)
class Mistake:
    """Something that is wrong in what was read."""

    place: tuple[Any, ...]  # names of keys, numbers in lists
    kind: str  # missing, unknown, or wrong
    what: str
    found: Any
    allowed: Iterable[str] = ()


def wrong(what: str, allowed: str | Iterable[str] = (), **more: Any) -> PydanticCustomError:
    """What a check raises; `found` names the value where it is another than the one checked."""
    allowed = [allowed] if isinstance(allowed, str) else list(allowed)
    return PydanticCustomError("wrong", "{what}", {"what": what, "allowed": allowed, **more})


def due(words: str) -> WrapValidator:
    """Say in one sentence what a value must be, also where it may be one of several things."""

    def check(value: Any, handler: ValidatorFunctionWrapHandler) -> Any:
        try:
            return handler(value)
        except ValidationError:
            raise wrong(f"must be {words}") from None

    return WrapValidator(check)


def mistakes(error: ValidationError) -> list[Mistake]:
    """Everything that pydantic has found, in the order of the keys of the model."""
    found = []
    for one in error.errors(include_url=False):
        place, context = one["loc"], one.get("ctx", {})
        if one["type"] == "missing":
            found.append(Mistake(place, "missing", f"the key {place[-1]} is missing", None))
        elif one["type"] == "extra_forbidden":
            found.append(Mistake(place, "unknown", "unknown key", None))
        else:
            words = _DUE.get(one["type"])
            found.append(
                Mistake(
                    (*place, *context.get("at", ())),
                    "wrong",
                    f"must be {words}" if words else one["msg"],
                    context.get("found", one["input"]),
                    context.get("allowed", ()),
                )
            )
    return found
