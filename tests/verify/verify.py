"""Compare computed values with closed forms: `make verify`.

Each case writes namelists, runs the program and reads its results with perigeo_post. The rows are
printed as a table (quantity, reference, computed, difference and tolerance in its unit, verdict),
and written to results/verify/verify.json and verify.md; exit status 1 when one of them fails.

    verify.py [CASE ...]   only these cases (names: verify.py --list)
    verify.py --publish    all cases, and the table into doc/verification_table.md
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import date
from pathlib import Path

import numpy as np
from perigeo_post import PostError, Run, apparent_modulus, measure_band, peak, stress_strain
from perigeo_post.measure.limit_load import limit_load

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(os.environ.get("PERIGEO_BIN", ROOT / "bin" / "perigeo"))
RESULTS = ROOT / "results" / "verify"

E, NU, SIGMA_Y, RHO = 50.0e6, 0.3, 0.15e6, 2000.0
G = E / (2.0 * (1.0 + NU))
C_P = float(np.sqrt(E * (1.0 - NU) / ((1.0 + NU) * (1.0 - 2.0 * NU)) / RHO))
ROOT_3 = float(np.sqrt(3.0))

Groups = list[tuple[str, dict[str, object]]]


@dataclass
class Row:
    """One line of the table; errors are relative to `exact`."""

    case: str
    quantity: str
    unit: str
    exact: float
    computed: float
    tolerance: float
    source: str  # where the exact value comes from
    scale: float = 0.0  # what the error refers to; 0: the exact value
    note: str = ""  # told below the table

    @property
    def error(self) -> float:
        return (self.computed - self.exact) / abs(self.scale or self.exact)

    @property
    def allowed(self) -> float:
        """The tolerance in the unit of the row."""
        return self.tolerance * abs(self.scale or self.exact)

    @property
    def passed(self) -> bool:
        return bool(abs(self.error) <= self.tolerance)


def namelist(groups: Groups) -> str:
    """Text of an input file."""

    def text(value: object) -> str:
        if isinstance(value, str):
            return f"'{value}'"
        if isinstance(value, (list, tuple)):
            return ", ".join(repr(float(v)) for v in value)
        return repr(value)

    lines = []
    for group, keys in groups:
        lines.append(f"&{group}")
        lines += [f"  {key} = {text(value)}" for key, value in keys.items()]
        lines.append("/")
    return "\n".join(lines) + "\n"


def run(name: str, groups: Groups) -> Run:
    """Run the program on one thread and open its result."""
    folder = RESULTS / name
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.nml"
    always = [
        ("run", {"name": name, "output_dir": str(folder)}),
        ("stabilisation", {"method": "none"}),  # closed forms of the plain operators
    ]
    path.write_text(namelist([*always, *groups]))
    command = [str(PROGRAM), "--threads", "1", "--force", "--quiet", str(path)]
    return execute(name, folder, command)


def execute(name: str, folder: Path, command: list[str]) -> Run:
    """Carry out a run and open its result."""
    # Threads that wait must not take the cores from the cases beside them.
    env = {**os.environ, "OMP_WAIT_POLICY": "passive"}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=env)
    if done.returncode != 0:
        raise RuntimeError(f"{name}: exit status {done.returncode}\n{done.stderr}")
    return Run(folder / f"{name}.h5")


def material(model: str = "j2", **keys: object) -> tuple[str, dict[str, object]]:
    """The material of the paper without softening."""
    values: dict[str, object] = {
        "model": model,
        "density": RHO,
        "youngs_modulus": E,
        "poissons_ratio": NU,
    }
    if model == "j2":
        values["yield_stress"] = SIGMA_Y
    return ("material", values | keys)


def specimen(spacing: float, horizon: float, **keys: object) -> Groups:
    """1 m x 2 m."""
    return [
        ("discretisation", {"spacing": spacing, "horizon": horizon, "fit": "nearest"} | keys),
        ("body", {"x_min": 0.0, "x_max": 1.0, "y_min": 0.0, "y_max": 2.0}),
    ]


def platens(bottom: str = "rough", rate: float = 0.01) -> Groups:
    """A fixed bottom and a smooth top that comes down."""
    return [
        ("boundary", {"name": "bottom", "side": "bottom", "contact": bottom}),
        (
            "boundary",
            {"name": "top", "side": "top", "contact": "smooth", "velocity": (0.0, -rate)},
        ),
    ]


# ------------------------------------------------------------------------------------- cases


def moduli() -> list[Row]:
    """E_app of the specimen of the paper against an independent calculation (theory, section 8)."""
    expected = {
        "fixed horizon 0.08 m": (51.4, 50.0, 49.6, 49.3, 49.2, 49.1),
        "fixed spacing 0.02 m": (50.8, 50.2, 49.8, 49.3, 48.9, 48.5),
    }
    rows = []
    for series, values in expected.items():
        for m, value in enumerate(values, start=1):
            horizon_fixed = "horizon" in series
            spacing, horizon = (0.08 / m, 0.08) if horizon_fixed else (0.02, 0.02 * m)
            groups = [
                *specimen(spacing, horizon),
                material("elastic", strain_measure="green_lagrange"),  # the paper's
                *platens(),
                (
                    "integration",
                    {"final_strain": 1.0e-3, "damping": 5.0e5, "damping_frame": "platens"},
                ),
                ("output", {"history_count": 200, "frame_count": 1}),
            ]
            kind = "delta" if horizon_fixed else "dx"
            result = run(f"modulus_{kind}_m{m}", groups)
            rows.append(
                Row(
                    "modulus",
                    f"E_app, {series}, m = {m}",
                    "MPa",
                    value,
                    apparent_modulus(result).value / 1e6,
                    5.0e-3,
                    "independent",
                )
            )
    return rows


def affine_body(gradient: tuple[float, ...], **table: object) -> Groups:
    """One free point whose surroundings move affinely: a test of the material alone.

    With more free points the truncated families of the layers would disturb the outer ones.
    """
    return [
        ("discretisation", {"spacing": 0.1, "horizon": 0.3, "layout": "cells"}),
        ("body", {"x_min": -0.05, "x_max": 0.05, "y_min": -0.05, "y_max": 0.05}),
        (
            "boundary",
            {
                "name": "rim",
                "side": "all",
                "contact": "affine",
                "velocity_gradient": gradient,
                **table,
            },
        ),
    ]


def uniaxial() -> list[Row]:
    """Slope and first yield of plane strain compression with free sides, as an affine map.

    Stiff, so that the strains at yield are small and all stress measures agree.
    """
    rate, stiff = 5.0e-4, 20.0 * E
    groups = [
        *affine_body((NU / (1.0 - NU) * rate, 0.0, 0.0, -rate)),
        material(youngs_modulus=stiff),
        ("integration", {"end_time": 0.4, "damping": 5.0e5}),
        ("output", {"history_count": 2000, "frame_count": 1}),
    ]
    history = run("uniaxial", groups).history()
    stress, strain = -history["mean_stress_yy"], -history["mean_strain_yy"]
    elastic = history["max_plastic_strain"] <= 0.0
    early = elastic & (strain > 0.0)
    last = int(np.flatnonzero(elastic)[-1])
    return [
        Row(
            "elastic",
            "slope E / (1 - nu^2)",
            "MPa",
            stiff / (1.0 - NU**2) / 1e6,
            float(np.polyfit(strain[early], stress[early], 1)[0]) / 1e6,
            2.0e-3,
            "closed form",
        ),
        Row(
            "elastic",
            "first yield sigma_y / sqrt(1 - nu + nu^2)",
            "kPa",
            SIGMA_Y / float(np.sqrt(1.0 - NU + NU**2)) / 1e3,
            float(stress[last]) / 1e3,
            5.0e-3,
            "closed form",
        ),
    ]


def plateau() -> list[Row]:
    """Perfectly plastic specimen: 2 sigma_y / sqrt(3).

    Stiff, and slow by the same factor, so that strains and the drag of the damping stay small.
    """
    stiff = 100.0
    groups = [
        *specimen(0.05, 0.15, volumes="tributary"),
        material(youngs_modulus=stiff * E),
        *platens("smooth", rate=0.2 / stiff),
        (
            "integration",
            {"final_strain": 0.04 / stiff, "damping": 2.0e6, "damping_frame": "platens"},
        ),
        ("output", {"history_count": 400, "frame_count": 1}),
    ]
    curve = stress_strain(run("plateau", groups))
    return [
        Row(
            "plateau",
            "plateau 2 sigma_y / sqrt(3)",
            "kPa",
            2.0 * SIGMA_Y / ROOT_3 / 1e3,
            float(curve.y[-1]) / 1e3,
            5.0e-3,
            "closed form",
        )
    ]


def measures() -> list[Row]:
    """Perfect plasticity up to 2 % of strain, in the measures whose plastic flow keeps the volume.

    With small strain the stress of the platen stays 2 sigma_y / sqrt(3); with logarithmic strain
    that is the true stress, times the area that grows: (2 sigma_y / sqrt(3)) / (1 - strain).
    """
    rows = []
    for name in ("small", "logarithmic"):
        groups = [
            *specimen(0.05, 0.15, volumes="tributary"),
            material(strain_measure=name),
            *platens("smooth", rate=0.005),
            (
                "integration",
                {"final_strain": 0.02, "damping": 5.0e5, "damping_frame": "platens"},
            ),
            ("output", {"history_count": 400, "frame_count": 1}),
        ]
        curve = stress_strain(run(f"measures_{name}", groups))
        for strain in (0.01, 0.02):
            spread = 1.0 - strain if name == "logarithmic" else 1.0
            rows.append(
                Row(
                    "measures",
                    f"plateau at {100.0 * strain:.0f} %, {name} strain",
                    "kPa",
                    2.0 * SIGMA_Y / ROOT_3 / spread / 1e3,
                    float(np.interp(strain, curve.x, curve.y)) / 1e3,
                    5.0e-3,
                    "closed form",
                )
            )
    return rows


def shear(name: str, end: float, table: dict[str, object], **keys: object) -> Run:
    """Simple shear of one point at 0.02 / s times a table, with 400 frames."""
    return run(
        name,
        [
            *affine_body((0.0, 0.02, 0.0, 0.0), **table),
            material(**keys),
            ("integration", {"end_time": end, "damping": 5.0e5}),
            ("output", {"history_count": 10, "frame_count": 400}),
        ],
    )


def shear_curve(result: Run) -> tuple[np.ndarray, np.ndarray]:
    """Engineering shear strain and shear stress of the body [Pa]."""
    gamma, tau = [], []
    for frame in result.frames():
        gamma.append(2.0 * float(frame["strain_xy"][result.body][0]))
        tau.append(float(frame["stress_xy"][result.body][0]))
    return np.array(gamma), np.array(tau)


def softening() -> list[Row]:
    """Simple shear beyond yield: d tau / d gamma = G H / (3 G + H), then the residual strength.

    Soft enough to reach the residual strength at small strains.
    """
    rows = []
    h, residual = -25.0e6, 0.5 * SIGMA_Y
    exact = G * h / (3.0 * G + h)
    for kind in ("kinematic", "isotropic"):
        keys = {f"{kind}_modulus": h, "residual_strength": residual}
        gamma, tau = shear_curve(shear(f"softening_{kind}", 0.6, {}, **keys))
        falling = (gamma > 0.005) & (gamma < 0.0065)
        rows.append(
            Row(
                "softening",
                f"slope G H / (3 G + H), {kind}",
                "MPa",
                exact / 1e6,
                float(np.polyfit(gamma[falling], tau[falling], 1)[0]) / 1e6,
                1.0e-2,
                "closed form",
            )
        )
        rows.append(
            Row(
                "softening",
                f"residual shear stress sigma_r / sqrt(3), {kind}",
                "kPa",
                residual / ROOT_3 / 1e3,
                float(tau[-1]) / 1e3,
                1.0e-2,
                "closed form",
            )
        )
    return rows


def exact_loop(gamma: np.ndarray, h_k: float, h_i: float) -> np.ndarray:
    """Shear stress of linear hardening in simple shear, step by step in closed form."""
    tau_y, slope_k, slope_i = SIGMA_Y / ROOT_3, h_k / 3.0, h_i / 3.0
    plastic = back = 0.0
    tau = []
    for g in gamma:
        trial = G * (g - plastic)
        excess = abs(trial - back) - tau_y
        if excess > 0.0:
            sign = 1.0 if trial > back else -1.0
            d = excess / (G + slope_k + slope_i)
            plastic += sign * d
            back += sign * slope_k * d
            tau_y += slope_i * d
        tau.append(G * (g - plastic))
    return np.array(tau)


def cyclic() -> list[Row]:
    """Cyclic simple shear: the loop, and the elastic range after reversal (Bauschinger)."""
    times = [0.0, 0.5, 0.55, 1.5, 1.55, 2.5]
    table = {"times": times, "factors": [1.0, 1.0, -1.0, -1.0, 1.0, 1.0]}
    rows = []
    for name, h_k, h_i in (("kinematic", 3.0e6, 0.0), ("mixed", 2.0e6, 2.0e6)):
        keys = {"kinematic_modulus": h_k, "isotropic_modulus": h_i}
        gamma, tau = shear_curve(shear(f"cyclic_{name}", 2.5, table, **keys))
        exact = exact_loop(gamma, h_k, h_i)
        worst = float(np.max(np.abs(tau - exact)))
        rows.append(
            Row(
                "cyclic",
                f"loop, {name} hardening: largest difference",
                "kPa",
                0.0,
                worst / 1e3,
                1.0e-2,
                "closed form",
                scale=float(np.max(np.abs(exact))) / 1e3,
            )
        )
        if h_i == 0.0:
            turn = int(np.argmax(gamma[: len(gamma) // 2]))
            below = tau[turn] - tau[turn:]
            off = np.abs((tau[turn] - tau[turn:]) - G * (gamma[turn] - gamma[turn:]))
            elastic = off < 2.0e-3 * SIGMA_Y
            first = int(np.argmin(elastic))
            rows.append(
                Row(
                    "cyclic",
                    "elastic range after reversal 2 sigma_y / sqrt(3)",
                    "kPa",
                    2.0 * SIGMA_Y / ROOT_3 / 1e3,
                    float(below[first]) / 1e3,
                    2.5e-2,
                    "closed form",
                )
            )
    return rows


def wave() -> list[Row]:
    """A constrained bar hit at its left end: time of flight of the front, and its stress.

    The hit is ramped so that the front is long against the horizon. The layers above and below
    slide with the bar and carry their share, so the stress is read at a point.
    """
    speed, spacing, rise = 0.01, 0.02, 0.6 / C_P
    end = 3.6 / C_P
    push = {"times": [0.0, rise], "velocities_x": [0.0, speed]}
    groups = [
        ("discretisation", {"spacing": spacing, "horizon": 3.0 * spacing, "layout": "cells"}),
        ("body", {"x_min": 0.0, "x_max": 4.0, "y_min": 0.0, "y_max": 0.2}),
        material("elastic"),
        ("boundary", {"name": "left", "side": "left", "contact": "rough", **push}),
        ("boundary", {"name": "below", "side": "bottom", "contact": "smooth"}),
        ("boundary", {"name": "above", "side": "top", "contact": "smooth"}),
        ("integration", {"end_time": end}),
        ("output", {"history_count": 20, "frame_count": 300}),
    ]
    result = run("wave", groups)
    frames = result.frames()
    times = np.array([frame.time for frame in frames])
    arrival = []
    for x in (1.01, 2.51):
        distance = np.hypot(result.positions[:, 0] - x, result.positions[:, 1] - 0.09)
        point = int(np.argmin(distance))
        v = np.array([frame["velocity_x"][point] for frame in frames])
        after = int(np.argmax(v >= 0.5 * speed))
        share = (0.5 * speed - v[after - 1]) / (v[after] - v[after - 1])
        arrival.append(times[after - 1] + share * (times[after] - times[after - 1]))
        if x < 2.0:
            stress = np.array([frame["stress_xx"][point] for frame in frames])
            behind = -float(np.mean(stress[times > arrival[0] + rise]))
    return [
        Row(
            "wave",
            "wave speed sqrt((lambda + 2 G) / rho)",
            "m/s",
            C_P,
            1.5 / (arrival[1] - arrival[0]),
            1.0e-2,
            "closed form",
        ),
        Row(
            "wave",
            "stress behind the front rho c_p v",
            "kPa",
            RHO * C_P * speed / 1e3,
            behind / 1e3,
            2.0e-2,
            "closed form",
        ),
    ]


def loads_body(spacing: float, m: int, layout: str = "nodes") -> Groups:
    """Elastic specimen of 1 m x 2 m, at rest soon after a slow load."""
    return [
        *specimen(spacing, m * spacing, layout=layout, volumes="tributary"),
        material("elastic"),
        ("integration", {"end_time": 0.9, "damping": 2.0e5}),
        ("output", {"history_count": 100, "frame_count": 1}),
    ]


def side_pressure(side: str, value: float) -> tuple[str, dict[str, object]]:
    """A pressure on a whole side, which rises within 0.3 s."""
    return ("pressure", {"name": side, "side": side, "value": value, "ramp_time": 0.3})


def pressure() -> list[Row]:
    """Dead pressure: all round, on both sides between smooth platens, on one between rough ones.

    Strains are below 0.04 %, so that all stress measures agree.
    """
    p = 20.0e3
    sides = ("left", "right", "bottom", "top")
    groups = [*loads_body(0.1, 2, "cells"), *(side_pressure(side, p) for side in sides)]
    history = run("pressure_all_round", groups).history()
    rows = [
        Row(
            "pressure",
            f"stress {axis} under pressure all round",
            "kPa",
            -p / 1e3,
            float(history[f"mean_stress_{axis}"][-1]) / 1e3,
            1.0e-4,
            "closed form",
        )
        for axis in ("xx", "yy")
    ]
    between = [
        ("boundary", {"name": side, "side": side, "contact": "smooth"})
        for side in ("bottom", "top")
    ]
    both = [side_pressure(side, p) for side in ("left", "right")]
    history = run("pressure_smooth", [*loads_body(0.02, 3), *between, *both]).history()
    for quantity, column, exact in (
        ("lateral pressure, smooth fixed platens: stress xx = -p", "xx", -p),
        ("the same: stress yy = -nu p / (1 - nu)", "yy", -NU / (1.0 - NU) * p),
    ):
        computed = float(history[f"mean_stress_{column}"][-1])
        rows.append(
            Row("pressure", quantity, "kPa", exact / 1e3, computed / 1e3, 1.0e-2, "closed form")
        )
    between = [
        ("boundary", {"name": side, "side": side, "contact": "rough"}) for side in ("bottom", "top")
    ]
    groups = [*loads_body(0.05, 3), *between, side_pressure("left", p)]
    history = run("pressure_rough", groups).history()
    force = float(history["bottom_force_x"][-1] + history["top_force_x"][-1])
    rows.append(
        Row(
            "pressure",
            "pressure on one side, rough platens: their forces = -p H",
            "kN/m",
            -p * 2.0 / 1e3,
            force / 1e3,
            1.0e-3,
            "closed form",
        )
    )
    return rows


def traction() -> list[Row]:
    """A platen under a dead load between free sides: stress, strain, planeness, balance."""
    load = 20.0e3
    top = {"name": "top", "side": "top", "contact": "smooth"}
    groups = [
        *loads_body(0.025, 3),
        ("boundary", {"name": "bottom", "side": "bottom", "contact": "smooth"}),
        ("boundary", top | {"traction": (0.0, -load), "ramp_time": 0.3}),
    ]
    result = run("traction", groups)
    history = result.history()
    platen = result.positions[:, 1] > 2.0 + 1.0e-9
    height = np.asarray(result.last_frame["displacement_y"])[platen]
    stress, strain = (float(history[f"mean_{name}_yy"][-1]) for name in ("stress", "strain"))
    error = float(np.max(np.abs(history["energy_error"][5:])))
    return [
        Row("traction", "stress yy", "kPa", -load / 1e3, stress / 1e3, 1.0e-2, "closed form"),
        Row(
            "traction",
            "strain yy = -t (1 - nu^2) / E",
            "%",
            -100.0 * load * (1.0 - NU**2) / E,
            100.0 * strain,
            1.0e-2,
            "closed form",
        ),
        Row(
            "traction",
            "platen out of plane, over its displacement",
            "1",
            0.0,
            float(np.ptp(height) / np.max(np.abs(height))),
            1.0e-12,
            "closed form",
            scale=1.0,
        ),
        Row("traction", "largest energy_error", "1", 0.0, error, 1.0e-3, "closed form", scale=1.0),
    ]


def isotropic() -> list[Row]:
    """Biaxial test from 100 kPa all round: start, modulus, limit (input/biaxial_isotropic.nml)."""
    nu, youngs, c_u, cell, change = 0.45, 30.0e6, 50.0e3, 100.0e3, 0.5
    history = shipped("biaxial_isotropic").history()
    time, flow = history["time"], np.asarray(history["max_plastic_strain"])
    start = int(np.searchsorted(time, change - 1.0e-6))
    elastic = int(np.argmax(flow > 0.0)) - 2
    names = ("mean_stress_xx", "mean_stress_yy", "mean_strain_yy")
    xx, yy, strain = (np.asarray(history[name]) for name in names)
    slope = (yy - nu / (1.0 - nu) * xx)[[start, elastic]]  # sigma_3 changes by a little too
    modulus = float(np.diff(slope)[0] / np.diff(strain[[start, elastic]])[0])
    exact = youngs / (1.0 - nu**2)
    lines = [
        ("stress yy before the change", "kPa", -cell / 1e3, float(yy[start]) / 1e3, 5.0e-3),
        ("stress xx before the change", "kPa", -cell / 1e3, float(xx[start]) / 1e3, 2.0e-2),
        ("modulus after it, E / (1 - nu^2)", "MPa", exact / 1e6, modulus / 1e6, 1.0e-2),
        ("limit, sigma_1 - sigma_3 = 2 c_u", "kPa", 2e-3 * c_u, float(xx[-1] - yy[-1]) / 1e3, 1e-2),
    ]
    return [Row("isotropic", *line, "closed form") for line in lines]


def shipped(path: str, *settings: str, name: str = "", threads: int = 1) -> Run:
    """Run an input of the folder input/, perhaps with settings and under another name."""
    name = name or Path(path).name
    folder = RESULTS / name
    folder.mkdir(parents=True, exist_ok=True)
    command = [str(PROGRAM), "--threads", str(threads), "--force", "--quiet"]
    command += ["--output", str(folder), "--set", f"run.name={name}"]
    for setting in settings:
        command += ["--set", setting]
    return execute(name, folder, [*command, str(ROOT / "input" / f"{path}.nml")])


AT_EQUILIBRIUM = ("integration.method=equilibrium", "integration.damping=")
OF_MOTION = (
    "integration.damping_frame=",
    "integration.time_step_rule=",
    "integration.safety=",
)


def footing() -> list[Row]:
    """Rough strip footing on clay, in time and at equilibrium: (2 + pi) c B."""
    rows = []
    for way, settings, tolerance in (
        ("footing", (), 1.0e-2),
        ("footing at equilibrium", AT_EQUILIBRIUM, 7.0e-3),
    ):
        name = way.replace(" ", "_")
        found = limit_load(shipped("limit_loads/strip_footing", *settings, name=name))
        rows += [
            Row(
                way,
                f"limit load of a rough strip footing, {what}",
                "kN/m",
                (2.0 + np.pi) * 10.0,
                value / 1e3,
                tolerance,
                "closed form",
            )
            for what, value in (("mean of 4 to 5 % of B", found.load), ("largest", found.peak))
        ]
    return rows


def compression_at_equilibrium() -> list[Row]:
    """The reference case at equilibrium does not depend on the increments.

    With a control, for without one it has more than one equilibrium after the peak.
    """
    runs = {}
    for count in (100, 200, 400):
        settings = ("stabilisation.method=relaxing", "imperfection.amplitude=1.0e-2")
        runs[count] = shipped(
            "compression",
            *AT_EQUILIBRIUM,
            *OF_MOTION,
            *settings,
            f"integration.increments={count}",
            name=f"compression_equilibrium_{count}",
            threads=2 if count == 200 else 1,
        )
    curves = {count: stress_strain(result) for count, result in runs.items()}
    log = runs[200].path.with_suffix(".log").read_text(encoding="utf-8")
    loop = re.findall(r"^time loop +(.*)$", log, re.MULTILINE)[-1]
    note = f"The reference case at equilibrium, 200 increments, 2 threads: time loop {loop}."
    return [
        Row(
            "reference case at equilibrium",
            f"axial stress at {100.0 * strain:.1f} % at equilibrium, {count} increments",
            "kPa",
            float(np.interp(strain, curves[400].x, curves[400].y)) / 1e3,
            float(np.interp(strain, curves[count].x, curves[count].y)) / 1e3,
            2.0e-2,
            "400 increments",
            note=note if (count, strain) == (200, 0.010) else "",
        )
        for count in (100, 200)
        for strain in (0.010, 0.016)
    ]


def compression_equilibrium() -> list[Row]:
    """What the input of the path of equilibrium tells its reader to expect."""
    result = shipped("compression_equilibrium", threads=2)
    curve = stress_strain(result)
    top, strain_at_top = peak(curve)
    frame = result.frame(strain=0.010)
    largest = float(np.max(frame["plastic_strain"][result.body]))
    ratio = measure_band(result, strain=0.010).bands.ratio
    given = "its input"
    lines = [
        ("peak axial stress", "kPa", 173.0, top / 1e3, 3.0e-3, given),
        ("strain at the peak", "%", 0.345, 100.0 * strain_at_top, 1.0e-2, given),
        ("axial stress at 1 %", "kPa", 29.0, curve.at(0.010) / 1e3, 2.0e-2, given),
        ("largest alpha at 1.0 %", "1", 0.23, largest, 2.5e-2, given),
    ]  # fmt: skip
    name = "path of equilibrium"
    rows = [Row(name, f"{what}, {name}", *rest) for what, *rest in lines]
    one_band = f"weaker over stronger band at 1 %, {name}: one band"
    return [*rows, Row(name, one_band, "1", 0.0, ratio, 0.25, given, scale=1.0)]


def compression() -> list[Row]:
    """The reference case against an independent calculation (doc/verification.md)."""
    result = shipped("compression")
    curve = stress_strain(result)
    top, strain_at_top = peak(curve)
    history = result.history()
    found = [
        ("peak axial stress", "kPa", 172.2, top / 1e3, 1.0e-2),
        ("strain at the peak", "%", 0.349, 100.0 * strain_at_top, 2.0e-2),
        ("axial stress at 1 %", "kPa", 40.6, curve.at(0.010) / 1e3, 2.0e-2),
    ]
    for strain, alpha in ((0.010, 0.200), (0.013, 0.244), (0.016, 0.282)):
        frame = result.frame(strain=strain)
        largest = float(np.max(frame["plastic_strain"][result.body]))
        found.append((f"largest alpha at {100 * strain:.1f} %", "1", alpha, largest, 2.0e-2))
    rows = [Row("compression", *line, "independent") for line in found]
    first_yield = SIGMA_Y / float(np.sqrt(1.0 - NU + NU**2))
    factor = 1.0 + result.spacing / result.width  # of uniform volumes
    what, exact = "peak: first yield times 1 + dx/width", first_yield * factor / 1e3
    rows.append(Row("compression", what, "kPa", exact, top / 1e3, 5.0e-3, "closed form"))
    error = float(np.max(np.abs(history["energy_error"])))
    rows.append(
        Row("compression", "largest energy_error", "1", 0.0, error, 1.0e-3, "closed form", 1.0)
    )
    bands = measure_band(result, strain=0.010)
    at_end = measure_band(result, strain=0.013)
    for label, band, ratio in (
        ("weaker over stronger band at 1 %: X", bands, 0.317),
        ("weaker over stronger band at 1.3 %: one band", at_end, 0.236),
    ):
        rows.append(Row("compression", label, "1", ratio, band.bands.ratio, 5.0e-2, "independent"))
    rows.append(
        Row(
            "compression",
            "angle of the prevailing band at 1 %",
            "degrees",
            45.0,
            bands.bands.prevailing.angle,
            7.0e-2,
            "paper",
        )
    )
    return rows


def perfect() -> list[Row]:
    """The perfect specimen: X at 1 %, then whichever band round-off favours.

    Round-off decides how far one band is ahead, so the tolerances are wide.
    """
    result = shipped("compression_perfect")
    last = result.last_frame
    largest = float(np.max(last["plastic_strain"][result.body]))
    ratio = measure_band(result, strain=0.010).bands.ratio
    return [
        Row(
            "perfect",
            "largest alpha at 1.6 %, perfect",
            "1",
            0.295,
            largest,
            8.5e-2,
            "independent",
        ),
        Row(
            "perfect",
            "weaker over stronger band at 1 %, perfect: X",
            "1",
            0.5,
            ratio,
            0.5,
            "independent",
        ),
    ]


CASES: dict[str, Callable[[], list[Row]]] = {
    "modulus": moduli,
    "elastic": uniaxial,
    "plateau": plateau,
    "measures": measures,
    "softening": softening,
    "cyclic": cyclic,
    "wave": wave,
    "pressure": pressure,
    "traction": traction,
    "isotropic": isotropic,
    "compression": compression,
    "perfect": perfect,
    "footing": footing,
    "compression_at_equilibrium": compression_at_equilibrium,
    "compression_equilibrium": compression_equilibrium,
}


def table(rows: list[Row]) -> list[list[str]]:
    """The rows as text."""
    head = "quantity unit reference computed difference tolerance error verdict from"
    lines = [head.split()]
    for row in rows:
        lines.append(
            [
                row.quantity,
                row.unit,
                f"{row.exact:.5g}",
                f"{row.computed:.5g}",
                f"{row.computed - row.exact:+.2g}",
                f"{row.allowed:.2g}",
                f"{100.0 * row.error:+.3f} %",
                "ok" if row.passed else "FAILED",
                row.source,
            ]
        )
    return lines


def print_table(rows: list[Row]) -> None:
    lines = table(rows)
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
    for line in lines:
        print("  ".join(text.ljust(width) for text, width in zip(line, widths)).rstrip())
    for row in rows:
        if row.note:
            print(row.note)


def save(rows: list[Row], results: Path) -> None:
    """verify.json for programs, verify.md for doc/verification_table.md."""
    results.mkdir(parents=True, exist_ok=True)
    data = [vars(row) | {"error": row.error, "passed": row.passed} for row in rows]
    (results / "verify.json").write_text(json.dumps(data, indent=1) + "\n")
    lines = table(rows)
    lines.insert(1, ["---"] * len(lines[0]))
    command = [str(PROGRAM), "--version"]
    version = subprocess.run(command, capture_output=True, text=True, check=True)
    text = [f"Printed by `make verify`, {version.stdout.strip()}, {platform.machine()}, "]
    text[0] += f"{date.today().isoformat()}:\n"
    text += ["| " + " | ".join(line) + " |" for line in lines]
    text += [f"\n{row.note}" for row in rows if row.note]
    (results / "verify.md").write_text("\n".join(text) + "\n")


def publish() -> None:
    """Put verify.md between the markers of doc/verification_table.md."""
    page = ROOT / "doc" / "verification_table.md"
    begin, end = "<!-- verify: begin -->", "<!-- verify: end -->"
    before, rest = page.read_text().split(begin)
    after = rest.split(end)[1]
    table_text = (RESULTS / "verify.md").read_text()
    page.write_text(f"{before}{begin}\n{table_text}{end}{after}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", nargs="*", metavar="CASE", help="only these cases")
    parser.add_argument(
        "--publish", action="store_true", help="put the table into doc/verification_table.md"
    )
    parser.add_argument("--list", action="store_true", help="list the cases")
    arguments = parser.parse_args()
    unknown = set(arguments.cases) - set(CASES)
    if arguments.list or unknown:
        print("cases:", ", ".join(CASES))
        return 1 if unknown else 0
    wanted = arguments.cases or list(CASES)
    rows: list[Row] = []
    failures: list[str] = []
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        jobs = {name: pool.submit(CASES[name]) for name in wanted}
        for name, job in jobs.items():
            try:
                rows += job.result()
            except (PostError, RuntimeError) as problem:
                failures.append(f"{name}: {problem}")
    print_table(rows)
    if not arguments.cases:
        save(rows, RESULTS)
    if arguments.publish and not arguments.cases:
        publish()
    for failure in failures:
        print("could not run:", failure, file=sys.stderr)
    failed = len(failures) + sum(not row.passed for row in rows)
    print(f"{len(rows) + len(failures) - failed} passed, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
