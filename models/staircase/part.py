"""Writes part.step: the bar with the cylinder on top, as the ball would leave it without allowance."""

from build123d import Align, Box, Cylinder, Pos, Rot
from make import CYLINDER, HALF, LONG, LOW  # beside this file

from benchmarks.modelfiles import write_part

bar = Pos(0, 0, LOW) * Box(LONG, 2 * HALF, -LOW, align=(Align.MIN, Align.CENTER, Align.MIN))
part = bar & Pos(0, 0, -CYLINDER) * Rot(0, 90, 0) * Cylinder(
    CYLINDER, LONG, align=(Align.CENTER, Align.CENTER, Align.MIN)
)

if __name__ == "__main__":
    write_part(__file__, part)
