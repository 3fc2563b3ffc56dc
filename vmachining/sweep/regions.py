"""Which part of the boundary of a sweep a point belongs to: the body as it stood at first, the envelope, the body at last.

The sweep without its first thousandth is the same body wherever the surface was made later. What it lacks is what trailed the
tool at the start, ingress; what the sweep without its last thousandth lacks is egress; all else is grazing. Distances are
those of `Sweep.signed_distance`, so a facet that stands off the true surface along its normal gets the right region, too.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, Ints
from vmachining.sweep.grazing.condition import across, circles, grazing_angles, instant
from vmachining.sweep.grazing.faces import grazing_stretches, whole_meridian
from vmachining.sweep.motion import Sweep

REGIONS = ("ingress", "grazing", "egress")

FIRST = 1e-3
"""Share of the block: the border of a region is off by this share of its length at most."""

GAP_MM = 1e-6
"""Ten times what a distance may be off where a surface slides nearly along itself."""


def regions(sweep: Sweep, points: ArrayLike) -> Ints:
    """(n,) place in `REGIONS` of points (n, 3) mm on the boundary of a sweep."""
    where = np.asarray(points, dtype=np.float64)
    whole = sweep.signed_distance(where)
    later, earlier = (sweep.split([p])[k].signed_distance(where) for p, k in ((FIRST, 1), (1.0 - FIRST, 0)))
    lacks = np.stack([later - whole, np.full(len(where), GAP_MM), earlier - whole])
    return np.asarray(lacks.argmax(axis=0))


def grazing_points(sweep: Sweep, t: float, n: int = 60) -> list[Floats]:
    """Branches (m, 3) mm of the grazing curve at t in [0, 1] on the faces of the body, n points on each stretch of a face.

    Arcs on sharp edges, where a fan of normals grazes, join the branches and are not among them. A disc that slides in its own
    plane grazes all over and has no curve.
    """
    now = instant(sweep.path, t)
    x, y = across(now.axis)
    found = []
    for s in whole_meridian(sweep.profile):
        for lo, hi in grazing_stretches(s, now):
            # close where u turns fast
            p = lo + (hi - lo) * (0.5 - 0.5 * np.cos(np.pi * np.linspace(0.0, 1.0, n)))
            beta = p if s.is_arc else np.full(n, s.beta[0])
            if s.is_arc:
                h, rho = s.cz + s.radius * np.sin(beta), s.cr + s.radius * np.cos(beta)
            elif s.z0 == s.z1:
                h, rho = np.full(n, s.z0), p
            else:
                h, rho = p, s.r0 + (s.r1 - s.r0) * (p - s.z0) / (s.z1 - s.z0)
            of = circles(now, h, rho, np.cos(beta), np.sin(beta))
            # where both branches meet, at a tangent circle
            rear = of.heading + np.where(of.c > 0.0, np.pi, 0.0)
            for u in grazing_angles(of).T:
                u = np.where(np.isnan(u), rear, u)[:, None]
                found.append(now.tip + h[:, None] * now.axis + rho[:, None] * (np.cos(u) * x + np.sin(u) * y))
    return found
