"""What a cutter sweeps during one block: geometry without a kernel.

Goal: exact answers about tool + motion of one block that every engine can be measured against: box, volume,
membership, distance, and where a ray is inside.

1. A cutter and a path make a `Sweep`: a line in any direction, a circle or a helix about x, y or z. The body
   only translates, so a point x is in the sweep when x - p(t) is in the cutter for some t. A `Turn` moves
   the axis too: on a great circle, by linear rotary angles, or by all joints of a serial chain.
2. The distance to a body of revolution is a distance in the meridian half plane, to lines and arcs.
3. The distance to a sweep is its minimum over t. For a convex piece of the cutter and a straight motion it is
   convex in point and t together; around a level arc the nearest pose is the horizontally nearest one.
4. A ray meets a straight sweep of a convex piece in one interval, and Newton's method on the convex distance
   walks to both ends without passing them.
   Where the tip goes around or the axis turns, poses give the intervals that surely belong, and tangent planes
   that move with the tool prove for how long their ends cannot be left (`turned`).
5. Volumes: convex translation adds |d| times the shadow, circles add the shadow of the meridian minus what is
   entered twice, in closed form per height. A turning body: V(K) + Phi - W, the flux of its front surface
   minus what enters a second time (`flux`).

| file | holds |
|---|---|
| `motion.py` | `Sweep`, `RayIntervals` |
| `pose.py` | `Pose` and the checks of tips and axes |
| `turning.py` | `Turn`: tip and axis of a five-axis block, with two derivatives |
| `bounds.py` | box of a body that turns |
| `volume.py` | `swept_volume` and its cases, `shadow` |
| `grazing/` | the condition N . V = 0 on circles, faces, discs and edges of any body of revolution |
| `weinert.py` | the explicit profiles of toroidal and cylindrical cutters, with corrected equations |
| `stance.py` | `Stance`: the tool at one instant, its surface by rotation angle |
| `folds.py` | where an envelope lies inside the sweep, which poses cover it |
| `topology.py` | `breaks`: instants at which the grazing curve changes its shape |
| `_kernels.py` | distances and ray intervals of bodies that only translate, in numba |
| `turned/` | the same where the axis turns |
| `ball/` | lines against ball cutters on lines, in closed form |
| `flux/` | volume where the axis turns |

Source: volume of a convex body plus segment by Minkowski and Cauchy (shadow as half the integral of |n . d|);
the rest is derived in the docstrings. Departures: rays do not march with the distance. Near a tangent
marching takes 1 / depth steps, while planes with a bound of the second derivative keep their cost and prove
what they leave out. No convex hulls of poses: they are of first order where the axis turns.

Known limits: `Sweep.volume` knows no formula for arcs about x or y, for helices that come back to where they
were (a full turn), and for bodies that are not convex unless they move horizontally or, without a waist,
along their axis; `Sweep.flux` estimates all curved ones. Where the axis turns W is a quadrature with an error
estimate, no bound, and takes 0.02 s on blocks of a millimetre, up to 10 s where a pivot lies in the tool.
Distances inside are the largest depth in one pose and one convex piece, a lower bound of the depth below the
surface of the sweep. Rays take about 1 us on level moves, plunges, (upright rays only) level arcs and five-
axis blocks of 1 mm and a degree, 5 us on ramps, 10 to 60 us on arcs, helices and five-axis blocks of 40 mm
and more.
"""

from vmachining.sweep.motion import Motion, RayIntervals, Sweep
from vmachining.sweep.pose import Pose
from vmachining.sweep.stance import Stance
from vmachining.sweep.topology import breaks
from vmachining.sweep.turning import Turn
from vmachining.sweep.volume import shadow, swept_volume

__all__ = ["Motion", "Pose", "RayIntervals", "Stance", "Sweep", "Turn", "breaks", "shadow", "swept_volume"]
