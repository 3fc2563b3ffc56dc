# Closed integrals of sweep k less those of one other surface. E, lines, P: see sides.py.

import numpy as np

from vmachining.engines.columns.arcs._kernels import same_arc
from vmachining.engines.columns.patches._kernels import FOUR, RECT, room
from vmachining.engines.columns.sides import COVER, DOWN, FIRST, OUT, ROUGH, SELF, SMOOTH, TOP, UP
from vmachining.engines.columns.smooth._kernels import above, bends, positive
from vmachining.engines.columns.surface._kernels import FROM, OF, TO, covers, height, local, poses, profile
from vmachining.jit import inner, leaf

NONE = np.int64(-1)


@leaf
def hides(head, part, lift, rows, lines, rules, i, k, x, y, hx, hy, slack):
    """Whether line i covers line k in the cell, see `covers` and `same_arc`."""
    if rules & COVER == 0:
        return False
    if same_arc(lift, rows, lines, i, k, slack):
        return True
    return covers(head, part, lift, lines, i, k, x, y, hx, hy, slack)


@leaf
def known_room(head, part, lines, E, i, top, x, y, hx, hy, P, W):
    """(lo, hi) of the integral of what surface i lies below the top over its footprint, see `room`."""
    c = int(lines[i, 7])
    if lines[i, 8] != lines[i, 7]:
        return -np.inf, np.inf
    rim = lines[i, 2] + max(lines[i, 6] * lines[i, 5], 0.0) + profile(head, part, c, head[c, 1])[0]
    below = rim <= top or (E[i, UP + 7] == SMOOTH and above(E, TOP, DOWN, hx, hy, i, UP))
    return room(head, part, c, lines, i, top, x, y, hx, hy, below, P, RECT, FOUR, W)


@inner
def starts_on(lines, i, k, slack):
    """Whether sweep k begins on the path of sweep i, or above it, of one cutter."""
    c = lines[k, 7]
    if lines[k, 8] != c or lines[i, 7] != c or lines[i, 8] != c:
        return False
    along, aside = local(lines, i, lines[k, 0], lines[k, 1])
    if abs(aside) > slack or along < -slack or along > lines[i, 5] + slack:
        return False
    return lines[k, 2] >= lines[i, 2] + lines[i, 6] * min(max(along, 0.0), lines[i, 5]) - slack


@leaf
def both_lower(head, part, lines, i, k, x, y, hx, hy, slack):
    """Bound of the integral of what sweeps i and k of one cutter both lie below the pose where i ends and k begins; infinite
    if unknown.

    With the gradient g of that pose, k is lower where g u_k > m_k only, by (g u_k - m_k) times the way to its touching
    pose at most, and i where g u_i < m_i only.
    """
    c = int(lines[k, 7])
    if lines[k, 8] != c or lines[i, 7] != c or lines[i, 8] != c:
        return np.inf
    ex, ey = (
        lines[i, 0] + lines[i, 5] * lines[i, 3] - lines[k, 0],
        lines[i, 1] + lines[i, 5] * lines[i, 4] - lines[k, 1],
    )
    if (
        abs(ex) > slack
        or abs(ey) > slack
        or abs(lines[i, 2] + lines[i, 6] * lines[i, 5] - lines[k, 2]) > slack
    ):
        return np.inf
    drop = lines[i, 6] - lines[k, 6]
    along, aside = local(lines, k, lines[i, 0], lines[i, 1])
    if abs(aside) > slack or along > slack:
        dx, dy = x - lines[k, 0], y - lines[k, 1]
        far = np.sqrt(dx * dx + dy * dy) + np.sqrt(hx * hx + hy * hy)
        if far >= head[c, 1]:
            return np.inf
        dx, dy = lines[k, 3] - lines[i, 3], lines[k, 4] - lines[i, 4]
        drop += profile(head, part, c, far)[3] * np.sqrt(dx * dx + dy * dy)
    if drop <= 0.0:
        return 0.0
    poses(head, part, c, lines, i, x, y, hx, hy)
    poses(head, part, c, lines, k, x, y, hx, hy)
    way = min(min(lines[k, TO], lines[k, 5]), min(lines[i, 5] - lines[i, FROM], lines[i, 5]))
    return 4.0 * hx * hy * drop * max(way, 0.0)


@leaf
def beyond(head, part, lift, rows, lines, rules, E, i, x, y, hx, hy, slack):
    """Bound of the integral of what surface i lies below sweep k, where k is whole; infinite elsewhere.

    A rough k is convex: it lies below its plane raised by the most that a corner lies above it.
    """
    if hides(head, part, lift, rows, lines, rules, SELF, i, x, y, hx, hy, slack):
        return 0.0
    if E[SELF, UP + 7] < ROUGH:
        return np.inf
    over = 0.0
    if E[SELF, UP + 7] == SMOOTH:
        over = bends(E, SELF, UP, i, DOWN, hx, hy, 1.0)
    else:
        c = int(lines[SELF, 7])
        poses(head, part, c, lines, SELF, x, y, hx, hy)
        for v in range(4):
            px, py = (hx if v % 2 else -hx), (hy if v > 1 else -hy)
            f = height(head, part, c, lines, SELF, x + px, y + py)
            over = max(over, f - E[SELF, UP] - E[SELF, UP + 1] * px - E[SELF, UP + 2] * py)
        over += bends(E, TOP, UP, i, DOWN, hx, hy, 1.0)
    a, b = abs(E[SELF, UP + 1] - E[i, DOWN + 1]) * hx, abs(E[SELF, UP + 2] - E[i, DOWN + 2]) * hy
    return positive(E[SELF, UP] - E[i, DOWN] + over, a, b, hx, hy, 1.0)


@leaf
def posed(lines, E, i):
    """Row of the pose in which sweep i begins."""
    pose = np.int64(len(lines) - 1)
    for j in range(9):
        lines[pose, j] = lines[i, j]
    lines[pose, 5], lines[pose, 6], lines[pose, OF] = 0.0, 0.0, -1.0
    E[pose, UP + 7] = OUT
    return pose


@inner
def pair(head, part, lift, rows, lines, rules, E, top, x, y, hx, hy, slack, gap, room_k, P, W):
    """(lo, hi) of what sweep k removes where the two earlier sweeps that are left follow each other.

    They share the pose P and, but for `both_lower`, nothing else: together they remove G_i + G_j - G_P.
    """
    i, j = FIRST, FIRST + 1
    both = both_lower(head, part, lines, i, j, x, y, hx, hy, slack)
    if both == np.inf:
        i, j = j, i
        both = both_lower(head, part, lines, i, j, x, y, hx, hy, slack)
        if both == np.inf:
            return 0.0, np.inf
    pose = posed(lines, E, j)
    a, b = known_room(head, part, lines, E, i, top, x, y, hx, hy, P, W)
    c, d = known_room(head, part, lines, E, j, top, x, y, hx, hy, P, W)
    e, f = known_room(head, part, lines, E, pose, top, x, y, hx, hy, P, W)
    lo, hi = gap - b - d + e, room_k - a - c + f + both
    if not lo > -np.inf or not hi < np.inf:
        return 0.0, np.inf
    hi += beyond(head, part, lift, rows, lines, rules, E, i, x, y, hx, hy, slack)
    hi += beyond(head, part, lift, rows, lines, rules, E, j, x, y, hx, hy, slack)
    return max(lo, 0.0), max(hi, 0.0)


@inner
def less(head, part, lift, rows, lines, rules, E, n, best, known, top, x, y, hx, hy, slack, enough, P, W):
    """(lo, hi, share, least, most, exact): what sweep k removes by its closed integral less that of one other; what is known
    of what it lies below `best`, from below, and of the difference of both; whether nothing else need be asked.

    Nothing is left above a pose of k that lies in an earlier sweep: k removes no more than what it lies below that pose.
    """
    alone, begun = n <= 3, NONE
    if rules & COVER != 0 and lines[SELF, 5] > 0.0:
        for i in range(2, n):
            if lines[i, 5] > 0.0 and starts_on(lines, i, SELF, slack):
                begun = np.int64(i)
                break
    other = FIRST if alone else best
    if not (alone or n == 4 or (known and best > 0) or begun > 0):
        return 0.0, np.inf, -np.inf, -np.inf, np.inf, False
    gap, room_k = known_room(head, part, lines, E, SELF, top, x, y, hx, hy, P, W)
    if n == 2 or not room_k < np.inf:
        return max(gap, 0.0), max(room_k, 0.0), -np.inf, -np.inf, np.inf, n == 2 and room_k < np.inf
    lo, hi, share, least, most = 0.0, max(room_k, 0.0), -np.inf, -np.inf, np.inf
    if n == 4:
        lo, a = pair(head, part, lift, rows, lines, rules, E, top, x, y, hx, hy, slack, gap, room_k, P, W)
        hi = min(hi, a)
        if hi - lo <= enough:
            return lo, hi, share, least, most, True
    hidden = (
        other > 0
        and (alone or known)
        and hides(head, part, lift, rows, lines, rules, SELF, other, x, y, hx, hy, slack)
    )
    if begun > 0 and not hidden:
        pose = posed(lines, E, SELF)
        a, b = known_room(head, part, lines, E, pose, top, x, y, hx, hy, P, W)
        hi = min(hi, max(room_k - a, 0.0))
        if alone or begun == best:
            share = gap - b - both_lower(head, part, lines, begun, SELF, x, y, hx, hy, slack)
            if alone:
                lo = max(share, 0.0)
                if hi - lo <= enough:
                    return lo, hi, share, least, most, True
    if other > 0 and (alone or known):
        a, b = known_room(head, part, lines, E, other, top, x, y, hx, hy, P, W)
        if b < np.inf:
            a, b = gap - b, room_k - a
            if alone:
                lo = max(lo, a)
            if hidden:
                hi = min(hi, max(b, 0.0))
                if alone:
                    return lo, hi, share, a, b, True
            elif alone:
                c = beyond(head, part, lift, rows, lines, rules, E, other, x, y, hx, hy, slack)
                hi = min(hi, max(b + c, 0.0))
                if hi - lo <= enough:
                    return lo, hi, share, a, b, True
            if other == best:
                least, most = a, b
    return lo, hi, share, least, most, False
