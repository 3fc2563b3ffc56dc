"""Programs with a known result: from the literature, and from runs of the open reference interpreter."""

from __future__ import annotations

import math

import pytest
from published import TESTER

from vmachining.nc import Motion, Program, ToolEntry, parse_program

INCH = 25.4
TOOLS = {1: ToolEntry(1, 10.0, 50.0), 3: ToolEntry(3, 6.0, 30.0)}


def read(text: str, **options: object) -> Program:
    program = parse_program(text.encode(), "test.nc", **{"home": (0.0, 0.0, 0.0), **options})  # type: ignore[arg-type]
    assert not [f for f in program.errors if f.code != "W401"], program.errors
    return program


@pytest.mark.erratum(
    "tester",
    "3.2",
    "X1.234 Y-5.678 Z0.321 F100 explained as X123 Y-456 Z432, mm/s",
    "the values as written, mm/min",
)
def test_one_block_of_the_nc_tester():
    move = read("N001 G90 G21 G01 X1.234 Y-5.678 Z0.321 S300 F100 M03").moves[0]
    assert (move.n, move.motion, move.feed_mm_min, move.spindle_rpm) == (1, Motion.LINEAR, 100.0, 300.0)
    assert move.end == (1.234, -5.678, 0.321)


def test_g92_declares_where_the_tool_stands():
    (move,) = read("N002 G90 G92 X20 Y15 Z5\nN003 G00 X10 Y5 Z2").moves
    assert [b - a for a, b in zip(move.start, move.end, strict=True)] == pytest.approx([-10, -10, -3])
    assert move.end_program == pytest.approx((10, 5, 2))
    assert move.end_machine == pytest.approx(move.end)


SLOT = TESTER.format(n40="Y0.25 Z0.1")


@pytest.mark.erratum(
    "tester",
    "4.1, N40",
    "X2.75 Y0.25 Z0.1 within G91",
    "X2.75 Y-0.75 Z-0.9, which ends where the comments of the program say",
)
def test_incremental_program_in_inches():
    program = read(SLOT)
    ends = [[round(v / INCH, 6) for v in move.end_program] for move in program.moves]
    assert ends == [
        [1.75, 1.25, 1.1],
        [1.75, 1.25, 0.6],
        [1.75, 0, 0.6],
        [0.25, 0, 0.6],
        [-0.25, -0.5, 0.6],
        [-0.25, -1.25, 0.6],
        [-0.25, -1.25, 1.1],
        [-0.25, -1.25, 1.1],
        [-1, 1, 1],
    ]
    arc = program.moves[4]
    assert arc.motion is Motion.ARC_CCW
    assert arc.center == pytest.approx((1.25 * INCH, -1.5 * INCH))  # (0.25, -0.5) in program coordinates
    assert program.moves[1].feed_mm_min == 5 * INCH
    assert program.ended and not program.findings


def test_quarter_helix_and_three_quarters():
    first, second = read("G21 G90 G17 G0 X10 Y0 Z0\nF100 S1 M3\nG3 X0 Y10 Z5 R10\nG3 X10 Y0 R-10").moves[1:]
    for move in (first, second):
        assert move.motion is Motion.ARC_CCW
        assert move.center == pytest.approx((0, 0), abs=1e-9)
    assert first.end == (0, 10, 5) and second.end == (10, 0, 5)


@pytest.mark.parametrize(
    ("text", "plane", "center", "extreme"),
    [
        ("G18 G2 X10 Z0 I5 K0", "zx", (0, 5), (5, 0, -5)),
        ("G19 G2 Y10 Z0 J5 K0", "yz", (5, 0), (0, 5, 5)),
        ("G17 G2 X10 Y0 I5 J0", "xy", (5, 0), (5, 5, 0)),
    ],
)
def test_half_circles_bulge_to_the_right_side(text, plane, center, extreme):
    from vmachining.geometry import arc_between

    (move,) = read(f"F100 S1 M3 G21 {text}").moves
    assert (move.plane, move.center) == (plane, center)
    a, b, normal = {"xy": (0, 1, 2), "zx": (2, 0, 1), "yz": (1, 2, 0)}[plane]
    middle = [0.0, 0.0, 0.0]
    middle[a], middle[b] = move.center
    arc = arc_between(move.start, move.end, middle, normal, ccw=False, turns=move.turns)
    assert arc.position(0.5) == pytest.approx(extreme, abs=1e-12)


def test_radius_a_little_short_is_snapped_to_half_the_chord():
    (move,) = read("G21 G90 S1 M3\nG2 X10 Y0 R4.9999 F100").moves
    assert move.center == pytest.approx((5, 0), abs=1e-12)


def test_full_circle_and_turns():
    circle, spiral = read("G21 S1 M3 F100\nG2 X0 Y0 I5 J0\nG3 I5 Z2 P3").moves
    assert circle.end == circle.start == (0, 0, 0) and circle.turns == 1
    assert spiral.turns == 3 and spiral.end == (0, 0, 2)


def test_absolute_centres():
    (move,) = read("G90.1 S1 M3 F100 G92 X1 Y1\nG2 X11 Y1 I6 J1").moves
    assert move.center == pytest.approx((5, 0))


def test_units_may_change_between_blocks():
    moves = read("G21 G0 X25.4\nG20\nG91 X1\nG21 G90 Y10").moves
    assert moves[1].end == pytest.approx((50.8, 0, 0))
    assert moves[2].end == pytest.approx((50.8, 10, 0))


def test_inverse_time_feed_follows_the_length():
    line, arc = read("G93 S1 M3\nG1 X30 Y40 F2\nG3 X10 Y40 I-10 F4").moves
    assert line.feed_mm_min == pytest.approx(100)
    assert arc.feed_mm_min == pytest.approx(40 * math.pi)


def test_feed_per_revolution():
    assert read("G95 S500 M4\nG1 X1 F0.2").moves[0].feed_mm_min == pytest.approx(100)


def test_tool_length_moves_the_machine_and_not_the_simulated_tip():
    moves = read("T1 M6\nG43 H1\nG0 X5\nZ10\nG49\nZ20", tools=TOOLS).moves
    assert [m.end for m in moves] == [(5, 0, 0), (5, 0, 10), (5, 0, 20)]
    assert [m.end_machine for m in moves] == [(5, 0, 0), (5, 0, 60), (5, 0, 20)]
    assert [m.end_program for m in moves] == [(5, 0, -50), (5, 0, 10), (5, 0, 20)]


@pytest.mark.parametrize(
    ("word", "length"),
    [
        ("G43 H1\nG43.2 H3", 80),
        ("M48 M61 Q1\nG43", 50),
        ("G43", 30),
        ("G43 H1", 50),
        ("G43 H0", 30),
        ("G43.1 Z7.5", 7.5),
        ("G49", 0),
    ],
)
def test_where_a_tool_length_comes_from(word, length):
    assert read(f"T3 M6\n{word}\nG0 Z1", tools=TOOLS).moves[0].end_machine[2] == 1 + length


def test_reference_and_machine_coordinates():
    moves = read(
        "G0 X5 Y6\nG28 G91 Z12\nG90 G92 X100\nG53 G0 X1",
        home=(0.0, 0.0, 100.0),
        work_offsets={"G54": (0, 0, 0)},
    ).moves
    assert [m.end for m in moves] == [(5, 6, 100), (5, 6, 112), (5, 6, 100), (1, 6, 100)]
    assert moves[-1].end_program == (96, 6, 100)


def test_work_offsets_are_seen_relative_to_the_first():
    offsets = {"G54": (100.0, 0.0, 0.0), "G55": (150.0, 20.0, 0.0)}
    moves = read("G0 X1 Y1\nG55 X1 Y1\nG54 X1", work_offsets=offsets).moves
    assert [m.end[:2] for m in moves] == [(1, 1), (51, 21), (1, 21)]
    assert [m.end_machine[:2] for m in moves] == [(101, 1), (151, 21), (101, 21)]


def test_parameters_and_expressions():
    text = "#<a> = 2 #5 = [3 + 1]\nG0 X[#<a> * -53.] Y#5 Z-[ATAN[1]/[1] + 7 MOD 4]\nX[2 ** 3 ** 2] Y##6\n"
    moves = read("#6 = 5\n" + text).moves
    assert moves[0].end == pytest.approx((-106, 4, -48))
    assert moves[1].end == pytest.approx((64, 4, -48))
    assert read("#1=1\n#1=2 G0 X#1").moves[0].end[0] == 1  # assignments count after their block


def test_controls_quirks():
    moves = read(
        "g0z+3.0\ng 0 1 x 2 . 5 f1 0 0 m3s10\nY1\n/Z1 (deleted when the switch is on)\n\rX0;(x\r\nG4P.5"
    ).moves
    assert [m.end for m in moves[:4]] == [(0, 0, 3), (2.5, 0, 3), (2.5, 1, 3), (2.5, 1, 1)]
    assert moves[-1].motion is Motion.DWELL and moves[-1].dwell_s == 0.5
    assert len(read("G0 X1\n/X2\nX3", block_delete=True).moves) == 2


def test_tape_marks():
    assert [m.line for m in read("leader\n%\nG0 X1\n%\nG0 X2").moves] == [3]
    late = read("G0 X1\n%\n")
    assert late.ended and [f.code for f in late.findings] == ["I405"]


def test_dwell_and_spindle_direction():
    moves = read("S10 M4 G1 F10 X1\nM5 G4 P2\nM6 T1\nG0 X2").moves
    assert [(m.spindle_rpm, m.dwell_s, m.tool) for m in moves] == [(-10, 0, 0), (0, 2, 0), (0, 0, 1)]
