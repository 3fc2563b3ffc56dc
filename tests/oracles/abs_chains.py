"""Published chains of triangles, and where a line leaves a patch exactly (ABS)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Bools, Floats
from vmachining.engagement.analytic.finish import rooted
from vmachining.engagement.analytic.surface import Patch, Shape, Surface


class Chain(NamedTuple):
    """Triangles of 6-8 to 6-19: co mm, from the point to the centre; pa, pb, pc, pd rad, its angles; cs mm, the length."""

    co: float
    pa: float
    pb: float
    pc: float
    pd: float
    cs: float


def circle_chain(cq: float, tilt: float, radius: float, lean: float) -> Chain:
    """`circle_length` by the published chain of triangles, put right (6-11, 6-12, 6-15, 6-17, 6-18).

    It loses five digits by cancellation, and all of them on a concave profile where the line goes through the centre.
    """
    big = abs(radius)
    if radius > 0.0:
        co = np.sqrt(cq**2 + big**2 - 2.0 * cq * big * np.cos(tilt))
        pa = np.arccos(min(1.0, (co**2 + big**2 - cq**2) / (2.0 * co * big)))
        pb = np.pi - abs(lean - (tilt + np.sign(tilt) * pa))
        pc = np.arcsin(co * np.sin(pb) / big)
        pd = np.pi - pb - pc
        cs = np.sqrt(big**2 + co**2 - 2.0 * big * co * np.cos(pd))
    else:
        co = np.sqrt(cq**2 + big**2 + 2.0 * cq * big * np.cos(tilt))
        pa = np.arcsin(big * np.sin(tilt) / co)
        pb = abs(lean - pa)
        pc = np.pi - np.arcsin(co * np.sin(pb) / big)
        pd = np.pi - pb - pc
        cs = co * np.sin(pd) / np.sin(pc) if pb > 0.0 else co - big
    return Chain(*(float(v) for v in (co, pa, pb, pc, pd, cs)))


def ray_length(surface: Surface, point: ArrayLike, axis: ArrayLike) -> Floats:
    """(...,) mm from points C (..., 3) along unit axes w (..., 3) to a surface; NaN where it is not met.

    A `Patch` of two straight profiles, or of one, in closed form (the latter by the sheared coordinate z - m x); else the
    root of z_C + s w_z - S(C + s w), bracketed from the vertical distance.
    """
    c, w = np.broadcast_arrays(np.asarray(point, dtype=np.float64), np.asarray(axis, dtype=np.float64))
    if isinstance(surface, Patch):
        straight = [s.shape in (Shape.FLAT, Shape.SLOPE) for s in (surface.along_x, surface.along_y)]
        if all(straight):
            slopes = [np.tan(s.ascent) for s in (surface.along_x, surface.along_y)]
            down = w[..., 2] - slopes[0] * w[..., 0] - slopes[1] * w[..., 1]
            return np.asarray(surface.projection(c) / np.where(down > 0.0, down, np.nan))
        if any(straight):
            return _sheared(surface, c, w, 0 if straight[0] else 1)
    return _ray_root(surface, c, w)


def _sheared(patch: Patch, c: Floats, w: Floats, k: int) -> Floats:
    """Profile k is straight, the other a circle in the plane (t, z - m x_k)."""
    line, arc = (patch.along_x, patch.along_y) if k == 0 else (patch.along_y, patch.along_x)
    m, j = np.tan(line.ascent), 1 - k
    sin, cos = np.sin(arc.mu), np.cos(arc.mu)
    d = np.stack([w[..., j], w[..., 2] - m * w[..., k]], axis=-1)
    # O: (t1 - R sin mu, z1 - R cos mu - m x1); p = C - O
    p = np.stack(
        [
            c[..., j] - (arc.at - arc.radius * sin),
            c[..., 2] - m * c[..., k] - (patch.z1 - arc.radius * cos - m * line.at),
        ],
        axis=-1,
    )
    a, b = (d * d).sum(axis=-1), (d * p).sum(axis=-1)
    # p.p - R^2 as a product of sum and difference
    size = np.linalg.norm(p, axis=-1)
    g = (size - abs(arc.radius)) * (size + abs(arc.radius))
    root = np.sqrt(np.where(b * b - a * g >= 0.0, b * b - a * g, np.nan))
    with np.errstate(divide="ignore", invalid="ignore"):
        if arc.radius > 0.0:
            return np.asarray(np.where(b > 0.0, -g / (b + root), (root - b) / a))
        return np.asarray(np.where(b < 0.0, g / (root - b), (-b - root) / a))


def _ray_root(surface: Surface, c: Floats, w: Floats) -> Floats:
    """Bracket from the point upward in growing steps, then a root."""
    flat_c, flat_w = c.reshape(-1, 3), w.reshape(-1, 3)

    def above(s: Floats, who: Bools | slice = slice(None)) -> Floats:
        q = flat_c[who] + s[:, None] * flat_w[who]
        return np.asarray(q[:, 2] - surface.height(q[:, 0], q[:, 1]))

    n = len(flat_c)
    low = np.zeros(n)
    f_low = above(low)
    with np.errstate(divide="ignore", invalid="ignore"):
        high = np.where(f_low < 0.0, -f_low / np.maximum(flat_w[:, 2], 0.1), 0.0)
    f_high = above(high)
    for _ in range(60):
        short = f_high < 0.0
        if not short.any():
            break
        low, f_low = np.where(short, high, low), np.where(short, f_high, f_low)
        high = np.where(short, high + np.maximum(-1.5 * f_high, 1e-9), high)
        f_high = np.where(short, above(high), f_high)
    good = (f_low < 0.0) & (f_high >= 0.0)
    out = np.full(n, np.nan)
    out[good] = rooted(lambda s: above(s, good), low[good], high[good])
    return out.reshape(c.shape[:-1])


def corner_circle_chain(r: float, radius: float, lean: float, tilt: float, cs: float) -> float:
    """rad, the same as `corner_circle` for a convex profile by the chain of triangles (6-43 to 6-52)."""
    co3 = np.sqrt(cs**2 + radius**2 - 2.0 * cs * radius * np.cos(tilt))
    pa = np.arccos(np.clip((co3**2 + radius**2 - cs**2) / (2.0 * co3 * radius), -1.0, 1.0))
    dc = tilt + np.sign(tilt) * pa
    pf = np.pi - abs(lean - dc)
    o3o4 = np.sqrt(r**2 + co3**2 - 2.0 * r * co3 * np.cos(pf))
    pg = np.arccos(np.clip((r**2 + o3o4**2 - co3**2) / (2.0 * r * o3o4), -1.0, 1.0))
    outward = (
        lean - dc < 0.0
    )  # O3 outward of the line of the axis: the axis leans less than the circle's radius
    wu = r - (r**2 - radius**2 + o3o4**2) / (2.0 * o3o4)
    return float(np.arccos(1.0 - wu / r) + (pg if not outward else -pg))
