"""Writes part.step: the sculptured surface as one spline face over a block."""

from make import BOTTOM, LONG, WIDE, height  # beside this file

from benchmarks.modelfiles import part_below, write_part

part = part_below(height, (0.0, WIDE), (0.0, LONG), bottom=BOTTOM, cells=(40, 28))

if __name__ == "__main__":
    write_part(__file__, part)
