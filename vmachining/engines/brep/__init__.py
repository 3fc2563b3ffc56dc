"""OCCT, so far as a door: STEP files in, checked closed solids out.

| file | holds |
|---|---|
| `step.py` | `read_step`: STEP -> closed solid -> triangles and exact volume |

Every shape is asked before it is believed: OCCT reads an open shell, an invalid solid or nothing at all
without complaint. The B-rep oracle (swept solids, the ladder of booleans) is not here yet.
"""

from vmachining.engines.brep.step import StepSolid, read_step

__all__ = ["StepSolid", "read_step"]
