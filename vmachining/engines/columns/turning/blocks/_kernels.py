# The heap of cells of one block: the widest is divided next.
#
# Legend: see ../_kernels.py and ../cells/_kernels.py.

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.engines.columns.heap._kernels import sift_down, sift_up
from vmachining.engines.columns.roof._kernels import Roof
from vmachining.engines.columns.turning._kernels import NOWHERE
from vmachining.engines.columns.turning.cells._kernels import Lists, bounds
from vmachining.engines.columns.turning.triangles._kernels import ZERO, Room
from vmachining.jit import kernel, leaf

LOW = np.int64(3)  # column of a cell's lower end; the upper one stands beside it


@leaf
def _store(cell, n, u, v, h, lo, hi, heights):
    cell[n, 0], cell[n, 1], cell[n, 2], cell[n, 3], cell[n, 4] = u, v, h, lo, hi
    cell[n, 5], cell[n, 6], cell[n, 7] = heights[0], heights[1], heights[2]


class Grown(NamedTuple):
    """Cells of one block along one direction so far: cell (n, 8) = u, v, h, lo, hi, t0, t1, raised; span (n, 2) where its list
    begins and its length; heap (n,) of those that may be divided, the widest first; ids (m,), rng (m, 10) of all lists; queue,
    keys, floors (count,): see `Lists`. at (3,): entries of lists, cells of the heap, cells looked at; sums (2,): lo, hi.
    """

    cell: NDArray[np.float64]
    span: NDArray[np.int64]
    heap: NDArray[np.int64]
    ids: NDArray[np.int64]
    rng: NDArray[np.float64]
    queue: NDArray[np.int64]
    keys: NDArray[np.float64]
    floors: NDArray[np.float64]
    at: NDArray[np.int64]
    sums: NDArray[np.float64]


def nothing_yet(limit: int, first: int, count: int) -> Grown:
    """Room for so many cells, `first` of them at the start, and sweeps; the first look at all of these always fits."""
    n = limit + first + 8
    m = n * min(count, 16) + (first + 5) * count
    return Grown(
        np.empty((n, 8)), np.empty((n, 2), dtype=np.int64), np.empty(n, dtype=np.int64), np.empty(m, dtype=np.int64),
        np.empty((m, 10)), np.empty(count, dtype=np.int64), np.empty(count), np.empty(count),
        np.zeros(3, dtype=np.int64), np.zeros(2),
    )  # fmt: skip


@kernel
def remove(
    rows: NDArray[np.float64], waves: NDArray[np.float64], reach: NDArray[np.float64], F: NDArray[np.float64], roof: Roof,
    starts: NDArray[np.int64], rules: int, room: Room, root: NDArray[np.float64], count: int, relative: float, floor: float,
    limit: int, slack: float, grown: Grown,
) -> None:  # fmt: skip
    """Continue until the bracket `grown.sums` of what the sweep of rows 0 and 1 removes is narrow, or `limit` cells are made.

    room.K: witnesses of these rows alone.
    root: (8,) u0, v0, half edge of first cells, number of them along u and v, heights of `bounds`. count: sweeps, k among them.
    """
    nu, nv, h = int(root[3]), int(root[4]), root[2]
    room.H[1, 0], room.H[1, 1], room.H[1, 2] = root[0], root[1], h
    cell, span, heap, ids, rng = grown.cell, grown.span, grown.heap, grown.ids, grown.rng
    lists = Lists(ids, rng, reach, np.zeros(2), grown.queue, grown.keys, grown.floors)
    used, n, made, lo, hi = grown.at[0], grown.at[1], grown.at[2], grown.sums[0], grown.sums[1]
    heights, inner = np.array([root[5], root[6], root[7]]), np.zeros(3)
    if made == 0:
        for q in range(count):
            ids[q] = q
            rng[q, :] = 0.0
            rng[q, 1], rng[q, 3], rng[q, 4], rng[q, 7] = 1.0, 1.0, NOWHERE, NOWHERE
        used += count
        for place in range(nu * nv):
            u, v = root[0] + (2 * (place % nu) + 1) * h, root[1] + (2 * (place // nu) + 1) * h
            x, y, m = bounds(
                rows, waves, lists, F, roof, starts, rules, room, u, v, h, heights, ZERO, count, used, slack, inner
            )  # fmt: skip
            made += 1
            lo, hi = lo + x, hi + y
            if y > x:
                _store(cell, n, u, v, h, x, y, inner)
                span[n, 0], span[n, 1] = used, m
                used += m
                heap[n] = n
                n += 1
                sift_up(heap, cell, n - 1, LOW)
    while n > 0 and hi - lo > max(relative * 0.5 * (lo + hi), floor) and made < limit:
        c = heap[0]
        src, size = span[c, 0], span[c, 1]
        if (
            not cell[c, 4] > cell[c, 3]
        ):  # all are settled: what is left of hi - lo is rounding, and their lists are empty
            break
        if used + 4 * size > len(ids) or n + 4 > len(cell):
            break
        u, v, h = cell[c, 0], cell[c, 1], 0.5 * cell[c, 2]
        lists.at[0], lists.at[1] = u, v
        heights[0], heights[1], heights[2] = cell[c, 5], cell[c, 6], cell[c, 7]
        lo, hi = lo - cell[c, 3], hi - cell[c, 4]
        for q in range(4):
            cu, cv = u + (h if q % 2 else -h), v + (h if q > 1 else -h)
            x, y, m = bounds(
                rows, waves, lists, F, roof, starts, rules, room, cu, cv, h, heights, src, size, used, slack, inner
            )  # fmt: skip
            made += 1
            lo, hi = lo + x, hi + y
            new = c if q == 0 else n
            _store(cell, new, cu, cv, h, x, y, inner)
            span[new, 0], span[new, 1] = used, m
            used += m
            if q == 0:
                sift_down(heap, cell, n, LOW)
            elif y > x:
                heap[n] = new
                n += 1
                sift_up(heap, cell, n - 1, LOW)
    grown.at[0], grown.at[1], grown.at[2], grown.sums[0], grown.sums[1] = used, n, made, lo, hi
