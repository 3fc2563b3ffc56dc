"""Every length and angle that decides something about a solid of OCCT: name, value, where it comes from.

OCCT takes points nearer than its confusion for one. Everything here is that number, a multiple of it that a face or an edge
needs to be made, or what a solid may miss the truth by and still be called the sweep (gates: `MISS_MM`, volumes).
"""

from __future__ import annotations

from typing import Final

# -- what OCCT takes for the same ------------------------------------------------------------------------------

CONFUSION_MM: Final = 1e-7
"""`Precision::Confusion` of OCCT: points that close are one. Tolerance of our vertices, edges and faces."""

SAME_VERTEX_MM: Final = 2e-8
"""Ends of edges that close get one vertex: a fifth of the confusion, far above rounding at 100 mm."""

SAME_CROSSING_MM: Final = 1e-6
"""Crossings of a line with faces that close are one: a line through an edge meets both of its faces."""

FLAT_MM: Final = 1e-9
"""A radius, a distance from an axis, a difference of heights or radii below this is zero: a hundredth of the confusion."""

SAME_ANGLE_RAD: Final = 1e-9
"""Directions that close are one, normals that close are tangent."""

APART_MM: Final = 1e-6
"""A cusp this close to the end of a face begins there: ten times the confusion."""

# -- how well curves and sheets are asked to fit -----------------------------------------------------------------

PARAMETER_FIT_MM: Final = 1e-8
"""Of an edge's curve in the parameters of a face: a tenth of the tolerance of an edge."""

CURVE_FIT_MM: Final = 3e-8
"""Of fitted curves: a third of the confusion. What was reached is reported. At 1e-9 there are twice as many knots and booleans
of two ramps of a torus take 2.4 times as long."""

EDGE_CURVE_FIT_MM: Final = 1e-9
"""Of splines that represent wound cutting edges: questions about lines through them, no booleans."""

SHEET_FIT_MM: Final = 1e-6
"""Of the sheets of a tool that turns: ten times the confusion, 1e-8 of a volume."""

# -- what is too small to build ----------------------------------------------------------------------------------

LEVEL_MM: Final = 2e-5
"""A rise or a sideways step below this does not count (the mean is taken): faces that close to each other would get edges
of that length."""

SHORT_EDGE_MM: Final = 1e-4
"""Shortest edge: a thousand times the confusion."""

SHORT_PIECE_MM: Final = 1e-3
"""A part of a block during which the tool moves less is left out: its sheets would be ten shortest edges wide."""

NARROW_WALL_MM: Final = 1e-3
"""A wall that runs this close around the axis of its helix is a spline: no kernel likes such a cylinder."""

SNAP_MM: Final = 1e-5
"""A circle this close to a joint of the meridian is taken for it: faces miss the square of it over their radius."""

SLIVER_MM: Final = 0.01
"""Shorter pieces of a cutting edge whose middle is on a surface are where two round surfaces touch."""

CRUMB_MM3: Final = 1e-9
"""A cube of 1e-3 mm: smaller solids do not count. Crumbs seen held 4e-21."""

# -- what a solid may miss ---------------------------------------------------------------------------------------

MISS_MM: Final = 3e-5
"""By how much a solid may cross itself where a sheet lies inside, or miss the sweep between poses; volumes are right
to 1e-5 then. Asked of exact distances."""

GAP_MM: Final = 1e-4
"""Motion left out at a change of shape: both poses are there, so smooth faces miss the square of it over their
radius, and only a sharp edge leaves a groove half as deep. No edge of the solids is much shorter."""

END_GAP_MM: Final = 1e-6
"""Motion left out where the shape changes at the very start or end of a block, of all faces there."""

SWEPT_REL: Final = {False: 1e-6, True: 1e-5}
"""Agreement of a volume with the closed form or the flux identity: of analytic faces, and where some are splines."""

POLYHEDRON_REL: Final = 1e-12
"""The same of plane faces through given corners, for every triangle: rounding of a sum over all of them."""

# -- when a point is on something --------------------------------------------------------------------------------

ON_FACE_MM: Final = 1e-6
"""A point of a cutting edge this close to a face is on it: ten times the confusion."""

ON_FACE_SLANTED_MM: Final = 5e-6
"""The same along a line that meets the face at 12 degrees."""

ON_SWEEP_MM: Final = 1e-4
"""A point of a face of the workpiece this close to a sweep was made by it: tolerances that OCCT gives to edges in which
faces intersect."""

# -- files -------------------------------------------------------------------------------------------------------

STEP_REL: Final = 1e-8
"""Volumes of swept solids as read back: STEP keeps 15 digits of a pole."""

WORKPIECE_STEP_REL: Final = 1e-6
"""The same of a workpiece, whose edges are intersections and are read with their tolerances."""

STEP_FACET_RAD: Final = 0.25
"""Largest turn of the normal from facet to facet of a STEP stock; keeps small fillets round when the chord is coarse."""

STEP_MESH_REL: Final = 0.05
"""A triangulation whose volume differs more than this from the exact one is not that solid any more."""

ODD_RAD: Final = 0.137
"""A turn that no face of ours is aligned with, before or after."""
