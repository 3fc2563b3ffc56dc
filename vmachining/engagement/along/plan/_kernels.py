# The plan: square cells of the xy plane, each with a list of the sweeps whose box meets it.

import numpy as np

from vmachining.jit import kernel


@kernel
def enter(head, nodes, used, origin, cell, box, ends, radius, k) -> int:
    """Put sweep k into every cell of the plan that its box meets; nodes rows: sweep, next. -1: no room.

    ends (4,): x, y of a straight path, whose cells are tested by their distance to it; NaN for others.
    """
    nx, ny = head.shape
    i0 = min(max(int(np.floor((box[0] - origin[0]) / cell)), 0), nx)
    i1 = max(min(int(np.floor((box[3] - origin[0]) / cell)), nx - 1), -1)
    j0 = min(max(int(np.floor((box[1] - origin[1]) / cell)), 0), ny)
    j1 = max(min(int(np.floor((box[4] - origin[1]) / cell)), ny - 1), -1)
    straight = not np.isnan(ends[0])
    dx, dy = ends[2] - ends[0], ends[3] - ends[1]
    size = dx * dx + dy * dy
    for i in range(i0, i1 + 1):
        for j in range(j0, j1 + 1):
            if straight:
                x, y = origin[0] + (i + 0.5) * cell - ends[0], origin[1] + (j + 0.5) * cell - ends[1]
                t = 0.0
                if size > 0.0:
                    t = min(max((x * dx + y * dy) / size, 0.0), 1.0)
                if np.sqrt((x - t * dx) ** 2 + (y - t * dy) ** 2) > radius + 0.70711 * cell:
                    continue
            if used >= len(nodes):
                return -1
            nodes[used, 0], nodes[used, 1] = k, head[i, j]
            head[i, j] = used
            used += 1
    return used


@kernel
def gather(head, nodes, origin, cell, box, region, stamp, mark, out) -> int:
    """Sweeps whose box meets a region (6,), into `out`; how many. stamp (n,) remembers who was seen."""
    nx, ny = head.shape
    i0 = min(max(int(np.floor((region[0] - origin[0]) / cell)), 0), nx)
    i1 = max(min(int(np.floor((region[3] - origin[0]) / cell)), nx - 1), -1)
    j0 = min(max(int(np.floor((region[1] - origin[1]) / cell)), 0), ny)
    j1 = max(min(int(np.floor((region[4] - origin[1]) / cell)), ny - 1), -1)
    n = 0
    for i in range(i0, i1 + 1):
        for j in range(j0, j1 + 1):
            at = head[i, j]
            while at >= 0:
                k = nodes[at, 0]
                at = nodes[at, 1]
                if stamp[k] == mark:
                    continue
                stamp[k] = mark
                b = box[k]
                if (
                    b[0] <= region[3] and b[3] >= region[0] and b[1] <= region[4] and b[4] >= region[1]
                    and b[2] <= region[5] and b[5] >= region[2]
                ):  # fmt: skip
                    out[n] = k
                    n += 1
    return n
