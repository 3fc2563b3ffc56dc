"""OCCT: swept volumes as valid solids, removed volume per block that is never silently wrong, STEP.

Goal: a B-rep answer beside the mesh bracket. Every value is either inside the bracket or refused with a reason.

1. `solid(sweep)` builds the sweep of a block vertex by vertex: caps trimmed at the grazing curve, the sheet the
   curve draws, discs. No boolean, no sewing; planes, cylinders, cones, spheres, tori wherever these are exact.
2. `volume(shape)` integrates along edges in closed form per kind of face.
3. `removal` is the gate: a boolean is one of several ways of asking OCCT, and its value stands only where all judges (engines of
   other kinds) allow it. The judges exclude each other: the block is disputed.
4. `check_blocks` does that for many blocks in worker processes with a time limit: a crash or a hang costs an attempt, at worst
   one block. `isolated` runs any function like that.
5. `step_file` writes the workpiece: cut block by block, each cut gated, valid and closed at the end.
6. `read_step` is the door for STEP stock.

| room or file | holds |
|---|---|
| `occt/shapes.py`, `topology.py` | curves and surfaces with their numpy formula; `Builder`: shells vertex by vertex |
| `occt/primitives.py`, `polyhedron.py`, `parts.py` | boxes, revolved bodies; triangles as plane faces; parts of a shape |
| `occt/measure.py`, `validity.py` | exact volume; what OCCT says of a solid |
| `occt/inside.py`, `probe.py` | which points, and which parts of a curve, lie in solids |
| `occt/booleans.py`, `step.py`, `step_out.py` | booleans that are asked whether they worked; STEP in and out |
| `occt/tolerances.py` | every tolerance of a solid, and where it comes from |
| `translations/` | upright tools: level lines and arcs, plunges, ramps, helices |
| `envelopes/` | tools that lean or turn: grazing curves, sheets, lenses, parts in time, turns about a line, covers |
| `swept.py`, `write.py` | `solid`, `solids` of any sweep; STEP of them |
| `removal/` | the gate: attempts, judges, verdicts, the processes that make them |
| `workpiece/` | the stock after all blocks as a valid solid; which parts of a cutting edge lie in it |
| `blank.py`, `process.py` | raw stock as a solid; a process that may crash or hang |

Envelopes: a spline sheet and its neighbours share nodes, so borders agree to rounding. Flat faces that tilt re-enter nearly
always; valleys and lenses cut that off in closed form, and the volume is V(K) + Phi - W of the flux identity. Where the
envelope folds, parts of the tool and of the block and some poses cover the sweep; rotations about a fixed line through the
axis are two or four solids of analytic faces.

Source: Weinert, Du, Damm, Stautner (2004) for the grazing curve of toroidal cutters (`vmachining.sweep.weinert`); the rest is
derived in the docstrings. Departure: no sewing, no lofts, no `BRepGProp`.

Measured: which attempt won how many blocks of random chains `docs/measured/gate.md`; single sweeps `docs/measured/brep.md`.

Known limits: a block whose solid cannot be built is refused by name, and so are blocks that need it as a
neighbour: cones that meet a steep slope on arcs in upright planes, steps of a cutter there, and what `envelopes/pieces.py`
says of tools that turn. A cutter that is not convex on a ramp, and arcs or helices that come
back to themselves, are several solids whose union is the sweep: a helical entry is the cutter at its lowest, and
what its front passes per half turn. A cone's apex brings one edge without length, which OCCT wants there.
Brackets of the mesh engine are those of the triangles of a curved STEP; jobs widen them by what the triangles
can change (`stock_slack_mm3` of the summary), so a gate on such a stock is that much weaker.
A workpiece as STEP is cut block by block in one process: minutes for a hundred blocks, not for thousands.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from vmachining.engines.brep.occt.step import StepSolid, read_step

if TYPE_CHECKING:
    from vmachining.engines.brep.blank import Blank, shape_of
    from vmachining.engines.brep.occt.inside import held
    from vmachining.engines.brep.occt.measure import volume
    from vmachining.engines.brep.occt.validity import Inspection, inspect
    from vmachining.engines.brep.process import isolated, isolated_steps
    from vmachining.engines.brep.removal.attempts import ATTEMPTS
    from vmachining.engines.brep.removal.check import BlockChecker
    from vmachining.engines.brep.removal.gate import Status, Verdict
    from vmachining.engines.brep.removal.workers import check_blocks, step_file
    from vmachining.engines.brep.swept import solid, solids
    from vmachining.engines.brep.workpiece.edges import BrepWorkpiece
    from vmachining.engines.brep.write import Described, described, write_solids, write_sweep

__all__ = [
    "ATTEMPTS",
    "Blank",
    "BlockChecker",
    "BrepWorkpiece",
    "Described",
    "Inspection",
    "Status",
    "StepSolid",
    "Verdict",
    "check_blocks",
    "described",
    "held",
    "inspect",
    "isolated",
    "isolated_steps",
    "read_step",
    "shape_of",
    "solid",
    "solids",
    "step_file",
    "volume",
    "write_solids",
    "write_sweep",
]

_FILES = {
    "blank": ("Blank", "shape_of"),
    "occt.inside": ("held",),
    "occt.measure": ("volume",),
    "occt.validity": ("Inspection", "inspect"),
    "process": ("isolated", "isolated_steps"),
    "removal.attempts": ("ATTEMPTS",),
    "removal.check": ("BlockChecker",),
    "removal.gate": ("Status", "Verdict"),
    "removal.workers": ("check_blocks", "step_file"),
    "swept": ("solid", "solids"),
    "workpiece.edges": ("BrepWorkpiece",),
    "write": ("Described", "described", "write_solids", "write_sweep"),
}
_HOME = {name: file for file, names in _FILES.items() for name in names}


def __getattr__(name: str) -> Any:
    """OCCT takes seconds to load: only for who asks for it."""
    if name in _HOME:
        return getattr(importlib.import_module(f"{__name__}.{_HOME[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
