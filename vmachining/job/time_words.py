"""What a summary says of machine times: by tool, what keeps blocks from their feed, and what was assumed."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from vmachining.job.jobfile import MM_PER_INCH
from vmachining.job.timing import MoveTimes
from vmachining.job.toolpath import Toolpath
from vmachining.machine import Machine, MachineLimits
from vmachining.nc import Program, decode_program

WORST = 10
"""Blocks that are named, by the time that they lose."""


def times_summary(
    toolpath: Toolpath, times: MoveTimes, limits: MachineLimits, after: MoveTimes | None = None
) -> dict[str, Any]:
    """Key `times` of summary.json.

    tools : seconds by tool, in program order. below_feed_share : of the time at feed, in which the programmed feed is never
    reached; reasons : moves by why; worst : the blocks that lose most, against their length over their feed.
    """
    tools: dict[int, float] = {}
    for move, seconds in zip(toolpath.moves, times.seconds.tolist(), strict=True):
        tools[move.tool] = tools.get(move.tool, 0.0) + seconds
    lost = np.where(times.late, times.seconds - times.ideal_s, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        plain = 60.0 * toolpath.length / times.programmed_mm_min
    lost = np.where(np.isfinite(plain) & (lost != 0.0), times.seconds - plain, lost)
    worst, late, why = [], times.late, times.why
    for block in toolpath.blocks:
        k = max(block.moves, key=lambda index: lost[index])
        if late[k]:
            worst.append((float(lost[k]), block, k))
    worst.sort(key=lambda entry: -entry[0])
    return {
        "tools": [{"tool": tool, "seconds": seconds} for tool, seconds in tools.items()],
        "below_feed_share": times.below_share,
        "scheduled_below_feed_share": None if after is None else after.below_share,
        "reasons": times.reasons(),
        "worst": [
            {
                "block": block.number, "line": block.line, "feed_mm_min": float(times.programmed_mm_min[k]),
                "reached_mm_min": float(times.reached_mm_min[k]), "why": str(why[k]), "lost_s": seconds,
            }
            for seconds, block, k in worst[:WORST]
        ],
        "assumed": assumed(limits, toolpath.machine, toolpath.program),
    }  # fmt: skip


def assumed(
    limits: MachineLimits, machine: Machine | None = None, program: Program | None = None
) -> list[str]:
    """What nobody said of the machine, and what was taken instead."""
    own = machine is not None and any(np.isfinite(axis.max_acceleration) for axis in machine.axes)
    out = []
    if limits.max_acceleration_mm_s2 is None and not limits.axis_acceleration_mm_s2 and not own:
        out.append("no acceleration is given: speeds change at once, and corners take no extra time")
    else:
        out.append(
            f"corners may be missed by {limits.corner_tolerance_mm:g} mm where the program does not say (G64 P, G61, CYCLE832)"
        )
    if limits.rapid_mm_min is None and not limits.axis_rapid_mm_min and machine is None:
        out.append("no rapid speed is given: rapids take no time")
    if limits.tool_change_s == 0.0:
        out.append("no time of a tool change is given: it takes none")
    step = None if program is None else _step(program)
    if program is not None and step is not None:
        told = [float(a or b) for a, b in SMOOTHING.findall(decode_program(program.data, program.name))]
        unit = _unit(program)
        least = min(
            (v for v in (limits.corner_tolerance_mm, *(unit * t for t in told)) if v > 0.0), default=step
        )
        if least < 0.999 * step:
            out.append(
                f"a corner tolerance of {least:.3g} mm is below the resolution of the program ({step:.3g} mm): "
                "corners that come from rounding slow the path down as well"
            )
    return out


INCH_WORD = re.compile(rb"^[^(;\n]*G0*(?:20|70)(?![\d.])", re.IGNORECASE | re.MULTILINE)
SMOOTHING = re.compile(r"G64\s*P\s*(\d*\.?\d+)|CYCLE832\s*\(\s*(\d*\.?\d+)", re.IGNORECASE)


def _step(program: Program) -> float | None:
    """mm, the last decimal of its coordinates; None where none has any."""
    digits = max(map(len, re.findall(rb"[XYZ]\s*[-+]?\d*\.(\d+)", program.data, re.IGNORECASE)), default=0)
    return _unit(program) * 10.0**-digits if digits else None


def _unit(program: Program) -> float:
    """mm in its unit of length, by G20 or G70 where only a word says it."""
    inch = program.declared.unit == "inch" or (
        not program.declared.unit and INCH_WORD.search(program.data) is not None
    )
    return MM_PER_INCH if inch else 1.0
