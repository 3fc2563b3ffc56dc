"""One solution out of many for a whole path: fewest rewinds, then least turning, and where an axis must swing round."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Bools, Floats, Ints, rows
from vmachining.errors import KinematicsError
from vmachining.geometry.rotation import angle_between
from vmachining.machine import _kernels
from vmachining.machine.chain import Machine, Solutions

SUM_WEIGHT = 1e-6
"""Weight of the sum of changes against the largest one: breaks ties, decides nothing else."""

JUMP = np.radians(30.0)
"""rad; smaller turns of one block are not jumps, whatever the tool does."""

JUMP_RATIO = 5.0
"""A turn this many times the turn of the tool is a jump: the tool is within 11 degrees of the rotary axis."""

HARD = 2**31
"""Price of a jump under feed; one in a rapid costs 1."""

ROOM = 64
"""States of a pose that are kept: all of travels up to nine turns and 16 more."""

LIMIT_SLACK = 1e-9
"""mm or rad; a solution this far outside a travel is on its end, rounded."""


class Jump(NamedTuple):
    """A block in which a rotary axis turns far more than the tool.

    pose : the block ends at this pose (and starts at the one before). name : the rotary axis.
    turn : rad, signed, of the rotary axis. tool : rad, of the tool axis.
    kind : "rewind" if the axis turns back by whole turns because its travel ends, else "singular".
    """

    pose: int
    name: str
    turn: float
    tool: float
    kind: str


@dataclass(frozen=True, slots=True, eq=False)
class JointPath:
    """Joints along a path of n poses.

    joints : (n, m) mm and rad, rotary values unwound (continuous where travel permits).
    branch : (n,) 0 or 1. singular : (n,) the first rotary axis was free and kept its value.
    jumps : blocks to look at.
    """

    joints: Floats
    branch: Ints
    singular: Bools
    jumps: tuple[Jump, ...]


def follow(
    machine: Machine,
    tip: ArrayLike,
    axis: ArrayLike,
    *,
    start: ArrayLike | None = None,
    prefer: int = 1,
    easy: ArrayLike | None = None,
) -> JointPath:
    """Joints for poses in order: over the whole path the fewest jumps, of those the least turning.

    Dynamic programming: a state is a branch with the turns of its rotary axes inside their travels. A block costs its jump,
    see `Jump`, and then the largest turn of a rotary axis (equal ones are distinguished by the sum of the turns). Where the
    tool is parallel to the first rotary axis that axis keeps its value; poses like that at the start take the value that
    the first other pose needs. Of travels above nine turns nine evenly spaced turns are tried where a path begins and
    after a jump.

    tip : (n, 3) mm; axis : (n, 3); workpiece coordinates.
    start : (m,) joints before the first pose; without it the path begins at any turn of any branch.
    prefer : without `start`, the wanted sign (+1, -1) of the last rotary axis at the first pose, or 0 for any.
    easy : (n,) poses reached by a rapid, where a jump does no harm: the fewest other jumps come first.
    Raises KinematicsError: A pose out of reach, in a slide singularity, or outside the travels; names pose and reason.
    """
    found = machine.inverse(tip, axis)
    n, m = len(found.reachable), len(machine.axes)
    turning, slides = list(machine.rotary), list(machine.slides)
    limits = machine.limits + [[-LIMIT_SLACK], [LIMIT_SLACK]]
    if not found.reachable.all():
        raise _refusal(machine, found, int(np.flatnonzero(~found.reachable)[0]))
    before = np.zeros(m)
    if start is not None:
        before = np.array(rows(start, m, name="start"))
    elif prefer not in (-1, 0, 1):
        raise KinematicsError(f"prefer is {prefer}, expected -1, 0 or 1")
    with np.errstate(invalid="ignore"):
        places, (low, high) = found.joints[..., slides], limits[:, slides]
        inside = (places >= low) & (places <= high)
    given = np.isfinite(found.joints[..., 0])
    # slides of a free axis are not known yet
    allowed = given & (inside.all(axis=2) | found.singular[:, None])
    angles, ends = np.zeros((n, 2, 2)), np.array([[-np.inf] * 2, [np.inf] * 2])
    angles[..., : len(turning)] = np.where(given[..., None], found.joints[..., turning], 0.0)
    ends[:, : len(turning)] = limits[:, turning]
    first = np.zeros(2)
    first[: len(turning)] = before[turning]
    # at the start a free axis is where the first pose that needs it has it
    held = 0 if start is not None or found.singular.all() else int(np.argmin(found.singular))
    u = np.asarray(axis, dtype=np.float64).reshape(-1, 3)
    tool = np.zeros(n)
    tool[1:] = angle_between(u[:-1], u[1:])
    if n and start is not None:
        tool[0] = float(angle_between(machine.forward(before).axis, u[0]))
    price = np.full(n, HARD, dtype=np.int64)
    if easy is not None:
        price[np.asarray(easy, dtype=np.bool_)] = 1
    with np.errstate(invalid="ignore"):
        wide = np.where(np.isfinite(ends).all(axis=0), np.ceil((ends[1] - ends[0]) / np.pi / 2) + 1, 1)
    room = int(min(2 * wide.prod(), ROOM))
    out, branch = np.zeros((n, 2)), np.zeros(n, dtype=np.int64)
    failed = _kernels.least_jumps(
        angles[held:], allowed[held:], found.singular[held:].copy(), ends[0].copy(), ends[1].copy(), tool[held:],
        price[held:], first, start is not None, 0 if len(turning) < 2 else prefer, JUMP, JUMP_RATIO, SUM_WEIGHT, room,
        out[held:], branch[held:],
    )  # fmt: skip
    if failed >= 0:
        raise _outside(machine, found.joints[held + failed], held + failed)
    for k in range(held - 1, -1, -1):
        near = _kernels.nearest_turn(angles[k, 0, 1], out[k + 1, 1], ends[0, 1], ends[1, 1])
        if np.isnan(near):
            raise _outside(machine, found.joints[k], k)
        out[k] = out[k + 1, 0], near
    q = np.array(found.joints[np.arange(n), branch])
    q[:, turning] = out[:, : len(turning)]
    kept = np.flatnonzero(found.singular)
    if len(kept):
        q[kept], _ = machine.place(q[kept], rows(tip, -1, 3, name="tip")[kept])
        wrong = ~np.isfinite(q).all(axis=1)
        with np.errstate(invalid="ignore"):
            wrong |= (q < limits[0]).any(axis=1) | (q > limits[1]).any(axis=1)
        if wrong.any():
            k = int(np.flatnonzero(wrong)[0])
            raise _outside(machine, q[k : k + 1], k)
    for array in (q, branch):
        array.setflags(write=False)
    return JointPath(q, branch, found.singular, jumps(machine, q))


def jumps(machine: Machine, joints: ArrayLike) -> tuple[Jump, ...]:
    """Blocks of a joint path (n, m) in which a rotary axis turns far more than the tool does."""
    q = np.asarray(joints, dtype=np.float64)
    turning = list(machine.rotary)
    if len(q) < 2 or not turning:
        return ()
    axis = machine.forward(q).axis
    tool = angle_between(axis[:-1], axis[1:])
    turn = np.diff(q[:, turning], axis=0)
    large = (np.abs(turn) > JUMP) & (np.abs(turn) > JUMP_RATIO * tool[:, None])
    out = []
    for block, column in np.argwhere(large):
        size = float(turn[block, column])
        kind = "rewind" if abs(size) > np.pi else "singular"
        out.append(Jump(int(block) + 1, machine.names[turning[column]], size, float(tool[block]), kind))
    return tuple(out)


def _refusal(machine: Machine, found: Solutions, k: int) -> KinematicsError:
    if np.isfinite(found.slide_det[k]).any():
        return KinematicsError(f"pose {k}: two slides are parallel there (slide singularity)")
    return KinematicsError(
        f"pose {k}: the rotary axes {', '.join(machine.names[i] for i in machine.rotary)} cannot turn the tool there"
        if machine.rotary
        else f"pose {k}: machine {machine.name} has no rotary axis to tilt the tool"
    )


def _outside(machine: Machine, joints: Floats, k: int) -> KinematicsError:
    """Which limits forbid the solutions (s, m) of pose k."""
    reasons = []
    for q in joints[np.isfinite(joints).all(axis=1)]:
        for axis, value in zip(machine.axes, q, strict=True):
            best = _kernels.nearest_turn(value, value, axis.lower, axis.upper) if axis.is_rotary else value
            if np.isnan(best) or not axis.lower <= best <= axis.upper:
                reasons.append(
                    f"{axis.name} {axis.shown(value):g} {axis.unit} outside "
                    f"{axis.shown(axis.lower):g} to {axis.shown(axis.upper):g}"
                )
    return KinematicsError(
        f"pose {k} is outside the travels: {'; '.join(dict.fromkeys(reasons)) or 'all solutions'}"
    )
