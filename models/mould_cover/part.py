"""Writes part.step: the mould cover of the vectors benchmark, a tenth of its size: lips, rim flats, drafted walls, 111 slots."""

from build123d import BuildPart, BuildSketch, GridLocations, Mode, Plane, Rectangle, extrude

from benchmarks.modelfiles import write_part

LENGTH, WIDTH, HEIGHT, RIM, FLAT, DRAFT_DEG = 100.0, 95.5, 34.0, 2.0, 1.0, 5.0
SLOT, SLOT_LENGTH, SLOT_DEPTH = 1.5, 20.0, 0.8
PITCH, COLUMNS, ROW_PITCH, ROWS = 2.5, 37, 30.0, 3

with BuildPart() as cover:
    with BuildSketch():
        Rectangle(LENGTH, WIDTH)
    extrude(amount=RIM)
    with BuildSketch(Plane.XY.offset(RIM)):
        Rectangle(LENGTH - 2 * FLAT, WIDTH - 2 * FLAT)
    extrude(amount=HEIGHT - RIM, taper=DRAFT_DEG)
    with BuildSketch(Plane.XY.offset(HEIGHT)), GridLocations(PITCH, ROW_PITCH, COLUMNS, ROWS):
        Rectangle(SLOT, SLOT_LENGTH)
    extrude(amount=-SLOT_DEPTH, mode=Mode.SUBTRACT)

if __name__ == "__main__":
    write_part(__file__, cover.part)
