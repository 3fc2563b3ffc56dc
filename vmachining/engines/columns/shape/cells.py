"""Cells that are not level: two triangles, or what walls divide them into."""

from __future__ import annotations

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.engines.columns.shape.lattice import Lattice
from vmachining.engines.columns.shape.sheets import LEVEL_MM, Edges, Mesh
from vmachining.engines.columns.shape.walls import Heights, bend, junction


def divide(
    mesh: Mesh, at: Heights, lattice: Lattice, edges: Edges, bottom: float, kinds: tuple[Bools, Bools], wall: Ints,
    ids: tuple[Ints, Ints, Ints, Ints], in_use: Ints, heights: Floats, nothing: Bools, block: Ints,
) -> None:  # fmt: skip
    """Cells that are not level, and those at a border of the bottom, above and below."""
    (rough, rim), (low, high, base, sides) = kinds, ids
    walls = (wall >= 0).sum(axis=1)

    def both(
        cells: Ints, corners: tuple[Ints, Ints, Ints], under: tuple[Ints, Ints, Ints], whose: Ints
    ) -> None:
        """Triangles above and, of cells at a border, those below; both or none where all corners lie at the bottom."""
        solid = (corners[0] != under[0]) | (corners[1] != under[1]) | (corners[2] != under[2])
        mesh.take(tuple(c[solid] for c in corners), whose[solid])
        solid &= rim[cells]
        a, b, c = (c[solid] for c in under)
        mesh.take((a, c, b), -1)

    for falling in (True, False):  # the diagonal that lies lower, so that no ridge is made of two slopes
        lower = heights[:, 0] + heights[:, 2] <= heights[:, 1] + heights[:, 3]
        c = np.flatnonzero((rough | rim) & (walls == 0) & (lower == falling))
        for t in ((0, 1, 2), (0, 2, 3)) if falling else ((0, 1, 3), (1, 2, 3)):
            both(c, tuple(high[in_use[c, k]] for k in t), tuple(low[in_use[c, k]] for k in t), block[c, 0])
    cells = np.flatnonzero(walls > 0)
    if not len(cells):
        return
    n = len(cells)
    crossed = wall[cells]
    one = crossed >= 0
    # near and far side of each wall as the ring meets it: edges 2 and 3 run against their axes
    turned = np.array([0, 0, 1, 1])
    near, far = sides[turned, crossed], sides[1 - turned, crossed]
    z_near, z_far = edges.z[turned, crossed], edges.z[1 - turned, crossed]
    foot, spot = base[crossed], edges.place[crossed]
    top, under = high[in_use[cells]], low[in_use[cells]]
    own, count = block[cells], walls[cells]
    i, j = lattice.cells[cells].T
    corner_low = np.column_stack([lattice.xs[i], lattice.ys[j]])
    corner_high = np.column_stack([lattice.xs[i + 1], lattice.ys[j + 1]])
    order = np.argsort(~one, axis=1, kind="stable")  # the walls of a cell first
    rows = np.arange(n)

    centre = 0.5 * (corner_low + corner_high)
    z = np.zeros((n, 3))
    fan = (count == 1) | (count == 3)
    two = np.flatnonzero(count == 2)
    if len(two):
        a, b = order[two, 0], order[two, 1]
        real, bent, place, left, right = bend(
            at, corner_low[two], corner_high[two], spot[two, a], spot[two, b]
        )
        bent |= rim[cells[two]]
        centre[two], z[two, 0], z[two, 1] = place, left, right
        z[two[~real], 0] = 0.5 * (z_near[two, a] + z_far[two, b])[~real]
        z[two[~real], 1] = 0.5 * (z_far[two, a] + z_near[two, b])[~real]
        fan[two[bent]] = True
        _chord(mesh, two[~bent], order, (near, far), top, own, (z_near, z_far))
    single = np.flatnonzero(count == 1)
    if len(single):
        empty = nothing[cells[single]]
        bare = (empty & np.roll(empty, -1, axis=1)).any(axis=1)  # no tent over an edge where there is nothing
        z[single] = np.where(bare, bottom, at(centre[single])[0])[:, None]
    three = np.flatnonzero(count == 3)
    if len(three):
        ends = np.stack([spot[three, order[three, k]] for k in range(3)], axis=1)
        centre[three] = junction(at, corner_low[three], corner_high[three], ends)
        for s in range(3):  # from the far side of one wall to the near side of the next
            before, after = order[three, (s + 2) % 3], order[three, s]
            share = 0.5 * (spot[three, before] + spot[three, after])
            z[three, s] = 0.5 * (z_far[three, before] + z_near[three, after])
            step = centre[three] + 0.02 * (share - centre[three])
            there = at(step)[0]
            likely = np.abs(there - z[three, s]) < 0.25 * np.abs(z_near - z_far)[three].max(axis=1)
            z[three, s] = np.where(likely, there, z[three, s])
    some = np.flatnonzero(fan)
    if len(some):
        point = np.full((n, 3), -1)
        floor = np.full(n, -1)
        floor[some] = mesh.add(centre[some], bottom)
        for s in range(3):
            mine = some[count[some] > s]
            point[mine, s] = np.where(z[mine, s] > bottom, mesh.add(centre[mine], z[mine, s]), floor[mine])
            for e in range(s):
                alike = mine[np.abs(z[mine, e] - z[mine, s]) <= LEVEL_MM]
                point[alike, s] = point[alike, e]
        sector = np.zeros(n, dtype=np.int64)
        for k in range(4):
            then = (k + 1) % 4
            mid, cut = point[rows, sector], one[:, k]
            for chosen, tips, feet, whose in (
                (fan & ~cut, (top[:, k], top[:, then]), (under[:, k], under[:, then]), own[:, k]),
                (fan & cut, (top[:, k], near[:, k]), (under[:, k], foot[:, k]), own[:, k]),
            ):
                c = np.flatnonzero(chosen)
                both(cells[c], (mid[c], tips[0][c], tips[1][c]), (floor[c], feet[0][c], feet[1][c]), whose[c])
            sector = np.where(fan & cut, (sector + 1) % np.maximum(count, 1), sector)
            c, after = np.flatnonzero(fan & cut), point[rows, sector]
            both(
                cells[c],
                (after[c], far[c, k], top[c, then]),
                (floor[c], foot[c, k], under[c, then]),
                own[c, then],
            )
            whose = np.where(z_near[:, k] < z_far[:, k], own[:, k], own[:, then])[c]
            mesh.take((near[c, k], far[c, k], after[c]), whose)
            other = 3 - (sector[c] + (sector[c] - 1) % np.maximum(count[c], 1))
            between = np.where(count[c] == 3, point[c, np.clip(other, 0, 2)], -1)
            here, there = z[c, (sector[c] - 1) % count[c]], z[c, sector[c]]
            lo, hi = np.minimum(here, there), np.maximum(here, there)
            z_between = z[c, np.clip(other, 0, 2)]
            through = (count[c] == 3) & (z_between > lo + LEVEL_MM) & (z_between < hi - LEVEL_MM)
            mesh.take((near[c, k], after[c], np.where(through, between, mid[c])), whose)
            mesh.take((near[c, k][through], between[through], mid[c][through]), whose[through])
    four = np.flatnonzero(count == 4)
    if len(four):
        joint = np.abs(heights[cells[four], 0] - heights[cells[four], 2]) <= np.abs(
            heights[cells[four], 1] - heights[cells[four], 3]
        )
        for shift, c in ((0, four[joint]), (1, four[~joint])):
            a, b, d, e = ((k + shift) % 4 for k in range(4))  # corners a and d stay together; edges alike
            for before, corner, after in ((a, b, b), (d, e, e)):
                both(
                    cells[c], (far[c, before], top[c, corner], near[c, after]),
                    (foot[c, before], under[c, corner], foot[c, after]), own[c, corner],
                )  # fmt: skip
                whose = np.where(z_near[c, before] < z_far[c, before], own[c, before], own[c, corner])
                mesh.take((near[c, before], far[c, before], near[c, after]), whose)
                mesh.take((near[c, before], near[c, after], far[c, after]), whose)
            loop = (
                (top, under, a),
                (near, foot, a),
                (far, foot, b),
                (top, under, d),
                (near, foot, d),
                (far, foot, e),
            )
            for k in range(1, 5):
                (p, pu, pk), (q, qu, qk), (r, ru, rk) = loop[0], loop[k], loop[k + 1]
                both(cells[c], (p[c, pk], q[c, qk], r[c, rk]), (pu[c, pk], qu[c, qk], ru[c, rk]), own[c, a])


def _chord(
    mesh: Mesh, c: Ints, order: Ints, ends: tuple[Ints, Ints], top: Ints, own: Ints, z: tuple[Floats, Floats]
) -> None:
    """Cells that one straight wall divides."""
    (near, far), (z_near, z_far) = ends, z
    for a in range(4):
        for b in range(a + 1, 4):
            d = c[(order[c, 0] == a) & (order[c, 1] == b)]
            if not len(d):
                continue
            for start, stop in ((a, b), (b, a + 4)):
                ring = [
                    far[d, start],
                    *(top[d, k % 4] for k in range(start + 1, stop + 1)),
                    near[d, stop % 4],
                ]
                for k in range(1, len(ring) - 1):
                    mesh.take((ring[0], ring[k], ring[k + 1]), own[d, (start + 1) % 4])
            whose = np.where(z_near[d, a] < z_far[d, a], own[d, a], own[d, (a + 1) % 4])
            mesh.take((near[d, a], far[d, a], near[d, b]), whose)
            mesh.take((near[d, a], near[d, b], far[d, b]), whose)
