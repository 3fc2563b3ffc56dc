"""SIGTERM at any time ends a command with a sentence and exit code 130, also while modules are loaded."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path

import pytest
from tinyjob import write_job


def listens(process: int) -> bool:
    """Whether the process has a handler of its own for SIGTERM: from here on the command is ours to end."""
    status = Path(f"/proc/{process}/status").read_text()
    caught = int(status.split("SigCgt:")[1].split()[0], 16)
    return bool(caught >> (signal.SIGTERM - 1) & 1)


@pytest.mark.skipif(not Path("/proc/self/status").is_file(), reason="looks into /proc")
@pytest.mark.parametrize("after", [0.0, 0.1, 0.3, 0.6])
def test_a_signal_during_imports_is_an_interruption(after: float, tmp_path: Path) -> None:
    """Three of four tries were killed by the signal without a word."""
    job = write_job(tmp_path / "job")
    run = subprocess.Popen(
        [sys.executable, "-m", "vmachining", "run", str(job), "--out", str(tmp_path / "out")],
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    deadline = time.monotonic() + 60
    while not listens(run.pid):
        assert run.poll() is None and time.monotonic() < deadline
        time.sleep(0.002)
    time.sleep(after)
    run.send_signal(signal.SIGTERM)
    _, err = run.communicate(timeout=60)
    assert run.returncode == 130, err
    assert (
        any(word in err for word in ("interrupted", "stopped after", "ended within"))
        and "Traceback" not in err
    )


@pytest.mark.parametrize("place", ["run", "_say"])
def test_a_signal_before_and_after_the_command_is_an_interruption(place, monkeypatch, capsys) -> None:
    """Between two imports, and while a refusal is being said, it ended in a traceback."""
    room = import_module("vmachining.cli.main")
    real, asked = getattr(room, place), iter([True])

    def interrupted(*given):
        if next(asked, False):
            raise KeyboardInterrupt
        return real(*given)

    monkeypatch.setattr(room, place, interrupted)
    monkeypatch.setattr(signal, "signal", lambda *_: None)
    with pytest.raises(SystemExit) as ended:
        room.main(["run", "missing.toml"])
    assert ended.value.code == 130 and capsys.readouterr().err == "vmachining: interrupted\n"


@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&- 2>&-"])
def test_standard_streams_may_be_closed(closed, tmp_path):
    """As by some servers: it ended with a traceback, and files of ours would get their numbers."""
    words = [sys.executable, "-m", "vmachining", "nc", "check", write_job(tmp_path).with_name("tiny.nc")]
    ended = subprocess.run(["sh", "-c", f'"$@" {closed}', "sh", *words], capture_output=True, text=True)
    assert ended.returncode == 0 and "Traceback" not in ended.stderr
