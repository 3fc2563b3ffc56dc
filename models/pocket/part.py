"""Writes part.step: the block with the pocket, its floor rounded by the corner of the cutter."""

from build123d import Align, Axis, Box, RectangleRounded, extrude, fillet
from make import CORNER, LEVELS, LOOPS, RADIUS, ROUND, STOCK  # beside this file

from benchmarks.modelfiles import write_part

long, wide = (side + 2 * RADIUS for side in LOOPS[-1])
room = extrude(RectangleRounded(long, wide, ROUND + RADIUS), amount=LEVELS[-1])
room = fillet(room.faces().sort_by(Axis.Z)[0].edges(), CORNER)
part = Box(*STOCK, align=(Align.CENTER, Align.CENTER, Align.MAX)) - room

if __name__ == "__main__":
    write_part(__file__, part)
