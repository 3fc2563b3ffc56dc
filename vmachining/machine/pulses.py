"""Whole paths as pulse trains: blocks, feed, deviation, files and a plot.

Symbols: V feed along the path (mm/min), L path length, R radius (mm), N capacity, FRN feed rate number.

    FRN = 10 V / L for a line, 10 V / R for an arc (V in its plane);  time of a line 600 / FRN s
    clock of the registers  f0 = N FRN / 600 Hz: a line takes N ticks, a radian of an arc takes N ticks
    if a third register of 2^n, loaded with FRN and clocked with f, makes that clock:  f = 2^(m + n) / 600, N = 2^m
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vmachining.arrays import Ints
from vmachining.errors import KinematicsError
from vmachining.geometry import Arc, Line
from vmachining.machine.dda import (
    MAX_CAPACITY,
    Train,
    arc_corners,
    arc_limit,
    helix_train,
    lattice_sweep,
    line_limit,
    line_train,
    pulse_counts,
    radius_error,
    refuse_many,
    s1_quadrant_train,
)

BLU_MM = 0.02
"""4 mm screw lead, 200 full steps per turn."""
REGISTER = 20_000
"""Holds a block of 400 mm at 0.02 mm."""
RAPID_MM_MIN = 4000.0
LATTICE_SLACK = 3.0
"""BLU; radii of an arc whose start, end and centre are rounded may differ by sqrt(8) at most."""
IN_PLANE = {0: (1, 2, 0), 1: (2, 0, 1), 2: (0, 1, 2)}


@dataclass(frozen=True, slots=True, eq=False)
class PulseBlock:
    """Pulses of one block.

    line : of the program, or None. kind : "line", "arc" or "helix".
    start : (3,) BLU where the block begins; wanted : (3,) pulses that lead to its end.
    train : columns x, y, z. feed_mm_min : of the path. frn : feed rate number. clock_hz : of the registers.
    peak_hz : largest pulse rate of an axis.
    deviation_blu : largest distance of the pulses to the line or circle through the rounded ends and centre;
        for a helix the larger of its radius error and its z error.
    limit_blu : what the method promises for it; inf for arcs of mode `s1`, which promise nothing.
    """

    line: int | None
    kind: str
    start: Ints
    wanted: Ints
    train: Train
    feed_mm_min: float
    frn: float
    clock_hz: float
    peak_hz: float
    deviation_blu: float
    limit_blu: float

    @property
    def time_s(self) -> float:
        """Ticks over clock; 0 for a block without ticks."""
        return self.train.ticks / self.clock_hz if self.train.ticks else 0.0

    @property
    def missing(self) -> Ints:
        """(3,) pulses that the train does not send (mode `s1` loses some in arcs)."""
        return np.asarray(self.wanted - self.train.counts)


@dataclass(frozen=True, slots=True, kw_only=True)
class Interpolator:
    """A pulse generator.

    blu_mm : length of a pulse. register : capacity N. mode : "dda" or "s1".
    split : cut blocks that overflow the register instead of refusing them (lines only; an arc needs the
        capacity of its radius).
    max_pulse_hz : pulse rate the drives can follow, None for no limit. rapid_mm_min : feed of rapids.

    Raises KinematicsError: A value that makes no sense.
    """

    blu_mm: float = BLU_MM
    register: int = REGISTER
    mode: str = "dda"
    split: bool = False
    max_pulse_hz: float | None = None
    rapid_mm_min: float = RAPID_MM_MIN

    def __post_init__(self) -> None:
        if self.mode not in ("dda", "s1"):
            raise KinematicsError(f"mode {self.mode!r}: expected dda or s1")
        if not 1 <= self.register <= MAX_CAPACITY:
            raise KinematicsError(f"register {self.register}: expected a whole number from 1 to 2^31")
        for name, value in (("blu_mm", self.blu_mm), ("rapid_mm_min", self.rapid_mm_min),
                            ("max_pulse_hz", self.max_pulse_hz)):  # fmt: skip
            if value is not None and not (math.isfinite(value) and value > 0):
                raise KinematicsError(f"{name} is {value}, expected a positive number")

    def blocks(
        self, path: Line | Arc, feed_mm_min: float | None, line: int | None = None
    ) -> list[PulseBlock]:
        """Pulses of one path; several blocks if it was split, none if it has no pulse.

        feed_mm_min : along the path; None for a rapid.
        line : of the program, for messages.
        Raises KinematicsError: Register overflow, off-circle end, an arc that mode `s1` cannot draw, a feed that is not
            positive or above `max_pulse_hz`.
        """
        feed = self.rapid_mm_min if feed_mm_min is None else feed_mm_min
        if not feed > 0:
            raise KinematicsError(f"feed {feed} mm/min is not positive", line=line)
        begin, end = pulse_counts([path.start, path.end], self.blu_mm)
        try:
            if isinstance(path, Line):
                made = self._line(begin, end, path.length, feed, line)
            else:
                made = self._arc(path, begin, end, feed, line)
        except KinematicsError as exc:
            if exc.line is not None or line is None:
                raise
            raise KinematicsError(exc.message, line=line, remedy=exc.remedy) from exc
        for block in made:
            if self.max_pulse_hz is not None and block.peak_hz > self.max_pulse_hz * (1 + 1e-12):
                raise KinematicsError(
                    f"feed too high: {block.peak_hz:.6g} pulses/s, the drives follow {self.max_pulse_hz:.6g}",
                    line=line,
                    remedy=f"feed at most {feed * self.max_pulse_hz / block.peak_hz:.6g} mm/min",
                )
        return made

    def _line(self, begin: Ints, end: Ints, length: float, feed: float, line: int | None) -> list[PulseBlock]:
        counts = end - begin
        if not counts.any():
            return []
        largest = int(np.abs(counts).max())
        refuse_many(largest)
        parts = math.ceil(largest / self.register) if self.split else 1
        # rounding positions, not increments: the parts add up to the whole
        cuts = pulse_counts(counts * np.arange(parts + 1)[:, None] / parts, 1.0)
        out = []
        for a, b in pairwise(cuts):
            piece = b - a
            if self.mode == "dda":
                train, limit = line_train(piece, self.register), line_limit(piece, self.register)
            else:
                train, limit = self._engraver_line(piece)
            seconds = 60.0 * length / feed / parts
            clock = train.ticks / seconds
            peak = clock * float(np.abs(piece).max()) / train.ticks
            out.append(
                PulseBlock(line, "line", begin + a, piece, train, feed, 600.0 / seconds, clock, peak,
                           self._off_line(train, piece), limit)
            )  # fmt: skip
        return out

    def _engraver_line(self, piece: Ints) -> tuple[Train, float]:
        """Mode s1: x and y from empty registers, then z by itself."""
        flat = line_train(piece[:2], self.register, preset=0)
        down = abs(int(piece[2]))
        limit = line_limit(piece[:2], self.register, half_load=False)
        if not down:
            return Train(flat.tick, _wide(flat.steps), flat.ticks), limit
        first = flat.ticks if piece[:2].any() else 0
        steps = np.zeros((len(flat.tick) + down, 3), dtype=np.int8)
        steps[: len(flat.tick), :2] = flat.steps
        steps[len(flat.tick) :, 2] = np.sign(piece[2])
        tick = np.concatenate([flat.tick, first + np.arange(down)])
        # x, y and then z leave the straight line by the height over the foot of the corner
        size = math.hypot(*piece[:2])
        corner = size * down / math.hypot(size, down)
        return Train(tick, steps, first + down), limit + corner

    def _off_line(self, train: Train, piece: Ints) -> float:
        way = piece / np.linalg.norm(piece)
        at = train.positions(np.zeros(3)).astype(np.float64)
        return float(np.linalg.norm(at - np.outer(at @ way, way), axis=1).max())

    def _arc(self, path: Arc, begin: Ints, end: Ints, feed: float, line: int | None) -> list[PulseBlock]:
        a, b, c = IN_PLANE[path.axis]
        radius_end = float(np.hypot(*(path.end - path.center)[[a, b]]))
        if abs(path.radius - radius_end) > self.blu_mm:
            raise KinematicsError(
                f"off-circle end, start radius {path.radius:g} mm and end radius {radius_end:g} mm", line=line
            )
        start = pulse_counts((path.start - path.center)[[a, b]], self.blu_mm)
        finish = start + (end - begin)[[a, b]]
        if not start.any() or not finish.any():
            raise KinematicsError(f"an arc of radius {path.radius:g} mm is below one BLU", line=line)
        ccw, rise = path.angle > 0, int((end - begin)[c])
        # the lattice has its own sweep; whole turns make up the difference to the programmed one
        sweep = lattice_sweep(start, finish, ccw=ccw)
        turns = 1 + round((abs(path.angle) - sweep) / (2 * math.pi))
        if turns < 1:
            # both ends fall on one point of the lattice, or change places: what is left is not an arc
            return self._line(begin, end, path.length, feed, line)
        if self.mode == "s1":
            flat, limit = self._engraver_arc(start, finish, ccw, turns, rise), math.inf
            train = Train(flat.tick, _wide(flat.steps), flat.ticks)
        else:
            train = helix_train(start, finish, rise, self.register, ccw=ccw, turns=turns, slack=LATTICE_SLACK)
            limit = arc_limit(arc_corners(start, finish, ccw=ccw, slack=LATTICE_SLACK), turns)
            if abs(math.hypot(*start) - math.hypot(*finish)) > 1.0:
                limit += abs(math.hypot(*start) - math.hypot(*finish))
        at = train.positions(np.zeros(3))
        error = float(radius_error(at[:, :2] + start, math.hypot(*start)).max())
        if rise:
            even = rise * (train.tick + 1) / train.ticks
            error = max(error, float(np.abs(at[1:, 2] - even).max()))
        order = [(a, b, c).index(k) for k in range(3)]
        train = Train(train.tick, np.ascontiguousarray(train.steps[:, order]), train.ticks)
        share = path.radius * abs(path.angle) / path.length  # of the feed, in the plane
        frn = 10.0 * feed * share / path.radius
        clock = self.register * frn / 600.0
        return [
            PulseBlock(line, "helix" if rise else "arc", begin, end - begin, train, feed, frn, clock,
                       clock * math.hypot(*start) / self.register, error, limit)
        ]  # fmt: skip

    def _engraver_arc(self, start: Ints, finish: Ints, ccw: bool, turns: int, rise: int) -> Train:
        corners = arc_corners(start, finish, ccw=ccw, slack=LATTICE_SLACK)
        if (start != 0).all() or (finish != 0).all() or rise or turns > 1 or (
            abs(math.hypot(*start) - math.hypot(*finish)) > 0
        ):  # fmt: skip
            raise KinematicsError(
                "mode s1 draws whole quadrants of a circle only", remedy="mode dda draws any arc and helix"
            )
        ticks, trains = 0, []
        for p, q in pairwise(corners):
            right, upper = bool((p + q)[0] > 0), bool((p + q)[1] > 0)
            quadrant = (2 if right else 1) if upper else (3 if right else 4)
            train = s1_quadrant_train(quadrant, int(np.abs(p).max()), self.register, ccw=ccw)
            trains.append((train.tick + ticks, train.steps))
            ticks += train.ticks
        return Train(np.concatenate([t for t, _ in trains]), np.concatenate([s for _, s in trains]), ticks)


def write_csv(path: str | Path, blocks: Iterable[PulseBlock]) -> None:
    """One row per pulsing tick: block, line, tick, time_s (from the start of the path), x, y, z."""
    with Path(path).open("w", encoding="utf-8", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["block", "line", "tick", "time_s", "x", "y", "z"])
        begin = 0.0
        for k, block in enumerate(blocks):
            times = begin + (block.train.tick + 1) / block.clock_hz
            where = "" if block.line is None else block.line
            for tick, time, step in zip(
                block.train.tick.tolist(), times.tolist(), block.train.steps.tolist(), strict=True
            ):
                out.writerow([k, where, tick, f"{time:.9g}", *step])
            begin += block.time_s


def write_npz(path: str | Path, blocks: Sequence[PulseBlock], interpolator: Interpolator) -> None:
    """Columns for numpy: steps (p, 3) int8, tick (p,), block (p,); line, ticks, clock_hz (b,); blu_mm, register."""
    trains = [block.train for block in blocks]
    counts = [len(train.tick) for train in trains]
    columns: dict[str, NDArray[np.generic]] = {
        "steps": np.concatenate([np.zeros((0, 3), np.int8), *(train.steps for train in trains)]),
        "tick": np.concatenate([np.zeros(0, np.int64), *(train.tick for train in trains)]),
        "block": np.repeat(np.arange(len(blocks)), counts),
        "line": np.array([-1 if block.line is None else block.line for block in blocks], dtype=np.int64),
        "ticks": np.array([train.ticks for train in trains], dtype=np.int64),
        "clock_hz": np.array([block.clock_hz for block in blocks]),
        "blu_mm": np.array(interpolator.blu_mm),
        "register": np.array(interpolator.register),
    }
    with Path(path).open("wb") as file:
        np.savez_compressed(file, **columns)  # type: ignore[arg-type]


def _wide(steps: NDArray[np.int8]) -> NDArray[np.int8]:
    """Two columns as three."""
    return np.concatenate([steps, np.zeros((len(steps), 1), np.int8)], axis=1)
