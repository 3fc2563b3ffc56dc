"""Where a moving cutter slides along its own envelope: one condition, N . V = 0, for all who ask it.

Goal: engines, envelopes, fluxes and quadratures name the same functions, so that one set of tables checks them all.

1. On a circle of the body the normal speed is f(u) = a cos u + b sin u + c (`condition.py`); two angles graze.
2. Along a face of the meridian a^2 + b^2 - c^2 is a quadratic in the place on it (`faces.py`): where it is positive the
   circles have their two angles, and where it begins to be the grazing curve turns or ends.
3. `weinert.py` (one room up) has the named equations of toroidal and cylindrical cutters, of which the envelopes of the
   B-rep engine take `torus_terms` and `torus_angle`.

| file | holds |
|---|---|
| `condition.py` | `circles`, `circles_along`, `grazing_angles`, `chord`, `folding` |
| `faces.py` | `line_terms`, `arc_terms`, `circle_terms`: the quadratic; `grazing_stretches` |
| `_kernels.py` | f, for numba and numpy |

Source: Weinert, Du, Damm, Stautner, Int. J. Mach. Tools Manuf. 44 (2004) 617-628, equations of two surfaces; the form for
any body of revolution is derived in the docstrings.
"""

from vmachining.sweep.grazing.condition import (
    Circles,
    Instant,
    across,
    chord,
    circles,
    circles_along,
    folding,
    grazing_angles,
    instant,
    normal_speed,
)
from vmachining.sweep.grazing.faces import (
    arc_terms,
    circle_terms,
    grazing_stretches,
    line_terms,
    scalars,
    terms_of,
    whole_meridian,
)

__all__ = [
    "Circles", "Instant", "across", "arc_terms", "chord", "circle_terms", "circles", "circles_along", "folding",
    "grazing_angles", "grazing_stretches", "instant", "line_terms", "normal_speed", "scalars", "terms_of",
    "whole_meridian",
]  # fmt: skip
