"""Tool tables and records."""

from __future__ import annotations

import json

import pytest

from vmachining.errors import ToolError
from vmachining.nc import ToolEntry, move_record, parse_program, read_tool_table


def test_tbl(tmp_path):
    file = tmp_path / "t.tbl"
    file.write_text("; comment\nT1 P1 Z0.5 D0.25;first\nt3p7d1.0z+2\n")
    assert read_tool_table(file, "inch") == {
        1: ToolEntry(1, 0.25 * 25.4, 0.5 * 25.4),
        3: ToolEntry(3, 25.4, 50.8),
    }
    assert read_tool_table(file)[1].length_mm == 0.5


def test_job_file(tmp_path):
    file = tmp_path / "job.toml"
    file.write_text('name = "x"\n[[tools]]\nnumber = 2\ntype = "flat"\ndiameter_mm = 8\nlength_mm = 60.5\n')
    assert read_tool_table(file) == {2: ToolEntry(2, 8.0, 60.5)}


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.tbl", "T1 P1\nhello\n", "a.tbl:2: not a tool"),
        ("a.tbl", "P1 Z1\n", "whole number T"),
        ("a.tbl", "T1\nT1\n", "given twice"),
        ("a.tbl", "\0", "binary"),
        ("a.toml", "[[tools]\n", "TOML"),
        ("a.toml", "tools = 3\n", r"\[\[tools\]\]"),
        ("a.toml", '[[tools]]\nnumber = "1"\n', "whole 'number'"),
        ("a.toml", "[[tools]]\nnumber = 1\nlength_mm = nan\n", "length_mm"),
    ],
)
def test_bad_tables(tmp_path, name, text, message):
    file = tmp_path / name
    file.write_text(text)
    with pytest.raises(ToolError, match=message):
        read_tool_table(file)


def test_missing_table(tmp_path):
    with pytest.raises(ToolError, match="cannot read"):
        read_tool_table(tmp_path / "none.tbl")
    with pytest.raises(ToolError, match="units"):
        read_tool_table(tmp_path / "none.tbl", "parsec")


def test_record_in_both_coordinates():
    text = b"S1 M3 F100\nG92 X10 Y10\nN7 G2 X20 Y10 I5 J0"
    move = parse_program(text, "p", home=(0, 0, 0)).moves[0]
    machine, program = move_record(move), move_record(move, "program")
    assert machine["end_mm"] == [10, 0, 0] and machine["center_mm"] == [5, 0]
    assert program["end_mm"] == [20, 10, 0] and program["center_mm"] == [15, 10]
    assert json.loads(json.dumps(machine))["motion"] == "arc_cw" and machine["n"] == 7
    with pytest.raises(ValueError, match="machine or program"):
        move_record(move, "work")
