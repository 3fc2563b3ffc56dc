"""Analytical boundary simulation (ABS): engaged intervals of the cutting edge in closed form, for many positions at once.

Goal: chip geometry of flat, bull and ball cutters over every rotation angle of a whole pass, fast enough for feeds and
forces, and exact for the workpiece as it is given.

1. `frames` and `chip` (room above) hold the coordinates: tool frame, lead and tilt, edge points, facing condition, chips.
2. Semi-finish: the workpiece is a `HeightStock`, heights over cells: blocks of a staircase, vertical vectors, or a job that
   has run (`vmachining.job.height_map`). `engaged` collects where the edge crosses walls, tops and floor, sorts, and tests
   the middle of every interval. No table of cases decides.
3. Finish: a surface known by its normals is modelled by circular or straight profiles (`Patch`), `finished` follows the edge
   to it at every angle. The published stages (`staged_length`, `station_ends`) are kept for comparison.
4. `Pass` is the outcome: intervals [position, angle, interval], cut length, depths, chip thickness and area, LE and UE.
5. `HeightWorkpiece` lets `engage --method analytic` ask the same kernels at one instant of a job.

| file | holds |
|---|---|
| `passes.py` | `engaged`, `Pass`, `Corner` |
| `stairs.py`, `heights.py` | `HeightStock`; heights of stock minus sweeps |
| `records.py` | `Records`: CL and CC points, interpolation |
| `planes.py` | where the edge crosses a plane |
| `surface.py` | `Patch`, `NormalGrid`: surface shape from normals |
| `finish.py`, `finish_corner.py` | direct solve; published stages for the cylinder and for the corner |
| `workpiece.py` | `HeightWorkpiece`, `corner_of` |

Source: Hendriko, five-axis milling, chapters 5 and 6; the printed equations are corrected, tests show where they fail, and
docs/engagement_analytic.md maps every symbol to its function.

Known limits: the edge is straight (no helix). The workpiece is what heights can say: no overhang. Contacts with a
surface shorter than r / 50 may be missed by `finished`; `engaged` misses nothing. Measured: docs/measured/abs.md.
"""

from vmachining.engagement.analytic.finish import (
    Stages,
    circle_length,
    finished,
    section_through,
    slope_length,
    staged_length,
    staged_lengths,
)
from vmachining.engagement.analytic.finish_corner import (
    EndPlace,
    StationEnd,
    corner_circle,
    corner_line,
    end_at_height,
    end_place,
    interpolated_heights,
    station,
    station_ends,
)
from vmachining.engagement.analytic.heights import heights_of
from vmachining.engagement.analytic.passes import Corner, Pass, engaged
from vmachining.engagement.analytic.planes import CornerCrossings, corner_plane, cylinder_plane
from vmachining.engagement.analytic.records import Poses, Records, axis_rate_of
from vmachining.engagement.analytic.stairs import HeightStock
from vmachining.engagement.analytic.surface import (
    NormalGrid,
    Patch,
    Section,
    Shape,
    Surface,
    section,
    section_radius,
)
from vmachining.engagement.analytic.workpiece import HeightWorkpiece, corner_of

__all__ = [
    "Corner", "CornerCrossings", "EndPlace", "HeightStock", "HeightWorkpiece", "NormalGrid", "Pass", "Patch", "Poses",
    "Records", "Section", "Shape", "Stages", "StationEnd", "Surface", "axis_rate_of", "circle_length",
    "corner_circle", "corner_line", "corner_of", "corner_plane", "cylinder_plane", "end_at_height", "end_place",
    "engaged", "finished", "heights_of", "interpolated_heights", "section", "section_radius", "section_through",
    "slope_length", "staged_length", "staged_lengths", "station", "station_ends",
]  # fmt: skip
