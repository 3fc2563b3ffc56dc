"""Frames of a tool and of its feed, as functions of plain numbers and arrays.

Every function broadcasts over leading dimensions. Angles in rad, lengths in mm.

| frame | axes |
|---|---|
| workpiece (WCS) | x, y, z; z up |
| tool (TCS) | columns of `rotation(theta_a, theta_b)`; origin at the tip T, third axis w to the spindle |
| contact (LCS) | feed t, b = n x t, surface normal n |
| feed | u = v x w, v = unit(w x V), w: the tool frame turned about w by `feed_angle` |

theta_a and theta_b are rotations about x and y. A positive theta_a leans the tool to **-y**, a positive theta_b to +x.
Source: Hendriko, five-axis milling, equations 5-1 to 5-6, with the sign of M[2, 0] and the frames corrected.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats
from vmachining.errors import InputError

LEVEL = 1e-12
"""Sine of the angle between axis and normal below which the contact of a corner has no direction."""


class Tilts(NamedTuple):
    """theta_a, theta_b : (...,) rad, rotations of the spindle about x and y."""

    theta_a: Floats
    theta_b: Floats


def unit(vector: ArrayLike) -> Floats:
    """(..., 3) of length one; NaN for a vector of length zero."""
    v = np.asarray(vector, dtype=np.float64)
    size = np.linalg.norm(v, axis=-1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(v / np.where(size > 0.0, size, np.nan))


def rotation(theta_a: ArrayLike, theta_b: ArrayLike) -> Floats:
    """(..., 3, 3) Rx(theta_a) Ry(theta_b): takes tool coordinates of directions to the workpiece (5-2)."""
    a, b = np.broadcast_arrays(np.asarray(theta_a, dtype=np.float64), np.asarray(theta_b, dtype=np.float64))
    sa, ca, sb, cb = np.sin(a), np.cos(a), np.sin(b), np.cos(b)
    rows = ((cb, np.zeros_like(cb), sb), (sa * sb, ca, -sa * cb), (-ca * sb, sa, ca * cb))
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def axis_of(theta_a: ArrayLike, theta_b: ArrayLike) -> Floats:
    """(..., 3) tool axis w from tip to spindle (5-3); the total tilt is acos(w_z)."""
    return np.asarray(rotation(theta_a, theta_b)[..., :, 2])


def angles_of(axis: ArrayLike) -> Tilts:
    """Rotations that give a unit axis (..., 3); |theta_b| <= pi / 2."""
    w = np.asarray(axis, dtype=np.float64)
    theta_b = np.arctan2(w[..., 0], np.hypot(w[..., 1], w[..., 2]))
    return Tilts(np.asarray(np.arctan2(-w[..., 1], w[..., 2])), np.asarray(theta_b))


def frame_of(axis: ArrayLike) -> Floats:
    """(..., 3, 3) tool frame of a unit axis, `rotation` of its angles."""
    return rotation(*angles_of(axis))


def feed_direction(velocity: ArrayLike, normal: ArrayLike) -> Floats:
    """(..., 3) t: the velocity of the tip projected on the tangent plane of a unit normal, unit (5-4 corrected)."""
    v, n = np.asarray(velocity, dtype=np.float64), np.asarray(normal, dtype=np.float64)
    return unit(v - (v * n).sum(axis=-1, keepdims=True) * n)


def axis_of_lean(lead: ArrayLike, tilt: ArrayLike, feed: ArrayLike, normal: ArrayLike) -> Floats:
    """(..., 3) tool axis: sin(lead) t - sin(tilt) cos(lead) b + cos(tilt) cos(lead) n.

    feed, normal : unit t and n at right angles. With n = z and t = x, lead is theta_b and tilt is theta_a.
    """
    t, n = np.asarray(feed, dtype=np.float64), np.asarray(normal, dtype=np.float64)
    b = np.cross(n, t)
    al, be = np.asarray(lead, dtype=np.float64)[..., None], np.asarray(tilt, dtype=np.float64)[..., None]
    return np.asarray(np.sin(al) * t - np.sin(be) * np.cos(al) * b + np.cos(be) * np.cos(al) * n)


def feed_angle(velocity: ArrayLike, frame: ArrayLike) -> Floats:
    """(...,) rad, eps: phi + eps is 90 degrees straight ahead (5-6 in the plane of the tool, all quadrants).

    The printed atan(dy/dx) holds for an upright tool only. 0 where the feed is along the axis.
    """
    v, m = np.asarray(velocity, dtype=np.float64), np.asarray(frame, dtype=np.float64)
    return np.asarray(np.arctan2((v * m[..., :, 1]).sum(axis=-1), (v * m[..., :, 0]).sum(axis=-1)))


def tip_of_contact(
    contact: ArrayLike,
    normal: ArrayLike,
    axis: ArrayLike,
    rm: float,
    r: float,
    toward: ArrayLike | None = None,
) -> Floats:
    """(..., 3) mm: tip T of a tool of unit axis that touches a surface of unit normal at a contact point CC.

    rm, r : mm, radius of the centre circle of the corner, and of the corner; R = rm + r.
    toward : (..., 3) direction from the tool axis to the contact where the normal is the axis and leaves it open;
        the feed, as a rule.

    Raises InputError: The normal is the axis and no direction was given, and the tool is not a ball.
    """
    cc, n, w = (np.asarray(v, dtype=np.float64) for v in (contact, normal, axis))
    cos = (n * w).sum(axis=-1, keepdims=True)
    across = n - cos * w
    sin = np.linalg.norm(across, axis=-1, keepdims=True)
    level = sin <= LEVEL
    with np.errstate(invalid="ignore", divide="ignore"):
        e = -across / np.where(level, np.nan, sin)
    if level.any():
        if toward is None and rm > 0.0:
            raise InputError(
                "the surface normal is the tool axis: any point of the bottom may touch",
                remedy="give the direction from the axis to the contact, such as the feed",
            )
        d = np.asarray(w if toward is None else toward, dtype=np.float64)
        d = d - (d * w).sum(axis=-1, keepdims=True) * w
        e = np.where(level, np.nan_to_num(unit(d)), e)
    reach = np.where(level & (r == 0.0), rm, rm + r * sin)
    return np.asarray(cc - reach * e - r * (1.0 - cos) * w)
