"""Conversational programs: every construct with a smallest program and its motions, worked by hand.

Source of the rules: HEIDENHAIN TNC 640, user's manuals "Conversational programming" and "Cycle programming" (public); the
section is named in each test. Coordinates are mm, of the tip, in work coordinates.
"""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mutants import mutated

from vmachining.nc import Program, parse_program, read_program

HALF = math.sqrt(0.5)
POSTS = Path(__file__).resolve().parents[3] / "shared/data/posts/heidenhain"
HOME = (0.0, 0.0, 100.0)


def read(
    body: str, *, unit: str = "MM", head: str = "TOOL DEF 1 L+0 R+5\nTOOL CALL 1 Z S1000 F200\nM3", **more
) -> Program:
    text = f"BEGIN PGM T {unit}\n{head}\n{body}\nEND PGM T {unit}\n"
    return parse_program(text.encode(), "t.h", dialect="heidenhain", home=HOME, **more)


def codes(program: Program) -> list[str]:
    return [f.code for f in program.findings if f.code not in ("W501", "I408")]


def path(program: Program) -> list[tuple]:
    """(kind, x, y, z) of every move; arcs have their centre as well."""
    kinds = {"rapid": "R", "linear": "L", "arc_cw": "CW", "arc_ccw": "CCW", "dwell": "D"}
    out = []
    for move in program.moves:
        row = (kinds[move.motion], *(round(v, 4) + 0.0 for v in move.end))
        out.append(row if move.center is None else (*row, *(round(v, 4) + 0.0 for v in move.center)))
    return out


def drilled(body: str, **more) -> list[tuple[str, float]]:
    """Kind and z of the moves after the first."""
    program = read("L X+10 Y+20 Z+50 FMAX\n" + body, **more)
    assert codes(program) == []
    return [(row[0], row[3]) for row in path(program)[1:]]


# ---- path functions (conversational programming, "Path contours - Cartesian coordinates") ----


def test_lines_incremental_words_and_rapid():
    program = read("L X+10 Y+20 FMAX\nL Z-5 F300\nL IX+5 IY-2.5\nL Z + 10 FMAX")
    assert path(program) == [("R", 10, 20, 100), ("L", 10, 20, -5), ("L", 15, 17.5, -5), ("R", 15, 17.5, 10)]
    assert [m.feed_mm_min for m in program.moves] == [None, 300.0, 300.0, None]
    assert codes(program) == []


def test_the_feed_of_the_call_and_that_of_a_corner():
    """FAUTO is the feed of TOOL CALL; a corner without F is cut as what stands before it, and its F holds for it alone."""
    program = read(
        "L X+0 Y+0 Z+0 FMAX\nL X+20 F500\nL X+30 FAUTO\nL X+40\nL X+50 F500\nRND R2\nL Y+20 F90\nCHF 1 F70\nL X+0"
    )
    assert codes(program) == []
    assert [m.feed_mm_min for m in program.moves[1:]] == [500, 200, 200, 500, 500, 90, 70, 90]


def test_inch_programs_scale_lengths_and_feeds():
    program = read("L X+1 Y+2 F10", unit="INCH")
    assert path(program) == [("L", 25.4, 50.8, 100)]
    assert program.moves[0].feed_mm_min == 254.0


def test_circles_about_a_centre_by_radius_and_tangential():
    program = read(
        "L X+10 Y+0 F100\nCC X+0 Y+0\nC X+0 Y+10 DR+\nC X+0 Y+10 DR-\nCR X+10 Y+20 R+10 DR-\nCT X+20 Y+10"
    )
    assert path(program)[1:] == [
        ("CCW", 0, 10, 100, 0, 0),
        ("CW", 0, 10, 100, 0, 0),
        (
            "CW",
            10,
            20,
            100,
            10,
            10,
        ),  # start (0, 10), end (10, 20): centres (10, 10) and (0, 20), the first is cw
        ("CW", 20, 10, 100, 10, 10),  # tangent (1, 0) at (10, 20)
    ]


def test_a_negative_radius_is_the_longer_arc():
    program = read("L X+0 Y+10 F100\nCR X+10 Y+20 R-10 DR-")
    assert path(program)[1] == ("CW", 10, 20, 100, 0, 20)


def test_polar_lines_arcs_and_a_helix():
    program = read("CC X+10 Y+10\nLP PR+10 PA+0 F100\nCP PA+90 DR+\nLP IPA+90\nCP IPA-720 IZ-8 DR-")
    assert path(program) == [
        ("L", 20, 10, 100),
        ("CCW", 10, 20, 100, 10, 10),
        ("L", 0, 10, 100),
        ("CW", 0, 10, 92, 10, 10),
    ]
    assert program.moves[-1].turns == 2


def test_rounding_and_chamfer_at_a_right_angle():
    program = read("L X+0 Y+0 F100\nL Y+20\nRND R5 F50\nL X+30\nCHF 4\nL Y+0")
    assert path(program)[1:] == [
        ("L", 0, 15, 100), ("CW", 5, 20, 100, 5, 15), ("L", 26, 20, 100), ("L", 30, 16, 100), ("L", 30, 0, 100),
    ]  # fmt: skip
    assert program.moves[2].feed_mm_min == 50.0


def test_a_rounding_between_a_line_and_an_arc_touches_both():
    program = read("L X+0 Y+0 F100\nL X+20\nRND R2\nCR X+20 Y+20 R+12 DR+\nL X+0")
    (line, round_, arc) = program.moves[1:4]
    cx, cy = round_.center
    assert cy == pytest.approx(2.0)  # beside the line
    assert math.dist((cx, cy), arc.center) == pytest.approx(10.0)  # inside the arc of radius 12
    assert line.end[0] == pytest.approx(cx)


def test_compensation_to_the_left_goes_round_outer_and_through_inner_corners():
    # TOOL DEF 1 R+5; square corner at (0, 20), path turning right: outer for RL
    program = read("L X+0 Y-20 R0 FMAX\nL X+0 Y+0 RL F100\nL Y+20\nL X+30\nL Y+40\nL X+60 R0")
    assert path(program) == [
        ("R", 0, -20, 100), ("L", -5, 0, 100), ("L", -5, 20, 100), ("CW", 0, 25, 100, 0, 20), ("L", 25, 25, 100),
        ("L", 25, 40, 100), ("L", 60, 40, 100),
    ]  # fmt: skip


def test_allowances_of_the_call_count():
    head = "TOOL DEF 1 L+0 R+5\nTOOL CALL 1 Z S1000 F200 DL+0.5 DR+1\nM3"
    program = read("L X+0 Y-20 Z+0 R0 FMAX\nL X+0 Y+0 RL F100\nL Y+20\nL Y+40 R0", head=head)
    assert path(program)[1] == ("L", -6, 0, 0.5)


# ---- approach and departure ("Contour approach and departure") ----


def test_approach_on_a_line_and_an_arc_of_the_manual():
    # APPR LT: along the first element, LEN before the contour; compensation RR moves both to the right
    program = read("L X+40 Y+10 R0 FMAX\nAPPR LT X+20 Y+20 LEN15 RR F100\nL Y+35\nL Y+60")
    assert path(program)[1:3] == [("L", 25, 5, 100), ("L", 25, 20, 100)]
    # APPR CT: centre R beside the contour point on the free side, CCA back along the arc
    program = read("L X+40 Y+10 R0 FMAX\nAPPR CT X+20 Y+20 CCA90 R+10 RR F100\nL Y+35\nL Y+60")
    assert path(program)[1:3] == [("L", 30, 15, 100), ("CW", 25, 20, 100, 30, 20)]


def test_departure_on_a_line_an_arc_and_perpendicular():
    start = "L X+0 Y-20 R0 FMAX\nL X+0 Y+0 RL F100\nL Y+20\n"
    assert path(read(start + "DEP LT LEN12.5"))[2:] == [("L", -5, 20, 100), ("L", -5, 32.5, 100)]
    assert path(read(start + "DEP CT CCA90 R+10\nL Z+200 FMAX"))[2:] == [
        ("L", -5, 20, 100), ("CCW", -10, 25, 100, -10, 20), ("R", -10, 25, 200),
    ]  # fmt: skip


@pytest.mark.parametrize(
    "block",
    [
        "DEP LT",
        "DEP LN",
        "DEP CT R5",
        "DEP CT CCA0 R5",
        "DEP CT CCA90",
        "DEP CT CCA90 R0",
        "DEP LCT X+50 Y+50",
    ],
)
def test_an_approach_or_departure_without_its_size_is_refused(block):
    """Without CCA the arc ended where it began: a full circle; without R or LEN it was left out."""
    before = "L X+0 Y+0 R0 F100 M3\nL X+20\n"
    program = read(before + block)
    assert codes(program) == ["E109"] and path(program) == path(read(before))
    program = read(
        f"L X+0 Y+0 R0 F100 M3\n{block.replace('DEP', 'APPR').replace(' X+50 Y+50', '')} X+9 Y+9 RL\nL X+40\nL X+50"
    )
    assert "E109" in codes(program) and all(move.center is None for move in program.moves)


@pytest.mark.parametrize("side", ["R0", "RL"])
@pytest.mark.parametrize("block", ["DEP LT LEN5", "DEP LN LEN5", "DEP CT CCA90 R5", "CT X+40 Y+20"])
def test_a_tangent_after_a_move_along_the_tool_is_not_known(block, side):
    """It was taken as nought: no way out, a straight line instead of CT, an arc about its own start."""
    before = f"L X+0 Y+0 R0 F100 M3\nL X+20 {side}\nL Z-5\n"
    program = read(before + block + "\nL Z+50 R0 FMAX")
    assert {"E302", "E352"} & set(codes(program))
    assert [move for move in program.moves if move.line == program.findings[0].line] == []


def test_approach_lct_touches_its_arc():
    program = read("L X-20 Y-20 R0 FMAX\nAPPR LCT X+10 Y+10 R8 RL F300\nL Y+70\nL X+90")
    line, arc = program.moves[1:3]
    assert arc.center == pytest.approx((2.0, 10.0))
    radius = (line.end[0] - 2.0, line.end[1] - 10.0)
    assert math.hypot(*radius) == pytest.approx(3.0)  # R8 less the tool
    assert radius[0] * (line.end[0] + 20.0) + radius[1] * (line.end[1] + 20.0) == pytest.approx(0.0, abs=1e-9)
    assert arc.end[:2] == pytest.approx((5.0, 10.0))


# ---- drilling cycles (cycle programming) ----

SET = "Q200=2 Q203=+0 Q204=20 Q206=150"


def test_cycle_200_pecks_to_its_depth():
    moves = drilled(f"CYCL DEF 200 DRILLING {SET} Q201=-10 Q202=4 Q210=0 Q211=0.5\nM99")
    assert moves == [
        ("R", 2), ("L", -4), ("R", 2), ("R", -2), ("L", -8), ("R", 2), ("R", -6), ("L", -10), ("D", -10), ("R", 2),
        ("R", 20),
    ]  # fmt: skip


def test_cycle_201_feeds_both_ways():
    assert drilled(f"CYCL DEF 201 REAMING {SET} Q201=-8 Q211=0 Q208=300\nM99") == [
        ("R", 2), ("L", -8), ("L", 2), ("R", 20),
    ]  # fmt: skip


def test_cycle_203_breaks_chips_before_it_retracts():
    moves = drilled(
        f"CYCL DEF 203 {SET} Q201=-12 Q202=4 Q210=0 Q212=1 Q213=1 Q205=2 Q211=0 Q208=0 Q256=0.2\nM99"
    )
    # steps 4, 3, 2, 2, 1; one chip broken, then one full retract
    assert [z for kind, z in moves if kind == "L"] == [-4, -7, -9, -11, -12]
    assert [z for kind, z in moves if kind == "R"] == pytest.approx([2, -3.8, 2, -5, -8.8, 2, -9, 2, 20])


def test_cycle_205_stops_before_the_last_depth():
    body = f"CYCL DEF 205 {SET} Q201=-9 Q202=3 Q212=0 Q205=0 Q258=0.5 Q259=0.5 Q257=0 Q256=0 Q211=0 Q379=0 Q253=500\nM99"
    assert drilled(body) == [
        ("R", 2), ("L", -3), ("R", 2), ("R", -2.5), ("L", -6), ("R", 2), ("R", -5.5), ("L", -9), ("R", 2), ("R", 20),
    ]  # fmt: skip


def test_cycle_207_feeds_by_pitch():
    program = read("L X+0 Y+0 Z+50 FMAX\nCYCL DEF 207 Q200=2 Q201=-9 Q239=+1.5 Q203=+0 Q204=5\nM99")
    assert [m.feed_mm_min for m in program.moves if m.motion == "linear"] == [1500.0, 1500.0]


def test_a_tap_without_pitch_keeps_its_path():
    program = read("L X+0 Y+0 Z+50 FMAX\nCYCL DEF 207 Q200=2 Q201=-9 Q239=0 Q203=+0 Q204=5\nM99")
    assert [m.feed_mm_min for m in program.moves if m.motion == "linear"] == [1000.0, 1000.0]
    assert [m.end[2] for m in program.moves][-4:] == [2.0, -9.0, 2.0, 5.0]
    assert [f.code for f in program.findings if f.severity != "I"] == ["W381"]


def test_cycle_208_mills_a_helix_and_a_last_circle():
    program = read(f"L X+10 Y+20 Z+50 FMAX\nCYCL DEF 208 {SET} Q201=-6 Q334=4 Q335=16 Q342=0\nM99")
    assert path(program)[1:] == [
        ("R", 10, 20, 2), ("L", 13, 20, 2), ("CCW", 13, 20, -6, 10, 20), ("CCW", 13, 20, -6, 10, 20),
        ("L", 10, 20, -6), ("R", 10, 20, 2), ("R", 10, 20, 20),
    ]  # fmt: skip
    assert program.moves[3].turns == 2


def test_the_old_pecking_cycle_counts_from_where_the_tool_stands():
    body = "CYCL DEF 1.0 PECKING\nCYCL DEF 1.1 SET UP 2\nCYCL DEF 1.2 DEPTH -20\nCYCL DEF 1.3 PECKG 12\nCYCL DEF 1.4 DWELL 0\n"
    body += "CYCL DEF 1.5 F80\nL Z+2 FMAX\nCYCL CALL"
    assert drilled(body) == [("R", 2), ("L", -12), ("R", 2), ("R", -11.4), ("L", -20), ("R", 2)]


def test_m89_m99_and_call_pos_drill_where_they_stand():
    cycle = f"CYCL DEF 201 {SET} Q201=-8 Q211=0 Q208=0\n"
    body = (
        cycle
        + "L X+0 Y+0 FMAX M89\nL X+10 FMAX\nL X+20 FMAX M99\nL X+30 FMAX\nCYCL CALL POS X+40 Y+5 Z+0 FMAX"
    )
    program = read("L Z+50 FMAX\n" + body)
    assert codes(program) == []
    assert [m.end[:2] for m in program.moves if m.motion == "linear" and m.end[2] == -8] == [
        (0, 0), (10, 0), (20, 0), (40, 5),
    ]  # fmt: skip


def test_patterns_on_a_circle_and_in_rows():
    cycle = f"CYCL DEF 201 {SET} Q201=-8 Q211=0 Q208=0\n"
    circle = "CYCL DEF 220 Q216=+50 Q217=+50 Q244=40 Q245=+0 Q246=+360 Q247=+0 Q241=4 Q200=2 Q203=+0 Q204=30 Q301=1"
    program = read("L Z+50 FMAX\n" + cycle + circle)
    holes = [tuple(round(v, 6) for v in m.end[:2]) for m in program.moves if m.end[2] == -8]
    assert holes == [(70, 50), (50, 70), (30, 50), (50, 30)]
    rows = (
        "CYCL DEF 221 Q225=+10 Q226=+20 Q237=+5 Q238=+8 Q242=3 Q243=2 Q224=+0 Q200=2 Q203=+0 Q204=30 Q301=1"
    )
    program = read("L Z+50 FMAX\n" + cycle + rows)
    assert [m.end[:2] for m in program.moves if m.end[2] == -8] == [
        (10, 20), (15, 20), (20, 20), (20, 28), (15, 28), (10, 28),
    ]  # fmt: skip


# ---- coordinate transformations ----


def test_shift_mirror_rotation_and_scale():
    shift = "CYCL DEF 7.0\nCYCL DEF 7.1 X+10\nCYCL DEF 7.2 Y+20\n"
    assert path(read(shift + "L X+1 Y+2 F100"))[-1] == ("L", 11, 22, 100)
    assert path(read(shift + "CYCL DEF 7.1 IX+5\nL X+1 Y+2 F100"))[-1] == ("L", 16, 22, 100)
    turn = "CYCL DEF 10.0\nCYCL DEF 10.1 ROT+90\n"
    assert path(read(shift + turn + "L X+1 Y+2 F100"))[-1] == ("L", 8, 21, 100)
    mirror = "CYCL DEF 8.0\nCYCL DEF 8.1 X\n"
    assert path(read(shift + mirror + "L X+1 Y+2 F100"))[-1] == ("L", 9, 22, 100)
    scale = "CYCL DEF 11.0\nCYCL DEF 11.1 SCL 0.5\n"
    assert path(read(shift + scale + "L X+2 Y+4 F100"))[-1] == ("L", 11, 22, 100)
    off = "CYCL DEF 10.0\nCYCL DEF 10.1 ROT+0\n"
    assert path(read(shift + turn + "L X+1 F100\n" + off + "L X+1 Y+2 F100"))[-1] == ("L", 11, 22, 100)


def test_a_mirrored_arc_turns_the_other_way_and_compensation_changes_sides():
    mirror = "CYCL DEF 8.0\nCYCL DEF 8.1 X\n"
    program = read(mirror + "L X+10 Y+0 F100\nCC X+0 Y+0\nC X+0 Y+10 DR+")
    assert path(program)[-1] == ("CW", 0, 10, 100, 0, 0)
    program = read(mirror + "L X+0 Y-20 FMAX\nL X+10 Y+0 RL F100\nL Y+20\nL Y+40 R0")
    assert path(program)[1] == ("L", -5, 0, 100)  # x = -(10 - 5)


def test_a_shift_defined_before_a_rotation_is_not_changed_under_it():
    shift = "CYCL DEF 7.0\nCYCL DEF 7.1 X+10\n"
    program = read(shift + "CYCL DEF 10.0\nCYCL DEF 10.1 ROT+90\nCYCL DEF 7.0\nCYCL DEF 7.1 X+20\nL X+0 F100")
    assert codes(program) == ["E367"]


def test_spatial_angles_tilt_the_plane_and_the_tool():
    program = read("PLANE SPATIAL SPA+0 SPB+90 SPC+0 STAY\nL X+10 Y+5 Z+20 FMAX\nL Z+3 F100")
    last = program.moves[-1]
    # B+90 carries x to -z and z to +x
    assert last.end == pytest.approx((3, 5, -10))
    assert last.axis_end == pytest.approx((1, 0, 0))
    assert codes(program) == ["W365"]


def test_the_vector_plane_equals_its_angles():
    a = read(
        "PLANE VECTOR BX+0.8660254037844387 BY+0 BZ-0.5 NX+0.5 NY+0 NZ+0.8660254037844387 STAY\nL X+10 Y+5 Z+20 FMAX"
    )
    b = read("PLANE SPATIAL SPA+0 SPB+30 SPC+0 STAY\nL X+10 Y+5 Z+20 FMAX")
    c = read("CYCL DEF 19.0\nCYCL DEF 19.1 A+0 B+30 C+0\nL X+10 Y+5 Z+20 FMAX")
    for other in (b, c):
        assert other.moves[-1].end == pytest.approx(a.moves[-1].end, abs=1e-12)


def test_a_circle_in_a_tilted_plane_stays_a_circle():
    program = read(
        "PLANE SPATIAL SPA+0 SPB+30 SPC+0 STAY\nL X+10 Y+0 Z+0 FMAX\nCC X+0 Y+0\nC X+10 Y+0 DR+ F100\nL Z+50 FMAX"
    )
    pieces = [m for m in program.moves if m.circle is not None]
    assert len(pieces) == 4
    s, c = 0.5, math.sqrt(0.75)
    for piece in pieces:
        middle, normal = piece.circle
        assert middle == pytest.approx((0, 0, 0), abs=1e-12)
        assert normal == pytest.approx((s, 0, c))
        assert math.dist(piece.end, middle) == pytest.approx(10.0)
        assert sum(p * n for p, n in zip(piece.end, normal, strict=True)) == pytest.approx(0.0, abs=1e-9)


def test_machine_coordinates_go_home_unless_the_job_says_where_the_part_lies():
    program = read("L X+10 Y+10 Z+5 FMAX\nL Z-1 FMAX M91")
    assert path(program)[-1] == ("R", 10, 10, 100)
    assert codes(program) == ["W366"]
    program = read("L X+10 Y+10 Z+5 FMAX\nL Z-1 FMAX M91", work_offsets={"G54": (0.0, 0.0, -300.0)})
    assert path(program)[-1] == ("R", 10, 10, 299)
    assert codes(program) == []


def test_tool_centre_point_control_keeps_the_tip():
    program = read("L A+0 B+0 FMAX\nM128\nL X+0 Y+0 Z+10 B+30 C+0 F100\nL X+10 B+40")
    last = program.moves[-1]
    assert last.tcp
    assert last.end == (10, 0, 10)
    assert last.rotary_deg == {"a": 0, "b": 40, "c": 0}
    assert last.rotary_start == {"a": 0, "b": 30, "c": 0}


# ---- parameters, labels, programs ----


def test_parameters_and_functions_compute():
    body = "FN 0: Q1 = +10\nFN 1: Q2 = +Q1 + +5\nFN 4: Q3 = +Q2 DIV +4\nQ4 = SQRT ( Q1 * Q1 + 3 ^ 2 * 0 ) + SIN 30\n"
    body += "FN 13: Q5 = +10 ANG +10\nFN 8: Q6 = +3 LEN +4\nL X+Q2 Y-Q3 F100\nL X+Q4 Y+Q5\nL X+Q6"
    program = read(body)
    assert path(program) == [("L", 15, -3.75, 100), ("L", 10.5, 45, 100), ("L", 5, 45, 100)]


def test_labels_are_called_and_repeated():
    body = 'L X+0 Y+0 F100\nLBL 1\nL IX+10\nCALL LBL 1 REP2/2\nCALL LBL 2\nCALL LBL "up"\nL Y+50\nM30\n'
    body += 'LBL 2\nL IY+1\nLBL 0\nLBL "up"\nL Z+5\nLBL 0'
    program = read(body)
    assert path(program)[1:] == [
        ("L", 10, 0, 100), ("L", 20, 0, 100), ("L", 30, 0, 100), ("L", 30, 1, 100), ("L", 30, 1, 5), ("L", 30, 50, 5),
    ]  # fmt: skip


def test_branches_compare():
    body = "FN 0: Q1 = +0\nLBL 1\nL IX+1 F100\nFN 1: Q1 = +Q1 + +1\nFN 12: IF +Q1 LT +3 GOTO LBL 1\n"
    body += "FN 9: IF +Q1 EQU +3 GOTO LBL 9\nL X+99\nLBL 9\nL Y+7"
    assert path(read(body))[-2:] == [("L", 3, 0, 100), ("L", 3, 7, 100)]


def test_a_called_program_runs_from_its_file(tmp_path: Path):
    (tmp_path / "SUB.H").write_text("BEGIN PGM SUB MM\nL X+5 F100\nEND PGM SUB MM\n")
    main = tmp_path / "main.h"
    main.write_text(
        "BEGIN PGM MAIN MM\nTOOL CALL 1 Z S100\nCALL PGM TNC:\\JOB\\SUB.H\nL Y+7\nEND PGM MAIN MM\n"
    )
    program = read_program(main, dialect="heidenhain", home=HOME)
    assert path(program) == [("L", 5, 0, 100), ("L", 5, 7, 100)]
    assert [move.line for move in program.moves] == [3, 4]
    assert program.files == (str(tmp_path / "SUB.H"),)


def test_the_blank_and_the_unit_are_told():
    program = read("BLK FORM 0.1 Z X+0 Y-10 Z-20\nBLK FORM 0.2 IX+100 Y+50 Z+0\nL X+0 FMAX")
    assert program.declared.stock == {"box": {"min": [0, -10, -20], "max": [100, 50, 0]}}
    assert program.declared.unit == "mm"
    assert program.declared.radii == {1: 5.0}


# ---- what is refused, and told once ----


@pytest.mark.parametrize(
    ("body", "code"),
    [
        ("CYCL DEF 258 POLYGON STUD Q218=60\nL X+0 FMAX M99\nL X+1 FMAX M99", "E208"),
        ("CYCL DEF 212 POCKET Q200=1", "E208"),
        ("CYCL DEF 251 POCKET Q200=1\nL X+0 FMAX M99", "E331"),
        ("L X+1 FMAX M97", "E208"),
        ("L X+Q77 F100\nL Y+Q77", "E108"),
        ("CALL LBL 7", "E412"),
        ("PLANE AXIAL A+30 B+30 STAY", "E208"),
        ("L U+5 FMAX", "E209"),
        ("C X+1 Y+1 DR+", "E302"),
        ("L X+1 BLAH+3", "E109"),
        ("FN 14: ERROR= 1005", "E418"),
        ("TOOL CALL 2 X S100", "E208"),
        ("LBL 1\nL IX+1 F100\nFN 9: IF +0 EQU +0 GOTO LBL 1", "E413"),
    ],
)
def test_what_is_refused_is_named_once(body: str, code: str):
    program = read(body, max_steps=5000)
    assert codes(program) == [code]


def test_codes_without_a_path_are_noted_once():
    program = read(
        "L X+1 FMAX M8\nL X+2 FMAX M8\nCYCL DEF 32.0 TOLERANCE\nCYCL DEF 32.1 T0.05\nFN 15: PRINT Q1"
    )
    assert [f.word for f in program.findings if f.code == "I408"] == ["M8", "CYCL DEF 32", "FN 15"]
    assert program.errors == ()


def test_a_text_is_recognised_by_its_frame():
    text = b"0 BEGIN PGM T MM\n1 TOOL CALL 1 Z S10\n2 L X+5 FMAX\n3 END PGM T MM\n"
    program = parse_program(text, "t.h", dialect="auto", home=HOME)
    assert program.dialect == "heidenhain"
    assert path(program) == [("R", 5, 0, 100)]


# ---- programs of others ----


@pytest.mark.skipif(not POSTS.is_dir(), reason="programs of others are not here")
def test_programs_of_others_read():
    read_clean = 0
    files = sorted(f for f in POSTS.iterdir() if f.suffix.lower() in (".h", ".ptp"))
    for file in files:
        program = read_program(file, dialect="auto")
        read_clean += not [f for f in program.errors if f.code not in ("E351", "E412", "W401")]
    assert read_clean >= 0.7 * len(files)


SEED = """BEGIN PGM T MM
BLK FORM 0.1 Z X+0 Y+0 Z-20
TOOL DEF 1 L+0 R+5
TOOL CALL 1 Z S1000 DL+0.1
L X+10 Y+5 R0 FMAX M3
APPR LCT X+10 Y+10 R8 RL F300
L Y+70
RND R6
CT X+20 Y+90
CR X+40 Y+90 R+15 DR-
DEP LT LEN5
CC X+1 Y+2
CP IPA+400 IZ-3 DR+
CYCL DEF 200 DRILLING Q200=2 Q201=-10 Q206=100 Q202=4 Q203=0 Q204=5
L X+3 FMAX M99
LBL 1
FN 1: Q1 = +Q2 + +1
Q3 = ( Q1 * 2 ) ^ 0.5
FN 12: IF +Q1 LT +3 GOTO LBL 1
CALL LBL 1 REP3/3
PLANE SPATIAL SPA+10 SPB-20 SPC+5 TURN
L X+1 Y+1 Z+10 FMAX
C X+5 Y+1 DR-
CYCL DEF 7.0
CYCL DEF 7.1 IX+5
CYCL DEF 10.1 ROT+30
CYCL DEF 11.1 SCL0.5
M128
LN X+1 Y+2 Z+3 TX+0 TY+0.6 TZ+0.8 F100
END PGM T MM
"""


@settings(max_examples=300, deadline=None)
@given(seed=st.integers(0, 2**32))
def test_mutated_programs_raise_nothing(seed: int):
    damaged = mutated(SEED, seed, ["9" * 12, "-", "Q1", "\n", "~\n", "LBL 1\n", "Z+1"])
    program = parse_program(damaged.encode(), "m.h", dialect="heidenhain", max_steps=2000)
    assert all(math.isfinite(v) for move in program.moves for v in move.end)


# ---- DIN/ISO (TNC 640, user's manual ISO programming) ----


def iso(body: str) -> Program:
    head = "%T G71 *\nN10 G30 G17 X+0 Y+0 Z-40 *\nN20 G31 G90 X+100 Y+100 Z+0 *\n"
    text = f"{head}N30 G99 T1 L+0 R+5 *\nN40 T1 G17 S1000 *\n{body}\nN99999 %T G71 *\n"
    return parse_program(text.encode(), "t.i", dialect="auto", home=HOME)


def test_din_iso_is_recognised_and_its_blank_is_no_retract():
    program = iso("N50 G00 G40 G90 Z+250 M3 *\nN60 X-30 Y+30 *\nN70 G01 Z-5 F200 *\nN80 G91 X+10 *")
    assert program.dialect == "heidenhain-iso"
    assert program.declared.stock == {"box": {"min": [0, 0, -40], "max": [100, 100, 0]}}
    assert codes(program) == ["I212"]
    assert path(program) == [("R", 0, 0, 250), ("R", -30, 30, 250), ("L", -30, 30, -5), ("L", -20, 30, -5)]


def test_din_iso_shifts_the_datum_by_g54_and_turns_about_poles():
    program = iso(
        "N50 M3 *\nN60 G54 X+10 Y+20 *\nN70 G01 X+10 Y+0 F100 *\nN80 I+0 J+0 *\nN90 G03 X+0 Y+10 *\nN95 G02 X+10 Y+20 R+10 *"
    )
    assert path(program) == [("L", 20, 20, 100), ("CCW", 10, 30, 100, 10, 20), ("CW", 20, 40, 100, 20, 30)]


def test_din_iso_polar_rounding_labels_and_cycles():
    program = iso(
        "N50 G01 X+0 Y+0 F100 M3 *\nN60 Y+20 *\nN70 G25 R5 *\nN80 X+30 *\nN85 I+30 J+10 *\nN90 G11 R+10 H+0 *\nN95 G13 G91 H+90 *"
    )
    assert path(program)[1:] == [
        ("L", 0, 15, 100), ("CW", 5, 20, 100, 5, 15), ("L", 30, 20, 100), ("L", 40, 10, 100), ("CCW", 30, 20, 100, 30, 10),
    ]  # fmt: skip
    program = iso(
        "N50 G200 Q200=2 Q201=-8 Q206=100 Q202=8 Q203=+0 Q204=20 *\nN55 M3 *\nN60 G98 L1 *\nN70 G91 G00 X+10 M99 *\nN80 L1,2 *"
    )
    assert [m.end[0] for m in program.moves if m.end[2] == -8] == [10, 20, 30]
    assert [f.code for f in iso("N50 G77 X5 *").findings] == ["I212", "E109"]


def test_m126_goes_the_shorter_way_round():
    body = "L C+350 FMAX\nM128\nL X+0 Y+0 Z+10 B+10 F100\nM126\nL X+1 C+10"
    assert read(body).moves[-1].rotary_deg == {"b": 10, "c": 370}
    assert read(body.replace("M126\n", "")).moves[-1].rotary_deg == {"b": 10, "c": 10}


def test_din_iso_branches():
    body = (
        "N50 D00 Q1 P01 +0 *\nN55 M3 *\nN60 G98 L1 *\nN65 G91 G01 X+1 F100 *\nN70 D01 Q1 P01 +Q1 P02 +1 *\n"
    )
    program = iso(body + "N80 D12 P01 +Q1 P02 +3 P03 1 *")
    assert [m.end[0] for m in program.moves] == [1, 2, 3]
