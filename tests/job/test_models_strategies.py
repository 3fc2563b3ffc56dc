"""Shipped models with chip area and force as what the feed keeps, end to end; loads beside their closed forms."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from vmachining.job import Job, run

MODELS = Path(__file__).parents[2] / "models"
KT, KR, KA, KTE, KRE, KAE = 700.0, 250.0, 120.0, 25.0, 18.0, 4.0
"""N/mm^2 and N/mm of the shipped set `aluminium_like_constant`."""

FORCE = '\n[force]\ncoefficients = "aluminium_like_constant"\n'
COLUMN = {"chip_area": "chip_area_mm2", "force": "force_n"}


def model(folder, name, change=str):
    shutil.copytree(MODELS / name, folder / name)
    path = folder / name / "job.toml"
    path.write_text(change(path.read_text(encoding="utf-8")) + FORCE, encoding="utf-8")
    return Job.load(path)


@pytest.mark.slow  # 33 passes with 17 stations each, cut and met three times
def test_the_staircase_keeps_its_force(tmp_path):
    """First pass: a flat cutter of 6 mm with three teeth and half of it in the bar, 2.31861 mm deep, F1200, S6000."""
    found = run(
        model(tmp_path, "staircase", lambda text: text.replace('"volume"', '"force"')), engine="columns"
    )
    first = found.blocks.filter(pl.col("line") == 8).row(0, named=True)
    f, ap = 1200.0 / (3 * 6000.0), 2.31861
    assert first["ap_mm"] == pytest.approx(ap, abs=1e-6) and first["ae_mm"] == pytest.approx(3.0, abs=1e-6)
    assert first["engaged_fraction"] == pytest.approx(0.25, abs=1e-6)
    assert first["chip_area_mm2"] == pytest.approx(f * ap, rel=1e-6)
    one_tooth = (
        np.linalg.norm([KT * f + KTE, KR * f + KRE, KA * f + KAE]) * ap
    )  # straight ahead, the others in air
    assert first["force_n"] == pytest.approx(one_tooth, rel=1e-6)
    torque = 3 / (2 * np.pi) * 3.0 * ap * (KT * f + KTE * np.pi / 2)
    assert first["power_w"] == pytest.approx(2 * np.pi * 6000 / 60 * torque / 1000, rel=1e-4)
    goals = {1: first["force_n"], 2: found.blocks.filter(pl.col("tool") == 2)["force_n"].max()}
    for tool, goal in goals.items():
        after = found.scheduled_blocks.filter(pl.col("tool") == tool)
        assert after["force_n"].max() <= goal * (1 + 1e-6)
    assert found.summary["scheduled_time_s"] < 0.6 * found.summary["time_s"]
    assert set(found.schedule.comparison["judged"]) == {"simulated"}


@pytest.mark.long  # a minute each: 440 blocks of an STL stock by mesh, and their contact, twice
@pytest.mark.parametrize(("strategy", "reference"), [("chip_area", 0.02), ("force", 60.0)])
def test_finishing_keeps_what_is_asked(strategy, reference, tmp_path):
    """Ball of 6 mm, two teeth, S12000, F1500; block 1 plunges into a corner of the stock."""
    feed = (
        f'\n[feed]\nstrategy = "{strategy}"\nreference = {reference}\nmin_mm_min = 200\nmax_mm_min = 4000\n'
    )
    found = run(model(tmp_path, "finishing", lambda text: text + feed))
    plunge = found.blocks.row(1, named=True)
    f, ap = 1500.0 / (2 * 12000.0), plunge["ap_mm"]
    assert plunge["chip_thickness_mm"] == pytest.approx(f, rel=1e-6)
    assert plunge["chip_area_mm2"] == pytest.approx(f * np.sqrt(ap * (6.0 - ap)), rel=1e-6)
    column = COLUMN[strategy]
    assert (
        found.blocks[column] > reference
    ).sum() > 10  # there is something to slow down, and something to speed up
    after = found.scheduled_blocks.filter(pl.col(column) > 0.0)
    free = after.filter((pl.col("feed_mm_min") > 200.0) & (pl.col("feed_mm_min") < 4000.0))
    assert len(free) > 100 and (free[column] <= reference * (1 + 1e-6)).all()
    assert (after.filter(pl.col("feed_mm_min") == 4000.0)[column] <= reference * (1 + 1e-6)).all()
    assert free[column].min() > 0.99 * reference  # written feeds are rounded down to 0.1 mm/min
    assert found.summary["scheduled_time_s"] < found.summary["time_s"]
