"""`write_solids`: swept solids as a STEP file that reads back the same; `built_sweep`: what they are made of."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from vmachining.engines.brep.occt.inside import Union
from vmachining.engines.brep.occt.measure import volume
from vmachining.engines.brep.occt.parts import compound, faces_of, point_inside, points_on
from vmachining.engines.brep.occt.step_out import (
    LabelledFace,
    difference,
    volumes_in,
    write_labelled,
)
from vmachining.engines.brep.occt.tolerances import MISS_MM
from vmachining.engines.brep.occt.validity import Inspection
from vmachining.engines.brep.swept import solids
from vmachining.errors import EngineError
from vmachining.sweep import Sweep
from vmachining.sweep.regions import REGIONS, regions

POINTS, ON = 400, 4000
"""At which a union is compared: around it, and on its faces and edges."""

STEP_MM, WORST = 1e-4, 10.0
"""Half of the way between points whose distances say where the surface is; the most that may be missing, in what was allowed."""

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


def built_sweep(sweep: Sweep, miss_mm: float = MISS_MM, step: Path | None = None) -> Iterator[Any]:
    """`Described`: what OCCT says about the solids of a sweep, numbers that travel between processes, as no shape does.

    Then, where `step` is given, they are written as by `write_solids`, and it is the sum of their volumes as read back, mm^3:
    every face named and coloured by its region, ingress, grazing or egress; "inside" where it lies inside of the sweep.

    miss_mm : as of `solids`. Solids that use it are compared with exact distances at points around the sweep.

    Raises EngineError: One of these points, farther from the surface than the solids may be off, is on the wrong side; or as
        `write_solids`.
    """
    parts = solids(sweep, miss_mm=miss_mm)
    shapes = [part.shape for part in parts]
    fit, points = max(part.fit_mm for part in parts), 0
    if fit > MISS_MM:
        fit, points = compared(sweep, shapes, fit)
    yield Described(tuple(part.report for part in parts), fit, points)
    if step is not None:
        yield write_solids(step, shapes, _labelled(sweep, shapes))


def _labelled(sweep: Sweep, shapes: Sequence[Any]) -> list[LabelledFace]:
    """Faces with the names of their regions."""
    faces = [face for shape in shapes for face in faces_of(shape)]
    points = np.array([point_inside(face) for face in faces])
    inside = sweep.signed_distance(points) < -INSIDE_MM
    kinds = np.where(inside, len(REGIONS), regions(sweep, points)).tolist()
    names = (*REGIONS, "inside")
    return [LabelledFace(face, names[k], SHADES[k]) for face, k in zip(faces, kinds, strict=True)]


def compared(sweep: Sweep, shapes: Sequence[Any], fit_mm: float) -> tuple[float, int]:
    """How far (mm) the union of some shapes is off by exact distances, at least `fit_mm`, and at how many points.

    All that is not within `fit_mm` has to be on the right side. Then points on the faces of the shapes are moved towards
    the surface of the sweep, until nothing lies deeper in it than all shapes reach.

    Raises EngineError: They are not what they should be.
    """
    rng = np.random.default_rng(0)
    lo, hi = sweep.bounds
    points = rng.uniform(lo, hi, (POINTS, 3))
    distance = sweep.signed_distance(points)
    clear = np.abs(distance) > fit_mm
    union = Union(shapes)
    wrong = int((union.holds(points[clear]) != (distance[clear] < 0.0)).sum())
    if wrong:
        what = f"the solids are wrong at {wrong} of {clear.sum()} points by exact distances"
        raise EngineError(what, engine="brep")
    faces = [face for shape in shapes for face in faces_of(shape)]
    on = np.concatenate([points_on(face, -(-ON // (2 * len(faces))), rng) for face in faces])
    deep = sweep.signed_distance(on)
    if deep.max() > fit_mm:
        raise EngineError(f"the solids leave the sweep by {deep.max():.2g} mm", engine="brep")
    sides = STEP_MM * np.eye(3)
    way = np.stack([sweep.signed_distance(on + s) - sweep.signed_distance(on - s) for s in sides], axis=1)
    way /= np.maximum(np.linalg.norm(way, axis=1), STEP_MM)[:, None]
    count, off = int(clear.sum()) + len(on), fit_mm
    while len(on):
        at = on - way * (deep + off)[:, None]
        open_ = (deep < -off) & (sweep.signed_distance(at) < -0.99 * off)
        open_[open_] = ~union.holds(at[open_])
        on, way, deep = on[open_], way[open_], deep[open_]
        if len(on):
            off *= 1.25
        if off > WORST * fit_mm:
            raise EngineError(f"the solids lack more than {off:.2g} mm of the sweep", engine="brep")
    return off, count


def write_solids(path: Path, shapes: Sequence[Any], faces: Sequence[LabelledFace] = ()) -> float:
    """Write TopoDS_Solids into one STEP file, some faces named; returns the sum of their volumes as read back, mm^3.

    Raises EngineError: The file cannot be written, or reads back with other solids or volumes. It is removed then.
    """
    write_labelled(path, shapes[0] if len(shapes) == 1 else compound(shapes), "swept volume", faces)
    back = volumes_in(path)
    if strange := difference(back, [volume(shape) for shape in shapes]):
        path.unlink()
        what = f"{path.name} reads back with {strange}; split the block, or write STL"
        raise EngineError(what, engine="brep")
    return float(sum(back))
