"""Moves -> paths of the cutter: lines and arcs with an upright tool, `Turn` where the axis leans or turns.

| the program gives | path |
|---|---|
| X Y Z only | line or arc, tool along +z |
| tool axes (tables of poses, CL files) | tip straight, axis on the great circle between them |
| rotary words under tool-centre-point control (tables of poses with angles too) | tip straight, rotary joints linear |
| rotary words without it | all joints linear: the tip follows the bow that the chain makes of it |

Where the axis is +z throughout and the tip goes straight, the path is a plain line, so that nothing depends on
how many axes the machine has.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from functools import lru_cache
from typing import TypeAlias

import numpy as np

from vmachining.arrays import Floats
from vmachining.errors import KinematicsError, NCError, SweepError
from vmachining.geometry import Arc, Line, arc_between
from vmachining.machine import Machine, linear_peaks, peak_accelerations, peak_times, tcp_block_peaks
from vmachining.nc import Motion, Move, Program, decode_program, lex_line, split_lines
from vmachining.sweep import Pose, Turn
from vmachining.tolerance import LENGTH_EPS_MM

__all__ = [
    "CutterPath",
    "JointDemands",
    "end_axis",
    "joint_demands",
    "joint_feeds",
    "move_path",
    "moves",
    "settled",
]

CutterPath: TypeAlias = Line | Arc | Turn

UP = (0.0, 0.0, 1.0)
NORMAL = {"yz": 0, "zx": 1, "xy": 2}
IN_PLANE = {"yz": (1, 2), "zx": (2, 0), "xy": (0, 1)}
STILL = 1e-9
"""mm, and length of a unit vector, below which a difference is rounding."""
ARCS = (Motion.ARC_CW, Motion.ARC_CCW)


def move_path(move: Move, machine: Machine | None = None) -> CutterPath:
    """The path of the cutter; an arc stays an arc.

    Raises
    ------
    NCError
        An arc without a usable centre or with a leaning tool; rotary words without a machine that has such
        joints; a tool axis that is reversed.
    """
    if move.axis_end is None and move.rotary_deg is None and _is_plain(machine):
        return _arc(move) if move.motion in ARCS else Line(move.start, move.end)
    try:
        turn = _turn(move, machine)
    except (KinematicsError, SweepError) as exc:
        raise NCError(exc.message, line=move.line, remedy=exc.remedy) from exc
    if move.motion in ARCS:
        ends = np.abs([turn.start - move.start, turn.end - move.end]).max()
        if not turn.is_upright or ends > LENGTH_EPS_MM:
            raise NCError(
                "an arc with a leaning tool or on a turned table cannot be simulated",
                line=move.line,
                remedy="use short lines",
            )
        return _arc(move)
    return Line(turn.start, turn.end) if turn.is_upright and turn.is_straight else turn


def moves(path: CutterPath) -> bool:
    """Whether the cutter goes anywhere: a tip at rest may turn."""
    return path.length > LENGTH_EPS_MM or (isinstance(path, Turn) and not path.is_steady)


def end_axis(path: CutterPath) -> Floats:
    """(3,) unit tool axis at the end of a path."""
    return path.axis(1.0) if isinstance(path, Turn) else np.array(UP)


def _turn(move: Move, machine: Machine | None) -> Turn:
    if move.axis_end is not None:
        return Turn.great_circle(Pose(move.start, move.axis_start or UP), Pose(move.end, move.axis_end))
    first, last, chain = _joints(move, machine)
    screws, tip, axis = chain.screws()
    return Turn.joints(screws, first, last, tip_home=tip, axis_home=axis)


def _joints(move: Move, machine: Machine | None) -> tuple[Floats, Floats, Machine]:
    """Joints at both ends, and the chain in which they are linear."""
    angles = move.rotary_deg or {}
    if machine is None or not machine.rotary:
        words = " ".join(letter.upper() for letter in angles)
        raise NCError(
            f"rotary words ({words}) without a machine that has such axes",
            line=move.line,
            remedy='name it in the job: chain = "ac-table" or file = "machine.toml" under [machine]',
        )
    chain = _tip_centred(machine) if move.tcp else machine
    x, y, z = move.start
    first = chain.joints(degrees=True, x=x, y=y, z=z, **(move.rotary_start or {}))
    x, y, z = move.end
    return first, chain.joints(degrees=True, x=x, y=y, z=z, **angles), chain


@lru_cache(maxsize=8)
def _tip_centred(machine: Machine) -> Machine:
    """The chain in which blocks under tool-centre-point control are joint-linear."""
    return machine.tip_centred()


@lru_cache(maxsize=8)
def _is_plain(machine: Machine | None) -> bool:
    """Whether X Y Z alone are the tip of an upright tool while all rotary axes stand at zero."""
    if machine is None or not machine.rotary:
        return True
    where = np.eye(4, 3, k=-1)  # home, then one step along each slide
    pose = machine.forward(machine.joints(degrees=True, x=where[:, 0], y=where[:, 1], z=where[:, 2]))
    return bool(np.abs(pose.tip - where).max() < STILL and np.abs(pose.axis - UP).max() < STILL)


def settled(program: Program, machine: Machine | None) -> Program:
    """The program with the true start of every move before which tool-centre-point control was switched.

    Switching moves nothing, but from then on the same place has other coordinates. Words that are left out
    would keep coordinates of the old kind, so the first move behind has to be a rapid that names X, Y and Z.

    Raises
    ------
    NCError
        It is not, while the rotary axes are turned.
    """
    out = list(program.moves)
    lines: list[str] = []
    for k in range(1, len(out)):
        before, move = out[k - 1], out[k]
        if before.tcp == move.tcp or move.rotary_deg is None:
            continue
        tip = move_path(before, machine).position(1.0)
        if np.abs(move_path(move, machine).position(0.0) - tip).max() <= LENGTH_EPS_MM:
            continue
        lines = lines or list(split_lines(decode_program(program.data, program.name)))
        letters = {word.letter for word in lex_line(lines[move.line - 1]).words}
        if move.motion is not Motion.RAPID or not letters >= {"X", "Y", "Z"}:
            raise NCError(
                "tool-centre-point control was switched while the rotary axes are turned",
                file=program.name,
                line=move.line,
                remedy="go on with a rapid that names X, Y and Z",
            )
        start = tip
        if not move.tcp:
            assert machine is not None
            rotary = machine.joints(degrees=True, **(move.rotary_start or {}))
            placed = machine.named(machine.place(rotary, tip)[0])
            start = np.array([placed[name] for name in "XYZ"])
            if not np.isfinite(start).all():
                raise NCError("two slides are parallel here", file=program.name, line=move.line)
        x, y, z = start.tolist()
        out[k] = move._replace(start=(x, y, z))
    return dataclasses.replace(program, moves=tuple(out))


def _arc(move: Move) -> Arc:
    if move.center is None:
        raise NCError("an arc without a centre", line=move.line)
    center = list(move.start)
    for axis, value in zip(IN_PLANE[move.plane], move.center, strict=True):
        center[axis] = value
    try:
        return arc_between(
            move.start,
            move.end,
            center,
            NORMAL[move.plane],
            ccw=move.motion is Motion.ARC_CCW,
            turns=move.turns,
        )
    except ValueError as exc:
        raise NCError(str(exc), line=move.line) from exc


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class JointDemands:
    """What the joints say about moves, (n,) each.

    seconds : that a move lasts at least, 0 without rotary words. accelerations : mm/s^2 along its path; inf for
    none.
    """

    seconds: Floats
    accelerations: Floats


def joint_demands(moves: Sequence[Move], machine: Machine | None, lengths: Floats) -> JointDemands:
    """By speeds and accelerations of the joints, for moves with rotary words; lengths : (n,) mm, tip paths.

    Under tool-centre-point control the slides are where the chain needs them all along the move, and its fastest
    moment counts; where two slides are parallel on the way they are not looked at.
    """
    out = JointDemands(np.zeros(len(moves)), np.full(len(moves), np.inf))
    wanted = [k for k, move in enumerate(moves) if move.rotary_deg is not None]
    if machine is None or not machine.rotary or not wanted:
        return out
    first, last = (
        np.array(ends) for ends in zip(*(_joints(moves[k], machine)[:2] for k in wanted), strict=True)
    )
    centred = np.array([moves[k].tcp for k in wanted])
    peaks = linear_peaks(first, last)
    if centred.any():
        own = list(machine.rotary)
        ends = []
        for joints in (first[centred], last[centred]):
            q = np.zeros((len(joints), len(machine.axes)))
            q[:, own] = joints[:, 3:]
            placed = machine.place(q, joints[:, :3])[0]
            ends.append(np.where(np.isnan(placed), q, placed))
        inside = tcp_block_peaks(machine, *ends)
        for found, mine in ((inside.first, peaks.first), (inside.second, peaks.second)):
            mine[centred] = np.where(np.isfinite(found), found, 0.0)
    k = np.array(wanted)
    out.seconds[k] = peak_times(machine, peaks)
    out.accelerations[k] = peak_accelerations(machine, peaks, lengths[k])
    return out


def joint_feeds(lengths: Floats, seconds: Floats) -> Floats:
    """(n,) mm/min that the joints allow; inf where nothing limits."""
    limited = (seconds > 0) & (lengths > 0)
    return np.asarray(60.0 * np.divide(lengths, seconds, out=np.full(len(lengths), np.inf), where=limited))
