"""Fastest time along a path by dense integration in the phase plane (s, u = (ds/dt)^2), written from the constraints alone.

Of every joint q(s) that is given at dense places: |q' w + q'' u| <= a with w = d2s/dt2, |q'| sqrt(u) <= v; along and across
the tip's path |w| <= A, kappa u <= A; u <= a given cap. Backward, the largest u from which some w still keeps the next bound is
found by bisection; forward, the largest allowed w is taken. Derivatives are differences of the places: no closed form of an
arc, of a chain or of a peak enters. What may be kept at a corner is the documented rule, written again in `corner`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

__all__ = ["Dense", "corner", "fastest"]


@dataclass(frozen=True)
class Dense:
    """A block at k + 1 places.

    s (k + 1,) mm, q (k + 1, m) joints, kappa 1/mm of the tip, cap mm/s. tip : (2, 3) what the corner rule looks
    at, d/ds at both ends: of the tip (unit vectors), or of the slides of a block whose joints go straight.
    """

    s: np.ndarray
    q: np.ndarray
    kappa: float
    cap: float
    tip: np.ndarray
    turns: np.ndarray  # (m,) rad/mm of the rotary joints, 0 for slides

    @property
    def length(self):
        return float(self.s[-1])


def corner(
    one: Dense, two: Dense, tolerance: float, whole: float, slides: np.ndarray, turning: np.ndarray
) -> float:
    """Largest u where two blocks meet.

    The direction of the slides changes in a piece that misses the corner by the tolerance at most and takes no more than half
    of the shorter block on each side; rotary joints change their rate within the same halves.
    """
    least = min(one.length, two.length)
    change = two.tip[0] - one.tip[1]
    size = np.linalg.norm(change)
    u = np.inf
    if size > 2e-9:
        lengths = np.linalg.norm(one.tip[1]), np.linalg.norm(two.tip[0])
        cosine = (
            1.0 if min(lengths) < 1e-9 else np.clip(one.tip[1] @ two.tip[0] / np.prod(lengths), -1.0, 1.0)
        )
        c = np.cos(np.arccos(cosine) / 2.0)
        taken = min(least, 4.0 * tolerance * (1.0 + c) / size)
        most = [a / abs(n) for a, n in zip(slides, change, strict=True) if abs(n) > 1e-9]
        u = taken * c * min(whole / size, *most)
    for rate, a in zip(np.abs(two.turns - one.turns), turning, strict=True):
        u = min(u, least * a / rate) if rate > 1e-12 else u
    return u


@njit(cache=True)
def _bounds(u, p, r, a, whole):
    """Least and largest w that all joints allow at u."""
    low, high = -whole, whole
    for j in range(p.shape[0]):
        if abs(p[j]) > 1e-9:
            one, two = (-a[j] - r[j] * u) / p[j], (a[j] - r[j] * u) / p[j]
            low, high = max(low, min(one, two)), min(high, max(one, two))
        elif abs(r[j]) * u > a[j]:
            return 1.0, -1.0
    return low, high


@njit(cache=True)
def _integrate(ds, p, r, top, a, whole):
    n = len(ds)
    reach = top.copy()
    for k in range(n - 1, -1, -1):
        good, bad = 0.0, reach[k]
        for _ in range(60):
            u = bad if good == 0.0 and _ == 0 else 0.5 * (good + bad)
            low, high = _bounds(u, p[k], r[k], a, whole)
            if low <= high and u + 2.0 * ds[k] * low <= reach[k + 1]:
                if u == bad:
                    good = bad
                    break
                good = u
            else:
                bad = u
        reach[k] = good
    u, total = reach[0], 0.0
    for k in range(n):
        _, high = _bounds(u, p[k], r[k], a, whole)
        after = max(min(u + 2.0 * ds[k] * high, reach[k + 1]), 0.0)
        total += 2.0 * ds[k] / (np.sqrt(u) + np.sqrt(after))
        u = after
    return total


def fastest(blocks, borders, *, speed, acceleration, whole) -> float:
    """Seconds from rest to rest.

    borders : (n - 1,) u at most between blocks. speed, acceleration : (m,) of the joints.
    """
    ds, p, r, top = [], [], [], []
    for k, block in enumerate(blocks):
        step = np.diff(block.s)
        rate = np.gradient(block.q, block.s, axis=0, edge_order=2)
        bend = np.gradient(rate, block.s, axis=0, edge_order=2)
        with np.errstate(divide="ignore"):
            cap = np.minimum(block.cap, (speed / np.abs(rate)).min(axis=1)) ** 2
        cap = np.minimum(cap, whole / block.kappa if block.kappa > 0 else np.inf)
        if k:
            cap[0] = min(cap[0], borders[k - 1], top[-1][-1])
            top[-1][-1] = cap[0]
        top.append(cap)
        ds.append(step)
        p.append(rate[:-1])
        r.append(bend[:-1])
    caps = np.concatenate([top[0], *(t[1:] for t in top[1:])])
    caps[0] = caps[-1] = 0.0
    return float(
        _integrate(np.concatenate(ds), np.concatenate(p), np.concatenate(r), caps, acceleration, whole)
    )
