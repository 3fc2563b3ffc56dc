# One block against the tiles: cells in a heap, the widest first, divided into four until the bracket is narrow enough.
#
# Legend. Shapes and rows: see surface/_kernels.py. Tiles: grid = (x, y, width, depth of a tile), size = (tiles along x,
# y), first[tile] its first entry or -1, entries e: sweep[e], after[e] the next one or -1; free = (first
# free entry, number of them); own[tile]: 1 where sweeps are cut, 0 where somebody else cuts them or nobody asks.
# Work: cell[c] = (x, y, hx, hy, lo, hi), span[c] = (first id, ids), heap of cells by width, ids, and what cells need.

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.engines.columns.arcs._kernels import STRAIGHT, at, place
from vmachining.engines.columns.cells._kernels import bounds
from vmachining.engines.columns.closed._kernels import hides
from vmachining.engines.columns.heap._kernels import sift_down, sift_up, width
from vmachining.engines.columns.roof._kernels import Roof
from vmachining.engines.columns.sides import DOWN, FIRST, FORGET, SELF, SMOOTH, UP
from vmachining.engines.columns.smooth._kernels import above
from vmachining.engines.columns.surface._kernels import COLUMNS, distance, value
from vmachining.jit import kernel, leaf

LOW = np.int64(4)  # column of a cell's lower end; the upper one stands beside it


class Shapes(NamedTuple):
    """Cutters and sweeps: head (c, 5), part (c, parts, 8), lift (c, c), ladder (c, 3), rows (n, 13); see
    surface/_kernels.py and arcs/_kernels.py. rules: see sides.py."""

    head: NDArray[np.float64]
    part: NDArray[np.float64]
    lift: NDArray[np.float64]
    ladder: NDArray[np.float64]
    rows: NDArray[np.float64]
    rules: int


class Tiles(NamedTuple):
    """grid (4,) mm, size (2,), first (tiles,), sweep, after (entries,), free (2,), own (tiles,)."""

    grid: NDArray[np.float64]
    size: NDArray[np.int64]
    first: NDArray[np.int64]
    sweep: NDArray[np.int64]
    after: NDArray[np.int64]
    free: NDArray[np.int64]
    own: NDArray[np.uint8]


class Work(NamedTuple):
    """cell (n, 6), span (n, 2), heap (n,), ids (m,), met (t, 3) tile, first id, ids; lines, E, C, P, W per cell."""

    cell: NDArray[np.float64]
    span: NDArray[np.int64]
    heap: NDArray[np.int64]
    ids: NDArray[np.int64]
    met: NDArray[np.int64]
    lines: NDArray[np.float64]
    E: NDArray[np.float64]
    C: NDArray[np.float64]
    P: NDArray[np.float64]
    W: NDArray[np.float64]


class Goal(NamedTuple):
    """Width asked for: max(relative * volume - less, weight * relative * volume + floor), see `engines/columns/goal.py`."""

    relative: float
    less: float
    weight: float
    floor: float


@kernel
def tile_range(
    rows: NDArray[np.float64], k: int, R: float, grid: NDArray[np.float64], size: NDArray[np.int64]
) -> tuple[int, int, int, int]:
    """(first, last + 1) tile along x and y that sweep k, of a cutter with radius R, may reach."""
    L = rows[k, 5]
    x0, x1 = rows[k, 0], rows[k, 0] + L * rows[k, 3]
    y0, y1 = rows[k, 1], rows[k, 1] + L * rows[k, 4]
    if rows[k, 10] != STRAIGHT:  # its ends, and how far it bulges between
        r = rows[k, 3]
        x0, y0, _, _, _, _ = at(rows, k, r, 0.0)
        x1, y1, _, _, _, _ = at(rows, k, r, abs(rows[k, 11]))
        R += r * (1.0 - np.cos(0.5 * rows[k, 11]))
    i0 = int(np.floor((min(x0, x1) - R - grid[0]) / grid[2]))
    i1 = int(np.floor((max(x0, x1) + R - grid[0]) / grid[2])) + 1
    j0 = int(np.floor((min(y0, y1) - R - grid[1]) / grid[3]))
    j1 = int(np.floor((max(y0, y1) + R - grid[1]) / grid[3])) + 1
    return max(i0, 0), min(i1, size[0]), max(j0, 0), min(j1, size[1])


@leaf
def _replace(tiles, t, ids, at, count):
    """Give tile t the list ids[at:at + count]. The caller has seen to free entries."""
    first, sweep, after, free = tiles.first, tiles.sweep, tiles.after, tiles.free
    e, last = first[t], -1
    for q in range(count):
        if e < 0:
            e = free[0]
            free[0] = after[e]
            free[1] -= 1
            after[e] = -1
            if last < 0:
                first[t] = e
            else:
                after[last] = e
        sweep[e] = ids[at + q]
        last, e = e, after[e]
    if last < 0:
        first[t] = -1
    else:
        after[last] = -1
    while e >= 0:  # what is left over is free again
        after[e], free[0], e = free[0], e, after[e]
        free[1] += 1


@leaf
def part_of(goal: Goal, share: float) -> Goal:
    """What a part with this share of the tiles of a block has to reach of the goal of the whole; see columns/goal.py."""
    if share >= 1.0:
        return goal
    return Goal(goal.relative, 0.5 * goal.floor * (1.0 - share), 0.5, 0.5 * share * goal.floor)


@leaf
def wanted(goal: Goal, volume: float) -> float:
    """mm^3 of width at which a removed volume is known well enough."""
    wide = goal.relative * volume
    return max(wide - goal.less, goal.weight * wide + goal.floor)


MANY = 256.0  # at first, cells as wide as the width asked for divided by this are as good as known
PROGRESS = 0.0625  # then, those of this share of the width of the cell whose part they are
POINT = 1e-7  # of a tile: a cell so small that it is a place
NEAR = 1e-9  # of a radius
IDS = 200  # of sweeps, all in all, by the cells that a block is divided into at most
FINE, FULL, LONG, AWAY = 0.0, 1.0, 2.0, 3.0
ZERO = np.int64(0)  # typed, see surface/_kernels.py


@kernel
def remove(
    shapes: Shapes, tiles: Tiles, roof: Roof, work: Work, k: int, rim: int, top: float, bottom: float, goal: Goal,
    slack: float, limit: int, keep: bool, out: NDArray[np.float64],
) -> None:  # fmt: skip
    """Bracket of what sweep k removes in our tiles, into out = (lo, hi, cells, most sweeps in a tile, state).

    goal: width at which it is done, see `wanted`.
    limit: cells, beside those of the first look, into which these are divided at most. keep: whether the tiles are to
    know the sweep afterwards.
    state FULL: the cells were used up before the width asked for was reached (the bracket holds); LONG: there is no room
    for a list of sweeps or for a cell, nothing was done.

    Every write has its guard in front of it. `bounds` fills rows up to count + 2 of lines, E, C and W, the last row of C,
    and at most `count` ids from where it is asked; P holds what three clips can make of four corners (see `clip`).
    """
    head, part, lift, ladder, rows = shapes.head, shapes.part, shapes.lift, shapes.ladder, shapes.rows
    rules = shapes.rules
    cell, span, heap, ids, met = work.cell, work.span, work.heap, work.ids, work.met
    lines, E, C, P, W = work.lines, work.E, work.C, work.P, work.W
    i0, i1, j0, j1 = tile_range(rows, k, head[int(rows[k, 8]), 1], tiles.grid, tiles.size)
    gx, gy, w, h = tiles.grid[0], tiles.grid[1], tiles.grid[2], tiles.grid[3]
    n, used, fresh, most = ZERO, ZERO, ZERO, ZERO
    out[4], lo, hi, least = FINE, 0.0, 0.0, 0.0
    for j in range(j0, j1):
        for i in range(i0, i1):
            t = j * tiles.size[0] + i
            if tiles.own[t] == 0:
                continue
            count, e = ZERO, tiles.first[t]
            while e >= 0:
                if count + 3 >= len(E) or used + 2 * count + 8 >= len(ids):
                    out[4] = LONG
                    return
                ids[used + count] = tiles.sweep[e]
                count += 1
                e = tiles.after[e]
            for q in range(count // 2):  # the newest first: most often one of them lies below k
                early, late = used + q, used + count - 1 - q
                ids[early], ids[late] = ids[late], ids[early]
            x, y = gx + (i + 0.5) * w, gy + (j + 0.5) * h
            src = used
            a, b, m = bounds(
                head, part, lift, ladder, rows, rules, roof, k, rim, top, bottom, x, y, 0.5 * w, 0.5 * h,
                ids, src, count, src + count, slack, min(wanted(goal, least) / MANY, 1e30), lines, E, C, P, W,
            )  # fmt: skip
            if b <= 0.0:
                continue
            least += a
            most = max(most, m)
            used += count + m
            lo, hi = lo + a, hi + b
            if b > a:  # what is known exactly stays out of the heap
                if n >= len(cell):
                    out[4] = LONG
                    return
                cell[n, 0], cell[n, 1], cell[n, 2], cell[n, 3] = x, y, 0.5 * w, 0.5 * h
                cell[n, 4], cell[n, 5] = a, b
                span[n, 0], span[n, 1] = src + count, m
                heap[n] = n
                n += 1
            if keep:
                if used + m + 1 >= len(ids) or fresh >= len(met):
                    out[4] = LONG
                    return
                left = ZERO
                for q in range(m - 1, -1, -1):
                    s = ids[src + count + q]
                    if rules & FORGET != 0 and hides(
                        head, part, lift, rows, lines, rules, SELF, FIRST + q, x, y, 0.5 * w, 0.5 * h, slack
                    ):
                        continue
                    known = rules & FORGET != 0 and E[SELF, UP + 7] == SMOOTH and E[SELF, UP] > bottom
                    if known and above(E, FIRST + q, DOWN, 0.5 * w, 0.5 * h, SELF, UP):
                        continue
                    ids[used + left] = s
                    left += 1
                ids[used + left] = k
                met[fresh, 0], met[fresh, 1], met[fresh, 2] = t, used, left + 1
                used += left + 1
                fresh += 1
            elif b == a:
                used = src  # nobody asks for its list again
    for c in range(n):
        sift_up(heap, cell, c, LOW)
    begun = n
    while n > 0 and hi - lo > wanted(goal, 0.5 * (lo + hi)):
        c = heap[0]
        x, y, hx, hy = cell[c, 0], cell[c, 1], 0.5 * cell[c, 2], 0.5 * cell[c, 3]
        src, count = span[c, 0], span[c, 1]
        if n + 4 > begun + limit or used + 4 * count > IDS * limit:
            out[4] = FULL
            break
        if n + 4 > len(cell) or used + 4 * count > len(ids):
            out[4] = LONG
            return
        enough = PROGRESS * width(cell, c, LOW)
        lo, hi = lo - cell[c, 4], hi - cell[c, 5]
        for q in range(4):
            cx, cy = x + (hx if q % 2 else -hx), y + (hy if q > 1 else -hy)
            a, b, m = bounds(
                head, part, lift, ladder, rows, rules, roof, k, rim, top, bottom, cx, cy, hx, hy,
                ids, src, count, used, slack, enough, lines, E, C, P, W,
            )  # fmt: skip
            new = c if q == 0 else n
            cell[new, 0], cell[new, 1], cell[new, 2], cell[new, 3] = cx, cy, hx, hy
            cell[new, 4], cell[new, 5] = a, b
            span[new, 0], span[new, 1] = used, m
            used += m
            lo, hi = lo + a, hi + b
            if q == 0:
                sift_down(heap, cell, n, LOW)
            elif b > a:  # what is known exactly stays out of the heap, and the next cell takes its place
                heap[n] = new
                n += 1
                sift_up(heap, cell, n - 1, LOW)
    out[0], out[1], out[2], out[3] = lo, hi, n, most
    if keep:
        for q in range(fresh):
            _replace(tiles, met[q, 0], ids, met[q, 1], met[q, 2])


@kernel
def remove_all(
    shapes: Shapes, tiles: Tiles, roof: Roof, work: Work, first: int, stop: int, rim: int, top: float, bottom: float,
    goal: Goal, divided: bool, slack: NDArray[np.float64], limit: int, keep: bool, out: NDArray[np.float64],
) -> int:  # fmt: skip
    """`remove` of sweeps `first` to `stop` - 1, one after the other, into rows of out; the first that is not done.

    divided: whether the goal is that of all parts together; state AWAY: no tile is ours. It stops before a sweep for which
    there are too few free entries, and at state LONG.
    """
    for k in range(first, stop):
        i0, i1, j0, j1 = tile_range(
            shapes.rows, k, shapes.head[int(shapes.rows[k, 8]), 1], tiles.grid, tiles.size
        )
        reached = max(i1 - i0, 0) * max(j1 - j0, 0)
        if tiles.free[1] < reached:
            out[k - first, 4] = FINE
            return k
        asked = goal
        if divided:
            mine = 0
            for j in range(j0, j1):
                for i in range(i0, i1):
                    mine += 1 if tiles.own[j * tiles.size[0] + i] != 0 else 0
            if mine == 0:
                out[k - first, 4] = AWAY
                continue
            asked = part_of(goal, mine / reached)
        remove(
            shapes, tiles, roof, work, k, rim, top, bottom, asked, slack[k - first], limit, keep, out[k - first],
        )  # fmt: skip
        if out[k - first, 4] == LONG:
            return k
    return stop


@kernel
def listed(tiles: Tiles, t: int) -> NDArray[np.int64]:
    """Sweeps that tile t keeps."""
    n, e = 0, tiles.first[t]
    while e >= 0:
        n += 1
        e = tiles.after[e]
    out = np.empty(n, dtype=np.int64)
    e = tiles.first[t]
    for i in range(n):
        out[i] = tiles.sweep[e]
        e = tiles.after[e]
    return out


@kernel
def assign(tiles: Tiles, t: int, ids: NDArray[np.int64]) -> None:
    """Give tile t a list; the caller has seen to free entries."""
    _replace(tiles, t, ids, ZERO, len(ids))


@kernel
def heights(
    shapes: Shapes, tiles: Tiles, lines: NDArray[np.float64], rim: int, bottom: float, top: float,
    places: NDArray[np.float64], height: NDArray[np.float64], owner: NDArray[np.int64],
) -> None:  # fmt: skip
    """Height of what is left at places (n, 2), and the row of the sweep that made it; -1: none, -2: outside of the rim.

    An arc is asked for the pose that is lowest there, a steep ramp for the lower of its ends. A place that lies within
    1e-9 of the square of a border is beyond the border of the stock, and inside that of a sweep.
    """
    head, part, ladder, rows = shapes.head, shapes.part, shapes.ladder, shapes.rows
    x, y, w, h = tiles.grid[0], tiles.grid[1], tiles.grid[2], tiles.grid[3]
    for p in range(len(places)):
        px, py = places[p, 0], places[p, 1]
        height[p], owner[p] = bottom, -2
        if rim >= 0 and distance(rows, rim, px, py) >= head[int(rows[rim, 7]), 1] * (1.0 - NEAR):
            continue
        i = min(max(int((px - x) / w), 0), tiles.size[0] - 1)
        j = min(max(int((py - y) / h), 0), tiles.size[1] - 1)
        e, low, who = tiles.first[j * tiles.size[0] + i], top, -1
        while e >= 0:
            k = tiles.sweep[e]
            e = tiles.after[e]
            if rows[k, 9] >= low:
                continue
            place(head, part, ladder, rows, k, px, py, POINT * w, POINT * w, lines, SELF)
            f = value(head, part, int(rows[k, 7]), lines, SELF, px, py)
            if f < low:
                low, who = f, k
        height[p], owner[p] = max(low, bottom), who


def work(cells: int = 120_000, most: int = 256) -> Work:
    """Room for so many cells in a block and sweeps in a tile."""
    return Work(
        np.zeros((cells, 6)),
        np.zeros((cells, 2), dtype=np.int64),
        np.zeros(cells, dtype=np.int64),
        np.zeros(25 * cells, dtype=np.int64),
        np.zeros((cells, 3), dtype=np.int64),
        np.zeros((most, COLUMNS)),
        np.zeros((most, 16)),
        np.zeros((most, 4)),
        np.zeros((5, 16, 2)),
        np.zeros((most, 16)),
    )
