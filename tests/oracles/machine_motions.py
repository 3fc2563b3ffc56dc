"""Motions of a five-axis machine between two joint positions, written with the joints at every time.

`vmachining.sweep.Turn` and `vmachining.machine.tcp_block_peaks` say the same of many blocks and without the chain.

J  `JointMotion`: every joint linear. The tip leaves the straight line.
R  `TcpMotion(..., orientation="rotary")`: tip straight, rotary joints linear (tool-centre-point control).
V  `TcpMotion(..., orientation="vector")`: tip straight, tool axis on the great circle at constant rate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, rows
from vmachining.errors import KinematicsError
from vmachining.geometry.rotation import angle_between, great_circle
from vmachining.machine import Machine, follow
from vmachining.machine.chain import Rates

GAUSS = np.polynomial.legendre.leggauss(16)
SAMPLES = 33
RANK = 1e-12
"""Relative size of a singular value that is rounding; a tool 1e-12 rad from the pole is in it."""
MISSED = 1e-9
"""Relative residual of a system that has no solution."""


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
            raise KinematicsError(f"orientation {orientation!r}: expected rotary or vector")
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


def _joints(machine: Machine, value: ArrayLike, name: str) -> Floats:
    try:
        return rows(value, len(machine.axes), name=name)
    except ValueError as exc:
        raise KinematicsError(f"machine {machine.name}: {exc}") from exc


def tcp_peaks(motion: TcpMotion, *, samples: int = SAMPLES) -> tuple[Floats, Floats]:
    """max|q'| and max|q''| of every joint of a tool-centre-point block, each (m,), per unit of t.

    The derivatives are exact (the chain is solved for the joint rates), their maxima are sampled. inf where
    the tool passes a singularity.

    Raises
    ------
    KinematicsError
        A point that the machine cannot reach.
    """
    machine = motion.machine
    t = np.union1d(np.linspace(0.0, 1.0, samples), _nearest_to_pole(motion))
    q = motion.joints(t)
    turning, slides = list(machine.rotary), list(machine.slides)
    dq, ddq = np.zeros_like(q), np.zeros_like(q)
    if motion.orientation == "rotary":
        dq[:, turning] = (motion.last - motion.first)[turning]
    elif turning:
        columns = [machine.rates(q, np.eye(len(machine.axes))[i]).axis_rate for i in turning]
        spread = np.stack(columns, axis=-1)
        dq[:, turning] = _solved(spread, motion.axis_rate(t))
        turning_at = np.where(np.isfinite(dq), dq, 0.0)
        rest = motion.axis_acceleration(t) - machine.rates(q, turning_at).axis_acceleration
        ddq[:, turning] = _solved(spread, rest)
    known = np.isfinite(dq).all(axis=1) & np.isfinite(ddq).all(axis=1)
    dq[~known], ddq[~known] = 0.0, 0.0
    jacobian = np.stack([machine.rates(q, np.eye(len(machine.axes))[i]).velocity for i in slides], axis=-1)
    dq[:, slides] = _solved(jacobian, motion.velocity(t) - machine.rates(q, dq).velocity)
    # with the joints at dq the tip has this acceleration; slides and rotary accelerations must cancel it
    lack = -machine.rates(q, dq).acceleration - machine.rates(q, ddq).velocity
    ddq[:, slides] = _solved(jacobian, lack)
    dq[~known], ddq[~known] = np.inf, np.inf
    return np.abs(dq).max(axis=0), np.abs(ddq).max(axis=0)


def _nearest_to_pole(motion: TcpMotion) -> list[float]:
    """Parameters at which the great circle passes closest to the first rotary axis, where joints are fastest."""
    machine = motion.machine
    if motion.orientation == "rotary" or not machine.rotary or motion.rotation == 0.0:
        return []
    pole = machine.work[:3, :3].T @ machine.axes[machine.rotary[0]].direction
    u, across = motion.axis(0.0), motion.axis_rate(0.0) / motion.rotation
    angle = np.arctan2(pole @ across, pole @ u) + np.pi * np.array([-1, 0, 1])
    return [float(t) for t in angle / motion.rotation if 0.0 < t < 1.0]


def _solved(matrix: Floats, right: Floats) -> Floats:
    """Solutions (n, k) of (n, 3, k) systems; inf where none exists. A free joint stays where it is."""
    out = (np.linalg.pinv(matrix, rcond=RANK) @ right[..., None])[..., 0]
    missed = np.linalg.norm((matrix @ out[..., None])[..., 0] - right, axis=-1)
    out[missed > MISSED * (1.0 + np.linalg.norm(right, axis=-1))] = np.inf
    return np.asarray(out)
