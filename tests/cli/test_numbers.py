"""Numbers that no option means are refused with the option's name: infinite, no number, far too large, below zero."""

from __future__ import annotations

import pytest
import typer.main

from vmachining.cli.app import app
from vmachining.cli.main import run

TOOLPATH = {
    "pocket": ["100", "80", "60", "--radius", "5"],
    "drop": ["part.stl", "--points", "0,0"],
    "distance": ["part.stl", "part.step"],
    "flank": ["rulings.csv", "--tool", "flat:12"],
    "surface": ["part.stl", "--tool", "ball:6", "--step", "2"],
}
OTHERS = [
    ("sweep s.json", "--chord"), ("sweep s.json", "--seconds"), ("engage j.toml --block 1", "--every"),
    ("engage j.toml --block 1", "--seconds"), ("nc check p.nc", "--blu"), ("nc check p.nc", "--stock-top"),
    ("post p.nc --machine ac-table --out q.nc", "--angle"),
]  # fmt: skip
SIGNED = {"--stock-top", "--floor", "--lead", "--tilt", "--direction", "--waterline"}


def numbers():
    group = typer.main.get_command(app).commands["toolpath"]
    for name, command in group.commands.items():
        for option in command.params:
            if option.param_type_name == "option" and option.metavar in (
                "MM",
                "MM/MIN",
                "REV/MIN",
                "DEG",
                "Z",
            ):
                yield name, option.opts[0]


def test_every_command_is_known():
    assert {name for name, _ in numbers()} == set(TOOLPATH)
    assert len(list(numbers())) >= 20


@pytest.mark.parametrize(
    ("call", "option"),
    [*((f"toolpath {name} {' '.join(TOOLPATH[name])}", option) for name, option in numbers()), *OTHERS],
)
def test_a_number_that_cannot_be_meant(call, option, capsys):
    """Refused before a file is looked for: part.stl is not there."""
    for value in ("inf", "-inf", "nan", "1e300", *(() if option in SIGNED else ("-1",))):
        assert run([*call.split(), option, value]) == 2
        said = capsys.readouterr().err
        assert f"'{option}'" in said and "give a number" in said and "internal" not in said
