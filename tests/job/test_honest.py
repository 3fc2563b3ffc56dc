"""What a schedule could not do, what a stop costs, and what a triangulated stock hides: all of it is said."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest
from tinyjob import FEED, JOB, write_job

import vmachining as vm
from vmachining.job.pace import Pace
from vmachining.job.timing import machine_limits, move_times
from vmachining.job.toolpath import Toolpath

BOX = "box = { min = [0, 0, -4], max = [10, 18, 0] }"
ACCELERATION = {"max_feed_mm_min = 4000": "max_feed_mm_min = 4000\nmax_acceleration_mm_s2 = 500"}
HEAD = "T1 M6\nS1000 M3\nF600\n"


def times(tmp_path, program):
    job = vm.Job.load(write_job(tmp_path, swap=ACCELERATION, program=HEAD + program))
    read = vm.read_program(job.program_path)
    return move_times(Toolpath.of(read), machine_limits(job)).seconds.sum(), Pace.of(read).halt


def test_a_program_stop_and_a_tool_change_stop_the_axes(tmp_path):
    through, flags = times(tmp_path, "G1 X10\nG1 X20\nM30\n")
    assert flags.tolist() == [False, True]
    # 600 mm/min, 500 mm/s^2: a stop in the middle of a straight path costs one more v / a
    once = 600 / 60 / 500
    for program, where in (
        ("G1 X10\nM0\nG1 X20\nM30\n", [True, True]),
        ("G1 X10 M1\nG1 X20\nM30\n", [True, True]),
        ("G1 X10\n(M0)\nM3\nG1 X20\nM30\n", [False, True]),
        ("G1 X10\nT1 M6\nG1 X20\nM30\n", [True, True]),
        ("G1 X10\nG1 X20 M6 T1\nM30\n", [True, True]),
    ):
        seconds, flags = times(tmp_path, program)
        assert flags.tolist() == where, program
        assert seconds == pytest.approx(through + once * where[0], rel=1e-9), program


def test_a_deleted_stop_does_not_stop(tmp_path):
    job = vm.Job.load(write_job(tmp_path, program=HEAD + "G1 X10\n/M0\nG1 X20\nM30\n"))
    read = vm.read_program(job.program_path, block_delete=True)
    assert Pace.of(read).halt.tolist() == [True, True]
    assert Pace.of(read, block_delete=True).halt.tolist() == [False, True]


def test_a_feed_that_cannot_be_changed_is_reported(tmp_path):
    # G53 blocks keep their feed: the rewriter leaves them alone
    program = "G21 T1 M6\nS1000 M3\nG0 X-4 Y4 Z-1\nG53 G1 X14 F600\nG0 Z5\nM30\n"
    result = vm.run(vm.Job.load(write_job(tmp_path, program=program, job=JOB + FEED)))
    assert result.summary["untouched_lines"] == [4] and result.summary["unsplit_lines"] == []
    row = result.blocks.filter(pl.col("line") == 4)
    assert "left as programmed" in row["warning"][0] and row["scheduled_feed_mm_min"][0] == 600
    assert result.summary["warnings"] == 1
    (block,) = row["block"]
    assert "left as programmed" in result.schedule.limits[block]


def test_a_block_that_cannot_be_divided_is_reported(tmp_path):
    # its F would be in other units than that of the inserted lines
    program = "T1 M6\nS1000 M3\nG0 X-8 Y4 Z-1\nG20 G1 X1 F20\nG21\nG0 Z5\nM30\n"
    feed = FEED + "insert_blocks = true\n"
    result = vm.run(vm.Job.load(write_job(tmp_path, program=program, job=JOB + feed)))
    assert result.summary["unsplit_lines"] == [4]
    row = result.blocks.filter(pl.col("line") == 4)
    assert "could not be divided" in row["warning"][0]


def test_a_line_of_two_rapids_is_a_rapid(tmp_path):
    program = "T1 M6\nS1000 M3\nG0 X-4 Y4 Z-1\nG1 X14 F600\nG28 Z5\nM30\n"
    result = vm.run(vm.Job.load(write_job(tmp_path, program=program, job=JOB + FEED)))
    last = result.blocks.row(-1, named=True)
    assert last["motion"] == "rapid" and last["feed_mm_min"] is None and last["warning"] is None


def test_the_totals_of_a_round_step_stock_contain_the_truth(tmp_path):
    cq = pytest.importorskip("cadquery")
    radius, chord = 9.0, 0.05
    job = write_job(tmp_path, swap={BOX: 'step = "s.step"'}, program=HEAD + "G0 X-20 Y9 Z-1\nG1 X30\nM30\n")
    bar = cq.Workplane().circle(radius).extrude(-4).translate((5, 9, 0))
    cq.exporters.export(bar, str(tmp_path / "s.step"))
    result = vm.run(vm.Job.load(job))
    s = result.summary
    # a slot 4 mm wide along the diameter, 1 mm deep: 2 * (h sqrt(R^2 - h^2) + R^2 asin(h / R)), h = 2
    exact = 2 * (2 * np.sqrt(radius**2 - 4) + radius**2 * np.arcsin(2 / radius))
    assert s["removed_lo_mm3"] <= exact <= s["removed_hi_mm3"]
    assert s["stock_step_mm3"] == pytest.approx(np.pi * radius**2 * 4, rel=1e-9)
    assert abs(s["stock_step_mm3"] - s["stock_mm3"]) <= s["stock_slack_mm3"]
    assert s["stock_slack_mm3"] == pytest.approx(chord * 2 * np.pi * radius * 4, rel=0.01)
    (note,) = s["notes"]
    assert "triangulated" in note and f"{s['stock_slack_mm3']:.3g}" in note


def test_a_step_stock_of_planes_is_exact(tmp_path):
    cq = pytest.importorskip("cadquery")
    job = write_job(tmp_path, swap={BOX: 'step = "s.step"'})
    box = cq.Workplane().box(10, 18, 4, centered=False).translate((0, 0, -4))
    cq.exporters.export(box, str(tmp_path / "s.step"))
    s = vm.run(vm.Job.load(job)).summary
    assert s["stock_slack_mm3"] == 0.0 and s["notes"] == []
