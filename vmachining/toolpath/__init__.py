"""Tool paths that we generate, with the geometry that makes them right.

| file | holds |
|---|---|
| `triangle.py` | `Triangle`: a pocket with three sides and round corners |
| `pocket.py` | four strategies for it: paths, lengths as published and as they are, coverage, advice; program and job |
| `clpath.py` | `CLPath`: poses in order; as NC program, table of poses, APT file |
| `rotary.py` | `rotary_program`: a leaning tool as an NC program of one machine, by its inverse kinematics |
| `flank.py` | `flank_path`: ruled faces with the side of the tool |
| `facets/` | surfaces of facets: drop cutter, passes in three and five axes, waterlines |

Source: spec C for pockets. No engine is imported: the engines compute what a path cuts.
"""

from vmachining.toolpath.flank import flank_path
from vmachining.toolpath.pocket import (
    MODES,
    STRATEGIES,
    Pocket,
    advice,
    bare_path,
    coverage,
    coverage_shapes,
    needs_centre,
    path_length,
    pocket_lengths,
    pocket_path,
)
from vmachining.toolpath.triangle import Triangle

__all__ = [
    "MODES", "STRATEGIES", "Pocket", "Triangle", "advice", "bare_path", "coverage", "coverage_shapes", "flank_path",
    "needs_centre", "path_length", "pocket_lengths", "pocket_path",
]  # fmt: skip
