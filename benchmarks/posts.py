"""Programs of CAM posts by family: how many are read clean, how many are named by one finding, what stands in the way."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from vmachining.errors import NCError
from vmachining.nc import parse_program

__all__ = ["posts"]

FOLDER_VARIABLE: Final = "VMACHINING_POSTS"


def posts() -> Iterator[dict[str, Any]]:
    """One folder of VMACHINING_POSTS is a family; its files are programs."""
    root = Path(os.environ.get(FOLDER_VARIABLE, "../shared/data/posts"))
    for family in sorted(path for path in root.iterdir() if path.is_dir()) if root.is_dir() else ():
        counts, causes = Counter[int](), Counter[str]()
        for file in sorted(family.iterdir()):
            try:
                errors = parse_program(file.read_bytes(), file.name, dialect="auto", rotary="ABC").errors
            except NCError as exc:
                counts[1] += 1
                causes[str(exc)[:90]] += 1
                continue
            counts[min(len(errors), 2)] += 1
            causes.update({f"{item.code} {item.message.split(';')[0]}"[:90] for item in errors})
        yield {
            "case": "posts", "family": family.name, "files": sum(counts.values()), "clean": counts[0], "named": counts[1],
            "more": counts[2], "causes": dict(causes.most_common(8)),
        }  # fmt: skip
