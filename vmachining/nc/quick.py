"""The short cut: blocks that only move, in the order of words that posts write, with the result of the long way.

    [N] [G0 G1 G2 G3] [X] [Y] [Z] [A] [B] [C] [I] [J] [K] [F] [comment]

Under cutter compensation the move goes through it (`offset`). What needs more than the modal state (turned coordinates,
centres by R, the first word of a rotary axis, an error, a warning about the arc) is left to the long way.
"""

from __future__ import annotations

import math
import re
from operator import attrgetter
from typing import Any, Final

from vmachining.nc.arcs import check_center, is_rounded
from vmachining.nc.model import Motion, Move
from vmachining.nc.refusal import ArcError, CompensationError
from vmachining.nc.run import SLOWEST_MM_MIN
from vmachining.nc.state import ORIGIN, State
from vmachining.nc.vectors import add

_N = r"([+-]?(?:[0-9]{1,9}(?:\.[0-9]*)?|\.[0-9]+))[ \t]*"
BLOCK: Final = re.compile(
    r"(?:[Nn]([0-9]{1,9})[ \t]*)?(?:[Gg]0?([0-3])[ \t]*)?"
    rf"(?:[Xx][ \t]*{_N})?(?:[Yy][ \t]*{_N})?(?:[Zz][ \t]*{_N})?(?:(?=[AaBbCcIiJjKk])(?:[Aa][ \t]*{_N})?(?:[Bb][ \t]*{_N})?"
    rf"(?:[Cc][ \t]*{_N})?(?:[Ii][ \t]*{_N})?(?:[Jj][ \t]*{_N})?(?:[Kk][ \t]*{_N})?)?(?:[Ff][ \t]*{_N})?"
    r"(?:\((?![ \t]*[Aa][Bb][Oo][Rr][Tt])[^()]*\)[ \t]*)?"
)

Groups = tuple[str | float | None, ...]

_CODES: Final = {"0": 0, "1": 10, "2": 20, "3": 30, "00": 0, "01": 10, "02": 20, "03": 30}
_MOTIONS: Final = {0: Motion.RAPID, 10: Motion.LINEAR, 20: Motion.ARC_CW, 30: Motion.ARC_CCW}
_THREE_AXES: Final = tuple(Move._field_defaults.values())
"""The fields of a move that three axes do not use."""

CHANGED: Final = attrgetter("motion", "feed", "sim", "machine", "rotary")
"""What a move changes of a state."""

_make = tuple.__new__  # Move(...) itself takes twice as long


def quick_move(state: State, words: Groups, line: int, n: int | None, arcs: bool) -> Move | None:
    """The move of a block; the state after it. None, and nothing changed, where it is for the long way.

    state : `plain`. words : of `BLOCK`, the code as text. arcs : I J K count from the start.
    """
    _, code, x, y, z, a, b, c, i, j, k, f, = words  # fmt: skip
    motion = state.motion if code is None else _CODES.get(code)  # type: ignore[arg-type]
    if state.cycle is not None:  # G0 to G3 end it
        return None
    turning = a is not None or b is not None or c is not None
    if motion not in _MOTIONS or not (x is not None or y is not None or z is not None or turning):
        return None
    feed, scale, mode, start = state.feed, state.scale, state.feed_mode, state.sim
    if mode == 940:
        if f is not None:
            feed = float(f) * scale
        if not (feed and feed > 0.0) and (motion or f is not None):
            return None
    elif mode == 930 and motion in (0, 10) and (f is not None) == (motion == 10):
        feed = float(f) if f is not None else None
        if feed is not None and not feed > 0.0:
            return None
    else:
        return None
    if motion and state.direction == 0 and not state.warned_stopped:
        return None
    back = state.to_sim
    ox, oy, oz = back if state.absolute else start
    end = (
        start[0] if x is None else float(x) * scale + ox,
        start[1] if y is None else float(y) * scale + oy,
        start[2] if z is None else float(z) * scale + oz,
    )
    program = end if back == ORIGIN else (end[0] - back[0], end[1] - back[1], end[2] - back[2])
    center = None
    if motion >= 20:
        plane = state.plane
        centre = {"I": i, "J": j, "K": k}
        first, second = (centre[letter] for letter in plane.words)
        if (
            turning
            or not arcs
            or state.absolute_center
            or centre[plane.wrong] is not None
            or first is second is None
        ):
            return None
        u, v = plane.first, plane.second
        begin = start[u] - back[u], start[v] - back[v]
        middle = begin[0] + float(first or 0.0) * scale, begin[1] + float(second or 0.0) * scale
        try:
            if is_rounded(check_center(begin, (program[u], program[v]), middle, scale != 1.0)):
                return None
        except ArcError:
            return None
        center = middle[0] + back[u], middle[1] + back[v]
    elif i is not None or j is not None or k is not None:
        return None
    along = feed
    if mode == 930 and feed is not None:
        along = max(feed * math.dist(start, end), SLOWEST_MM_MIN)
    rest = _THREE_AXES if not state.coolant else (*_THREE_AXES[:-1], state.coolant)
    if turning or state.rotary or state.centred:
        before = after = state.rotary
        if state.rotary_work or state.rotary_g92:
            return None
        duration, turned = None, 0.0
        if turning:
            after = dict(before)
            for axis, value in (("a", a), ("b", b), ("c", c)):
                if value is not None:
                    old = before.get(axis)
                    if old is None:
                        return None
                    new = after[axis] = float(value) + (0.0 if state.absolute else old)
                    turned = max(turned, abs(new - old))
        if turned > 0.0 and motion and feed and along:
            if mode == 930:
                duration = 60.0 / feed
            elif start == end:
                duration = 60.0 * turned / (along / scale)
        rest = (None, None, before, after, after, state.centred, duration, *rest[7:])
        state.rotary = after
    state.motion, state.feed, state.sim = motion, feed, end
    lag = state.lag
    state.machine = machine = end if lag == ORIGIN else add(end, lag)
    move: Move = _make(
        Move,
        (
            line, n, _MOTIONS[motion], start, end, state.plane.name, center, 1 if center is not None else 0,
            along if motion else None, state.tool, state.speed * state.direction, 0.0, machine, program, *rest,
        ),
    )  # fmt: skip
    return move


def offset(state: State, move: Move, before: tuple[Any, ...]) -> list[Move] | None:
    """What cutter compensation makes of a move. None, and the state as `before`, where it has to say something."""
    assert state.compensation is not None
    try:
        step = state.compensation.accept(move)
    except CompensationError:
        step = None
    if step is None or step.warnings:
        state.motion, state.feed, state.sim, state.machine, state.rotary = before
        return None
    state.compensation = step.after
    return step.moves
