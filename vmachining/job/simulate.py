"""The loop: blocks in program order, each one swept, cut and written down; stoppable between any two."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.protocol import NOTHING, Removal
from vmachining.job.contact import Contacts, Found, ToolParts
from vmachining.job.executor import Executor, Later
from vmachining.job.paths import CutterPath, ends
from vmachining.job.table import RowFile
from vmachining.job.toolpath import Block, Toolpath
from vmachining.job.total import ENDS
from vmachining.nc import Motion
from vmachining.progress import Progress
from vmachining.stock import StepStock, Stock
from vmachining.tool import Profile

CHECKPOINT_SECONDS = 120.0
"""A kill that cannot be caught loses this much work, or `SAVES_APART` times what a checkpoint takes: workers wait for it."""

SAVES_APART = 30.0

AT_ONCE = 256
"""Rows that are written together."""

STRAIGHT = 0.02
"""Relative bend of the removed volume below which a cut counts as steady: a tenth of the default tau."""


class Stopped(Exception):  # noqa: N818 - not an error: the user asked for it
    """The user asked to stop; everything up to here is on disk."""

    def __init__(self, stage: str, done: int, total: int, what: str = "block", then: str = "") -> None:
        super().__init__(f"stopped after {what} {done} of {total} ({stage})" + (f"; {then}" if then else ""))
        self.stage, self.done, self.total = stage, done, total


def sampled_volumes(executor: Executor, cutter: Profile, path: CutterPath, count: int) -> list[float]:
    """mm^3 that each of `count` equal parts of a path will remove; the workpiece stays as it is.

    The volume V(t) of the part from 0 to t is measured at the quarters and wherever V is not straight: an
    interval whose middle lies on its chord (within `STRAIGHT` of its rise) is not divided further. So a
    steady cut costs 8 measurements and a sharp change is found to one part.
    """
    volume = np.full(count + 1, np.nan)
    volume[0] = 0.0

    def measure(k: int) -> float:
        if np.isnan(volume[k]):
            part = path if k == count else path.split([k / count])[0]
            volume[k] = executor.touch(cutter, part)().estimate
        return float(volume[k])

    quarter = max(1, count // 4)
    waiting = [(a, a + quarter) for a in range(0, count, quarter)]
    while waiting:
        a, b = waiting.pop()
        low, high = measure(a), measure(b)
        if b - a < 2:
            continue
        middle = (a + b) // 2
        if abs(measure(middle) - (low + high) / 2) > STRAIGHT * (high - low):
            waiting += [(a, middle), (middle, b)]
    known = np.flatnonzero(~np.isnan(volume))
    steps = np.diff(np.interp(np.arange(count + 1), known, volume[known]))
    return [float(step) for step in np.maximum(steps, 0.0)]


@dataclass(slots=True, eq=False)
class Ordered:
    """A block that is being cut: answers that may still be on their way, and what is known at once."""

    block: Block
    removed: list[Later] = field(default_factory=list)
    warnings: list[Found] = field(default_factory=list)
    samples: list[float] = field(default_factory=list)


class Told(NamedTuple):
    """What is known of a block once it is cut, see `table.COLUMNS`."""

    block: int
    removed: Removal
    proven: bool
    samples: str | None
    warning: str | None


@dataclass(slots=True, eq=False)
class Stage:
    """One pass of one program through one workpiece.

    name : shown in the progress bar.
    toolpath : what to run; block k is row k.
    feed, seconds : (n,) mm/min and s of each block, see `timing.block_feeds`.
    tools : by number.
    notes : {line: text} findings of the program to repeat beside the rows.
    contacts : checks rapids, shank and holder; None to skip them.
    save_every : s between checkpoints, at least.
    stock : raw; blocks near faces that triangles only represent are not proven. None: it is what the engine cuts.
    sample_counts : number of equal parts that a path of a length (mm) is measured in; None: whole blocks.
    """

    name: str
    toolpath: Toolpath
    feed: Floats
    seconds: Floats
    tools: Mapping[int, ToolParts]
    notes: Mapping[int, str]
    executor: Executor
    contacts: Contacts | None
    sample_counts: Callable[[float], int] | None = None
    save_every: float = CHECKPOINT_SECONDS
    stock: Stock | None = None

    def run(
        self,
        rows: RowFile,
        *,
        first: int,
        stop: Callable[[], bool],
        progress: Progress,
        checkpoint: Callable[[int], None],
    ) -> None:
        """Cut blocks `first`, `first` + 1, ... and write a row for each.

        Raises
        ------
        Stopped
            `stop()` became true; rows and checkpoint are on disk.
        EngineError
            A kernel failed; rows so far are on disk.
        """
        total = len(self.toolpath.blocks)
        last_save, every = time.monotonic(), self.save_every
        progress(self.name, first, total)
        ordered: deque[Ordered] = deque()
        told: list[Told] = []

        def answered(left: int) -> None:
            while len(ordered) > left:
                told.append(self._told(ordered.popleft()))
                progress(self.name, told[-1].block + 1, total)
                if len(told) >= AT_ONCE:
                    write()

        def write() -> None:
            if told:
                some = self._columns(told)
                told.clear()
                rows.write(some)

        try:
            for block in map(self.toolpath.blocks.__getitem__, range(first, total)):
                stopped = stop()
                if not stopped:
                    ordered.append(self._order(block))
                    answered(self.executor.ahead)
                if stopped or time.monotonic() - last_save > every:
                    answered(0)
                    write()
                    rows.flush()
                    begin = time.monotonic()
                    checkpoint(block.number + (not stopped))
                    last_save = time.monotonic()
                    every = max(self.save_every, SAVES_APART * (last_save - begin))
                if stopped:
                    raise Stopped(self.name, block.number, total)
            answered(0)
        finally:
            write()
        rows.flush()

    def _order(self, block: Block) -> Ordered:
        """Have a block cut and checked."""
        order = Ordered(block)
        contacts = self.contacts
        for index in block.moves:
            move, path = self.toolpath.moves[index], self.toolpath.paths[index]
            tool = self.tools.get(move.tool)
            if tool is None:  # no tool in the spindle yet; a cut without one is refused beforehand
                continue
            if move.motion is Motion.RAPID:
                if contacts is not None:
                    order.warnings.append(contacts.rapid(tool, path))
                continue
            if self.sample_counts is not None and (count := self.sample_counts(path.length)) > 1:
                order.samples += sampled_volumes(self.executor, tool.cutter, path, count)
            order.removed.append(self.executor.cut(tool.cutter, path, block.number))
            if contacts is not None:
                order.warnings.append(contacts.cutting(tool, path))
        return order

    def _curved(self, block: Block) -> bool:
        """Whether the raw stock has faces near a block that its triangles differ from."""
        if not isinstance(self.stock, StepStock) or not len(self.stock.curved):
            return False
        return any(
            self.stock.slack_near(sweep.bounds) > 0.0 for sweep in self.toolpath.sweeps(block, self.tools)
        )

    def _told(self, order: Ordered) -> Told:
        """The answers to the orders of a block."""
        block, removed = order.block, NOTHING
        for k, part in enumerate(order.removed):
            removed = removed.plus(part()) if k else part()
        warnings = [text for found in order.warnings for text in found()]
        warnings += [text for text in (removed.note, self.notes.get(block.line)) if text is not None]
        proven = removed.proven and not (removed.hi > 0.0 and self._curved(block))
        samples = " ".join(map(repr, order.samples)) or None
        return Told(block.number, removed, proven, samples, "; ".join(warnings) or None)

    def _columns(self, told: Sequence[Told]) -> dict[str, Any]:
        """Rows of consecutive blocks."""
        here, moves = slice(told[0].block, told[-1].block + 1), self.toolpath.moves
        blocks = self.toolpath.blocks[here]
        last = [moves[block.members[-1]] for block in blocks]
        tips, axes = ends([self.toolpath.paths[block.moves[-1]] for block in blocks])
        at = blocks[0].members.start  # lengths of these alone: a program has a million
        length = self.toolpath.length[at : blocks[-1].members.stop].tolist()
        volumes = np.array([one.removed[:3] for one in told])
        seconds = self.seconds[here]
        rate = np.divide(60.0 * volumes[:, 1], seconds, out=np.full(len(told), np.nan), where=seconds > 0.0)
        return {
            **{name: [getattr(block, name) for block in blocks] for name in ("line", "tool", "motion")},
            "block": [block.number for block in blocks],
            "text": [block.text or None for block in blocks],
            **dict(zip(("x_mm", "y_mm", "z_mm", "i", "j", "k"), (*tips.T, *axes.T), strict=True)),
            "length_mm": [sum(length[k - at] for k in block.moves) for block in blocks],
            "feed_mm_min": self.feed[here],
            "time_s": seconds,
            **dict(zip(ENDS, volumes.T, strict=True)),
            "engine": [one.removed.engine or self.executor.engine for one in told],
            "proven": [one.proven for one in told],
            "mrr_mm3_min": rate,
            "spindle_rpm": [move.spindle_rpm for move in last],
            "coolant": [move.coolant or None for move in last],
            "samples_mm3": [one.samples for one in told],
            "warning": [one.warning for one in told],
        }
