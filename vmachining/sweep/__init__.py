"""What a cutter sweeps during one block: geometry without a kernel.

A `Sweep` is a cutter on a path: a line, a circle or a helix, which only translate it, or a `Turn`, which moves the tool axis,
too, between two `Pose`s. It knows its box, whether points are inside, how far away they are, where rays are inside
(`ray_intervals`), and its volume: `swept_volume` in closed form where there is one, else `Sweep.flux` with an error estimate;
`shadow` is the area that a translation adds per length. `Stance` is the tool at one instant, with its grazing curve;
`breaks` are the instants at which that curve changes its shape.

A point x is in the sweep of a translation along p when x - p(t) is in the cutter for some t; all else follows from that.

Imports `tool`, `geometry` and `numerics`; every engine imports it. Methods, sources, departures and
limits: docs/sweeps.md.
"""

from vmachining.geometry import RayIntervals
from vmachining.sweep.motion import Motion, Sweep
from vmachining.sweep.pose import Pose
from vmachining.sweep.stance import Stance
from vmachining.sweep.topology import breaks
from vmachining.sweep.turning import Turn
from vmachining.sweep.volume import shadow, swept_volume

__all__ = ["Motion", "Pose", "RayIntervals", "Stance", "Sweep", "Turn", "breaks", "shadow", "swept_volume"]
