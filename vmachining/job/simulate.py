"""The loop: blocks in program order, each one swept, cut and written down; stoppable between any two."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.protocol import NOTHING
from vmachining.job.blocks import Block
from vmachining.job.contact import Contacts, Found, ToolParts
from vmachining.job.executor import Executor, Later
from vmachining.job.paths import CutterPath, end_axis
from vmachining.job.table import RowFile
from vmachining.job.toolpath import Toolpath
from vmachining.nc import Motion
from vmachining.progress import Progress
from vmachining.stock import StepStock, Stock
from vmachining.tool import Profile

__all__ = ["CHECKPOINT_SECONDS", "Progress", "Stage", "Stopped"]

CHECKPOINT_SECONDS = 120.0
"""A kill that cannot be caught loses at most this much work."""

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
    end: Floats = field(default_factory=lambda: np.zeros(3))
    axis: Floats = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    length: float = 0.0
    driven_mm: float = 0.0
    driven_min: float = 0.0


@dataclass(slots=True, eq=False)
class Stage:
    """One pass of one program through one workpiece.

    name : shown in the progress bar.
    toolpath : what to run; block k is row k.
    move_time_s : seconds of each move.
    tools : by number.
    notes : {line: text} findings of the program to repeat beside the rows.
    contacts : checks rapids, shank and holder; None to skip them.
    save_every : s between checkpoints.
    stock : raw; blocks near faces that triangles only represent are not proven. None: it is what the engine cuts.
    sample_counts : number of equal parts that a path of a length (mm) is measured in; None: whole blocks.
    """

    name: str
    toolpath: Toolpath
    move_time_s: Sequence[float]
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
        last_save = time.monotonic()
        progress(self.name, first, total)
        ordered: deque[Ordered] = deque()

        def written(left: int) -> None:
            while len(ordered) > left:
                order = ordered.popleft()
                rows.add(self._row(order))
                progress(self.name, order.block.number + 1, total)

        for block in self.toolpath.blocks[first:]:
            if stop():
                written(0)
                rows.flush()
                checkpoint(block.number)
                raise Stopped(self.name, block.number, total)
            ordered.append(self._order(block))
            written(self.executor.ahead)
            if time.monotonic() - last_save > self.save_every:
                written(0)
                rows.flush()
                checkpoint(block.number + 1)
                last_save = time.monotonic()
        written(0)
        rows.flush()

    def _order(self, block: Block) -> Ordered:
        """Have a block cut and checked."""
        order = Ordered(block)
        contacts = self.contacts
        for index in block.moves:
            move, path = self.toolpath.moves[index], self.toolpath.paths[index]
            order.end, order.axis = path.position(1.0), end_axis(path)
            order.length += path.length
            tool = self.tools.get(move.tool)
            if tool is None:  # no tool in the spindle yet; a cut without one is refused beforehand
                continue
            if move.motion is Motion.RAPID:
                if contacts is not None:
                    order.warnings.append(contacts.rapid(tool, path))
                continue
            if move.feed_mm_min:
                order.driven_mm += path.length
                order.driven_min += path.length / move.feed_mm_min
            if (count := self.sample_counts(path.length) if self.sample_counts else 1) > 1:
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

    def _row(self, order: Ordered) -> dict[str, Any]:
        """The row of a block, once its orders are carried out."""
        block = order.block
        removed = NOTHING
        for part in order.removed:
            removed = removed.plus(part())
        warnings = [text for found in order.warnings for text in found()]
        if removed.note is not None:
            warnings.append(removed.note)
        if (note := self.notes.get(block.line)) is not None:
            warnings.append(note)
        end = order.end
        feeds = {
            move.feed_mm_min for index in block.moves if (move := self.toolpath.moves[index]).feed_mm_min
        }
        # several feeds on one line: the one that takes the same time
        mean = order.driven_mm / order.driven_min if order.driven_min > 0 else None
        feed = feeds.pop() if len(feeds) == 1 else mean
        seconds = float(sum(self.move_time_s[index] for index in block.members))
        rate = 60.0 * removed.estimate / seconds if seconds > 0 else None
        return {
            "block": block.number,
            "line": block.line,
            "text": block.text,
            "tool": block.tool,
            "motion": block.motion,
            "x_mm": float(end[0]),
            "y_mm": float(end[1]),
            "z_mm": float(end[2]),
            "i": float(order.axis[0]),
            "j": float(order.axis[1]),
            "k": float(order.axis[2]),
            "length_mm": order.length,
            "feed_mm_min": feed,
            "time_s": seconds,
            "removed_mm3": removed.estimate,
            "removed_lo_mm3": removed.lo,
            "removed_hi_mm3": removed.hi,
            "engine": removed.engine or self.executor.engine,
            "proven": removed.proven and not (removed.hi > 0.0 and self._curved(block)),
            "mrr_mm3_min": rate,
            "spindle_rpm": self.toolpath.moves[block.members[-1]].spindle_rpm,
            "coolant": self.toolpath.moves[block.members[-1]].coolant or None,
            "samples_mm3": " ".join(map(repr, order.samples)) or None,
            "warning": "; ".join(warnings) or None,
        }
