"""Triangles for a file without topology: where readers join equal corners, every edge still has two triangles.

Walls of a workpiece that touch along a line share its points, and four triangles meet at its edges; so they do where
rounding joins corners. Readers then say that the solid is open. Here

1. corners are rounded as the file will hold them, triangles that collapse are dropped, and so are pairs that cover
   each other from both sides (what is between them has no volume),
2. at an edge of more than two triangles, those that bound one wedge of material are paired: seen along the edge,
   directions of triangles alternate between leaving and entering material,
3. every pair but the first gets its own point in the middle of the edge, moved a little into its wedge, and its
   two triangles are divided there. No other point moves.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from math import sqrt
from typing import TypeAlias

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.stock import _kernels

Edge: TypeAlias = tuple[int, int]
AXES = np.eye(3)

STEPS = 4.0
"""Units in the last place of the file by which a new point lies beside its edge; doubled until it is alone."""

LEAST_MM = 1e-6
"""Points nearer than 1e-8 mm are joined by readers, so new ones keep off by a hundred times that."""


def twofold(
    points: Floats, triangles: Ints, rounded: Callable[[Floats], Floats], ulp: float
) -> tuple[Floats, Ints, Ints]:
    """Points (n, 3) and triangles (m, 3) of the same surface; each edge of a closed one has two triangles.

    rounded : coordinates as the file will hold them. ulp : mm, relative unit of the last place there.
    Returns points, triangles, and (m,) which of the triangles given each is, or is a piece of.
    """
    points, triangles, source = _joined(rounded(points), triangles)
    edges = defaultdict(list)
    turned = np.roll(triangles, -1, axis=1)
    ends = (np.minimum(triangles, turned) * len(points) + np.maximum(triangles, turned)).ravel()
    order = np.sort(ends)
    for k in np.flatnonzero(np.isin(ends, order[2:][order[2:] == order[:-2]])).tolist():
        edges[divmod(int(ends[k]), len(points))].append(k // 3)
    if not edges:
        return points, triangles, source
    taken = {tuple(point) for point in points.tolist()}
    added: list[list[float]] = []
    inserted: dict[int, dict[Edge, int]] = defaultdict(dict)
    for edge, members in sorted(edges.items()):
        for one, other in _wedges(points, triangles, edge, members)[1:]:
            spot = _beside(points, triangles, edge, (one, other), rounded, ulp, taken)
            taken.add(tuple(spot))
            for face in (one, other):
                inserted[face][edge] = len(points) + len(added)
            added.append(spot)
    keep = np.ones(len(triangles), dtype=bool)
    keep[list(inserted)] = False
    spotted = sorted(inserted.items())
    pieces = [(face, piece) for face, spots in spotted for piece in _divided(triangles[face].tolist(), spots)]
    divided = np.array([piece for _, piece in pieces], dtype=np.int64).reshape(-1, 3)
    whose = source[np.array([face for face, _ in pieces], dtype=np.int64)]
    new = np.array(added, dtype=np.float64).reshape(-1, 3)
    sources = np.concatenate([source[keep], whose])
    return np.concatenate([points, new]), np.concatenate([triangles[keep], divided]), sources


def _joined(points: Floats, triangles: Ints) -> tuple[Floats, Ints, Ints]:
    """Equal points are one; without triangles that collapse, and pairs of them that face each other. Which are left."""
    points = np.ascontiguousarray(points + 0.0)  # no -0
    where, first = _different(points.view(np.int64))
    points, triangles = points[first], where[triangles]
    a, b, c = triangles.T
    real = (a != b) & (b != c) & (c != a)
    triangles = triangles[real]
    first = triangles.argmin(axis=1)  # turned so that the smallest index comes first, which keeps the sense
    turned = np.take_along_axis(triangles, (first[:, None] + np.arange(3)) % 3, axis=1)
    up = turned[:, 1] < turned[:, 2]
    same = np.sort(turned, axis=1)
    group, _ = _different(same)
    spare = np.minimum(np.bincount(group, up), np.bincount(group, ~up)).astype(np.int64)
    keep = np.ones(len(turned), dtype=bool)
    for sense in (up, ~up):
        left = spare.copy()
        for k in np.flatnonzero(sense & (spare[group] > 0)).tolist():
            if left[group[k]] > 0:
                left[group[k]] -= 1
                keep[k] = False
    return points, turned[keep], np.flatnonzero(real)[keep]


def _different(rows: Ints) -> tuple[Ints, Ints]:
    """Which of the rows (n, 3) that differ each is, and the first row of each."""
    which, first = np.empty(len(rows), dtype=np.int64), np.empty(len(rows), dtype=np.int64)
    count = _kernels.different(rows, which, first)
    return which, first[:count]


def _cross(a: Floats, b: Floats) -> Floats:
    """np.cross of two vectors, a tenth of its time."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx))


def _size(a: Floats) -> float:
    """np.linalg.norm of one vector."""
    return sqrt(a.dot(a))


def _wedges(points: Floats, triangles: Ints, edge: Edge, members: list[int]) -> list[tuple[int, int]]:
    """Pairs of triangles that bound one wedge of material each, by their order about the edge."""
    u, v = edge
    along = points[v] - points[u]
    along = along / _size(along)
    helper = AXES[int(np.argmin(np.abs(along)))]
    x = _cross(along, helper)
    x /= _size(x)
    y = _cross(along, x)
    found = []
    for face in members:
        a, b, c = triangles[face].tolist()
        corner = next(k for k in (a, b, c) if k not in edge)
        t = points[corner] - points[u]
        leaves = (u, v) in ((a, b), (b, c), (c, a))
        found.append((float(np.arctan2(t @ y, t @ x)), leaves, face))
    # material lies below the angle of a triangle that runs u -> v: with angles falling, that opens a wedge
    found.sort(key=lambda item: (-item[0], not item[1], item[2]))
    open_: list[int] = []
    pairs: list[tuple[int, int]] = []
    for _, opens, face in found * 2:
        if opens and all(face not in pair for pair in pairs) and face not in open_:
            open_.append(face)
        elif not opens and open_ and all(face not in pair for pair in pairs):
            pairs.append((open_.pop(), face))
    return sorted(pairs)


def _beside(
    points: Floats,
    triangles: Ints,
    edge: Edge,
    faces: tuple[int, int],
    rounded: Callable[[Floats], Floats],
    ulp: float,
    taken: set[tuple[float, ...]],
) -> list[float]:
    """A point of nobody else's near the middle of an edge, in the wedge between two triangles."""
    u, v = edge
    middle = 0.5 * (points[u] + points[v])
    into = np.zeros(3)
    for face in faces:
        a, b, c = points[triangles[face]]
        normal = _cross(b - a, c - a)
        size = _size(normal)
        into -= normal / size if size > 0.0 else 0.0
    if _size(into) < 1e-3:  # a blade: along one of its sides
        corner = next(k for k in triangles[faces[0]].tolist() if k not in edge)
        into = points[corner] - middle
    into = into / max(_size(into), 1e-300)
    step = max(STEPS * ulp * float(np.abs(middle).max()), LEAST_MM)
    for turn in range(40):
        spot = rounded((middle + step * into)[None])[0] + 0.0
        if tuple(spot.tolist()) not in taken:
            break
        step *= 2.0 if turn % 3 else -1.0
    return [float(value) for value in spot]


def _divided(face: list[int], spots: dict[Edge, int]) -> list[list[int]]:
    """A triangle with points on some of its edges, as triangles."""
    outline = []
    for a, b in zip(face, face[1:] + face[:1], strict=True):
        outline.append(a)
        if (spot := spots.get((min(a, b), max(a, b)))) is not None:
            outline.append(spot)
    begin = next(k for k, corner in enumerate(outline) if corner not in face)
    ring = outline[begin:] + outline[:begin]
    # ears at old corners between two new points first, so that no diagonal runs along an edge
    pieces = []
    while len(ring) > 3:
        old = [corner in face for corner in ring]
        ears = (k for k in range(len(ring)) if old[k] and not old[k - 1] and not old[(k + 1) % len(ring)])
        if (ear := next(ears, None)) is None:  # one new point left: the fan about it
            break
        pieces.append([ring[ear - 1], ring[ear], ring[(ear + 1) % len(ring)]])
        del ring[ear]
    start = next((k for k, corner in enumerate(ring) if corner not in face), 0)
    ring = ring[start:] + ring[:start]
    pieces += [[ring[0], ring[k], ring[k + 1]] for k in range(1, len(ring) - 1)]
    return pieces
