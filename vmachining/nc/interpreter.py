"""Executes one block on a copy of the state, in the order of RS-274.

The first thing that cannot be done stops the block.
"""

from __future__ import annotations

import math
from typing import Final

from vmachining.nc import cycles, offsets
from vmachining.nc.block import CYCLES, Block, Problem, spell
from vmachining.nc.compensation import Compensation
from vmachining.nc.frames import PLANES, arc_length, center_from_radius, check_center, is_rounded
from vmachining.nc.lexer import Word
from vmachining.nc.model import ArcError, Motion, Move, Point, add, put, subtract
from vmachining.nc.placing import turned_arc
from vmachining.nc.run import Run
from vmachining.nc.settings import Settings
from vmachining.nc.state import ORIGIN, State

INCH: Final = 25.4
_FIXED: Final = {12: "work offset", 6: "units", 8: "tool length"}
"""Groups that must not change while cutter compensation is on."""

_OFFSETS: Final = {
    100: offsets.write, 280: offsets.reference, 281: offsets.keep_reference, 290: offsets.from_reference,
    300: offsets.reference, 301: offsets.keep_reference, 520: offsets.local, 920: offsets.declare,
    **dict.fromkeys((921, 922, 923), offsets.g92),
}  # fmt: skip
_COOLANT: Final = {7: "mist", 8: "flood", 9: ""}
_SIGNALS: Final = {62: "P", 63: "P", 64: "P", 65: "P", 66: "", 67: "E", 68: "E"}
"""Words without which a code that sets an output or reads an input says nothing."""


def execute(
    block: Block, state: State, line: int, n: int | None, settings: Settings
) -> tuple[list[Move], list[Problem]]:
    """Run a block.

    block : checked, without problems.
    state : changed in place; pass a clone, a BlockError leaves it half changed.
    Returns moves, warnings
    Raises BlockError: The first semantic error in execution order.
    """
    run = _Interpreter(block, state, line, n, settings)
    run.prepare()
    run.switch()
    run.travel()
    if block.m.get(4, (0, None))[0] in (2, 30):
        run.end()
    state.check_sync()
    return run.moves, run.warnings


NO_PLACE: Final = (
    "G53: the part has no position on the machine: Z goes to home, X and Y are taken as part coordinates"
)


class _Interpreter(Run):
    """The steps of a block."""

    __slots__ = ()

    # ---- feed, speed, tool, spindle, dwell ----

    def prepare(self) -> None:
        """Feed mode, F, S, T, M6, M3 to M5, tool centre point control, G4."""
        block, state = self.block, self.state
        if 5 in block.g:
            mode = block.g[5][0]
            if mode != state.feed_mode:
                held = state.held_feed if self.settings.family and state.feed is None else None
                if state.feed is not None:
                    state.held_feed = state.feed_mode, state.feed
                state.feed_mode, state.feed = mode, held[1] if held is not None and held[0] == mode else None
        feed = block.value("F")
        if state.feed_mode == 930:
            state.feed = None
        if feed is not None:
            self._set_feed(feed)
        speed = block.value("S")
        if speed is not None and block.stored not in (770, 780):
            if speed < 0.0:
                raise self.fail("E312", block.word("S"), f"the spindle speed {speed:g} is negative")
            state.speed = speed
        tool = block.value("T")
        if tool is not None:
            state.selected = offsets.tool_number(self, "T", tool)
        if 6 in block.m:
            self._change_tool(*block.m[6])
        if 5 in block.m:
            self._signal(*block.m[5])
        if 7 in block.m:
            code, word = block.m[7]
            if code in (3, 4) and state.speed <= 0.0 and not self.settings.family:
                raise self.fail("E311", word, f"{spell('M', code)} without a spindle speed")
            if code == 19:
                self._orient()
            state.direction = {3: 1, 4: -1}.get(code, 0)
            state.warned_stopped = False
        if 12 in block.m:
            self._modes(*block.m[12])
        if 8 in block.m:
            old, code = state.coolant, block.m[8][0]
            state.coolant = _COOLANT[code] if code == 9 or old in ("", _COOLANT[code]) else "mist and flood"
        if 11 in block.m:
            state.tcp = block.m[11][0] in (128, 428)
            state.tcp_length = False
        if block.has_g(40):
            seconds = self.seconds("P")
            if seconds is None or seconds < 0.0:
                what = "G4 without P" if seconds is None else f"a dwell of {seconds:g} s"
                raise self.fail("E335", block.word("P") or block.g[0][1], what)
            self.dwell(seconds)

    def _change_tool(self, code: int, word: Word) -> None:
        block, state = self.block, self.state
        if state.compensation is not None:
            raise self.fail("E359", word, "the tool cannot change while cutter compensation is on")
        if code == 61:
            number = block.value("Q")
            if number is None:
                raise self.fail("E323", word, "M61 needs Q, the number of the tool in the spindle")
            state.tool = offsets.tool_number(self, "Q", number)
            return
        if state.selected is None:
            raise self.fail("E323", word, "M6, but no tool was selected")
        state.tool, state.direction, state.warned_stopped = state.selected, 0, False

    def _signal(self, code: int, word: Word) -> None:
        """M62 to M68: outputs and inputs change no path; their numbers are checked."""
        block = self.block
        for letter in "PE":
            number = block.value(letter)
            if number is not None and (number < 0.0 or number != int(number)):
                what = f"{letter}{number:g} is not the number of an input or output"
                raise self.fail("E376", block.word(letter), what)
        if letters := [letter for letter in _SIGNALS[code] if letter not in block.words]:
            raise self.fail("E376", word, f"{spell('M', code)} needs {' and '.join(letters)}")
        if code == 66 and ("P" in block.words) == ("E" in block.words):
            raise self.fail("E376", word, "M66 waits for an input: one of P and E is expected")
        if code == 66 and block.value("L") and not (block.value("Q") or 0.0) > 0.0:
            raise self.fail("E376", block.word("L"), "M66 that waits needs Q, the seconds it may take")

    def _orient(self) -> None:
        """M19: the spindle stops at an angle, which no cutter of revolution knows."""
        block = self.block
        angle, way = block.value("R"), block.value("P")
        if angle is not None and not 0.0 <= angle < 360.0:
            raise self.fail("E376", block.word("R"), f"R{angle:g}: degrees from 0 to 360 are expected")
        if way is not None and way not in (0.0, 1.0, 2.0):
            raise self.fail("E376", block.word("P"), f"P{way:g}: 0, 1 or 2 is expected")

    def _modes(self, code: int, word: Word) -> None:
        """M70 and M73 save the modes, M71 forgets them, M72 brings them back."""
        state = self.state
        if state.compensation is not None:
            raise self.fail("E359", word, f"{spell('M', code)} while cutter compensation is on")
        if code in (70, 73):
            state.save(automatic=code == 73)
        elif code == 71:
            state.levels = (*state.levels[:-1], None)
        elif state.levels[-1] is None:
            raise self.fail("E376", word, "M72, but no modes were saved here by M70")
        else:
            state.restore()

    def _set_feed(self, feed: float) -> None:
        block, state = self.block, self.state
        if feed < 0.0:
            raise self.fail("E301", block.word("F"), f"the feed {feed:g} is negative")
        state.feed, state.held_feed = feed if state.feed_mode == 930 else feed * state.scale, None
        units = block.g.get(6)
        if units and state.feed_mode != 930 and _scale(units[0]) != state.scale:
            old = "mm" if state.scale == 1.0 else "inch"
            what = f"F is read before {spell('G', units[0])} takes effect: {feed:g} {old}"
            self.warn("W302", block.word("F"), what)

    # ---- modes and offsets ----

    def switch(self) -> None:
        """Plane, units, cutter compensation, tool length, work offset, distance modes, cycle return."""
        block, state = self.block, self.state
        if state.compensation is not None:
            self._while_compensated(state.compensation)
        if 2 in block.g:
            state.plane = PLANES[block.g[2][0]]
        if 6 in block.g:
            state.scale = _scale(block.g[6][0])
        if 7 in block.g:
            self._compensate(*block.g[7])
        if 8 in block.g:
            offsets.tool_length(self, *block.g[8])
        if 12 in block.g:
            state.work = block.g[12][0]
            state.place_offsets()
        if 3 in block.g:
            state.absolute = block.g[3][0] == 900
        if 4 in block.g:
            state.absolute_center = block.g[4][0] == 901
        if 10 in block.g:
            state.to_r = block.g[10][0] == 990

    def _while_compensated(self, active: Compensation) -> None:
        block, state = self.block, self.state
        if 2 in block.g and PLANES[block.g[2][0]] is not active.plane:
            raise self.fail("E356", block.g[2][1], "the plane cannot change while cutter compensation is on")
        for group, name in _FIXED.items():
            if group in block.g and not (group == 6 and _scale(block.g[6][0]) == state.scale):
                what = f"the {name} cannot change under cutter compensation"
                raise self.fail("E359", block.g[group][1], what)
        code, word = block.g.get(0, (None, None))
        if code in (100, 520, 530, 920, 921, 922, 923):
            raise self.fail("E359", word, f"{spell('G', code or 0)} while cutter compensation is on")

    def _compensate(self, code: int, word: Word) -> None:
        state = self.state
        if code == 400:
            if state.compensation is not None:
                moves, tip = state.compensation.finish()
                self.moves.extend(moves)
                state.compensation = None
                state.tip = tip if tip is not None and math.dist(tip, state.sim) > 0.0 else None
            return
        if state.compensation is not None:
            side = 1 if code in (410, 411) else -1
            if self.settings.family and state.compensation.is_like(side, self._diameter(code, word)):
                return
            what = f"{spell('G', code)} while cutter compensation is on already"
            raise self.fail("E357", word, what)
        if state.rotation != 0.0 and state.plane.name != "xy":
            raise self.fail("E361", word, "compensation outside the XY plane under a rotated work offset")
        diameter, corner = self._diameter(code, word), self.settings.corner
        side = 1 if (code in (410, 411)) == (diameter >= 0.0) else -1
        how = self.settings.entry, corner == "miter", corner == "exact", state.turn, self.settings.family
        state.compensation = Compensation(side, abs(diameter) / 2.0, state.plane, *how, corner == "line")

    def _diameter(self, code: int, word: Word) -> float:
        """Of the tool D names or the one in the spindle; negative swaps the sides."""
        block, state, tools = self.block, self.state, self.settings.tools
        chosen = block.value("D")
        if chosen == 0.0 and state.tool == 0 and tools is not None:
            self.warn("W351", block.word("D"), "D0 and no tool in the spindle: its radius is taken as zero")
            return 0.0
        if code in (411, 421):
            if chosen is None:
                raise self.fail("E351", word, f"{spell('G', code)} needs D, the diameter of the tool")
            if block.value("L"):
                like = block.words["L"][1]
                what = f"L of {spell('G', code)} is the orientation of a lathe tool: {like.text}"
                raise self.fail("E209", like, what, "remove the word")
            return chosen * state.scale
        number = offsets.tool_number(self, "D", chosen or 0.0) or state.tool
        entry = state.table.get(number)
        if tools is None and self.settings.family:
            what = f"{word.text}: the tool radius is not known; the programmed contour is taken as the path of the tool centre"
            self.warn("W351", block.word("D") or word, what)
            return 0.0
        if entry is None or math.isnan(entry.diameter_mm):
            what = "no tool table was given" if tools is None else f"tool {number} is not in the tool table"
            raise self.fail("E351", block.word("D") or word, f"the tool radius is not known: {what}")
        if entry.turning:
            what = f"tool {number} has an orientation (Q) in the tool table: it belongs to a lathe"
            raise self.fail("E351", block.word("D") or word, what)
        return entry.diameter_mm

    def end(self) -> None:
        """M2, M30."""
        state = self.state
        if state.compensation is not None:
            self.warn("W358", self.block.m[4][1], "the program ends with cutter compensation on")
            self.moves.extend(state.compensation.finish()[0])
            state.compensation = None
        state.ended, state.direction = True, 0

    # ---- motion ----

    def travel(self) -> None:
        """Group 0 codes that take axis words, stored cycles, else the motion."""
        block, state = self.block, self.state
        code, word = block.g.get(0, (None, None))
        if code in _OFFSETS and word is not None:
            _OFFSETS[code](self, code, word)
        before = state.motion
        if block.motion is not None:
            state.motion = None if block.motion == 800 else block.motion
            if state.motion not in CYCLES:
                state.cycle = None
        if block.stored is not None:
            cycles.execute(self, block.stored)
            if block.stored != 800:
                return
        places = block.axes or block.rotary or block.polar
        claimed = code in (100, 280, 290, 300, 520, 920) or block.has_g(431)
        arc = bool(block.centre) and state.motion in (20, 30)
        active = block.motion not in (None, 800) or bool(places) or arc
        if code == 530:
            self._machine_move(word, active)
        elif not claimed and active and state.motion is not None:
            if state.motion in (0, 10):
                self._straight()
            elif state.motion in CYCLES:
                cycles.drill(self, state.motion, before not in CYCLES)
            elif state.motion == 331:
                cycles.tap_rigid(self)
            else:
                self._arc(ccw=state.motion == 30)

    def _machine_move(self, word: Word | None, active: bool) -> None:
        """G53: axis words are machine coordinates. In the simulation frame the tool has no length."""
        block, state = self.block, self.state
        if state.motion not in (0, 10) or not active:
            raise self.fail("E372", word, "G53 needs G0 or G1 and axis words")
        if not state.absolute:
            raise self.fail("E372", word, "G53 cannot be used in incremental mode (G91)")
        if block.polar:
            raise self.fail("E372", word, "G53 takes no polar words")
        rotary, given = dict(state.rotary), {}
        for axis, letter in enumerate("XYZ"):
            value = block.value(letter)
            if value is not None:
                given[axis] = value * state.scale
        if given and not state.offsets:  # nobody says where the part lies on the machine
            self.warn("W366", word, NO_PLACE)
            if 2 in given:
                given[2] = self.settings.home[2] + state.start_offset[2]
        sim = {axis: value - state.start_offset[axis] for axis, value in given.items()}
        if state.carried is not None:
            self._line(*offsets.slides(self, sim), rotary)
            return
        for letter in block.rotary:
            rotary[letter.lower()] = block.words[letter][0]
        self._line(put(state.sim, sim), put(state.machine, given), rotary)

    def _straight(self) -> None:
        block, state = self.block, self.state
        idle = not state.feed or (state.feed_mode == 950 and state.rpm == 0.0 and not self.settings.family)
        if state.motion == 10 and idle and not (block.axes or block.rotary or block.polar):
            return  # G1 alone only chooses the mode; F may follow with the first axis word
        self._line(*self.target(), self.rotary_target())

    def _line(self, sim: Point, machine: Point, rotary: dict[str, float]) -> None:
        state = self.state
        if state.motion == 0:
            self.emit(Motion.RAPID, sim, machine, None, rotary=rotary)
            return
        # after a tool length was switched the machine is not where the simulated tip says: inverse time counts its way
        feed = self.feed(math.dist(state.machine, machine))
        self.emit(Motion.LINEAR, sim, machine, feed, rotary=rotary)

    def _arc(self, ccw: bool) -> None:
        block, state = self.block, self.state
        plane, word = state.plane, block.culprit()
        if state.tip is not None:
            raise self.fail("E352", word, "the first motion after G40 is an arc", "leave on a straight line")
        sim, machine = self.target()
        a, b = plane.first, plane.second
        begin, finish = state.program, state.seen(subtract(machine, state.to_machine))
        start, end = (begin[a], begin[b]), (finish[a], finish[b])
        turns = self._turns()
        try:
            center = self._center(start, end, ccw)
            difference = 0.0
            if block.value("R") is None:
                difference = check_center(start, end, center, state.scale != 1.0)
        except ArcError as exc:
            raise self.fail(exc.code, word, str(exc)) from None
        rise = finish[plane.normal] - begin[plane.normal]
        feed = self.feed(arc_length(start, end, center, ccw, turns, rise))
        if is_rounded(difference):
            what = f"the radii at start and end differ by {difference:.3g} mm"
            self.warn("W304", word, what)
        middle = self._in_plane(center)
        if not state.synced:
            # a tool length of this plane was switched since: the arc follows the programmed start
            state.sim = put(state.sim, dict(zip((a, b), self._in_plane(start), strict=True)))
            sim = put(sim, dict(zip((a, b), self._in_plane(end), strict=True)))
        motion = Motion.ARC_CCW if ccw else Motion.ARC_CW
        rotary = self.rotary_target()
        if state.rotation != 0.0 and plane.name != "xy":
            if rotary or not state.synced or state.compensation is not None:
                what = "an arc outside the XY plane under a rotated work offset, with rotary axes or a tool length just switched"
                raise self.fail("E361", word, what)
            first = len(self.moves)
            self.emit(motion, sim, machine, feed, center=center, turns=turns)
            self.moves[first:] = turned_arc(self.moves[first], state, self.settings, begin, finish)
            return
        self.emit(motion, sim, machine, feed, center=middle, turns=turns, rotary=rotary)

    def _in_plane(self, pair: tuple[float, float]) -> tuple[float, float]:
        """A pair of program coordinates in the simulation frame."""
        state = self.state
        point = put(ORIGIN, {state.plane.first: pair[0], state.plane.second: pair[1]})
        out = add(state.turned(point), state.to_sim)
        return out[state.plane.first], out[state.plane.second]

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
            what = f"{plane.wrong} is not a centre word of plane {plane.name.upper()}"
            raise self.fail("E307", block.word(plane.wrong), what)
        if radius is not None and block.centre:
            raise self.fail("E303", block.word("R"), "both R and centre words")
        if self.settings.control.modal_centres:
            radius = state.centre.get("R") if radius is None and not block.centre else radius
            held = {k: v for k, v in state.centre.items() if k != "R"}
            state.centre = held if radius is None else {**held, "R": radius}
        if radius is not None:
            return center_from_radius(start, end, radius * state.scale, ccw)
        given = [block.value(letter) for letter in plane.words]
        control = self.settings.control
        if control.modal_centres:
            given = [state.centre.get(k) if v is None else v for k, v in zip(plane.words, given, strict=True)]
            named = {k: v for k, v in zip(plane.words, given, strict=True) if v is not None}
            state.centre = {**state.centre, **named}
        if given == [None, None]:
            raise ArcError("E302", "neither R nor a centre word")
        absolute = control.arc_centres == "absolute"
        if state.absolute_center and None in given:
            raise ArcError("E302", f"G90.1 needs both {' and '.join(plane.words)}")
        if state.absolute_center or absolute:
            whole = [at if v is None else v * state.scale for v, at in zip(given, start, strict=True)]
            return whole[0], whole[1]
        sign = -state.scale if control.arc_centres == "reversed" else state.scale
        return start[0] + (given[0] or 0.0) * sign, start[1] + (given[1] or 0.0) * sign


def _scale(code: int) -> float:
    return INCH if code == 200 else 1.0
