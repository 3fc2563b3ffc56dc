"""Curves as SVG that stands in a page: colours of its style sheet, no script. Many points are thinned to what can be seen."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from html import escape
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats

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

    out = [
        f'<svg viewBox="0 0 {WIDTH} {height}" role="img" aria-label="{escape(y)} over {escape(x)}" '
        'style="width:100%;height:auto" font-size="12" fill="var(--muted)">'
    ]
    for v in ticks(low, high, 5):
        at = float(up(v))
        out.append(f'<path d="M{LEFT} {at:.1f}H{WIDTH - RIGHT}" stroke="var(--grid)"/>')
        out.append(f'<text x="{LEFT - 8}" y="{at + 4:.1f}" text-anchor="end">{v:g}</text>')
    for v in ticks(left, right, 10):
        at = float(across(v))
        out.append(f'<text x="{at:.1f}" y="{height - BOTTOM + 16}" text-anchor="middle">{v:g}</text>')
    out.append(f'<text x="{WIDTH / 2:.0f}" y="{height - 6}" text-anchor="middle">{escape(x)}</text>')
    middle = (height - BOTTOM + TOP) / 2
    out.append(f'<text transform="translate(13 {middle:.0f}) rotate(-90)" text-anchor="middle">{escape(y)}</text>')  # fmt: skip
    for name, v in levels:
        at = float(up(v))
        out.append(f'<path d="M{LEFT} {at:.1f}H{WIDTH - RIGHT}" stroke="var(--bad)" stroke-dasharray="6 5"/>')
        out.append(f'<text x="{WIDTH - RIGHT - 4}" y="{at - 4:.1f}" text-anchor="end">{escape(name)}</text>')
    for mark in marks:
        at = float(across(mark.x))
        out.append(
            f'<g><title>{escape(mark.words)}</title><path d="M{at:.1f} {TOP}V{height - BOTTOM}" stroke="var(--{mark.colour})" '
            f'stroke-opacity=".6"/></g>'
        )  # fmt: skip
    legend = []
    for k, curve in enumerate(curves):
        colour, dash = COLOURS[k % len(COLOURS)], ' stroke-dasharray="5 4"' if curve.dashed else ""
        way = _way(curve, across, up)
        out.append(f'<path d="{way}" fill="none" stroke="var(--{colour})" stroke-width="1.5"{dash}/>')
        legend.append(
            f'<span><i style="display:inline-block;width:22px;border-top:3px {"dashed" if curve.dashed else "solid"} '
            f'var(--{colour});vertical-align:middle"></i> {escape(curve.name)}</span>'
        )
    words = f'<p class="caption" style="display:flex;flex-wrap:wrap;gap:4px 22px">{"".join(legend)}</p>'
    return "".join([*out, "</svg>", words])


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
