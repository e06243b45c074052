"""`perigeo-post info`: what a result holds and how far it has come."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np

from ..measure import measures
from ..read.numerals import fixed
from ..read.run import Run
from .options import Arguments, add_files, add_json, print_json


def add_options(parser: argparse.ArgumentParser) -> None:
    add_files(parser)
    add_json(parser)
    parser.add_argument("--input", action="store_true", help="print the namelist of the run")
    parser.add_argument("--values", action="store_true", help="print all input values as used")


def carry_out(args: Arguments) -> None:
    runs = [Run(path) for path in args.files]
    if args.input or args.values:
        for run in runs:
            if args.input:
                _print_bytes(run.input_bytes)
            if args.values:
                print("\n".join(f"{key} = {value}" for key, value in run.values.items()))
        return
    facts = [measures.run_facts(run) for run in runs]
    if args.json:
        print_json(facts[0] if len(facts) == 1 else facts)
        return
    print("\n\n".join(_info_text(f) for f in facts))


def _print_bytes(text: bytes) -> None:
    """Print an input byte for byte, whatever the encodings of the input and of the terminal."""
    sys.stdout.flush()
    sys.stdout.buffer.write(text)
    if not text.endswith(b"\n") and sys.stdout.isatty():
        sys.stdout.buffer.write(b"\n")  # the prompt
    sys.stdout.buffer.flush()


def _info_text(facts: dict[str, Any]) -> str:
    size = np.asarray(facts["upper"]) - np.asarray(facts["lower"])
    state = "complete" if facts["complete"] else "not complete: still running, or stopped early"
    layout = "lattice" if facts["on_lattice"] else "cloud"
    lines = [
        f"{facts['name']}: {facts['title']}",
        f"  file         {facts['file']} ({state})",
        f"  body         {size[0]:g} m x {size[1]:g} m, {facts['body_points']} points ({layout}), "
        f"{facts['fictitious_points']} fictitious",
        f"  spacing      {facts['spacing']:g} m, horizon {facts['horizon']:g} m",
        f"  loading axis {facts['loading_axis'] or 'none (no platens)'}"
        + (f", boundaries: {', '.join(facts['boundaries'])}" if facts["boundaries"] else ""),
        *_fields_text(facts),
        "  frames       number    step       time [s]    strain    largest plastic strain",
    ]
    for f in facts["frames"]:
        number = "failed" if f["number"] is None else f["number"]
        strain = f"{f['strain']:9.6f}" if np.isfinite(f["strain"]) else "        -"
        note = "" if f["valid"] else "   (failing state, left out unless asked for)"
        lines.append(
            f"               {number:>6} {f['step']:>8} {f['time']:13.6g} {strain} "
            f"{f['largest_plastic_strain']:12.5g}{note}"
        )
    lines += _history_text(facts["history"])
    if "factor_of_safety" in facts:
        borne, not_borne = facts["factor_of_safety"].values()
        rest = f", {not_borne:.4g} is not" if np.isfinite(not_borne) else ", and none was not"
        lines.append(f"  safety       a factor of {borne:.4g} is borne{rest}")
    lines += _trust_text(facts)
    lines += [f"  {key:<14} {value}" for key, value in facts["provenance"].items()]
    return "\n".join(lines)


def _trust_text(facts: dict[str, Any]) -> list[str]:
    """Doubts that were told, the frames that come after one, and the quality at the end."""
    lines = []
    for doubt in facts["doubts"]:
        found = f"{doubt['value']:.4g} ({doubt['bound']}): " if doubt["bound"] else ""
        when = f"step {doubt['step']}" if doubt["step"] else "the start"
        lines.append(f"  warning      {doubt['name']} at {when}: {found}{doubt['meaning']}")
    first = min((d["step"] for d in facts["doubts"] if d["step"]), default=None)
    if first is not None:
        after = [f for f in facts["frames"] if f["valid"] and f["step"] >= first]
        lines.append(f"               {len(after)} of the frames come at or after step {first}")
    if lines:
        lines.append("               what they mean: doc/doubts.md, doc/limits.md")
    if facts["quality"]:
        words = ", ".join(f"{key} {value:.3g}" for key, value in facts["quality"].items())
        lines.append(f"  quality      {words}")
    return lines


def _fields_text(facts: dict[str, Any]) -> list[str]:
    """The fields of the file with their units, then those derived from them."""
    stored = facts["stored_fields"]
    if not stored:
        return ["  fields       none written yet"]
    items = [
        _named(name, about["unit"])
        + (f" ({' '.join(about['components'])})" if about["components"] else "")
        for name, about in stored.items()
    ]
    parts = {f"{name}_{part}" for name, about in stored.items() for part in about["components"]}
    derived = [name for name in facts["fields"] if name not in stored and name not in parts]
    lines = [f"  fields       {', '.join(items)}"]
    return lines + ([f"  derived      {', '.join(derived)}"] if derived else [])


def _named(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


def _history_text(history: dict[str, Any]) -> list[str]:
    if "missing" in history:
        return [f"  history      {history['missing']}"]
    columns = [_named(name, unit) for name, unit in history["columns"].items()]
    lines = [
        f"  history      {history['rows']} rows in {Path(history['file']).name}: "
        f"{', '.join(columns)}"
    ]
    if history.get("peak_stress") is not None and history["rows"]:
        lines.append(
            f"  peak stress  {fixed(history['peak_stress'] / 1e3, 2)} kPa at a strain of "
            f"{history['strain_at_peak']:.6f} (compression positive)"
        )
        modulus = history.get("apparent_modulus")
        text = f"{fixed(modulus / 1e6, 2)} MPa" if modulus is not None else "not determined: "
        reason = history.get("apparent_modulus_missing", "")
        lines.append(f"  E_app        {text}{reason}")
    if "curve_missing" in history:
        lines.append(f"  axial stress not shown: {history['curve_missing']}")
    lines += _loads_text(history.get("limit_loads", []))
    if "largest_energy_error" in history:
        lines.append(f"  energy error {history['largest_energy_error']:.2e} at most")
    return lines


def _loads_text(loads: list[dict[str, Any]]) -> list[str]:
    """Whether the forces of boundaries that move have settled, and their peaks."""
    lines = []
    for one in loads:
        way = f"the last fifth of {one['way']:.4g} m"
        if one["missing"]:
            words = f"not known: {one['missing']}"
        elif one["reached"]:
            words = f"{_force(one['load'])}; it changes by {one['change']:.2%} over {way}"
        else:
            words = f"no limit load yet: the force changes by {one['change']:.2%} over {way}"
        lines.append(f"  limit load   {one['boundary']}: {words}")
        strain = one["strain_at_peak"]
        at = f"{one['time_at_peak']:.4g} s" + (
            f", a strain of {strain:.6f}" if np.isfinite(strain) else ""
        )
        lines.append(f"               its largest force is {_force(one['peak'])} at {at}")
    return lines


def _force(value: float) -> str:
    return f"{fixed(value / 1e3, 3)} kN/m"
