"""Dialect fanuc and its kin. Motions are worked by hand from what the operator manuals say of each code."""

from __future__ import annotations

import math

import pytest

from vmachining.nc import Motion, Program, ToolEntry, parse_program

R, F, CW, CCW, D = Motion.RAPID, Motion.LINEAR, Motion.ARC_CW, Motion.ARC_CCW, Motion.DWELL
TOOLS = {1: ToolEntry(1, 10.0, 50.0), 2: ToolEntry(2, 6.0, 40.0)}


def read(text: str, dialect: str = "fanuc", **options: object) -> Program:
    options = {"home": (0.0, 0.0, 50.0), "tools": TOOLS, "rotary": "ABC", **options}
    return parse_program(text.encode(), "p.nc", dialect=dialect, **options)  # type: ignore[arg-type]


def clean(text: str, dialect: str = "fanuc", **options: object) -> Program:
    program = read(text, dialect, **options)
    assert not program.errors, program.errors
    return program


def ends(program: Program) -> list[tuple[Motion, tuple[float, ...]]]:
    return [(m.motion, tuple(round(v, 6) + 0.0 for v in m.end)) for m in program.moves]


HEAD = "O0001\nG21 G90 G17 G40 G80\nT1 M6\nS1000 M3\n"


def test_what_changes_no_path_is_said_once():
    text = (
        HEAD
        + "G05.1 Q1\nG8 P1\nG61.1\nM31\nM88\nG5 P10000\nG0 X1 H7 E3\nM31\nG05.1 Q0\nG69\nG50\nG50.1\nG15\nG67\nM30"
    )
    program = clean(text)
    assert ends(program) == [(R, (1, 0, 50))]
    notes = [f for f in program.findings if f.code == "I214"]
    assert [f.word for f in notes] == [
        "G05.1",
        "G8",
        "G61.1",
        "M31",
        "M88",
        "G5",
        "H7",
        "E3",
        "G69",
        "G50",
        "G50.1",
        "G15",
        "G67",
    ]


def test_spindle_without_speed_and_no_end():
    program = clean("O1\nG21\nM3\nS0 M3\nG0 X1")
    assert [f.code for f in program.findings] == ["W401"] and len(program.moves) == 1


def test_no_motion_code_at_the_start_and_after_a_cycle():
    """Power on is G00; G80 gives back the code of group 01 that was in force before the cycle."""
    program = clean("O1\nG21 F100\nX1\nG1 Y1\nG81 X2 Z-1 R2\nG80\nX3\nG0 Z5 G80\nX4\nM30")
    assert ends(program) == [
        (R, (1, 0, 50)), (F, (1, 1, 50)),
        (R, (2, 1, 50)), (R, (2, 1, 2)), (F, (2, 1, -1)), (R, (2, 1, 50)),
        (F, (3, 1, 50)), (R, (3, 1, 5)), (R, (4, 1, 5)),
    ]  # fmt: skip


CYCLES = [
    ("G82 X1 Z-2 R3", [(R, 50), (R, 3), (F, -2), (R, 50)]),
    ("G99 G82 X1 Z-2 R3 P500", [(R, 50), (R, 3), (F, -2), (D, -2), (R, 3)]),
    ("G99 G83 X1 Z-2 R3", [(R, 50), (R, 3), (F, -2), (R, 3)]),
    ("G99 G83 X1 Z-2 R3 Q0", [(R, 50), (R, 3), (F, -2), (R, 3)]),
    ("G99 G76 X1 Z-2 R3 Q.2", [(R, 50), (R, 3), (F, -2), (R, 3)]),
    ("G99 G88 X1 Z-2 R3", [(R, 50), (R, 3), (F, -2), (R, 3)]),
    ("G99 G84 X1 Z-2 R3", [(R, 50), (R, 3), (F, -2), (F, 3)]),
    ("M29 S500\nG99 G84 X1 Z-2 R3", [(R, 50), (R, 3), (F, -2), (F, 3)]),
    ("G99 G81 X1 Z-2 R3\nG82 X2", [(R, 50), (R, 3), (F, -2), (R, 3), (R, 3), (F, -2), (R, 3)]),
    ("G91 G99 G81 X1 Z-5 R-47 K2", [(R, 50), (R, 3), (F, -2), (R, 3), (R, 3), (F, -2), (R, 3)]),
]  # fmt: skip


@pytest.mark.parametrize(("cycle", "z"), CYCLES)
def test_cycles(cycle, z):
    moves = clean(HEAD + f"F100\n{cycle}\nG80\nM30").moves
    assert [(m.motion, round(m.end[2], 9)) for m in moves] == z
    assert all(m.dwell_s == 0.5 for m in moves if m.motion is D)


def test_back_boring_goes_in_beside_its_hole():
    """Shift by Q along +X, down to R, back over the hole, feed up to Z, beside it again and out."""
    moves = clean(HEAD + "F100\nG87 X5 Z-4 R-9 Q.5\nG80\nM30").moves
    assert [(m.motion, m.end[0], m.end[2]) for m in moves] == [
        (R, 5, 50), (R, 5.5, 50), (R, 5.5, -9), (R, 5, -9), (F, 5, -4), (R, 5.5, -4), (R, 5.5, 50), (R, 5, 50),
    ]  # fmt: skip


def test_a_rotary_axis_turns_on_the_way_to_its_hole():
    moves = clean(HEAD + "F100\nG99 G81 X1 B90. Z-1 R2\nX2 B180.\nG80\nM30").moves
    assert [(m.motion, m.end[0], m.end[2], (m.rotary_deg or {}).get("b")) for m in moves if m.motion is F] == [
        (F, 1, -1, 90), (F, 2, -1, 180),
    ]  # fmt: skip
    assert [m for m in moves if m.rotary_start != m.rotary_deg and m.motion is F] == []


def test_dwells_count_milliseconds_without_a_point():
    moves = clean("O1\nG21\nG4 P500\nG4 X1.5\nG4 P2.\nG0 X1\nM30").moves
    assert [m.dwell_s for m in moves if m.motion is D] == [0.5, 1.5, 2.0]


def test_polar_coordinates():
    moves = clean(HEAD + "G16\nG0 X10 Y30\nY90\nG15\nG0 X1 Y2\nM30").moves
    c, s = 10 * math.cos(math.radians(30)), 10 * math.sin(math.radians(30))
    assert [m.end[:2] for m in moves] == [pytest.approx((c, s)), pytest.approx((0, 10)), (1, 2)]


def test_rotation_about_a_point():
    """G68 about (10, 0) by 90 degrees: (20, 0) is seen at (10, 10)."""
    moves = clean(HEAD + "G68 X10 Y0 R90.\nG0 X20 Y0\nG69\nG0 X20 Y0\nM30").moves
    assert moves[0].end == pytest.approx((10, 10, 50)) and moves[1].end == pytest.approx((20, 0, 50))


def test_extended_offsets_and_machine_moves():
    program = clean("O1\nG21 G90\nG54.1 P3\nG0 X1\nG53 Z0\nX2\nG1 X3 F9\nG53 G0 Z0\nG53\nM30")
    assert [(m.motion, m.end[0]) for m in program.moves] == [(R, 1), (R, 1), (R, 2), (F, 3), (R, 3)]


def test_length_and_radius_registers():
    text = HEAD + "G43 H21 Z10\nG41 D31 G1 X0 Y10 F100\nX20\nG40 Y30\nG49\nM30"
    program = clean(text)
    assert [f.word for f in program.findings if f.code == "I214"] == ["H21", "D31"]
    assert program.moves[2].end[1] == 15.0  # left of the way along +X by the radius of tool 1
    own = clean(HEAD + "G10 L12 P31 R3\nG41 D31 G1 X0 Y10 F100\nX20\nG40 Y30\nM30")
    assert own.moves[1].end[1] == 13.0
    none = clean(HEAD + "G41 D0 G1 X0 Y10 F100\nX20\nG40 Y30\nM30")
    assert none.moves[1].end[1] == 10.0


def test_comments_names_and_headers():
    long = "x" * 300
    text = (
        "=" * 40 + "\nInformation listing created by :  me\n" + "=" * 40 + "\n%\nOPART-7 (A (B) C)\n"
        f"N0010 G21 (a (nested) one)\n({long})\n:0070 G0 X1 (open\n/2 G0 Y1\nN5 /G0 X3\nDPRNT[X#1[53]]\nM30\n%\n"
    )
    assert ends(clean(text, "fanuc")) == [(R, (1, 0, 50)), (R, (1, 1, 50)), (R, (3, 1, 50))]


def test_a_refused_block_is_one_finding():
    text = HEAD + "G0 X0 Y0 Z0\nG1 F100\nG2 X10 Y3 I5 J9\nX20 Y0 I5 J0\nG12.1\nG1 X1\nG12.1\nM30"
    errors = read(text).errors
    assert [(f.code, f.line) for f in errors] == [("E304", 7), ("E208", 9)]
    assert "1 more lines" in errors[1].message


def test_a_program_for_turning_is_one_finding():
    text = b"O1\nG50 S1800\nG96 S200 M3\nG0 X20 Z2\nU2 W1\nG32 Z-5 F1\nM30"
    errors = parse_program(text, "p", dialect="fanuc", control={"lathe": "mill"}).errors
    assert len(errors) == 1 and "turning" in errors[0].message


@pytest.mark.parametrize(
    ("text", "dialect"),
    [
        ("%\nO1234 (PART)\nG0 X1\nM30\n%", "fanuc"), (":0097\nG0 X1\nM30", "fanuc"), ("G187 P1\nG0 X1\nM30", "haas"),
        ("(MAZAK VTC)\nO1\nG0 X1\nM30", "mazak"), ("$A.MIN%\nG15 H1\nG0 X1\nM2", "okuma"),
        ("o<a> sub\nG0 X1\no<a> endsub\no<a> call\nM2", "iso"), ("G21\nG0 X1\nM2", "iso"),
        ("G21\nS0 M3\nM31\nG0 X1\nM30", "fanuc"),
    ],
)  # fmt: skip
def test_the_dialect_is_recognised(text, dialect):
    program = parse_program(text.encode(), "p", dialect="auto")
    assert program.dialect == dialect
    assert ("I212" in {f.code for f in program.findings}) == (dialect != "iso")


@pytest.mark.parametrize(
    ("text", "x", "code"),
    [
        ("(ALL UNITS IN INCH)\nG0 X1\nM2", 25.4, "I213"), ("(METRIC)\nG0 X1\nM2", 1.0, "I213"),
        ("G1 F10\nX1.1234\nX2.1234\nX1.5432\nX1.1111\nX1.2345\nX1\nM2", 25.4, "I213"),
        ("G1 F1000\nX100.123\nX90.123\nX70.1\nX50.2\nX20.3\nX1\nM2", 1.0, "I213"),
        ("G0 X1\nM2", 1.0, "W213"), ("(T1 1/2 END MILL)\nG0 X1\nM2", 25.4, "I213"), ("(OP 1/2)\nG0 X1\nM2", 1.0, "W213"),
        ("G81 Z-.5 R.1 F10. L0\nG70 I1.5 J15. L6\nX1.\nM2", 25.4, "I213"),  # holes on a circle, Haas
    ],
)  # fmt: skip
def test_the_unit_is_inferred_and_said(text, x, code):
    program = parse_program(text.encode(), "p", dialect="auto")
    assert program.moves[-1].end[0] == pytest.approx(x) and code in {f.code for f in program.findings}
    said = parse_program(text.encode(), "p", dialect="auto", units="mm")
    assert said.moves[-1].end[0] == 1.0 and not {"I213", "W213"} & {f.code for f in said.findings}


def places(text: str, dialect: str = "fanuc") -> list[tuple[float, float]]:
    return [(round(m.end[0], 6) + 0.0, round(m.end[1], 6) + 0.0) for m in clean(text, dialect).moves]


MACROS = [
    # GOTO backwards, IF
    ("O1\nG21\n#1=0\nN5 #1=#1+1\nG0 X#1\nIF [#1 LT 3] GOTO 5\nM30", [(1, 0), (2, 0), (3, 0)]),
    # brackets are optional in the target, THEN takes an assignment
    ("O1\nG21\n#1=1\nIF [#1 EQ 1] THEN #1=7\nIF[#1NE7]GOTO9\nG0 X#1\nN9 M30", [(7, 0)]),
    ("O1\nG21\n#1=1\nWHILE [#1 LE 2] DO 1\n#2=1\nWHILE [#2 LE 2] DO 2\nG0 X#1 Y#2\n#2=#2+1\nEND 2\n#1=#1+1\nEND1\nM30",
     [(1, 1), (1, 2), (2, 1), (2, 2)]),
    ("O1\nG21\n#1=5\nWHILE [#1 LE 2] DO 1\nG0 X9\nEND1\nG0 X1\nM30", [(1, 0)]),
    # a word whose variable was never set is left out
    ("O1\nG21\nG0 X#5 Y2\nIF [#5 EQ #0] THEN #6=3\nG0 X#6\nM30", [(0, 2), (3, 2)]),
    # subprograms: repetitions by L, in front of the number, and at the end of a block
    ("O1\nG21 G91\nG0 X1 M98 P100 L2\nM30\nO100\nY1\nM99", [(1, 0), (1, 1), (1, 2)]),
    ("O1\nG21 G91 G0 X1\nM98 P0030100\nM30\nO0100\nY1\nM99", [(1, 0), (1, 1), (1, 2), (1, 3)]),
    ("O1\nG21\nM97 P50 L2\nX9\nM30\nN50 G91 X1\nG90\nM99", [(1, 0), (2, 0), (9, 0)]),
    ("O1\nG21\nM98 P100\nX1\nN7 X2\nM30\nO100\nX5\nM99 P7", [(5, 0), (2, 0)]),
    # a macro: A is #1, B #2, X #24; the caller's #1 stays what it is
    ("O1\nG21\n#1=8\nG65 P200 A2. B3. X4.\nG0 X#1\nM30\nO200\nG0 X[#24+#1] Y#2\nM99", [(6, 3), (8, 3)]),
    ("O1\nG21\nG0 X3\n#1=#5041\nG0 Y#1\nM30", [(3, 0), (3, 3)]),
]  # fmt: skip


@pytest.mark.parametrize(("text", "wanted"), MACROS)
def test_macros_and_subprograms(text, wanted):
    assert places(text) == wanted
    assert not [f for f in read(text).findings if f.code == "W404"]


def test_a_circle_of_holes_by_a_macro():
    """Six holes on a circle of radius 10 about (5, 5), the first at 30 degrees."""
    text = (
        "O1\nG21 G90 F100\nM3 S100\nG0 Z9\nG65 P9100 X5. Y5. I10. A30. B60. H6. R1. Z-2.\nM30\n"
        "O9100\n#100=0\nWHILE [#100 LT #11] DO 1\n#101=#1+#100*#2\n"
        "G99 G81 X[#24+#4*COS[#101]] Y[#25+#4*SIN[#101]] Z#26 R#18\n#100=#100+1\nEND 1\nG80\nM99\n"
    )
    holes = [m.end for m in clean(text).moves if m.motion is F]
    wanted = [
        (5 + 10 * math.cos(math.radians(30 + 60 * k)), 5 + 10 * math.sin(math.radians(30 + 60 * k)), -2)
        for k in range(6)
    ]
    assert len(holes) == 6 and all(a == pytest.approx(b) for a, b in zip(holes, wanted, strict=True))


@pytest.mark.parametrize(
    ("text", "code", "line"),
    [
        ("O1\nG21\nGOTO 5\nG0 X1\nM30", "E108", 3), ("O1\nM97 P7\nG0 X1\nM30", "E108", 2),
        ("O1\nN1 G0 X1\nGOTO 1\nM30", "E413", 2), ("O1\n#3000=1 (TOO LONG)\nG0 X1\nM30", "E108", 2),
        ("O1\nG0 X#5401\nM30", "E108", 2), ("O1\nG0 X1\nG66\nM30", "E412", 3),
        ("O1\nM98 P1\nG0 X1\nM30", "E414", 2), ("O1\nWHILE [1 EQ 0] DO 1\nG0 X1\nM30", "E108", 2),
    ],
)  # fmt: skip
def test_macros_that_cannot_be_honoured(text, code, line):
    found = read(text, max_steps=500).errors
    assert (code, line) in {(f.code, f.line) for f in found}, found


def test_arcs_of_g18_under_a_turned_work_offset_lean():
    """Half a circle of radius 1 in ZX, the work offset turned by 90 degrees: in YZ, from the origin to y = 2."""
    text = "G21\nG10 L2 P1 R90\nG0 X0 Y0 Z0\nM3 S1\nG18 F1\nG2 X2 I1\nM2"
    moves = parse_program(text.encode(), "p", home=(0.0, 0.0, 0.0)).moves[1:]
    assert moves[-1].end == pytest.approx((0, 2, 0), abs=1e-12)
    assert [(m.plane, m.center) for m in moves] == [("yz", pytest.approx((1, 0)))]


def test_cutter_compensation_without_a_tool_table_is_said_and_goes_along_the_contour():
    program = clean(HEAD + "G41 D1 G1 X0 Y10 F100\nX20\nG40 Y30\nM30", tools=None)
    assert program.moves[1].end[1] == 10.0 and "W351" in {f.code for f in program.findings}
    wear = clean(HEAD + "G41 D1 G1 X0 Y10 F100\nX20\nG40 Y30\nM30", control={"compensation": "wear"})
    assert wear.moves[1].end[1] == 10.0


CENTRES = [
    # quarter of a circle about (0, 0) from (10, 0) to (0, 10): I from the start -10, absolute 0, reversed 10
    ("G3 X0 Y10 I-10. J0", "start"), ("G3 X0 Y10 I0 J0", "absolute"), ("G3 X0 Y10 I10. J0", "reversed"),
]  # fmt: skip


@pytest.mark.parametrize(("arc", "how"), CENTRES)
def test_centres_of_arcs_are_taken_as_they_close(arc, how):
    program = clean(HEAD + f"G0 X10. Y0\nG1 F100\n{arc}\nM30")
    assert program.moves[-1].center == pytest.approx((0, 0))
    assert any("as Fanuc counts" in f.message for f in program.findings) == (how != "start")
    said = clean(HEAD + f"G0 X10. Y0\nG1 F100\n{arc}\nM30", control={"arc_centres": how})
    assert said.moves[-1].center == pytest.approx((0, 0)) and not said.errors


def test_one_wrong_arc_is_no_other_way_to_count():
    text = HEAD + "G0 X10. Y0\nG1 F100\nG3 X0 Y10 I-10. J0\nG3 X-10. Y0 I9. J-10.\nM30"
    assert [(f.code, f.line) for f in read(text).errors] == [("E304", 8)]


def test_corners_between_two_lines():
    """(0,0) to (20,0) to (20,20): a rounding of 5 from (15,0) to (20,5) about (15,5); a chamfer joins the same points."""
    text = HEAD + "G0 X0 Y0 Z0\nG1 F100 X20.,{}\nY20.\nM30"
    rounded = clean(text.format("R5.")).moves[1:]
    assert [m.end for m in rounded] == [pytest.approx(p) for p in ((15, 0, 0), (20, 5, 0), (20, 20, 0))]
    assert rounded[1].motion is CCW and rounded[1].center == pytest.approx((15, 5))
    bevelled = clean(text.format("C5.")).moves[1:]
    assert [m.end for m in bevelled] == [pytest.approx(p) for p in ((15, 0, 0), (20, 5, 0), (20, 20, 0))]
    assert bevelled[1].motion is F
    assert [f.code for f in read(HEAD + "G1 F100 X20.,R5.\nG0 Y20.\nM30").errors][:1] == ["E109"]


def test_mirror_and_scale():
    """Mirrored at x = 5, an arc turns round; scaled by 2 about the origin, 3 is at 6. G51 P2000: thousandths."""
    moves = clean(
        HEAD + "G0 X10. Y0 Z0\nG51.1 X5.\nG1 F100 X0 Y0\nG3 X10. Y10. I0 J10.\nG50.1\nG0 X1. Y1.\nM30"
    ).moves
    assert moves[1].end == pytest.approx((10, 0, 0)) and moves[2].end == pytest.approx((0, 10, 0))
    assert (
        moves[2].motion is CW
        and moves[2].center == pytest.approx((10, 10))
        and moves[3].end == pytest.approx((1, 1, 0))
    )
    scaled = clean(HEAD + "G51 X0 Y0 Z0 P2000\nG0 X3. Y4. Z5.\nG50\nX3.\nM30").moves
    assert scaled[0].end == pytest.approx((6, 8, 10)) and scaled[1].end == pytest.approx((3, 8, 10))


def test_tilted_plane():
    """Euler angles 0, 90, 0 about (10, 20, 30): the plane's z is -y of the part (Rx 90: y to z, z to -y)."""
    text = HEAD + "G68.2 X10. Y20. Z30. I0 J90. K0\nG53.1\nG0 X1. Y2. Z3.\nG1 F100 Z-1.\nG69\nM30"
    program = clean(text)
    cut = program.moves[-1]
    assert program.moves[-2].end == pytest.approx((11, 17, 32)) and cut.end == pytest.approx((11, 21, 32))
    assert cut.axis_end == pytest.approx((0, -1, 0)) and "W365" in {f.code for f in program.findings}


OKUMA = [
    ("G15 H2\nG0 X1", [(1, 0)]), ("G56 H1 Z5.\nG0 X1", [(0, 0), (1, 0)]),
    ("G11 X5. Y0 P90.\nG0 X1. Y0\nG10\nG0 X1.", [(5, 1), (1, 1)]),
    ("VC1=3\nIF [VC1 EQ 3] NEND\nG0 X9\nNEND G0 X=VC1+1", [(4, 0)]), ("WIDE=7\nG0 X=WIDE", [(7, 0)]),
]  # fmt: skip


@pytest.mark.parametrize(("text", "wanted"), OKUMA)
def test_okuma(text, wanted):
    assert places(f"O1\nG21 G90\n{text}\nM2", "okuma") == wanted


def test_reference_and_back():
    """G28 through z = 10 to the reference point (z = 50), G29 through z = 10 again to z = 5."""
    moves = clean(HEAD + "G0 Z20.\nG28 Z10.\nG29 Z5.\nM30").moves
    assert [m.end[2] for m in moves] == [20, 10, 50, 10, 5]


def test_a_stored_cycle_drills_from_the_next_hole_on():
    moves = clean(HEAD + "G0 X0 Y0 Z9.\nG99 G81 Z-1. R2. F100 K0\nX3.\nG80\nM30").moves
    assert [(m.motion, m.end[0], m.end[2]) for m in moves[1:]] == [
        (R, 3, 9),
        (R, 3, 2),
        (F, 3, -1),
        (R, 3, 2),
    ]


def test_w_beside_a_text_that_is_no_word():
    """Found by random texts: a line whose Z is dropped elsewhere once ended the reading."""
    read("G68.2 X1 Y2 Z3 I10. J20. K30.\nG0 W1.\nG0 Z2.", control={"w": "z"})
    moves = clean(HEAD + "G0 Z10.\nW5.\nZ20.\nM30", control={"w": "z"}).moves
    assert [m.end[2] for m in moves] == [10, 15, 25]
