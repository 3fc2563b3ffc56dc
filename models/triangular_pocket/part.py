"""Writes part.step: the block with the pocket."""

from build123d import Box, Face, Kind, Pos, Wire, extrude, offset
from make import DEPTH, HIGH, LOW, RADIUS, SIDES  # beside this file

from benchmarks.modelfiles import write_part
from vmachining.toolpath import Triangle

centres = Triangle.of(*SIDES, RADIUS).corners.tolist()  # where the cutter's axis may be
outline = offset(Face(Wire.make_polygon([(x, y, 0.0) for x, y in centres])), RADIUS, kind=Kind.ARC)
middle, size = zip(*((0.5 * (a + b), b - a) for a, b in zip(LOW, HIGH, strict=True)), strict=True)
part = Pos(*middle) * Box(*size) - extrude(outline, amount=DEPTH, dir=(0, 0, -1))

if __name__ == "__main__":
    write_part(__file__, part)
