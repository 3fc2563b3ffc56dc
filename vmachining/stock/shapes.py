"""Raw stock as one value: box, upright cylinder, closed triangle mesh. No geometry kernel is needed for any of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Bools, Floats, Ints, rows
from vmachining.errors import StockError
from vmachining.geometry import RayIntervals
from vmachining.geometry.boxtree import box_tree, curve_order
from vmachining.stock import _kernels
from vmachining.tolerance import LENGTH_EPS_MM


@dataclass(frozen=True, slots=True)
class Blank:
    """Raw stock: box (lo, hi), cylinder (center, radius, z), a STEP file, or triangles. Lengths in mm.

    kind : "box", "cylinder", "step" or "triangles". triangles : rows of three corners, outward.
    """

    kind: str
    lo: tuple[float, float, float] = (0.0, 0.0, 0.0)
    hi: tuple[float, float, float] = (0.0, 0.0, 0.0)
    center: tuple[float, float] = (0.0, 0.0)
    radius: float = 0.0
    file: str = ""
    triangles: tuple[tuple[float, ...], ...] = ()

    @property
    def bounds(self) -> Floats | None:
        """(2, 3) mm of a box or a cylinder, to the last bit."""
        if self.kind == "box":
            return np.array([self.lo, self.hi], dtype=np.float64)
        if self.kind == "cylinder":
            (x, y), r = self.center, self.radius
            return np.array([(x - r, y - r, self.lo[2]), (x + r, y + r, self.hi[2])], dtype=np.float64)
        return None


SAG_SHARE = 3.0
"""chord / depth of a facet: facets inside and outside of a circle are then no more than the chord apart."""

MAX_STEP = np.pi / 8
"""Facets never turn by more, however coarse the chord."""

NUDGE_MM = 1e-9
"""How far a line steps aside that all but meets a corner of a mesh."""

TRIES = 4
"""Lines that still do not close count as outside; nobody has met one."""


class Triangles(NamedTuple):
    """vertices : (n, 3) mm. triangles : (m, 3) indices, counterclockwise seen from outside."""

    vertices: Floats
    triangles: Ints

    @property
    def volume(self) -> float:
        """mm^3 inside, if they are closed."""
        kinds = (self.vertices, np.float64), (self.triangles, np.int64)
        return float(_kernels.enclosed(*(np.require(v, kind, ["C", "W"]) for v, kind in kinds)))


class Stock(Protocol):
    """Raw stock of a job. Engines take from it what they need.

    bounds : (2, 3) mm, its box.
    """

    @property
    def bounds(self) -> Floats: ...

    def signed_distance(self, points: Floats) -> Floats:
        """(n,) mm, negative inside, zero on the surface, changing by at most the way between two points."""
        ...

    def crossings(self, places: Floats) -> RayIntervals:
        """Heights (mm) between which upright lines through places (n, 2) are inside; touching ends are joined."""
        ...

    def mesh(self, chord: float) -> tuple[Triangles, Triangles]:
        """Closed meshes around and inside of it, no farther apart than `chord` (mm); one and the same if exact."""
        ...

    def solid(self) -> Blank:
        """It in numbers, for an engine that builds solids."""
        ...

    def slack_near(self, box: Floats) -> float:
        """mm^3 by which it may differ from what it represents inside of a box (2, 3) mm: 0 if it is exact there."""
        ...


class _Exact:
    """A stock that is what it represents."""

    __slots__ = ()

    def slack_near(self, box: Floats) -> float:
        return 0.0


@dataclass(frozen=True, slots=True, eq=False, init=False)
class BoxStock(_Exact):
    """Axis-parallel box; lo, hi (3,) mm."""

    lo: Floats
    hi: Floats

    def __init__(self, lo: ArrayLike, hi: ArrayLike) -> None:
        object.__setattr__(self, "lo", rows(lo, 3, name="box min"))
        object.__setattr__(self, "hi", rows(hi, 3, name="box max"))
        if not (self.lo < self.hi).all():
            raise StockError(f"box min {self.lo.tolist()} is not below max {self.hi.tolist()} on every axis")

    @property
    def bounds(self) -> Floats:
        """(2, 3) mm."""
        return np.stack([self.lo, self.hi])

    def crossings(self, places: Floats) -> RayIntervals:
        inside = (places > self.lo[:2]) & (places < self.hi[:2])
        return _uniform(inside[:, 0] & inside[:, 1], self.lo[2], self.hi[2])

    def mesh(self, chord: float) -> tuple[Triangles, Triangles]:
        (x0, y0, z0), (x1, y1, z1) = self.bounds.tolist()
        ring = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
        exact = prism(ring, z0, z1)
        return exact, exact

    def solid(self) -> Blank:
        (x, y, z), (a, b, c) = self.bounds.tolist()
        return Blank("box", (x, y, z), (a, b, c))

    def signed_distance(self, points: Floats) -> Floats:
        over = np.maximum(self.lo - points, points - self.hi)
        return np.asarray(np.linalg.norm(np.maximum(over, 0.0), axis=1) + np.minimum(over.max(axis=1), 0.0))


@dataclass(frozen=True, slots=True)
class CylinderStock(_Exact):
    """Upright cylinder about `center` (x, y), from z[0] to z[1]; mm."""

    center: tuple[float, float]
    radius: float
    z: tuple[float, float]

    def __post_init__(self) -> None:
        finite = np.isfinite([*self.center, self.radius, *self.z]).all()
        if not (finite and self.radius > 0.0 and self.z[0] < self.z[1]):
            raise StockError(
                f"cylinder of radius {self.radius:g} from z {self.z[0]:g} to {self.z[1]:g} is not a solid"
            )

    @property
    def bounds(self) -> Floats:
        """(2, 3) mm."""
        middle, r = np.array(self.center), self.radius
        return np.array([[*(middle - r), self.z[0]], [*(middle + r), self.z[1]]], dtype=np.float64)

    def crossings(self, places: Floats) -> RayIntervals:
        inside = ((places - self.center) ** 2).sum(axis=1) < self.radius**2
        return _uniform(inside, *self.z)

    def mesh(self, chord: float) -> tuple[Triangles, Triangles]:
        """See `Stock`. n tangents outside and 2 n corners inside.

        (area inside * 2 + area outside) / 3 is Huygens' rule, of fourth order in pi / n.
        """
        step = 2.0 * np.arccos(max(1.0 - chord / SAG_SHARE / self.radius, np.cos(MAX_STEP / 2.0)))
        n = 2 * max(4, int(np.ceil(np.pi / step - 1e-9)))
        rings = []
        for corners, reach in ((n, 1.0 / np.cos(np.pi / n)), (2 * n, 1.0)):
            angle = 2.0 * np.pi * np.arange(corners) / corners
            rings.append(self.center + self.radius * reach * np.column_stack([np.cos(angle), np.sin(angle)]))
        return prism(rings[0], *self.z), prism(rings[1], *self.z)

    def solid(self) -> Blank:
        low, high = self.z
        return Blank("cylinder", (0.0, 0.0, low), (0.0, 0.0, high), center=self.center, radius=self.radius)

    def signed_distance(self, points: Floats) -> Floats:
        aside = np.hypot(points[:, 0] - self.center[0], points[:, 1] - self.center[1]) - self.radius
        above = np.maximum(self.z[0] - points[:, 2], points[:, 2] - self.z[1])
        out = np.hypot(np.maximum(aside, 0.0), np.maximum(above, 0.0))
        return np.asarray(out + np.minimum(np.maximum(aside, above), 0.0))


class MeshStock(_Exact):
    """Closed mesh, taken as the exact stock. vertices (n, 3) mm; triangles (m, 3) of indices, outward.

    What a mesh of a file must be is asked by `read_mesh` and `closed_mesh`.
    """

    def __init__(self, vertices: ArrayLike, triangles: ArrayLike) -> None:
        self.vertices = rows(vertices, -1, 3, name="vertices")
        self.triangles: Ints = np.asarray(triangles, dtype=np.int64)
        if not self._cross.any():
            raise StockError("a mesh without area is not a stock")

    @property
    def corners(self) -> Floats:
        """(m, 3, 3) mm: corners of the triangles, counterclockwise seen from outside."""
        return np.asarray(self.vertices[self.triangles])

    @property
    def bounds(self) -> Floats:
        """(2, 3) mm."""
        used = self.vertices[np.unique(self.triangles)]
        return np.stack([used.min(axis=0), used.max(axis=0)])

    def mesh(self, chord: float) -> tuple[Triangles, Triangles]:
        exact = Triangles(self.vertices, self.triangles)
        return exact, exact

    def solid(self) -> Blank:
        """See `Stock`; a face for every triangle."""
        return Blank("triangles", triangles=tuple(map(tuple, self.corners.reshape(-1, 9).tolist())))

    def signed_distance(self, points: Floats) -> Floats:
        out = np.empty(len(points))
        where = np.ascontiguousarray(points, dtype=np.float64)
        _kernels.mesh_distances(where, *self.nearest, out)
        return out

    def crossings(self, places: Floats) -> RayIntervals:
        """See `Stock`.

        A line through an edge or a corner counts as if it stood a little aside, at the same side for all triangles.
        """
        where = np.array(places, dtype=np.float64)
        found = []
        todo = np.arange(len(where))
        for _ in range(TRIES):
            ray, height, enters, odd = self._hits(where[todo])
            found.append((todo[ray], height, enters))
            todo = todo[odd]
            if not len(todo):
                break
            where[todo] += NUDGE_MM
        ray, height, enters = (np.concatenate(column) for column in zip(*found, strict=True))
        counts = np.bincount(ray[enters], minlength=len(where))
        order = np.argsort(ray, kind="stable")
        height, enters = height[order], enters[order]
        return _joined(RayIntervals(counts, height[enters], height[~enters]))

    def _hits(self, places: Floats) -> tuple[Ints, Floats, Bools, Ints]:
        """Line, height and kind of the ends of all intervals, line by line, rising; and lines that do not close.

        Rounding can let a line that all but meets a corner leave more often than it enters.
        """
        order = np.lexsort((places[:, 1], places[:, 0]))
        where, corners = np.ascontiguousarray(places[order]), np.ascontiguousarray(self.corners)
        hits, empty = np.zeros(len(where), dtype=np.int64), np.empty(0)
        _kernels.upright_hits(where, corners, hits, empty, empty, False)
        height, sense = np.empty(hits.sum()), np.empty(hits.sum())
        _kernels.upright_hits(where, corners, np.cumsum(hits) - hits, height, sense, True)
        ray = np.repeat(order, hits)
        balance = np.zeros(len(where))
        np.add.at(balance, ray, sense)
        odd = balance != 0.0
        keep = ~odd[ray]
        ray, height, sense = ray[keep], height[keep], sense[keep]
        rising = np.lexsort((-sense, height, ray))  # entries first: solids that touch are one
        ray, height, sense = ray[rising], height[rising], sense[rising]
        depth = np.cumsum(sense)
        ends = ((sense > 0.0) & (depth == 1.0)) | ((sense < 0.0) & (depth == 0.0))
        return ray[ends], height[ends], sense[ends] > 0.0, np.flatnonzero(odd)

    @cached_property
    def _cross(self) -> Floats:
        a, b, c = self.corners.transpose(1, 0, 2)
        return np.asarray(np.cross(b - a, c - a))

    @cached_property
    def nearest(self) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        """Corners and pseudonormals of the triangles that have an area, and a tree over them, see `_kernels.mesh_distances`."""
        _, member = np.unique(self.vertices, axis=0, return_inverse=True)
        corner = member.reshape(-1)[self.triangles]
        a, b, c = (np.ascontiguousarray(p) for p in self.corners.transpose(1, 0, 2))
        size = np.linalg.norm(self._cross, axis=1)
        real = size > 0.0  # slivers without area have no side; their edges belong to neighbours too
        a, b, c, corner = a[real], b[real], c[real], corner[real]
        normal = self._cross[real] / size[real, None]
        order = curve_order((a + b + c) / 3.0)  # neighbours get into one leaf of the tree
        a, b, c, corner, normal = a[order], b[order], c[order], corner[order], normal[order]
        boxes = box_tree(np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c), _kernels.LEAF)
        return a, b, c, _pseudonormals(a, b, c, corner, normal), boxes


class StepStock(MeshStock):
    """Solid of a STEP file, known to most by triangles within `chord` mm of it.

    file : of the solid itself. exact_mm3 : its volume. curved : (k, 3, 3) mm, triangles of faces that are not plane.
    """

    def __init__(self, mesh: MeshStock, *, file: str, exact_mm3: float, curved: Floats, chord: float) -> None:
        super().__init__(mesh.vertices, mesh.triangles)
        self.file, self.exact_mm3, self.curved, self.chord = file, exact_mm3, curved, chord

    def solid(self) -> Blank:
        """See `Stock`; the faces of the file."""
        return Blank("step", file=self.file)

    @property
    def slack_mm3(self) -> float:
        """Bound of the volume between the solid and its triangles: chord times curved area, to first order.

        Every removed volume can be off by at most that.
        """
        return self.chord * _area(self.curved)

    def slack_near(self, box: Floats) -> float:
        """See `Stock`: 0 where no curved face comes near."""
        low, high = self.curved.min(axis=1) - self.chord, self.curved.max(axis=1) + self.chord
        return self.chord * _area(self.curved[((low <= box[1]) & (high >= box[0])).all(axis=1)])


def _area(corners: Floats) -> float:
    """mm^2 of triangles (n, 3, 3)."""
    a, b, c = corners.transpose(1, 0, 2)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2.0)


def prism(ring: Floats, low: float, high: float) -> Triangles:
    """Upright prism over a convex polygon (n, 2), counterclockwise."""
    n = len(ring)
    points = np.empty((2 * n, 3))
    points[:n, :2] = points[n:, :2] = ring
    points[:n, 2], points[n:, 2] = low, high
    i, j = np.arange(n), (np.arange(n) + 1) % n
    cap = np.stack([np.zeros(n - 2, np.int64), np.arange(1, n - 1), np.arange(2, n)], axis=1)
    walls = [np.stack([i, j, j + n], 1), np.stack([i, j + n, i + n], 1)]
    return Triangles(points, np.concatenate([*walls, cap[:, ::-1], cap + n]))


def _joined(rays: RayIntervals) -> RayIntervals:
    """Without gaps that are only rounding."""
    ray = np.repeat(np.arange(len(rays.counts)), rays.counts)
    real = np.ones(len(ray) + 1, dtype=np.bool_)
    real[1:-1] = (ray[1:] != ray[:-1]) | (rays.enter[1:] - rays.leave[:-1] > LENGTH_EPS_MM)
    counts = np.bincount(ray[real[:-1]], minlength=len(rays.counts))
    return RayIntervals(counts.astype(np.int64), rays.enter[real[:-1]], rays.leave[real[1:]])


def _uniform(inside: Bools, low: float, high: float) -> RayIntervals:
    """One interval for every line that is inside."""
    count = int(inside.sum())
    return RayIntervals(inside.astype(np.int64), np.full(count, low), np.full(count, high))


def _pseudonormals(a: Floats, b: Floats, c: Floats, corner: Ints, normal: Floats) -> Floats:
    """(m, 7, 3): of faces, edges (sum of both faces) and corners (sum by the angle of every face there)."""
    out = np.empty((len(a), 7, 3))
    out[:, 0] = normal
    every = np.sort(np.concatenate([corner[:, [0, 1]], corner[:, [1, 2]], corner[:, [2, 0]]]), axis=1)
    _, edge = np.unique(every, axis=0, return_inverse=True)
    edge = edge.reshape(-1)
    total = np.zeros((edge.max() + 1, 3))
    np.add.at(total, edge, np.tile(normal, (3, 1)))
    out[:, 1:4] = total[edge].reshape(3, -1, 3).transpose(1, 0, 2)
    at = np.zeros((corner.max() + 1, 3))
    for k, (p, q, r) in enumerate(((a, b, c), (b, c, a), (c, a, b))):
        u, v = q - p, r - p
        angle = np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), (u * v).sum(axis=1))
        np.add.at(at, corner[:, k], angle[:, None] * normal)
    out[:, 4:] = at[corner]
    return out
