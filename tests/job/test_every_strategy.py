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
    if insert and name != "force":
        # the strategy that a run asks for is lowered where its divided program passes the reference; the others stay as
        # planned, so they are never slower than a run of their own, and their peaks show what they pass
        assert row["machine_time_s"] <= mine.summary["scheduled_time_s"] * (1 + 1e-12)
        assert row["inserted"] == len(mine.scheduled_blocks) - len(mine.blocks)
        return
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


def test_a_table_of_poses_is_scheduled(tmp_path):
    """A slot of 1 mm and one of 0.5 mm: the second may be fed twice as fast, and the table that says so is cut again."""
    table = (
        "x_mm,y_mm,z_mm,i,j,k,feed_mm_min,rapid\n-4,4,5,0,0,1,600,1\n-4,4,-1,0,0,1,,1\n14,4,-1,0,0,1,,0\n14,4,5,0,0,1,,1\n"
        "14,12,5,0,0,1,,1\n14,12,-0.5,0,0,1,,1\n-4,12,-0.5,0,0,1,,0\n"
    )
    text = TEXT.replace('file = "tiny.nc"', 'file = "tiny.nc"\ndialect = "poses"') + FEED + FORCE
    text = text.replace("[force]\n", "[force]\nspindle_rev_min = 8000\n")
    found = run(Job.load(write_job(tmp_path, job=text, program=table)), out=tmp_path / "out")
    assert not (found.folder / "scheduled.nc").exists()  # a table is not an NC program
    lines = (found.folder / "scheduled.csv").read_text(encoding="utf-8").splitlines()
    feed = float(lines[-1].split(",")[6])
    assert feed == pytest.approx(1200.0, rel=1e-2)  # estimates are middles of brackets
    assert lines == [*table.splitlines()[:-1], f"-4,12,-0.5,0,0,1,{feed},0"]
    cuts = found.blocks.filter(pl.col("removed_mm3") > 0)
    assert cuts["removed_mm3"].to_list() == pytest.approx([40.0, 20.0], rel=1e-2)
    assert cuts["scheduled_feed_mm_min"].to_list() == [600.0, feed]
    rates = found.scheduled_blocks.filter(pl.col("removed_mm3") > 0)
    rates = rates["removed_mm3"] * rates["feed_mm_min"] / rates["length_mm"]
    assert rates.to_list() == pytest.approx([40.0 * 600 / 18] * 2, rel=1e-2)
    assert set(found.schedule.comparison["judged"]) == {"simulated"}
