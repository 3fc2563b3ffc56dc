"""Stages may be left out, are done later where they are asked for, and say what they cost."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import polars as pl
import polars.testing
import pytest
from tinyjob import FEED, JOB, write_job

from vmachining.cli.main import run as command
from vmachining.job.record import Spent, in_words

TEETH = JOB.replace("length_mm = 20", "length_mm = 20\nflutes = 2")
LOADS = ("ae_mm", "ap_mm", "engaged_fraction", "chip_area_mm2", "chip_thickness_mm")


@pytest.fixture
def job(tmp_path: Path) -> Path:
    return write_job(tmp_path / "job", job=TEETH)


def told(out: Path) -> dict[str, object]:
    summary: dict[str, object] = json.loads((out / "summary.json").read_text())
    return summary


def test_volumes_alone_then_everything_else(
    job: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`--stages cut` writes volumes and nothing else; `contact`, `check` and `--resume` add the rest, as one run makes it."""
    whole, out = tmp_path / "whole", tmp_path / "out"
    assert command(["run", str(job), "--out", str(whole)]) == 0
    assert command(["run", str(job), "--out", str(out), "--stages", "cut"]) == 0
    table = pl.read_parquet(out / "blocks.parquet")
    assert table.select(LOADS).null_count().sum_horizontal()[0] == len(LOADS) * len(table)
    assert table["removed_dexel_mm3"].null_count() == len(table) and "second_judge" not in told(out)
    assert {path.name for path in out.iterdir()} == {
        "blocks.csv", "blocks.parquet", "summary.json", "manifest.json", "stages.zip",
    }  # fmt: skip
    assert set(told(out)["stage_seconds"]) == {"read", "cut", "files"}
    assert command(["contact", str(out)]) == 0
    ours, theirs = pl.read_parquet(out / "blocks.parquet"), pl.read_parquet(whole / "blocks.parquet")
    polars.testing.assert_frame_equal(
        ours.select("block", *LOADS), theirs.select("block", *LOADS), check_exact=True
    )
    assert ours["chip_area_mm2"].max() > 0.0
    assert command(["run", str(job), "--out", str(out), "--resume"]) == 0  # all stages, as by default
    capsys.readouterr()
    polars.testing.assert_frame_equal(pl.read_parquet(out / "blocks.parquet"), theirs, check_exact=True)
    assert (out / "report.html").is_file() and (out / "stock.stl").is_file()
    assert command(["check", str(out), "--brep", "2"]) == 0
    assert pl.read_parquet(out / "blocks.parquet")["brep_status"][2] == "agreed"
    assert told(out)["brep"]["asked"] == 1


def test_contact_of_a_sample(job: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.modules["vmachining.job.stations"], "SAMPLE", 2)
    whole, out = tmp_path / "whole", tmp_path / "out"
    assert command(["run", str(job), "--out", str(whole), "--quiet"]) == 0
    assert command(["run", str(job), "--out", str(out), "--contact", "sample", "--quiet"]) == 0
    ours, theirs = pl.read_parquet(out / "blocks.parquet"), pl.read_parquet(whole / "blocks.parquet")
    known = ours.filter(pl.col("ap_mm").is_not_null())["block"].to_list()
    assert len(known) == 2 and theirs["ap_mm"].count() > 2
    both = (frame.filter(pl.col("block").is_in(known)).select(LOADS) for frame in (ours, theirs))
    polars.testing.assert_frame_equal(*both, check_exact=True)
    assert any("of 2 blocks (sample)" in text for text in told(out)["contact_notes"])
    assert command(["contact", str(out), "--quiet"]) == 0
    polars.testing.assert_frame_equal(
        pl.read_parquet(out / "blocks.parquet").select(LOADS), theirs.select(LOADS), check_exact=True
    )


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (
            ["--stages", "cut,milling"],
            "unknown stage 'milling'; take some of cut, contact, plan, judge, show",
        ),
        (["--contact", "some"], "--contact 'some' is not understood; give none | sample | all"),
        (["--contact", "none"], "[feed] in the job needs the contact of all blocks"),
        (["--stages", "cut,plan"], "omit the plan as well: --stages cut,judge,show"),
    ],
)
def test_what_cannot_be_is_refused(
    words: list[str], text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    job = write_job(tmp_path / "job", job=TEETH + FEED)
    assert command(["run", str(job), "--out", str(tmp_path / "out"), *words]) == 2
    assert text in capsys.readouterr().err and not (tmp_path / "out").exists()


def test_a_result_of_other_files_is_named(
    job: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert command(["run", str(job), "--out", str(out), "--stages", "cut", "--quiet"]) == 0
    program = job.parent / "tiny.nc"
    program.write_text(program.read_text().replace("F600", "F601"))
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    assert command(["contact", str(out)]) == 2
    told = capsys.readouterr().err
    assert f"the program file {program} changed since this result was made" in told
    assert command(["check", str(tmp_path)]) == 2
    assert "is not a result of a run" in capsys.readouterr().err
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before
    assert command(["run", str(job), "--out", str(out), "--stages", "cut", "--resume"]) == 0
    told = capsys.readouterr().err
    assert f"the program file {program} changed since this result was made; nothing of it is kept" in told


def test_a_result_of_another_version_is_added_to_by_no_command_and_made_anew_by_run(
    job: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert command(["run", str(job), "--out", str(out), "--stages", "cut", "--quiet"]) == 0
    manifest = json.loads((out / "manifest.json").read_text())
    manifest["versions"]["vmachining"] = "0.0.1"
    (out / "manifest.json").write_text(json.dumps(manifest))
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    for words in (["contact", str(out), "--blocks", "sample"], ["check", str(out), "--brep", "2"]):
        assert command(words) == 2
        assert "this result was made with vmachining 0.0.1, this is " in capsys.readouterr().err
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before
    assert command(["run", str(job), "--out", str(out), "--contact", "sample", "--resume"]) == 0
    told = capsys.readouterr().err
    assert "this result was made with vmachining 0.0.1, this is " in told and "nothing of it is kept" in told


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["contact", "OUT", "--blocks", "3-5"], "--blocks '3-5' is not understood; give none | sample | all"),
        (
            ["run", "JOB", "--out", "OUT", "--resume", "--contact", "3-5"],
            "--contact '3-5' is not understood; give none | sample | all",
        ),
    ],
)
def test_an_unknown_choice_of_contact_is_refused_by_its_option(
    words: list[str], text: str, job: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert command(["run", str(job), "--out", str(out), "--stages", "cut", "--quiet"]) == 0
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    assert command([{"OUT": str(out), "JOB": str(job)}.get(word, word) for word in words]) == 2
    assert text in capsys.readouterr().err
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before


def test_a_part_is_no_result_to_add_to(job: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert command(["run", str(job), "--out", str(out), "--part", "1/2", "--quiet"]) == 0
    assert command(["contact", str(out)]) == 2
    assert "is part 1/2 of a run, and has no finished table; join all parts" in capsys.readouterr().err


def test_seconds_and_memory_are_taken_after_the_report(job: Path, tmp_path: Path) -> None:
    """They were taken before it: 301 MB stated, 681 measured."""
    from vmachining import run

    result = run(job)
    before = dict(result.summary)
    result.write(tmp_path / "out")
    after = told(tmp_path / "out")
    assert after["peak_mb"] >= before["peak_mb"] and after["seconds"] > before["seconds"]
    assert after["stage_seconds"]["files"] > before["stage_seconds"]["files"]
    assert sum(after["stage_seconds"].values()) == pytest.approx(after["seconds"])


def test_time_within_a_stage_is_counted_once(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([0.0, 1.0, 4.0, 6.0, 100.0, 103.0])
    monkeypatch.setattr("time.perf_counter", lambda: next(clock))
    spent = Spent()
    spent.add({"cut": 10.0})
    with spent.on("read"), spent.on("cut"):  # 0 to 1 reading, 1 to 4 cutting, 4 to 6 reading
        pass
    with spent.on("files"):
        pass
    assert spent.seconds == {"cut": 13.0, "read": 3.0, "files": 3.0}
    assert in_words({"cut": 2.13, "contact": 0.6, "judge": 0.001}) == "cut 2.1 s, contact 0.6 s"


def test_the_table_of_a_long_program_is_parquet_and_csv_where_asked_for(
    job: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Above `MOST_CSV` blocks there is no blocks.csv, and it is said; `--csv` makes it later, and later runs keep it."""
    short, out = tmp_path / "short", tmp_path / "out"
    asked = ["run", str(job), "--stages", "cut", "--out"]
    assert command([*asked, str(short)]) == 0 and "  table " not in capsys.readouterr().err
    monkeypatch.setattr(sys.modules["vmachining.job.course"], "MOST_CSV", 2)
    assert command([*asked, str(out)]) == 0
    assert "written as .parquet only; --csv adds the .csv" in capsys.readouterr().err
    assert not (out / "blocks.csv").exists() and "table_note" in told(out)
    assert command([*asked, str(out), "--resume", "--csv"]) == 0
    assert (out / "blocks.csv").read_bytes() == (short / "blocks.csv").read_bytes()
    assert (out / "blocks.parquet").read_bytes() == (short / "blocks.parquet").read_bytes()
    assert "table_note" not in told(out)
    assert command(["run", str(job), "--out", str(out), "--resume", "--stages", "cut,judge"]) == 0
    assert (out / "blocks.csv").is_file() and "table_note" not in told(out)


@pytest.mark.slow  # 4 s
def test_a_schedule_with_too_many_blocks_for_csv_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The program itself is short enough; blocks that the schedule inserts are not, and nothing said so."""
    job, out = write_job(tmp_path / "job", job=TEETH + FEED + "insert_blocks = true\n"), tmp_path / "out"
    monkeypatch.setattr(sys.modules["vmachining.job.course"], "MOST_CSV", 9)
    assert command(["run", str(job), "--out", str(out), "--stages", "cut,contact,plan", "--quiet"]) == 0
    rows = [len(pl.read_parquet(out / f"{stem}.parquet")) for stem in ("blocks", "scheduled_blocks")]
    assert rows[0] <= 9 < rows[1], rows
    assert (out / "blocks.csv").is_file() and not (out / "scheduled_blocks.csv").exists()
    assert "--csv" in str(told(out)["table_note"])
