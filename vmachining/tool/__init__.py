"""Cutters as surfaces of revolution: pure shape, never where it is.

Goal: one representation for every cutter, the meridian, on which everything else (distances, sweeps, meshes,
volumes) is written once.

1. A cutter checks its sizes and draws its meridian: lines and outward arcs (r, z) from the tip up.
2. `Profile` answers for the body of revolution: exact volume, surface, shadow, radius, normals.
3. `Profile.convex_pieces` cuts it at every height where the meridian turns outward; `convex_cover` lets the
   pieces overlap, so that distances to the union have no seams.
4. The part that cuts, the shank and the holder are three profiles in one frame (tip at 0, axis +z), so that a
   a touch differs from a cut.

| file | holds |
|---|---|
| `profile.py` | `Profile`, `Segment`: the meridian and what follows from it; `convex_cover`: overlapping convex pieces |
| `edge.py` | `Edge`: the cutting edge as a curve, straight or with a constant lead |
| `cutters.py` | `FlatEnd`, `BallNose`, `BullNose`, `Taper`, `ProfileTool` and their common base `Cutter` |
| `apt.py` | `AptTool`: the seven parameters of APT |
| `table.py` | `tool_from_mapping`, `mapping_of_tool`: one `[[tools]]` table of a job file |

Source: the seven parameters are those of APT (CUTTER statement, ISO 4343); the arc ends are the roots of
line and circle, rederived here. Departures: `Taper.diameter` is that of the corner torus or ball, not of the
point where the flank meets z = 0 (APT's d), so that a ball tip has corner_radius = diameter / 2. The whole
tool is closed by a flat disc at `length`; above the flutes it keeps the cutter's radius, and the shank is a
separate profile.

Known limits: a meridian never falls in z (no hollow bottom), arcs only bulge outward, free meridians are
polylines. Teeth are a number; the helix is one too, until somebody asks for an `Edge`.
"""

from vmachining.tool.apt import AptTool
from vmachining.tool.cutters import BallNose, BullNose, Cutter, FlatEnd, ProfileTool, Taper, Tool
from vmachining.tool.edge import Edge, EdgeParts
from vmachining.tool.profile import Profile, Segment, convex_cover
from vmachining.tool.table import mapping_of_tool, tool_from_mapping

__all__ = [
    "AptTool", "BallNose", "BullNose", "Cutter", "Edge", "EdgeParts", "FlatEnd", "Profile", "ProfileTool", "Segment",
    "Taper", "Tool", "convex_cover", "mapping_of_tool", "tool_from_mapping",
]  # fmt: skip
