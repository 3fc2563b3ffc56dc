# Cubes of a stock: sweeps that hold them, and sweeps that may meet the others (L9).
#
# Legend: see ../_kernels.py; the frame is that of the stock. grid (x, y, z): LEFT; OUT, above the stock; else 1 more than the
# number of a sweep that holds the cube. head (x, y, z): 1 more than the first of nodes (n, 2) = number of a sweep that may meet
# the cube, next; at (2,): the first node that is free, as in head, and all that were ever used. low (3,), edge: of grid, mm.

import numpy as np
from numpy.typing import NDArray

from vmachining.engines.columns.turning._kernels import ACC, OMEGA, TOPR, TOPZ, depth, state, support
from vmachining.jit import kernel, leaf

LEFT, OUT, MET = 0, -1, -2
CLOSE = 0.75  # edges between two poses that are looked at
MOST = 400.0  # of them
SAFE = 1e-6  # of an edge: rounding of depths, and of facets
STEEP = 1e-3  # of a normal: planes of steeper facets are not asked


@leaf
def _stops(rows, i, P, edge):
    """Number of steps of time between poses that are looked at."""
    way = np.sqrt(P[6] ** 2 + P[7] ** 2 + P[8] ** 2) + rows[i, ACC]
    return int(min(way / (CLOSE * edge) + rows[i, OMEGA] * abs(rows[i, TOPZ]) / edge, MOST)) + 1


@leaf
def _span(rows, i, P, axis, low, edge, size, more):
    """(first, last + 1) cubes along an axis that a pose, grown by so many mm, may meet."""
    c = P[3 + axis]
    a, b = support(rows, i, -c)
    d, e = support(rows, i, c)
    first = (P[axis] - max(a, b) - more - low) / edge
    last = (P[axis] + max(d, e) + more - low) / edge
    return int(min(max(np.floor(first), 0.0), size)), int(min(max(np.ceil(last), 0.0), size))


@kernel
def carve(
    rows: NDArray[np.float64], waves: NDArray[np.float64], i: int, number: int, grid: NDArray[np.int32], head: NDArray[np.int32],
    nodes: NDArray[np.int32], at: NDArray[np.int64], low: NDArray[np.float64], edge: float,
) -> None:  # fmt: skip
    """A sweep holds the cubes whose ball lies in one of its poses: it is convex, and depths are least depths. Of several the last
    number counts: a cutter that goes deeper holds what is above, in whatever order they come. Nodes become free."""
    P, half = np.empty(12), (0.5 * np.sqrt(3.0) + SAFE) * edge
    state(rows, waves, i, 0.0, P)
    stops = _stops(rows, i, P, edge)
    for n in range(stops + 1):
        state(rows, waves, i, n / stops, P)
        x0, x1 = _span(rows, i, P, 0, low[0], edge, grid.shape[0], 0.0)
        y0, y1 = _span(rows, i, P, 1, low[1], edge, grid.shape[1], 0.0)
        z0, z1 = _span(rows, i, P, 2, low[2], edge, grid.shape[2], 0.0)
        for x in range(x0, x1):
            u = low[0] + (x + 0.5) * edge
            for y in range(y0, y1):
                v = low[1] + (y + 0.5) * edge
                for z in range(z0, z1):
                    if grid[x, y, z] == OUT or grid[x, y, z] > number:
                        continue
                    if depth(rows, i, P, u, v, low[2] + (z + 0.5) * edge) < half:
                        continue
                    grid[x, y, z] = number + 1
                    node = np.int64(head[x, y, z])
                    head[x, y, z] = 0
                    while node > 0:
                        after = np.int64(nodes[node - 1, 1])
                        nodes[node - 1, 1] = at[0]
                        at[0], node = node, after


@kernel
def met(
    rows: NDArray[np.float64], waves: NDArray[np.float64], i: int, grid: NDArray[np.int32], low: NDArray[np.float64],
    edge: float, out: NDArray[np.int64],
) -> int:  # fmt: skip
    """Number of the cubes left that the sweep may meet; as many as there is room for into out (n, 3).

    A point of a pose was, half a step away, at most d + rate (its distance from the tip) aside of where it is; minus a depth is
    at most a distance.
    """
    P, half, count = np.empty(12), (0.5 * np.sqrt(3.0) + SAFE) * edge, 0
    state(rows, waves, i, 0.0, P)
    stops = _stops(rows, i, P, edge)
    step = 0.5 / stops
    for n in range(stops + 1):
        state(rows, waves, i, n / stops, P)
        d = np.sqrt(P[6] ** 2 + P[7] ** 2 + P[8] ** 2) * step + 0.5 * rows[i, ACC] * step * step
        turn = rows[i, OMEGA] * step
        more = half + d + turn * (abs(rows[i, TOPZ]) + rows[i, TOPR])
        x0, x1 = _span(rows, i, P, 0, low[0], edge, grid.shape[0], more)
        y0, y1 = _span(rows, i, P, 1, low[1], edge, grid.shape[1], more)
        z0, z1 = _span(rows, i, P, 2, low[2], edge, grid.shape[2], more)
        for x in range(x0, x1):
            u = low[0] + (x + 0.5) * edge
            for y in range(y0, y1):
                v = low[1] + (y + 0.5) * edge
                for z in range(z0, z1):
                    if grid[x, y, z] != LEFT:
                        continue
                    t = low[2] + (z + 0.5) * edge
                    away = np.sqrt((u - P[0]) ** 2 + (v - P[1]) ** 2 + (t - P[2]) ** 2)
                    if depth(rows, i, P, u, v, t) >= -(half + d + turn * (away + half + d)):
                        grid[x, y, z] = MET
                        if count < len(out):
                            out[count, 0], out[count, 1], out[count, 2] = x, y, z
                        count += 1
    if count <= len(out):
        for k in range(count):
            grid[out[k, 0], out[k, 1], out[k, 2]] = LEFT
    else:
        for x in range(grid.shape[0]):
            for y in range(grid.shape[1]):
                for z in range(grid.shape[2]):
                    if grid[x, y, z] == MET:
                        grid[x, y, z] = LEFT
    return count


@kernel
def enlist(
    cubes: NDArray[np.int64],
    number: int,
    head: NDArray[np.int32],
    nodes: NDArray[np.int32],
    at: NDArray[np.int64],
) -> None:
    """A sweep may meet these cubes (n, 3); there is room for as many nodes."""
    for k in range(len(cubes)):
        x, y, z = cubes[k, 0], cubes[k, 1], cubes[k, 2]
        first = np.int64(head[x, y, z])
        if first > 0 and nodes[first - 1, 0] == number:  # another part of it did
            continue
        node = at[0]
        if node > 0:
            at[0] = nodes[node - 1, 1]
        else:
            at[1] += 1
            node = at[1]
        nodes[node - 1, 0], nodes[node - 1, 1], head[x, y, z] = number, first, node


@kernel
def who(
    cubes: NDArray[np.int64], first: NDArray[np.int64], last: NDArray[np.int64], grid: NDArray[np.int32],
    head: NDArray[np.int32], nodes: NDArray[np.int32], out: NDArray[np.uint8],
) -> None:  # fmt: skip
    """out[number] 1 for sweeps that may meet one of the cubes left, 2 for those that hold one of the cubes first to last."""
    for k in range(len(cubes)):
        node = np.int64(head[cubes[k, 0], cubes[k, 1], cubes[k, 2]])
        while node > 0:
            out[nodes[node - 1, 0]] = 1
            node = np.int64(nodes[node - 1, 1])
    for x in range(first[0], last[0]):
        for y in range(first[1], last[1]):
            for z in range(first[2], last[2]):
                if grid[x, y, z] > 0:
                    out[grid[x, y, z] - 1] = 2


@kernel
def above(top: NDArray[np.float64], grid: NDArray[np.int32], low: NDArray[np.float64], edge: float) -> None:
    """Mark the cubes above all facets (n, 3, 3) that a height field's top has over their square, or near it."""
    highest = np.full(grid.shape[:2], -np.inf)
    for f in range(len(top)):
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = top[f]
        nx = (by - ay) * (cz - az) - (bz - az) * (cy - ay)
        ny = (bz - az) * (cx - ax) - (bx - ax) * (cz - az)
        nz = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        most, flat = max(az, bz, cz), nz > STEEP * (abs(nx) + abs(ny))
        x0 = int(min(max((min(ax, bx, cx) - low[0]) / edge - 1.0, 0.0), grid.shape[0]))
        x1 = int(min(max((max(ax, bx, cx) - low[0]) / edge + 2.0, 0.0), grid.shape[0]))
        y0 = int(min(max((min(ay, by, cy) - low[1]) / edge - 1.0, 0.0), grid.shape[1]))
        y1 = int(min(max((max(ay, by, cy) - low[1]) / edge + 2.0, 0.0), grid.shape[1]))
        for x in range(x0, x1):
            for y in range(y0, y1):
                z = most
                if flat:  # its plane over the square
                    u, v = low[0] + (x + 0.5) * edge - ax, low[1] + (y + 0.5) * edge - ay
                    z = min(z, az - (nx * u + ny * v - 0.5 * edge * (abs(nx) + abs(ny))) / nz)
                highest[x, y] = max(highest[x, y], z)
    for x in range(grid.shape[0]):
        for y in range(grid.shape[1]):
            for z in range(grid.shape[2]):
                if low[2] + z * edge > highest[x, y] + SAFE * edge:
                    grid[x, y, z] = OUT
