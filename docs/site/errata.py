"""The page of misprints of the sources, made from the marks of the tests that prove them."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]

SOURCES = {
    "book": "Hendriko: five-axis milling, kinematics, sweeps, vectors, analytic engagement, forces, feeds",
    "pocket": "Paths in triangular pockets (register EC00201976084)",
    "tester": "A tester of NC programs (Parahyangan Catholic University)",
    "dda": "Interpolation by DDA for an engraving machine (Syahmenan)",
    "facets": "CAM on faceted models",
}

HEAD = """# Errata of the sources

The package follows five sources, and tests every formula of theirs before it trusts it. Here is what a test proves to be
printed wrong: the place, what is printed, what is right, and the test. The page is made from the marks of these tests, so
a row without a proof cannot stand here. Formulas that are not listed were found right as printed, or are not used.
"""


class Erratum(NamedTuple):
    """A misprint. test : file and name of the test that proves it."""

    source: str
    place: str
    printed: str
    right: str
    test: str


def errata(tests: Path = ROOT / "tests") -> Iterator[Erratum]:
    """All misprints that are marked in the tests, by file and line."""
    for file in sorted(tests.rglob("test_*.py")):
        text = file.read_text(encoding="utf-8")
        if "mark.erratum" not in text:
            continue
        for node in ast.walk(ast.parse(text)):
            if not isinstance(node, ast.FunctionDef):
                continue
            for mark in node.decorator_list:
                if isinstance(mark, ast.Call) and ast.unparse(mark.func) == "pytest.mark.erratum":
                    words = [str(ast.literal_eval(word)) for word in mark.args]
                    yield Erratum(*words, f"{file.relative_to(tests.parent).as_posix()}::{node.name}")


def errata_page(table: Callable[[Iterable[str], Iterable[Iterable[str]]], str]) -> str:
    """Markdown, a table for each source."""
    found = list(errata())
    out = [HEAD]
    for key, title in SOURCES.items():
        rows = [(e.place, e.printed, e.right, f"`{e.test}`") for e in found if e.source == key]
        if rows:
            out += [f"## {title}\n", table(("place", "printed", "right", "proof"), rows)]
    return "\n".join(out)
