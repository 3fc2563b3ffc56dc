"""Constructs that posts write beside the plain ones: patterns, thread milling, planes by points, words of M codes.

Source of the rules: HEIDENHAIN TNC 640, user's manuals "Conversational programming" and "Cycle programming" (public); the
section is named in each test. Motions are worked by hand; coordinates are mm, of the tip, in work coordinates.
"""

from __future__ import annotations

import math

import pytest

from vmachining.nc import Program, ToolEntry, parse_program

HALF = math.sqrt(0.5)
DRILL = "CYCL DEF 200 DRILLING Q200=2 Q201=-5 Q206=100 Q202=5 Q210=0 Q203=0 Q204=20 Q211=0\n"


def read(
    body: str, *, unit: str = "MM", head: str = "TOOL DEF 1 L+0 R+5\nTOOL CALL 1 Z S1000 F200\nM3", **more
) -> Program:
    text = f"BEGIN PGM T {unit}\n{head}\n{body}\nEND PGM T {unit}\n"
    return parse_program(text.encode(), "t.h", dialect="heidenhain", home=(0.0, 0.0, 100.0), **more)


def codes(program: Program) -> list[str]:
    return [f.code for f in program.findings if f.code not in ("W501", "I408")]


def rows(program: Program) -> list[tuple]:
    """Kind and end of every move."""
    return [(m.motion.value, *(round(v, 4) + 0.0 for v in m.end)) for m in program.moves]


def holes(body: str) -> list[tuple[float, float, float]]:
    """Where the feed moves of a drilling pattern end."""
    program = read(DRILL + body + "\nL Z+50 FMAX\nCYCL CALL PAT FMAX")
    assert codes(program) == []
    return [row[1:] for row in rows(program) if row[0] == "linear"]


# ---- cycle programming, "Pattern definition PATTERN DEF" ----


@pytest.mark.parametrize(
    ("pattern", "where"),
    [
        ("POS1 (X+10 Y+20 Z+0) ~\n POS2 (X+30 Y+20 Z-3)", [(10, 20, -5), (30, 20, -8)]),
        ("ROW1 (X+1 Y+2 D+10 NUM3 ROT+90 Z+0)", [(1, 2, -5), (1, 12, -5), (1, 22, -5)]),
        (
            "PAT1 (X+0 Y+0 DX+10 DY+4 NUMX2 NUMY2 ROT+0 ROTX+0 ROTY+0 Z+0)",
            [(0, 0, -5), (10, 0, -5), (10, 4, -5), (0, 4, -5)],
        ),
        # only the columns' direction turns: the second row lies 4 along -X
        (
            "PAT1 (X+0 Y+0 DX+10 DY+4 NUMX2 NUMY2 ROT+0 ROTX+0 ROTY+90 Z+0)",
            [(0, 0, -5), (10, 0, -5), (6, 0, -5), (-4, 0, -5)],
        ),
        (
            "FRAME1 (X+0 Y+0 DX+10 DY+10 NUMX3 NUMY3 ROT+0 ROTX+0 ROTY+0 Z+0)",
            [
                (0, 0, -5),
                (10, 0, -5),
                (20, 0, -5),
                (20, 10, -5),
                (20, 20, -5),
                (10, 20, -5),
                (0, 20, -5),
                (0, 10, -5),
            ],
        ),
        ("CIRC1 (X+5 Y+5 D20 START+0 NUM4 Z+0)", [(15, 5, -5), (5, 15, -5), (-5, 5, -5), (5, -5, -5)]),
        ("PITCHCIRC1 (X+0 Y+0 D20 START+0 STEP90 NUM2 Z+0)", [(10, 0, -5), (0, 10, -5)]),
    ],
)
def test_a_cycle_is_called_at_every_point_of_a_pattern(pattern: str, where: list):
    assert holes(f"PATTERN DEF {pattern}") == where


def test_between_the_points_the_tool_is_at_the_higher_of_q204_and_where_it_stood():
    program = read(DRILL + "PATTERN DEF POS1 (X+0 Y+0 Z+0) POS2 (X+9 Y+0 Z+0)\nL Z+50 FMAX\nCYCL CALL PAT")
    assert rows(program)[-8:] == [
        ("rapid", 0, 0, 2), ("rapid", 0, 0, 20), ("rapid", 0, 0, 50), ("rapid", 9, 0, 50), ("rapid", 9, 0, 2),
        ("linear", 9, 0, -5), ("rapid", 9, 0, 2), ("rapid", 9, 0, 20),
    ]  # fmt: skip


@pytest.mark.parametrize(
    "pattern",
    ["POS1 (X+1 Y+Q9)", "ROW1 (X+1 Y+1 D+2)", "PAT1 (X1 Y1 DX1 DY1 NUMX999 NUMY999)", "STAR1 (X+1)"],
)
def test_a_pattern_that_lacks_something_is_named(pattern: str):
    assert len(codes(read(f"PATTERN DEF {pattern}"))) == 1


# ---- cycle programming, "THREAD MILLING (cycle 262)" and "Fundamentals of thread milling" ----


def test_thread_milling_climbs_out_of_the_hole():
    # M3, climb, right-hand: Z+. Radius 10 - 5; two turns of 2 mm from -4 to 0; half circles rise by 1 mm.
    program = read(
        "L X+10 Y+20 Z+2 FMAX\nCYCL DEF 262 THREAD MILLING Q335=20 Q239=2 Q201=-4 Q355=1 Q253=750 Q351=1 Q200=2 Q203=0"
        " Q204=50 Q207=500\nCYCL CALL"
    )
    assert codes(program) == ["W373"]
    assert rows(program)[1:] == [
        ("linear", 10, 20, -5), ("arc_ccw", 15, 20, -4), ("arc_ccw", 15, 20, 0), ("arc_ccw", 10, 20, 1),
        ("rapid", 10, 20, 2), ("rapid", 10, 20, 50),
    ]  # fmt: skip
    assert [(m.turns, m.feed_mm_min) for m in program.moves[2:5]] == [(1, 500), (2, 500), (1, 500)]


def test_a_thread_of_several_passes_up_cut_goes_down():
    # up-cut: cw, Z-. Passes of one turn (1 mm), 2 x 1 mm apart, from the surface
    program = read(
        "L X+0 Y+0 Z+2 FMAX\nCYCL DEF 262 Q335=20 Q239=1 Q201=-4 Q355=2 Q253=750 Q351=-1 Q200=2 Q203=0 Q204=2 Q207=500\nM99"
    )
    assert [row for row in rows(program) if row[0] == "arc_cw"] == [
        ("arc_cw", 5, 0, 0), ("arc_cw", 5, 0, -1), ("arc_cw", 0, 0, -1.5),
        ("arc_cw", 5, 0, -2), ("arc_cw", 5, 0, -3), ("arc_cw", 0, 0, -3.5),
    ]  # fmt: skip


# ---- cycle programming, "BACK BORING (cycle 204)" ----


def test_back_boring_passes_beside_the_hole_and_cuts_upwards():
    program = read(
        "L X+10 Y+0 Z+50 FMAX\nCYCL DEF 204 BACK BORING Q200=2 Q249=5 Q250=20 Q251=3.5 Q252=15 Q253=750 Q254=200 Q255=1 Q203=20"
        " Q204=50 Q214=1 Q336=0\nM99"
    )
    # surface 20, plate 20, edge 15: the underside is reached at -15; 2 below it, then up by 5
    assert rows(program)[1:] == [
        ("rapid", 10, 0, 22), ("rapid", 6.5, 0, 22), ("linear", 6.5, 0, -17), ("rapid", 10, 0, -17), ("linear", 10, 0, -10),
        ("dwell", 10, 0, -10), ("linear", 10, 0, -17), ("rapid", 6.5, 0, -17), ("linear", 6.5, 0, 22), ("rapid", 10, 0, 22),
        ("rapid", 10, 0, 70),
    ]  # fmt: skip
    assert codes(program) == ["W373"]


# ---- conversational programming, "Programming: Q parameters" ----


def test_what_only_the_machine_knows_is_an_error_where_it_is_used():
    read_it = "FN 18: SYSREAD Q10 = ID20 NR4\nQ11 = Q10 + 1\nFN 2: Q12 = +Q11 - +1\n"
    assert codes(read(read_it + "L X+10")) == []
    assert codes(read(read_it + "L X+Q12")) == ["E108"]
    assert codes(read(read_it + "FN 0: Q12 = +3\nL X+Q12")) == []
    ends = read(read_it + "FN 9: IF +Q10 EQU +0 GOTO LBL 1\nL X+1\nLBL 1\nL X+2")
    assert codes(ends) == ["E108"]
    assert not ends.moves
    assert codes(read("TCH PROBE 417 PROBING IN TS AXIS Q263=0\nL X+Q150")) == ["E108"]


def test_the_radius_of_the_tool_is_in_the_unit_of_the_program():
    assert (
        rows(read("L X+Q108 FMAX", unit="INCH", head="TOOL DEF 1 L+0 R+0.5\nTOOL CALL 1 Z S1000 F20"))[0][1]
        == 12.7
    )


def test_a_tool_is_named_by_a_text():
    assert read('QS1 = "T12"\nTOOL CALL QS1 Z S100').declared.names == {1: "T12"}
    assert read('DECLARE STRING QS1 = "T12"\nTOOL CALL QS1 Z S100').declared.names == {1: "T12"}
    assert codes(read("TOOL CALL QS7 Z S100")) == ["E108"]


# ---- conversational programming, "Miscellaneous functions": words that belong to an M code ----


@pytest.mark.parametrize(
    "words",
    ["M128 F9000", "M118 X1 Y1 Z1", "M103 F20", "M120 LA30", "M124 T0.01", "M112 T0.01 A10", "M138 A C"],
)
def test_words_after_an_m_code_are_its_own(words: str):
    program = read(f"L X+10 Y+5 Z+2 {words}\nL X+20")
    assert rows(program) == [("linear", 10, 5, 2), ("linear", 20, 5, 2)]
    assert [m.feed_mm_min for m in program.moves] == [200, 200]
    assert codes(program) == (["W372"] if "M103" in words else [])


def test_m140_retracts_at_its_own_feed():
    program = read("L X+0 Z+0\nL X+10 M140 MB+30 F750\nL X+20\nM140 MB5")
    assert rows(program)[1:] == [
        ("linear", 10, 0, 0),
        ("linear", 10, 0, 30),
        ("linear", 20, 0, 30),
        ("rapid", 20, 0, 35),
    ]
    assert [m.feed_mm_min for m in program.moves[1:]] == [200, 750, 200, None]


def test_m140_goes_along_the_tool_axis_of_a_vector():
    # axis (0.6, 0, 0.8): 10 mm are 6 in X and 8 in Z
    program = read("M128\nLN X+0 Y+0 Z+0 TX0.6 TY0 TZ0.8\nM140 MB10")
    assert rows(program)[-1] == ("rapid", 6, 0, 8)


def test_a_feed_per_tooth_needs_the_teeth():
    table = {1: ToolEntry(1, 10.0, 50.0, flutes=3)}
    assert read("L X+10 FZ0.1", tools=table).moves[0].feed_mm_min == pytest.approx(0.1 * 3 * 1000)
    assert codes(read("L X+10 FZ0.1", tools={1: ToolEntry(1, 10.0, 50.0)})) == ["E301"]
    program = read("L X+10 FZ0.1")  # without any tool table: two teeth, and said
    assert codes(program) == ["W381"] and program.moves[0].feed_mm_min == pytest.approx(200)


@pytest.mark.parametrize(("cycle", "code"), [(403, "W368"), (410, "W368"), (430, "I408"), (480, "I408")])
def test_probing_that_places_the_part_is_said(cycle, code):
    """TNC 640, touch probe cycles: 400 to 405 set a basic rotation, 408 to 419 a datum, 420 and on only measure."""
    found = read(f"CYCL DEF {cycle} PROBE Q321=+0\nL X+1 FMAX").findings
    assert [f.code for f in found if f"cycle {cycle}" in f.message] == [code]
    assert not any("work_offsets" in f.hint for f in found)


# ---- conversational programming, "The PLANE function" and "TRANS DATUM"; functions of TCPM ----


def test_a_plane_by_three_points():
    # X along P1 P2, P3 on the side of Y: normal (0, -1, 1) / sqrt 2 x ... = X x (P3 - P1)
    points = "PLANE POINTS P1X+0 P1Y+0 P1Z+0 P2X+10 P2Y+0 P2Z+0 P3X+0 P3Y+10 P3Z+10 STAY"
    program = read(f"L Z+0 FMAX\n{points}\nL X+3 Y+1 Z+0 FMAX")
    end = program.moves[-1]
    assert end.end == pytest.approx((3, HALF, HALF))
    assert end.axis_end == pytest.approx((0, -HALF, HALF))


def test_a_plane_by_one_angle_of_the_machine():
    program = read("PLANE AXIAL B+90 STAY\nL X+0 Y+0 Z+5 FMAX")
    assert program.moves[-1].end == pytest.approx((5, 0, 0))
    assert "W374" in codes(program)


def test_trans_words_are_the_cycles_of_the_same_name():
    body = (
        "TRANS MIRROR AXIS X\nL X+10 Y+0\nTRANS MIRROR RESET\nTRANS ROTATION ROT+90\nL X+10\nTRANS ROTATION RESET\n"
        "TRANS SCALE SCL2\nL X+4 Y+1\nTRANS SCALE RESET\nL X+4"
    )
    # where the tool stands, (-10, 0), is (0, 10) in axes turned by 90 degrees
    assert [row[1:3] for row in rows(read(body))] == [(-10, 0), (-10, 10), (8, 2), (4, 2)]


@pytest.mark.parametrize("words", ["AXIS SPAT PATHCTRL AXIS", "AXIS POS PATHCTRL VECTOR"])
def test_variants_of_tcpm_with_another_meaning_are_refused(words: str):
    assert codes(read(f"FUNCTION TCPM F TCP {words}")) == ["E208"]


# ---- what is refused is told once ----


def test_free_contours_and_milling_cycles_are_one_finding_each():
    free = read("FPOL X+0 Y+0\nFL AN+0\nFC DR+ R5 CCX+10 CCY+5\nFLT\nFCT DR- R3\nFSELECT 2\nL X+5")
    assert codes(free) == ["E208"] and "FK" in free.errors[0].message
    pockets = read(
        "CYCL DEF 212 Q215=0 Q218=60\nL X+5 FMAX M99\nCYCL DEF 4.0 POCKET\nCYCL DEF 4.1 SET UP2\nL X+9 FMAX M99"
    )
    assert codes(pockets) == ["E208"] and pockets.errors[0].line == 5


# ---- conversational programming, "Circular path about circle centre CC": other planes; tool data, feeds; presets ----


def test_an_arc_in_a_plane_beside_the_working_plane():
    """Pole at Y-50 Z-6.8, start at Y-48.8: a quarter clockwise about X leads from +Y to -Z, to Y-50 Z-8."""
    program = read(
        "L X+200 Y-48.8 Z-6.8 R0 FMAX\nCC Y-50 Z-6.8\nCP IPA-90 DR- F100\nCC X+201 Y-50\nCP IPA+180 DR+"
    )
    assert codes(program) == []
    arc, back = program.moves[-2:]
    assert arc.end == pytest.approx((200, -50, -8)) and arc.plane == "yz"
    assert back.end == pytest.approx((202, -50, -8)) and back.plane == "xy"
    program = read("L X+10 Y+0 Z+0 R0 FMAX\nCC X+0 Z+0\nC X+0 Z-10 DR+ F100")
    assert program.moves[-1].end == pytest.approx((0, 0, -10)) and program.moves[-1].plane == "zx"


def test_an_arc_beside_the_working_plane_takes_no_compensation():
    assert codes(read("L X+0 Y+0 RL F100\nL X+20\nCC Y+0 Z+0\nC Y+0 Z+0 DR+"))[0] == "E361"


def test_speeds_and_feeds_of_the_tool_call():
    """VC 120 m/min on a diameter of 10: 3819.7 rev/min; FZ 0.05 with four teeth; FAUTO is the feed of the call."""
    more = {"tools": {1: ToolEntry(1, 10.0, 0.0, flutes=4)}}
    head = "TOOL CALL 1 Z S(VC=120) F(FZ=0.05)\nM3"
    program = read("L X+1 R0\nL X+2 F100\nL X+3 FAUTO", head=head, **more)
    assert program.moves[0].spindle_rpm == pytest.approx(120000 / (10 * math.pi))
    assert [m.feed_mm_min for m in program.moves] == pytest.approx([763.944, 100, 763.944], abs=1e-3)
    assert codes(read("L X+1 FZ0.1", head="TOOL CALL 1 Z S(VC=120)\nM3")) == ["W381", "W381"]


def test_feeds_of_cycles_by_their_kind():
    program = read(DRILL.replace("Q206=100", "Q206=FAUTO") + "L X+1 FMAX M99")
    assert [m.feed_mm_min for m in program.moves if m.feed_mm_min] == [200.0]
    for written in ("Q206= AUTO ;FEED RATE", "Q206=AUTO"):  # as a control stores it
        program = read(DRILL.replace("Q206=100", written + "~\n") + "L X+1 FMAX M99")
        assert codes(program) == []
        assert [m.feed_mm_min for m in program.moves if m.feed_mm_min] == [200.0]
    program = read(DRILL.replace("Q206=100", "Q206=AUTO") + "L X+1 FMAX M99", head="TOOL CALL 1 Z S1000\nM3")
    assert codes(program) == ["E301"] and "which has none" in program.findings[0].message
    program = read(DRILL.replace("Q206=100", "Q206=FU0.1") + "L X+1 FMAX M99")
    assert [m.feed_mm_min for m in program.moves if m.feed_mm_min] == [100.0]


@pytest.mark.parametrize("word", ["Q206=FMAX", "Q206=MAX"])
def test_a_plunge_at_rapid_is_refused_and_the_cycle_before_is_not_run_in_its_place(word):
    """Q208 is a way back, which may be a rapid."""
    pocket = (
        "CYCL DEF 251 Q215=1 Q218=60 Q219=20 Q201=-5 Q202=5 Q207=500 Q206=100 Q200=2 Q203=0 Q204=20 Q370=1\n"
    )
    assert codes(read(pocket + "L X+2 FMAX M99")) == ["W384"]
    program = read(f"{DRILL}L X+1 FMAX M99\n{pocket.replace('Q206=100', word)}L X+2 FMAX M99")
    assert codes(program) == ["E301"] and all(m.end[0] == 1.0 for m in program.moves if m.feed_mm_min)
    assert codes(read(DRILL.replace("200", "201", 1).rstrip() + " Q208=FMAX\nL X+1 FMAX M99")) == []


def test_values_of_global_def_are_taken_by_predef():
    known = "GLOBAL DEF 100 GENERAL Q200=+3 Q204=+30 Q253=750 Q208=999\n"
    program = read(known + DRILL.replace("Q200=2", "Q200=PREDEF") + "L X+1 FMAX M99")
    assert rows(program)[1] == ("rapid", 1, 0, 3)
    assert codes(read(DRILL.replace("Q200=2", "Q200=PREDEF")))[0] == "E331"


def test_another_preset_ends_shifts_mirrors_and_scales():
    """Cycle 247: datum shift, mirror, rotation and scale are reset; PRESET SELECT may keep them."""
    shift = "CYCL DEF 7.0 DATUM\nCYCL DEF 7.1 X+10\n"
    assert rows(read(shift + "CYCL DEF 247 SET Q339=1\nL X+1 FMAX"))[-1] == ("rapid", 1, 0, 100)
    assert rows(read(shift + "PRESET SELECT #1\nL X+1 FMAX"))[-1] == ("rapid", 1, 0, 100)
    assert rows(read(shift + "PRESET SELECT #1 KEEP TRANS\nL X+1 FMAX"))[-1] == ("rapid", 11, 0, 100)


def test_adaptive_feeds_and_remarks():
    assert codes(
        read("FUNCTION AFC CUT BEGIN TIME5\nL X+1 FMAX (GO THERE)\n(A LINE)\nFUNCTION AFC CUT END")
    ) == ["W376"]


def test_a_cycle_written_with_blanks():
    assert [m.dwell_s for m in read("CYCL DEF9 .0 DWELL\nCYCL DEF9.1 V.ZEIT 5").moves] == [5]


def test_a_block_parallel_to_an_axis():
    """Axis keys write X+20 R0 F100 without a path function: a straight line."""
    lines = rows(read("L X+1 Y+2 FMAX\nY+5 R0 F100\nIX+3 M8"))
    assert lines == [("rapid", 1, 2, 100), ("linear", 1, 5, 100), ("linear", 4, 5, 100)]
    assert codes(read("X+5 R+ F100")) == ["E208"]
    parts = ("0 PECKING", "1 SET UP 2", "2 DEPTH -5", "3 PECKG 5", "4 DWELL", "5 F90")
    old = "".join(f"CYCL DEF 1.{part}\n" for part in parts)
    assert codes(read(f"L Z+2 FMAX\n{old}X+5 R0 FMAX M99")) == []


# ---- texts that are no numbers: they were left out, and what they belong to was taken as zero or cut short ----


@pytest.mark.parametrize(
    "block",
    [
        "CYCL DEF 7.1 X", "CYCL DEF 7.1 Y+1O", "CYCL DEF 7.1 X+5 B*3", "CYCL DEF 8.1 X FOO", "CYCL DEF 10.1 ROT+3O",
        "CYCL DEF 11.1 SCL2 X", "CYCL DEF 19.1 A+10 B", "CYCL DEF 26.1 X2 Y", "TRANS DATUM AXIS X+10 FOO",
        "PLANE SPATIAL SPA+10 SPB SPC+0 STAY", "PLANE SPATIAL SPA+10 SPB+2O SPC+0 STAY", "PLANE SPATIAL STAY",
        "PLANE VECTOR BX1 BY0 BZ0 NX0 NY0.2 STAY", "PLANE POINTS P1X+0 P1Y+0 P1Z+0 P2X+10 P2Y+0 P2Z+1 P3X+0 P3Y+10 STAY",
    ],
)  # fmt: skip
def test_a_garbled_coordinate_system_is_refused(block):
    program = read(block + "\nL X+1 Y+2 Z+3 R0 FMAX")
    assert codes(program) == ["E109"] and program.moves[-1].end == (1.0, 2.0, 3.0)


@pytest.mark.parametrize("value", ["Q203=-AX", "Q203=1O", "Q203", "Q203=", "Q203=1.2.3", "Q2O3=5"])
def test_a_garbled_value_of_a_cycle_is_refused_with_its_holes(value):
    program = read(DRILL.replace("Q203=0", value) + "L X+9 Y+9 R0 FMAX M99")
    assert codes(program) == ["E109"] and min(move.end[2] for move in program.moves) > 0.0


@pytest.mark.parametrize("slash", ["/ {}", "/{}", "{} /", "{} / "])
def test_a_slash_stands_before_or_after_the_number_of_a_block(slash):
    """TNC files have `/ 13 STOP`; both are skipped where block delete is on, and read where it is off."""
    text = "10 L X+1 F100\n{} L X+5\n12 L X+2".replace("{}", slash.format(11))
    whole, short = read(text), read(text, block_delete=True)
    assert codes(whole) == codes(short) == []
    assert [m.end[0] for m in whole.moves] == [1.0, 5.0, 2.0] and [m.n for m in whole.moves] == [10, 11, 12]
    assert [m.end[0] for m in short.moves] == [1.0, 2.0]


def test_a_skipped_cycle_keeps_its_values_on_lines_of_their_own():
    """The values of a cycle follow without `~`, whatever stands before its number."""
    text = DRILL.replace("Q206=100", "Q206=150").replace(" Q2", "\n  Q2")
    for head in ("/ 11 ", "/11 ", "11 /", "11 "):
        program = read(head + text.strip() + "\n12 L X+1 FMAX M99")
        assert codes(program) == [] and [m.feed_mm_min for m in program.moves if m.feed_mm_min] == [150.0]
