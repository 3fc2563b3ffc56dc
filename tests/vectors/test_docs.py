"""docs/vectors.md names what there is."""

from __future__ import annotations

import re
from pathlib import Path

from vmachining.engines import vectors

PAGE = Path(__file__).parents[2] / "docs" / "vectors.md"


def test_every_function_that_the_page_names_is_public() -> None:
    table = PAGE.read_text(encoding="utf-8").split("## Symbols and equations")[1].split("## ")[0]
    named = set(re.findall(r"`(\w+)\(", table)) | set(re.findall(r"`([A-Z]\w+)\.", table))
    assert len(named) >= 8 and named <= set(vectors.__all__)
