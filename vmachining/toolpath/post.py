"""A program that was read, written again for a control: `iso`, `fanuc`, `sinumerik` or `heidenhain`.

Lines and arcs stay what they are. A leaning tool is written as its axis where the control interpolates axes on the great
circle (`A3= B3= C3=` under TRAORI, `LN TX TY TZ` under M128), so that the posted program drives the same path; for the
other two as rotary angles under tool centre point control (M128, G43.4) with the fewest rewinds over the whole path, in
blocks halved until the axis stays within `angle_deg` of its great circle. Rotary words of the source stay angles.
Feeds are mm/min along the tip. Arcs under a leaning tool have no words in these languages and are refused.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from vmachining.errors import InputError
from vmachining.geometry.rotation import great_circle
from vmachining.machine import JointPath, Machine, axis_deviation, follow
from vmachining.nc import Motion, Move
from vmachining.nc.frames import PLANES, swept
from vmachining.nc.model import Point

POSTS: Final = ("iso", "fanuc", "sinumerik", "heidenhain")
ROUNDS: Final = 10
UP: Final = (0.0, 0.0, 1.0)
ARCS: Final = (Motion.ARC_CW, Motion.ARC_CCW)
PLANE_CODES: Final = {"xy": "G17", "zx": "G18", "yz": "G19"}
IN_PLANE: Final = {plane.name: (plane.first, plane.second, plane.normal) for plane in PLANES.values()}


@dataclass(frozen=True, slots=True, eq=False)
class Posted:
    """A written program. notes : what is to be known of it. joints : of the machine, at the start and after every block;
    lines, rapid : (n,) of the source, of the way to these poses. None where no angles were asked of a machine."""

    text: str
    notes: tuple[str, ...]
    joints: JointPath | None = None
    lines: tuple[int, ...] = ()
    rapid: tuple[bool, ...] = ()


def post_program(
    moves: Sequence[Move],
    dialect: str,
    *,
    machine: Machine | None = None,
    name: str = "PART",
    decimals: int = 9,
    angle_deg: float = 0.05,
    start_deg: Mapping[str, float] | None = None,
) -> Posted:
    """Write moves for a control.

    machine : its inverse kinematics give the angles of a leaning tool, for iso and fanuc.
    start_deg : angles of its rotary axes before the program; left out: those that cost the fewest rewinds.
    decimals : of mm, degrees and components of the tool axis.
    Raises InputError: Another dialect, no motion, an arc under a leaning tool, a leaning tool without a machine.
    Raises KinematicsError: A pose out of reach or outside of the travels.
    """
    if dialect not in POSTS:
        raise InputError(f"dialect '{dialect}' is not written", remedy=f"one of {', '.join(POSTS)}")
    if not 0 <= decimals <= 15:
        raise InputError(f"{decimals} decimals: give 0 to 15")
    if not moves:
        raise InputError("the program has no motion: nothing is posted")
    leaning = next(
        (m for m in moves if m.circle is not None or (m.motion in ARCS and m.axis_end not in (None, UP))),
        None,
    )
    if leaning is not None:
        raise InputError(
            f"line {leaning.line}: an arc under a leaning tool cannot be written",
            remedy="post it as short lines",
        )
    joints = next(
        (m for m in moves if m.rotary_deg is not None and not m.tcp and any(m.rotary_deg.values())), None
    )
    if joints is not None:
        raise InputError(
            f"line {joints.line}: rotary words without tool centre point control",
            remedy="post a path of tips and axes",
        )
    first = next((m for m in moves if m.motion is not Motion.DWELL), moves[0])
    if first.motion is not Motion.RAPID:  # where a table of poses begins, the machine has to go first
        there = first._replace(
            motion=Motion.RAPID, end=first.start, center=None, turns=0, feed_mm_min=None, axis_end=first.axis_start,
            rotary_deg=first.rotary_start,
        )  # fmt: skip
        moves = [there, *moves]
    writer = _WRITERS[dialect](name, decimals)
    angles: list[Any] = [()]
    if dialect in ("iso", "fanuc") and any(m.axis_end is not None for m in moves):
        if machine is None or not machine.rotary:
            raise InputError(
                "the tool leans: its angles need a machine", remedy="name one: --machine ac-table"
            )
        moves, *angles = _with_angles(moves, machine, angle_deg, start_deg)
    writer.write(moves)
    return Posted("\n".join(writer.lines) + "\n", *angles)


def _with_angles(
    moves: Sequence[Move], machine: Machine, angle_deg: float, start_deg: Mapping[str, float] | None
) -> tuple[list[Move], tuple[str, ...], JointPath, tuple[int, ...], tuple[bool, ...]]:
    """Moves with rotary angles instead of axes."""
    start = None if start_deg is None else machine.joints(degrees=True, **start_deg)
    if not (math.isfinite(angle_deg) and angle_deg > 0.0):
        raise InputError(f"angle {angle_deg:g} degrees: give a positive number")
    tilted = [m for m in moves if m.motion is not Motion.DWELL]
    tips = np.array([tilted[0].start, *(m.end for m in tilted)])
    axes = np.array([tilted[0].axis_start or UP, *(m.axis_end or UP for m in tilted)])
    owner = np.arange(len(tilted))
    rapid = np.array([m.motion is Motion.RAPID for m in tilted])
    worst, left = 0.0, 0
    for turn in range(ROUNDS + 1):
        found = follow(machine, tips, axes, start=start, easy=np.concatenate([[True], rapid]))
        off = axis_deviation(machine, found.joints[:-1], found.joints[1:], samples=17).from_circle
        split = (off > math.radians(angle_deg)) & ~rapid
        worst, left = float(np.degrees(off[~rapid].max())) if (~rapid).any() else 0.0, int(split.sum())
        if not left or turn == ROUNDS:
            break
        at = np.flatnonzero(split) + 1
        middle = great_circle(axes[at - 1], axes[at], np.full(len(at), 0.5))
        tips = np.insert(tips, at, 0.5 * (tips[at - 1] + tips[at]), axis=0)
        axes = np.insert(axes, at, middle, axis=0)
        owner, rapid = np.insert(owner, at - 1, owner[at - 1]), np.insert(rapid, at - 1, False)
    letters = [machine.names[k].lower() for k in machine.rotary]
    angles = found.joints[:, list(machine.rotary)]
    out: list[Move] = []
    where = np.flatnonzero(np.diff(owner, prepend=-1))
    for k, of in enumerate(owner):
        move = tilted[of]
        pose = dict(zip(letters, np.degrees(angles[k + 1]).tolist(), strict=True))
        x, y, z = tips[k + 1].tolist()
        end = move.end if move.motion in ARCS else (x, y, z)
        out.append(move._replace(end=end, axis_start=None, axis_end=None, rotary_deg=pose, tcp=True))
    lines = tuple(tilted[k].line for k in [0, *owner])
    notes = [
        f"line {lines[j.pose]}: {j.name} turns by {math.degrees(j.turn):.0f} degrees ({j.kind}"
        f"{', in a rapid' if rapid[j.pose - 1] else ''})"
        for j in found.jumps
    ]
    # the last pose of a block: those that were put into it have its line too
    if poles := sorted({lines[k] for k in np.flatnonzero(found.singular) if axes[k].tolist() != list(UP)}):
        notes.append(
            f"the tool is parallel to {machine.names[machine.rotary[0]]} in {len(poles)} lines from line {poles[0]} on: "
            "the axis keeps its angle there"
        )
    if left:
        notes.append(
            f"{left} blocks leave the path while an axis swings or rewinds, the tool axis by up to {worst:.3g} degrees"
        )
    if len(out) > len(where):
        notes.append(
            f"{len(out) - len(where)} blocks were added so that the axis stays within {angle_deg:g} degrees"
        )
    return _with_dwells(moves, owner.tolist(), out), tuple(notes), found, lines, (True, *rapid.tolist())


def _with_dwells(moves: Sequence[Move], owner: list[int], out: list[Move]) -> list[Move]:
    """The dwells of the source at their places again."""
    merged: list[Move] = []
    place, count = 0, -1
    for move in moves:
        if move.motion is Motion.DWELL:
            merged.append(move)
            continue
        count += 1
        while place < len(owner) and owner[place] == count:
            merged.append(out[place])
            place += 1
    return merged


def _turns(move: Move) -> list[tuple[Point, bool]]:
    """Ends of the single turns of an arc, and whether each is a full circle."""
    assert move.center is not None
    a, b, normal = IN_PLANE[move.plane]
    start, end = ((point[a], point[b]) for point in (move.start, move.end))
    whole = math.dist(start, end) < 1e-9
    sweep = math.tau if whole else swept(start, end, move.center, move.motion is Motion.ARC_CCW)
    total = sweep + math.tau * (move.turns - 1)
    out: list[tuple[Point, bool]] = []
    for k in range(1, move.turns):
        place = list(move.start)
        place[normal] += (move.end[normal] - move.start[normal]) * math.tau * k / total
        out.append(((place[0], place[1], place[2]), True))
    return [*out, (move.end, sweep == math.tau)]


class _Writer:
    """Lines of a program, words only where they change."""

    comment = ("(", ")")

    def __init__(self, name: str, decimals: int) -> None:
        clean = "".join(c for c in name.upper() if c.isalnum() or c in "-_")[:24]
        self.name, self.decimals = clean or "PART", decimals
        self.lines: list[str] = []
        self.tool, self.rpm = -1, math.nan
        self.feed: float | None = None
        self.last: dict[str, str] = {}
        self.mode, self.plane, self.leans = "", "", False

    def number(self, value: float) -> str:
        """Fixed point, no more digits than needed."""
        text = f"{round(value, self.decimals) + 0.0:.{self.decimals}f}"
        return text.rstrip("0").rstrip(".") if "." in text else text

    def changed(self, words: Iterable[tuple[str, float]]) -> list[str]:
        """Words whose number is another one than before."""
        out = []
        for letter, value in words:
            text = self.number(value)
            if self.last.get(letter) != text:
                self.last[letter] = text
                out.append(self.word(letter, text))
        return out

    def word(self, letter: str, text: str) -> str:
        return f"{letter}{text}"

    def write(self, moves: Sequence[Move]) -> None:
        self.lines += self.head()
        for move in moves:
            if move.tool != self.tool:
                self.lean(False)
                self.lines += self.change(move)
                self.tool, self.rpm, self.mode, self.feed = move.tool, math.nan, "", None
                self.last = {}
            if move.spindle_rpm != self.rpm:
                self.lines += self.spindle(move)
                self.rpm = move.spindle_rpm
            if move.motion is Motion.DWELL:
                self.lines.append(self.dwell(move.dwell_s))
                continue
            self.lean(move.axis_end is not None or (move.tcp and move.rotary_deg is not None))
            self.arc(move) if move.motion in ARCS else self.straight(move)
        self.lean(False)
        self.lines += self.tail()

    def head(self) -> list[str]:
        return [f"({self.name})", "G21 G17 G90 G94 G40"]

    def tail(self) -> list[str]:
        return ["M5", "M30"]

    def change(self, move: Move) -> list[str]:
        return [f"T{move.tool} M6"]

    def spindle(self, move: Move) -> list[str]:
        if move.spindle_rpm == 0.0:
            return ["M5"]
        return [f"S{abs(move.spindle_rpm):.9g} M{3 if move.spindle_rpm > 0 else 4}"]

    def dwell(self, seconds: float) -> str:
        return f"G4 P{self.number(seconds)}"

    tcp = ("M128", "M129")

    def lean(self, on: bool) -> None:
        """Tool centre point control."""
        if on != self.leans:
            self.lines.append(self.tcp[0 if on else 1])
            self.leans, self.last, self.mode = on, {}, ""

    def pose(self, move: Move) -> list[tuple[str, float]]:
        """Words of the end of a move."""
        out = list(zip("XYZ", move.end, strict=True))
        if move.tcp and move.rotary_deg is not None:
            out += [(letter.upper(), value) for letter, value in move.rotary_deg.items()]
        return out

    def feed_word(self, move: Move) -> list[str]:
        if move.feed_mm_min is None or move.feed_mm_min == self.feed:
            return []
        self.feed = move.feed_mm_min
        return [f"F{self.number(move.feed_mm_min)}"]

    def straight(self, move: Move) -> None:
        code = "G0" if move.motion is Motion.RAPID else "G1"
        words = self.changed(self.pose(move))
        if not words:
            return
        head = [code] if code != self.mode else []
        self.mode = code
        self.lines.append(" ".join([*head, *words, *(self.feed_word(move) if code == "G1" else [])]))

    def arc(self, move: Move) -> None:
        """An arc by its centre, turn by turn."""
        assert move.center is not None
        a, b, normal = IN_PLANE[move.plane]
        if move.plane != self.plane:
            self.lines.append(PLANE_CODES[move.plane])
            self.plane = move.plane
        code = "G3" if move.motion is Motion.ARC_CCW else "G2"
        begin = move.start
        for end, _ in _turns(move):
            words = [self.word("XYZ"[k], self.number(end[k])) for k in sorted((a, b))]
            if end[normal] != begin[normal]:
                words.append(self.word("XYZ"[normal], self.number(end[normal])))
            words += [
                self.word("IJK"[k], self.number(c - begin[k]))
                for k, c in sorted(zip((a, b), move.center, strict=True))
            ]
            self.lines.append(" ".join([code, *words, *self.feed_word(move)]))
            self.last.update({"XYZ"[k]: self.number(end[k]) for k in range(3)})
            begin = end
        self.mode = code


class _Fanuc(_Writer):
    tcp = ("G43.4 H0", "G49")

    def head(self) -> list[str]:
        return ["%", f"O0001 ({self.name})", "G21 G17 G90 G94 G40 G49 G80"]

    def change(self, move: Move) -> list[str]:
        self.tcp = (f"G43.4 H{move.tool}", "G49")
        return [f"T{move.tool} M6"]

    def dwell(self, seconds: float) -> str:
        return f"G4 P{round(1000.0 * seconds)}"

    def tail(self) -> list[str]:
        return ["M5", "M30", "%"]


class _Sinumerik(_Writer):
    tcp = ("TRAORI", "TRAFOOF")

    def head(self) -> list[str]:
        return [f"%_N_{self.name.replace('-', '_')}_MPF", "G17 G90 G710 G94 G40"]

    def dwell(self, seconds: float) -> str:
        return f"G4 F{self.number(seconds)}"

    def word(self, letter: str, text: str) -> str:
        return f"{letter}={text}" if len(letter) > 1 else f"{letter}{text}"

    def pose(self, move: Move) -> list[tuple[str, float]]:
        out = super().pose(move)
        return (
            out if move.axis_end is None else out + list(zip(("A3", "B3", "C3"), move.axis_end, strict=True))
        )

    def changed(self, words: Iterable[tuple[str, float]]) -> list[str]:
        """A tool axis is written whole: one component alone would be another direction."""
        given = list(words)
        axis = [(letter, self.number(value)) for letter, value in given if letter in ("A3", "B3", "C3")]
        out = super().changed([item for item in given if item[0] not in ("A3", "B3", "C3")])
        if axis and any(self.last.get(letter) != text for letter, text in axis):
            self.last.update(axis)
            out += [f"{letter}={text}" for letter, text in axis]
        return out


class _Heidenhain(_Writer):
    def head(self) -> list[str]:
        return [f"BEGIN PGM {self.name} MM"]

    def tail(self) -> list[str]:
        return ["M5", "M30", f"END PGM {self.name} MM"]

    def change(self, move: Move) -> list[str]:
        return [f"TOOL CALL {move.tool} Z S{abs(move.spindle_rpm):.9g}"]

    def spindle(self, move: Move) -> list[str]:
        if move.spindle_rpm == 0.0:
            return ["M5"]
        call = [f"TOOL CALL Z S{abs(move.spindle_rpm):.9g}"] if not math.isnan(self.rpm) else []
        return [*call, f"M{3 if move.spindle_rpm > 0 else 4}"]

    def dwell(self, seconds: float) -> str:
        return f"CYCL DEF 9.0 DWELL TIME\nCYCL DEF 9.1 DWELL {self.number(seconds)}"

    def word(self, letter: str, text: str) -> str:
        return f"{letter}{text}" if text.startswith("-") else f"{letter}+{text}"

    def pose(self, move: Move) -> list[tuple[str, float]]:
        out = super().pose(move)
        return (
            out if move.axis_end is None else out + list(zip(("TX", "TY", "TZ"), move.axis_end, strict=True))
        )

    def straight(self, move: Move) -> None:
        rapid = move.motion is Motion.RAPID
        words = self.changed(item for item in self.pose(move) if not item[0].startswith("T"))
        axis = []
        if move.axis_end is not None:
            axis = [
                (letter, self.number(v)) for letter, v in zip(("TX", "TY", "TZ"), move.axis_end, strict=True)
            ]
        turned = any(self.last.get(letter) != text for letter, text in axis)
        if not words and not turned:
            return
        self.last.update(axis)
        if axis and not words:
            words = [self.word("X", self.number(move.end[0]))]
        head = "LN" if axis else "L"
        tail = ["FMAX"] if rapid else self.feed_word(move)
        self.lines.append(
            " ".join([head, *words, *(self.word(k, t) for k, t in axis), *([] if axis else ["R0"]), *tail])
        )

    def arc(self, move: Move) -> None:
        assert move.center is not None
        if move.plane != "xy":
            raise InputError(
                f"line {move.line}: an arc outside XY is not written for heidenhain",
                remedy="post it as short lines",
            )
        x, y = move.center
        self.lines.append(f"CC {self.word('X', self.number(x))} {self.word('Y', self.number(y))}")
        ccw, begin = move.motion is Motion.ARC_CCW, move.start
        for end, whole in _turns(move):
            tail = ["DR+" if ccw else "DR-", *self.feed_word(move)]
            if end[2] == begin[2]:
                words = [self.word(c, self.number(v)) for c, v in zip("XY", end, strict=False)]
                self.lines.append(" ".join(["C", *words, *tail]))
            else:
                angle = 360.0
                if not whole:
                    angle = math.degrees(swept(begin[:2], end[:2], (x, y), ccw))
                step = self.word("IPA", self.number(angle if ccw else -angle))
                self.lines.append(" ".join(["CP", step, self.word("Z", self.number(end[2])), *tail]))
            begin = end
        self.last.update({c: self.number(v) for c, v in zip("XYZ", move.end, strict=True)})


_WRITERS: Final[dict[str, type[_Writer]]] = {
    "iso": _Writer, "fanuc": _Fanuc, "sinumerik": _Sinumerik, "heidenhain": _Heidenhain,
}  # fmt: skip
