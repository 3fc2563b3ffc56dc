"""`--engine columns` in a job, and blocks handed on to the mesh engine."""

from __future__ import annotations

import math
from contextlib import closing
from itertools import pairwise

import pytest
import trimesh
from tinyjob import SLOT_MM3, write_job

import vmachining as vm
from vmachining.engines import ENGINES
from vmachining.engines.mesh import MeshEngine
from vmachining.engines.protocol import Options, Request, Share
from vmachining.engines.relay import ColumnsFirst, best_engine, handed_on
from vmachining.geometry import Arc, Line
from vmachining.job.brep import columns_say
from vmachining.job.executor import executor
from vmachining.job.jobfile import Job
from vmachining.stock import BoxStock
from vmachining.sweep import Sweep

OPTIONS = Options(chord=0.05)


def test_a_job_by_columns(tmp_path):
    assert "columns" in ENGINES
    job = Job.load(write_job(tmp_path)).with_width("0.5%")
    result = vm.run(job, engine="columns", workers=1)
    rows = result.blocks
    assert set(rows["engine"]) == {"columns"}
    slot = rows.filter(rows["line"] == 7).row(0, named=True)
    assert slot["removed_lo_mm3"] <= SLOT_MM3 <= slot["removed_hi_mm3"]
    assert slot["removed_hi_mm3"] - slot["removed_lo_mm3"] <= 0.00501 * SLOT_MM3
    points, triangles, _ = result.surface
    solid = trimesh.Trimesh(points, triangles, process=False)
    assert solid.is_watertight
    assert solid.is_winding_consistent
    assert solid.volume == pytest.approx(result.stock.volume.estimate, rel=0.01)


def engine() -> ColumnsFirst:
    return ColumnsFirst.of(BoxStock((0, 0, -10), (60, 30, 0)), OPTIONS)


def cut(work: ColumnsFirst, tool: vm.Tool, a, b):
    return work.cut(Sweep.along(tool, Line(a, b)), 0)


def test_what_columns_do_not_take_is_handed_on_and_its_neighbours_too(tmp_path):
    """A dovetail undercuts: it and what crosses it go to the mesh engine, the rest stays with columns."""
    flat, dovetail = vm.FlatEnd(diameter=6, length=40), vm.Taper(diameter=10, taper_deg=-20, length=9)
    work = engine()
    first = cut(work, flat, (10, -5, -4), (10, 35, -4))
    under = cut(work, dovetail, (10, -8, -8), (10, 38, -8))
    work.save(tmp_path / "state.npz")
    work = ColumnsFirst.load(tmp_path / "state.npz")
    across = cut(work, flat, (0, 15, -9), (20, 15, -9))
    apart = cut(work, flat, (40, -5, -4), (40, 35, -4))
    assert [r.engine for r in (first, under, across, apart)] == ["columns", "mesh", "mesh", "columns"]
    assert first.lo <= 6 * 4 * 30 <= first.hi
    assert apart.lo <= 6 * 4 * 30 <= apart.hi
    # section of the dovetail: width 2 (5 - h tan 20 degrees) at h over its tip, less the slot of 6 mm from h = 4 to 8
    tan = math.tan(math.radians(20.0))
    low, wings = (
        2 * (5 * 4 - tan * 8),
        2 * (2 - 4 * tan) ** 2 / (2 * tan),
    )  # the flanks reach 3 mm before h = 8
    assert under.lo <= 30 * (low + wings) <= under.hi
    total = work.volume
    assert total.lo <= total.estimate <= total.hi


def test_two_processes_cut_what_one_cuts(tmp_path):
    """Slots, a dovetail that only the mesh engine takes, what crosses it, and a checkpoint on the way."""
    flat, ball = vm.FlatEnd(diameter=6, length=40).cutter, vm.BallNose(diameter=6, length=40).cutter
    dovetail = vm.Taper(diameter=10, taper_deg=-20, length=9).cutter
    orders = [
        (flat, Line((10, -5, -4), (10, 35, -4))), (dovetail, Line((10, -8, -8), (10, 38, -8))),
        (flat, Line((0, 15, -9), (20, 15, -9))), (ball, Line((40, -5, -4), (40, 35, -4))),
        (ball, Line((43, 35, -4), (37, -5, -3))),
    ]  # fmt: skip
    found, volumes = {}, {}
    for workers in (1, 2):
        work = engine()
        answers = []
        for some in (orders[:3], orders[3:]):
            with closing(executor(work, workers)) as hands:
                later = [hands.cut(tool, path, len(answers) + k) for k, (tool, path) in enumerate(some)]
                answers += [answer() for answer in later]
                hands.save(tmp_path / "state.npz")
                volumes[workers] = hands.finish().volume
            work = ColumnsFirst.load(tmp_path / "state.npz")
            assert work.volume == volumes[workers]
        found[workers] = answers
    assert [r.engine for r in found[2]] == ["columns", "mesh", "mesh", "columns", "columns"]
    for one, two in zip(found[1], found[2], strict=True):
        assert one.engine == two.engine and one.note is two.note is None
        assert max(one.lo, two.lo) <= min(one.hi, two.hi)
        if two.engine == "columns":
            assert two.width <= OPTIONS.width * two.estimate
        else:  # tiles of the mesh engine are the same
            assert two.bracket == pytest.approx(one.bracket, rel=1e-9)
    assert found[2][0].lo <= 6 * 4 * 30 <= found[2][0].hi
    assert max(v.lo for v in volumes.values()) <= min(v.hi for v in volumes.values())


def test_an_arc_in_an_upright_plane_is_cut_by_columns_and_both_engines_agree():
    ball, stock = vm.BallNose(diameter=6, length=40), BoxStock((0, 0, -10), (60, 30, 0))
    dip = Arc((20, 15, -1), (25, 15, 11), axis=1, angle=-2 * math.atan2(5, 12))  # ends at (30, 15, -1)
    assert dip.end == pytest.approx((30, 15, -1))
    sweep = Sweep.along(ball, dip)
    assert not handed_on(stock)(sweep)
    by_columns = engine().cut(sweep, 0)
    by_mesh = MeshEngine.of(stock, OPTIONS).cut(sweep, 0)
    assert by_columns.engine == "columns" and by_columns.note is None
    assert by_mesh.lo <= by_columns.lo and by_columns.hi <= by_mesh.hi


@pytest.mark.parametrize("parts", [1, 2])
def test_many_orders_at_once_are_the_same_orders_one_after_the_other(parts, tmp_path):
    """Lines in a row, beside the stock, a plunge, a steep ramp, an arc, a check, and a tool whose top dips into the stock."""
    ball, short = vm.BallNose(diameter=6, length=40), vm.FlatEnd(diameter=6, length=5)
    places = [
        (0, 5, -2),
        (20, 5, -3),
        (40, 6, -2),
        (80, 6, -2),
        (90, 6, -2),
        (30, 15, 1),
        (30, 15, -4),
        (30.0001, 15, -1),
    ]
    sweeps = [Sweep.along(ball, Line(a, b)) for a, b in pairwise(places)]
    sweeps += [Sweep.along(ball, Arc((30, 20, -3), (30, 15, -3), angle=2.0)), sweeps[0]]
    sweeps += [
        Sweep.along(short, Line((5, 25, -6), (9, 25, -6))),
        Sweep.along(ball, Line((3, 21, -2), (11, 29, -2))),
    ]
    engine().save(raw := tmp_path / "raw.npz")
    for part in range(parts):
        one, many = (ColumnsFirst.load(raw, share=Share(part, parts)) for _ in range(2))
        found = [one.touch(sweep) if k == 8 else one.cut(sweep, k) for k, sweep in enumerate(sweeps)]
        assert list(many.answer([Request(sweep, k, k != 8) for k, sweep in enumerate(sweeps)])) == found
        assert many.volume == one.volume and many.in_use().tolist() == one.in_use().tolist()
        assert {removed.engine for removed in found[:8]} == {"columns"}


def test_blocks_add_up_to_what_is_gone_from_the_stock(tmp_path):
    result = vm.run(write_job(tmp_path))
    s = result.summary
    assert s["removed_mm3"] == pytest.approx(result.blocks["removed_mm3"].sum(), rel=1e-12)
    assert s["removed_mm3"] + s["final_mm3"] == pytest.approx(s["stock_mm3"], rel=1e-12)
    assert s["final_lo_mm3"] <= s["final_mm3"] <= s["final_hi_mm3"]
    assert result.removed.error == max(
        s["removed_hi_mm3"] - s["removed_mm3"], s["removed_mm3"] - s["removed_lo_mm3"]
    )


def test_columns_judge_what_the_mesh_engine_cut(tmp_path):
    """The intersection is a tenth as wide as the mesh bracket of a slot of a ball, and no block behind a dovetail is judged."""
    ball, dovetail = vm.BallNose(diameter=6, length=40), vm.Taper(diameter=10, taper_deg=-20, length=9)
    stock = BoxStock((0, 0, -10), (60, 30, 0))
    slots = [[Sweep.along(ball, Line((10 + k, -5, -1), (10 + k, 35, -1)))] for k in range(3)]
    under = [Sweep.along(dovetail, Line((40, -8, -8), (40, 38, -8)))]
    said = columns_say(stock, [*slots, under, slots[0]], {0, 2, 4}, [0.0] * 5)
    assert said.keys() == {0, 2} and said[0].name == "columns"
    lo, _, hi, proven, *_ = said[0].removal
    section = 9 * math.acos(2 / 3) - 2 * math.sqrt(5)
    assert proven and lo <= 30 * section <= hi and hi - lo <= 0.0011 * hi


def test_the_rule_of_the_default(tmp_path):
    """Box and upright flat end: columns. A tool that undercuts in more than half of the motions: mesh."""
    stock = BoxStock((0, 0, -10), (60, 30, 0))
    flat, dovetail = vm.FlatEnd(diameter=6, length=40), vm.Taper(diameter=10, taper_deg=-20, length=9)
    way = Line((10, -8, -8), (10, 38, -8))
    hands_on = handed_on(stock)
    one, other = (hands_on(Sweep.along(tool, way)) for tool in (flat, dovetail))
    assert (one, other) == (False, True)
    assert best_engine([one, other]) == "columns" and best_engine([one, other, other]) == "mesh"
    job = Job.load(write_job(tmp_path))
    found = vm.run(job)
    assert set(found.blocks["engine"]) == {"columns"} and found.summary["blocks_by_mesh"] == 0
