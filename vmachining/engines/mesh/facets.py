"""Facets of a cutter: its meridian as a polyline and its circles as polygons, in three flavours.

`inner`  every facet lies inside the true body,
`outer`  every facet lies outside, tangent to it,
`fair`   arcs keep their area, so that the bias of a volume cancels facet by facet.

In all three the ends of an arc and the two points of a circle beside the heading stay exact: the flat
bottom, the cylinder and the walls that a straight move leaves have no facet error at all.

    sag = R (1 - cos(D/2))          depth of a facet of angle D on radius R
    inner  vertices on the arc, every D
    outer  tangents at both ends and at the middle of every inner facet: vertices at R / cos(D/2)
    fair   inner vertices, but for the first and the last, at k R; k from
           2 k s + (q - 2) k^2 s = q D,   s = sin D     (area of q facets = area of the sector)

With q >= 4 facets in an arc k < 1/cos(D/2), hence inner < fair < outer as sets.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.errors import EngineError
from vmachining.tool import Profile

FACET_SHARE: Final = 3.0
"""chord / sag of a facet. The gap between inner and outer adds up from circle, meridian and path: one each."""

SHARP: Final = np.pi / 4
"""Facets that meet at a larger angle meet at an edge of the cutter; see MAX_STEP for the round ones."""

MIN_STEPS: Final = 4
MAX_STEP: Final = np.pi / 8
"""Facets of a half circle never exceed 22.5 degrees, however coarse the chord."""


class Side(StrEnum):
    """Which way a faceted solid may deviate from the truth."""

    INNER = "inner"
    FAIR = "fair"
    OUTER = "outer"


def arc_steps(radius: float, angle: float, sag: float) -> int:
    """Number of facets of an arc of `angle` (rad) whose depth stays below `sag`."""
    if radius <= 0.0 or angle <= 0.0:
        return 1
    step = 2.0 * np.arccos(max(1.0 - sag / radius, np.cos(MAX_STEP / 2)))
    return max(MIN_STEPS, int(np.ceil(angle / step - 1e-9)))


def unit_arc(begin: float, end: float, steps: int, side: Side) -> Floats:
    """Vertices (k, 2) that represent the unit arc from angle `begin` to `end` > `begin`, both ends exact."""
    width = (end - begin) / steps
    if side is Side.OUTER:
        tangents = np.concatenate([[begin], begin + width * (np.arange(steps) + 0.5), [end]])
        middle, half = (tangents[1:] + tangents[:-1]) / 2, (tangents[1:] - tangents[:-1]) / 2
        inside = np.stack([np.cos(middle), np.sin(middle)], axis=1) / np.cos(half)[:, None]
        ends = [[np.cos(begin), np.sin(begin)]], [[np.cos(end), np.sin(end)]]
        return np.concatenate([ends[0], inside, ends[1]])
    angles = np.linspace(begin, end, steps + 1)
    angles = np.linspace(begin, end, steps + 1)
    points = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    if side is Side.FAIR:
        points[1:-1] *= fair_radius(steps, width)
    return points


def fair_radius(steps: int, width: float) -> float:
    """Of the inner corners of a unit arc in facets of an angle `width`: k of the head of this file."""
    s = float(np.sin(width))
    b = (steps - 2) * s
    return float((np.sqrt(s * s + b * steps * width) - s) / b) if b > 0 else width / s


def circle(steps: int, side: Side) -> Floats:
    """Polygon (n, 2) of the unit circle, counter-clockwise, heading along +x, exact at +-90 degrees.

    `steps` counts the facets of half a circle.
    """
    half = unit_arc(-np.pi / 2, np.pi / 2, steps, side)
    if side is Side.OUTER:
        half = half[1:-1]  # the wall points are inside the tangent facets, no corners
        return np.concatenate([half, -half])
    return np.concatenate([half[:-1], -half[:-1]])


def meridian(profile: Profile, sag: float, side: Side) -> Floats:
    """Polyline (k, 2) of (r, z), bottom up, of a convex profile; z does not fall, r >= 0."""
    points = [profile.points[:1]]
    for i, radius in enumerate(profile.radii):
        if radius <= 0.0:
            points.append(profile.points[i + 1 : i + 2])
            continue
        a, b, c = profile.points[i], profile.points[i + 1], profile.centers[i]
        begin, end = np.arctan2(*(a - c)[::-1]), np.arctan2(*(b - c)[::-1])
        unit = unit_arc(begin, end, arc_steps(radius, end - begin, sag), side)
        arc = c + radius * unit
        arc[0], arc[-1] = a, b
        points.append(arc[1:])
    line = np.concatenate(points)
    line[:, 0] = np.maximum(line[:, 0], 0.0)
    line[:, 1] = np.maximum.accumulate(line[:, 1])
    return tidy(line)


@dataclass(frozen=True, slots=True, eq=False)
class Polyhedron:
    """Convex part of a cutter, tool frame, heading along +x.

    points (n, 3); triangles (m, 3), outward; normals (m, 3), unit; edges (k, 4): two points and the triangles
    on the left and on the right of the way from the first to the second; height: lowest and highest
    z; reach: largest radius; areas (m,) mm^2;
    turn: sine of half as much again as the largest angle between neighbouring facets of a round surface.
    """

    points: Floats
    triangles: Ints
    normals: Floats
    edges: Ints
    height: tuple[float, float]
    reach: float
    turn: float
    areas: Floats

    def shadow(self, level: float, rise: float) -> float:
        """mm^2 of the projection along the unit direction (level, 0, rise), without the upper rim's share.

        Half the sum of |n . d| over the facets; the disc on top makes the upper edge of the shadow.
        """
        along = np.abs(self.normals[:, 0] * level + self.normals[:, 2] * rise)
        top = self.normals[:, 2] > 1.0 - 1e-9
        return 0.5 * float(self.areas @ along - abs(rise) * self.areas[top].sum())


def rings(line: Floats, sag: float, side: Side) -> list[Floats]:
    """Polygons (n, 3) of the circles along the meridian, each with no more facets than the surface there needs.

    A facet that is too short by s on a circle is too low by s n_r on the surface, n_r the radial part of its
    normal: circles near a flat or round tip need few facets. Numbers of facets are q 2^k of one q, so that
    neighbouring circles share corners. A slab between two circles lies in the hull of their polygons, hence
    inner stays inside and outer outside.
    """
    step = np.diff(line, axis=0)
    steep = step[:, 1] / np.hypot(step[:, 0], step[:, 1])
    steep = np.maximum(np.concatenate([[0.0], steep]), np.concatenate([steep, [0.0]]))
    need = [
        arc_steps(float(r), np.pi, sag / max(float(n_r), 1e-6))
        for r, n_r in zip(line[:, 0], steep, strict=True)
    ]
    base = int(np.ceil(max(need) / 2 ** int(np.log2(max(need) / MIN_STEPS))))
    out = []
    for (r, z), steps in zip(line, need, strict=True):
        if r == 0.0:
            out.append(np.array([[0.0, 0.0, z]]))
            continue
        polygon = circle(base * 2 ** max(0, int(np.ceil(np.log2(steps / base) - 1e-9))), side) * r
        out.append(np.column_stack([polygon, np.full(len(polygon), z)]))
    return out


def polyhedron(line: Floats, sag: float, side: Side) -> Polyhedron:
    """Convex hull of circles along the meridian, see `rings`."""
    _, points, triangles, equations = hull(np.concatenate(rings(line, sag, side)))
    _, planes = np.unique(equations, axis=0, return_inverse=True)  # parts of one facet have the same numbers
    half = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    owner = np.tile(np.arange(len(triangles)), 3)
    left = {(int(u), int(v)): int(t) for (u, v), t in zip(half, owner, strict=True)}
    edges = np.array([(u, v, t, left[v, u]) for (u, v), t in left.items() if u < v], dtype=np.int64)
    a, b, c = points[triangles].transpose(1, 0, 2)
    areas = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    normals = _alike(_support_normals(points, triangles, left), planes.ravel(), areas)
    bends = np.arccos(np.clip(np.einsum("ij,ij->i", normals[edges[:, 2]], normals[edges[:, 3]]), -1.0, 1.0))
    bend = float(bends[bends < SHARP].max(initial=0.0))
    height, reach = (float(line[0, 1]), float(line[-1, 1])), float(np.hypot(points[:, 0], points[:, 1]).max())
    turn = float(np.sin(min(1.5 * bend, np.pi / 2)))
    return Polyhedron(points, triangles, normals, edges, height, reach, turn, areas)


def hull(cloud: Floats) -> tuple[Ints, Floats, Ints, Floats]:
    """Of a convex hull: which points are its corners (n,), these (n, 3), outward triangles (m, 3), their equations (m, 4).

    The same in every process. Raises EngineError where it degenerates.

    (The hull of manifold3d splits plane facets as its threads happen to meet them.)
    """
    from scipy.spatial import ConvexHull, QhullError  # slow to load: commands that cut no mesh start sooner

    try:
        found = ConvexHull(cloud, qhull_options="Qt")
    except QhullError as error:
        raise EngineError("a convex hull of facets degenerates", engine="mesh") from error
    used, corner = np.unique(found.simplices, return_inverse=True)
    triangles = corner.reshape(-1, 3)
    points = cloud[used]
    a, b, c = (points[triangles[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), found.equations[:, :3]) < 0.0
    triangles[inward] = triangles[inward][:, ::-1]
    order = np.argsort(points[triangles, 2].min(axis=1), kind="stable")
    return used, points, triangles[order].astype(np.int64), found.equations[order]


CHUNK = 256
"""Facets whose planes are held against all points at once."""


def _alike(normals: Floats, planes: Ints, areas: Floats) -> Floats:
    """Normals (m, 3), those in one plane as that of the largest triangle in it."""
    order = np.lexsort((-areas, planes))
    _, first, plane = np.unique(planes[order], return_index=True, return_inverse=True)
    out = np.empty_like(normals)
    out[order] = normals[order[first]][plane]
    return out


def _support_normals(points: Floats, triangles: Ints, left: dict[tuple[int, int], int]) -> Floats:
    """Unit outward normals whose planes bound the hull.

    A hull has slivers with a normal that is mere rounding; they take the one behind their longest edge.
    """
    corners = points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normals, axis=1)
    normals /= np.where(size > 0.0, size, 1.0)[:, None]
    scale = 1e-9 * (1.0 + float(np.abs(points).max()))
    beyond = -np.einsum("ij,ij->i", corners[:, 0], normals)
    for k in range(0, len(normals), CHUNK):  # all at once would be the largest array of the whole engine
        beyond[k : k + CHUNK] += (points @ normals[k : k + CHUNK].T).max(axis=0)
    doubtful = [int(t) for t in np.flatnonzero((beyond > scale) | (size == 0.0))]
    for _ in range(len(doubtful)):
        later = []
        for t in doubtful:
            a, b, c = (int(v) for v in triangles[t])
            sides = (a, b), (b, c), (c, a)
            u, v = max(sides, key=lambda e: float(np.linalg.norm(points[e[0]] - points[e[1]])))
            if left[v, u] in doubtful:
                later.append(t)
            else:
                normals[t] = normals[left[v, u]]
        if len(later) == len(doubtful):
            raise EngineError("the facets of a cutter degenerate; ask for a coarser chord", engine="mesh")
        doubtful = later
        if not doubtful:
            break
    return np.asarray(normals, dtype=np.float64)


def tidy(line: Floats) -> Floats:
    """Without repeated points and points in the middle of a straight run."""
    step = np.linalg.norm(np.diff(line, axis=0), axis=1)
    line = line[np.concatenate([[True], step > 1e-12])]
    if len(line) < 3:
        return line
    before, after = line[1:-1] - line[:-2], line[2:] - line[1:-1]
    bend = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    scale = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    keep: Bools = np.concatenate([[True], np.abs(bend) > 1e-12 * scale, [True]])
    return np.asarray(line[keep], dtype=np.float64)


def radius_at(line: Floats, z: Floats) -> Floats:
    """Radius of a convex meridian at heights z, the larger one where a disc makes it jump."""
    lower = np.interp(z, line[:, 1], line[:, 0])
    upper = np.interp(-z, -line[::-1, 1], line[::-1, 0])
    return np.asarray(np.maximum(lower, upper), dtype=np.float64)


def narrowed(line: Floats, radial: float, axial: float) -> Floats | None:
    """Meridian of the points that stay in the body when moved by `radial` sideways and `axial` up or down.

    None if nothing is left. Concave in z, so interpolation between its own breakpoints stays inside.
    """
    z = line[:, 1]
    lo, hi = z[0] + axial, z[-1] - axial
    if hi <= lo:
        return None
    if axial == 0.0:
        heights, r = z, line[:, 0] - radial
    else:
        heights = np.unique(np.clip(np.concatenate([z - axial, z + axial]), lo, hi))
        r = np.minimum(radius_at(line, heights - axial), radius_at(line, heights + axial)) - radial
    if r.max() <= 0.0:
        return None
    return tidy(clipped(np.stack([r, heights], axis=1)))


def clipped(line: Floats) -> Floats:
    """A polyline (k, 2) without its parts at negative first coordinate."""
    kept = [line[0]] if line[0, 0] >= 0 else []
    for a, b in itertools.pairwise(line):
        if (a[0] < 0) != (b[0] < 0):
            t = a[0] / (a[0] - b[0])
            kept.append(np.array([0.0, a[1] + t * (b[1] - a[1])]))
        if b[0] >= 0:
            kept.append(b)
    return np.array(kept)


def grown(line: Floats, radial: float, axial: float) -> Floats:
    """Meridian that holds every point of the body moved by `radial` sideways and `axial` up or down."""
    widest = int(np.argmax(line[:, 0]))
    last = len(line) - 1 - int(np.argmax(line[::-1, 0]))
    lower, upper = line[: widest + 1] + [radial, -axial], line[last:] + [radial, axial]
    return tidy(np.concatenate([lower, upper]))
