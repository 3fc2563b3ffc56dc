"""Each rule of docs/columns.md can be switched off: brackets become wider, and hold the truth anyway."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest
from referee import CUTTERS, lowest, program

from vmachining.engines.columns import ColumnsEngine, FlatStock, sides
from vmachining.geometry import Line
from vmachining.sweep import Sweep

RULES = {
    "R3": sides.CURVATURE, "R4": sides.ABOVE, "R5": sides.BELOW, "R7": sides.COVER, "R8": sides.FORGET,
    "closed integrals": sides.CLOSED, "crossings": sides.CROSS,
}  # fmt: skip
STOCK = FlatStock((-6.0, -5.0, -10.0), (7.0, 6.0, 0.0))
POINTS = 8_000


def cut(tool, way, rules: int):
    """Removals and the cells that they took."""
    engine = ColumnsEngine(STOCK, 0.02, 0.02)
    engine.rules = rules
    found = [engine.cut(Sweep.along(tool, Line(a, b))) for a, b in way]
    return found, engine.cells


def counted(way, radius, under) -> list[tuple[float, float]]:
    """Volume of each block and its standard error, by random columns."""
    (x0, y0, z0), (x1, y1, _) = STOCK[:2]
    x, y = np.random.default_rng(1).uniform((x0, y0), (x1, y1), (POINTS, 2)).T
    left, area, out = np.zeros(POINTS), (x1 - x0) * (y1 - y0), []
    for a, b in way:
        depth = np.maximum(left - np.maximum(lowest(a, b, radius, under, x, y), z0), 0.0)
        left -= depth
        out.append((area * depth.mean(), area * depth.std() / sqrt(POINTS)))
    return out


@pytest.mark.parametrize("make", CUTTERS.values(), ids=CUTTERS.keys())
def test_a_rule_switched_off_changes_widths_alone(make):
    tool, radius, under = make()
    way = program(np.random.default_rng(11), 10)
    on, _ = cut(tool, way, int(sides.ALL))
    truth = counted(way, radius, under)
    for name, bit in RULES.items():
        off, _ = cut(tool, way, int(sides.ALL & ~bit))
        for a, b, (volume, error) in zip(on, off, truth, strict=True):
            assert max(a.lo, b.lo) <= min(a.hi, b.hi), name
            # of rare hits the count knows no spread: at least that of columns as deep as the stock
            error = (
                max(error, sqrt(1430.0 * b.hi / POINTS)) + 1e-9
            )  # the search along the path ends at rounding
            assert b.lo - 4 * error <= volume <= b.hi + 4 * error, name


@pytest.mark.parametrize(
    ("name", "cutter"),
    [
        ("R3", "ball"),
        ("R4", "ball"),
        ("R5", "flat"),
        ("R7", "ball"),
        ("closed integrals", "ball"),
        ("crossings", "ball"),
    ],
)
def test_a_rule_saves_cells(name, cutter):
    """Not R8: it makes lists short."""
    tool, _, _ = CUTTERS[cutter]()
    way = program(np.random.default_rng(11), 10)
    _, cells_on = cut(tool, way, int(sides.ALL))
    _, cells_off = cut(tool, way, int(sides.ALL & ~RULES[name]))
    assert cells_off > 1.05 * cells_on
