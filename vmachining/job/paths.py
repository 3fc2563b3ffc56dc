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
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Bools, Floats, Ints, rows
from vmachining.errors import KinematicsError, NCError, SweepError
from vmachining.geometry import Arc, Line, arc_between
from vmachining.machine import Machine, Peaks, linear_peaks, peak_accelerations, peak_times, tcp_block_peaks
from vmachining.nc import Motion, Move, Program, decode_program, lex_line, split_lines
from vmachining.sweep import Pose, Turn
from vmachining.tolerance import LENGTH_EPS_MM

CutterPath: TypeAlias = Line | Arc | Turn

UP = (0.0, 0.0, 1.0)
NORMAL = {"yz": 0, "zx": 1, "xy": 2}
IN_PLANE = {"yz": (1, 2), "zx": (2, 0), "xy": (0, 1)}
STILL = 1e-9
"""mm, and length of a unit vector, below which a difference is rounding."""
PIECES = 16
"""Of a block under tool-centre-point control, whose slides are faster in some parts than in others."""

ARCS = (Motion.ARC_CW, Motion.ARC_CCW)


def move_path(move: Move, machine: Machine | None = None) -> CutterPath:
    """The path of the cutter; an arc stays an arc.

    Raises NCError: An arc without a usable centre or with a leaning tool; rotary words without a machine that has such joints; a
        tool axis that is reversed.
    """
    if move.circle is not None:  # an arc in a tilted plane, less than a turn
        center, normal, start, end = (np.array(point) for point in (*move.circle, move.start, move.end))
        angle = _swept(start, end, center, normal)
        return _about(start, end, np.array(move.axis_end or UP), center, normal, angle)
    if move.axis_end is None and move.rotary_deg is None and _is_plain(machine):
        return _arc(move) if move.motion in ARCS else Line(move.start, move.end)
    try:
        turn = _turn(move, machine)
    except (KinematicsError, SweepError) as exc:
        raise NCError(exc.message, line=move.line, remedy=exc.remedy) from exc
    if move.motion in ARCS:
        ends = np.abs([turn.start - move.start, turn.end - move.end]).max()
        if not turn.is_upright or ends > LENGTH_EPS_MM:
            return _placed_arc(move, machine, turn)
        return _arc(move)
    return Line(turn.start, turn.end) if turn.is_upright and turn.is_straight else turn


class Paths:
    """Paths of moves in their order. A line is made when it is asked for, from rows of 48 bytes, and takes eight times as much.

    start, end : (n, 3) mm of the lines, read-only, 0 elsewhere. others : by number, rising.
    """

    def __init__(self, start: ArrayLike, end: ArrayLike, others: dict[int, CutterPath]) -> None:
        self.start, self.end = rows(start, -1, 3, name="start"), rows(end, -1, 3, name="end")
        self.others = others

    def some(self, which: Ints) -> Paths:
        """Those with some numbers, rising."""
        others = {k: self.others[j] for k, j in enumerate(which.tolist()) if j in self.others}
        return Paths(self.start[which], self.end[which], others)

    def __len__(self) -> int:
        return len(self.start)

    def __getitem__(self, k: int) -> CutterPath:
        return self.others.get(k) or Line.trusted(self.start[k], self.end[k])

    def __iter__(self) -> Iterator[CutterPath]:
        return map(self.__getitem__, range(len(self)))

    @property
    def length(self) -> Floats:
        """(n,) mm."""
        way = self.end - self.start
        out = np.sqrt(np.vecdot(way, way))  # the same digits as `Line.length`
        out[list(self.others)] = [path.length for path in self.others.values()]
        return np.asarray(out)


def move_paths(moves: Sequence[Move], machine: Machine | None = None) -> Paths:
    """`move_path` of every move; straight ones of an upright tool are made together."""
    plain, ends, others = _is_plain(machine), np.zeros((len(moves), 2, 3)), dict[int, CutterPath]()
    for k, m in enumerate(moves):
        # X Y Z alone say where it goes, and it goes straight
        is_line = (
            plain
            and m.circle is None
            and m.axis_end is None
            and m.rotary_deg is None
            and m.motion not in ARCS
        )
        path = None if is_line else move_path(m, machine)
        if path is None or isinstance(path, Line):
            ends[k] = (m.start, m.end) if path is None else (path.start, path.end)
        else:
            others[k] = path
    return Paths(ends[:, 0], ends[:, 1], others)


def moving(paths: Paths, length: Floats) -> Bools:
    """(n,) whether the cutter goes anywhere: a tip at rest may turn."""
    out = length > LENGTH_EPS_MM
    for k in np.flatnonzero(~out).tolist():
        path = paths[k]
        out[k] = isinstance(path, Turn) and not path.is_steady
    return out


def ends(paths: Sequence[CutterPath]) -> tuple[Floats, Floats]:
    """(n, 3) mm, tips at the ends of paths, and (n, 3) unit tool axes there."""
    tips, axes = np.empty((len(paths), 3)), np.tile(np.array(UP), (len(paths), 1))
    for k, path in enumerate(paths):
        tips[k] = path.end + 0.0 * path.start if isinstance(path, Line) else path.position(1.0)
        if isinstance(path, Turn):
            axes[k] = path.axis(1.0)
    return tips, axes


def end_axis(path: CutterPath) -> Floats:
    """(3,) unit tool axis at the end of a path."""
    return path.axis(1.0) if isinstance(path, Turn) else np.array(UP)


def _turn(move: Move, machine: Machine | None) -> Turn:
    if move.axis_end is not None:
        return Turn.great_circle(Pose(move.start, move.axis_start or UP), Pose(move.end, move.axis_end))
    first, last, chain = _joints(move, machine)
    screws, tip, axis = chain.screws()
    return Turn.joints(screws, first, last, tip_home=tip, axis_home=axis)


def _placed_arc(move: Move, machine: Machine | None, turn: Turn) -> Arc | Turn:
    """An arc in a main plane of the program, with a leaning tool or on a turned table that stands still."""
    arc, moved = _arc(move), np.zeros((2, 3))
    center, normal = np.array(arc.center), np.eye(3)[NORMAL[move.plane]]
    if not turn.is_steady:
        what = "an arc while the tool axis turns cannot be simulated"
        raise NCError(what, line=move.line, remedy="use short lines")
    if move.axis_end is None:  # where the table carries the centre, and a place above it
        for k, place in enumerate((center, center + normal)):
            x, y, z = place.tolist()
            moved[k] = _turn(move._replace(start=(x, y, z), end=(x, y, z)), machine).start
        center, normal = moved[0], moved[1] - moved[0]
    if turn.is_upright and abs(normal[2]) > 1.0 - STILL:
        angle = np.copysign(arc.angle, arc.angle * normal[2])
        return Arc(turn.start, center, 2, angle=angle, rise=turn.end[2] - turn.start[2])
    normal = np.copysign(1.0, arc.angle) * normal
    return _about(turn.start, turn.end, turn.axis(0.0), center, normal, abs(arc.angle))


def _swept(start: Floats, end: Floats, center: Floats, normal: Floats) -> float:
    """rad from start to end about the normal, less than a turn."""
    arm, flat = start - center, end - ((end - start) @ normal) * normal - center
    return float(np.arctan2(np.cross(normal, arm) @ flat, arm @ flat) % (2.0 * np.pi))


def _about(start: Floats, end: Floats, axis: Floats, center: Floats, normal: Floats, angle: float) -> Turn:
    """The tip turns about the centre while it rises, and the tool as much back about its tip."""
    chain = [("L", normal, center, 1.0), ("R", normal, center, 1.0), ("R", normal, start, -1.0)]
    joints = np.array([float((end - start) @ normal), angle, angle])
    return Turn.joints(chain, np.zeros(3), joints, tip_home=start, axis_home=axis)


def _joints(move: Move, machine: Machine | None) -> tuple[Floats, Floats, Machine]:
    """Joints at both ends, and the chain in which they are linear."""
    angles = move.rotary_deg or {}
    if machine is None or not machine.rotary:
        words = " ".join(letter.upper() for letter in angles)
        remedy = 'name it in the job: chain = "ac-table" or file = "machine.toml" under [machine]'
        raise NCError(
            f"rotary words ({words}) without a machine that has such axes", line=move.line, remedy=remedy
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
    would keep coordinates of the old kind, so the first move after it has to be a rapid that names X, Y and Z.

    Raises NCError: It is not, while the rotary axes are turned.
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
            what = "tool-centre-point control was switched while the rotary axes are turned"
            remedy = "continue with a rapid that names X, Y and Z"
            raise NCError(what, file=program.name, line=move.line, remedy=remedy)
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
    ccw = move.motion is Motion.ARC_CCW
    try:
        return arc_between(move.start, move.end, center, NORMAL[move.plane], ccw=ccw, turns=move.turns)
    except ValueError as exc:
        raise NCError(str(exc), line=move.line) from exc


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class JointDemands:
    """What the joints say about moves, (n,) each.

    seconds : that a move lasts at least, 0 without rotary words. accelerations : mm/s^2 along its path; inf for
    none. slides : (n, 3) mm that X, Y, Z go at most per move, at its fastest moment; NaN without rotary words.
    piece_seconds, piece_accelerations : (n, PIECES) the same in equal parts of a move, if all of it were so.
    """

    seconds: Floats
    accelerations: Floats
    slides: Floats
    piece_seconds: Floats
    piece_accelerations: Floats


def joint_demands(moves: Sequence[Move], machine: Machine | None, lengths: Floats) -> JointDemands:
    """By speeds and accelerations of the joints, for moves with rotary words; lengths : (n,) mm, tip paths.

    Under tool-centre-point control the slides are where the chain needs them all along the move, and its fastest
    moment counts; where two slides are parallel on the way they are not looked at.
    """
    n = len(moves)
    wanted = [k for k, move in enumerate(moves) if move.rotary_deg is not None]
    none, free = (np.broadcast_to(value, (n, PIECES)) for value in (0.0, np.inf))  # views of one number
    if wanted:
        none, free = none.copy(), free.copy()
    out = JointDemands(np.zeros(n), np.full(n, np.inf), np.full((n, 3), np.nan), none, free)
    for at, move in enumerate(moves):
        if move.circle is not None and lengths[at] > 0.0:
            out.slides[at] = _peaks(*_arc_rates(move))[0]
    if machine is None or not machine.rotary or not wanted:
        return out
    first, last = (
        np.array(ends) for ends in zip(*(_joints(moves[k], machine)[:2] for k in wanted), strict=True)
    )
    centred = np.array([moves[k].tcp for k in wanted])
    whole = linear_peaks(first, last)
    peaks = Peaks(*(np.repeat(v[:, None, :], PIECES, axis=1) for v in (whole.first, whole.second)))
    if centred.any():
        own = list(machine.rotary)
        ends = []
        for joints in (first[centred], last[centred]):
            q = np.zeros((len(joints), len(machine.axes)))
            q[:, own] = joints[:, 3:]
            placed = machine.place(q, joints[:, :3])[0]
            ends.append(np.where(np.isnan(placed), q, placed))
        inside = tcp_block_peaks(machine, ends[0], ends[1], PIECES)
        for found, mine in ((inside.first, peaks.first), (inside.second, peaks.second)):
            mine[centred] = np.where(np.isfinite(found), found, 0.0)
    k = np.array(wanted)
    for i, at in enumerate(wanted):  # the ends of an arc say nothing of the way between them
        if is_arc(moves[at]) and lengths[at] > 0.0:
            first, second = _arc_peaks(moves[at], machine)
            peaks.first[i][:, list(machine.slides)] = first
            if not isinstance(move_path(moves[at], machine), Arc):  # of those the look-ahead knows the bend
                peaks.second[i][:, list(machine.slides)] = second
    for j, name in enumerate("XYZ"):
        own = [i for i in machine.slides if machine.axes[i].name.upper() == name]
        out.slides[k, j] = peaks.first[:, :, own[0]].max(axis=1) if own else 0.0
    parts = Peaks(*(v.reshape(-1, v.shape[2]) for v in (peaks.first, peaks.second)))
    out.piece_seconds[k] = peak_times(machine, parts).reshape(-1, PIECES)
    pushes = peak_accelerations(machine, parts, np.repeat(lengths[k], PIECES))
    out.piece_accelerations[k] = pushes.reshape(-1, PIECES)
    out.seconds[k] = out.piece_seconds[k].max(axis=1)
    out.accelerations[k] = out.piece_accelerations[k].min(axis=1)
    return out


def is_arc(move: Move) -> bool:
    """In a main plane or in a tilted one."""
    return move.motion in ARCS or move.circle is not None


def places(move: Move, t: Floats) -> Floats:
    """(k, 3) mm in the coordinates of the program, at shares (k,) of the way of a line or an arc."""
    start, end = np.array(move.start), np.array(move.end)
    along, across, rise, angle = _arc_rates(move) if is_arc(move) else (start, start, start, 0.0)
    if angle == 0.0:
        return np.asarray(start + t[:, None] * (end - start))
    theta = abs(angle) * t[:, None]
    arm = -across / abs(angle)
    return np.asarray(
        start + arm * (np.cos(theta) - 1.0) + along / abs(angle) * np.sin(theta) + rise * t[:, None]
    )


def _arc_rates(move: Move) -> tuple[Floats, Floats, Floats, float]:
    """Of an arc, per unit of t in [0, 1]: the tip goes A cos(|angle| t) + B sin(|angle| t) + C; (A, B, C, angle)."""
    start, end = np.array(move.start), np.array(move.end)
    if move.circle is not None:
        center, normal = (np.array(v) for v in move.circle)
        angle = _swept(start, end, center, normal)
    else:
        arc = _arc(move)
        center, normal, angle = np.array(arc.center), np.eye(3)[arc.axis], arc.angle
    arm = start - center
    arm = arm - (arm @ normal) * normal
    return angle * np.cross(normal, arm), -abs(angle) * arm, ((end - start) @ normal) * normal, angle


def _peaks(along: Floats, across: Floats, rise: Floats, angle: float) -> tuple[Floats, Floats]:
    """(3,) largest |A cos + B sin + C| on the way of an arc, and of its derivative; see `_arc_rates`."""

    def largest(a: Floats, b: Floats, c: Floats | float) -> Floats:
        crest = np.arctan2(b, a) % np.pi
        at = np.minimum(np.stack([0.0 * crest, crest, crest + np.pi, 0.0 * crest + abs(angle)]), abs(angle))
        return np.asarray(np.abs(a * np.cos(at) + b * np.sin(at) + c).max(axis=0))

    return largest(along, across, rise), abs(angle) * largest(across, -along, 0.0)


def _arc_peaks(move: Move, machine: Machine) -> tuple[Floats, Floats]:
    """Largest |q'| and |q''| of the slides of a chain in an arc, in their order, while the rotary axes stand where it ends."""
    along, across, rise, angle = _arc_rates(move)
    if not move.tcp:
        # -1: another slide, which rests
        order = ["XYZ".find(machine.axes[i].name[0].upper()) for i in machine.slides]
        return tuple(np.append(v, 0.0)[order] for v in _peaks(along, across, rise, angle))  # type: ignore[return-value]
    still = machine.joints(degrees=True, **(move.rotary_deg or {}))
    tips = np.vstack([np.zeros(3), np.eye(3)])
    placed = machine.place(np.broadcast_to(still, (4, len(still))), tips)[0][:, list(machine.slides)]
    turn = (placed[1:] - placed[0]).T
    found = _peaks(turn @ along, turn @ across, turn @ rise, angle)
    return tuple(np.where(np.isfinite(v), v, 0.0) for v in found)  # type: ignore[return-value]


def _curvature(move: Move, machine: Machine | None, length: float) -> Floats:
    """(4,) 1/mm, largest |d2q/ds2| of X, Y, Z in an arc, and that of the tip."""
    along, across, rise, angle = _arc_rates(move)
    slides = _peaks(along, across, rise, angle)[1]
    if machine is not None and machine.rotary and move.rotary_deg is not None:
        names = (machine.axes[i].name.upper() for i in machine.slides)
        found = dict(zip(names, _arc_peaks(move, machine)[1], strict=True))
        slides = np.array([found.get(name, 0.0) for name in "XYZ"])
    return np.append(slides, abs(angle) * np.linalg.norm(along)) / length**2


def joint_feeds(lengths: Floats, seconds: Floats) -> Floats:
    """(n,) mm/min that the joints allow; inf where nothing limits."""
    limited = (seconds > 0) & (lengths > 0)
    return np.asarray(60.0 * np.divide(lengths, seconds, out=np.full(len(lengths), np.inf), where=limited))


def joint_directions(
    moves: Sequence[Move], paths: Paths, machine: Machine | None, lengths: Floats
) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """How the joints move along the paths.

    Gives (n, m) dq/ds at the start, slides X, Y, Z first (where the tip goes straight or in an arc: the tip), then rotary joints;
    (m,) their accelerations, inf without a limit; (n,) rad that a tip at rest turns, 0 elsewhere; of arcs whose plane or tool
    leans (n, 3) directions of the tip at the end, else NaN, and (n, 4) 1/mm largest curvature of X, Y, Z and the tip, else 0.
    """
    turning = [] if machine is None else list(machine.rotary)
    out, still = np.zeros((len(moves), 3 + len(turning))), np.zeros(len(moves))
    leaving, bend = np.full((len(moves), 3), np.nan), np.zeros((len(moves), 4))
    goes = lengths > 0.0
    out[goes, :3] = (paths.end[goes] - paths.start[goes]) / lengths[goes, None]
    for k, path in enumerate(paths) if turning else paths.others.items():
        if lengths[k] > 0.0 and not isinstance(path, Line):
            if isinstance(path, Turn) and is_arc(moves[k]):
                ends = path.velocity(np.array([0.0, 1.0]))
                out[k, :3], leaving[k] = ends / np.linalg.norm(ends, axis=1, keepdims=True)
                bend[k] = _curvature(moves[k], machine, lengths[k])
            else:
                velocity = path.velocity(0.0) if isinstance(path, Arc) else path.end - path.start
                out[k, :3] = velocity / max(float(np.linalg.norm(velocity)), 1e-300)
        move = moves[k]
        if machine is None or not turning or move.rotary_deg is None:
            continue
        first, last, chain = _joints(move, machine)
        change = (last - first)[list(chain.rotary)]
        if lengths[k] > 0.0:
            out[k, 3:] = change / lengths[k]
            if not (move.tcp or is_arc(move)):
                own = {chain.axes[i].name.upper(): (last - first)[i] for i in chain.slides}
                out[k, :3] = [own.get(name, 0.0) / lengths[k] for name in "XYZ"]
        elif (most := float(np.abs(change).max())) > STILL:
            still[k], out[k, 3:] = most, change / most
    limit = np.full(out.shape[1], np.inf)
    if machine is not None:
        slides = {machine.axes[k].name.upper(): machine.axes[k].max_acceleration for k in machine.slides}
        limit[:3] = [slides.get(name, np.inf) for name in "XYZ"]
        limit[3:] = [machine.axes[k].max_acceleration for k in turning]
    return out, limit, still, leaving, bend
