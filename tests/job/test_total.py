"""The bracket of the total is never widened to hold an estimate, its blocks add up to it, and `proven` says what is known."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tinyjob import FEED, JOB, SLOT_MM3, write_job

from vmachining.interval import Interval
from vmachining.job import Job, run
from vmachining.job.total import ENDS, settled, total_of

STOCK = 10_000.0
volumes = st.floats(0.0, 100.0)


@st.composite
def cases(draw):
    """Blocks with brackets around a truth, an engine's workpiece around what is then left, either proven or not."""
    truth = np.array(draw(st.lists(volumes, min_size=1, max_size=6)))
    ends = np.array(draw(st.lists(st.tuples(volumes, volumes), min_size=len(truth), max_size=len(truth))))
    lo, hi = np.maximum(truth - ends[:, 0], 0.0), truth + ends[:, 1]
    share = np.array(draw(st.lists(st.floats(0, 1), min_size=len(truth), max_size=len(truth))))
    estimate = np.clip(lo + share * (hi - lo), lo, hi)
    rows = pl.DataFrame(
        dict(zip(ENDS, (lo, estimate, hi), strict=True))
        | {"block": np.arange(len(truth)), "time_s": np.full(len(truth), 2.0), "proven": draw(st.booleans())}
    )
    left = STOCK - truth.sum()
    a, b = (draw(st.floats(0.0, 30.0)) for _ in range(2))
    final = Interval(left - a, left - a + draw(st.floats(0, 1)) * (a + b), left + b, draw(st.booleans()))
    return rows, final, float(truth.sum())


@given(cases())
def test_the_proof_wins(case):
    rows, final, truth = case
    total = total_of(rows, Interval(STOCK, STOCK, STOCK), final)
    removed = total.removed
    assert removed.lo - 1e-9 <= truth <= removed.hi + 1e-9
    assert removed.lo <= removed.estimate <= removed.hi
    if float(rows["removed_mm3"].sum()) not in removed and removed.lo > 0.0:
        # what nobody found is no estimate: at an end only where the workpiece, as printed, leaves nothing else
        ends = max(removed.lo, STOCK - final.hi), min(removed.hi, STOCK - final.lo)
        assert ends[0] < removed.estimate < ends[1] or ends[1] - ends[0] <= 1e-5
    assert total.final.lo <= total.final.estimate <= total.final.hi
    proofs = [
        bracket
        for bracket, proven in (
            (Interval(*(float(rows[name].sum()) for name in ENDS)), rows["proven"].all()),
            (Interval(STOCK - final.hi, 0.0, STOCK - final.lo), final.proven),
        )
        if proven
    ]
    assert removed.proven is bool(proofs) and total.note is None
    for proof in proofs:  # 1e-6: rounding of differences of 10,000 mm^3
        assert proof.lo - 1e-6 <= removed.lo and removed.hi <= proof.hi + 1e-6
    moved = settled(rows, total)
    if moved is None:
        assert float(rows["removed_mm3"].sum()) == removed.estimate
        return
    new = moved["removed_mm3"].to_numpy()
    lo, hi = rows["removed_lo_mm3"].to_numpy(), rows["removed_hi_mm3"].to_numpy()
    assert (new >= lo - 1e-9).all() and (new <= hi + 1e-9).all()
    if lo.sum() <= removed.estimate <= hi.sum():
        assert new.sum() == pytest.approx(removed.estimate, rel=1e-12, abs=1e-9)
    np.testing.assert_allclose(moved["mrr_mm3_min"], 30.0 * new)


def test_an_estimate_of_nothing_stays_one():
    """Two methods find nothing, and no proof says otherwise."""
    rows = pl.DataFrame(
        {
            "removed_lo_mm3": [0.0, 0.0],
            "removed_mm3": [0.0, 0.0],
            "removed_hi_mm3": [0.3, 0.2],
            "proven": [True, True],
        }
    )
    total = total_of(rows, Interval(1000, 1000, 1000), Interval(999.5, 1000, 1000))
    assert total.removed.estimate == 0.0 and total.final.estimate == 1000.0 and not total.moved


def test_brackets_that_exclude_each_other_are_said():
    rows = pl.DataFrame(
        {"removed_lo_mm3": [5.0], "removed_mm3": [6.0], "removed_hi_mm3": [7.0], "proven": [True]}
    )
    total = total_of(rows, Interval(100, 100, 100), Interval(90, 91, 92))
    assert total.note is not None and "exclude each other" in total.note
    assert not total.removed.proven and total.removed.lo == 5.0 and total.removed.hi == 10.0


def test_slots_over_each_other_keep_the_proven_end(tmp_path):
    """Six passes of a slot through the whole stock, each of 40 mm^3, as in tinyjob: 40 in all. The mesh engine's estimate of
    a pass lies above its proven sum where facets stand for an arc; what is printed holds the truth and is not widened."""
    circle = "\n".join(f"N{k} G2 X7 Y9 I2 J0\nN{k + 1} G2 X3 Y9 I-2 J0" for k in range(100, 112, 2))
    program = f"G21 G90\nT1 M6\nS8000 M3\nG0 X3 Y9 Z5\nG1 Z-1 F300\n{circle}\nG0 Z5\nM30\n"
    result = run(Job.load(write_job(tmp_path, program=program)), engine="mesh")
    s, rows = result.summary, result.blocks
    lo, hi = (float(rows[f"removed_{end}_mm3"].sum()) for end in ("lo", "hi"))
    before, after = result.stock.stock_volume, result.stock.volume
    assert s["removed_lo_mm3"] == pytest.approx(max(lo, before.lo - after.hi), abs=1e-9)
    assert s["removed_hi_mm3"] == pytest.approx(min(hi, before.hi - after.lo), abs=1e-9)
    truth = np.pi * 16.0 * 1.0  # a disc of R = 2 + 2 mm, 1 mm deep
    assert s["removed_lo_mm3"] <= truth <= s["removed_hi_mm3"]
    assert rows["removed_mm3"].sum() == pytest.approx(s["removed_mm3"], rel=1e-12)
    assert s["stock_mm3"] - s["final_mm3"] == pytest.approx(s["removed_mm3"], rel=1e-12)


@pytest.mark.parametrize("engine", ["columns", "mesh", "dexel", "rays"])
def test_the_table_says_what_is_proven(engine, tmp_path):
    result = run(Job.load(write_job(tmp_path / "job", job=JOB + FEED)), engine=engine)
    proves = engine in ("columns", "mesh")
    cut = result.blocks.filter(pl.col("removed_hi_mm3") > 0.0)
    assert len(cut) and (cut["proven"] == proves).all()
    assert result.summary["proven"] is proves and result.removed.proven is proves
    assert result.summary["stated_blocks"] == (0 if proves else len(cut))
    assert result.removed.holds(result.removed.estimate)
    result.write(tmp_path / "out", stock=())
    written = pl.read_csv(tmp_path / "out" / "blocks.csv")
    assert written["proven"].to_list() == result.blocks["proven"].to_list()
    again = pl.read_parquet(tmp_path / "out" / "scheduled_blocks.parquet")
    assert (again.filter(pl.col("removed_hi_mm3") > 0.0)["proven"] == proves).all()
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert ("stated, not proven" in page) is not proves
    slot = cut.row(0, named=True)
    assert slot["removed_lo_mm3"] <= SLOT_MM3 <= slot["removed_hi_mm3"]


def test_the_cli_says_it(tmp_path, capsys):
    from vmachining.cli.main import run as command

    path = write_job(tmp_path / "job")
    for engine, words in (("columns", "mm3, proven"), ("rays", "mm3, stated, not proven (")):
        assert command(["run", str(path), "--out", str(tmp_path / engine), "--engine", engine]) == 0
        assert words in capsys.readouterr().err


TURNING = """\
x_mm,y_mm,z_mm,i,j,k,feed_mm_min
-4,4,-1,0,0,1,600
14,4,-1,0,0,1,600
14,14,-1,0.1,0,0.995,600
-4,14,-1,0,0.1,0.995,600
"""


BOX = "box = { min = [0, 0, -4], max = [10, 18, 0] }"
ROUND = "cylinder = { center = [5, 9], radius = 9, z = [-4, 0] }"


@pytest.mark.parametrize(
    ("stock", "lean", "proven"), [(BOX, "0.1", True), (ROUND, "0.1", True), (ROUND, "1.0", False)]
)
def test_blocks_that_turn_are_proven_but_for_wide_turns_of_the_mesh_engine(tmp_path, stock, lean, proven):
    """On plane faces all are; a block of the mesh engine that turns by 45 degrees is stated, and so is the total."""
    job = JOB.replace('file = "tiny.nc"', 'file = "turn.csv"\ndialect = "poses"')
    assert BOX in job
    path = write_job(tmp_path, job=job.replace(BOX, stock))
    (tmp_path / "turn.csv").write_text(TURNING.replace("0.1", lean))
    result = run(Job.load(path), engine="columns")
    told = {row["block"]: row["proven"] for row in result.blocks.iter_rows(named=True)}
    engine = result.blocks.filter(pl.col("engine") == "columns")
    assert len(engine) and engine["proven"].all()
    assert result.summary["stated_blocks"] == sum(not word for word in told.values())
    assert all(told.values()) is proven and result.removed.proven is proven
