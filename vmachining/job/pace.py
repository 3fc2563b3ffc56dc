"""What a program says about its pace besides feeds: stops, exact paths and tolerances, changes of tool, pallet and spindle.

| words | meaning here |
|---|---|
| G61.1, G9, G4 P0, M0 M1 M2 M6 M30 M60 | the axes stand still at the end of the move |
| G61 | exact path: no tolerance at corners |
| G64 P, CYCLE832(tolerance) | tolerance at corners, in the unit of the program; G64 alone: that of the machine |

States hold from their line on in the order of the file, also where a program jumps.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.machine import MachineLimits
from vmachining.nc import Motion, Program, decode_program, is_g_code, lex_line, split_lines

BEFORE, AFTER = frozenset((6.0,)), frozenset((0.0, 1.0, 2.0, 30.0, 60.0))
"""M codes that stop the axes: before the motion of their line, and after it."""

TELLING = re.compile(r"[MST]|G\s*0*(?:9|20|21|70|71)(?![\d.])|G\s*6[14]|CYCLE832", re.IGNORECASE)
SMOOTHING = re.compile(r"CYCLE832\s*\(\s*([\d.]+)", re.IGNORECASE)
INCH_MM = 25.4


@dataclass(frozen=True, slots=True, eq=False)
class Pace:
    """Columns (n,) of the moves of a program.

    halt : everything stops when the move ends. tolerance : mm at the corner where it ends, NaN where only the machine says.
    events : (n, 5) before it: tool changes, pallet changes, stops by the program, starts and stops of the spindle, and
    the 1000 rev/min that it had or gets in them. lines : (lines + 1, 5) the same by line, None where lines say nothing.
    """

    halt: Bools
    tolerance: Floats
    events: Floats
    lines: Floats | None = None

    def changes(self, limits: MachineLimits) -> Floats:
        """(n,) s that the events before a move last."""
        return np.asarray(self.events @ event_seconds(limits))

    @classmethod
    def of(cls, program: Program, *, block_delete: bool = False) -> Pace:
        """Of a program. block_delete : lines that open with a slash did not run."""
        own = np.array([move.line for move in program.moves], dtype=np.int64)
        tools = np.array([move.tool for move in program.moves], dtype=np.int64)
        none = np.zeros((len(own), 5))
        dwells = np.array([move.motion is Motion.DWELL for move in program.moves], dtype=np.bool_)
        if not len(own):
            return cls(dwells, np.zeros(0), none)
        if not is_g_code(program.dialect):
            changed = np.diff(tools, prepend=0) != 0
            halt = dwells | np.append(changed[1:], True)
            none[:, 0] = changed
            return cls(halt, np.full(len(own), np.nan), none)
        lines = _Lines.of(program, block_delete)
        here, there = own, np.append(own[1:], len(lines.before) - 1)
        stops = np.cumsum(lines.before + lines.after)
        between = np.where(there > here, stops[np.maximum(there - 1, 0)] - stops[here], 0)
        halt = (there != here) & ((lines.after[here] > 0) | (lines.before[there] > 0) | (between > 0))
        exact = lines.exact[here] & (there != here)
        return cls(halt | exact | dwells, lines.tolerance[here], _since(lines.events, own), lines.events)


def event_seconds(limits: MachineLimits) -> Floats:
    """(5,) what one of each event lasts, see `Pace`."""
    return np.array(
        [limits.tool_change_s, limits.table_change_s, limits.program_stop_s, limits.spindle_start_s,
         limits.spindle_s_per_1000_rev_min]
    )  # fmt: skip


def _since(events: Floats, own: Ints) -> Floats:
    """(n, 5) events after the line of the move before, up to the move's own; of a line that was jumped back to, its own."""
    total = np.cumsum(events, axis=0)
    before = np.concatenate([[0], own[:-1]])
    found = np.where((own > before)[:, None], total[own] - total[np.minimum(before, own)], events[own])
    return np.where((own == before)[:, None], 0.0, found)


@dataclass(slots=True, eq=False)
class _Lines:
    """What every line says, from line 1 on; arrays of one more than there are lines, and line 0."""

    before: Ints
    after: Ints
    exact: Bools
    tolerance: Floats
    events: Floats

    @classmethod
    def of(cls, program: Program, block_delete: bool) -> _Lines:
        texts = list(split_lines(decode_program(program.data, program.name)))
        n = len(texts) + 2
        before, after = np.zeros((2, n), dtype=np.int64)
        events = np.zeros((n, 5))
        asked, turning = 0.0, 0.0  # 1000 rev/min
        tool: tuple[float | None, float | None] = (None, None)  # that T named last, and in the spindle
        exact, tolerance = np.zeros(n, dtype=np.bool_), np.full(n, np.nan)
        unit, held, mode = 1.0, False, np.nan
        for number, text in enumerate(texts, start=1):
            once = False
            if TELLING.search(text):
                lexed = lex_line(text)
                if not (block_delete and lexed.block_delete):
                    words = [(word.letter, word.value) for word in lexed.words]
                    m = {value for letter, value in words if letter == "M"}
                    g = {value for letter, value in words if letter == "G"}
                    before[number], after[number] = not m.isdisjoint(BEFORE), not m.isdisjoint(AFTER)
                    speeds = [value for letter, value in words if letter == "S" and value is not None]
                    asked = abs(speeds[-1]) / 1000.0 if speeds else asked
                    named = [value for letter, value in words if letter == "T" and value is not None]
                    tool = (named[-1] if named else tool[0], tool[1])
                    # a tool that is in the spindle is not changed
                    changes = 6.0 in m and (tool[0] is None or tool[0] != tool[1])
                    events[number, :3] = changes, 60.0 in m, not m.isdisjoint((0.0, 1.0))
                    if 6.0 in m:
                        tool = (tool[0], tool[0])
                    if turning and not m.isdisjoint((2.0, 5.0, 6.0, 30.0)):
                        events[number, 3:] += 1.0, turning
                        turning = 0.0
                    if not m.isdisjoint((3.0, 4.0)) and asked != turning:
                        events[number, 3:] += 1.0, abs(asked - turning)
                        turning = asked
                    once = 9.0 in g
                    unit = INCH_MM if g & {20.0, 70.0} else 1.0 if g & {21.0, 71.0} else unit
                    if g & {61.0, 61.1}:
                        held, mode = 61.1 in g, 0.0
                    elif 64.0 in g:
                        given = [value for letter, value in words if letter == "P"]
                        held, mode = False, (given[0] * unit if given and given[0] is not None else np.nan)
                    if found := SMOOTHING.search(text):
                        held, mode = False, float(found[1]) * unit or np.nan
            exact[number], tolerance[number] = held or once, mode
        return cls(before, after, exact, tolerance, events)
