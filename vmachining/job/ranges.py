"""What a program asks of a machine beyond its ranges: feed, spindle, travel of slides and rotary axes, legs; as findings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from vmachining.arrays import Bools, Floats
from vmachining.errors import KinematicsError, NCError
from vmachining.job.mill import Mill
from vmachining.job.paths import is_arc, places
from vmachining.job.timing import Driven, slide_speeds
from vmachining.job.toolpath import Toolpath
from vmachining.machine import Machine
from vmachining.nc import (
    Finding,
    Move,
    Program,
    beyond_travel,
    decode_program,
    finding,
    is_g_code,
    lex_line,
    split_lines,
)

OVER = 1.0 + 1e-6
"""Feeds and speeds are printed with a few digits."""

ANGLE_EPS_DEG = 1e-6

INSIDE = np.linspace(0.0, 1.0, 9)[1:]
"""Where slides and legs are looked at in a straight block: its end, and seven places before it."""

EACH_TURN = 128
"""The same on an arc, for each whole turn."""


def range_findings(program: Program, mill: Mill) -> list[Finding]:
    """W377 feed, W378 spindle, E373 travel, E377 legs, E378 a path that the machine cannot take.

    A feed or speed is named once, where it is first beyond, with the number of motions; travel once for each line.
    """
    out = list(_spindle(program, mill))
    out += _travel(program.moves, mill)
    try:
        out += _feeds(program, mill)
    except (NCError, KinematicsError) as exc:
        line = getattr(exc, "line", None) or 1
        out.append(finding("E378", line, None, exc.message, hint=exc.remedy or ""))
    return out


def unchecked(mill: Mill) -> str:
    """What the machine does not say, so that it was not looked at; "" for nothing."""
    limits, chain = mill.limits, mill.chain
    slides = [] if chain is None else [chain.axes[k] for k in chain.slides]
    fast = limits.max_feed_mm_min or limits.axis_feed_mm_min or any(np.isfinite(a.max_speed) for a in slides)
    travel = limits.travel_mm or any(np.isfinite([a.lower, a.upper]).any() for a in slides) or mill.legs
    turns = [a for a in (chain.axes if chain is not None else ()) if a.is_rotary]
    rotary = all(np.isfinite([a.lower, a.upper]).any() for a in turns) or mill.legs
    known = {
        "largest feed (max_feed_mm_min)": fast, "smallest feed (min_feed_mm_min)": limits.min_feed_mm_min,
        "spindle (spindle_rev_min)": limits.spindle_rev_min, "travel (travel_mm)": travel, "travel of rotary axes": rotary,
    }  # fmt: skip
    missing = [words for words, told in known.items() if not told]
    return f"{mill.name} does not say, so it was not checked: {', '.join(missing)}" if missing else ""


def _feeds(program: Program, mill: Mill) -> Iterator[Finding]:
    driven, limits = Driven.of(Toolpath.of(program, mill.chain)), mill.limits
    feed = np.where(driven.fast | (driven.length == 0), np.nan, driven.feed)
    path, speeds = limits.max_feed_mm_min or np.inf, slide_speeds(limits.axes, mill.chain)
    own = np.divide(speeds, driven.peaks, out=np.full(driven.peaks.shape, np.inf), where=driven.peaks > 1e-12)
    caps = np.stack([np.full(len(feed), path), *own.T, driven.allowed])
    names = ("the path", *"XYZ", "the turn of the rotary axes")
    by, least = np.argmin(caps, axis=0), caps.min(axis=0)
    over, lines = feed > OVER * least, _Lines(program)
    for k, count in _first(feed, by, over):
        low = float(least[(feed == feed[k]) & (by == by[k]) & over].min())
        most = f"the machine feeds at {low:.6g} mm/min at most" if by[k] == 0 else ""
        what = most or f"{names[by[k]]} limits it to {low:.6g} mm/min"
        yield lines.named("W377", program.moves[k], "F", f"F{feed[k]:.6g} mm/min in {count} motions: {what}")
    if limits.min_feed_mm_min is not None:
        for k, count in _first(feed, by * 0, feed * OVER < limits.min_feed_mm_min):
            what = f"F{feed[k]:.6g} mm/min in {count} motions: the machine feeds at {limits.min_feed_mm_min:g} mm/min at least"
            yield lines.named("W377", program.moves[k], "F", what)


def _spindle(program: Program, mill: Mill) -> Iterator[Finding]:
    if mill.limits.spindle_rev_min is None:
        return
    low, high = mill.limits.spindle_rev_min
    speed = np.abs([move.spindle_rpm for move in program.moves])
    lines = _Lines(program)
    for k, count in _first(speed, speed * 0, (speed > OVER * high) | ((speed > 0) & (speed * OVER < low))):
        what = f"S{speed[k]:.6g} in {count} motions: the spindle turns at {low:g} to {high:g} rev/min"
        yield lines.named("W378", program.moves[k], "S", what)


def _first(values: Floats, kinds: Floats, hit: Bools) -> Iterator[tuple[int, int]]:
    """The first of each value and kind that is hit, and how many are like it; in program order."""
    k = np.flatnonzero(hit)
    pairs = np.column_stack([values[k], kinds[k]])
    _, first, counts = np.unique(pairs, axis=0, return_index=True, return_counts=True)
    for i in np.argsort(first):
        yield int(k[first[i]]), int(counts[i])


def _travel(moves: Sequence[Move], mill: Mill) -> Iterator[Finding]:
    chain, given = mill.chain, mill.limits.travel_mm
    box = np.array([(-np.inf, np.inf)] * 3 if given is None else given)
    for j, name in enumerate("XYZ"):
        for axis in () if chain is None else (chain.axes[k] for k in chain.slides):
            if axis.name.upper() == name:
                box[j] = max(box[j, 0], axis.lower), min(box[j, 1], axis.upper)
    low, high = ((float(a), float(b), float(c)) for a, b, c in box.T)
    if np.isfinite(box).any() and mill.legs is None:
        yield from beyond_travel([move for move in moves if not move.tcp], low, high)
    if chain is None or not chain.rotary:
        return
    turning = (chain.axes[k] for k in chain.rotary)
    ends = {axis.name.lower(): np.degrees([axis.lower, axis.upper]) for axis in turning}
    seen: set[int] = set()
    for move in moves:
        angles = move.rotary_deg or {}
        for name, (least, most) in ends.items():
            value = angles.get(name, 0.0)
            if not least - ANGLE_EPS_DEG <= value <= most + ANGLE_EPS_DEG and move.line not in seen:
                seen.add(move.line)
                what = f"{name.upper()} would turn to {value:.6g} degrees, its travel is {least:.6g} to {most:.6g}"
                yield finding("E373", move.line, move.n, what)
        if move.line in seen:
            continue
        if mill.legs is not None:
            tips, axes = _poses(move, chain)
            if (told := mill.legs.complaint(mill.legs.home + tips, axes)) is not None:
                seen.add(move.line)
                yield finding("E377", move.line, move.n, told[1])
        elif move.tcp and np.isfinite(box).any():
            q = chain.named(chain.place(_turned(move, chain), places(move, _inside(move)))[0])
            for j, name in enumerate("XYZ"):
                values = q.get(name, q.get(name.lower(), np.zeros(1))).tolist()
                far = max(values, key=lambda v: max(low[j] - v, v - high[j]))
                if far < low[j] - ANGLE_EPS_DEG or far > high[j] + ANGLE_EPS_DEG:
                    seen.add(move.line)
                    what = f"{name} would go to {far:.6g} mm, its travel is {low[j]:g} to {high[j]:g} mm"
                    yield finding("E373", move.line, move.n, f"{what} (part where the machine file has it)")
                    break


def _inside(move: Move) -> Floats:
    """(k,) shares of the way of a block."""
    if not is_arc(move):
        return INSIDE
    return np.linspace(0.0, 1.0, 1 + EACH_TURN * max(move.turns or 1, 1))[1:]


def _turned(move: Move, chain: Machine) -> Floats:
    """(k, m) rotary joints along a block, slides 0."""
    first, inside = move.rotary_start or {}, _inside(move)
    ends = {name: (first.get(name, 0.0), end) for name, end in (move.rotary_deg or {}).items()}
    names = {name: start + inside * (end - start) for name, (start, end) in ends.items()}
    return np.broadcast_to(chain.joints(degrees=True, **names), (len(inside), len(chain.axes)))


def _poses(move: Move, chain: Machine) -> tuple[Floats, Floats]:
    """(k, 3) tips, counted from home, and tool axes."""
    inside = _inside(move)
    tips = places(move, inside)
    if not move.tcp:  # machine coordinates, without the way that offsets are taken from
        tips = tips + (np.array(move.end_machine) - np.array(move.end))
    if move.axis_end is not None:
        start, end = np.array(move.axis_start or (0.0, 0.0, 1.0)), np.array(move.axis_end)
        return tips, np.asarray(start + inside[:, None] * (end - start))
    return tips, chain.forward(_turned(move, chain)).axis


class _Lines:
    """Where a word stands: in the line of a motion, or in the nearest line above it."""

    def __init__(self, program: Program) -> None:
        known = is_g_code(program.dialect)
        self.texts = list(split_lines(decode_program(program.data, program.name))) if known else []

    def named(self, code: str, move: Move, letter: str, what: str) -> Finding:
        for line in range(min(move.line, len(self.texts)), 0, -1):
            if letter in self.texts[line - 1].upper():
                word = next((w for w in lex_line(self.texts[line - 1]).words if w.letter == letter), None)
                if word is not None:
                    number = move.n if line == move.line else None
                    return finding(code, line, number, what, word.text, word.col)
        return finding(code, move.line, move.n, what)
