# Stretches of an edge that cut, at any angle, from the angles that were asked: between two of them ends are interpolated.
#
# Legend: angle (n,) rising over a turn, with span (n, 2) of rows in part (piece, s0, s1); ring 1: the last meets the first.
#   wanted (m,) rotation angles of the tip; a point of a wound edge at height z stands at wanted - z twist. hits rows: index of
#   the wanted angle, piece, s0, s1.

import numpy as np

from vmachining.engagement.along.kernels.margin_kernels import edge_point
from vmachining.jit import kernel, leaf

FULL = 2.0 * np.pi
LAG = np.radians(1.0)  # of a stretch that counts as straight
EDGE_RAD = 6e-4  # a chain of angles ends this close to where facing does


@leaf
def place(angle, n, phi):
    """Position of the last angle not above phi, and phi within a turn of the first one."""
    phi = angle[0] + (phi - angle[0]) % FULL
    low, high = 0, n
    while high - low > 1:
        middle = (low + high) // 2
        if angle[middle] <= phi:
            low = middle
        else:
            high = middle
    return low, phi


@leaf
def parts_of(span, part, i, piece):
    """First row and number of the parts of a piece at an angle."""
    first, n = -1, 0
    for p in range(span[i, 0], span[i, 1]):
        if int(part[p, 0]) == piece:
            if n == 0:
                first = p
            n += 1
    return first, n


@leaf
def add(hits, used, first, index, piece, a, b, low, high):
    """Append what of a..b lies in low..high, joined to the row before where they meet."""
    a, b = max(a, low), min(b, high)
    if b <= a or used >= len(hits):
        return used
    if used > first and hits[used - 1, 1] == piece and abs(hits[used - 1, 3] - a) < 1e-12:
        hits[used - 1, 3] = b
        return used
    hits[used, 0], hits[used, 1], hits[used, 2], hits[used, 3] = index, piece, a, b
    return used + 1


@leaf
def between(angle, span, part, ring, phi, piece, low, high, index, hits, used, first):
    """What of low..high of a piece cuts at an angle; rows used."""
    n = len(angle)
    i, phi = place(angle, n, phi)
    j, wide = i + 1, 0.0
    if j < n:
        wide = angle[j] - angle[i]
    elif ring:
        j, wide = 0, angle[0] + FULL - angle[i]
    else:  # beyond a chain: its ends, to where facing ends
        if phi - angle[i] <= EDGE_RAD:
            j = i
        elif angle[0] + FULL - phi <= EDGE_RAD:
            i = j = 0
        else:
            return used
    f, count = parts_of(span, part, i, piece)
    g, other = parts_of(span, part, j, piece)
    share = (phi - angle[i]) / wide if wide > 0.0 else 0.0
    if count == other:
        for k in range(count):
            a = part[f + k, 1] + share * (part[g + k, 1] - part[f + k, 1])
            b = part[f + k, 2] + share * (part[g + k, 2] - part[f + k, 2])
            used = add(hits, used, first, index, piece, a, b, low, high)
        return used
    if share >= 0.5:
        f, count = g, other
    for k in range(count):
        used = add(hits, used, first, index, piece, part[f + k, 1], part[f + k, 2], low, high)
    return used


@kernel
def resample(blade, angle, span, part, ring, wanted, hits) -> int:
    """Rows of hits used: what the edge, wound or straight, cuts at the wanted angles."""
    used = 0
    for w in range(len(wanted)):
        first = used
        for piece in range(len(blade.rows)):
            a, b = blade.joints[piece], blade.joints[piece + 1]
            rise = abs(blade.rows[piece, 3] - blade.rows[piece, 1]) * abs(blade.twist)
            cells = max(1, int(np.ceil(rise / LAG)))
            for c in range(cells):
                low, high = a + (b - a) * c / cells, a + (b - a) * (c + 1) / cells
                z = edge_point(blade, piece, 0.5 * (low + high))[1]
                phi = wanted[w] - z * blade.twist
                used = between(angle, span, part, ring, phi, piece, low, high, w, hits, used, first)
    return used
