"""Packs: whole, hashed, the same every time; the shipped one is what its own job gives."""

from __future__ import annotations

import hashlib
import json
import shlex
import shutil
from pathlib import Path

import numpy as np
import polars as pl
import pytest
import trimesh
from tinyjob import FEED, JOB, PROGRAM, SLOT_MM3, write_job

import vmachining as vm
from tests.models.shipped import MODELS
from vmachining.cli.main import run
from vmachining.errors import InputError, JobError
from vmachining.job.folder import FolderLock
from vmachining.oracle.pack import KIND

PACK = MODELS / "reference_pack" / "slot"
STRAIGHT = "\n".join([*PROGRAM.splitlines()[:8], "N130 M30", "%", ""])
"""The slot of the tiny program alone."""

CALLING = "G21 G90\nT1 M6\nS8000 M3\nG0 X-4 Y4 Z5\nG0 Z-1\no<slot> call [14]\nM98 P200\nM30\n"
SUBPROGRAMS = {
    "slot.ngc": "o<slot> sub\nG1 X#1 F600\no<slot> endsub\n",
    "200.nc": "O200\nG0 Z5\nX3 Y12\nG1 Z-0.5 F300\nM99\n",
}
"""The slot and a plunge, both in separate files."""


def hashes(folder: Path) -> dict[str, str]:
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.iterdir()}


def test_the_shipped_pack_is_small_and_whole() -> None:
    manifest = json.loads((PACK / "manifest.json").read_text(encoding="utf-8"))
    found = hashes(PACK)
    found.pop("manifest.json")
    assert manifest["files"] == found
    assert sum(path.stat().st_size for path in PACK.iterdir()) < 300_000
    assert (PACK / "slot.nc").read_bytes() == (MODELS / "slot" / "slot.nc").read_bytes()
    assert "CC0-1.0" in (PACK / "LICENCE.md").read_text(encoding="utf-8")
    assert manifest["options"]["licence"] == "cc0"
    command = "vmachining pack job.toml --out . --stock '' --engine columns --brep none --licence cc0 --engagement 8\n"
    assert command in (PACK / "README.md").read_text(encoding="utf-8")


@pytest.mark.slow  # 5 s
def test_regenerating_the_shipped_pack_gives_its_numbers(tmp_path: Path) -> None:
    copy = tmp_path / "pack"
    shutil.copytree(PACK, copy)
    vm.write_pack(
        copy / "job.toml", copy, stock=(), engine="columns", licence="cc0", engagement=8
    )  # over itself
    new, old = (pl.read_parquet(folder / "blocks.parquet") for folder in (copy, PACK))
    assert {path.name for path in copy.iterdir()} == {path.name for path in PACK.iterdir()}
    text = ["block", "line", "text", "motion"]
    assert new.select(text).equals(old.select(text))
    assert vm.compare(new, PACK).agrees
    # both hold the truth; an estimate that is rounding may lie outside of what is exactly nothing today
    low, high = (
        np.array([table[column] for table in (new, old)]) for column in ("removed_lo_mm3", "removed_hi_mm3")
    )
    assert (low.max(axis=0) <= high.min(axis=0)).all()


def test_a_pack_is_deterministic_and_serves_as_a_job(tmp_path: Path) -> None:
    nested = JOB.replace('"tiny.nc"', '"nc/tiny.nc"   # kept')
    job = write_job(tmp_path / "in", job=nested + FEED)
    (tmp_path / "in" / "nc").mkdir()
    (tmp_path / "in" / "tiny.nc").rename(tmp_path / "in" / "nc" / "tiny.nc")
    a, b, c = (tmp_path / name for name in "abc")
    assert run(["pack", str(job), "--out", str(a), "--quiet"]) == 0
    vm.write_pack(job, b)
    assert hashes(a) == hashes(b)
    vm.write_pack(a / "job.toml", c)  # flat now, and its own source
    assert hashes(a) == hashes(c)
    assert 'file = "tiny.nc"   # kept' in (a / "job.toml").read_text()
    texts = [
        p.read_text(encoding="utf-8") for p in a.iterdir() if p.suffix in (".json", ".md", ".csv", ".toml")
    ]
    assert not any(str(tmp_path) in text for text in texts)
    row = vm.compare({"line": [7], "removed_mm3": [SLOT_MM3]}, a).blocks.row(
        by_predicate=pl.col("line") == 7, named=True
    )
    assert row["status"] == "inside"
    before, after = (trimesh.load_mesh(a / f"stock_{name}.stl") for name in ("before", "after"))
    summary = json.loads((a / "summary.json").read_text())
    assert before.volume == pytest.approx(720.0, rel=1e-6)  # 10 x 18 x 4, corners in 32 bits
    # the mesh that holds the true workpiece: its volume is the upper bound, up to 32-bit corners
    assert after.volume == pytest.approx(summary["final_hi_mm3"], rel=1e-6)
    assert not {"seconds", "peak_mb"} & summary.keys()
    assert "No licence was chosen" in (a / "LICENCE.md").read_text()


@pytest.mark.parametrize(
    "licence", [*(pytest.param(n, marks=pytest.mark.long) for n in ("none", "cc0")), "terms.txt"]
)
@pytest.mark.slow  # 5 s
def test_the_command_of_the_readme_makes_the_same_pack(
    licence: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = write_job(tmp_path / "in", program=STRAIGHT)
    monkeypatch.chdir(tmp_path)
    Path("terms.txt").write_text("Ask us.\n")
    options = ["--stock", "3mf,stl", "--engagement", "1", "--brep", "2, 2-2", "--licence", licence]
    assert run(["pack", str(job), "--out", "made", "--quiet", *options]) == 0
    shutil.copytree("made", "copy")
    monkeypatch.chdir("copy")
    (line,) = (x for x in Path("README.md").read_text().splitlines() if x.startswith("    vmachining pack"))
    assert run([*shlex.split(line)[1:], "--quiet"]) == 0
    assert hashes(Path()) == hashes(tmp_path / "made")
    told = json.loads(Path("manifest.json").read_text())["options"]
    assert told["licence"] == ("LICENCE.md" if licence == "terms.txt" else licence)
    assert ("Ask us." in Path("LICENCE.md").read_text()) == (licence == "terms.txt")


@pytest.mark.parametrize(
    ("key", "copied"),
    [
        ("", ""),
        ("subroutines = [\"subs\", 'more']  # two", "subroutines = []  # two\n"),
        ('subroutines = [\n  "subs", # ]\n  "more",\n]', "subroutines = []\n"),
    ],
    ids=["beside the program", "one line", "several lines"],
)
def test_subprograms_in_files_come_along(key: str, copied: str, tmp_path: Path) -> None:
    home = 'file = "nc/tiny.nc"\n'
    job = write_job(tmp_path / "in", job=JOB, swap={'file = "tiny.nc"\n': f"{home}{key}\n"})
    (tmp_path / "in" / "nc").mkdir()
    (tmp_path / "in" / "nc" / "tiny.nc").write_text(CALLING)
    folders = ("subs", "more") if key else ("nc", "nc")
    for folder, (name, text) in zip(folders, SUBPROGRAMS.items(), strict=True):
        (tmp_path / "in" / folder).mkdir(exist_ok=True)
        (tmp_path / "in" / folder / name).write_text(text)
    assert run(["pack", str(job), "--out", str(tmp_path / "made"), "--quiet", "--engagement", "1"]) == 0
    assert copied in (tmp_path / "made" / "job.toml").read_text()
    shutil.move(tmp_path / "made", tmp_path / "elsewhere" / "pack")
    shutil.rmtree(tmp_path / "in")
    pack = tmp_path / "elsewhere" / "pack"
    result = vm.run(vm.Job.load(pack / "job.toml"), engine="mesh", workers=1)
    assert vm.compare(pack / "blocks.csv", result).agrees
    packed, again = pl.read_parquet(pack / "blocks.parquet")["removed_mm3"], result.blocks["removed_mm3"]
    assert packed.to_list() == again.to_list() and len(packed.filter(packed > 0.0)) == 2
    manifest = json.loads((pack / "manifest.json").read_text())
    assert SUBPROGRAMS.keys() <= manifest["files"].keys()
    assert "| `slot.ngc` | a subprogram that the program calls |" in (pack / "README.md").read_text()
    assert run(["pack", str(pack / "job.toml"), "--out", str(tmp_path / "b"), "--quiet"]) == 0  # of the copy


@pytest.mark.slow  # 9 s
def test_a_pack_with_brep_has_no_date_and_its_result_is_a_reference(tmp_path: Path) -> None:
    job = write_job(tmp_path / "in", program=STRAIGHT)
    result = vm.write_pack(job, tmp_path / "pack", stock=("step",), brep="all")
    row = pl.read_csv(tmp_path / "pack" / "blocks.csv").row(by_predicate=pl.col("line") == 7, named=True)
    assert row["brep_status"] == "agreed"
    assert row["removed_brep_mm3"] == pytest.approx(SLOT_MM3, rel=1e-6)
    assert "T00:00:00'" in (tmp_path / "pack" / "stock_after.step").read_text()[:2000]
    vm.write_pack(job, tmp_path / "again", stock=("step",), brep="all")
    assert hashes(tmp_path / "pack") == hashes(tmp_path / "again")
    found = vm.compare({"line": [7], "removed_mm3": [SLOT_MM3]}, result)
    assert found.agrees and found.reference == "result"
    assert not vm.compare({"line": [7], "removed_mm3": [1.01 * SLOT_MM3]}, result).agrees


def test_what_cannot_be_packed_is_refused_and_nothing_is_written(tmp_path: Path) -> None:
    job = write_job(tmp_path / "in")
    with pytest.raises(InputError, match="holds other files"):
        vm.write_pack(job, tmp_path / "in")
    (tmp_path / "pack").mkdir()
    for files in ({}, {"files": ["a", 3]}):
        (tmp_path / "pack" / "manifest.json").write_text(json.dumps({"kind": KIND, **files}))
        with pytest.raises(InputError, match=r"manifest\.json: this manifest of a pack lists no files"):
            vm.write_pack(job, tmp_path / "pack")
    with pytest.raises(InputError, match="take cc0, none, or a text file"):
        vm.write_pack(job, tmp_path / "out", licence="gpl")
    with pytest.raises(InputError, match="unknown stock format 'obj'"):
        vm.write_pack(job, tmp_path / "out", stock=("obj",))
    (tmp_path / "in" / "blocks.csv").write_bytes((tmp_path / "in" / "tiny.nc").read_bytes())
    clash = tmp_path / "in" / "clash.toml"
    clash.write_text(JOB.replace("tiny.nc", "blocks.csv"))
    with pytest.raises(JobError, match=r"clash\.toml:5:1.*another file of that name; rename it"):
        vm.write_pack(clash, tmp_path / "out")
    assert not (tmp_path / "out").exists()
    assert run(["pack", str(tmp_path / "none.toml")]) == 2


def never(*_: object) -> None:
    pytest.fail("it was cut before it was refused")


def test_what_cannot_be_written_is_refused_before_the_run(tmp_path: Path) -> None:
    job = write_job(tmp_path / "in", program=STRAIGHT)
    for out in (tmp_path / "in" / "tiny.nc", tmp_path / "in" / "tiny.nc" / "pack"):
        with pytest.raises(InputError, match=r"tiny\.nc: is a file, not a directory; choose another --out"):
            vm.write_pack(job, out, progress=never)
    stock = trimesh.creation.icosphere(subdivisions=4, radius=6.0)  # 5120 triangles
    stock.apply_translation([5.0, 9.0, -5.0])
    stock.export(tmp_path / "in" / "ball.stl")
    line = "box = { min = [0, 0, -4], max = [10, 18, 0] }"
    ball = write_job(tmp_path / "in", program=STRAIGHT, swap={line: 'stl = "ball.stl"'})
    with pytest.raises(
        InputError, match=r"job\.toml:\d+:\d+: .* at most 5000 triangles, this stock has 5120"
    ):
        vm.write_pack(ball, tmp_path / "out", stock=("stl", "step"), progress=never)
    assert not (tmp_path / "out").exists()


def test_an_earlier_pack_loses_its_files_and_nothing_else(tmp_path: Path) -> None:
    job = write_job(tmp_path / "in", program=STRAIGHT)
    (tmp_path / "pack" / "mine").mkdir(parents=True)
    (tmp_path / "pack" / "old.nc").write_text("M30\n")
    (tmp_path / "pack" / "changed.nc").write_text("M30 (by hand)\n")
    digest = hashlib.sha256(b"M30\n").hexdigest()
    files = dict.fromkeys(("old.nc", "changed.nc", "mine", "gone.nc", "..", "../in/tiny.nc"), digest)
    (tmp_path / "pack" / "manifest.json").write_text(json.dumps({"kind": KIND, "files": files}))
    vm.write_pack(job, tmp_path / "pack", engagement=0)
    assert not (tmp_path / "pack" / "old.nc").exists()
    assert (tmp_path / "pack" / "mine").is_dir() and (tmp_path / "in" / "tiny.nc").exists()
    assert (tmp_path / "pack" / "changed.nc").exists()


def test_files_of_an_earlier_pack_that_were_changed_or_added_are_not_replaced(tmp_path: Path) -> None:
    job, pack = write_job(tmp_path / "in", program=STRAIGHT), tmp_path / "pack"
    vm.write_pack(job, pack, engagement=0)
    vm.write_pack(job, pack, engagement=0)  # its own files are
    for name, text in (("README.md", "ours, with remarks"), ("stock_after.step", "another program's")):
        before = (pack / name).read_bytes() if (pack / name).exists() else None
        (pack / name).write_text(text)
        with pytest.raises(InputError, match=rf"{name}: was (changed|not made).*move it away"):
            vm.write_pack(job, pack, engagement=0, progress=never)
        assert (pack / name).read_text() == text
        (pack / name).unlink() if before is None else (pack / name).write_bytes(before)
    # in its own directory, with a program that was changed there
    (pack / "tiny.nc").write_text(STRAIGHT.replace("X14", "X12"))
    vm.write_pack(pack / "job.toml", pack, engagement=0)
    assert "X12" in (pack / "tiny.nc").read_text()
    with FolderLock(pack) as lock:
        lock.acquire()
        with pytest.raises(InputError, match="another vmachining writes into this directory"):
            vm.write_pack(job, pack, engagement=0)
