"""`write_solids`: swept solids as a STEP file that reads back the same; `described`: what they are made of."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from vmachining.engines.brep.occt.measure import volume
from vmachining.engines.brep.occt.parts import compound, faces_of, point_inside
from vmachining.engines.brep.occt.step_out import (
    LabelledFace,
    difference,
    volumes_in,
    write_labelled,
    write_plain,
)
from vmachining.engines.brep.occt.validity import Inspection, inspect
from vmachining.engines.brep.swept import solids
from vmachining.errors import EngineError
from vmachining.sweep import Sweep
from vmachining.sweep.regions import REGIONS, regions

INSIDE_MM = 1e-3
"""What lies deeper is no boundary; splines are nearer to the truth."""

SHADES = ((0.0, 0.45, 0.7), (0.85, 0.85, 0.85), (0.9, 0.62, 0.0), (0.5, 0.5, 0.5))
"""Of ingress, grazing, egress, inside."""


class Described(NamedTuple):
    """solids : those whose union is a sweep. fit_mm : largest distance of their splines from the true surface."""

    solids: tuple[Inspection, ...]
    fit_mm: float


def described(sweep: Sweep) -> Described:
    """What OCCT says about the solids of a sweep: numbers that travel between processes, as no shape does."""
    parts = solids(sweep)
    return Described(tuple(inspect(part.shape) for part in parts), max(part.fit_mm for part in parts))


def write_sweep(path: Path, sweep: Sweep) -> float:
    """`write_solids` of the solids of a sweep, every face named and coloured by its region: ingress, grazing or egress.

    Where solids overlap, a face inside of the sweep is named "inside".
    """
    shapes = [part.shape for part in solids(sweep)]
    faces = [face for shape in shapes for face in faces_of(shape)]
    points = np.array([point_inside(face) for face in faces])
    inside = sweep.signed_distance(points) < -INSIDE_MM
    kinds = np.where(inside, len(REGIONS), regions(sweep, points)).tolist()
    names = (*REGIONS, "inside")
    labelled = [LabelledFace(face, names[k], SHADES[k]) for face, k in zip(faces, kinds, strict=True)]
    return write_solids(path, shapes, labelled)


def write_solids(path: Path, shapes: Sequence[Any], faces: Sequence[LabelledFace] = ()) -> float:
    """Write TopoDS_Solids into one STEP file; returns the sum of their volumes as read back, mm^3.

    faces : with names and colours.

    Raises EngineError: The file cannot be written, or reads back with other solids or volumes. It is removed then.
    """
    if faces:
        write_labelled(path, shapes[0] if len(shapes) == 1 else compound(shapes), "swept volume", faces)
    else:
        write_plain(path, shapes)
    back = volumes_in(path)
    strange = difference(back, [volume(shape) for shape in shapes])
    if strange:
        path.unlink()
        raise EngineError(
            f"{path.name} reads back with {strange}; split the block, or write STL", engine="brep"
        )
    return float(sum(back))
