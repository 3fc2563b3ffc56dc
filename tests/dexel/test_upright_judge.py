"""The quick second judge: its heights against exact rays, its intervals against closed forms, totals against sums."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from closedforms import FAMILIES, HI, LO, case_of
from scipy.stats import binom

from vmachining.engines.columns import ColumnsEngine
from vmachining.engines.dexel import RayEngine, UprightJudge, Way
from vmachining.engines.dexel.rays import CONFIDENCE
from vmachining.engines.protocol import Options
from vmachining.geometry import Arc, Line
from vmachining.stock import BoxStock, CylinderStock
from vmachining.sweep import Sweep
from vmachining.tool import BallNose, BullNose, FlatEnd, Taper

BOX = BoxStock(LO, HI)
TOOLS = {
    "ball": BallNose(diameter=6, length=60),
    "flat": FlatEnd(diameter=6, length=60),
    "bull": BullNose(diameter=6, corner_radius=1, length=60),
    "cone": Taper(diameter=2, taper_deg=12, corner_radius=0.5, length=60),
}
PATHS = {
    "level": Line((0, 0, -5), (7, 3, -5)),
    "down": Line((0, 0, -5), (7, 3, -8)),
    "up": Line((0, 0, -8), (2, -1, -5)),
    "plunge": Line((1, 1, 2), (1, 1, -6)),
    "arc": Arc((5, 0, -5), (0, 0, -5), angle=2.2),
    "clockwise": Arc((1, 0, -5), (0, 0, -5), angle=-5.0),
    "circle": Arc((5, 1, -5), (0, 0, -5), angle=2 * np.pi),
    "helix": Arc((5, 0, -4), (0, 0, -4), angle=-7.0, rise=-6.0),
    "steep helix": Arc((1.5, 0, -9), (0, 0, -9), angle=4.0, rise=7.0),
}


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("tool", TOOLS)
def test_heights_are_those_of_exact_rays(tool: str, path: str) -> None:
    """Over random places; a minimum over time that lies higher by what its bracket leaves is no lower than the truth."""
    cutter = TOOLS[tool].profile
    judge = UprightJudge(BOX, [Way(0, cutter, PATHS[path])])
    assert judge.is_whole and judge.takes(0)
    sweep = Sweep.along(cutter, PATHS[path])
    (x0, y0, _), (x1, y1, _) = sweep.bounds
    where = np.random.default_rng(3).uniform((x0, y0), (x1, y1), (600, 2))
    found = sweep.ray_intervals(np.column_stack([where, np.zeros(600)]), (0.0, 0.0, 1.0))
    first = np.concatenate([[0], np.cumsum(found.counts)])
    exact = np.array([found.enter[a] if b > a else np.inf for a, b in pairwise(first)])
    mine = judge.lowest(where)
    both = np.isfinite(exact) & np.isfinite(mine)
    assert (np.isfinite(exact) != np.isfinite(mine)).sum() <= 2  # grazing
    assert np.abs(mine[both] - exact[both]).max() < 1e-6 and both.sum() > 100


def test_closed_forms_lie_in_the_interval_as_often_as_it_says() -> None:
    answered, misses = 0, 0
    for seed in range(50_000, 50_000 + 60 * len(FAMILIES)):
        case = case_of(seed)
        last = len(case.earlier)
        ways = [Way(k, sweep.profile, sweep.path) for k, sweep in enumerate(case.earlier)]
        judge = UprightJudge(case.stock or BOX, [*ways, *(Way(last, s.profile, s.path) for s in case.block)])
        if judge.takes(last):
            found = judge.removed(last)
            answered += 1
            misses += not found.lo <= case.truth <= found.hi
    assert answered > 300  # not: tools that lean, and those that narrow
    assert misses <= binom.ppf(1.0 - 1e-4, answered, 1.0 - CONFIDENCE)


@pytest.mark.parametrize("stock", [BOX, CylinderStock((0, 0), 30, (-20, 0))])
def test_blocks_and_their_total_agree_with_columns(stock: BoxStock | CylinderStock) -> None:
    """Forty random blocks of four tools; brackets of columns are proven."""
    rng = np.random.default_rng(11)
    engine = ColumnsEngine.of(stock, Options())
    at, ways, lows, highs = np.array([0.0, 0.0, -2.0]), [], [], []
    for number in range(40):
        to = np.clip(at + rng.normal(size=3) * [6.0, 6.0, 0.7], [-35, -35, -9], [35, 35, -0.5])
        cutter = list(TOOLS.values())[number // 10].profile
        path: Line | Arc = Line(at, to)
        if number % 5 == 4:
            path = Arc(at, [*(at[:2] + rng.normal(size=2) * 4.0), at[2]], angle=rng.uniform(-4, 4), rise=-0.1)
        at = path.position(1.0)
        ways.append(Way(number, cutter, path))
        found = engine.cut(Sweep.along(cutter, path), number)
        lows.append(found.lo)
        highs.append(found.hi)
    judge = UprightJudge(stock, ways)
    assert judge.is_whole
    excluded = []
    for number in range(40):
        said = judge.removed(number)
        if said.lo > highs[number] or said.hi < lows[number]:
            excluded.append(number)
    assert len(excluded) <= 1  # a chip of some 0.01 mm3 that no place has met: then exact rays are asked
    rays = RayEngine(stock)
    for way in ways:
        rays.add(Sweep.along(way.cutter, way.path))
    for number in excluded:
        said = rays.removed([number], seed=number)
        assert said.lo <= highs[number] and said.hi >= lows[number]
    total = judge.total()
    assert total.lo <= sum(highs) and total.hi >= sum(lows)
    assert total.width < 0.01 * total.estimate


def test_what_it_does_not_know_it_does_not_judge() -> None:
    lollipop, ball = BallNose(diameter=6, length=3.5).profile, TOOLS["ball"].profile
    ways = [
        Way(0, lollipop, Line((0, 0, -9), (5, 0, -9))),  # its top stays below that of the stock
        Way(1, ball, Line((0, 2, -9), (5, 2, -9))),
        Way(2, ball, Line((0, 20, -9), (5, 20, -9))),
        Way(3, ball, Arc((0, 25, -9), (0, 25, 0), axis=0, angle=0.4)),
    ]
    judge = UprightJudge(BOX, ways)
    assert [judge.takes(k) for k in range(4)] == [False, False, True, False] and not judge.is_whole
