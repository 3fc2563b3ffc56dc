"""Programs on the command line: travels and steps of a machine, taps, corners and folders of subprograms."""

from __future__ import annotations

import json

import pytest

from vmachining.cli.main import run

ARC = "G21 S1 M3 F100\nG0 X10 Y0 Z5\nG2 X10 Y0 I-5 J0\nG1 X12.013\nM2\n"


@pytest.fixture
def program(tmp_path):
    path = tmp_path / "p.nc"
    path.write_text(ARC)
    return path


@pytest.mark.parametrize("command", [["dda"], ["nc", "check"]])
@pytest.mark.parametrize(("travel", "fine"), [("0,-5,0,20,5,100", True), ("0,-4.9,0,20,5,100", False)])
def test_a_circle_may_leave_the_travel_between_its_ends(command, travel, fine, program, capsys):
    code = run([*command, str(program), "--travel", travel, "--home", "10,0,50"])
    told = capsys.readouterr()
    assert (code == 0) == fine
    assert fine or "E373 Y would go to -5 mm" in told.out + told.err


def test_targets_between_two_steps_are_told(program, capsys):
    assert run(["dda", str(program), "--blu", "0.01"]) == 0
    assert "I374 1 targets are not multiples of 0.01 mm" in capsys.readouterr().err
    assert run(["nc", "check", str(program), "--blu", "0.001"]) == 0
    assert "I374" not in capsys.readouterr().out


@pytest.mark.parametrize("travel", ["1,2", "a,0,0,1,1,1", "5,0,0,1,1,1"])
def test_a_travel_is_a_box(travel, program, capsys):
    assert run(["nc", "check", str(program), "--travel", travel]) == 2
    assert "--travel" in capsys.readouterr().err


def ends(capsys, *argv) -> list[list[float]]:
    assert run(["nc", "moves", *map(str, argv), "--json"]) == 0
    return [json.loads(line)["end_mm"] for line in capsys.readouterr().out.splitlines()]


def test_options_of_the_reader_reach_it(tmp_path, capsys):
    (tmp_path / "subs").mkdir()
    (tmp_path / "subs" / "go.ngc").write_text("o<go> sub\nG0 X7\no<go> endsub\n")
    path = tmp_path / "main.ngc"
    path.write_text("o<go> call\nM2\n")
    assert ends(capsys, path, "--subroutines", tmp_path / "subs") == [[7, 0, 0]]
    path.write_text("G21 S1 M3 F9 G98 G18\nG0 Y5\nG84 X1 Z2 R3 Y0\nM2\n")
    assert ends(capsys, path)[3] == [0, 2, 1]  # beside the hole, as the reference control feeds it
    assert ends(capsys, path, "--taps", "axis")[3] == [1, 0, 2]
    path.write_text("G21 S1 M3 F9\nG42.1 D2 G1 X9\nX18 Y.3\nX27\nM2\n")
    assert len(ends(capsys, path)) == 3
    assert len(ends(capsys, path, "--crc-corner", "exact")) == 4  # an arc about the corner
