"""What two neighbouring passes leave between them, and the step over that leaves what is asked. Source: spec D.10.

A cutter that goes straight on leaves its outline along the feed. In three axes the outlines of both passes are compared with
those of passes between them: what these would take is the ridge, whatever the tool touches with. In five axes the tool
touches the chosen points, and the outlines are compared with the part.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from vmachining.arrays import Floats
from vmachining.toolpath.facets import _kernels

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
