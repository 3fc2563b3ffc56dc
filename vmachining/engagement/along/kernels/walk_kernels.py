# Contact along the motions of one tool: every station in the workpiece before it, then the sweep of the motion.
#
# Legend: cut (n, 3): first and last + 1 row of a motion in the sweeps, 1 if what it has swept may cover the front of the tool.
#   station (m, 4): motion, fraction of it, share of it that lies less than 0.02 mm back, 1 for the last of it; extra (m,): row
#   of the World with what the motion has swept so far, or -1. nows (m, 22), tips (m, 3) mm where the motion is then (the
#   stations themselves may stand a little before). result (m, COLUMNS). Kept, per station: first and last + 1 row of angles; rows
#   phi, first and last + 1 part; part rows piece, s0, s1.

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.engagement.along.kernels.distance_kernels import CIRCLE, EXACT, HELIX, POSES
from vmachining.engagement.along.kernels.edge_kernels import Scene
from vmachining.engagement.along.kernels.tile_kernels import enter, gather
from vmachining.engagement.along.kernels.turn_kernels import ROOM, scene_convex, turn_at
from vmachining.jit import kernel, leaf

SAME_MM2 = 1e-14  # two tips are one


class Kept(NamedTuple):
    """What stations saw, see the legend. used (2,): rows of angles and of parts. station (m, 3): first, last + 1, ring."""

    station: NDArray[np.int64]
    angle: NDArray[np.float64]
    span: NDArray[np.int64]
    part: NDArray[np.float64]
    used: NDArray[np.int64]


@leaf
def shorten(rows, k, spare, share):
    """Row `spare` becomes the first `share` of curved sweep k."""
    for c in range(rows.num.shape[1]):
        rows.num[spare, c] = rows.num[k, c]
    for c in range(6):
        rows.box[spare, c] = rows.box[k, c]
    rows.kind[spare], rows.tool[spare], rows.exact[spare] = rows.kind[k], rows.tool[k], -1
    q = rows.num[spare]
    if rows.kind[k] == POSES:
        square = share * share
        for c in range(3):
            q[3 + c] *= share
            q[6 + c] *= square
            q[9 + c] *= square * share
            q[23 + c] *= share
            q[27 + c] *= square
            q[30 + c] *= square * share
        q[19] *= square
        q[34] *= share
        return
    q[10] *= share
    q[5] *= share
    half = 0.5 * abs(q[10])
    middle, end = q[9] + 0.5 * q[10], q[9] + q[10]
    q[11], q[12] = np.cos(middle), np.sin(middle)
    q[13] = np.cos(half) if half < np.pi else -1.1
    q[14], q[15] = q[6] + q[8] * np.cos(end), q[7] + q[8] * np.sin(end)
    q[26] = q[2] + q[5]
    q[27], q[28] = min(q[2], q[26]), max(q[2], q[26])


@leaf
def own_sweeps(scene, cut, station, extra, s, near, n, spare):
    """Adds what the motion has swept so far; how many sweeps there are, and the next spare row."""
    rows = scene.rows
    if extra[s] >= 0:
        rows.kind[spare], rows.tool[spare], rows.exact[spare] = EXACT, -1, extra[s]
        for c in range(6):
            rows.box[spare, c] = scene.world.box[extra[s], c]
        near[n] = spare
        return n + 1
    c = int(station[s, 0])
    first, last = cut[c, 0], cut[c, 1]
    done = station[s, 1] - station[s, 2]
    for k in range(first, last):
        share = done * (last - first) - (k - first)
        if share <= 1e-6 or (rows.kind[k] != POSES and rows.kind[k] != CIRCLE and rows.kind[k] != HELIX):
            break
        if share < 1.0:
            shorten(rows, k, spare, share)
            near[n] = spare
            return n + 1
        near[n] = k
        n += 1
    return n


@leaf
def at_tip(q, x, y, z):
    """1 where a sweep ends at a tip, 2 where it begins there, else 0."""
    if (q[14] - x) ** 2 + (q[15] - y) ** 2 + (q[26] - z) ** 2 < SAME_MM2:
        return 1
    if (q[0] - x) ** 2 + (q[1] - y) ** 2 + (q[2] - z) ** 2 < SAME_MM2:
        return 2
    return 0


@leaf
def keep_turn(scene, turn, kept, s, n, ring):
    """Store the angles of a station and their parts."""
    a, p = kept.used[0], kept.used[1]
    kept.station[s, 0] = a
    for at in range(n):
        i = turn.order[at]
        kept.angle[a] = turn.phi[i]
        kept.span[a, 0] = p
        for k in range(turn.found[i]):
            for c in range(3):
                kept.part[p, c] = turn.part[i, k, c]
            p += 1
        kept.span[a, 1] = p
        a += 1
    kept.station[s, 1], kept.station[s, 2] = a, ring
    kept.used[0], kept.used[1] = a, p


@kernel
def replay(tiles, rows, which, first, tile_row) -> int:
    """Enters sweeps from place `first` of a list on; the first that found no room."""
    for i in range(first, len(which)):
        if not enter(tiles, rows, which[i], tile_row):
            return i
    return len(which)


@kernel
def walk(
    scene: Scene,
    turn,
    tiles,
    first,
    cut,
    station,
    extra,
    nows,
    tips,
    box,
    tool,
    radius,
    spare,
    mark,
    kept,
    tile_row,
    result,
):
    """Stations from `first` on; the first station that was not done, because a table has no room.

    box (m, 6): of the tool at every station. spare: first free row of the sweeps, of two at least. mark (2,): of stamps; the
    next sweep that enters the tiles.
    """
    near, work = scene.work.near, scene.work
    convex = scene_convex(scene)
    for s in range(first, len(station)):
        c = int(station[s, 0])
        while mark[1] < cut[c, 0]:
            if not enter(tiles, scene.rows, mark[1], tile_row):
                return s
            mark[1] += 1
        if len(kept.station) and (
            kept.used[0] + ROOM > len(kept.angle) or kept.used[1] + turn.part.size // 3 > len(kept.part)
        ):
            return s
        now = nows[s]
        upright = now[5] == 1.0 and now[21] == 0.0
        half_turn = upright and convex and now[8] >= 0.0 and now[6] ** 2 + now[7] ** 2 > 1e-18 * now[8] ** 2
        mark[0] += 1
        for v in range(len(result[s])):
            result[s, v] = 0.0
        if now[6] ** 2 + now[7] ** 2 <= 1e-18 * now[8] ** 2 and upright:
            result[s, 2] = np.nan
        n, top = gather(tiles, scene.rows, now, radius, half_turn, box[s], mark[0], near)
        if n < 0 or n + (cut[c, 1] - cut[c, 0]) + 2 > len(near):
            return s
        height = top - now[2] if upright else now[20]
        if height <= 0.0:
            continue
        gone = False
        x, y, z = tips[s, 0], tips[s, 1], tips[s, 2]
        for i in range(n):
            k = near[i]
            work.mode[i] = 0
            if scene.rows.tool[k] == tool and upright:
                mode = at_tip(scene.rows.num[k], x, y, z)
                if mode > 0:
                    if station[s, 3] > 0.0:
                        gone = True  # nothing of the tool at the end of the motion is material
                    elif scene.rows.kind[k] < EXACT:
                        work.mode[i] = mode
            work.slot[k] = i
        if gone:
            continue
        work.clock[1], work.clock[2] = n, mark[0]
        if cut[c, 2] > 0:
            before = n
            n = own_sweeps(scene, cut, station, extra, s, near, n, spare)
            for i in range(before, n):
                work.mode[i] = 0
        angles, ring = turn_at(scene, turn, now, n, height, result[s])
        for i in range(angles):
            if turn.found[i] == len(work.part):
                return s
        if len(kept.station) and result[s, 4] > 0.0:
            keep_turn(scene, turn, kept, s, angles, 1 if ring else 0)
    return len(station)
