"""Programs as posts of CAM systems write them, Fanuc and its kin: motions worked by hand from the manual that is named."""

from __future__ import annotations

import math

import pytest

from vmachining.nc import Motion, Program, ToolEntry, parse_program

HEAD = "O0001\nG21 G90 G17 G40 G80\nS1000 M3\n"
LATHE = "O1\nG21 G40 G99\nT0101\nG97 S500 M3\n"


def read(text: str, dialect: str = "fanuc", **options: object) -> Program:
    options = {"home": (0.0, 0.0, 200.0), "rotary": "ABC", "units": "mm", **options}
    return parse_program(text.encode(), "p.nc", dialect=dialect, **options)  # type: ignore[arg-type]


def clean(text: str, dialect: str = "fanuc", **options: object) -> Program:
    program = read(text, dialect, **options)
    assert not program.errors, program.errors
    return program


def errors(text: str, dialect: str = "fanuc", **options: object) -> list[tuple[str, int]]:
    return [(f.code, f.line) for f in read(text, dialect, **options).errors]


def codes(program: Program) -> set[str]:
    return {f.code for f in program.findings}


PLANE = "G68.2 X10. Y0 Z0 I90. J90. K-90.\n"
"""Rz(90) Rx(90) Rz(-90): its x, y, z are -z, y, x of the part."""


@pytest.mark.parametrize("reach", ["G0 B90. C0\n" + PLANE + "G53.1\n", PLANE + "G0 B90. C0\n"])
def test_rotary_axes_that_are_turned_before_a_tilted_plane_or_in_it_reach_it(reach):
    """Fanuc 30i operator's manual, tilted working plane indexing: the plane is one of the part, however its table stands.

    (1, 2, 3) of the plane is (10, 0, 0) + 1 (0, 0, -1) + 2 (0, 1, 0) + 3 (1, 0, 0) = (13, 2, -1).
    """
    program = clean(
        HEAD + "G0 Z100.\n" + reach + "G0 X1. Y2. Z3.\nG1 Z-1. F100\nG0 Z50.\nG69\nG0 X0 Y0\nG28 B0 C0\nM30"
    )
    approach, cut, _, after, *home = program.moves[-6:]
    assert approach.end == pytest.approx((13, 2, -1)) and cut.end == pytest.approx((9, 2, -1))
    assert cut.axis_start == cut.axis_end == pytest.approx((1, 0, 0)) and cut.rotary_start is None
    # G69: the angles tell again how the tool stands, until they are taken back
    assert after.axis_end is None and after.rotary_deg == {"b": 90.0, "c": 0.0}
    assert home[-1].rotary_deg == {"b": 0.0, "c": 0.0}
    assert "W365" in codes(program)


def test_a_table_that_has_turned_before_its_plane_does_not_swing_again():
    program = clean(HEAD + "G0 Z100.\nG0 B90.\n" + PLANE + "G53.1\nG0 X1. Y2. Z3.\nM30")
    assert [m.line for m in program.moves] == [4, 5, 8]


@pytest.mark.parametrize(
    "text",
    [
        "G0 B90.\n" + PLANE + "G0 X1. Y2.",  # neither G53.1 nor angles: the tool may stand askew
        "G0 B90.\n" + PLANE + "G53.1\nG0 B45.",  # away from the plane
        PLANE
        + "G53.1\nG1 X1. F100\nG69\nG1 X5.",  # the plane is over, the table still stands as G53.1 left it
    ],
)
def test_motions_whose_tilt_is_not_known_are_refused(text):
    last = HEAD + text
    assert errors(last + "\nM30") == [("E208", last.count("\n") + 1)]


def test_the_stock_of_manual_guide_is_a_drawing_and_its_cycles_are_named():
    """Manual Guide i operator's manual: G1900 to G1903 draw the blank, G1000 and on are cycles."""
    program = clean(HEAD + "G1902 B100. D60. H40. I0 J0 K1.\nG0 X5.\nM30", rotary="")
    assert [m.end[0] for m in program.moves] == [5]
    (refused,) = read(HEAD + "G1020 Z-5.\nM30").errors
    assert "Manual Guide" in refused.message


def test_feed_returns_with_its_mode_where_none_was_given_between():
    """One register holds F (0i manual, feed functions): G94 for a rapid does not empty it, F under G94 fills it anew."""
    text = HEAD + "G95 G1 X1. F0.2\nG94 G0 X2.\nG95 G1 X3.\nM30"
    assert clean(text).moves[-1].feed_mm_min == pytest.approx(200)
    assert errors(HEAD + "G95 G1 X1. F0.2\nG94 G1 X2. F80\nG95 G1 X3.\nM30") == [("E301", 6)]
    assert errors(HEAD + "G94 G1 X1. F80\nG93 G1 X2. F5\nG94 G1 X3.\nM30") == [("E301", 6)]


def test_the_sign_of_a_rounding_repeats_where_the_next_line_leads():
    """0i-TD operator's manual, chamfering and corner R: R-2 turns the same corner as R2 where the next line leads to -X."""
    text = LATHE + "G0 X40. Z2.\nG1 Z-10. R{} F0.2\nX20.\nM30"
    plus, minus = (clean(text.format(sign), control={"lathe": "diameter"}) for sign in ("2.", "-2."))
    assert [m.end for m in plus.moves] == [m.end for m in minus.moves] and len(plus.moves) == 4


def test_a_line_by_its_angle_ends_where_the_line_of_the_next_block_begins():
    """0i-TD operator's manual, direct drawing dimensions: 45 degrees from the face meet the cylinder of 40 at z = -20."""
    program = clean(LATHE + "G0 X0 Z0\nG1 A135. F0.2\nX40. Z-30. A180.\nM30", control={"lathe": "diameter"})
    assert [m.end for m in program.moves[-2:]] == [pytest.approx((20, 0, -20)), pytest.approx((20, 0, -30))]


def test_an_angle_that_stands_alone_in_its_block():
    """G1 is modal: the block is one word, and its end is where its line meets the next."""
    program = clean(LATHE + "G1 X0 Z0 F0.2\nA135.\nX40. Z-30. A180.\nM30", control={"lathe": "diameter"})
    assert [m.end for m in program.moves[-2:]] == [pytest.approx((20, 0, -20)), pytest.approx((20, 0, -30))]


def test_an_alarm_of_the_program_ends_it_with_one_finding():
    """Macro B, #3000: the control stops, nothing after it runs."""
    text = HEAD + "G0 X1.\nIF [#1 EQ #0] THEN #3000=1 (NO ARGUMENT)\n#2=1/0\nG0 X2.\nM30"
    program = read(text)
    assert [(f.code, f.line) for f in program.errors] == [("E108", 5)] and len(program.moves) == 1


def test_radii_that_a_macro_sets_are_those_of_the_compensation():
    """30i manual, system variables: #13001 radius and #12001 wear of register 1, in units of the program."""
    text = HEAD + "#13001=4.\n#12001=1.\n#1=#[13000+1]\nG0 X0 Y0\nG1 G41 D1 X10. Y0 F100\nX20.\nX[20+#1]\nM30"
    program = clean(text)
    assert program.moves[-2].end == pytest.approx((20, 5, 200))
    assert "W351" not in codes(program)


@pytest.mark.parametrize(
    ("lines", "radius"),
    [
        ("#12001=.1", 3.1), ("G91 G10 L12 P1 R.5\nG90", 3.5), ("G10 L13 P1 R.1", 3.1), ("G10 L13 P1 R.2\nG10 L13 P1 R.1", 3.1),
        ("G10 L13 P1 R.1\nG91 G10 L13 P1 R.1\nG90", 3.2), ("G10 L12 P1 R4.\n#12001=.1", 4.1), ("#12001=.1\nG10 L12 P1 R4.", 4.1),
        ("G10 L13 P1 R.1\n#13001=4.", 4.1), ("#13001=4.", 4.0),
    ],
)  # fmt: skip
def test_a_wear_is_added_to_the_radius_of_its_tool(lines: str, radius: float):
    """30i manual, tool compensation memory C: geometry (L12, #13001) and wear (L13, #12001) are two registers, D their sum."""
    text = HEAD + f"T1 M6\n{lines}\nG0 X0 Y0\nG1 G41 D1 X10. Y0 F100\nX20.\nX25.\nM30"
    program = clean(text, tools={1: ToolEntry(1, 6.0, 0.0)})
    assert program.moves[-2].end[1] == pytest.approx(radius)


NO_PROGRAMS = {
    "wire erosion": "//ACCUTEX WEDM CUTTING CONDITIONS --BEGIN--\nE001=10 17 16 09 08 10 50 12\nG90 G21\nE1\nG1 X5.\nM2",
    "General Electric": "%\nN1G90M03\nN2G00X0019685Y-0008937S18T01M06\nN3G87R-0003937Z-0003937F600D01\nN4G01X-0003937\nM30",
    "library": "$PARTS.SSB%\nOABC\nG0 X=XPOS\nRTS",
}  # fmt: skip


@pytest.mark.parametrize("what", NO_PROGRAMS)
def test_what_is_not_read_is_named_once(what):
    program = parse_program(NO_PROGRAMS[what].encode(), "p.nc", dialect="auto")
    (only,) = program.errors
    assert only.code == "E211" and what in only.message and not program.moves


def test_a_number_beside_the_tape_mark_is_that_of_a_fanuc_program():
    program = parse_program(
        b"%O1200(SHAFT)\nG21 G95\nG92 S500\nG97 S300 M3\nG0 X40. Z2.\nG1 Z-5. F0.2\nG33 Z-9. F1.\nM30\n%",
        "p.nc",
        dialect="auto",
    )
    assert program.dialect == "fanuc" and not program.errors and "W380" in codes(program)


def test_a_radius_that_a_block_leaves_out_is_the_last_one_where_all_arcs_fit():
    """A square of rounded corners: each arc is a quarter about a centre 2 inside of its corner, as is said."""
    text = HEAD + "G0 X2. Y0\nG1 X8. F100\nG3 X10. Y2. R2.\nG1 Y8.\nG3 X8. Y10.\nG1 X2.\nG3 X0 Y8.\nM30"
    program = clean(text)
    arcs = [m for m in program.moves if m.motion is Motion.ARC_CCW]
    assert [m.center for m in arcs] == [pytest.approx(c) for c in ((8, 2), (8, 8), (2, 8))]
    assert any("R that a block leaves out" in f.message for f in program.findings)
    small = HEAD + "G0 X2. Y0\nG3 X3. Y1. R1. F100\nG3 X13. Y1.\nM30"  # no circle of 1 reaches over 10
    assert errors(small) == [("E302", 6)]


def test_a_clearance_plane_below_the_hole_is_executed_and_said_once():
    """0i manual, canned cycles: R is where the rapid ends and the cut begins, wherever Z is."""
    program = clean(HEAD + "G0 Z50.\nG81 X1. Y1. Z40. R3. F100\nX2.\nG80\nM30")
    assert [m.end[2] for m in program.moves if m.line == 5] == [50, 3, 40, 50]
    assert [f.line for f in program.findings if f.code == "W333"] == [5]


def test_i_is_the_peck_of_a_cycle_without_q():
    """Anilam and Haas manuals: I of G83 is the depth of a peck. From 2 down by 3 to -4: two pecks."""
    program = clean(HEAD + "G0 X0 Y0 Z50.\nG83 Z-4. R2. I3. F100\nG80\nM30")
    assert [m.end[2] for m in program.moves if m.motion is Motion.LINEAR] == pytest.approx([-1, -4])


def test_the_code_that_stands_beside_every_tool_changes_it_where_there_is_no_m6():
    program = clean(HEAD + "T5 M106\nG43 H5 Z50.\nT7 M106 (DRILL)\nG0 Z40.\nM30")
    assert [m.tool for m in program.moves] == [5, 7]
    assert [m.tool for m in clean(HEAD + "T5 M106\nG0 Z50.\nT7 M6\nG0 Z40.\nM30").moves] == [0, 7]


def test_a_turned_zero_of_okuma_is_the_offset_that_turns():
    """Okuma OSP-P300M, fixture offset function: CALL OO88 writes offset PP as PH turned with the table."""
    job = {"work_offsets": {"G54": (5.0, 0.0, 0.0), "G55": (9.0, 0.0, 0.0)}}
    text = (
        "O1\nG21 G90\nG15 H1\nG0 X1.\nCALL OO88 PX=0 PY=0 PZ=0 PA=-90. PC=45. PH=1 PP=2\nG15 H2\nG0 X{}\nM2"
    )
    assert [m.end_machine[0] for m in clean(text.format("2."), "okuma", **job).moves] == [6, 7]
    assert errors(text.format("2.").replace("PX=0", "PX=3."), "okuma", **job) == [("E208", 5)]


def test_probing_is_named_once_with_how_often_it_comes():
    program = clean(HEAD + "G65 P9832\nG65 P9810 Z5. F1000.\nG65 P9811 Y0\nG0 X1.\nM30")
    (said,) = [f for f in program.findings if f.code == "W382"]
    assert said.line == 4 and "2 more lines" in said.message


def test_tools_and_names_of_okuma_lathes():
    """OSP-P200L: T is nose, tool, register by two digits each; NAT01 names a block."""
    text = "G140\nNSTRT\nG0 X50. Z30.\nG50 S800\nNAT01\nT010203 G97 S500 M3\nG95 G1 X40. F.2\nM02"
    program = parse_program(text.encode(), "p.min", dialect="auto", units="mm")
    assert program.dialect == "okuma" and not program.errors and program.moves[-1].tool == 2
    assert program.moves[-1].end[0] == pytest.approx(20) and math.isclose(program.moves[-1].spindle_rpm, 500)


TURNED = {"control": {"lathe": "diameter"}}


def test_a_call_within_a_contour_whose_passes_are_left_out_is_left_out_too():
    """0i-TD manual, G71: the blocks from P to Q only describe the contour."""
    text = "G0 X50. Z2.\nG71 P10 Q20 U.2 W.1 F.2\nN10 G0 X20.\nM98 P100\nN20 X50.\nG0 Z5.\nM30\nO100\nG1 Z-5. F.1\nM99"
    assert [m.end[2] for m in clean(LATHE + text, **TURNED).moves] == [2, 5]


def test_the_lead_of_a_thread_stays_in_the_register_of_feeds():
    """0i-TD manual, G32: F is the lead, and the one F of the control; K of an older control is not."""
    text = LATHE + "G1 X20. Z2. F.2\n{}\nG1 X25.\nM30"
    assert clean(text.format("G32 Z-10. F1.5"), **TURNED).moves[-1].feed_mm_min == pytest.approx(750)
    assert clean(text.format("G33 Z-10. K1.5"), **TURNED).moves[-1].feed_mm_min == pytest.approx(100)


def test_a_lathe_with_a_y_axis_is_known_by_its_tools_and_their_registers():
    text = b"O1\nG21\nT0101\nG97 S500 M3\nG0 X50. Z2. Y5.\nG1 Z-5. F.1\nT0200\nG0 X20.\nM30"
    program = parse_program(text, "p.nc", dialect="auto")
    assert "W380" in codes(program) and program.moves[0].end == pytest.approx((25, 5, 2))
    mill = parse_program(text.replace(b"T0200", b"T0200 M6"), "p.nc", dialect="auto")
    assert "W380" not in codes(mill) and mill.moves[0].end[0] == pytest.approx(50)


def test_a_cut_under_g53_goes_where_its_words_say():
    """Posts for lathes write G53 to end a work offset: a cut to the machine's own places makes no sense."""
    program = clean(LATHE + "G0 X50. Z2.\nG53 G1 X40. F.2\nG0 G53 X0 Z0\nM30", **TURNED)
    assert program.moves[1].motion is Motion.LINEAR and program.moves[1].end == pytest.approx((20, 0, 2))
    assert "W366" in codes(program) and program.moves[-1].end[0] > 25  # a rapid goes home


def test_w_of_a_macro_call_does_not_hide_the_quill():
    text = HEAD + "G0 W2. X0 Y0\nG65 P9021 W7.\nG1 Z-5. F100\nM30"
    assert [m.end[2] for m in clean(text).moves] == pytest.approx([202, -3])


def test_a_tool_length_by_g56_and_h_is_one_of_okuma():
    program = parse_program(
        b"O1\nT1\nM6\nG0 X1. Y2.\nG56 Z5. H01\nG1 Z-1. F9.\nM2", "p.txt", dialect="auto", units="mm"
    )
    assert program.dialect == "okuma" and "W368" not in codes(program) and program.moves[-1].end[2] == -1


def test_rigid_taps_by_other_names():
    """Fanuc 15 format G84.2, Brother G77 (I threads to the inch, J pitch), Okuma G284: F 1.5 times 1000 turns, R no rounding."""
    text = HEAD + "G0 Z50.\nG1 X5. F100\n{} X10. Y0 Z-9. R2. {}\nG80\nM30"
    wanted = [(10, 0, 50), (10, 0, 2), (10, 0, -9)]
    for code, words, dialect in (
        ("G84.2", "F1500.", "fanuc"), ("G77", "J1.5", "fanuc"), ("G77", "I16.9333333", "fanuc"), ("G284", "F1500.", "okuma"),
    ):  # fmt: skip
        moves = [m for m in clean(text.format(code, words), dialect).moves if m.line == 6]
        assert [m.end for m in moves[:3]] == [pytest.approx(p) for p in wanted], code
        assert moves[2].feed_mm_min == pytest.approx(1500, rel=1e-6)


def test_the_lead_of_a_tap_is_no_feed_of_the_cuts_after_it():
    """Brother G77 and G78: every hole of the cycle feeds with lead times speed, whatever turns the spindle takes; F stays."""
    text = HEAD + (
        "G0 Z50.\nG1 X5. F100\nG77 X10. Y0 Z-9. R2. J1.5\nX20.\nX30. S500\nG81 X35. Z-5. R2.\nG80\nG1 X40.\n"
        "G78 X50. Z-9. R2. I25.4\nG84 X60. Z-9. R2. F200\nG80\nG1 X70.\nM30"
    )
    feeds = {move.line: move.feed_mm_min for move in clean(text).moves if move.feed_mm_min is not None}
    assert feeds == pytest.approx(
        {5: 100, 6: 1500, 7: 1500, 8: 750, 9: 100, 11: 100, 12: 500, 13: 200, 15: 200}
    )


def test_small_words_of_mazak_okuma_and_lathes():
    """G54.4 P0 ends a set-up error, G20 HP=1 is the home of Okuma mills, G154 P of a Haas lathe a work offset."""
    assert [m.end[0] for m in clean(HEAD + "G54.4 P0\nG0 X1.\nM30", "mazak").moves] == [1]
    assert [m.end for m in clean("O1\nG21 G90\nG0 X9.\nG20 HP=1\nG0 X1.\nM2", "okuma").moves][-1] == (
        1,
        0,
        200,
    )
    assert [m.end[0] for m in clean(LATHE + "G154 P1\nG0 X2. Z1.\nM30", "haas", **TURNED).moves] == [1]
    assert clean(HEAD + "#3001=0\n#1=#4012\nG0 X#1\nM30").moves[-1].end[0] == 67


def test_tool_centre_point_control_of_okuma():
    """OSP-P300M, five-axis machining: between G169 H and G170 the words are the tip on the part."""
    program = clean("O1\nG21 G90\nT1 M6\nG169 H1\nG1 X5. A10. C20. F100\nG170\nG0 X1.\nM2", "okuma")
    assert [m.tcp for m in program.moves] == [True, False]
    assert program.moves[0].rotary_deg == {"a": 10.0, "c": 20.0}


def test_okuma_calls_repeat():
    text = b"O1\nG21 G90\nG15 H1\nG0 X1.\nCALL OSUB Q3\nM2\nOSUB\nG91 G0 X10.\nG90\nRTS\n"
    program = parse_program(text, "a.min", dialect="auto")
    assert not program.errors and [move.end[0] for move in program.moves] == [1.0, 11.0, 21.0, 31.0]
