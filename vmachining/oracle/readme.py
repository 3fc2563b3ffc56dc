"""The words that go into a pack."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

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
    "removed_mm3": "estimate of the volume that this block removes, mm^3",
    "removed_lo_mm3": "it is not less than this, mm^3",
    "removed_hi_mm3": "and not more than this, mm^3",
    "engine": "who computed it",
    "proven": "true: both ends are proven bounds; false: they rest on a step that is not proven (a tool that turns)",
    "removed_brep_mm3": "the same by booleans of exact B-rep solids (OCCT), where they were asked and agree, mm^3",
    "removed_brep_error_mm3": "how far that is from the truth at most, mm^3",
    "brep_attempt": "which of the ways of asking OCCT agreed: its number and name",
    "brep_status": "agreed (at the first attempt), retried (at a later one), refused, disputed (our engines exclude each "
    "other: do not use this block), skipped; empty: not asked",
    "removed_dexel_mm3": "the same by exact rays, where they were asked, mm^3; likewise removed_dexel_lo_mm3 and "
    "removed_dexel_hi_mm3, an interval of stated confidence and no bracket",
    "warning": "what is odd about the block",
}
"""Columns of a pack's `blocks`; y_mm, z_mm, j and k are described with x_mm and i."""


ENGAGEMENT_MEAN: dict[str, str] = {
    "block": "number of the block, as above; likewise line",
    "at": "where the tool is on the block, 0.5 is the middle of its path",
    "phi_deg": "rotation angle of the edge in the frame of the tool, from its second direction (+y of an upright "
    "tool) to the first (+x), clockwise seen from the spindle; the frame is Rx(A) Ry(B), B = asin(i), "
    "A = atan2(-j, k)",
    "phi_feed_deg": "the same from the feed: 90 is straight ahead; empty where the feed is along the axis",
    "lower_mm": "where an engaged interval begins: arc length along the meridian of the cutter, from its lowest "
    "point off the bottom disc, mm; empty where the edge touches nothing",
    "upper_mm": "where it ends; an angle may have several intervals",
    "length_mm": "length of the edge between them, mm; 0 where it touches nothing",
    "le_x_mm": "lower engagement point, work coordinates; likewise le_y_mm, le_z_mm",
    "ue_x_mm": "upper engagement point; likewise ue_y_mm, ue_z_mm",
    "lower_by": "what ends the interval there: stock, block N (an earlier sweep), facing (beyond it the surface "
    "leaves the material), edge (the end of the cutting edge); likewise upper_by",
}
"""Columns of a pack's `engagement`."""


def readme(name: str, summary: Mapping[str, Any], asked: str, files: Mapping[str, str], command: str) -> str:
    """README.md of a pack; `asked` says how exact it was to be, `files` what each file is, `command` makes the pack again."""
    removed = [summary[f"removed_{side}mm3"] for side in ("lo_", "", "hi_")]
    width = removed[2] - removed[0]
    listed = "\n".join(f"| `{file}` | {text} |" for file, text in files.items())
    columns = "\n".join(f"| `{column}` | {text} |" for column, text in COLUMNS_MEAN.items())
    edge = _edge() if "engagement.csv" in files else ""
    blocks, stated = summary["blocks"], summary["stated_blocks"]
    sure = "the ends of every interval are proven bounds"
    sure = f"{stated} of {blocks} intervals are stated, not proven" if stated else sure
    notes = "".join(f"\nNote: {text}.\n" for text in summary["notes"])
    return f"""\
# Reference pack: {name}

What every block of an NC program removes from the stock, each volume in an interval; {sure}. For developers of
milling simulations: compute the volumes with your engine and compare. Nothing has to be installed for that.

{summary["blocks"]} blocks remove {removed[1]:.6f} mm^3, between {removed[0]:.6f} and {removed[2]:.6f}
(width {width:.3g} mm^3, {asked}), from a stock of {summary["stock_mm3"]:.6f} mm^3.
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
{edge}
## How to compare

A volume V of yours is wrong if V < `removed_lo_mm3` or V > `removed_hi_mm3`, where `proven` is true; where it is false the
interval is stated, and a V outside of it is in doubt. Inside the bracket it is not
proved right: no error larger than the width of the bracket is left. `removed_mm3` is an estimate inside of it
and good for plots of errors, not for a verdict. Blocks of one line may be summed, and their bounds with them.

With vmachining, where results.csv has the columns `block` or `line`, and `removed_mm3`:

    vmachining compare results.csv .

`job.toml` is a job of vmachining: `vmachining run job.toml` computes the volumes again, and a smaller `chord_mm` (mesh) or
`width` (columns) gives narrower brackets. Cutters are described there: diameters, corner radius, lengths in the units of the job;
only the flutes' body of revolution cuts. This makes the folder again:

    {command}
"""


def _edge() -> str:
    columns = "\n".join(f"| `{column}` | {text} |" for column, text in ENGAGEMENT_MEAN.items())
    return f"""
## Columns of `engagement`

One row per interval of a straight cutting edge (the meridian of the cutter) that lies in the material in front of
the tool, at some rotation angles in the middle of some blocks. An edge cuts where the outward normal and the
velocity of its surface make an acute angle. The bottom disc of a tool is no part of this edge: a plunging flat end
touches nothing here. Ends are good to 1e-6 mm in plane stock and to 1e-4 mm in curved one.

| column | meaning |
|---|---|
{columns}

`vmachining compare results.csv .` compares them too, where results.csv has block, phi_deg, lower_mm and upper_mm.
"""
