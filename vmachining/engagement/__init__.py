"""What the tool touches: engaged intervals of its cutting edge for every rotation angle, at one instant of a block.

1. `Stance` (sweep room) is the tool at fraction p of a block, `Edge` (tool room) its meridian by arc length s.
2. A point of the edge cuts where its surface moves into what lies before it, N . V > 0, and that is material: in the stock, in
   no earlier sweep. `divided` finds the sign changes: functions that change no faster than the way between two points prove
   cells empty of roots, other cells are halved to 0.01 mm.
3. `contact` turns the edge through a grid of angles and narrows the ends of the engaged arcs to 1e-9 rad.
4. `along/` answers for whole programs, at the errors of its columns.

| file | holds |
|---|---|
| `extract.py` | `contact`, `engaged_parts`, `facing_parts` |
| `workpiece.py` | `RayWorkpiece`: stock minus earlier sweeps by exact distances |
| `divide.py` | `divided`: sign changes along edges |
| `result.py`, `chips.py` | `Engagement`, `chip_table` |
| `analytic/` | engagement in closed form, many positions at once |
| `frames.py`, `chip.py` | frames of tool, contact and feed; chips: plain arrays |

The touch with its own past
---------------------------
The tool stands on the boundary of what it has swept so far. Behind (N . V < 0) the surface has passed through a point. In front
only a pose farther back can have covered it: never where a convex cutter goes straight. Elsewhere the sweep of the block's first
part covers what lies deeper in it than `Past.touch`; earlier sweeps and the stock have the same slack. It moves ends by 1e-9 mm
(2e-7 mm at sweeps that turn) over the sine of the angle between edge and surface. Intervals shorter than 0.02 mm that go no
deeper are a touch and are left out.

Conventions: phi from +y of the tool frame towards +x, clockwise seen from the spindle; phi + feed_angle = 90 degrees straight
ahead. s from the lowest point of the meridian off the bottom disc; with `bottom` the edge continues to the axis, s < 0. Only the
part that cuts (`flute_length`) has an edge. Source: Hendriko, five-axis milling, chapters 5 and 6, rederived; depth and chip area
are the exact ones.

Known limits: gaps and contacts shorter than 0.01 mm along the edge, or narrower in phi than the grid, may be missed. A mesh is as
exact as its triangles. 360 angles take 0.1 to 1 s on one core, more with turning sweeps and large meshes."""

from vmachining.engagement import chip, frames
from vmachining.engagement.chips import chip_points, chip_table
from vmachining.engagement.extract import Contact, contact, engaged_parts, facing_parts
from vmachining.engagement.result import Engagement
from vmachining.engagement.workpiece import By, Past, RayWorkpiece, Workpiece, sweeps_near
from vmachining.stock import BoxStock, CylinderStock, MeshStock, Stock

__all__ = [
    "BoxStock", "By", "Contact", "CylinderStock", "Engagement", "MeshStock", "Past", "RayWorkpiece", "Stock",
    "Workpiece", "chip", "chip_points", "chip_table", "contact", "engaged_parts", "facing_parts", "frames",
    "sweeps_near",
]  # fmt: skip
