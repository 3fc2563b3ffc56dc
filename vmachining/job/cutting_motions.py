"""The motions of a program that cut, as arrays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, Self

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.job.paths import CutterPath
from vmachining.job.toolpath import Toolpath
from vmachining.nc import Motion, Move
from vmachining.tolerance import LENGTH_EPS_MM
from vmachining.tool import Tool


class CuttingMotions(NamedTuple):
    """Cutting motions of a program.

    first : (n + 1,) of every block. single : (n,) whether that block has no other motion. block, tool : (m,). move, path : m
    of them. rev_min, scale, per_feed : (m,) of the spindle, of chips at the programmed feed and per mm/min, NaN where one is
    missing.
    """

    first: Ints
    single: Bools
    block: Ints
    tool: Ints
    move: list[Move]
    path: list[CutterPath]
    rev_min: Floats
    scale: Floats
    per_feed: Floats

    @classmethod
    def of(cls, toolpath: Toolpath, tools: Mapping[int, Tool], rev_min: float | None) -> Self:
        """rev_min : where the program gives none."""
        nan = float("nan")
        steps = toolpath.moves
        cuts = [
            (block.number, k) for block in toolpath.blocks for k in block.moves
            if steps[k].motion is not Motion.RAPID and steps[k].tool in tools
        ]  # fmt: skip
        moves, paths = [steps[k] for _, k in cuts], [toolpath.paths[k] for _, k in cuts]
        block, tool = (
            np.array(ids, dtype=np.int64) for ids in ([k for k, _ in cuts], [m.tool for m in moves])
        )
        length = toolpath.length[[k for _, k in cuts]] if cuts else np.zeros(0)
        feed = np.array([move.feed_mm_min or nan for move in moves])
        lasts = np.array([move.duration_s or nan for move in moves])
        speed = np.array([abs(move.spindle_rpm) or rev_min or nan for move in moves])
        count = np.array([tools[move.tool].flutes or nan for move in moves])
        with np.errstate(divide="ignore", invalid="ignore"):
            per_feed = np.where(length > LENGTH_EPS_MM, 1.0 / (length * count * speed), nan)
            by_feed = per_feed * feed
            scale = np.where(np.isnan(by_feed), 60.0 / lasts / (count * speed), by_feed)
        per_feed[np.isnan(by_feed)] = nan
        single = np.array([len(block.moves) == 1 for block in toolpath.blocks], dtype=np.bool_)
        first = np.searchsorted(block, np.arange(len(toolpath.blocks) + 1))
        return cls(first, single, block, tool, moves, paths, speed, scale, per_feed)
