"""Stocks of columns in any direction: convex ones with plane faces, and height fields of facets over a convex outline."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.engines.columns.roof._kernels import Roof
from vmachining.engines.columns.roof.facets import facets_of
from vmachining.engines.columns.turning.triangles._kernels import FACES
from vmachining.errors import StockError
from vmachining.stock import BoxStock, MeshStock, StepStock, Stock

FLAT_MM = 1e-9
"""How far corners of a convex stock may lie beyond its faces."""

FACETS = 20_000
"""Of a height field at most: all of them are turned for each direction of a block."""

AWAY = 20.0
"""How far the top continues beyond the outline, in extents of the stock: columns lean 85 degrees at most."""

UPRIGHT, STEEP = 1e-12, 1e-6
"""Cosine of a facet's normal and the columns: below the first it has no area to them, below the second it is too steep."""

LEAN = np.cos(np.radians(80.0))
"""Least cosine of columns over a height field and the z axis."""


class Solid(NamedTuple):
    """What lies behind all faces and, where it has a top, below it.

    faces : (m, 4) outward normal and offset. corners : (n, 3) mm. top : (f, 3, 3) corners of facets of the top, seen from above
    counterclockwise, upright ones among them, and such as continue it beyond the outline; none of a convex stock.
    normals : (f, 3) of these.
    """

    faces: Floats
    corners: Floats
    top: Floats
    normals: Floats

    @classmethod
    def under(cls, faces: Floats, corners: Floats, top: Floats) -> Solid:
        """With the normals of the top."""
        n = np.cross(top[:, 1] - top[:, 0], top[:, 2] - top[:, 0])
        return cls(faces, corners, top, n / np.linalg.norm(n, axis=1)[:, None])

    def within(self, low: Floats, high: Floats) -> Floats:
        """(m + 6, 4) its faces and those of a box; of the same normals only the tighter ones."""
        sides = np.column_stack([np.concatenate([np.eye(3), -np.eye(3)]), [*high, *-low]])
        faces, more = self.faces.copy(), []
        for side in sides:
            same = np.flatnonzero((faces[:, :3] == side[:3]).all(axis=1))
            if len(same):
                faces[same[0], 3] = min(faces[same[0], 3], side[3])
            else:
                more.append(side)
        return np.concatenate([faces, np.array(more).reshape(-1, 4)])

    def stands(self, d: Floats) -> bool:
        """Whether nothing of the top hangs over columns along d, so that each leaves the stock once."""
        cos = self.normals @ d
        return not len(cos) or bool(d[2] >= LEAN and ((cos >= STEEP) | (np.abs(cos) <= UPRIGHT)).all())

    def roof(self, frame: Floats, origin: Floats, root: Floats) -> Roof:
        """The top over first cells `root` in a frame with rows u, v, t along which it stands, in one tile."""
        near, end = self.normals @ frame[2] > UPRIGHT, root[:2] + 2.0 * root[2] * root[3:5]
        for way, first, last in zip(frame[:2], root[:2], end, strict=True):
            a, b, c = (self.top @ way - origin @ way).T
            near &= (np.minimum(np.minimum(a, b), c) <= last) & (np.maximum(np.maximum(a, b), c) >= first)
        p, n = (self.top[near] - origin) @ frame.T, self.normals[near] @ frame.T
        plane = np.column_stack(
            [p[:, 0], -n[:, :2] / n[:, 2:], p[:, :, 2].min(axis=1), p[:, :, 2].max(axis=1)]
        )
        one, none = np.array([0, len(p)]), np.zeros(0, dtype=np.int64)
        return Roof(
            np.array([0.0, 0.0, 1.0, 1.0]), np.ones(2, dtype=np.int64), plane, np.ascontiguousarray(p[:, :, :2].reshape(-1, 6)),
            one, np.arange(len(p)), np.zeros((0, 4)), np.zeros(2, dtype=np.int64), none,
        )  # fmt: skip


def solid_of(stock: Stock) -> Solid:
    """That of a job.

    Raises
    ------
    StockError
        It has curved faces, or is neither convex nor a height field over a convex outline.
    """
    if isinstance(stock, BoxStock):
        lo, hi = stock.bounds
        faces = np.concatenate([np.column_stack([np.eye(3), hi]), np.column_stack([-np.eye(3), -lo])])
        corners = np.array(
            [[x, y, z] for x in (lo[0], hi[0]) for y in (lo[1], hi[1]) for z in (lo[2], hi[2])]
        )
        return Solid.under(faces, corners, np.zeros((0, 3, 3)))
    if not isinstance(stock, MeshStock) or (isinstance(stock, StepStock) and len(stock.curved)):
        raise StockError(
            "columns in any direction need a stock with plane faces", remedy="take --engine mesh"
        )
    a, b, c = stock.corners.transpose(1, 0, 2)
    n = np.cross(b - a, c - a)
    size = np.linalg.norm(n, axis=1)
    n[size > 0.0] /= size[size > 0.0][:, None]
    faces = _faces(stock, n[size > 0.0])
    if len(faces) <= FACES and _on(stock.corners[size > 0.0], faces).all():
        return Solid.under(faces, stock.vertices, np.zeros((0, 3, 3)))
    return _height_field(stock, n)


def _faces(stock: MeshStock, normals: Floats) -> Floats:
    """(m, 4) planes along some normals that no corner of the stock lies beyond."""
    n = np.unique(np.round(normals, 12), axis=0)
    n /= np.linalg.norm(n, axis=1)[:, None]
    return np.column_stack([n, (stock.vertices @ n.T).max(axis=0)])


def _on(corners: Floats, faces: Floats) -> Bools:
    """(f,) which facets lie on one of the planes."""
    centres = corners.mean(axis=1)
    found: Bools = (faces[:, 3] - centres @ faces[:, :3].T).min(axis=1) <= FLAT_MM
    return found


def _height_field(stock: MeshStock, normals: Floats) -> Solid:
    facets_of(stock)  # refuses other bottoms, and what hangs over
    if len(stock.triangles) > FACETS:
        raise StockError("columns in any direction need a stock of fewer facets", remedy="take --engine mesh")
    level = normals[:, 2] < -0.5
    steep = (np.abs(normals[:, 2]) <= UPRIGHT) & normals.any(axis=1)
    walls = _faces(stock, normals[steep])
    outer = np.zeros(len(normals), dtype=bool)
    outer[steep] = _on(stock.corners[steep], walls)
    walls = _faces(stock, normals[outer])
    ends = stock.triangles[level]
    round_bottom = np.concatenate([ends[:, [0, 1]], ends[:, [1, 2]], ends[:, [2, 0]]])
    _, which, counts = np.unique(
        np.sort(round_bottom, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    outline = stock.vertices[round_bottom[counts[which.ravel()] == 1]]
    if len(walls) + 1 > FACES or not _on(outline, walls).all():
        raise StockError(
            "columns in any direction need a stock whose outline is convex, with few sides",
            remedy="take --engine mesh",
        )
    bottom = np.array([[0.0, 0.0, -1.0, -float(stock.bounds[0, 2])]])
    triangles = stock.triangles[~level & ~outer & (np.linalg.norm(normals, axis=1) > 0.5)]
    top = np.concatenate([stock.vertices[triangles], _beyond(stock, triangles, walls)])
    solid = Solid.under(np.concatenate([walls, bottom]), stock.vertices, top)
    if not solid.stands(np.array([0.0, 0.0, 1.0])):
        raise StockError("columns in any direction cannot use this stock's top", remedy="take --engine mesh")
    return solid


def _beyond(stock: MeshStock, top: Ints, walls: Floats) -> Floats:
    """(k, 3, 3) the top continued outward: along the normal of each wall without slope, level around corners of the outline.

    Raises
    ------
    StockError
        An edge of the top that is no other facet's lies on no wall, or on two.
    """
    far = AWAY * float(np.ptp(stock.vertices, axis=0).max())
    ends = np.concatenate([top[:, [0, 1]], top[:, [1, 2]], top[:, [2, 0]]])
    _, which, counts = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True, return_counts=True)
    alone = ends[counts[which.ravel()] == 1]
    p = stock.vertices[alone]
    on = (np.abs(p @ walls[:, :3].T - walls[:, 3]) <= FLAT_MM).all(axis=1)
    if (on.sum(axis=1) != 1).any():
        raise StockError(
            "columns in any direction cannot use this stock's outline", remedy="take --engine mesh"
        )
    out = far * walls[np.argmax(on, axis=1), :3]
    strips = [
        np.stack([p[:, 1], p[:, 0], p[:, 0] + out], axis=1),
        np.stack([p[:, 1], p[:, 0] + out, p[:, 1] + out], axis=1),
    ]
    here, there = {int(e[0]): k for k, e in enumerate(alone)}, {int(e[1]): k for k, e in enumerate(alone)}
    wedges = []
    for vertex, k in here.items():
        j = there.get(vertex)
        if j is not None and np.abs(out[j] - out[k]).max() > FLAT_MM:
            at = stock.vertices[vertex]
            wedges.append(np.array([at, at + out[j], at + out[k]]))
    return np.concatenate([*strips, np.array(wedges).reshape(-1, 3, 3)])
