"""Neighbouring facets of a cutter kept together, so that a tile looks only at those that are near it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats, Ints

__all__ = ["Clusters", "clustered"]

SIZE = 24
"""Patches in a cluster, at most: looking at a box costs about as much as looking at three of them."""


class Clusters(NamedTuple):
    """Groups of facets that lie together.

    first : (h + 1, 3); group i has the triangles, the edges and the patches from the numbers in row i up to those
    in the next. boxes : (h, 2, 3) mm, around all their corners.
    """

    first: Ints
    boxes: Floats


def clustered(
    points: Floats, triangles: Ints, edges: Ints, patches: Ints
) -> tuple[Clusters, Ints, Ints, Ints]:
    """Put the facets of a polyhedron in groups, see `Polyhedron` for the arrays.

    An edge goes with the triangle on its left.

    Returns
    -------
    (Clusters, (m,) int, (k, 4) int, (l, 6) int)
        Which triangle is where now, and the edges and patches in their new order with the new numbers.
    """
    group = _groups(points[patches[:, 2:]].mean(axis=1))
    of_triangle = np.empty(len(triangles), dtype=np.int64)
    for column in (0, 1):
        has = patches[:, column] >= 0
        of_triangle[patches[has, column]] = group[has]
    order = np.argsort(of_triangle, kind="stable")
    number = np.empty_like(order)
    number[order] = np.arange(len(order))
    of_edge = of_triangle[edges[:, 2]]
    edges = np.column_stack([edges[:, :2], number[edges[:, 2:]]])[np.argsort(of_edge, kind="stable")]
    pairs = np.where(patches[:, :2] >= 0, number[patches[:, :2]], -1)
    patches = np.column_stack([pairs, patches[:, 2:]])[np.argsort(group, kind="stable")]
    count = int(group.max()) + 1
    sizes = [np.bincount(of, minlength=count) for of in (of_triangle, of_edge, group)]
    first = np.zeros((count + 1, 3), dtype=np.int64)
    first[1:] = np.cumsum(sizes, axis=1).T
    corners = points[triangles[order]]
    low = np.minimum.reduceat(corners.min(axis=1), first[:-1, 0])
    high = np.maximum.reduceat(corners.max(axis=1), first[:-1, 0])
    return Clusters(first, np.stack([low, high], axis=1)), order, edges, patches


def _groups(places: Floats) -> Ints:
    """(l,) numbers of groups: places (l, 3) are halved across their longest side until the groups are small."""
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
