"""Integrals of sweeps over cells, against sums over fine grids of surfaces found by a search."""

from __future__ import annotations

import numpy as np
import pytest
from referee import CUTTERS, lowest

from vmachining.engines.columns.cutters import underside
from vmachining.engines.columns.patches._kernels import FOUR, RECT, rectangle, room
from vmachining.engines.columns.surface._kernels import COLUMNS, OF

GRID = 80
STEP = (2.0 * np.arange(GRID) + 1.0) / GRID - 1.0


def motion(rng: np.random.Generator) -> np.ndarray:
    """Long and short, level, steep and turned, along an axis and nearly so."""
    there = rng.normal(size=3) * rng.choice([0.3, 1.0, 4.0])
    kind = rng.integers(5)
    if kind == 0:
        there[1] = 0.0
    elif kind == 1:
        there[0] = 1e-4 * there[1]
    if rng.random() < 0.4:
        there[2] = 0.0
    return there


@pytest.mark.parametrize("make", CUTTERS.values(), ids=CUTTERS.keys())
def test_room_under_the_top_over_one_cell(make):
    """Tops above the sweep and through it; most brackets are narrow."""
    tool, r, under = make()
    cutter = underside(tool.profile)
    head, part = cutter.head[None].copy(), cutter.part[None].copy()
    rng, scratch, widths = np.random.default_rng(0), (np.zeros((5, 16, 2)), np.zeros((16, 16))), []
    for _ in range(150):
        a, d = rng.uniform(-2, 2, 3), motion(rng)
        top = a[2] + rng.choice([9.0, rng.uniform(0.1, 3.0)])
        length = np.hypot(d[0], d[1])
        row = np.zeros((1, COLUMNS))
        row[0, :7], row[0, OF] = [*a, d[0] / length, d[1] / length, length, d[2] / length], -1.0
        (x, y), (hx, hy) = rng.uniform(-6, 6, 2), rng.uniform(0.01, 0.7, 2)
        f = lowest(a, a + d, r, under, *np.meshgrid(x + hx * STEP, y + hy * STEP))
        inside = np.isfinite(f)
        rim = max(a[2], a[2] + d[2]) + float(under(np.array(r)))
        below = rim <= top or bool(inside.all() and f.max() + 0.05 < top)
        rectangle(scratch[0], hx, hy)
        lo, hi = room(head, part, 0, row, 0, top, x, y, hx, hy, below, scratch[0], RECT, FOUR, scratch[1])
        if not np.isfinite(lo):
            continue
        area = 4.0 * hx * hy
        found = np.where(inside, np.maximum(top - f, 0.0), 0.0).mean() * area
        # of a midpoint rule: strips along a border that may be crossed, or what f changes by within tiles
        near, corner = np.hypot(hx, hy) * 2.0 / GRID, np.array([-1.0, 1.0])
        corners = lowest(a, a + d, r - near, under, *np.meshgrid(x + hx * corner, y + hy * corner))
        if np.isfinite(corners).all():
            first = max(np.abs(np.diff(f, axis=k)).max() for k in (0, 1))
            second = max(np.abs(np.diff(f, 2, axis=k)).max() for k in (0, 1))
            off = area * (second + 4.0 * first / GRID)
        else:
            off = 5.0 * area * max(top - a[2] + 3.0, 1.0) / GRID
        assert lo - off <= found <= hi + off
        if found > 0.0:
            widths.append((hi - lo) / area)
    assert len(widths) > 40
    assert np.median(widths) < 1e-4
