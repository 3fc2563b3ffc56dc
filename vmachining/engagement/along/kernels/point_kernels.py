# How deep a point of an edge lies in what may cut: its margin against stock and sweeps.
#
# Legend: blade, now as in margin_kernels.py. Margin m of a point, mm: the least of its depth in the stock and of its signed
#   distances to the sweeps; a point that faces, N.V > 0, cuts where m > -TAU. Every distance changes by at most 1 mm per mm, so
#   zeros are interpolated between nodes. near, mode (count,): sweeps that may matter here; mode 1: the sweep ends at the tip,
#   2: it begins there. Such a sweep touches the tool all over; r N.V of its end, or -r N.V of its beginning, has its sign,
#   and on a corner of r changes as slowly.

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.engagement.along.kernels.distance_kernels import (
    CIRCLE,
    EXACT,
    POSES,
    Rows,
    among_poses,
    exact,
    gap,
)
from vmachining.engagement.along.kernels.margin_kernels import (
    FAR,
    Blade,
    Room,
    World,
    box_gap,
    edge_point,
    mesh_depth,
)
from vmachining.engagement.along.kernels.tile_kernels import Tiles
from vmachining.jit import inner, leaf

TAU = 1e-9  # mm: a sweep that covers a point by less than this touches it
NODES = 96  # of a piece, at most
FLAT = 1e-3  # mm: sweeps that are farther than the bracket of an end by this do not end it
DEEP = 5.0  # mm: margins are known up to this


class Work(NamedTuple):
    """Space of the kernels.

    x .. m : (NODES,), n_r, n_z normals of the meridian there; who : of the sweep that is nearest to a node, as place in `keep`,
    one more for the stock. gaps (sweeps + 1, NODES) : distances of nodes, by place in `keep`, and to the stock. near, mode : see
    the legend. keep : of a piece, as places in `near`; low : (sweeps + 1,) see `margin_on`; few : of those what may end it in a
    bracket. part : (n, 3) piece, s0, s1; a full one may have left parts out, and is made larger. slot, seen : (sweeps,) place in
    `near`, and the stretch that saw a sweep last. clock : (4,) stretches so far, places in `near` that tiles know, stamp of the
    station, 1 if all of `near` have closed forms. tile : those under a stretch.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    z: NDArray[np.float64]
    s: NDArray[np.float64]
    m: NDArray[np.float64]
    who: NDArray[np.float64]
    n_r: NDArray[np.float64]
    n_z: NDArray[np.float64]
    gaps: NDArray[np.float64]
    keep: NDArray[np.int64]
    low: NDArray[np.float64]
    few: NDArray[np.int64]
    near: NDArray[np.int64]
    mode: NDArray[np.int64]
    part: NDArray[np.float64]
    slot: NDArray[np.int64]
    seen: NDArray[np.int64]
    clock: NDArray[np.int64]
    tile: NDArray[np.int64]


class Scene(NamedTuple):
    """Sweeps, their tiles, stock and edge of one station."""

    rows: Rows
    tiles: Tiles
    world: World
    blade: Blade
    work: Work
    room: Room


@leaf
def sided(q, mode, n_x, n_y, n_z):
    """Sign of the distance to a sweep that ends or begins at the tip, in mm that change by 1 per mm of the edge at most."""
    size = q[17] if q[17] > 0.0 else q[16]
    if mode == 1:
        return size * (n_x * q[23] + n_y * q[24] + n_z * q[25])
    return -size * (n_x * q[20] + n_y * q[21] + n_z * q[22])


@leaf
def around(kind, d, side):
    """Distance to a sweep at the tip: the sign of its end, unless the rest of a curved one comes back to the point."""
    return side if kind < CIRCLE or d > -1e-6 else min(side, d)


@leaf
def depth(kind, q, x, y, z):
    """How deep a point lies in a box or an upright cylinder, mm; negative outside."""
    if kind == 0:
        a, b = max(q[0] - x, x - q[3]), max(q[1] - y, y - q[4])
        c = max(q[2] - z, z - q[5])
        side = np.sqrt(max(a, 0.0) ** 2 + max(b, 0.0) ** 2)
        a = max(a, b)
    else:
        a, c = np.sqrt((x - q[0]) ** 2 + (y - q[1]) ** 2) - q[2], max(q[3] - z, z - q[4])
        side = max(a, 0.0)
    c0 = max(c, 0.0)
    return -np.sqrt(side * side + c0 * c0) - min(max(a, c), 0.0)


@inner
def place(scene, now, piece, s, way):
    """A point of the edge at a `turned` angle and its normal, (x, y, z, N)."""
    r, h, n_r, n_z = edge_point(scene.blade, piece, s)
    return (
        now[0] + h * now[3] + r * way[0], now[1] + h * now[4] + r * way[1], now[2] + h * now[5] + r * way[2],
        n_r * way[0] + n_z * now[3], n_r * way[1] + n_z * now[4], n_r * way[2] + n_z * now[5],
    )  # fmt: skip


@leaf
def beside(q, mode, at):
    """Signed distance to poses that end or begin at the tip, of a `place` of the tool: near its surface only the sign counts.

    It moves into what lies before it there, or leaves it, at N.V; where that is faster than slopes can fall, no other pose covers
    it. N is that of the piece: on an edge between two pieces the distance has two slopes.
    """
    if q[34] <= 0.0:  # at rest, it covers nothing
        return DEEP
    t = 1.0 if mode == 1 else 0.0
    w = wa = na = nv = nb = 0.0
    for c in range(3):
        a = q[20 + c] + t * (q[23 + c] + q[27 + c] + q[30 + c])
        b = q[23 + c] + t * (2.0 * q[27 + c] + 3.0 * q[30 + c])
        v = q[3 + c] + t * (2.0 * q[6 + c] + 3.0 * q[9 + c])
        p = at[c] - q[c] - t * (q[3 + c] + q[6 + c] + q[9 + c])
        w, wa, na, nv, nb = w + p * a, wa + p * b, na + at[3 + c] * a, nv + at[3 + c] * v, nb + at[3 + c] * b
    rate = nv + w * nb - wa * na
    if mode != 1:
        rate = -rate
    side = rate * (q[17] if q[17] > 0.0 else q[18]) / (2.0 * q[34])
    if abs(rate) < 4.0 * q[19]:
        d = among_poses(q, 1.0, at[0], at[1], at[2]) + q[33]
        return min(side, d) if d < -1e-6 else side
    return side


@inner
def gap_of(scene, c, at, near, most):
    """Signed distance of a `place` to the sweep in `near` at c, or a number up to it: one that is above `near`, or `most`."""
    rows, x, y, z = scene.rows, at[0], at[1], at[2]
    k, mode = scene.work.near[c], scene.work.mode[c]
    kind = rows.kind[k]
    if mode != 0:
        if kind == POSES:
            return beside(rows.num[k], mode, at)
        side = sided(rows.num[k], mode, at[3], at[4], at[5])
        return around(kind, 0.0 if kind < CIRCLE else gap(rows.num, kind, k, x, y, z, FAR), side)
    if kind != EXACT:
        return gap(rows.num, kind, k, x, y, z, most)
    d = box_gap(rows.box[k], x, y, z)
    return d if d > near else exact(rows, scene.world, k, x, y, z, most, scene.room)


@inner
def margin_at(scene, now, count, most, piece, s, way):
    """m of one point of the edge against the first `count` sweeps of `few`, at most `most`; (m, sweeps nearer than that).

    These are the first of `few` afterwards: no other one comes to the surface within `most`.
    """
    world, work = scene.world, scene.work
    at = place(scene, now, piece, s, way)
    m, n = most, 0
    for i in range(count):
        c = work.few[i]
        d = gap_of(scene, c, at, most, most)
        if d < most or work.mode[c] != 0:
            work.few[n] = c
            n += 1
        m = min(m, d)
    if world.kind != 2:
        return min(m, depth(world.kind, world.stock, at[0], at[1], at[2])), n
    if m > -TAU and scene.room.last[1] > 0:
        m = mesh_depth(world, at[0], at[1], at[2], m, scene.room.free[4], scene.room)
    return m, n


@inner
def margin_on(scene, now, count, piece, s, way, far, rough):
    """m of one point of the edge against `keep`, after points of smaller s; the nearest sweep comes first afterwards.

    work.low : distance + s where a sweep was asked last, at `count` that of the triangles: it falls by 1 mm per mm at most, and
    who cannot be nearest is not asked. far : no sweep is looked for deeper than this, nor exactly beyond m by it. rough :
    triangles are asked, too, where neither m nor what is known of them allows a step as long.
    """
    world, work = scene.world, scene.work
    at = place(scene, now, piece, s, way)
    m, first = DEEP, 0
    if world.kind != 2:
        m = min(m, depth(world.kind, world.stock, at[0], at[1], at[2]))
    for i in range(count):
        if work.low[i] - s > m + FLAT:
            continue
        c = work.keep[i]
        d = gap_of(scene, c, at, m, min(max(m, 0.0) + far, DEEP))
        if work.mode[c] == 0:
            work.low[i] = d + s
        if d < m:
            m, first = d, i
            if m < -far:
                break
    if count > 0:
        work.keep[0], work.keep[first] = work.keep[first], work.keep[0]
        work.low[0], work.low[first] = work.low[first], work.low[0]
    known, want = work.low[count] - s, max(m, rough)
    if world.kind == 2 and scene.room.last[1] > 0 and m > -rough and known <= want:
        d = mesh_depth(world, at[0], at[1], at[2], want, known, scene.room)
        work.low[count] = d + s
        m = min(m, d)
    return m


@inner
def may_end(work, room, count, s, t):
    """Leaves in `few` who can come to the surface between s and t, both asked by `margin_on`; how many, and the old last[1]."""
    few, mesh = 0, room.last[1]
    for i in range(count):
        if work.low[i] <= 2.0 * t - s + FLAT:
            work.few[few] = work.keep[i]
            few += 1
    room.last[1] = mesh > 0 and work.low[count] <= 2.0 * t - s + FLAT
    room.free[4] = work.low[count] - 2.0 * t + s
    return few, mesh
