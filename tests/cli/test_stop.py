"""A signal ends a run in about two seconds, in the middle of a kernel call of minutes, too."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from slowness import slowness
from tinyjob import write_job

from vmachining.cli.stop import descendants

LONG = {"chord_mm = 0.05": "chord_mm = 2e-7"}
"""Its half circle takes about a minute."""

SOON = 6.0
"""s, for two that are promised, on a busy machine."""


def is_alive(process):
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.parametrize("number", [signal.SIGTERM, pytest.param(signal.SIGINT, marks=pytest.mark.long)])
@pytest.mark.slow  # 7 s
def test_a_signal_to_the_whole_group_while_solids_are_checked_is_an_interruption(number, tmp_path):
    """As `timeout` and a terminal send it: to the workers of OCCT, too."""
    job, out = write_job(tmp_path), tmp_path / "out"
    run = subprocess.Popen(
        [sys.executable, "-m", "vmachining", "run", str(job), "--out", str(out), "--brep", "all", "--workers", "2"],
        stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    deadline = time.monotonic() + 90
    while not (out / "brep.partial.csv").exists():
        assert run.poll() is None and time.monotonic() < deadline
        time.sleep(0.05)
    time.sleep(0.5)  # its workers are starting
    os.killpg(run.pid, number)
    _, err = run.communicate(timeout=60)
    assert run.returncode == 130 and "internal failure" not in err
    # between two blocks, or within one that takes long
    assert ("stopped after block" in err or "ended within block" in err) and "--resume" in err


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="looks for processes in /proc")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
@pytest.mark.slow  # 5 s
def test_a_long_block_does_not_keep_a_signal_waiting(number, tmp_path):
    job, out = write_job(tmp_path, swap=LONG), tmp_path / "out"
    run = subprocess.Popen(
        [sys.executable, "-m", "vmachining", "run", str(job), "--out", str(out), "--engine", "mesh", "--workers", "1"],
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    deadline = time.monotonic() + 60
    while not ((out / "blocks.partial.csv").exists() and descendants(run.pid)):
        assert run.poll() is None and time.monotonic() < deadline
        time.sleep(0.1)
    time.sleep(2.0)
    others = descendants(run.pid)
    begin = time.monotonic()
    run.send_signal(number)
    _, err = run.communicate(timeout=60)
    took = time.monotonic() - begin
    assert run.returncode == 130 and took < SOON * slowness()
    assert "ended within block" in err and "--resume" in err and err.count("\n") == 1
    assert json.loads((out / "manifest.json").read_text())["complete"] is False
    time.sleep(0.2)
    assert others and not any(map(is_alive, others))
