"""System variables of Fanuc controls (0i/30i operator's manual, custom macro): positions, modes, offsets, lengths and radii.

| number | holds |
|---|---|
| #3001 to #3004, #3006 #1100 to #1135 | switches, messages and outputs: they are set, and change no path |
| #4001 to #4014, #4109 to #4130 | codes of the modal groups; F, S, T, P of G54.1 |
| #5001 #5021 #5041 and on | end of the last block, machine coordinates, position |
| #5221 to #5323, #7001 to #7943 | G54 to G59, G54.1 P1 to P48: read and set |
| #11001 to #11400, #13001 to #13400 | length and radius of a tool of the table, or as they were set; #10001, #12001 their wear |

Timers, clocks, inputs, counters and tool life hold the state of a machine, which no program knows: refused by name.
"""

from __future__ import annotations

from math import isnan
from typing import TYPE_CHECKING, Final

from vmachining.nc.expressions import NoValueError
from vmachining.nc.frames import PLANES
from vmachining.nc.model import put

if TYPE_CHECKING:
    from vmachining.nc.state import State

FAMILY_FREE: Final = 1000
"""Numbered parameters from this on belong to the control."""

WORK: Final = (540, 550, 560, 570, 580, 590)
EXTENDED: Final = 100000
"""Code of the work offset G54.1 P1 is one more."""


def is_switch(number: int) -> bool:
    """Whether setting it changes no path."""
    register = 10000 < number <= 13400 and 1 <= number % 1000 <= 400  # of a tool: it holds what was set
    return register or number in (3001, 3002, 3003, 3004, 3006) or 1100 <= number <= 1135


def _offset(number: int) -> tuple[int, int] | None:
    """Code of the work offset and axis that a variable belongs to."""
    for first, last in ((5221, 5326), (7001, 7943)):
        group, axis = divmod(number - first, 20)
        if first <= number <= last and axis < 3:
            return (WORK[group] if first == 5221 else EXTENDED + group + 1), axis
    return None


def variable(state: State, number: int) -> float:
    """Its value, lengths in units of the program.

    Raises NoValueError: It holds what no program knows.
    """
    for first, place in ((5001, state.program), (5041, state.program), (5021, state.machine)):
        if first <= number <= first + 2:
            return place[number - first] / state.scale
    if (at := _offset(number)) is not None:
        return state.offsets.get(at[0], (0.0, 0.0, 0.0))[at[1]] / state.scale
    for first in (11001, 13001):
        entry = state.table.get(number - first + 1) if first <= number < first + 400 else None
        if entry is not None:
            value = entry.length_mm if first == 11001 else entry.diameter_mm / 2.0
            return 0.0 if isnan(value) else value / state.scale
    side = 0 if state.compensation is None else state.compensation.side
    motion, work = state.motion or 0, state.work
    cycle = state.motion if state.cycle is not None else 800
    modes = {
        4001: motion / 10.0 if state.cycle is None else 0.0, 4003: 90.0 if state.absolute else 91.0,
        4002: next(code for code, plane in PLANES.items() if plane is state.plane) / 10.0,
        4005: state.feed_mode / 10.0, 4006: 21.0 if state.scale == 1.0 else 20.0,
        4007: {0: 40.0, 1: 41.0, -1: 42.0}[side], 4008: 43.0 if any(state.length) else 49.0,
        4009: (cycle or 800) / 10.0, 4010: 99.0 if state.to_r else 98.0,
        4012: 67.0, 4014: work / 10.0 if work < EXTENDED else 54.1, 4130: float(work - EXTENDED) if work > EXTENDED else 0.0,
        4109: (state.feed or 0.0) / state.scale, 4119: state.speed, 4120: float(state.tool),
    }  # fmt: skip
    if number not in modes:
        what = f"#{number} holds the state of a machine, or an offset, that this program does not contain"
        raise NoValueError(what)
    return modes[number]


def set_variable(state: State, number: int, value: float) -> None:
    """Write a work offset.

    Raises NoValueError: The variable cannot be set.
    """
    at = _offset(number)
    if at is None:
        raise NoValueError(f"#{number} belongs to the control, setting it is not supported")
    old = state.offsets.get(at[0], (0.0, 0.0, 0.0))
    state.offsets = {**state.offsets, at[0]: put(old, {at[1]: value * state.scale})}
    state.place_offsets()
