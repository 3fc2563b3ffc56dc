"""Two results on one page: volumes against the closed form of a slot, matched by where motions end."""

from __future__ import annotations

import json

import polars as pl
import pytest
from tinyjob import FEED, JOB, PROGRAM, write_job

from vmachining.cli.main import run as command
from vmachining.job import Job, run
from vmachining.report.comparison import Side, compare_results

SLOT = "N60 G1 X14 F600"


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """The job as it is, with a slot half as deep, with the slot in two blocks, and with a schedule; names that break out."""
    folder = tmp_path_factory.mktemp("both")
    programs = {
        "whole": PROGRAM,
        "half": PROGRAM.replace("N50 G0 Z-1", "N50 G0 Z-0.5"),
        "<b>two": PROGRAM.replace(SLOT, "N60 G1 X5 F600\nN61 G1 X14"),
        "<i>feed": PROGRAM,
    }
    for name, program in programs.items():
        job = write_job(folder / f"job {len(name)}", job=JOB + FEED * ("feed" in name), program=program)
        run(Job.load(job)).write(folder / name, stock=(), report=False)
    return folder


def test_a_slot_half_as_deep_removes_half_as_much(results):
    """4 x 10 mm, 1 mm against 0.5 mm deep: 20 mm3 less, and what follows is cut from more material there."""
    found = compare_results(Side.of(results / "whole"), Side.of(results / "half"))
    low, _, high = found.volume
    # the block of the slot ends at another height, so it stands with its approach between the same two ends
    told = found.differs.nonzero()[0]
    assert len(told) == 1 and low[told[0]] <= -20.0 <= high[told[0]] and high[told[0]] < 0.0
    assert not found.is_one_to_one


def test_a_block_in_two_is_one_piece_of_the_path(results):
    found = compare_results(Side.of(results / "whole"), Side.of(results / "<b>two"))
    assert not found.differs.any() and len(found.ends_a) == len(found.a.blocks) + 1
    sizes = found.ends_b[1:] - found.ends_b[:-1]
    assert sorted(sizes.tolist())[-2:] == [1, 2] and abs(found.seconds.sum()) < 1e-9


def test_one_page_says_it_in_words(results, capsys):
    page = results / "both.html"
    assert (
        command(["compare", str(results / "whole"), str(results / "<b>two"), "--html", str(page), "--json"])
        == 0
    )
    told = json.loads(capsys.readouterr().out)
    assert told["pieces_that_differ"] == 0 and told["blocks"][1] == told["blocks"][0] + 1
    text = page.read_text(encoding="utf-8")
    assert "agree within their brackets" in text and "&lt;b&gt;two" in text and "<b>two" not in text
    assert command(["compare", str(results / "half"), str(results / "whole"), "--html", str(page)]) == 1
    assert "differ for sure" in page.read_text(encoding="utf-8")


def test_before_and_after_a_schedule(results, capsys):
    page = results / "schedule.html"
    assert command(["compare", str(results / "<i>feed"), "--html", str(page), "--json"]) == 0
    told, blocks = json.loads(capsys.readouterr().out), pl.read_csv(results / "<i>feed" / "blocks.csv")
    assert told["time_s"] == pytest.approx(
        [blocks["time_s"].sum(), blocks["scheduled_time_s"].sum()], rel=1e-6
    )
    assert "as programmed and scheduled" in page.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("what", "words"),
    [(["whole"], "no schedule"), (["whole", "nowhere"], "no table of blocks"), (["both.css"], "no schedule")],
)
def test_what_cannot_be_compared_is_named(results, capsys, what, words):
    (results / "both.css").write_text("x")
    assert (
        command(["compare", *(str(results / name) for name in what), "--html", str(results / "p.html")]) == 2
    )
    assert words in capsys.readouterr().err and not (results / "p.html").exists()


def test_nothing_differs_for_sure_by_stated_intervals(results, tmp_path, capsys):
    """The same slots by a grid of heights: its intervals are stated, so the page says so where it said for sure."""
    for name in ("whole", "half"):
        program = PROGRAM.replace("N50 G0 Z-1", "N50 G0 Z-0.5") if name == "half" else PROGRAM
        job = write_job(tmp_path / f"job {name}", program=program)
        run(Job.load(job), engine="dexel").write(tmp_path / name, stock=(), report=False)
    page = tmp_path / "p.html"
    assert (
        command(["compare", str(tmp_path / "whole"), str(tmp_path / "half"), "--html", str(page), "--json"])
        == 1
    )
    told, text = json.loads(capsys.readouterr().out), page.read_text(encoding="utf-8")
    assert told["pieces_that_differ"] >= 1 and told["pieces_that_differ_proven"] == 0
    assert "for sure" not in text and "stated, not proven" in text
    assert (
        command(["compare", str(results / "whole"), str(results / "half"), "--html", str(page), "--json"])
        == 1
    )
    told, text = json.loads(capsys.readouterr().out), page.read_text(encoding="utf-8")
    assert told["pieces_that_differ_proven"] == told["pieces_that_differ"] >= 1
    assert "differ for sure" in text and "stated, not proven" not in text


def test_a_table_without_all_volumes_is_refused(results, tmp_path, capsys):
    table = pl.read_csv(results / "whole" / "blocks.csv")
    for k, missing in enumerate((None, float("nan"))):
        path = tmp_path / f"{k}.csv"
        table.with_columns(
            removed_hi_mm3=pl.when(pl.col("block") == 2).then(missing).otherwise(pl.col("removed_hi_mm3"))
        ).write_csv(path)
        assert (
            command(["compare", str(path), str(results / "whole"), "--html", str(tmp_path / "p.html")]) == 2
        )
        assert "removed_hi_mm3" in capsys.readouterr().err
