"""The page that maps equations to functions names functions that exist, and its example runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from vmachining.engagement import Engagement, analytic, chip, chip_table, frames

PAGE = Path(__file__).parents[2] / "docs" / "engagement_analytic.md"
METHODS = (
    analytic.Pass,
    analytic.HeightStock,
    analytic.Records,
    analytic.Patch,
    analytic.Section,
    analytic.NormalGrid,
)


@pytest.mark.skipif(not PAGE.exists(), reason="the docs are not part of an installed package")
def test_every_named_function_exists_and_the_example_runs():
    text = PAGE.read_text(encoding="utf-8")
    prose = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    named = set(re.findall(r"`\.?([A-Za-z_][\w.]*)\(", prose))
    assert len(named) > 40
    for name in named:
        head, _, tail = name.partition(".")
        home = getattr(analytic, head, None)
        known = any(hasattr(room, head) for room in (analytic, chip, frames)) or head in ("vmachining", "vm")
        known |= any(hasattr(kind, head) for kind in METHODS)
        assert known, name
        if tail and isinstance(home, type):
            assert hasattr(home, tail), name
    space: dict[str, object] = {}
    for code in re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL):
        exec(code, space)
    found = space["found"]
    assert isinstance(found, analytic.Pass) and found.cut_length.max() > 0
    assert chip_table(found).height == 360 and Engagement is not None
