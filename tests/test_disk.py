"""Temporary directories stay with nobody, and a disk without room is named."""

from __future__ import annotations

import errno
import signal
import subprocess
import sys
from pathlib import Path

import polars as pl
import pytest

from vmachining import disk
from vmachining.disk import Scratch, writing
from vmachining.errors import FullError, InputError

HOLD = """
import pathlib, sys
from vmachining.disk import Scratch
kept = Scratch(pathlib.Path(sys.argv[1]))
print(kept.path, flush=True)
input()
"""


def test_a_killed_process_leaves_its_directory_to_the_next(tmp_path: Path) -> None:
    """Of two processes the one that lives keeps its own."""
    holders = [
        subprocess.Popen([sys.executable, "-c", HOLD, tmp_path], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        for _ in range(2)
    ]  # fmt: skip
    killed, alive = (Path(holder.stdout.readline().strip()) for holder in holders if holder.stdout)
    (killed / "deep").mkdir()
    (killed / "deep" / "file").write_text("left")
    holders[0].send_signal(signal.SIGKILL)
    holders[0].wait()
    strange = tmp_path / killed.name.replace("vmachining", "somebody")
    strange.mkdir()
    assert killed.is_dir()
    disk._tidy.cache_clear()
    with Scratch(tmp_path) as mine:
        assert not killed.exists() and alive.is_dir() and mine.is_dir() and strange.is_dir()
    holders[1].communicate("\n")
    assert list(tmp_path.iterdir()) == [strange]


def test_a_directory_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nowhere: cannot write: .*set TMPDIR"):
        Scratch(tmp_path / "nowhere")


@pytest.mark.parametrize("kind", [FullError, InputError])
def test_a_full_disk_is_told_from_other_failures(kind: type[InputError], tmp_path: Path) -> None:
    number = errno.ENOSPC if kind is FullError else errno.EROFS
    with pytest.raises(InputError, match=r"x\.csv: cannot write") as caught, writing(tmp_path / "x.csv"):
        raise OSError(number, "said by the system")
    assert type(caught.value) is kind
    with pytest.raises(pl.exceptions.ComputeError), writing(tmp_path / "x.csv"):  # there is room
        raise pl.exceptions.ComputeError("a fault of ours")
