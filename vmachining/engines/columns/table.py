"""The cutters of a job as the kernels know them."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from vmachining.engines.columns.arcs._kernels import RUNGS
from vmachining.engines.columns.cutters import grown, lift, underside, widened
from vmachining.engines.columns.paths import widest
from vmachining.engines.packed import packed_profiles, profiles_of
from vmachining.errors import EngineError
from vmachining.tool import Profile

ASIDE, ANYWHERE = 1, 2
"""Columns of the ladder: cutters for points at the same height, and for any."""

PARTS = 12
"""Parts of a cutter's lower surface that the kernels have room for."""


class CutterTable:
    """Cutters, and the same grown and shrunk, by number.

    head : (c, 5), part : (c, PARTS, 8), lift : (c, c), ladder : (c, 3), see surface/_kernels.py and arcs/_kernels.py.
    tops : (c) mm above the tip, up to which everything over the lower surface is cutter.
    """

    def __init__(self) -> None:
        self.head, self.part, self.lift = np.zeros((0, 5)), np.zeros((0, PARTS, 8)), np.zeros((0, 0))
        self.ladder = np.zeros((0, 3))
        self.tops: list[float] = []
        self._numbers: dict[tuple[bytes, float], int] = {}
        self._known: list[tuple[Profile, float, int]] = []
        # asked for by the block before, most often
        self._last: tuple[Profile | None, float, int] = None, 0.0, 0

    def number(self, profile: Profile, by: float, rung: int = 0) -> int:
        """Number of a cutter grown by some mm, given to the kernels once.

        rung : ASIDE or ANYWHERE for one that arcs alone use; the cover rule is not asked about it.

        Raises EngineError: The cutter is not convex, or has more parts than there is room for.
        """
        if not rung and self._last[0] is profile and self._last[1] == by:
            return self._last[2]
        # by shape: behind a checkpoint the cutter of a job is another object, and still the one that lies in itself
        key = b"|".join(a.tobytes() for a in (profile.points, profile.centers, profile.radii)), by
        known = None if rung else self._numbers.get(key)
        if known is not None:
            self._last = profile, by, known
            return known
        found = underside((widened if rung == ASIDE else grown)(profile, by))
        if found is None or len(found.part) > PARTS:
            raise EngineError("the tool is not convex or has too many parts", engine="columns")
        part = np.zeros((1, PARTS, 8))
        part[0, : len(found.part)] = found.part
        n = len(self.head)
        self.head = np.concatenate([self.head, found.head[None]])
        self.part = np.concatenate([self.part, part])
        self.ladder = np.concatenate([self.ladder, np.zeros((1, 3))])
        wider = np.full((n + 1, n + 1), np.inf)
        wider[:n, :n], wider[n, n] = self.lift, 0.0
        if not rung:
            for j in range(n):
                if not self._known[j][2]:
                    wider[n, j], wider[j, n] = (lift(self.head, self.part, b, c) for b, c in ((n, j), (j, n)))
        self.lift = wider
        self.tops.append(found.top)
        self._known.append((profile, by, rung))
        if not rung:
            self._numbers[key] = n
        return n

    def climb(self, profile: Profile, c: int, rung: int) -> None:
        """Make the shrunk and grown cutters between which arcs of cutter c are held, if they are not there.

        rung : ASIDE where arc and chord lie at the same height, ANYWHERE where they do not.
        """
        if self.ladder[c, rung]:
            return
        off = widest(float(self.head[c, 1]))
        first = len(self.head)
        for k in range(RUNGS):
            for sign in (-1.0, 1.0):
                self.number(profile, sign * off / 2.0**k, rung)
        self.ladder[c, 0], self.ladder[c, rung] = off, first

    def packed(self) -> dict[str, Any]:
        """Arrays by name, see `unpacked`."""
        profiles = {id(p): p for p, _, _ in self._known}
        number = {key: k for k, key in enumerate(profiles)}
        arrays = packed_profiles(list(profiles.values()))
        arrays["cutters"] = np.array([(number[id(p)], by, rung) for p, by, rung in self._known]).reshape(
            -1, 3
        )
        arrays["ladder"] = self.ladder
        return arrays

    @classmethod
    def unpacked(cls, arrays: dict[str, Any]) -> Self:
        """What `packed` wrote."""
        self, profiles = cls(), profiles_of(arrays)
        for k, by, rung in arrays["cutters"].tolist():
            self.number(profiles[int(k)], by, int(rung))
        self.ladder = arrays["ladder"]
        return self
