"""`perigeo-post contours` and `animate`: a field at one, several or all states."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..measure import export, measures
from ..measure.smooth import are_smoothed, smoothed_for
from ..read.labels import labels_of
from ..read.run import Frame, Run
from .options import (
    Arguments,
    add_colours,
    add_files,
    add_json,
    add_labels,
    add_output,
    add_state,
    beside,
    draw_figure,
    given_path,
    print_json,
    say,
)

MOST_PANELS = 6
FILM = 12  # frames from which a film moves


def add_options(parser: argparse.ArgumentParser) -> None:
    add_files(parser)
    add_output(parser, "write the values at all points to a CSV file")
    add_state(parser, many=True)
    add_colours(parser)
    add_labels(parser)
    parser.add_argument("--fictitious", action="store_true", help="show fictitious points as well")
    parser.add_argument("--include-invalid", action="store_true",
                        help="take frames of a failing state as well")  # fmt: skip
    parser.add_argument("--colours", metavar="MAP", help="matplotlib colour map")
    parser.add_argument("--column", choices=["single", "double"],
                        help="width of the figure: 88 or 180 mm")  # fmt: skip


def chosen_frames(
    run: Run,
    strains: Sequence[float] | None = None,
    times: Sequence[float] | None = None,
    numbers: Sequence[int] | None = None,
    tolerance: float | None = None,
    include_invalid: bool = False,
) -> list[Frame]:
    """The frames asked for; without any request all after the first, at most six of them."""
    if strains:
        return [run.frame(strain=s, tolerance=tolerance, include_invalid=include_invalid)
                for s in strains]  # fmt: skip
    if times:
        return [run.frame(time=t, tolerance=tolerance, include_invalid=include_invalid)
                for t in times]  # fmt: skip
    if numbers:
        return [run.frame(number=n, include_invalid=include_invalid) for n in numbers]
    frames = run.frames(include_invalid)
    if not frames:
        return [run.last_frame]
    later = [f for f in frames if f.number != 0] or frames
    if len(later) <= MOST_PANELS:
        return later
    picked = np.unique(np.rint(np.linspace(0, len(later) - 1, MOST_PANELS)).astype(int))
    return [later[k] for k in picked]


def shown_frames(args: Arguments, frames: list[Frame]) -> list[Frame]:
    """The frames, with smoothed displacements where that is asked for."""
    if not args.smooth:
        return frames
    return [smoothed_for(frame, args.field, args.deformed) for frame in frames]


def carry_out(args: Arguments) -> None:
    runs = [Run(path) for path in args.files]
    names = measures.labels_for(runs, args.labels)
    frames: list[Frame] = []
    titles: list[str] = []
    for run, name in zip(runs, names):
        found = chosen_frames(
            run, args.strain, args.time, args.frame, args.tolerance, args.include_invalid
        )
        frames += shown_frames(args, found)
        labels = labels_of(found)
        titles += labels if len(runs) == 1 else [f"{name}\n{label}" for label in labels]
    if args.csv:
        say(args, export.write_points(args.csv, frames, args.field))
    if args.json:
        print_json([frame_numbers(f, args.field, args.fictitious) for f in frames])

    def draw() -> Any:
        from ..draw.panels import contour_figure

        return contour_figure(
            frames, args.field, args.deformed, args.fictitious, args.min, args.max,
            args.colours, titles, args.column,
        )  # fmt: skip

    draw_figure(args, args.files[0], args.field, draw)


def frame_numbers(frame: Frame, name: str, fictitious: bool = False) -> dict[str, Any]:
    field = frame.scalar(name)
    keep = np.ones(len(field.values), dtype=bool) if fictitious else frame.run.body
    values, places = field.values[keep], frame.run.positions[keep]
    numbers: dict[str, Any] = {
        "run": frame.run.name, "frame": frame.number, "step": frame.step, "time": frame.time,
        "strain": frame.strain, "valid": frame.valid, "field": name, "unit": field.unit,
        "smoothed": are_smoothed([frame]),
        "min": None, "max": None, "mean": None, "position_of_max": None,
    }  # fmt: skip
    good = np.isfinite(values)
    if good.any():
        weights = frame.run.volumes[keep][good]
        top = int(np.nanargmax(np.where(good, values, np.nan)))
        numbers.update(
            min=values[good].min(), max=values[good].max(),
            mean=np.average(values[good], weights=weights), position_of_max=places[top],
        )  # fmt: skip
    return numbers


def add_animate_options(parser: argparse.ArgumentParser) -> None:
    add_files(parser, many=False)
    parser.add_argument("-o", "--output", metavar="FILE", type=given_path,
                        help="file to write, .gif or .mp4 (default: a GIF beside it)")  # fmt: skip
    add_json(parser)
    add_colours(parser)
    parser.add_argument("--fictitious", action="store_true", help="show fictitious points as well")
    parser.add_argument("--include-invalid", action="store_true",
                        help="show the failing state as well")  # fmt: skip
    parser.add_argument("--fps", type=float, default=5.0, help="frames a second (5)")


def carry_out_animate(args: Arguments) -> None:
    from ..draw.animation import animate

    run = Run(args.file)
    frames = shown_frames(args, run.frames(args.include_invalid))
    if args.json:
        print_json([frame_numbers(f, args.field, args.fictitious) for f in frames])
        if args.output is None:
            return
    path = args.output or beside(args.file, args.field, ".gif")
    if len(frames) < FILM:
        print(
            f"perigeo-post: a film of {len(frames)} frames: all that the result has; a run writes "
            "more with frame_count or frame_times in &output",
            file=sys.stderr,
        )
    say(args, animate(
        frames, path, args.field, args.deformed, args.fictitious, args.min, args.max, args.fps
    ))  # fmt: skip
