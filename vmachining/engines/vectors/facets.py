"""Swept envelopes as facets, as published (spec E.5): tool surfaces at both ends, and strips between their silhouettes.

The cutter is inscribed: corners lie on its surface, facets at most `chord` inside. Where the axis turns, the block is
divided until no corner of the cutter leaves its chord by more than that.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.geometry import Line
from vmachining.sweep import Motion, Sweep, Turn
from vmachining.sweep.pose import tool_frame
from vmachining.tool import Profile

__all__ = ["envelope"]

MOST_STEPS = 256


def envelope(sweep: Sweep, chord: float) -> Floats:
    """(k, 3, 3) mm: corners of facets, outward normals by their order."""
    points, triangles, pairs = _tool(sweep.profile, chord)
    poses = _poses(sweep, points, chord)
    found = []
    for begin, end in pairwise(poses):
        found.append(_between(begin, end, triangles, pairs))
    return np.ascontiguousarray(np.concatenate(found))


def _between(begin: Floats, end: Floats, triangles: Ints, pairs: Ints) -> Floats:
    """Facets of one step: those at the start that trail, those at the end that lead, and strips over the silhouette."""
    move = end - begin
    if not move.any():
        return begin[triangles]
    a, b, c = (begin[triangles[:, k]] for k in range(3))
    e, f, g = (end[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a) + np.cross(f - e, g - e)
    lead = (normal * move[triangles].mean(axis=1)).sum(axis=1) > 0.0
    one, two = lead[pairs[:, 2]], lead[pairs[:, 3]]
    # an edge runs from i to j in its first triangle: the strip keeps the side of the one that leads
    i, j = pairs[:, 0], pairs[:, 1]
    front = np.flatnonzero(one & ~two)
    back = np.flatnonzero(~one & two)
    p = np.concatenate([i[front], j[back]])
    q = np.concatenate([j[front], i[back]])
    strips = [np.stack([begin[p], begin[q], end[q]], axis=1), np.stack([begin[p], end[q], end[p]], axis=1)]
    return np.concatenate([begin[triangles[~lead]], end[triangles[lead]], *strips])


def _poses(sweep: Sweep, points: Floats, chord: float) -> list[Floats]:
    """Corners of the tool at instants close enough."""
    path = sweep.path
    if isinstance(path, Line):
        return [points + path.start, points + path.end]
    steps = 4
    while True:
        t = np.linspace(0.0, 1.0, 2 * steps + 1)
        every = [_at(path, float(s), points) for s in t]
        bend = max(
            float(np.abs(every[k] - 0.5 * (every[k - 1] + every[k + 1])).max())
            for k in range(1, 2 * steps, 2)
        )
        if bend <= chord or steps >= MOST_STEPS:
            return every[::2]
        steps *= 2


def _at(path: Motion, t: float, points: Floats) -> Floats:
    place = np.asarray(path.position(t)).reshape(3)
    if isinstance(path, Turn):
        first = np.asarray(path.axis(0.0)).reshape(3)
        return np.asarray(
            place + (points @ tool_frame(first)) @ _least_turn(first, np.asarray(path.axis(t)).reshape(3)).T
        )
    return np.asarray(place + points)


def _least_turn(a: Floats, b: Floats) -> Floats:
    """(3, 3): the rotation in their plane that takes one unit vector to another, not opposite one."""
    x, y, z = np.cross(a, b)
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + skew + skew @ skew / (1.0 + float(a @ b)))


@lru_cache(maxsize=64)
def _tool(profile: Profile, chord: float) -> tuple[Floats, Ints, Ints]:
    """Points (n, 3), triangles (m, 3) and edges (k, 4): two ends, and the two triangles, the first running i to j."""
    ring: list[tuple[float, float]] = [(0.0, float(profile.points[0, 1]))]
    for s in profile.segments:
        many = 1
        if s.is_arc:
            low, high = s.beta
            step = 2.0 * np.arccos(max(1.0 - 0.5 * chord / s.radius, 0.0))
            many = max(1, int(np.ceil((high - low) / step)))
            beta = np.linspace(low, high, many + 1)
            arc = np.column_stack([s.cr + s.radius * np.cos(beta), s.cz + s.radius * np.sin(beta)])
            ring += [(r, z) for r, z in arc.tolist()]
        else:
            ring += [(s.r0, s.z0), (s.r1, s.z1)]
    ring.append((0.0, float(profile.points[-1, 1])))
    kept = [ring[0]]
    for r, z in ring[1:]:
        if abs(r - kept[-1][0]) + abs(z - kept[-1][1]) > 1e-12:
            kept.append((max(r, 0.0), z))
    around = max(8, int(np.ceil(np.pi / np.arccos(max(1.0 - 0.5 * chord / profile.max_radius, 0.0)))))
    turn = 2.0 * np.pi * np.arange(around) / around
    points, first = list[Floats](), list[Ints]()
    count = 0
    for r, z in kept:
        if r <= 1e-12:
            points.append(np.array([[0.0, 0.0, z]]))
            first.append(np.full(around, count))
            count += 1
        else:
            points.append(np.column_stack([r * np.cos(turn), r * np.sin(turn), np.full(around, z)]))
            first.append(count + np.arange(around))
            count += around
    faces = list[Ints]()
    for below, above in pairwise(first):
        one = np.stack([below, np.roll(below, -1), np.roll(above, -1)], axis=1)
        two = np.stack([below, np.roll(above, -1), above], axis=1)
        faces += [one, two]
    triangles = np.concatenate(faces)
    triangles = triangles[
        (triangles[:, 0] != triangles[:, 1])
        & (triangles[:, 1] != triangles[:, 2])
        & (triangles[:, 2] != triangles[:, 0])
    ]
    return np.concatenate(points), triangles, _pairs(triangles)


def _pairs(triangles: Ints) -> Ints:
    """(k, 4): ends of every edge as its first triangle runs, and both triangles."""
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    facet = np.tile(np.arange(len(triangles)), 3)
    order = np.lexsort((ends.max(axis=1), ends.min(axis=1)))
    ends, facet = ends[order], facet[order]
    return np.column_stack([ends[::2], facet[::2], facet[1::2]])
