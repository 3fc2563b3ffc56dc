"""Drawing a million things with a hundred thousand: only the picture is thinned, never a number."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from vmachining.arrays import Floats, Ints

MAX_TRIANGLES = 250_000
"""What a browser turns smoothly on an ordinary notebook; about 10 MB of page."""

MAX_POINTS = 20_000
"""Points of one line plot: ten times the pixels it is drawn on."""


@dataclass(frozen=True, slots=True, eq=False)
class ThinMesh:
    """vertices (n, 3) mm, triangles (m, 3), block (m,); cell: size of the clusters in mm, 0 if untouched."""

    vertices: Floats
    triangles: Ints
    block: Ints
    cell: float


def thin_mesh(vertices: Floats, triangles: Ints, block: Ints, limit: int = MAX_TRIANGLES) -> ThinMesh:
    """At most `limit` triangles, by merging the vertices of each cell of a cubic grid.

    Cells grow until the surviving triangles fit. Flat faces with few triangles survive any cell that is
    smaller than the part, so a coarse stock keeps its shape. For looking at only.
    """
    if len(triangles) <= limit:
        return ThinMesh(vertices, triangles, block, 0.0)
    low = vertices.min(axis=0)
    size = float((vertices.max(axis=0) - low).max())
    cell = size / 1024
    while True:
        keys = np.floor((vertices - low) / cell).astype(np.int64)
        code = (keys[:, 0] << 42) | (keys[:, 1] << 21) | keys[:, 2]
        _, first, member = np.unique(code, return_index=True, return_inverse=True)
        merged = member.reshape(-1)[triangles]
        keep = (
            (merged[:, 0] != merged[:, 1]) & (merged[:, 1] != merged[:, 2]) & (merged[:, 2] != merged[:, 0])
        )
        if keep.sum() <= limit or cell > size / 16:
            return ThinMesh(vertices[first], merged[keep], block[keep], cell)
        cell *= 1.25


def thin_rows(count: int, weight: Floats, limit: int = MAX_POINTS) -> Ints:
    """Row numbers to draw: in each of limit/2 bins the rows of smallest and largest weight."""
    if count <= limit:
        return np.arange(count, dtype=np.int64)
    edges = np.linspace(0, count, limit // 2 + 1).astype(np.int64)
    chosen = {0, count - 1}
    filled = np.nan_to_num(weight)
    for lo, hi in pairwise(edges.tolist()):
        part = filled[lo:hi]
        chosen.update((lo + int(part.argmin()), lo + int(part.argmax())))
    return np.array(sorted(chosen), dtype=np.int64)
