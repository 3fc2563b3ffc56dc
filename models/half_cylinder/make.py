"""Writes half_cylinder.nc and stock.stl, and knows what the program removes.

python models/half_cylinder/make.py                             the shipped case: 10 passes
python models/half_cylinder/make.py --passes 100 --spacing 1    21 500 blocks, full coverage
python models/half_cylinder/make.py --table                     prints the closed form

Design: half cylinder of radius 50 mm about the X axis, X 0..100, Z >= 0. A ball of radius b runs over it in
planes X = const; its centre stays on a polygon inscribed in the circle of radius 50 + b, with n chords. All
that matters happens in the section: at the distance u from the plane of a pass the ball has the radius
q = sqrt(b^2 - u^2), and what it leaves is the polygon moved inwards by q, whose edges touch the circle of
radius c - q, c = (50 + b) cos(pi / 2n). The stock is a polygon with the same edge directions that touches the
circle of radius 50 + allowance, so both areas are n tan(pi / 2n) times the radius squared, and

    V = n tan(pi / 2n) * sum over the passes of the integral of (50 + allowance)^2 - (c - q(u))^2

over the u nearest to each pass, as far as the ball cuts and the stock goes.
"""

from __future__ import annotations

import argparse
import struct
from math import asin, cos, pi, sin, sqrt, tan
from pathlib import Path
from typing import NamedTuple

from benchmarks.modelfiles import word

DESIGN = 50.0  # mm, radius of the half cylinder
LENGTH = 100.0  # mm along X
BALL = 5.0  # mm, radius of the cutter
FEED = 1500.0  # mm/min
HERE = Path(__file__).parent


class Case(NamedTuple):
    """Number of passes, their spacing in mm, chords per pass, stock allowance in mm."""

    passes: int = 10
    spacing: float = 10.0
    chords: int = 214
    allowance: float = 1.0


def part_volume() -> float:
    """mm^3 of part.step."""
    return pi * DESIGN**2 / 2 * LENGTH


def half_width(case: Case) -> float:
    """Half the width in X of the cut of a single pass, mm."""
    reach = (DESIGN + BALL) * cos(pi / (2 * case.chords)) - DESIGN - case.allowance
    return sqrt(BALL**2 - reach**2)


def removed_volume(case: Case) -> float:
    """Volume that the whole program removes, mm^3."""
    centre, single = (DESIGN + BALL) * cos(pi / (2 * case.chords)), half_width(case)

    def side(w: float) -> float:  # integral of (50 + allowance)^2 - (c - q)^2 over 0 <= u <= w
        w = min(w, single)
        q = (w * sqrt(BALL**2 - w**2) + BALL**2 * asin(w / BALL)) / 2
        q2 = BALL**2 * w - w**3 / 3
        return w * (DESIGN + case.allowance) ** 2 - w * centre**2 + 2 * centre * q - q2

    between = 2 * (case.passes - 1) * side(case.spacing / 2)
    outer = 2 * side((LENGTH - (case.passes - 1) * case.spacing) / 2)
    return case.chords * tan(pi / (2 * case.chords)) * (between + outer)


def block_bounds(case: Case) -> tuple[float, float]:
    """Bounds of the volume removed from the block of block.toml, mm^3; passes times spacing must be 100 mm.

    The section left over is a polygon between the circle that it touches and the one through its corners, cut
    off at Y = -50 and 50. Simpson's rule in t, u = b sin t; its error is far below the bounds' difference.
    """
    half_chord = pi / (2 * case.chords)
    centre = (DESIGN + BALL) * cos(half_chord)
    steps, last = 400, asin(min(1.0, case.spacing / 2 / BALL))

    def under(radius: float) -> float:  # area of the half disc between Y = -50 and Y = 50
        y = min(DESIGN, radius)
        return y * sqrt(radius**2 - y**2) + radius**2 * asin(y / radius)

    left = [0.0, 0.0]
    for k in range(steps + 1):
        t = last * k / steps
        weight = (1 if k in (0, steps) else 4 if k % 2 else 2) * last / steps / 3 * BALL * cos(t)
        inner = centre - BALL * cos(t)
        left[0] += 2 * weight * under(inner)
        left[1] += 2 * weight * under(inner / cos(half_chord))
    block = 2 * DESIGN * (DESIGN + BALL) * LENGTH
    return block - case.passes * left[1], block - case.passes * left[0]


def stock_volume(case: Case) -> float:
    """Volume of stock.stl, mm^3."""
    return case.chords * tan(pi / (2 * case.chords)) * (DESIGN + case.allowance) ** 2 * LENGTH


def sagitta() -> float:
    """How far the chords of the shipped case dip below the arc, mm."""
    return (DESIGN + BALL) * (1 - cos(pi / (2 * Case().chords)))


def cusp(case: Case) -> float:
    """Height of the ridge midway between two passes above the design, mm; spacing below the diameter."""
    return DESIGN + BALL - sqrt(BALL**2 - (case.spacing / 2) ** 2) - DESIGN


def program(case: Case) -> str:
    """The text of half_cylinder.nc: passes to and fro, joined by half circles outside the stock."""
    x = (LENGTH - (case.passes - 1) * case.spacing) / 2
    radius = DESIGN + BALL
    lines = [
        "(HALF CYLINDER R50, BALL D10, THREE AXES)",
        f"({case.passes} PASSES, {case.chords} CHORDS EACH, SPACING {case.spacing:g} MM)",
        "(ZERO ON THE AXIS OF THE CYLINDER, Z UP)",
        "G21 G90 G17 G94 G40 G49 G80 G54",
        "T1 M6",
        "S9000 M3",
        "G0 Z80",
        f"G0 {word('X', x)} {word('Y', radius + 5)} M8",
        f"G0 {word('Z', -BALL)}",
        f"G1 {word('Y', radius)} {word('F', FEED)}",
    ]
    for k in range(case.passes):
        forward = k % 2 == 0
        for i in range(1, case.chords + 1):
            angle = pi * (i if forward else case.chords - i) / case.chords
            end = word("Y", radius * cos(angle)) + " " + word("Z", radius * sin(angle) - BALL)
            lines.append(("G1 " if i == 1 else "") + end)
        if k < case.passes - 1:  # at the -Y side counter-clockwise, at the +Y side clockwise
            x += case.spacing
            lines.append(f"{'G3' if forward else 'G2'} {word('X', x)} {word('I', case.spacing / 2)} J0")
    away = radius + 5 if case.passes % 2 == 0 else -radius - 5
    lines += [f"G1 {word('Y', away)}", "G0 Z80", "M5", "M9", "M30"]
    return "\n".join(lines) + "\n"


def stock_stl(case: Case) -> bytes:
    """Binary STL of the stock: a prism whose edges touch the circle of radius 50 + allowance from outside."""
    corner = (DESIGN + case.allowance) / cos(pi / (2 * case.chords))
    profile = [
        (corner * cos(pi * i / case.chords), corner * sin(pi * i / case.chords)) for i in range(case.chords)
    ]
    profile.append((-corner, 0.0))
    near, far = ([(x, y, z) for y, z in profile] for x in (0.0, LENGTH))
    last = len(profile) - 1
    facets = [(far[0], far[i], far[i + 1]) for i in range(1, last)]
    facets += [(near[0], near[i + 1], near[i]) for i in range(1, last)]
    for i in range(last + 1):
        j = (i + 1) % (last + 1)
        facets += [(near[i], near[j], far[j]), (near[i], far[j], far[i])]
    body = b"".join(
        struct.pack("<12fH", 0, 0, 0, *(c for corner in facet for c in corner), 0) for facet in facets
    )
    return b"half cylinder stock, mm".ljust(80) + struct.pack("<I", len(facets)) + body


def main() -> None:
    """Write the program and its stock, or print the closed form."""
    default = Case()
    parser = argparse.ArgumentParser(description="Half cylinder: NC program and stock.")
    parser.add_argument("--passes", type=int, default=default.passes)
    parser.add_argument("--spacing", type=float, default=default.spacing, help="mm between passes")
    parser.add_argument("--chords", type=int, default=default.chords, help="blocks per pass")
    parser.add_argument("--allowance", type=float, default=default.allowance, help="mm on the stock")
    parser.add_argument("--out", type=Path, default=HERE, help="folder to write to")
    parser.add_argument("--table", action="store_true", help="print the closed form, write nothing")
    args = parser.parse_args()
    case = Case(args.passes, args.spacing, args.chords, args.allowance)
    if args.table:
        print(f"removed {removed_volume(case):.6f} mm^3 of {stock_volume(case):.6f} mm^3")
        print(f"per pass {removed_volume(case) / case.passes:.6f} mm^3")
        print(f"per chord {removed_volume(case) / case.passes / case.chords:.9f} mm^3")
        if case.passes * case.spacing == LENGTH:
            print("from the block", *(f"{bound:.3f}" for bound in block_bounds(case)), "mm^3")
        print(f"half width {half_width(case):.6f} mm, cusp {cusp(case):.7f} mm, sagitta {sagitta():.7f} mm")
    else:
        args.out.mkdir(parents=True, exist_ok=True)
        (args.out / "half_cylinder.nc").write_text(program(case), encoding="ascii")
        (args.out / "stock.stl").write_bytes(stock_stl(case))


if __name__ == "__main__":
    main()
