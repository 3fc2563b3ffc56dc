"""Writes part.step: the part without its cam groove."""

from build123d import Align, Box, Cylinder, Pos, Rot
from make import BORE, BORE_DEEP, FACE, FLAT, FLAT_TOP, FLAT_WIDE, HOLE, HOLE_BOTTOM, HOLE_Z, LENGTH, RADIUS

from benchmarks.modelfiles import write_part

LOW, HIGH = (Align.CENTER, Align.CENTER, Align.MIN), (Align.CENTER, Align.CENTER, Align.MAX)

part = Pos(0, 0, -LENGTH) * Cylinder(RADIUS, LENGTH - FACE, align=LOW)
part -= Pos(0, 0, -FACE) * Cylinder(BORE, BORE_DEEP, align=HIGH)
for k in range(6):
    beyond = Pos(FLAT + 10.0, 0, FLAT_TOP) * Box(20.0, 3 * RADIUS, FLAT_WIDE, align=HIGH)
    part -= Rot(0, 0, 60.0 * k) * beyond
for k in range(3):
    across = Pos(HOLE_BOTTOM, 0, HOLE_Z) * Rot(0, 90, 0) * Cylinder(HOLE, RADIUS, align=LOW)
    part -= Rot(0, 0, -(120.0 * k + 30.0)) * across

if __name__ == "__main__":
    write_part(__file__, part)
