"""Flat faces that the tool leaves and enters again during a block: a pocket of the grazing curve, and what fills it.

A disc with a round corner that tilts about a line in it trails on one side of its chord while all around it leads.
The grazing curve has a loop of its own there: the chord, and an arc on the corner. The chord passes from the trailing to the
leading side, phi_tt < 0, so its sheet lies inside the sweep. The sheet of the arc lies hardly outside of the first and last
pose, where it does at all. So the sweep is the union of

- the solid whose curve has no loop, as if its tool led all over the disc,
- some poses, as many as come near enough to the arc (exact distances).

A disc that leads in part while all around it trails is the same backwards in time.

The solid without the loop has the volume V(K) + Phi less what the loop's inside adds to the flux with the wrong sign.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.brep.envelopes.rings import Element, Ring, rings_of
from vmachining.engines.brep.translations.caps import Tool
from vmachining.sweep import Sweep, Turn
from vmachining.sweep.folds import least_count, standing
from vmachining.sweep.grazing import (
    Instant,
    across,
    arc_terms,
    circles,
    folding,
    grazing_angles,
    instant,
    scalars,
)
from vmachining.tool import Profile, Segment

TIMES = 16
"""Instants, in the middle of equal parts, at which a pocket has to lie inside."""

PANELS, NODES = 24, 6
"""Of the flux through a pocket in time; as many nodes per panel of the radius and of the corner."""

LOOKS = 9
"""Circles of the corner at which a pocket is looked at."""

FAR = np.array([0.02, 0.05, 0.1, 0.2, 0.5])
"""Shares of the rest of a block before and after a part, whose poses may cover what the part lacks."""


class Pocket(NamedTuple):
    """ring : of the disc, in the order of `rings_of`. sign : 1 where all around it leads, -1 where it trails."""

    ring: int
    sign: int

    def place(self, profile: Profile) -> tuple[Ring, Element]:
        """The disc and its round corner."""
        rings, elements = rings_of(Tool.of(profile))
        arc = _corner(elements, self.ring)
        assert arc is not None
        return rings[self.ring], arc

    def heights(self, profile: Profile) -> tuple[float, float]:
        """mm between which the loop lies: of the disc and of the far end of its corner."""
        disc, arc = self.place(profile)
        return disc.z, arc.segment.z1 if arc.segment.z0 == disc.z else arc.segment.z0

    def poses(
        self, profile: Profile, path: Turn, span: tuple[float, float], gap: float, most: int
    ) -> int | None:
        """Least number of equal parts of a part of a block whose ends come within `gap` mm of the sheet of the arc.

        What other parts of the block sweep counts, too. None above `most`.
        """
        a, b = span
        away = [Sweep.along(profile, standing(path, t)) for t in (*(a * (1.0 - FAR)), *(b + (1.0 - b) * FAR))]
        part = path.part(a, b)
        return least_count(lambda count: self._missing(profile, part, count, away), gap, most)

    def _missing(self, profile: Profile, path: Turn, count: int, away: list[Sweep]) -> float:
        """mm between the arcs and `count` + 1 poses, or those away, at instants between them."""
        (disc, arc), worst = self.place(profile), 0.0
        stood = [Sweep.along(profile, standing(path, k / count)) for k in range(count + 1)]
        for k in range(count):
            near = [stood[i] for i in sorted({0, k, k + 1, count // 2, count})] + away
            for t in (0.25, 0.5, 0.75) if count > 1 else np.linspace(0.0, 1.0, 9)[1:-1]:
                points = _arc_points(instant(path, (k + float(t)) / count), arc, disc)
                if len(points):
                    gap = np.min([pose.signed_distance(points) for pose in near], axis=0)
                    worst = max(worst, float(gap.max()))
        return worst

    def flux(self, profile: Profile, path: Turn) -> float:
        """mm^3 by which the solid without the loop differs from V(K) + Phi."""
        disc, arc = self.place(profile)
        x, w = np.polynomial.legendre.leggauss(NODES)
        t = ((np.arange(PANELS)[:, None] + 0.5 * (x + 1.0)) / PANELS).ravel()
        weights = np.tile(0.5 * w / PANELS, PANELS)
        return float(weights @ [self._inflow(path, float(s), disc, arc) for s in t])

    def _inflow(self, path: Turn, t: float, disc: Ring, arc: Element) -> float:
        """mm^3 per unit of t with the wrong sign, on the disc and its corner."""
        now = instant(path, t)
        x, w = np.polynomial.legendre.leggauss(4 * NODES)
        x, w = 0.5 * (x + 1.0), 0.5 * w
        x, w = x * x * (3.0 - 2.0 * x), w * 6.0 * x * (1.0 - x)  # smooth where circles begin to graze
        size = float(np.linalg.norm(now.axis_rate))
        first = abs(float(now.velocity @ now.axis)) / size if size > 0.0 else disc.r
        total = 0.0
        if first < disc.r:
            rho, weight = first + x * (disc.r - first), w * (disc.r - first)
            total += float((weight * rho) @ self._wrong(now, disc.z, rho, 0.0, np.sin(disc.beta)))
        far = _calm(now, arc, disc)
        if far is None:
            return total
        g = arc.segment
        beta = disc.beta + x * (far[1] - disc.beta)
        rho, z = g.cr + g.radius * np.cos(beta), g.cz + g.radius * np.sin(beta)
        wrong = self._wrong(now, z, rho, np.cos(beta), np.sin(beta))
        return total + float((w * abs(far[1] - disc.beta) * g.radius * rho) @ wrong)

    def _wrong(self, now: Instant, *place: Floats | float) -> Floats:
        """(n,) integrals around circles of the part of f whose sign is not `sign`."""
        a, b, c = circles(now, *np.broadcast_arrays(*place))
        reach, level = np.hypot(a, b), self.sign * c
        half = np.arccos(np.clip(level / np.maximum(reach, 1e-300), -1.0, 1.0))
        return np.asarray(np.where(level >= reach, 0.0, 2.0 * (level * half - reach * np.sin(half))))


def pockets(profile: Profile, path: Turn) -> Iterator[Pocket]:
    """Discs with a pocket that lies inside the sweep during all of a block."""
    rings, elements = rings_of(Tool.of(profile))
    for k in {0, len(rings) - 1}:
        arc = _corner(elements, k)
        if not rings[k].disc or arc is None:
            continue
        signs = {_sign(path, (i + 0.5) / TIMES, rings[k], arc) for i in range(TIMES)}
        if len(signs - {None}) == 1 and None not in signs:
            yield Pocket(k, int(signs.pop() or 0))


def _corner(elements: list[Element], ring: int) -> Element | None:
    """The round corner next to a disc."""
    return next((e for e in elements if e.kind == "arc" and ring in (e.lower, e.upper)), None)


def _sign(path: Turn, t: float, disc: Ring, arc: Element) -> int | None:
    """How all around the pocket of a disc moves; None if the loop meets the rest of the curve, or does not lie inside."""
    now, g = instant(path, t), arc.segment
    calm = _calm(now, arc, disc)
    if calm is None:
        return None
    lowest, edge = calm
    sign = _side(now, g, lowest)
    if edge == disc.beta:  # no pocket now
        return sign
    u = grazing_angles(circles(now, *np.array([[disc.z], [disc.r], [0.0], [np.sign(disc.beta)]])))
    chord = folding(now, disc.z, disc.r, 0.0, np.sign(disc.beta), u[0], 0.0)
    return sign if (chord < 0.0).all() else None


def _arc_points(now: Instant, arc: Element, disc: Ring) -> Floats:
    """(n, 3) mm: points of the loop on the corner; none while it has no loop."""
    calm, g = _calm(now, arc, disc), arc.segment
    if calm is None or calm[1] == disc.beta:
        return np.empty((0, 3))
    beta = disc.beta + (calm[1] - disc.beta) * np.sin(np.linspace(0.0, 0.5 * np.pi, LOOKS))
    z, r = g.cz + g.radius * np.sin(beta), g.cr + g.radius * np.cos(beta)
    u = grazing_angles(circles(now, z, r, np.cos(beta), np.sin(beta))).T
    x, y = across(now.axis)
    m = np.cos(u)[..., None] * x + np.sin(u)[..., None] * y
    points = now.tip + z[:, None] * now.axis + r[:, None] * m
    return np.asarray(points[np.isfinite(points).all(axis=-1)])


def _side(now: Instant, g: Segment, beta: float) -> int:
    """Whether a circle of the corner that does not graze leads or trails."""
    place = g.cz + g.radius * np.sin(beta), g.cr + g.radius * np.cos(beta), np.cos(beta), np.sin(beta)
    return int(np.sign(circles(now, *place).c))


def _calm(now: Instant, arc: Element, disc: Ring) -> tuple[float, float] | None:
    """Normal angles of the corner: of a circle that grazes least, and where circles cease to graze, seen from the disc.

    None if all of them graze. p cos^2 b + q cos b sin b + s sin^2 b < 0 of those that do not.
    """
    g = arc.segment
    p, q, s = arc_terms(g.cr, g.cz) @ scalars(now.velocity, now.axis_rate, now.axis)
    b0, b1 = g.beta

    def form(beta: Floats) -> Floats:
        return np.asarray(p * np.cos(beta) ** 2 + q * np.cos(beta) * np.sin(beta) + s * np.sin(beta) ** 2)

    far = 0.5 * float(np.arctan2(q, p - s)) + 0.5 * np.pi * np.array([-1.0, 1.0])
    spots = np.array([b0, b1, *far[(far > b0) & (far < b1)]])
    values = form(spots)
    k = int(np.argmin(values))
    if values[k] >= 0.0:
        return None
    lowest, edge = float(spots[k]), disc.beta
    if form(np.array([edge]))[0] > 0.0:
        lo, hi = edge, lowest
        for _ in range(60):
            middle = 0.5 * (lo + hi)
            lo, hi = (middle, hi) if form(np.array([middle]))[0] > 0.0 else (lo, middle)
        edge = lo
    return lowest, edge
