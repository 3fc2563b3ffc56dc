"""One block on its way: where its words lead, its feed, and the moves it makes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from vmachining.nc.block import Block, Problem
from vmachining.nc.compensation import JOINED_MM
from vmachining.nc.lexer import Word
from vmachining.nc.model import (
    ASSUMED_RPM,
    CompensationError,
    CornerError,
    Motion,
    Move,
    Point,
    add,
    put,
    subtract,
)
from vmachining.nc.offset_curves import joined
from vmachining.nc.settings import Settings
from vmachining.nc.state import ORIGIN, State

SLOWEST_MM_MIN: Final = 0.1
"""Feed of a G93 move without length, the floor of the reference control: a feed is never zero."""

AT_ORIGIN_MM: Final = 1e-9
"""Nearer to the origin than this the direction to the tool is rounding."""

MAX_MOVES: Final = 100_000
"""Motions of one block: repetitions times steps of a cycle beyond it are a typing error."""

DWELL_UNITS: Final = {"s": 1.0, "ms": 1e-3}

LONG_DWELL_S: Final = 30.0
"""No hole needs it, and the shortest dwells of posts that write milliseconds (P50, P100) lie above."""


class BlockError(Exception):
    """The block cannot be executed."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem.message)
        self.problem = problem


class Run:
    """A block being executed on a state that may be thrown away."""

    __slots__ = ("block", "line", "moves", "n", "settings", "state", "warnings")

    def __init__(self, block: Block, state: State, line: int, n: int | None, settings: Settings) -> None:
        self.block, self.state, self.line, self.n, self.settings = block, state, line, n, settings
        self.moves: list[Move] = []
        self.warnings: list[Problem] = []

    def fail(self, code: str, word: Word | None, message: str, hint: str = "") -> BlockError:
        """What to raise."""
        return BlockError(Problem(code, word, message, hint))

    def warn(self, code: str, word: Word | None, message: str) -> None:
        self.warnings.append(Problem(code, word, message))

    # ---- where to ----

    def place(self, values: Mapping[int, float]) -> tuple[Point, Point]:
        """Simulation frame and machine coordinates of a point; values : mm, program coordinates, by axis.

        Axes that are not named stay where they are, in each of the two worlds.
        """
        state = self.state
        if state.rotation == 0.0:
            sim = {axis: value + state.to_sim[axis] for axis, value in values.items()}
            machine = {axis: value + state.to_machine[axis] for axis, value in values.items()}
            return put(state.sim, sim), put(state.machine, machine)
        here, there = put(state.tip_program, values), put(state.program, values)
        return add(state.turned(here), state.to_sim), add(state.turned(there), state.to_machine)

    def target(self) -> tuple[Point, Point]:
        """Where the axis words lead."""
        block, state = self.block, self.state
        given = {axis: block.words[letter][0] for axis, letter in enumerate("XYZ") if letter in block.axes}
        if block.polar:
            return self.place(self.polar_target())
        if state.absolute:
            return self.place({axis: value * state.scale for axis, value in given.items()})
        step = state.turned(put(ORIGIN, {axis: value * state.scale for axis, value in given.items()}))
        return add(state.sim, step), add(state.machine, step)

    def polar_target(self) -> dict[int, float]:
        """`@` distance from the origin of the work offset, `^` angle from +X; in G91 both are steps."""
        block, state = self.block, self.state
        if state.plane.name != "xy":
            what = "polar words lie in XY, another plane is in force"
            raise self.fail("E207", block.word(block.polar[0]), what)
        here = state.program
        distance, angle = block.value("@"), block.value("^")
        radius, theta = math.hypot(here[0], here[1]), math.atan2(here[1], here[0])
        if radius <= AT_ORIGIN_MM and (angle is None or not state.absolute):
            what = "from the origin of the work offset polar words need ^, in G90"
            raise self.fail("E362", block.word(block.polar[0]), what)
        if state.absolute:
            radius = radius if distance is None else distance * state.scale
            theta = theta if angle is None else math.radians(angle)
        else:
            radius += (distance or 0.0) * state.scale
            theta += math.radians(angle or 0.0)
        out = {0: radius * math.cos(theta), 1: radius * math.sin(theta)}
        depth = block.value("Z")
        if depth is not None:
            out[2] = depth * state.scale + (0.0 if state.absolute else here[2])
        return out

    def rotary_target(self) -> dict[str, float]:
        """Machine degrees of the rotary axes after the block; axes that were never named are left out."""
        block, state = self.block, self.state
        out = dict(state.rotary)
        for letter in block.rotary:
            axis, value = letter.lower(), block.words[letter][0]
            base = state.rotary_shift(axis) if state.absolute else out.get(axis, 0.0)
            out[axis] = value + base
        return out

    # ---- how fast ----

    def feed(self, length: float) -> float:
        """Feed in mm/min along a path of this length."""
        state = self.state
        if not state.feed:
            inverse = state.feed_mode == 930
            what = "inverse time (G93) needs F in every feed block" if inverse else "a feed move without feed"
            raise self.fail("E301", self.block.word("F") or self.block.culprit(), what)
        if state.feed_mode == 930:
            feed = max(state.feed * length, SLOWEST_MM_MIN)
        elif state.feed_mode == 950:
            feed = state.feed * abs(state.rpm or (state.speed if self.settings.family else 0.0))
            if feed == 0.0 and self.settings.family:  # a code of the machine may start it
                what = f"feed per turn and no spindle speed: timed at {ASSUMED_RPM:g} rev/min"
                self.warn("W381", self.block.culprit(), what)
                feed = state.feed * ASSUMED_RPM
            if feed == 0.0:
                what = "feed per revolution (G95) with the spindle stopped"
                raise self.fail("E301", self.block.culprit(), what)
        else:
            feed = state.feed
        if state.direction == 0 and not state.warned_stopped:
            state.warned_stopped = True
            self.warn("W501", self.block.culprit(), "a feed move while the spindle is stopped")
        return feed

    # ---- the moves ----

    def rapid(self, values: Mapping[int, float]) -> None:
        self.emit(Motion.RAPID, *self.place(values), None)

    def cut(self, values: Mapping[int, float]) -> None:
        sim, machine = self.place(values)
        self.emit(Motion.LINEAR, sim, machine, self.feed(math.dist(self.state.sim, sim)))

    def seconds(self, letter: str) -> float | None:
        """A dwell by its word, s; None when the block does not have it. W335 where it is suspiciously long."""
        value = self.block.value(letter)
        if value is None:
            return None
        seconds = value * DWELL_UNITS[self.settings.dwell]
        if seconds >= LONG_DWELL_S:
            minutes = f" ({seconds / 60.0:.4g} minutes)" if seconds >= 60.0 else ""
            what = (
                f"a dwell of {seconds:g} s{minutes}; {value / 1000.0:g} s, if the program means milliseconds"
            )
            self.warn("W335", self.block.word(letter), what)
        return seconds

    def dwell(self, seconds: float) -> None:
        self.emit(Motion.DWELL, self.state.sim, self.state.machine, None, dwell_s=seconds)

    def emit(
        self,
        motion: Motion,
        sim: Point,
        machine: Point,
        feed: float | None,
        *,
        center: tuple[float, float] | None = None,
        turns: int = 0,
        dwell_s: float = 0.0,
        rotary: dict[str, float] | None = None,
    ) -> None:
        """Add a move and go there. Cutter compensation may hold it back, or move it."""
        state = self.state
        if len(self.moves) >= MAX_MOVES:
            raise self.fail("E413", self.block.culprit(), f"over {MAX_MOVES} motions in one block")
        tool = state.tool, state.rpm, dwell_s
        ends = machine, state.seen(subtract(machine, state.to_machine))
        way = motion, state.sim, sim, state.plane.name, center, turns, feed
        move = Move(self.line, self.n, *way, *tool, *ends, coolant=state.coolant)
        if state.rotation != 0.0:
            move = move._replace(rotation_deg=state.rotation)
        if state.tip is not None:
            move = _from_tip(move, state.tip, state)
            if motion is not Motion.DWELL:
                state.tip = None
        if rotary or state.rotary or state.centred:
            move = self._with_rotary(move, state.rotary if rotary is None else rotary)
        state.sim, state.machine = sim, machine
        kind = next((letter for letter in (",R", ",C") if letter in self.block.words), "")
        if kind or state.held is not None:
            self._corner(move, kind)
        else:
            self._through(move)

    def _corner(self, move: Move, kind: str) -> None:
        """`,R` and `,C`: a move that one of them ends waits for its neighbour in the plane."""
        state, held = self.state, self.state.held
        word = self.block.word(kind) if kind else self.block.culprit()
        a, b = state.plane.first, state.plane.second
        reach = math.hypot(move.end[a] - move.start[a], move.end[b] - move.start[b])
        leaves = held is not None and held.plane != move.plane
        flat = move.center is None and reach <= JOINED_MM
        if flat or leaves or move.motion in (Motion.DWELL, Motion.RAPID):
            what = "a corner (,R or ,C) stands between two feed motions of the plane"
            raise self.fail("E109", word, what, "program its next motion, or remove the word")
        if held is not None:
            state.held = None
            assert state.corner is not None
            try:
                made = joined(held, move, state.plane, *state.corner)
            except CornerError as exc:
                raise self.fail("E355", self.block.culprit(), str(exc)) from None
            for before in (held,) if made is None else made[:2]:
                self._through(before)
            move = move if made is None else made[2]
        if not kind:
            self._through(move)
            return
        size = self.block.words.pop(kind)[0] * state.scale
        if size <= 0.0:
            raise self.fail("E109", word, f"a corner of {size:g} mm")
        state.held, state.corner = move, ("round" if kind == ",R" else "chamfer", size)

    def _through(self, move: Move) -> None:
        state = self.state
        if state.compensation is None:
            self.moves.append(move)
            return
        try:
            step = state.compensation.accept(move)
        except CompensationError as exc:
            what, asked = "", self.settings.family and not self.settings.control.compensation
            if asked and exc.code in ("E353", "E355"):
                what = 'where the program is the path of the tool centre, say compensation = "wear"'
            raise self.fail(exc.code, self.block.culprit(), str(exc), what) from None
        state.compensation = step.after
        self.moves.extend(step.moves)
        for code, text in step.warnings:
            self.warn(code, self.block.culprit(), text)

    def _with_rotary(self, move: Move, rotary: Mapping[str, float]) -> Move:
        """The fields of the rotary axes; feeds of blocks that only turn are degrees per minute."""
        state = self.state
        start = {axis: state.rotary.get(axis, 0.0) for axis in rotary}
        turned = max((abs(rotary[axis] - start[axis]) for axis in rotary), default=0.0)
        duration = None
        if turned > 0.0 and move.feed_mm_min is not None and state.feed:
            if state.feed_mode == 930:
                duration = 60.0 / state.feed
            elif move.start == move.end:
                # F counts degrees, whatever the unit
                duration = 60.0 * turned / (move.feed_mm_min / state.scale)
        state.rotary = rotary
        return move._replace(
            rotary_start=start,
            rotary_deg=rotary,
            rotary_program={axis: value - state.rotary_shift(axis) for axis, value in rotary.items()},
            tcp=state.centred,
            duration_s=duration,
        )


def _from_tip(move: Move, tip: Point, state: State) -> Move:
    """The move as it starts beside the programmed point; a dwell stays there."""
    if move.motion is not Motion.DWELL:
        return move._replace(start=tip)
    aside = subtract(tip, move.end)
    machine, program = add(move.end_machine, aside), add(move.end_program, state.seen(aside))
    return move._replace(start=tip, end=tip, end_machine=machine, end_program=program)
