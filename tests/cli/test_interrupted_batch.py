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

from vmachining.cli.main import run
from vmachining.job.batch import folders_of
from vmachining.job.folder import FolderLock
from vmachining.processes import QUIET

pytestmark = pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="looks for processes in /proc")

STEPS = "".join(f"G1 X{1 + k % 9} Y{1 + k % 13} Z{-0.03 * k:.2f}\n" for k in range(60))
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


@pytest.mark.parametrize(
    ("number", "whom"),
    [
        (signal.SIGKILL, "batch"),
        pytest.param(signal.SIGINT, "batch", marks=pytest.mark.long),
        (signal.SIGINT, "group"),
        pytest.param(signal.SIGTERM, "group", marks=pytest.mark.long),
    ],
)
@pytest.mark.slow  # 15 s
def test_a_stopped_batch_leaves_nobody_behind_and_goes_on(number, whom, tmp_path):
    """A terminal sends Ctrl-C to the whole group, `kill` a signal to one process: anyway."""
    short = write_job(tmp_path / "a")
    long = write_job(
        tmp_path / "b",
        program=LONG,
        swap={'name = "tiny"': 'name = "long"', "chord_mm = 0.05": "chord_mm = 0.2"},
    )
    wrong = write_job(tmp_path / "c", program="", swap={'name = "tiny"': 'name = "wrong"'})
    out = tmp_path / "out"
    argv = [sys.executable, "-m", "vmachining", "batch", *map(str, (short, wrong, long))]
    argv += ["--out", str(out), "--stock", ""]
    process = subprocess.Popen(argv, stderr=subprocess.PIPE, text=True, start_new_session=True)
    partial = out / "long" / "blocks.partial.csv"
    deadline = time.monotonic() + 200
    while not (partial.exists() and partial.stat().st_size > 1000) and time.monotonic() < deadline:
        time.sleep(0.02)
    workers = children(process.pid)
    assert workers
    if whom == "batch":
        process.send_signal(number)
    else:
        os.killpg(process.pid, number)
    err = process.communicate(timeout=60)[1]
    assert "Traceback" not in err and "leaked" not in err, err[-3000:]
    deadline = time.monotonic() + 10
    while any(map(running, workers)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(map(running, workers))
    first, second, third = rows(out)
    assert [row["status"] for row in (first, second, third)] == ["done", "failed", "interrupted"]
    assert first["out"] == str(out / "tiny") and second["out"] == "" and not (out / "wrong").exists()
    if number != signal.SIGKILL:
        assert (
            process.returncode == 130 and "stopped after block" in err and third["out"] == str(out / "long")
        )
    write_job(tmp_path / "c", swap={'name = "tiny"': 'name = "wrong"'})
    done = subprocess.run([*argv, "--resume"], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert [row["status"] for row in rows(out)] == ["skipped", "done", "done"]


def test_ctrl_c_does_not_reach_the_queries_of_a_process_of_a_batch():
    """polars raises KeyboardInterrupt in a query where a process merely ignores the signal."""
    queries = """
import os, polars as pl, threading, time
rows = pl.DataFrame({"a": range(1_000_000)})
def kick():
    while True:
        time.sleep(0.002)
        os.kill(os.getpid(), signal.SIGINT)
threading.Thread(target=kick, daemon=True).start()
end = time.monotonic() + 1.5
while time.monotonic() < end:
    rows.sort("a", descending=True)
"""
    done = subprocess.run([sys.executable, "-c", QUIET + queries], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.slow  # 4 s
def test_a_table_of_somebody_else_and_a_second_batch_are_refused(tmp_path, capsys):
    job, out = write_job(tmp_path), tmp_path / "out"
    out.mkdir()
    (out / "batch.csv").write_text("part,price\n")
    argv = ["batch", str(job), "--out", str(out), "--stock", "", "--quiet"]
    assert run(argv) == 2 and (out / "batch.csv").read_text() == "part,price\n"
    assert f"{out / 'batch.csv'}: was not made by this command" in capsys.readouterr().err
    (out / "batch.csv").unlink()
    with FolderLock(out) as lock:
        lock.acquire()
        assert run(argv) == 2
    assert f"{out}: another vmachining writes into this directory" in capsys.readouterr().err
    for _ in range(2):
        assert run(argv) == 0


def test_every_job_has_a_directory_of_its_own(tmp_path):
    files = [tmp_path / f"{k}" / f"{stem}.toml" for k, stem in enumerate(("a", "a", "a-2", "a"))]
    folders = [folder.name for folder in folders_of(files, tmp_path)]
    assert len(set(folders)) == 4 and folders[:2] == ["a", "a-2"]
