"""More is asked of a finished result: only that is done. What would have given other numbers is refused by name."""

from __future__ import annotations

import json
import shutil
from contextlib import suppress
from pathlib import Path
from zipfile import ZipFile

import polars as pl
import polars.testing
import pytest
from tinyjob import FEED, JOB, write_job

from vmachining.cli.main import run as command
from vmachining.errors import InputError, JobError
from vmachining.job import Job, Stopped, run
from vmachining.job.folder import ResultFolder
from vmachining.job.store import finished


@pytest.fixture
def job(tmp_path: Path) -> Path:
    return write_job(tmp_path / "job")


def passes(job: Path, out: Path, **asked: object) -> tuple[dict[str, int], pl.DataFrame]:
    """Blocks that every pass does in a run that continues, and its table."""
    done: dict[str, int] = {}
    begun: dict[str, int] = {}

    def progress(name: str, now: int, total: int) -> None:
        begun.setdefault(name, now)
        done[name] = now - begun[name]

    result = run(Job.load(job), out=out, resume=True, progress=progress, **asked)
    result.write(out)
    return done, result.blocks


def test_the_example_of_the_help_text(job: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`run JOB`, then `run JOB --brep 2,6 --resume`: said "already complete" and did nothing."""
    out = tmp_path / "out"
    words = ["run", str(job), "--out", str(out)]
    assert command(words) == 0
    before = pl.read_parquet(out / "blocks.parquet")
    assert command([*words, "--brep", "2,6", "--resume"]) == 0
    err = capsys.readouterr().err
    assert "already complete" not in err and "2 blocks asked" in err
    after = pl.read_parquet(out / "blocks.parquet")
    assert after.filter(pl.col("brep_status") == "agreed")["block"].to_list() == [2, 6]
    same = [name for name in before.columns if "brep" not in name and "dexel" not in name]
    polars.testing.assert_frame_equal(before.select(same), after.select(same), check_exact=True)
    manifest = json.loads((out / "manifest.json").read_text())
    assert manifest["complete"] and manifest["options"]["brep"] == "2,6" and manifest["checkpoints"] == {}
    assert json.loads((out / "summary.json").read_text())["brep"]["asked"] == 2
    for again in (["--brep", "2,6"], []):
        assert command([*words, *again, "--resume"]) == 0
        assert "already complete" in capsys.readouterr().err


def test_nothing_is_cut_again_and_what_is_there_stays(job: Path, tmp_path: Path) -> None:
    run(Job.load(job), out=tmp_path / "out", brep="2").write(tmp_path / "out", stock=("3mf",))
    done, rows = passes(job, tmp_path / "out", brep="5-6")
    assert done["program"] == 0 and done["engagement"] == 0
    asked = rows.filter(pl.col("brep_status") != "skipped")["block"].to_list()
    assert asked == [2, 5, 6]
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert manifest["options"]["brep"] == "2+5-6" and manifest["options"]["stock"] == ["3mf", "stl"]
    assert (tmp_path / "out" / "stock.3mf").is_file() and (tmp_path / "out" / "stock.stl").is_file()


def test_with_a_schedule_no_pass_is_done_again(tmp_path: Path) -> None:
    job = write_job(tmp_path / "job", job=JOB + FEED + "insert_blocks = true\n")
    whole = run(Job.load(job), out=tmp_path / "out")
    whole.write(tmp_path / "out")
    text = (tmp_path / "out" / "scheduled.nc").read_text()
    done, rows = passes(job, tmp_path / "out", brep="2")
    assert done["program"] == done["scheduled"] == 0
    same = [name for name in rows.columns if "brep" not in name and "dexel" not in name]
    polars.testing.assert_frame_equal(whole.blocks.select(same), rows.select(same), check_exact=True)
    assert (tmp_path / "out" / "scheduled.nc").read_text() == text


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--engine", "mesh"], 'engine was "columns" and is "mesh"'),
        (["--chord", "0.02"], "chord_mm was 0.05 and is 0.02"),
        (["--width", "1%"], "width was 0.003 and is 0.01"),
        (["--spacing", "0.5"], "spacing_mm was null and is 0.5"),
        (["--directions", "1"], "directions was 3 and is 1"),
    ],
)
def test_other_numbers_are_refused(
    words: list[str], told: str, job: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert command(["run", str(job), "--out", str(out), "--quiet"]) == 0
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    assert command(["run", str(job), "--out", str(out), "--resume", *words]) == 2
    err = capsys.readouterr().err
    assert (
        f"the finished run had other options: {told}" in err and "--out, or run again without --resume" in err
    )
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before


def test_more_stocks_are_written(job: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    words = ["run", str(job), "--out", str(out)]
    assert command(words) == 0
    assert command([*words, "--stock", "3mf", "--stock-at", "2", "--resume"]) == 0
    assert all((out / name).is_file() for name in ("stock.stl", "stock.3mf", "stock_2.step"))
    assert "already complete" not in capsys.readouterr().err


def test_a_stage_in_addition_can_be_interrupted(job: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    run(Job.load(job), out=out, brep="2").write(out)
    under_way: list[str] = []
    with pytest.raises(Stopped):
        run(
            Job.load(job), out=out, resume=True, brep="6", stop=lambda: "brep" in under_way,
            progress=lambda name, *_: under_way.append(name),
        )  # fmt: skip
    assert json.loads((out / "manifest.json").read_text())["complete"] is False
    done, rows = passes(job, out, brep="6")
    assert done["program"] == 0
    assert rows.filter(pl.col("brep_status") != "skipped")["block"].to_list() == [2, 6]


def test_other_inputs_begin_anew(job: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    run(Job.load(job), out=out).write(out)
    program = job.parent / "tiny.nc"
    program.write_text(program.read_text().replace("F600", "F601"))
    assert finished(Job.load(job), out) is None
    done, _ = passes(job, out)
    assert done["program"] == 9


def test_an_archive_of_something_else_is_refused(job: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    run(Job.load(job), out=out).write(out)
    manifest = json.loads((out / "manifest.json").read_text())
    with ZipFile(out / "stages.zip", "w") as archive:
        archive.writestr("../evil.csv", "block")
    manifest["files"]["stages.zip"] = None
    (out / "manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(JobError, match=r"holds '\.\./evil\.csv', which no run writes"):
        run(Job.load(job), out=out, resume=True, brep="2")
    assert not (tmp_path / "evil.csv").exists()


def test_without_the_archive_the_run_is_done_again(job: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    run(Job.load(job), out=out).write(out)
    (out / "stages.zip").unlink()
    assert finished(Job.load(job), out) is not None
    done, rows = passes(job, out, brep="2")
    assert done["program"] == 9 and rows["brep_status"].to_list().count("agreed") == 1


def test_whenever_a_run_that_adds_is_killed_nothing_is_cut_again(
    job: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The directory as it is before each of its manifests, after what was made before is gone, and while checkpoints are
    unpacked: from each of them the run continues after the last block that was cut."""
    out, moments = tmp_path / "out", [0]
    run(Job.load(job), out=out, contact="none").write(out)

    def told(function):
        def call(*words, **options):
            shutil.copytree(out, tmp_path / f"killed-{len(moments)}")
            moments.append(0)
            return function(*words, **options)

        return call

    with monkeypatch.context() as patch:
        patch.setattr(ResultFolder, "save", told(ResultFolder.save))
        patch.setattr("vmachining.job.result.now", told(lambda: "2026-01-01T00:00:00Z"))
        patch.setattr(shutil, "copyfileobj", told(shutil.copyfileobj))
        run(Job.load(job), out=out, resume=True).write(out, report=False)
    assert len(moments) > 10
    for folder in sorted(tmp_path.glob("killed-*")):
        begun: dict[str, int] = {}
        with suppress(Stopped):
            run(
                Job.load(job), out=folder, resume=True, stop=lambda: True,
                progress=lambda name, now, total, begun=begun: begun.setdefault(name, now),
            )  # fmt: skip
        assert begun["program"] == 9, sorted(path.name for path in folder.iterdir())
        assert not list(folder.glob(".*tmp*"))


def test_an_archive_that_changed_or_is_somebodys_is_left_alone(job: Path, tmp_path: Path) -> None:
    out, theirs = tmp_path / "out", tmp_path / "theirs"
    theirs.mkdir()
    (theirs / "stages.zip").write_bytes(b"of somebody")
    with pytest.raises(InputError, match="was not made by this command"):
        run(Job.load(job), out=theirs)
    assert (theirs / "stages.zip").read_bytes() == b"of somebody"
    result = run(Job.load(job), out=out, contact="none")
    with pytest.raises(InputError, match="was not made by this command"):
        result.write(theirs)
    result.write(out)
    with ZipFile(out / "stages.zip", "a") as archive:
        archive.comment = b"changed"
    with pytest.raises(InputError, match="was changed since it was made"):
        run(Job.load(job), out=out, resume=True)


def test_a_result_that_is_written_twice_has_its_own_stages_in_both_places(job: Path, tmp_path: Path) -> None:
    """The second directory held an older result, with other volumes: its stages would have been continued."""
    here, there = tmp_path / "here", tmp_path / "there"
    run(Job.load(job), out=there, width=0.2, contact="none").write(there, report=False)
    result = run(Job.load(job), out=here, contact="none")
    for folder in (here, there):
        result.write(folder, report=False)
    assert (here / "stages.zip").read_bytes() == (there / "stages.zip").read_bytes()
    done, _ = passes(job, there)
    assert done["program"] == 0 and done["engagement"] == 9


def test_an_interrupted_run_keeps_its_csv(job: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vmachining.job.course.MOST_CSV", 3)
    with pytest.raises(Stopped):
        run(Job.load(job), out=tmp_path / "out", csv=True, contact="none", stop=lambda: True)
    run(Job.load(job), out=tmp_path / "out", resume=True, contact="none")
    assert (tmp_path / "out" / "blocks.csv").is_file()
