"""How fast the joints get inside tool-centre-point blocks, for many blocks at once.

The tip goes straight at constant speed and the rotary joints are linear in t, so the slides bend: on a table that
turns they are fastest, or reverse, somewhere inside. Derivatives at the samples are exact,

    J s' = p' - p_rotary,    J s'' = -p_joints

with J the slides' columns, s the slides, p' the speed of the tip, p_rotary the speed that the rotary joints alone
give it, and p_joints the acceleration that it has while all joints keep their speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, rows
from vmachining.errors import KinematicsError
from vmachining.geometry import Arc, Line
from vmachining.machine.chain import SLIDE_EPS, Machine

PER_RADIAN = 16
"""Samples for each half radian that the rotary joints turn, at least this many for a block."""


@dataclass(frozen=True, slots=True, eq=False)
class Peaks:
    """Largest |q'| and |q''| of every joint inside blocks, first and second (n, m), per unit of t in [0, 1].

    inf where slides cannot follow, because two of them are parallel on the way.
    """

    first: Floats
    second: Floats


def linear_peaks(start: ArrayLike, end: ArrayLike) -> Peaks:
    """Of joint-linear blocks; start, end (n, m)."""
    q0, q1 = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    return Peaks(np.abs(q1 - q0), np.zeros(q0.shape))


def tcp_block_peaks(machine: Machine, start: ArrayLike, end: ArrayLike, pieces: int = 1) -> Peaks:
    """Of blocks with a straight tip and linear rotary joints between the joints start and end (n, m).

    What may hide between two samples is added: an eighth of the largest second difference, which is the error of
    a sampled maximum to the fourth order of the step. pieces : 1, 2, 4, 8 or 16 equal parts of a block; more than one gives
    (n, pieces, m).
    Raises KinematicsError: As many starts as ends are needed, each of all joints.
    """
    q0, q1 = (rows(v, -1, len(machine.axes), name=n) for v, n in ((start, "start"), (end, "end")))
    if len(q0) != len(q1):
        raise KinematicsError(f"{len(q0)} starts and {len(q1)} ends")
    turned = np.abs(q1 - q0)[:, list(machine.rotary)].sum(axis=1)
    counts = PER_RADIAN * (1 + np.ceil(2.0 * turned).astype(np.int64))
    out = Peaks(*np.zeros((2, len(q0), pieces, q0.shape[1])))
    for count in np.unique(counts):
        k = np.flatnonzero(counts == count)
        rate, bend = _derivatives(machine, q0[k], q1[k], np.linspace(0.0, 1.0, int(count) + 1))
        own = int(count) // pieces
        for values, peak in ((rate, out.first), (bend, out.second)):
            with np.errstate(invalid="ignore"):
                hidden = np.abs(np.diff(values, n=2, axis=0)).max(axis=0) / 8.0
            for piece in range(pieces):
                top = np.abs(values[piece * own : (piece + 1) * own + 1]).max(axis=0) + hidden
                peak[k, piece] = np.where(np.isnan(top), np.inf, top)
    return out if pieces > 1 else Peaks(out.first[:, 0], out.second[:, 0])


def _derivatives(machine: Machine, q0: Floats, q1: Floats, t: Floats) -> tuple[Floats, Floats]:
    """q' and q'' (k, n, m) at parameters (k,); NaN for slides that cannot follow."""
    s = t[:, None, None]
    slides = list(machine.slides)
    p0, p1 = machine.forward(q0).tip, machine.forward(q1).tip
    q, det = machine.place((1.0 - s) * q0 + s * q1, (1.0 - s) * p0 + s * p1)
    known = det > SLIDE_EPS
    q[~known] = 0.0
    rate, bend = np.zeros(q.shape), np.zeros(q.shape)
    turning = list(machine.rotary)
    rate[..., turning] = (q1 - q0)[:, turning]
    unit = np.eye(len(machine.axes))
    columns = np.stack([machine.rates(q, unit[i]).velocity for i in slides], axis=-1)
    columns = np.where(known[..., None, None], columns, np.eye(3))

    def solved(right: Floats) -> Floats:
        found = np.linalg.solve(columns, right[..., None])[..., 0]
        return np.where(known[..., None], found, np.nan)

    rate[..., slides] = solved((p1 - p0) - machine.rates(q, rate).velocity)
    moving = np.where(np.isnan(rate), 0.0, rate)
    bend[..., slides] = solved(-machine.rates(q, moving).acceleration)
    return rate, bend


def peak_times(machine: Machine, peaks: Peaks) -> Floats:
    """(n,) s that blocks driven at constant rate last at least: max_i max(|q_i'| / v_i, sqrt(|q_i''| / a_i))."""
    speed, force = _limits(machine)
    by_speed = _shares(peaks.first, speed).max(axis=1, initial=0.0)
    by_force = _shares(peaks.second, force).max(axis=1, initial=0.0)
    return np.asarray(np.maximum(by_speed, np.sqrt(by_force)))


def peak_accelerations(machine: Machine, peaks: Peaks, length_mm: ArrayLike) -> Floats:
    """(n,) mm/s^2 along blocks of these lengths: L min_i(a_i / |q_i'|); inf where nothing limits, or without length.

    That is the limit where a block bends nowhere; where it does, the joints have less to spare.
    """
    length = rows(length_mm, len(peaks.first), name="length_mm")
    share = _shares(peaks.first, _limits(machine)[1]).max(axis=1, initial=0.0)
    usable = (share > 0) & (length > 0)
    return np.asarray(np.divide(length, share, out=np.full(len(length), np.inf), where=usable))


def _limits(machine: Machine) -> tuple[Floats, Floats]:
    speed, force = zip(*((axis.max_speed, axis.max_acceleration) for axis in machine.axes), strict=True)
    return np.array(speed), np.array(force)


def _shares(values: Floats, limit: Floats) -> Floats:
    """values / limit, where a joint without a limit takes no share."""
    free = np.isinf(limit)
    return np.asarray(np.where(free, 0.0, values / np.where(free, 1.0, limit)))


IN_PLANE = np.array([[1, 2], [2, 0], [0, 1]])
"""First and second in-plane slide by normal axis, right-handed about the normal."""


def line_peaks(start: ArrayLike, end: ArrayLike) -> Floats:
    """Peak of |dq_i/ds| of straight blocks.

    start, end : (n, 3) mm
    Returns (n, 3), each in [0, 1]; zeros for a block without length.
    """
    travel = np.abs(rows(end, -1, 3, name="end") - rows(start, -1, 3, name="start"))
    length = np.linalg.norm(travel, axis=1, keepdims=True)
    return np.asarray(np.divide(travel, length, out=np.zeros_like(travel), where=length > 0))


def arc_peaks(
    start: ArrayLike, center: ArrayLike, axis: ArrayLike, angle: ArrayLike, rise: ArrayLike
) -> Floats:
    """Peak of |dq_i/ds| of circular and helical blocks.

    The in-plane speeds are |sin| and |cos| of the angle about the centre; a peak of 1 is reached when the
    arc passes a quadrant point, otherwise the larger of the two ends counts.

    start, center : (n, 3) mm
    axis : (n,) 0, 1 or 2, the normal of the plane
    angle : (n,) rad, signed
    rise : (n,) mm along the normal
    Returns (n, 3), each in [0, 1].
    Raises KinematicsError: An axis that is not 0, 1 or 2.
    """
    p, c = rows(start, -1, 3, name="start"), rows(center, -1, 3, name="center")
    n = len(p)
    turn, climb = rows(angle, n, name="angle"), np.abs(rows(rise, n, name="rise"))
    normal = np.asarray(axis, dtype=np.int64)
    if normal.shape != (n,) or ((normal < 0) | (normal > 2)).any():
        raise KinematicsError("axis of an arc is not 0, 1 or 2")
    row = np.arange(n)
    first, second = IN_PLANE[normal].T
    da, db = (p - c)[row, first], (p - c)[row, second]
    begin = np.arctan2(db, da)
    lo, hi = np.minimum(begin, begin + turn), np.maximum(begin, begin + turn)
    around = np.hypot(da, db) * np.abs(turn)
    length = np.hypot(around, climb)
    share = np.divide(around, length, out=np.zeros(n), where=length > 0)
    peaks = np.zeros((n, 3))
    # slide a moves with sin(angle), slide b with cos(angle): largest at quadrant points of b and of a
    for slide, function, phase in ((first, np.sin, 0.5 * np.pi), (second, np.cos, 0.0)):
        passes = np.floor((hi - phase) / np.pi) >= np.ceil((lo - phase) / np.pi)
        ends = np.maximum(np.abs(function(lo)), np.abs(function(hi)))
        peaks[row, slide] = share * np.where(passes, 1.0, ends)
    peaks[row, normal] = np.divide(climb, length, out=np.zeros(n), where=length > 0)
    return peaks


def path_peaks(paths: Sequence[Line | Arc]) -> Floats:
    """Peak of |dq_i/ds| of any mixture of paths, (n, 3)."""
    out = np.zeros((len(paths), 3))
    lines = [k for k, path in enumerate(paths) if isinstance(path, Line)]
    if lines:
        out[lines] = line_peaks([paths[k].start for k in lines], [paths[k].end for k in lines])
    arcs = [(k, path) for k, path in enumerate(paths) if isinstance(path, Arc)]
    if arcs:
        out[[k for k, _ in arcs]] = arc_peaks(
            [a.start for _, a in arcs], [a.center for _, a in arcs], [a.axis for _, a in arcs],
            [a.angle for _, a in arcs], [a.rise for _, a in arcs],
        )  # fmt: skip
    return out
