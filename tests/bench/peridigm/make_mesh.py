"""Write the points and node sets of `compression.yaml`, for Peridigm.

The specimen of input/compression.nml, 51 x 101 points with layers beyond its ends, in two layers
out of plane. Files of text in the folder that is asked for:

    points.txt      x y z block volume, one line a point [m, m^3]
    all.txt         numbers of all points, the first is 1
    bottom.txt      those of the layer below the specimen
    top.txt         those of the layer above it

    make_mesh.py [--m M] [--columns N] [--rows N] [--sheets N] [FOLDER]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

SPACING = 0.02  # [m]


def points(
    columns: int, rows: int, sheets: int, layer: int
) -> list[tuple[float, float, float, str]]:
    """Position of every point, and the set that it belongs to."""
    found = []
    for k in range(sheets):
        for j in range(-layer, rows + layer):
            name = "bottom" if j < 0 else "top" if j >= rows else ""
            found += [(i * SPACING, j * SPACING, k * SPACING, name) for i in range(columns)]
    return found


def directed_bonds(columns: int, rows: int, sheets: int, m: int) -> int:
    """Number of pairs (i, j) with j in the family of i, bonds of length m spacings included."""
    total = 0
    for x in range(-m, m + 1):
        for y in range(-m, m + 1):
            for z in range(1 - sheets, sheets):
                if 0 < x * x + y * y + z * z <= m * m:
                    total += (columns - abs(x)) * (rows - abs(y)) * (sheets - abs(z))
    return total


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", default=".", type=Path, help="where to write")
    parser.add_argument("--m", type=int, default=3, help="horizon over spacing (default: 3)")
    parser.add_argument("--columns", type=int, default=51, help="points across (default: 51)")
    parser.add_argument("--rows", type=int, default=101, help="points along (default: 101)")
    parser.add_argument("--sheets", type=int, default=2, help="layers out of plane (default: 2)")
    given = parser.parse_args()
    if min(given.m, given.columns, given.rows) < 1 or given.sheets < 2:
        parser.error("m, columns and rows must be 1 or more, sheets 2 or more")

    found = points(given.columns, given.rows, given.sheets, given.m)
    given.folder.mkdir(parents=True, exist_ok=True)
    lines = ["# x y z block volume"]
    lines += [f"{x:.6f} {y:.6f} {z:.6f} 1 {SPACING**3:.9e}" for x, y, z, _ in found]
    (given.folder / "points.txt").write_text("\n".join(lines) + "\n")
    for name in ("bottom", "top", "all"):
        numbers = [k for k, point in enumerate(found, start=1) if name in ("all", point[3])]
        (given.folder / f"{name}.txt").write_text("".join(f"{k}\n" for k in numbers))

    bonds = directed_bonds(given.columns, given.rows + 2 * given.m, given.sheets, given.m)
    print(
        f"points          {len(found)}, of which in the layers "
        f"{2 * given.m * given.columns * given.sheets}"
    )
    print(f"directed bonds  {bonds}; per point {bonds / len(found):.1f}")
    print(f"horizon         {given.m * SPACING + 1e-5:.5f} m: the value for compression.yaml")
    return 0


if __name__ == "__main__":
    sys.exit(main())
