"""Stored cycles, cutter location files, tables of poses, rotary words."""

from __future__ import annotations

import pytest

from vmachining.nc import Motion, Program, ToolEntry, move_record, parse_program
from vmachining.nc.cycles import degression

R, F, D = Motion.RAPID, Motion.LINEAR, Motion.DWELL


def read(text: str, dialect: str, **options: object) -> Program:
    program = parse_program(
        text.encode(),
        "p",
        dialect=dialect,
        **{"home": (0.0, 0.0, 0.0), **options},  # type: ignore[arg-type]
    )
    assert not [f for f in program.errors if f.code != "W401"], program.errors
    return program


# ---- mts ----


@pytest.mark.parametrize(
    ("depth", "first", "less", "steps"),
    [
        (47, 20, 5, [20, 15, 10, 2]), (100, 20, 5, [20, 15, 10, *[5] * 11]), (47, 20, 0, [20, 20, 7]),
        (10, 20, 5, [10]), (35, 20, 5, [20, 15]), (60, 20, 7, [20, 13, 7, 7, 7, 6]), (30, 12, 4, [12, 8, 4, 4, 2]),
    ],
)  # fmt: skip
@pytest.mark.erratum(
    "tester", "3.6, G82", "steps of 20, 15, 12 and 2 mm for a depth of 47", "20, 15, 10 and 2 mm"
)
def test_degression(depth, first, less, steps):
    assert degression(depth, first, less) == pytest.approx(steps)


CYCLES = [
    ("G81 Z-20 W+10", 10, [(R, 0), (F, -20), (R, 0), (R, 10)]),
    ("G82 Z-47 W+5 B+0.5 D+5 K+20", 5,
     [(R, 0), (F, -20), (D, -20), (R, -19), (F, -35), (D, -35), (R, -34), (F, -45), (D, -45), (R, -44), (F, -47),
      (D, -47), (R, 0), (R, 5)]),
    ("G83 Z-47 W+5 B+0.5 D+5 K+20", 5,
     [(R, 0), (F, -20), (R, 0), (D, 0), (R, -19), (F, -35), (R, 0), (D, 0), (R, -34), (F, -45), (R, 0), (D, 0),
      (R, -44), (F, -47), (R, 0), (R, 5)]),
]  # fmt: skip


@pytest.mark.parametrize(("cycle", "start", "wanted"), CYCLES)
def test_stored_cycles(cycle, start, wanted):
    moves = read(f"F100 S9 M3\nN010 {cycle}\nN011 G79\nM30", "mts", home=(0.0, 0.0, float(start))).moves
    assert [(m.motion, round(m.end[2], 9)) for m in moves] == wanted
    assert all(m.dwell_s == 0.5 for m in moves if m.motion is D)


LINE = """N05 G21 G90
N10 M06 T01
N15 S1200 F100 M03
N20 G92 X-100 Y+100 Z+100
N25 G81 Z-15
N30 G78 X100 Y-75 D+100 S3
N35 G79
"""


def test_pattern_on_a_line():
    program = read(LINE, "mts", stock_top_mm=-10.0)
    assert [f.code for f in program.findings] == ["W401"]
    holes = [(100 + 100 * k, -75) for k in range(3)]
    wanted = [(kind, (x, y, z)) for x, y in holes for kind, z in ((R, 100), (F, 85), (R, 100))]
    assert [(m.motion, tuple(round(v, 9) for v in m.end_program)) for m in program.moves] == wanted
    assert program.moves[0].spindle_rpm == 1200
    assert "W520" in {f.code for f in read(LINE, "mts", stock_top_mm=-20.0).findings}


def test_pattern_on_a_circle_and_its_end():
    text = "F9 S9 M3\nG81 Z-1\nG77 X10 Y0 R5 A90 D90 S4\nG79\nG79 X1 Y2\nG80\nG0 X3"
    ends = [m.end for m in read(text, "mts").moves if m.motion is F]
    wanted = [(10, 5, -1), (5, 0, -1), (10, -5, -1), (15, 0, -1), (1, 2, -1)]
    assert all(a == pytest.approx(b) for a, b in zip(ends, wanted, strict=True))


# ---- apt ----

CL = """PARTNO BRACKET $$ made by hand
UNITS/MM
LOADTL/3,ADJUST,1
CUTTER/10.0,2.0
SPINDL/RPM,1200,CLW
RAPID
GOTO/0,0,50
FEDRAT/300,MMPM
GOTO/ 10.0, 0.0,$
  5.0
CIRCLE/10,10,5,0,0,1,10,.01,.5,0,0
GOTO/20,10,5
GODLTA/0,0,20
DELAY/2.5
MULTAX/ON
GOTO/20,10,25,0.6,0,0.8
GOHOME
FINI
"""


def test_cutter_location_file():
    program = read(CL, "apt", home=(0.0, 0.0, 100.0))
    assert not [f for f in program.findings if f.code != "E109"]
    kinds = [(m.line, m.motion, m.end) for m in program.moves]
    assert kinds == [
        (7, R, (0, 0, 50)), (9, F, (10, 0, 5)), (12, Motion.ARC_CCW, (20, 10, 5)), (13, F, (20, 10, 25)),
        (14, D, (20, 10, 25)), (16, F, (20, 10, 25)), (17, R, (0, 0, 100)),
    ]  # fmt: skip
    arc, tilt = program.moves[2], program.moves[5]
    assert arc.center == (10, 10) and arc.turns == 1 and arc.axis_end is None
    assert (tilt.axis_start, tilt.axis_end) == ((0, 0, 1), (0.6, 0, 0.8))
    assert (tilt.tool, tilt.spindle_rpm, tilt.feed_mm_min) == (3, 1200, 300)


def test_inches_feeds_per_revolution_and_circles_in_other_planes():
    text = "UNITS/INCHES\nSPINDL/100,CCLW\nFEDRAT/.01,IPR\nGOTO/1,0,0\nCIRCLE/1,0,1,0,1,0,1\nGOTO/2,0,1\n"
    text += "FEDRAT/20\nGOTO/0,0,0\nEND"
    line, arc, last = read(text, "apt").moves
    assert line.end == (25.4, 0, 0) and line.feed_mm_min == pytest.approx(25.4) and line.spindle_rpm == -100
    assert (arc.plane, arc.center, arc.motion) == ("zx", (25.4, 25.4), Motion.ARC_CCW)
    assert last.feed_mm_min == pytest.approx(508)


ARC = "CIRCLE/10,0,0,0,0,1,10"


@pytest.mark.parametrize(
    ("text", "code", "line"),
    [("CIRCLE/10,0,0,0,0,1,5\nGOTO/20,0,0", "E304", 4), (f"RAPID\n{ARC}\nGOTO/20,0,0", "E109", 5),
     (f"{ARC},CLW\nGOTO/0,0,1", "E109", 3), ("MOVARC/10,0,0,0,0,1,10,ANGLE,540\nGOTO/9,0,0", "E309", 3)],
)  # fmt: skip
def test_circles_that_say_two_things(text, code, line):
    data = f"UNITS/MM\nFEDRAT/50\n{text}\nFINI\n".encode()
    program = parse_program(data, "p", dialect="apt", home=(0.0, 0.0, 0.0))
    assert [(f.code, f.line) for f in program.errors] == [(code, line)]


def test_what_waits_for_the_next_motion_waits_for_one_only():
    text = f"FEDRAT/50\nRAPID\nGOHOME\nGOTO/0,0,0\n{ARC}\nGOHOME\nGOTO/0,0,0\n"
    text += "MOVARC/10,0,0,0,0,1,10,ANGLE,180\nGOTO/20,0,0\nGOTO/0,0,0\nFINI"
    program = read(text, "apt", home=(0.0, 0.0, 10.0))
    assert [m.motion for m in program.moves] == [R, F, R, F, Motion.ARC_CCW, F]


# ---- poses ----


def test_table_with_axes():
    text = "# made by hand\nx_mm,y_mm,z_mm,i,j,k,feed_mm_min,rapid,tool\n0,0,9,0,0,1,,,2\n1,2,3,0,.6,.8,200,,\n\n"
    text += "4,5,6,0,0,2,,1,\n"
    program = read(text, "poses", tools={2: ToolEntry(2, 1, 1)})
    first, second = program.moves
    assert (first.line, first.start, first.end, first.feed_mm_min) == (4, (0, 0, 9), (1, 2, 3), 200)
    assert (first.axis_start, first.axis_end, first.tool) == ((0, 0, 1), pytest.approx((0, 0.6, 0.8)), 2)
    assert second.motion is R and second.axis_end == (0, 0, 1) and second.line == 6
    assert [(f.code, f.line) for f in program.findings] == [("W363", 6)]
    assert move_record(first)["axis"] == pytest.approx([0, 0.6, 0.8])


def test_table_with_angles():
    text = "x_mm,y_mm,z_mm,a_deg,c_deg,feed_mm_min\n0,0,9,0,0,100\n1,2,3,-20,30,\n"
    (move,) = read(text, "poses").moves
    assert (move.rotary_start, move.rotary_deg, move.tcp) == ({"a": 0, "c": 0}, {"a": -20, "c": 30}, True)
    assert move_record(move)["rotary_deg"] == {"a": -20, "c": 30}


@pytest.mark.parametrize(
    ("row", "code"),
    [("1,2,3,0,0,0", "E363"), ("1,2,3,0,0,-1", "E364"), ("1,2,3,0,0", "E109"), ("1,2,1e400,0,0,1", "E102"),
     ("1,2,0x3,0,0,1", "E102"), ("1,2,3,0,0,1", "E301")],
)  # fmt: skip
def test_wrong_rows(row, code):
    found = parse_program(f"x_mm,y_mm,z_mm,i,j,k\n0,0,0,0,0,1\n{row}\n".encode(), "p", dialect="poses").errors
    assert [(f.code, f.line) for f in found] == [(code, 3)]


# ---- rotary words ----


def test_rotary_axes_have_offsets_and_a_start():
    text = "G0 X1\nA30\nG91 A10 C5\nG90 G10 L2 P1 A100\nA0\nG92 A7\nA7 X2\nG28 A0"
    moves = read(text, "iso", rotary="AC").moves
    assert [m.rotary_deg for m in moves] == [
        None, {"a": 30}, {"a": 40, "c": 5}, {"a": 100, "c": 5}, {"a": 100, "c": 5}, {"a": 93, "c": 5}, {"a": 0, "c": 5},
    ]  # fmt: skip
    assert moves[4].rotary_start == {"a": 100, "c": 5} and moves[4].rotary_program == {"a": 7, "c": 5}
    assert not any(m.tcp for m in moves)


@pytest.mark.parametrize(
    ("on", "off"), [("M428", "M429"), ("M128", "M129"), ("TRAORI", "TRAFOOF"), ("G43.4 H0", "G49")]
)
def test_tool_centre_point_control(on, off):
    moves = read(f"S1 M3\n{on}\nG1 X1 A9 F100\n{off}\nX2", "iso", rotary="A").moves
    assert [m.tcp for m in moves] == [True, False]


def test_tool_centre_point_control_ends_with_what_began_it():
    text = "S1 M3\nM428\nG43 H0\nG1 X1 A9 F100\nG49\nX2\nG43.4 H0\nM429\nX3\nG43.4 H0\nX4\nG43 H0\nX5"
    assert [m.tcp for m in read(text, "iso", rotary="A").moves] == [True, True, False, True, False]


@pytest.mark.parametrize(("line", "text"), [(1, "G81 Z-5 W2 A30"), (2, "G81 Z-5 W2\nG79 X9 A30")])
def test_stored_cycles_do_not_turn(line, text):
    found = parse_program(f"{text}\nM30".encode(), "p", dialect="mts", rotary="A").errors
    assert [(f.line, f.code, f.word) for f in found] == [(line, "E207", "A30")]


@pytest.mark.parametrize("unit", ["G20", "G21"])
def test_degrees_per_minute_and_per_turn_know_no_inch(unit):
    moves = read(f"{unit}\nS20 M3\nG1 A90 F180\nG95 F9 A0", "iso", rotary="A").moves
    assert [m.duration_s for m in moves] == pytest.approx([30, 30])  # 90 / 180 min, 90 / (9 * 20) min


def test_time_of_blocks_that_turn():
    text = "S1 M3\nG93 G1 A90 F2\nA0 X9 F4\nG94 F180 A90\nX0"
    moves = read(text, "iso", rotary="A").moves
    assert [m.duration_s for m in moves] == [30, 15, 30, None]
    assert moves[1].feed_mm_min == pytest.approx(36)


def test_a_turned_arc_is_listed_in_both_frames():
    (move,) = read("S1 M3 F9\nG10 L2 P1 X10 R90\nG3 X2 I1 J0", "iso").moves[-1:]
    # the start is (0, 10) seen from there, and (x, y) there is (10 - y, x) here
    assert move_record(move, "program")["center_mm"] == pytest.approx([1, 10])
    assert move_record(move)["center_mm"] == pytest.approx([0, 1])
