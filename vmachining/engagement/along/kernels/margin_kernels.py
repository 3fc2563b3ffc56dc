# The margin of a point of the edge against stock and sweeps nearby.
#
# Legend: s arc length along the meridian, mm; m (margin) of a point, mm: negative where it cuts. A point cuts if its
#   surface moves into what lies before it (N.V > 0), if it is in the stock, and if no sweep covers it; the margin is
#   the largest of three functions that change by at most `stretch` per mm of s, so |m| / stretch is a step without a
#   root.
# World: kind 0 box (lo, hi), 1 upright cylinder (x, y, R, z0, z1), 2 triangles (a to boxes, see
#   engagement/_kernels.py). Columns of the sweeps, one row each: box lo and hi; form: first and last + 1 piece, 1 if
#   the axis turns, row of frames or -1; start; path (see sweep/_kernels.py); tol: of the distance, and depth up to
#   which a point counts as on the surface. Rows of pieces: first and last + 1 segment, first and last + 1 wave; limits
#   and waves as in sweep/rotating.
# Tool: rows r0 z0 r1 z1 cr cz R beta0 beta1 of the meridian, joints (s of their ends), twist rad/mm of height.
# now (22,): tip, axis, velocity, rate of the axis, right, ahead (3 each), speed, idle speed, highest z, steepness added.

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.jit import leaf
from vmachining.stock._kernels import leaves_near, listed_distance, mesh_distance
from vmachining.sweep._kernels import meridian, nearest, planar_gap
from vmachining.sweep.rotating._kernels import narrowed
from vmachining.sweep.rotating.pose._kernels import near, state

FAR = 1e9
NEAR_MM = 2.0  # of a station, triangles are listed
LEVEL = -0.25  # mm: deeper than this in a turning sweep needs no digits


class World(NamedTuple):
    """Stock and earlier sweeps, see the legend."""

    kind: int
    stock: NDArray[np.float64]
    box: NDArray[np.float64]
    form: NDArray[np.int64]
    start: NDArray[np.float64]
    path: NDArray[np.float64]
    tol: NDArray[np.float64]
    frames: NDArray[np.float64]
    pieces: NDArray[np.int64]
    seg: NDArray[np.float64]
    limits: NDArray[np.float64]
    waves: NDArray[np.float64]
    a: NDArray[np.float64]
    b: NDArray[np.float64]
    c: NDArray[np.float64]
    normals: NDArray[np.float64]
    boxes: NDArray[np.float64]


class Blade(NamedTuple):
    """The meridian, see the legend."""

    rows: NDArray[np.float64]
    joints: NDArray[np.float64]
    twist: float
    stretch: float


class Room(NamedTuple):
    """Work space of the kernels.

    free (5,): point that triangles were asked for last, and its signed distance; how deep in them a bracket is at least.
    last (3,): the triangle that was nearest, whether triangles may end the stretch, how many leaves of their tree `near` holds,
    those within near_mm of `region`, with their numbers `place`; -1 if there is no room for so many.
    """

    cells: NDArray[np.float64]
    p: NDArray[np.float64]
    poses: NDArray[np.float64]
    free: NDArray[np.float64]
    stack: NDArray[np.int64]
    square: NDArray[np.float64]
    last: NDArray[np.int64]
    region: NDArray[np.float64]
    near: NDArray[np.float64]
    place: NDArray[np.int64]


@leaf
def list_triangles(world, box, room):
    """Lists what `mesh_depth` looks at first, near a box."""
    room.last[2] = -1
    for k in range(6):
        room.region[k] = box[k]
    if box[0] <= box[3] and box[1] <= box[4] and box[2] <= box[5]:
        room.last[2] = leaves_near(world.boxes, box, NEAR_MM, room.stack, room.near, room.place)


@leaf
def mesh_depth(world, x, y, z, most, known, room):
    """The smaller of `most` and how deep a point lies among the triangles, mm; negative outside.

    known : it lies so deep at least, because another point did. With no triangle within `most`, and that more than -known, none
    lies between the two points, and it is as deep as `most`.
    """
    p = room.p
    p[0], p[1], p[2] = x, y, z
    reach, last = most if known > -most else FAR, room.last
    sure = NEAR_MM - box_gap(room.region, x, y, z)  # triangles within this are listed
    d = FAR
    if last[2] >= 0:
        d, last[0] = listed_distance(
            p, world.a, world.b, world.c, world.normals, room.near, room.place, last[2], room.square, last[0],
            min(reach, 2.0 * NEAR_MM),
        )  # fmt: skip
    if last[2] < 0 or abs(d) > sure:
        d, last[0] = mesh_distance(
            p, world.a, world.b, world.c, world.normals, world.boxes, room.stack, room.square, last[0], reach
        )
    return most if d >= reach else min(most, -d)


@leaf
def box_gap(box, x, y, z):
    """Distance to a box, 0 inside."""
    a = max(max(box[0] - x, x - box[3]), 0.0)
    b = max(max(box[1] - y, y - box[4]), 0.0)
    c = max(max(box[2] - z, z - box[5]), 0.0)
    return np.sqrt(a * a + b * b + c * c)


@leaf
def sweep_gap(world, k, x, y, z, best, room):
    """The smaller of `best` and the signed distance to sweep k; below LEVEL only that it is."""
    first, last, turns, frame = world.form[k, 0], world.form[k, 1], world.form[k, 2], world.form[k, 3]
    if frame >= 0:
        f = world.frames[frame]
        x, y, z = (
            f[0, 0] * x + f[0, 1] * y + f[0, 2] * z,
            f[1, 0] * x + f[1, 1] * y + f[1, 2] * z,
            f[2, 0] * x + f[2, 1] * y + f[2, 2] * z,
        )
    x, y, z = x - world.start[k, 0], y - world.start[k, 1], z - world.start[k, 2]
    seg, tol = world.seg, world.tol[k, 0]
    if turns == 0:
        path = world.path[k]
        if path[9] == 0.0:
            for j in range(first, last):
                best = min(
                    best, nearest(seg, world.pieces[j, 0], world.pieces[j, 1], path[6:9], x, y, z, tol)[0]
                )
        else:
            gap = planar_gap(path, x, y)
            for j in range(first, last):
                best = min(best, meridian(seg, world.pieces[j, 0], world.pieces[j, 1], gap, z)[0])
        return best
    cells, poses = room.cells, room.poses
    waves = world.waves[world.pieces[first, 2] : world.pieces[first, 3]]
    state(waves, 0.0, poses[0])
    state(waves, 1.0, poses[1])
    for j in range(first, last):
        i0, i1 = world.pieces[j, 0], world.pieces[j, 1]
        cells[0, 0], cells[0, 1], cells[0, 2] = 0.0, 1.0, 0.0
        for e in range(2):
            d, _x, _y, _z, f = near(seg, i0, i1, poses[e], x, y, z)
            cells[0, 3 + 2 * e], cells[0, 4 + 2 * e] = d, f
            best = min(best, d)
        best = narrowed(
            seg, i0, i1, world.limits[j], waves, x, y, z, best, LEVEL, cells, room.p, 0, 0, max(tol, 1e-8)
        )[0]
    return best


@leaf
def edge_point(blade, piece, s):
    """r, z, n_r, n_z of the meridian."""
    q = blade.rows[piece]
    t = s - blade.joints[piece]
    if q[6] > 0.0:
        beta = min(q[7] + t / q[6], q[8])
        c, n = np.cos(beta), np.sin(beta)
        return max(q[4] + q[6] * c, 0.0), q[5] + q[6] * n, c, n
    size = blade.joints[piece + 1] - blade.joints[piece]
    share = min(max(t / size, 0.0), 1.0)
    return q[0] + share * (q[2] - q[0]), q[1] + share * (q[3] - q[1]), np.cos(q[7]), np.sin(q[7])


@leaf
def turned(now, phi, aside):
    """Of a rotation angle: direction of the edge (3); that times the velocity, times the rate of the axis, times aside (3,); axis
    times velocity."""
    sp, cp = np.sin(phi), np.cos(phi)
    x, y, z = sp * now[12] + cp * now[15], sp * now[13] + cp * now[16], sp * now[14] + cp * now[17]
    return (
        x, y, z, x * now[6] + y * now[7] + z * now[8], x * now[9] + y * now[10] + z * now[11],
        x * aside[0] + y * aside[1] + z * aside[2], now[3] * now[6] + now[4] * now[7] + now[5] * now[8],
    )  # fmt: skip


@leaf
def into(way, r, z, n_r, n_z):
    """N . V of a point of the edge at a `turned` angle, per unit of the block."""
    return n_r * way[3] + n_z * way[6] + (z * n_r - r * n_z) * way[4]
