"""Text files that exhaust a parser are refused in one sentence by whatever command reads them."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest

from vmachining.cli.main import run
from vmachining.errors import InputError
from vmachining.textfile import MAX_TEXT, parse_json, parse_toml, read_text

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
