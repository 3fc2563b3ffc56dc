"""Closed integrals of a ball's sweep over cells, against sums over fine grids of surfaces found by a search."""

from __future__ import annotations

import numpy as np
from referee import ball, lowest

from vmachining.engines.columns.cutters import underside
from vmachining.engines.columns.patches._kernels import room

TOP = 9.0


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


def test_room_under_the_top_over_one_cell():
    tool, r, under = ball()
    cutter = underside(tool.profile)
    head, part = cutter.head[None], cutter.part[None]
    rng, scratch, grid, known = np.random.default_rng(0), np.zeros((5, 16, 2)), 300, 0
    step = (2.0 * np.arange(grid) + 1.0) / grid - 1.0
    for _ in range(150):
        a, d = rng.uniform(-2, 2, 3), motion(rng)
        length = np.hypot(d[0], d[1])
        row = np.array([[*a, d[0] / length, d[1] / length, length, d[2] / length, 0.0, 0.0, 0.0]])
        (x, y), (hx, hy) = rng.uniform(-6, 6, 2), rng.uniform(0.01, 0.7, 2)
        lo, hi = room(head, part, 0, row, 0, TOP, x, y, hx, hy, scratch)
        if not np.isfinite(lo):
            continue
        known += 1
        assert hi - lo <= 4e-3
        f = lowest(a, a + d, r, under, *np.meshgrid(x + hx * step, y + hy * step))
        area, inside = 4.0 * hx * hy, np.isfinite(f)
        found = np.where(inside, TOP - f, 0.0).mean() * area
        # of a midpoint rule: strips along a border that is crossed; else by the second derivatives over h^2 / 24
        crossed = inside.any() and not inside.all()
        off = area * (4.0 * TOP / grid if crossed else 2e-5)
        assert lo - off <= found <= hi + off
    assert known > 130
