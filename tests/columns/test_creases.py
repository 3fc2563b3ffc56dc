"""What one sweep lies below another in a cell, against sums over fine grids of surfaces found by a search."""

from __future__ import annotations

import numpy as np
import pytest
from referee import CUTTERS, lowest

from vmachining.engines.columns.balls._kernels import ball_room
from vmachining.engines.columns.cells._kernels import look
from vmachining.engines.columns.creases._kernels import crease
from vmachining.engines.columns.cutters import underside
from vmachining.engines.columns.patches._kernels import FOUR, RECT, rectangle
from vmachining.engines.columns.sides import ALL, FIRST, SELF, SMOOTH, TOP, UP
from vmachining.engines.columns.surface._kernels import COLUMNS, FROM, OF, TO, local, poses

GRID = 120
STEP = (2.0 * np.arange(GRID) + 1.0) / GRID - 1.0
HIGH = 40.0


def placed(lines: np.ndarray, i: int, a: np.ndarray, d: np.ndarray) -> None:
    """A straight sweep of cutter 0 from a by d as row i."""
    length = np.hypot(d[0], d[1])
    lines[i] = 0.0
    lines[i, :7], lines[i, OF] = [*a, d[0] / length, d[1] / length, length, d[2] / length], -1.0


@pytest.mark.parametrize("make", CUTTERS.values(), ids=CUTTERS.keys())
def test_what_lies_below_a_smooth_surface(make):
    """Rows beside each other and paths that go on, cells at rims and crossings; many brackets are narrow."""
    tool, r, under = make()
    cutter = underside(tool.profile)
    head, part = cutter.head[None].copy(), cutter.part[None].copy()
    rng, polygons, room = np.random.default_rng(1), np.zeros((5, 16, 2)), np.zeros((16, 16))
    lines, sides, borders = np.zeros((16, COLUMNS)), np.zeros((16, 16)), np.zeros((16, 4))
    sides[TOP, UP], sides[TOP, 8], sides[TOP, UP + 7], sides[TOP, 15] = HIGH, HIGH, SMOOTH, SMOOTH
    narrow, asked = 0, 0
    for _ in range(400):
        starts = rng.uniform(-0.5, 0.5, (3, 3)) * [1.0, 2.0, 1.0]
        moves = rng.normal(size=(3, 3)) * [1.0, 0.1, 0.6]
        if rng.random() < 0.5:
            starts[2] = starts[1] + moves[1]
        h = rng.choice([0.3, 0.1, 0.03])
        angle = rng.uniform(0.0, 2.0 * np.pi)
        x, y = starts[2, :2] + rng.choice([1.0, 1.0, rng.random()]) * r * np.array(
            [np.cos(angle), np.sin(angle)]
        )
        rectangle(polygons, h, h)
        for i, a, d in zip((SELF, FIRST, FIRST + 1), starts, moves, strict=True):
            placed(lines, i, a, d)
        met = [
            look(head, part, lines, i, 0, 0, ALL, x, y, h, h, sides, borders, i)
            for i in (SELF, FIRST, FIRST + 1)
        ]
        j, b = FIRST + 1, TOP if rng.random() < 0.2 else FIRST
        if not all(met) or sides[b, UP + 7] != SMOOTH:
            continue
        lo, hi, free = crease(head, part, lines, sides, b, j, HIGH, x, y, h, h, polygons, room)
        places = np.meshgrid(x + h * STEP, y + h * STEP)
        f_k, f_b, f_j = (lowest(a, a + d, r, under, *places) for a, d in zip(starts, moves, strict=True))
        if b == TOP:
            f_b = np.full_like(f_j, HIGH)
        f_j = np.minimum(f_j, HIGH)
        found = np.maximum(f_b - f_j, 0.0)
        area = 4.0 * h * h
        steps = np.concatenate([np.abs(np.diff(found, axis=k)).ravel() for k in (0, 1)])
        off = area * (
            3.0 * steps.mean() + 1e-3 * h
        )  # of a midpoint rule: half of what changes from place to place
        assert lo - off <= found.mean() * area <= hi + off
        if free and lo > off:
            assert (f_k - f_j)[found > 0.0].min() < 1e-9
        asked += 1
        narrow += hi - lo < 1e-3 * area
    assert asked > 60
    assert narrow > 0.3 * asked


def test_parts_of_a_cell_under_a_ball_add_up():
    """Sixteen parts and the whole, with seams of steep and flat ramps, rims and tangents of both on the borders of cells."""
    rng, polygons, room, R = np.random.default_rng(2), np.zeros((5, 16, 2)), np.zeros((16, 16)), 5.0
    tool, _, _ = CUTTERS["ball"]()
    cutter = underside(tool.profile)
    head, part = cutter.head[None].copy(), cutter.part[None].copy()

    def integral(row, x, y, hx, hy):
        row[0, OF] = -1.0
        poses(head, part, 0, row, 0, x, y, hx, hy)
        xi, eta = local(row, 0, x, y)
        rectangle(polygons, hx, hy)
        return ball_room(
            row, 0, R, 30.0, row[0, FROM], row[0, TO], hx, hy, xi, eta, polygons, RECT, FOUR, room
        )

    told = 0
    for _ in range(600):
        row, way = (
            np.zeros((1, COLUMNS)),
            rng.choice([0.0, 0.5 * np.pi, 0.25 * np.pi, rng.uniform(0.0, 6.28)]),
        )
        m, length = rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-4.0, 1.0), 10.0 ** rng.uniform(-1.0, 1.0)
        placed(row, 0, np.zeros(3), length * np.array([np.cos(way), np.sin(way), m]))
        h = 10.0 ** rng.uniform(-2.0, 0.0)
        eta = rng.choice([-1.0, 1.0]) * (R - h * rng.choice([0.0, 1.0, rng.uniform(-1.0, 3.0)]))
        xi = rng.choice([0.0, length]) + m / np.sqrt(1.0 + m * m) * np.sqrt(max(R * R - eta * eta, 0.0))
        xi += rng.choice([0.0, h, rng.uniform(-1.0, 1.0) * h])
        x, y = xi * np.cos(way) - eta * np.sin(way), xi * np.sin(way) + eta * np.cos(way)
        lo, hi = integral(row, x, y, h, h)
        parts = np.array(
            [
                integral(row, x + 0.25 * h * i, y + 0.25 * h * j, 0.25 * h, 0.25 * h)
                for i in (-3, -1, 1, 3)
                for j in (-3, -1, 1, 3)
            ]
        )
        if not np.isfinite(lo) or not np.isfinite(parts).all():
            continue
        assert parts[:, 0].sum() <= hi
        assert lo <= parts[:, 1].sum()
        assert hi - lo < 1e-3 * h * h
        told += 1
    assert told > 500
