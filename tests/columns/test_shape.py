"""The finished surface: closed, without false walls, with walls and corners where they are; closed forms."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import pytest
from referee import CUTTERS, ball, flat

import vmachining as vm
from vmachining.engines.columns import ColumnsEngine, FlatStock
from vmachining.geometry import Arc, Line
from vmachining.sweep import Sweep

SAG = 1.0 / (8.0 * 20.0**2)
"""Of a wall of radius R, by R: chords of a cell, R / 20 long, bulge by no more; so does the ball between nodes, twice."""


def closed(surface) -> bool:
    """Whether every edge has two triangles, one each way."""
    t, n = surface.triangles, len(surface.vertices)
    one = np.concatenate([t[:, a] * n + t[:, b] for a, b in ((0, 1), (1, 2), (2, 0))])
    other = np.concatenate([t[:, b] * n + t[:, a] for a, b in ((0, 1), (1, 2), (2, 0))])
    return len(np.unique(one)) == len(one) and bool((np.sort(one) == np.sort(other)).all())


def volume(surface) -> float:
    p = surface.vertices[surface.triangles]
    return float(np.einsum("ij,ij->i", p[:, 0], np.cross(p[:, 1], p[:, 2])).sum()) / 6.0


def flange() -> ColumnsEngine:
    """A round bar whose rim an end mill takes off, as far as the bar goes, and then nearer to the middle."""
    engine = ColumnsEngine(FlatStock((-40.0, -40.0, -20.0), (40.0, 40.0, 0.0), 40.0))
    tool = vm.FlatEnd(diameter=12, length=50)
    engine.cut(Sweep.along(tool, Arc((34, 0, -5), (0, 0, -5), angle=2 * pi)), 0)
    engine.cut(Sweep.along(tool, Line((34, 0, -5), (24, 0, -5))), 1)
    engine.cut(Sweep.along(tool, Arc((24, 0, -5), (0, 0, -5), angle=2 * pi)), 2)
    return engine


def test_a_flange_has_no_wall_at_its_rim():
    surface = flange().surface()
    assert closed(surface)
    r, z = np.hypot(*surface.vertices[:, :2].T), surface.vertices[:, 2]
    assert (
        z[r > 18.0 + 1e-3 * 0.3].max() <= -5.0 + 1e-12
    )  # points of walls keep a thousandth of a cell from nodes
    exact = pi * (40.0**2 * 15.0 + 18.0**2 * 5.0)
    # walls of radius 40 and 18 are chords of a cell of 0.3 mm, its diagonal at most
    sag = 2.0 * 0.3**2 / 8.0 * 2.0 * pi * (15.0 + 5.0)
    assert abs(volume(surface) - exact) <= sag


def test_the_estimate_of_what_is_left_is_at_no_end():
    """Middles of three blocks add up to 3 mm^3 beyond what one look at all that is left allows: the estimate was its end."""
    left = flange().volume
    exact = pi * (40.0**2 * 15.0 + 18.0**2 * 5.0)
    assert left.lo <= exact <= left.hi and left.lo < left.estimate < left.hi
    assert abs(left.estimate - exact) <= 0.5 * left.width * (1.0 + 1e-9)


def test_a_wall_beside_a_node_leaves_no_sliver():
    """Nodes slide in their level away from walls, and short edges of walls close up: chords of them stay on their circles."""
    cell = 0.3
    surface = flange().surface()
    p = surface.vertices[surface.triangles]
    sides = np.linalg.norm(p - np.roll(p, -1, axis=1), axis=2)
    height = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1) / sides.max(axis=1)
    assert sides.min() > 0.09 * cell and height.min() > 0.01 * cell
    assert (height < 0.05 * cell).mean() < 1e-3  # 3 % of them as the lattice and the walls meet
    r, z = np.hypot(*surface.vertices[:, :2].T), surface.vertices[:, 2]
    # the crest is where it was: no point of it is farther out, and chords of 1.2 diagonals lose no more than their sag
    top = (p[:, :, 2] == 0.0).all(axis=1)
    area = 0.5 * np.cross(p[top, 1] - p[top, 0], p[top, 2] - p[top, 0])[:, 2].sum()
    assert r[z == 0.0].max() <= 18.0 + 1e-3 * cell
    assert 0.0 <= pi * 18.0**2 - area <= 2.0 / 3.0 * 2.0 * pi * 18.0 * 1.2**2 * 2.0 * cell**2 / (8.0 * 18.0)
    assert set(np.round(z, 9).tolist()) == {0.0, -5.0, -20.0}


@pytest.mark.parametrize(("angle", "cells"), [(0.0, 1e-6), (0.4, 0.36)])
def test_slots_that_cross_have_sharp_corners(angle, cells):
    """At round numbers, where the lattice has lines if it begins at the corner of the stock, and turned.

    A tip that ends between two nodes is cut off: its height is half of sin(2 angle) of a cell at most.
    """
    tool, r, _ = flat()
    engine = ColumnsEngine(FlatStock((-40.0, -40.0, -20.0), (40.0, 40.0, 0.0)))
    u, v = np.array([np.cos(angle), np.sin(angle), 0.0]), np.array([-np.sin(angle), np.cos(angle), 0.0])
    low, deep = np.array([0.0, 0.0, -3.0]), np.array([0.0, 0.0, -5.0])
    engine.cut(Sweep.along(tool, Line(low - 60 * u, low + 60 * u)), 0)
    engine.cut(Sweep.along(tool, Line(deep - 60 * v, deep + 60 * v)), 1)
    surface = engine.surface()
    assert closed(surface)
    for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        corner = r * (a * u + b * v)
        for z in (0.0, -5.0):
            assert (
                np.linalg.norm(surface.vertices - [corner[0], corner[1], z], axis=1).min() <= cells * r / 20
            )
    assert set(np.unique(surface.block).tolist()) == {-1, 0, 1}
    long = 80.0 / np.cos(angle)
    exact = 80.0 * 80.0 * 20.0 - 2 * r * long * (3.0 + 5.0) + 3.0 * 4 * r * r
    assert volume(surface) == pytest.approx(exact, rel=1e-6)


def test_a_ball_is_as_near_as_its_cells_are_fine():
    tool, r, _ = ball()
    engine = ColumnsEngine(FlatStock((-20.0, -20.0, -30.0), (40.0, 20.0, 0.0)))
    engine.cut(Sweep.along(tool, Line((0, 0, -r), (20, 0, -r))), 0)
    surface = engine.surface()
    assert closed(surface)
    xi = np.clip(surface.vertices[:, 0], 0.0, 20.0)
    d2 = (surface.vertices[:, 0] - xi) ** 2 + surface.vertices[:, 1] ** 2
    made = (surface.vertices[:, 2] < -1e-3) & (d2 < (r * (1 - 1e-6)) ** 2) & (surface.vertices[:, 2] > -29.0)
    assert np.abs(surface.vertices[made, 2] + np.sqrt(r * r - d2[made])).max() < 1e-6 * r
    exact = 60.0 * 40.0 * 30.0 - (20.0 * pi * r * r / 2 + 2.0 / 3.0 * pi * r**3)
    assert abs(volume(surface) - exact) <= 4.0 * SAG * r * (40.0 * r + pi * r * r)


def test_what_is_cut_away_whole_has_no_surface():
    engine = ColumnsEngine(FlatStock((-2.0, -2.0, -5.0), (2.0, 2.0, 0.0)))
    engine.cut(Sweep.along(vm.FlatEnd(diameter=12, length=50), Line((-9, 0, -6), (9, 0, -6))), 0)
    surface = engine.surface()
    assert len(surface.triangles) == len(surface.vertices) == len(surface.block) == 0


def test_what_no_tool_met_costs_few_triangles():
    engine = ColumnsEngine(FlatStock((0.0, 0.0, -20.0), (1000.0, 800.0, 0.0)))
    tool, r, _ = ball()
    engine.cut(Sweep.along(tool, Line((500, 300, -1), (510, 300, -1))), 0)
    surface = engine.surface()
    cells = (10.0 + 2 * r) * 2 * r / (r / 20) ** 2
    assert closed(surface)
    assert len(surface.triangles) < 4 * cells


def program(seed: int) -> ColumnsEngine:
    """Lines and arcs, some at round numbers, in a box or a round bar, through its sides and its bottom."""
    rng = np.random.default_rng([seed, 41])
    tool, *_ = list(CUTTERS.values())[seed % len(CUTTERS)]()
    half = (-20.0, -15.0, -10.0), (20.0, 15.0, 0.0)
    stock = FlatStock(*half) if seed % 2 else FlatStock((-20.0, -20.0, -10.0), (20.0, 20.0, 0.0), 20.0)
    engine, low, high = ColumnsEngine(stock, 0.05), np.array(stock.low), np.array(stock.high)
    here = rng.uniform(low, high)
    for k in range(int(rng.integers(3, 9))):
        there = rng.uniform(low - [5, 5, 2], high + [5, 5, -0.2])
        if seed % 3 == 0:
            there = np.round(there)
        path: Line | Arc = Line(here, there)
        if rng.random() < 0.3:
            a, r = rng.uniform(0, 2 * pi), rng.choice([3.0, 8.0])
            middle = here + [r * np.cos(a), r * np.sin(a), 0.0]
            path = Arc(here, middle, angle=float(rng.uniform(0.5, 6.0)), rise=float(rng.choice([0.0, -1.0])))
            there = path.end
        engine.cut(Sweep.along(tool, path), k)
        here = np.array(there)
    return engine


@pytest.mark.parametrize("seed", range(24))
def test_surfaces_of_any_program_are_closed(seed):
    engine = program(seed)
    surface = engine.surface()
    assert closed(surface)
    low, high = engine.stock.low, engine.stock.high
    assert (surface.vertices >= np.array(low) - 1e-12).all() and (
        surface.vertices <= np.array(high) + 1e-12
    ).all()
    box = engine.volume
    # a wall that bulges between nodes, and heights that bend: by the area of the plan and the sides, four times the sag
    radius = max(t[0].max_radius for t in engine._cutters._known[-1:])
    area = 2 * 40.0 * 40.0 + 4 * 40.0 * 10.0 * sqrt(2.0)
    assert box.lo - 8 * SAG * radius * area <= volume(surface) <= box.hi + 8 * SAG * radius * area
