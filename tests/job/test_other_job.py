"""A directory knows its job: two jobs of one name do not take each other's results away."""

from __future__ import annotations

import shutil
import tomllib
from pathlib import Path

import pytest
from tinyjob import JOB, write_job

from vmachining.cli.main import run as command
from vmachining.errors import InputError
from vmachining.job import Job, run
from vmachining.toolpath import Triangle
from vmachining.toolpath.pocket import pocket_job

QUICK = ["--stages", "cut", "--quiet"]


def contents(out: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in out.iterdir()}


def test_another_job_of_that_name_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Both are called "tiny" and would write into out/tiny; the second replaced 690 s of work without a word."""
    first, second = write_job(tmp_path / "a"), write_job(tmp_path / "b", job=JOB + "\n# another\n")
    monkeypatch.chdir(tmp_path)
    assert command(["run", str(first), *QUICK]) == 0
    before = contents(tmp_path / "out" / "tiny")
    for words in ([], ["--resume"]):
        assert command(["run", str(second), *QUICK, *words]) == 2
        err = capsys.readouterr().err
        assert f"holds the result of another job, 'tiny' of {first.resolve()}" in err and "--force" in err
        assert contents(tmp_path / "out" / "tiny") == before
    assert command(["run", str(first), *QUICK]) == 0  # its own is replaced, as before
    assert command(["run", str(second), *QUICK, "--force"]) == 0


def test_an_edited_or_moved_job_is_the_same_one(tmp_path: Path) -> None:
    path, out = write_job(tmp_path / "a"), tmp_path / "out"
    words = ["--out", str(out), *QUICK]
    assert command(["run", str(path), *words]) == 0
    path.write_text(path.read_text() + "\n# edited\n")
    assert command(["run", str(path), *words]) == 0
    shutil.copytree(path.parent, tmp_path / "b")
    assert command(["run", str(tmp_path / "b" / path.name), *words]) == 0


def test_a_result_is_not_written_over_that_of_another_job(tmp_path: Path) -> None:
    one, other = write_job(tmp_path / "a"), write_job(tmp_path / "b", job=JOB + "\n# another\n")
    result = run(Job.load(one), stages=("cut",))
    result.write(tmp_path / "out", stock=(), report=False)
    second = run(Job.load(other), stages=("cut",))
    with pytest.raises(InputError, match="the result of another job, 'tiny'"):
        second.write(tmp_path / "out", stock=(), report=False)
    second.write(tmp_path / "out", stock=(), report=False, force=True)


def test_generated_jobs_carry_the_name_of_their_file() -> None:
    text = pocket_job(Triangle.of(100, 90, 80, 5), 'left "one".nc', depth_mm=2.0)
    assert tomllib.loads(text)["name"] == 'left "one"'
