"""A run that was stopped and continues makes the table of one that was never stopped."""

from __future__ import annotations

import json
import os
import signal
from unittest import mock

import numpy as np
import polars as pl
import polars.testing
import pytest
from tinyjob import FEED, JOB, write_job

from vmachining.engines.brep import Status, Verdict
from vmachining.engines.judges import Judge
from vmachining.engines.protocol import Removal
from vmachining.errors import InputError, JobError
from vmachining.job import Job, Stopped, cutting, engagement_columns, run
from vmachining.job.executor import WorkerPool, executor
from vmachining.job.verdicts import VerdictFile


def stop_after(stage, done):
    """A progress callback that sends Ctrl-C to this process once."""
    sent = []

    def progress(name, now, total):
        if name == stage and now == done and not sent:
            sent.append(True)
            os.kill(os.getpid(), signal.SIGINT)

    return progress


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    return Job.load(write_job(tmp_path_factory.mktemp("job"), job=JOB + FEED + "insert_blocks = true\n"))


@pytest.fixture(scope="module")
def whole(job, tmp_path_factory):
    return run(job, out=tmp_path_factory.mktemp("whole"))


def area_by_block(surface):
    """mm^2 that each block left on the workpiece; the order of triangles is nobody's business."""
    a, b, c = surface.vertices[surface.triangles].transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    return {int(k): float(area[surface.block == k].sum()) for k in np.unique(surface.block)}


@pytest.mark.parametrize(
    ("stage", "done"), [("program", 0), ("program", 3), ("scheduled", 0), ("scheduled", 2)]
)
def test_stop_and_go_on(stage, done, job, whole, tmp_path):
    with pytest.raises(Stopped) as caught:
        run(job, out=tmp_path, progress=stop_after(stage, done))
    assert caught.value.done == done and caught.value.stage == stage
    manifest = json.loads((tmp_path / "manifest.json").read_text())
    assert manifest["complete"] is False and manifest["checkpoints"][stage]["done"] == done
    partial = "blocks.partial.csv" if stage == "program" else "scheduled_blocks.partial.csv"
    assert len((tmp_path / partial).read_text().splitlines()) == done + 1
    result = run(job, out=tmp_path, resume=True)
    polars.testing.assert_frame_equal(result.blocks, whole.blocks, rel_tol=1e-9, abs_tol=1e-9)
    for key in ("removed_mm3", "removed_lo_mm3", "removed_hi_mm3", "final_mm3", "time_s", "scheduled_time_s"):
        assert result.summary[key] == pytest.approx(whole.summary[key], rel=1e-9)
    ours, theirs = area_by_block(result.surface), area_by_block(whole.surface)
    assert ours.keys() == theirs.keys() and ours == pytest.approx(theirs, rel=1e-9)
    result.write(tmp_path, stock=())
    left = {path.name for path in tmp_path.iterdir()}
    assert not any("partial" in name or "checkpoint" in name for name in left)
    assert json.loads((tmp_path / "manifest.json").read_text())["complete"] is True


@pytest.mark.parametrize(("stage", "done"), [("engagement", 3), ("engagement, scheduled", 6)])
def test_contact_goes_on_where_it_stopped(stage, done, tmp_path, monkeypatch):
    """Contact stops between chunks; chunks of three blocks give the numbers of one of nine."""
    teeth = {"length_mm = 20": "length_mm = 20\nflutes = 2"}
    job = Job.load(write_job(tmp_path / "job", job=JOB + FEED, swap=teeth))
    whole = run(job, out=tmp_path / "whole")
    monkeypatch.setattr(engagement_columns, "CHUNK", 3)
    with pytest.raises(Stopped, match=rf"block {done} of 9 \({stage}"):
        run(job, out=tmp_path / "out", progress=stop_after(stage, done))
    asked = []
    result = run(
        job, out=tmp_path / "out", resume=True, progress=lambda name, now, _: asked.append((name, now))
    )
    assert [now for name, now in asked if name == stage] == list(range(done, 10, 3))
    assert not any(name == "program" and now < 9 for name, now in asked)
    assert whole.blocks["chip_area_mm2"].max() > 0.0
    polars.testing.assert_frame_equal(result.blocks, whole.blocks, rel_tol=1e-9, abs_tol=1e-9)


def test_the_second_judge_can_be_stopped(job, tmp_path):
    with pytest.raises(Stopped, match="second judge"):
        run(job, out=tmp_path, progress=stop_after("second judge", 0))
    assert run(job, out=tmp_path, resume=True).blocks["removed_dexel_mm3"].count() > 0


def test_handlers_are_put_back(job, tmp_path):
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(Stopped):
        run(job, out=tmp_path, progress=stop_after("program", 1))
    assert signal.getsignal(signal.SIGINT) is before


def test_a_changed_program_is_not_resumed(tmp_path):
    path = write_job(tmp_path)
    with pytest.raises(Stopped):
        run(Job.load(path), out=tmp_path / "out", progress=stop_after("program", 2))
    program = tmp_path / "tiny.nc"
    program.write_text(program.read_text().replace("F600", "F601"))
    with pytest.raises(JobError, match="program file changed"):
        run(Job.load(path), out=tmp_path / "out", resume=True)
    fresh = run(Job.load(path), out=tmp_path / "out")  # without resume it starts again
    assert fresh.summary["blocks"] == 9


def test_rows_behind_the_checkpoint_are_made_again(tmp_path):
    path = write_job(tmp_path)
    with pytest.raises(Stopped):
        run(Job.load(path), out=tmp_path / "out", progress=stop_after("program", 4))
    partial = tmp_path / "out" / "blocks.partial.csv"
    rows = partial.read_text()
    partial.write_text(rows + rows.splitlines()[-1].replace("3,", "4,", 1) + "\n5,torn")
    result = run(Job.load(path), out=tmp_path / "out", resume=True)
    assert result.blocks["block"].to_list() == list(range(9))
    assert result.blocks["removed_mm3"].sum() == pytest.approx(result.summary["removed_mm3"])


@pytest.mark.parametrize("harm", ["edited", "shorter", "gone", "other columns"])
@pytest.mark.parametrize("stage", ["program", "scheduled"])
def test_changed_rows_are_not_continued(harm, stage, tmp_path):
    """What stood there was taken without a word; other columns were an internal failure."""
    job = Job.load(write_job(tmp_path / "job", job=JOB + FEED))
    with pytest.raises(Stopped):
        run(job, out=tmp_path / "out", progress=stop_after(stage, 8), engine="mesh")
    rows = tmp_path / "out" / ("blocks.partial.csv" if stage == "program" else "scheduled_blocks.partial.csv")
    before = rows.read_text()
    after = {
        "edited": before.replace(",40.0", ",41.0"), "shorter": before[: before[:-1].rindex("\n") + 1],
        "gone": None, "other columns": pl.read_csv(rows, infer_schema_length=0).drop("coolant").write_csv(),
    }[harm]  # fmt: skip
    assert after != before
    rows.unlink()
    if after is not None:
        rows.write_text(after)
    with pytest.raises(JobError, match=r"partial\.csv: .*; run again without --resume"):
        run(job, out=tmp_path / "out", resume=True, engine="mesh")
    assert (rows.read_text() if rows.exists() else None) == after
    assert run(job, out=tmp_path / "out", engine="mesh").summary["blocks"] == 9


@pytest.mark.slow  # 6 s
def test_a_workpiece_that_was_divided_stays_so(tmp_path, monkeypatch):
    """Few blocks are left, and fewer processes would be taken: volumes of meshes then had another rounding."""
    monkeypatch.setattr(WorkerPool, "ahead", 1)
    job = Job.load(write_job(tmp_path / "job"))
    with pytest.raises(Stopped):
        run(job, out=tmp_path / "out", progress=stop_after("program", 5), engine="mesh", workers=2)
    known = json.loads((tmp_path / "out" / "manifest.json").read_text())["checkpoints"]["program"]
    assert known["shares"] == 2 and known["done"] < known["total"]
    seen = []
    with mock.patch.object(
        cutting, "executor", lambda *a, **k: seen.append(k["shares"]) or executor(*a, **k)
    ):
        run(job, out=tmp_path / "out", resume=True, engine="mesh")
    assert seen == [2]


def test_resume_without_a_run_starts_one_and_wants_a_directory(tmp_path):
    job = Job.load(write_job(tmp_path))
    with pytest.raises(InputError, match="directory"):
        run(job, resume=True)
    assert run(job, out=tmp_path / "new", resume=True).summary["blocks"] == 9


def test_the_partial_table_reads_back_bit_for_bit(tmp_path):
    from vmachining.job.table import COLUMNS, RowFile, read_partial, read_samples

    row = {
        name: {pl.Float64: 0.1 + 0.2, pl.Int64: 7, pl.Boolean: False, pl.String: 'a "quoted", text'}[kind]
        for name, kind in COLUMNS.items()
    }
    row["warning"] = None
    path = tmp_path / "x.partial.csv"
    with RowFile(path) as rows:
        for one in (row | {"samples_mm3": "0.1 0.30000000000000004"}, row | {"block": 8, "text": "µ ; <b>"}):
            rows.write({name: [value] for name, value in one.items()})
    frame = read_partial(path)
    assert frame.row(0, named=True) == row and frame["text"][1] == "µ ; <b>"
    assert dict(read_samples(path)) == {7: (0.1, 0.1 + 0.2)}


def test_a_warning_of_two_lines_is_one_row_when_a_run_continues(tmp_path):
    from vmachining.job.table import RowFile, read_partial

    path = tmp_path / "x.partial.csv"
    with RowFile(path) as rows:
        rows.write({"block": [0, 1], "warning": ["one\r\ntwo", None]})
        digest = rows.digest
        rows.write({"block": [2], "warning": ["three"]})
    with RowFile(path, keep=2, digest=digest):
        pass
    frame = read_partial(path)
    assert frame["block"].to_list() == [0, 1] and frame["warning"].to_list() == ["one two", None]


@pytest.mark.slow  # 11 s
def test_verdicts_are_not_asked_for_again(tmp_path):
    job = Job.load(write_job(tmp_path, job=JOB + FEED))
    whole = run(job, out=tmp_path / "whole", brep="all").blocks
    with pytest.raises(Stopped, match="stopped after block 2 of 4"):
        run(job, out=tmp_path / "out", brep="all", workers=1, progress=stop_after("brep", 2))
    file = tmp_path / "out" / "brep.partial.csv"
    kept = pl.read_csv(file)
    assert kept.height == 2 and kept["status"].to_list() == ["agreed", "agreed"]
    # one is as it was; another was changed within its bracket; and a third was being written when the power went
    head, one, other = file.read_text().splitlines()
    value = repr(kept["removed_brep_mm3"][1])
    assert value in other
    file.write_text("\n".join([head, one, other.replace(value, repr(float(value) * (1.0 + 1e-7))), "7,agr"]))
    heard = []
    whom = {"brep": "all", "resume": True, "progress": lambda *words: heard.append(words)}
    result = run(job, out=tmp_path / "out", **whom).blocks
    assert all(
        done == total for stage, done, total in heard if stage in ("program", "scheduled")
    )  # both passes were done
    assert min(done for stage, done, _ in heard if stage == "brep") == 1
    assert result["removed_brep_mm3"].to_list() == whole["removed_brep_mm3"].to_list()
    polars.testing.assert_frame_equal(result, whole, rel_tol=1e-6, abs_tol=1e-9)


@pytest.mark.slow  # 11 s
def test_verdicts_have_the_time_that_is_asked_for(tmp_path):
    result = run(Job.load(write_job(tmp_path)), brep="2", brep_seconds=1e-3)
    row = result.blocks.row(2, named=True)
    assert (
        row["brep_status"] == "refused" and "judges: no answer within 0" in row["warning"]
    )  # what is left of it
    assert result.summary["brep"]["refused"] == 1
    with pytest.raises(Stopped):
        run(
            Job.load(write_job(tmp_path)), out=tmp_path / "out", brep="all", brep_seconds=1e-3, workers=1,
            progress=stop_after("brep", 1),
        )  # fmt: skip
    kept = pl.read_csv(tmp_path / "out" / "brep.partial.csv")
    assert kept["status"].to_list() == ["refused"] and kept["limit_s"].to_list() == [1e-3]
    more_time = {"brep": "all", "resume": True}
    result = run(Job.load(write_job(tmp_path)), out=tmp_path / "out", **more_time)
    assert result.summary["brep"] == result.summary["brep"] | {"agreed": 4, "refused": 0}
    with pytest.raises(InputError, match="brep_seconds 0 is not a limit"):
        run(Job.load(write_job(tmp_path)), brep="2", brep_seconds=0.0)


def test_a_verdict_reads_back_as_it_was_written(tmp_path):
    """Values and errors come from numpy, too, which writes its numbers in words of its own."""
    rays = Judge("dexel", Removal(1.2, 1.45, 1.7, proven=False))
    verdict = Verdict(
        Status.RETRIED, np.float64(1.5), np.float64(0.25), "rotated", 5, "", 2.5, 3, judges=(rays,)
    )
    path = tmp_path / "verdicts.csv"
    wide, narrow = ([Judge("mesh", Removal(lo, lo, hi))] for lo, hi in ((1.0, 2.0), (1.8, 2.0)))
    with VerdictFile(path, {7: wide}, 120.0) as file:
        file.add(7, verdict)
    for _ in range(2):
        with VerdictFile(path, {7: wide}, 120.0) as file:
            assert file.known == {7: verdict}
    with VerdictFile(path, {7: narrow}, 120.0) as file:
        assert not file.known  # 1.5 +- 0.25 does not reach it
