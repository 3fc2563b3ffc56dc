"""Dialect `mts`: a training control whose drilling cycles are stored first and called later.

    G81 Z W            drill                      Z < 0 depth below the clearance plane, W >= 0 from there up
    G82 Z W B D K      break the chip             to the withdrawal plane, B dwell in s, K first step,
    G83 Z W B D K      clear the chip             D what each step is shorter than the one before
    G78 X Y D A S      S points along a line: spacing D, angle A from +X in degrees
    G77 X Y R A D S    S points on a circle: centre X Y, radius R, first angle A, step D in degrees
    G79 [X Y]          the stored cycle at every point of the pattern, else at X Y, else here
    G80                forgets both

The tool stands on the withdrawal plane z_w when the cycle is called: z_c = z_w - W, bottom z_c + Z, all of
them steps whatever G90 or G91 says. Steps are K, K - D, ... but not below D (K where D is zero), the last one
what is left. Between steps G82 lifts by 1 mm; G83 rapids to z_c, dwells, and comes back to 1 mm above.
Departures: where the source is silent (place of the dwell in G82, smallest step, words of G77) the rules
above were chosen; its printed example of a degression, 20 15 12 2 for a depth of 47, does not add up.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from vmachining.nc.codes import spell
from vmachining.nc.cycles import ROUNDING_MM
from vmachining.nc.run import Run

LIFT_MM: Final = 1.0
MAX_POINTS: Final = 100_000
"""Points of a pattern, steps of a hole: more is a typing error."""


class Stored(NamedTuple):
    """A cycle waiting for G79; lengths mm, as steps. dwell : s."""

    code: int
    depth: float
    withdraw: float
    dwell: float = 0.0
    first: float = 0.0
    less: float = 0.0


class Pattern(NamedTuple):
    """Points waiting for G79, program coordinates, mm."""

    points: tuple[tuple[float, float], ...]


def degression(depth: float, first: float, less: float) -> list[float]:
    """Steps of a hole: `first`, each `less` than the one before but not below `less`, together `depth`."""
    floor = less if less > 0.0 else first
    steps, left, step = [], depth, first
    while left > ROUNDING_MM:
        steps.append(min(step, left))
        left -= steps[-1]
        step = max(step - less, floor)
    return steps


def execute(run: Run, code: int) -> None:
    """A block with one of G77 to G83."""
    state = run.state
    if code == 800:
        state.stored = state.pattern = None
    elif code in (770, 780):
        state.pattern = _pattern(run, code)
    elif code == 790:
        _call(run)
    else:
        state.stored = _store(run, code)


def _store(run: Run, code: int) -> Stored:
    block, scale = run.block, run.state.scale
    word = block.g[9][1]
    depth, withdraw = block.value("Z"), (block.value("W") or 0.0) * scale
    if depth is None:
        raise run.fail("E331", word, f"{spell('G', code)} needs Z, its depth")
    if depth >= 0.0:
        raise run.fail("E337", block.word("Z"), "Z is the depth below the clearance plane, a negative step")
    if withdraw < 0.0:
        raise run.fail("E338", block.word("W"), "W goes up from the clearance plane, so it is not negative")
    if code == 810:
        return Stored(code, -depth * scale, withdraw)
    first, less, dwell = block.value("K"), block.value("D") or 0.0, run.seconds("B") or 0.0
    if first is None or first <= 0.0:
        what = f"{spell('G', code)} needs K, a first step above zero"
        raise run.fail("E339", block.word("K") or word, what)
    if less < 0.0 or dwell < 0.0:
        letter = "D" if less < 0.0 else "B"
        raise run.fail("E339", block.word(letter), f"{letter} of {spell('G', code)} is negative")
    if -depth / (less if less > 0.0 else first) > MAX_POINTS:
        raise run.fail("E339", block.word("K"), f"over {MAX_POINTS} steps in one hole")
    return Stored(code, -depth * scale, withdraw, dwell, first * scale, less * scale)


def _here(run: Run) -> tuple[float, float]:
    """X and Y of the block, or where the tool is."""
    block, state = run.block, run.state
    now = state.program
    x, y = (
        now[axis]
        if (value := block.value(letter)) is None
        else value * state.scale + (0.0 if state.absolute else now[axis])
        for axis, letter in enumerate("XY")
    )
    return x, y


def _pattern(run: Run, code: int) -> Pattern:
    block, scale = run.block, run.state.scale
    word = block.g[9][1]
    count, spacing = block.value("S"), block.value("D") or 0.0
    if count is None or count < 1.0 or count != int(count) or count > MAX_POINTS:
        what = f"{spell('G', code)} needs S, a whole number of points"
        raise run.fail("E342", block.word("S") or word, what)
    if spacing == 0.0 and count > 1.0:
        raise run.fail("E343", block.word("D") or word, f"{int(count)} points at one place: D is zero")
    x, y = _here(run)
    start = math.radians(block.value("A") or 0.0)
    if code == 780:
        step = spacing * scale
        dx, dy = math.cos(start), math.sin(start)
        return Pattern(tuple((x + k * step * dx, y + k * step * dy) for k in range(int(count))))
    radius = (block.value("R") or 0.0) * scale
    if radius <= 0.0:
        raise run.fail("E332", block.word("R") or word, "G77 needs R, a radius above zero")
    angles = [start + k * math.radians(spacing) for k in range(int(count))]
    return Pattern(tuple((x + radius * math.cos(a), y + radius * math.sin(a)) for a in angles))


def _call(run: Run) -> None:
    state, block = run.state, run.block
    word = block.g[9][1]
    if state.compensation is not None:
        raise run.fail("E344", word, "G79 while cutter compensation is on")
    if state.stored is None:
        code = "E340" if state.pattern is None else "E341"
        raise run.fail(code, word, "G79, but no cycle is stored")
    points: tuple[tuple[float, float], ...] = (_here(run),)
    if state.pattern is not None:
        if block.axes:
            raise run.fail("E207", block.word(block.axes[0]), "G79 with a place, but a pattern is waiting")
        points = state.pattern.points
    elif not block.axes:
        _drill(run, state.stored)
        return
    for x, y in points:
        run.rapid({0: x, 1: y})
        _drill(run, state.stored)
    state.pattern = None


def _drill(run: Run, cycle: Stored) -> None:
    """One hole where the tool stands."""
    above = run.state.program[2]
    clear = above - cycle.withdraw
    if cycle.withdraw > 0.0:
        run.rapid({2: clear})
    if cycle.code == 810:
        run.cut({2: clear - cycle.depth})
    else:
        _steps(run, cycle, clear)
    run.rapid({2: clear})
    if cycle.withdraw > 0.0:
        run.rapid({2: above})


def _steps(run: Run, cycle: Stored, clear: float) -> None:
    steps, depth = degression(cycle.depth, cycle.first, cycle.less), clear
    for k, step in enumerate(steps, 1):
        depth -= step
        run.cut({2: depth})
        last = k == len(steps)
        if cycle.code == 830 and not last:
            run.rapid({2: clear})
        if cycle.dwell > 0.0 and not (cycle.code == 830 and last):
            run.dwell(cycle.dwell)
        if not last:
            run.rapid({2: depth + LIFT_MM})
