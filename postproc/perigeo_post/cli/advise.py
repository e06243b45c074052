"""`perigeo-post advise`: an input to start from, for a soil and a size; doc/own_test.md."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable

from ..read.errors import RequestError
from .advice import Soil, Test, footing, specimen
from .options import Arguments

_KINDS: dict[str, Callable[[Soil, Test], str]] = {"specimen": specimen, "footing": footing}


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--cu", metavar="PA", type=float, required=True, help="undrained shear strength [Pa]"
    )
    parser.add_argument(
        "--eu", metavar="PA", type=float,
        help="undrained Young's modulus [Pa] (default: 600 cu)",
    )  # fmt: skip
    parser.add_argument(
        "--size", metavar="M", type=float, nargs="+", required=True,
        help="width and height of a specimen, or width of a footing [m]",
    )  # fmt: skip
    parser.add_argument(
        "--kind", choices=list(_KINDS), default="specimen",
        help="plane strain compression, or a rough strip footing (default: specimen)",
    )  # fmt: skip
    parser.add_argument(
        "--sensitivity", metavar="S", type=float, default=1.0,
        help="peak over residual strength (default: 1, no softening)",
    )  # fmt: skip
    parser.add_argument(
        "--slip", metavar="M", type=float,
        help="slip in a band at which the residual strength is reached [m] (default: half as "
        "brittle as what breaks at once)",
    )  # fmt: skip
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--spacing", metavar="M", type=float, help="distance of the points [m]")
    size.add_argument(
        "--points", metavar="N", type=int, default=20,
        help="points across the smaller size (default: 20)",
    )  # fmt: skip
    parser.add_argument(
        "--horizon", metavar="M", type=float,
        help="horizon [m] (default: 3 spacings; 4 with softening)",
    )  # fmt: skip
    parser.add_argument(
        "--method", choices=["equilibrium", "verlet"], default="equilibrium",
        help="path of equilibrium, or motion in time (default: equilibrium)",
    )  # fmt: skip
    parser.add_argument(
        "--nu", metavar="NU", type=float, default=0.49, help="Poisson's ratio (default: 0.49)"
    )
    parser.add_argument(
        "--density", metavar="RHO", type=float, default=1900.0,
        help="density [kg/m^3] (default: 1900)",
    )  # fmt: skip
    parser.add_argument("--name", default="own_test", help="name of the run (default: own_test)")


def carry_out(args: Arguments) -> None:
    sizes = 2 if args.kind == "specimen" else 1
    if len(args.size) != sizes:
        raise RequestError(f"--size: --kind {args.kind} takes {sizes}, given {len(args.size)}")
    for name in ("cu", "eu", "slip", "spacing", "points", "horizon", "density"):
        _check(name, getattr(args, name), 0.0, math.inf)
    _check("nu", args.nu, 0.0, 0.5)
    for size in args.size:
        _check("size", size, 0.0, math.inf)
    if not 1.0 <= args.sensitivity < math.inf:
        raise RequestError(f"--sensitivity: {args.sensitivity:g}; it must be at least 1")
    if args.slip is not None and not args.sensitivity > 1.0:
        raise RequestError("--slip goes with --sensitivity above 1")
    if args.kind == "footing" and args.sensitivity > 1.0 and args.slip is None:
        raise RequestError("--kind footing with --sensitivity needs --slip")
    soil = Soil(
        args.cu, args.eu or 600.0 * args.cu, args.nu, args.density, args.sensitivity, args.slip
    )
    least = min(args.size)
    spacing = args.spacing or least / args.points
    if spacing > least / 4.0:
        raise RequestError(f"spacing {spacing:g} m: fewer than 4 points across {least:g} m")
    horizon = args.horizon or (4.0 if soil.softens else 3.0) * spacing
    if horizon < 2.0 * spacing:
        raise RequestError(f"--horizon: {horizon:g} m is below two spacings of {spacing:g} m")
    test = Test(args.name, args.size, spacing, horizon, args.method)
    print(_KINDS[args.kind](soil, test), end="")


def _check(name: str, value: float | None, above: float, below: float) -> None:
    """Report a value that is not between two bounds."""
    if value is not None and not above < value < below:
        end = "" if below == math.inf else f" and below {below:g}"
        raise RequestError(f"--{name}: {value:g}; it must be above {above:g}{end}")
