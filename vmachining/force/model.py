"""Force of all teeth at many positions and rotation angles, from engaged intervals of any engine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, Ints
from vmachining.engagement.along import blade
from vmachining.errors import InputError
from vmachining.force import _kernels
from vmachining.force.coefficients import Coefficients
from vmachining.tool import BullNose, Cutter, Edge


@dataclass(frozen=True, slots=True, eq=False)
class Forces:
    """Force on the tool, linear in the feed: at feed per tooth f every column is `slope` f + `edge`.

    Columns [position, angle]: force x, y, z in the tool frame, N; torque, N mm; sum of the tangential forces, N.
    frame : (positions, 3, 3) of the tool. feed : (positions,) mm per tooth. teeth : summed over.
    heights : lowest and highest segment that cuts, mm above the tip.
    """

    slope: Floats
    edge: Floats
    frame: Floats
    feed: Floats
    teeth: int
    heights: tuple[float, float]

    def columns(self, feed: ArrayLike | None = None) -> Floats:
        """(positions, angles, 5) at a feed per tooth, mm; that of the motion if none is given."""
        asked = self.feed if feed is None else np.asarray(feed, dtype=np.float64)
        f = np.broadcast_to(asked, self.feed.shape)
        return np.asarray(self.slope * f[:, None, None] + self.edge)

    @property
    def tool(self) -> Floats:
        """(positions, angles, 3) N in the tool frame."""
        return self.columns()[..., :3]

    @property
    def workpiece(self) -> Floats:
        """(positions, angles, 3) N on the tool, in workpiece axes: F_wcs = M3 F_tcs (7-12 with a 3 x 3 matrix)."""
        return np.asarray(np.einsum("pij,paj->pai", self.frame, self.tool))

    @property
    def resultant(self) -> Floats:
        """(positions, angles) N."""
        return np.asarray(np.linalg.norm(self.tool, axis=-1))

    @property
    def torque(self) -> Floats:
        """(positions, angles) N mm."""
        return self.columns()[..., 3]

    def power(self, rev_min: ArrayLike) -> Floats:
        """(positions,) W at the cutter, mean over the revolution."""
        return power_w(self.torque.mean(axis=1), rev_min)


def edge_forces(
    tool: Cutter,
    coefficients: Coefficients,
    phi: ArrayLike,
    lower: ArrayLike,
    upper: ArrayLike,
    *,
    frame: ArrayLike,
    velocity: ArrayLike,
    feed_per_tooth: ArrayLike,
    axis_rate: ArrayLike | None = None,
    teeth: int = 1,
    chi: float = 0.0,
    lag: bool = False,
    segments: int = 20,
    spin: int = 1,
) -> Forces:
    """Forces of a tool at positions of a path, turned through a grid of angles (7-1 to 7-8).

    tool : cutter; its meridian with the bottom gives radius, height and normal of a point.
    phi : (angles,) rad, an even grid over one turn where there is more than one tooth or a lag.
    lower, upper : (positions, angles, intervals) mm, s of engaged intervals, NaN where none exists, each in one piece.
    frame, velocity : (positions, 3, 3) and (positions, 3): tool frames, and motion of the tip in any unit of time.
    feed_per_tooth : (positions,) mm.
    axis_rate : (positions, 3) dw/dt in the same unit; None: the axis keeps its direction.
    teeth : equally spaced. chi : rad, helix angle of the direction matrix.
    lag : whether points at height z stand z tan(chi) / R behind the tip, too.
    segments : of every interval, midpoint rule.
    spin : 1 as under M3, -1 under M4: the cutting direction is the other one.
    Raises InputError: Shapes that do not fit; teeth that do not divide the angles; a lag or several teeth on an uneven
        grid.
    """
    angle = np.atleast_1d(np.asarray(phi, dtype=np.float64))
    low, high = (np.asarray(v, dtype=np.float64) for v in (lower, upper))
    if low.ndim != 3 or low.shape != high.shape or low.shape[1] != len(angle):
        raise InputError(
            f"intervals: expected (positions, {len(angle)}, intervals), got {low.shape} and {high.shape}"
        )
    n, count = low.shape[:2]
    frames = np.broadcast_to(np.asarray(frame, dtype=np.float64), (n, 3, 3))
    v = np.broadcast_to(np.asarray(velocity, dtype=np.float64), (n, 3))
    w = np.broadcast_to(np.zeros(3) if axis_rate is None else np.asarray(axis_rate, dtype=np.float64), (n, 3))
    feed = np.broadcast_to(np.asarray(feed_per_tooth, dtype=np.float64), (n,)).copy()
    if teeth < 1 or spin not in (1, -1):
        raise InputError(f"{teeth} teeth, spin {spin}: expected at least one tooth, and 1 or -1")
    step = 2.0 * np.pi / count
    even = bool(np.allclose(np.diff(angle), step, atol=1e-9)) if count > 1 else False
    if teeth > 1 and (not even or count % teeth):
        raise InputError(
            f"{teeth} teeth do not divide {count} even angles of a turn",
            remedy=f"take {teeth * -(-count // teeth)} angles",
        )
    if lag and chi != 0.0 and not even:
        raise InputError("a lag needs an even grid of angles over one turn")
    speed = np.linalg.norm(v, axis=1)
    if not (speed > 0.0).all():
        raise InputError("the tip rests at a position: the feed per tooth is undefined there")
    hits = _hits(tool, low, high)
    at = np.tile(angle, n)
    local = np.column_stack([np.einsum("pji,pj->pi", frames, v), np.einsum("pji,pj->pi", frames, w)[:, :2]])
    motion = np.repeat(local / speed[:, None], count, axis=0)
    edge = Edge(tool, bottom=True)
    node, weight = midpoints(segments)
    out, heights = np.empty((n * count, 10)), np.array([np.inf, -np.inf])
    if lag and chi != 0.0:
        hits, at, motion, back = _lagged(edge, hits, at, motion, chi, segments)
        found = np.empty((len(at), 10))
        _kernels.edge_forces(
            blade(edge), hits, at, motion, coefficients.powers, chi, float(spin), np.zeros(1), np.full(1, 2.0),
            heights, found,
        )  # fmt: skip
        out[:] = _deposited(found, back, step, n, count)
    else:
        _kernels.edge_forces(
            blade(edge), hits, at, motion, coefficients.powers, chi, float(spin), node, weight, heights, out
        )
    table = out.reshape(n, count, 10)
    if teeth > 1:
        table = np.tile(table.reshape(n, teeth, count // teeth, 10).sum(axis=1), (1, teeth, 1))
    slope = table[..., [0, 1, 2, 6, 8]]
    rest = table[..., [3, 4, 5, 7, 9]]
    return Forces(slope, rest, frames, feed, teeth, (float(heights[0]), float(heights[1])))


def midpoints(segments: int) -> tuple[Floats, Floats]:
    """Nodes and weights of the midpoint rule on [-1, 1]."""
    if segments < 1:
        raise InputError(f"{segments} segments: expected at least 1")
    return (2.0 * np.arange(segments) + 1.0) / segments - 1.0, np.full(segments, 2.0 / segments)


def bull_edge(rm: float, r: float, length: float) -> Cutter:
    """The cutter with a centre circle of radius rm and a corner of radius r, mm; r = 0 flat, rm = 0 ball."""
    return BullNose(diameter=2.0 * (rm + r), corner_radius=r, length=length)


def power_w(torque_n_mm: ArrayLike, rev_min: ArrayLike) -> Floats:
    """(...,) W = 2 pi n_s / 60 M / 1000, of a mean torque."""
    return np.asarray(2.0 * np.pi * np.asarray(rev_min) / 60.0 * np.asarray(torque_n_mm) / 1000.0)


def cantilever_mm(force_n: ArrayLike, length: float, diameter: float, modulus_n_mm2: float) -> Floats:
    """(...,) mm at the end of a uniform round cantilever: F l^3 / (3 E I), I = pi d^4 / 64."""
    return np.asarray(np.asarray(force_n) * length**3 / (3.0 * modulus_n_mm2 * np.pi * diameter**4 / 64.0))


def deflection_force(deflection_mm: float, length: float, diameter: float, modulus_n_mm2: float) -> float:
    """N across the axis that bends the tool by a deflection: the inverse of `cantilever_mm`."""
    return float(deflection_mm / cantilever_mm(1.0, length, diameter, modulus_n_mm2))


def _hits(tool: Cutter, low: Floats, high: Floats) -> Floats:
    """(k, 4) rows of the kernels for intervals (n, count, j)."""
    edge = Edge(tool, bottom=True)
    p, a, j = np.nonzero(high > low)
    first, last = low[p, a, j], high[p, a, j]
    piece = edge.piece_at(0.5 * (first + last))
    return np.ascontiguousarray(
        np.column_stack([p * low.shape[1] + a, piece, first, last]).astype(np.float64)
    )


def _lagged(
    edge: Edge, hits: Floats, at: Floats, motion: Floats, chi: float, segments: int
) -> tuple[Floats, Floats, Floats, tuple[Ints, Floats]]:
    """Every segment its own row, and how far ahead of it the tip of its edge stands."""
    share = np.arange(segments + 1) / segments
    ends = hits[:, 2, None] + (hits[:, 3] - hits[:, 2])[:, None] * share
    owner = np.repeat(hits[:, 0].astype(np.int64), segments)
    piece = np.repeat(hits[:, 1], segments)
    low, high = ends[:, :-1].ravel(), ends[:, 1:].ravel()
    rows = np.column_stack([np.arange(len(owner)), piece, low, high]).astype(np.float64)
    z = edge.at(piece.astype(np.int64), 0.5 * (low + high)).z
    lag = z * np.tan(chi) / edge.profile.max_radius
    return np.ascontiguousarray(rows), at[owner], np.ascontiguousarray(motion[owner]), (owner, lag)


def _deposited(found: Floats, back: tuple[Ints, Floats], step: float, n: int, count: int) -> Floats:
    """Segments given to the angles of their tips, shared between the two of the grid beside each."""
    owner, lag = back
    place, angle = owner // count, owner % count
    move = angle + lag / step
    left = np.floor(move).astype(np.int64)
    share = move - left
    out = np.zeros((n * count, found.shape[1]))
    np.add.at(out, place * count + left % count, found * (1.0 - share)[:, None])
    np.add.at(out, place * count + (left + 1) % count, found * share[:, None])
    return out
