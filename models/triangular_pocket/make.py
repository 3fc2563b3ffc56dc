"""Writes triangular_pocket.nc: the shortest of four strategies in a triangle with rounded corners, on two levels.

python models/triangular_pocket/make.py             writes the program beside this file
python models/triangular_pocket/make.py --table     prints the volumes

The cutter's axis may go wherever its distance from the sides is R or more: a smaller triangle, similar to the first. The pocket
is that triangle and all that lies within R of it, so its area follows from Steiner's formula.
"""

from __future__ import annotations

from math import pi, prod, sqrt

from benchmarks.modelfiles import write_model
from vmachining.toolpath import Triangle, advice
from vmachining.toolpath.pocket import level_program

SIDES = (60.0, 50.0, 40.0)  # mm
LOW, HIGH = (-10.0, -10.0, -12.0), (65.0, 42.0, 0.0)  # mm, corners of the stock in job.toml
RADIUS, DEPTH, STEP = 4.0, 6.0, 3.0  # mm, cutter, pocket and one level


def pocket_area() -> float:
    """mm^2 of the pocket in plan: A' + p' R + pi R^2 of the inner triangle."""
    a, b, c = SIDES
    s = sum(SIDES) / 2
    area = sqrt(s * (s - a) * (s - b) * (s - c))
    scale = 1 - RADIUS * s / area  # the inner triangle: its incircle is R smaller
    return area * scale**2 + 2 * s * scale * RADIUS + pi * RADIUS**2


def pocket_volume(depth: float = DEPTH) -> float:
    """mm^3."""
    return pocket_area() * depth


def part_volume() -> float:
    """mm^3 of part.step."""
    return prod(b - a for a, b in zip(LOW, HIGH, strict=True)) - pocket_volume()


def program() -> str:
    """The text of triangular_pocket.nc."""
    best = advice(*SIDES, RADIUS)[0]
    title = f"TRIANGULAR POCKET {SIDES[0]:g} {SIDES[1]:g} {SIDES[2]:g} R{RADIUS:g} {best.strategy.upper()}"
    return level_program(
        best.path, depth_mm=DEPTH, step_mm=STEP, feed_mm_min=600.0, plunge_mm_min=200.0, title=title
    )


def table() -> str:
    """The known truths."""
    return (
        f"area {pocket_area():.6f} mm^2, volume {pocket_volume():.6f} mm^3\n"
        f"corner of the triangle at {Triangle.of(*SIDES, RADIUS).corners[0].tolist()}"
    )


if __name__ == "__main__":
    write_model(__file__, lambda: {"triangular_pocket.nc": program()}, table)
