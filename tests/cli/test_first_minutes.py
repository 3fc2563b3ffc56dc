"""What a newcomer types first: the command alone, help, completion, lists, and options that save time."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import click
import pytest
import typer
from tinyjob import write_job

from benchmarks import CASES, TAKES, described
from vmachining.cli.app import app
from vmachining.cli.main import run

SWEEP = {
    "tool": {"type": "flat", "diameter_mm": 10, "length_mm": 20},
    "start": {"cl_mm": [0, 0, 0], "axis": [0, 0, 1]},
    "end": {"cl_mm": [30, 0, 0], "axis": [0, 0, 1]},
}


def commands(group: click.Group, words: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
    out = [words]
    for name, command in group.commands.items():
        nested = getattr(command, "commands", None)
        out += commands(command, (*words, name)) if nested else [(*words, name)]
    return out


ALL = commands(typer.main.get_command(app))


@pytest.mark.parametrize("words", [(), ("nc",)])
def test_a_command_alone_prints_its_help(words, capsys):
    assert run([*words]) == 0
    said = capsys.readouterr()
    assert said.out.startswith("Usage: vmachining") and "Commands:" in said.out and not said.err


@pytest.mark.parametrize("words", ALL, ids=" ".join)
def test_examples_stand_on_one_line_each_and_are_real(words, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "60")
    assert run([*words, "--help"]) == 0
    lines = capsys.readouterr().out.splitlines()
    at = next(k for k, line in enumerate(lines) if line.strip() in ("Example:", "Examples:"))
    shown = [line.split() for line in lines[at + 1 :] if line.strip()]
    assert shown and all(line[0] == "vmachining" for line in shown)
    known = {word for path in ALL for word in path}
    assert all(line[1] in known for line in shown)
    for line in shown:  # every option of an example exists
        path = [word for word in line[1:3] if word in known]
        assert run([*path, "--help"]) == 0
        text = capsys.readouterr().out
        assert all(word in text for word in line if word.startswith("--"))


@pytest.mark.parametrize(
    ("shell", "asked", "wanted"),
    [
        ("bash", {"COMP_WORDS": "vmachining ini", "COMP_CWORD": "1"}, "init"),
        ("zsh", {"_TYPER_COMPLETE_ARGS": "vmachining ben"}, "bench"),
        (
            "fish",
            {"_TYPER_COMPLETE_ARGS": "vmachining run --ch", "_TYPER_COMPLETE_FISH_ACTION": "get-args"},
            "--chord",
        ),
    ],
)
def test_shells_complete(shell, asked, wanted):
    environment = {**os.environ, **asked, "_VMACHINING_COMPLETE": f"complete_{shell}"}
    done = subprocess.run(
        [sys.executable, "-m", "vmachining"], env=environment, capture_output=True, text=True, check=False
    )
    assert wanted in done.stdout, done


def test_bench_lists_its_cases_with_their_times(capsys):
    assert set(TAKES) <= set(CASES) and all(described(name)[0] for name in TAKES)
    assert run(["bench", "--list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == sorted(CASES)
    assert all(described(line.split()[0])[1] in line for line in lines)
    assert run(["bench", "--list", "--json", "nc"]) == 0
    assert json.loads(capsys.readouterr().out)["takes"] == TAKES["nc"]


def test_run_takes_another_chord_and_knows_results_by_it(tmp_path, capsys):
    path, out = write_job(tmp_path), tmp_path / "o"
    widths = []
    mesh = ["run", str(path), "--out", str(out), "--engine", "mesh"]
    for chord in ("0.4", "0.1"):
        assert run([*mesh, "--chord", chord, "--json"]) == 0
        summary = json.loads(capsys.readouterr().out)
        widths.append(summary["removed_hi_mm3"] - summary["removed_lo_mm3"])
        assert json.loads((out / "manifest.json").read_text())["options"]["chord_mm"] == float(chord)
    assert widths[1] < widths[0]
    assert run([*mesh, "--chord", "0.1", "--resume"]) == 0
    assert "already complete" in capsys.readouterr().err
    assert run([*mesh, "--chord", "0.3", "--resume"]) != 1
    assert "already complete" not in capsys.readouterr().err
    assert run(["run", str(path), "--chord", "0"]) == 2 and "above zero" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("more", "said"),
    [(["--chord", "0.2"], True), ([], False), (["--chord", "0.2", "--engine", "mesh"], False)],
)
def test_a_chord_that_changes_nothing_is_said(more, said, tmp_path, capsys):
    """Columns cut boxes without facets."""
    out = tmp_path / "o"
    assert run(["run", str(write_job(tmp_path)), "--out", str(out), "--stock", "", *more]) == 0
    notes = json.loads((out / "summary.json").read_text())["notes"]
    assert any(text.startswith("--chord changed no volume") for text in notes) == said
    assert ("--chord changed no volume" in capsys.readouterr().err) == said


def test_a_sweep_without_occt_and_its_picture(tmp_path, capsys):
    file, picture = tmp_path / "sweep.json", tmp_path / "sweep.html"
    file.write_text(json.dumps(SWEEP))
    assert run(["sweep", str(file), "--no-brep", "--plot", str(picture), "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert (
        record["brep_mm3"] is None and record["brep_note"] == "not asked" and "brep" not in record["seconds"]
    )
    assert record["lo_mm3"] <= (10 * 30 + 25 * 3.141592653589793) * 20 <= record["hi_mm3"]
    page = picture.read_text()
    assert "Swept solid" in page and 'src="http' not in page  # opens offline
    assert run(["sweep", str(file), "--no-brep"]) == 0
    said = capsys.readouterr().out
    assert "B-rep" not in said and "stated" not in said
    file.write_text(json.dumps(SWEEP | {"end": SWEEP["end"] | {"axis": [0.02, 0, 1]}}))
    assert run(["sweep", str(file), "--no-brep", "--chord", "0.05"]) == 0
    assert [line.endswith("]   stated") for line in capsys.readouterr().out.splitlines()] == [True, True]
    assert run(["sweep", str(file), "--no-brep", "--step", str(tmp_path / "s.step")]) == 2
    assert run(["sweep", str(file), "--plot", str(tmp_path / "s.txt")]) == 2


def test_pulse_trains_take_a_tool_table_and_do_not_flood_the_screen(tmp_path, capsys):
    program, table, out = tmp_path / "p.nc", tmp_path / "t.tbl", tmp_path / "pulses.csv"
    program.write_text(
        "G21 G90 G94 F100 S100 M3\nT1 M6 G43 H1\nS100 M3\nG41 D1\nG1 X10 Y0\nG1 X20\nG40\nM2\n"
    )
    table.write_text("T1 P1 Z50 D2 ;ten\n")
    assert run(["dda", str(program)]) == 2 and "E351" in capsys.readouterr().err
    assert run(["dda", str(program), "--tools", str(table), "--out", str(out)]) == 0
    said = capsys.readouterr()
    assert said.out == "" and str(out) in said.err and out.stat().st_size > 0
    assert run(["dda", str(program), "--tools", str(table)]) == 0 and "FRN" in capsys.readouterr().out


def test_every_command_that_reads_a_path_says_what_it_assumed(tmp_path, capsys):
    """G41 without a tool table is read as the path of the centre: no command may keep that to itself."""
    program = tmp_path / "p.nc"
    program.write_text(
        "%\nO0001\nG21 G17 G40 G90 G94\nT1 M6\nS1000 M3\nG54\nG0 X-10 Y0\nG43 H1 Z5\nG1 Z-2 F100\nG41 D1 X0 Y0\nX20\n"
        "G40 X40\nG0 Z50\nM30\n%\n"
    )
    for command in (["nc", "moves"], ["nc", "plot", "--out", str(tmp_path / "p.html")], ["dda"]):
        run([*command[:2], str(program), *command[2:], "--dialect", "fanuc"])
        assert "W351" in capsys.readouterr().err, command
