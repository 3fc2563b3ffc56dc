"""`write_solids`: swept solids as a STEP file that reads back the same; `described`: what they are made of."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from vmachining.engines.brep.measure import volume
from vmachining.engines.brep.swept import Inspection, inspect, solids
from vmachining.errors import EngineError
from vmachining.sweep import Sweep

__all__ = ["Described", "described", "write_solids", "write_sweep"]

SAME_REL = 1e-8
"""STEP keeps 15 digits of a pole; volumes are integrated over the same faces."""


class Described(NamedTuple):
    """solids : those whose union is a sweep. fit_mm : largest distance of their splines from the true surface."""

    solids: tuple[Inspection, ...]
    fit_mm: float


def described(sweep: Sweep) -> Described:
    """What OCCT says about the solids of a sweep: numbers that travel between processes, as no shape does."""
    parts = solids(sweep)
    return Described(tuple(inspect(part.shape) for part in parts), max(part.fit_mm for part in parts))


def write_sweep(path: Path, sweep: Sweep) -> float:
    """`write_solids` of the solids of a sweep."""
    return write_solids(path, [part.shape for part in solids(sweep)])


def write_solids(path: Path, shapes: Sequence[Any]) -> float:
    """Write TopoDS_Solids into one STEP file; returns the sum of their volumes as read back, mm^3.

    Raises
    ------
    EngineError
        The file cannot be written, or reads back with other solids or volumes. It is removed then.
    """
    import cadquery as cq
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer

    writer = STEPControl_Writer()
    for shape in shapes:
        writer.Transfer(shape, STEPControl_StepModelType.STEPControl_AsIs)
    if writer.Write(str(path)) != IFSelect_ReturnStatus.IFSelect_RetDone:
        path.unlink(missing_ok=True)
        raise EngineError(f"OCCT cannot write {path.name}", engine="brep")
    found = [cq.Shape.cast(v.wrapped) for v in cq.importers.importStep(str(path)).vals()]  # type: ignore[union-attr]
    back = sorted(volume(part.wrapped) for whole in found for part in whole.Solids())
    wanted = sorted(volume(shape) for shape in shapes)
    good = len(back) == len(wanted) and all(
        abs(a - b) <= SAME_REL * b for a, b in zip(back, wanted, strict=True)
    )
    if not good:
        path.unlink()
        raise EngineError(f"{path.name} reads back with {back} mm3 instead of {wanted}", engine="brep")
    return float(sum(back))
