"""A path in a plane as a program of dialect `iso`, and the job that cuts it from a block of stock."""

from __future__ import annotations

import json
from math import ceil
from pathlib import Path

import numpy as np

from vmachining.arrays import Floats
from vmachining.errors import InputError
from vmachining.toolpath.clpath import iso_head
from vmachining.toolpath.triangle import Triangle

CLEAR_MM, MARGIN_MM = 2.0, 5.0
"""Height of rapids between levels; what the block of stock is larger than the pocket."""


def level_program(
    path: Floats,
    *,
    depth_mm: float,
    step_mm: float,
    feed_mm_min: float,
    plunge_mm_min: float,
    title: str = "",
) -> str:
    """Program text that drives a path (n, 2) mm at one or more depths below z = 0, plunging at its start.

    Coordinates have four decimals: points move by at most 7e-5 mm.

    Raises InputError: A depth, step or feed that is not positive.
    """
    sizes = {"depth": depth_mm, "step": step_mm, "feed": feed_mm_min, "plunge feed": plunge_mm_min}
    for name, value in sizes.items():
        if not (np.isfinite(value) and value > 0.0):
            raise InputError(f"{name} {value:g}: give a positive number")
    levels = ceil(depth_mm / step_mm - 1e-12)
    (x, y), rest = path[0], path[1:]
    lines = [*iso_head(title, 1, 6000.0), f"G0 X{x:.4f} Y{y:.4f}", f"Z{CLEAR_MM:.4f}"]
    for level in range(1, levels + 1):
        if level > 1:
            lines += [f"G0 Z{CLEAR_MM:.4f}", f"X{x:.4f} Y{y:.4f}"]
        lines.append(f"G1 Z{-depth_mm * level / levels:.4f} F{plunge_mm_min:g}")
        for k, (px, py) in enumerate(rest):
            feed = f" F{feed_mm_min:g}" if k == 0 else ""
            lines.append(f"X{px:.4f} Y{py:.4f}{feed}")
    lines += ["G0 Z20.0000", "M5", "M2"]
    return "\n".join(lines) + "\n"


def pocket_job(triangle: Triangle, program: str, *, depth_mm: float) -> str:
    """Text of a job file, named after its program: a flat end mill and a block `MARGIN_MM` larger than the pocket."""
    corners = triangle.corners
    low = corners.min(axis=0) - triangle.r - MARGIN_MM
    high = corners.max(axis=0) + triangle.r + MARGIN_MM
    bottom = -depth_mm - MARGIN_MM
    numbers = ", ".join(f"{v:.4f}" for v in (*low, bottom))
    upper = ", ".join(f"{v:.4f}" for v in (*high, 0.0))
    return f"""name = {json.dumps(Path(program).stem, ensure_ascii=False)}

[program]
file = {json.dumps(program, ensure_ascii=False)}

[[tools]]
number = 1
type = "flat"
diameter_mm = {2.0 * triangle.r:.9g}
length_mm = {max(3.0 * depth_mm, 4.0 * triangle.r):.9g}

[stock]
box = {{ min = [{numbers}], max = [{upper}] }}
"""
