"""Waterlines: closed loops on which a cutter at one height touches the part from the side. Source: spec D.10.

1. A tool at height z that moves along a straight fibre cuts into a triangle on one interval: tool and triangle are convex, and
   so is what they exclude. The interval's ends are found by halving between the highest place of the triangle, which lies on
   an edge, and a place out of reach. Their union over the triangles is where the tool must not be.
2. Fibres along x and along y make cells. On the border of a cell the ends follow one another; every stretch outside the part
   gives one chord, from where the border leaves the part to where it comes back. Every end is in two cells, so loops close.
3. Chords are divided: a point of a chord at which the tool would cut is moved out to where it touches.

Known limits: features that lie within one cell are not seen; the part is what a tool from above meets (with an endless shank).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.errors import InputError
from vmachining.toolpath.clpath import CLPath, Mark, positive
from vmachining.toolpath.facets import _kernels
from vmachining.toolpath.facets.drop import Surface

SHIFT = 0.5641895835
"""Fibres stand off round numbers by this share of their distance: edges of parts lie on round numbers."""

ROUNDS = 12
MOST_FIBRES = 20_000


class Fibres(NamedTuple):
    """fibre : (n,) index. low, high : (n,) mm along it; intervals of one fibre are apart and rise."""

    fibre: Ints
    low: Floats
    high: Floats


def push_cutter(
    surface: Surface, z: float, places: Floats, radius: float, corner_radius: float, *, along: str = "x"
) -> Fibres:
    """Where a cutter with its tip at height z cuts into the part, along fibres at y = places (or x, along "y")."""
    corners, planes, boxes = surface.sorted
    planes = planes.copy()
    planes[:, 8:] = 0.0  # triangles count one by one here, with all of their edges
    if along == "y":
        corners = np.ascontiguousarray(corners[:, [1, 0, 2, 4, 3, 5, 7, 6, 8]])
        planes = np.ascontiguousarray(planes[:, [1, 0, 2, 3, 4, 5, 7, 6, 8, 9, 10]])
        boxes = np.ascontiguousarray(boxes[:, [1, 0, 2, 4, 3, 5]])
    elif along != "x":
        raise InputError(f"along {along!r}: give 'x' or 'y'")
    where = np.ascontiguousarray(places, dtype=np.float64)
    asked = where, float(z), corners, planes, boxes, float(radius), float(corner_radius)
    out = np.empty((max(1024, 8 * len(where)), 3))
    count = _kernels.push(*asked, out)
    if count > len(out):
        out = np.empty((count, 3))
        _kernels.push(*asked, out)
    rows = out[np.lexsort((out[:count, 1], out[:count, 0]))]
    merged: list[tuple[int, float, float]] = []
    for fibre, low, high in rows.tolist():
        if merged and merged[-1][0] == fibre and low <= merged[-1][2]:
            if high > merged[-1][2]:
                merged[-1] = (merged[-1][0], merged[-1][1], high)
        else:
            merged.append((int(fibre), low, high))
    table = np.array(merged).reshape(-1, 3)
    return Fibres(table[:, 0].astype(np.int64), table[:, 1], table[:, 2])


def waterline(
    surface: Surface,
    z: float,
    radius: float,
    corner_radius: float,
    *,
    chord: float,
    pitch: float | None = None,
) -> list[Floats]:
    """Closed loops (n, 3) of the tip at height z, first point repeated at the end; the part lies on their right (climb milling).

    chord : mm, largest distance of the loops from where the tool touches.
    pitch : mm between fibres; default a quarter of the radius.
    """
    gap = radius / 4.0 if pitch is None else pitch
    positive(chord=chord, pitch=gap)
    low, high = surface.mesh.bounds[:, :2]
    start = low - radius - (1.0 + SHIFT) * gap
    counts = np.ceil((high + radius + gap - start) / gap).astype(np.int64) + 1
    if counts.max() > MOST_FIBRES:
        raise InputError(f"{counts.max()} fibres, at most {MOST_FIBRES}", remedy="a larger pitch")
    xs, ys = (start[k] + gap * np.arange(counts[k]) for k in (0, 1))
    inside, on_x, on_y = _crossings(surface, z, radius, corner_radius, xs, ys)
    loops = _loops(inside, on_x, on_y, xs, ys)

    def free(points: Floats) -> Bools:
        found = surface.drop(points, radius, corner_radius)
        return np.asarray(~(found.z > z))

    return [
        np.column_stack([xy, np.full(len(xy), float(z))])
        for xy in (_divided(loop, free, chord) for loop in loops)
    ]


def waterline_path(
    surface: Surface,
    levels: Floats,
    radius: float,
    corner_radius: float,
    *,
    chord: float,
) -> CLPath:
    """Loops at several heights, from above, each reached from a rapid above the part.

    Raises InputError: No loop at any height.
    """
    pieces, empty = [], []
    for z in sorted(np.atleast_1d(levels).tolist(), reverse=True):
        loops = waterline(surface, z, radius, corner_radius, chord=chord)
        pieces += [CLPath.upright(loop, np.full(len(loop), Mark.CONTACT)) for loop in loops]
        if not loops:
            empty.append(f"{z:g}")
    notes = (f"no loop at z {', '.join(empty)}: the cutter touches nothing there",) if empty else ()
    if not pieces:
        raise InputError("no waterline: the cutter touches nothing at these heights")
    return CLPath.joined(pieces, clear_mm=float(surface.mesh.bounds[1, 2]) + 5.0, notes=notes)


def _crossings(
    surface: Surface, z: float, radius: float, corner_radius: float, xs: Floats, ys: Floats
) -> tuple[Bools, dict[tuple[int, int], list[float]], dict[tuple[int, int], list[float]]]:
    """Nodes in the part (nx, ny); ends on the sides of cells along x and along y, rising, by (i, j) of their first node."""
    inside = np.zeros((len(xs), len(ys)), dtype=np.bool_)
    tables = []
    for along, places, nodes in (("x", ys, xs), ("y", xs, ys)):
        table: dict[tuple[int, int], list[float]] = {}
        found = push_cutter(surface, z, places, radius, corner_radius, along=along)
        for k, low, high in zip(found.fibre.tolist(), found.low.tolist(), found.high.tolist(), strict=True):
            first, last = np.searchsorted(nodes, [low, high])
            if along == "x":
                inside[first:last, k] = True
            for end, cell in ((low, int(first) - 1), (high, int(last) - 1)):
                table.setdefault((cell, k) if along == "x" else (k, cell), []).append(end)
        tables.append(table)
    on_x, on_y = tables
    # both families judge a node; where rounding parts them, the end goes to the free node of its side
    for (i, j), ends in on_y.items():
        ends.sort()
        if (len(ends) % 2 == 1) != bool(inside[i, j] != inside[i, j + 1]):
            ends[:] = [] if inside[i, j] == inside[i, j + 1] else [float(ys[j + int(inside[i, j])])]
    for i, j in zip(*np.nonzero(inside[:, 1:] != inside[:, :-1]), strict=True):
        if not on_y.get((int(i), int(j))):
            on_y[(int(i), int(j))] = [float(ys[j + int(inside[i, j])])]
    for ends in on_x.values():
        ends.sort()
    return inside, on_x, on_y


def _loops(
    inside: Bools,
    on_x: dict[tuple[int, int], list[float]],
    on_y: dict[tuple[int, int], list[float]],
    xs: Floats,
    ys: Floats,
) -> list[Floats]:
    """Chords of all cells, joined."""
    cells = {(i, j - d) for i, j in on_x for d in (0, 1)} | {(i - d, j) for i, j in on_y for d in (0, 1)}
    follow: dict[tuple[int, int, int, int], tuple[int, int, int, int]] = {}
    place: dict[tuple[int, int, int, int], tuple[float, float]] = {}
    for i, j in sorted(cells):
        ring: list[tuple[int, int, int, int]] = []
        sides = ((0, i, j, False), (1, i + 1, j, False), (0, i, j + 1, True), (1, i, j, True))
        for axis, a, b, back in sides:
            ends = (on_y if axis else on_x).get((a, b), [])
            keys = [(axis, a, b, k) for k in range(len(ends))]
            for key, end in zip(keys, ends, strict=True):
                place[key] = (float(xs[a]), end) if axis else (end, float(ys[b]))
            ring += keys[::-1] if back else keys
        # out of the part at every second end, into it at the next; driven backwards, so that the part lies on the right
        for k in range(int(not inside[i, j]), len(ring), 2):
            follow[ring[(k + 1) % len(ring)]] = ring[k]
    loops = []
    while follow:
        begin = next(iter(follow))
        key, points = begin, []
        while key in follow:
            points.append(place[key])
            key = follow.pop(key)
        loops.append(np.array([*points, points[0]]))
    return loops


def _divided(loop: Floats, free: Callable[[Floats], Bools], chord: float) -> Floats:
    """A loop whose chords stay within the chord tolerance of where the tool touches, moved out where they would cut."""
    points = loop
    done = np.zeros(len(points) - 1, dtype=np.bool_)
    for _ in range(ROUNDS):
        asked = np.flatnonzero(~done)
        if not len(asked):
            break
        p, q = points[asked], points[asked + 1]
        way = q - p
        size = np.linalg.norm(way, axis=1)
        normal = np.column_stack([-way[:, 1], way[:, 0]]) / np.maximum(size, 1e-300)[:, None]  # free side
        middle = 0.5 * (p + q)
        # how far the middle has to go to touch: out where it cuts, in where it is free
        reach = 0.5 * size + chord
        out = ~free(middle)
        near, far = np.zeros(len(asked)), np.where(out, reach, -reach)
        for _ in range(40):
            half = 0.5 * (near + far)
            same = free(middle + half[:, None] * normal) == free(middle)
            near, far = np.where(same, half, near), np.where(same, far, half)
        found = np.where(out, far, near)
        lost = np.abs(np.abs(found) - reach) < 1e-3 * reach  # nothing to touch within reach
        split = (np.abs(found) > 0.5 * chord) & (size > 0.1 * chord) & ~lost
        done[asked] = ~split
        at = asked[split] + 1
        points = np.insert(points, at, (middle + found[:, None] * normal)[split], axis=0)
        done = np.insert(done, at, False)
    return points
