"""Lower and upper bounds of limit loads by finite elements; writes bounds.json beside itself.

    python bounds.py [CASE ...]          only the cases whose names begin so
    python bounds.py --fine [CASE ...]   on a third mesh as well (minutes for each case)

Needs scipy and clarabel, see limit_analysis.py. limit_loads.py shows what stands in bounds.json.
Sides of the bodies are far enough away that the loads do not depend on where: the soil beyond
them is taken to be at rest (upper bound) and to bear what comes (lower bound).
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import numpy as np
from limit_analysis import Mesh, graded, lower, upper

FILE = Path(__file__).with_name("bounds.json")
SMALL = 1e-9
GROWTH = 1.2


def uniform(points):
    return np.ones(len(points))


def both_ways(start, left, right, first, largest):
    """Return points from left to right whose steps grow from start."""
    there = graded(start, left, first, GROWTH, largest)[::-1]
    return np.concatenate([there, graded(start, right, first, GROWTH, largest)[1:]])


def loaded(mesh, strength, part, kind, pull):
    """Return both bounds of the load on the side called 'load', per unit of its width.

    part(middle) says which side of the body it is: load, free, axis, or fixed.
    """
    kinds = {
        "load": (kind, (0.0, -1.0)),
        "free": ("free", None),
        "axis": ("smooth", (0.0, 0.0)),
        "fixed": ("rough", (0.0, 0.0)),
    }
    stresses = {"free": "free", "axis": "smooth", "fixed": "any"}
    stresses["load"] = "smooth" if kind == "smooth" else "any"
    low = lower(mesh, strength, lambda m: stresses[part(m)], lambda m: pull * (part(m) == "load"))
    high = upper(mesh, strength, lambda m: kinds[part(m)])
    return 2.0 * low, 2.0 * high  # half of the body, width 1


def trapdoor(cover, kind, first, largest):
    """Bound (sigma_s + gamma H - sigma_t) / c above a trapdoor of width 1 in a rigid base."""
    far = 0.5 + 1.1 * cover
    x = both_ways(0.5, 0.0, far, first, largest)
    mesh = Mesh(*np.meshgrid(x, graded(0.0, cover, first, GROWTH, largest), indexing="ij"))

    def part(m):
        if m[1] < SMALL:
            return "load" if m[0] < 0.5 else "fixed"
        if m[1] > cover - SMALL:
            return "free"
        return "axis" if m[0] < SMALL else "fixed"

    return mesh, *loaded(mesh, uniform, part, kind, 1.0)


def footing(ratio, kind, first, largest):
    """Bound q / c0 below a strip footing of width 1, c = c0 + k z, ratio = k B / c0."""
    x = both_ways(0.5, 0.0, 2.0, first, largest)
    y = graded(0.0, -1.2, first, GROWTH, largest)[::-1]
    mesh = Mesh(*np.meshgrid(x, y, indexing="ij"))

    def part(m):
        if m[1] > -SMALL:
            return "load" if m[0] < 0.5 else "free"
        return "axis" if m[0] < SMALL else "fixed"

    return mesh, *loaded(mesh, lambda p: 1.0 - ratio * p[:, 1], part, kind, -1.0)


def slope(degrees, first, largest):
    """Bound gamma h / c of a slope of height 1; its toe is the origin, soil is on the right."""
    left, right, depth = -0.7, 2.0, -0.5
    x = both_ways(0.0, left, right, first, largest)
    y = both_ways(0.0, depth, 1.0, first, largest)
    x, y = np.meshgrid(x, y, indexing="ij")
    keep = ~((x < -SMALL) & (y > -SMALL))
    lean = 1.0 / np.tan(np.radians(degrees))
    x = x + np.where((y > 0.0) & (x > -SMALL), y * lean * (1.0 - x / right), 0.0)
    mesh = Mesh(x, y, keep)

    def fixed(m):
        return m[0] < left + SMALL or m[0] > right - SMALL or m[1] < depth + SMALL

    low = lower(mesh, uniform, lambda m: "any" if fixed(m) else "free")
    still, open_side = ("rough", (0.0, 0.0)), ("free", None)
    high = upper(mesh, uniform, lambda m: still if fixed(m) else open_side, gravity=True)
    return mesh, low, high


def block(ratio, first, largest):
    """Bound p / (2 c) on a block between rough platens, of height 1 and so many times as wide."""
    x = graded(ratio / 2.0, 0.0, first, GROWTH, largest)[::-1]
    y = graded(0.5, 0.0, first, GROWTH, largest)[::-1]
    mesh = Mesh(*np.meshgrid(x, y, indexing="ij"))

    def part(m):
        if m[1] > 0.5 - SMALL:
            return "load"
        return "axis" if min(m) < SMALL else "free"

    low, high = loaded(mesh, uniform, part, "rough", -1.0)
    return mesh, low / (2.0 * ratio), high / (2.0 * ratio)


CASES = {
    "trapdoor H/B=1 rough": (trapdoor, 1, "rough"),
    "trapdoor H/B=1 smooth": (trapdoor, 1, "smooth"),
    "trapdoor H/B=2 rough": (trapdoor, 2, "rough"),
    "trapdoor H/B=2 smooth": (trapdoor, 2, "smooth"),
    "trapdoor H/B=3 rough": (trapdoor, 3, "rough"),
    "footing kB/c0=0 rough": (footing, 0, "rough"),
    "footing kB/c0=4 rough": (footing, 4, "rough"),
    "footing kB/c0=4 smooth": (footing, 4, "smooth"),
    "slope 90 degrees": (slope, 90.0),
    "slope 60 degrees": (slope, 60.0),
    "block w/h=2": (block, 2.0),
    "block w/h=4": (block, 4.0),
}
# Steps at the singular point, and far from it; the last pair is for --fine.
MESHES = ((0.08, 0.16), (0.04, 0.1), (0.02, 0.06))


def main(names):
    """Compute the cases whose names begin with one of those given; none: all."""
    meshes = MESHES if "--fine" in names else MESHES[:-1]
    names = tuple(name for name in names if name != "--fine")
    results = json.loads(FILE.read_text()) if FILE.exists() else {}
    for name, (function, *values) in CASES.items():
        if names and not name.startswith(names):
            continue
        results[name] = []
        for steps in meshes:
            began = time.perf_counter()
            mesh, low, high = function(*values, *steps)
            row = {
                "triangles": len(mesh.triangles),
                "lower": round(low, 5),
                "upper": round(high, 5),
            }
            results[name].append(row)
            seconds = time.perf_counter() - began
            print(
                f"{name:26s} {row['triangles']:6d} {low:8.4f} {high:8.4f} {seconds:6.1f} s",
                flush=True,
            )
        FILE.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
