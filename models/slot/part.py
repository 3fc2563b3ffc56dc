"""Writes part.step: the block with the slot; ramps are ruled by half circles, exactly as the flat cutter leaves them.

A flat end that goes down along a straight line leaves behind each place the rear half of its rim: those half circles make the
floor of a ramp, and at its deep end stands the cutter. Going up it is the same backwards. The quarter turn that descends is
the swept volume of one helical arc.
"""

from itertools import pairwise
from math import atan2, degrees, hypot, pi

from build123d import Align, Box, Cylinder, Edge, Face, Part, Pos, Solid
from make import FAR, NEAR, PARK, RADIUS, STOCK, TURN, path  # beside this file

from benchmarks.modelfiles import write_part
from vmachining.engines.brep import solids
from vmachining.geometry import Arc
from vmachining.sweep import Sweep
from vmachining.tool import FlatEnd

TOP = 5.0  # mm above the stock, where cuts may begin

Place = tuple[float, float, float]


def cutter(at: Place) -> Part:
    """The cutter at a place, up to `TOP`."""
    low = (Align.CENTER, Align.CENTER, Align.MIN)
    return Pos(*at) * Cylinder(RADIUS, TOP - at[2], align=low)


def line(one: Place, two: Place) -> Part:
    """What it sweeps on a straight way, but for the cutter at the higher end of a ramp, where another way ends."""
    deep, high = sorted((one, two), key=lambda place: place[2])
    way = tuple(b - a for a, b in zip(deep, high, strict=True))
    heading = degrees(atan2(way[1], way[0]))
    rim = Pos(*deep) * Edge.make_circle(RADIUS, start_angle=heading - 90.0, end_angle=heading + 90.0)
    floor = Face.extrude(rim, way)
    above = Solid.extrude(floor, (0.0, 0.0, 2 * TOP + STOCK[2]))
    return cutter(deep) + above


def straights() -> list[tuple[Place, Place]]:
    """Straight blocks, those that continue in the same direction as one."""
    places = [(PARK, NEAR, -2.0), *((block.x, block.y, block.z) for block in path())]
    out = []
    for k, (a, b) in enumerate(pairwise(places)):
        way = tuple(y - x for x, y in zip(a, b, strict=True))
        if path()[k].center is not None or not any(way):
            continue
        if out:
            before = tuple(y - x for x, y in zip(*out[-1], strict=True))
            turn = [before[i] * way[j] - before[j] * way[i] for i, j in ((0, 1), (1, 2), (2, 0))]
            if out[-1][1] == a and hypot(*turn) < 1e-9:
                out[-1] = (out[-1][0], b)
                continue
        out.append((a, b))
    return out


def quarter(one: Place, two: Place) -> list[Solid]:
    """What it sweeps on a quarter of the half turn, level or helical."""
    arc = Arc(one, (TURN, 0.5 * (NEAR + FAR), one[2]), 2, angle=pi / 2, rise=two[2] - one[2])
    tool = FlatEnd(diameter=2 * RADIUS, length=TOP - two[2])
    return [Solid(swept.shape) for swept in solids(Sweep.along(tool, arc))]


east = TURN + 0.5 * (FAR - NEAR)
turns = [(TURN, NEAR, -2.4), (east, 0.5 * (NEAR + FAR), -2.4), (TURN, FAR, -3.0)]
part = Pos(0, 0, -STOCK[2]) * Box(*STOCK, align=Align.MIN)
for way in straights():
    part -= line(*way)
for way in pairwise(turns):
    part -= quarter(*way)

if __name__ == "__main__":
    write_part(__file__, part)
