"""From a point on a surface to the tool that touches it: CC point to CL point with lead and tilt. Source: spec D.5."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, rows
from vmachining.errors import InputError

ALONG = 1e-12
"""An axis that leaves the normal by less stands on it: the flat bottom lies on the surface and the tip on the CC point."""


class Located(NamedTuple):
    """cl : (n, 3) mm, tip. axis : (n, 3), unit, from tip to spindle."""

    cl: Floats
    axis: Floats


def cl_points(
    cc: ArrayLike,
    normals: ArrayLike,
    feeds: ArrayLike,
    radius: float,
    corner_radius: float,
    *,
    lead_deg: float = 0.0,
    tilt_deg: float = 0.0,
    axis: ArrayLike | None = None,
) -> Located:
    """Tool that touches a surface at CC points.

    cc : (n, 3) mm. normals : (n, 3), outward. feeds : (n, 3), directions of the feed; their part along the normal is left out.
    radius, corner_radius : mm, of the cutter.
    lead_deg, tilt_deg : the axis leans forward along the feed, and towards feed x normal.
    axis : (3,), a fixed tool axis instead of lead and tilt; (0, 0, 1) in three axes.
    Raises InputError: A tool that would stand below the surface, a feed along the normal, a normal of no length.
    """
    points, n, f = (
        rows(v, -1, 3, name=name) for v, name in ((cc, "cc"), (normals, "normals"), (feeds, "feeds"))
    )
    n = n / _lengths(n, "a normal has no length")
    if axis is None:
        f = f - (f * n).sum(axis=1)[:, None] * n
        f = f / _lengths(f, "the feed goes along the normal")
        c = np.cross(f, n)
        lead, tilt = np.radians(lead_deg), np.radians(tilt_deg)
        t = np.sin(lead) * f + np.cos(lead) * (np.cos(tilt) * n + np.sin(tilt) * c)
    else:
        fixed = rows(axis, 3, name="axis")
        t = np.tile(fixed / np.linalg.norm(fixed), (len(points), 1))
    up = (n * t).sum(axis=1)
    if (up <= 0.0).any():
        k = int(np.argmax(up <= 0.0))
        raise InputError(f"the tool is below the surface at CC point {k}: normal {n[k].round(6).tolist()}")
    w = n - up[:, None] * t
    size = np.linalg.norm(w, axis=1)[:, None]
    aside = np.divide(w, size, out=np.zeros_like(w), where=size >= ALONG)
    flat = size[:, 0] < ALONG
    tip = points + corner_radius * n + (radius - corner_radius) * aside - corner_radius * t
    tip[flat] = points[flat]
    return Located(tip, t)


def _lengths(vectors: Floats, complaint: str) -> Floats:
    size = np.linalg.norm(vectors, axis=1)[:, None]
    if (size < 1e-12).any():
        raise InputError(f"{complaint} at point {int(np.argmax(size[:, 0] < 1e-12))}")
    return np.asarray(size)


def scallop_step(height: ArrayLike, radius: ArrayLike, curvature: ArrayLike = 0.0) -> Floats:
    """Distance of two passes of a ball that leaves scallops of a height; exact where the curvature across the feed is constant.

    height, radius : mm. curvature : 1/mm across the feed, positive where the surface is convex, above -1 / radius. Two balls of
    radius R whose centres lie rho + R from the middle of the circle rho meet at rho + h: the triangle with these sides gives the
    angle, and rho times it the step; the published square roots are its leading terms.
    """
    h, ball, k = np.broadcast_arrays(*(np.asarray(v, dtype=np.float64) for v in (height, radius, curvature)))
    plane = 2.0 * np.sqrt(np.maximum(2.0 * ball * h - h * h, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        rho = 1.0 / k
        far, near = rho + ball, rho + h
        half = np.arccos(np.clip((far**2 + near**2 - ball**2) / (2.0 * far * near), -1.0, 1.0))
        curved = 2.0 * np.abs(rho) * half
    return np.asarray(np.where(np.abs(k) * ball < 1e-9, plane, curved))
