"""Make hourglass.txt: points of a body whose sides are curved, so that no lattice fits.

Rows of points at equal distances in y; in every row the same number of points divides the width
of the body at that height. Each point owns its part of the row.

Usage: python3 make_hourglass.py > hourglass.txt
"""

import math

HEIGHT, WIDTH, WAIST = 2.0, 1.0, 0.7  # [m]
SPACING, LAYER = 0.04, 0.16  # [m]


def width(y: float) -> float:
    """Width of the body [m] at a height; the layers beyond its ends are as wide as the ends."""
    y = min(max(y, 0.0), HEIGHT)
    return WIDTH - (WIDTH - WAIST) * math.sin(math.pi * y / HEIGHT) ** 2


def main() -> None:
    rows = round(HEIGHT / SPACING)
    layer = round(LAYER / SPACING)
    columns = round(WIDTH / SPACING)
    print("# Hourglass, made by make_hourglass.py: x [m], y [m], volume [m^2], boundary")
    for row in range(-layer, rows + layer):
        y = (row + 0.5) * SPACING
        w = width(y)
        name = "bottom" if row < 0 else "top" if row >= rows else ""
        for column in range(columns):
            x = 0.5 * WIDTH + w * ((column + 0.5) / columns - 0.5)
            volume = w * SPACING / columns
            print(f"{x:.6f} {y:.6f} {volume:.8f} {name}".rstrip())


if __name__ == "__main__":
    main()
