"""A batch on a small Dask cluster of this machine: a worker is killed, its job continues after the checkpoint elsewhere.

Everything else about clusters, with the commands of the docs, is in tests/cli/test_batch_cluster.py, which takes minutes.
"""

from __future__ import annotations

import os
import signal
import socket
from collections.abc import Callable
from itertools import count
from pathlib import Path

import polars as pl
import pytest
from polars.testing import assert_frame_equal
from tinyjob import write_job

from vmachining.errors import InputError
from vmachining.job import Job, Stopped, run
from vmachining.job.batch import run_many
from vmachining.job.batch.one import Row

distributed = pytest.importorskip("distributed")

STEPS = "".join(f"G1 X{1 + k % 9} Y{1 + k % 13} Z{-0.03 * k:.2f}\n" for k in range(40))
LONG = f"T1 M6\nS1000 M3\nG0 X1 Y1 Z1\nG1 Z0 F500\n{STEPS}M30\n"
BEGUN = 8
"""Blocks that are behind a checkpoint before the batch begins."""


class Killer:
    """Kills the worker that has the job, once it continues; keeps what it is told.

    blocks : numbers of blocks that were through, as told.
    """

    def __init__(self, address: str) -> None:
        self.client = distributed.Client(address, set_as_default=False)
        self.pids = self.client.run(os.getpid)
        self.blocks: list[int] = []
        self.notes: list[str] = []
        self.killed = False

    def at(self, index: int, stage: str, done: int, total: int) -> None:
        if stage != "program":
            return
        self.blocks.append(done)
        if self.killed or done <= BEGUN:
            return
        self.killed = True
        (busy,) = [address for address, tasks in self.client.processing().items() if tasks]
        os.kill(self.pids[busy], signal.SIGKILL)

    def ended(self, index: int, row: Row, done: int, total: int) -> None: ...

    def note(self, text: str) -> None:
        self.notes.append(text)


def _after(blocks: int) -> Callable[[], bool]:
    """Asked before every block: stop once so many are through."""
    asked = count()
    return lambda: next(asked) >= blocks


def test_a_scheduler_that_does_not_answer_is_named(tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))  # bound and not listening: refuses at once
        address = f"tcp://127.0.0.1:{taken.getsockname()[1]}"
        with pytest.raises(InputError, match=f"no Dask scheduler answers at {address}") as refused:
            run_many([write_job(tmp_path / "job")], tmp_path / "out", scheduler=address)
    assert "dask scheduler" in str(refused.value.remedy)
    with pytest.raises(InputError, match="is not an address"):
        run_many([write_job(tmp_path / "job")], tmp_path / "out", scheduler="tcp://:port")


@pytest.mark.slow  # 10 s: five interpreters start
def test_the_job_of_a_killed_worker_goes_on_behind_its_checkpoint(tmp_path: Path) -> None:
    file = write_job(
        tmp_path / "job", program=LONG, swap={'name = "tiny"': 'name = "long"', "chord_mm = 0.05": "chord_mm = 0.2"}
    )  # fmt: skip
    job, out = Job.load(file), tmp_path / "out"
    whole = run(job, out=tmp_path / "whole")

    with pytest.raises(Stopped):
        run(job, out=out / "long", stop=_after(BEGUN), workers=1)
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, protocol="tcp://", dashboard_address=None,
        host="127.0.0.1", silence_logs=50, local_directory=str(tmp_path / "scratch"),
    ) as cluster:  # fmt: skip
        killer = Killer(cluster.scheduler_address)
        (row,) = run_many(
            [file], out, scheduler=cluster.scheduler_address, formats=(), resume=True, watcher=killer
        )
        killer.client.close()
    assert killer.killed and any("is gone, its job go to others" in note for note in killer.notes), (
        killer.notes
    )
    assert row["status"] == "done", row
    assert min(killer.blocks) >= BEGUN  # both attempts
    assert_frame_equal(pl.read_parquet(out / "long" / "blocks.parquet"), whole.blocks, check_exact=True)
