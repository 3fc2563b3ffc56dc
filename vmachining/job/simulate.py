"""The loop: blocks in program order, each one swept, cut and written down; stoppable between any two."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from vmachining.engines.mesh import MeshEngine
from vmachining.geometry import Path
from vmachining.geometry.bracket import ZERO
from vmachining.job.blocks import Block, move_path
from vmachining.job.contact import Contacts, ToolParts
from vmachining.job.table import RowFile
from vmachining.nc import Motion, Move
from vmachining.sweep import Sweep
from vmachining.tool import Profile

__all__ = ["CHECKPOINT_SECONDS", "Progress", "Stage", "Stopped"]

CHECKPOINT_SECONDS = 120.0
"""A kill that cannot be caught loses at most this much work."""

STRAIGHT = 0.02
"""Relative bend of the removed volume below which a cut counts as steady: a tenth of the default tau."""

Progress = Callable[[str, int, int], None]
"""Called with the stage's name, blocks done and blocks in all."""


class Stopped(Exception):  # noqa: N818 - not an error: the user asked for it
    """The user asked to stop; everything up to here is on disk."""

    def __init__(self, stage: str, done: int, total: int) -> None:
        super().__init__(f"stopped after block {done} of {total} ({stage})")
        self.stage, self.done, self.total = stage, done, total


def sampled_volumes(engine: MeshEngine, cutter: Profile, path: Path, count: int) -> list[float]:
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
            volume[k] = engine.touch(Sweep.along(cutter, part))
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
class Stage:
    """One pass of one program through one workpiece.

    name : shown in the progress bar.
    moves, blocks : what to run; block k is row k.
    move_time_s : seconds of each move, aligned with `moves`.
    tools : by number.
    notes : {line: text} findings of the program to repeat beside the rows.
    contacts : checks rapids, shank and holder; None to skip them.
    sample_counts : number of equal parts that a path of a length (mm) is measured in; None: whole blocks.
    seconds : spent so far in cutting and in contact checks.
    """

    name: str
    moves: Sequence[Move]
    blocks: Sequence[Block]
    move_time_s: Sequence[float]
    tools: Mapping[int, ToolParts]
    notes: Mapping[int, str]
    engine: MeshEngine
    contacts: Contacts | None
    sample_counts: Callable[[float], int] | None = None
    seconds: dict[str, float] = field(default_factory=lambda: {"cut": 0.0, "check": 0.0})

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
        total = len(self.blocks)
        last_save = time.monotonic()
        progress(self.name, first, total)
        for block in self.blocks[first:]:
            if stop():
                rows.flush()
                checkpoint(block.number)
                raise Stopped(self.name, block.number, total)
            rows.add(self._row(block))
            if time.monotonic() - last_save > CHECKPOINT_SECONDS:
                rows.flush()
                checkpoint(block.number + 1)
                last_save = time.monotonic()
            progress(self.name, block.number + 1, total)
        rows.flush()

    def _row(self, block: Block) -> dict[str, Any]:
        removed = ZERO
        samples: list[float] = []
        warnings: list[str] = []
        length, driven_mm, driven_min = 0.0, 0.0, 0.0
        contacts = self.contacts
        for index in block.moves:
            move = self.moves[index]
            path = move_path(move)
            length += path.length
            tool = self.tools.get(move.tool)
            if tool is None:  # no tool in the spindle yet; a cut without one is refused beforehand
                continue
            if move.motion is Motion.RAPID:
                if contacts is not None:
                    warnings += self._checked(contacts.rapid, tool, path)
                continue
            if move.feed_mm_min:
                driven_mm, driven_min = driven_mm + path.length, driven_min + path.length / move.feed_mm_min
            begin = time.perf_counter()
            if (count := self.sample_counts(path.length) if self.sample_counts else 1) > 1:
                samples += sampled_volumes(self.engine, tool.cutter, path, count)
            removed = removed.plus(self.engine.cut(Sweep.along(tool.cutter, path), block=block.number))
            self.seconds["cut"] += time.perf_counter() - begin
            if contacts is not None:
                warnings += self._checked(contacts.cutting, tool, path)
        if (note := self.notes.get(block.line)) is not None:
            warnings.append(note)
        end = self.moves[block.moves[-1]].end
        feeds = {move.feed_mm_min for index in block.moves if (move := self.moves[index]).feed_mm_min}
        # several feeds on one line: the one that takes the same time
        feed = feeds.pop() if len(feeds) == 1 else driven_mm / driven_min if driven_min > 0 else None
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
            "i": 0.0,
            "j": 0.0,
            "k": 1.0,
            "length_mm": length,
            "feed_mm_min": feed,
            "time_s": seconds,
            "removed_mm3": removed.estimate,
            "removed_lo_mm3": removed.lo,
            "removed_hi_mm3": removed.hi,
            "engine": "mesh",
            "mrr_mm3_min": rate,
            "samples_mm3": " ".join(map(repr, samples)) or None,
            "warning": "; ".join(warnings) or None,
        }

    def _checked(
        self, check: Callable[[ToolParts, Path], list[str]], tool: ToolParts, path: Path
    ) -> list[str]:
        begin = time.perf_counter()
        found = check(tool, path)
        self.seconds["check"] += time.perf_counter() - begin
        return found
