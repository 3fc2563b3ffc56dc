"""Raw stock as a signed distance: box, upright cylinder, closed triangle mesh. No kernel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, Ints, rows
from vmachining.engagement import _kernels
from vmachining.errors import StockError

__all__ = ["BoxStock", "CylinderStock", "MeshStock", "Stock"]


class Stock(Protocol):
    """What an edge can be in."""

    def signed_distance(self, points: Floats) -> Floats:
        """(n,) mm, negative inside, zero on the surface, changing by at most the way between two points."""


@dataclass(frozen=True, slots=True, eq=False, init=False)
class BoxStock:
    """Axis-parallel box; lo, hi (3,) mm."""

    lo: Floats
    hi: Floats

    def __init__(self, lo: ArrayLike, hi: ArrayLike) -> None:
        object.__setattr__(self, "lo", rows(lo, 3, name="box min"))
        object.__setattr__(self, "hi", rows(hi, 3, name="box max"))
        if not (self.lo < self.hi).all():
            raise StockError(f"box min {self.lo.tolist()} is not below max {self.hi.tolist()} on every axis")

    def signed_distance(self, points: Floats) -> Floats:
        over = np.maximum(self.lo - points, points - self.hi)
        return np.asarray(np.linalg.norm(np.maximum(over, 0.0), axis=1) + np.minimum(over.max(axis=1), 0.0))


@dataclass(frozen=True, slots=True)
class CylinderStock:
    """Upright cylinder about `center` (x, y), from z[0] to z[1]; mm."""

    center: tuple[float, float]
    radius: float
    z: tuple[float, float]

    def __post_init__(self) -> None:
        if not (self.radius > 0.0 and self.z[0] < self.z[1]):
            raise StockError(f"cylinder of radius {self.radius:g} from z {self.z[0]:g} to {self.z[1]:g} mm")

    def signed_distance(self, points: Floats) -> Floats:
        aside = np.hypot(points[:, 0] - self.center[0], points[:, 1] - self.center[1]) - self.radius
        above = np.maximum(self.z[0] - points[:, 2], points[:, 2] - self.z[1])
        out = np.hypot(np.maximum(aside, 0.0), np.maximum(above, 0.0))
        return np.asarray(out + np.minimum(np.maximum(aside, above), 0.0))


@dataclass(frozen=True, slots=True, eq=False, init=False)
class MeshStock:
    """Closed mesh, triangles outward. vertices (n, 3) mm; triangles (m, 3)."""

    _corners: tuple[Floats, Floats, Floats]
    _normals: Floats
    _boxes: Floats

    def __init__(self, vertices: ArrayLike, triangles: Ints) -> None:
        points = rows(vertices, -1, 3, name="vertices")
        _, member = np.unique(points, axis=0, return_inverse=True)
        corner = member.reshape(-1)[np.asarray(triangles)]
        a, b, c = (np.ascontiguousarray(points[np.asarray(triangles)[:, k]]) for k in range(3))
        cross = np.cross(b - a, c - a)
        size = np.linalg.norm(cross, axis=1)
        if not (size > 0.0).any():
            raise StockError("a mesh without area is no stock")
        real = size > 0.0  # slivers without area have no side; their edges belong to neighbours too
        a, b, c, corner = a[real], b[real], c[real], corner[real]
        normal = cross[real] / size[real, None]
        order = _along_a_curve((a + b + c) / 3.0)  # neighbours get into one leaf of the tree
        a, b, c, corner, normal = a[order], b[order], c[order], corner[order], normal[order]
        object.__setattr__(self, "_corners", (a, b, c))
        object.__setattr__(self, "_normals", _pseudonormals(a, b, c, corner, normal))
        object.__setattr__(
            self, "_boxes", _tree(np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c))
        )

    @property
    def corners(self) -> tuple[Floats, Floats, Floats]:
        """First, second and third corners (m, 3) of the triangles, mm."""
        return self._corners

    def signed_distance(self, points: Floats) -> Floats:
        out = np.empty(len(points))
        where = np.ascontiguousarray(points, dtype=np.float64)
        _kernels.mesh_distances(where, *self._corners, self._normals, self._boxes, out)
        return out


def _along_a_curve(points: Floats) -> Ints:
    """Order of points (n, 3) along a Morton curve: their coordinates in 21 bits each, interleaved."""
    low, size = points.min(axis=0), max(float(np.ptp(points, axis=0).max()), 1e-300)
    cell = ((points - low) * ((2**21 - 1) / size)).astype(np.uint64)
    code = np.zeros(len(points), dtype=np.uint64)
    for bit in range(21):
        for axis in range(3):
            code |= ((cell[:, axis] >> np.uint64(bit)) & np.uint64(1)) << np.uint64(3 * bit + axis)
    return np.argsort(code, kind="stable")


def _tree(low: Floats, high: Floats) -> Floats:
    """Boxes of a binary tree over triangles in order, see the legend of `_kernels.py`."""
    size = _kernels.LEAF
    leaves = 1 << max(0, (-(-len(low) // size) - 1).bit_length())
    boxes = np.empty((2 * leaves - 1, 6))
    for part, values, empty, reduce in (
        (slice(0, 3), low, np.inf, np.min),
        (slice(3, 6), high, -np.inf, np.max),
    ):
        padded = np.full((leaves * size, 3), empty)
        padded[: len(values)] = values
        level = reduce(padded.reshape(leaves, size, 3), axis=1)
        while True:
            boxes[len(level) - 1 : 2 * len(level) - 1, part] = level
            if len(level) == 1:
                break
            level = reduce(level.reshape(-1, 2, 3), axis=1)
    return boxes


def _pseudonormals(a: Floats, b: Floats, c: Floats, corner: Ints, normal: Floats) -> Floats:
    """(m, 7, 3): of faces, edges (sum of both faces) and corners (sum by the angle of every face there)."""
    out = np.empty((len(a), 7, 3))
    out[:, 0] = normal
    for k, (i, j) in enumerate(((0, 1), (1, 2), (2, 0))):
        ends = np.sort(corner[:, [i, j]], axis=1)
        if k == 0:
            every, sides = ends, normal
        else:
            every, sides = np.concatenate([every, ends]), np.concatenate([sides, normal])
    _, edge = np.unique(every, axis=0, return_inverse=True)
    edge = edge.reshape(-1)
    total = np.zeros((edge.max() + 1, 3))
    np.add.at(total, edge, sides)
    out[:, 1:4] = total[edge].reshape(3, -1, 3).transpose(1, 0, 2)
    at = np.zeros((corner.max() + 1, 3))
    for k, (p, q, r) in enumerate(((a, b, c), (b, c, a), (c, a, b))):
        u, v = q - p, r - p
        angle = np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), (u * v).sum(axis=1))
        np.add.at(at, corner[:, k], angle[:, None] * normal)
    out[:, 4:] = at[corner]
    return out
