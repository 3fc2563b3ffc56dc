"""`write_solids`: swept solids as a STEP file that reads back the same; `described`: what they are made of."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from vmachining.engines.brep.occt.inside import held
from vmachining.engines.brep.occt.measure import volume
from vmachining.engines.brep.occt.parts import compound, faces_of, point_inside
from vmachining.engines.brep.occt.step_out import (
    LabelledFace,
    difference,
    volumes_in,
    write_labelled,
    write_plain,
)
from vmachining.engines.brep.occt.tolerances import MISS_MM
from vmachining.engines.brep.occt.validity import Inspection, inspect
from vmachining.engines.brep.swept import solids
from vmachining.errors import EngineError
from vmachining.sweep import Sweep
from vmachining.sweep.regions import REGIONS, regions

POINTS = 400
"""At which a union is compared."""

INSIDE_MM = 1e-3
"""What lies deeper is no boundary; splines are nearer to the truth."""

SHADES = ((0.0, 0.45, 0.7), (0.85, 0.85, 0.85), (0.9, 0.62, 0.0), (0.5, 0.5, 0.5))
"""Of ingress, grazing, egress, inside."""


class Described(NamedTuple):
    """solids : those whose union is a sweep. fit_mm : largest distance of their splines from the true surface, or what is
    missing between them. points : at which their union was compared with exact distances, 0 where `fit_mm` is as usual."""

    solids: tuple[Inspection, ...]
    fit_mm: float
    points: int = 0


def described(sweep: Sweep, miss_mm: float = MISS_MM) -> Described:
    """What OCCT says about the solids of a sweep: numbers that travel between processes, as no shape does.

    miss_mm : as of `solids`. Solids that use it are compared with exact distances at points around the sweep.

    Raises EngineError: One of these points, farther from the surface than the solids may be off, is on the wrong side.
    """
    parts = solids(sweep, miss_mm=miss_mm)
    fit = max(part.fit_mm for part in parts)
    points = _compared(sweep, [part.shape for part in parts], fit) if fit > MISS_MM else 0
    return Described(tuple(inspect(part.shape) for part in parts), fit, points)


def _compared(sweep: Sweep, shapes: Sequence[Any], fit_mm: float) -> int:
    """At how many points the union of some shapes agrees with exact distances: all that are not within `fit_mm`."""
    lo, hi = sweep.bounds
    points = np.random.default_rng(0).uniform(lo, hi, (POINTS, 3))
    distance = sweep.signed_distance(points)
    clear = np.abs(distance) > fit_mm
    wrong = int((held(shapes, points[clear]) != (distance[clear] < 0.0)).sum())
    if wrong:
        raise EngineError(
            f"the solids are wrong at {wrong} of {clear.sum()} points by exact distances", engine="brep"
        )
    return int(clear.sum())


def write_sweep(path: Path, sweep: Sweep, miss_mm: float = MISS_MM) -> float:
    """`write_solids` of the solids of a sweep, every face named and coloured by its region: ingress, grazing or egress.

    Where solids overlap, a face inside of the sweep is named "inside".
    """
    shapes = [part.shape for part in solids(sweep, miss_mm=miss_mm)]
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
