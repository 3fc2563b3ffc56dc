"""Writes mill_turn.nc: a bar on a C axis under a swivelling B head: hexagon, cross holes, cam groove, bore.

See `benchmarks.modelfiles` for how to call it. Rotary words without tool centre point control: X is the radial place of the
tip at B90, Z the axial one, C turns the bar.
"""

from __future__ import annotations

from math import acos, pi, sqrt

from scipy.integrate import quad

from benchmarks.modelfiles import write_model

RADIUS, LENGTH = 20.0, 45.0  # mm, of the bar
FACE = 1.0  # mm that facing takes
FLAT, FLAT_TOP, FLAT_WIDE = (
    16.0,
    -1.0,
    10.0,
)  # mm from the axis; axial place and width of the band of the hexagon
HOLE, HOLE_Z, HOLE_BOTTOM = 3.0, -20.0, 8.0  # mm, radius, axial place, distance of the bottom from the axis
BORE, BORE_DEEP = 4.0, 10.0  # mm
GROOVE_Z, GROOVE_PITCH, GROOVE_BOTTOM, GROOVE_STEPS = -30.0, 8.0, 18.0, 12  # mm; over half a turn
CLEAR = 24.0  # mm, radial


def program() -> str:
    """The text of mill_turn.nc."""
    lines = [
        "(HEXAGON, CROSS HOLES, CAM GROOVE AND BORE ON A BAR D40, C TABLE AND B HEAD)",
        "G21 G90 G17 G94 G40 G49 G80 G54",
        "(T1 FLAT D50: FACE)", "T1 M6", "S2000 M3", "G0 B0 C0", "G0 X-50 Y0 Z10", "G0 Z-1",
        "G1 X50 F600", "G0 Z10",
        "(T2 FLAT D10: HEXAGON)", "T2 M6", "S6000 M3", "G0 X40 Y-30 Z10", "G0 B90 C0",
    ]  # fmt: skip
    middle = FLAT_TOP - FLAT_WIDE / 2.0
    for k in range(6):
        a, b = (-30, 30) if k % 2 == 0 else (30, -30)
        lines += [f"G0 C{60 * k} Y{a}", f"G0 Z{middle:g}", f"G0 X{FLAT:g}", f"G1 Y{b} F500", f"G0 X{CLEAR:g}"]
    lines += [
        "G0 X60",
        "(T3 FLAT D6: CROSS HOLES)",
        "T3 M6",
        "S8000 M3",
        f"G0 Y0 Z{HOLE_Z:g}",
        f"G0 X{CLEAR:g}",
    ]
    for k in range(3):
        lines += [f"G0 C{120 * k + 30}", f"G1 X{HOLE_BOTTOM:g} F200", f"G0 X{CLEAR:g}"]
    lines += [
        "G0 X60",
        "(T4 BALL D6: CAM GROOVE)",
        "T4 M6",
        "S9000 M3",
        f"G0 C0 Z{GROOVE_Z:g}",
        f"G0 X{CLEAR:g}",
    ]
    lines.append(f"G1 X{GROOVE_BOTTOM:g} F200")
    for k in range(1, GROOVE_STEPS + 1):
        share = k / GROOVE_STEPS
        lines.append(f"G1 C{180 * share:g} Z{GROOVE_Z - GROOVE_PITCH * share * share:.4f} F400")
    lines += [
        f"G0 X{CLEAR:g}", "G0 X80", "(T5 FLAT D8: BORE)", "T5 M6", "S5000 M3", "G0 Z30", "G0 B0", "G0 X0 Y0", "G0 Z2",
        f"G1 Z{-FACE - BORE_DEEP:g} F150", "G0 Z30", "M5", "M30",
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def segment(distance: float) -> float:
    """mm^2 of the bar's section beyond a chord."""
    return RADIUS**2 * acos(distance / RADIUS) - distance * sqrt(RADIUS**2 - distance**2)


def hole() -> float:
    """mm^3 of a cross hole from the bar's surface to its flat bottom."""
    value, _ = quad(
        lambda y: 2 * sqrt(HOLE**2 - y * y) * (sqrt(RADIUS**2 - y * y) - HOLE_BOTTOM),
        -HOLE,
        HOLE,
        epsabs=1e-12,
    )
    return float(value)


def truths() -> dict[str, float]:
    """mm^3 by what is cut; all but the groove."""
    return {
        "face": pi * RADIUS**2 * FACE,
        "first flat": segment(FLAT) * FLAT_WIDE,
        "hexagon": (pi * RADIUS**2 - 2 * sqrt(3) * FLAT**2) * FLAT_WIDE,
        "one hole": hole(),
        "bore": pi * BORE**2 * BORE_DEEP,
    }


def part_volume() -> float:
    """mm^3 of part.step."""
    found = truths()
    gone = found["face"] + found["hexagon"] + 3 * found["one hole"] + found["bore"]
    return pi * RADIUS**2 * LENGTH - gone


def table() -> str:
    """The known truths."""
    return "\n".join(f"{name:12} {value:.6f} mm^3" for name, value in truths().items())


if __name__ == "__main__":
    write_model(__file__, lambda: {"mill_turn.nc": program()}, table)
