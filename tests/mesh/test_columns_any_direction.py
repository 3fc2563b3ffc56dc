"""Columns in any direction: brackets of one number, however it is asked for, must meet (section 7 of the lemmas' page)."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest

from benchmarks.columns5_counts import BOX, asked, brackets, rays, ways
from benchmarks.turned_blocks import KINDS, TOOLS, Case, case_of, hills, stairs, tilted, unit
from vmachining.engines.columns import ColumnsEngine
from vmachining.engines.columns.turning import Air, AnyDirection, Rows, rows_of
from vmachining.engines.columns.turning.stocks import solid_of
from vmachining.engines.dexel import RayEngine
from vmachining.engines.mesh import MeshEngine
from vmachining.engines.protocol import Options, Removal
from vmachining.engines.relay import ColumnsFirst
from vmachining.errors import EngineError, StockError
from vmachining.geometry import Arc, Line
from vmachining.stock import BoxStock, CylinderStock
from vmachining.sweep import Pose, Sweep, Turn
from vmachining.tool import FlatEnd


def disagreeing(seed: int) -> str | None:
    """Six directions with each rule on and off, parts in time, turned with the stock, and exact rays."""
    said = brackets(seed)
    lo, hi = max(r.lo for r in said.values()), min(r.hi for r in said.values())
    return None if lo <= hi else f"{seed} {case_of(seed).name}: {said}"


@pytest.mark.slow  # 12 s: every kind, tool and stock
def test_all_brackets_of_one_block_meet() -> None:
    found = [disagreeing(seed) for seed in range(5000, 5000 + 35 * len(KINDS), 35)]
    assert [each for each in found if each] == []


@pytest.mark.long
def test_brackets_of_a_thousand_blocks_meet() -> None:
    """Forty minutes; `vmachining bench columns5-counts` continues."""
    found = [disagreeing(seed) for seed in range(1000)]
    assert [each for each in found if each] == []


@pytest.mark.parametrize("tool", TOOLS)
@pytest.mark.parametrize("lean", [0.0, 1e-9])
def test_without_a_turn_brackets_meet_those_of_upright_columns(tool: str, lean: float) -> None:
    start, end, up = np.array([-3.0, 0.5, -2.0]), np.array([-1.5, 1.0, -2.2]), np.array([0.0, 0.0, 1.0])
    upright = ColumnsEngine.of(BOX, Options(width=0.001)).cut(Sweep.along(TOOLS[tool], Line(start, end)))
    turn = Turn.great_circle(Pose(start, up), Pose(end, np.array([np.sin(lean), 0.0, np.cos(lean)])))
    said = asked([], [Sweep.along(TOOLS[tool], turn)])
    assert said.proven and said.lo <= upright.hi and upright.lo <= said.hi
    assert said.width <= 0.02 * upright.estimate


def leaning_slot(depth: float) -> tuple[Sweep, float]:
    """A tool that leans and does not turn, its ball alone in the stock: a half round slot, and its volume."""
    r = 3.0
    axis = np.array([np.sin(0.3), 0.0, np.cos(0.3)])
    tips = [np.array([x, 0.0, r - depth]) - r * axis for x in (-20.0, 20.0)]
    sweep = Sweep.along(TOOLS["ball"], Turn.great_circle(Pose(tips[0], axis), Pose(tips[1], axis)))
    section = r**2 * np.arccos(1.0 - depth / r) - (r - depth) * np.sqrt(depth * (2.0 * r - depth))
    return sweep, 16.0 * float(section)


@pytest.mark.parametrize("width", [0.01, 2e-3])
def test_a_leaning_slot_of_a_ball_has_its_closed_form(width: float) -> None:
    sweep, volume = leaning_slot(1.2)
    found = asked([], [sweep], width=width)
    assert found.lo <= volume <= found.hi and found.width <= 1.1 * width * found.estimate


def test_what_lies_below_and_above_a_hole_counts_together() -> None:
    """A slot of a flat end across a level hole: each upright column through the hole takes two pieces."""
    hole, slot = (FlatEnd(diameter=d, length=40).profile for d in (2, 6))
    x, y, z = np.eye(3)
    drilled = Turn.great_circle(Pose(10.0 * x - 3.0 * z, x), Pose(-10.0 * x - 3.0 * z, x))
    milled = Turn.great_circle(Pose(-12.0 * y - 6.0 * z, z), Pose(12.0 * y - 6.0 * z, z))
    found = asked([Sweep.along(hole, drilled)], [Sweep.along(slot, milled)], way=z)
    volume = 6.0 * 6.0 * 16.0 - 6.0 * np.pi
    assert found.lo <= volume <= found.hi and found.width <= 0.011 * volume


def test_the_surface_after_a_leaning_slot_is_closed_and_holds_what_is_left(tmp_path: Path) -> None:
    """Through ends of rays, after a checkpoint: volume by the divergence theorem, every edge twice, distances of the sweep."""
    sweep, volume = leaning_slot(1.2)
    engine = ColumnsFirst.of(BOX, Options(width=0.1))
    engine.cut(sweep, 7)
    engine.save(tmp_path / "state.npz")
    surface = ColumnsFirst.load(tmp_path / "state.npz").surface()
    corners = surface.vertices[surface.triangles]
    held = np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    assert held == pytest.approx(2048.0 - volume, abs=2e-3 * volume)
    ends = surface.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    assert np.array_equal(np.unique(ends, axis=0), np.unique(ends[:, ::-1], axis=0))
    assert set(surface.block.tolist()) == {-1, 7}
    off = np.abs(sweep.signed_distance(corners[surface.block == 7].mean(axis=1)))
    assert np.median(off) < 1e-3 and off.max() < 0.1  # a cell: beside edges


@pytest.mark.parametrize("seed", [0, 2, 18, 24])  # a ball that mills with its tip and digs a slot, two cones
def test_second_derivatives_of_balls_say_what_planes_say(seed: int) -> None:
    """L8 for balls, ten times as narrow as planes can be asked for: on and off, and along two directions."""
    case, said = case_of(seed), list[Removal]()
    for way in ways(case)[:2]:
        said += [
            asked(case.earlier, [case.block], BOX, way, rules, width)
            for rules, width in ((15, 3e-4), (7, 3e-3))
        ]
    assert max(r.lo for r in said) <= min(r.hi for r in said)
    assert min(r.width for r in said) <= 4e-4 * said[0].estimate + 1e-3


@pytest.mark.parametrize(
    ("seed", "width"), [(16, 0.03), (46, 0.06), (15, 0.8)]
)  # of a flat end: plunges, a pivot
def test_tools_without_a_side_are_asked_along_more_than_their_axis(seed: int, width: float) -> None:
    """Along the axis alone, these are two to five times as wide; exact rays say the same."""
    case = case_of(seed)
    said, seen = asked(case.earlier, [case.block]), rays(case)
    assert said.lo <= seen.hi and seen.lo <= said.hi and said.width <= width * said.estimate


@pytest.mark.parametrize("tool", ["ball", "cone", "bull"])
def test_rotary_angles_and_arcs_meet_rays(tool: str) -> None:
    """Linear rotary angles, a control point above the tip, joints, and an arc: everything that has bounds of its rates."""
    joints = [
        ("R", [0, 1, 0], [0, 0, 60], 1.0),
        ("L", [1, 0, 0], [0, 0, 0], 1.0),
        ("L", [0, 0, 1], [0, 0, 0], 1.0),
    ]
    paths = [
        Turn.rotary([-2, 0, -1.5], [0, 1, -1.7], "ac", {"a": 0.1, "c": 0.3}, {"a": 0.14, "c": 0.5}),
        Turn.through(
            [-2, 0, 28.5],
            [0, 1, 28.3],
            "bc",
            {"b": 0.1, "c": 0.3},
            {"b": 0.13, "c": 0.4},
            control_height=30.0,
        ),
        Turn.joints(joints, [0.0, -1.0, -1.5], [0.04, 1.0, -1.5]),
        Arc((2.0, 0.0, -1.5), (0.0, 0.0, -1.5), axis=2, angle=0.5),
    ]
    for path in paths:
        case = Case("", [], Sweep.along(TOOLS[tool], path))
        said, seen = asked([], [case.block]), rays(case)
        assert said.proven and said.lo <= seen.hi and seen.lo <= said.hi, path
        assert said.width <= 0.06 * said.estimate


def test_a_block_cut_again_or_backwards_removes_nothing() -> None:
    case = case_of(7)
    path = case.block.path
    assert isinstance(path, Turn)
    back = Turn.great_circle(Pose(path.end, path.axis(1.0)), Pose(path.start, path.axis(0.0)))
    for again in (path, back):
        assert asked([case.block], [Sweep.along(case.block.profile, again)]).hi == 0.0


def rising(seed: int) -> tuple[list[Sweep], Sweep]:
    """Six passes 0.3 mm apart, and a block 0.3 mm above their middle, which finds nothing to take."""
    rng, up = np.random.default_rng(seed), np.array([0.0, 0.0, 1.0])
    profile, axis = TOOLS[("ball", "bull", "flat")[seed % 3]], tilted(up, rng, 15.0)
    feed = unit(np.append(rng.normal(size=2), 0.0))
    aside, tip = np.cross(up, feed), np.array([0.0, 0.0, -1.5])
    earlier = []
    for k in range(6):
        start = tip + 0.3 * k * aside
        path = Turn.great_circle(Pose(start, axis), Pose(start + 2.0 * feed, tilted(axis, rng, 0.3)))
        earlier.append(Sweep.along(profile, path))
    tip = tip + 0.75 * aside + 0.5 * feed + 0.3 * axis
    path = Turn.great_circle(Pose(tip, axis), Pose(tip + 0.5 * feed, tilted(axis, rng, 0.1)))
    return earlier, Sweep.along(profile, path)


def layered(tool: str, seed: int) -> Case:
    """Two layers of four passes each, of two blocks, and the first block of a pass beside the second layer, a little lower."""
    rng, profile = np.random.default_rng(seed), TOOLS[tool]
    axis, blocks = tilted(np.array([0.0, 0.0, 1.0]), rng, 15.0), list[Sweep]()
    for layer, passes in enumerate((4, 4, 1)):
        for y in 0.6 * np.arange(passes) + (0.9 if layer == 2 else 0.0):
            tips = [np.array([x, y, -1.0 - 0.4 * layer]) for x in (-2.0, 0.0, 2.0)]
            poses = [Pose(tip, tilted(axis, rng, 0.3)) for tip in tips]
            blocks += [Sweep.along(profile, Turn.great_circle(a, b)) for a, b in pairwise(poses)]
    return Case(tool, blocks[:-2], blocks[-2])


@pytest.mark.parametrize("tool", ["ball", "bull", "blade"])
def test_sweeps_of_layers_above_are_hidden_only_where_others_have_taken_all(tool: str) -> None:
    case = layered(tool, 3)
    said = [
        asked(case.earlier, [case.block]),
        *(
            asked(case.earlier, [case.block], way=ways(case)[n]) for n in (0, 2)
        ),  # along the feed, covers end below
        rays(case),
    ]
    assert max(r.lo for r in said) <= min(r.hi for r in said)
    assert said[0].width <= 0.02 * said[0].estimate


@pytest.mark.parametrize("seed", [0, 7, 12, 20, 26])  # point, swarf and slot, all tools
def test_cubes_that_are_cut_lie_in_sweeps_and_what_a_block_takes_lies_in_the_others(seed: int) -> None:
    """By exact distances: corners of cubes from earlier sweeps, random points of the stock from the block."""
    case = case_of(seed)
    air = Air(solid_of(BOX))
    for number, sweep in enumerate(case.earlier):
        air.add(number, rows_of(sweep))
        cut = np.argwhere(air.grid == number + 1)
        corners = air.low + air.edge * (cut[:, None] + np.indices((2, 2, 2)).reshape(3, 8).T)
        assert len(cut) > 5 and sweep.signed_distance(corners.reshape(-1, 3)).max() <= 1e-9
    points = np.random.default_rng(seed).uniform(BOX.lo, BOX.hi, (20_000, 3))
    points = points[case.block.signed_distance(points) < 0.0]
    taken = np.array([sweep.signed_distance(points) > 0.0 for sweep in case.earlier]).all(axis=0)
    left = air.left(rows_of(case.block))
    cubes = np.floor((points[taken] - air.low) / air.edge).astype(int).tolist()
    assert set(map(tuple, cubes)) <= {tuple(cube) for part in left for cube in part.cubes.tolist()}
    # what any others hold of the block in the box, those around hold
    boxes = np.array([part.box for part in left])
    inside = points[((points > boxes[:, 0].max(axis=0)) & (points < boxes[:, 1].min(axis=0))).all(axis=1)]
    held = np.array([sweep.signed_distance(inside) < 0.0 for sweep in case.earlier])
    assert (held.any(axis=0) == held[air.around(left, case.block.bounds)[0]].any(axis=0)).all()


def test_cubes_above_a_top_hold_no_stock() -> None:
    stock = hills(1)
    air, rng = Air(solid_of(stock)), np.random.default_rng(1)
    out = np.argwhere(air.grid == -1)
    assert len(out) > 1000
    points = air.low + air.edge * (out + rng.random(out.shape))
    points = points[(np.abs(points[:, :2]) < 8.0).all(axis=1)]
    lines = stock.crossings(points[:, :2])
    assert (lines.counts == 1).all() and (points[:, 2] >= lines.leave).all()


def test_a_block_where_all_is_cut_removes_nothing_and_is_not_looked_at() -> None:
    """Inside of a wider slot: no cube is left."""
    case = case_of(7)
    wide = Sweep.along(FlatEnd(diameter=20, length=40).profile, Line((-30.0, 0.0, -8.0), (30.0, 0.0, -8.0)))
    engine = ColumnsFirst.of(BOX, Options())
    engine.cut(case.earlier[0]), engine.cut(wide)
    found = engine.cut(case.block)
    assert found.hi == 0.0 and found.proven and found.engine == "columns"


@pytest.mark.parametrize("seed", range(4))
def test_a_block_in_air_has_a_bracket_about_zero_however_narrow_it_is_asked_for(seed: int) -> None:
    """With no width that is enough, cells are divided until rounding alone is left of their sum."""
    earlier, block = rising(seed)
    engine = AnyDirection.of(BOX, Options(width=0.01, width_mm3=0.0))
    said = engine.cut(rows_of(block), Rows.join([rows_of(sweep) for sweep in earlier]))
    assert said.proven and said.lo == 0.0 and said.hi < 1e-6


def test_a_block_that_passes_a_corner_of_the_stock_removes_nothing() -> None:
    """Its box meets the stock, it does not; a block that crosses that corner before it is not taken for it."""
    along = [(np.sin(angle), 0.0, np.cos(angle)) for angle in (0.05, 0.055)]
    past, across = (
        rows_of(
            Sweep.along(
                TOOLS["ball"],
                Turn.great_circle(
                    *(Pose(np.array(p), np.array(a)) for p, a in zip(ends, along, strict=True))
                ),
            )
        )
        for ends in (((0, 0, -1), (20, 20, -1)), ((16, -10, -1), (16, 24, -1)))
    )
    engine = AnyDirection.of(BoxStock(np.array([12.0, -6, -10]), np.array([20.0, 3, 0])), Options(width=0.01))
    assert engine.cut(across, None).lo > 25.0  # 9 mm of a segment of a circle, 1 mm deep
    for before in (None, across):
        found = engine.cut(past, before)
        assert found.proven and found.lo == 0.0 and found.hi < 1e-6


def test_directions_that_contradict_each_other_are_no_proof(monkeypatch: pytest.MonkeyPatch) -> None:
    answers = iter([(1.0, 1.5, 1), (2.0, 2.5, 1)])
    monkeypatch.setattr(AnyDirection, "_look", lambda *_: next(answers))
    case = case_of(6)  # a bull nose: of balls one direction is asked
    said = AnyDirection.of(BOX, Options()).cut(rows_of(case.block), None)
    assert not said.proven and (said.lo, said.hi) == (1.0, 2.5) and "contradict" in str(said.note)


def test_a_leaning_slot_over_a_step_has_its_closed_form() -> None:
    """A flat end that leans across its feed digs a slot of a level bottom's corner into both levels of the stairs."""
    r, lean, depth = 3.0, 0.3, 2.0
    axis = np.array([0.0, np.sin(lean), np.cos(lean)])
    tips = [np.array([x, 0.0, -depth]) for x in (-20.0, 20.0)]
    sweep = Sweep.along(TOOLS["flat"], Turn.great_circle(Pose(tips[0], axis), Pose(tips[1], axis)))
    # across the feed the tool is a rectangle 2 r wide that leans: its lower corner lies r sin(lean) below the tip

    def section(top: float) -> float:
        corners = [(s * r * np.cos(lean) + t * np.sin(lean), -depth - s * r * np.sin(lean) + t * np.cos(lean))
                   for s, t in ((-1, 0), (1, 0), (1, 40), (-1, 40))]  # fmt: skip
        return area_below(corners, top)

    for stock, truth in ((BOX, 16.0 * section(0.0)), (stairs(), 8.0 * (section(0.0) + section(-1.0)))):
        found = asked([], [sweep], stock)
        assert found.lo - 1e-9 <= truth <= found.hi + 1e-9 and found.width <= 0.03 * truth


def area_below(corners: list[tuple[float, float]], top: float) -> float:
    """Of a convex polygon, by the shoelace formula."""
    kept = []
    for (a, b), (c, d) in zip(corners, corners[1:] + corners[:1], strict=True):
        if b <= top:
            kept.append((a, b))
        if (b - top) * (d - top) < 0.0:
            kept.append((a + (c - a) * (top - b) / (d - b), top))
    return 0.5 * abs(sum(a * d - b * c for (a, b), (c, d) in zip(kept, kept[1:] + kept[:1], strict=True)))


def test_round_stocks_are_left_to_the_mesh_engine() -> None:
    stock = CylinderStock((0.0, 0.0), 8.0, (-8.0, 0.0))
    with pytest.raises(StockError, match="plane faces"):
        AnyDirection.of(stock, Options())
    case = case_of(0)
    found = ColumnsFirst.of(stock, Options(chord=0.05)).cut(case.block)
    assert found.engine == "mesh" and found.proven


def test_the_default_engine_proves_turning_blocks(tmp_path: Path) -> None:
    """Before and after a checkpoint, and upright blocks that cross them: all proven, all meet rays and each other's sums."""
    case = case_of(0)
    across = Sweep.along(TOOLS["ball"], Line((-6.0, 0.0, -1.0), (6.0, 0.0, -1.0)))
    sweeps = [*case.earlier, case.block, across]
    once, twice = (ColumnsFirst.of(BOX, Options(chord=0.05)) for _ in range(2))
    judge = RayEngine(BOX)
    for sweep in sweeps:
        found, seen = once.cut(sweep), judge.cut(sweep)
        assert found.proven and found.engine == "columns"
        assert found.lo <= seen.hi and seen.lo <= found.hi
        again = twice.cut(sweep)
        assert again.bracket == found.bracket
        twice.save(tmp_path / "state.npz")
        twice = ColumnsFirst.load(tmp_path / "state.npz")
    assert once.volume == twice.volume and once.volume.proven


def test_a_block_that_stays_wide_is_what_columns_and_the_mesh_engine_both_allow() -> None:
    """A flat end that turns about a point of its bottom: no wider than either alone, and both are named."""
    case, options = case_of(15), Options(chord=0.05)
    default, meshed = ColumnsFirst.of(BOX, options), MeshEngine.of(BOX, options)
    for sweep in case.earlier:
        default.cut(sweep), meshed.cut(sweep)
    alone = asked(case.earlier, [case.block], width=options.width)
    other, found = meshed.cut(case.block), default.cut(case.block)
    assert found.engine == "columns+mesh" and found.proven and alone.width > 0.1 * alone.estimate
    assert found.lo == pytest.approx(max(alone.lo, other.lo), abs=1e-9)
    assert found.hi == pytest.approx(min(alone.hi, other.hi), abs=1e-9)
    assert found.width <= min(alone.width, other.width) + 2e-9


def test_checkpoints_of_versions_before_are_refused_by_name(tmp_path: Path) -> None:
    engine = ColumnsFirst.of(BOX, Options())
    engine.save(tmp_path / "now.npz")
    with ZipFile(tmp_path / "now.npz") as now, ZipFile(tmp_path / "old.npz", "w") as old:
        for name in now.namelist():
            data = now.read(name)
            if name.endswith(".json"):
                head = json.loads(data)
                del head["state"]["turns"]
                data = json.dumps(head).encode()
            old.writestr(name, data)
    with pytest.raises(EngineError, match=r"earlier version.*run the job again"):
        ColumnsFirst.load(tmp_path / "old.npz")


@pytest.mark.long  # 60 s: compiles with checks of bounds
def test_kernels_stay_within_their_arrays(tmp_path: Path) -> None:
    code = (
        "from benchmarks.columns5_counts import *\n"
        "from benchmarks.turned_blocks import case_of\n"
        "for seed in (0, 7, 13, 20):\n"
        "    case = case_of(seed)\n"
        "    crowd = [*case.earlier, *(s for k in range(5100, 5130) for s in case_of(k).earlier)]\n"
        "    asked(crowd, [case.block])\n"
    )
    env = {**os.environ, "NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
