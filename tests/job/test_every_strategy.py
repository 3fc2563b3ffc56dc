"""All feed strategies on one job, judged on written programs: a run that asks for one of them is the truth of its row."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest
from tinyjob import FEED, JOB, write_job

from vmachining.job import Job, Stopped, run

TEXT = JOB.replace("length_mm = 20", "length_mm = 20\nflutes = 2")
FORCE = '\n[force]\ncoefficients = "aluminium_like_constant"\n'
NAMES = ("volume", "chip_area", "force")
COLUMN = {"chip_area": "chip_area_mm2", "force": "force_n"}


def job(folder, strategy, insert):
    feed = FEED.replace('"volume"', f'"{strategy}"') + ("insert_blocks = true\n" if insert else "")
    return Job.load(write_job(folder, job=TEXT + feed + FORCE))


@pytest.fixture(scope="module", params=[False, True], ids=["whole", "divided"])
def judged(request, tmp_path_factory):
    insert, folder = request.param, tmp_path_factory.mktemp("judged")
    every = run(job(folder / "every", "force", insert), out=folder / "out", every_strategy=True)
    alone = {name: run(job(folder / name, name, insert), out=folder / f"{name}-out") for name in NAMES}
    rows = {row["strategy"]: row for row in pl.read_csv(folder / "out" / "strategies.csv").to_dicts()}
    return every, alone, rows, insert


@pytest.mark.parametrize("name", NAMES)
def test_a_row_is_a_run_that_asks_for_its_strategy(judged, name):
    every, alone, rows, insert = judged
    mine, row = alone[name], rows[name]
    written = "scheduled.nc" if name == "force" else f"scheduled_{name}.nc"
    assert (every.folder / written).read_bytes() == (mine.folder / "scheduled.nc").read_bytes()
    assert row["judged"] == "simulated" and row["asked_for"] == (name == "force")
    assert row["machine_time_s"] == pytest.approx(mine.summary["scheduled_time_s"], rel=1e-12)
    assert row["reference"] == pytest.approx(mine.summary["schedule"]["reference"], rel=1e-12)
    assert row["inserted"] == len(mine.scheduled_blocks) - len(mine.blocks)
    for load, column in COLUMN.items():
        own = mine.scheduled_blocks[column].max()
        # pieces of all strategies are at least as fine as the blocks of one, so they find no smaller peak; where nothing is
        # divided they are the same stations
        assert row[f"{load}_peak"] >= own * (1 - 1e-3 if insert else 1 - 1e-9)
        if not insert:
            assert row[f"{load}_peak"] == pytest.approx(own, rel=1e-9)
    blocks = mine.scheduled_blocks.filter(pl.col("motion") != "rapid")
    rate = (blocks["removed_mm3"] * blocks["feed_mm_min"] / blocks["length_mm"]).max()
    width = every.summary["width"]  # estimates are middles of brackets
    assert row["volume_peak"] >= rate * (1 - (2 * width if insert else 1e-9))


def test_peaks_stay_at_the_reference_and_time_falls(judged):
    every, _, rows, insert = judged
    assert list(rows) == ["as programmed", *NAMES]
    before = rows["as programmed"]
    assert before["machine_time_s"] == pytest.approx(every.summary["time_s"], rel=1e-12)
    for name in NAMES:
        row = rows[name]
        # a volume rate is the mean of a part: where the tool enters, pieces that are shorter than the parts show more
        if not (insert and name == "volume"):
            assert row[f"{name}_peak"] <= row["reference"] * (1 + (1e-3 if insert else 1e-9))
        assert row["machine_time_s"] < before["machine_time_s"]
        assert row[f"{name}_spread"] < before[f"{name}_spread"]


def test_without_a_division_for_all_others_are_planned_only_where_blocks_are_inserted(judged):
    _, alone, _, insert = judged
    told = set(alone["force"].schedule.comparison["judged"])
    assert told == ({"planned"} if insert else {"simulated"})


def test_an_interrupted_comparison_goes_on(judged, tmp_path):
    """Stopped while the pieces are cut: resumed, it gives the same table."""
    _, _, rows, insert = judged
    if not insert:
        pytest.skip("no pieces are cut where nothing is divided")
    place, seen = job(tmp_path, "force", True), []

    def stop() -> bool:
        return seen[-1:] == ["pieces"]

    with pytest.raises(Stopped):
        run(
            place,
            out=tmp_path / "out",
            every_strategy=True,
            stop=stop,
            progress=lambda name, *_: seen.append(name),
        )
    run(place, out=tmp_path / "out", every_strategy=True, resume=True)
    again = pl.read_csv(tmp_path / "out" / "strategies.csv")
    for row in again.to_dicts():
        for key, value in rows[row["strategy"]].items():
            assert row[key] == (pytest.approx(value, rel=1e-9) if isinstance(value, float) else value)
    assert np.isfinite(again["force_peak"].to_numpy()).all()
