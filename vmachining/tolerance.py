"""Every tolerance of the package, and the limit of its kernel: name, value and where it comes from."""

from __future__ import annotations

from typing import Final

CHORD_MM: Final = 0.01
"""Default distance asked for between the inner and the outer sweep; the usual CAM chordal tolerance."""

LENGTH_EPS_MM: Final = 1e-9
"""Two points closer than this are one: a thousandth of the finest machine increment (1 nm)."""

ANGLE_EPS: Final = 1e-12
"""Directions whose cosine differs by less are one: some ulp of a unit vector."""

ARC_RADIUS_MM: Final = 0.01
"""Largest difference between the start and the end radius of a programmed arc (controls use 0.005 to 0.05)."""

VOLUME_REL: Final = 1e-12
"""Relative noise of a mesh volume: about n_tri ulp in the sum of signed tetrahedra."""

BREP_SECONDS: Final = 120.0
"""Of a processor: limit of a B-rep check, solids of the block and of all that it needs included. Lines and level arcs need a
second or so, sharp turns of five axes more than they get."""

WIDTH: Final = 0.003
"""Default width of a block's bracket relative to its volume: as narrow as two meshes make it at the default chord where
they are at their best (slots of a flat end), and a third of what forces and feeds are known to."""

WIDTH_MM3: Final = 1e-3
"""Default width at which a block of hardly any volume is done: a layer of a micrometre on a square millimetre."""
