"""Sweeps that one engine has cut and another one may still have to cut, as rows of arrays: a few hundred bytes each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Self

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.engines.columns.store import PATH, packed_path, packed_profiles, path_of, profiles_of
from vmachining.sweep import Sweep, Turn
from vmachining.tool import Profile

__all__ = ["Boxes", "Noted"]

NO_BLOCK = -1


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
        if self._count == len(self._rows):
            self._rows = np.concatenate([self._rows, np.zeros((max(64, self._count), 2, 3))])
        self._rows[self._count] = box
        self._count += 1

    def keep(self, which: Bools) -> None:
        """Only these."""
        self._rows = self.rows[which].copy()
        self._count = len(self._rows)

    def meeting(self, box: Floats | Sequence[Floats], axes: int) -> Bools:
        """(n,) which of them overlap a box in the first so many axes."""
        lo, hi = np.array(box)[:, :axes]
        rows = self.rows[:, :, :axes]
        return np.asarray(((lo <= rows[:, 1]) & (hi >= rows[:, 0])).all(axis=1))


class Noted:
    """Sweeps of upright tools in the order they came, with the numbers of their blocks."""

    def __init__(self) -> None:
        self.boxes = Boxes()
        self._rows = np.zeros((64, PATH + 2))  # path, tool, block
        self._profiles: list[Profile] = []
        self._tools: dict[int, int] = {}

    def __len__(self) -> int:
        return len(self.boxes)

    @property
    def blocks(self) -> Ints:
        """(n,) numbers of their blocks, -1 where none was given."""
        return np.asarray(self._rows[: len(self), PATH + 1].astype(np.int64))

    def add(self, sweep: Sweep, block: int | None) -> None:
        """One more, of a line or an arc."""
        assert not isinstance(sweep.path, Turn)
        k = len(self)
        if k == len(self._rows):
            self._rows = np.concatenate([self._rows, np.zeros((max(64, k), PATH + 2))])
        tool = self._tools.get(id(sweep.profile))
        if tool is None:
            tool = self._tools[id(sweep.profile)] = len(self._profiles)
            self._profiles.append(sweep.profile)
        row = self._rows[k]
        packed_path(sweep.path, row[:PATH])
        row[PATH], row[PATH + 1] = tool, NO_BLOCK if block is None else block
        self.boxes.add(sweep.bounds)

    def keep(self, which: Bools) -> None:
        """Only these."""
        self._rows = self._rows[: len(self)][which].copy()
        self.boxes.keep(which)

    def sweeps(self, which: Bools) -> Iterator[tuple[Sweep, int | None]]:
        """Some of them, with the numbers of their blocks."""
        for row in self._rows[: len(self)][which]:
            tool, block = int(row[PATH]), int(row[PATH + 1])
            path = path_of(row[:PATH])
            yield Sweep.along(self._profiles[tool], path), None if block == NO_BLOCK else block

    def packed(self) -> dict[str, Any]:
        """Arrays by name, see `unpacked`."""
        return {"noted": self._rows[: len(self)], "boxes": self.boxes.rows, **packed_profiles(self._profiles)}

    @classmethod
    def unpacked(cls, arrays: dict[str, Any]) -> Self:
        """What `packed` wrote."""
        self = cls()
        self._rows, self.boxes = np.ascontiguousarray(arrays["noted"]), Boxes(arrays["boxes"])
        self._profiles = profiles_of(arrays)
        self._tools = {id(profile): k for k, profile in enumerate(self._profiles)}
        return self
