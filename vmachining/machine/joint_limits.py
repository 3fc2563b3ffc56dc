"""What the joints of a five-axis machine allow: travels, and the tip feed at which the first joint is at its limit.

Symbols: q joints, t parameter of a block in [0, 1], L length of its tip path, U tip feed, v_i and a_i largest
speed and acceleration of joint i. At constant tip feed t runs at U / L, so

    |q_i'| U / L <= v_i    and    |q_i''| (U / L)^2 <= a_i
    U = L min_i min( v_i / max|q_i'|, sqrt(a_i / max|q_i''|) )                                     (5)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, rows
from vmachining.errors import KinematicsError
from vmachining.machine.chain import Machine
from vmachining.machine.motion import JointMotion, TcpMotion, tip_lengths

__all__ = [
    "Overrun",
    "joint_accelerations",
    "joint_caps",
    "joint_peaks",
    "least_times",
    "tcp_caps",
    "tcp_peaks",
    "travel_overruns",
]

SAMPLES = 33
RANK = 1e-12
"""Relative size of a singular value that is rounding; a tool 1e-12 rad from the pole is in it."""
MISSED = 1e-9
"""Relative residual of a system that has no solution."""
MM_MIN = 60.0


class Overrun(NamedTuple):
    """A joint that leaves its travel.

    name : of the joint. pose : first pose outside. worst : farthest value, mm or degrees; limit : the end of
    the travel on that side, same unit. poses : how many are outside on that side.
    """

    name: str
    pose: int
    worst: float
    limit: float
    poses: int


def travel_overruns(machine: Machine, joints: ArrayLike) -> tuple[Overrun, ...]:
    """Every end of travel that the joints (n, m) of a path pass. Linear joints pass none in between."""
    q = rows(joints, -1, len(machine.axes), name="joints")
    out = []
    for axis, values in zip(machine.axes, q.T, strict=True):
        for limit, beyond in ((axis.lower, values < axis.lower), (axis.upper, values > axis.upper)):
            if beyond.any():
                worst = values[beyond].min() if limit == axis.lower else values[beyond].max()
                out.append(
                    Overrun(axis.name, int(beyond.argmax()), axis.shown(float(worst)), axis.shown(limit),
                            int(beyond.sum()))
                )  # fmt: skip
    return tuple(out)


def least_times(machine: Machine, start: ArrayLike, end: ArrayLike) -> Floats:
    """(n,) s that joint-linear blocks last at least, by the speeds of the joints: max_i |dq_i| / v_i.

    start, end : (n, m).
    """
    moved = np.abs(
        rows(end, -1, len(machine.axes), name="end") - rows(start, -1, len(machine.axes), name="start")
    )
    speed = np.array([axis.max_speed for axis in machine.axes])
    return np.asarray((moved / speed).max(axis=1, initial=0.0))


def joint_caps(
    machine: Machine, start: ArrayLike, end: ArrayLike, length_mm: ArrayLike | None = None
) -> Floats:
    """Largest feed of joint-linear blocks, mm/min: U = L / max_i(|dq_i| / v_i).

    Parameters
    ----------
    start, end : (n, m).
    length_mm : (n,) length that the control counts for F; default the true tip path.

    Returns
    -------
    (n,) mm/min; inf where nothing limits, and for a block without length.
    """
    seconds = least_times(machine, start, end)
    given = tip_lengths(machine, start, end) if length_mm is None else length_mm
    length = rows(given, len(seconds), name="length_mm")
    usable = (seconds > 0) & (length > 0)
    return np.asarray(MM_MIN * np.divide(length, seconds, out=np.full(len(length), np.inf), where=usable))


def joint_accelerations(
    machine: Machine, start: ArrayLike, end: ArrayLike, length_mm: ArrayLike | None = None
) -> Floats:
    """Largest acceleration along joint-linear blocks, mm/s^2: L min_i(a_i / |dq_i|).

    Parameters and the treatment of length as in `joint_caps`; for `block_times`. inf where nothing limits, and
    for a block without length: give its `least_times` as a pause.
    """
    q0, q1 = (rows(v, -1, len(machine.axes), name=n) for v, n in ((start, "start"), (end, "end")))
    limit = np.array([axis.max_acceleration for axis in machine.axes])
    given = tip_lengths(machine, q0, q1) if length_mm is None else length_mm
    length = rows(given, len(q0), name="length_mm")
    share = (np.abs(q1 - q0) / limit).max(axis=1, initial=0.0)
    usable = (share > 0) & (length > 0)
    return np.asarray(np.divide(length, share, out=np.full(len(length), np.inf), where=usable))


def joint_peaks(motion: JointMotion) -> tuple[Floats, Floats]:
    """max|q'| and max|q''| of every joint of a joint-linear block, each (m,), per unit of t."""
    return np.abs(motion.last - motion.first), np.zeros(len(motion.first))


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


def tcp_caps(
    machine: Machine, start: ArrayLike, end: ArrayLike, *, orientation: str = "rotary", samples: int = SAMPLES
) -> Floats:
    """Largest tip feed of tool-centre-point blocks by speeds and accelerations of the joints, eq. (5), mm/min.

    start, end : (n, m) joints; orientation as in `TcpMotion`.

    Returns
    -------
    (n,) mm/min; inf where nothing limits and for a block without length; 0 where the block passes a
    singularity.
    """
    q0, q1 = (rows(v, -1, len(machine.axes), name=n) for v, n in ((start, "start"), (end, "end")))
    if len(q0) != len(q1):
        raise KinematicsError(f"{len(q0)} starts and {len(q1)} ends")
    speed = np.array([axis.max_speed for axis in machine.axes])
    acceleration = np.array([axis.max_acceleration for axis in machine.axes])
    out = np.full(len(q0), np.inf)
    for k in range(len(q0)):
        motion = TcpMotion(machine, q0[k], q1[k], orientation=orientation)
        if (length := motion.length) == 0.0:
            continue
        first, second = tcp_peaks(motion, samples=samples)
        if np.isinf(first).any():
            out[k] = 0.0
            continue
        with np.errstate(divide="ignore", invalid="ignore"):
            # a joint at rest, or one without a limit, limits nothing
            by_speed = np.where(first > 0, speed / first, np.inf)
            by_force = np.where(second > 0, acceleration / second, np.inf)
        out[k] = MM_MIN * length * min(float(by_speed.min()), float(np.sqrt(by_force.min())))
    return out


def _solved(matrix: Floats, right: Floats) -> Floats:
    """Solutions (n, k) of (n, 3, k) systems; inf where there is none. A free joint stays where it is."""
    out = (np.linalg.pinv(matrix, rcond=RANK) @ right[..., None])[..., 0]
    missed = np.linalg.norm((matrix @ out[..., None])[..., 0] - right, axis=-1)
    out[missed > MISSED * (1.0 + np.linalg.norm(right, axis=-1))] = np.inf
    return np.asarray(out)


def _nearest_to_pole(motion: TcpMotion) -> list[float]:
    """Parameters at which the great circle passes closest to the first rotary axis, where joints are fastest."""
    machine = motion.machine
    if motion.orientation == "rotary" or not machine.rotary or motion.rotation == 0.0:
        return []
    pole = machine.work[:3, :3].T @ machine.axes[machine.rotary[0]].direction
    u, across = motion.axis(0.0), motion.axis_rate(0.0) / motion.rotation
    angle = np.arctan2(pole @ across, pole @ u) + np.pi * np.array([-1, 0, 1])
    return [float(t) for t in angle / motion.rotation if 0.0 < t < 1.0]
