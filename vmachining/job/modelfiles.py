"""What the scripts beside the shipped models share: `make.py` writes program and stock, `part.py` the part.

python models/NAME/make.py             writes the program, and the stock where it is no plain body
python models/NAME/make.py --table     prints the known truths that README.md states
python models/NAME/part.py             writes part.step (build123d)
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from vmachining.job.stock import write_stock
from vmachining.stock import Triangles
from vmachining.toolpath.facets import FacetMesh

__all__ = ["number", "word", "write_model", "write_part"]


def number(value: float, decimals: int = 5) -> str:
    """At most so many decimals, no trailing zeros and no negative zero."""
    return f"{round(value, decimals) + 0.0:.{decimals}f}".rstrip("0").rstrip(".")


def word(letter: str, value: float, decimals: int = 5) -> str:
    """An NC word."""
    return letter + number(value, decimals)


def write_model(
    script: str, files: Callable[[], Mapping[str, str | bytes | FacetMesh]], table: Callable[[], str]
) -> None:
    """`main` of a make.py: writes its files beside it, or prints its table.

    script : `__file__`. files : what to write by name, meshes as STL. table : the known truths as text.
    """
    if "--table" in sys.argv[1:]:
        print(table())
        return
    folder = Path(script).parent
    for name, content in files().items():
        if isinstance(content, str):
            (folder / name).write_text(content, encoding="ascii")
        elif isinstance(content, bytes):
            (folder / name).write_bytes(content)
        else:
            write_stock(Triangles(content.vertices, content.triangles), folder / name)


def write_part(script: str, part: Any) -> None:
    """`main` of a part.py: part.step beside it, without the time of day."""
    from build123d import export_step

    target = Path(script).parent / "part.step"
    export_step(part, target, write_pcurves=False, timestamp="1970-01-01T00:00:00")
