"""A binary tree of boxes over things in order: node k stands over nodes 2 k + 1 and 2 k + 2, the last P are leaves."""

from __future__ import annotations

import numpy as np

from vmachining.arrays import Floats, Ints

BITS = 21
"""Of each coordinate in a Morton code of 64 bits."""


def curve_order(points: Floats) -> Ints:
    """Order of points (n, 2 or 3) along a Morton curve: neighbours in space come close to each other."""
    low, size = points.min(axis=0), max(float(np.ptp(points, axis=0).max()), 1e-300)
    cell = ((points - low) * ((2**BITS - 1) / size)).astype(np.uint64)
    code = np.zeros(len(points), dtype=np.uint64)
    dims = points.shape[1]
    for bit in range(BITS):
        for axis in range(dims):
            code |= ((cell[:, axis] >> np.uint64(bit)) & np.uint64(1)) << np.uint64(dims * bit + axis)
    return np.argsort(code, kind="stable")


def box_tree(low: Floats, high: Floats, leaf: int) -> Floats:
    """(2 P - 1, 6): boxes of a tree over boxes (n, 3), `leaf` neighbours in a leaf; an empty leaf has inf above -inf."""
    leaves = 1 << max(0, (-(-len(low) // leaf) - 1).bit_length())
    boxes = np.empty((2 * leaves - 1, 6))
    for part, values, empty, reduce in (
        (slice(0, 3), low, np.inf, np.min),
        (slice(3, 6), high, -np.inf, np.max),
    ):
        padded = np.full((leaves * leaf, 3), empty)
        padded[: len(values)] = values
        level = reduce(padded.reshape(leaves, leaf, 3), axis=1)
        while True:
            boxes[len(level) - 1 : 2 * len(level) - 1, part] = level
            if len(level) == 1:
                break
            level = reduce(level.reshape(-1, 2, 3), axis=1)
    return boxes
