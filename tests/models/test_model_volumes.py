"""The shipped models, simulated: every closed form of their readmes lies in the bracket of its block.

The chord is coarser than the shipped one to save time; a bracket must hold at any chord. The closed forms
assume exact coordinates, the programs round them to 5e-6 mm, which moves a volume by less than `ROUNDING`.
"""

from __future__ import annotations

from math import floor
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import vmachining as vm
from tests.models.heightfield import Grid, Round, grid, removed
from tests.models.shipped import MODELS, generator, reduced

ROUNDING = 0.01
"""mm^3: 5e-6 mm times the largest cutter surface that moves at once, below 2000 mm^2."""


def feed_rows(result: vm.RunResult) -> pl.DataFrame:
    return result.blocks.filter(pl.col("motion") != "rapid")


def outside(rows: pl.DataFrame, truth: list[float | None]) -> list[str]:
    """Blocks whose bracket misses the truth."""
    assert len(rows) == len(truth)
    return [
        f"{row['block']} {row['text']}: {value} not in [{row['removed_lo_mm3']}, {row['removed_hi_mm3']}]"
        for row, value in zip(rows.iter_rows(named=True), truth, strict=True)
        if value is not None
        and not row["removed_lo_mm3"] - ROUNDING <= value <= row["removed_hi_mm3"] + ROUNDING
    ]


def check_total(result: vm.RunResult, truth: float) -> None:
    """Sum and conservation: what is gone from the stock is what the blocks removed."""
    s = result.summary
    assert s["removed_lo_mm3"] - ROUNDING <= truth <= s["removed_hi_mm3"] + ROUNDING
    assert s["removed_mm3"] == pytest.approx(s["stock_mm3"] - s["final_mm3"], rel=1e-9)
    assert result.blocks.filter(pl.col("motion") == "rapid")["removed_mm3"].sum() == 0.0


@pytest.fixture(scope="module")
def slot(tmp_path_factory: pytest.TempPathFactory) -> vm.RunResult:
    job = vm.Job.load(reduced("slot", tmp_path_factory.mktemp("slot"), chord=0.05, feed=True))
    return vm.run(job)


@pytest.mark.slow  # 11 s
def test_every_block_of_the_slot_has_its_closed_form(slot: vm.RunResult) -> None:
    truth = [block.volume for block in generator("slot").path()]
    assert not outside(feed_rows(slot), truth)
    check_total(slot, sum(truth))


def test_slot_feeds_follow_from_its_volumes(slot: vm.RunResult) -> None:
    rows = feed_rows(slot)
    truth = np.array([block.volume for block in generator("slot").path()])
    length, feed = rows["length_mm"].to_numpy(), rows["feed_mm_min"].to_numpy()
    reference = (truth * feed / length).max()
    most = np.full(len(rows), 600.0)
    most[0] = feed[0]  # the plunge, which is never faster than programmed
    wanted = np.clip(reference * length / np.maximum(truth, 1e-12), 48.0, most)
    # the scheduler knows volumes only up to their brackets, so a feed lies between these two
    lo, hi = rows["removed_lo_mm3"].to_numpy(), rows["removed_hi_mm3"].to_numpy()
    low = np.clip((lo * feed / length).max() * length / np.maximum(hi, 1e-12), 48.0, most)
    high = np.clip((hi * feed / length).max() * length / np.maximum(lo, 1e-12), 48.0, most)
    written = rows["scheduled_feed_mm_min"].to_numpy()
    assert (low <= wanted).all() and (wanted <= high).all()
    assert (written >= np.floor(low * 10) / 10 - 1e-9).all()
    assert (written <= high + 1e-9).all()
    assert slot.summary["scheduled_time_s"] < slot.summary["time_s"]


@pytest.mark.slow  # 20 s
def test_slot_plateaus_at_the_shipped_chord(tmp_path: Path) -> None:
    """The feeds that the readme states, from the shipped job."""
    result = vm.run(vm.Job.load(MODELS / "slot" / "job.toml"))
    rows = feed_rows(result)
    reference = 107.41592653589793 * 96 / np.sqrt(4.16)
    feeds = rows["scheduled_feed_mm_min"].to_list()
    for block, depth in ((10, 2.0), (22, 4.0), (78, 3.0), (89, 1.0)):
        # written feeds are rounded down to 0.1; 1e-4 is the rel. error of the estimate at this chord
        assert feeds[block] == pytest.approx(
            floor(reference / depth) / 10, abs=0.1 + 1e-4 * reference / depth / 10
        )
    assert feeds[19] == pytest.approx(96.0, abs=0.1)
    assert feeds[38] == 600.0
    assert rows["removed_mm3"].sum() == pytest.approx(
        sum(b.volume for b in generator("slot").path()), rel=1e-4
    )
    assert result.blocks["warning"].drop_nulls().is_empty()


@pytest.mark.slow  # 16 s
def test_pocket(tmp_path: Path) -> None:
    make = generator("pocket")
    result = vm.run(vm.Job.load(reduced("pocket", tmp_path, chord=0.05)))
    rows = feed_rows(result)
    moves = make.written_moves()
    truth = [move.volume for move in moves]
    assert sum(value is not None for value in truth) == 6
    assert not outside(rows, truth)
    check_total(result, make.pocket_volume(10))
    half = len(moves) // 2
    for part, whole in (
        (rows[:half], make.pocket_volume(5)),
        (rows[half:], make.pocket_volume(10) - make.pocket_volume(5)),
        (rows[: 2 + make.TURNS], make.entry_volume()),
        (rows[half : half + 2 + make.TURNS], make.entry_volume()),
    ):
        lo, hi = part["removed_lo_mm3"].sum(), part["removed_hi_mm3"].sum()
        assert lo - ROUNDING <= whole <= hi + ROUNDING
    # the second turn of the first helix, narrower than the cutter, stays wider than 0.3 %, and says so
    warnings = result.blocks["warning"].drop_nulls()
    assert warnings.str.starts_with("removed volume known to").all() and len(warnings) <= 1


@pytest.mark.parametrize(
    ("passes", "spacing"),
    [pytest.param(2, 10.0, marks=pytest.mark.long, id="apart"), pytest.param(3, 4.0, id="overlapping")],
)
@pytest.mark.slow  # 33 s
def test_half_cylinder(tmp_path: Path, passes: int, spacing: float) -> None:
    make = generator("half_cylinder")
    case = make.Case(passes=passes, spacing=spacing)
    job = reduced("half_cylinder", tmp_path, chord=0.15, program=make.program(case))
    result = vm.run(vm.Job.load(job))
    check_total(result, make.removed_volume(case))
    assert result.summary["stock_mm3"] == pytest.approx(
        make.stock_volume(case), rel=1e-7
    )  # float32 in the STL
    first = feed_rows(result)[1 : 1 + case.chords]  # the chords of the first pass, which nothing disturbs
    one = make.removed_volume(make.Case(passes=1)) / case.chords
    steady: list[float | None] = [
        one if case.chords / 3 < k < case.chords - 5 else None for k in range(case.chords)
    ]
    assert not outside(first, steady)
    assert result.blocks["warning"].drop_nulls().is_empty()


@pytest.mark.long  # 83 s
def test_mould_against_its_height_map(tmp_path: Path) -> None:
    make = generator("mould")
    result = vm.run(vm.Job.load(reduced("mould", tmp_path, chord=0.05)))
    low, high = make.volume_bounds()
    assert low <= result.summary["removed_mm3"] <= high
    plate: Grid = grid((-26, -26), (26, 26), 0.1, lambda x, y: np.zeros_like(x))
    moves = vm.read_program(MODELS / "mould" / "mould.nc").moves
    by_move = removed(moves, {1: Round(4, 0), 2: Round(4, 4)}, plate)
    truth = float(by_move.sum())
    # cells of 0.1 mm, tips 0.05 mm apart: 0.06 mm^3 from where finer maps settle (models/mould/README.md)
    assert truth == pytest.approx(7467.55, abs=0.1)
    s = result.summary
    assert s["removed_lo_mm3"] - 0.1 <= truth <= s["removed_hi_mm3"] + 0.1
    assert s["removed_mm3"] == pytest.approx(s["stock_mm3"] - s["final_mm3"], rel=1e-9)
    assert result.blocks["warning"].drop_nulls().is_empty()
