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
"""

from __future__ import annotations

from typing import Final, NamedTuple

from vmachining.nc.arcs import Plane
from vmachining.nc.codes import spell
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
    repeats = block.value("L")
    if repeats is None:
        repeats = 1.0
    if repeats == 0.0 and run.settings.family:  # stored, and drilled by the next block
        state.cycle = cycle
        return
    if repeats < 1.0 or repeats != int(repeats) or repeats > MAX_REPEATS:
        raise run.fail("E336", block.word("L"), f"L{repeats:g} is not a whole number of holes")
    state.cycle = cycle
    clear = _levels(run, cycle)[0]
    level = state.program[plane.normal]
    if cycle.code != 870 and (
        level < clear - ROUNDING_MM
        or (cycle.initial < clear - ROUNDING_MM and abs(level - clear) <= ROUNDING_MM)
    ):  # the second has no length: as the reference control
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
    if (
        cycle.p is not None
        and (cycle.p or not run.settings.family)
        and code in (740, 760, 820, 840, 860, 880, 890)
    ):
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
    run.warn(
        "W345", word, f"in this plane the reference control feeds the tap away from its hole: {level:g} mm"
    )
    sim, machine = run.place({normal: level})
    here = state.program
    hole = [level if axis == normal else here[axis] for axis in range(3)]
    run.cut({axis: hole[k] for axis, k in enumerate(_BESIDE[state.plane.name])})
    state.tip = None if state.sim == sim else state.sim
    state.sim, state.machine = sim, machine  # the control continues as if the tap stood in its hole


def _pecks(run: Run, cycle: Cycle, normal: int, clear: float, bottom: float) -> None:
    step, gap, depth = cycle.q or 0.0, run.settings.peck_clearance_mm, clear
    if (clear - bottom) / step > MAX_PECKS:
        raise run.fail(
            "E334", run.block.word("Q") or run.block.culprit(), f"over {MAX_PECKS} steps in one hole"
        )
    less, least = run.state.shrink or (0.0, 0.0)
    while True:
        if step <= ROUNDING_MM:
            word = run.block.word("Q") or run.block.culprit()
            raise run.fail(
                "E334", word, "the pecks shrink to zero above the bottom: K, the smallest peck, is missing"
            )
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
