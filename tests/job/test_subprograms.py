"""A job whose program calls a subprogram in a separate file: one row per motion, its file watched by resumes."""

from __future__ import annotations

import json

import pytest
from tinyjob import FEED, JOB, SLOT_MM3

import vmachining as vm

PROGRAM = "G21 G90\nT1 M6\nS8000 M3\nG0 X-4 Y4 Z5\nG0 Z-1\no<slot> call [14]\nG0 Z5\nM30\n"
SLOT = "o<slot> sub\nG1 X#1 F600\no<slot> endsub\n"


@pytest.fixture
def job(tmp_path):
    (tmp_path / "tiny.nc").write_text(PROGRAM)
    (tmp_path / "subs").mkdir()
    (tmp_path / "subs" / "slot.ngc").write_text(SLOT)
    path = tmp_path / "job.toml"
    path.write_text(JOB.replace("home = [0, 0, 20]", 'home = [0, 0, 20]\nsubroutines = ["subs"]') + FEED)
    return path


def test_the_schedule_leaves_the_feed_of_the_file_alone(job, tmp_path):
    result = vm.run(vm.Job.load(job), out=tmp_path / "out")
    (row,) = result.blocks.filter(result.blocks["removed_mm3"] > 0).to_dicts()
    assert (row["line"], row["text"], row["feed_mm_min"]) == (6, "o<slot> call [14]", 600)
    assert row["removed_mm3"] == pytest.approx(SLOT_MM3, rel=1e-6)
    assert (tmp_path / "out" / "scheduled.nc").read_text() == PROGRAM
    inputs = json.loads((tmp_path / "out" / "manifest.json").read_text())["inputs"]
    assert inputs["subprogram 1"]["file"] == str(tmp_path / "subs" / "slot.ngc")


def test_a_changed_file_is_another_program(job, tmp_path):
    from vmachining.job.store import finished

    loaded = vm.Job.load(job)
    vm.run(loaded, out=tmp_path / "out").write(tmp_path / "out")
    assert finished(loaded, tmp_path / "out") is not None
    (tmp_path / "subs" / "slot.ngc").write_text(SLOT.replace("600", "500"))
    assert finished(loaded, tmp_path / "out") is None
