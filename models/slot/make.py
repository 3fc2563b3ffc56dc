"""Writes slot.nc, and knows the exact volume that every feed block of it removes.

python models/slot/make.py            writes slot.nc beside this file
python models/slot/make.py --table    prints the closed form of every feed block

A flat cutter of radius R follows a path in plan with radius of curvature above R; d is its depth below
the stock. The horizontal section at depth t of what it has removed is the sweep of a disc along those parts
of the path where d >= t. A disc swept over the length L covers 2 R L + pi R^2. Layer by layer this gives for
a block of plan length L whose depth runs from d0 to d1 in fresh material

    V = 2 R L (d0 + d1) / 2 + pi R^2 max(d1 - d0, 0)
"""

from __future__ import annotations

from math import acos, asin, cos, pi, prod, radians, sin, sqrt
from typing import NamedTuple

from benchmarks.modelfiles import word, write_model

RADIUS = 5.0  # mm
FEED = 96.0  # mm/min, constant
STEP = 2.0  # mm in plan, the usual block
NEAR, FAR = 15.0, 45.0  # mm, Y of the two lanes
TURN = 90.0  # mm, X of the centre of the half turn that joins them
PARK = -8.0  # mm, X outside the stock
STOCK = (120.0, 60.0, 20.0)  # mm, as in job.toml


class Block(NamedTuple):
    """One feed block: its end, its centre if it is an arc, and the volume it removes in mm^3."""

    x: float
    y: float
    z: float
    center: tuple[float, float] | None
    volume: float


def fresh(length: float, d0: float, d1: float) -> float:
    """Volume of a block inside the stock; above the stock the depth counts as zero."""
    d0, d1 = max(d0, 0.0), max(d1, 0.0)
    return RADIUS * length * (d0 + d1) + pi * RADIUS**2 * max(d1 - d0, 0.0)


def covered(x: float) -> float:
    """Area in X >= 0 swept by a disc that came from X = -inf to x."""
    if x >= 0:
        return 2 * RADIUS * x + pi * RADIUS**2 / 2
    if x <= -RADIUS:
        return 0.0
    return RADIUS**2 * acos(-x / RADIUS) + x * sqrt(RADIUS**2 - x**2)


def ahead(x: float) -> float:
    """Area of a lane in X >= 0 not yet swept by a disc that came from X = +inf to x."""
    if x >= RADIUS:
        return 2 * RADIUS * x - pi * RADIUS**2 / 2
    if x <= 0:
        return 0.0
    return 2 * RADIUS * x - x * sqrt(RADIUS**2 - x**2) - RADIUS**2 * asin(x / RADIUS)


def lane(y: float, start: float, end: float, d0: float, d1: float, step: float = STEP) -> list[Block]:
    """Straight blocks at Y = y, the depth changing linearly from d0 to d1."""
    count = max(1, round(abs(end - start) / step))
    blocks = []
    for k in range(count):
        xa, xb = (start + (end - start) * i / count for i in (k, k + 1))
        da, db = (d0 + (d1 - d0) * i / count for i in (k, k + 1))
        if min(xa, xb) >= RADIUS:
            volume = fresh(abs(xb - xa), da, db)
        elif end > start:  # into the stock through the face X = 0, at constant depth
            volume = d0 * (covered(xb) - covered(xa))
        else:  # out of it
            volume = d0 * (ahead(xa) - ahead(xb))
        blocks.append(Block(xb, y, -db, None, volume))
    return blocks


def turn(d0: float, d1: float, first: int, last: int, count: int = 24) -> list[Block]:
    """Arcs number first..last of the half turn, each 180/count degrees counter-clockwise."""
    radius, center = (FAR - NEAR) / 2, (TURN, (FAR + NEAR) / 2)
    blocks = []
    for k in range(first, last):
        angle = radians(-90.0 + 180.0 * (k + 1) / count)
        da, db = (d0 + (d1 - d0) * (i - first) / (last - first) for i in (k, k + 1))
        x, y = center[0] + radius * cos(angle), center[1] + radius * sin(angle)
        blocks.append(Block(x, y, -db, center, fresh(radius * pi / count, da, db)))
    return blocks


def path() -> list[Block]:
    """Every feed block, in the order of the program."""
    down = Block(PARK, NEAR, -2.0, None, 0.0)  # beside the stock
    return [
        down,
        *lane(NEAR, PARK, 20, 2, 2),
        *lane(NEAR, 20, 30, 2, 4),
        *lane(NEAR, 30, 40, 4, 4),
        *lane(NEAR, 40, 64, 4, -0.8),  # leaves the stock at X = 60
        *lane(NEAR, 64, 74, -0.8, -0.8),  # air
        *lane(NEAR, 74, 90, -0.8, 2.4),  # enters it again at X = 78
        *turn(2.4, 2.4, 0, 12),
        *turn(2.4, 3.0, 12, 24),
        *lane(FAR, 90, 70, 3, 3),
        *lane(FAR, 70, 60, 3, 1),
        *lane(FAR, 60, 30, 1, 1, step=30),  # one long block
        *lane(FAR, 30, 20, 1, 3),
        *lane(FAR, 20, PARK, 3, 3),
    ]


def part_volume() -> float:
    """mm^3 of part.step."""
    return prod(STOCK) - sum(block.volume for block in path())


def program() -> str:
    """The text of slot.nc."""
    head = [
        "(SLOT OF VARYING DEPTH, FLAT END MILL D10, CONSTANT FEED)",
        "(STOCK X 0..120  Y 0..60  Z -20..0, ZERO AT TOP CORNER)",
    ]
    lines = [
        "G21 G90 G17 G94 G40 G49 G80 G54",
        "T1 M6",
        "S1200 M3",
        "G0 Z20",
        f"G0 {word('X', PARK)} {word('Y', NEAR)} M8",
        "G0 Z2",
    ]
    x, y, z, mode = PARK, NEAR, 2.0, "G0"
    for block in path():
        motion = "G3" if block.center else "G1"
        words = [motion] if motion != mode else []
        words += [
            word(letter, new)
            for letter, old, new in (("X", x, block.x), ("Y", y, block.y), ("Z", z, block.z))
            if abs(new - old) > 1e-9
        ]
        if block.center:
            words += [word("I", block.center[0] - x), word("J", block.center[1] - y)]
        if mode == "G0":
            words.append(word("F", FEED))
        lines.append(" ".join(words))
        x, y, z, mode = block.x, block.y, block.z, motion
    lines += ["G0 Z20", "M5", "M9", "M30"]
    return "\n".join(head + [f"N{10 * k} {text}" for k, text in enumerate(lines, 1)]) + "\n"


def table() -> str:
    """The known truths."""
    rows = [f"{k:4d} {b.x:10.4f} {b.y:10.4f} {b.z:8.4f} {b.volume:14.6f}" for k, b in enumerate(path())]
    return "\n".join([*rows, f"total {sum(block.volume for block in path()):.6f} mm^3"])


if __name__ == "__main__":
    write_model(__file__, lambda: {"slot.nc": program()}, table)
