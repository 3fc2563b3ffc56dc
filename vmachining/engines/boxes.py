"""Boxes of many sweeps in one array, to ask which of them meet another box."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vmachining.arrays import Bools, Floats


class Boxes:
    """Boxes of sweeps in the order that they came in, in an array that grows.

    rows : (n, 2, 3) mm.
    """

    def __init__(self, rows: Floats | None = None) -> None:
        self._rows = np.zeros((64, 2, 3)) if rows is None else rows
        self._count = 0 if rows is None else len(rows)

    def __len__(self) -> int:
        return self._count

    @property
    def rows(self) -> Floats:
        """See the class."""
        return self._rows[: self._count]

    def add(self, box: Floats | Sequence[Floats]) -> None:
        """One more."""
        self.extend([box])

    def extend(self, boxes: Sequence[Floats | Sequence[Floats]]) -> None:
        """Some more."""
        if not boxes:
            return
        stop = self._count + len(boxes)
        if stop > len(self._rows):
            self._rows = np.concatenate([self._rows, np.zeros((max(64, stop), 2, 3))])
        self._rows[self._count : stop] = boxes
        self._count = stop

    def keep(self, which: Bools) -> None:
        """Only these."""
        self._rows = self.rows[which].copy()
        self._count = len(self._rows)

    def meeting(self, box: Floats | Sequence[Floats], axes: int) -> Bools:
        """(n,) which of them overlap a box in the first so many axes."""
        lo, hi = np.array(box)[:, :axes]
        rows = self.rows[:, :, :axes]
        return np.asarray(((lo <= rows[:, 1]) & (hi >= rows[:, 0])).all(axis=1))
