"""`Cuts`: the sweeps that have cut, and which of them made a length: it is asked again instead of being kept for all."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from typing import Any, Self

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.engines.packed import packed_sweeps, sweeps_of
from vmachining.engines.vectors.grid import _kernels
from vmachining.sweep import Sweep
from vmachining.sweep.ball import BallBlock

TOLD = 1e-6
"""mm by which a tip may lie off the sweep that made it, beside the rounding of its float32 length."""

CELL_TIPS = 8
"""Tips in a cell of their index, about."""


class Cuts:
    """Sweeps in the order in which they cut: blocks of ball cutters on lines as rows of numbers, others as they are."""

    def __init__(self) -> None:
        self._balls = array("d")
        self._ball_order = array("q")
        self._others: list[tuple[int, Sweep]] = []
        self._block = array("q")

    def __len__(self) -> int:
        return len(self._block)

    def add(self, sweep: Sweep, ball: BallBlock | None, block: int | None) -> None:
        """One more. ball : the same sweep, where it is one of a ball cutter."""
        if ball is not None:
            self._balls.extend(ball.row)
            self._ball_order.append(len(self._block))
        else:
            self._others.append((len(self._block), sweep))
        self._block.append(-1 if block is None else block)

    @property
    def others(self) -> list[int]:
        """Places in the order of the sweeps that are kept as they are."""
        return [place for place, _ in self._others]

    def packed(self) -> dict[str, Any]:
        """Arrays by name, see `unpacked`."""
        numbers = {"balls": self._balls, "ball_order": self._ball_order, "block": self._block}
        arrays = {name: np.array(values) for name, values in numbers.items()}
        return arrays | packed_sweeps([sweep for _, sweep in self._others])

    @classmethod
    def unpacked(cls, arrays: dict[str, Any], others: Sequence[int]) -> Self:
        """What `packed` gave. others : see there."""
        self = cls()
        for own, name in ((self._balls, "balls"), (self._ball_order, "ball_order"), (self._block, "block")):
            own.extend(arrays[name].tolist())
        self._others = list(zip(others, sweeps_of(arrays), strict=True))
        return self

    def owners(self, tips: Floats, length: Floats) -> Ints:
        """(n,) block of the first sweep that reaches a tip (n, 3), -1 where none does. length : (n,) mm, of the vectors.

        Lengths are the shortest over all blocks, so no sweep reaches beyond a tip (but from behind), and the first that
        touches it made it.
        """
        first = self.first(tips, length)
        return np.where(first < 0, -1, np.array([*self._block, -1])[first])

    def first(self, tips: Floats, length: Floats) -> Ints:
        """(n,) place in the order of the first sweep that reaches a tip, -1 where none does."""
        out = np.full(len(tips), len(self._block), dtype=np.int64)
        if not len(tips) or not self._block:
            return np.full(len(tips), -1)
        slack = TOLD + np.spacing(np.abs(length).astype(np.float32)).astype(np.float64)
        self._first_ball(tips, slack, out)
        order = np.argsort(tips[:, 0], kind="stable")
        x = tips[order, 0]
        for place, sweep in self._others:
            box = sweep.bounds + [[-1e-3], [1e-3]]
            near = order[np.searchsorted(x, box[0, 0]) : np.searchsorted(x, box[1, 0])]
            near = near[out[near] > place]
            near = near[((tips[near] >= box[0]) & (tips[near] <= box[1])).all(axis=1)]
            if len(near):
                out[near[sweep.signed_distance(tips[near]) <= slack[near]]] = place
        return np.where(out == len(self._block), -1, out)

    def _first_ball(self, tips: Floats, slack: Floats, out: Ints) -> None:
        if not self._balls:
            return
        low, wide = tips[:, :2].min(axis=0), np.ptp(tips[:, :2], axis=0)
        count = max(1, len(tips) // CELL_TIPS)
        cell = max(float(np.sqrt(wide.prod() / count)), float(wide.max()) / count, 1e-9)
        cells = np.floor(wide / cell).astype(np.int64) + 1
        at = np.minimum(np.floor((tips[:, :2] - low) / cell).astype(np.int64), cells - 1)
        key = at[:, 0] * cells[1] + at[:, 1]
        order = np.argsort(key, kind="stable")
        first = np.searchsorted(key[order], np.arange(int(cells.prod()) + 1)).astype(np.int64)
        found = out[order]
        balls, place = np.array(self._balls).reshape(-1, 8), np.array(self._ball_order, dtype=np.int64)
        _kernels.first_balls(
            balls, place, np.ascontiguousarray(tips[order]), slack[order], first, cells, float(low[0]), float(low[1]), cell, found
        )  # fmt: skip
        out[order] = found
