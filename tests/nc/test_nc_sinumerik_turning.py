"""Programs of SINUMERIK lathes: diameters, surface speed, threads, faces milled by C; motions worked by hand.

Rules: SINUMERIK 840D sl/828D, Programming Manual Fundamentals, "Channel-specific diameter/radius programming", "Constant
cutting rate (G96...)", "Thread cutting with constant lead (G33)"; Job Planning, "TRANSMIT" (public).
"""

from __future__ import annotations

import math

import pytest

from vmachining.nc import Program, parse_program


def read(body: str, head: str = "G18 G90 G95 G710 DIAMON\nT1 D1\n", **more) -> Program:
    return parse_program(f"{head}{body}\nM30\n".encode(), "t.mpf", dialect="sinumerik", rotary="C", **more)


def codes(program: Program) -> list[str]:
    return [f.code for f in program.findings if f.severity != "I"]


def xz(program: Program) -> list[tuple[float, float]]:
    return [(round(m.end[0], 6), round(m.end[2], 6)) for m in program.moves]


def test_diameters_absolute_and_incremental():
    """DIAMON: X40 lies at radius 20, IC(4) two further; DIAM90: IC(4) four further; DIAMOF: radii."""
    body = "S100 M3\nG0 X40 Z2\nG1 X=IC(4) F.1\nDIAM90 X=IC(4)\nX50\nDIAMOF X50\nG91 X1\nDIAMON X1"
    assert xz(read(body)) == [(20, 2), (22, 2), (26, 2), (25, 2), (50, 2), (51, 2), (51.5, 2)]


def test_it_is_said_that_it_is_a_lathe_and_what_x_is():
    program = read("S100 M3\nG0 X40 Z2")
    assert codes(program) == ["W380"]
    assert "diameters" in program.findings[0].message or "diameters" in program.findings[1].message
    plain = read("G96 S100 LIMS=2000 M4\nG0 X40 Z2", head="G18 G90 G710\n")
    assert codes(plain) == ["W380"] and xz(plain) == [(20, 2)]
    at_once = read("G0 X1 Z2\nG96 S100 LIMS=2000 M4\nG1 X40 F.1")
    assert not [f for f in at_once.findings if "without a limit" in f.message]
    assert [f for f in read("G96 S100 M4\nG0 X0 Z2\nG1 X40 F.1").findings if "without a limit" in f.message]
    radii = read("G96 S100 LIMS=2000 M4\nG0 X40 Z2", head="G18 G90 G710\n", control={"lathe": "radius"})
    assert xz(radii) == [(40, 2)]


@pytest.mark.parametrize("body", ["G96 S100 M4\nG1 X10 Y5 Z1 F.1", "DIAMOF\nG0 X10 Z1"])
def test_a_mill_stays_a_mill(body: str):
    program = read(body, head="G17 G90 G710\nT1 D1\n")
    assert "W380" not in codes(program) and program.moves[-1].end[0] == 10


def test_a_lathe_that_is_called_a_mill_is_refused_by_its_word():
    assert codes(read("G0 X40 Z2", control={"lathe": "mill"})) == ["E208"]


def test_centres_are_radii_unless_they_are_absolute():
    """Quarter from (radius 20, 0) to (radius 25, -5) about (25, 0): I5 is a step, I=AC(50) a diameter."""
    for centre in ("I5 K0", "I=AC(50) K=AC(0)", "CR=5"):
        program = read(f"S100 M3\nG0 X40 Z0\nG2 X50 Z-5 {centre} F.1")
        assert codes(program) == ["W380"]
        arc = program.moves[-1]
        assert arc.end == pytest.approx((25, 0, -5)) and arc.center == pytest.approx(
            (0, 25)
        )  # Z X, the order of G18


def test_surface_speed_follows_the_radius_and_its_limit():
    """200 m/min at diameter 50: 200000 / (pi 50) = 1273.24 rev/min; at diameter 10 the limit of 3000."""
    program = read("G96 S200 LIMS=3000 M4\nG0 X50 Z2\nG1 Z0 F.2\nX10\nG97 S500\nX8")
    speeds = [round(abs(m.spindle_rpm), 2) for m in program.moves[1:]]
    assert speeds == [1273.24, 3000.0, 500.0]
    assert [round(m.feed_mm_min, 2) for m in program.moves[1:]] == [254.65, 600.0, 100.0]


def test_a_thread_moves_by_its_lead():
    """G33 Z K1.5 at 800 rev/min: 1200 mm/min along Z; on a cone the path is longer by the root of 1 + tan2."""
    program = read("G97 S800 M4\nG0 X44 Z5\nG33 Z-20 K1.5\nG33 X54 Z-45 K1.5")
    assert program.moves[1].feed_mm_min == pytest.approx(1200)
    assert program.moves[2].feed_mm_min == pytest.approx(1200 * math.hypot(5, 25) / 25)


def test_passes_of_turning_cycles_are_left_out_and_said_once():
    program = read(
        'G97 S500 M4\nG0 X64 Z2\nCYCLE95("K",2,.2,.4,,.3,.2,.1,9)\nCYCLE95("K",2,.2,.4,,.3,.2,.1,9)\nG1 X60 F.1'
    )
    assert codes(program) == ["W380", "W379"]
    assert xz(program) == [(32, 2), (30, 2)]


def test_the_face_by_transmit_is_the_programmed_path():
    """C at 96.788 degrees and radius 37.845 is the point (-4.473, 37.580) of the face; off it, radius and angle again."""
    body = (
        "G17 G94 DIAMOF S800 M3\nG0 C96.788\nZ1\nX37.845\nTRANSMIT\nG1 X-4.473 Y0 F100\n"
        "G2 X0 Y-4.473 CR=4.473\nTRAFOOF\nG0 X30"
    )
    program = read(body)
    assert codes(program) == ["W380"]
    first = next(m for m in program.moves if m.feed_mm_min)
    assert first.start == pytest.approx((-4.473, 37.580, 1), abs=1e-3) and first.end == pytest.approx(
        (-4.473, 0, 1)
    )
    assert first.rotary_deg is None
    last = program.moves[-1]
    assert last.end == (30, 0, 1) and last.rotary_deg == pytest.approx({"c": -90})


def test_both_spindles_and_channels_are_noted():
    program = read("WAITM(1,1,2)\nSETM(3)\nT1=5 D1\nS1=900 M1=4\nG0 X84 Z2\nG1 Z-20 F0.1\nM1=5\nWAITE(2)")
    assert codes(program) == ["W380"]
    assert program.moves[-1].tool == 5 and program.moves[-1].spindle_rpm == -900


def test_a_cycle_of_the_builder_is_a_missing_program():
    program = read("G0 X1 Y2\nHOME\nL7\nMYCYCLE(1,2)\nG0 X2", head="G17 G90 G710\n")
    assert codes(program) == ["W383", "W383", "W383"] and program.moves[-1].end[0] == 2


def test_a_call_with_values_marks_the_dialect():
    """OTWOR_M6(10, 10) would be the name of a program, O and a text, to a Fanuc control: the call would be lost."""
    data = b"G17 G90 G71 G54\nT1 M6\nOTWOR_M6(10, 10)\nG0 X5\nM30\n"
    read = parse_program(data, "p.mpf", dialect="auto")
    assert (read.dialect, [f.code for f in read.findings if f.severity != "I"]) == ("sinumerik", ["W383"])
