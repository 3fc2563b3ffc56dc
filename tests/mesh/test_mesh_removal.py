"""Removed volumes against closed forms, quadrature, and meshes of another chord."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from manifold3d import Manifold
from strategies import programs

from vmachining.engines.mesh import MeshEngine, StockMesh, box_stock
from vmachining.engines.mesh.facets import Side
from vmachining.engines.mesh.removal import shared
from vmachining.engines.mesh.solids import cutters, manifold, pieces
from vmachining.engines.mesh.straight import facets
from vmachining.geometry import Arc, Line
from vmachining.stock import CylinderStock
from vmachining.sweep import Sweep
from vmachining.tool import BallNose, BullNose, FlatEnd, Taper

TOOLS = {
    "flat": FlatEnd(diameter=6, length=30),
    "ball": BallNose(diameter=6, length=30),
    "bull": BullNose(diameter=8, corner_radius=1.5, length=30),
    "taper": Taper(diameter=3, taper_deg=10, corner_radius=0.7, length=30),
}
LO, HI = (0.0, 0.0, -10.0), (24.0, 18.0, 0.0)


def segment(radius, depth):
    return radius**2 * np.arccos(1 - depth / radius) - (radius - depth) * np.sqrt(
        depth * (2 * radius - depth)
    )


@pytest.mark.parametrize(
    ("tool", "depth", "section"),
    [
        ("flat", 2.0, 6.0 * 2.0),
        ("ball", 1.0, segment(3.0, 1.0)),
        ("bull", 3.0, 8.0 * 3.0 - (2 - np.pi / 2) * 1.5**2),
    ],
)
@pytest.mark.parametrize("path", ["line", "circle"])
def test_grooves_with_a_closed_form(tool, depth, section, path):
    """A groove along a line, and around a circle: Pappus and Guldin, the section is symmetric about its way."""
    way = Line((-10, 9, -depth), (34, 9, -depth))
    length = 24.0
    if path == "circle":
        way, length = Arc((17, 9, -depth), (12, 9, -depth), angle=2 * np.pi), 2 * np.pi * 5.0
    engine = MeshEngine(box_stock((0, -10, -10), (24, 30, 0)), 0.01)
    lo, estimate, hi = engine.cut(Sweep.along(TOOLS[tool].cutter, way)).bracket
    exact = section * length
    assert lo <= exact * (1 + 1e-12) and exact * (1 - 1e-12) <= hi
    assert hi - lo < 0.02 * exact
    assert abs(estimate - exact) < 1e-4 * exact
    again = engine.cut(Sweep.along(TOOLS[tool].cutter, way)).bracket
    assert again.lo == 0.0 and again.estimate <= 1e-9 * exact


@settings(max_examples=12, deadline=None, phases=[Phase.generate])
@given(programs(8), st.sampled_from(sorted(TOOLS)), st.booleans(), st.sampled_from([0.05, 0.02]))
def test_brackets_of_two_chords_hold_one_truth(program, tool, is_round, chord):
    """Random programs: both brackets contain the truth, so they overlap. What a block would take is what it takes."""

    def stock():
        return StockMesh.of(CylinderStock((12, 9), 9.0, (-10, 0)), chord) if is_round else box_stock(LO, HI)

    wide, narrow = MeshEngine(stock(), chord), MeshEngine(stock(), 0.4 * chord)
    cutter = TOOLS[tool].cutter
    for k, path in enumerate(program):
        sweep = Sweep.along(cutter, path)
        before = wide.touch(sweep)
        a, b = wide.cut(sweep, k), narrow.cut(sweep, k)
        noise = 1e-9 * (1.0 + b.hi)
        assert (
            before.lo <= a.hi + noise and a.lo <= before.hi + noise
        )  # without what its start has cut before
        assert a.lo <= b.hi + noise and b.lo <= a.hi + noise
        assert a.lo <= a.estimate <= a.hi
    left, other = wide.volume, narrow.volume
    assert left.lo <= other.hi and other.lo <= left.hi


def test_a_finished_slope_against_quadrature():
    """Overlapping passes of a ball on a slope: the heights they leave are ellipses across the way."""
    engine = MeshEngine(box_stock(LO, HI), 0.01)
    cutter, radius, slope = TOOLS["ball"].cutter, 3.0, -0.05
    sides = np.arange(2.0, 16.0, 0.8)
    corners = [
        (x, y, -1.0 + slope * x - 0.02 * y)
        for k, y in enumerate(sides)
        for x in ((-4, 28) if k % 2 else (28, -4))
    ]
    for a, b in pairwise(corners):
        engine.cut(Sweep.along(cutter, Line(a, b)))
    y = (np.arange(18_000) + 0.5) / 1000
    x = (np.arange(24) + 0.5)[:, None]  # heights are linear along the passes: any number of columns will do
    heights = np.zeros((24, len(y)))
    for side in sides:
        across = radius**2 - (y - side) ** 2
        low = (
            -1.0 + slope * x - 0.02 * side + radius - np.sqrt(np.maximum(across, 0.0)) * np.hypot(1.0, slope)
        )
        heights = np.where(across > 0.0, np.minimum(heights, low), heights)
    truth = -float(heights.sum()) / 1000
    gone = engine.stock_volume.estimate - engine.volume.estimate
    # the weights of inner and outer facets know the shadow of the cutter, not of the ridges it leaves
    assert abs(gone - truth) < 0.1 * engine.volume.width
    assert engine.volume.holds(18 * 24 * 10 - truth)


def test_no_cutter_is_too_thin_for_a_helix():
    """Thinner than its polygon's chords are deep, it has once cut nothing."""
    cutter = FlatEnd(diameter=0.06, length=5).cutter
    sweep = Sweep.along(cutter, Arc((10, 0, -1), (0, 0, -1), angle=1.0, rise=-0.5))
    engine = MeshEngine(box_stock((-12, -12, -2), (12, 12, 0)), 0.5)
    about = 0.06 * 10.0 * 1.25
    lo, _, hi = engine.cut(sweep).bracket
    assert 0.0 < lo < about < hi


def test_a_helix_beside_the_stock_removes_nothing():
    """A bar just beyond the wall of the hole, where a chord of the path comes nearest to it."""
    half, radius = np.pi / 16, 8.0
    begin = radius * np.array([np.cos(half), -np.sin(half)])
    path = Arc((*begin, -2), (0, 0, -2), angle=np.pi / 2, rise=1e-3)
    sweep = Sweep.along(FlatEnd(diameter=6, length=5).cutter, path)
    wall = radius - 3.0
    engine = MeshEngine(box_stock((wall - 1.0, -0.02, -1), (wall - 1e-4, 0.02, 0)), 0.5)
    assert sweep.signed_distance([[wall - 1e-4, y, -0.5] for y in (-0.02, 0.0, 0.02)]).min() > 0.0
    assert engine.cut(sweep).lo == 0.0


def test_rings_of_round_tips_do_not_cross_themselves():
    """A volume taken twice would come out of the tip of the groove."""
    sweep = Sweep.along(TOOLS["ball"].cutter, Arc((10, 0, -1), (0, 0, -1), angle=2 * np.pi))
    *_, ring = pieces(sweep, facets(sweep.profile, 0.2, Side.INNER), None)
    solid = manifold(ring.points, ring.triangles)
    block = Manifold.cube((30, 30, 3)).translate((-15, -15, -3))
    assert abs(((block - solid) ^ solid).volume()) < 1e-9


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
@pytest.mark.slow  # 4 s
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
