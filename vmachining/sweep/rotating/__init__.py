"""Rays and distances where the tool axis turns, or where the tip goes around an arc.

1. A convex piece of the body is an intersection of cones, discs and tori; a line meets it in one interval,
   by quadratics and by Newton's method on the convex distance to the torus, from outside.
2. Over time the interval moves. Its ends can only leave what is already known where the surface advances, and
   a tangent plane that moves with the tool, with a bound of the second derivative of the motion, proves for
   how long it cannot. Known poses at both ends of a time interval are tried; what they do not cover is cut,
   at the secant root of the normal speed where that changes sign.
3. Poses that miss the line prove nothing by themselves: cutting planes walk in from both ends of the line.
4. Distances of points use the same proof with the gradient of the distance.

| file | holds |
|---|---|
| `pack.py` | bodies and motions as rows |
| `pose/` | one pose: its motion, the lines that cross it, distances to it |
| `_kernels.py` | the search in time |

On spheres, and on discs of a steady axis, the plane need not turn with the tool: it keeps its direction and
moves with the centre, so that a ball turned about its centre is nothing to search.

Known limits: another surface that slides along itself gives the planes nothing to prove; after 1000 intervals
of time what one may miss grows from 1e-11 mm by factors of 100, up to 1e-7 mm.
"""

from vmachining.sweep.rotating.pack import Packed, arc_series, meridian_rows, pack, rate_bound, waves_of

__all__ = ["Packed", "arc_series", "meridian_rows", "pack", "rate_bound", "waves_of"]
