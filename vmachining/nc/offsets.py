"""Where zero is: G10, G52, G92, work offsets, tool lengths, reference points.

All of them change what coordinates mean and none of them moves the tool, but G28 and G30.
"""

from __future__ import annotations

import math
from typing import Final

from vmachining.nc.block import spell
from vmachining.nc.findings import NO_TOOL
from vmachining.nc.frames import UP, dot
from vmachining.nc.lexer import Word
from vmachining.nc.model import Motion, Point, add, put, subtract
from vmachining.nc.placing import swung
from vmachining.nc.run import Run
from vmachining.nc.settings import ToolEntry
from vmachining.nc.state import ORIGIN, WORK_OFFSETS

AXES: Final = "XYZ"


def tool_length(run: Run, code: int, word: Word) -> None:
    """G43, G43.1, G43.2 (a further length), G43.4, G49."""
    block, state = run.block, run.state
    if code == 490:
        state.length = ORIGIN
    elif code == 431:
        if not block.axes:
            raise run.fail("E371", word, "G43.1 without an axis word")
        state.length = put(state.length, _given(run))
    else:
        chosen = block.value("H")
        if code == 432 and chosen is None:
            raise run.fail("E322", word, "G43.2 needs H, the tool whose length is added")
        number = tool_number(run, "H", chosen or 0.0) or state.tool  # H0 means the tool in the spindle
        entry = state.table.get(number)
        if entry is None and number > 0 and run.settings.tools is None:
            what = f"no tool table was given: the length of tool {number} is taken as zero"
            run.warn("W321", block.word("H") or word, what)
        further = state.length if code == 432 else ORIGIN
        own = (entry.x_mm, entry.y_mm, entry.length_mm) if entry else ORIGIN
        state.length = add(further, own)
    state.tcp_length = code == 434
    state.place_offsets()


def tool_number(run: Run, letter: str, value: float) -> int:
    """A whole number from zero up that the tool table knows, or E321, E322; a tool that it lacks may move, see `spared`."""
    word = run.block.word(letter)
    number = round(value)
    if value < 0.0 or abs(value - number) > 1e-4:
        raise run.fail("E322", word, f"{letter}{value:g} is not a whole number from zero up")
    if number > 0 and run.settings.tools is not None and number not in run.state.table:
        if letter not in "TQ" and number != run.state.tool:
            raise run.fail("E321", word, f"{word.text if word else letter}: {NO_TOOL.format(number)}")
        run.warn("E321", word, NO_TOOL.format(number))
    return number


def write(run: Run, code: int, word: Word) -> None:
    """G10 L2 Pn (offsets of a work offset, R its rotation), G10 L20 Pn (so that the tool stands there); tools."""
    block, state = run.block, run.state
    kind, place = block.value("L"), block.value("P")
    if kind in (1.0, 10.0, 11.0):
        _write_tool(run, round(kind), word)
        return
    if kind not in (2.0, 20.0):
        what = "G10 without L" if kind is None else f"G10 L{kind:g} is not supported"
        raise run.fail("E375", block.word("L") or word, what)
    if place is None or place not in range(len(WORK_OFFSETS) + 1):
        what = "G10 without P" if place is None else f"P{place:g} is not a work offset"
        raise run.fail("E375", block.word("P") or word, what)
    code = WORK_OFFSETS[int(place) - 1] if place else state.work
    turn = block.value("R")
    if turn is not None:
        if kind == 20.0:
            raise run.fail("E207", block.word("R"), "G10 L20 takes no R")
        state.rotations = {**state.rotations, code: turn}
    old = state.offsets.get(code, ORIGIN)
    given = _given(run)
    new = put(old, given) if kind == 2.0 else _standing(run, code, old, given)
    state.offsets = {**state.offsets, code: new}
    # where a program of the Fanuc family gives G54 itself, before it moves, the zero of the job is: the machine stands where
    # it stood over that zero; where the job gives work offsets, it counts from those
    untouched = state.sim == run.settings.home and state.synced and state.work == code == WORK_OFFSETS[0]
    if run.settings.family and not run.settings.work_offsets and untouched:
        state.start_offset, state.machine = new, add(state.sim, new)
    angles = dict(state.rotary_work.get(code, {}))
    for letter in block.rotary:
        axis, value = letter.lower(), block.words[letter][0]
        here = state.rotary.get(axis, 0.0) - state.rotary_g92.get(axis, 0.0)
        angles[axis] = value if kind == 2.0 else here - value
    state.rotary_work = {**state.rotary_work, code: angles}
    if code == state.work:
        state.place_offsets()


def _write_tool(run: Run, kind: int, word: Word) -> None:
    """G10 L1 (offsets and radius R of tool P), L10 and L11 (so that the tool, measured here, stands there).

    L10 counts in the work offset in force, L11 in G59.3 without G92. Nothing moves before the next G43.
    """
    block, state = run.block, run.state
    place = block.value("P")
    if place is None or place == 0.0:
        raise run.fail("E375", block.word("P") or word, f"G10 L{kind} needs P, the number of a tool")
    if block.rotary:
        what = f"tools have no offset of a rotary axis here: {block.rotary[0]}"
        raise run.fail("E375", block.word(block.rotary[0]), what)
    number = tool_number(run, "P", place)
    old = state.table.get(number, ToolEntry(number, math.nan, 0.0))
    given, before = _given(run), (old.x_mm, old.y_mm, old.length_mm)
    x, y, z = put(before, given) if kind == 1 else _measured(run, kind, before, given)
    radius = block.value("R")
    width = old.diameter_mm if radius is None else 2.0 * radius * state.scale
    entry = old._replace(x_mm=x, y_mm=y, length_mm=z, diameter_mm=width)
    state.table = {**state.table, number: entry}


def _measured(run: Run, kind: int, before: Point, given: dict[int, float]) -> Point:
    """Tool offset T with which the tool stands at the given coordinates: machine = R (program + G92) + G5x + T.

    Along axes of the work offset that are not named T stays; under a rotation that changes both X and Y.
    """
    state = run.state
    code, g92_here = (593, ORIGIN) if kind == 11 else (state.work, state.g92)
    angle = math.radians(state.rotations.get(code, 0.0))
    c, s = math.cos(angle), math.sin(angle)

    def seen(point: Point) -> Point:
        return c * point[0] + s * point[1], c * point[1] - s * point[0], point[2]

    bare = subtract(seen(subtract(state.machine, state.offsets.get(code, ORIGIN))), g92_here)
    kept = seen(before)
    u, v, w = (bare[axis] - given[axis] if axis in given else kept[axis] for axis in range(3))
    return c * u - s * v, s * u + c * v, w


def _standing(run: Run, code: int, old: Point, given: dict[int, float]) -> Point:
    """Origin of a work offset under which the tool stands at the given coordinates."""
    state = run.state
    kept = state.work
    state.work = code
    state.place_offsets()
    before, after = state.turned(state.program), state.turned(put(state.program, given))
    state.work = kept
    state.place_offsets()
    return add(old, subtract(before, after))


def declare(run: Run, code: int, word: Word) -> None:
    """G92: the tool stands at the given coordinates."""
    block, state = run.block, run.state
    if not block.axes and not block.rotary:
        raise run.fail("E371", word, "G92 without an axis word")
    given = _given(run)

    def shifted(old: Point, here: Point) -> Point:
        return put(old, {axis: old[axis] + (here[axis] - value) for axis, value in given.items()})

    offset, offset_sim = shifted(state.g92, state.program), shifted(state.g92_sim, state.tip_program)
    angles = dict(state.rotary_g92)
    for letter in block.rotary:
        axis_name = letter.lower()
        seen = state.rotary.get(axis_name, 0.0) - state.rotary_shift(axis_name)
        angles[axis_name] = angles.get(axis_name, 0.0) + seen - block.words[letter][0]
    _set_g92(run, offset, offset_sim)
    state.rotary_g92 = state.rotary_saved = angles


def local(run: Run, code: int, word: Word) -> None:
    """G52: the offset itself; it shares its registers with G92, as in the reference control."""
    block, state = run.block, run.state
    if not block.axes:
        raise run.fail("E371", word, "G52 without an axis word")
    _set_g92(run, put(state.g92, _given(run)), put(state.g92_sim, _given(run)))


def _given(run: Run) -> dict[int, float]:
    """Axis words of the block, mm."""
    block, scale = run.block, run.state.scale
    return {axis: block.words[letter][0] * scale for axis, letter in enumerate(AXES) if letter in block.axes}


def _set_g92(run: Run, offset: Point, offset_sim: Point) -> None:
    state = run.state
    state.g92, state.g92_sim = offset, offset_sim
    state.g92_saved = offset, offset_sim
    state.place_offsets()


def g92(run: Run, code: int, word: Word) -> None:
    """G92.1 forgets the offset, G92.2 suspends it, G92.3 takes it back."""
    state = run.state
    if code == 923:
        state.g92, state.g92_sim = state.g92_saved
        state.rotary_g92 = state.rotary_saved
    else:
        state.g92 = state.g92_sim = ORIGIN
        state.rotary_g92 = {}
        if code == 921:
            state.g92_saved = ORIGIN, ORIGIN
            state.rotary_saved = {}
    state.place_offsets()


def keep_reference(run: Run, code: int, word: Word) -> None:
    """G28.1, G30.1: the reference point is here."""
    state = run.state
    first, second = state.references
    here = subtract(state.machine, state.start_offset)
    state.references = (here, second) if code == 281 else (first, here)
    one, two = state.rotary_references
    state.rotary_references = (state.rotary, two) if code == 281 else (one, state.rotary)


def reference(run: Run, code: int, word: Word) -> None:
    """G28, G30: by the intermediate point to the reference point, with the axes named or with all."""
    state, block = run.state, run.block
    if state.compensation is not None:
        raise run.fail("E359", word, f"{spell('G', code)} with cutter compensation on")
    named = block.axes + block.rotary
    run.emit(Motion.RAPID, *run.target(), None, rotary=run.rotary_target())
    state.between = state.machine
    home = state.references[0 if code == 280 else 1]
    angles = state.rotary_references[0 if code == 280 else 1]
    places = {axis: home[axis] for axis, letter in enumerate(AXES) if letter in named or not named}
    if state.carried is not None:
        run.emit(Motion.RAPID, *slides(run, places), None)
        return
    # the axes named are those of the work offset, turned with it
    to_sim = state.seen(subtract(home, state.to_sim))
    to_machine = state.seen(subtract(add(home, state.start_offset), state.to_machine))
    sim = put(state.tip_program, {axis: to_sim[axis] for axis in places})
    machine = put(state.program, {axis: to_machine[axis] for axis in places})
    turned = {
        axis: angles.get(axis, 0.0) if axis.upper() in named or not named else value
        for axis, value in state.rotary.items()
    }
    sim, machine = add(state.turned(sim), state.to_sim), add(state.turned(machine), state.to_machine)
    run.emit(Motion.RAPID, sim, machine, None, rotary=turned)


def slides(run: Run, places: dict[int, float]) -> tuple[Point, Point]:
    """Where slides that go to their own places, simulation frame, leave the tool in a tilted plane: table about zero."""
    state = run.state
    assert state.carried is not None
    frame = state.carried
    if abs(dot(frame.axis, state.axis) - 1.0) > 1e-9 or frame.mirrored or frame.scale != 1.0:
        word = run.block.g[0][1]
        what = f"{word.text} while coordinates are turned, scaled or mirrored"
        raise run.fail("E208", word, what, "cancel that before")
    here = put(swung(state.axis, UP, frame.apply(state.sim)), places)
    sim = frame.invert(swung(UP, state.axis, here))
    return sim, add(sim, state.lag)


def from_reference(run: Run, code: int, word: Word) -> None:
    """G29: through the intermediate point of the last G28 to the axis words.

    Raises BlockError: E371 without axis words, or before any G28; E359.
    """
    state, block = run.state, run.block
    if state.compensation is not None:
        raise run.fail("E359", word, "G29 with cutter compensation on")
    if state.between is None or not (block.axes or block.rotary):
        what = "G29 without an axis word" if state.between is not None else "G29 before any G28"
        raise run.fail("E371", word, what)
    goal = run.target()
    given, between = _given(run), state.between
    machine = put(state.machine, {axis: between[axis] for axis in given})
    start = put(state.sim, {axis: between[axis] - state.lag[axis] for axis in given})
    if not state.absolute:  # steps count from the intermediate point
        step = put(ORIGIN, given)
        goal = add(start, step), add(machine, step)
    run.emit(Motion.RAPID, start, machine, None)
    run.emit(Motion.RAPID, *goal, None, rotary=run.rotary_target())
