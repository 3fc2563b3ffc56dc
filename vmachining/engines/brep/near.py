"""Which earlier sweeps reach what a block could remove, decided by exact distances and no sampling luck.

1. A grid over x and y names the earlier sweeps whose box meets the box of the block.
2. The box of the block, clipped by the stock, is divided into cells. The signed distance d of a cell's centre
   to a sweep is 1-Lipschitz, so with half the diagonal h of the cell: d > h means the sweep misses the cell,
   d < -h means the cell lies inside it (inside, |d| never exceeds the true depth).
3. Cells that miss the block's own sweep are dead. The earlier sweep that holds most of the live cells is taken
   next and kills them; a sweep that touches no live cell is not needed.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from vmachining.arrays import Floats
from vmachining.sweep import Sweep

__all__ = ["SweepIndex"]

CELLS = 1500
"""Cells of one block: enough to see a chip a tenth of the tool wide, few enough to cost milliseconds."""


class SweepIndex:
    """Boxes of sweeps in a grid over x and y. Sweeps are known by their position in the chain."""

    def __init__(self, sweeps: Sequence[Sweep]) -> None:
        self._sweeps = sweeps
        self._boxes = np.array([s.bounds for s in sweeps]).reshape(-1, 2, 3)
        spans = np.ptp(self._boxes[:, :, :2], axis=1) if len(sweeps) else np.ones((1, 2))
        self._pitch = float(max(np.median(spans.max(axis=1)), 1e-3))
        self._cells: dict[tuple[int, int], list[int]] = defaultdict(list)
        for k, box in enumerate(self._boxes):
            for key in self._keys(box):
                self._cells[key].append(k)

    def _keys(self, box: Floats) -> list[tuple[int, int]]:
        (i0, j0), (i1, j1) = np.floor(box[:, :2] / self._pitch).astype(int).tolist()
        return [(i, j) for i in range(i0, i1 + 1) for j in range(j0, j1 + 1)]

    def meets(self, box: Floats, before: int) -> list[int]:
        """Sweeps before a position whose box meets a box (2, 3)."""
        found: set[int] = set()
        for key in self._keys(box):
            found.update(k for k in self._cells.get(key, ()) if k < before)
        ks = np.array(sorted(found), dtype=np.int64)
        if not len(ks):
            return []
        boxes = self._boxes[ks]
        hit = ((boxes[:, 0] < box[1]) & (boxes[:, 1] > box[0])).all(axis=1)
        return [int(k) for k in ks[hit]]

    def needed(self, target: int, clip: Floats) -> list[int]:
        """Earlier sweeps that must be subtracted from sweep `target` within a box, those that take most first.

        clip : (2, 3) mm, box of the stock.
        """
        box = np.stack([
            np.maximum(self._boxes[target, 0], clip[0]), np.minimum(self._boxes[target, 1], clip[1])
        ])  # fmt: skip
        if (box[0] >= box[1]).any():
            return []
        candidates = self.meets(box, target)
        if not candidates:
            return []
        size = box[1] - box[0]
        pitch = max(float(np.cbrt(size.prod() / CELLS)), float(size.max()) / 40.0)
        counts = np.maximum(np.ceil(size / pitch), 1).astype(int)
        axes = [lo + (np.arange(n) + 0.5) * s / n for lo, s, n in zip(box[0], size, counts, strict=True)]
        centers = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        half = 0.5 * float(np.linalg.norm(size / counts)) * (1.0 + 1e-9) + 1e-9
        centers = centers[self._sweeps[target].signed_distance(centers) <= half]
        touched: dict[int, np.ndarray] = {}
        holds: dict[int, np.ndarray] = {}
        for k in candidates:
            distance = self._sweeps[k].signed_distance(centers)
            if (distance <= half).any():
                touched[k], holds[k] = distance <= half, distance < -half
        live = np.ones(len(centers), dtype=bool)
        order: list[int] = []
        while touched:
            best = max(touched, key=lambda k: (int((holds[k] & live).sum()), int((touched[k] & live).sum())))
            if not (touched[best] & live).any():
                break
            order.append(best)
            live &= ~holds[best]
            del touched[best], holds[best]
            for k in [k for k in touched if not (touched[k] & live).any()]:
                del touched[k], holds[k]
        return order
