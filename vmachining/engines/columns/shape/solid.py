"""Triangles between a level bottom and the heights over a lattice."""

from __future__ import annotations

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.engines.columns.shape import _kernels
from vmachining.engines.columns.shape.cells import divide
from vmachining.engines.columns.shape.lattice import Lattice, Squares, free, joined, places, unique
from vmachining.engines.columns.shape.sheets import LEVEL_MM, Border, Edges, Mesh
from vmachining.engines.columns.shape.walls import Heights
from vmachining.engines.protocol import StockSurface

SLIVER = 0.1
"""Of a cell: a triangle less high is one, where its points may go elsewhere."""

OFF = 5e-3
"""Of a cell: by how much a point may then leave the plane of a face; a wall bulges by R / 3200, a cell is R / 20."""

RING = ((0, 0), (1, 0), (1, 1), (0, 1))
"""Corners of a cell, counterclockwise; edge k goes from corner k to the next."""


def solid_of(at: Heights, lattice: Lattice, bottom: float, top: float, block_of: Ints) -> StockSurface:
    """The closed surface.

    at : heights, at or above the bottom, and who made them. lattice : see `lattice_of`. block_of : block of each sweep, the
    last one for none.
    """
    mesh = _mesh_of(at, lattice, bottom, top, block_of)
    points, triangles = _parted(np.concatenate(mesh.points), np.concatenate(mesh.triangles))
    cell = float(min(np.median(np.diff(lines)) for lines in (lattice.xs, lattice.ys)))
    points, triangles, kept = _tidied(points, triangles, cell)
    used = unique(triangles.ravel(), len(points))
    number = np.zeros(len(points), dtype=np.int64)
    number[used] = np.arange(len(used))
    return StockSurface(points[used], number[triangles], np.concatenate(mesh.blocks)[kept])


def _mesh_of(at: Heights, lattice: Lattice, bottom: float, top: float, block_of: Ints) -> Mesh:
    """Its points and triangles, some of them too many; what it takes to find them, a kB a cell, is free after that."""
    mesh, (i, j) = Mesh(), lattice.cells.T
    # rows of four lie column by column, which are quick to compare
    corner = np.stack([lattice.node(i + a, j + b) for a, b in RING]).T
    wide, count = len(lattice.xs), len(lattice.xs) * len(lattice.ys)
    nodes = unique(corner.ravel(), count)
    z, owner = at(lattice.place(nodes))
    edges = Edges(at, lattice, nodes, z, owner)
    where = places(nodes, corner.T, count)
    heights, owners = z[where].T, owner[where].T
    first = corner[:, 0]
    keys = 2 * first, 2 * first + 3, 2 * (first + wide), 2 * first + 1
    wall = np.stack([edges.of(key) for key in keys]).T
    plain = (wall < 0).all(axis=1)
    nothing = heights <= bottom
    level = plain & (np.ptp(heights, axis=1) <= LEVEL_MM)
    gone, flat = level & nothing.all(axis=1), level & ~nothing.any(axis=1)
    # what lies at a border of the bottom is divided alike above and below
    rim = ~gone & (nothing.any(axis=1) | _touches(edges, wall, bottom))
    rough = ~gone & ~flat
    block = block_of[np.maximum(owners, -1)]

    outer = free(lattice, lattice.cells)
    if len(outer.i0):
        ends = np.stack([outer.i0 + outer.i1, outer.j0 + outer.j1], axis=1) // 2
        solid = at(np.column_stack([lattice.xs[ends[:, 0]], lattice.ys[ends[:, 1]]]))[0] > bottom
        outer = Squares(*(a[solid] for a in outer))
    height = np.round(heights[flat, 0] / (10 * LEVEL_MM))
    begin = np.flatnonzero(np.diff(height, prepend=np.nan))  # of cells in a row with one height
    number = np.repeat(np.unique(height[begin], return_inverse=True)[1], np.diff(begin, append=len(height)))
    same = block[flat, 0] + (1 << 40) * number
    floors = joined(lattice.cells[flat], same)
    floors = floors._replace(label=np.asarray((floors.label + (1 << 39)) % (1 << 40) - (1 << 39)))
    whole = ~gone & ~rim
    under = joined(lattice.cells[whole], np.zeros(int(whole.sum()), dtype=np.int64))

    # nodes: those of the bottom first
    used = unique(
        np.concatenate([corner[~gone].ravel(), *(_nodes(lattice, s) for s in (outer, floors, under))]),
        count,
    )
    spots = lattice.place(used)
    low = mesh.add(spots, bottom)
    height = np.full(len(used), top)
    at_used = np.searchsorted(nodes, used)
    known = at_used < len(nodes)
    known[known] = nodes[at_used[known]] == used[known]
    height[known] = z[at_used[known]]
    high = mesh.add(spots, height)
    high = np.where(height > bottom, high, low)
    base = mesh.add(edges.place, bottom)
    sides = np.stack([np.where(h > bottom, mesh.add(edges.place, h), base) for h in edges.z])

    in_use = places(used, corner, count)
    divide(
        mesh,
        at,
        lattice,
        edges,
        bottom,
        (rough, rim),
        wall,
        (low, high, base, sides),
        in_use,
        heights,
        nothing,
        block,
    )

    above = np.concatenate([corner[rough].ravel(), *(_nodes(lattice, s) for s in (outer, floors))])
    below = np.concatenate([corner[rim].ravel(), *(_nodes(lattice, s) for s in (outer, under))])
    crossed = unique(wall[rim][wall[rim] >= 0], len(edges.key))
    sheets: list[Border] = []
    for numbers, ids in ((above, high), (below, low)):
        numbers = unique(numbers, count)
        ids, ii, jj = ids[places(used, numbers, count)], 2 * (numbers % wide), 2 * (numbers // wide)
        if len(sheets):
            ids = np.concatenate([ids, base[crossed]])
            ii, jj = np.concatenate([ii, edges.i[crossed]]), np.concatenate([jj, edges.j[crossed]])
        sheets.append(Border(lattice, ii, jj, ids))
    for s in (outer, floors):
        _fans(mesh, lattice, sheets[0], s, True)
    for s in (outer, under):
        _fans(mesh, lattice, sheets[1], s, False, bottom)
    _around(mesh, lattice, sheets, edges, sides)
    return mesh


def _tidied(points: Floats, triangles: Ints, cell: float) -> tuple[Floats, Ints, Bools]:
    """Without slivers, which stand where a wall passes beside a node; and which of the triangles are left."""
    if not len(triangles):  # nothing is left of the stock
        return points, triangles, np.ones(0, dtype=np.bool_)
    n, box = len(points) + 1, np.stack([points.min(axis=0), points.max(axis=0)])
    points, triangles = np.concatenate([points, np.zeros((1, 3))]), np.ascontiguousarray(triangles)
    head, after, mark = (np.empty(k, dtype=np.int64) for k in (n, triangles.size, n))
    _kernels.tidy(points, triangles, box, head, after, mark, SLIVER * cell, OFF * cell)
    a, b, c = triangles.T
    kept = np.asarray((a != b) & (b != c) & (c != a))
    return points, triangles[kept], kept


def _parted(points: Floats, triangles: Ints) -> tuple[Floats, Ints]:
    """Two parts of the solid that touch in an edge have points of their own there, so that each edge has two triangles."""
    key = triangles.ravel() * len(points) + np.roll(triangles, -1, axis=1).ravel()
    order = np.sort(key)
    twice = np.unique(order[1:][order[1:] == order[:-1]])
    if not len(twice):
        return points, triangles
    more: list[Floats] = []
    triangles, shared = triangles.copy(), {frozenset(divmod(k, len(points))) for k in twice.tolist()}
    for v in sorted(set[int]().union(*shared)):
        rest = set(np.flatnonzero((triangles == v).any(axis=1)).tolist())
        first = True
        while rest:
            todo = [rest.pop()]
            part = list(todo)
            while todo:
                mine = set(triangles[todo.pop()].tolist()) - {v}
                for t in [
                    t
                    for t in rest
                    if any(frozenset((v, w)) not in shared for w in mine & set(triangles[t].tolist()))
                ]:
                    rest.remove(t)
                    todo.append(t)
                    part.append(t)
            if not first:
                whole = triangles[part]
                triangles[part] = np.where(whole == v, len(points) + len(more), whole)
                more.append(points[v])
            first = False
    return np.concatenate([points, np.array(more).reshape(-1, 3)]), triangles


def _touches(edges: Edges, wall: Ints, bottom: float) -> Bools:
    """Whether some wall of a cell stands where there is nothing next to it."""
    if not len(edges.key):
        return np.zeros(len(wall), dtype=np.bool_)
    return np.asarray(((wall >= 0) & (edges.z.min(axis=0) <= bottom)[wall]).any(axis=1))


def _nodes(lattice: Lattice, s: Squares) -> Ints:
    return np.concatenate(
        [lattice.node(i, j) for i, j in ((s.i0, s.j0), (s.i1, s.j0), (s.i1, s.j1), (s.i0, s.j1))]
    )


def _fans(mesh: Mesh, lattice: Lattice, sheet: Border, s: Squares, up: bool, bottom: float = 0.0) -> None:
    """Squares of a level sheet: two triangles, or a fan over the middle where there are points on a side."""
    n = len(s.i0)
    if not n:
        return
    corners = [sheet.of(i, j) for i, j in ((s.i0, s.j0), (s.i1, s.j0), (s.i1, s.j1), (s.i0, s.j1))]
    sides = [
        sheet.along(0, s.j0, s.i0, s.i1), sheet.along(1, s.i1, s.j0, s.j1),
        sheet.along(0, s.j1, s.i0, s.i1), sheet.along(1, s.i0, s.j0, s.j1),
    ]  # fmt: skip
    counts = np.stack([c for _, c, _ in sides])
    size = 4 + counts.sum(axis=0)
    start = np.cumsum(size) - size
    ring = np.zeros(int(size.sum()), dtype=np.int64)
    before = start.copy()
    for k, (first, count, ids) in enumerate(sides):
        ring[before] = corners[k]
        which = np.repeat(np.arange(n), count)
        step = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
        place = first[which] + (step if k < 2 else count[which] - 1 - step)
        ring[before[which] + 1 + step] = ids[place]
        before += 1 + count
    fan = size > 4
    points = np.concatenate(mesh.points)
    z = points[corners[0], 2] if up else np.full(n, bottom)
    middle = np.column_stack(
        [0.5 * (lattice.xs[s.i0] + lattice.xs[s.i1]), 0.5 * (lattice.ys[s.j0] + lattice.ys[s.j1])]
    )
    centre = np.zeros(n, dtype=np.int64)
    centre[fan] = mesh.add(middle[fan], z[fan])
    which = np.repeat(np.arange(n), size)
    after = np.arange(len(ring)) + 1
    last = start + size - 1
    after[last] = start
    some = fan[which]
    label = s.label if up else np.full(n, -1)
    t = np.column_stack([centre[which[some]], ring[some], ring[after[some]]])
    a, b, c, d = (corner[~fan] for corner in corners)
    t = np.concatenate([t, np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    mesh.take(t if up else t[:, ::-1], np.concatenate([label[which[some]], label[~fan], label[~fan]]))


def _around(mesh: Mesh, lattice: Lattice, sheets: list[Border], edges: Edges, sides: Ints) -> None:
    """Upright sides of the box: between the points of both sheets on each."""
    n, m = len(lattice.xs) - 1, len(lattice.ys) - 1
    for axis, line, forward in ((0, 0, True), (1, n, True), (0, m, False), (1, 0, False)):
        count = n if axis == 0 else m
        chains = []
        for sheet in sheets:
            keys, ids, step = (
                (sheet.rows, sheet.row_ids, sheet.wide)
                if axis == 0
                else (sheet.columns, sheet.column_ids, sheet.tall)
            )
            low, high = np.searchsorted(keys, [2 * line * step, 2 * line * step + 2 * count + 1])
            chains.append((keys[low:high] - 2 * line * step, ids[low:high]))
        along, across = (edges.i, edges.j) if axis == 0 else (edges.j, edges.i)
        on = np.flatnonzero((across == 2 * line) & (along % 2 == 1))
        where = np.concatenate([chains[0][0], along[on], along[on]])
        ids = np.concatenate([chains[0][1], sides[0][on], sides[1][on]])
        order = np.argsort(where, kind="stable")
        upper, lower = list(zip(where[order].tolist(), ids[order].tolist(), strict=True)), chains[1]
        zero = set(lower[1].tolist())
        triangles: list[tuple[int, int, int]] = []
        run: list[tuple[int, int]] = []
        foot = list(zip(lower[0].tolist(), lower[1].tolist(), strict=True))
        at_foot = 0
        for point in [*upper, (-1, -1)]:
            if run and (point[1] < 0 or (point[1] in zero and run[-1][1] in zero)):
                at_foot = _zipped(run, foot, at_foot, triangles)
                run = []
            if point[1] >= 0:
                run.append(point)
        t = np.array(triangles, dtype=np.int64).reshape(-1, 3)
        mesh.take(t if forward else t[:, ::-1], -1)


def _zipped(
    run: list[tuple[int, int]], foot: list[tuple[int, int]], at: int, out: list[tuple[int, int, int]]
) -> int:
    """Triangles between a run of points above and those below it; where the next run begins below."""
    while at < len(foot) and foot[at][0] < run[0][0]:
        at += 1
    stop = at
    while stop + 1 < len(foot) and foot[stop + 1][0] <= run[-1][0]:
        stop += 1
    k = 0
    while k + 1 < len(run) or at < stop:
        if k + 1 < len(run) and (at == stop or run[k + 1][0] <= foot[at + 1][0]):
            out.append((run[k][1], foot[at][1], run[k + 1][1]))
            k += 1
        else:
            out.append((run[k][1], foot[at][1], foot[at + 1][1]))
            at += 1
    return at
