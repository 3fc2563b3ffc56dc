"""What the scripts beside the shipped models share: `make.py` writes program and stock, `part.py` the part.

python models/NAME/make.py             writes the program, and the stock where it is not a plain body
python models/NAME/make.py --table     prints the known truths that README.md states
python models/NAME/part.py             writes part.step (build123d)
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vmachining.arrays import Floats
from vmachining.job.stock import write_stock
from vmachining.stock import Triangles
from vmachining.toolpath.facets import FacetMesh


def number(value: float, decimals: int = 5) -> str:
    """At most so many decimals, no trailing zeros and no negative zero."""
    return f"{round(value, decimals) + 0.0:.{decimals}f}".rstrip("0").rstrip(".")


def word(letter: str, value: float, decimals: int = 5) -> str:
    """An NC word."""
    return letter + number(value, decimals)


def write_model(
    script: str, files: Callable[[], Mapping[str, str | bytes | FacetMesh]], table: Callable[[], str]
) -> None:
    """`main` of a make.py: writes its files next to it, or prints its table.

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


def finishing_bounds(
    area: float, flattest: float, *, allowance: float, scallop: float, chord: float
) -> tuple[float, float]:
    """mm^3 removed where a faceted design raised by an allowance along z is finished.

    The finished part lies between the design less the chord and the design with scallops and what chords leave; heights along
    a normal are longer along z, by its least n_z. area: mm^2 in plan. flattest: least n_z of the design. Lengths in mm.
    """
    return area * (allowance - (scallop + 2 * chord) / flattest), area * (allowance + chord / flattest)


def part_below(
    height: Callable[[Floats, Floats], Floats],
    x: tuple[float, float],
    y: tuple[float, float],
    *,
    bottom: float,
    cells: tuple[int, int],
    margin: float = 1.0,
) -> Any:
    """A block from `bottom` up to a spline face through heights over a grid, a build123d part.

    height : mm at x (n, 1) and y (m,). x, y : mm, sides of the block. cells : of the grid, which goes `margin` mm beyond them.
    """
    from build123d import Box, Face, Pos, Vector, extrude

    a, b = (
        np.linspace(low - margin, high + margin, count + 1)
        for (low, high), count in zip((x, y), cells, strict=True)
    )
    z = height(a[:, None], b)
    points: list[list[Any]] = [[Vector(u, v, z[i, j]) for j, v in enumerate(b)] for i, u in enumerate(a)]
    top = float(z.max()) + 1.0
    face = Face.make_surface_from_array_of_points(points, tol=1e-4)
    below = extrude(face, amount=2.0 * (top - bottom), dir=(0.0, 0.0, -1.0))
    middle = [0.5 * sum(x), 0.5 * sum(y), 0.5 * (top + bottom)]
    return Pos(*middle) * Box(x[1] - x[0], y[1] - y[0], top - bottom) & below


def write_part(script: str, part: Any) -> None:
    """`main` of a part.py: part.step next to it, without the time of day."""
    from build123d import export_step

    target = Path(script).parent / "part.step"
    export_step(part, target, write_pcurves=False, timestamp="1970-01-01T00:00:00")
