"""Commands that write a file or a folder leave alone what is not theirs."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from tinyjob import write_job

from vmachining.cli.main import run

BALL = {"type": "ball", "diameter_mm": 4, "length_mm": 20}
SWEEP = {"tool": BALL, "start": {"cl_mm": [0, 0, 0]}, "end": {"cl_mm": [5, 0, 0]}, "interpolation": "axis"}
for end in ("start", "end"):
    SWEEP[end]["axis"] = [0, 0, 1]


def refused_once(argv: list[str], file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The command writes its file twice, and not where somebody else's is."""
    for _ in range(2):
        assert run(argv) == 0
    assert file.stat().st_size > 0
    file.write_text("ISO-10303-21; of somebody else")
    capsys.readouterr()
    assert run(argv) == 2
    said = capsys.readouterr().err
    assert str(file) in said and " made" in said and "choose another" in said
    assert file.read_text() == "ISO-10303-21; of somebody else"


@pytest.mark.parametrize("option", ["--out a.csv", "--out a.npz", "--plot a.html"])
def test_dda(option, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_job(tmp_path)
    refused_once(["dda", "tiny.nc", *option.split()], Path(option.split()[1]), capsys)


def test_a_program_is_not_replaced_by_its_pulses(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    program = (write_job(tmp_path).parent / "tiny.nc").rename(tmp_path / "tiny.csv").read_text()
    Path("pulses.csv").symlink_to("tiny.csv")
    for name in ("tiny.csv", "pulses.csv"):
        assert run(["dda", "tiny.csv", "--out", name]) == 2
        assert f"{name}: is the program itself" in capsys.readouterr().err
    assert Path("tiny.csv").read_text() == program


@pytest.mark.slow  # 7 s
def test_sweep(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("sweep.json").write_text(json.dumps(SWEEP))
    refused_once(["sweep", "sweep.json", "--step", "a.step"], Path("a.step"), capsys)
    refused_once(["sweep", "sweep.json", "--no-brep", "--plot", "a.html"], Path("a.html"), capsys)
    assert run(["sweep", "sweep.json", "--step", "sweep.json"]) == 2
    assert "sweep.json: is the sweep itself" in capsys.readouterr().err


@pytest.mark.parametrize("block", ["2", "2,5"])
def test_engage(block, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_job(tmp_path)
    argv = ["engage", "job.toml", "--block", block, "--angles", "12", "--out", "found"]
    Path("found").mkdir()
    Path("found/notes.txt").write_text("mine")
    refused_once(argv, Path("found/engagement.parquet"), capsys)
    assert Path("found/notes.txt").read_text() == "mine"
    made = json.loads(Path("found/engagement.json").read_text())["files"]
    assert {path.name for path in Path("found").iterdir()} == {"notes.txt", "engagement.json", *made}
