"""Blocks whose sweep lines enter in closed form: ball cutters, with their shanks, on straight lines.

`ball_block` tells whether a sweep is one of them; `_kernels.py` has the entry of any line (`ball_entry`) and whether a
point is inside (`in_ball_sweep`).
"""

from __future__ import annotations

from typing import NamedTuple

from vmachining.arrays import Floats
from vmachining.geometry import Line
from vmachining.sweep.motion import Sweep
from vmachining.tool import Profile

__all__ = ["BallBlock", "ball_block"]


class BallBlock(NamedTuple):
    """center (3,) at the start, travel (3,), radius of ball and shank, height of the shank above the centre. mm."""

    center: Floats
    travel: Floats
    radius: float
    height: float

    @property
    def row(self) -> tuple[float, ...]:
        """Centre, travel, radius, height: eight numbers, for kernels."""
        return (*self.center.tolist(), *self.travel.tolist(), self.radius, self.height)


def ball_block(sweep: Sweep) -> BallBlock | None:
    """A sweep as one of a ball cutter on a line; None if it is another."""
    path = sweep.path
    if not isinstance(path, Line):
        return None
    shape = _ball(sweep.profile)
    if shape is None:
        return None
    radius, lift, height = shape
    return BallBlock(path.start + [0.0, 0.0, lift], path.end - path.start, radius, height)


def _ball(profile: Profile) -> tuple[float, float, float] | None:
    """Radius, height of the centre above the tip's origin, and of the shank above the centre."""
    if len(profile.radii) != 2 or profile.radii[0] <= 0.0 or profile.radii[1] > 0.0:
        return None
    (tip_r, tip_z), (wide, middle), (top_r, top_z) = profile.points.tolist()
    r = float(profile.radii[0])
    if not (tip_r == 0.0 and wide == top_r == r and profile.centers[0, 0] == 0.0):
        return None
    if not (profile.centers[0, 1] == middle and middle - tip_z == r):
        return None
    return r, middle, top_z - middle
