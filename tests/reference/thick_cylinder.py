"""Thick cylinder under internal pressure in plane strain, elastic and perfectly plastic.

Shear strength c: von Mises with the yield stress sqrt(3) c, which is Tresca's 2 c where the axial
stress lies between the others. Radii a < b, E and nu as usual, strains small. Tension is positive.

`plastic_radius_pressure` and `displacement` are Tresca's closed forms (Hill, R. (1950), The
Mathematical Theory of Plasticity, chapter V.2). They are von Mises's for nu = 0.5. For other nu
von Mises has no closed form beyond first yield, for the axial stress takes part in yielding, and
`von_mises_curve` integrates it. The limit load is the same for all of them.
"""

from __future__ import annotations

from math import log, sqrt

import numpy as np


def limit_pressure(c, a, b):
    """Return the pressure at which the whole wall flows."""
    return 2.0 * c * log(b / a)


def yield_pressure(c, a, b, nu=0.5):
    """Return the pressure of first yield at the inner rim, by von Mises."""
    return c * (b**2 - a**2) / sqrt(b**4 + (1.0 - 2.0 * nu) ** 2 * a**4 / 3.0)


def plastic_radius_pressure(radius, c, a, b):
    """Return the pressure at which the wall flows out to a radius."""
    return c * (2.0 * log(radius / a) + 1.0 - (radius / b) ** 2)


def plastic_radius(p, c, a, b):
    """Return out to which radius the wall flows under a pressure; a: nowhere."""
    if p > limit_pressure(c, a, b):
        raise ValueError("the pressure is above the limit load")
    low, high = a, b
    while high - low > 1e-14 * b:
        middle = 0.5 * (low + high)
        if plastic_radius_pressure(middle, c, a, b) < p:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def elastic_displacement(p, r, a, b, young, nu):
    """Return the radial displacement at r of an elastic wall (Lame)."""
    mean = p * a**2 / (b**2 - a**2)
    return (1.0 + nu) / young * mean * ((1.0 - 2.0 * nu) * r + b**2 / r)


def displacement(p, c, a, b, young, nu):
    """Return the displacement of the inner rim, outwards, under a pressure up to the limit load.

    Plastic flow keeps the volume, so r u = (1 + nu) (1 - 2 nu) r^2 sigma_r / E + constant in the
    whole wall, and the constant is that of the elastic part.
    """
    if p <= plastic_radius_pressure(a, c, a, b):
        return elastic_displacement(p, a, a, b, young, nu)
    out_to = plastic_radius(p, c, a, b)
    shear = 2.0 * (1.0 - nu**2) * c * out_to**2 / a
    return (shear - (1.0 + nu) * (1.0 - 2.0 * nu) * p * a) / young


def stresses(r, p, c, a, b):
    """Return radial and hoop stress at radii r."""
    r = np.asarray(r, dtype=float)
    if p <= plastic_radius_pressure(a, c, a, b):
        mean = p * a**2 / (b**2 - a**2)
        return mean * (1.0 - (b / r) ** 2), mean * (1.0 + (b / r) ** 2)
    out_to = plastic_radius(p, c, a, b)
    inside = r <= out_to
    radial = np.where(
        inside, -p + 2.0 * c * np.log(r / a), c * out_to**2 * (1.0 / b**2 - 1.0 / r**2)
    )
    hoop = np.where(inside, radial + 2.0 * c, c * out_to**2 * (1.0 / b**2 + 1.0 / r**2))
    return radial, hoop


def returned(trial, c):
    """Return stresses (radial, hoop, axial) brought back to von Mises's surface, and the tangent.

    The tangent is with respect to the trial stresses.
    """
    mean = trial.mean(axis=1, keepdims=True)
    deviator = trial - mean
    size = np.sqrt(0.5 * (deviator**2).sum(axis=1))[:, None]
    part = np.minimum(1.0, c / np.maximum(size, 1e-300))
    volumetric = np.full((3, 3), 1.0 / 3.0)
    tangent = volumetric + part[:, :, None] * (np.eye(3) - volumetric)
    unit = np.where(size > c, deviator / np.maximum(size, 1e-300), 0.0)
    tangent -= 0.5 * part[:, :, None] * unit[:, :, None] * unit[:, None, :]
    return mean + part * deviator, tangent


def von_mises_curve(moves, c, a, b, young, nu, elements=200, steps=400):
    """Return the pressures under which the inner rim has moved as far as `moves` says, rising.

    Finite elements along the radius, linear, with stresses in their middle; the rim is moved in
    `steps` even steps to the last of `moves`; radial return.
    """
    nodes = np.geomspace(a, b, elements + 1)
    length, radius = np.diff(nodes), 0.5 * (nodes[1:] + nodes[:-1])
    gradient = np.zeros((elements, 3, 2))
    gradient[:, 0, 0], gradient[:, 0, 1] = -1.0 / length, 1.0 / length
    gradient[:, 1] = (0.5 / radius)[:, None]
    stiffness = young / (1.0 + nu) * (np.eye(3) + nu / (1.0 - 2.0 * nu))
    weighted = gradient * (radius * length / a)[:, None, None]
    there = np.swapaxes(weighted, 1, 2)
    u, stress = np.zeros(elements + 1), np.zeros((elements, 3))
    path, load = np.linspace(0.0, moves[-1], steps + 1), [0.0]
    for rim in path[1:]:
        step, change = np.zeros(elements + 1), rim - u[0]
        for _ in range(50):
            strain = gradient[:, :, 0] * step[:-1, None] + gradient[:, :, 1] * step[1:, None]
            new, tangent = returned(stress + strain @ stiffness, c)
            local = there @ (tangent @ stiffness) @ gradient
            pull = (there @ new[:, :, None])[:, :, 0]
            force = np.append(pull[:, 0], 0.0) + np.append(0.0, pull[:, 1])
            if change == 0.0 and abs(force[1:]).max() < 1e-9 * c:
                break
            step += correction(local, force, change)
            change = 0.0
        else:
            raise ArithmeticError("no equilibrium of the cylinder")
        u, stress = u + step, new
        load.append(force[0])
    return np.interp(moves, path, load)


def correction(local, force, change):
    """Return what removes the forces of all nodes but the first, which moves by `change`."""
    size = len(force)
    diagonal = np.append(local[:, 0, 0], 0.0) + np.append(0.0, local[:, 1, 1])
    right = -force
    right[1] -= local[0, 1, 0] * change
    below, above, diagonal = local[:, 1, 0].tolist(), local[:, 0, 1].tolist(), diagonal.tolist()
    right = right.tolist()
    for i in range(2, size):
        share = below[i - 1] / diagonal[i - 1]
        diagonal[i] -= share * above[i - 1]
        right[i] -= share * right[i - 1]
    moved = [change] * size
    moved[-1] = right[-1] / diagonal[-1]
    for i in range(size - 2, 0, -1):
        moved[i] = (right[i] - above[i] * moved[i + 1]) / diagonal[i]
    return np.array(moved)
