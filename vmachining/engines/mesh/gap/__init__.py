"""The gap between the facets of an inner cutter and the surface they stand for.

Over the plane of a facet the surface of a convex body is a concave function, the gap. Its largest value follows
from supports in closed form, its mean from a quadrature. An upper bound of its integral needs no more than points:
a concave function lies below its tangents, and the integral of a linear function over a triangle is its value at
the centroid; the sum over small triangles is a bound, and close (3 % for nine of them). How far the tangents slope is
kept, for `vmachining.engines.mesh.skin` looks at the gap along lines that are not quite normal to the facet.

The shadow of the cutter along its way, over an edge of the silhouette, is the same in a plane. There any line that
supports the shadow will do for a tangent.

| file | holds |
|---|---|
| `_kernels.py` | supports, gaps, shadows |

Source: derived here; Jensen's inequality, supports of convex bodies.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.engines.mesh.gap import _kernels

__all__ = ["Gauge", "facet_means", "gauge", "supports"]

facet_means = _kernels.facet_means


class Gauge(NamedTuple):
    """How far the facets of an inner cutter lie below its surface.

    most, mean : (m,) mm, along the normal of each facet. bulk : (m,) mm^3, a bound of what is between facet and
    surface, by tangents of at most slope (m, 2), sideways and up. plumb : (m,) mm, height of facets of a
    cylinder, or 0. meridian : (k, 10) rows of the true cutter.
    """

    most: Floats
    mean: Floats
    bulk: Floats
    slope: Floats
    plumb: Floats
    meridian: Floats


def gauge(points: Floats, triangles: Ints, normals: Floats, planes: Ints, meridian: Floats) -> Gauge:
    """Gauge of a polyhedron inside a convex body; triangles in one plane get one mean.

    points (n, 3), triangles (m, 3), unit normals (m, 3), planes (m,): equal in one plane.
    """
    most, mean, bulk, plumb = np.empty((4, len(triangles)))
    slope = np.empty((len(triangles), 2))
    _kernels.gauge(points, triangles, normals, meridian, most, mean, bulk, slope, plumb)  # type: ignore[no-untyped-call]
    a, b, c = (points[triangles[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    whole = np.maximum(np.bincount(planes, area), 1e-300)
    return Gauge(most, (np.bincount(planes, area * mean) / whole)[planes], bulk, slope, plumb, meridian)


def supports(meridian: Floats, normals: Floats) -> Floats:
    """(k,) support of a convex body of revolution in directions (k, 2) of (n_r, n_z), n_r >= 0."""
    return np.array([_kernels.support(meridian, *n) for n in normals.tolist()])  # type: ignore[no-untyped-call]
