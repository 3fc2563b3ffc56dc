"""What a chained block can still remove, against points of its sweep outside of where it starts."""

from itertools import pairwise

import numpy as np
import pytest
from somecutters import TOOLS

from vmachining.engines.mesh import MeshEngine, box_stock
from vmachining.engines.mesh.ahead import ahead
from vmachining.engines.mesh.facets import Side
from vmachining.engines.mesh.removal import shared
from vmachining.engines.mesh.solids import cutters
from vmachining.engines.mesh.straight import facets
from vmachining.geometry import Line
from vmachining.sweep import Sweep
from vmachining.tool import BallNose, FlatEnd, Profile, ProfileTool


@pytest.mark.parametrize("tool", TOOLS)
@pytest.mark.parametrize("step", [(2, 1, 0), (1, -1, 0.7), (1, 0, -0.7), (0.2, 0.1, 2), (0.1, 0, -2)])
def test_nothing_new_is_behind_the_limits(tool, step):
    rng = np.random.default_rng(3)
    cutter = TOOLS[tool].cutter
    sweep, start = Sweep(cutter, (0, 0, 0), step), Sweep(cutter, (0, 0, 0), (0, 0, 0))
    found = ahead(sweep, facets(cutter, 0.01, Side.INNER))
    assert found is not None
    low, high = np.array(sweep.bounds)
    points = rng.uniform(low, high, (100_000, 3))
    points = points[(sweep.signed_distance(points) < 0.0) & (start.signed_distance(points) > 0.0)]
    along = points[:, :2] @ found.limits.heading
    k = np.floor((points[:, 2] - found.limits.low) / found.limits.step).astype(int)
    assert len(points) > 1000 and (along >= found.limits.rear[k] - 1e-9).all()


@pytest.mark.parametrize("step", [(0.3, 0, 0), (0.3, 0, 1.5), (0.3, 0, -1.5)])
def test_the_foremost_point_is_new(step):
    """Also of a cutter that is widest in the middle of an arc, where no point of its meridian lies."""
    none = (np.nan, np.nan)
    bulge = Profile(
        np.array([(0, 0), (4, 0), (4, 6), (2, 8)]), np.array([none, (0, 3), none]), np.array([0, 5, 0])
    )
    assert bulge.max_radius == 5.0
    for cutter in (bulge, *(tool.cutter for tool in TOOLS.values())):
        sweep, start = Sweep(cutter, (0, 0, 0), step), Sweep(cutter, (0, 0, 0), (0, 0, 0))
        found = ahead(sweep, facets(cutter, 0.01, Side.INNER))
        assert found is not None
        assert abs(sweep.signed_distance([found.front])[0]) < 1e-9
        assert start.signed_distance([found.front])[0] > 0.1


@pytest.mark.parametrize("rise", [-1.5, -0.2, 0.0, 0.2, 1.5])
def test_limits_of_a_ball_are_those_of_its_front_half(rise):
    """Where the normal looks ahead, (y - c) . d >= 0, moved on by any part of the way."""
    radius, level = 3.0, 1.2
    cutter = BallNose(diameter=6, length=8).cutter
    found = ahead(Sweep(cutter, (0, 0, 0), (level, 0, rise)), facets(cutter, 0.01, Side.INNER))
    assert found is not None
    part = np.linspace(0, 1, 4001)
    for j, limit in enumerate(found.limits.rear):
        z = found.limits.low + (j + 0.5) * found.limits.step
        at = z - part * rise
        half = np.sqrt(np.maximum(radius**2 - np.minimum(at - radius, 0.0) ** 2, 0.0))
        rear = np.where(at < radius, (radius - at) * rise / level, 0.0)
        rear = np.where(rear > half, np.inf, np.maximum(rear, -half))
        rear = np.where((at < 0) | (at > 8), np.inf, rear) + part * level
        if 0.3 < z < 2.5 and np.isfinite(rear.min()):
            # a step of the table is 0.1 mm in height, and the limit leans as the motion does
            assert rear.min() - 0.1 - 0.2 * abs(rise) / level <= limit <= rear.min() + 1e-9 + 0.1 * abs(rise)


def test_vertical_moves_and_waisted_cutters_have_no_limits():
    ball = TOOLS["ball"].cutter
    assert ahead(Sweep(ball, (0, 0, 0), (0, 0, -1)), facets(ball, 0.01, Side.INNER)) is None
    waist = ProfileTool(points=[(0, 0), (4, 0), (2, 3), (3, 8)]).cutter
    assert ahead(Sweep(waist, (0, 0, 0), (1, 0, 0)), facets(waist, 0.01, Side.INNER)) is None


def test_a_block_ahead_of_which_nothing_is_left_removes_nothing_at_all():
    """Out of the stock, with the rear of the cutter in the slot that it has cut."""
    cutter = BallNose(diameter=10, length=40).cutter
    engine = MeshEngine(box_stock((0, 0, -10), (20, 20, 0)))
    at = np.array([4.0, 10.0, -1.0])
    for x in (8.0, 14.0, 20.5, 26.0):
        lo, _, hi = engine.cut(Sweep.along(cutter, Line(at, (x, 10.0, -1.0)))).bracket
        at = np.array([x, 10.0, -1.0])
    assert lo == hi == 0.0  # from 20.5 on the front is outside


def test_a_block_that_begins_below_the_surface_finds_its_material():
    """A short cutter deep in the stock: no triangle is ahead of it, but all of its way is."""
    cutter = FlatEnd(diameter=4, length=2).cutter
    engine = MeshEngine(box_stock((0, 0, -20), (40, 20, 0)), tile_mm=100.0)
    first = engine.cut(Sweep.along(cutter, Line((10, 10, -10), (10, 10, -10)))).bracket
    second = engine.cut(Sweep.along(cutter, Line((10, 10, -10), (16, 10, -10)))).bracket
    assert first.holds(np.pi * 4 * 2) and second.holds(6 * 4 * 2)


def zigzag(rng: np.random.Generator, runs: int, steep: float):
    """Corners (3 runs + 1, 3) mm of a path through the top of the stock: three blocks one way, then another."""
    at = [np.array([4.0, 4.0, -1.5])]
    while len(at) < 3 * runs:
        heading, steps = rng.uniform(-np.pi, np.pi), rng.uniform(0.3, 2.0, 3)
        level = np.cumsum(steps)[:, None] * [np.cos(heading), np.sin(heading)]
        rises = np.cumsum(steps * rng.uniform(-steep, steep, 3))
        run = at[-1] + np.column_stack([level, rises])
        if (run > [1, 1, -4]).all() and (run < [19, 19, 0]).all():
            at.extend(run)
    return np.array(at)


@pytest.mark.parametrize("steep", [0.0, 0.3, 1.5])
@pytest.mark.parametrize("tool", TOOLS)
def test_all_that_the_mesh_of_a_cutter_holds_is_gone_although_only_some_of_it_is_built(tool, steep):
    """Whatever was left out of the mesh held no material: the whole mesh of the last block finds none."""
    rng = np.random.default_rng(len(tool))
    cutter = TOOLS[tool].cutter
    engine = MeshEngine(box_stock((0, 0, -12), (20, 20, -0.5)), 0.02, tile_mm=100.0)
    points = zigzag(rng, 12, steep)
    checked = 0
    for k, (a, b) in enumerate(pairwise(points)):
        sweep = Sweep.along(cutter, Line(a, b))
        removed = engine.cut(sweep, k).bracket
        if k % 3 == 2 and removed.estimate > 0.1:
            whole = cutters(sweep, facets(cutter, 0.02, Side.INNER))
            assert shared(engine.whole(), whole) < 1e-8
            checked += 1
    assert checked > 3
