"""Canned cycles: one block, many moves. G17: holes at X Y, drilled along Z; other planes likewise.

One hole: (1) below the R plane: rapid up to it; (2) rapid over the hole; (3) rapid down to R; (4) the body;
(5) back to R (G99), or to the higher of R and the initial level (G98).

| code | body | way back |
|---|---|---|
| G81 | feed to Z | rapid |
| G82 | feed to Z, dwell P | rapid |
| G73 | feed in steps Q, rapid up by the peck clearance between them | rapid |
| G83 | feed in steps Q, rapid to R between them and down to the peck clearance | rapid |
| G84, G74 | feed to Z, spindle reversed, dwell P | feed, spindle reversed |
| G85 | feed to Z | feed to R, rapid |
| G86 | feed to Z, dwell P, spindle stopped | rapid, spindle on |
| G89 | feed to Z, dwell P | feed |

G33.1 (rigid tapping) is not a cycle: it feeds by the pitch from where the tool is, and back.

In G90 all words are coordinates. In G91 X and Y are steps, R counts from the initial level, Z from R. Z, R, Q
and P hold for the blocks that follow with the same code; L (repetitions, default 1) for its own block only.
The initial level is where the tool was when the series of cycles began.
Source: RS274/NGC; the moves of LinuxCNC 2.9, observed. Its taps in G18 and G19 take the coordinates of the hole
in another order, so that they feed next to it: copied, with a warning, unless the option `taps` is "axis".
Departures: the reference control makes a peck without depth where rounding leaves 1e-15 mm of a depth of whole
steps; with an initial level below R, a later block whose R is lower does not go down before it is over its
hole.

Dialect `mts`: a training control whose drilling cycles are stored first and called later.

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
from typing import Final, NamedTuple, TypeAlias

from vmachining.nc.block import spell
from vmachining.nc.frames import Plane
from vmachining.nc.model import Motion
from vmachining.nc.run import Run

MAX_REPEATS: Final = 100_000
MAX_PECKS: Final = 1_000_000
"""Holes of a block, and steps of a hole: beyond it is a typing error, not a program."""

ROUNDING_MM: Final = 1e-6
"""A peck of less is rounding, a thousandth of the finest programmed digit: a depth of whole steps has no other."""

_BESIDE: Final = {"zx": (1, 2, 0), "yz": (2, 0, 1)}
"""Which coordinate of the hole a tap is sent to along X, Y and Z: an error of the reference control, kept."""


class Cycle(NamedTuple):
    """What a series of canned cycles remembers; lengths mm, as programmed (G91: steps).

    initial : level where the series began, program coordinates. z, r, q, p belong to `code` in `plane` only.
    """

    code: int
    plane: str
    initial: float
    z: float | None = None
    r: float | None = None
    q: float | None = None
    p: float | None = None


def drill(run: Run, code: int, fresh: bool) -> None:
    """Execute the cycle `code` at the place of this block.

    fresh : the motion mode before this block was no cycle, so the initial level is where the tool is.
    Raises BlockError: E331 to E336, E344, E301, E311.
    """
    state, block = run.state, run.block
    plane = state.plane
    word = block.culprit()
    if state.compensation is not None:
        raise run.fail("E344", word, f"{spell('G', code)} while cutter compensation is on")
    if state.feed_mode == 930:
        raise run.fail("E301", word, "canned cycles have no inverse time feed (G93)")
    cycle = _remember(run, code, plane, fresh)
    if code in (740, 840) and state.direction != (1 if code == 840 else -1) and not run.settings.family:
        want = "M3" if code == 840 else "M4"
        raise run.fail("E311", word, f"{spell('G', code)} taps with {want}, which is not in force")
    given = block.value("L")
    repeats = 1.0 if given is None else given
    if repeats == 0.0 and run.settings.family:  # stored, and drilled by the next block
        state.cycle = cycle
        return
    if repeats < 1.0 or repeats != int(repeats) or repeats > MAX_REPEATS:
        raise run.fail("E336", block.word("L"), f"L{repeats:g} is not a whole number of holes")
    state.cycle = cycle
    clear = _levels(run, cycle)[0]
    level = state.program[plane.normal]
    low = clear - ROUNDING_MM
    # on the clearance plane the rapid has no length: as the reference control
    if cycle.code != 870 and (level < low or (cycle.initial < low and abs(level - clear) <= ROUNDING_MM)):
        run.rapid({plane.normal: clear})
    kept = state.feed
    if state.tap and code in (740, 840):
        state.feed = state.tap * (state.speed if state.feed_mode == 940 else 1.0)
    for _ in range(int(repeats)):
        _hole(run, cycle, plane)
    state.feed = kept


def _remember(run: Run, code: int, plane: Plane, fresh: bool) -> Cycle:
    """The words of the block over those that hold, checked."""
    state, block = run.state, run.block
    old, scale = state.cycle, state.scale
    level = state.program[plane.normal]
    if old is None or fresh:
        old = Cycle(code, plane.name, level if state.return_level is None else state.return_level)
    if (old.code, old.plane) != (code, plane.name):
        old = Cycle(code, plane.name, old.initial if old.plane == plane.name else level)
    word, depth = block.culprit(), "XYZ"[plane.normal]
    values = {name: block.value(letter) for name, letter in zip("zrqp", (depth, "R", "Q", "P"), strict=True)}
    z = old.z if values["z"] is None else values["z"] * scale
    r = old.r if values["r"] is None else values["r"] * scale
    q = old.q if values["q"] is None else values["q"] * scale
    p = old.p if values["p"] is None else run.seconds("P")
    if r is None:
        raise run.fail("E332", word, f"{spell('G', code)} needs R, its clearance plane")
    if z is None:
        raise run.fail("E331", word, f"{spell('G', code)} needs {depth}, the bottom of the hole")
    if code in (730, 830) and (q is None or q <= 0.0):
        what = f"{spell('G', code)} needs Q, a step above zero"
        raise run.fail("E334", block.word("Q") or word, what)
    if (code in (820, 860, 890) and p is None) or (p is not None and p < 0.0):
        what = f"{spell('G', code)} needs P, a dwell of zero or more seconds"
        raise run.fail("E335", block.word("P") or word, what)
    if not run.settings.family and ((z > 0.0) if not state.absolute else (r < z)):
        raise run.fail("E333", block.word("R") or word, "R is below the bottom of the hole")
    if run.settings.family and state.absolute and code != 870 and r < z - ROUNDING_MM:
        what = f"R {r / scale:g} lies below the bottom of the hole, {z / scale:g}: a rapid to R, and a cut upwards"
        run.warn("W333", block.word("R") or word, what)
    return Cycle(code, plane.name, old.initial, z, r, q, p)


def _levels(run: Run, cycle: Cycle) -> tuple[float, float, float]:
    """Clearance plane, bottom, and where the tool goes back to; program coordinates."""
    assert cycle.z is not None and cycle.r is not None
    clear = cycle.r if run.state.absolute else cycle.r + cycle.initial
    bottom = cycle.z if run.state.absolute else cycle.z + clear
    return clear, bottom, clear if run.state.to_r else max(clear, cycle.initial)


def _hole(run: Run, cycle: Cycle, plane: Plane) -> None:
    state, block = run.state, run.block
    normal = plane.normal
    clear, bottom, back = _levels(run, cycle)
    here = state.program
    over = {axis: here[axis] for axis in (plane.first, plane.second)}
    if block.polar:
        over.update({axis: v for axis, v in run.polar_target().items() if axis != normal})
    for axis in over:
        value = block.value("XYZ"[axis])
        if value is not None:
            over[axis] = value * state.scale + (0.0 if state.absolute else here[axis])
    run.rapid(over)
    if cycle.code == 870:
        _back_bore(run, cycle, plane, over)
        return
    if abs(here[normal] - clear) > ROUNDING_MM:
        run.rapid({normal: clear})
    _body(run, cycle, normal, clear, bottom, back)


def _body(run: Run, cycle: Cycle, normal: int, clear: float, bottom: float, back: float) -> None:
    """From the clearance plane to the bottom and out again."""
    state, code = run.state, cycle.code
    if code in (730, 830):
        _pecks(run, cycle, normal, clear, bottom)
    elif code in (740, 840):
        _tap(run, normal, bottom)
    else:
        run.cut({normal: bottom})
    direction = state.direction
    if code in (740, 840):
        state.direction = -direction
    waits = code in (740, 760, 820, 840, 860, 880, 890)
    if waits and cycle.p is not None and (cycle.p or not run.settings.family):
        run.dwell(cycle.p)
    if code in (740, 840):
        _tap(run, normal, back)
    elif code == 890:
        run.cut({normal: back})
    elif code == 850:
        run.cut({normal: clear})
        run.rapid({normal: back})
    else:
        if code == 860:
            state.direction = 0
        run.rapid({normal: back})
    state.direction = direction


def _back_bore(run: Run, cycle: Cycle, plane: Plane, over: dict[int, float]) -> None:
    """G87: beside the hole down to R, into it, feed up to Z, next to it again and out."""
    clear, bottom, _ = _levels(run, cycle)
    first, normal = plane.first, plane.normal
    aside = over[first] + (cycle.q or 0.0)
    run.rapid({first: aside})
    run.rapid({normal: clear})
    run.rapid({first: over[first]})
    run.cut({normal: bottom})
    if cycle.p:
        run.dwell(cycle.p)
    run.rapid({first: aside})
    run.rapid({normal: cycle.initial})
    run.rapid({first: over[first]})


def tap_rigid(run: Run) -> None:
    """G33.1: straight in by the pitch K for each turn of the spindle, and back to where it began.

    Raises BlockError: E301 (no target, or inverse time), E311, E334 (no pitch), E344.
    """
    state, block = run.state, run.block
    word, pitch = block.culprit(), block.value("K")
    if state.compensation is not None:
        raise run.fail("E344", word, "G33.1 while cutter compensation is on")
    if not (block.axes or block.polar) or block.rotary:
        raise run.fail("E206", word, "G33.1 needs X, Y or Z, and turns no rotary axis")
    if not pitch:
        raise run.fail("E334", block.word("K") or word, "G33.1 needs K, its pitch", "program K")
    if state.rpm == 0.0:
        raise run.fail("E311", word, "G33.1 taps with the spindle turning")
    sim, machine, begin, above = *run.target(), state.sim, state.machine
    feed, direction = abs(pitch) * state.scale * abs(state.rpm), state.direction
    run.emit(Motion.LINEAR, sim, machine, feed)
    state.direction = -direction
    run.emit(Motion.LINEAR, begin, above, feed)
    state.direction = direction


def _tap(run: Run, normal: int, level: float) -> None:
    """Feed a tap to a level of its axis; next to it in G18 and G19, as the reference control does."""
    state, word = run.state, run.block.culprit()
    if normal == 2 or run.settings.taps == "axis":
        run.cut({normal: level})
        return
    what = f"in this plane the reference control feeds the tap away from its hole: {level:g} mm"
    run.warn("W345", word, what)
    sim, machine = run.place({normal: level})
    here = state.program
    hole = [level if axis == normal else here[axis] for axis in range(3)]
    run.cut({axis: hole[k] for axis, k in enumerate(_BESIDE[state.plane.name])})
    state.tip = None if state.sim == sim else state.sim
    state.sim, state.machine = sim, machine  # the control continues as if the tap stood in its hole


def _pecks(run: Run, cycle: Cycle, normal: int, clear: float, bottom: float) -> None:
    step, gap, depth = cycle.q or 0.0, run.settings.peck_clearance_mm, clear
    if (clear - bottom) / step > MAX_PECKS:
        what = f"over {MAX_PECKS} steps in one hole"
        raise run.fail("E334", run.block.word("Q") or run.block.culprit(), what)
    less, least = run.state.shrink or (0.0, 0.0)
    while True:
        if step <= ROUNDING_MM:
            word = run.block.word("Q") or run.block.culprit()
            what = "the pecks shrink to zero above the bottom: K, the smallest peck, is missing"
            raise run.fail("E334", word, what)
        depth -= step
        step = max(step - less, least) if less else step
        if depth - bottom < ROUNDING_MM:
            run.cut({normal: bottom})
            return
        run.cut({normal: depth})
        if cycle.code == 830:
            run.rapid({normal: clear})
        short = depth + gap < clear - ROUNDING_MM or cycle.code == 730  # never above the clearance plane
        if short and (gap < step or not run.settings.family):
            run.rapid({normal: min(depth + gap, clear)})


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


Pattern: TypeAlias = tuple[tuple[float, float], ...]
"""Points waiting for G79, program coordinates, mm."""


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
    x, y, _ = now = state.program
    if (value := block.value("X")) is not None:
        x = value * state.scale + (0.0 if state.absolute else now[0])
    if (value := block.value("Y")) is not None:
        y = value * state.scale + (0.0 if state.absolute else now[1])
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
        return tuple((x + k * step * dx, y + k * step * dy) for k in range(int(count)))
    radius = (block.value("R") or 0.0) * scale
    if radius <= 0.0:
        raise run.fail("E332", block.word("R") or word, "G77 needs R, a radius above zero")
    angles = [start + k * math.radians(spacing) for k in range(int(count))]
    return tuple((x + radius * math.cos(a), y + radius * math.sin(a)) for a in angles)


def _call(run: Run) -> None:
    state, block = run.state, run.block
    word = block.g[9][1]
    if state.compensation is not None:
        raise run.fail("E344", word, "G79 while cutter compensation is on")
    if state.stored is None:
        code = "E340" if state.pattern is None else "E341"
        raise run.fail(code, word, "G79, but no cycle is stored")
    if state.pattern is not None and block.axes:
        raise run.fail("E207", block.word(block.axes[0]), "G79 with a place, but a pattern is waiting")
    if state.pattern is None and not block.axes:
        _drill(run, state.stored)
        return
    for x, y in state.pattern or (_here(run),):
        run.rapid({0: x, 1: y})
        _drill(run, state.stored)
    state.pattern = None


def _drill(run: Run, cycle: Stored) -> None:
    """One hole where the tool stands."""
    above = run.state.program[2]
    clear = above - cycle.withdraw
    if cycle.withdraw > 0.0:
        run.rapid({2: clear})
    steps = degression(cycle.depth, cycle.first or cycle.depth, cycle.less)
    depth = clear
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
    run.rapid({2: clear})
    if cycle.withdraw > 0.0:
        run.rapid({2: above})
