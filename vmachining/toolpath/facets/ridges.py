"""What two neighbouring passes leave between them, and the step over that leaves what is asked. Source: spec D.10.

A cutter that goes straight on leaves its outline along the feed. In three axes the outlines of both passes are compared with
those of passes between them: what these would take is the ridge, whatever the tool touches with. In five axes the tool
touches the chosen points, and the outlines are compared with the part.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, rows
from vmachining.errors import InputError
from vmachining.toolpath.facets import _kernels

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


OUTLINE, OUTLINE_NORMALS = np.radians(85.0), 171
"""Normals of an outline that are looked at, to both sides of the part's, a degree apart: between them it is a chord, which lies
above it by 4e-5 of its radius."""


def upright_ridges(
    heights: Floats, slopes: Floats, offsets: Floats, radius: float, corner_radius: float
) -> tuple[Floats, Floats]:
    """((n,) mm along the normal of what the first and the last of k passes leave of what those between take, (n,) its z).

    heights : (k, n) mm, of the tips at n stations. slopes : (k, n), of the feed. offsets : (k,) mm across. inf where both passes
    leave a strip between them.
    """
    left = np.empty(heights.shape[1])
    z, along, places = (np.ascontiguousarray(v) for v in (heights, slopes, offsets))
    _kernels.between_passes(z, along, places, float(radius), float(corner_radius), left)
    middle = slopes[len(slopes) // 2]
    across = (heights[-1] - heights[0]) / (offsets[-1] - offsets[0])
    up = 1.0 / np.sqrt(1.0 + middle**2 + across**2)
    return np.asarray(left * up), np.asarray(up)


def leaning_ridges(
    part: Floats,
    normals: Floats,
    feeds: Floats,
    passes: Sequence[tuple[Floats, Floats]],
    radius: float,
    corner_radius: float,
) -> Floats:
    """(n,) mm: what two neighbouring passes leave above the part between them, at most.

    The outline is that of the circle of radius a about the axis, an ellipse, grown by the corner radius r. Where its normal is m,
    square to the feed, it goes through tip + r T - a w / |w| - r m with w = m - (m . T) T.

    part : (n, k, 3) mm, from where one pass touches to where the other does. normals, feeds : (n, 3), halfway.
    passes : tips and axes (n, 3) of both.
    """
    f = feeds / np.linalg.norm(feeds, axis=1)[:, None]
    side = part[:, -1] - part[:, 0]
    side = side - (side * f).sum(axis=1)[:, None] * f
    width = np.linalg.norm(side, axis=1)
    c = side / np.maximum(width, 1e-300)[:, None]
    up = np.cross(f, c)
    up *= np.where((up * normals).sum(axis=1) < 0.0, -1.0, 1.0)[:, None]
    origin = 0.5 * (part[:, 0] + part[:, -1])
    turn = np.linspace(-OUTLINE, OUTLINE, OUTLINE_NORMALS)
    m = np.cos(turn)[None, :, None] * up[:, None] + np.sin(turn)[None, :, None] * c[:, None]

    def section(points: Floats) -> tuple[Floats, Floats]:
        away = points - origin[:, None]
        return (away * c[:, None]).sum(axis=2), (away * up[:, None]).sum(axis=2)

    across, height = section(part)
    outlines = []
    for tips, axes in passes:
        t = axes[:, None]
        w = m - (m * t).sum(axis=2, keepdims=True) * t
        size = np.linalg.norm(w, axis=2, keepdims=True)
        w = np.divide(w, size, out=np.zeros_like(w), where=size > 1e-12)
        u, h = section(tips[:, None] + corner_radius * (t - m) - (radius - corner_radius) * w)
        outlines.append(
            np.array([
                np.interp(x, u[k, ::-1], h[k, ::-1], left=np.inf, right=np.inf) for k, x in enumerate(across)
            ]) - height
        )  # fmt: skip
    slope = np.gradient(height, axis=1) / np.maximum(np.gradient(across, axis=1), 1e-12 * width[:, None])
    one, two = (left / np.sqrt(1.0 + slope**2) for left in outlines)
    ridge = np.minimum(one, two).max(axis=1)
    with np.errstate(invalid="ignore"):  # highest is where the outlines cross, between two places
        gap = one - two
        share = gap[:, :-1] / (gap[:, :-1] - gap[:, 1:])
        cross = np.where((share > 0.0) & (share < 1.0), one[:, :-1] + share * np.diff(one, axis=1), 0.0)
    ridge = np.maximum(ridge, cross.max(axis=1))
    return np.asarray(np.minimum(ridge, 0.5 * width))


def widest_step(
    highest: Callable[[float], float], scallop: float, *, start: float, least: float, most: float
) -> float:
    """Largest step, within a percent, whose highest scallop is not above the asked one; 0 if none is known down to `least`.

    Scallops grow with the square of the step, which gives the next trial; where that does not help, halves do.
    """
    good, bad, s = 0.0, np.inf, start
    for _ in range(24):
        s = min(max(s, least), most)
        height = highest(s)
        if height <= scallop:
            good = max(good, s)
            if height >= 0.98 * scallop or s >= most:
                break
        else:
            bad = min(bad, s)
            if s <= least:
                break
        new = s * float(np.sqrt(0.99 * scallop / max(height, 0.05 * scallop)))
        s = new if good < new < bad else (0.5 * (good + bad) if np.isfinite(bad) else 2.0 * s)
        if bad - good < 1e-3 * start:
            break
    return good
