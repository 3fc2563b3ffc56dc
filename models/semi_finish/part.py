"""Writes part.step: the bar under the wave, as a cutter without scallops would leave it."""

from make import BOTTOM, HALF, LONG, height  # beside this file

from benchmarks.modelfiles import part_below, write_part

part = part_below(lambda x, y: height(x) + 0.0 * y, (0.0, LONG), (-HALF, HALF), bottom=BOTTOM, cells=(66, 6))

if __name__ == "__main__":
    write_part(__file__, part)
