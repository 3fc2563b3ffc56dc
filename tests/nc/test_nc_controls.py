"""What one control does and another does not: smallest programs, their motions worked by hand from public manuals."""

from __future__ import annotations

import pytest

from vmachining.nc import ToolEntry, parse_program

TOOLS = {1: ToolEntry(1, 4.0, 50.0), 100: ToolEntry(100, 4.0, 50.0)}
HEAD = "O1\nG21 G90 G17\nT1 M6\nS1 M3 F100\n"


def read(text, dialect="fanuc", **options):
    return parse_program(text.encode(), "p", dialect=dialect, home=(0.0, 0.0, 0.0), **options)


def ends(text, dialect="fanuc", **options):
    program = read(text, dialect, **options)
    assert not program.errors, program.errors
    return [(move.line, *(round(v, 4) for v in move.end)) for move in program.moves]


@pytest.mark.parametrize(
    ("expression", "fanuc", "iso"),
    [("FIX[-1.2]", -1.0, -2.0), ("FUP[-1.2]", -2.0, -1.0), ("FIX[1.2]", 1.0, 1.0), ("FUP[1.2]", 2.0, 2.0)],
)
def test_fanuc_drops_fractions_towards_zero(expression, fanuc, iso):
    """Fanuc 0i/30i, arithmetic and logic operation: FIX and FUP go by the absolute value; LinuxCNC by the number line."""
    assert ends(f"{HEAD}G1 X[{expression}]\nM30\n")[-1][1] == fanuc
    assert ends(f"G21 S1 M3 F100\nG1 X[{expression}]\nM2\n", "iso")[-1][1] == iso


@pytest.mark.parametrize(("unit", "x", "y"), [("G21", 1.235, 2.0), ("G20", 25.4 * 1.2345, 2.0 * 25.4)])
def test_round_in_an_address_goes_to_least_increments(unit, x, y):
    """The same place: in the word of an address ROUND is to 0.001 mm, 0.0001 inch; in a statement to a whole number."""
    text = f"O1\n{unit} S1 M3 F1\n#1=1.23451\n#2=ROUND[#1+0.6]\nG1 XROUND[#1] Y#2\nG1 Z[ROUND[#1]+1]\nM30\n"
    (_, *first), (_, *second) = ends(text)
    assert first[:2] == pytest.approx([x, y], abs=1e-4)
    assert second[2] == pytest.approx(x + (1.0 if unit == "G21" else 25.4), abs=1e-4)


def test_null_is_no_zero():
    """A variable that was never set is not equal to 0; one that is 0 is."""
    text = f"{HEAD}#4=0\nIF [#1 EQ 0] THEN #2=5\nIF [#1 NE 0] THEN #3=7\nIF [#4 EQ 0] THEN #5=8\nG1 X#2 Y#3 Z#5\nM30\n"
    assert ends(text)[-1] == (9, 0.0, 7.0, 8.0)


def test_an_alarm_on_the_state_of_the_machine_is_not_raised():
    program = read(f"{HEAD}IF [#5405 GE 6000] THEN #3000=15\nG1 X1\nM30\n", "haas")
    assert not program.errors and [m.end[0] for m in program.moves] == [1.0]
    assert any(f.code == "I213" and f.line == 5 for f in program.findings)
    assert [f.code for f in read(f"{HEAD}IF [#3901 GE 6] GOTO 9\nG1 X1\nN9 M30\n").errors] == ["E108"]
    assert [f.code for f in read(f"{HEAD}IF [1 EQ 1] THEN #3000=15\nG1 X1\nM30\n").errors] == ["E108"]


@pytest.mark.parametrize("call", ["", "M98 P2\n"])
def test_a_program_ends_where_the_next_o_number_stands(call):
    program = read(f"{HEAD}G1 X1.\n{call}O2\nG1 X5.\nM99\n")
    assert [m.end[0] for m in program.moves] == ([1.0, 5.0] if call else [1.0])
    assert [f.line for f in program.findings if f.code == "W401"] == [7 if call else 6]


def test_w_beside_y_is_a_second_axis_along_z():
    """ISO 841: W is parallel to Z. 5 + 100, then 5 - 1; a lathe has no Y, and U beside W."""
    text = "O1\nG21 G90 S1 M3\nG0 X0 Y0 Z100. W5.\nG1 Z-1. F100\nM30\n"
    program = parse_program(text.encode(), "p", home=(0.0, 0.0, 0.0), dialect="auto")
    assert [m.end[2] for m in program.moves] == [105.0, 4.0] and not program.errors
    assert any(f.code == "I213" and "W moves the tool along Z" in f.message for f in program.findings)
    for other in (text.replace("Y0", "U0"), text.replace("Y0 ", "")):
        assert parse_program(other.encode(), "p", dialect="fanuc").errors


def test_k_with_parts_is_no_number_of_holes():
    """Posts for Burgmaster: G83 K is the peck, G82 K the dwell in seconds; 2 mm in pecks of 0.75 are three."""
    text = f"{HEAD}G0 Z5.\nG82 X1. Z-1. R1. K.4\nG83 X2. Z-1. R1. K.75\nG80\nM30\n"
    program = read(text)
    assert not program.errors
    assert [m.dwell_s for m in program.moves if m.dwell_s] == [0.4]
    assert [m.end[2] for m in program.moves if m.line == 7 and m.feed_mm_min] == [0.25, -0.5, -1.0]
    count = read(f"{HEAD}G0 Z5.\nG91 G81 X1. Z-1. R-4. K3\nG80\nM30\n")
    assert [m.end[0] for m in count.moves if m.feed_mm_min] == [1.0, 2.0, 3.0]


CONTOUR = (
    "G0 X0 Y0\nG41 G1 X10. D1\nY10.\nX0\nX20. Y20.\nG41 X0 Y30.\nG2 X10. Y40. I10. J0\nG1 Y60.\nG40 X0\nM30\n"
)


def test_fanuc_compensation_goes_about_corners_on_lines():
    """Start-up type A, radius 2, left of (10,0) (10,10) (0,10) (20,20) (0,30), an arc about (10,30), (10,60).

    Inner corners are trimmed. At (0,10) the work has 26.6 degrees: both offset lines go on by the radius, and a straight
    line joins them. At (0,30) it has 116.6: one point, where the offset line meets the tangent of the arc, X-2; then along
    it to the start of the arc. (Fanuc 0i, details of cutter compensation; parameter CCC = 0.)
    """
    got = ends(HEAD + CONTOUR, tools=TOOLS)[1:]
    k = 5**-0.5
    far = 2.0 * ((1.0 - k) / (1.0 + k)) ** 0.5
    want = [
        (6, 8, 0), (7, 8, 8), (8, -2, 8), (9, -6 * k, 10 + 2 * k), (9, 20 - 10 * k, 20), (10, -2, 30 - 4 * k + far * k),
        (11, -2, 30), (11, 8, 30 + 140**0.5), (12, 8, 60), (13, 0, 60),
    ]  # fmt: skip
    assert [line for line, *_ in got] == [line for line, *_ in want]
    for (_, x, y, _), (_, u, v) in zip(got, want, strict=True):
        assert (x, y) == pytest.approx((u, v), abs=1e-4)
    assert [m.motion.name for m in read(HEAD + CONTOUR, tools=TOOLS).moves].count("ARC_CW") == 1


def test_the_job_may_say_that_corners_are_arcs():
    moves = read(HEAD + CONTOUR, tools=TOOLS, crc_corner="arc").moves
    assert [m.motion.name for m in moves].count("ARC_CW") == 3


def test_t_changes_the_tool_of_a_program_without_m6():
    """Sinumerik machine data 22550 = 0: T loads the tool at once."""
    text = "G71 G90 G54\nT100\nS1 M3 F100\nG0 X0 Y0\nG41 G1 X10\nY10\nM30\n"
    program = read(text, "sinumerik", tools=TOOLS)
    assert {m.tool for m in program.moves} == {100} and program.moves[1].end[0] == 8.0
    assert {m.tool for m in read(text.replace("S1", "M6\nS1"), "sinumerik", tools=TOOLS).moves} == {100}
    assert [f.code for f in program.findings if f.code[0] == "I"] == ["I213"]


@pytest.mark.parametrize(
    ("mode", "inner", "outer"), [("", 80.0, 120.0), ("CFIN", 80.0, 100.0), ("CFTCP", 100.0, 100.0)]
)
def test_sinumerik_feeds_hold_on_the_contour(mode, inner, outer):
    """Radius 10 from inside and from outside with a tool of radius 2: the centre goes on 8 and 12 (CFC, as delivered)."""
    text = (
        f"G71 G90 G54 {mode}\nT100\nS1 M3 F100\nG0 X0 Y0\nG41 G1 X10 Y5\nY10\nG3 X0 Y20 CR=10\nG1 X-10\nG2 X-20 Y30 CR=10\n"
        "G1 Y40\nM30\n"
    )
    feeds = {(m.line, m.motion.name): m.feed_mm_min for m in read(text, "sinumerik", tools=TOOLS).moves}
    assert feeds[7, "ARC_CCW"] == pytest.approx(inner) and feeds[9, "ARC_CW"] == pytest.approx(outer)
    assert feeds[6, "LINEAR"] == 100.0


@pytest.mark.parametrize(
    ("code", "inner", "outer"), [("M109", 80.0, 120.0), ("M110", 80.0, 100.0), ("M111", 100.0, 100.0)]
)
def test_heidenhain_feeds_hold_on_the_contour_by_m109(code, inner, outer):
    text = (
        f"0 BEGIN PGM A MM\n1 TOOL CALL 1 Z S1\n2 L X+0 Y+0 R0 FMAX M3\n3 L X+10 Y+5 RL F100 {code}\n4 L Y+10\n"
        "5 CR X+0 Y+20 R+10 DR+\n6 L X-10\n7 CR X-20 Y+30 R+10 DR-\n8 L Y+40\n9 END PGM A MM\n"
    )
    feeds = {(m.line, m.motion.name): m.feed_mm_min for m in read(text, "heidenhain", tools=TOOLS).moves}
    assert feeds[6, "ARC_CCW"] == pytest.approx(inner) and feeds[8, "ARC_CW"] == pytest.approx(outer)


def test_without_a_tool_table_the_contour_is_the_path_and_that_is_said():
    for text, dialect in (
        ("G71 G90 G54\nT1 M6\nS1 M3 F100\nG0 X0 Y0\nG41 G1 X10 Y0\nY10\nM30\n", "sinumerik"),
        ("0 BEGIN PGM A MM\n1 TOOL CALL 1 Z S1\n2 L X+0 Y+0 R0 FMAX M3\n3 L X+10 RL F100\n4 L Y+10\n5 END PGM A MM\n",
         "heidenhain"),
    ):  # fmt: skip
        program = read(text, dialect)
        assert not program.errors and program.moves[-1].end[:2] == (10.0, 10.0)
        assert [f.code for f in program.findings].count("W351") == 1
        assert [f.code for f in read(text, dialect, tools={1: ToolEntry(1, float("nan"), 0.0)}).errors] == [
            "E351"
        ]


def test_an_old_control_is_named_by_one_finding():
    """Most words of a short program mean nothing: one finding, not five."""
    text = (
        "P000058\nN10T25M75M60\nN20T25M6\nN30G54G0Z+0035000F20000S3120M13P32.936P32\n"
        "N40G89G81G2Z-0028000K+0000000R-0013000M13M8P120.0P121.0P122.178P123.22.5P125.-90P126.4\n"
        "N60G89G2P120P121P122P123\nN100X+0280000\nN120G66Y+0500000\nN130T0M6M29M70\n"
    )
    errors = parse_program(text.encode(), "p", dialect="auto").errors
    assert [error.code for error in errors] == ["E211"]


def test_machine_coordinates_go_home_where_nobody_says_where_the_part_lies():
    """G53 Z0 is the top of the machine, not of the part."""
    text = f"{HEAD}G0 X1. Z2.\nG53 G0 Z0\nG53 X-5. Y0\nM30\n"
    program = parse_program(text.encode(), "p", dialect="fanuc", home=(0.0, 0.0, 90.0))
    assert [m.end for m in program.moves] == [(1.0, 0.0, 2.0), (1.0, 0.0, 90.0), (-5.0, 0.0, 90.0)]
    assert [f.line for f in program.findings if f.code == "W366"] == [6]
    known = parse_program(text.encode(), "p", dialect="fanuc", work_offsets={"G54": (-9.0, 0.0, -300.0)})
    assert [m.end for m in known.moves[1:]] == [(1.0, 0.0, 300.0), (4.0, 0.0, 300.0)]
    own = text.replace("G0 X1. Z2.", "G10 L2 P1 X-9. Y0 Z-300.\nG0 X1. Z2.")
    assert [m.end for m in read(own).moves] == [(1.0, 0.0, 2.0), (1.0, 0.0, 300.0), (4.0, 0.0, 300.0)]


def test_a_second_work_offset_needs_its_place():
    text = f"{HEAD}G55\nG54\nG1 X1.\nG55\nG1 X2.\nG54 X3.\nG55 X4.\nG56 X5.\nM30\n"
    assert [f.line for f in read(text).findings if f.code == "W368"] == [8, 12]
    some = {"G54": (0.0, 0.0, 0.0), "G55": (100.0, 0.0, 0.0)}
    program = read(text, work_offsets=some)
    assert [f.line for f in program.findings if f.code == "W368"] == [12]
    assert [m.end[0] for m in program.moves] == [1.0, 102.0, 3.0, 104.0, 5.0]
    assert "counts as zero" in next(f.message for f in program.findings if f.code == "W368")
    assert not [f for f in read(f"{HEAD}G55\nG1 X1.\nM30\n").findings if f.code == "W368"]


def test_sinumerik_lines_by_an_angle():
    """From (10, 0) at 30 degrees to X 40: Y 30 tan 30; then at 180 - 45 to Y + 10: X - 10."""
    y = 30.0 / 3.0**0.5
    text = f"G71 G90 G54\nT1 M6\nS1 M3 F100\nG1 X10\nX40 ANG=30\nY{y + 10:.6f} ANG=135\n"
    program = read(text + "M30\n", "sinumerik")
    assert program.moves[-2].end == pytest.approx((40.0, y, 0.0))
    assert program.moves[-1].end == pytest.approx((30.0, y + 10.0, 0.0), abs=1e-6)
    for wrong, code in (("X0 ANG=30", "E309"), ("ANG=30", "E208"), ("X50 Y50 ANG=30", "E208")):
        assert [f.code for f in read(f"{text}{wrong}\nM30\n", "sinumerik").errors] == [code]


def test_pecks_that_shrink_to_nothing_are_refused():
    """I 3, J 1 without K: 3 + 2 + 1 mm are 6, and the hole has 9; with K 0.5 the rest comes in pecks of 0.5."""
    text = f"{HEAD}G0 Z1.\nG83 X1. Z-8. R1. I3. J1. %s\nG80\nM30\n"
    assert [f.code for f in read(text % "", "haas").errors] == ["E334"]
    program = read(text % "K.5", "haas")
    assert [m.end[2] for m in program.moves if m.feed_mm_min] == [-2, -4, -5, -5.5, -6, -6.5, -7, -7.5, -8]
