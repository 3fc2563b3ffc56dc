"""The digital differential analyser: pulses for stepping motors from adding registers.

Lengths are counted in BLU (basic length units, one pulse each), time in ticks of the register clock. A register
of capacity N adds its integrand once per tick and sends a pulse when it overflows (comparison >=).

Line      integrand |p_a|, N ticks, count after j ticks floor((q0 + j |p_a|) / N)
          preset q0 = 0: |error| < 1 BLU per axis; q0 = N // 2 ("half load"): |error| <= 1/2 BLU per axis
Circle    integrands |Y| for x and |X| for y; one radian takes N ticks
Helix     the arc first; then z in a register whose capacity is the number of ticks the arc took

Modes: `dda` as above, with half load, updated coordinates and end-point counters; `s1` as the listing of a
historical engraving machine: empty registers, integer 1.57 N ticks per quadrant, coordinates of the pass before.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vmachining.arrays import Floats, Ints
from vmachining.errors import KinematicsError
from vmachining.machine import _kernels

MAX_CAPACITY = 2**31
"""Products of two register contents stay exact in 64 bits."""

MAX_PULSES = 50_000_000
"""Per axis and block: 10 m at 0.2 um. More is a mistyped BLU, and would fill the memory."""

ARC_LIMITS = {"quadrant": 1.0, "circle": 1.2, "arc": 2.5}
"""BLU, radius error of circular trains: a quadrant from an axis point, a whole circle from one, any other arc.

Measured over all radii to 500 and beyond: 0.96, 1.16 and 2.44 (the last contains a start up to 0.7 BLU off the
circle). Circles in a row start with the registers of the one before and err by up to 1.46; they count as arcs.
With both registers half full and coordinates of the tick before, 1 + pi/4 R/N + sqrt(2)/2 < 2.5 BLU per quadrant
can be proven."""

QUADRANTS_S1 = {
    # (number, ccw): starts along x, sign of x, sign of y; numbers run clockwise from the upper left
    (1, False): (False, 1, 1), (2, False): (True, 1, -1), (3, False): (False, -1, -1), (4, False): (True, -1, 1),
    (1, True): (True, -1, -1), (2, True): (False, -1, 1), (3, True): (True, 1, 1), (4, True): (False, 1, -1),
}  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Train:
    """Pulses of one block.

    tick : (p,) tick of each pulsing moment, from 0, increasing. steps : (p, k) -1, 0 or +1 per axis.
    ticks : length of the block, idle ticks included.
    """

    tick: Ints
    steps: NDArray[np.int8]
    ticks: int

    @property
    def counts(self) -> Ints:
        """(k,) pulses of each axis, signed."""
        return np.asarray(self.steps.sum(axis=0, dtype=np.int64))

    def dense(self) -> NDArray[np.int8]:
        """(ticks, k), idle ticks as zeros."""
        out = np.zeros((self.ticks, self.steps.shape[1]), dtype=np.int8)
        out[self.tick] = self.steps
        return out

    def positions(self, start: ArrayLike = 0) -> Ints:
        """(p + 1, k) BLU after each pulsing tick, the start first."""
        path = np.cumsum(self.steps, axis=0, dtype=np.int64)
        path = np.concatenate([np.zeros((1, path.shape[1]), dtype=np.int64), path])
        return np.asarray(path + np.asarray(start, dtype=np.int64))

    def text(self, *, idle: bool = False) -> str:
        """One group of +, - and 0 per tick, e.g. "+0 ++ 0-"; without idle ticks unless asked for."""
        rows = self.dense() if idle else self.steps
        return " ".join("".join("0+-"[s] for s in row) for row in rows.tolist())

    def codes(self) -> NDArray[np.int8]:
        """(p, k) in the code of the engraver's driver: 0 none, 1 forward, 2 backward."""
        return np.asarray(np.where(self.steps < 0, 2, self.steps), dtype=np.int8)


def pulse_counts(position_mm: ArrayLike, blu_mm: float) -> Ints:
    """Absolute positions in BLU, halves away from zero.

    Blocks are differences of these, so that errors of rounding never add up: three moves of 0.03 mm at
    0.02 mm are 2, 1 and 2 pulses.
    """
    if not (blu_mm > 0 and math.isfinite(blu_mm)):
        raise KinematicsError(f"BLU is {blu_mm} mm, expected a positive number")
    scaled = np.asarray(position_mm, dtype=np.float64) / blu_mm
    # a decimal half is seldom one in binary: 44.45 / 0.02 gives 2222.4999999999995
    nudged = scaled * (1.0 + 4 * np.finfo(float).eps)
    if not (np.abs(scaled) < 2**52).all():
        raise KinematicsError("positions beyond 2^52 BLU")
    return np.asarray(np.sign(scaled) * np.floor(np.abs(nudged) + 0.5), dtype=np.int64)


def line_train(counts: ArrayLike, capacity: int, *, preset: int | None = None) -> Train:
    """Linear DDA over any number of axes.

    counts : (k,) signed pulses. capacity : N.
    preset : content of the registers before; default half load, N // 2.
    Raises KinematicsError: A register overflow (more pulses than capacity), a preset outside [0, N).

    Each axis sends exactly |p_a| pulses, and its register ends as it began, because it overflows
    floor((q0 + N |p_a|) / N) = |p_a| times.
    """
    p = np.asarray(counts, dtype=np.int64)
    q0 = _checked(capacity) // 2 if preset is None else preset
    if p.ndim != 1 or not len(p):
        raise KinematicsError(f"counts: expected one number per axis, got shape {p.shape}")
    if not 0 <= q0 < capacity:
        raise KinematicsError(f"preset {q0} outside 0 to {capacity - 1}")
    _fits(int(np.abs(p).max()), capacity)
    # pulse c of an axis comes in the first tick j (from 1) with q0 + j |p| >= c N
    ticks = [
        -((q0 - np.arange(1, n + 1, dtype=np.int64) * capacity) // n) - 1 for n in np.abs(p).tolist() if n
    ]
    every = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *ticks]))
    steps = np.zeros((len(every), len(p)), dtype=np.int8)
    for axis, moments in zip(np.flatnonzero(p), ticks, strict=True):
        steps[np.searchsorted(every, moments), axis] = np.sign(p[axis])
    return _train(every, steps, capacity)


def line_limit(counts: ArrayLike, capacity: int, *, half_load: bool = True) -> float:
    """Proven bound of the distance between the pulses and the straight line, BLU.

    Each axis errs by e_a, |e_a| <= 1/2 with half load and -(N - 1)/N <= e_a <= 0 without. The distance to the
    line is at most |e|; for two moving axes it is |e_x s_y - e_y s_x| along the unit direction s.
    """
    p = np.asarray(counts, dtype=np.float64)
    moving = p[p != 0.0]
    if len(moving) < 2:
        return 0.0
    share = np.abs(moving) / np.linalg.norm(moving)
    if half_load:
        return 0.5 * float(share.sum() if len(moving) == 2 else math.sqrt(len(moving)))
    one = 1.0 - 1.0 / capacity
    return one * (float(share.max()) if len(moving) == 2 else math.sqrt(len(moving)))


def arc_corners(start: ArrayLike, end: ArrayLike, *, ccw: bool, slack: float = 1.0) -> Ints:
    """Start, axis points passed on the way, end: (l + 1, 2) BLU about the centre. Equal ends: a whole circle.

    Raises KinematicsError: Start on the centre, or an end whose radius differs by more than `slack` BLU ("off-circle
        end").
    """
    s, e = (np.asarray(v, dtype=np.int64) for v in (start, end))
    if s.shape != (2,) or e.shape != (2,):
        raise KinematicsError(f"arc: expected two coordinates, got shapes {s.shape} and {e.shape}")
    radius, far = math.hypot(*s), math.hypot(*e)
    if radius == 0.0 or far == 0.0:
        raise KinematicsError("arc: its start or end is the centre")
    if abs(radius - far) > slack:
        raise KinematicsError(
            f"arc: off-circle end, start radius {radius:.4g} BLU and end radius {far:.4g} BLU",
            remedy=f"they may differ by {slack:g} BLU",
        )
    way = 1 if ccw else -1
    begin, sweep = math.atan2(s[1], s[0]), lattice_sweep(s, e, ccw=ccw)
    size = math.floor(radius + 0.5)
    points = []
    for quarter in range(-8, 9):
        passed = way * (quarter * math.pi / 2 - begin)
        # lattice points off the axes are 1 / radius away from them, far more than this
        if 1e-12 < passed < sweep - 1e-12:
            points.append((passed, [(size, 0), (0, size), (-size, 0), (0, -size)][quarter % 4]))
    return np.array([s, *(point for _, point in sorted(points)), e], dtype=np.int64)


def lattice_sweep(start: Ints, end: Ints, *, ccw: bool) -> float:
    """rad in (0, 2 pi] between two points about the centre; equal points are a whole turn apart."""
    if (start == end).all():
        return 2 * math.pi
    turn = math.atan2(end[1], end[0]) - math.atan2(start[1], start[0])
    return (turn if ccw else -turn) % (2 * math.pi)


def arc_train(
    start: ArrayLike, end: ArrayLike, capacity: int, *, ccw: bool, turns: int = 1, slack: float = 1.0
) -> Train:
    """Circular DDA of mode `dda`; its end is exact by counters.

    start, end : (2,) BLU about the centre. turns : 1 is up to a whole circle, each further one adds a circle.
    Raises KinematicsError: Like `arc_corners`; a radius above the capacity; turns below 1.
    """
    tick, steps, ticks = _arc(start, end, capacity, ccw, turns, slack)
    return _train(tick, steps, ticks)


def helix_train(
    start: ArrayLike,
    end: ArrayLike,
    rise: int,
    capacity: int,
    *,
    ccw: bool,
    turns: int = 1,
    slack: float = 1.0,
) -> Train:
    """Circular DDA with a third axis, linear in ticks within half a BLU; columns x, y, z.

    Raises KinematicsError: Like `arc_train`; more pulses of the third axis than ticks.
    """
    tick, steps, ticks = _arc(start, end, capacity, ccw, turns, slack)
    if abs(rise) > ticks:
        raise KinematicsError(
            f"helix: {abs(rise)} pulses along the axis in {ticks} ticks of the arc",
            remedy="take a larger register",
        )
    up = line_train([rise], ticks) if rise else Train(tick[:0], np.zeros((0, 1), np.int8), ticks)
    every = np.union1d(tick, up.tick)
    out = np.zeros((len(every), 3), dtype=np.int8)
    out[np.searchsorted(every, tick), :2] = steps
    out[np.searchsorted(every, up.tick), 2] = up.steps[:, 0]
    return _train(every, out, ticks)


def s1_quadrant_train(quadrant: int, radius: int, capacity: int, *, ccw: bool = False) -> Train:
    """One whole quadrant as the engraver's listing draws it, errors included (mode `s1`).

    It runs int(1.57 N) ticks, so the slow axis misses at least one pulse and a large quadrant ends early.

    quadrant : 1 upper left, 2 upper right, 3 lower right, 4 lower left: the numbering of the listing.
    radius : BLU.
    Raises KinematicsError: Another quadrant, a radius that is not positive or above the capacity.
    """
    if (quadrant, ccw) not in QUADRANTS_S1:
        raise KinematicsError(f"quadrant {quadrant}, expected 1 to 4")
    if radius < 1:
        raise KinematicsError(f"radius {radius} BLU is not positive")
    _fits(radius, _checked(capacity))
    along_x, sx, sy = QUADRANTS_S1[quadrant, ccw]
    ticks = int(1.57 * capacity)
    room = min(ticks, 4 * radius + 8)
    tick, steps = np.zeros(room, dtype=np.int64), np.zeros((room, 2), dtype=np.int8)
    n = _kernels.quadrant_s1(radius, along_x, sx, sy, capacity, ticks, tick, steps)
    return _train(tick[:n], steps[:n], ticks)


def arc_limit(corners: Ints, turns: int) -> float:
    """BLU the radius of an arc train may err, see `ARC_LIMITS`; corners from `arc_corners`."""
    start, end = corners[0], corners[-1]
    if turns > 1 or (start != 0).all() or (end != 0).all():
        return ARC_LIMITS["arc"]
    return ARC_LIMITS["circle" if (start == end).all() else "quadrant" if len(corners) == 2 else "arc"]


def radius_error(positions: Ints, radius: float) -> Floats:
    """| |(x, y)| - R | along a train, BLU; positions (p, 2) about the centre."""
    return np.asarray(np.abs(np.hypot(positions[:, 0], positions[:, 1]) - radius))


def _arc(
    start: ArrayLike, end: ArrayLike, capacity: int, ccw: bool, turns: int, slack: float
) -> tuple[Ints, NDArray[np.int8], int]:
    if turns < 1:
        raise KinematicsError(f"arc: {turns} turns")
    s = np.asarray(start, dtype=np.int64)
    corners = arc_corners(s, end, ccw=ccw, slack=slack)
    _fits(math.ceil(math.hypot(*s)), _checked(capacity))
    refuse_many(4 * turns * math.ceil(math.hypot(*s)))
    if turns > 1:
        circle = arc_corners(s, s, ccw=ccw)
        corners = np.concatenate([*[circle[:-1]] * (turns - 1), corners])
    room = int(np.abs(np.diff(corners, axis=0)).sum()) + 1
    tick, steps = np.zeros(room, dtype=np.int64), np.zeros((room, 2), dtype=np.int8)
    n, ticks, _ = _kernels.circular_dda(corners, capacity, tick, steps)
    return tick[:n], steps[:n], int(ticks)


def _checked(capacity: int) -> int:
    if capacity < 1 or capacity != int(capacity) or capacity > MAX_CAPACITY:
        raise KinematicsError(f"register capacity {capacity}: expected a whole number from 1 to 2^31")
    return int(capacity)


def refuse_many(pulses: int) -> None:
    """Raises KinematicsError: Above `MAX_PULSES`."""
    if pulses > MAX_PULSES:
        raise KinematicsError(
            f"{pulses} pulses in one block", remedy=f"at most {MAX_PULSES}; take a larger BLU"
        )


def _fits(pulses: int, capacity: int) -> None:
    refuse_many(pulses)
    if pulses > capacity:
        raise KinematicsError(
            f"register overflow: {pulses} in a register of {capacity}",
            remedy="split the block, or take a larger register or BLU",
        )


def _train(tick: Ints, steps: NDArray[np.int8], ticks: int) -> Train:
    for array in (tick, steps):
        array.setflags(write=False)
    return Train(tick, steps, ticks)
