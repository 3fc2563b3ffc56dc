"""Text files that exhaust a parser are refused in one sentence by whatever command reads them."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest

from vmachining.cli.main import run
from vmachining.errors import InputError
from vmachining.textfile import MAX_TEXT, number_rows, parse_json, parse_toml, read_text

TOML = {
    "nested": "a = " + "[" * 100_000,
    "deep but closed": "a = " + "[" * 100 + "]" * 100,
    "dotted": "a" + ".a" * 100_000 + " = 1",
    "dotted header": "[" + " . ".join("a" * 70) + "]",
    "digits": "a = " + "1" * 10_000,
    "date": "a = 2026-02-31",
}


@pytest.mark.parametrize("name", TOML)
def test_toml_that_exhausts_its_parser(name):
    with pytest.raises(tomllib.TOMLDecodeError):
        parse_toml(TOML[name])


def test_points_in_numbers_and_comments_are_no_keys():
    row = ", ".join(f"{k}.5" for k in range(200))
    text = f"x = [{row}] # {'.' * 200} {row}\n[a.b]\nc.d = 1.5\ns = '{'word. ' * 20}'\n"
    assert parse_toml(text) == tomllib.loads(text)


@pytest.mark.parametrize("text", ['{"a":' * 100_000, '{"a": ' + "1" * 10_000 + "}", "{", "[1,]"])
def test_json_that_exhausts_its_parser(text):
    with pytest.raises(json.JSONDecodeError):
        parse_json(text)


@pytest.mark.parametrize("command", ["run {}", "nc check {} --tools {}", "batch {}"])
@pytest.mark.parametrize("name", ["nested", "digits"])
def test_commands_name_the_file(command, name, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("x.toml").write_text(TOML[name])
    assert run(command.format("x.toml", "x.toml").split()) == 2
    said = capsys.readouterr().err
    assert "x.toml" in said and "internal" not in said


@pytest.mark.parametrize(
    "text", ['{"a":' * 100_000, '{"tool": ' + "1" * 10_000 + "}"], ids=["nested", "digits"]
)
def test_a_sweep_names_its_file(text, tmp_path, capsys):
    (tmp_path / "x.json").write_text(text)
    assert run(["sweep", str(tmp_path / "x.json")]) == 2
    assert "x.json:1:1: not valid JSON" in capsys.readouterr().err


def test_what_never_ends_is_refused(tmp_path):
    endless = Path("/dev/zero")
    if not endless.exists():
        pytest.skip("no /dev/zero here")
    with pytest.raises(InputError, match=f"larger than {MAX_TEXT >> 20} MB"):
        read_text(endless, "table", InputError)


@pytest.mark.parametrize(
    "text",
    [
        "1,2.5,3\n", "1; 2.5 ;3;more words\n", "# said\n\nx_mm,y_mm,z_mm,kind\n1,2.5,3,none\n",
        "x [mm] y [mm] z [mm]\n1\t2.5\t3\n", "x, mm;y, mm;z, mm\n1;2.5;3;\n", "X,Y,Z\n1,2.5,3,,\n",
    ],
)  # fmt: skip
def test_lines_of_numbers(tmp_path, text):
    (tmp_path / "t.csv").write_text(text)
    assert number_rows(tmp_path / "t.csv", ("x", "y", "z"), "table", InputError).tolist() == [[1.0, 2.5, 3.0]]


@pytest.mark.parametrize(
    ("text", "words", "line"),
    [
        ("x;y;z\n12,5341;7,25;1,5\n", "a decimal comma", 2),
        ("12,5 7,25 1,5\n", "a decimal comma", 1),
        ("x,y,z\n12,5,7,25,1,5\n", "6 cells below 3 names", 2),
        ("nan,0,1\n1,2,3\n", "expected x, y, z", 1),
        ("inf 0 1\n1 2 3\n", "expected x, y, z", 1),
        ("x,y,z\nmm,mm,mm\n1,2,3\n", "expected x, y, z", 2),
        ("x,0,1\n1,2,3\n", "expected x, y, z", 1),
        ("1,2,3\n1,,2,3\n", "expected x, y, z", 2),
        ("\t1\t2\t3\n", "expected x, y, z", 1),
        ("1\t\t2\t3\n", "expected x, y, z", 1),
        (",x,y,z\n0,1,2,3\n", "expected x, y, z", 1),
        ("id,x,y,z\n0,1,2,3\n", "column 2 is called x", 1),
    ],
)
def test_lines_that_could_be_other_numbers(tmp_path, text, words, line):
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(InputError, match=words) as said:
        number_rows(tmp_path / "t.csv", ("x", "y", "z"), "table", InputError)
    assert f"t.csv:{line}:" in str(said.value)
