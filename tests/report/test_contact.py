"""The page shows contact, chips and forces, and all strategies beside the one asked for."""

from __future__ import annotations

import polars as pl
import pytest
from tinyjob import FEED, JOB, write_job

from vmachining.job import Job, run
from vmachining.report.figures import contact_along

FORCE = '\n[force]\ncoefficients = "aluminium_like_constant"\n'
CUTTER = JOB.replace("length_mm = 20", "length_mm = 20\nflutes = 2")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("page")
    text = CUTTER + FEED.replace('"volume"', '"force"') + FORCE
    run(Job.load(write_job(path, job=text))).write(path / "out", stock=())
    return path / "out"


def test_the_page_shows_contact_and_strategies(folder):
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "Contact, chips and forces" in page and 'id="contact"' in page
    assert "All strategies on this job" in page and "force (asked for)" in page and "chip area" in page
    worst = pl.read_csv(folder / "blocks.csv")["force_n"].max()
    assert f"{worst:.5g} N" in page
    assert "Largest chip thickness" in page and "columns are empty" not in page


def test_the_comparison_is_a_table_too(folder):
    table = pl.read_csv(folder / "strategies.csv")
    assert table["strategy"].to_list() == ["as programmed", "volume", "chip_area", "force"]
    asked = table.row(3, named=True)
    assert (
        asked["asked_for"] and asked["unit"] == "N" and asked["force_peak"] <= asked["reference"] * (1 + 1e-9)
    )
    assert asked["time_s"] < table["time_s"][0]


def test_a_reference_below_edge_forces_is_told_with_what_can_be_met(tmp_path):
    text = CUTTER + FEED.replace('"volume"', '"force"') + "reference = 30\n" + FORCE
    result = run(Job.load(write_job(tmp_path, job=text)))
    told = result.summary["schedule"]["note"]
    # the slot of line 7, one edge of 1 mm straight ahead with the other in air: Kte = 25, Kre = 18, Kae = 4 N/mm alone
    assert "below what edge forces alone need" in told
    result.write(tmp_path / "out", stock=())
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "elow what edge forces alone need" in page


def test_contact_can_be_drawn_over_time(folder):
    blocks = pl.read_parquet(folder / "blocks.parquet")
    seconds = contact_along(blocks).layout.meta["time"]
    assert len(seconds) == 2 * len(blocks) and seconds[0] == 0.0
    assert seconds[-1] == pytest.approx(blocks["time_s"].sum(), abs=1e-6)
    assert seconds[1::2][:-1] == pytest.approx(
        seconds[2::2], abs=1e-9
    )  # a block begins where the one before it ends
    assert 'data-along="time"' in (folder / "report.html").read_text(encoding="utf-8")
