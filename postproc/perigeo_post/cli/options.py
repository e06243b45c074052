"""Options that commands share, and what they all do with figures and files."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..measure.export import to_json
from ..read.errors import RequestError
from ..read.outputs import FIGURE, PAGE, TABLE, check_output

Arguments = argparse.Namespace


@contextmanager
def extra(name: str) -> Iterator[None]:
    """Around the imports of a command whose packages are an extra of their own."""
    try:
        yield
    except ModuleNotFoundError as error:
        if (error.name or "perigeo_post").partition(".")[0] == "perigeo_post":
            raise
        raise RequestError(
            f"perigeo-post {name} needs {error.name}, which is not installed; to install it, type "
            f"in the folder of perigeo: {sys.executable} -m pip install './postproc[{name}]'"
        ) from None


def strain_value(text: str) -> float:
    """A strain as a number (0.01) or in per cent (1%)."""
    try:
        return float(text[:-1]) / 100.0 if text.endswith("%") else float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a strain; write 0.01 or 1%") from None


def given_path(text: str) -> Path:
    """A path as it is typed: ~ is the home folder, also where the shell has left it alone."""
    try:
        return Path(text).expanduser()
    except RuntimeError:
        raise argparse.ArgumentTypeError(f"'{text}': the home folder is not known") from None


def add_output(parser: argparse.ArgumentParser, csv: str | None = None) -> None:
    parser.add_argument(
        "-o", "--output", metavar="FIGURE", type=given_path,
        help="file to write, .png, .pdf, .svg or .eps (default: beside the first result)",
    )  # fmt: skip
    add_json(parser)
    if csv:
        parser.add_argument("--csv", metavar="FILE", type=given_path, help=csv)


def add_json(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--json", action="store_true",
        help="print the numbers as JSON; draws only where -o is given too",
    )  # fmt: skip


def add_files(parser: argparse.ArgumentParser, many: bool = True) -> None:
    if many:
        parser.add_argument(
            "files", metavar="FILE.h5", nargs="+", type=given_path, help="result file"
        )
    else:
        parser.add_argument("file", metavar="FILE.h5", type=given_path, help="result file")


def add_state(parser: argparse.ArgumentParser, many: bool = False) -> None:
    number: dict[str, Any] = {"nargs": "+"} if many else {}
    which = parser.add_mutually_exclusive_group()
    which.add_argument(
        "--strain", metavar="S", type=strain_value, help="nominal strain, 0.01 or 1%%", **number
    )
    which.add_argument("--time", metavar="T", type=float, help="time [s]", **number)
    which.add_argument("--frame", metavar="N", type=int, help="number of the frame", **number)
    parser.add_argument(
        "--tolerance", metavar="D", type=float,
        help="largest distance of the frame from the strain or time asked for (default: 2 %%)",
    )  # fmt: skip


def add_colours(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--field", default="plastic_strain", metavar="NAME", help="field to show "
                        "(default: plastic_strain); 'perigeo-post info' lists them")  # fmt: skip
    parser.add_argument(
        "--deformed", metavar="SCALE", type=float, nargs="?", const=1.0,
        help="deformed shape, displacements times SCALE (default 1)",
    )  # fmt: skip
    parser.add_argument(
        "--smooth", action="store_true",
        help="displacements without zero-energy modes: affine fits over the families",
    )  # fmt: skip
    parser.add_argument("--min", metavar="V", type=float, help="low end of the colours, SI units")
    parser.add_argument("--max", metavar="V", type=float, help="high end of the colours, SI units")


def add_signs(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--tension-positive", action="store_true",
        help="tension positive in stress-strain curves (default: compression positive)",
    )  # fmt: skip


def add_labels(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--labels", metavar="TEXT", nargs="+", help="labels of the runs (default: their names)"
    )


def check_outputs(args: Arguments) -> None:
    """Refuse outputs that would destroy something, before anything is computed."""
    if args.command in ("study", "export"):
        return  # its output is a folder of its own
    inputs = [*getattr(args, "files", []), *([args.file] if hasattr(args, "file") else [])]
    kinds = {"output": PAGE if args.command == "report" else FIGURE, "csv": TABLE, "table": TABLE}
    asked = {name: path for name in kinds if (path := getattr(args, name, None)) is not None}
    for name, path in asked.items():
        check_output(path, kinds[name], inputs)
    if len({path.resolve() for path in asked.values()}) < len(asked):
        raise RequestError("two outputs have one name: the second would replace the first")


def beside(file: Path, kind: str, ending: str = ".png") -> Path:
    """Where a figure goes when no name is given: beside the result, named after it."""
    return file.with_name(f"{file.stem}_{kind}{ending}")


def draw_figure(args: Arguments, file: Path, kind: str, draw: Callable[[], Any]) -> None:
    if args.json and args.output is None:
        return
    from ..draw.style import check_figure_path, save_figure

    path = args.output or beside(file, kind)
    check_figure_path(path)
    say(args, save_figure(draw(), path))


def print_json(value: Any) -> None:
    """Numbers on standard output, also where that cannot show every letter."""
    encoding = getattr(sys.stdout, "encoding", None) or "ascii"
    plain = "utf" not in encoding.lower()
    print(to_json(value, only_ascii=plain))


def say(args: Arguments, path: Path) -> None:
    """Name a file that was written; not among the numbers of --json."""
    print(f"wrote {path}", file=sys.stderr if args.json else sys.stdout)
