"""`shape_of`: raw stock as a solid of OCCT."""

from __future__ import annotations

from typing import Any

from vmachining.engines.brep.occt.polyhedron import polyhedron
from vmachining.stock import Blank


def shape_of(blank: Blank) -> Any:
    """TopoDS_Shape. Raises EngineError for triangles that OCCT makes no solid of."""
    from vmachining.engines.brep.occt import parts, primitives, step_out  # OCCT takes seconds to load

    if blank.kind == "box":
        return primitives.box(blank.lo, blank.hi)
    if blank.kind == "cylinder":
        return primitives.cylinder(blank.center, blank.radius, (blank.lo[2], blank.hi[2]))
    if blank.kind == "triangles":
        return polyhedron(blank.triangles)
    found = step_out.solids_in(blank.file)
    return found[0] if len(found) == 1 else parts.compound(found)
