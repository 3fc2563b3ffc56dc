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

from vmachining.engagement.along.kernels.distance_kernels import CIRCLE, EXACT, HELIX, POSES, touch
from vmachining.engagement.along.kernels.margin_kernels import list_triangles
from vmachining.engagement.along.kernels.point_kernels import TAU, Scene
from vmachining.engagement.along.kernels.tile_kernels import enter, gather
from vmachining.engagement.along.kernels.turn_kernels import ROOM, scene_convex, turn_at
from vmachining.jit import kernel, leaf

SAME_MM2 = 1e-14  # two tips are one


class Stops(NamedTuple):
    """Motions and stations, see the legend. box (m, 6): of the tool at every station."""

    cut: NDArray[np.int64]
    station: NDArray[np.float64]
    extra: NDArray[np.int64]
    now: NDArray[np.float64]
    tip: NDArray[np.float64]
    box: NDArray[np.float64]
    result: NDArray[np.float64]


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
            q[14 + c if c < 2 else 26] = q[c] + q[3 + c] + q[6 + c] + q[9 + c]
            q[35 + c] = q[c] + 0.5 * (q[3 + c] + 0.5 * (q[6 + c] + 0.5 * q[9 + c]))
            q[38 + c] = q[20 + c] + 0.5 * (q[23 + c] + 0.5 * (q[27 + c] + 0.5 * q[30 + c]))
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
def at_tip(q, kind, tip, now):
    """1 where a sweep ends at a tip and with the axis there, 2 where it begins so, else 0."""
    end = (q[14] - tip[0]) ** 2 + (q[15] - tip[1]) ** 2 + (q[26] - tip[2]) ** 2
    begin = (q[0] - tip[0]) ** 2 + (q[1] - tip[1]) ** 2 + (q[2] - tip[2]) ** 2
    for c in range(3):
        first = last = 0.0 if c < 2 else 1.0
        if kind == POSES:
            first, last = q[20 + c], q[20 + c] + q[23 + c] + q[27 + c] + q[30 + c]
        end += (last - now[3 + c]) ** 2
        begin += (first - now[3 + c]) ** 2
    return 1 if end < SAME_MM2 else 2 if begin < SAME_MM2 else 0


@leaf
def flush(q, kind, tip, height):
    """Whether a tool may stand along what a sweep left: where it ends or begins, or below that if its wall cuts."""
    if kind == EXACT:
        return True
    begin, end = (q[0] - tip[0]) ** 2 + (q[1] - tip[1]) ** 2, (q[14] - tip[0]) ** 2 + (q[15] - tip[1]) ** 2
    if height <= q[17]:
        begin, end = begin + (q[2] - tip[2]) ** 2, end + (q[26] - tip[2]) ** 2
    return min(begin, end) < SAME_MM2


@leaf
def has_disc(scene):
    """Whether the edge has a level line: a floor may lie all along it."""
    for piece in range(len(scene.blade.rows)):
        if scene.blade.rows[piece, 6] == 0.0 and scene.blade.rows[piece, 1] == scene.blade.rows[piece, 3]:
            return True
    return False


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
def walk(scene: Scene, turn, past, stops, kept, first, tool, radius, mark, tile_row):
    """Stations from `first` on; the first station that was not done, because a table has no room.

    The last row of the sweeps is a spare one. tool, radius : of all of them. mark (2,): of stamps; the next sweep that enters the
    tiles. past: see turn_kernels.py. tile_row (8,) : work space.
    """
    cut, station, extra, nows, tips, box, result = stops
    tiles, spare = scene.tiles, len(scene.rows.kind) - 1
    near, work = scene.work.near, scene.work
    convex = scene_convex(scene)
    past.known[0], disc = 0, has_disc(scene)
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
        result[s, :] = 0.0
        if now[6] ** 2 + now[7] ** 2 <= 1e-18 * now[8] ** 2 and upright:
            result[s, 2] = np.nan
        n, top = gather(tiles, scene.rows, now, radius, half_turn, box[s], mark[0], near)
        if n < 0 or n + (cut[c, 1] - cut[c, 0]) + 2 > len(near):
            return s
        height = top - now[2] if upright else now[20]
        if height <= 0.0:
            continue
        closed, gone, tol, last = True, False, TAU, cut[c, 0] - 1  # row that the motion before ends with
        ends, follows = False, not len(kept.station) and station[s, 1] == 0.0 and past.known[2] == c - 1
        follows &= not disc or now[3] * now[6] + now[4] * now[7] + now[5] * now[8] >= 0.0
        for i in range(n):
            k = near[i]
            work.mode[i] = 0
            tol = max(tol, TAU + touch(scene.rows, scene.world, k))
            closed &= scene.rows.kind[k] < EXACT
            follows &= k == last or not flush(scene.rows.num[k], scene.rows.kind[k], tips[s], height)
            if scene.rows.tool[k] == tool and scene.rows.kind[k] != EXACT:
                mode = at_tip(scene.rows.num[k], scene.rows.kind[k], tips[s], now)
                if mode > 0:
                    if station[s, 3] > 0.0:
                        gone = True  # nothing of the tool at the end of the motion is material
                    else:
                        work.mode[i] = mode
                    if k == last:
                        ends = mode == 1
            work.slot[k] = i
        if gone:
            continue
        work.clock[1], work.clock[2] = n, mark[0]
        if cut[c, 2] > 0:
            before = n
            n = own_sweeps(scene, cut, station, extra, s, near, n, spare)
            for i in range(before, n):  # poses end where the tool stands, curves of an upright one do not
                work.mode[i] = 1 if i == n - 1 and scene.rows.kind[near[i]] == POSES else 0
                closed &= scene.rows.kind[near[i]] < EXACT
        work.clock[3] = 1 if closed else 0
        if scene.world.kind == 2:
            list_triangles(scene.world, box[s], scene.room)
        if not (follows and ends):
            past.known[0] = 0
        angles, ring = turn_at(scene, turn, past, now, n, height, tol, result[s])
        for i in range(angles):
            if turn.found[i] == len(work.part):
                return s
        if len(kept.station) and result[s, 4] > 0.0:
            keep_turn(scene, turn, kept, s, angles, 1 if ring else 0)
        if station[s, 3] > 0.0:
            turn.known[0], turn.known[1], turn.known[2] = angles, 1 if ring else 0, c
            turn, past = past, turn
    return len(station)
