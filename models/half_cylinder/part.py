"""Writes part.step: the half cylinder without allowance."""

from build123d import Align, Box, Cylinder, Rot
from make import DESIGN, LENGTH  # beside this file

from benchmarks.modelfiles import write_part

whole = Rot(0, 90, 0) * Cylinder(DESIGN, LENGTH, align=(Align.CENTER, Align.CENTER, Align.MIN))
part = whole & Box(LENGTH, 2 * DESIGN, DESIGN, align=(Align.MIN, Align.CENTER, Align.MIN))

if __name__ == "__main__":
    write_part(__file__, part)
