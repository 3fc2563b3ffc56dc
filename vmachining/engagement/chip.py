"""Points, normals and chips of the edge of flat, bull and ball cutters, as functions of plain numbers and arrays.

The edge is the meridian, straight, in three pieces with one parameter s, the arc length from the lower end of the
corner, mm:

| piece | s | own parameter | point | outward normal |
|---|---|---|---|---|
| bottom disc | -rm .. 0 | rho = rm + s | T + rho e_r | -w |
| corner | 0 .. r pi/2 | lam = s / r | T + (rm + r sin lam) e_r + r (1 - cos lam) w | sin lam e_r - cos lam w |
| cylinder | r pi/2 .. | l = s - r pi/2 | T + (rm + r) e_r + (r + l) w | e_r |

rm is the radius of the centre circle of the corner, r that of the corner: r = 0 is a flat cutter, rm = 0 a ball.
phi is the rotation angle in the tool frame, from +y to +x (clockwise seen from the spindle); phi + eps = 90 degrees
is straight ahead.

**Intervals** are arrays `lower`, `upper` of s, (..., k), NaN where none exists; each lies in one piece. In results of
a path the dimensions are [position, rotation angle, interval]. Every function broadcasts, so one interval of one
angle is as welcome.

**Speeds** hold the motion: N . V of a point is n_r v_r + n_z v_w + (z n_r - rho n_z) g_r, with v_r = V . e_r,
v_w = V . w and g_r = (omega x w) . e_r, V the velocity of the tip. On the corner this is a sin lam - b cos lam with
a = v_r + r g_r, b = v_w - rm g_r, the velocity of the centre of the corner.

Source: Hendriko, five-axis milling, 5-7 to 5-15 and 5-28 to 5-31; the normal of the corner, the rotation and the chip
thickness along the corner are corrected.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, Ints

QUARTER = 0.5 * np.pi


class EdgePiece(IntEnum):
    """Pieces of the edge."""

    NONE = -1
    BOTTOM = 0
    CORNER = 1
    CYLINDER = 2


class Speeds(NamedTuple):
    """Motion as an edge sees it. radial, axial, swing : (...,) mm/s (or per mm), V . e_r, V . w, (omega x w) . e_r;
    the last in 1/s. tip : (...,) |V|."""

    radial: Floats
    axial: Floats
    swing: Floats
    tip: Floats


class FacingRange(NamedTuple):
    """Facing set of the corner: lower, upper (...,) rad of lam, equal where none exists."""

    lower: Floats
    upper: Floats


# -- the edge ------------------------------------------------------------------------------------------------


def radial(frame: ArrayLike, phi: ArrayLike) -> Floats:
    """(..., 3) e_r = M (sin phi, cos phi, 0) of frames (..., 3, 3) at phi (...,) rad."""
    m, at = np.asarray(frame, dtype=np.float64), np.asarray(phi, dtype=np.float64)[..., None]
    return np.asarray(np.sin(at) * m[..., :, 0] + np.cos(at) * m[..., :, 1])


def elevation(s: ArrayLike, r: float) -> Floats:
    """(...,) rad, lam at s: 0 on the bottom disc, pi/2 on the cylinder."""
    at = np.asarray(s, dtype=np.float64)
    if r == 0.0:
        return np.where(np.isnan(at), np.nan, np.where(at >= 0.0, QUARTER, 0.0))
    return np.asarray(np.clip(at / r, 0.0, QUARTER))


def arc_length(lam: ArrayLike, r: float, l: ArrayLike = 0.0) -> Floats:  # noqa: E741 the symbol of the source
    """(...,) mm, s of lam rad on the corner, or of l mm on the cylinder (lam = pi/2)."""
    return np.asarray(r * np.asarray(lam, dtype=np.float64) + np.asarray(l, dtype=np.float64))


def radius(s: ArrayLike, rm: float, r: float) -> Floats:
    """(...,) mm, distance from the tool axis at s."""
    at = np.asarray(s, dtype=np.float64)
    return np.asarray(np.where(at < 0.0, rm + at, rm + r * np.sin(elevation(at, r))))


def height(s: ArrayLike, r: float) -> Floats:
    """(...,) mm above the tip, along the axis, at s."""
    at = np.asarray(s, dtype=np.float64)
    above = np.maximum(at - r * QUARTER, 0.0)
    return np.asarray(r * (1.0 - np.cos(elevation(at, r))) + above)


def pieces(lower: ArrayLike, upper: ArrayLike, r: float) -> Ints:
    """(...,) `EdgePiece` of intervals, by their middle; NONE for NaN."""
    middle = 0.5 * (np.asarray(lower, dtype=np.float64) + np.asarray(upper, dtype=np.float64))
    piece = np.where(
        middle < 0.0, EdgePiece.BOTTOM, np.where(middle < r * QUARTER, EdgePiece.CORNER, EdgePiece.CYLINDER)
    )
    return np.asarray(np.where(np.isnan(middle), EdgePiece.NONE, piece).astype(np.int64))


def edge_points(
    tip: ArrayLike, frame: ArrayLike, phi: ArrayLike, s: ArrayLike, rm: float, r: float
) -> Floats:
    """(..., 3) mm, Q at s (5-7 to 5-10): tip (..., 3), frame (..., 3, 3), phi and s (...,)."""
    m = np.asarray(frame, dtype=np.float64)
    return np.asarray(
        np.asarray(tip)
        + radius(s, rm, r)[..., None] * radial(m, phi)
        + height(s, r)[..., None] * m[..., :, 2]
    )


# -- motion --------------------------------------------------------------------------------------------------


def edge_speeds(
    velocity: ArrayLike,
    frame: ArrayLike,
    phi: ArrayLike,
    *,
    omega: ArrayLike | None = None,
    axis_rate: ArrayLike | None = None,
) -> Speeds:
    """Speeds of an edge at phi.

    velocity : (..., 3) mm/s (or per block) of the tip.
    frame, phi : (..., 3, 3), (...,) rad.
    omega : (..., 3) rad/s of the tool body. axis_rate : (..., 3) 1/s, dw/dt = omega x w, instead of it.
        Neither: the axis keeps its direction.
    """
    m, v = np.asarray(frame, dtype=np.float64), np.asarray(velocity, dtype=np.float64)
    w, e_r = m[..., :, 2], radial(m, phi)
    if omega is not None:
        axis_rate = np.cross(np.asarray(omega, dtype=np.float64), w)
    g = np.zeros(3) if axis_rate is None else np.asarray(axis_rate, dtype=np.float64)
    found = ((v * e_r).sum(axis=-1), (v * w).sum(axis=-1), (g * e_r).sum(axis=-1), np.linalg.norm(v, axis=-1))
    return Speeds(*(np.asarray(x) for x in np.broadcast_arrays(*found)))


def corner_speeds(speeds: Speeds, rm: float, r: float) -> tuple[Floats, Floats]:
    """a, b (...,): components along e_r and w of the velocity of the centre of the corner (5-13 to 5-15)."""
    return np.asarray(speeds.radial + r * speeds.swing), np.asarray(speeds.axial - rm * speeds.swing)


def facing_range(a: ArrayLike, b: ArrayLike) -> FacingRange:
    """Stretch of the corner that moves into the material, N . V > 0; the table of the source with all its rows."""
    x, y = np.broadcast_arrays(np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64))
    lower = np.where((x > 0.0) & (y > 0.0), np.arctan2(y, x), 0.0)
    upper = np.where(x > 0.0, QUARTER, np.where(y < 0.0, np.arctan2(-y, -x), 0.0))
    return FacingRange(lower, upper)


def normal_speed(s: ArrayLike, speeds: Speeds, rm: float, r: float) -> Floats:
    """(...,) mm/s, N . V at s; speeds broadcast against s."""
    at = np.asarray(s, dtype=np.float64)
    lam = elevation(at, r)
    n_r, n_z = np.where(at < 0.0, 0.0, np.sin(lam)), np.where(at < 0.0, -1.0, -np.cos(lam))
    n_z = np.where(lam >= QUARTER, 0.0, n_z)
    lever = height(at, r) * n_r - radius(at, rm, r) * n_z
    return np.asarray(n_r * speeds.radial + n_z * speeds.axial + lever * speeds.swing)


def feed_scale(feed_per_tooth: ArrayLike, speeds: Speeds) -> Floats:
    """(...,) s: f / |V|, what makes a chip thickness of N . V; NaN where the tip rests."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.asarray(feed_per_tooth) / np.where(speeds.tip > 0.0, speeds.tip, np.nan))


# -- chips ---------------------------------------------------------------------------------------------------


def chip_thickness(s: ArrayLike, speeds: Speeds, rm: float, r: float, scale: ArrayLike) -> Floats:
    """(...,) mm, h = max(0, N . V) scale at s, exact to first order in the feed; scale from `feed_scale`.

    On the cylinder f cos(lead) sin(phi + eps) (5-30); on the corner it falls with lam, which the source leaves out.
    """
    return np.asarray(np.maximum(normal_speed(s, speeds, rm, r), 0.0) * np.asarray(scale))


def cut_length(lower: ArrayLike, upper: ArrayLike) -> Floats:
    """(...,) mm, q: engaged length of the edge, sum over the intervals (last dimension) (5-29)."""
    return np.asarray(np.nansum(np.asarray(upper) - np.asarray(lower), axis=-1))


def axial_depth(lower: ArrayLike, upper: ArrayLike, r: float) -> Floats:
    """(...,) mm, d_ax: engaged length along the tool axis, gaps left out."""
    return np.asarray(np.nansum(height(upper, r) - height(lower, r), axis=-1))


def exact_depth(
    lower: ArrayLike,
    upper: ArrayLike,
    tip: ArrayLike,
    frame: ArrayLike,
    phi: ArrayLike,
    rm: float,
    r: float,
    normal: ArrayLike = (0.0, 0.0, 1.0),
) -> Floats:
    """(...,) mm, depth of cut (Q_UE - Q_LE) . n over the whole engaged part; 0 where nothing is engaged.

    lower, upper : (..., k). tip (..., 3), frame (..., 3, 3), phi (...,) broadcast against their leading dimensions.
    normal : (..., 3) design normal; z for staircases.
    """
    low, high = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    free = np.isnan(low).all(axis=-1)
    first = np.where(np.isnan(low), np.inf, low).min(axis=-1)
    last = np.where(np.isnan(high), -np.inf, high).max(axis=-1)
    ends = [edge_points(tip, frame, phi, np.where(free, 0.0, s), rm, r) for s in (first, last)]
    deep = ((ends[1] - ends[0]) * np.asarray(normal, dtype=np.float64)).sum(axis=-1)
    return np.asarray(np.where(free, 0.0, deep))


def chip_area(
    lower: ArrayLike, upper: ArrayLike, speeds: Speeds, rm: float, r: float, scale: ArrayLike
) -> Floats:
    """(...,) mm^2, A: integral of the chip thickness along the intervals (..., k), in closed form.

    speeds, scale : of the leading dimensions. Intervals must lie in the facing set, as those of the engines do;
    elsewhere N . V counts with its sign. Bottom included where the intervals have it.
    """
    return np.asarray(np.nansum(_integrals(lower, upper, speeds, rm, r), axis=-1) * np.asarray(scale))


def _integrals(lower: ArrayLike, upper: ArrayLike, speeds: Speeds, rm: float, r: float) -> Floats:
    """Integrals of N . V ds over every interval."""
    low, high = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    piece = pieces(low, high, r)
    v_r, v_w, g = (np.asarray(x, dtype=np.float64)[..., None] for x in speeds[:3])
    p1, p2 = rm + low, rm + high
    disc = -v_w * (p2 - p1) + 0.5 * g * (p2**2 - p1**2)
    x, y = elevation(low, r), elevation(high, r)
    corner = r * ((v_r + r * g) * (np.cos(x) - np.cos(y)) - (v_w - rm * g) * (np.sin(y) - np.sin(x)))
    # cylinder: N . V is linear in the height
    rod = (v_r + (r + 0.5 * (low + high) - r * QUARTER) * g) * (high - low)
    kinds = (EdgePiece.BOTTOM, EdgePiece.CORNER, EdgePiece.CYLINDER)
    return np.select([piece == k for k in kinds], [disc, corner, rod], np.nan)


def book_chip_area(
    lower: ArrayLike, upper: ArrayLike, feed_per_tooth: ArrayLike, lead: ArrayLike, phi_feed: ArrayLike
) -> Floats:
    """(...,) mm^2 as published, q f cos(lead) sin(phi + eps) (5-31): 1.6 to 4 times too much on a corner.

    phi_feed : rad, phi + eps.
    """
    h = np.asarray(feed_per_tooth) * np.cos(np.asarray(lead, dtype=np.float64))
    return np.asarray(cut_length(lower, upper) * h * np.maximum(np.sin(np.asarray(phi_feed)), 0.0))
