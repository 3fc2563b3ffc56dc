"""A machine as one serial chain from the workpiece to the tool: forward and inverse kinematics, velocity.

Symbols: q joints (mm, rad), m their number, T_i motion of joint i, H product of all, Mw pose of the workpiece
frame in machine axes, p tip and u tool axis in the workpiece frame, w1 and w2 directions of the rotary axes
(w1 nearest to the workpiece), k tool axis at home, sigma the sign of a joint.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Bools, Floats, rows
from vmachining.errors import KinematicsError
from vmachining.geometry.rotation import angle_between, rotation
from vmachining.machine.axis import Axis, Kind

SINGULAR_EPS = 1e-9
"""rad; a tool axis nearer than this to the first rotary axis is parallel to it, so that this axis is free.
Ten metres of lever then move by 10 nm."""

REACH_EPS = 1e-9
"""rad; an orientation may lie this far outside the reach, as rounded direction cosines do."""

SLIDE_EPS = 1e-9
"""Smallest |det J| of three slides; below, two of them are parallel or all three lie in one plane."""

PARALLEL_EPS = 1e-9
"""Sine of the angle between directions that count as parallel."""


class ToolPose(NamedTuple):
    """Tip (..., 3) mm and tool axis (..., 3) unit, in workpiece coordinates."""

    tip: Floats
    axis: Floats


class Screws(NamedTuple):
    """A chain in workpiece coordinates at home.

    chain : per joint, workpiece to tool, (kind, direction (3,), point (3,) mm, sign); kind "L" slides, "R" turns.
    tip_home : (3,) mm. axis_home : (3,) unit.
    """

    chain: tuple[tuple[str, Floats, Floats, int], ...]
    tip_home: Floats
    axis_home: Floats


class Rates(NamedTuple):
    """First and second derivatives of tip and tool axis, each (..., 3), for joints that move linearly."""

    tip: Floats
    axis: Floats
    velocity: Floats
    axis_rate: Floats
    acceleration: Floats
    axis_acceleration: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Solutions:
    """All joint positions that reach n poses.

    joints : (n, 2, m) mm and rad, both branches; rotary values in [-pi, pi]. NaN where a branch does not
        exist or its slides cannot be solved. Where both branches coincide only the first is given.
    reachable : (n,) some branch is given.
    singular : (n,) the tool is parallel to the rotary axis nearest to the workpiece; that axis is free, and
        what is given for it (0 if exactly parallel) carries no information.
    boundary : (n,) both branches coincide (up to the free axis).
    slide_det : (n, 2) |det J| of the unit slide directions: 1 at best, 0 in a slide singularity.
    """

    joints: Floats
    reachable: Bools
    singular: Bools
    boundary: Bools
    slide_det: Floats

    @property
    def count(self) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
        """(n,) number of branches, 0 to 2."""
        return np.asarray(np.isfinite(self.joints).all(axis=2).sum(axis=1), dtype=np.int64)


@dataclass(frozen=True, slots=True, eq=False)
class Machine:
    """A serial chain, listed from the workpiece over the bed to the tool.

    axes : joints in that order.
    tip : (3,) mm, tool tip at home in machine axes. tool : (3,) unit, tool axis at home, from tip to spindle.
    work : (4, 4) pose of the workpiece frame in machine axes at home.
    table : number of joints on the workpiece's side of the bed. It classifies the machine; the mathematics
        does not need it.

    Raises KinematicsError: Two joints of one name, no joints, a work frame that is not a rigid motion.
    """

    name: str
    axes: Sequence[Axis]
    tip: Floats = field(default_factory=partial(np.zeros, 3), kw_only=True)
    tool: Floats = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]), kw_only=True)
    work: Floats = field(default_factory=partial(np.eye, 4), kw_only=True)
    table: int = field(default=0, kw_only=True)

    def __post_init__(self) -> None:
        where = f"machine {self.name}"
        try:
            point, k = rows(self.tip, 3, name="tip"), np.array(rows(self.tool, 3, name="tool"))
            frame = rows(self.work, 4, 4, name="work")
        except ValueError as exc:
            raise KinematicsError(f"{where}: {exc}") from exc
        names = self.names
        twice = next((n for n in names if names.count(n) > 1), None)
        if twice is not None or not names:
            raise KinematicsError(f"{where}: {f'joint {twice} is given twice' if twice else 'no joints'}")
        if not 0 <= self.table <= len(names):
            raise KinematicsError(f"{where}: {self.table} of {len(names)} joints on the table")
        size, turn = float(np.linalg.norm(k)), frame[:3, :3]
        rigid = np.abs(turn @ turn.T - np.eye(3)).max() < 1e-9 and np.linalg.det(turn) > 0
        if size == 0.0 or not rigid or (frame[3] != (0, 0, 0, 1)).any():
            what = "tool has no direction" if size == 0.0 else "work is not a rotation and a translation"
            raise KinematicsError(f"{where}: {what}")
        k /= size
        k.setflags(write=False)
        for name, value in (("axes", tuple(self.axes)), ("tip", point), ("tool", k), ("work", frame)):
            object.__setattr__(self, name, value)

    # ---- what it is ------------------------------------------------------------------------------------

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the joints, from the workpiece to the tool: the order of every joint array."""
        return tuple(axis.name for axis in self.axes)

    @property
    def rotary(self) -> tuple[int, ...]:
        """Columns of the rotary joints, nearest to the workpiece first."""
        return tuple(i for i, axis in enumerate(self.axes) if axis.is_rotary)

    @property
    def slides(self) -> tuple[int, ...]:
        """Columns of the linear joints."""
        return tuple(i for i, axis in enumerate(self.axes) if not axis.is_rotary)

    @property
    def chain(self) -> str:
        """E.g. "C'A'|XYZ": primes carry the workpiece, | is the bed."""
        left = "".join(f"{name}'" for name in self.names[: self.table])
        return f"{left}|{''.join(self.names[self.table :])}"

    @property
    def limits(self) -> Floats:
        """(2, m): lowest and highest coordinate, mm and rad."""
        return np.array([[axis.lower for axis in self.axes], [axis.upper for axis in self.axes]])

    def with_tool(self, length_mm: float) -> Machine:
        """The same machine with a tool: the tip of this one is the gauge point, the tool hangs below it."""
        if not math.isfinite(length_mm):
            raise KinematicsError(f"tool length is {length_mm}")
        return dataclasses.replace(self, tip=self.tip - length_mm * self.tool)

    def with_work(self, origin: ArrayLike, turn: ArrayLike | None = None) -> Machine:
        """The same machine with the workpiece frame elsewhere.

        origin : (3,) mm, machine axes at home. turn : (3, 3) rotation, default none.
        """
        frame = np.eye(4)
        frame[:3, 3] = rows(origin, 3, name="origin")
        frame[:3, :3] = np.eye(3) if turn is None else rows(turn, 3, 3, name="turn")
        return dataclasses.replace(self, work=frame)

    def joints(self, *, degrees: bool = True, **values: ArrayLike) -> Floats:
        """Joint array (..., m) from values by name, case ignored; joints that are not named are zero.

        Raises KinematicsError: A name the machine does not have.
        """
        known = {name.lower(): i for i, name in enumerate(self.names)}
        arrays = {name.lower(): np.asarray(value, dtype=np.float64) for name, value in values.items()}
        for name in arrays:
            if name not in known:
                raise KinematicsError(
                    f"machine {self.name} has no joint {name.upper()}",
                    remedy=f"it has {', '.join(self.names)}",
                )
        out = np.zeros((*np.broadcast_shapes(*(a.shape for a in arrays.values())), len(self.axes)))
        for name, array in arrays.items():
            turns = degrees and self.axes[known[name]].is_rotary
            out[..., known[name]] = np.radians(array) if turns else array
        return out

    def named(self, joints: ArrayLike, *, degrees: bool = True) -> dict[str, Floats]:
        """Columns of a joint array by name."""
        q = self._joints(joints)
        return {
            axis.name: np.degrees(q[..., i]) if degrees and axis.is_rotary else q[..., i]
            for i, axis in enumerate(self.axes)
        }

    def screws(self) -> Screws:
        """The chain in the workpiece frame, as rows that need no machine: what a sweep takes."""
        turn, origin = self._base(())
        screws = tuple(
            ("R" if axis.is_rotary else "L", turn @ axis.direction, turn @ axis.point + origin, axis.sign)
            for axis in self.axes
        )
        return Screws(screws, turn @ self.tip + origin, turn @ self.tool)

    def tip_centred(self) -> Machine:
        """The machine as tool-centre-point control shows it: joints X, Y, Z are the tip in the workpiece frame,
        followed by the rotary joints of this machine.

        A block with a straight tip and linear rotary joints is a joint-linear block of this one.

        Raises KinematicsError: A rotary joint named X, Y or Z.
        """
        turn = self.work[:3, :3].T
        slides = [Axis(name, Kind.LINEAR, way) for name, way in zip("XYZ", np.eye(3), strict=True)]
        turning = [
            dataclasses.replace(axis, direction=turn @ axis.direction, point=np.zeros(3))
            for axis in self.axes
            if axis.is_rotary
        ]
        return Machine(f"{self.name}, tip centred", [*slides, *turning], tool=turn @ self.tool)

    # ---- forward ---------------------------------------------------------------------------------------

    def forward(self, joints: ArrayLike) -> ToolPose:
        """Tip and tool axis in the workpiece frame, p = Mw^-1 H(q) tip and u = rot(Mw^-1 H(q)) k.

        joints : (..., m) mm and rad.
        """
        q = self._joints(joints)
        turn, origin = self._base(q.shape[:-1])
        for i, axis in enumerate(self.axes):
            turn, origin = _advance(axis, q[..., i], turn, origin)
        return ToolPose(np.asarray(turn @ self.tip + origin), np.asarray(turn @ self.tool))

    def rates(self, joints: ArrayLike, speeds: ArrayLike) -> Rates:
        """Pose with its first and second derivatives while the joints move at constant speed.

        Each joint adds a twist (omega_i, v_i) in workpiece coordinates, known from the joints before it; its
        own change is the bracket with the twist of those joints.

        joints, speeds : (..., m); speeds per unit of any parameter.
        """
        q, dq = np.broadcast_arrays(self._joints(joints), self._joints(speeds))
        turn, origin = self._base(q.shape[:-1])
        shape = (*q.shape[:-1], 3)
        omega, v, alpha, a = (np.zeros(shape) for _ in range(4))
        for i, axis in enumerate(self.axes):
            way = axis.sign * dq[..., i : i + 1] * (turn @ axis.direction)
            if axis.is_rotary:
                w_i, v_i = way, np.cross(turn @ axis.point + origin, way)
            else:
                w_i, v_i = np.zeros(shape), way
            alpha = alpha + np.cross(omega, w_i)
            a = a + np.cross(omega, v_i) + np.cross(v, w_i)
            omega, v = omega + w_i, v + v_i
            turn, origin = _advance(axis, q[..., i], turn, origin)
        p, u = turn @ self.tip + origin, turn @ self.tool
        dp, du = v + np.cross(omega, p), np.cross(omega, u)
        return Rates(
            np.asarray(p), np.asarray(u), dp, du,
            a + np.cross(alpha, p) + np.cross(omega, dp), np.cross(alpha, u) + np.cross(omega, du),
        )  # fmt: skip

    # ---- inverse ---------------------------------------------------------------------------------------

    def inverse(self, tip: ArrayLike, axis: ArrayLike) -> Solutions:
        """All joints that bring the tool to the poses.

        tip : (n, 3) mm; axis : (n, 3), of any length but zero; workpiece coordinates.
        Raises KinematicsError: A chain that is not made of three slides and at most two rotary axes, parallel rotary
            axes, a rotary axis that only spins the tool, an axis without direction. A pose out of reach is not an error.

        The orientation R(w1, t1) R(w2, t2) k = u is the second subproblem of Paden and Kahan. Its common
        vector z = R(w2, t2) k has the colatitude of u about w1; its azimuth psi about w1 is an angle of the
        spherical triangle with the sides angle(w1, u), angle(w1, w2), angle(w2, k). The half-angle formula

            tan^2(psi / 2) = sin(s - a) sin(s - b) / (sin s sin(s - c)),   s = (a + b + c) / 2

        keeps all digits of a tool nearly parallel to w1 and at the border of the reach, where the usual
        solution by dot products keeps half of them.
        """
        p, u = rows(tip, -1, 3, name="tip"), np.array(rows(axis, -1, 3, name="axis"))
        if len(p) != len(u):
            raise KinematicsError(f"{len(p)} tips and {len(u)} axes")
        size = np.linalg.norm(u, axis=1, keepdims=True)
        if not (size > 0).all():
            raise KinematicsError(f"tool axis {int(np.flatnonzero(size == 0)[0])} has no direction")
        if len(self.slides) != 3 or len(self.rotary) > 2:
            raise KinematicsError(
                f"{self.chain}: the inverse needs three slides and at most two rotary axes, "
                f"got {len(self.slides)} and {len(self.rotary)}"
            )
        wanted = (u / size) @ self.work[:3, :3].T
        angles, reach, singular, boundary = self._orient(wanted)
        n, m = len(p), len(self.axes)
        q = np.zeros((n, 2, m))
        for column, joint in enumerate(self.rotary):
            q[:, :, joint] = angles[:, :, column]
        q, det = self.place(q, p[:, None, :])
        missing = np.stack([~reach, ~reach | boundary], axis=1)
        q[missing], det[missing] = np.nan, np.nan
        given: Bools = np.isfinite(q[:, :, 0])
        return Solutions(q, given[:, 0] | given[:, 1], singular & reach, boundary & reach, det)

    def place(self, joints: ArrayLike, tip: ArrayLike) -> tuple[Floats, Floats]:
        """Slides that bring the tip to a place while the rotary joints stay.

        joints : (..., m), slides ignored. tip : (..., 3) mm.
        Returns joints (..., m) with the slides filled in, NaN where they cannot be solved; |det J| (...,).
        """
        q = np.array(joints, dtype=np.float64)
        q[..., self.slides] = 0.0
        turn, origin = self._base(q.shape[:-1])
        columns = []
        for i, axis in enumerate(self.axes):
            if not axis.is_rotary:
                columns.append(axis.sign * (turn @ axis.direction))
            turn, origin = _advance(axis, q[..., i], turn, origin)
        jacobian = np.stack(np.broadcast_arrays(*columns), axis=-1)
        det = np.abs(np.linalg.det(jacobian))
        solvable = det > SLIDE_EPS
        rest = np.asarray(tip, dtype=np.float64) - (turn @ self.tip + origin)
        safe = np.where(solvable[..., None, None], jacobian, np.eye(3))
        slides = np.linalg.solve(safe, np.where(solvable[..., None], rest, 0.0)[..., None])[..., 0]
        q[..., self.slides] = slides
        q[~solvable] = np.nan
        return q, det

    # ---- inside ----------------------------------------------------------------------------------------

    def _joints(self, values: ArrayLike) -> Floats:
        q = np.asarray(values, dtype=np.float64)
        if q.ndim == 0 or q.shape[-1] != len(self.axes):
            raise KinematicsError(
                f"joints: expected {len(self.axes)} columns ({', '.join(self.names)}), got shape {q.shape}"
            )
        return q

    def _base(self, shape: tuple[int, ...]) -> tuple[Floats, Floats]:
        """Mw^-1 as rotation (..., 3, 3) and origin (..., 3)."""
        turn = self.work[:3, :3].T
        origin = -turn @ self.work[:3, 3]
        return np.broadcast_to(turn, (*shape, 3, 3)), np.broadcast_to(origin, (*shape, 3))

    def _orient(self, wanted: Floats) -> tuple[Floats, Bools, Bools, Bools]:
        """Rotary coordinates (n, 2, r), reachable, singular, boundary, for directions in machine axes (n, 3)."""
        n = len(wanted)
        turning = [self.axes[i] for i in self.rotary]
        everywhere, nowhere = np.ones(n, dtype=np.bool_), np.zeros(n, dtype=np.bool_)
        if not turning:
            reach = angle_between(wanted, self.tool) <= REACH_EPS
            return np.zeros((n, 2, 0)), reach, nowhere, everywhere
        w1 = turning[0].direction
        a = angle_between(wanted, w1)
        singular = np.minimum(a, np.pi - a) < SINGULAR_EPS
        if len(turning) == 1:
            reach = np.abs(a - angle_between(self.tool, w1)) <= REACH_EPS
            angle = turning[0].sign * _turn(w1, self.tool, wanted)
            return np.repeat(angle[:, None, None], 2, axis=1), reach, singular, everywhere
        w2 = turning[1].direction
        b, c = float(angle_between(w1, w2)), float(angle_between(w2, self.tool))
        for what, sine in (("rotary axes are parallel", math.sin(b)),
                           (f"{turning[1].name} only spins the tool", math.sin(c))):  # fmt: skip
            if sine < PARALLEL_EPS:
                raise KinematicsError(f"{self.chain}: {what}, orientations cannot be solved")
        half = 0.5 * (a + b + c)
        gaps = np.stack([half - a, half - b, half - c, np.pi - half], axis=1)
        reach = gaps.min(axis=1) >= -0.5 * REACH_EPS
        top, side_b, side_c, rest = np.sin(np.clip(gaps, 0.0, np.pi)).T
        # azimuth of z about w1, from the plane of w1 and w2
        psi = 2.0 * np.arctan2(np.sqrt(top * side_b), np.sqrt(rest * side_c))
        boundary = singular | (np.minimum(psi, np.pi - psi) < SINGULAR_EPS)
        across = np.cross(w1, w2) / math.sin(b)
        level = np.cross(across, w1)
        azimuth = np.arctan2(wanted @ across, wanted @ level)
        angles = np.empty((n, 2, 2))
        for branch, s in ((0, 1.0), (1, -1.0)):
            around = np.cos(psi)[:, None] * level + s * np.sin(psi)[:, None] * across
            z = np.cos(a)[:, None] * w1 + np.sin(a)[:, None] * around
            angles[:, branch, 0] = turning[0].sign * _wrapped(azimuth - s * psi)
            angles[:, branch, 1] = turning[1].sign * _turn(w2, self.tool, z)
        return angles, reach, singular, boundary


def _advance(axis: Axis, q: Floats, turn: Floats, origin: Floats) -> tuple[Floats, Floats]:
    """Frame behind a joint, from the frame before it."""
    if not axis.is_rotary:
        return turn, origin + (axis.sign * q)[..., None] * (turn @ axis.direction)
    further = turn @ rotation(axis.direction, axis.sign * q)
    return further, origin + (turn - further) @ axis.point


def _turn(w: Floats, start: Floats, end: Floats) -> Floats:
    """(n,) rad about w that takes `start` (3,) to `end` (n, 3), as seen along w."""
    from_ = start - (start @ w) * w
    to = end - (end @ w)[:, None] * w
    return np.asarray(np.arctan2(np.cross(from_, to) @ w, to @ from_))


def _wrapped(angle: Floats) -> Floats:
    """The same angle in [-pi, pi]."""
    return np.asarray(angle - 2 * np.pi * np.round(angle / (2 * np.pi)))
