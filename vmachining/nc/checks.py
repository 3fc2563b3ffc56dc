"""What can only be told from the moves: travel, increments of the machine, feeds above the stock."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from vmachining.nc.catalogue import CATALOGUE
from vmachining.nc.model import Finding, Motion, Move, Point
from vmachining.nc.vectors import add, subtract

NEAR: float = 1e-6
"""mm: a coordinate this near to a multiple of the increment, or to the end of travel, is one."""


def finding(
    code: str, line: int, n: int | None, message: str, word: str = "", col: int = 1, hint: str = ""
) -> Finding:
    """A finding; hint : in place of that of its catalogue entry."""
    return Finding(line, col, len(word), n, word, code, code[0], message, hint or CATALOGUE[code].hint)


def check_moves(
    moves: Sequence[Move],
    stock_top_mm: float | None,
    travel_mm: tuple[Point, Point] | None,
    blu_mm: float | None,
) -> list[Finding]:
    """E373, I374 and W520; each line says it once, I374 the whole program once."""
    out: list[Finding] = []
    if travel_mm is not None:
        out += beyond_travel(moves, *travel_mm)
    if blu_mm is not None and blu_mm > 0.0:
        out += _between(moves, blu_mm)
    if stock_top_mm is not None:
        feeds = [move for move in moves if move.motion not in (Motion.RAPID, Motion.DWELL)]
        if feeds and min(min(move.start[2], move.end[2]) for move in feeds) >= stock_top_mm:
            what = f"no feed motion goes below the top of the stock, z = {stock_top_mm:g} mm"
            out.append(finding("W520", feeds[0].line, feeds[0].n, what))
    return out


def beyond_travel(moves: Iterable[Move], low: Point, high: Point) -> Iterable[Finding]:
    """E373 of the lines whose motions leave a box of machine coordinates, arcs on their way too."""
    seen: set[int] = set()
    for move in moves:
        reach = (move.end_machine, move.end_machine) if move.center is None else _arc_box(move)
        for axis, a, b, least, most in zip("XYZ", low, high, *reach, strict=True):
            value = most if most - b > a - least else least
            if not a - NEAR <= value <= b + NEAR and move.line not in seen:
                seen.add(move.line)
                what = f"{axis} would go to {value:.6g} mm, its travel is {a:g} to {b:g} mm"
                yield finding("E373", move.line, move.n, what)


def _arc_box(move: Move) -> tuple[Point, Point]:
    """Machine coordinates of the corners of the box of an arc."""
    from vmachining.nc.rewrite_pieces import move_path  # with arrays, which most checks do without

    path = move_path(move)
    assert path is not None
    shift = subtract(move.end_machine, move.end)
    low, high = ((float(x), float(y), float(z)) for x, y, z in path.bounds)
    return add(low, shift), add(high, shift)


def _between(moves: Sequence[Move], blu: float) -> Iterable[Finding]:
    off = [
        move for move in moves if any(abs(v / blu - round(v / blu)) * blu > NEAR for v in move.end_machine)
    ]
    if off:
        what = f"{len(off)} targets are not multiples of {blu:g} mm"
        yield finding("I374", off[0].line, off[0].n, what)
