"""`run --engine dexel`: every block has an interval that holds its closed form, and nobody calls it a bracket."""

from __future__ import annotations

from pathlib import Path

import polars as pl
import pytest

import vmachining as vm
from tests.tinyjob import SLOT_MM3, write_job
from vmachining.cli.main import run as command


@pytest.mark.slow  # 13 s
def test_a_job_by_rays(tmp_path: Path) -> None:
    file, out = write_job(tmp_path), tmp_path / "out"
    assert (
        command(["run", str(file), "--out", str(out), "--engine", "dexel", "--stock", "stl", "--quiet"]) == 0
    )
    rows = pl.read_parquet(out / "blocks.parquet")
    assert set(rows["engine"]) == {"dexel"}
    slot = rows.filter(pl.col("line") == 7).row(0, named=True)
    assert slot["removed_lo_mm3"] <= SLOT_MM3 <= slot["removed_hi_mm3"]
    assert slot["removed_mm3"] == pytest.approx(SLOT_MM3, rel=0.01)
    page = (out / "report.html").read_text()
    assert "dexel engine" in page and "not proven" in page and "The bracket" not in page


def test_engines_lie_in_each_others_intervals(tmp_path: Path) -> None:
    job = vm.Job.load(write_job(tmp_path))
    mesh, dexel = (vm.run(job, engine=engine).blocks for engine in ("mesh", "dexel"))
    for ours, theirs in zip(mesh.iter_rows(named=True), dexel.iter_rows(named=True), strict=True):
        assert ours["removed_lo_mm3"] <= theirs["removed_hi_mm3"]
        assert theirs["removed_lo_mm3"] <= ours["removed_hi_mm3"]


def test_a_spacing_that_no_engine_takes_is_told(tmp_path: Path) -> None:
    job = vm.Job.load(write_job(tmp_path)).with_spacing(0.5, None)
    told = {engine: vm.run(job, engine=engine).summary["notes"] for engine in ("columns", "dexel")}
    assert [any("--spacing" in note for note in told[engine]) for engine in ("columns", "dexel")] == [
        True,
        False,
    ]
