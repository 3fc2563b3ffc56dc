"""Executes one block on a copy of the state, in the order of RS-274.

The first thing that cannot be done stops the block.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from vmachining.nc.arcs import PLANES, ArcError, arc_length, center_from_radius, check_center, is_rounded
from vmachining.nc.block import Block, Problem
from vmachining.nc.codes import spell
from vmachining.nc.lexer import Word
from vmachining.nc.model import Motion, Move, Point
from vmachining.nc.state import ORIGIN, State, add, subtract
from vmachining.nc.tooltable import ToolEntry

__all__ = ["BlockError", "execute"]

INCH: Final = 25.4
SLOWEST_MM_MIN: Final = 0.1
"""Feed of a G93 move without length, the floor of the reference control: a feed is never zero."""


class BlockError(Exception):
    """The block cannot be executed."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem.message)
        self.problem = problem


def execute(
    block: Block,
    state: State,
    line: int,
    n: int | None,
    tools: Mapping[int, ToolEntry] | None,
    home: Point,
) -> tuple[list[Move], list[Problem]]:
    """Run a block.

    Parameters
    ----------
    block : checked, without problems.
    state : changed in place; pass a clone, a BlockError leaves it half changed.
    tools : None: unknown.
    home : mm, simulation frame; where G28 and G30 go.

    Returns
    -------
    moves, warnings

    Raises
    ------
    BlockError
        The first semantic error in execution order.
    """
    run = _Run(block, state, line, n, tools, home)
    run.prepare()
    run.switch()
    run.travel()
    if block.m.get(4, (0, None))[0] in (2, 30):
        state.ended = True
        state.direction = 0
    state.check_sync()
    return run.moves, run.warnings


class _Run:
    """One block on its way through the steps."""

    __slots__ = ("block", "home", "line", "moves", "n", "state", "tools", "warnings")

    def __init__(
        self,
        block: Block,
        state: State,
        line: int,
        n: int | None,
        tools: Mapping[int, ToolEntry] | None,
        home: Point,
    ) -> None:
        self.block, self.state, self.line, self.n, self.tools, self.home = block, state, line, n, tools, home
        self.moves: list[Move] = []
        self.warnings: list[Problem] = []

    def fail(self, code: str, word: Word | None, message: str, hint: str = "") -> BlockError:
        return BlockError(Problem(code, word, message, hint))

    # ---- feed, speed, tool, spindle, dwell ----

    def prepare(self) -> None:
        """Feed mode, F, S, T, M6, M3 to M5, G4."""
        block, state = self.block, self.state
        if 5 in block.g:
            mode = block.g[5][0]
            if mode != state.feed_mode:
                state.feed_mode, state.feed = mode, None
        feed = block.value("F")
        if state.feed_mode == 930:
            state.feed = None
        if feed is not None:
            self._set_feed(feed)
        speed = block.value("S")
        if speed is not None:
            if speed < 0.0:
                raise self.fail("E312", block.word("S"), f"the spindle speed {speed:g} is negative")
            state.speed = speed
        tool = block.value("T")
        if tool is not None:
            state.selected = self._tool_number("T", tool)
        if 6 in block.m:
            if state.selected is None:
                raise self.fail("E323", block.m[6][1], "M6, but no tool was selected")
            state.tool, state.direction, state.warned_stopped = state.selected, 0, False
        if 7 in block.m:
            code, word = block.m[7]
            if code != 5 and state.speed <= 0.0:
                raise self.fail("E311", word, f"{spell('M', code)} without a spindle speed")
            state.direction = {3: 1, 4: -1, 5: 0}[code]
            state.warned_stopped = False
        if block.has_g(40):
            seconds = block.value("P")
            if seconds is None or seconds < 0.0:
                what = "G4 without P" if seconds is None else f"a dwell of {seconds:g} s"
                raise self.fail("E335", block.word("P") or block.g[0][1], what)
            self._emit(Motion.DWELL, state.sim, state.machine, None, dwell_s=seconds)

    def _set_feed(self, feed: float) -> None:
        block, state = self.block, self.state
        if feed < 0.0:
            raise self.fail("E301", block.word("F"), f"the feed {feed:g} is negative")
        state.feed = feed if state.feed_mode == 930 else feed * state.scale
        units = block.g.get(6)
        if units and state.feed_mode != 930 and _scale(units[0]) != state.scale:
            old = "mm" if state.scale == 1.0 else "inch"
            what = f"F is read before {spell('G', units[0])} takes effect: {feed:g} {old}"
            self.warnings.append(Problem("W302", block.word("F"), what))

    def _tool_number(self, letter: str, value: float) -> int:
        word = self.block.word(letter)
        number = round(value)
        if value < 0.0 or abs(value - number) > 1e-4:
            raise self.fail("E322", word, f"{letter}{value:g} is not a whole number from zero up")
        if number > 0 and self.tools is not None and number not in self.tools:
            raise self.fail("E321", word, f"tool {number} is not in the tool table")
        return number

    # ---- modes and offsets ----

    def switch(self) -> None:
        """Plane, units, tool length, work offset, distance and arc centre mode."""
        block, state = self.block, self.state
        if 2 in block.g:
            state.plane = PLANES[block.g[2][0]]
        if 6 in block.g:
            state.scale = _scale(block.g[6][0])
        if 8 in block.g:
            self._tool_length(*block.g[8])
            state.place_offsets()
        if 12 in block.g:
            state.work = block.g[12][0]
            state.place_offsets()
        if 3 in block.g:
            state.absolute = block.g[3][0] == 900
        if 4 in block.g:
            state.absolute_center = block.g[4][0] == 901

    def _tool_length(self, code: int, word: Word) -> None:
        block, state = self.block, self.state
        if code == 490:
            state.length = ORIGIN
        elif code == 431:
            if not block.axes:
                raise self.fail("E371", word, "G43.1 without an axis word")
            given = [block.value(letter) for letter in "XYZ"]
            x, y, z = (
                old if new is None else new * state.scale
                for new, old in zip(given, state.length, strict=True)
            )
            state.length = x, y, z
        else:
            chosen = block.value("H")
            number = self._tool_number("H", chosen or 0.0) or state.tool  # H0 means the tool in the spindle
            entry = self.tools.get(number) if self.tools is not None else None
            if entry is None and number > 0 and self.tools is None:
                what = f"no tool table was given: the length of tool {number} is taken as zero"
                self.warnings.append(Problem("W321", block.word("H") or word, what))
            state.length = 0.0, 0.0, entry.length_mm if entry else 0.0

    # ---- motion ----

    def travel(self) -> None:
        """Group 0 codes that take axis words, else the motion."""
        block, state = self.block, self.state
        code, word = block.g.get(0, (None, None))
        if code in (920, 921, 922, 923):
            assert code is not None
            self._g92(code, word)
        elif code in (280, 300):
            self._reference()
        if block.motion is not None:
            state.motion = None if block.motion == 800 else block.motion
        claimed = code in (280, 300, 920) or block.has_g(431)
        active = (
            block.motion not in (None, 800)
            or bool(block.axes)
            or (bool(block.centre) and state.motion in (20, 30))
        )
        if code == 530:
            self._machine_move(word, active)
        elif not claimed and active and state.motion is not None:
            if state.motion in (0, 10):
                self._straight()
            else:
                self._arc(ccw=state.motion == 30)

    def _g92(self, code: int, word: Word | None) -> None:
        block, state = self.block, self.state
        if code == 920:
            if not block.axes:
                raise self.fail("E371", word, "G92 without an axis word")
            program, sim = state.program, subtract(state.sim, state.to_sim)
            offset, offset_sim = list(state.g92), list(state.g92_sim)
            for axis, letter in enumerate("XYZ"):
                value = block.value(letter)
                if value is not None:
                    offset[axis] += program[axis] - value * state.scale
                    offset_sim[axis] += sim[axis] - value * state.scale
            state.g92 = offset[0], offset[1], offset[2]
            state.g92_sim = offset_sim[0], offset_sim[1], offset_sim[2]
            state.g92_saved = state.g92, state.g92_sim
        elif code == 923:
            state.g92, state.g92_sim = state.g92_saved
        else:
            state.g92 = state.g92_sim = ORIGIN
            if code == 921:
                state.g92_saved = ORIGIN, ORIGIN
        state.place_offsets()

    def _target(self) -> tuple[Point, Point]:
        """Where the axis words lead, in the simulation frame and in machine coordinates."""
        block, state = self.block, self.state
        sim, machine = list(state.sim), list(state.machine)
        for axis, letter in enumerate("XYZ"):
            value = block.value(letter)
            if value is None:
                continue
            value *= state.scale
            if state.absolute:
                sim[axis] = value + state.to_sim[axis]
                machine[axis] = value + state.to_machine[axis]
            else:
                sim[axis] += value
                machine[axis] += value
        return (sim[0], sim[1], sim[2]), (machine[0], machine[1], machine[2])

    def _reference(self) -> None:
        """G28, G30: by the intermediate point to the start position, with the axes named or with all."""
        state = self.state
        axes = self.block.axes or "XYZ"
        self._emit(Motion.RAPID, *self._target(), None)
        reference = add(self.home, state.start_offset)
        sim, machine = list(state.sim), list(state.machine)
        for axis, letter in enumerate("XYZ"):
            if letter in axes:
                sim[axis], machine[axis] = self.home[axis], reference[axis]
        self._emit(Motion.RAPID, (sim[0], sim[1], sim[2]), (machine[0], machine[1], machine[2]), None)

    def _machine_move(self, word: Word | None, active: bool) -> None:
        """G53: axis words are machine coordinates. In the simulation frame the tool has no length."""
        block, state = self.block, self.state
        if state.motion not in (0, 10) or not active:
            raise self.fail("E372", word, "G53 needs G0 or G1 and axis words")
        if not state.absolute:
            raise self.fail("E372", word, "G53 cannot be used in incremental mode (G91)")
        sim, machine = list(state.sim), list(state.machine)
        for axis, letter in enumerate("XYZ"):
            value = block.value(letter)
            if value is not None:
                machine[axis] = value * state.scale
                sim[axis] = machine[axis] - state.start_offset[axis]
        self._line((sim[0], sim[1], sim[2]), (machine[0], machine[1], machine[2]))

    def _straight(self) -> None:
        if not self.block.axes and self.state.motion == 10 and self._feed_is_missing():
            return  # G1 alone only chooses the mode; F may follow with the first axis word
        self._line(*self._target())

    def _line(self, sim: Point, machine: Point) -> None:
        state = self.state
        if state.motion == 0:
            self._emit(Motion.RAPID, sim, machine, None)
            return
        feed = self._feed(math.dist(state.sim, sim))
        self._emit(Motion.LINEAR, sim, machine, feed)

    def _feed_is_missing(self) -> bool:
        return not self.state.feed or (self.state.feed_mode == 950 and self.state.rpm == 0.0)

    def _feed(self, length: float) -> float:
        """Feed in mm/min along a path of this length."""
        state = self.state
        if not state.feed:
            what = (
                "inverse time (G93) wants F in every feed block"
                if state.feed_mode == 930
                else "a feed move without feed"
            )
            raise self.fail("E301", self.block.word("F") or self.block.culprit(), what)
        if state.feed_mode == 930:
            feed = max(state.feed * length, SLOWEST_MM_MIN)
        elif state.feed_mode == 950:
            feed = state.feed * abs(state.rpm)
            if feed == 0.0:
                what = "feed per revolution (G95) with the spindle stopped"
                raise self.fail("E301", self.block.culprit(), what)
        else:
            feed = state.feed
        if state.direction == 0 and not state.warned_stopped:
            state.warned_stopped = True
            self.warnings.append(
                Problem("W501", self.block.culprit(), "a feed move while the spindle is stopped")
            )
        return feed

    def _arc(self, ccw: bool) -> None:
        block, state = self.block, self.state
        plane, word = state.plane, block.culprit()
        sim, machine = self._target()
        a, b = plane.first, plane.second
        begin, finish = subtract(state.machine, state.to_machine), subtract(machine, state.to_machine)
        start, end = (begin[a], begin[b]), (finish[a], finish[b])
        turns = self._turns()
        try:
            center = self._center(start, end, ccw)
            difference = check_center(start, end, center, state.scale != 1.0) if block.centre else 0.0
        except ArcError as exc:
            raise self.fail(exc.code, word, str(exc)) from None
        rise = finish[plane.normal] - begin[plane.normal]
        feed = self._feed(arc_length(start, end, center, ccw, turns, rise))
        if is_rounded(difference):
            what = f"the radii at start and end differ by {difference:.3g} mm"
            self.warnings.append(Problem("W304", word, what))
        middle = center[0] + state.to_sim[a], center[1] + state.to_sim[b]
        if (
            not state.synced
        ):  # a tool length of this plane was switched since: the arc follows the programmed start
            moved = list(state.sim)
            moved[a], moved[b] = start[0] + state.to_sim[a], start[1] + state.to_sim[b]
            sim_end = list(sim)
            sim_end[a], sim_end[b] = end[0] + state.to_sim[a], end[1] + state.to_sim[b]
            state.sim = moved[0], moved[1], moved[2]
            sim = sim_end[0], sim_end[1], sim_end[2]
        motion = Motion.ARC_CCW if ccw else Motion.ARC_CW
        self._emit(motion, sim, machine, feed, center=middle, turns=turns)

    def _turns(self) -> int:
        turns = self.block.value("P")
        if turns is None:
            return 1
        if turns < 1.0 or abs(turns - round(turns)) > 1e-4:
            raise self.fail("E309", self.block.word("P"), f"{turns:g} turns")
        return round(turns)

    def _center(self, start: tuple[float, float], end: tuple[float, float], ccw: bool) -> tuple[float, float]:
        block, state = self.block, self.state
        plane, radius = state.plane, block.value("R")
        if plane.wrong in block.centre:
            what = f"{plane.wrong} is no centre word of plane {plane.name.upper()}"
            raise self.fail("E307", block.word(plane.wrong), what)
        if radius is not None and block.centre:
            raise self.fail("E303", block.word("R"), "both R and centre words")
        if radius is not None:
            return center_from_radius(start, end, radius * state.scale, ccw)
        given = [block.value(letter) for letter in plane.words]
        if given == [None, None]:
            raise ArcError("E302", "neither R nor a centre word")
        if state.absolute_center:
            if None in given:
                raise ArcError("E302", f"G90.1 wants both {' and '.join(plane.words)}")
            return (given[0] or 0.0) * state.scale, (given[1] or 0.0) * state.scale
        return start[0] + (given[0] or 0.0) * state.scale, start[1] + (given[1] or 0.0) * state.scale

    def _emit(
        self,
        motion: Motion,
        sim: Point,
        machine: Point,
        feed: float | None,
        *,
        center: tuple[float, float] | None = None,
        turns: int = 0,
        dwell_s: float = 0.0,
    ) -> None:
        state = self.state
        program = subtract(machine, state.to_machine)
        self.moves.append(
            Move(
                self.line,
                self.n,
                motion,
                state.sim,
                sim,
                state.plane.name,
                center,
                turns,
                feed,
                state.tool,
                state.rpm,
                dwell_s,
                machine,
                program,
            )
        )
        state.sim, state.machine = sim, machine


def _scale(code: int) -> float:
    return INCH if code == 200 else 1.0
