"""Sinumerik programs: every construct with a smallest program and its motions, worked by hand.

Source of the rules: SINUMERIK 840D sl/828D, Programming Manuals Fundamentals, Job Planning and Cycles (public).
"""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mutants import mutated

from vmachining.nc import Program, ToolEntry, parse_program, read_program

POSTS = Path(__file__).resolve().parents[3] / "shared/data/posts/sinumerik"
HOME = (0.0, 0.0, 100.0)
TOOLS = {1: ToolEntry(1, 10.0, 0.0)}


def read(body: str, **more) -> Program:
    text = f"G17 G90 G710 G40\nT1 M6\nS1000 M3 F200\n{body}\nM30\n"
    return parse_program(text.encode(), "t.mpf", dialect="sinumerik", home=HOME, tools=TOOLS, **more)


def codes(program: Program) -> list[str]:
    return [f.code for f in program.findings if f.code != "I408"]


def path(program: Program) -> list[tuple]:
    kinds = {"rapid": "R", "linear": "L", "arc_cw": "CW", "arc_ccw": "CCW", "dwell": "D"}
    out = []
    for move in program.moves:
        row = (kinds[move.motion], *(round(v, 4) + 0.0 for v in move.end))
        out.append(row if move.center is None else (*row, *(round(v, 4) + 0.0 for v in move.center)))
    return out


def test_coordinates_absolute_incremental_and_computed():
    program = read("R1=5 R2=R1*2\nG0 X10 Y=R1+R2/4\nG1 X=IC(5) Z=AC(-3)\nG91 X1 Y=AC(20)\nG90 X=SIN(30)*R2")
    assert path(program) == [("R", 10, 7.5, 100), ("L", 15, 7.5, -3), ("L", 16, 20, -3), ("L", 5, 20, -3)]
    assert codes(program) == []


def test_units():
    assert path(read("G700 G1 X1 F10"))[-1] == ("L", 25.4, 0, 100)
    assert read("G700 G1 X1 F10").moves[0].feed_mm_min == 254.0
    assert codes(read("G70 G1 X1 F10")) == ["W370"]


def test_arcs_by_centre_radius_angle_and_point():
    program = read(
        "G1 X10 Y0\nG3 X0 Y10 I-10 J0\nG2 X10 Y20 CR=10\nG2 X20 Y10 I=AC(10) J=AC(10)\nG2 X10 Y0 AR=90"
        "\nCIP X0 Y10 I1=AC(10) J1=AC(20)"
    )
    assert path(program)[1:5] == [
        ("CCW", 0, 10, 100, 0, 0), ("CW", 10, 20, 100, 10, 10), ("CW", 20, 10, 100, 10, 10), ("CW", 10, 0, 100, 10, 10),
    ]  # fmt: skip
    assert path(program)[5] == ("CW", 0, 10, 100, 5, 5) or path(program)[5][4:] == (10, 10)


def test_a_helix_with_further_turns_and_a_negative_radius():
    program = read("G1 X10 Y0\nG3 X10 Y0 Z94 I-10 TURN=2\nG2 X0 Y-10 CR=-10")
    assert program.moves[1].turns == 3
    assert path(program)[1] == ("CCW", 10, 0, 94, 0, 0)
    assert path(program)[2][4:] == (10, -10)


def test_roundings_and_chamfers():
    program = read("G1 X0 Y20 RND=5\nX30 CHR=4\nY0 CHF=SQRT(2)*3\nX60")
    assert path(program) == [
        ("L", 0, 15, 100), ("CW", 5, 20, 100, 5, 15), ("L", 26, 20, 100), ("L", 30, 16, 100), ("L", 30, 3, 100),
        ("L", 33, 0, 100), ("L", 60, 0, 100),
    ]  # fmt: skip


def test_polar_words_about_a_pole():
    program = read("G111 X10 Y10\nG1 AP=90 RP=5\nAP=180")
    assert path(program) == [("L", 10, 15, 100), ("L", 5, 10, 100)]


def test_frames_replace_and_add():
    assert path(read("TRANS X10 Y20\nG1 X1 Y2"))[-1] == ("L", 11, 22, 100)
    assert path(read("TRANS X10 Y20\nAROT Z90\nG1 X1 Y2"))[-1] == ("L", 8, 21, 100)
    assert path(read("TRANS X10 Y20\nROT RPL=90\nG1 X1 Y2"))[-1] == ("L", -2, 1, 100)
    assert path(read("TRANS X10\nAMIRROR X0\nG1 X1 Y2"))[-1] == ("L", 9, 2, 100)
    assert path(read("TRANS X10\nASCALE X2 Y2 Z2\nG1 X1 Y2"))[-1] == ("L", 12, 4, 100)
    assert path(read("TRANS X10\nG1 X1\nTRANS\nX1"))[-1] == ("L", 1, 0, 100)


def test_compensation_left_and_right():
    program = read("G0 X0 Y-20\nG41 G1 X0 Y0\nY20\nX30\nG40 X60")
    assert path(program)[1:5] == [
        ("L", -5, 0, 100),
        ("L", -5, 20, 100),
        ("CW", 0, 25, 100, 0, 20),
        ("L", 30, 25, 100),
    ]
    program = read("G451\nG0 X0 Y-20\nG41 G1 X0 Y0\nY20\nX30\nG40 X60")
    assert path(program)[2] == ("L", -5, 25, 100)


def test_jumps_loops_and_variables():
    body = "DEF REAL A=2, B\nDEF INT I\nB=A+1\nG1 X=B\nFOR I=1 TO 3\nY=IC(I)\nENDFOR\nIF B>2\nZ1\nELSE\nZ2\nENDIF\n"
    body += "R1=0\nWHILE R1<2\nR1=R1+1\nX=IC(1)\nENDWHILE\n"
    body += "IF R1==2 GOTOF DONE\nX99\nDONE: Y0\nR3=0\nAGAIN:\nR3=R3+1 X=IC(10)\nIF R3<2 GOTOB AGAIN\n"
    body += "REPEAT\nZ=IC(1)\nR3=R3+1\nUNTIL R3>3"
    program = read(body)
    assert codes(program) == []
    assert path(program) == [
        ("L", 3, 0, 100), ("L", 3, 1, 100), ("L", 3, 3, 100), ("L", 3, 6, 100), ("L", 3, 6, 1), ("L", 4, 6, 1), ("L", 5, 6, 1),
        ("L", 5, 0, 1), ("L", 15, 0, 1), ("L", 25, 0, 1), ("L", 25, 0, 2), ("L", 25, 0, 3),
    ]  # fmt: skip


def test_sections_repeat():
    program = read("G1 X0 Y1\nSTART: X=IC(10)\nY=IC(1)\nENDE: Z=IC(-1)\nREPEAT START ENDE P=2\nREPEATB START")
    assert [m.end for m in program.moves][-1] == (40, 4, 97)
    assert codes(program) == []


def test_archives_and_files_hold_subprograms(tmp_path: Path):
    text = "%_N_MAIN_MPF\nT1 M6\nS1 M3 F100\nL10 P2\nHOLE(7,-2)\nOUTSIDE\nM30\n%_N_L10_SPF\nG91 G1 X5\nG90\nM17\n"
    text += "%_N_HOLE_SPF\nPROC HOLE(REAL P1, REAL P2)\nG1 Y=P1 Z=P2\nRET\n"
    (tmp_path / "OUTSIDE.SPF").write_text("G1 X0\nM17\n")
    main = tmp_path / "main.arc"
    main.write_text(text)
    program = read_program(main, dialect="sinumerik", home=HOME)
    assert codes(program) == []
    assert path(program) == [("L", 5, 0, 100), ("L", 10, 0, 100), ("L", 10, 7, -2), ("L", 0, 7, -2)]


# ---- cycles ----


def drilled(call: str) -> list[tuple[str, float]]:
    program = read(f"G0 X10 Y20 Z50\n{call}")
    assert codes(program) == []
    return [(row[0], row[3]) for row in path(program)[1:]]


def test_cycle_81_82_and_85():
    assert drilled("CYCLE81(20,0,2,-10)") == [("R", 2), ("L", -10), ("R", 2), ("R", 20)]
    assert drilled("CYCLE82(20,0,2,,10,0.5)") == [("R", 2), ("L", -10), ("D", -10), ("R", 2), ("R", 20)]
    assert drilled("CYCLE85(20,0,2,-10,,0,100,300)") == [("R", 2), ("L", -10), ("L", 2), ("R", 20)]


def test_cycle_83_clears_chips_with_shrinking_strokes():
    # first depth -6, then strokes 6 - 2 = 4, then 2 as long as more than 4 are left; the rest in two equal ones
    moves = drilled("CYCLE83(20,0,2,-15,,-6,,2,0,0,1,1)")
    assert [z for kind, z in moves if kind == "L"] == [-6, -10, -12, -13.5, -15]
    assert [z for kind, z in moves if kind == "R"] == pytest.approx(
        [2, 2, -5.4, 2, -9.4, 2, -11.4, 2, -12.9, 2, 20]
    )


def test_cycle_83_breaks_chips():
    assert drilled("CYCLE83(20,0,2,-6,,-3,,0,0,0,1,0)") == [
        ("R", 2),
        ("L", -3),
        ("R", -2),
        ("L", -6),
        ("R", 2),
        ("R", 20),
    ]


def test_cycle_84_feeds_by_pitch():
    program = read("G0 X0 Y0 Z50\nCYCLE84(20,0,2,-10,,0,3,,1.25,0,500,600)")
    assert [m.feed_mm_min for m in program.moves if m.motion == "linear"] == [625.0, 625.0]


def test_a_tap_without_pitch_keeps_its_path_and_a_missing_program_the_rest():
    """The control raises an alarm for both; the way is plain, so it is read, and what is guessed is said."""
    program = read("G0 X0 Y0 Z50\nS500 M3\nCYCLE84(20,0,2,-10,,0,3,,0,0,0,600)\nL54\nG0 X7")
    assert [(f.code, f.line) for f in program.findings if f.code in ("W381", "W383")] == [
        ("W381", 6),
        ("W383", 7),
    ]
    assert [m.feed_mm_min for m in program.moves if m.motion == "linear"] == [500.0, 500.0]
    assert not program.errors and program.moves[-1].end[0] == 7.0
    flat = read("G0 X0 Y0 Z50\nS500 M3 F100\nCYCLE81(20,0,2,0)")
    assert [round(m.end[2], 6) for m in flat.moves] == [50.0, 2.0, 0.0, 2.0, 20.0]


def test_modal_calls_drill_at_every_position_and_on_patterns():
    program = read(
        "G0 Z50\nMCALL CYCLE81(20,0,2,-10)\nX0 Y0\nX10\nHOLES2(50,50,20,0,90,4)\n"
        "HOLES1(0,0,90,5,10,2)\nCYCLE801(0,0,0,5,8,2,2)\nMCALL\nX99"
    )
    assert codes(program) == []
    assert [tuple(round(v, 6) for v in m.end[:2]) for m in program.moves if m.end[2] == -10] == [
        (0, 0), (10, 0), (70, 50), (50, 70), (30, 50), (50, 30), (0, 5), (0, 15), (0, 0), (5, 0), (5, 8), (0, 8),
    ]  # fmt: skip


# ---- planes and five axes ----


def test_cycle800_tilts_axis_by_axis():
    # mode 57: about X by A, then the new Y by B, then the new Z by C
    program = read('CYCLE800(0,"TC1",0,57,10,0,0,0,90,0,0,0,0,1)\nG0 X1 Y2 Z3')
    assert program.moves[-1].end == pytest.approx((10 + 3, 2, -1))
    assert program.moves[-1].axis_end == pytest.approx((1, 0, 0))
    program = read('CYCLE800(0,"TC1",0,57,10,0,0,0,90,0,0,0,0,1)\nCYCLE800()\nG0 X1 Y2 Z3')
    assert program.moves[-1].end == (1, 2, 3)


def test_a_rotated_frame_does_not_tilt_an_upright_tool():
    program = read("ROT Y90\nG0 X1 Y2 Z3")
    assert program.moves[-1].end == pytest.approx((3, 2, -1))
    assert program.moves[-1].axis_end is None


def test_traori_with_rotary_words_and_with_vectors():
    program = read("TRAORI\nG1 X0 Y0 Z10 A30 C0\nX10 A40\nTRAFOOF")
    assert program.moves[-1].tcp and program.moves[-1].rotary_deg == {"a": 40, "c": 0}
    program = read("TRAORI\nG1 X0 Y0 Z10 A3=0 B3=0.6 C3=0.8\nX10 A3=0 B3=0 C3=2")
    assert program.moves[0].axis_end == pytest.approx((0, 0.6, 0.8))
    assert program.moves[1].axis_end == pytest.approx((0, 0, 1))


def test_machine_coordinates_go_home():
    program = read("G0 X10 Y10 Z5\nSUPA G0 Z=600 D0\nG0 X0")
    assert path(program)[1] == ("R", 10, 10, 100)
    assert codes(program) == ["W366"]


@pytest.mark.parametrize(
    ("body", "code"),
    [
        ("CYCLE72(1,2,3)", "E208"),
        ("LONGHOLE(10,0,2,-5)\nSLOT1(10,0,2,-5)", "E208"),
        ("MCALL CYCLE72(1)\nG0 X1\nX2", "E208"),
        ("G1 X=R77", "E108"),
        ("G1 X=UNKNOWN+1", "E108"),
        ("GOTOF NOWHERE", "E412"),
        ("WHILE 1\nR1=1\nENDWHILE", "E413"),
        ("IF 1\nG0 X1", "E411"),
        ("BSPLINE X1 Y1", "E208"),
        ("G1 X1 ?", "E109"),
        ("G2 X1 Y1", "E302"),
        ("@123 R1", "E211"),
        ("G1 Q5 X1", "E207"),
        ("TRANSMIT", "E208"),
    ],
)
def test_what_is_refused_is_named_once(body: str, code: str):
    found = [c for c in codes(read(body, max_steps=3000)) if not c.startswith("W")]
    assert found == [code]


@pytest.mark.skipif(not POSTS.is_dir(), reason="programs of others are not here")
def test_programs_of_others_read():
    files = [
        POSTS / name
        for name in sorted(f.name for f in POSTS.iterdir())
        if name[:4] in ("0030", "0031", "0032")
    ]
    for file in files:
        program = read_program(file, dialect="auto", rotary="ABC")
        assert program.dialect == "sinumerik"
        assert program.errors == ()


SEED = """%_N_T_MPF
G17 G90 G710
T="MILL" M6
S1000 M3 F200
DEF REAL A=1
R1=5 R2=SQRT(R1)
G0 X10 Y=R1+R2
G41 G1 X0 Y0
Y20 RND=2
G2 X10 Y30 CR=10
G40 X60
MCALL CYCLE83(20,0,2,-15,,-6,,2,0,0,1,1)
X1 Y2
HOLES2(0,0,10,0,0,3)
MCALL
FOR R3=1 TO 3
ATRANS X1
ENDFOR
AROT Z30 Y10
CYCLE800(0,"T",0,57,1,2,3,10,20,30,1,1,1,1)
G3 X5 Y5 I=AC(3) J4 TURN=1
TRAORI
G1 X1 A3=0 B3=0.6 C3=0.8
AP=30 RP=R1
IF R1>2 GOTOF ENDE
ENDE: G4 F1
M30
%_N_L10_SPF
M17
"""


@settings(max_examples=300, deadline=None)
@given(seed=st.integers(0, 2**32))
def test_mutated_programs_raise_nothing(seed: int):
    damaged = mutated(SEED, seed, ["9" * 12, "-", "R1", "\n", "(", "=", "ENDIF\n", "X=1"])
    program = parse_program(damaged.encode(), "m.mpf", dialect="sinumerik", max_steps=2000)
    assert all(math.isfinite(v) for move in program.moves for v in move.end)


def test_the_zero_of_g500_is_another_one():
    assert codes(read("G500\nSUPA G0 Z=500\nG54 X1 Y1")) == ["W366"]
    assert codes(read("G54 G0 X1\nG500 X2")) == ["E368"]
    assert codes(read("G500 G0 X1\nG54 X2")) == ["E368"]
