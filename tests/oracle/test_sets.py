"""Sets of packs: made by one command, whole, gone on with, and judged by `compare`."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import polars as pl
import pytest
from tinyjob import PROGRAM, SLOT_MM3, write_job

import vmachining as vm
from benchmarks.sets import CaseSet, write_set
from tests.models.shipped import MODELS, generator
from vmachining.cli.main import run
from vmachining.errors import InputError
from vmachining.job.files import sha256
from vmachining.oracle import compare_set
from vmachining.oracle.results import read_reference

SET = MODELS / "reference_pack"
CASES = [case.name for case in CaseSet.load(SET).cases]
SHORT = "\n".join([*PROGRAM.splitlines()[:8], "N130 M30", "%", ""])
HEAD = 'title = "t"\nabout = "a"\ncite = "c"\n'


def test_the_shipped_set_is_whole_public_and_small() -> None:
    manifest = json.loads((SET / "manifest.json").read_text(encoding="utf-8"))
    assert len(CASES) == 20 and list(manifest["cases"]) == CASES
    for name, digest in {
        **manifest["files"],
        **{f"{n}/manifest.json": d for n, d in manifest["cases"].items()},
    }.items():
        assert sha256(SET / name) == digest, name
    assert sum(path.stat().st_size for path in SET.rglob("*")) < 30e6
    assert "CC0-1.0" in (SET / "LICENCE.md").read_text(encoding="utf-8")
    page = (SET / "README.md").read_text(encoding="utf-8")
    assert len(page.splitlines()) < 70 and all(f"[`{name}`]" in page for name in CASES)


@pytest.mark.parametrize("name", CASES)
def test_a_case_is_what_its_script_writes_and_its_bounds_are_proven_and_narrow(name: str) -> None:
    for file, text in generator("reference_pack").CASES[name]().items():
        assert (SET / name / file).read_text(encoding="utf-8") == text
    blocks = pl.read_parquet(SET / name / "blocks.parquet")
    assert 18 <= len(blocks) <= 200
    assert read_reference(SET / name).total[1] == pytest.approx(blocks["removed_mm3"].sum(), rel=1e-9)
    lo, hi = blocks["removed_lo_mm3"], blocks["removed_hi_mm3"]
    assert ((lo >= 0.0) & (lo <= hi)).all()
    summary = json.loads((SET / name / "summary.json").read_text())
    width = summary["removed_hi_mm3"] - summary["removed_lo_mm3"]
    # columns in any direction add the widths of all blocks: 1.6 and 1.3 % of these totals, where no mesh proves any
    assert width <= (0.02 if name in ("five_lead", "five_pocket") else 0.01) * summary["removed_mm3"]
    assert blocks["proven"].all() or name not in ("five_lead", "five_swarf", "five_pocket")
    assert summary["removed_mm3"] == pytest.approx(summary["stock_mm3"] - summary["final_mm3"], rel=1e-9)


def test_what_the_set_covers() -> None:
    jobs = [vm.Job.load(SET / name / "job.toml") for name in CASES]
    kinds = {str(tool.get("type")) for job in jobs for tool in job.keys.tools}
    assert kinds == {"flat", "ball", "bull", "taper", "apt", "profile"}
    tables = {name: pl.read_parquet(SET / name / "blocks.parquet") for name in CASES}
    assert sum(bool((table["k"] < 1.0).any()) for table in tables.values()) >= 6
    planes = {
        move.plane for name in ("arcs", "helices") for move in vm.read_program(SET / name / f"{name}.nc").moves if move.center
    }  # fmt: skip
    assert planes == {"xy", "zx", "yz"}
    assert all((SET / name / "engagement.csv").is_file() for name in CASES)


def test_an_engine_of_another_kind_agrees_with_a_case(tmp_path: Path) -> None:
    job = vm.Job.load(SET / "plunges" / "job.toml").with_chord(0.01)
    other = vm.run(job, engine="mesh").blocks
    ours = pl.read_parquet(SET / "plunges" / "blocks.parquet")
    assert (other["removed_lo_mm3"] <= ours["removed_hi_mm3"] + 1e-9).all()
    assert (other["removed_hi_mm3"] >= ours["removed_lo_mm3"] - 1e-9).all()


@pytest.fixture
def two(tmp_path: Path) -> Path:
    """A set of two cases, made."""
    folder = tmp_path / "set"
    for name in ("one", "two"):
        write_job(folder / name, program=SHORT)
    (folder / "set.toml").write_text(
        HEAD
        + '[[cases]]\nname = "one"\nshows = "x"\nengine = "columns"\n[[cases]]\nname = "two"\nshows = "y"\n'
    )
    write_set(folder)
    return folder


def test_a_set_is_made_gone_on_with_and_compared_with(
    two: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stamp = (two / "one" / "blocks.csv").stat().st_mtime_ns
    (two / "two" / "blocks.csv").unlink()
    before = sha256(two / "manifest.json")
    write_set(two)
    assert (two / "one" / "blocks.csv").stat().st_mtime_ns == stamp and sha256(
        two / "manifest.json"
    ) == before
    assert run(["pack", str(two), "--out", str(tmp_path / "copy"), "--quiet"]) == 0
    assert sha256(tmp_path / "copy" / "manifest.json") == before  # the same bytes elsewhere
    results = tmp_path / "results"
    results.mkdir()
    (results / "one.csv").write_text(f"line,removed_mm3\n7,{SLOT_MM3}\n")
    found = compare_set(results, two)
    assert found.agrees and found.missing == ("two",)
    (tmp_path / "all.csv").write_text(f"case,line,removed_mm3\none,7,{SLOT_MM3}\ntwo,7,{1.2 * SLOT_MM3}\n")
    capsys.readouterr()
    assert run(["compare", str(tmp_path / "all.csv"), str(two), "--json"]) == 1
    told = json.loads(capsys.readouterr().out)
    assert [row["agrees"] for row in told["summary"]] == [True, False] and told["missing"] == []
    assert run(["compare", str(results), str(two)]) == 0
    assert "1 of 1 cases" in capsys.readouterr().out


def test_refusals(two: Path, tmp_path: Path) -> None:
    results = tmp_path / "r.csv"
    results.write_text("line,removed_mm3\n7,40\n")
    with pytest.raises(InputError, match="no column case"):
        compare_set(results, two)
    results.write_text("case,line,removed_mm3\nthree,7,40\n")
    with pytest.raises(InputError, match="the set has no case 'three'"):
        compare_set(results, two)
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="no results of any case"):
        compare_set(tmp_path / "empty", two)
    changed = two / "one" / "manifest.json"
    changed.write_text(changed.read_text() + " ")
    with pytest.raises(InputError, match="differs from the one that the set was made with"):
        compare_set(tmp_path / "empty", two)
    shutil.rmtree(two / "two")
    with pytest.raises(InputError, match=r"a case 'two' without two/job\.toml"):
        write_set(two)
    for text, what in (
        ("", "expected"),
        ("nonsense = 1", "key"),
        ('[[cases]]\nname = "one"\n', "a case 'one'"),
    ):
        (two / "set.toml").write_text((HEAD if "cases" in text else "") + text)
        with pytest.raises(InputError, match=what):
            write_set(two)
    with pytest.raises(InputError, match="bounds that are proven"):
        vm.write_pack(two / "one" / "job.toml", tmp_path / "p", engine="dexel")
