"""`compare JOB --engines`: one table of all engines, honest about what is proven, who refuses, and who is wrong."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tests.tinyjob import SLOT_MM3, write_job
from vmachining.cli.main import run as command
from vmachining.errors import InputError
from vmachining.oracle import EngineComparison, compare_engines


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> EngineComparison:
    return compare_engines(write_job(tmp_path_factory.mktemp("job")), ("columns", "mesh", "dexel", "vectors"))


def test_every_engine_knows_the_slot_and_says_how_well(found: EngineComparison) -> None:
    slot = list(found.line).index(7)
    columns, mesh, dexel, _ = found.answers
    for each in (columns, mesh, dexel):
        assert each.lo[slot] <= SLOT_MM3 <= each.hi[slot] and each.seconds.sum() > 0.0
    assert columns.proven[slot] and mesh.proven[slot] and not dexel.proven[slot]
    assert found.agrees and not found.disagreements
    assert found.narrowest()[slot] == pytest.approx(SLOT_MM3, rel=1e-3)


def test_the_first_blocks_are_enough(tmp_path: Path, found: EngineComparison) -> None:
    part = compare_engines(write_job(tmp_path), ("columns", "dexel"), blocks=2)
    assert list(part.block) == list(found.block)[:2]
    for each, whole in zip(part.answers, (found.answers[0], found.answers[2]), strict=True):
        np.testing.assert_allclose(each.estimate, whole.estimate[:2], rtol=1e-12)
    with pytest.raises(InputError, match="0 blocks: expected one or more"):
        compare_engines(write_job(tmp_path), ("columns", "dexel"), blocks=0)


def test_an_engine_that_refuses_is_told_and_the_others_go_on(found: EngineComparison) -> None:
    rows = {row["engine"]: row for row in found.summary()}
    assert "has no design; add [design]" in rows["vectors"]["refused"] and rows["vectors"]["blocks"] == 0
    assert rows["mesh"]["refused"] is None and rows["mesh"]["blocks"] == len(found.block)


def test_bounds_that_exclude_each_other_are_a_disagreement(found: EngineComparison) -> None:
    """One bracket moved aside: the verdict names block and pair; a stated interval may miss in one of a hundred."""
    columns, mesh, dexel, vectors = found.answers
    by = np.where(np.array(found.line) == 7, 9.0, 0.0)
    aside = [
        replace(each, lo=each.lo + by, estimate=each.estimate + by, hi=each.hi + by) for each in (mesh, dexel)
    ]
    wrong = replace(found, answers=[columns, aside[0], dexel, vectors])
    assert not wrong.agrees
    assert {k: v for k, v in wrong.disagreements[0].items() if k != "blocks"} == {
        "engines": ["columns", "mesh"],
        "proven": 1,
    }
    assert wrong.disagreements[0]["blocks"] == [found.block[list(found.line).index(7)]]
    missed = replace(found, answers=[columns, mesh, aside[1], vectors])
    assert missed.agrees and missed.disagreements[0]["proven"] == 0


def test_the_command_writes_one_table_and_one_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    job, out = write_job(tmp_path), tmp_path / "out"
    assert command(["compare", str(job), "--engines", "columns,dexel", "--out", str(out), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["agrees"] and [row["engine"] for row in told["engines"]] == ["columns", "dexel"]
    rows = pl.read_csv(out / "engines.csv")
    assert rows.height == len(told["blocks"]) and {"columns_mm3", "dexel_hi_mm3", "dexel_s"} <= set(
        rows.columns
    )
    page = (out / "engines.html").read_text()
    assert "the engines agree" in page and "N60 G1 X14 F600" in page


@pytest.mark.slow  # 20 s: OCCT in its processes
def test_brep_judges_with_its_error(tmp_path: Path) -> None:
    found = compare_engines(write_job(tmp_path), ("columns", "brep"))
    brep = found.answers[1]
    slot = list(found.line).index(7)
    assert brep.estimate[slot] == pytest.approx(SLOT_MM3, rel=1e-3) and brep.seconds[slot] > 0.0
    assert found.agrees


@pytest.mark.parametrize(
    ("engines", "message"),
    [
        ("columns,nx", "unknown engine 'nx'"),
        ("mesh", "two or more different"),
        ("mesh,mesh", "two or more different"),
    ],
)
def test_names_that_do_not_do(tmp_path: Path, engines: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        compare_engines(write_job(tmp_path), engines.split(","))


def test_a_table_without_a_reference_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "results.csv").write_text("block,removed_mm3\n1,2\n")
    assert command(["compare", str(tmp_path / "results.csv")]) == 2
    assert "compare needs a reference" in capsys.readouterr().err
