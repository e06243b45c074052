"""`perigeo-post geometry`: the body of an input, before it is run."""

from __future__ import annotations

import argparse
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from ..read.errors import RequestError
from ..read.points_file import BODY, ModelPoints, read_points_file
from .options import Arguments, add_output, draw_figure, given_path, print_json


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="RUN.nml", type=given_path, help="input file")
    add_output(parser)
    parser.add_argument(
        "--set", metavar="GROUP.KEY=VALUE", dest="settings", action="append", default=[],
        help="a value in place of that of the file, as often as needed",
    )  # fmt: skip
    parser.add_argument(
        "--program", metavar="PATH", type=given_path,
        help="the program perigeo (default: PERIGEO_BIN, bin/perigeo above RUN.nml, or on PATH)",
    )  # fmt: skip


def carry_out(args: Arguments) -> None:
    model = model_of(args.file, args.program, args.settings)
    if args.json:
        print_json(numbers_of(model))

    def draw() -> Any:
        from ..draw.geometry import geometry_figure

        return geometry_figure(model, args.file.stem)

    draw_figure(args, args.file, "geometry", draw)


def model_of(path: Path, program: Path | None, settings: list[str]) -> ModelPoints:
    """The points of an input, which the program sets up and checks."""
    from ..study.program import find_program

    if not path.is_file():
        raise RequestError(f"the input file is not there: {path}")
    found = find_program(program, path)
    with tempfile.TemporaryDirectory() as folder:
        points = Path(folder) / "points.txt"
        chosen = [word for text in settings for word in ("--set", text)]
        done = subprocess.run(
            [str(found.path), "--check", "--points", str(points), *chosen, str(path)],
            stdin=subprocess.DEVNULL, capture_output=True, check=False, text=True, errors="replace",
        )  # fmt: skip
        if done.returncode != 0:
            raise RequestError(done.stderr.strip() or f"{found.path} ended without a message")
        return read_points_file(points)


def numbers_of(model: ModelPoints) -> dict[str, Any]:
    """Points and area of every material, points of every boundary, force of every load."""
    materials, boundaries = np.array(model.materials), np.array(model.boundaries)
    body = boundaries == BODY
    return {
        "points": len(materials),
        "materials": {
            name: {"points": int((body & (materials == name)).sum()),
                   "area": float(model.volumes[body & (materials == name)].sum())}
            for name in dict.fromkeys(model.materials)
        },
        "boundaries": {
            name: int((boundaries == name).sum())
            for name in dict.fromkeys(model.boundaries) if name != BODY
        },
        "loads": {name: rows[:, 2:].sum(axis=0).tolist()
                  for name, rows in model.things.get("load", {}).items()},
    }  # fmt: skip
