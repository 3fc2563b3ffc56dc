"""One job on a Dask cluster of two workers on this machine: workers die in cut and in contact, no number changes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("distributed")
from test_batch_cluster import ROOT, Cluster, commands, descendants, ended, until
from tinyjob import JOB

pytestmark = [
    pytest.mark.long,  # schedulers, workers and their processes each start an interpreter, and 4,200 blocks are run twice
    pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="looks for processes in /proc"),
]

ROWS = "".join(
    f"G1 X{x if k % 2 == 0 else 60 - x} Y{0.4 * k:.1f} Z{-1 - (x % 7) / 9:.3f}\n"
    for k in range(70)
    for x in range(60)
)
PROGRAM = f"T1 M6\nS8000 M3\nG0 X0 Y0 Z5\nG1 Z-1 F900\n{ROWS}G0 Z5\nM30\n"
BALL = 'type = "ball"\ndiameter_mm = 6\nflutes = 2\nlength_mm = 20'
SWAP = {
    'type = "flat"\ndiameter_mm = 4\nlength_mm = 20': BALL,
    "min = [0, 0, -4], max = [10, 18, 0]": "min = [0, 0, -6], max = [60, 30, 0]",
}


@pytest.fixture
def cluster(tmp_path):
    found = Cluster(tmp_path)
    yield found
    found.close()


def started(job, out, *more):
    words = [sys.executable, "-m", "vmachining", "run", str(job), "--out", str(out), *more]
    return subprocess.Popen(
        words, env=os.environ | {"PYTHONPATH": str(ROOT)}, stderr=subprocess.PIPE, text=True, start_new_session=True
    )  # fmt: skip


def points(out):
    """Names of the checkpoints of every part."""
    files = sorted((out / "parts").glob("*-of-2/manifest.json"))
    return [json.loads(path.read_text())["checkpoints"].keys() for path in files]


def test_workers_that_die_in_cut_and_in_contact_change_no_number(cluster, tmp_path):
    job = tmp_path / "job.toml"
    (tmp_path / "tiny.nc").write_text(PROGRAM)
    text = JOB
    for old, new in SWAP.items():
        assert old in text
        text = text.replace(old, new)
    job.write_text(text)
    alone = tmp_path / "alone"
    assert ended(started(job, alone, "--workers", "1"))[0] == 0
    workers = [cluster.worker(), cluster.worker()]
    out = tmp_path / "out"
    process = started(job, out, "--scheduler", cluster.address)
    rows = [out / "parts" / f"{k}-of-2" / "blocks.partial.csv" for k in (1, 2)]
    until(
        lambda: all(path.exists() and path.stat().st_size > 20_000 for path in rows), "no rows of the parts"
    )
    assert not any(points(out))  # both are in cut
    victims = descendants(workers[0].pid)
    os.killpg(workers[0].pid, signal.SIGKILL)
    until(lambda: not commands(victims), "a process of the dead worker lives")
    workers.append(cluster.worker())
    # a part that has cut is in contact until it says that it is complete
    until(
        lambda: any("program" in found and "engagement" not in found for found in points(out)),
        "no part has cut",
    )
    os.killpg(workers[1].pid, signal.SIGKILL)
    workers.append(cluster.worker())
    code, err = ended(process)
    assert code == 0 and err.count("is gone") == 2, err
    for name in ("blocks.csv", "stock.stl"):
        assert (out / name).read_bytes() == (alone / name).read_bytes()
    assert not (out / "parts").exists()


def test_one_three_and_no_workers(cluster, tmp_path):
    """Parts are as many as threads, and a cluster that cannot be used is refused before anything is written."""
    job = tmp_path / "job.toml"
    (tmp_path / "tiny.nc").write_text(PROGRAM)
    job.write_text(JOB.replace(*next(iter(SWAP.items()))))
    code, err = ended(started(job, tmp_path / "none", "--scheduler", cluster.address))
    assert code == 2 and "has no workers" in err and not list((tmp_path / "none").iterdir()), err
    tables = []
    for _ in (1, 3):
        cluster.worker()
        if tables:
            cluster.worker()
        out = tmp_path / f"{len(tables)}"
        code, err = ended(started(job, out, "--scheduler", cluster.address))
        assert code == 0, err
        tables.append((out / "blocks.csv").read_bytes())
    assert tables[0] == tables[1]
