"""Fields of a frame: those stored, their components, and those derived from them."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from .errors import FieldNotFoundError
from .points import FloatArray
from .shown import Short

TENSOR = ("xx", "yy", "zz", "xy")
# Of the fields of schema 1, for files whose datasets do not say
FIRST_COMPONENTS: dict[str, tuple[str, ...]] = {
    "displacement": ("x", "y"),
    "velocity": ("x", "y"),
    "stress": TENSOR,
    "strain": TENSOR,
}
OF_THE_POINTS = ("yield_stress",)  # stand once in the file, and are the same in every frame


@dataclass(frozen=True)
class About:
    """What a field means, without its values."""

    unit: str  # "1" for a pure number, empty where the file does not say
    description: str
    components: tuple[str, ...] = ()


@dataclass(frozen=True, repr=False)
class Field(Short):
    """Values at all points with their meaning."""

    name: str
    values: FloatArray  # (n) or (n, c)
    unit: str
    description: str
    components: tuple[str, ...] = ()

    def component(self, name: str) -> Field:
        """One component as a field of its own, by name ("xx", "y")."""
        if name not in self.components:
            raise FieldNotFoundError(
                f"'{self.name}' has no component '{name}'; it has: {', '.join(self.components)}"
            )
        k = self.components.index(name)
        return Field(
            f"{self.name}_{name}", self.values[:, k], self.unit, f"{self.description}, {name}"
        )


def mean_of_tensor(field: Field) -> FloatArray:
    """(xx + yy + zz) / 3"""
    return sum((field.component(c).values for c in ("xx", "yy", "zz")), np.zeros(1)) / 3.0


def von_mises_of(field: Field) -> FloatArray:
    """sqrt(3/2) |dev| of a symmetric tensor, the shear component counted twice."""
    xx, yy, zz, xy = (field.component(c).values for c in TENSOR)
    mean = (xx + yy + zz) / 3.0
    square = (xx - mean) ** 2 + (yy - mean) ** 2 + (zz - mean) ** 2 + 2.0 * xy**2
    return np.asarray(np.sqrt(1.5 * square))


def plane_shear_of(field: Field) -> FloatArray:
    """Largest shear component in the plane, sqrt(((xx - yy)/2)^2 + xy^2)."""
    xx, yy, xy = (field.component(c).values for c in ("xx", "yy", "xy"))
    return np.asarray(np.hypot(0.5 * (xx - yy), xy))


def magnitude_of(field: Field) -> FloatArray:
    """Length of a vector."""
    return np.asarray(np.linalg.norm(field.values, axis=1))


@dataclass(frozen=True)
class _Derived:
    source: str
    needs: tuple[str, ...]  # components of the source
    rule: Callable[[Field], FloatArray]
    description: str

    def possible(self, components: tuple[str, ...]) -> bool:
        """Whether a source with these components will do."""
        return set(self.needs) <= set(components)


_DIAGONAL = ("xx", "yy", "zz")
_PLANE = ("xx", "yy", "xy")
DERIVED: dict[str, _Derived] = {
    "displacement_magnitude": _Derived(
        "displacement", ("x", "y"), magnitude_of, "length of the displacement"
    ),
    "velocity_magnitude": _Derived("velocity", ("x", "y"), magnitude_of, "length of the velocity"),
    "mean_stress": _Derived(
        "stress", _DIAGONAL, mean_of_tensor, "mean Cauchy stress, tension positive"
    ),
    "pressure": _Derived(
        "stress", _DIAGONAL, lambda f: -mean_of_tensor(f), "pressure, minus mean stress"
    ),
    "max_shear_stress": _Derived(
        "stress", _PLANE, plane_shear_of, "largest shear stress in the plane"
    ),
    "von_mises": _Derived("stress", TENSOR, von_mises_of, "von Mises stress"),
    "volumetric_strain": _Derived(
        "strain", _DIAGONAL, lambda f: 3.0 * mean_of_tensor(f), "xx + yy + zz"
    ),
    "max_shear_strain": _Derived(
        "strain", _PLANE, plane_shear_of, "largest shear strain in the plane"
    ),
}

# Text on axes and colour bars
_LABELS = {
    "plastic_strain": "Equivalent plastic strain α",
    "von_mises": "Von Mises stress",
    "yield_stress": "Initial yield stress",
    "zero_energy": "Zero-energy measure",
    "mean_stress": "Mean stress (tension positive)",
    "pressure": "Pressure",
    "max_shear_stress": "Largest shear stress in the plane",
    "max_shear_strain": "Largest shear strain in the plane",
    "volumetric_strain": "Volumetric strain",
    "det_f": "det F",
    "displacement_magnitude": "Displacement |u|",
    "velocity_magnitude": "Velocity |v|",
}
_SYMBOLS = {
    "stress": ("Cauchy stress", "σ"),
    "strain": ("Strain", "E"),
    "displacement": ("Displacement", "u"),
    "velocity": ("Velocity", "v"),
}


def label_of(name: str) -> str:
    """Text for an axis: words and symbol, without unit."""
    if name in _LABELS:
        return _LABELS[name]
    source, _, component = name.rpartition("_")
    if source in _SYMBOLS and set(component) <= set("xyz"):
        words, symbol = _SYMBOLS[source]
        return f"{words} ${symbol}_{{{component}}}$"
    words = name.replace("_", " ")
    return words[:1].upper() + words[1:]


def find(name: str, stored: Callable[[str], Field | None]) -> Field | None:
    """A field by name, None where there is none; `stored` gives what the file holds.

    A name is that of a dataset, of a dataset with a component (stress_xx), or of a derived field.
    """
    found = stored(name)
    if found is not None:
        return found
    if name in DERIVED:
        rule = DERIVED[name]
        source = stored(rule.source)
        if source is not None and rule.possible(source.components):
            return Field(name, rule.rule(source), source.unit, rule.description)
    source_name, _, component = name.rpartition("_")
    source = stored(source_name) if source_name else None
    if source is not None and source.components:
        return source.component(component)
    return None


def available(stored: Mapping[str, About]) -> list[str]:
    """All names: of the stored fields, of their components, and of those derived from them."""
    names = []
    for name, about in stored.items():
        names.append(name)
        names += [f"{name}_{part}" for part in about.components]
    return names + [
        name
        for name, rule in DERIVED.items()
        if name not in names
        and rule.source in stored
        and rule.possible(stored[rule.source].components)
    ]


def unknown(name: str, names: list[str]) -> FieldNotFoundError:
    """The error for a name that is not there, with the nearest right one."""
    near = difflib.get_close_matches(name, names, n=1)
    hint = f"; did you mean '{near[0]}'?" if near else ""
    return FieldNotFoundError(f"there is no field '{name}'{hint} There are: {', '.join(names)}")
