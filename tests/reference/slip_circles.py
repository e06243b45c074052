"""Slopes with phi = 0: the slip circle that needs the least unit weight.

A circle through the toe of a slope of height 1 is given by where it leaves the crest and by half
its angle at the centre. Moments about the centre: gamma times those of the soil above it equal c R
times the length of the arc. What slides is rigid, so that the result is an upper bound.
Taylor, D.W. (1937), Stability of earth slopes, J. Boston Soc. Civ. Engrs 24, 197-246.
"""

from __future__ import annotations

import numpy as np


def weight_of_circle(degrees, crest, half_angle):
    """Return gamma h / c at which the soil above a toe circle slides; arrays."""
    edge = 1.0 / np.tan(np.radians(degrees)) if degrees < 90.0 else 0.0
    chord = np.hypot(crest, 1.0)
    radius = 0.5 * chord / np.sin(half_angle)
    centre = 0.5 * crest - radius * np.cos(half_angle) / chord
    # The segment between arc and chord, and the triangle of toe, edge of the crest and exit.
    segment = 2.0 / 3.0 * (radius * np.sin(half_angle)) ** 3 / chord
    moment = segment + 0.5 * (crest - edge) * ((edge + crest) / 3.0 - centre)
    return np.where(moment > 0.0, 2.0 * half_angle * radius**2 / moment, np.inf)


def critical_toe_circle(degrees):
    """Return the least gamma h / c, and the exit on the crest and half angle of its circle."""
    edge = 1.0 / np.tan(np.radians(degrees)) if degrees < 90.0 else 0.0
    low, high = np.array([edge + 1e-3, 1e-2]), np.array([edge + 3.0, 1.5])
    for _ in range(40):
        crest, half = np.meshgrid(*np.linspace(low, high, 41).T, indexing="ij")
        values = weight_of_circle(degrees, crest, half)
        best = np.unravel_index(np.argmin(values), values.shape)
        at, reach = np.array([crest[best], half[best]]), 0.25 * (high - low)
        low, high = np.maximum(at - reach, [edge + 1e-9, 1e-3]), at + reach
    return float(values[best]), float(at[0]), float(at[1])
