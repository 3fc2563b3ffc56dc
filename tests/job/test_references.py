"""One program by several references: feeds and times of a full slot (4 x 1 x 10 mm on 18 mm of path) in closed form."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest
from tinyjob import FEED, JOB, write_job

from vmachining.cli.main import run as command
from vmachining.job import Job, run

REFERENCES = (300.0, 600.0)


def table(folder, feed: str) -> pl.DataFrame:
    job = write_job(folder, job=JOB + FEED + f"references = {list(REFERENCES)}\n" + feed)
    run(Job.load(job)).write(folder / "out")
    return pl.read_csv(folder / "out" / "references.csv", infer_schema_length=None)


def test_whole_blocks(tmp_path, capsys):
    rows = table(tmp_path, "")
    assert rows["reference"].unique(maintain_order=True).to_list()[:3] == [None, *REFERENCES]
    mine = rows.filter(pl.col("block") == rows.filter(pl.col("length_mm") == 18.0)["block"][0])
    programmed = mine.row(0, named=True)
    assert programmed["feed_mm_min"] == 600.0 and programmed["load"] == pytest.approx(40 * 600 / 18, rel=0.01)
    for value in REFERENCES:
        row = mine.filter(pl.col("reference") == value).row(0, named=True)
        assert row["load"] <= value and not row["written"]
        assert row["feed_mm_min"] == pytest.approx(value * 18 / 40, rel=0.01)
        assert row["time_s"] == pytest.approx(60 * 40 / value, rel=0.01)
    # the schedule that is written stands beside them, with its own reference
    last = rows.filter(pl.col("written"))
    scheduled = pl.read_csv(tmp_path / "out" / "scheduled_blocks.csv", infer_schema_length=None)
    np.testing.assert_array_equal(
        last["feed_mm_min"].drop_nulls(), scheduled.filter(pl.col("motion") != "rapid")["feed_mm_min"]
    )
    # without its table the figure is refused
    (tmp_path / "out" / "references.csv").unlink()
    assert command(["figure", str(tmp_path / "out"), "--kind", "references"]) == 2
    assert "name `references` under [feed]" in capsys.readouterr().err


def test_divided_blocks(tmp_path):
    rows = table(tmp_path, "insert_blocks = true\n")
    slot = rows.filter(pl.col("block") == rows.filter(pl.col("length_mm") == 18.0)["block"][0])
    for value in REFERENCES:
        mine = slot.filter(pl.col("reference") == value)
        assert len(mine) > 2 and mine["length_mm"].sum() == pytest.approx(18.0)
        assert (mine["load"] <= value).all()
        # 4 mm wide and 1 deep while the front half of the cutter lies within the stock: tips from x = 0 to 8
        start = 18.0 * mine["end"].shift(1, fill_value=0.0) - 4.0
        full = mine.filter((start >= 0.0) & (18.0 * mine["end"] - 4.0 <= 8.0))
        assert len(full) and full["feed_mm_min"].to_list() == pytest.approx([value / 4] * len(full), rel=0.01)
        # in air as fast as allowed
        assert mine["feed_mm_min"][0] == 3000.0
