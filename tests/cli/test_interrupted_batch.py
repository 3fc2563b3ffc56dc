"""A batch that is killed or stopped: no worker stays, the table is true, --resume finishes the rest."""

from __future__ import annotations

import csv
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from tinyjob import write_job

pytestmark = pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="looks for processes in /proc")

STEPS = "".join(f"G1 X{1 + k % 9} Y{1 + k % 13} Z{-0.01 * k:.2f}\n" for k in range(300))
LONG = f"T1 M6\nS1000 M3\nG0 X1 Y1 Z1\nG1 Z0 F500\n{STEPS}M30\n"


def children(pid: int) -> list[int]:
    return [int(p) for p in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def rows(out: Path) -> list[dict[str, str]]:
    with (out / "batch.csv").open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_a_stopped_batch_leaves_nobody_behind_and_goes_on(number, tmp_path):
    short = write_job(tmp_path / "a")
    long = write_job(tmp_path / "b", program=LONG, swap={'name = "tiny"': 'name = "long"'})
    out = tmp_path / "out"
    argv = [
        sys.executable,
        "-m",
        "vmachining",
        "batch",
        str(short),
        str(long),
        "--out",
        str(out),
        "--stock",
        "",
    ]
    process = subprocess.Popen(argv, stderr=subprocess.PIPE, text=True, start_new_session=True)
    partial = out / "long" / "blocks.partial.csv"
    deadline = time.monotonic() + 60
    while not (partial.exists() and partial.stat().st_size > 1000) and time.monotonic() < deadline:
        time.sleep(0.02)
    workers = children(process.pid)
    assert workers
    if number == signal.SIGKILL:
        process.kill()
    else:
        os.killpg(process.pid, number)  # as a terminal does it
    err = process.communicate(timeout=60)[1]
    assert "Traceback" not in err
    deadline = time.monotonic() + 10
    while any(map(running, workers)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(map(running, workers))
    first, second = rows(out)
    assert first["status"] == "done" and second["status"] == "interrupted"
    if number == signal.SIGINT:
        assert process.returncode == 130 and "stopped after block" in err
    done = subprocess.run([*argv, "--resume"], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert [row["status"] for row in rows(out)] == ["skipped", "done"]
