"""`write_solids`: swept solids as a STEP file that reads back the same; `described`: what they are made of."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from vmachining.engines.brep.occt.measure import volume
from vmachining.engines.brep.occt.validity import Inspection, inspect
from vmachining.engines.brep.swept import solids
from vmachining.errors import EngineError
from vmachining.sweep import Sweep

__all__ = ["Described", "described", "write_solids", "write_sweep"]

ORIGIN = "vmachining"
"""In the header of a STEP file, as the system it comes from: files of ours are known by it."""

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
    from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer
    from OCP.TCollection import TCollection_HAsciiString

    writer = STEPControl_Writer()
    for shape in shapes:
        writer.Transfer(shape, STEPControl_StepModelType.STEPControl_AsIs)
    header = APIHeaderSection_MakeHeader(writer.Model())
    header.SetOriginatingSystem(TCollection_HAsciiString(ORIGIN))
    if writer.Write(str(path)) != IFSelect_ReturnStatus.IFSelect_RetDone:
        path.unlink(missing_ok=True)
        raise EngineError(f"OCCT cannot write {path.name}", engine="brep")
    found = [cq.Shape.cast(v.wrapped) for v in cq.importers.importStep(str(path)).vals()]  # type: ignore[union-attr]
    back = [volume(part.wrapped) for whole in found for part in whole.Solids()]
    strange = _difference(back, [volume(shape) for shape in shapes])
    if strange:
        path.unlink()
        raise EngineError(
            f"{path.name} reads back with {strange}; split the block, or write STL", engine="brep"
        )
    return float(sum(back))


def _difference(back: Sequence[float], wanted: Sequence[float]) -> str:
    """What became of some volumes (mm^3), in words; nothing if they are the same."""
    if len(back) != len(wanted):
        return f"{len(back)} solids instead of {len(wanted)}"
    inverted = sum(value < 0.0 for value in back)
    gaps = [abs(abs(a) - b) for a, b in zip(sorted(map(abs, back)), sorted(wanted), strict=True)]
    other = sum(not gap <= SAME_REL * value for gap, value in zip(gaps, sorted(wanted), strict=True))
    found = [f"{count} of {len(back)} solids {what}" for count, what in (
        (inverted, "inside out"), (other, f"of another volume, by up to {max(gaps, default=0.0):.3g} mm3")) if count]  # fmt: skip
    return " and ".join(found)
