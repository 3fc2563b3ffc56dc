"""Sweeps that one engine has cut and another one may still have to cut or know, as rows of arrays: a few hundred bytes each,
some thousand where the tool turns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Self

import numpy as np

from vmachining.arrays import Bools, Ints
from vmachining.engines.boxes import Boxes
from vmachining.engines.packed import (
    PATH,
    packed_path,
    packed_profiles,
    packed_turns,
    path_of,
    profiles_of,
    turns_of,
)
from vmachining.sweep import Sweep, Turn
from vmachining.tool import Profile

NO_BLOCK = -1

TOOL, BLOCK, LASTS, CUT, NUMBER = range(PATH, PATH + 5)
"""Columns after those of the path: tool, block, whether it is never forgotten, whether the other engine has cut it, number."""


class Noted:
    """Sweeps in the order they came, with the numbers of their blocks."""

    def __init__(self) -> None:
        self.boxes = Boxes()
        self._rows = np.zeros((64, NUMBER + 1))
        self._made = 0
        self._turns: dict[int, Turn] = {}
        self._profiles: list[Profile] = []
        self._tools: dict[int, int] = {}

    def __len__(self) -> int:
        return len(self.boxes)

    @property
    def blocks(self) -> Ints:
        """(n,) numbers of their blocks, -1 where none was given."""
        return np.asarray(self._rows[: len(self), BLOCK].astype(np.int64))

    @property
    def serials(self) -> Ints:
        """(n,) serial numbers."""
        return np.asarray(self._rows[: len(self), NUMBER].astype(np.int64))

    @property
    def uncut(self) -> Bools:
        """(n,) which of them the other engine has not cut yet."""
        return np.asarray(self._rows[: len(self), CUT] == 0.0)

    @property
    def lasting(self) -> Bools:
        """(n,) which of them are never forgotten."""
        return np.asarray(self._rows[: len(self), LASTS] == 1.0)

    def add(self, sweep: Sweep, block: int | None, *, lasts: bool = False, cut: bool = False) -> int:
        """One more; its serial number."""
        self.extend([(sweep, block)], lasts=lasts, cut=cut)
        return self._made - 1

    def extend(
        self, sweeps: Sequence[tuple[Sweep, int | None]], *, lasts: bool = False, cut: bool = False
    ) -> None:
        """Some more, with the numbers of their blocks."""
        k, n = len(self), len(sweeps)
        if k + n > len(self._rows):
            self._rows = np.concatenate([self._rows, np.zeros((max(64, k, n), NUMBER + 1))])
        rows = self._rows[k : k + n]
        for row, (sweep, block) in zip(rows, sweeps, strict=True):
            packed_path(sweep.path, row[:PATH])
            row[TOOL], row[BLOCK] = self._tool(sweep.profile), NO_BLOCK if block is None else block
            if isinstance(sweep.path, Turn):
                self._turns[self._made] = sweep.path
            self._made += 1
        rows[:, LASTS], rows[:, CUT], rows[:, NUMBER] = lasts, cut, range(self._made - n, self._made)
        self.boxes.extend([sweep.bounds for sweep, _ in sweeps])

    def _tool(self, profile: Profile) -> int:
        tool = self._tools.get(id(profile))
        if tool is None:
            tool = self._tools[id(profile)] = len(self._profiles)
            self._profiles.append(profile)
        return tool

    def mark(self, which: Bools) -> None:
        """The other engine has cut these."""
        self._rows[: len(self), CUT][which] = 1.0

    def keep(self, which: Bools) -> None:
        """Only these."""
        self._rows = self._rows[: len(self)][which].copy()
        self.boxes.keep(which)
        left = set(self._rows[:, NUMBER].astype(np.int64).tolist())
        self._turns = {number: turn for number, turn in self._turns.items() if number in left}

    def sweeps(self, which: Bools) -> Iterator[tuple[Sweep, int | None]]:
        """Some of them, with the numbers of their blocks."""
        for row in self._rows[: len(self)][which]:
            tool, block = int(row[TOOL]), int(row[BLOCK])
            path = self._turns.get(int(row[NUMBER])) or path_of(row[:PATH])
            yield Sweep.along(self._profiles[tool], path), None if block == NO_BLOCK else block

    def packed(self) -> dict[str, Any]:
        """Arrays by name, see `unpacked`."""
        return {
            "noted": self._rows[: len(self)], "boxes": self.boxes.rows, **packed_profiles(self._profiles),
            "turning": np.array(list(self._turns), dtype=np.int64), **packed_turns(list(self._turns.values())),
        }  # fmt: skip

    @classmethod
    def unpacked(cls, arrays: dict[str, Any]) -> Self:
        """What `packed` wrote."""
        self = cls()
        self._rows, self.boxes = np.ascontiguousarray(arrays["noted"]), Boxes(arrays["boxes"])
        self._profiles = profiles_of(arrays)
        self._tools = {id(profile): k for k, profile in enumerate(self._profiles)}
        self._made = int(self._rows[:, NUMBER].max(initial=-1.0)) + 1
        ends = {int(row[NUMBER]): row for row in self._rows}
        paths = np.array([ends[number][:PATH] for number in arrays["turning"].tolist()]).reshape(-1, PATH)
        self._turns = dict(zip(arrays["turning"].tolist(), turns_of(paths, arrays), strict=True))
        return self
