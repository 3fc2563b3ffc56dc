"""`write_solids`: swept solids as a STEP file that reads back the same; `described`: what they are made of."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from vmachining.engines.brep.occt.measure import volume
from vmachining.engines.brep.occt.step_out import difference, volumes_in, write_plain
from vmachining.engines.brep.occt.validity import Inspection, inspect
from vmachining.engines.brep.swept import solids
from vmachining.errors import EngineError
from vmachining.sweep import Sweep

__all__ = ["Described", "described", "write_solids", "write_sweep"]


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

    Raises EngineError: The file cannot be written, or reads back with other solids or volumes. It is removed then.
    """
    write_plain(path, shapes)
    back = volumes_in(path)
    strange = difference(back, [volume(shape) for shape in shapes])
    if strange:
        path.unlink()
        raise EngineError(
            f"{path.name} reads back with {strange}; split the block, or write STL", engine="brep"
        )
    return float(sum(back))
