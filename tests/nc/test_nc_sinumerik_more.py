"""What posts write beside the plain words: machine data, CASE, roundings everywhere, solid angles, fixed points.

Source of the rules: SINUMERIK 840D sl/828D, Programming Manuals Fundamentals (NC), Job Planning and Cycles (public); the
section is named in each test. Motions are worked by hand, mm, work coordinates.
"""

from __future__ import annotations

import math

import pytest

from vmachining.nc import Program, ToolEntry, parse_program

HALF = math.sqrt(0.5)


def read(body: str, head: str = "G17 G90 G710 G40\nT1 M6\nS1000 M3 F200\n", **more) -> Program:
    options = {"tools": {1: ToolEntry(1, 10.0, 0.0)}, **more}
    return parse_program(
        f"{head}{body}\nM30\n".encode(), "t.mpf", dialect="sinumerik", home=(0.0, 0.0, 100.0), **options
    )


def codes(program: Program) -> list[str]:
    return [f.code for f in program.findings if f.code != "I408"]


def rows(program: Program) -> list[tuple]:
    return [(m.motion.value, *(round(v, 4) + 0.0 for v in m.end)) for m in program.moves]


# ---- job planning, "System variables" ----


def test_what_only_the_machine_knows_is_an_error_where_it_is_used():
    assert codes(read("R1=$AC_TIME\nR2=R1*2\nG0 X1")) == []
    program = read("R1=$AC_TIME\nR2=R1*2\nG0 X=R2\nG0 X1")
    assert codes(program) == ["E108"]
    assert "R1 was set to $AC_TIME" in program.findings[-1].message
    assert codes(read("R1=$AC_TIME\nR1=5\nG0 X=R1")) == []
    branch = read("DEF REAL T0=$AN_SETUP_TIME\nIF T0>5 GOTOF ENDE\nG0 X1\nENDE:\nG0 X2")
    assert codes(branch) == ["E108"]
    assert not branch.moves


def test_a_program_is_read_as_it_cuts_and_not_as_a_test():
    assert rows(read("IF $P_ISTEST GOTOF ENDE\nIF $P_SEARCH==1 GOTOF ENDE\nG0 X1\nENDE:")) == [
        ("rapid", 1, 0, 100)
    ]


def test_a_position_is_read_back():
    assert rows(read("G0 X10 Y20\nR1=$P_EP[X] R2=$AA_IW[Y]\nG1 X=R1+1 Y=R2+1"))[-1] == ("linear", 11, 21, 100)


def test_offsets_that_the_program_writes_place_one_against_the_other():
    # G55 lies 50 in X and -10 in Z from G54, the zero of the job
    frames = "$P_UIFR[1]=CTRANS(X,100,Y,0,Z,-200)\n$P_UIFR[2,X,TR]=150\n$P_UIFR[2,Z,TR]=-210\n"
    program = read(frames + "G54 G0 X1 Y1 Z1\nG55 X1 Y1 Z1\nG54 X1 Y1 Z1")
    assert rows(program) == [("rapid", 1, 1, 1), ("rapid", 51, 1, -9), ("rapid", 1, 1, 1)]
    assert codes(program) == []
    moved = read(frames + "G54 G0 X1 Y1 Z1\n$P_UIFR[1,X,TR]=120\nG54 X1 Y1 Z1")
    assert rows(moved)[-1] == ("rapid", 21, 1, 1)


@pytest.mark.parametrize(
    "data",
    ["G54 G0 X1\n$P_UIFR[1,X,TR]=5\nG54 X1", "$P_UIFR[1]=CROT(Z,30)", "$P_PFRAME=CTRANS(X,5)", "$P_BFRAME[X,TR]=1",
     "$MC_GCODE_RESET_VALUES[5]=2", "$P_UIFR[1,Z,RT]=20"],
)  # fmt: skip
def test_frames_that_are_not_read_are_refused(data: str):
    assert codes(read(data)) == ["E208"]


def test_the_radius_that_the_program_gives_is_the_one_of_compensation():
    # left of +X lies +Y
    program = read("$TC_DP6[1,1]=4\nG1 Z0\nG41 G1 X10 Y0\nX30\nG40 X40", tools=None)
    assert ("linear", 10, 4, 0) in rows(program)


# ---- job planning, "Program branch CASE" ----


@pytest.mark.parametrize(("value", "x"), [(1, 10), (2, 20), (7, 30)])
def test_case_goes_to_the_label_of_its_value(value: int, x: int):
    body = (
        f"R1={value}\nCASE(R1) OF 1 GOTOF ONE 2 GOTOF TWO DEFAULT GOTOF REST\nONE: G0 X10\nGOTOF ENDE\nTWO: G0 X20\nGOTOF ENDE\n"
        "REST: G0 X30\nENDE:"
    )
    assert rows(read(body)) == [("rapid", x, 0, 100)]


def test_case_without_a_default_goes_on():
    assert rows(read("R1=9\nCASE(R1) OF 1 GOTOF ONE\nG0 X5\nONE:")) == [("rapid", 5, 0, 100)]


# ---- fundamentals, "Chamfer, rounding (CHF, CHR, RND, RNDM)" ----


def test_modal_roundings_stand_where_cutting_moves_meet():
    # square corner, radius 2: from (8, 0) to (10, 2) about (8, 2); none where the rapid begins, none after RNDM=0
    program = read("G0 X0 Y0 Z0\nRNDM=2\nG1 X10\nG1 Y10\nG0 X0\nG1 Y20 RNDM=0\nX-5")
    assert rows(program) == [
        ("rapid", 0, 0, 0), ("linear", 8, 0, 0), ("arc_ccw", 10, 2, 0), ("linear", 10, 10, 0), ("rapid", 0, 10, 0),
        ("linear", 0, 20, 0), ("linear", -5, 20, 0),
    ]  # fmt: skip
    assert codes(program) == []
    plunge = read("RNDM=2\nG1 X10\nZ-5\nY5")
    assert [row[0] for row in rows(plunge)] == ["linear"] * 3


# ---- cycles, "Swiveling - CYCLE800" ----


def test_a_solid_angle_turns_about_z_and_tilts_about_the_new_y():
    # Rz(90) Ry(90): X' -> -Z, Z' -> +Y
    program = read('CYCLE800(1,"T",0,64,0,0,0,90,90,0,0,0,0,1,)\nG0 X0 Y0 Z5')
    assert program.moves[-1].end == pytest.approx((0, 5, 0), abs=1e-9)
    assert program.moves[-1].axis_end == pytest.approx((0, 1, 0), abs=1e-9)
    assert codes(program) == ["W365"]


def test_direct_angles_are_those_of_the_machine():
    assert codes(read('CYCLE800(1,"T",0,192,0,0,0,0,0,0,0,0,0,1,)\nG0 X1')) == []
    assert codes(read('CYCLE800(1,"T",0,192,0,0,0,30,0,0,0,0,0,1,)\nG0 X1')) == ["E208"]


@pytest.mark.parametrize("block", ["G1 X1=10 Y5", "Y1=3", "G1 ZPOS=30 X1", "G1 X10 RTCP=1"])
def test_an_address_that_is_not_known_beside_a_motion_is_no_variable(block: str):
    """Job planning, "Variables": what is assigned stands in a block of its own; beside a motion a name may be an axis."""
    program = read(f"{block}\nG1 X20")
    assert "E207" in codes(program)
    assert codes(read("SETPOS=5\nG1 X=SETPOS")) == []


# ---- fundamentals, "Reference point approach (G74)", "Fixed point approach (G75)"; machine coordinates ----


def test_fixed_points_are_home_for_the_axes_named():
    program = read("G0 X10 Y10 Z5\nG75 FP=1 Z1=0\nG74 X1=0 Y1=0")
    assert rows(program)[1:] == [("rapid", 10, 10, 100), ("rapid", 0, 0, 100)]
    assert codes(program) == ["W366"]


def test_machine_coordinates_that_only_the_machine_knows_are_home_as_well():
    assert rows(read("G0 X10 Z5\nSUPA Z=$MA_POS_LIMIT_PLUS[Z]-1 D0"))[-1] == ("rapid", 10, 0, 100)
    assert "E108" in codes(read("G0 Z=$MA_POS_LIMIT_PLUS[Z]-1"))


def test_vectors_by_axes_are_said():
    assert codes(read("TRAORI\nORIAXES\nG1 X1 A3=0.6 B3=0 C3=0.8")) == ["W375"]
    assert codes(read("TRAORI\nORIAXES\nORIVECT\nG1 X1 A3=0.6 B3=0 C3=0.8")) == []


def test_iso_mode_is_refused_with_the_dialect_that_reads_it():
    program = read("G291")
    assert codes(program)[0] == "E208"
    assert "fanuc" in program.findings[0].hint


def test_a_code_that_is_written_as_a_power_of_ten_is_a_number_like_others():
    # EX is the exponent of this control: 1EX0 is 1; 3EX30 is not a code of anything
    assert rows(read("G1EX0 X5")) == [("linear", 5, 0, 100)]
    assert codes(read("G3EX30 X5")) == ["E108"]
    assert codes(read("G4EX0 F1")) == []


# ---- what is refused is told once ----


def test_milling_cycles_offsets_and_the_other_language_are_one_finding_each():
    assert codes(
        read(
            "G0 X1\nCYCLE63(35,25,5,0)\nLONGHOLE(10,0,2,15)\nMCALL CYCLE899(10,0,2)\nX1\nMCALL\nSLOT1(1,2)\nCYCLE79(1)"
        )
    ) == ["E208"]
    assert codes(read("G54\nG0 X1\nG55\nX2\nG56\nX3")) == ["W368", "W368"]
    text = "G54 G1 X5 F100\nG55\nG1 X5\nG505\nG1 X5"  # the job gives one of two, both, and G505 as its G58
    places = {"G54": (100, 0, 0), "G55": (120, 0, 0), "G58": (150, 0, 0)}
    for given, said, ends in (
        ("G54", 2, [5, 5, 5]),
        ("G55", 2, [5, 5, 5]),
        ("G54 G55", 1, [5, 25, 5]),
        ("G54 G55 G58", 0, [5, 25, 55]),
    ):
        program = read(text, work_offsets={name: places[name] for name in given.split()})
        assert codes(program).count("W368") == said and [m.end[0] for m in program.moves] == ends
    other = read("G0 X1\nG291\nG81 X5 R2 Z-3\nX9")
    assert codes(other) == ["E208"] and other.errors[0].line == 5 and len(other.moves) == 1


@pytest.mark.parametrize(
    ("text", "feeds"),
    [
        ("G1 X20 F300 RND=2 FRC=50\nY20 F200\nX0", [300, 50, 200, 200]),
        ("G1 X20 F300 CHR=2 FRC=50\nY20 CHF=1\nX0", [300, 50, 300, 300, 300]),
        ("FRCM=60\nG1 X20 F300 RND=2\nY20 F200 RND=1 FRC=40\nX0\n", [300, 60, 200, 40, 200]),
        ("FRCM=60\nG1 X20 F300 RND=2\nFRCM=0\nY20 F200\nX0", [300, 60, 200, 200]),
        ("RNDM=2 FRCM=60\nG1 X20 F300\nY20 F200", [300, 60, 200]),
        ("G95 G1 X20 F0.1 RND=2 FRC=0.02\nY20\nX0", [100, 20, 100, 100]),
    ],
)
def test_roundings_and_chamfers_have_a_feed_of_their_own(text, feeds):
    """Manual of the 840D, RND CHR CHF: FRC is the feed of this corner, FRCM of all until FRCM=0."""
    head = "G17 G90 G71 G94\nT1 D1 S1000 M3\nG0 X0 Y0 Z5\n"
    program = parse_program((head + text + "\nM30\n").encode(), "a.mpf", dialect="sinumerik")
    assert not program.errors
    assert [m.feed_mm_min for m in program.moves if m.feed_mm_min is not None] == pytest.approx(feeds)


def test_words_that_change_feeds_are_a_warning():
    program = read("OVR=50\nG1 X10\nFL[X]=100\nOVR=80\nSPOS=0")
    assert codes(program) == ["W376", "W376"] and [f.line for f in program.findings if f.code == "W376"] == [
        4,
        6,
    ]
    assert program.moves[-1].feed_mm_min == 200.0


# ---- job planning, "Array variables"; fundamentals, "Feed for one block (FB)", "Travel commands with polar coordinates" ----


def test_arrays_have_elements():
    program = read("DEF REAL PT[3],Q\nPT[0]=1 PT[1]=2\nR1=1\nPT[R1+1]=PT[0]+PT[R1]\nG0 X=PT[2] Y=PT[1]")
    assert rows(program) == [("rapid", 3, 2, 100)]
    assert codes(read("DEF REAL PT[3]\nG0 X=PT[2]")) == ["E108"]


def test_a_feed_for_one_block():
    program = read("G1 X10 F100\nX20 FB=300\nX30")
    assert [m.feed_mm_min for m in program.moves] == [100, 300, 100]


def test_an_arc_by_polar_words_runs_about_the_pole():
    """Pole 20 20, radius 10: from 0 to 90 degrees."""
    program = read("G111 X20 Y20\nG1 AP=0 RP=10\nG3 AP=90")
    assert program.moves[-1].end == pytest.approx((20, 30, 100)) and program.moves[-1].center == (20, 20)


def test_variables_of_the_machine_are_noted_and_words_of_the_path_are_not():
    program = read("WEARCHANGED=FALSE\nDRZ=170\nG0 X1")
    assert codes(program) == [] and sum(f.code == "I408" for f in program.findings) == 2
    for word in ("OFFN=2", "POS[X]=5", "LEAD=3", "A4=1"):
        assert codes(read(f"{word}\nG0 X1")) in (["E207"], ["E208"]), word


def test_feed_per_tooth():
    """FZ of G95 counts by the teeth of the tool: 0.1 mm x 4 x 2400/min."""
    text = "G17 G71 G90\nT1 M6\nG{} S2400 FZ=0.1 M3\nG1 X10\nM30"
    four = {1: ToolEntry(1, 10.0, 50.0, flutes=4)}
    program = parse_program(text.format(95).encode(), "p", dialect="sinumerik", tools=four)
    assert not program.errors and program.moves[-1].feed_mm_min == pytest.approx(960.0)
    wrong = parse_program(text.format(94).encode(), "p", dialect="sinumerik", tools=four)
    assert wrong.errors[0].code == "E301" and not wrong.moves
