"""A file of one JSON row for every seed that is done: a run that was cut continues where it was."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

__all__ = ["journaled"]


def journaled(
    seeds: Iterable[int], journal: str | Path | None, row_of: Callable[[int], dict[str, Any]]
) -> Iterator[dict[str, Any]]:
    """The row of each seed: from the journal, or made and written to it at once. Rows have a key `seed`."""
    known = {row["seed"]: row for row in _read(Path(journal))} if journal else {}
    for seed in seeds:
        row = known.get(seed) or row_of(seed)
        if journal and seed not in known:
            with Path(journal).open("a", encoding="utf-8") as out:
                out.write(json.dumps(row) + "\n")
        yield row


def _read(path: Path) -> list[dict[str, Any]]:
    """Rows of a journal; a last line that was cut is taken off."""
    if not path.exists():
        return []
    text = path.read_text(encoding="utf-8")
    whole = text[: text.rfind("\n") + 1]
    if whole != text:
        path.write_text(whole, encoding="utf-8")
    return [json.loads(line) for line in whole.splitlines()]
