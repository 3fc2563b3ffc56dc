"""Which earlier sweeps reach what a block could remove, decided by exact distances and no sampling luck.

1. A grid over x and y names the earlier sweeps whose box meets the box of the block.
2. The box of the block, clipped by the stock, is divided into cells. The signed distance d of a cell's centre
   to a sweep is 1-Lipschitz, so with half the diagonal h of the cell: d > h means the sweep misses the cell,
   d < -h means the cell lies inside it (inside, |d| never exceeds the true depth).
3. Cells that miss the block's own sweep are dead. The earlier sweep that holds most of the live cells is taken
   next and kills them, until none holds any.
4. Live cells that a sweep touches which is not taken are divided into eight, and so on, while there are not too many of
   them. Sweeps that touch no live cell are not needed: of 169 sweeps beside a pass of the flank of a cutter 32 are left.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from vmachining.arrays import Floats
from vmachining.sweep import Sweep

CELLS = 1500
"""Cells of one block to begin with: enough to see a chip a tenth of the tool wide, few enough to cost milliseconds."""

LEVELS, MOST = 6, 4000
"""Times that cells are divided, and most cells that are: a tangent neighbour touches some of any size."""

EIGHT = 0.5 * (np.stack(np.meshgrid([-1, 1], [-1, 1], [-1, 1], indexing="ij"), axis=-1).reshape(-1, 3))
"""Centres of the eighths of a cell, in units of their sides."""


class SweepIndex:
    """Boxes of sweeps in a grid over x and y. Sweeps are known by their position in the chain."""

    def __init__(
        self, sweeps: Sequence[Sweep], *, pitch: float | None = None, clip: Floats | None = None
    ) -> None:
        """pitch : mm, of the grid; None: from the sweeps. clip : (2, 3) mm, beyond which cells need not be told apart."""
        self.sweeps = list[Sweep]()
        self._boxes = np.empty((64, 2, 3))
        self._clip = clip
        if pitch is None:
            wide = [float(np.ptp(sweep.bounds[:, :2], axis=0).max()) for sweep in sweeps]
            pitch = float(np.median(wide)) if wide else 1.0
        self._pitch = max(pitch, 1e-3)
        self._cells: dict[tuple[int, int], list[int]] = defaultdict(list)
        for sweep in sweeps:
            self.add(sweep)

    def add(self, sweep: Sweep) -> int:
        """Put a sweep behind all others; its position."""
        k = len(self.sweeps)
        self.sweeps.append(sweep)
        if k == len(self._boxes):
            self._boxes = np.concatenate([self._boxes, np.empty_like(self._boxes)])
        self._boxes[k] = sweep.bounds
        for key in self._keys(self._boxes[k]):
            self._cells[key].append(k)
        return k

    def _keys(self, box: Floats) -> list[tuple[int, int]]:
        box = box if self._clip is None else np.clip(box, *self._clip)
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
        return self.needed_by(self.sweeps[target], target, clip)

    def needed_by(self, sweep: Sweep, before: int, clip: Floats) -> list[int]:
        """The same of any sweep that comes after the first `before` ones."""
        bounds = sweep.bounds
        box = np.stack([np.maximum(bounds[0], clip[0]), np.minimum(bounds[1], clip[1])])
        if (box[0] >= box[1]).any():
            return []
        candidates = self.meets(box, before)
        if not candidates:
            return []
        size = box[1] - box[0]
        pitch = max(float(np.cbrt(size.prod() / CELLS)), float(size.max()) / 40.0)
        counts = np.maximum(np.ceil(size / pitch), 1).astype(int)
        axes = [lo + (np.arange(n) + 0.5) * s / n for lo, s, n in zip(box[0], size, counts, strict=True)]
        centers = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        return [candidates[i] for i in self._chosen(sweep, candidates, centers, size / counts)]

    def _chosen(self, sweep: Sweep, candidates: Sequence[int], centers: Floats, cell: Floats) -> list[int]:
        """Which of the candidates are needed, among cells at `centers` (n, 3) with sides `cell` (3,), mm."""
        order: list[int] = []
        others = np.arange(len(candidates))
        touches = np.ones((len(candidates), len(centers)), dtype=bool)
        for level in range(LEVELS + 1):
            half = 0.5 * float(np.linalg.norm(cell)) * (1.0 + 1e-9) + 1e-9
            own = sweep.signed_distance(centers) <= half
            centers, touches = centers[own], touches[:, own]
            holds = np.zeros_like(touches)
            for i in np.flatnonzero(touches.any(axis=1)).tolist():
                where = np.flatnonzero(touches[i])
                distance = self.sweeps[candidates[i]].signed_distance(centers[where])
                touches[i, where], holds[i, where] = distance <= half, distance < -half
            touches[:, holds[order].any(axis=0)] = False
            while True:
                kills = (holds & touches)[others].sum(axis=1)
                if not kills.any():
                    break
                most = np.flatnonzero(kills == kills.max())
                best = int(others[most[touches[others[most]].sum(axis=1).argmax()]])
                order.append(best)
                others = others[others != best]
                touches[:, holds[best]] = False
            is_open = touches[others].any(axis=0)
            if level == LEVELS or not is_open.any() or is_open.sum() > MOST:
                break
            cell = 0.5 * cell
            centers = (centers[is_open][:, None] + EIGHT * cell).reshape(-1, 3)
            touches = np.repeat(touches[:, is_open], len(EIGHT), axis=1)
        reach = touches[others].sum(axis=1)
        return order + [int(i) for i in others[np.argsort(-reach, kind="stable")][: np.count_nonzero(reach)]]
