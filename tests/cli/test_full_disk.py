"""A disk that is full in the middle of a run or a batch: what was done is there, a line says so, with more room it continues."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from pathlib import Path

import pytest
from tinyjob import write_job

STEPS = "".join(f"G1 X{1 + k % 9} Y{1 + k % 13} Z{-0.01 * k:.2f}\n" for k in range(60))
LONG = f"T1 M6\nS1000 M3\nG0 X1 Y1 Z1\nG1 Z0 F500\n{STEPS}M30\n"

SCRIPT = """
mount -t tmpfs -o size=$1 none "$2" || exit 99
shift; disk=$1; copy=$2; shift 2
"$@"; echo $? > "$copy/first"
cp -r "$disk"/out/* "$copy"
mount -o remount,size=30m "$disk"
"$@" --resume; echo $? > "$copy/second"
ls "$disk/out" > "$copy/left"
"""
"""A small disk of its own, in a mount namespace that ends with the shell."""


def on_a_small_disk(size, disk, copy, *words):
    """stderr of both runs of a command, the second with more room and --resume, and their exit codes."""
    disk.mkdir()
    copy.mkdir()
    argv = [sys.executable, "-m", "vmachining", *map(str, words)]
    try:
        done = subprocess.run(
            ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c", SCRIPT, "sh", size, disk, copy, *argv],
            capture_output=True, text=True, timeout=300,
        )  # fmt: skip
    except FileNotFoundError:
        pytest.skip("no unshare here: a small disk cannot be made")
    if not (copy / "first").exists():
        pytest.skip(f"a small disk cannot be mounted here: {done.stderr.strip()}")
    return done.stderr, [int((copy / name).read_text()) for name in ("first", "second")]


@pytest.mark.parametrize(
    ("size", "lacks"),
    [
        ("12k", r"of 61 blocks are in blocks\.partial\.csv"),
        pytest.param("28k", "checkpoint", marks=pytest.mark.long),
        pytest.param("44k", "blocks", marks=pytest.mark.long),
        ("400k", "report"),
    ],
)
@pytest.mark.slow  # 12 s
def test_a_full_disk_leaves_what_was_done(size, lacks, tmp_path):
    """Full while rows come, while contact is saved, while the tables are made, while the page is."""
    job = write_job(tmp_path / "job", program=LONG)
    copy = tmp_path / "copy"
    err, codes = on_a_small_disk(
        size, tmp_path / "disk", copy,
        "run", job, "--out", tmp_path / "disk" / "out", "--engine", "mesh", "--quiet", "--workers", "1",
    )  # fmt: skip  # the sizes of disks are those of the files of the mesh engine
    (said,) = err.splitlines()
    assert codes == [2, 0] and "cannot write" in said and "free some disk space" in said
    assert Path(said.split(": ")[1]).name.startswith(lacks) or lacks.replace("\\", "") in said
    assert json.loads((copy / "manifest.json").read_text())["complete"] is False
    rows = (copy / "blocks.partial.csv").read_text()
    assert rows.count("\n") > 20 and rows.endswith("\n")
    whole = [
        "blocks.csv",
        "blocks.parquet",
        "manifest.json",
        "report.html",
        "stages.zip",
        "stock.stl",
        "summary.json",
    ]
    assert (copy / "left").read_text().split() == whole


@pytest.mark.parametrize(
    ("size", "lacks"),
    [("8k", "one/manifest.json"), pytest.param("16k", "one/blocks.partial.csv", marks=pytest.mark.long)],
)
@pytest.mark.slow  # 12 s: two batches each, an interpreter for every one and for its jobs
def test_a_full_disk_stops_no_batch_in_mid_job(size, lacks, tmp_path):
    """Full while the first job begins, and while its rows come: every job is tried, and the table is not what ends them."""
    names = ("one", "two", "three")
    jobs = [write_job(tmp_path / n, program=LONG, swap={'name = "tiny"': f'name = "{n}"'}) for n in names]
    copy, out = tmp_path / "copy", tmp_path / "disk" / "out"
    err, codes = on_a_small_disk(size, tmp_path / "disk", copy, "batch", *jobs, "--out", out, "--stock", "")
    assert codes == [2, 0], err
    first = err[: err.index("3 of 3 jobs complete")]
    assert (
        f"{out / lacks}: cannot write" in first and "free some disk space" in first and "Traceback" not in err
    )
    assert all(f"] {job}: failed: " in first for job in jobs)
    with (copy / "batch.csv").open(newline="") as file:  # as it was when there was room
        assert [row["status"] for row in csv.DictReader(file)] == ["interrupted"] * 3
    assert json.loads((copy / "batch.json").read_text())["complete"] is False
    assert {"one", "two", "three", "dataset", "batch.csv", "index.html"} <= set(
        (copy / "left").read_text().split()
    )
