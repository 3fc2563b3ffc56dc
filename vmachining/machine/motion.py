"""The motions a five-axis control drives between two joint positions, as functions of t in [0, 1].

J  `JointMotion`: every joint linear. The tip leaves the straight line.
R  `TcpMotion(..., orientation="rotary")`: tip straight, rotary joints linear (tool-centre-point control).
V  `TcpMotion(..., orientation="vector")`: tip straight, tool axis on the great circle at constant rate.

Beside `vmachining.sweep.Turn`, which a sweep is made of, these stay for what lies below the sweeps and needs the joints at
every time: how far a control leaves the straight line (`deviation.py`) and what its joints allow (`joint_limits.py`);
`tests/machine/test_machine_sweeps.py` holds both to one another.

All have position, axis and their derivatives, so that a sweep needs no machine: `position`, `axis`, `velocity`,
`axis_rate`, `acceleration`, `axis_acceleration`, `start`, `end`, `length`, `split`, `tip_bounds`, `rotation`,
`is_upright`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, rows
from vmachining.errors import KinematicsError
from vmachining.geometry.rotation import angle_between, great_circle
from vmachining.machine.branches import follow
from vmachining.machine.chain import Machine, Rates

__all__ = ["JointMotion", "TcpMotion", "derivative_bounds", "tip_lengths"]

GAUSS = np.polynomial.legendre.leggauss(16)
UPRIGHT_EPS = 1e-12
"""Largest component of the axis across z that is rounding."""
SAME_JOINTS = 1e-6
"""mm or rad; what the inverse returns for a pose differs by less from the joints it was made of."""
HARMONICS = 3
"""Each rotary joint multiplies the number of harmonics of the axis by this: w becomes w, w + r and w - r."""


@dataclass(frozen=True, slots=True, eq=False)
class JointMotion:
    """All joints linear, q(t) = (1 - t) first + t last. first, last : (m,) mm and rad.

    Raises
    ------
    KinematicsError
        Joints of the wrong number or not finite.
    """

    machine: Machine
    first: Floats
    last: Floats

    def __init__(self, machine: Machine, first: ArrayLike, last: ArrayLike) -> None:
        object.__setattr__(self, "machine", machine)
        for name, value in (("first", first), ("last", last)):
            object.__setattr__(self, name, _joints(machine, value, name))

    def joints(self, t: ArrayLike) -> Floats:
        """(..., m) mm and rad; the ends are hit exactly."""
        s = np.asarray(t, dtype=np.float64)[..., None]
        return np.asarray((1.0 - s) * self.first + s * self.last)

    def rates(self, t: ArrayLike) -> Rates:
        """Everything below at once."""
        return self.machine.rates(self.joints(t), self.last - self.first)

    def position(self, t: ArrayLike) -> Floats:
        """(..., 3) mm, tip."""
        return self.machine.forward(self.joints(t)).tip

    def axis(self, t: ArrayLike) -> Floats:
        """(..., 3) unit."""
        return self.machine.forward(self.joints(t)).axis

    def velocity(self, t: ArrayLike) -> Floats:
        """(..., 3) mm per unit of t."""
        return self.rates(t).velocity

    def axis_rate(self, t: ArrayLike) -> Floats:
        """(..., 3) per unit of t."""
        return self.rates(t).axis_rate

    def acceleration(self, t: ArrayLike) -> Floats:
        """(..., 3) mm per unit of t squared."""
        return self.rates(t).acceleration

    def axis_acceleration(self, t: ArrayLike) -> Floats:
        """(..., 3) per unit of t squared."""
        return self.rates(t).axis_acceleration

    @property
    def start(self) -> Floats:
        """(3,) tip at t = 0."""
        return self.position(0.0)

    @property
    def end(self) -> Floats:
        """(3,) tip at t = 1."""
        return self.position(1.0)

    @property
    def length(self) -> float:
        """mm of the tip path; Gauss quadrature, 16 points for each half radian the rotary joints turn."""
        return float(tip_lengths(self.machine, self.first[None], self.last[None])[0])

    @property
    def rotation(self) -> float:
        """rad, sum of the turns of the rotary joints: an upper bound of what the axis sweeps."""
        return float(np.abs(self.last - self.first)[list(self.machine.rotary)].sum())

    @property
    def tip_bounds(self) -> Floats:
        """(2, 3): box that contains the tip path; wider than needed by at most the bulge between samples."""
        count = 16 * (math.ceil(self.rotation) + 1)
        points = self.position(np.linspace(0.0, 1.0, count + 1))
        slack = float(derivative_bounds(self.machine, self.first, self.last)[0]) / (8 * count**2)
        return np.stack([points.min(axis=0) - slack, points.max(axis=0) + slack])

    @property
    def is_upright(self) -> bool:
        """Whether the tool axis is +z throughout."""
        return _is_upright(self)

    def split(self, fractions: Sequence[float]) -> list[JointMotion]:
        """Pieces between consecutive fractions (0 and 1 are added)."""
        joints = self.joints([0.0, *fractions, 1.0])
        return [JointMotion(self.machine, a, b) for a, b in pairwise(joints)]


@dataclass(frozen=True, slots=True, eq=False)
class TcpMotion:
    """Tip on the straight line at constant speed, between the poses of two joint positions.

    orientation : "rotary" (rotary joints linear) or "vector" (great circle).

    Raises
    ------
    KinematicsError
        Joints of the wrong number, another orientation, opposite tool axes with "vector".
    """

    machine: Machine
    first: Floats
    last: Floats
    orientation: str

    def __init__(
        self, machine: Machine, first: ArrayLike, last: ArrayLike, *, orientation: str = "rotary"
    ) -> None:
        if orientation not in ("rotary", "vector"):
            raise KinematicsError(f"orientation {orientation!r}: want rotary or vector")
        object.__setattr__(self, "machine", machine)
        object.__setattr__(self, "orientation", orientation)
        for name, value in (("first", first), ("last", last)):
            object.__setattr__(self, name, _joints(machine, value, name))
        ends = machine.forward([self.first, self.last]).axis
        if orientation == "vector" and np.pi - angle_between(*ends) < 1e-9:
            raise KinematicsError("the tool turns by 180 degrees: no great circle is the shortest")

    def joints(self, t: ArrayLike) -> Floats:
        """(k, m) joints at increasing parameters (k,); "vector" follows the branch of `first`.

        Raises
        ------
        KinematicsError
            A point that the machine cannot reach, or a slide singularity.
        """
        s = rows(t, -1, name="t")
        if self.orientation == "vector":
            return np.array(follow(self.machine, self.position(s), self.axis(s), start=self.first).joints)
        q, _ = self.machine.place(self._rotary(s), self.position(s))
        if not np.isfinite(q).all():
            raise KinematicsError("two slides are parallel on the way (slide singularity)")
        return q

    def whole(self, t: ArrayLike) -> Floats:
        """`joints` at parameters (k,) that run from 0 to 1, with both ends exactly as given.

        Raises
        ------
        KinematicsError
            As `joints`, and where the great circle leads to other joints of the same pose than `last`.
        """
        joints = self.joints(t)
        # the inverse returns the ends to rounding; the block must meet its neighbours exactly
        for k, own in ((0, self.first), (-1, self.last)):
            if np.abs(joints[k] - own).max() > SAME_JOINTS:
                raise KinematicsError("the great circle ends in another joint position than asked for",
                                      remedy="take the ends from `follow`")  # fmt: skip
            joints[k] = own
        return joints

    def position(self, t: ArrayLike) -> Floats:
        """(..., 3) mm, tip; the ends are hit exactly."""
        s = np.asarray(t, dtype=np.float64)[..., None]
        return np.asarray((1.0 - s) * self.start + s * self.end)

    def axis(self, t: ArrayLike) -> Floats:
        """(..., 3) unit."""
        if self.orientation == "rotary":
            return self.machine.forward(self._rotary(t)).axis
        return great_circle(*self._ends(), t)

    def velocity(self, t: ArrayLike) -> Floats:
        """(..., 3) mm per unit of t, constant."""
        return np.broadcast_to(self.end - self.start, (*np.shape(t), 3)).copy()

    def axis_rate(self, t: ArrayLike) -> Floats:
        """(..., 3) per unit of t."""
        if self.orientation == "rotary":
            return self.machine.rates(self._rotary(t), self._speeds()).axis_rate
        u, v = self._ends()
        normal = np.cross(u, v)
        size = float(np.linalg.norm(normal))
        turn = normal / size * self.rotation if size > 0 else np.zeros(3)
        return np.cross(turn, self.axis(t))

    def acceleration(self, t: ArrayLike) -> Floats:
        """(..., 3) zero."""
        return np.zeros((*np.shape(t), 3))

    def axis_acceleration(self, t: ArrayLike) -> Floats:
        """(..., 3) per unit of t squared."""
        if self.orientation == "rotary":
            return self.machine.rates(self._rotary(t), self._speeds()).axis_acceleration
        return -(self.rotation**2) * self.axis(t)

    @property
    def start(self) -> Floats:
        """(3,) tip at t = 0."""
        return self.machine.forward(self.first).tip

    @property
    def end(self) -> Floats:
        """(3,) tip at t = 1."""
        return self.machine.forward(self.last).tip

    @property
    def length(self) -> float:
        """mm."""
        return float(np.linalg.norm(self.end - self.start))

    @property
    def rotation(self) -> float:
        """rad; an upper bound of what the axis sweeps ("vector": exactly that)."""
        if self.orientation == "vector":
            return float(angle_between(*self._ends()))
        return float(np.abs(self._speeds()).sum())

    @property
    def tip_bounds(self) -> Floats:
        """(2, 3): box of the tip path."""
        return np.stack([np.minimum(self.start, self.end), np.maximum(self.start, self.end)])

    @property
    def is_upright(self) -> bool:
        """Whether the tool axis is +z throughout."""
        return _is_upright(self)

    def split(self, fractions: Sequence[float]) -> list[TcpMotion]:
        """Pieces between consecutive fractions (0 and 1 are added).

        Raises
        ------
        KinematicsError
            As `whole`.
        """
        joints = self.whole([0.0, *fractions, 1.0])
        return [
            TcpMotion(self.machine, a, b, orientation=self.orientation) for a, b in pairwise(joints)
        ]  # fmt: skip

    def _rotary(self, t: ArrayLike) -> Floats:
        """(..., m) joints with linear rotary values; slides without meaning."""
        s = np.asarray(t, dtype=np.float64)[..., None]
        return np.asarray((1.0 - s) * self.first + s * self.last)

    def _speeds(self) -> Floats:
        """(m,) of the rotary joints; slides zero."""
        out = self.last - self.first
        out[list(self.machine.slides)] = 0.0
        return out

    def _ends(self) -> tuple[Floats, Floats]:
        u, v = self.machine.forward([self.first, self.last]).axis
        return u, v


def _is_upright(motion: JointMotion | TcpMotion) -> bool:
    """Whether the tool axis is +z throughout.

    The axis is a sum of n harmonics of t whose frequencies lie within `rotation` of zero. Equal steps of less than
    half a period of the fastest tell all of them apart, and what vanishes at n such points vanishes.
    """
    steps = HARMONICS ** len(motion.machine.rotary) * (1 + math.ceil(motion.rotation / np.pi))
    return bool(np.abs(motion.axis(np.linspace(0.0, 1.0, steps + 1)) - (0, 0, 1)).max() < UPRIGHT_EPS)


def tip_lengths(machine: Machine, start: ArrayLike, end: ArrayLike) -> Floats:
    """(n,) mm of the tip paths of joint-linear blocks (n, m).

    Gauss quadrature of the speed, 16 points for each half radian that the rotary joints turn.
    """
    q0, q1 = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    turned = np.abs(q1 - q0)[:, list(machine.rotary)].sum(axis=1)
    pieces = np.ceil(2.0 * turned).astype(np.int64) + 1
    out = np.zeros(len(q0))
    node, weight = GAUSS
    for count in np.unique(pieces):
        k = np.flatnonzero(pieces == count)
        t = ((np.arange(count)[:, None] + 0.5 * (node + 1.0)) / count).reshape(-1, 1)
        speed = (q1[k] - q0[k])[:, None, :]
        velocity = machine.rates(q0[k][:, None, :] + t * speed, speed).velocity
        out[k] = np.linalg.norm(velocity, axis=-1) @ np.tile(weight, count) / (2 * count)
    return out


def derivative_bounds(machine: Machine, start: ArrayLike, end: ArrayLike) -> Floats:
    """Bounds of the norms of the second, third and fourth derivative of the tip in a joint-linear block.

    The tip is a sum of vectors r_j(t), linear in t, each turned by the first j rotary joints, R_j(t) r_j(t).
    With W_j the sum of their turns, |d^k R_j / dt^k| <= W_j^k, so

        |d^k p / dt^k| <= sum_j W_j^k max|r_j| + k W_j^(k-1) |r_j'|

    Parameters
    ----------
    start, end : (..., m). Returns (..., 3).
    """
    q0, q1 = np.broadcast_arrays(np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64))
    shape = q0.shape[:-1]
    before, after, turned = np.zeros((*shape, 3)), np.zeros((*shape, 3)), np.zeros(shape)
    out = np.zeros((*shape, 3))
    k = np.array([2.0, 3.0, 4.0])

    def add() -> None:
        reach = np.maximum(np.linalg.norm(before, axis=-1), np.linalg.norm(after, axis=-1))[..., None]
        change = np.linalg.norm(after - before, axis=-1)[..., None]
        w = turned[..., None]
        out[...] += w**k * reach + k * w ** (k - 1.0) * change

    for i, axis in enumerate(machine.axes):
        if axis.is_rotary:
            before, after = before + axis.point, after + axis.point
            add()
            before, after = (np.broadcast_to(-axis.point, (*shape, 3)) for _ in range(2))
            turned = turned + np.abs(q1[..., i] - q0[..., i])
        else:
            before = before + axis.sign * q0[..., i, None] * axis.direction
            after = after + axis.sign * q1[..., i, None] * axis.direction
    before, after = before + machine.tip, after + machine.tip
    add()
    return out


def _joints(machine: Machine, value: ArrayLike, name: str) -> Floats:
    try:
        return rows(value, len(machine.axes), name=name)
    except ValueError as exc:
        raise KinematicsError(f"machine {machine.name}: {exc}") from exc
