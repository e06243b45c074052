"""Finite element limit analysis in plane strain, Tresca (von Mises in plane strain), phi = 0.

Needs scipy and clarabel (a solver of second-order cone programs), which are in no requirement of
perigeo: `python -m pip install scipy clarabel`. `bounds.py` uses it.

Lower bound: stresses linear in each triangle, in equilibrium there, with tractions continuous
across sides and sqrt((sxx - syy)^2 / 4 + sxy^2) <= c at the corners, and so everywhere, since c is
linear. Upper bound: velocities linear in each triangle, without change of volume, which may slip
past each other along sides at the cost c |jump|. After Sloan, S.W. (1988) Int. J. Num. Anal.
Methods Geomech. 12, 61-77; Sloan, S.W. & Kleeman, P.W. (1995) Comput. Methods Appl. Mech. Engrg
127, 293-314; as cone programs: Makrodimopoulos, A. & Martin, C.M. (2006) Int. J. Num. Methods
Engng 66, 604-634. Tension is positive here, y points up.
"""

from __future__ import annotations

from collections import defaultdict

import clarabel
import numpy as np
import scipy.sparse as sparse

CORNERS = range(3)


def graded(start, end, first, growth, largest):
    """Return points from start to end, with steps that grow from the first one."""
    points = [0.0]
    while points[-1] < abs(end - start):
        points.append(points[-1] + first)
        first = min(first * growth, largest)
    return start + np.array(points) * (end - start) / points[-1]


class Mesh:
    """Four triangles in each quadrilateral of a grid x[i, j], y[i, j], where `keep[i, j]`."""

    def __init__(self, x, y, keep=None):
        index = np.arange(x.size).reshape(x.shape)
        points, centres, triangles = np.column_stack([x.ravel(), y.ravel()]), [], []
        for i, j in np.ndindex(x.shape[0] - 1, x.shape[1] - 1):
            if keep is None or keep[i, j]:
                ring = [index[i, j], index[i + 1, j], index[i + 1, j + 1], index[i, j + 1]]
                middle = x.size + len(centres)
                centres.append(points[ring].mean(axis=0))
                triangles += [(ring[k], ring[(k + 1) % 4], middle) for k in range(4)]
        self.points = np.vstack([points, centres])
        self.triangles = np.array(triangles)
        self.sides = self._sides()
        self.needless = self._needless()
        p = self.points[self.triangles]
        (ax, ay), (bx, by) = (p[:, 1] - p[:, 0]).T, (p[:, 2] - p[:, 0]).T
        self.area = 0.5 * (ax * by - ay * bx)
        assert (self.area > 0.0).all()
        opposite = np.roll(p, -1, axis=1) - np.roll(p, -2, axis=1)
        self.slopes = np.stack([opposite[..., 1], -opposite[..., 0]], axis=-1)
        self.slopes /= 2.0 * self.area[:, None, None]  # gradients of the shape functions

    def _sides(self):
        """Return ((first, second point), [(triangle, corner at first, corner at second), ...])."""
        found = defaultdict(list)
        for t, corners in enumerate(self.triangles):
            for a in CORNERS:
                b = (a + 1) % 3
                a_, b_ = (a, b) if corners[a] < corners[b] else (b, a)
                found[corners[a_], corners[b_]].append((t, a_, b_))
        return list(found.items())

    def _needless(self):
        """Return sides at whose end continuity of shear follows from that at the others.

        It does where four sides form two straight lines, and solvers dislike to be told twice.
        """
        found = set()
        for t in range(0, len(self.triangles), 4):
            middle = self.triangles[t][2]
            arms = [self.points[self.triangles[t + k][0]] - self.points[middle] for k in range(4)]
            bend = [arms[k][0] * arms[k + 2][1] - arms[k][1] * arms[k + 2][0] for k in (0, 1)]
            if max(map(abs, bend)) < 1e-9 * abs(arms[0] @ arms[0]):
                found.add((self.triangles[t + 3][0], middle))
        return found

    def along(self, side):
        """Return the length of a side and the unit vector along it."""
        step = self.points[side[1]] - self.points[side[0]]
        return np.hypot(*step), step / np.hypot(*step)


class Rows:
    """Rows of a sparse matrix with their right-hand sides."""

    def __init__(self):
        self.row, self.column, self.value, self.right = [], [], [], []

    def add(self, columns, values, right=0.0):
        self.row += [len(self.right)] * len(columns)
        self.column += columns
        self.value += values
        self.right.append(right)

    def matrix(self, size):
        shape = (len(self.right), size)
        return sparse.csc_matrix((self.value, (self.row, self.column)), shape=shape)


def minimise(cost, equal, bounded, cones):
    """Return the least cost x: equal x = right, bounded x <= right, right - cones x in cones."""
    groups = [(equal, [clarabel.ZeroConeT(len(equal.right))])]
    if bounded.right:
        groups.append((bounded, [clarabel.NonnegativeConeT(len(bounded.right))]))
    groups.append((cones, [clarabel.SecondOrderConeT(3)] * (len(cones.right) // 3)))
    settings = clarabel.DefaultSettings()
    settings.verbose, settings.max_threads = False, 1
    settings.tol_gap_rel = settings.tol_gap_abs = 1e-6
    settings.static_regularization_constant = 1e-7  # sides of meshes are not quite independent
    solution = clarabel.DefaultSolver(
        sparse.csc_matrix((len(cost), len(cost))),
        cost,
        sparse.vstack([rows.matrix(len(cost)) for rows, _ in groups], format="csc"),
        np.concatenate([rows.right for rows, _ in groups]),
        [cone for _, kinds in groups for cone in kinds],
        settings,
    ).solve()
    if str(solution.status) != "Solved":
        raise ArithmeticError(f"the solver stopped: {solution.status}")
    x = np.array(solution.x)
    assert abs(equal.matrix(len(cost)) @ x - equal.right).max() < 1e-6
    return solution.obj_val


def velocity(t, corner, axis):
    return 6 * t + 2 * corner + axis


def upper(mesh, strength, side_kind, gravity=False):
    """Return the least dissipation of velocities that the sides prescribe.

    side_kind(middle) is 'free', or 'smooth' or 'rough' with the velocity of what the side touches:
    smooth prescribes the normal part, rough lets slip at the cost of dissipation. With gravity
    the least unit weight that makes the body fail is returned.
    """
    count = len(mesh.triangles)
    c = strength(mesh.points)
    kinds = [side_kind(mesh.points[list(side)].mean(axis=0)) for side, _ in mesh.sides]
    slips = [len(of) == 2 or kind[0] == "rough" for (_, of), kind in zip(mesh.sides, kinds)]
    cost = np.zeros(7 * count + 2 * sum(slips))
    equal, bounded, cones = Rows(), Rows(), Rows()
    for t in range(count):
        g = mesh.slopes[t]
        columns = [velocity(t, k, i) for k in CORNERS for i in (0, 1)]
        equal.add(columns, [g[k, i] for k in CORNERS for i in (0, 1)])
        cones.add([6 * count + t], [-1.0])
        cones.add(columns, [s * g[k, i] for k in CORNERS for i, s in ((0, 1.0), (1, -1.0))])
        cones.add(columns, [g[k, i] for k in CORNERS for i in (1, 0)])
        cost[6 * count + t] = mesh.area[t] * c[mesh.triangles[t]].mean()
    slip = 7 * count
    for (side, of), (kind, v), slipping in zip(mesh.sides, kinds, slips):
        if len(of) == 1 and kind == "free":
            continue
        length, (x, y) = mesh.along(side)
        for end in (0, 1):
            columns = [velocity(of[0][0], of[0][1 + end], i) for i in (0, 1)]
            along, across, vt, vn = [x, y], [-y, x], 0.0, 0.0
            if len(of) == 2:
                columns += [velocity(of[1][0], of[1][1 + end], i) for i in (0, 1)]
                along, across = [*along, -x, -y], [*across, y, -x]
            else:
                vt, vn = x * v[0] + y * v[1], x * v[1] - y * v[0]
            equal.add(columns, across, vn)
            if slipping:
                bounded.add([*columns, slip], [*along, -1.0], vt)
                bounded.add([*columns, slip], [*[-value for value in along], -1.0], -vt)
                cost[slip] = length * (2.0 * c[side[end]] + c[side[1 - end]]) / 6.0
                slip += 1
    if gravity:
        columns = [velocity(t, k, 1) for t in range(count) for k in CORNERS]
        equal.add(columns, [-mesh.area[t] / 3.0 for t in range(count) for _ in CORNERS], 1.0)
    return minimise(cost, equal, bounded, cones)


def stress(t, corner, component):
    """Return the number of sxx, syy or sxy at a corner of a triangle."""
    return 9 * t + 3 * corner + component


def equilibrium(mesh, strength, gravity):
    """Return the rows of equilibrium in triangles, and of strength at their corners."""
    c = strength(mesh.points)
    equal, cones = Rows(), Rows()
    for t, g in enumerate(mesh.slopes):
        values = [g[k, i] for k in CORNERS for i in (0, 1)]
        equal.add([stress(t, k, i) for k in CORNERS for i in (0, 2)], values)
        columns = [stress(t, k, i) for k in CORNERS for i in (2, 1)]
        if gravity:
            columns, values = [*columns, 9 * len(mesh.triangles)], [*values, -1.0]
        equal.add(columns, values)
        for k in CORNERS:
            cones.add([], [], c[mesh.triangles[t][k]])
            cones.add([stress(t, k, 0), stress(t, k, 1)], [0.5, -0.5])
            cones.add([stress(t, k, 2)], [1.0])
    return equal, cones


def lower(mesh, strength, side_kind, pull=None):
    """Return the largest load that stresses in equilibrium carry.

    side_kind(middle) is 'free', 'smooth' (no shear) or 'any'. The load is the integral of
    pull(middle) * syy along the outer sides; without pull it is the unit weight.
    """
    equal, cones = equilibrium(mesh, strength, gravity=pull is None)
    cost = np.zeros(9 * len(mesh.triangles) + 1)
    for side, of in mesh.sides:
        length, (x, y) = mesh.along(side)
        normal = [y * y, x * x, -2.0 * x * y]
        shear = [-x * y, x * y, x * x - y * y]
        middle = mesh.points[list(side)].mean(axis=0)
        for end in (0, 1):
            columns = [stress(of[0][0], of[0][1 + end], i) for i in range(3)]
            if len(of) == 2:
                both = columns + [stress(of[1][0], of[1][1 + end], i) for i in range(3)]
                equal.add(both, normal + [-value for value in normal])
                if end == 0 or side not in mesh.needless:
                    equal.add(both, shear + [-value for value in shear])
                continue
            if side_kind(middle) == "free":
                equal.add(columns, normal)
            if side_kind(middle) != "any":
                equal.add(columns, shear)
            if pull is not None:
                cost[columns[1]] -= pull(middle) * 0.5 * length
    if pull is None:
        cost[-1] = -1.0
    return -minimise(cost, equal, Rows(), cones)
