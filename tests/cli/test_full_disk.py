"""A disk that is full in the middle of a run: the rows so far and a manifest are there, one line says so, and with
more room the run goes on."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from tinyjob import write_job

STEPS = "".join(f"G1 X{1 + k % 9} Y{1 + k % 13} Z{-0.01 * k:.2f}\n" for k in range(120))
LONG = f"T1 M6\nS1000 M3\nG0 X1 Y1 Z1\nG1 Z0 F500\n{STEPS}M30\n"

SCRIPT = """
mount -t tmpfs -o size=$1 none "$2" || exit 99
shift; disk=$1; copy=$2; shift 2
"$@"; echo $? > "$copy/first"
cp "$disk"/out/* "$copy"
mount -o remount,size=30m "$disk"
"$@" --resume; echo $? > "$copy/second"
ls "$disk/out" > "$copy/left"
"""
"""A small disk of its own, in a mount namespace that ends with the shell."""


@pytest.mark.parametrize(
    ("size", "lacks"),
    [("24k", r"of 121 blocks are in blocks\.partial\.csv"), ("36k", "blocks"), ("400k", "report")],
)
@pytest.mark.slow  # 21 s
def test_a_full_disk_leaves_what_was_done(size, lacks, tmp_path):
    """Full while rows come, while the tables are made, while the page is."""
    job = write_job(tmp_path / "job", program=LONG)
    disk, copy = tmp_path / "disk", tmp_path / "copy"
    disk.mkdir()
    copy.mkdir()
    argv = [
        sys.executable,
        "-m",
        "vmachining",
        "run",
        str(job),
        "--out",
        str(disk / "out"),
        "--engine",
        "mesh",  # the sizes of disks are those of its files
        "--quiet",
        "--workers",
        "1",
    ]
    try:
        done = subprocess.run(
            ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c", SCRIPT, "sh", size, disk, copy, *argv],
            capture_output=True, text=True, timeout=120,
        )  # fmt: skip
    except FileNotFoundError:
        pytest.skip("no unshare here: a small disk cannot be made")
    if not (copy / "first").exists():
        pytest.skip(f"a small disk cannot be mounted here: {done.stderr.strip()}")
    (said,) = done.stderr.splitlines()
    assert (copy / "first").read_text() == "2\n" and "cannot write" in said and "room" in said
    assert Path(said.split(": ")[1]).name.startswith(lacks) or lacks.replace("\\", "") in said
    assert json.loads((copy / "manifest.json").read_text())["complete"] is False
    rows = (copy / "blocks.partial.csv").read_text()
    assert rows.count("\n") > 20 and rows.endswith("\n")
    assert (copy / "second").read_text() == "0\n"
    whole = ["blocks.csv", "blocks.parquet", "manifest.json", "report.html", "stock.stl", "summary.json"]
    assert (copy / "left").read_text().split() == whole
