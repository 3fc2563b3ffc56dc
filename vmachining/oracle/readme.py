"""The words that go into a pack."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

__all__ = ["CC0", "COLUMNS_MEAN", "NO_LICENCE", "readme"]

CC0 = """\
SPDX-License-Identifier: CC0-1.0

To the extent possible under law, the makers of this pack have waived all copyright and related rights to the
program, the job, the tables and the solids in it (CC0 1.0 Universal).
Legal text: https://creativecommons.org/publicdomain/zero/1.0/legalcode
"""

NO_LICENCE = """\
No licence was chosen when this pack was made. Program, tools and stock belong to whoever wrote them: ask before
you pass them on. The vmachining project claims no right to the numbers and solids that it computed.
"""

COLUMNS_MEAN: dict[str, str] = {
    "block": "number of the motion block, from 0; rapids count too",
    "line": "line of the program file, from 1; a line that is repeated has several blocks",
    "text": "the line",
    "tool": "tool number, see job.toml",
    "motion": "rapid, linear, arc_cw, arc_ccw, cycle",
    "x_mm": "tool tip at the end of the block, work coordinates, mm; likewise y_mm, z_mm",
    "i": "unit vector along the tool, from tip to spindle; likewise j, k",
    "length_mm": "length of the tip's path, mm",
    "feed_mm_min": "feed, mm/min; empty for a rapid",
    "removed_mm3": "best estimate of the volume that this block removes, mm^3",
    "removed_lo_mm3": "it is not less than this, mm^3",
    "removed_hi_mm3": "and not more than this, mm^3",
    "engine": "who computed it",
    "removed_brep_mm3": "the same by exact B-rep booleans, where they were asked and agree, mm^3",
    "brep_status": "agreed, retried, refused, skipped; empty: not asked",
    "warning": "what is odd about the block",
}
"""Columns of a pack's `blocks`; y_mm, z_mm, j and k are told with x_mm and i."""


def readme(name: str, summary: Mapping[str, Any], chord_mm: float, files: Mapping[str, str]) -> str:
    """README.md of a pack; `files` tells what each file is."""
    removed = [summary[f"removed_{side}mm3"] for side in ("lo_", "", "hi_")]
    width = removed[2] - removed[0]
    listed = "\n".join(f"| `{file}` | {text} |" for file, text in files.items())
    columns = "\n".join(f"| `{column}` | {text} |" for column, text in COLUMNS_MEAN.items())
    notes = "".join(f"\nNote: {text}.\n" for text in summary["notes"])
    return f"""\
# Reference pack: {name}

What every block of an NC program removes from the stock, each volume between two bounds. For developers of
milling simulations: compute the volumes with your engine and compare. Nothing has to be installed for that.

{summary["blocks"]} blocks remove {removed[1]:.6f} mm^3, between {removed[0]:.6f} and {removed[2]:.6f}
(width {width:.3g} mm^3, chord {chord_mm:g} mm), from a stock of {summary["stock_mm3"]:.6f} mm^3.
{notes}
| file | holds |
|---|---|
{listed}

## Columns of `blocks`

| column | meaning |
|---|---|
{columns}

A rapid removes 0 by definition. Later blocks cut what the earlier ones left. An empty cell is a value that
was not computed.

## How to compare

A volume V of yours is wrong if V < `removed_lo_mm3` or V > `removed_hi_mm3`. Inside the bracket it is not
proved right: no error larger than the width of the bracket is left. `removed_mm3` is an estimate inside of it
and good for plots of errors, not for a verdict. Blocks of one line may be summed, and their bounds with them.

With vmachining, where results.csv has the columns `block` or `line`, and `removed_mm3`:

    vmachining compare results.csv .

`job.toml` is a job of vmachining: `vmachining run job.toml` computes the volumes again, a smaller `chord_mm`
gives narrower brackets, and `vmachining pack job.toml --out .` makes this folder again. Cutters are described
there: diameters, corner radius, lengths in the units of the job; only the flutes' body of revolution cuts.
"""
