"""`engaged`: the edge at many positions and rotation angles against stock of heights; `Pass`: what came out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, Ints
from vmachining.engagement import chip
from vmachining.engagement.analytic import _kernels
from vmachining.engagement.analytic.stairs import HeightStock
from vmachining.engagement.frames import feed_angle
from vmachining.errors import InputError, ToolError

FIRST_CAPACITY = 4
"""Intervals per edge that room is made for at first; more are counted and asked for again."""

LONG_MM = 1000.0
"""Of the cylinder where nothing was said: more than any stock near a tool reaches."""

ROTATION = 1e-6
"""A frame whose columns are less at right angles or of length one than this is refused: six digits of a CL file."""

IDLE = 1e-12
"""N . V below this share of the speed of the tip counts as zero, as for the other methods: an edge that slides cuts nothing."""


@dataclass(frozen=True, slots=True)
class Corner:
    """A flat, bull or ball cutter as its edge: rm and r mm, flute: mm of the cylinder above the corner that cut.

    rm is the radius of the centre circle of the corner: r = 0 is a flat cutter, rm = 0 a ball.
    """

    rm: float
    r: float
    flute: float = LONG_MM

    def __post_init__(self) -> None:
        positive = min(self.rm, self.r, self.flute) >= 0.0 and self.radius > 0.0
        if not (positive and self.radius < np.inf and self.flute < np.inf):
            raise ToolError(f"a cutter of radii {self.rm:g} + {self.r:g} mm and {self.flute:g} mm of flute")

    @property
    def radius(self) -> float:
        """mm, R = rm + r."""
        return self.rm + self.r


@dataclass(frozen=True, slots=True, eq=False)
class Pass:
    """Engaged intervals of one edge along a path, at every position and rotation angle, and its chips.

    corner : the cutter. tip (n, 3) mm, frame (n, 3, 3): where it is. velocity (n, 3), axis_rate (n, 3): how it moves.
    phi : (n or 1, m) rad in the tool frame. lower, upper : (n, m, k) mm, s of the intervals, NaN after the last one;
    a `piece` of the edge each. Units of time are those of velocity and axis_rate.
    """

    corner: Corner
    tip: Floats
    frame: Floats
    velocity: Floats
    axis_rate: Floats
    phi: Floats
    lower: Floats
    upper: Floats

    @property
    def count(self) -> Ints:
        """(n, m) how many intervals."""
        return np.asarray((~np.isnan(self.lower)).sum(axis=-1))

    @property
    def speeds(self) -> chip.Speeds:
        """Of every position and angle, (n, m)."""
        return chip.edge_speeds(
            self.velocity[:, None], self.frame[:, None], self.phi, axis_rate=self.axis_rate[:, None]
        )

    @property
    def phi_feed(self) -> Floats:
        """(n, m) rad from the feed, pi/2 straight ahead, in [0, 2 pi)."""
        turned = self.phi + feed_angle(self.velocity, self.frame)[:, None]
        return np.asarray(np.mod(turned, 2.0 * np.pi))

    @property
    def cut_length(self) -> Floats:
        """(n, m) mm, q."""
        return chip.cut_length(self.lower, self.upper)

    @property
    def axial_depth(self) -> Floats:
        """(n, m) mm along the tool axis, gaps left out."""
        return chip.axial_depth(self.lower, self.upper, self.corner.r)

    def depth(self, normal: ArrayLike = (0.0, 0.0, 1.0)) -> Floats:
        """(n, m) mm along the design normal (3,) or (n, 1, 3), from LE to UE."""
        c = self.corner
        return chip.exact_depth(
            self.lower, self.upper, self.tip[:, None], self.frame[:, None], self.phi, c.rm, c.r, normal
        )

    def chip_area(
        self, feed_per_tooth: ArrayLike = 1.0, *, model: str = "exact", lead: ArrayLike = 0.0
    ) -> Floats:
        """(n, m) mm^2 for a feed per tooth in mm; model "book": the published one, for a lead in rad."""
        if model == "book":
            return chip.book_chip_area(self.lower, self.upper, feed_per_tooth, lead, self.phi_feed)
        speeds, c = self.speeds, self.corner
        return chip.chip_area(
            self.lower, self.upper, speeds, c.rm, c.r, chip.feed_scale(feed_per_tooth, speeds)
        )

    def thickest(self, feed_per_tooth: ArrayLike = 1.0) -> Floats:
        """(n, m) mm: largest chip thickness along the edge, 0 in air.

        N . V is a wave along the corner with its crest at atan2(a, -b), and linear elsewhere: ends and crest suffice.
        """
        speeds, c = self.speeds, self.corner
        a, b = chip.corner_speeds(speeds, c.rm, c.r)
        crest = c.r * np.clip(np.arctan2(a, -b), 0.0, chip.QUARTER)[..., None]
        round_ = chip.pieces(self.lower, self.upper, c.r) == chip.EdgePiece.CORNER
        within = np.where(round_, np.clip(crest, self.lower, self.upper), self.lower)
        at = chip.Speeds(*(v[..., None] for v in speeds))
        scale = chip.feed_scale(feed_per_tooth, at)
        asked = self.lower, within, self.upper
        best = [np.nan_to_num(chip.chip_thickness(s, at, c.rm, c.r, scale)) for s in asked]
        return np.asarray(np.max(best, axis=0).max(axis=-1, initial=0.0))

    def points(self, *, upper: bool) -> Floats:
        """(n, m, k, 3) mm: lower or upper ends of the intervals; the first lower one is LE, the last upper one UE."""
        s = self.upper if upper else self.lower
        c = self.corner
        return chip.edge_points(
            self.tip[:, None, None], self.frame[:, None, None], self.phi[..., None], s, c.rm, c.r
        )


def engaged(
    corner: Corner,
    stock: HeightStock,
    tip: ArrayLike,
    frame: ArrayLike,
    phi: ArrayLike,
    velocity: ArrayLike = (0.0, 0.0, 0.0),
    *,
    axis_rate: ArrayLike | None = None,
    facing: bool = True,
    bottom: bool = True,
) -> Pass:
    """Engaged intervals by the exact general rule: all crossings with walls, tops and floor, midpoints tested.

    tip : (n, 3) or (3,) mm. frame : (n, 3, 3) or (3, 3), `frames.rotation`.
    phi : (m,) rad in the tool frame, or (n, m) for every position its own.
    velocity, axis_rate : (n, 3) or (3,), of the tip and of the axis; without a rate the axis keeps its direction.
    facing : only where N . V > 0. False: all of the edge, as geometry tests do.
    bottom : with the disc inside the corner.

    Raises InputError: Shapes that do not fit, values that are not finite, a frame that is not a rotation.
    """
    moves, angles = moving(tip, frame, phi, velocity, axis_rate)
    n, m = len(moves.tip), angles.shape[1]
    sizes = float(corner.rm), float(corner.r), float(corner.flute)
    turns = np.sin(angles), np.cos(angles)
    lower, upper = found_intervals(
        n * m,
        lambda found: _kernels.engaged(moves, *turns, *sizes, facing, bottom, IDLE, stock.rows(), found),
    )
    shape = (n, m, lower.shape[1])
    return Pass(
        corner, moves.tip, moves.frame, moves.velocity, moves.axis_rate, angles,
        lower.reshape(shape), upper.reshape(shape),
    )  # fmt: skip


def found_intervals(rows: int, fill: Callable[[_kernels.Found], None]) -> tuple[Floats, Floats]:
    """Lower and upper ends (rows, k) that a kernel finds, with as much room as it needs; NaN after the last one."""
    capacity = FIRST_CAPACITY
    while True:
        lower, upper = np.full((2, rows, capacity), np.nan)
        found = _kernels.Found(lower, upper, np.zeros(rows, dtype=np.int64))
        fill(found)
        most = int(found.many.max(initial=0))
        if most <= capacity:
            return found.lower, found.upper
        capacity = most


def moving(
    tip: ArrayLike, frame: ArrayLike, phi: ArrayLike, velocity: ArrayLike, axis_rate: ArrayLike | None
) -> tuple[_kernels.Moves, Floats]:
    """Positions and motion as columns of equal length, and angles (n or 1, m), checked.

    Raises InputError: Shapes that do not fit, values that are not finite, a frame that is not a rotation.
    """
    where, angles = (np.array(value, dtype=np.float64, ndmin=2) for value in (tip, phi))
    rate = 0.0 if axis_rate is None else axis_rate
    given = {
        "tip": (tip, (3,)),
        "frame": (frame, (3, 3)),
        "velocity": (velocity, (3,)),
        "axis_rate": (rate, (3,)),
    }
    columns = []
    for name, (value, shape) in given.items():
        raw = np.asarray(value, dtype=np.float64)
        try:
            columns.append(np.ascontiguousarray(np.broadcast_to(raw, (len(where), *shape))))
        except ValueError as exc:
            what, remedy = f"{name} of shape {raw.shape}", f"one row of {shape}, or one for every position"
            raise InputError(f"{what} for {len(where)} positions", remedy=remedy) from exc
    if angles.ndim != 2 or angles.shape[0] not in (1, len(where)):
        what = f"phi of shape {np.shape(phi)} for {len(where)} positions"
        raise InputError(what, remedy="(m,), or a row for each")
    moves = _kernels.Moves(*columns)
    for name, column in (*zip(given, columns, strict=True), ("phi", angles)):
        if not np.isfinite(column).all():
            raise InputError(f"{name}: every value must be finite")
    off = np.abs(np.swapaxes(moves.frame, 1, 2) @ moves.frame - np.eye(3)).max(initial=0.0)
    if off > ROTATION or (np.linalg.det(moves.frame) < 0.0).any():
        what = f"a frame is not a rotation: its columns are off by {off:.3g}"
        raise InputError(what, remedy="see frames.frame_of")
    return moves, angles
