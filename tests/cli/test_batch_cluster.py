"""A batch on a Dask cluster of two workers on this machine, started as docs/batch.md says."""

from __future__ import annotations

import csv
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import polars as pl
import pytest
from polars.testing import assert_frame_equal
from tinyjob import write_job

pytest.importorskip("distributed")
pytestmark = [
    pytest.mark.long,  # schedulers, workers and their processes each start an interpreter
    pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="looks for processes in /proc"),
]

ROOT = Path(__file__).parents[2]
STEPS = "".join(f"G1 X{1 + k % 9} Y{1 + k % 13} Z{-0.03 * k:.2f}\n" for k in range(100))
LONG = f"T1 M6\nS1000 M3\nG0 X1 Y1 Z1\nG1 Z0 F500\n{STEPS}M30\n"
PATIENCE = 300.0
"""s for anything at all on a busy machine."""


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def documented(word):
    """The words of the command in the docs that begins with `dask WORD`."""
    return re.search(rf"^dask ({word} .*)$", (ROOT / "docs" / "batch.md").read_text(), re.M)[1].split()


class Cluster:
    """A scheduler and workers of this machine, each with a process group of its own."""

    def __init__(self, folder):
        self.folder, self.port = folder, free_port()
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.processes = []
        swap = {"10.0.0.5": "127.0.0.1", "8786": str(self.port)}
        self.scheduler = self.start([swap.get(word, word) for word in documented("scheduler")])

    def start(self, words, path=ROOT):
        process = subprocess.Popen(
            [sys.executable, "-m", "dask", *words, "--no-dashboard"], cwd=self.folder, start_new_session=True,
            env=os.environ | {"PYTHONPATH": str(path)}, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        self.processes.append(process)
        return process

    def worker(self, path=ROOT):
        words = ["1" if word == "4" else word for word in documented("worker")]
        words[1] = self.address
        scratch = self.folder / f"scratch{len(self.processes)}"
        return self.start([*words, "--local-directory", str(scratch)], path)

    def close(self):
        for process in self.processes:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()


@pytest.fixture
def cluster(tmp_path):
    found = Cluster(tmp_path)
    yield found
    found.close()


def batch(jobs, out, *more):
    argv = [
        sys.executable,
        "-m",
        "vmachining",
        "batch",
        *map(str, jobs),
        "--out",
        str(out),
        "--stock",
        "",
        *more,
    ]
    return subprocess.Popen(
        argv, env=os.environ | {"PYTHONPATH": str(ROOT)}, stderr=subprocess.PIPE, text=True, start_new_session=True
    )  # fmt: skip


def ended(process):
    err = process.communicate(timeout=PATIENCE)[1]
    assert "Traceback" not in err, err
    return process.returncode, err


def rows(out):
    with (out / "batch.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def descendants(pid):
    """Children are listed by the thread that started them."""
    found = []
    for table in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in table.read_text().split():
            found += [int(child), *descendants(int(child))]
    return found


def commands(pids):
    """{pid: command line} of those that live."""
    found = {}
    for pid in pids:
        with suppress(OSError):
            found[pid] = Path(f"/proc/{pid}/cmdline").read_text().replace("\0", " ")
    return {pid: text for pid, text in found.items() if text}


def until(true, what):
    deadline = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < deadline, what
        time.sleep(0.05)


def started(out, *names):
    def rows_there():
        tables = [out / name / "blocks.partial.csv" for name in names]
        return all(table.exists() and table.stat().st_size > 1000 for table in tables)

    until(rows_there, f"no rows of {names}")


def written(folder, name, program=LONG):
    return write_job(
        folder / name,
        program=program,
        swap={'name = "tiny"': f'name = "{name}"', "chord_mm = 0.05": "chord_mm = 0.2"},
    )


def test_a_worker_killed_in_mid_run_loses_nothing_and_changes_no_number(cluster, tmp_path):
    jobs = [
        written(tmp_path, "one"),
        written(tmp_path, "wrong", ""),
        written(tmp_path, "two"),
        written(tmp_path, "three"),
    ]
    workers = [cluster.worker(), cluster.worker()]
    out = tmp_path / "night"
    process = batch(jobs, out, "--scheduler", cluster.address)
    started(out, "one", "two")
    victim = descendants(workers[0].pid)
    os.killpg(workers[0].pid, signal.SIGKILL)
    code, err = ended(process)
    assert code == 2, err  # of the job with an empty program
    assert [row["status"] for row in rows(out)] == ["done", "failed", "done", "done"]
    assert re.search(r"worker tcp://\S+ is gone, its job go", err) or "is gone" in err
    until(lambda: not commands(victim), "a process of the dead worker lives")
    alone = tmp_path / "alone"
    assert ended(batch(jobs, alone))[0] == 2
    for name in ("one", "two", "three"):
        assert (out / name / "blocks.csv").read_bytes() == (alone / name / "blocks.csv").read_bytes()
        parts = [
            pl.read_parquet(each / "dataset" / f"job={name}" / "blocks.parquet") for each in (out, alone)
        ]
        assert_frame_equal(*parts, check_exact=True)


def test_the_process_of_a_job_ends_with_its_worker_alone(cluster, tmp_path):
    """The worker is killed and not its process group, as by the kernel when memory is short."""
    worker = cluster.worker()
    out = tmp_path / "night"
    process = batch([written(tmp_path, "one")], out, "--scheduler", cluster.address)
    started(out, "one")
    serving = [
        pid for pid, text in commands(descendants(worker.pid)).items() if "vmachining.job.batch" in text
    ]
    assert len(serving) == 1
    parent = int(Path(f"/proc/{serving[0]}/stat").read_text().rpartition(")")[2].split()[1])
    os.kill(parent, signal.SIGKILL)
    until(lambda: not commands(serving), "the process of the job lives")
    # the nanny starts a new worker, which takes the job up
    code, err = ended(process)
    assert code == 0 and "is gone" in err and "has come" in err, err
    assert rows(out)[0]["status"] == "done"


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_a_batch_that_ends_early_goes_on(number, cluster, tmp_path):
    jobs = [written(tmp_path, "one"), written(tmp_path, "two")]
    workers = [cluster.worker(), cluster.worker()]
    out = tmp_path / "night"
    process = batch(jobs, out, "--scheduler", cluster.address)
    started(out, "one", "two")
    process.send_signal(number)
    code, err = ended(process)
    if number == signal.SIGINT:
        assert code == 130 and err.count("stopped after block") == 2, err
        assert {row["status"] for row in rows(out)} == {"interrupted"}
    assert all(worker.poll() is None for worker in workers)
    code, err = ended(batch(jobs, out, "--scheduler", cluster.address, "--resume"))
    assert code == 0, err
    assert {row["status"] for row in rows(out)} <= {"done", "skipped"}


def test_a_cluster_without_workers_and_one_with_other_code_are_refused(cluster, tmp_path):
    job, out = written(tmp_path, "one"), tmp_path / "night"
    code, err = ended(batch([job], out, "--scheduler", cluster.address))
    assert code == 2 and "has no workers" in err and "dask worker tcp://" in err, err
    other = tmp_path / "other"
    shutil.copytree(ROOT / "vmachining", other / "vmachining", ignore=shutil.ignore_patterns("__pycache__"))
    with (other / "vmachining" / "errors.py").open("a") as file:
        file.write("# an edit\n")
    cluster.worker(other)
    code, err = ended(batch([job], out, "--scheduler", cluster.address))
    assert code == 2 and "has other versions: source of vmachining is" in err, err
    assert not (out / "batch.csv").exists() and not list(out.iterdir())


def test_a_scheduler_that_goes_ends_the_batch_and_says_so(cluster, tmp_path):
    cluster.worker()
    out = tmp_path / "night"
    process = batch([written(tmp_path, "one"), written(tmp_path, "two")], out, "--scheduler", cluster.address)
    started(out, "one")
    os.killpg(cluster.scheduler.pid, signal.SIGKILL)
    code, err = ended(process)
    assert code == 130 and f"the scheduler at {cluster.address} is gone" in err, err
    one, two = rows(out)
    assert one["status"] == two["status"] == "interrupted" and two["message"].startswith("not started")
