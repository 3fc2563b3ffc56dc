"""Neighbouring facets of a cutter kept together, so that a tile looks only at those that are near it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats, Ints

__all__ = ["Clusters", "clustered"]

SIZE = 48
"""Triangles in a cluster, at most: looking at a box costs about as much as looking at six of them."""


class Clusters(NamedTuple):
    """Groups of facets that lie together.

    first : (h + 1, 2); group i has the triangles and the edges from the numbers in row i up to those in the next.
    boxes : (h, 2, 3) mm, around all their corners.
    """

    first: Ints
    boxes: Floats


def clustered(points: Floats, triangles: Ints, edges: Ints) -> tuple[Clusters, Ints, Ints]:
    """Put the facets of a polyhedron in groups, see `Polyhedron` for the arrays.

    An edge goes with the triangle on its left.

    Returns
    -------
    (Clusters, (m,) int, (k, 4) int)
        Which triangle is where now, and the edges in their new order with the new numbers.
    """
    group = _groups(points[triangles].mean(axis=1))
    order = np.argsort(group, kind="stable")
    number = np.empty_like(order)
    number[order] = np.arange(len(order))
    of_edge = group[edges[:, 2]]
    edges = np.column_stack([edges[:, :2], number[edges[:, 2:]]])[np.argsort(of_edge, kind="stable")]
    count = int(group.max()) + 1
    first = np.zeros((count + 1, 2), dtype=np.int64)
    first[1:] = np.cumsum([np.bincount(of, minlength=count) for of in (group, of_edge)], axis=1).T
    corners = points[triangles[order]]
    low = np.minimum.reduceat(corners.min(axis=1), first[:-1, 0])
    high = np.maximum.reduceat(corners.max(axis=1), first[:-1, 0])
    return Clusters(first, np.stack([low, high], axis=1)), order, edges


def _groups(places: Floats) -> Ints:
    """(m,) numbers of groups: places (m, 3) are halved across their longest side until the groups are small."""
    out = np.zeros(len(places), dtype=np.int64)
    stack, count = [np.arange(len(places))], 0
    while stack:
        these = stack.pop()
        if len(these) <= SIZE:
            out[these] = count
            count += 1
            continue
        spread = places[these]
        along = spread[:, int(np.argmax(np.ptp(spread, axis=0)))]
        these = these[np.argsort(along, kind="stable")]
        stack += [these[len(these) // 2 :], these[: len(these) // 2]]
    return out
