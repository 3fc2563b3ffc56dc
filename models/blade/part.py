"""Writes part.step: the side of the blade that is finished as one spline face over a block."""

from make import BOTTOM, HALF, LONG, height  # beside this file

from benchmarks.modelfiles import part_below, write_part

part = part_below(height, (0.0, LONG), (-HALF, HALF), bottom=BOTTOM, cells=(12, 12))

if __name__ == "__main__":
    write_part(__file__, part)
