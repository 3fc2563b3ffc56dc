"""Where a function of points changes its sign along edges: nothing of a stated size is missed, ends by roots.

The functions are distances, signed, so they change by at most the length of the way. Between two points of an
edge with values f and g of one sign there is no zero if |f| + |g| is at least the way between them: cells of
the edge are halved until that holds or they are shorter than `RESOLUTION_MM`. A cell whose ends differ in sign
then holds a root, found by regula falsi with halvings. What could be missed are two crossings within one such
cell: a gap or a contact shorter than `RESOLUTION_MM`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.tool import EdgeParts

RESOLUTION_MM = 0.01
"""Gaps and contacts along the edge that are shorter than this may be overlooked; longer ones may not."""

ROOT_MM = 1e-12
"""Brackets of a root are narrowed to this; distances are good to 1e-11 mm."""

Function: TypeAlias = Callable[[Ints, Ints, Floats], Floats]
"""(row, piece, s), each (n,) -> (n,) values that change by at most `stretch` per mm of s."""


def divided(f: Function, parts: EdgeParts, stretch: float, code: int, *, inside: bool) -> EdgeParts:
    """The parts of `parts` where f < 0, or where it is not; new ends carry `code`."""
    n = len(parts.row)
    if n == 0:
        return parts
    first, owner, at = _roots(f, parts, stretch)
    # per part its lower end, its roots in order, its upper end: between them the sign alternates
    every = np.arange(n)
    owners = np.concatenate([every, owner, every])
    places = np.concatenate([parts.lower, at, parts.upper])
    kinds = np.repeat([0, 1, 2], [n, len(at), n])
    order = np.lexsort((places, kinds, owners))
    owners, places, kinds = owners[order], places[order], kinds[order]
    begin = np.flatnonzero(kinds == 0)
    turn = np.arange(len(owners)) - begin[owners]
    negative = first[owners] ^ (turn % 2 == 1)
    left = np.flatnonzero((kinds != 2) & (negative == inside))
    left = left[places[left + 1] > places[left]]
    right, mine = left + 1, owners[left]
    return EdgeParts(
        parts.row[mine], parts.piece[mine], places[left], places[right],
        np.where(kinds[left] == 0, parts.lower_by[mine], code),
        np.where(kinds[right] == 2, parts.upper_by[mine], code),
    )  # fmt: skip


def _roots(f: Function, parts: EdgeParts, stretch: float) -> tuple[Bools, Ints, Floats]:
    """Whether f < 0 at the lower ends; part and s of every change of sign."""
    owner = np.arange(len(parts.row))
    a, b = parts.lower, parts.upper
    f_a, f_b = f(parts.row, parts.piece, a), f(parts.row, parts.piece, b)
    first = np.asarray(f_a < 0.0)
    found: list[tuple[Ints, Floats, Floats, Floats, Floats]] = []
    while len(owner):
        width = b - a
        same = (f_a < 0.0) == (f_b < 0.0)
        small = width <= RESOLUTION_MM
        done = ~same & small
        if done.any():
            found.append((owner[done], a[done], b[done], f_a[done], f_b[done]))
        go = ~small & ~(same & (np.abs(f_a) + np.abs(f_b) >= stretch * width))
        owner, a, b, f_a, f_b = owner[go], a[go], b[go], f_a[go], f_b[go]
        m = 0.5 * (a + b)
        f_m = f(parts.row[owner], parts.piece[owner], m) if len(m) else m
        owner = np.concatenate([owner, owner])
        a, b = np.concatenate([a, m]), np.concatenate([m, b])
        f_a, f_b = np.concatenate([f_a, f_m]), np.concatenate([f_m, f_b])
    if not found:
        return first, np.empty(0, dtype=np.int64), np.empty(0)
    owner, a, b, f_a, f_b = (np.concatenate(column) for column in zip(*found, strict=True))
    return first, owner, _refined(f, parts.row[owner], parts.piece[owner], a, b, f_a, f_b)


def _refined(f: Function, row: Ints, piece: Ints, a: Floats, b: Floats, f_a: Floats, f_b: Floats) -> Floats:
    """Roots in brackets, by regula falsi (Illinois) and every third time the middle."""
    out = 0.5 * (a + b)
    left = np.arange(len(a))
    for step in range(90):
        with np.errstate(invalid="ignore", divide="ignore"):
            x = a + (b - a) * (f_a / (f_a - f_b))
        x = np.where(np.isfinite(x) & (x > a) & (x < b) & (step % 3 != 2), x, 0.5 * (a + b))
        f_x = f(row[left], piece[left], x)
        to_left = (f_x < 0.0) == (f_a < 0.0)
        f_a, f_b = np.where(to_left, f_x, 0.5 * f_a), np.where(to_left, 0.5 * f_b, f_x)
        a, b = np.where(to_left, x, a), np.where(to_left, b, x)
        middle = 0.5 * (a + b)
        out[left] = np.where(f_x == 0.0, x, middle)
        go = (f_x != 0.0) & (b - a > ROOT_MM) & (middle > a) & (middle < b)
        if not go.any():
            break
        left, a, b, f_a, f_b = left[go], a[go], b[go], f_a[go], f_b[go]
    return out
