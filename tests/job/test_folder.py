"""No run writes, replaces or removes a file that it did not make; two runs do not share a directory."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from datetime import UTC, datetime
from pathlib import Path

import pytest
from tinyjob import FEED, JOB, PROGRAM, write_job

from vmachining.cli.main import run as command
from vmachining.errors import InputError, JobError
from vmachining.job import Job, Stopped, run
from vmachining.job.files import OUTPUTS, sha256
from vmachining.job.folder import WORKING, FolderLock

NAMES = (*OUTPUTS, *WORKING, "manifest.json", "stock_3.step", "checkpoint.program.3.npz")


def tree(folder: Path) -> dict[str, str]:
    """Name and digest of every file."""
    return {str(path.relative_to(folder)): sha256(path) for path in folder.rglob("*") if path.is_file()}


def stop_after(done: int):
    """A progress callback that sends Ctrl-C to this process once."""
    sent: list[bool] = []

    def progress(stage: str, now: int, total: int) -> None:
        if now == done and not sent:
            sent.append(True)
            os.kill(os.getpid(), signal.SIGINT)

    return progress


def test_a_program_named_as_a_result_is_refused_beside_its_results(tmp_path, capsys):
    job = write_job(tmp_path, swap={'"tiny.nc"': '"scheduled.nc"'}, job=JOB + FEED)
    (tmp_path / "tiny.nc").rename(tmp_path / "scheduled.nc")
    before = tree(tmp_path)
    assert command(["run", str(job), "--out", str(tmp_path), "--quiet"]) == 2
    said = capsys.readouterr().err
    assert "scheduled.nc: is the program of this job" in said and "--out" in said
    assert tree(tmp_path) == before


@pytest.mark.parametrize("link", ["symbolic", "hard", "folder"])
def test_links_do_not_hide_an_input(link, tmp_path, capsys):
    """The program lies elsewhere; what leads to it has the name of a result, or the folder does."""
    job = write_job(tmp_path / "job", swap={'"tiny.nc"': '"report.html"'})
    program = tmp_path / "job" / "report.html"
    (tmp_path / "job" / "tiny.nc").rename(program)
    out = tmp_path / "out"
    if link == "folder":
        out.symlink_to(tmp_path / "job")
    else:
        out.mkdir()
        (out / "summary.json").symlink_to(program) if link == "symbolic" else (
            out / "summary.json"
        ).hardlink_to(program)
    assert command(["run", str(job), "--out", str(out), "--quiet"]) == 2
    assert "is the program of this job" in capsys.readouterr().err
    assert program.read_text() == PROGRAM and (out / "manifest.json").exists() is False


def test_an_input_that_an_earlier_run_made_is_not_replaced(tmp_path, capsys):
    """The second clamping starts from the workpiece of the first."""
    job, out = write_job(tmp_path), tmp_path / "out"
    assert command(["run", str(job), "--out", str(out), "--quiet"]) == 0
    second = write_job(
        tmp_path,
        swap={"box = { min = [0, 0, -4], max = [10, 18, 0] }": 'stl = "out/stock.stl"'},
        name="second.toml",
    )
    before = tree(tmp_path)
    assert command(["run", str(second), "--out", str(out), "--quiet"]) == 2
    assert "stock.stl: is the stock of this job" in capsys.readouterr().err and tree(tmp_path) == before


@pytest.mark.parametrize("name", NAMES)
def test_a_file_of_somebody_else_is_refused_by_name(name, tmp_path):
    job, out = Job.load(write_job(tmp_path)), tmp_path / "out"
    out.mkdir()
    (out / name).write_text("{}")
    (out / "notes.txt").write_text("mine")
    before = tree(tmp_path)
    with pytest.raises(InputError, match=r"was not made by this command.*move it away") as caught:
        run(job, out=out)
    assert caught.value.file == str(out / name) and tree(tmp_path) == before


def test_what_was_changed_since_it_was_made_belongs_to_who_changed_it(tmp_path):
    job, out = Job.load(write_job(tmp_path, job=JOB + FEED)), tmp_path / "out"
    run(job, out=out).write(out, stock=())
    (out / "notes.txt").write_text("mine")
    run(job, out=out).write(out, stock=())  # its own files are replaced, others stay
    assert (out / "notes.txt").read_text() == "mine"
    edited = (out / "scheduled.nc").read_text() + "(by hand)\n"
    (out / "scheduled.nc").write_text(edited)
    with pytest.raises(InputError, match=r"scheduled.nc: was changed since it was made"):
        run(job, out=out)
    assert (out / "scheduled.nc").read_text() == edited


def test_files_that_come_while_a_run_goes_on_stay(tmp_path):
    job, out = Job.load(write_job(tmp_path)), tmp_path / "out"
    result = run(job, out=out)
    (out / "report.html").write_text("mine")
    with pytest.raises(InputError, match=r"report.html: was not made"):
        result.write(out, stock=())
    assert (out / "report.html").read_text() == "mine"
    (out / "report.html").unlink()
    result.write(out, stock=("stl",))
    assert {path.name for path in out.iterdir()} == {
        "blocks.csv", "blocks.parquet", "summary.json", "report.html", "stock.stl", "manifest.json", "stages.zip",
    }  # fmt: skip


def test_results_of_another_kind_are_somebody_elses(tmp_path, capsys):
    job = write_job(tmp_path)
    assert command(["pack", str(job), "--out", str(tmp_path / "pack"), "--quiet", "--engagement", "0"]) == 0
    assert command(["run", str(job), "--out", str(tmp_path / "pack"), "--quiet"]) == 2
    assert "was not made by this command" in capsys.readouterr().err


@pytest.mark.slow  # 6 s
def test_a_manifest_says_what_made_the_files(tmp_path):
    job, out = write_job(tmp_path), tmp_path / "out"
    begin = datetime.now(UTC).replace(microsecond=0)
    argv = [
        "run",
        str(job),
        "--out",
        str(out),
        "--quiet",
        "--stock",
        "stl,3mf",
        "--stock-at",
        "2",
        "--workers",
        "1",
    ]
    done = subprocess.run(
        [sys.executable, "-m", "vmachining", *argv], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    manifest = json.loads((out / "manifest.json").read_text())
    assert manifest["command"][1:] == argv and manifest["checkpoints"] == {}
    given = {"workers": 1, "stock": ["stl", "3mf"], "stock_at": [2], "brep": "none"}
    assert manifest["options"] == manifest["options"] | given
    started, ended = (datetime.fromisoformat(manifest[key]) for key in ("started", "ended"))
    assert begin <= started <= ended <= datetime.now(UTC)
    found = tree(out)
    del found["manifest.json"]
    assert manifest["files"] == found and sorted([*manifest["outputs"], "stages.zip"]) == sorted(found)


def test_a_second_run_is_refused_while_the_first_one_lives(tmp_path, capsys):
    job, out = write_job(tmp_path), tmp_path / "out"
    with pytest.raises(Stopped):
        run(Job.load(job), out=out, progress=stop_after(4))
    before = tree(out)
    holder = subprocess.Popen(
        [sys.executable, "-c",
         "import sys; from pathlib import Path; from vmachining.job.folder import FolderLock\n"
         "lock = FolderLock(Path(sys.argv[1])); lock.acquire(); print('held', flush=True); sys.stdin.read()", str(out)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        assert holder.stdout is not None and holder.stdout.readline() == "held\n"
        for more in ([], ["--resume"]):
            assert command(["run", str(job), "--out", str(out), "--quiet", *more]) == 2
            assert f"{out}: another vmachining writes into this directory" in capsys.readouterr().err
        assert tree(out) == before
    finally:
        holder.kill()
        holder.communicate()
    assert command(["run", str(job), "--out", str(out), "--quiet", "--resume"]) == 0


def test_a_lock_of_one_directory_leaves_the_others_free(tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    with (
        FolderLock(tmp_path / "a") as one,
        FolderLock(tmp_path / "b") as two,
        FolderLock(tmp_path / "a") as three,
    ):
        one.acquire()
        two.acquire()
        with pytest.raises(InputError, match="another vmachining"):
            three.acquire()
        one.release()
        three.acquire()
    assert not list((tmp_path / "a").iterdir())


def test_other_options_are_named_with_both_values(tmp_path):
    job, out = write_job(tmp_path), tmp_path / "out"
    with pytest.raises(Stopped):
        run(Job.load(job), out=out, progress=stop_after(4))
    write_job(tmp_path, swap={"chord_mm = 0.05": "chord_mm = 0.02"})
    with pytest.raises(JobError, match=r"chord_mm was 0.05 and is 0.02"):
        run(Job.load(job), out=out, resume=True)
    write_job(tmp_path)
    assert run(Job.load(job), out=out, resume=True, brep="2", workers=1).summary["brep"]["agreed"] == 1


def test_a_killed_run_leaves_nothing_that_stands_in_the_way(tmp_path):
    """What was being written when the process was killed goes with the next run, resumed or not."""
    job, out = Job.load(write_job(tmp_path)), tmp_path / "out"
    for resume in (False, True):
        with pytest.raises(Stopped):
            run(job, out=out, progress=stop_after(4))
        manifest = json.loads((out / "manifest.json").read_text())
        torn = out / f".checkpoint.program.4.{manifest['process']}.tmp.npz"
        torn.write_text("half")
        time.sleep(0.01)
        run(job, out=out, resume=resume).write(out, stock=())
        assert not torn.exists() and not any("partial" in path.name for path in out.iterdir())


@pytest.mark.slow  # 4 s
def test_a_checkpoint_grows_with_the_workpiece_and_not_with_the_program(tmp_path):
    """Passes that find nothing left to cut add nothing to it."""
    passes = "".join(f"G1 X{9 - 8 * (k % 2)} Y{2 + 2 * (k // 2 % 7)}\n" for k in range(14)) * 6
    program = f"T1 M6\nS1000 M3\nG0 X1 Y2 Z1\nG1 Z-1 F500\n{passes}M30\n"
    job, sizes = Job.load(write_job(tmp_path, program=program)), []
    for done in (2 + 2 * 14, 2 + 5 * 14):
        with pytest.raises(Stopped):
            run(job, out=tmp_path / "out", engine="mesh", workers=1, progress=stop_after(done))
        sizes.append((tmp_path / "out" / f"checkpoint.program.{done}.npz").stat().st_size)
    assert sizes[1] <= 1.01 * sizes[0]
    resumed = run(job, out=tmp_path / "out", engine="mesh", resume=True).summary
    assert resumed["final_mm3"] == pytest.approx(run(job, engine="mesh").summary["final_mm3"], rel=1e-9)


@pytest.mark.parametrize(
    ("place", "wrong"),
    [
        (("options",), None), (("options", "brep"), 3), (("options", "contact"), "some"), (("options", "stages"), "cut"),
        (("inputs", "job"), []), (("versions",), ["1"]), (("checkpoints",), []), (("checkpoints", "program", "done"), -1),
        (("checkpoints", "program", "file"), "../checkpoint.program.3.npz"), (("stage_seconds", "cut"), "x"),
        (("files",), {"blocks.csv": 1}), (("process",), "x"),
    ],
)  # fmt: skip
def test_a_damaged_manifest_is_refused(place, wrong, tmp_path, capsys):
    """Each of these ended in an internal failure, or a file outside of the directory was removed."""
    job, out = write_job(tmp_path), tmp_path / "out"
    with pytest.raises(Stopped):
        run(Job.load(job), out=out, stop=lambda: True)
    manifest = json.loads((out / "manifest.json").read_text())
    inner = manifest
    for name in place[:-1]:
        inner = inner[name]
    inner[place[-1]] = wrong
    (out / "manifest.json").write_text(json.dumps(manifest))
    assert command(["run", str(job), "--out", str(out), "--resume"]) == 2
    assert "manifest.json: was not made by this command" in capsys.readouterr().err
    assert command(["check", str(out)]) == 2 and "is not a result of a run" in capsys.readouterr().err
