"""`read_cloud`: measured points x, y, z as a surface of facets over the plan."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial import Delaunay, QhullError

from vmachining.errors import InputError
from vmachining.textfile import number_rows
from vmachining.toolpath.facets.mesh import FacetMesh

__all__ = ["read_cloud"]

LONG = 5.0
"""Edges longer than this many times the median one close a gap in the cloud."""


def read_cloud(path: Path, *, scale: float = 1.0) -> FacetMesh:
    """A surface through points, one height over each place in plan: Delaunay's triangles of the plan.

    path : lines of x, y, z, see `number_rows`. scale : mm per unit.
    Raises InputError: A line without three numbers, fewer than three places, two heights over one, all on a line.
    """
    points = scale * number_rows(path, ("x", "y", "z"), "cloud of points", InputError)
    order = np.lexsort(points.T[::-1])
    points = points[order]
    same = np.append(False, (np.diff(points[:, :2], axis=0) == 0.0).all(axis=1))
    apart = same & (np.diff(points[:, 2], prepend=points[0, 2] if len(points) else 0.0) != 0.0)
    if apart.any():
        x, y, z = points[int(np.argmax(apart))]
        raise InputError(
            f"two heights at x {x:.6g}, y {y:.6g}, one of them z {z:.6g}", file=str(path),
            remedy="give a cloud with one height over each place: no walls, no undersides",
        )  # fmt: skip
    points = points[~same]
    try:
        triangles = Delaunay(points[:, :2]).simplices.astype(np.int64)
    except (QhullError, ValueError) as exc:
        raise InputError(
            f"{len(points)} points span no surface",
            file=str(path),
            remedy="give three at least, not on a line",
        ) from exc
    a, b, c = points[triangles].transpose(1, 0, 2)
    turned = np.cross(b - a, c - a)[:, 2] < 0.0
    triangles[turned] = triangles[turned][:, ::-1]
    edges = np.linalg.norm(np.stack([b - a, c - b, a - c])[:, :, :2], axis=2)
    gaps = int((edges.max(axis=0) > LONG * np.median(edges)).sum())
    notes = [f"surface through {len(points)} points, flat between them"]
    if gaps:
        notes.append(f"{gaps} facets close gaps of the cloud, or dents of its outline")
    return FacetMesh(points, triangles, tuple(notes))
