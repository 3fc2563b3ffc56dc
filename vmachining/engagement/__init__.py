"""What the tool touches: engaged intervals of its cutting edge for every rotation angle, at one instant of a block.

Goal: the numbers that force models need and that approximate methods are checked against, with ends that are
roots and not samples.

1. `Stance` (sweep room) is the tool at fraction p of a block, `Edge` (tool room) its meridian by arc length s, straight or
   wound.
2. A point of the edge cuts when its surface moves into what lies before it, N . V > 0 (`facing_parts`), and when that is
   material: in the stock, in no earlier sweep. `divided` finds the sign changes of these conditions, one after the other:
   functions that change no faster than the way between two points prove cells empty of roots, other cells are halved to 0.01
   mm.
3. `contact` turns the edge through a grid of angles and narrows the ends of the engaged arcs to 1e-9 rad. `Engagement` holds
   the outcome: intervals with their ends, arcs, depths, area, chip area per feed, removed volume per mm, table and map.
4. `along/` answers for whole programs, at the errors of its columns.

| file | holds |
|---|---|
| `extract.py` | `contact`, `engaged_parts`, `facing_parts` |
| `workpiece.py` | `RayWorkpiece`: stock minus earlier sweeps by exact distances; `sweeps_near`; `By`: what ends an interval |
| `divide.py` | `divided`: sign changes along edges |
| `result.py` | `Engagement`, `EngagementMap` |
| `chips.py` | `chip_table`: cut length, depths, chip thickness and area of any engagement, one table |
| `analytic/` | engagement in closed form, many positions at once |
| `frames.py` | frames of tool, contact and feed: plain numbers and arrays |
| `chip.py` | points of flat, bull and ball edges, facing condition, chip thickness, area, depth: plain arrays |

Jobs are wired to this in `vmachining.job.engage`, where the B-rep, or heights over cells (`analytic`), take the place of
`RayWorkpiece`; pictures are drawn in `vmachining.report`.

The touch with its own past
---------------------------
The tool stands on the boundary of what it has swept so far, so "not yet removed" cannot be asked of its points by a sign. Behind
(N . V < 0) the surface has passed through the point. In front (N . V > 0) only a pose farther back can have covered it: never
where a convex cutter goes straight, because the tangent plane moves away from the earlier poses. Elsewhere the sweep of the
block's first part covers what lies deeper in it than `Past.touch`. The same slack counts for earlier sweeps and for the stock,
whose surface belongs to it. It moves ends by 1e-9 mm (2e-7 mm at sweeps that turn) over the sine of the angle between edge and
surface. Intervals shorter than 0.02 mm that go no deeper are a touch of two round surfaces and are left out.

Conventions: phi from the second direction of the tool frame (+y of an upright tool) towards the first (+x), clockwise seen from
the spindle; phi + feed_angle = 90 degrees straight ahead. s from the lowest point of the meridian off the bottom disc; with
`bottom` the edge continues to the axis, s < 0. Only the part that cuts (`flute_length`) has an edge. Source of angle, edge
parameter and facing condition: Hendriko, five-axis milling, chapters 5 and 6, rederived; depth and chip area are the exact ones,
not the printed.

Known limits: gaps and contacts shorter than 0.01 mm along the edge, or narrower in phi than the grid, may be missed. A mesh (STL,
or a STEP in method dexel) is as exact as its triangles. Cost on one core, 360 angles: 0.1 to 1 s; a sweep that turns or comes
back to itself adds 0.1 to 0.5 s, an STL of twenty thousand triangles about a second. In 40 random chains against B-rep solids on
a round bar (`vmachining bench engage`) the ends agreed to 6e-7 mm; 380 random cases against sampled poses gave no contact where
none is."""

from vmachining.engagement import chip, frames
from vmachining.engagement.chips import CHIP_COLUMNS, chip_points, chip_table, depths
from vmachining.engagement.divide import RESOLUTION_MM
from vmachining.engagement.extract import Contact, contact, engaged_parts, facing_parts
from vmachining.engagement.result import COLUMNS, Engagement, EngagementMap
from vmachining.engagement.workpiece import By, Past, RayWorkpiece, Workpiece, sweeps_near
from vmachining.stock import BoxStock, CylinderStock, MeshStock, Stock

__all__ = [
    "CHIP_COLUMNS",
    "COLUMNS",
    "RESOLUTION_MM",
    "BoxStock",
    "By",
    "Contact",
    "CylinderStock",
    "Engagement",
    "EngagementMap",
    "MeshStock",
    "Past",
    "RayWorkpiece",
    "Stock",
    "Workpiece",
    "chip",
    "chip_points",
    "chip_table",
    "contact",
    "depths",
    "engaged_parts",
    "facing_parts",
    "frames",
    "sweeps_near",
]
