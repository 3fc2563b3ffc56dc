"""Drilling cycles CYCLE81 to CYCLE89, CYCLE840, and point patterns.

Levels: RTP return plane, RFP reference plane, SDIS safety distance (s = RFP + SDIS towards RTP), DP final depth, or DPR
below RFP. Every cycle: rapid to s, body, rapid to RTP.

| cycle | body |
|---|---|
| 81, 82 | feed to the depth, 82 dwells DTB; rapid back |
| 83 | first to FDEP (FDPR), strokes that shrink by DAM (below zero: by the factor), between them rapid to s and back to the distance ahead (VARI 1), or up by VRT (VARI 0) |
| 84, 840 | feed by pitch times speed, both ways |
| 85, 89 | feed to the depth (FFR), dwell, feed back (RFF) to s |
| 86, 87, 88 | feed to the depth, rapid back; the lift off the wall with the spindle still is left out |

Source: SINUMERIK 840D sl/828D, Programming Manual Cycles (public). Distance ahead: 0.6 mm to a depth of 30 mm, then a
fiftieth of the depth, 7 mm at most.
"""  # noqa: E501

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from vmachining.nc.pen import Pen
from vmachining.nc.refusal import PenError, refused

CYCLES: Final = frozenset({81, 82, 83, 84, 85, 86, 87, 88, 89, 840})
PATTERNS: Final = ("HOLES1", "HOLES2", "CYCLE801", "CYCLE802")
MOST: Final = 20_000
ROUNDING_MM: Final = 1e-6
METRIC: Final = {1: 0.25, 1.2: 0.25, 1.6: 0.35, 2: 0.4, 2.5: 0.45, 3: 0.5, 4: 0.7, 5: 0.8, 6: 1.0, 8: 1.25, 10: 1.5,
                 12: 1.75, 14: 2.0, 16: 2.0, 18: 2.5, 20: 2.5, 22: 2.5, 24: 3.0, 27: 3.0, 30: 3.5, 33: 3.5, 36: 4.0,
                 42: 4.5, 48: 5.0}  # fmt: skip
"""Pitch of standard threads, ISO 261 coarse: what MPIT means."""

Values = Sequence[float | None]


def _at(values: Values, place: int) -> float | None:
    return values[place] if place < len(values) else None


def one_depth(name: str, reference: float, absolute: float | None, relative: float | None) -> None:
    """Raises PenError: E333 where DP and DPR disagree, of which controls take the second and say so."""
    if absolute is not None and relative and abs(abs(absolute - reference) - abs(relative)) > 1e-3:
        raise PenError(
            "E333",
            f"{name}: DP {absolute:g} and DPR {relative:g} are two depths",
            name,
            "leave one of them out",
        )


def drill(pen: Pen, number: int, values: Values) -> None:
    """The cycle where the tool stands; lengths in program units."""
    if pen.compensation is not None:
        raise PenError("E344", f"CYCLE{number} while cutter compensation is on")
    k = pen.scale
    rtp, rfp, sdis, dp, dpr = (_at(values, i) for i in range(5))
    if rtp is None or (dp is None and dpr is None):
        raise PenError("E331", f"CYCLE{number} needs its return plane and its depth")
    one_depth(f"CYCLE{number}", rfp or 0.0, dp, dpr)
    reference = (rfp or 0.0) * k
    sign = -1.0 if (dp is not None and dp * k > reference) else 1.0  # which way it drills
    bottom = dp * k if dp is not None else reference - abs(dpr or 0.0) * k
    safe, back = reference + sign * abs(sdis or 0.0) * k, rtp * k
    if sign * (back - bottom) < 0.0:
        raise PenError("E333", "a drilling cycle whose planes do not lie above its depth")
    pen.rise(safe)
    if number == 83:
        _deep(pen, values, reference, safe, bottom, sign)
    elif number in (84, 840):
        rpm = (_at(values, 10) if number == 84 else None) or pen.rpm
        feed = pen.tap_feed(_pitch(number, values), rpm, f"CYCLE{number}")
        pen.sink(bottom, feed)
        _dwell(pen, _at(values, 5))
        pen.sink(safe, feed)
    else:
        feed_in, feed_out = ((_at(values, i) or 0.0) * k if number == 85 else 0.0 for i in (6, 7))
        pen.sink(bottom, feed_in or None)
        if number not in (81, 87):
            _dwell(pen, _at(values, 5))
        if number in (85, 89):
            pen.sink(safe, feed_out or None)
        else:
            pen.rise(safe)
    pen.rise(back)


def _dwell(pen: Pen, seconds: float | None) -> None:
    """Below zero: turns of the spindle."""
    if seconds:
        turns = abs(pen.rpm)
        pen.dwell(seconds if seconds > 0.0 else -seconds * 60.0 / turns if turns else 0.0)


def _pitch(number: int, values: Values) -> float:
    size, pitch = (_at(values, i) for i in ((7, 8) if number == 84 else (9, 10)))
    if pitch:
        return abs(pitch)
    if size and abs(size) not in METRIC:
        raise PenError("E339", f"CYCLE{number}: M{abs(size):g} is not a standard thread")
    return METRIC[abs(size)] if size else 0.0


def _strokes(
    reference: float, bottom: float, sign: float, first: float, less: float, least: float
) -> list[float]:
    """Depths: strokes from `first`, shrinking, not below `least`; the last two of a degression by amount share the rest."""
    out = [first]
    stroke = abs(reference - first)
    while (left := sign * (out[-1] - bottom)) > ROUNDING_MM:
        if len(out) > MOST or stroke <= ROUNDING_MM:
            raise PenError("E339", f"over {MOST} strokes in one hole")
        if less < 0.0:
            stroke = max(stroke * -less, least)
        elif less > 0.0:
            stroke = max(stroke - less, less, least)
            if stroke == less and less < left < 2.0 * less:
                stroke = left / 2.0
        out.append(bottom if left - stroke <= ROUNDING_MM else out[-1] - sign * stroke)
    return out


def _deep(pen: Pen, values: Values, reference: float, safe: float, bottom: float, sign: float) -> None:
    k = pen.scale
    fdep, fdpr, dam, dtb, dts, frf, vari = (_at(values, i) for i in range(5, 12))
    least, lift, ahead = (_at(values, i) for i in (13, 14, 16))
    if fdep is None and not fdpr:
        raise PenError("E334", "CYCLE83 needs FDEP or FDPR, its first depth")
    first = fdep * k if fdep is not None else reference - sign * abs(fdpr or 0.0) * k
    if sign * (first - bottom) < 0.0 or sign * (reference - first) < 0.0:
        raise PenError("E333", "CYCLE83: the first depth lies outside the hole")
    if not dam and sign * (reference - first) <= ROUNDING_MM:
        raise PenError("E334", "CYCLE83: the first stroke has no length")
    less = dam * k if dam and dam > 0.0 else dam or 0.0
    depth = abs(reference - bottom)
    near = ahead * k if ahead else min(max(0.6, depth / 50.0), 7.0)
    feed = pen.feed
    for place, level in enumerate(_strokes(reference, bottom, sign, first, less, (least or 0.0) * k)):
        pen.sink(level, feed * frf if place == 0 and frf and feed and pen.feed_mode == "min" else None)
        _dwell(pen, dtb)
        if level == bottom:
            break
        if vari == 1:
            pen.rise(safe)
            _dwell(pen, dts)
            pen.rise(level + sign * min(near, abs(safe - level)))
        else:
            pen.rise(level + sign * (lift * k if lift else 1.0))
    pen.rise(safe)


def points(name: str, values: Values) -> list[tuple[float, float]]:
    """Points of a pattern in program units."""
    v = [0.0 if value is None else value for value in values] + [0.0] * 8
    if name == "HOLES1":
        x, y, angle, first, step, count = v[:6]
        a = math.radians(angle)
        return [
            (x + d * math.cos(a), y + d * math.sin(a))
            for d in (first + i * step for i in range(_count(count)))
        ]
    if name == "HOLES2":
        x, y, radius, start, step, count = v[:6]
        n = _count(count)
        step = step or 360.0 / n
        angles = [math.radians(start + i * step) for i in range(n)]
        return [(x + radius * math.cos(a), y + radius * math.sin(a)) for a in angles]
    if name == "CYCLE801":
        x, y, angle, dx, dy, columns, rows = v[:7]
        c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        out = []
        for j in range(_count(rows)):
            along = range(_count(columns)) if j % 2 == 0 else range(_count(columns) - 1, -1, -1)
            out += [(x + c * i * dx - s * j * dy, y + s * i * dx + c * j * dy) for i in along]
        return out
    masks = [f"{values[i]:.0f}" if i < len(values) and values[i] is not None else "" for i in (0, 1)]
    if not all(mask and set(mask) == {"1"} for mask in masks):
        raise refused("CYCLE802 with incremental positions", "CYCLE802")
    rest = list(values[2:])
    pairs = [(rest[i], rest[i + 1]) for i in range(0, min(len(rest) - 1, 2 * len(masks[0])), 2)]
    return [(x, y) for x, y in pairs if x is not None and y is not None]


def _count(value: float) -> int:
    if not 1.0 <= value <= MOST or value != int(value):
        raise PenError("E342", f"{value:g} is not a whole number of points")
    return int(value)
