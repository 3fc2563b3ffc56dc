# Lines against the sweep of a whole ball cutter on a line, in closed form.
#
# Legend: ball of radius r about c1 that travels by d, upright shank of the same radius from its centre up to `height`
#   above it. The sweep is convex: a line is in it for one interval. Coordinates x, y, z are from c1.

import numpy as np

from vmachining.jit import kernel, leaf


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


@kernel
def ball_upright(x0, y0, pitch, c1, d, r, height, enter, leave) -> None:
    """Heights at which upright lines enter and leave a straight block of a ball cutter; inf, -inf where they miss.

    enter, leave (n, m): lines at (x0 + i pitch, y0 + j pitch). With u along the travel and v across, h^2 = r^2 - v^2,
    the lowest sphere over (u, v) has its centre at u - h sin(alpha), alpha the slope, or at an end.
    """
    run = np.sqrt(d[0] * d[0] + d[1] * d[1])
    slope, sin = 0.0, 0.0
    e0, e1 = 1.0, 0.0
    if run > 0.0:
        e0, e1 = d[0] / run, d[1] / run
        slope = d[2] / run
        sin = d[2] / np.sqrt(run * run + d[2] * d[2])
    n, m = enter.shape
    for i in range(n):
        x = x0 + i * pitch - c1[0]
        for j in range(m):
            y = y0 + j * pitch - c1[1]
            u, v = x * e0 + y * e1, y * e0 - x * e1
            h = np.sqrt(max(r * r - v * v, 0.0))
            center = min(max(u - h * sin, 0.0), run)
            off = u - center
            room = r * r - v * v - off * off
            enter[i, j], leave[i, j] = np.inf, -np.inf
            if room <= 0.0:  # the clamped centre is within reach if any is
                continue
            if run > 0.0:
                enter[i, j] = c1[2] + center * slope - np.sqrt(room)
                high = max(min(max(u - h, 0.0), run) * slope, min(max(u + h, 0.0), run) * slope)
                leave[i, j] = c1[2] + high + height
            else:
                enter[i, j] = c1[2] + min(0.0, d[2]) - np.sqrt(room)
                leave[i, j] = c1[2] + max(0.0, d[2]) + height
