"""The command line ``perigeo-post``: reads options, calls the functions, prints.

Exit status: 0 done, 1 wrong command line or something asked for that the result does not hold,
2 a result that cannot be read or a study file that is wrong, 4 a study in which a run failed or a
figure could not be drawn, 5 a file that cannot be written, 130 and 143 stopped by a signal.

What draws, does studies or writes the report is imported by the commands that need it, when they
run: the others work without matplotlib.
"""

from __future__ import annotations

import argparse
import io
import os
import re
import sys
import textwrap
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

from ..read.errors import PostError
from ..version import __version__
from . import advise, band, compare, contours, curves, export, geometry, info, report, study
from .options import Arguments, check_outputs


class _Parser(argparse.ArgumentParser):
    """Exit status 1 for a wrong command line, as the program perigeo has it.

    What begins like a negative number is a value, never an option: -2e5, -0.5%.
    """

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._negative_number_matcher = re.compile(r"-\.?\d")

    def error(self, message: str) -> NoReturn:
        self.print_usage(sys.stderr)
        print(f"{self.prog}: error: {message}", file=sys.stderr)
        raise SystemExit(1)


_Setup = Callable[[argparse.ArgumentParser], None]
_Action = Callable[[Arguments], Any]  # gives the exit status; None: 0
COMMANDS: dict[str, tuple[_Setup, _Action, str, str]] = {
    "info": (
        info.add_options, info.carry_out,
        "what a result holds and how far it has come",
        """\
        perigeo-post info results/compression/compression.h5
        perigeo-post info run.h5 --json
        perigeo-post info run.h5 --input > again.nml""",
    ),
    "curves": (
        curves.add_options, curves.carry_out,
        "stress-strain curves, settlements, energies, any column of the history",
        """\
        perigeo-post curves run.h5 -o curve.pdf --mark 1% 1.3% 1.6%
        perigeo-post curves a.h5 b.h5 --labels "m = 3" "m = 4" --csv curves.csv
        perigeo-post curves run.h5 --energies --against time
        perigeo-post curves run.h5 --settlement footing
        perigeo-post curves run.h5 --x wall_displacement_x --y wall_force_x
        perigeo-post curves run.h5 --x time --y top_force_x top_force_y""",
    ),
    "contours": (
        contours.add_options, contours.carry_out,
        "a field at one or several states, on one colour scale",
        """\
        perigeo-post contours run.h5
        perigeo-post contours run.h5 --strain 1% 1.3% 1.6% -o bands.pdf
        perigeo-post contours run.h5 --field stress_yy --frame 3 --deformed 10""",
    ),
    "band": (
        band.add_options, band.carry_out,
        "width, angle and place of the shear bands",
        """\
        perigeo-post band run.h5
        perigeo-post band run.h5 --strain 0.01 --json
        perigeo-post band run.h5 --line 0 0.5 1 1.5 --csv profile.csv --table bands.csv""",
    ),
    "compare": (
        compare.add_options, compare.carry_out,
        "several runs side by side, with a table",
        """\
        perigeo-post compare a.h5 b.h5 --labels coarse fine --strain 1%
        perigeo-post compare a.h5 b.h5 --at 0.5% 1% --table table.csv""",
    ),
    "animate": (
        contours.add_animate_options, contours.carry_out_animate,
        "GIF or MP4 of a field over all frames",
        """\
        perigeo-post animate run.h5
        perigeo-post animate run.h5 --field von_mises --deformed 5 -o run.mp4""",
    ),
    "export": (
        export.add_options, export.carry_out,
        "frames for other programs: VTU with PVD, or CSV",
        """\
        perigeo-post export run.h5
        perigeo-post export run.h5 --format csv --strain 1% --field stress plastic_strain""",
    ),
    "advise": (
        advise.add_options, advise.carry_out,
        "an input to start from, for a soil and a size",
        """\
        perigeo-post advise --cu 50e3 --eu 30e6 --size 0.05 0.1 > own_test.nml
        perigeo-post advise --cu 20e3 --sensitivity 4 --slip 0.002 --size 0.05 0.1
        perigeo-post advise --cu 50e3 --eu 30e6 --kind footing --size 2 --points 10""",
    ),
    "geometry": (
        geometry.add_options, geometry.carry_out,
        "the body of an input before it is run: points, boundaries, loads",
        """\
        perigeo-post geometry RUN.nml -o body.png
        perigeo-post geometry RUN.nml --set discretisation.spacing=0.05 --json""",
    ),
    "study": (
        study.add_options, study.carry_out,
        "many runs from one file: what to vary, to measure and to draw",
        """\
        perigeo-post study studies/horizon.toml
        perigeo-post study studies/horizon.toml --dry-run
        perigeo-post study my_study.toml --output results/trial --only 'm_*' --jobs 1
        perigeo-post study my_study.toml --figures-only""",
    ),
    "report": (
        report.add_options, report.carry_out,
        "one page with all studies: results/report.html",
        """        perigeo-post report
        perigeo-post report --results results -o page.html
        perigeo-post report --publish doc/verification.md""",
    ),
}  # fmt: skip


def parser() -> argparse.ArgumentParser:
    """The whole command line."""
    top = _Parser(
        prog="perigeo-post",
        description="Numbers and figures from the results of perigeo.",
        epilog="'perigeo-post COMMAND --help' explains a command and shows examples.",
    )
    top.add_argument("--version", action="version", version=f"perigeo-post {__version__}")
    commands = top.add_subparsers(
        dest="command", metavar="COMMAND", required=True, parser_class=_Parser
    )
    for name, (setup, action, words, examples) in COMMANDS.items():
        sub = commands.add_parser(
            name,
            help=words,
            description=words[:1].upper() + words[1:] + ".",
            epilog="examples:\n" + textwrap.indent(textwrap.dedent(examples), "  "),
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        setup(sub)
        sub.set_defaults(action=action)
    return top


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # letters that a terminal cannot show are no error
            stream.reconfigure(errors="backslashreplace")
    try:
        args = parser().parse_args(argv)
        check_outputs(args)
        status = args.action(args)
        sys.stdout.flush()
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else 1
    except PostError as error:
        for line in str(error).splitlines():
            print(f"perigeo-post: error: {line}", file=sys.stderr)
        return error.exit_status
    except BrokenPipeError:  # the reader of a pipe has gone
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except KeyboardInterrupt:
        return 130
    return status or 0


def main_entry() -> NoReturn:
    """The console script."""
    raise SystemExit(main())
