"""Force of all teeth over one revolution at a place of a block, as functions of the feed."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.engagement.along import Cutting, Sample, Teeth, blade
from vmachining.force import _kernels
from vmachining.force.coefficients import Coefficients

Component = Literal["resultant", "xy", "tangential", "torque", "power", "deflection"]
COMPONENTS: tuple[Component, ...] = ("resultant", "xy", "tangential", "torque", "power", "deflection")
"""What a limit may be put on: peak of the force in space, of its part across the axis, of the sum of the tangential
forces, of the torque; mean power; peak deflection of the tool as a cantilever."""

NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)
"""Of every engaged stretch: exact for cubic coefficients on the cylinder, 1e-9 relative on a quarter of a circle."""


class Load(NamedTuple):
    """At chip scale c (chip thickness c max(0, N . V)) every number is slope c + edge.

    angles : (n, 10) force slope (3) and edge (3) in the tool frame, N; torque slope, edge, N mm; tangential slope, edge, N.
    mean_torque : slope, edge, N mm. heights : lowest and highest place that cuts, mm above the tip.
    """

    angles: Floats
    mean_torque: tuple[float, float]
    heights: tuple[float, float]

    def peak(self, scale: float) -> float:
        """N, largest resultant over the revolution."""
        force = scale * self.angles[:, 0:3] + self.angles[:, 3:6]
        return float(np.sqrt((force**2).sum(axis=1).max())) if len(force) else 0.0

    def torque(self, scale: float) -> float:
        """N mm, mean over the revolution."""
        return scale * self.mean_torque[0] + self.mean_torque[1]


def turn_load(sample: Sample, teeth: Teeth, coefficients: Coefficients, *, spin: int = 1) -> Load | None:
    """Loads of a sample; None in air.

    Angles are those of the grid within one pitch, and of a straight edge the ends of the arcs and both sides of jumps,
    each with all teeth at their places.
    """
    found = _edge_sums(sample, teeth, coefficients, spin)
    if found is None:
        return None
    cutting, out, heights = found
    m, grid = teeth.number, cutting.grid
    even = out[:grid].reshape(m, grid // m, 10).sum(axis=0)
    table = [even]
    if teeth.helical is not None:
        mean = out[:grid, 6:8].mean(axis=0) * m
    else:
        mean = _mean_torque(cutting, out) * m
        special = cutting.own - cutting.grid
        if special and (m == 1 or len(cutting.phi) > cutting.own):
            rows = out[cutting.grid : cutting.own].copy()
            for j in range(1, m):
                rows += out[cutting.own + (j - 1) * special : cutting.own + j * special]
            table.append(rows)
    return Load(
        np.concatenate(table), (float(mean[0]), float(mean[1])), (float(heights[0]), float(heights[1]))
    )


def _edge_sums(
    sample: Sample, teeth: Teeth, coefficients: Coefficients, spin: int
) -> tuple[Cutting, Floats, Floats] | None:
    """What cuts, sums of one tooth at all its angles, and the heights met."""
    cutting = sample.helical if teeth.helical is not None else sample.straight
    if cutting is None:
        return None
    edge = teeth.edge if teeth.helical is None else teeth.helical
    chi = float(np.arctan(edge.twist * edge.profile.max_radius))
    now = sample.now
    frame = now[[12, 13, 14, 15, 16, 17, 3, 4, 5]].reshape(3, 3)
    local = np.concatenate([frame @ now[6:9], (frame @ now[9:12])[:2]])
    motion = np.broadcast_to(local, (len(cutting.phi), 5)).copy()
    out, heights = np.empty((len(cutting.phi), 10)), np.array([np.inf, -np.inf])
    _kernels.edge_forces(
        blade(edge), np.ascontiguousarray(cutting.hits), cutting.phi, motion, coefficients.powers, chi, float(spin), NODES,
        WEIGHTS, heights, out,
    )  # fmt: skip
    return cutting, out, heights


def turn_series(
    sample: Sample, teeth: Teeth, coefficients: Coefficients, scale: float, *, spin: int = 1
) -> tuple[Floats, Floats]:
    """One revolution: phi (n,) rad of the first tooth, rising over a turn, and columns (n, 5) at a chip scale.

    Columns: force in the tool frame (3), N; torque, N mm; tangential force, N. Without a contact one row of zeros.
    """
    found = _edge_sums(sample, teeth, coefficients, spin)
    if found is None:
        return np.zeros(1), np.zeros((1, 5))
    cutting, out, _ = found
    m, grid = teeth.number, cutting.grid
    even = np.tile(out[:grid].reshape(m, grid // m, 10).sum(axis=0), (m, 1))
    phi = cutting.phi[:grid]
    order = np.argsort(phi, kind="stable")
    columns = scale * even[:, [0, 1, 2, 6, 8]] + even[:, [3, 4, 5, 7, 9]]
    return phi[order], columns[order]


def _mean_torque(cutting: Cutting, out: Floats) -> Floats:
    """(2,) slope and edge of one tooth, mean over the turn."""
    phi = cutting.phi[: cutting.own] % (2.0 * np.pi)
    cuts = np.zeros(cutting.own, dtype=np.bool_)
    index = cutting.hits[:, 0].astype(np.int64)
    cuts[index[index < cutting.own]] = True
    order = np.argsort(phi, kind="stable")
    widest = 2.0 * np.pi / cutting.grid * (1.0 + 1e-9)
    both = [
        _kernels.over_turn(order, phi, cuts, np.ascontiguousarray(out[: cutting.own, k]), widest)
        for k in (6, 7)
    ]
    return np.array(both) / (2.0 * np.pi)


def load_rows(load: Load, component: Component, per_feed: float, top: float, watt: float = 1.0) -> Floats:
    """(k, 3) rows p, q, r: the component (its square for forces) is the largest p f^2 + 2 q f + r, f from 0 to `top`.

    per_feed : chip scale per mm of feed per tooth. watt : W per N mm of mean torque, for "power".
    """
    t = load.angles
    if component == "power":
        return np.array([[0.0, 0.5 * watt * per_feed * load.mean_torque[0], watt * load.mean_torque[1]]])
    rows = np.empty((len(t), 3))
    if component in ("tangential", "torque"):
        k = 8 if component == "tangential" else 6
        rows[:, 0], rows[:, 1], rows[:, 2] = 0.0, 0.5 * per_feed * t[:, k], t[:, k + 1]
    else:
        n = 3 if component == "resultant" else 2
        a, b = per_feed * t[:, 0:n], t[:, 3 : 3 + n]
        rows[:, 0], rows[:, 1], rows[:, 2] = (a * a).sum(axis=1), (a * b).sum(axis=1), (b * b).sum(axis=1)
    out = np.empty((min(len(rows), 24), 3))
    return out[: _kernels.envelope(rows, top, out)].copy()


def feasible_feeds(rows: Floats, first: Ints, last: Ints, level: Floats) -> Floats:
    """(m,) largest x at which the rows p x^2 + 2 q x + r of a part, `first` to `last`, stay below its level.

    0 where even x = 0 is too much, inf for a part without rows.
    """
    out = np.empty(len(first))
    _kernels.feasible(rows, first, last, np.ascontiguousarray(level, dtype=np.float64), out)
    return out


def peak_levels(rows: Floats, first: Ints, last: Ints, x: Floats) -> Floats:
    """(m,) largest p x^2 + 2 q x + r of the rows of every part; 0 without rows."""
    out = np.empty(len(first))
    _kernels.peaks(rows, first, last, np.ascontiguousarray(x, dtype=np.float64), out)
    return out
