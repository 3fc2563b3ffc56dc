"""Curves as SVG that stands in a page: colours of its style sheet, no script. Many points are thinned to what can be seen."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats
from vmachining.report.page import environment

Scale = Callable[[Floats], Floats]

WIDTH, LEFT, RIGHT, TOP, BOTTOM = 1100, 64, 14, 12, 40
COLOURS = ("first", "after", "fourth", "fifth", "second", "third")
"""Of the style sheet, in the order of the curves."""


class Curve(NamedTuple):
    """x, y : (n,), NaN breaks the line. stepped : y[k] holds from x[k] to x[k + 1]."""

    name: str
    x: Floats
    y: Floats
    stepped: bool = False
    dashed: bool = False


class Mark(NamedTuple):
    """An upright line at x with words that show under the pointer."""

    x: float
    words: str
    colour: str = "bad"


def ticks(low: float, high: float, count: int = 6) -> list[float]:
    """Round numbers between two values, about `count`."""
    if not high > low:
        return [low]
    raw = (high - low) / count
    size = 10.0 ** math.floor(math.log10(raw))
    step = next(size * f for f in (1.0, 2.0, 2.5, 5.0, 10.0) if size * f >= raw)
    first = math.ceil(low / step - 1e-9)
    return [k * step for k in range(first, math.floor(high / step + 1e-9) + 1)]


def chart(
    curves: Sequence[Curve],
    *,
    x: str,
    y: str,
    marks: Sequence[Mark] = (),
    levels: Sequence[tuple[str, float]] = (),
    height: int = 280,
    zero: bool = False,
) -> str:
    """One picture. x, y : what the axes show. levels : named heights, dashed. zero : y begins at 0."""
    known = [c for c in curves if np.isfinite(c.y).any()]
    values = np.concatenate([np.zeros(0), *(c.y[np.isfinite(c.y)] for c in known), [v for _, v in levels]])
    places = np.concatenate([np.zeros(0), *(c.x[np.isfinite(c.x)] for c in known)])
    low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 1.0)
    left, right = (float(places.min()), float(places.max())) if len(places) else (0.0, 1.0)
    low = min(low, 0.0) if zero else low
    edge = 0.06 * (high - low) or 1.0
    low, high = (low if zero else low - edge), high + edge
    right = right if right > left else left + 1.0

    def across(v: Floats | float) -> Floats:
        return np.asarray(LEFT + (np.asarray(v) - left) / (right - left) * (WIDTH - LEFT - RIGHT))

    def up(v: Floats | float) -> Floats:
        return np.asarray(height - BOTTOM - (np.asarray(v) - low) / (high - low) * (height - TOP - BOTTOM))

    drawn = [(c, _way(c, across, up), COLOURS[k % len(COLOURS)]) for k, c in enumerate(curves)]
    return environment().get_template("chart.svg.j2").render(
        wide=WIDTH, tall=height, left=LEFT, right=WIDTH - RIGHT, low=height - BOTTOM, high=TOP, x=x, y=y, curves=drawn,
        heights=[(v, float(up(v))) for v in ticks(low, high, 5)],
        places=[(v, float(across(v))) for v in ticks(left, right, 10)],
        levels=[(name, float(up(v))) for name, v in levels], marks=[(mark, float(across(mark.x))) for mark in marks],
    )  # fmt: skip


def _way(curve: Curve, across: Scale, up: Scale) -> str:
    """The d of a path; of many points in one pixel the lowest and the highest stay."""
    x, y = np.asarray(curve.x, dtype=np.float64), np.asarray(curve.y, dtype=np.float64)
    if curve.stepped and len(x) > 1:
        x, y = np.repeat(x, 2)[1:], np.repeat(y, 2)[:-1]
    px, py = across(x), up(y)
    if len(px) > 4 * WIDTH:
        column = np.floor(px).astype(np.int64)
        order = np.lexsort((py, column))
        first = np.flatnonzero(np.diff(column[order], prepend=-(10**9)))
        last = np.append(first[1:], len(order)) - 1
        keep = np.sort(np.concatenate([order[first], order[last]]))
        px, py = px[keep], py[keep]
    out, pen = [], False
    for a, b in zip(px.tolist(), py.tolist(), strict=True):
        if not math.isfinite(a + b):
            pen = False
            continue
        out.append(f"{'L' if pen else 'M'}{a:.1f} {b:.1f}")
        pen = True
    return "".join(out)
