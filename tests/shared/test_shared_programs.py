"""Whole programs written by others, from file to table.

The programs belong to the LinuxCNC project and are read where they lie. What is known about their result:

- `cds.ngc` mills a round boss of radius 1.5 in, then a diamond |x| + |y| <= 1.5 in on it, then ramps. Its
  first rows and both bosses have closed forms, because every row overlaps the next.
- `impeller-7bl-xyzac.ngc` is checked against random points and the exact membership of its sweeps.
- `3D_Chips.ngc` is checked against a height map that shares only the list of moves with the engine.
"""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import vmachining as vm
from tests.models.heightfield import Round, grid, removed
from vmachining.job import move_path
from vmachining.sweep import Sweep

JOBS = Path(__file__).parent / "jobs"
PROGRAMS = Path(__file__).parents[3] / "shared" / "data" / "linuxcnc" / "programs"
pytestmark = pytest.mark.skipif(not PROGRAMS.is_dir(), reason=f"no shared data: {PROGRAMS} is absent")

INCH3 = 25.4**3


def run(name: str) -> vm.RunResult:
    return vm.run(vm.Job.load(JOBS / f"{name}.toml"))


def check_sums(result: vm.RunResult) -> None:
    """Brackets in order, nothing lost between rows, stock and sum."""
    rows, s = result.blocks, result.summary
    assert rows.filter(pl.col("removed_lo_mm3") > pl.col("removed_mm3")).is_empty()
    assert rows.filter(pl.col("removed_mm3") > pl.col("removed_hi_mm3")).is_empty()
    assert rows.filter(pl.col("removed_lo_mm3") < 0).is_empty()
    assert s["removed_mm3"] == pytest.approx(float(rows["removed_mm3"].sum()), rel=1e-12)
    assert s["removed_mm3"] == pytest.approx(s["stock_mm3"] - s["final_mm3"], rel=1e-9)
    assert s["removed_lo_mm3"] <= s["removed_mm3"] <= s["removed_hi_mm3"]
    assert result.surface.triangles.shape[1] == 3


@pytest.fixture(scope="module")
def cds() -> vm.RunResult:
    return run("cds")


@pytest.mark.slow  # 8 s
def test_cds_sums(cds: vm.RunResult) -> None:
    check_sums(cds)
    assert cds.summary["blocks"] == 265
    assert cds.summary["stock_mm3"] == pytest.approx(32 * INCH3, rel=1e-12)


@pytest.mark.parametrize(
    ("last", "inch3", "slack"),
    [
        ("n0190", 4.0 * 0.21 * 0.3125, 0.0),  # one row: from the wall at 4.0 to 3.79 in
        ("n0210", 4.0 * 0.40 * 0.3125, 0.0),  # two rows, 0.19 in apart
        ("n1220", (16.0 - pi * 1.5**2) * 0.3125, 0.0),  # all around the round boss
        # and around the diamond, whose coordinates have four decimals: 5e-5 in times 6 in times 0.1563 in
        ("n2290", (16.0 - pi * 1.5**2) * 0.3125 + (pi * 1.5**2 - 4.5) * 0.1563, 5e-5 * 6 * 0.1563),
    ],
)
def test_cds_closed_forms(cds: vm.RunResult, last: str, inch3: float, slack: float) -> None:
    number = pl.col("text").str.extract(r"^\s*[nN](\d+)").cast(pl.Int64)
    rows = cds.blocks.filter(number <= int(last[1:]))
    lo, hi = float(rows["removed_lo_mm3"].sum()), float(rows["removed_hi_mm3"].sum())
    noise = 1e-9 * cds.summary["stock_mm3"]
    assert lo - slack * INCH3 - noise <= inch3 * INCH3 <= hi + slack * INCH3 + noise
    # the estimate is far better than the sum of the brackets
    error = abs(float(rows["removed_mm3"].sum()) - inch3 * INCH3)
    assert error <= 0.1 * (hi - lo) + slack * INCH3 + noise


def test_cds_against_its_height_map(cds: vm.RunResult) -> None:
    # cells that no coordinate of the program is a multiple of; walls cost up to half a cell of their area
    plate = grid((0, 0), (101.6, 101.6), 101.6 / 1013, lambda x, y: np.full_like(x, 50.8))
    by_move = removed([move._replace(tool=1) for move in cds.program.moves], {1: Round(3.175, 0.0)}, plate)
    assert float(by_move.sum()) == pytest.approx(cds.summary["removed_mm3"], rel=2e-3)


def chips_truth(moves: tuple[vm.nc.Move, ...]) -> float:
    plate = grid((-50, -50), (50, 50), 0.1, lambda x, y: np.zeros_like(x))
    return float(removed(moves, {1: Round(5.0, 5.0)}, plate, step=0.1).sum())


def test_chips_beginning() -> None:
    """The first tenth of the program at a coarse chord; all of it in the full lane."""
    job = vm.Job.load(JOBS / "chips.toml")
    program = vm.read_program(job.program_path)
    assert program.ended and not program.errors
    engine = vm.engines.mesh.MeshEngine(vm.engines.mesh.box_stock((-50, -50, -50), (50, 50, 0)), chord=0.1)
    moves = [move for move in program.moves if move.motion != "dwell"][:470]
    total = vm.Interval(0.0, 0.0, 0.0)
    for move in moves:
        if move.motion == "rapid":
            continue
        total += engine.cut(vm.Sweep(job.tools[1], move.start, move.end)).bracket
    truth = chips_truth(tuple(moves))
    slack = 1e-3 * truth  # of the height map; the cells at the walls of the ball's slot
    assert total.holds(truth, slack=slack)
    assert engine.stock_volume.estimate - engine.volume.estimate == pytest.approx(total.estimate, rel=1e-9)


@pytest.mark.long  # some minutes: the whole program
def test_chips() -> None:
    result = run("chips")
    check_sums(result)
    truth = chips_truth(result.program.moves)
    s = result.summary
    assert s["removed_lo_mm3"] - 1e-3 * truth <= truth <= s["removed_hi_mm3"] + 1e-3 * truth


def points_removed(job: vm.Job, result: vm.RunResult, count: int) -> tuple[float, float]:
    """mm^3 that the feed moves take from the blank, and its standard error: random points, exact membership."""
    cutter = job.tools[1].cutter
    sweeps = [
        Sweep.along(cutter, move_path(move, job.machine))
        for move in result.program.moves
        if move.motion != "rapid" and move.motion != "dwell"
    ]
    lo = np.maximum(np.min([sweep.bounds[0] for sweep in sweeps], axis=0), (-46, -46, -3))
    hi = np.minimum(np.max([sweep.bounds[1] for sweep in sweeps], axis=0), (46, 46, 40))
    points = np.random.default_rng(7).uniform(lo, hi, (count, 3))
    points = points[np.hypot(points[:, 0], points[:, 1]) <= 46]
    hit = np.zeros(len(points), dtype=bool)
    for sweep in sweeps:
        hit[~hit] = sweep.contains(points[~hit])
    share = float(hit.sum()) / count
    box = float(np.prod(hi - lo))
    return box * share, box * np.sqrt(share * (1 - share) / count)


@pytest.mark.slow  # 8 s
def test_the_impeller_begins_as_points_say(tmp_path: Path) -> None:
    """Fifteen five-axis blocks through the chain of the machine; all 4,500 in the full lane."""
    text = (PROGRAMS / "impeller-7bl-xyzac.ngc").read_text().splitlines()[:25]
    (tmp_path / "impeller.ngc").write_text("\n".join([*text, "M2", ""]))
    job_text = (JOBS / "impeller.toml").read_text()
    shared = "../../../../shared/data/linuxcnc/programs/impeller-7bl-xyzac.ngc"
    (tmp_path / "job.toml").write_text(job_text.replace(shared, "impeller.ngc"))
    job = vm.Job.load(tmp_path / "job.toml")
    result = vm.run(job, workers=1)
    check_sums(result)
    truth, sigma = points_removed(job, result, 120_000)
    s = result.summary
    assert s["removed_lo_mm3"] - 4 * sigma <= truth <= s["removed_hi_mm3"] + 4 * sigma
    assert 4 * sigma < 0.05 * truth  # sharp enough to see a lost block
    # the control says where the axis points: (sin c sin a, cos c sin a, cos a)
    a, c = np.radians([-71.841, -35.930])
    first = result.blocks.row(0, named=True)
    axis = [np.sin(c) * np.sin(a), np.cos(c) * np.sin(a), np.cos(a)]
    assert [first["i"], first["j"], first["k"]] == pytest.approx(axis, abs=1e-12)


@pytest.mark.long  # an hour: 4,500 five-axis blocks
def test_impeller() -> None:
    result = run("impeller")
    check_sums(result)
    assert result.summary["blocks"] > 4400
