"""Four strategies for triangular pockets: their paths, and the lengths that their source gives for them.

| strategy | path |
|---|---|
| `dp` | direction parallel: lines 2 r apart along the longest side, linked along the walls, then once around |
| `dpi` | its improvement: each line reaches back into the scallop that the last link left, no round |
| `cp` | contour parallel: loops with an overlap in the corners |
| `cpi` | its improvement: loops 2 r apart, short spurs into the corners |

`mode="true"` measures a path that is generated; `"book"` evaluates the source's formulas in full precision with their
inner loops shrinking, `"book_corrected"` its direction-parallel improvement with the right denominator. Source: spec C.2 to C.4.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import ceil, cos, hypot, sin, tan
from typing import NamedTuple

import numpy as np
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from vmachining.arrays import Floats
from vmachining.errors import InputError
from vmachining.tool import FlatEnd
from vmachining.toolpath.clpath import iso_head, path_job, positive
from vmachining.toolpath.triangle import Triangle

MODES = ("true", "book", "book_corrected")
SAME_MM = 1e-9
"""Consecutive points closer than this are one."""

QUARTER = 180
"""Segments per quarter circle of coverage polygons: a disc of radius r lacks 3.2e-5 r^2 of its area."""


class Pocket(NamedTuple):
    """What a strategy does in a pocket.

    length : mm, of the path in mode "true", of the formula else. path : (n, 2) mm, cutter centre.
    uncovered_area, gouge_area : mm^2 of the pocket that the path leaves, and that it cuts beyond the pocket, by polygons (a disc
    has 720 segments). passes : lines or loops. warnings : what does not fit.
    """

    strategy: str
    mode: str
    length: float
    path: Floats
    uncovered_area: float
    gouge_area: float
    passes: int
    warnings: tuple[str, ...]


def pocket_lengths(
    a: float,
    b: float,
    c: float,
    r: float,
    *,
    strategy: str,
    mode: str = "true",
    angles: tuple[float, float, float] | None = None,
    centre: bool = False,
) -> Pocket:
    """Length, path and coverage of a strategy in a triangular pocket.

    a, b, c : mm, sides; a is the longest. r : mm, radius of the cutter and of the corners.
    strategy : "dp", "dpi", "cp" or "cpi".
    mode : "true", "book" or "book_corrected".
    angles : alpha, beta, gamma in degrees, taken instead of those of the sides by the formulas; the path has the true ones.
    centre : strategy "cp": append the straight link to the incentre, without which a triangle may stay there.
    Raises InputError: No triangle, a cutter that is too large, an unknown strategy or mode.
    """
    if strategy not in STRATEGIES:
        raise InputError(f"unknown strategy {strategy!r}", remedy=f"one of {', '.join(STRATEGIES)}")
    if mode not in MODES:
        raise InputError(f"unknown mode {mode!r}", remedy=f"one of {', '.join(MODES)}")
    exact, given = Triangle.of(a, b, c, r), Triangle.of(a, b, c, r, angles=angles)
    path = pocket_path(exact, strategy, centre=centre)
    length = path_length(path) if mode == "true" else FORMULAS[strategy](given, mode)
    uncovered, gouge = coverage(exact, path)
    warnings = tuple(text for text in (given.misfit,) if text)
    return Pocket(strategy, mode, length, path, uncovered, gouge, passes(exact, strategy), warnings)


def advice(a: float, b: float, c: float, r: float) -> list[Pocket]:
    """All strategies, shortest true path first; contour loops with the link to the centre where they need it.

    Raises InputError: As `pocket_lengths`.
    """
    centre = needs_centre(Triangle.of(a, b, c, r))
    found = [pocket_lengths(a, b, c, r, strategy=s, centre=centre) for s in STRATEGIES]
    return sorted(found, key=lambda pocket: pocket.length)


def pocket_path(triangle: Triangle, strategy: str, *, centre: bool = False) -> Floats:
    """(n, 2) mm: path of the cutter centre; consecutive points differ."""
    points = np.array(list(STRATEGIES[strategy](triangle, centre)), dtype=np.float64)
    new = np.hypot(*np.diff(points, axis=0).T) > SAME_MM
    return np.asarray(points[np.concatenate([[True], new])])


def bare_path(triangle: Triangle, kind: str) -> Floats:
    """(n, 2) mm: what strategies have in common before they care for what is left: "lines" or "loops", 2 r apart."""
    if kind == "lines":
        ends = [(b, a) if i % 2 else (a, b) for i, (a, b, _) in enumerate(_lines(triangle))]
        return np.concatenate(ends)
    loops = [_loop(triangle, 2.0 * triangle.r * i) for i in range(passes(triangle, "cpi"))]
    return np.concatenate([[*loop, loop[0]] for loop in loops])


def needs_centre(triangle: Triangle) -> bool:
    """Whether the loops of "cp" leave a triangle in the middle: the inradius of the innermost exceeds that of the cutter."""
    return triangle.inset - (passes(triangle, "cp") - 1) * pitch(triangle, "cp") > triangle.r


def path_length(path: Floats) -> float:
    """mm, of a polyline (n, 2)."""
    return float(np.hypot(*np.diff(path, axis=0).T).sum())


def coverage(triangle: Triangle, path: Floats) -> tuple[float, float]:
    """mm^2 of the pocket that a path leaves, and that it cuts beyond the pocket."""
    uncut, gouged = coverage_shapes(triangle, path)
    return float(uncut.area), float(gouged.area)


def coverage_shapes(triangle: Triangle, path: Floats) -> tuple[BaseGeometry, BaseGeometry]:
    """The same as areas of shapely."""
    pocket = Polygon(triangle.corners).buffer(triangle.r, quad_segs=QUARTER)
    cut = LineString(path).buffer(triangle.r, quad_segs=QUARTER)
    return pocket.difference(cut), cut.difference(pocket)


def passes(t: Triangle, strategy: str) -> int:
    """n: lines of the direction-parallel strategies, loops of the others."""
    over = t.height / (2.0 * t.r) if strategy in ("dp", "dpi") else t.inset / pitch(t, strategy)
    return max(1, ceil(over - 1e-12))


def pitch(t: Triangle, strategy: str) -> float:
    """d: distance of neighbouring passes, mm; of "cp" the largest that leaves nothing in the sharpest corner."""
    sharpest = float(t.half_angles.min())
    return t.r * (1.0 + sin(sharpest)) if strategy == "cp" else 2.0 * t.r


# -- paths, spec C.4 ---------------------------------------------------------------------------------------


def _lines(t: Triangle) -> list[tuple[Floats, Floats, float]]:
    """(left end, right end, width) of the lines of a direction-parallel strategy."""
    a, b, _ = t.corners
    out = []
    for i in range(passes(t, "dp")):
        y = 2.0 * t.r * i
        left, right = a + [y / tan(t.beta), y], b + [-y / tan(t.gamma), y]
        out.append((left, right, float(right[0] - left[0])))
    return out


def _parallel(t: Triangle, centre: bool) -> Iterator[Floats]:
    a, b, c = t.corners
    for i, (left, right, _) in enumerate(_lines(t)):
        yield from (right, left) if i % 2 else (left, right)
    yield from (c, a, b, c)


def _parallel_improved(t: Triangle, centre: bool) -> Iterator[Floats]:
    lines = _lines(t)
    yield lines[0][0]
    yield lines[0][1]
    for i in range(1, len(lines)):
        (left, right, width), before = lines[i], lines[i - 1]
        if i % 2:
            back = min(width, t.r / tan(t.beta / 2.0))
            yield from (right, left + [back, 0.0], before[0], left)
        else:
            back = min(width, t.r / tan(t.gamma / 2.0))
            yield from (left, right - [back, 0.0], before[1], right)
    yield t.corners[2]
    left, right, _ = lines[-1]
    yield right if len(lines) % 2 == 0 else left


def _loop(t: Triangle, inset: float) -> Floats:
    """(3, 2): corners of the triangle of centres, moved in by `inset`."""
    return np.asarray(t.incentre + (1.0 - inset / t.inset) * (t.corners - t.incentre))


def _contour(t: Triangle, centre: bool) -> Iterator[Floats]:
    step = pitch(t, "cp")
    for i in range(passes(t, "cp")):
        a, b, c = _loop(t, i * step)
        foot = np.array([t.incentre[0], a[1]])
        yield from (foot, b, c, a, foot)
    if centre:
        yield t.incentre


def _contour_improved(t: Triangle, centre: bool) -> Iterator[Floats]:
    n, half = passes(t, "cpi"), t.half_angles
    first = int(np.argmin(half.round(12)))
    # the loop goes from the corner of the link over the other two, as a polygon runs
    order = [first, (first - 1) % 3, (first + 1) % 3]
    outward = (t.corners - t.incentre) / np.linalg.norm(t.corners - t.incentre, axis=1)[:, None]
    spurs = t.r / np.sin(half) - t.r
    for i in range(n):
        corners = _loop(t, 2.0 * t.r * i)
        yield corners[first]
        for k in order[1:]:
            yield corners[k]
            if i:
                yield corners[k] + spurs[k] * outward[k]
                yield corners[k]
        yield corners[first]
    left = t.inset - 2.0 * t.r * (n - 1)
    if left > t.r:
        yield t.incentre
        for k in order[1:]:
            spur = max(0.0, (left - t.r) / sin(half[k]) - t.r)
            yield t.incentre + spur * outward[k]
            yield t.incentre


STRATEGIES: dict[str, Callable[[Triangle, bool], Iterator[Floats]]] = {
    "dp": _parallel,
    "dpi": _parallel_improved,
    "cp": _contour,
    "cpi": _contour_improved,
}


# -- formulas of the source, spec C.2 ----------------------------------------------------------------------


def _book_parallel(t: Triangle, mode: str) -> float:
    ab, bc, ac = t.sides
    return _lines_length(t) + (ac + bc) / 2.0 + ab + bc + ac


def _lines_length(t: Triangle) -> float:
    """TPD."""
    lean = 1.0 / tan(t.beta) + 1.0 / tan(t.gamma)
    return sum(t.sides[0] - 2.0 * t.r * i * lean for i in range(passes(t, "dp")))


def _book_parallel_improved(t: Triangle, mode: str) -> float:
    n, r = passes(t, "dpi"), t.r
    if mode == "book":
        saved = (n - 1) * r * (cos(t.beta) + cos(t.gamma) + 2.0) / (2.0 * sin(t.beta))
    else:
        saved = (n - 1) * r * (1.0 / tan(t.beta / 2.0) + 1.0 / tan(t.gamma / 2.0)) / 2.0
    _, bc, ac = t.sides
    across = sum(hypot((3.0 * cos(v) + 1.0) / (2.0 * sin(v)), 1.0) for v in (t.beta, t.gamma))
    return _lines_length(t) - saved + ac + bc + (n - 1) * 2.0 * r * 0.5 * across


def _loops_length(t: Triangle, step: float, n: int) -> float:
    cots = sum(1.0 / tan(v / 2.0) for v in (t.alpha, t.beta, t.gamma))
    return sum(t.a + t.b + t.c - (2.0 * t.r + 2.0 * step * i) * cots for i in range(n))


def _book_contour(t: Triangle, mode: str) -> float:
    n, step = passes(t, "cp"), pitch(t, "cp")
    return _loops_length(t, step, n) + (n - 1) * step


def _book_contour_improved(t: Triangle, mode: str) -> float:
    n, r = passes(t, "cpi"), t.r
    link = (n - 1) * 2.0 * r / sin(t.beta / 2.0)
    spurs = 2.0 * (n - 1) * sum(r / sin(v / 2.0) - r for v in (t.gamma, t.alpha))
    return _loops_length(t, 2.0 * r, n) + link + spurs


FORMULAS: dict[str, Callable[[Triangle, str], float]] = {
    "dp": _book_parallel,
    "dpi": _book_parallel_improved,
    "cp": _book_contour,
    "cpi": _book_contour_improved,
}


CLEAR_MM, MARGIN_MM = 2.0, 5.0
"""Height of rapids between levels; what the block of stock is larger than the pocket."""


def level_program(
    path: Floats,
    *,
    depth_mm: float,
    step_mm: float,
    feed_mm_min: float,
    plunge_mm_min: float,
    title: str = "",
) -> str:
    """Program text that drives a path (n, 2) mm at one or more depths below z = 0, plunging at its start.

    Coordinates have four decimals: points move by at most 7e-5 mm.

    Raises InputError: A depth, step or feed that is not positive.
    """
    sizes = {"depth": depth_mm, "step": step_mm, "feed": feed_mm_min, "plunge feed": plunge_mm_min}
    positive("", **sizes)
    levels = ceil(depth_mm / step_mm - 1e-12)
    (x, y), rest = path[0], path[1:]
    lines = [*iso_head(title, 1, 6000.0), f"G0 X{x:.4f} Y{y:.4f}", f"Z{CLEAR_MM:.4f}"]
    for level in range(1, levels + 1):
        if level > 1:
            lines += [f"G0 Z{CLEAR_MM:.4f}", f"X{x:.4f} Y{y:.4f}"]
        lines.append(f"G1 Z{-depth_mm * level / levels:.4f} F{plunge_mm_min:g}")
        for k, (px, py) in enumerate(rest):
            feed = f" F{feed_mm_min:g}" if k == 0 else ""
            lines.append(f"X{px:.4f} Y{py:.4f}{feed}")
    lines += ["G0 Z20.0000", "M5", "M2"]
    return "\n".join(lines) + "\n"


def pocket_job(triangle: Triangle, program: str, *, depth_mm: float) -> str:
    """Text of a job file, named after its program: a flat end mill and a block `MARGIN_MM` larger than the pocket."""
    corners, room = triangle.corners, triangle.r + MARGIN_MM
    low = np.append(corners.min(axis=0) - room, -depth_mm - MARGIN_MM).round(4)
    high = np.append(corners.max(axis=0) + room, 0.0).round(4)
    tool = FlatEnd(diameter=2.0 * triangle.r, length=max(3.0 * depth_mm, 4.0 * triangle.r))
    return path_job(program, tool, low=low, high=high)
