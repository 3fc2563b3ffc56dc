"""The page shows contact, chips and forces, and all strategies beside the one asked for."""

from __future__ import annotations

import re

import numpy as np
import polars as pl
import pytest
from pagedata import unpacked
from tinyjob import FEED, JOB, write_job

from vmachining.job import Job, run
from vmachining.report.page import doubtful

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
    assert "Where the load peaks" in page and "Peak of the resultant force" not in page
    assert "force_n" in {entry["name"] for entry in unpacked(page)[0]["loads"]}
    assert "All strategies on this job" in page and "force (asked for)" in page and "chip area" in page
    worst = pl.read_csv(folder / "blocks.csv")["force_n"].max()
    assert f"{worst:.5g} N" in page
    assert "chip thickness" in page and "columns are empty" not in page


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


def test_the_peak_leads_to_its_line(folder):
    """The most loaded blocks of the page are the largest forces of the table, each with a way to its block."""
    page = (folder / "report.html").read_text(encoding="utf-8")
    blocks = pl.read_csv(folder / "blocks.csv").filter(pl.col("force_n") > 0)
    part = page[page.index("blocks with the largest force") :]
    listed = [int(k) for k in re.findall(r'data-block="(\d+)"', part[: part.index("</table>")])]
    forces = [blocks.filter(pl.col("block") == k)["force_n"][0] for k in listed]
    assert forces == blocks["force_n"].sort(descending=True).head(len(forces)).to_list() and len(forces) > 2


def test_the_map_of_a_slot_is_a_sine_over_half_a_turn(folder):
    """A flat cutter in a full slot: from 0 to 180 degrees of the feed the chip is f sin(angle) thick, up to the depth of 1 mm."""
    head, arrays = unpacked((folder / "report.html").read_text(encoding="utf-8"))
    blocks = pl.read_csv(folder / "blocks.csv")
    block = blocks.filter(pl.col("line") == 7)["block"][0]
    record = next(r for r in head["contact"] if r["block"] == block)
    per_tooth = 600 / (8000 * 2)  # mm: F / (S flutes)
    n = record["angles"]
    levels = arrays["contact_maps"][record["map"] : record["map"] + 48 * n].reshape(n, 48).astype(float)
    angle = np.radians(90 + 360 * np.arange(n) / n)
    heights = record["low"] + (np.arange(48) + 0.5) * (record["high"] - record["low"]) / 48
    thick = (levels - 1) / 254 * record["top"]
    inside = np.sin(angle) > 1e-9  # at 0 and 180 degrees the edge only touches
    assert record["unit"] == "mm" and record["fed"] and record["top"] == pytest.approx(per_tooth, rel=1e-9)
    for k in np.flatnonzero(inside):
        assert (levels[k] > 0).tolist() == (heights < 1.0).tolist()
        # half a level of the scale
        assert np.abs(thick[k][heights < 1.0] - per_tooth * np.sin(angle[k])).max() <= per_tooth / 508 + 1e-12
    assert (levels[np.sin(angle) < -1e-9] == 0).all()


def test_a_turn_has_the_force_of_the_table_and_repeats_with_the_teeth(folder):
    head, arrays = unpacked((folder / "report.html").read_text(encoding="utf-8"))
    blocks = pl.read_csv(folder / "blocks.csv")
    drawn = {record["block"] for record in head["contact"]}
    assert drawn == set(blocks.filter((pl.col("force_n") > 0) & (pl.col("ap_mm") > 0))["block"].to_list())
    for record in head["contact"]:
        turn = arrays["contact_turns"][record["turn"] : record["turn"] + record["angles"]]
        told = blocks.filter(pl.col("block") == record["block"])["force_n"][0]
        half = record["angles"] // 2
        assert turn.max() <= told * (1 + 1e-5) and np.abs(turn[:half] - turn[half:]).max() <= 1e-4 * told


def test_a_card_says_where_the_load_peaks_and_odd_rates_are_questioned(folder):
    page = (folder / "report.html").read_text(encoding="utf-8")
    blocks = pl.read_csv(folder / "blocks.csv")
    worst = blocks.sort("force_n", descending=True, nulls_last=True).row(0, named=True)
    cards = page[page.index('class="cards"') : page.index('id="work"')]
    assert f"block {worst['block']}, line {worst['line']}, after" in cards and "Largest force" in cards
    assert "in the median" in cards and doubtful(blocks) == ""
    odd = blocks.with_columns(
        mrr_mm3_min=pl.when(pl.col("line") == 7).then(1e9).otherwise(pl.col("mrr_mm3_min"))
    )
    assert "1 block would remove" in doubtful(odd) and "(line 7)" in doubtful(odd)
