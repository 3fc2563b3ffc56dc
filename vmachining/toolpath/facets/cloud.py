"""`read_cloud`: measured points x, y, z as a surface of facets over the plan."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial import Delaunay, QhullError, cKDTree

from vmachining.arrays import Floats, Ints
from vmachining.errors import InputError
from vmachining.textfile import number_rows
from vmachining.toolpath.facets.mesh import FacetMesh

LONG = 5.0
"""Edges longer than this many times the median one close a gap in the cloud."""

SAME = 1e-9
"""Points closer than this share of the size of the cloud are one."""


def read_cloud(path: Path, *, scale: float = 1.0) -> FacetMesh:
    """A surface through points, one height over each place in plan: Delaunay's triangles of the plan.

    path : lines of x, y, z, see `number_rows`. scale : mm per unit.
    Raises InputError: A line without three numbers, fewer than three places, two heights over one, all on a line.
    """
    points = scale * number_rows(path, ("x", "y", "z"), "cloud of points", InputError)
    given = len(points)
    points = _apart(points, path)
    try:
        # about its middle: Qhull drops points of a cloud far from the origin
        found = Delaunay(points[:, :2] - points[:, :2].mean(axis=0))
    except (QhullError, ValueError) as exc:
        raise InputError(
            f"{len(points)} points span no surface",
            file=str(path),
            remedy="give three at least, not on a line",
        ) from exc
    triangles = found.simplices.astype(np.int64)
    a, b, c = points[triangles].transpose(1, 0, 2)
    turned = np.cross(b - a, c - a)[:, 2] < 0.0
    triangles[turned] = triangles[turned][:, ::-1]
    edges = np.linalg.norm(np.stack([b - a, c - b, a - c])[:, :, :2], axis=2)
    gaps = int((edges.max(axis=0) > LONG * np.median(edges)).sum())
    left = found.coplanar
    notes = [f"surface through {len(points) - len(left)} points, flat between them"]
    if given > len(points):
        notes.append(f"{given - len(points)} points that repeat others were dropped")
    if len(left):
        off = float(np.abs(points[left[:, 0], 2] - points[left[:, 2], 2]).max())
        notes.append(
            f"{len(left)} points too close to others for triangles were dropped, {off:.3g} mm from the heights there at most"
        )
    if gaps:
        notes.append(f"{gaps} facets close gaps of the cloud, or dents of its outline")
    return FacetMesh(points, triangles, tuple(notes))


def _apart(points: Floats, path: Path) -> Floats:
    """The points in the order of x, y, z, without those that repeat others within rounding.

    Raises InputError: Two heights over one place.
    """
    points = points[np.lexsort(points.T[::-1])]
    within = max(
        SAME * float(np.ptp(points, axis=0).max()), 4.0 * np.finfo(float).eps * float(np.abs(points).max())
    )
    same = np.append(False, (np.diff(points[:, :2], axis=0) == 0.0).all(axis=1))
    _one_height(points, np.arange(len(points)) - same, within, path)
    points = points[~same]
    while len(points) > 1:
        plan = points[:, :2] - points[:, :2].mean(axis=0)
        far, which = cKDTree(plan).query(plan, k=2, distance_upper_bound=2.0 * within)
        own = np.arange(len(points))
        other = np.where(which[:, 0] == own, which[:, 1], which[:, 0])
        close = (far[:, 1] <= within) & (other < len(points))
        other = np.where(close, other, own)
        _one_height(points, other, within, path)
        if not (other < own).any():
            break
        points = points[other >= own]
    return points


def _one_height(points: Floats, other: Ints, within: float, path: Path) -> None:
    """Raises InputError: A point and the `other` one at its place differ in height."""
    apart = np.abs(points[:, 2] - points[other, 2]) > within
    if apart.any():
        x, y, z = points[int(np.argmax(apart))]
        raise InputError(
            f"two heights at x {x:.6g}, y {y:.6g}, one of them z {z:.6g}", file=str(path),
            remedy="give a cloud with one height over each place: no walls, no undersides",
        )  # fmt: skip
