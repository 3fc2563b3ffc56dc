"""Swept volume as body + flux - what is entered twice."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.sweep.flux import _kernels
from vmachining.sweep.grazing import terms_of, whole_meridian
from vmachining.sweep.rotating import Packed
from vmachining.sweep.rotating._kernels import PATIENCE
from vmachining.sweep.rotating.pose import _kernels as pose
from vmachining.sweep.volume import smooth_rule
from vmachining.tool import Profile

NODES = 24
"""Gauss points per smooth piece of the meridian; half-integer powers at its ends are mapped away."""

DEPTH = 1e-7
"""mm: a point that was less deep inside before counts as new; f is that small where the difference lies."""

STEPS = 12
"""Samples of the front arc of a circle in the search for visited arcs, at first; as many more per quartering."""

POINTS = 3
"""Gauss points per side of a rectangle of time and meridian."""

FIRST = (8, 6)
"""First division of time and of each face of the meridian."""

DEEPEST, MOST = 8, 3000
"""Most quarterings, and the number of rectangles that ends them: one second or so."""

ROUNDING = 1e-10
"""Relative noise of the sums."""

ROUNDS = 40
"""Most rounds of halving the time intervals; each gains three digits or more at a kink."""


class FluxVolume(NamedTuple):
    """body + flux - again = volume, mm^3; error is an estimate of the error of the volume, slack of what is in body + flux."""

    body: float
    flux: float
    again: float
    error: float
    slack: float

    @property
    def volume(self) -> float:
        """mm^3."""
        return self.body + self.flux - self.again

    @property
    def entered(self) -> float:
        """mm^3: what is entered, once per entry, which no volume exceeds."""
        return self.body + self.flux + self.slack


def flux_volume(
    profile: Profile, packed: Packed, *, wanted: float = 5e-6, patience: int = PATIENCE
) -> FluxVolume:
    """Volume of a sweep, mm^3, by the flux identity V = V(K) + Phi - W.

    Phi is the integral over time and surface of max(N . V_P, 0): what the body enters. It counts a point once
    per entry, so W, the part of it that enters where the body was before, is taken off.

    packed : columns of a motion and of convex pieces whose union is the body.
    wanted : relative error of the volume at which the search for W stops.
    patience : time intervals after which the search for one visit is given up.

    Phi: closed form around each circle, Gauss along the meridian between the circles that change from one-
    to two-sided (twice as many points say how far it is off), adaptive Gauss-Kronrod in time. W: around each
    circle the visited arcs are found by sampling and bisection and integrated in closed form; rectangles of time
    and meridian are quartered until what the quarters change is small. Twice that change is the error estimate,
    plus the flux of points whose search was given up. It is not a bound: a visit that falls between all sampled
    circles goes unnoticed.
    """
    faces, beta, terms = _faces(profile)

    def integral(nodes: int) -> tuple[float, float]:
        x, w = smooth_rule(nodes)

        def speed(times: Floats) -> Floats:
            out = np.empty(len(times))
            _kernels.flux(faces, beta, terms, packed.waves, times, x, w, out)
            return out

        return _adaptive(speed, 1e-11 * profile.volume)

    flux, flux_error = integral(NODES)
    flux_error += abs(integral(2 * NODES)[0] - flux)  # where a circle all but stands still
    again, again_error = _again(faces, beta, terms, packed, wanted * (profile.volume + flux), patience)
    slack = flux_error + ROUNDING * profile.volume
    return FluxVolume(profile.volume, flux, again, again_error + slack, slack)


def _again(
    faces: Floats, beta: Floats, terms: Floats, packed: Packed, tolerance: float, patience: int
) -> tuple[float, float]:
    """W and its error estimate: rectangles of time and meridian, quartered where they are not yet good."""
    nodes, weights = np.polynomial.legendre.leggauss(POINTS)
    nodes, weights = 0.5 * (nodes + 1.0), 0.5 * weights
    pair = np.stack(np.meshgrid(nodes, nodes, indexing="ij"), axis=-1).reshape(-1, 2)
    pair_weights = np.outer(weights, weights).ravel()

    def integrals(which: Ints, low: Floats, size: Floats, steps: int) -> tuple[Floats, Floats]:
        """W per rectangle, and what of the flux there was counted as new because a search was given up."""
        where = low[:, None] + size[:, None] * pair
        out, unsettled = np.empty((2, where.shape[0] * where.shape[1]))
        _kernels.reentry(
            faces, beta, packed.seg, packed.ends, packed.limits, packed.waves,
            where[..., 0].ravel(), where[..., 1].ravel(), np.repeat(which, len(pair)), steps, DEPTH, patience,
            out, unsettled,
        )  # fmt: skip
        total, unsure = (
            size.prod(axis=1) * (v.reshape(len(which), -1) @ pair_weights) for v in (out, unsettled)
        )
        return np.asarray(total), np.asarray(unsure)

    which, cell, low, size = _first(faces, beta, terms, packed.waves)
    value, unsure = integrals(which, low, size, STEPS)
    done = error = 0.0
    rest = np.abs(value)  # what a rectangle may be wrong by: all of it until its quarters are known
    for level in range(DEEPEST):
        bad = _with_neighbours(which, cell, rest > tolerance / (4.0 * max(len(rest), 16)))
        done += float(value[~bad].sum())
        error += float(rest[~bad].sum() + unsure[~bad].sum())
        which, cell, low, size, value = which[bad], cell[bad], low[bad], size[bad], value[bad]
        if not len(which):
            return done, error
        corner = np.array([(0, 0), (0, 1), (1, 0), (1, 1)])
        low = (low[:, None] + 0.5 * size[:, None] * corner).reshape(-1, 2)
        cell = (2 * cell[:, None] + corner).reshape(-1, 2)
        size, which = np.repeat(0.5 * size, 4, axis=0), np.repeat(which, 4)
        parts, unsure = integrals(which, low, size, STEPS * (level + 2))  # onsets are narrow
        gap = np.abs(parts.reshape(-1, 4).sum(axis=1) - value)
        value, rest = parts, np.repeat(gap / 2.0, 4)
        if 2.0 * float(gap.sum()) + error <= tolerance or len(which) > MOST:
            break
    return done + float(value.sum()), error + float(rest.sum() + unsure.sum())


def _first(faces: Floats, beta: Floats, terms: Floats, waves: Floats) -> tuple[Ints, Ints, Floats, Floats]:
    """First rectangles: face, place in the grid, corner and size in (t, share).

    Equal divisions, and along the meridian also the heights where the axis is slowest at some times: a pivot
    inside the tool has what is visited close around it.
    """
    state, cuts = np.zeros(12), np.zeros(8)
    which, cell, low, size = [], [], [], []
    for k in range(len(faces)):
        found = list(np.arange(FIRST[1] + 1) / FIRST[1])
        for t in np.linspace(0.0, 1.0, FIRST[0] + 1):
            pose.state(waves, t, state)
            n = _kernels.breaks_of(faces[k], beta[k], terms[k], state, cuts)
            found += list(cuts[:n])
        edges = np.sort(found)
        edges = edges[np.concatenate([[True], np.diff(edges) > 0.02])]
        edges[-1] = 1.0
        for i in range(FIRST[0]):
            for j in range(len(edges) - 1):
                which.append(k)
                cell.append((i, j))
                low.append((i / FIRST[0], edges[j]))
                size.append((1.0 / FIRST[0], edges[j + 1] - edges[j]))
    return np.array(which), np.array(cell), np.array(low), np.array(size)


def _with_neighbours(which: Ints, cell: Ints, bad: Bools) -> Bools:
    """`bad` and what touches it: a region must not end where the first circles happened to miss it."""
    near = {
        (k, i + a, j + b)
        for k, (i, j) in zip(which[bad].tolist(), cell[bad].tolist(), strict=True)
        for a in (-1, 0, 1)
        for b in (-1, 0, 1)
    }
    return np.array(
        [(k, i, j) in near for k, (i, j) in zip(which.tolist(), cell.tolist(), strict=True)], dtype=bool
    )


def _faces(profile: Profile) -> tuple[Floats, Floats, Floats]:
    """Rows of lines and arcs with the discs at both ends, their normal angles, and their `terms_of`."""
    parts = whole_meridian(profile)
    rows = [(*s[:4], *((s.cr, s.cz) if s.is_arc else (0.0, 0.0)), s.radius, 0.0) for s in parts]
    return np.array(rows), np.array([s.beta for s in parts]), np.array([terms_of(s) for s in parts])


KRONROD = np.array([
    0.991455371120812639206854697526329, 0.949107912342758524526189684047851,
    0.864864423359769072789712788640926, 0.741531185599394439863864773280788,
    0.586087235467691130294144691693013, 0.405845151377397166906606412076961,
    0.207784955007898467600689403773245, 0.0,
])  # fmt: skip
KRONROD_WEIGHTS = np.array([
    0.022935322010529224963732008058970, 0.063092092629978553290700663189204,
    0.104790010322250183839876322541518, 0.140653259715525918745189590510238,
    0.169004726639267902826583426598550, 0.190350578064785409913256402421014,
    0.204432940075298892414161999234649, 0.209482141084727828012999174891714,
])  # fmt: skip
GAUSS_WEIGHTS = np.array([
    0.129484966168869693270611432679082, 0.279705391489276667901467771423780,
    0.381830050505118944950369775488975, 0.417959183673469387755102040816327,
])  # fmt: skip


def _adaptive(f: Callable[[Floats], Floats], tolerance: float) -> tuple[float, float]:
    """Integral of f over [0, 1] and its error estimate, by halving the intervals that are not yet good."""
    x = np.concatenate([-KRONROD, KRONROD[-2::-1]])
    wk = np.concatenate([KRONROD_WEIGHTS, KRONROD_WEIGHTS[-2::-1]])
    wg = np.zeros(15)
    wg[1::2] = np.concatenate([GAUSS_WEIGHTS, GAUSS_WEIGHTS[-2::-1]])
    lo, hi = np.arange(4) / 4.0, (np.arange(4) + 1.0) / 4.0
    total = error = 0.0
    for k in range(ROUNDS):
        half = 0.5 * (hi - lo)
        values = f((0.5 * (lo + hi) + half * x[:, None]).ravel()).reshape(15, -1)
        fine, gap = half * (wk @ values), half * np.abs((wk - wg) @ values)
        good = (gap <= tolerance + 1e-13 * np.abs(fine)) | (k == ROUNDS - 1)
        total += float(fine[good].sum())
        error += float(gap[good].sum())
        lo, hi = lo[~good], hi[~good]
        if not len(lo):
            break
        middle = 0.5 * (lo + hi)
        lo, hi = np.concatenate([lo, middle]), np.concatenate([middle, hi])
    return total, error
