"""The pages that map symbols of the specification to functions name what there is."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path

import pytest

from vmachining.toolpath import MODES

DOCS = Path(__file__).parents[2] / "docs"
NAME = re.compile(r"`(\.?[A-Za-z_][\w.]*)[^`]*`")


def names() -> list[tuple[str, str]]:
    """(page, name) of the last column of the tables of symbols; `.name` belongs to the class that the row names before."""
    found = []
    for page in ("facets.md", "pockets.md"):
        for line in (DOCS / page).read_text(encoding="utf-8").splitlines():
            cells = re.split(r"(?<!\\)\|", line.strip().strip("|"))
            if len(cells) != 3:
                continue
            owner = ""
            for name in NAME.findall(cells[2]):
                if not name.startswith("."):
                    owner = name.removesuffix(".of")
                found.append((page, owner + name if name.startswith(".") else name))
    return found


def known(name: str) -> bool:
    """Whether a dotted name is one of the room, of `facets`, or a module in it."""
    parts = name.split(".")
    for root in ("vmachining", "vmachining.toolpath", "vmachining.toolpath.facets"):
        value, rest = import_module(root), list(parts)
        while rest:
            if not hasattr(value, rest[0]):
                try:
                    import_module(f"{getattr(value, '__name__', '?')}.{rest[0]}")
                except ImportError:
                    break
            value = getattr(value, rest.pop(0))
        if not rest:
            return True
    return False


def test_there_are_rows() -> None:
    assert len(names()) > 25


@pytest.mark.parametrize(("page", "name"), [pair for pair in names() if pair[1] != "mode"])
def test_each_function_of_a_row_is_there(page: str, name: str) -> None:
    assert known(name), f"{page}: {name}"


def test_modes_are_those_of_the_lengths() -> None:
    text = (DOCS / "pockets.md").read_text(encoding="utf-8")
    assert set(re.findall(r'mode="(\w+)"', text)) == set(MODES)
