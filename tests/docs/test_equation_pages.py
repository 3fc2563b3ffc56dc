"""The pages that map symbols and equations to functions: every name in their tables can be imported, every keyword is one."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
PAGES = ("engagement_analytic.md", "forces.md")
ROOMS = tuple(
    f"vmachining{room}" for room in ("", ".engagement", ".engagement.chip", ".force", ".feed", ".job")
)
"""Where a name may live that its section does not name."""

pytestmark = pytest.mark.skipif(not DOCS.is_dir(), reason="the docs are not part of an installed package")


def rows(text):
    """(modules of the section, cell of functions) of every row of every table."""
    modules, column = (), None
    for line in text.splitlines():
        if line.startswith("#"):
            modules, column = tuple(re.findall(r"`(vmachining[\w.]*)`", line)), None
        elif not line.startswith("|"):
            column = None
        else:
            cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line.strip().strip("|"))]
            if column is None:
                column = next((k for k, cell in enumerate(cells) if cell in ("function", "class")), -1)
            elif column >= 0 and not set(line) <= set("|-: "):
                yield modules, cells[column]


def resolved(name, rooms, classes):
    """What a dotted name of the page stands for, None if there is nothing of that name."""
    parts = [part for part in name.split(".") if part]
    if parts[0] in ("vm", "vmachining"):
        return pkgutil.resolve_name(".".join(["vmachining", *parts[1:]]))
    homes = [*(classes if name.startswith(".") else ()), *rooms, *classes]
    for home in homes:
        found = home
        for part in parts:
            found = getattr(found, part, None)
            if found is None:
                fields = getattr(home, "__dataclass_fields__", {})
                found = fields.get(part)
            if found is None:
                break
        if found is not None:
            return found
    return None


def code_of(cell):
    """(name, keywords) of the code in a cell of a table."""
    for code in re.findall(r"`([^`]+)`", cell):
        for name, args in re.findall(r"(\.?[A-Za-z_][\w.]*)(\([^()]*\))?", re.sub(r"=[^,)]+", "=", code)):
            inner = re.search(rf"\([^)]*\b{re.escape(name)}\b", code) is not None and not args
            if not inner and not re.fullmatch(r"[a-z]{1,2}=?", name):
                yield name, re.findall(r"(\w+)=", args)


@pytest.mark.parametrize("page", PAGES)
def test_every_name_in_a_table_can_be_imported(page):
    seen = 0
    for modules, cell in rows((DOCS / page).read_text(encoding="utf-8")):
        rooms = [importlib.import_module(name) for name in (*modules, *ROOMS)]
        classes = [value for room in rooms for value in vars(room).values() if inspect.isclass(value)]
        for name, keywords in code_of(cell):
            found = resolved(name, rooms, classes)
            assert found is not None, f"{page}: {name} in {cell}"
            seen += 1
            if keywords and callable(found):
                known = set(inspect.signature(found).parameters)
                assert set(keywords) <= known, (
                    f"{page}: {name} takes {sorted(known)}, the page says {keywords}"
                )
    assert seen > 30


def example(page):
    """What the code of a page leaves behind."""
    space: dict[str, object] = {}
    for code in re.findall(
        r"```python\n(.*?)```", (DOCS / page).read_text(encoding="utf-8"), flags=re.DOTALL
    ):
        exec(code, space)
    return space


def test_the_examples_run():
    assert example("engagement_analytic.md")["found"].cut_length.max() > 0.0
    assert example("forces.md")["f"].torque.mean() > 0.0
