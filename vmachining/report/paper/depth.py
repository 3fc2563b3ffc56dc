"""Triangles seen along a direction: nearest face in every pixel, in NumPy alone."""

from __future__ import annotations

import numpy as np

from vmachining.arrays import Floats, Ints

__all__ = ["nearest_faces"]

CHUNK = 4_000_000
"""Pairs of pixel and triangle that are tested at once."""


def nearest_faces(
    points: Floats, triangles: Ints, corner: Floats, pixel: float, shape: tuple[int, int]
) -> tuple[Floats, Ints]:
    """What an orthographic camera sees.

    Parameters
    ----------
    points : (n, 3) mm; the first two coordinates lie in the picture, the third points at the camera.
    triangles : (m, 3) rows of `points`.
    corner : (2,) mm, lower left corner of the picture. pixel : mm, side of a pixel. shape : rows and columns.

    Returns
    -------
    depth : (rows, columns) mm, third coordinate at the middle of each pixel, -inf where nothing is.
    face : (rows, columns) triangle that is seen, -1 where nothing is.
    """
    high, wide = shape
    depth = np.full(high * wide, -np.inf)
    face = np.full(high * wide, -1, dtype=np.int64)
    corners = points[triangles]
    flat = (corners[:, :, :2] - corner) / pixel - 0.5  # the middle of pixel (i, j) is at (j, i)
    first = np.maximum(np.ceil(flat.min(axis=1)), 0).astype(np.int64)
    last = np.minimum(np.floor(flat.max(axis=1)), [wide - 1, high - 1]).astype(np.int64)
    size = np.maximum(last - first + 1, 0)
    count = size.prod(axis=1)
    a, b, c = flat[:, 0], flat[:, 1], flat[:, 2]
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    todo = np.flatnonzero((count > 0) & (area != 0.0))
    ends = np.cumsum(count[todo])
    start = 0
    while start < len(todo):
        base = ends[start - 1] if start else 0
        stop = max(int(np.searchsorted(ends, base + CHUNK, side="right")), start + 1)
        mine = todo[start:stop]
        owner = np.repeat(mine, count[mine])
        place = np.arange(len(owner)) - np.repeat(np.cumsum(count[mine]) - count[mine], count[mine])
        x = first[owner, 0] + place % size[owner, 0]
        y = first[owner, 1] + place // size[owner, 0]
        u = (x - a[owner, 0]) * (c[owner, 1] - a[owner, 1]) - (y - a[owner, 1]) * (c[owner, 0] - a[owner, 0])
        v = (b[owner, 0] - a[owner, 0]) * (y - a[owner, 1]) - (b[owner, 1] - a[owner, 1]) * (x - a[owner, 0])
        u, v = u / area[owner], v / area[owner]
        inside = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1.0 + 1e-9)
        owner, u, v = owner[inside], u[inside], v[inside]
        z = corners[owner, :, 2]
        far = z[:, 0] + u * (z[:, 1] - z[:, 0]) + v * (z[:, 2] - z[:, 0])
        at = y[inside] * wide + x[inside]
        order = np.argsort(far, kind="stable")  # of several in one pixel the last one written is the nearest
        at, far, owner = at[order], far[order], owner[order]
        nearer = far > depth[at]
        at, far, owner = at[nearer], far[nearer], owner[nearer]
        depth[at], face[at] = far, owner
        start = stop
    return depth.reshape(shape), face.reshape(shape)
