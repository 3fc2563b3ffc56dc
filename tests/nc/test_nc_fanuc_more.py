"""Calls, variables, patterns and planes of the Fanuc family. Motions are worked by hand from the manuals of the controls."""

from __future__ import annotations

import itertools

import pytest

from vmachining.nc import Motion, Program, ToolEntry, parse_program

R, F, CW, CCW, D = Motion.RAPID, Motion.LINEAR, Motion.ARC_CW, Motion.ARC_CCW, Motion.DWELL
TOOLS = {1: ToolEntry(1, 10.0, 50.0), 2: ToolEntry(2, 6.0, 40.0)}
HEAD = "O1\nG21 G90 G17 G54\nG0 X0 Y0 Z5. S900 M3\nF100\n"  # F has the fourth line, the body begins with the fifth


def read(body: str, dialect: str = "fanuc", **options: object) -> Program:
    options = {"home": (0.0, 0.0, 50.0), "tools": TOOLS, "rotary": "ABC", **options}
    return parse_program((HEAD + body + "\nM30\n").encode(), "p.nc", dialect=dialect, **options)  # type: ignore[arg-type]


def ends(body: str, dialect: str = "fanuc", **options: object) -> list[tuple[Motion, tuple[float, ...]]]:
    """What the body moves."""
    program = read(body, dialect, **options)
    assert not program.errors, program.errors
    return [(m.motion, tuple(round(v, 6) + 0.0 for v in m.end)) for m in program.moves[1:]]


def refused(body: str, dialect: str = "fanuc", **options: object) -> list[tuple[str, int]]:
    return [(f.code, f.line) for f in read(body, dialect, **options).errors]


def test_programs_in_files_beside_are_called_by_number(tmp_path):
    """Operator's manual 0i, subprogram (M98, M198): an O number is looked for in the memory, here in the folders."""
    (tmp_path / "O0002.NC").write_text("%\nO0002(STEP)\nG91 G1 X1.\nG90\nM99\n%\n")
    (tmp_path / "3.txt").write_text("G1 Y#1\nM98 P2\nM99\n")
    got = ends("M98 P2 L2\nM98 P20002\nM198 P2\nG65 P3 A7.", subroutines=[tmp_path])
    assert got == [(F, (k, 0, 5)) for k in range(1, 6)] + [(F, (5, 7, 5)), (F, (6, 7, 5))]
    program = read("G0 X1.\nM98 P2", subroutines=[tmp_path])
    assert program.moves[-1].line == 6 and [file[-8:] for file in program.files] == ["O0002.NC"]
    lost = read("M98 P9\nG1 X3. F9")
    assert [(f.code, f.line) for f in lost.findings if f.code == "W383"] == [("W383", 5)] and not lost.errors
    kinds = [("M98 P9001", "W383"), ("M98 P8001", "W383"), ("G65 P8001", "W383"), ("G65 P9001", "W382")]
    for call, code in kinds:
        assert [f.code for f in read(call).findings if f.code in ("W382", "W383")] == [code]
    assert "O9.nc" in next(f.hint for f in lost.findings if f.code == "W383") and lost.moves[-1].end[0] == 3.0


def test_a_modal_macro_comes_after_every_block_that_moves(tmp_path):
    """Manual, modal call (G66): after each block with a move, not in the block of G66, until G67; G66.1 every block."""
    (tmp_path / "O8.nc").write_text("G1 Z-#1\nG0 Z#18\nM99\n")
    hole = [(F, -2.0), (R, 5.0)]
    got = ends("G66 P8 A2. R5.\nX1.\nM8\nX2. Y1.\nG67\nX3.", subroutines=[tmp_path])
    assert [(kind, p[2]) for kind, p in got] == [(R, 5.0), *hole, (R, 5.0), *hole, (R, 5.0)]
    assert [p[0] for _, p in got] == [1, 1, 1, 2, 2, 2, 3]
    (tmp_path / "O7.nc").write_text("G0 Z[#5003+1]\nM99\n")
    assert ends("G66.1 P7\nM8\nX1.\nG67", subroutines=[tmp_path])[-1] == (R, (1, 0, 7))


def test_arguments_of_both_types():
    """Manual, argument specification: I J K alone are #4 #5 #6; coming again or in another order they count on."""
    body = "G65 P2 {}\nM30\nO2\nG1 X#4 Y#7 Z#8\nM99"
    assert ends(body.format("I1. J2. K3.")) == [(F, (1, 0, 5))]
    assert ends(body.format("I1. J2. I3. J4.")) == [(F, (1, 3, 4))]
    assert ends("G65 P2 K1. I2.\nM30\nO2\nG1 X#6 Y#7\nM99") == [(F, (1, 2, 5))]
    assert ends("#31=4.\nG65 P2 A1.\nG1 X#31\nM30\nO2\n#31=9.\nM99") == [(F, (4, 0, 5))]


def test_variables_of_the_control():
    """Manual, system variables: offsets are read and set, modes and table read, the state of a machine is refused."""
    assert ends("#5221=10.\n#5222=[#5221+1]\nG0 X0 Y0") == [(R, (10, 11, 5))]
    assert ends("#7021=3.\nG54.1 P2\nG0 X0 Y#7021") == [(R, (3, 3, 5))]
    assert ends("G20\n#5241=1.\nG55 X0") == [(R, (25.4, 0, 5))]
    assert ends("#3006=1 (LOOK)\n#1100=1\nG18\nG1 X#4002 Y[#4014+#4003] Z#4010\nG17") == [(F, (18, 144, 98))]
    assert ends("G0 X#13001 Y#11002") == [(R, (5, 40, 5))]
    for number in (1000, 2001, 3011, 5405, 13009):
        assert refused(f"G0 X#{number}") == [("E108", 5)]
    assert refused("#2001=1.") == [("E108", 5)]


@pytest.mark.parametrize(
    "plane",
    [
        "G68.2 X10. Y0 Z0 I0 J45. K0",
        "G68.2 P2 Q1 X10. Y0 Z0\nG68.2 P2 Q2 X12. Y0 Z0\nG68.2 P2 Q3 X10. Y3. Z3.",
        "G68.2 P2 Q0 X0 Y0 Z0 R0\nG68.2 P2 Q1 X10.\nG68.2 P2 Q2 X12.\nG68.2 P2 Q3 X10. Y3. Z3.",
        "G68.2 P3 Q1 X10. Y0 Z0 I1. J0 K0\nG68.2 P3 Q2 I0 J-1. K1.",
        "G68 X10. Y0 Z0 I1. J0 K0 R45.",
    ],
)
def test_a_tilted_plane_in_all_its_spellings(plane):
    """Manual, tilted working plane and 3D coordinate conversion: +X along X, +Y and +Z turned by 45 degrees about it."""
    h = 2**-0.5
    at = (10 + 1, round(2 * h - 3 * h, 6), round(2 * h + 3 * h, 6))
    assert ends(plane + "\nG0 X1. Y2. Z3.\nG69\nX0 Y0 Z5.") == [(R, at), (R, (0, 0, 5))]


def test_a_turn_in_a_turn_and_planes_that_are_none():
    """A second G68 turns the coordinates of the first: X by 90 degrees about Z, then about the new Y."""
    body = "G68 X0 Y0 Z0 I0 J0 K1. R90.\nG68 X0 Y0 Z0 I0 J1. K0 R90.\nG0 X1. Y2. Z3.\nG69"
    assert ends(body) == [(R, (-2, 3, -1))]  # (x, y, z) -> (z, y, -x) -> (-y, z, -x)
    for body in (
        "G68.2 P2 Q3 X1.",
        "G68.2 P3 Q1 I1.\nG68.2 P3 Q2 I1. K0.1",
        "G68.2 P4 I1.",
        "G68 I0 R3.",
        "G68.3",
        "G68.4",
    ):
        assert {code for code, _ in refused(body)} == {"E208"}, body


def test_pecks_of_a_haas_shrink_and_its_k_repeats_nothing():
    """Haas manual, G83: I first peck, each J less, down to K."""
    got = ends("G99 G83 X0 Z-10. R2. I4. J1. K2.\nG80", "haas")
    assert [p[2] for kind, p in got if kind is F] == [-2, -5, -7, -9, -10]
    again = ends("G99 G83 X0 Z-10. R2. Q6. K3.\nG80", "haas")
    assert [p[2] for kind, p in again if kind is F] == [-4, -10]


HOLES = [
    ("G81 Z-1. R2. L0\nG70 I10. J90. L4", [(0, 10), (-10, 0), (0, -10), (10, 0)]),
    ("G81 G70 X5. Y5. I10. J0 L2 Z-1. R2.", [(15, 5), (-5, 5)]),
    ("G81 Z-1. R2. L0\nG71 I10. J90. K-90. L3", [(0, 10), (10, 0), (0, -10)]),
    ("G81 Z-1. R2. L0\nG72 X1. I5. J90. L3", [(1, 0), (1, 5), (1, 10)]),
    ("G91 G81 Z-3. R-3. L0\nG72 I5. J0 L3", [(0, 0), (5, 0), (10, 0)]),
]


@pytest.mark.parametrize(("body", "holes"), HOLES)
def test_patterns_of_holes_of_a_haas(body, holes):
    """Haas manual, G70 to G72: angles from 3 o'clock, counter-clockwise; the middle is not a hole."""
    got = ends(body + "\nG80", "haas")
    assert [p for kind, p in got if kind is F] == [(*hole, -1) for hole in holes]


def test_pockets_of_a_haas():
    """Haas manual, G12 and G13: full circles of I, I + Q, ... K less the radius of the tool, begun and ended in the middle."""
    program = read("T1 M6\nG0 X20. Y10. Z5.\nG13 D1 I7. K12. Q2. Z-1. F200.\nG0 Z9.", "haas")
    assert not program.errors
    moves = [m for m in program.moves if m.line == 7]
    assert moves[0].motion is F and moves[0].end == (20, 10, -1) and moves[-1].end == (20, 10, -1)
    arcs = moves[1:]
    assert {m.motion for m in arcs} == {CCW} and {m.feed_mm_min for m in moves} == {200}
    full = [abs(m.end[0] - 20) for m in arcs if m.start == m.end]
    assert full == [2, 4, 6, 7] and all(m.center == (20, 10) for m in arcs if m.start == m.end)
    for before, after in itertools.pairwise(arcs):
        assert before.end == after.start
    assert all(abs(m.center[0] - m.start[0]) == abs(m.center[0] - m.end[0]) for m in arcs)
    one = read("G91 G12 D0 I3. Z-1. L2\nG90 G0 Z9.", "haas")
    assert [m.end[2] for m in one.moves if m.motion is F] == [4, 3] and {m.motion for m in one.moves} == {
        R,
        F,
        CW,
    }
    assert (
        refused("G12 D7 I3. Z-1.", "haas") == [("E208", 5)] == refused("G12 D1 I3. Z-1.", "haas", tools=None)
    )


def test_offsets_and_mirrors_of_a_haas():
    assert ends("G10 L20 P2 X7.\nG111 G0 X1.\nG54", "haas") == [(R, (8, 0, 5))]
    assert ends("G101 X0\nG1 X3. Y2.\nG100\nX1.", "haas") == [(F, (-3, 2, 5)), (F, (1, 2, 5))]


NAMED = [
    ("G7.1 C10.", "cylindrical"), ("G107 A5.", "cylindrical"), ("G12.1", "polar coordinate"), ("G6.2 P4 K0 X1.", "NURBS"),
    ("G54.2 P1", "turn with the table"), ("G41.2 D1 X1.", "in space"), ("G31 Z1. F9.", "probing"), ("G150 P1 Z1.", "pocket"),
    ("G47 P0 X1.", "engraving"), ("G12 I3.", "haas dialect only"), ("G2.2 X1. I1.", "involutes"),
]  # fmt: skip


@pytest.mark.parametrize(("body", "why"), NAMED)
def test_what_is_not_honoured_is_refused_by_name(body, why):
    errors = read(body).errors
    assert [f.line for f in errors] == [5] and why in errors[0].message


def test_cancellations_and_smoothing_with_axes_change_no_path():
    assert ends("G5.1 Q2 X0 Y0 Z0\nG7.1 C0\nG13.1\nG54.2 P0\nG332 R3\nG103 P1\nG5.1 Q0\nG0 X1.") == [
        (R, (1, 0, 5))
    ]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("O1\nG90\nG1 X1. Y2. U.5 V.5\nG41 X3.\nM30", "wire erosion"),
        ("O1\nG0 X0 S9 M3 O0.0 H01\nG1 W2.\nM30", "O words are tool offsets"),
        ("O1\nG21\n{FOR I = 1 TO 5}\nG0 X1.\n{END}\nM30", "template"),
        (
            "O1\nG0 X1 X2\nG89G81G2Z-1\nP123.22.5 K\nX1,5\nG999 M10001\nN2 N3\n@ U1 V1\n'a'\nM30",
            "control that is not read",
        ),
    ],
)
def test_programs_of_other_machines_are_named_by_one_finding(text, why):
    program = parse_program(text.encode(), "p", dialect="auto", rotary="ABC")
    assert len(program.errors) == 1 and why in program.errors[0].message, program.errors


def test_the_first_registers_of_an_okuma_are_those_of_its_tool():
    """OSP manual: HA and DA name the first length and radius of the tool in the spindle."""
    text = "O1\nG21 G15 H1\nT1 M6\nS9 M3\nG56 Z5. HA\nG0 X0 Y0\nG41 DA G1 X20. F9.\nY20.\nG40 X30.\nM2"
    program = parse_program(text.encode(), "p", dialect="okuma", tools=TOOLS, home=(0.0, 0.0, 50.0))
    assert (
        not program.errors
        and program.moves[0].end == (0, 0, 5)
        and program.moves[-2].end[0] == pytest.approx(15)
    )


def test_a_tool_change_by_g100_goes_down_last():
    """Brother, G100: the tool is changed, X and Y are gone to, then Z; alone it only changes the tool."""
    program = read("G100 T2 X10. Y5. G43 Z8. H2 S1000 M3\nG1 Z-1.\nG100 T1\nG0 X0", tools=None)
    assert not program.errors
    assert [(m.motion, m.end, m.tool) for m in program.moves[1:]] == [
        (R, (10, 5, 5), 2), (R, (10, 5, 8), 2), (F, (10, 5, -1), 2), (R, (0, 5, -1), 1),
    ]  # fmt: skip


def test_two_tools_beside_a_change():
    """Mazak: T1 T2 M6 loads the first and makes the second ready."""
    program = read("T1 T2 M6\nG0 X1.\nM6\nX2.")
    assert not program.errors and [m.tool for m in program.moves[1:]] == [1, 2]


@pytest.mark.parametrize(("comment", "y"), [("WEAR COMP", 0.0), ("CONTROL COMP", 5.0)])
def test_a_header_of_mastercam_says_what_d_holds(comment, y):
    """The path of the centre where D holds wear (zero here); else it lies the radius of the tool (5 mm) to the left."""
    program = read(
        f"( T1 | 10. FLAT ENDMILL | H1 | D1 | {comment} | TOOL DIA. - 10. )\nT1 M6\nS9 M3\nG41 D1 G1 X10.\nX30.\nG40 X60."
    )
    assert not program.errors and program.moves[-2].end == pytest.approx((30, y, 5))
    assert any("WEAR COMP" in f.message for f in program.findings) == (y == 0.0)


@pytest.mark.parametrize(
    ("body", "moved"),
    [
        ("G1 X10. R2.\nY5.\nX0", [(F, (8, 0, 5)), (CCW, (10, 2, 5)), (F, (10, 5, 5)), (F, (0, 5, 5))]),
        ("#7021=4.\nG54 P2\nG0 X1.", [(R, (5, 0, 5))]),
        ("POPEN\nDPRNT[X#1[42]]\nPCLOS\nG0 X1.\x13", [(R, (1, 0, 5))]),
        ("#1=ATAN[1.,1.]\n#2=POW[2.,#3+3]\n#3=SQR[16.]\nG0 X#1 Y#2 Z#3", [(R, (45, 8, 4))]),
        ("M19 R90.\nG0 X1.", [(R, (1, 0, 5))]),
    ],
)
def test_more_words_of_the_family(body, moved):
    """Rounding by R alone, G54 P, output, functions of 30i, an oriented stop."""
    assert ends(body.replace("#3+3", "3.")) == moved


def test_turns_of_a_helix_by_l_are_not_passed_over():
    """On controls that know them L counts turns: the word was noted as unused, and one turn was read."""
    assert refused("G3 I-5. J0 Z-3. L3") == [("E207", 5)]
    assert refused("G43.1 H1 Z5.") == [("E208", 5)] and refused("G54.4 P1") == [("E208", 5)]


@pytest.mark.parametrize(
    "body", ["G81 Z-1. R2. L0\nG70 I9. J0 L6\nG80", "G13 I9. D0 Z-1. F9.", "G150 P9 Z-1."]
)
def test_a_haas_is_known_by_its_patterns(body):
    assert parse_program((HEAD + body + "\nM30").encode(), "p", dialect="auto").dialect == "haas"


def test_an_arc_on_a_kept_centre_must_fit_it():
    """Controls that keep I and J: from (10, 0) about (15, 0), (3, 7) is 13.9 mm away."""
    body = "G2 X10. Y0 I5. J0\nX3. Y7."
    assert refused(body, control={"modal_centres": True}) == [("E304", 6)]
    assert [code for code, _ in refused(body)] == ["E302"]  # not taken for such a control either
    assert ends("G2 X10. Y0 I5. J0\nX20.", control={"modal_centres": True})[1] == (CW, (20, 0, 5))


@pytest.mark.parametrize(
    ("line", "without"),
    [("M98 P7", 9), ("G65 P7 A1.", 9), ("GOTO 10", None), ("IF [1 EQ 1] GOTO 10", None), ("M99", None)],
)
def test_block_delete_skips_lines_that_steer(line, without):
    body = f"/{line}\nX2.\nN10 X3.\nM30\nO7\nX9.\nM99"
    assert [p[0] for _, p in ends(body, block_delete=True)] == [2, 3]
    if line != "M99":
        assert [p[0] for _, p in ends(body)] == [9, 2, 3] if without else [3]


def test_where_subprograms_end():
    """Manual: M99 P in the main program continues at that line; an O number is another program."""
    assert ends("M99 P300\nX1.\nN300 X2.") == [(R, (2, 0, 5))]
    back = read("N300 X1.\nM99 P300\nX3.")
    assert next(f.code for f in back.findings if f.severity == "W") == "W415"
    assert refused("M98 P7\nX1.\nM30\nO7\nX2.\nO8\nX3.\nM99") == [("E415", 8)]
    for line in ("M98 P7 Q10", "M98 P7 H10", "M98 P7 L1.5", "M98 P7 L-1"):
        assert refused(f"{line}\nM30\nO7\nX1.\nN10 X2.\nM99") == [("E412", 5)]


def test_a_modal_macro_comes_after_moves_alone():
    macro = "\nM30\nO7\nG91 Y1.\nG90\nM99"
    assert ends("G66 P7\nG4 X1.\nG10 L2 P2 X1.\nG92 X0\nX2.\nG67" + macro)[-1][1] == (2, 1, 5)
    assert refused("G66 P7\nX1.\nG66 P7\nG67" + macro) == [("E412", 7)]


def test_a_tilted_plane_takes_nothing_of_an_older_one():
    plane = "G68.2 P2 Q1 X10. Y0 Z0\nG68.2 P2 Q2 X12. Y0 Z0\nG68.2 P2 Q3 X10. Y3. Z3.\nG69\n"
    assert refused(plane + "G68.2 P2 Q2 X0 Y5.\nG68.2 P2 Q3 X0 Y0 Z9.") == [("E208", 10)]
    assert refused("G68.2 P2 Q1 X10.\nG68.2 P2 Q2 X12.\nG0 X1.") == [("E208", 7)]


@pytest.mark.parametrize(
    "block",
    [
        "G13 D0 I7. K5. Q1.",
        "G13 D0 I5. K7.",
        "G13 D0 I7. Q1.",
        "G13 D0 I7. L1.5",
        "G13 D0 I7. L0",
        "G81 Z-1. R1. L0\nG70 I5. J0 L4.5",
        "G81 Z-1. R1. L0\nG71 I5. J0 L2",
        "G81 Z-1. R1. L0\nG72 J45. L2",
        "G18 G81 Y-1. R1. L0\nG70 I5. J0 L2",
    ],
)
def test_patterns_and_pockets_of_a_haas_that_are_incomplete(block):
    assert {code for code, _ in refused(block, "haas")} == {"E208"}


def test_register_0_alone_takes_the_tool_length_away():
    """Operator's manual 0i, tool length offset: H0 holds no length; under G43 it acts as G49, elsewhere it does nothing."""

    def slides(body: str) -> list[float]:
        """Z of the machine, mm: with a length in force it is that much above the program's."""
        return [move.end_machine[2] for move in read("T1 M6\n" + body).moves]

    assert slides("G43 H1 Z20.\nX3.")[-2:] == [70.0, 70.0]  # tool 1 is 50 long
    for word in ("H0", "G49", "G43 H0"):
        assert slides(f"G43 H1 Z20.\n{word} Z100.\nX3.")[-2:] == [100.0, 100.0]
    assert slides("H0 Z100.") == slides("Z100.") == [5.0, 100.0]


def test_a_loop_that_waits_is_told_at_once():
    """For an input, or a variable of another program; one that counts ends, and branches may repeat between calls."""
    waiting = "O1\n#501=0\nN10 (WAIT)\nIF [#501 EQ 0] GOTO 10\nG0 X1.\nM30"
    (found,) = parse_program(waiting.encode(), "p", dialect="fanuc").errors
    assert (found.code, found.line) == ("E413", 4) and "nothing changes" in found.message
    ends = (
        "O1\n#1=0\nWHILE [#1 LT 3] DO1\nIF [#1 EQ 9] GOTO 9\n#1=#1+1\nEND1\nM98 P2 L2\n"
        "N9 G0 X#1\nM30\nO2\nIF [#501 EQ 9] GOTO 5\nN5\nM99"
    )
    program = parse_program(ends.encode(), "p", dialect="fanuc")
    assert not program.errors and program.moves[-1].end[0] == 3.0


def test_a_file_that_opens_with_subprograms_runs_the_program_that_ends():
    sub, main = "O9\nG91 G0 X5.\nG90\nM99\n", "O1\nG0 X1.\nM98 P9 L2\nM30\n"
    program = parse_program(f"%\n{sub}{main}%".encode(), "p", dialect="fanuc")
    assert [move.end[0] for move in program.moves] == [1.0, 6.0, 11.0]
    assert [(f.code, f.line) for f in program.findings if f.code == "I213"] == [("I213", 6)]
    both = parse_program(f"%\n{sub}{main}{main.replace('O1', 'O2')}%".encode(), "p", dialect="fanuc")
    assert "W415" in {f.code for f in both.findings}  # of two nobody knows which is meant
