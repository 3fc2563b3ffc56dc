"""Brackets of the columns engine against closed forms; counts: `test_counts.py`."""

from __future__ import annotations

from itertools import pairwise
from math import acos, pi, sqrt

import numpy as np
import pytest
from referee import CUTTERS, ball, bull, flat, lowest

import vmachining as vm
from vmachining.engines.columns import ColumnsEngine, FlatStock
from vmachining.engines.protocol import NOTHING
from vmachining.errors import EngineError
from vmachining.geometry import Arc, Line
from vmachining.sweep import Sweep

BOX = FlatStock((-20.0, -20.0, -40.0), (40.0, 20.0, 0.0))


def line(tool, a, b) -> Sweep:
    return Sweep.along(tool, Line(a, b))


def segment(r: float, depth: float) -> float:
    """Area of a disc of radius r below a chord `depth` above its lowest point; deeper it continues as a strip."""
    d = min(depth, r)
    return r * r * acos((r - d) / r) - (r - d) * sqrt(2 * r * d - d * d) + 2 * r * (depth - d)


def cap(r: float, depth: float) -> float:
    """Volume of a ball below the same plane, with the cylinder over it."""
    d = min(depth, r)
    return pi * d * d * (r - d / 3) + pi * r * r * (depth - d)


@pytest.mark.parametrize("depth", [0.001, 0.1, 1.0, 5.0, 12.0])
def test_slot_of_a_ball(depth):
    tool, r, _ = ball()
    engine = ColumnsEngine(BOX, 1e-3, 0.0)
    found = engine.cut(line(tool, (0, 0, -depth), (20, 0, -depth)))
    exact = 20 * segment(r, depth) + cap(r, depth)
    assert found.proven
    assert found.lo <= exact <= found.hi
    assert found.width <= 1.01e-3 * exact + 3e-7
    assert engine.cut(line(tool, (20, 0, -depth), (0, 0, -depth))) == NOTHING


@pytest.mark.parametrize("angle", [0.0, 0.3, pi / 4])
@pytest.mark.parametrize("depth", [0.5, 7.0])
def test_turned_slot_of_a_flat_end(angle, depth):
    tool, r, _ = flat()
    there = (15 * np.cos(angle), 15 * np.sin(angle), -depth)
    found = ColumnsEngine(BOX, 1e-3, 0.0).cut(line(tool, (0, 0, -depth), there))
    assert found.lo <= depth * (30 * r + pi * r * r) <= found.hi


@pytest.mark.parametrize("make", CUTTERS.values(), ids=CUTTERS.keys())
def test_plunge(make):
    """Pappus: 2 pi times the integral of (depth - phi) r, by Gauss on 2,000 steps."""
    tool, r, under = make()
    depth = 6.0
    found = ColumnsEngine(BOX, 1e-3, 0.0).cut(line(tool, (5, 0, 4), (5, 0, -depth)))
    edges = np.linspace(0.0, r, 2001)
    nodes, weights = np.polynomial.legendre.leggauss(4)
    half = 0.5 * np.diff(edges)[:, None]
    rho = 0.5 * (edges[1:] + edges[:-1])[:, None] + half * nodes
    exact = 2 * pi * (half * weights * rho * np.maximum(depth - under(rho), 0.0)).sum()
    assert found.lo - 1e-5 * exact <= exact <= found.hi + 1e-5 * exact
    assert found.width <= 1.01e-3 * exact


def test_through_the_bottom_at_a_corner_and_without_depth():
    tool, r, _ = flat()
    plate = FlatStock((0.0, 0.0, -5.0), (30.0, 30.0, 0.0))
    engine = ColumnsEngine(plate, 1e-4, 0.0)
    found = engine.cut(line(tool, (0, 0, 5), (0, 0, -9)))
    assert found.lo <= 5.0 * pi * r * r / 4 <= found.hi
    assert engine.cut(line(tool, (10, 10, 0), (20, 10, 0))).hi == 0.0
    assert engine.cut(line(tool, (10, 10, 3), (20, 10, 7))) == NOTHING


def ring(make):
    """A full circle: 2 pi R times the area of the section, Pappus again, where the sweep does not cover the middle."""
    tool, r, under = make()
    depth, way = 3.0, 14.0
    arc = Arc((way, 0, -depth), (0, 0, -depth), angle=2 * pi)
    stock = FlatStock((-25.0, -25.0, -10.0), (25.0, 25.0, 0.0))
    found = ColumnsEngine(stock, 0.01).cut(Sweep.along(tool, arc))
    x = np.linspace(-r, r, 400_001)
    return found, 2 * pi * way * np.trapezoid(np.maximum(depth - under(np.abs(x)), 0.0), x)


@pytest.mark.parametrize("make", [ball, bull, flat], ids=["ball", "bull", "flat"])
def test_ring_of_a_level_arc(make):
    found, exact = ring(make)
    assert found.lo - 1e-5 * exact <= exact <= found.hi + 1e-5 * exact
    assert found.width <= 0.0101 * exact


def test_round_stock():
    bar = FlatStock((-10.0, -10.0, -8.0), (10.0, 10.0, 0.0), 10.0)
    tool = vm.FlatEnd(diameter=50.0, length=60.0)
    found = ColumnsEngine(bar, 1e-4, 0.0).cut(line(tool, (-2, 0, -3), (2, 0, -3)))
    assert found.lo <= 300.0 * pi <= found.hi
    side = ColumnsEngine(bar, 1e-3, 0.0).cut(line(tool, (0, 25, -3), (1, 25, -3)))
    n = 2000
    x, y = np.meshgrid((np.arange(n) + 0.5) / n * 20 - 10, (np.arange(n) + 0.5) / n * 20 - 10)
    hit = (np.hypot(np.maximum(np.abs(x - 0.5) - 0.5, 0), y - 25) <= 25) & (np.hypot(x, y) <= 10)
    assert side.lo * (1 - 1e-3) <= 3.0 * hit.sum() * (20 / n) ** 2 <= side.hi * (1 + 1e-3)


def test_an_arc_run_again_takes_nothing():
    """Backwards, deeper nowhere: the cover rule of arcs of one circle; over the joint of two pieces to the floor alone."""
    tool, _, _ = bull()
    engine = ColumnsEngine(BOX, 0.01)
    helix = Arc((9, 0, -2), (0, 0, -2), angle=1.5, rise=-0.5)
    engine.cut(Sweep.along(tool, helix))
    joint = Arc(helix.position(0.9), helix.center, angle=-1.2, rise=0.4)
    assert engine.cut(Sweep.along(tool, joint)).hi <= engine.width_mm3
    within = Arc(helix.position(0.9), helix.center, angle=-0.5, rise=0.5 / 3.0)
    assert engine.cut(Sweep.along(tool, within)).hi == 0.0


@pytest.mark.slow  # 5 s
def test_sum_of_a_program_is_the_volume_of_its_union():
    """700 blocks: what they take together, against a fine grid of columns of the same sweeps."""
    tool, r, under = ball()
    rng = np.random.default_rng(1)
    stock = FlatStock((0.0, 0.0, -12.0), (30.0, 20.0, 0.0))
    engine = ColumnsEngine(stock, 0.02)
    way = [np.array([0.0, 0.0, -2.0])]
    for k in range(700):
        step = [0.8 if (k // 38) % 2 == 0 else -0.8, 0.0, 0.0] if k % 38 else [0.0, 0.4, 0.0]
        there = way[-1] + step
        there[2] = -4.0 + 2.5 * np.sin(there[0] / 5.0) + rng.normal() * 0.05
        way.append(there)
    n = 250
    x, y = (a.ravel() for a in np.meshgrid((np.arange(n) + 0.5) / n * 30, (np.arange(n) + 0.5) / n * 20))
    left, lo, hi = np.zeros(n * n), 0.0, 0.0
    for a, b in pairwise(way):
        found = engine.cut(line(tool, a, b))
        lo, hi = lo + found.lo, hi + found.hi
        near = (np.abs(x - a[0]) < r + 1) & (np.abs(y - a[1]) < r + 1)
        left[near] = np.minimum(left[near], lowest(a, b, r, under, x[near], y[near]))
    union = -left.mean() * 600.0
    assert lo * (1 - 5e-4) <= union <= hi * (1 + 5e-4)
    assert (hi - lo) <= 0.03 * union
    assert engine.volume.holds(7200.0 - union, 5e-4 * union)


def test_touch_changes_nothing_and_a_checkpoint_goes_on_alike(tmp_path):
    tool, _, _ = ball()
    engine = ColumnsEngine(BOX, 0.01)
    engine.cut(line(tool, (0, 0, -3), (10, 0, -3)))
    engine.cut(Sweep.along(tool, Arc((10, 0, -3), (10, 5, -3), angle=1.0)))
    ways = (Line((5, -6, -2), (9, 6, -4)), Arc((12, -4, -5), (8, -4, -5), angle=-2.0, rise=1.0))
    again = [Sweep.along(tool, way) for way in ways]
    touched = [engine.touch(sweep) for sweep in again]
    engine.save(tmp_path / "state.npz")
    other = ColumnsEngine.load(tmp_path / "state.npz")
    assert [engine.touch(sweep) for sweep in again] == touched == [other.touch(sweep) for sweep in again]
    assert engine.cut(again[1]) == other.cut(again[1]) == touched[1]
    assert engine.cut(again[0]) == other.cut(again[0])
    assert other.volume == engine.volume


def test_what_columns_do_not_take_is_refused_and_changes_nothing():
    engine = ColumnsEngine(BOX)
    short = vm.FlatEnd(diameter=8.0, length=5.0)
    with pytest.raises(EngineError, match="dips below"):
        engine.cut(line(short, (0, 0, -8), (5, 0, -8)))
    dovetail = vm.Taper(diameter=10.0, taper_deg=-20.0, length=8.0)
    with pytest.raises(EngineError, match="dips below"):
        engine.cut(line(dovetail, (0, 0, -5), (5, 0, -5)))
    assert engine.volume.estimate == engine.stock_volume.estimate


def test_two_cutters_in_one_job():
    """A ball of the same radius behind a flat end at the same height takes nothing; the other way round, the rest."""
    big, r, _ = flat(5.0)
    engine = ColumnsEngine(BOX, 1e-3, 0.0)
    engine.cut(line(ball(5.0)[0], (0, 0, -6), (20, 0, -6)))
    rest = engine.cut(line(big, (0, 0, -6), (20, 0, -6)))
    exact = 6.0 * (40 * r + pi * r * r) - 20 * segment(r, 6.0) - cap(r, 6.0)
    assert rest.lo <= exact <= rest.hi
    assert engine.cut(line(ball(4.0)[0], (0, 0, -6), (20, 0, -6))).hi <= 1e-6
