"""`DesignPart`: the part as designed, as vectors need it: heights, ways through it, features, points on them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import cos, pi
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.engines.vectors import _kernels
from vmachining.stock import MeshStock

OVERHANG_RAD = 90.01 * pi / 180.0
"""Slope above which a facet is an overhang: exported walls have n_z = +-1e-8 (spec E.2)."""

ON_SURFACE = 1e-7
"""Hits closer than this share of the part are the facet that a ray starts from: STL files have 24 bits."""


class Features(NamedTuple):
    """What upright vectors do not show (spec E.2).

    wall, overhang : (m,) facets with theta_V < theta <= 90.01 degrees, and above; the lowest face, which no cutter of the
        job is to reach, is neither.
    edge : (k, 2, 3) mm, ends of sharp edges. edge_normal : (k, 3) mean of the normals of their two facets.
    """

    wall: Bools
    overhang: Bools
    edge: Floats
    edge_normal: Floats


@dataclass(frozen=True, eq=False)
class DesignPart:
    """A closed mesh, facets without area left out."""

    mesh: MeshStock

    @property
    def bounds(self) -> Floats:
        """(2, 3) mm."""
        return self.mesh.bounds

    @cached_property
    def triangles(self) -> Ints:
        """(m, 3) indices of facets that have an area."""
        corners = self.mesh.corners
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        return np.asarray(self.mesh.triangles[np.linalg.norm(cross, axis=1) > 0.0])

    @cached_property
    def corners(self) -> Floats:
        """(m, 3, 3) mm."""
        return np.ascontiguousarray(self.mesh.vertices[self.triangles])

    @cached_property
    def normals(self) -> Floats:
        """(m, 3) outward, unit."""
        cross = np.cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0])
        return np.asarray(cross / np.linalg.norm(cross, axis=1, keepdims=True))

    @cached_property
    def slopes(self) -> Floats:
        """(m,) rad: theta = acos(n_z)."""
        return np.asarray(np.arctan2(np.hypot(self.normals[:, 0], self.normals[:, 1]), self.normals[:, 2]))

    @cached_property
    def size(self) -> float:
        """mm, diagonal of its box."""
        return float(np.linalg.norm(np.ptp(self.bounds, axis=0)))

    def by_tile(self, low: Floats, size: float, tiles: tuple[int, int]) -> tuple[Ints, Ints]:
        """Facets whose boxes seen from above meet a tile, for all tiles (a, b) of some size (mm) from `low` (2,) on.

        Those of tile (a, b) are facets[first[a * tiles[1] + b] : first[a * tiles[1] + b + 1]], rising.
        """
        seen = self.corners[:, :, :2]
        ends = (np.floor((v - low) / size).astype(np.int64) for v in (seen.min(axis=1), seen.max(axis=1)))
        begin, last = (np.clip(v, 0, np.array(tiles) - 1) for v in ends)
        wide = last - begin + 1
        many = wide.prod(axis=1)
        facet = np.repeat(np.arange(len(many)), many)
        k = np.arange(len(facet)) - np.repeat(np.cumsum(many) - many, many)
        step, across = np.divmod(k, wide[facet, 1])
        tile = (begin[facet, 0] + step) * tiles[1] + begin[facet, 1] + across
        order = np.argsort(tile, kind="stable")
        first = np.concatenate([[0], np.cumsum(np.bincount(tile, minlength=tiles[0] * tiles[1]))])
        return facet[order], first

    def leave(self, origins: Floats, directions: Floats, most: float) -> Floats:
        """(n,) mm on the way out of the part; inf where it is more than `most`."""
        return first_hits(self.mesh, origins, directions, 1.0, ON_SURFACE * self.size, most)

    def meet(self, origins: Floats, directions: Floats, most: float) -> Floats:
        """(n,) mm until the part is entered again; inf where it is more than `most`."""
        return first_hits(self.mesh, origins, directions, -1.0, ON_SURFACE * self.size, most)


def first_hits(
    mesh: MeshStock, origins: Floats, directions: Floats, sense: float, least: float, most: float
) -> Floats:
    """(n,) mm to the first facet that a ray leaves (1) or enters (-1) by, between `least` and `most`; inf if none."""
    a, b, c, _, boxes = mesh.nearest
    out = np.empty(len(origins))
    rays = np.ascontiguousarray(origins), np.ascontiguousarray(directions)
    _kernels.first_hits(*rays, sense, least, most, a, b, c, boxes, out)
    return out


def features(part: DesignPart, theta_v: float, theta_sharp: float) -> Features:
    """Walls, overhangs and sharp edges of a part; theta_v, theta_sharp in rad."""
    theta = part.slopes
    lowest = (theta > OVERHANG_RAD) & (
        part.corners[:, :, 2].max(axis=1) <= part.bounds[0, 2] + ON_SURFACE * part.size
    )
    overhang = (theta > OVERHANG_RAD) & ~lowest
    wall = (theta > theta_v) & (theta <= OVERHANG_RAD)
    used, place = np.unique(part.mesh.vertices, axis=0, return_inverse=True)
    corner = place.reshape(-1)[part.triangles]
    ends = np.sort(np.concatenate([corner[:, [0, 1]], corner[:, [1, 2]], corner[:, [2, 0]]]), axis=1)
    facet = np.tile(np.arange(len(corner)), 3)
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    ends, facet = ends[order], facet[order]
    pair = np.flatnonzero((ends[1:] == ends[:-1]).all(axis=1))
    first, second = part.normals[facet[pair]], part.normals[facet[pair + 1]]
    mean = first + second
    size = np.linalg.norm(mean, axis=1)
    sharp = ((first * second).sum(axis=1) < cos(theta_sharp)) & (size > 1e-9)
    below = lowest[facet[pair]] | lowest[facet[pair + 1]]
    kept = sharp & ~below
    return Features(wall, overhang, used[ends[pair[kept]]], mean[kept] / size[kept, None])
