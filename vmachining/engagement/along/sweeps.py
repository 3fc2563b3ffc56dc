"""The earlier sweeps of a program as rows of the kernels, and which of them lie near."""

from __future__ import annotations

from typing import Any

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.engagement.along.margin._kernels import World
from vmachining.engagement.along.plan import _kernels
from vmachining.engagement.workpiece import Past
from vmachining.errors import StockError
from vmachining.stock import BoxStock, CylinderStock, MeshStock, Stock
from vmachining.sweep import Motion, Sweep
from vmachining.tool import Profile

__all__ = ["Sweeps"]

CELLS = 256
"""Cells of the plan along its longer side, at most."""


class _Rows:
    """Rows of one width that grow; `view` is what is there."""

    def __init__(self, *shape: int, kind: type = np.float64) -> None:
        self._data: Any = np.zeros((64, *shape), dtype=kind)
        self.count = 0

    def add(self, rows: Floats | Ints) -> int:
        """Append (n, ...); the index of the first."""
        first, n = self.count, len(rows)
        while first + n > len(self._data):
            self._data = np.concatenate([self._data, np.zeros_like(self._data)])
        self._data[first : first + n] = rows
        self.count += n
        return first

    @property
    def view(self) -> Any:
        return self._data[: self.count]


class Sweeps:
    """Stock and sweeps, added in program order, and a plan of cells that finds those near a place.

    Parameters
    ----------
    stock : box, upright cylinder or triangles.
    cell : mm, side of a cell of the plan; the radius of the smallest tool is good.
    """

    def __init__(self, stock: Stock, cell: float) -> None:
        one = np.zeros((1, 3))
        self.mesh = (one, one, one, np.zeros((1, 7, 3)), np.zeros((1, 6)))
        if isinstance(stock, BoxStock):
            self.kind, self.stock = 0, np.concatenate([stock.lo, stock.hi])
        elif isinstance(stock, CylinderStock):
            (x, y), r, (low, high) = stock.center, stock.radius, stock.z
            self.kind, self.stock = 1, np.array([x, y, r, low, high, 0.0])
        elif isinstance(stock, MeshStock):
            self.mesh = stock.nearest
            self.kind, self.stock = 2, stock.bounds.reshape(6)
        else:
            raise StockError(f"no kernel for a {type(stock).__name__}")
        self.bounds = stock.bounds
        size = self.bounds[1, :2] - self.bounds[0, :2]
        self.cell = float(max(cell, size.max() / CELLS))
        self.head = np.full(np.maximum(np.ceil(size / self.cell), 1).astype(np.int64), -1, dtype=np.int64)
        self.nodes, self.used = np.zeros((1024, 2), dtype=np.int64), 0
        self.box, self.form = _Rows(6), _Rows(4, kind=np.int64)
        self.start, self.path, self.tol = _Rows(3), _Rows(10), _Rows(2)
        self.frames, self.pieces = _Rows(3, 3), _Rows(4, kind=np.int64)
        self.seg, self.limits, self.waves = _Rows(10), _Rows(7), _Rows(19)
        self.block: list[int] = []
        self._tables = (
            self.box, self.form, self.start, self.path, self.tol, self.frames, self.pieces, self.seg,
            self.limits, self.waves,
        )  # fmt: skip
        self._before: list[int] = []
        self._known: dict[int, tuple[Floats, int]] = {}
        self._stamp, self._mark = np.zeros(64, dtype=np.int64), 0

    def __len__(self) -> int:
        return self.box.count

    def add(self, block: int, cutter: Profile, path: Motion) -> None:
        """A sweep of a block, for all later questions."""
        k = self.push(block, Sweep.along(cutter, path))
        ends = np.full(4, np.nan)
        if self.form.view[k, 2] == 0 and self.form.view[k, 3] < 0 and self.path.view[k, 9] == 0.0:
            a, b = self.start.view[k], self.start.view[k] + self.path.view[k, 6:9]
            if (a[:2] != b[:2]).any():
                ends = np.concatenate([a[:2], b[:2]])
        while True:
            used = _kernels.enter(
                self.head, self.nodes, self.used, self.bounds[0], self.cell, self.box.view[k], ends,
                cutter.max_radius, k,
            )  # fmt: skip
            if used >= 0:
                break
            self._drop(k)
            self.nodes = np.concatenate([self.nodes, np.zeros_like(self.nodes)])
        self.used = used

    def _drop(self, k: int) -> None:
        """Take a sweep that was entered in part out of the cells again."""
        flat = self.head.reshape(-1)
        mine = (flat >= 0) & (self.nodes[np.maximum(flat, 0), 0] == k)
        flat[mine] = self.nodes[flat[mine], 1]

    def push(self, block: int, sweep: Sweep) -> int:
        """Rows of a sweep, without a place in the plan; its index."""
        self._before = [rows.count for rows in self._tables]
        past = Past(block, sweep)
        plain, frame = past.plain
        near, turned = plain.packed
        rows = near if near is not None else turned
        assert rows is not None
        which = -1 if frame is None else self.frames.add(frame[None])
        first = self.pieces.count
        if near is not None:
            base = self._body(near.seg)
            self.pieces.add(np.column_stack([near.first[:-1] + base, near.first[1:] + base,
                                             np.zeros((len(near.first) - 1, 2), dtype=np.int64)]))  # fmt: skip
            self.limits.add(np.zeros((len(near.first) - 1, 7)))
            path = near.path
        else:
            assert turned is not None
            base, wave = self._body(turned.seg), self.waves.add(turned.waves)
            n = len(turned.ends) - 1
            seg = turned.ends[:, 2] + base
            waves = np.tile([wave, wave + len(turned.waves)], (n, 1))
            self.pieces.add(np.column_stack([seg[:-1], seg[1:], waves]))
            self.limits.add(turned.limits)
            path = np.zeros(10)
        self.path.add(path[None])
        self.form.add(np.array([[first, self.pieces.count, int(near is None), which]]))
        self.start.add(plain.path.start[None])
        self.tol.add(np.array([[rows.tol, past.touch]]))
        self.box.add(sweep.bounds.reshape(1, 6))
        self.block.append(block)
        return self.box.count - 1

    def pop(self, k: int) -> None:
        """Forget the sweep that was pushed last."""
        assert k == self.box.count - 1
        for rows, count in zip(self._tables, self._before, strict=True):
            rows.count = count
        self._known = {key: known for key, known in self._known.items() if known[1] < self.seg.count}
        self.block.pop()

    def _body(self, seg: Floats) -> int:
        """First row of the segments of a body, which many sweeps share."""
        known = self._known.get(id(seg))
        if known is None:  # the array is kept, so that its id stays its own
            known = self._known[id(seg)] = (seg, self.seg.add(seg))
        return known[1]

    @property
    def world(self) -> World:
        """For the kernels."""
        return World(
            self.kind, self.stock, self.box.view, self.form.view, self.start.view, self.path.view, self.tol.view,
            self.frames.view, self.pieces.view, self.seg.view, self.limits.view, self.waves.view,
            *self.mesh,
        )  # fmt: skip

    def near(self, region: Floats) -> Ints:
        """Sweeps whose box meets a region (2, 3) mm, the latest first."""
        n = self.box.count
        if len(self._stamp) < n:
            self._stamp = np.concatenate([self._stamp, np.zeros(max(n, len(self._stamp)), dtype=np.int64)])
        self._mark += 1
        out = np.empty(n, dtype=np.int64)
        count = _kernels.gather(
            self.head, self.nodes, self.bounds[0], self.cell, self.box.view, region.reshape(6),
            self._stamp, self._mark, out,
        )  # fmt: skip
        return np.sort(out[:count])[::-1].copy()
