"""Units and sentences of the history's columns in results of schema 1.

Those files hold no history, only the CSV beside them, whose header has names without units. The
set of columns was fixed. From schema 2 on, the file itself says what its columns are.
"""

from __future__ import annotations

COLUMNS: dict[str, tuple[str, str]] = {
    "step": ("1", "number of the time step"),
    "time": ("s", "time"),
    "strain": ("1", "nominal strain between the platens, compression positive"),
    "mean_stress_xx": ("Pa", "mean first Piola stress xx of the body"),
    "mean_stress_yy": ("Pa", "mean first Piola stress yy of the body"),
    "mean_strain_yy": ("1", "mean strain yy of the body"),
    "max_plastic_strain": ("1", "largest equivalent plastic strain in the body"),
    "kinetic_energy": ("J/m", "kinetic energy"),
    "strain_energy": ("J/m", "stored elastic energy"),
    "plastic_dissipation": ("J/m", "plastic work, accumulated"),
    "damping_dissipation": ("J/m", "work of the damping, accumulated"),
    "stabilisation_energy": ("J/m", "energy of the zero-energy control"),
    "external_work": ("J/m", "work of reactions and loads, accumulated"),
    "energy_error": ("1", "relative error of the energy balance"),
}
# Each boundary has two more; its name stands before the ending
FORCES: dict[str, tuple[str, str]] = {
    "_force_x": ("N/m", "force of boundary '{}' on the body, along x"),
    "_force_y": ("N/m", "force of boundary '{}' on the body, along y"),
}


def column_meaning(name: str) -> tuple[str, str]:
    """Unit and sentence of a column of schema 1; both empty where it had no such column."""
    for ending, (unit, text) in FORCES.items():
        if name.endswith(ending):
            return unit, text.format(name[: -len(ending)])
    return COLUMNS.get(name, ("", ""))
