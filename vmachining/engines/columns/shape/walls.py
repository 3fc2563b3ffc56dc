"""Where walls stand: jumps of the height along lines, curved walls, corners and junctions in a cell."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Bools, Floats, Ints

STEP = 1e-3
"""Difference of height along an edge, in lengths of it, above which a jump is looked for where two sweeps meet."""

JUMP = 1e-4
"""What is left of it after bisection, in lengths of the edge, above which it is a jump."""

EARLY, HALVINGS = 5, 44
"""Halvings after which what has shrunk to a quarter is not a jump; all halvings."""

NEAR = 1e-3
"""Of an edge: a wall is that far from its ends at least."""

STRAIGHT = 2e-3
"""Of an edge: a wall that bulges less is a chord."""

LOOKED = np.array([0.01, 0.03, 0.1, 0.25, 0.5, 0.75, 0.9, 0.97, 0.99])
"""Shares of a chord at which a corner is looked for."""

CORNER = 0.01
"""The same, above which a corner is looked for."""

Heights = Callable[[Floats], tuple[Floats, Ints]]
"""Heights over places (k, 2), and the sweep that made each: -1 none, -2 outside of the stock."""


class Jumps(NamedTuple):
    """real (k,) : whether there is one. share (k,) of the way from a to b. first, last (k,) mm : heights at both sides."""

    real: Bools
    share: Floats
    first: Floats
    last: Floats


def jumps(at: Heights, a: Floats, b: Floats) -> Jumps:
    """Bisection between places a and b (k, 2)."""
    n = len(a)
    s, t = np.zeros(n), np.ones(n)
    (first, _), (last, _) = at(a), at(b)
    whole, alive = np.abs(last - first), np.arange(n)
    for k in range(HALVINGS):
        if k == EARLY:
            alive = alive[np.abs(last - first)[alive] > 0.25 * whole[alive]]
        if not len(alive):
            break
        middle = 0.5 * (s[alive] + t[alive])
        z, _ = at(a[alive] + middle[:, None] * (b - a)[alive])
        left = np.abs(z - first[alive]) > np.abs(last[alive] - z)  # where most of the step is
        t[alive[left]], last[alive[left]] = middle[left], z[left]
        s[alive[~left]], first[alive[~left]] = middle[~left], z[~left]
    real = np.zeros(n, dtype=np.bool_)
    size = np.hypot(*(b - a).T)
    real[alive] = np.abs(last - first)[alive] > JUMP * size[alive]
    return Jumps(real, 0.5 * (s + t), first, last)


def bend(
    at: Heights, low: Floats, high: Floats, p: Floats, q: Floats
) -> tuple[Bools, Bools, Floats, Floats, Floats]:
    """Where a wall from p to q (k, 2) through a cell between corners low and high (k, 2) is farthest from its chord.

    Returns whether it was found there, whether it is not a chord, that place (k, 2), and the heights (k,) to its left and right.
    """
    way = q - p
    size = np.maximum(np.hypot(*way.T), 1e-300)
    across = np.column_stack([way[:, 1], -way[:, 0]]) / size[:, None]
    edge = (high - low).max(axis=1)

    def offset(which: Ints, share: Floats) -> tuple[Bools, Floats, Floats, Floats]:
        """Of the wall from the chord, to its right, where the line across it meets the wall in the cell."""
        o, u = p[which] + share[:, None] * way[which], across[which]
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = np.stack([(low[which] - o) / u, (high[which] - o) / u])
        ends[:, u == 0.0] = np.array([[-np.inf], [np.inf]])
        near, far = ends.min(axis=0).max(axis=1), ends.max(axis=0).min(axis=1)
        found = jumps(at, o + near[:, None] * u, o + far[:, None] * u)
        return found.real, near + found.share * (far - near), found.first, found.last

    every = np.arange(len(p))
    share = np.full(len(p), 0.5)
    real, far, left, right = offset(every, share)
    far[~real] = 0.0
    bent = real & (np.abs(far) > STRAIGHT * edge)
    sharp = np.flatnonzero(bent & (np.abs(far) > CORNER * edge))
    if len(
        sharp
    ):  # two legs from both ends, by the places beside the farthest one, meet in a corner, if it is one
        looked = np.array([offset(sharp, np.full(len(sharp), s))[1] for s in LOOKED])
        top = np.abs(looked).argmax(axis=0)
        rows, one, other = np.arange(len(sharp)), np.maximum(top - 1, 0), np.minimum(top + 1, len(LOOKED) - 1)
        rise, fall = looked[one, rows] / LOOKED[one], looked[other, rows] / (1.0 - LOOKED[other])
        with np.errstate(divide="ignore", invalid="ignore"):
            met = fall / (rise + fall)
        good = (met > 0.0) & (met < 1.0)
        sharp, met, peak = sharp[good], met[good], (rise * met)[good]
        inside, there, *both = offset(sharp, met)
        good = inside & (np.abs(there - peak) < CORNER * edge[sharp])
        sharp, met = sharp[good], met[good]
        share[sharp], far[sharp] = met, there[good]
        left[sharp], right[sharp] = both[0][good], both[1][good]
    place = p + share[:, None] * way + far[:, None] * across
    margin = NEAR * (high - low)
    return real, bent, np.clip(place, low + margin, high - margin), left, right


def junction(at: Heights, low: Floats, high: Floats, places: Floats) -> Floats:
    """Where the walls from three places (k, 3, 2) on the border of a cell meet: nearest to their tangents."""
    middle, size = 0.5 * (low + high), high - low
    normal, total = np.zeros((len(low), 2, 2)), np.zeros((len(low), 2))
    for e in range(3):
        p = places[:, e]
        upright = np.minimum(p[:, 0] - low[:, 0], high[:, 0] - p[:, 0]) < np.minimum(
            p[:, 1] - low[:, 1], high[:, 1] - p[:, 1]
        )
        axis = np.where(upright, 1, 0)  # along the edge on which p lies
        inward = np.where(p < middle, 1.0, -1.0) * 0.01 * size
        a, b = p + inward, p + inward
        rows = np.arange(len(p))
        a[rows, axis], b[rows, axis] = (
            np.maximum(p - 0.1 * size, low)[rows, axis],
            np.minimum(p + 0.1 * size, high)[rows, axis],
        )
        found = jumps(at, a, b)
        u = a + found.share[:, None] * (b - a) - p
        n = np.column_stack([u[:, 1], -u[:, 0]]) / np.maximum(np.hypot(*u.T), 1e-300)[:, None]
        n *= found.real[:, None]
        normal += n[:, :, None] * n[:, None, :]
        total += n * (n * p).sum(axis=1)[:, None]
    normal += 1e-6 * np.eye(2)
    total += 1e-6 * places.mean(axis=1)
    found_at = np.linalg.solve(normal, total[:, :, None])[:, :, 0]
    return np.clip(found_at, low + 0.02 * size, high - 0.02 * size)
