"""Frames and points of edges as the source writes them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats
from vmachining.engagement.chip import Speeds, axial_depth, elevation, normal_speed, radial, radius
from vmachining.engagement.frames import unit


class Lean(NamedTuple):
    """lead, tilt : (...,) rad, of the tool axis about the contact frame; lead > 0 leans forward."""

    lead: Floats
    tilt: Floats


def world(points: ArrayLike, frame: ArrayLike, tip: ArrayLike) -> Floats:
    """(..., 3) tool coordinates of points to the workpiece, Q = M q + T (5-1); directions take no tip."""
    return np.asarray(
        np.einsum("...ij,...j->...i", np.asarray(frame), np.asarray(points, dtype=np.float64))
        + np.asarray(tip)
    )


def lean_of(axis: ArrayLike, feed: ArrayLike, normal: ArrayLike) -> Lean:
    """Lead and tilt of a unit axis, the inverse of `axis_of_lean`."""
    w, t, n = (np.asarray(v, dtype=np.float64) for v in (axis, feed, normal))
    b = np.cross(n, t)
    along, aside, up = ((w * e).sum(axis=-1) for e in (t, b, n))
    return Lean(np.asarray(np.arctan2(along, np.hypot(aside, up))), np.asarray(np.arctan2(-aside, up)))


def feed_frame(axis: ArrayLike, velocity: ArrayLike) -> Floats:
    """(..., 3, 3) columns u, v, w: v = unit(w x V), u = v x w; NaN where the feed is along the axis (5-3)."""
    w = np.broadcast_to(
        np.asarray(axis, dtype=np.float64), np.broadcast_shapes(np.shape(axis), np.shape(velocity))
    )
    v = unit(np.cross(w, np.asarray(velocity, dtype=np.float64)))
    return np.stack([np.cross(v, w), v, w], axis=-1)


def tangential(frame: ArrayLike, phi: ArrayLike) -> Floats:
    """(..., 3) e_t = M (cos phi, -sin phi, 0), the direction of the cutting velocity under M3."""
    m, at = np.asarray(frame, dtype=np.float64), np.asarray(phi, dtype=np.float64)[..., None]
    return np.asarray(np.cos(at) * m[..., :, 0] - np.sin(at) * m[..., :, 1])


def edge_normals(frame: ArrayLike, phi: ArrayLike, s: ArrayLike, r: float) -> Floats:
    """(..., 3) outward unit normals N = sin lam e_r - cos lam w at s (5-11, 5-12 put right)."""
    m, lam = np.asarray(frame, dtype=np.float64), elevation(s, r)[..., None]
    return np.asarray(np.sin(lam) * radial(m, phi) - np.cos(lam) * m[..., :, 2])


def limit_angle(a: ArrayLike, b: ArrayLike) -> Floats:
    """(...,) rad, lam of the LE point where N . V = 0: atan2(b, a), negative behind (5-15 put right).

    tan lam = tan(lead) / sin(phi + eps) for a tool that does not turn. Behind (a <= 0, b < 0) the corner cuts *below*
    atan2(-b, -a), and the source plots the negative of it.
    """
    x, y = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    behind = (x <= 0.0) & (y < 0.0)
    return np.asarray(np.where(behind, -np.arctan2(-y, -x), np.arctan2(y, x)))


def spindle_scale(teeth: int, rev_min: ArrayLike) -> Floats:
    """(...,) s between two teeth, 60 / (m n_s): the same as `feed_scale`, and defined where the tip rests."""
    return np.asarray(60.0 / (teeth * np.asarray(rev_min, dtype=np.float64)))


def book_depth(lower: ArrayLike, upper: ArrayLike, r: float, lead: ArrayLike) -> Floats:
    """(...,) mm, depth of cut as published, d_ax cos(lead) (5-28): exact for a flat cutter only."""
    return np.asarray(axial_depth(lower, upper, r) * np.cos(np.asarray(lead, dtype=np.float64)))


def removal_density(lower: ArrayLike, upper: ArrayLike, speeds: Speeds, rm: float, r: float) -> Floats:
    """(...,) mm^3/s per rad of phi: integral of N . V times the radius along the intervals, each in one piece.

    20 Gauss points integrate sines and cosines over a quarter turn to the last digit.
    """
    low, high = np.asarray(lower, dtype=np.float64)[..., None], np.asarray(upper, dtype=np.float64)[..., None]
    node, weight = np.polynomial.legendre.leggauss(20)
    s = low + 0.5 * (high - low) * (node + 1.0)
    at = Speeds(*(np.asarray(v)[..., None, None] for v in speeds))
    each = 0.5 * (high - low)[..., 0] * ((normal_speed(s, at, rm, r) * radius(s, rm, r)) @ weight)
    return np.asarray(np.nansum(each, axis=-1))
