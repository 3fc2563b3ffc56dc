# Lines against the sweep of a whole ball cutter on a line, in closed form.
#
# Legend: ball of radius r about c1 that travels by d, upright shank of the same radius from its centre up to `height`
#   above it. The sweep is convex: a line is in it for one interval. Coordinates x, y, z are from c1.

import numpy as np

from vmachining.jit import inner, leaf


@leaf
def travel(dx, dy, dz):
    """Length of a travel seen from above, its direction, its slope, the sine of its angle, and what an upright one falls."""
    run = np.sqrt(dx * dx + dy * dy)
    if run == 0.0:
        return run, 1.0, 0.0, 0.0, 0.0, min(0.0, dz)
    return run, dx / run, dy / run, dz / run, dz / np.sqrt(run * run + dz * dz), 0.0


@inner
def ball_below(u, v, run, slope, sine, square):
    """Lowest point of the sweep of a ball, radius^2 = square, over a place u along and v beside its travel: height over the
    first centre, place along the travel of the sphere, and its room, not positive where the line misses.

    Of the spheres over the line the lowest has its centre at u - h sin(alpha) along the travel, h^2 = r^2 - v^2, or at an end.
    Without a branch, so that loops work on several places at a time.
    """
    room = square - v * v
    s = u - np.sqrt(room if room > 0.0 else 0.0) * sine
    s = s if s > 0.0 else 0.0
    s = s if s < run else run
    room -= (u - s) * (u - s)
    return s * slope - np.sqrt(room if room > 0.0 else 0.0), s, room


@leaf
def capsule_entry(x, y, z, u, v, w, dx, dy, dz, r):
    """First t of (x, y, z) + t (u, v, w) in the capsule about the segment from 0 to d; inf if it misses.

    The direction may have any length. Where the line enters the unbounded cylinder beyond an end, the capsule is
    entered by the ball of that end or not at all.
    """
    nn = u * u + v * v + w * w
    if nn == 0.0:
        return np.inf
    dd = dx * dx + dy * dy + dz * dz
    cx, cy, cz = 0.0, 0.0, 0.0
    if dd > 0.0:
        along, speed = (x * dx + y * dy + z * dz) / dd, (u * dx + v * dy + w * dz) / dd
        px, py, pz = x - along * dx, y - along * dy, z - along * dz
        mx, my, mz = u - speed * dx, v - speed * dy, w - speed * dz
        a = mx * mx + my * my + mz * mz
        if a > 1e-24 * nn:
            b = px * mx + py * my + pz * mz
            disc = b * b - a * (px * px + py * py + pz * pz - r * r)
            if disc <= 0.0:  # a touch takes nothing
                return np.inf
            t = (-b - np.sqrt(disc)) / a
            s = along + t * speed
            if 0.0 <= s <= 1.0:
                return t
            if s > 1.0:
                cx, cy, cz = dx, dy, dz
        elif speed < 0.0:
            cx, cy, cz = dx, dy, dz
    x, y, z = x - cx, y - cy, z - cz
    b = x * u + y * v + z * w
    disc = b * b - nn * (x * x + y * y + z * z - r * r)
    if disc <= 0.0:
        return np.inf
    return (-b - np.sqrt(disc)) / nn


@leaf
def reach_along(x, y, dx, dy, r):
    """Part [s0, s1] of the travel on which an upright line is within r of the axis; s0 > s1 if it never is."""
    dd = dx * dx + dy * dy
    if dd == 0.0:
        if x * x + y * y <= r * r:
            return 0.0, 1.0
        return 1.0, 0.0
    off = x * dy - y * dx
    room = r * r * dd - off * off
    if room < 0.0:
        return 1.0, 0.0
    half, s = np.sqrt(room) / dd, (x * dx + y * dy) / dd
    return max(0.0, s - half), min(1.0, s + half)


@leaf
def in_ball_sweep(x, y, z, dx, dy, dz, r, height):
    """Whether a point (from the first centre) is in the sweep of the whole ball cutter."""
    s0, s1 = reach_along(x, y, dx, dy, r)
    if s0 > s1:
        return False
    z0, z1 = s0 * dz, s1 * dz
    if min(z0, z1) <= z <= max(z0, z1) + height:
        return True
    dd = dx * dx + dy * dy + dz * dz
    s = 0.0
    if dd > 0.0:
        s = min(max((x * dx + y * dy + z * dz) / dd, 0.0), 1.0)
    x, y, z = x - s * dx, y - s * dy, z - s * dz
    return x * x + y * y + z * z <= r * r


@leaf
def ball_entry(x, y, z, u, v, w, dx, dy, dz, r, height):
    """First t of a line in the sweep of the whole ball cutter, and whether that is sure.

    The sweep is convex: capsule of the ball, and the shank, whose walls stand on the stadium seen from above. Its
    lowest disc lies in the capsule; a line that comes down through the highest one is left to others (not sure).
    """
    t = capsule_entry(x, y, z, u, v, w, dx, dy, dz, r)
    wall = capsule_entry(x, y, 0.0, u, v, 0.0, dx, dy, 0.0, r)
    if u == 0.0 and v == 0.0:
        return t, w > 0.0
    if wall == np.inf:
        return np.inf, True
    qx, qy, qz = x + wall * u, y + wall * v, z + wall * w
    level = dx * dx + dy * dy
    if level > 0.0:
        s = min(max((qx * dx + qy * dy) / level, 0.0), 1.0)
        low, high = s * dz, s * dz + height
    else:
        low, high = min(0.0, dz), max(0.0, dz) + height
    if low <= qz <= high:
        return min(t, wall), True
    return t, not (qz > high and w < 0.0)
