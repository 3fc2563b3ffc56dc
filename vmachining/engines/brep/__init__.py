"""OCCT: swept volumes as valid solids, removed volume per block that is never silently wrong, STEP.

A value of this room stands only where judges of other kinds (mesh, columns, rays) allow it; otherwise the block is
refused with a reason, or disputed where the judges exclude each other. `docs/gate.md` explains the gate.

1. `solid(sweep)` builds the sweep of a block vertex by vertex: caps trimmed at the grazing curve, the sheet that the
   curve draws, discs; planes, cylinders, cones, spheres and tori wherever these are exact.
2. `volume(shape)` integrates along edges in closed form per kind of face.
3. `check_blocks` asks OCCT for what each block removes, in several ways, in processes with a time limit: a crash or a
   hang costs an attempt, at worst one block. `isolated` runs any function like that.
4. `step_file` writes the workpiece, cut block by block with every cut gated; `read_step` reads STEP stock.

| room or file | holds |
|---|---|
| `occt/` | curves, surfaces, shells, exact volume, membership, booleans, STEP, every tolerance |
| `translations/` | upright tools: level lines and arcs, plunges, ramps, helices |
| `envelopes/` | tools that lean or turn: grazing curves, sheets, lenses, parts in time, turns about a line, covers |
| `swept.py`, `write.py` | `solid`, `solids` of any sweep; STEP of them |
| `removal/` | the gate: attempts, judges, verdicts, the processes that make them |
| `workpiece/` | the stock after all blocks as a valid solid; which parts of a cutting edge lie in it |
| `blank.py`, `process.py` | raw stock as a solid; a process that may crash or hang |

Source: Weinert, Du, Damm, Stautner (2004) for the grazing curve of toroidal cutters (`vmachining.sweep.weinert`); the
rest is derived in the docstrings. Departure: no sewing, no lofts, no `BRepGProp`.

Known limits: a block whose solid cannot be built is refused, and so are blocks that need it as a neighbour (cones that
meet a steep slope on arcs in upright planes, steps of a cutter there, what `envelopes/pieces.py` says of tools that
turn). A curved STEP stock is judged by triangles, within `stock_slack_mm3` of the summary. A workpiece as STEP takes
minutes for a hundred blocks. Measured: `docs/measured/gate.md`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vmachining.engines.brep.occt.step import read_step
from vmachining.later import later

if TYPE_CHECKING:
    from vmachining.engines.brep.blank import shape_of
    from vmachining.engines.brep.occt.inside import held
    from vmachining.engines.brep.occt.measure import volume
    from vmachining.engines.brep.occt.validity import Inspection, inspect
    from vmachining.engines.brep.process import isolated, isolated_steps
    from vmachining.engines.brep.removal.check import BlockChecker
    from vmachining.engines.brep.removal.gate import Status, Verdict
    from vmachining.engines.brep.removal.workers import check_blocks, step_file
    from vmachining.engines.brep.swept import solid, solids
    from vmachining.engines.brep.workpiece.edges import BrepWorkpiece
    from vmachining.engines.brep.write import built_sweep, write_solids
    from vmachining.stock import Blank

__all__ = [
    "Blank", "BlockChecker", "BrepWorkpiece", "Inspection", "Status", "Verdict", "built_sweep", "check_blocks",
    "held", "inspect", "isolated", "isolated_steps", "read_step", "shape_of", "solid", "solids", "step_file",
    "volume", "write_solids",
]  # fmt: skip

__getattr__ = later(__name__, {
    "blank": "Blank shape_of", "occt.inside": "held", "occt.measure": "volume", "occt.validity": "Inspection inspect",
    "process": "isolated isolated_steps", "removal.check": "BlockChecker", "removal.gate": "Status Verdict",
    "removal.workers": "check_blocks step_file", "swept": "solid solids", "workpiece.edges": "BrepWorkpiece",
    "write": "built_sweep write_solids",
})  # fmt: skip
"""OCCT takes seconds to load: only for who asks for it."""
