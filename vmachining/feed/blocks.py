"""What the schedulers know of a program: one row per block."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vmachining.arrays import Bools, Floats, Ints
from vmachining.errors import FeedError

T = TypeVar("T", bound=np.generic)

NOISE_MM3 = 1e-9
"""Negative volumes up to this size are rounding of a difference of two solids and count as zero."""


class Kind(StrEnum):
    """What a block does. Only `cut` blocks get a new feed."""

    CUT = "cut"
    RAPID = "rapid"
    OTHER = "other"
    """Canned cycle, dwell, threading, probing: left as programmed."""


@dataclass(frozen=True, slots=True, eq=False)
class FeedBlocks:
    """n blocks in program order. Arrays are copied, checked and made read-only.

    line : (n,) int
        Line of the program; the same line again when it runs several times.
    kind : (n,)
        `Kind`, or its value as text.
    length_mm : (n,)
        Path of the tool tip.
    feed_mm_min : (n,)
        Original effective feed; NaN where none exists.
    volume_mm3 : (n,)
        Removed volume.
    volume_hi_mm3 : (n,), optional
        Upper end of its bracket.
    cap_mm_min : (n,), optional
        Cap of the machine on this block (axis feeds, chip load); inf where nothing limits.
    tool : (n,) int, optional
        Number of the tool; each tool has its own automatic reference.
    plunge : (n,) bool, optional
        Whether it goes down along the tool; such a block shares no feed with others.

    Raises FeedError: Wrong length, a value that is not finite, negative, or a kind nobody knows; names the block.
    """

    line: Ints
    kind: NDArray[np.str_]
    length_mm: Floats
    feed_mm_min: Floats
    volume_mm3: Floats
    volume_hi_mm3: Floats | None = None
    cap_mm_min: Floats | None = None
    tool: Ints | None = None
    plunge: Bools | None = None

    def __post_init__(self) -> None:
        lines = np.array(self.line, dtype=np.int64)
        if lines.ndim != 1:
            raise FeedError(f"line: expected shape (n,), got {lines.shape}")
        n = len(lines)
        kinds = _shaped([str(k) for k in self.kind], np.str_, n, "kind")
        known = [str(k) for k in Kind]
        if (odd := ~np.isin(kinds, known)).any():
            raise FeedError(f"kind {str(kinds[odd][0])!r} is not one of {', '.join(known)}")
        lengths = _column(self.length_mm, n, "length_mm", lines)
        volumes, upper = sure_volumes(self.volume_mm3, n, "volume_mm3", lines), self.volume_hi_mm3
        if upper is not None:
            upper = sure_volumes(upper, n, "volume_hi_mm3", lines)
            if (low := upper < volumes).any():
                raise FeedError("volume_hi_mm3 is below volume_mm3", line=int(lines[low][0]))
        feeds = _shaped(self.feed_mm_min, np.float64, n, "feed_mm_min")
        cuts = (kinds == str(Kind.CUT)) & ~np.isnan(feeds)  # NaN means "none"
        _refuse(cuts & ~(np.isfinite(feeds) & (feeds > 0)), feeds, "feed_mm_min", "a positive number", lines)
        caps = None if self.cap_mm_min is None else _shaped(self.cap_mm_min, np.float64, n, "cap_mm_min")
        if caps is not None:
            _refuse(~(caps > 0), caps, "cap_mm_min", "a positive number", lines)
        tools = None if self.tool is None else _shaped(self.tool, np.int64, n, "tool")
        down = (
            np.zeros(n, dtype=np.bool_)
            if self.plunge is None
            else _shaped(self.plunge, np.bool_, n, "plunge")
        )
        values = lines, kinds, lengths, feeds, volumes, upper, caps, tools, down
        for name, value in zip(self.__slots__, values, strict=True):
            if value is not None:
                value.setflags(write=False)
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        return len(self.line)

    @property
    def caps(self) -> Floats:
        """(n,) mm/min, inf where nothing limits."""
        return np.full(len(self), np.inf) if self.cap_mm_min is None else self.cap_mm_min

    @property
    def groups(self) -> Ints:
        """(n,) tool of every block, 0 where none is said."""
        return np.zeros(len(self), dtype=np.int64) if self.tool is None else self.tool

    def volumes(self, conservative: bool) -> Floats:
        """(n,) the volumes to schedule with: estimates, or upper ends of the brackets."""
        if not conservative:
            return self.volume_mm3
        if self.volume_hi_mm3 is None:
            raise FeedError("conservative scheduling needs volume_hi_mm3 for the blocks")
        return self.volume_hi_mm3


def _shaped(values: Any, kind: type[T], n: int, name: str) -> NDArray[T]:
    """(n,) values of a kind. Raises FeedError."""
    array = np.array(values, dtype=kind)
    if array.shape != (n,):
        raise FeedError(f"{name}: expected shape ({n},), got {array.shape}")
    return array


def _refuse(bad: Bools, values: Floats, name: str, wanted: str, lines: Ints | None) -> None:
    """Raises FeedError for the first value that is bad (n,)."""
    if bad.any():
        line = int(lines[bad][0]) if lines is not None else None
        raise FeedError(f"{name} is {values[bad][0]}, expected {wanted}", line=line)


def _column(values: ArrayLike, n: int, name: str, lines: Ints | None) -> Floats:
    """(n,) finite and not negative."""
    array = _shaped(values, np.float64, n, name)
    bad = ~(np.isfinite(array) & (array >= 0))
    _refuse(bad, array, name, "a finite number that is not negative", lines)
    return array


def sure_volumes(values: ArrayLike, n: int, name: str, lines: Ints | None = None) -> Floats:
    """(n,) mm^3, finite and not negative; noise below zero is zero. Raises FeedError."""
    array = np.array(values, dtype=np.float64)
    return _column(np.where((array < 0) & (array >= -NOISE_MM3), 0.0, array), n, name, lines)
