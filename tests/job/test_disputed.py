"""Judges that exclude each other: said first and everywhere, and the command ends with code 1."""

from __future__ import annotations

import json
import os
import signal
from contextlib import redirect_stderr
from io import StringIO
from pathlib import Path

import polars as pl
import pytest

import vmachining as vm
from tests.tinyjob import write_job
from vmachining.cli.main import run as command
from vmachining.engines import ENGINES, Entry
from vmachining.engines.brep import Status, Verdict
from vmachining.engines.judges import Judge
from vmachining.engines.mesh import MeshEngine
from vmachining.engines.protocol import Removal
from vmachining.job import Stopped
from vmachining.job.verdicts import VerdictFile
from vmachining.sweep import Sweep


@pytest.fixture(scope="module")
def disputed(tmp_path_factory: pytest.TempPathFactory) -> tuple[int, str, Path]:
    """A run that was stopped after the first verdict, a slot of 40 mm3, which is changed by hand to a dispute; then it continues.

    Exit code, what the terminal said, folder.
    """
    folder = tmp_path_factory.mktemp("disputed")
    file, out = write_job(folder), folder / "out"

    def stop(stage: str, done: int, total: int) -> None:
        if stage == "brep" and done == 1:
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(Stopped):
        vm.run(vm.Job.load(file), out=out, engine="mesh", brep="all", workers=1, progress=stop)
    partial = out / "brep.partial.csv"
    known = VerdictFile(partial, {}, 1e9)  # with more time than any run gives
    rays = Judge("dexel", Removal(38.0, 39.0, 39.5, False))
    known.add(2, Verdict(Status.DISPUTED, reason="rays find 39", judges=(rays,)))
    known.__exit__(None, None, None)
    said = StringIO()
    with redirect_stderr(said):
        words = ["run", str(file), "--engine", "mesh", "--brep", "all", "--resume", "--workers", "1"]
        code = command([*words, "--out", str(out)])
    return code, said.getvalue(), out


@pytest.mark.slow  # 5 s
def test_a_dispute_is_told_first_and_ends_with_code_1(disputed: tuple[int, str, Path]) -> None:
    code, said, out = disputed
    assert code == 1
    told = [
        line for line in said.splitlines() if not line.startswith("checking by B-rep: ")
    ]  # a slow machine
    first, block = told[:2]
    assert (
        first.startswith("DISPUTED") and "block 2 (line 7): mesh 4" in block and "dexel 38 to 39.5" in block
    )
    assert json.loads((out / "summary.json").read_text())["brep"]["disputed"] == 1
    page = (out / "report.html").read_text()
    assert page.index("Disputed: do not use") < page.index("Removed volume")
    row = pl.read_parquet(out / "blocks.parquet").row(2, named=True)
    assert (
        row["brep_status"] == "disputed" and row["removed_brep_mm3"] is None and "DISPUTED" in row["warning"]
    )
    assert (row["removed_dexel_lo_mm3"], row["removed_dexel_hi_mm3"]) == (38.0, 39.5)


def test_values_that_agree_say_how_good_they_are(disputed: tuple[int, str, Path]) -> None:
    rows = pl.read_parquet(disputed[2] / "blocks.parquet").filter(pl.col("brep_status") == "agreed")
    assert set(rows["brep_attempt"]) == {"1 plain"}
    assert (rows["removed_brep_error_mm3"] < rows["removed_brep_mm3"]).all()


def test_nobody_is_judged_by_a_disputed_block(disputed: tuple[int, str, Path]) -> None:
    rows = pl.read_parquet(disputed[2] / "blocks.parquet")
    found = vm.compare(rows.select("block", "removed_mm3"), disputed[2])
    assert found.counts["disputed"] == 1 and not found.agrees and "disputes" in found.verdict


class Liar(MeshEngine):
    """An engine that takes a tenth too little, and swears to it."""

    name = "liar"

    def cut(self, sweep: Sweep, block: int | None = None) -> Removal:
        found = super().cut(sweep, block)
        return Removal(0.9 * found.lo, 0.9 * found.estimate, 0.9 * found.hi)


def test_a_wrong_engine_is_found_out_by_the_second_judge(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a run that asks for no B-rep: at least eight blocks of every run are audited, here all four, and their total."""
    monkeypatch.setitem(ENGINES.own, "liar", Entry(f"{__name__}:Liar", "anything"))
    result = vm.run(vm.Job.load(write_job(tmp_path)), engine="liar")
    rows = result.blocks.filter(pl.col("brep_status") == "disputed")
    assert result.summary["brep"]["disputed"] == len(rows) == 4
    assert all("DISPUTED" in text for text in rows["warning"])
    assert (rows["removed_hi_mm3"] < rows["removed_dexel_lo_mm3"]).all()
    told = result.summary["second_judge"]
    assert told["total_agrees"] is False and told["total_lo_mm3"] > result.blocks["removed_hi_mm3"].sum()


def test_an_honest_engine_is_not(tmp_path: Path) -> None:
    result = vm.run(vm.Job.load(write_job(tmp_path)))
    rows = result.blocks.filter(pl.col("removed_dexel_mm3").is_not_null())
    assert len(rows) == 4 and rows["brep_status"].null_count() == 4
    assert result.summary["second_judge"]["total_agrees"] is True
    assert (rows["removed_dexel_lo_mm3"] <= rows["removed_hi_mm3"]).all()
    assert (rows["removed_dexel_hi_mm3"] >= rows["removed_lo_mm3"]).all()


THERE_AND_BACK = """\
N10 G21 G17 G90 G94
N20 T1 M6
N30 S8000 M3
N40 G0 X10 Y9 Z5
N50 G1 Z-7 F300
N60 G1 X28 F600
N70 G1 X10
N80 G1 X28 Y9.5
N90 M30
"""


def test_a_tool_that_widens_above_its_waist_is_judged_rightly_on_its_way_back(tmp_path: Path) -> None:
    """Every upright line has lost two pieces to the way there; between them is air."""
    shape = 'type = "profile"\nprofile = [[0, 0], [3.6, 1.5], [1.1, 6], [2, 6.3], [2.47, 41]]'
    swap = {
        'type = "flat"\ndiameter_mm = 4\nlength_mm = 20': shape,
        "[0, 0, -4], max = [10, 18, 0]": "[0, 0, -12], max = [36, 18, 0]",
    }
    for program in (
        THERE_AND_BACK,
        THERE_AND_BACK.replace("N80 G1 X28 Y9.5\n", ""),
    ):  # the last block is judged
        result = vm.run(vm.Job.load(write_job(tmp_path, program=program, swap=swap)))
        assert result.summary["brep"]["disputed"] == 0
        judged = result.blocks.filter(pl.col("removed_dexel_mm3").is_not_null())
        assert len(judged) == 1
    assert judged["text"].item() == "N70 G1 X10" and judged["removed_dexel_mm3"].item() < 1e-9
