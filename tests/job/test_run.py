"""Whole jobs, small enough to know the answer."""

from __future__ import annotations

import csv
import gc
import json
import math
import warnings

import numpy as np
import polars as pl
import pytest
from polars.testing import assert_frame_equal
from tinyjob import FEED, JOB, PROGRAM, SLOT_MM3, write_job

import vmachining as vm
from vmachining.errors import InputError, NCError, StockError
from vmachining.job import COLUMNS, Job, run

ARC_MM3 = 0.5 * (8 * math.pi + math.pi * 4)
"""Half ring of a 4 mm cutter, radii 0 to 4 mm, and half a disc at each end; 0.5 mm deep."""


@pytest.fixture(scope="module")
def tiny(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tiny")
    return run(Job.load(write_job(folder)), out=folder / "out", engine="mesh")


def test_the_slot_has_its_exact_volume(tiny):
    rows = {row["line"]: row for row in tiny.blocks.iter_rows(named=True)}
    slot = rows[7]
    assert slot["removed_mm3"] == pytest.approx(SLOT_MM3, abs=1e-9)
    assert slot["removed_lo_mm3"] <= SLOT_MM3 <= slot["removed_hi_mm3"]
    assert slot["time_s"] == pytest.approx(1.8, abs=1e-12) and slot["length_mm"] == 18
    assert slot["mrr_mm3_min"] == pytest.approx(SLOT_MM3 / 1.8 * 60)
    assert (slot["motion"], slot["feed_mm_min"], slot["tool"], slot["engine"]) == ("linear", 600, 1, "mesh")
    assert (slot["x_mm"], slot["y_mm"], slot["z_mm"], slot["k"]) == (14, 4, -1, 1)
    assert slot["text"].strip() == "N60 G1 X14 F600"


def test_a_run_without_a_place_has_one_until_its_result_goes(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = run(Job.load(write_job(tmp_path)), engine="columns")
        folder = result.folder
        assert (folder / "blocks.partial.csv").is_file()
        del result
        gc.collect()
    assert not folder.exists()


def test_plunge_and_arc_hold_the_closed_form(tiny):
    rows = {row["line"]: row for row in tiny.blocks.iter_rows(named=True)}
    both = [rows[line] for line in (10, 11)]
    lo, mid, hi = (sum(row[c] for row in both) for c in ("removed_lo_mm3", "removed_mm3", "removed_hi_mm3"))
    assert lo <= ARC_MM3 <= hi and abs(mid - ARC_MM3) < 0.2 * (hi - lo)
    assert rows[11]["motion"] == "arc_cw" and rows[11]["length_mm"] == pytest.approx(2 * math.pi)


def test_rapids_remove_nothing_and_the_table_keeps_its_order(tiny):
    table = tiny.blocks
    assert table.columns == list(COLUMNS) and table.schema == pl.Schema(COLUMNS)
    assert table["block"].to_list() == list(range(9))
    rapid = table.filter(pl.col("motion") == "rapid")
    assert rapid["removed_hi_mm3"].sum() == 0 and rapid["feed_mm_min"].null_count() == len(rapid)
    for column in (
        "removed_brep_mm3",
        "brep_status",
        "chip_area_mm2",
        "force_n",
        "scheduled_time_s",
        "warning",
    ):
        assert table[column].null_count() == len(table)


def test_the_summary_balances(tiny):
    s = tiny.summary
    assert s["stock_mm3"] == pytest.approx(720, abs=1e-9)
    assert s["stock_mm3"] - s["final_mm3"] == pytest.approx(s["removed_mm3"], abs=1e-9 * 720)
    assert s["removed_lo_mm3"] <= s["removed_mm3"] <= s["removed_hi_mm3"]
    assert s["time_s"] == pytest.approx(tiny.blocks["time_s"].sum()) and s["blocks"] == 9
    assert s["scheduled_time_s"] is None and s["warnings"] == 0 and s["peak_mb"] > 10


def test_written_files_agree(tiny, tmp_path):
    folder = tiny.write(tmp_path / "copy", stock=("stl", "3mf"))
    names = {path.name for path in folder.iterdir()}
    assert names == {
        "blocks.csv",
        "blocks.parquet",
        "summary.json",
        "stages.zip",
        "report.html",
        "stock.stl",
        "stock.3mf",
        "manifest.json",
    }
    frame = pl.read_csv(folder / "blocks.csv", schema=COLUMNS)
    exact = pl.read_parquet(folder / "blocks.parquet")
    assert_frame_equal(frame, exact, rel_tol=5e-15, abs_tol=0.0)
    with (folder / "blocks.csv").open(newline="") as file:
        assert next(csv.reader(file)) == list(COLUMNS)
    manifest = json.loads((folder / "manifest.json").read_text())
    assert manifest["complete"] is True and set(manifest["inputs"]) == {"job", "program"}
    assert len(manifest["inputs"]["program"]["sha256"]) == 64 and "numpy" in manifest["versions"]
    assert json.loads((folder / "summary.json").read_text()) == tiny.summary
    import trimesh

    part = trimesh.load_mesh(folder / "stock.stl")
    lo, hi = tiny.summary["final_lo_mm3"], tiny.summary["final_hi_mm3"]
    assert part.is_watertight and lo - 1e-3 <= part.volume <= hi + 1e-3
    assert (folder / "stock.3mf").read_bytes()[:2] == b"PK"


def test_the_same_job_gives_the_same_bytes(tiny, tmp_path):
    again = run(Job.load(write_job(tmp_path)), out=tmp_path / "out", engine="mesh")
    assert (again.folder / "blocks.csv").read_bytes() == (tiny.folder / "blocks.csv").read_bytes()


def one(tmp_path, program, **swap):
    """Rows of a program by line."""
    result = run(Job.load(write_job(tmp_path, program=program, swap=swap.get("swap"))), engine="mesh")
    return {row["line"]: row for row in result.blocks.iter_rows(named=True)}, result


def test_a_rapid_through_material_warns_with_its_volume(tmp_path):
    rows, result = one(tmp_path, "G21 T1 M6\nS1000 M3\nG0 X5 Y7 Z2\nG0 Z-1\nG1 Z-2 F100\nG0 Z5\nM30\n")
    plunge = rows[4]
    assert plunge["removed_mm3"] == 0 and plunge["warning"].startswith(
        "rapid through material: tool would remove 12."
    )
    assert rows[6]["warning"] is None  # up through the hole just drilled: facets are not contact
    assert result.summary["warnings"] == 1


def test_retracting_along_fresh_walls_is_no_contact(tmp_path):
    cuts = "G1 Z-1 F200\nG1 X7.3 Y9.1\nG3 X3 Y9 R4\n"
    program = f"T1 M6\nS1000 M3\nG0 X1 Y1 Z1\n{cuts}G0 Z5\nG0 X7.3 Y9.1\nG0 Z-0.9\nM30\n"
    rows, _ = one(tmp_path, program)
    assert [row["warning"] for row in rows.values()] == [None] * len(rows)


def test_shank_and_holder_contact_are_warnings_not_cuts(tmp_path):
    program = "T1 M6\nS1000 M3\nG0 X-4 Y7 Z1\nG0 Z-3\nG1 X14 F600\nM30\n"
    swap = {"length_mm = 20": "length_mm = 20\nflute_length_mm = 2\nshank_diameter_mm = 4"}
    rows, _ = one(tmp_path, program, swap=swap)
    assert rows[5]["removed_mm3"] == pytest.approx(4 * 2 * 10, abs=1e-9)
    assert rows[5]["warning"] == "shank touches the stock: 40 mm3"
    swap = {"length_mm = 20": "length_mm = 20\nholder = [[6, 2], [6, 10]]"}
    rows, _ = one(tmp_path / "b", program, swap=swap)
    assert rows[5]["warning"].startswith("holder touches the stock: ")


def test_a_shank_as_wide_as_its_cutter_slides_along_the_wall(tmp_path):
    program = "T1 M6\nS1000 M3\nG0 X5 Y7 Z1\nG1 Z-2 F100\nG1 Z-3\nG1 X9 Y9\nM30\n"
    swap = {"length_mm = 20": "length_mm = 20\nflute_length_mm = 3.5\nshank_diameter_mm = 4"}
    rows, _ = one(tmp_path, program, swap=swap)
    assert all(row["warning"] is None for row in rows.values())


def test_a_standing_spindle_is_a_warning_on_its_row(tmp_path):
    rows, result = one(tmp_path, PROGRAM.replace("N30 S8000 M3\n", ""))
    assert rows[6]["warning"] and "spindle" in rows[6]["warning"]
    assert result.summary["warnings"] >= 1


def test_times_follow_machine_limits_and_dwell(tmp_path):
    program = "T1 M6\nS1000 M3\nG0 X-4 Y4 Z-1\nG1 X14 F6000\nG4 P2.5\nM30\n"
    rows, result = one(tmp_path, program)
    assert rows[4]["time_s"] == pytest.approx(18 / 4000 * 60)
    assert result.summary["time_s"] == pytest.approx(sum(r["time_s"] for r in rows.values()) + 2.5)
    swap = {"max_feed_mm_min = 4000": "max_acceleration_mm_s2 = 100\naxis_feed_mm_min = [3000, 3000, 600]"}
    slow, _ = one(tmp_path / "b", program, swap=swap)
    assert slow[4]["time_s"] > 18 / 3000 * 60


def test_one_tool_needs_no_t_word_and_two_do(tmp_path):
    program = "S1000 M3\nG0 X-4 Y4 Z-1\nG1 X14 F600\nM30\n"
    rows, _ = one(tmp_path, program)
    assert rows[3]["removed_mm3"] == pytest.approx(SLOT_MM3) and rows[3]["tool"] == 1
    two = '[[tools]]\nnumber = 2\ntype = "flat"\ndiameter_mm = 2\nlength_mm = 9\n\n[stock]'
    with pytest.raises(NCError, match="cuts before any tool is called"):
        one(tmp_path / "b", program, swap={"[stock]": two})


def test_stock_from_files_and_a_cylinder(tmp_path):
    import trimesh

    box = trimesh.creation.box(bounds=[[0, 0, -4], [10, 18, 0]])
    write_job(tmp_path)
    box.export(tmp_path / "box.stl")
    old = "box = { min = [0, 0, -4], max = [10, 18, 0] }"
    for number, new in enumerate(
        ('stl = "box.stl"', "cylinder = { center = [5, 7], radius = 20, z = [-4, 0] }")
    ):
        rows, result = one(tmp_path, PROGRAM, swap={old: new})
        wide = SLOT_MM3 if number == 0 else 4 * 18 + 4 * math.pi  # the bar is wider than the path is long
        assert rows[7]["removed_lo_mm3"] <= wide <= rows[7]["removed_hi_mm3"]
    assert result.stock.stock_volume.holds(1600 * math.pi)
    assert result.stock.stock_volume.width < 1e-2 * 1600 * math.pi


REFUSED = {
    "empty": ("", NCError, "empty"),
    "blank": ("  \n\n", NCError, "empty"),
    "no motion": ("T1 M6\nM30\n", NCError, "moves nothing"),
    "unknown tool": ("T7 M6\nS1 M3\nG1 X5 Y5 Z-1 F100\nM30\n", NCError, "T7|tool 7"),
    "arc": ("T1 M6\nS1 M3\nG0 X0 Y0 Z-1\nG2 X10 Y0 I4 J0 F100\nM30\n", NCError, ":4:.*radi"),
    "far": ("T1 M6\nS1 M3\nG1 X500 Y0 Z20 F100\nM30\n", StockError, "reaches the stock"),
    "above": ("T1 M6\nS1 M3\nG0 X5 Y5 Z3\nG1 Z0 F100\nM30\n", StockError, "reaches the stock"),
    "rapid": (
        "T1 M6\nS1 M3\nG0 X5 Y5 Z3\nG0 Z-2\nG0 X8\nG0 Z9\nG1 X500 F100\nM30\n",
        StockError,
        "no feed move.*the rapid in line 4 goes into its box, but rapids cut nothing; program cuts with G1",
    ),
    "beside": ("T1 M6\nS1 M3\nG0 X-2 Y-2 Z3\nG1 Z-1 F100\nM30\n", StockError, "reaches the stock"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_programs_that_cannot_be_simulated(case, tmp_path):
    program, kind, words = REFUSED[case]
    with pytest.raises(kind, match=words) as caught:
        one(tmp_path, program)
    assert "\n" not in str(caught.value)


def test_later_engines_are_refused_by_name(tmp_path):
    job = Job.load(write_job(tmp_path))
    with pytest.raises(InputError, match=r"brep.*not supported yet"):
        run(job, engine="brep")
    with pytest.raises(InputError, match="unknown engine"):
        run(job, engine="magic")


def test_an_open_stl_is_refused(tmp_path):
    import trimesh

    box = trimesh.creation.box(bounds=[[0, 0, -4], [10, 18, 0]])
    trimesh.Trimesh(box.vertices, box.faces[1:]).export(tmp_path / "open.stl")
    with pytest.raises(StockError, match="open"):
        one(tmp_path, PROGRAM, swap={"box = { min = [0, 0, -4], max = [10, 18, 0] }": 'stl = "open.stl"'})


@pytest.fixture(scope="module", params=[False, True], ids=["no insertion", "insertion"])
def scheduled(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("scheduled")
    job = JOB + FEED + ("insert_blocks = true\n" if request.param else "")
    return run(Job.load(write_job(folder, job=job)), out=folder / "out", engine="mesh")


def test_the_schedule_is_faster_at_the_same_peak(scheduled):
    s, table = scheduled.summary, scheduled.blocks
    assert s["scheduled_time_s"] < s["time_s"]
    assert s["scheduled_time_s"] == pytest.approx(table["scheduled_time_s"].sum())
    before, after = table["mrr_mm3_min"].fill_null(0).max(), np.nanmax(scheduled.schedule.after_rate)
    if scheduled.job.keys.feed.insert_blocks:
        assert scheduled.schedule.blocks >= s["blocks"]
    else:
        assert after <= before * (1 + 1e-9) and scheduled.schedule.blocks == s["blocks"]
    feeds = table.filter(pl.col("motion") != "rapid")["scheduled_feed_mm_min"]
    assert feeds.min() >= 60 and feeds.max() <= 3000
    assert table.filter(pl.col("motion") == "rapid")["scheduled_feed_mm_min"].null_count() == 5


def test_the_rewritten_program_cuts_the_same_part(scheduled):
    rerun = scheduled.scheduled_blocks
    width = scheduled.summary["removed_hi_mm3"] - scheduled.summary["removed_lo_mm3"]
    assert abs(rerun["removed_mm3"].sum() - scheduled.summary["removed_mm3"]) <= width
    program = vm.read_program(scheduled.folder / "scheduled.nc")
    assert not program.errors and len(program.moves) >= len(scheduled.program.moves)
    assert rerun["time_s"].sum() == pytest.approx(scheduled.summary["scheduled_time_s"])


def test_the_samples_do_not_change_the_first_table(scheduled, tiny):
    names = ["block", "removed_mm3", "removed_lo_mm3", "removed_hi_mm3", "time_s"]
    ours, theirs = scheduled.blocks.select(names).to_numpy(), tiny.blocks.select(names).to_numpy()
    assert np.abs(ours - theirs).max() < 1e-9


def test_swept_volume_is_the_closed_form_in_its_bracket():
    ball = vm.BallNose(diameter=10, length=40)
    bracket = vm.swept_volume(vm.Sweep(ball, (0, 0, 0), (30, 0, 0)), chord=0.05)
    exact = ball.profile.volume + 30 * ball.profile.meridian_area
    assert bracket.estimate == pytest.approx(exact, rel=1e-12)
    assert bracket.lo < exact < bracket.hi and bracket.width < 0.02 * exact


def test_the_estimate_of_a_waisted_tool_lies_between_its_inner_and_outer_solid():
    waist = vm.ProfileTool(points=[[0, 0], [5, 0], [8, 5], [6, 10], [6, 20]])
    ramp = vm.Sweep(waist, (0, 0, 0), (20, 7, 3))
    assert ramp.volume is None  # so the estimate is that of the fair solid
    bracket = vm.swept_volume(ramp)
    inner, outer = (vm.engines.mesh.solid(ramp, side=side).volume() for side in ("inner", "outer"))
    assert (bracket.lo, bracket.hi) == (inner, outer)
    assert inner <= bracket.estimate <= outer


def test_the_package_root_is_lazy_and_complete():
    assert sorted(vm.__all__) == vm.__all__
    for name in vm.__all__:
        assert getattr(vm, name) is not None
    assert callable(vm.engines.mesh.solid)
    with pytest.raises(AttributeError):
        vm.nonsense  # noqa: B018
