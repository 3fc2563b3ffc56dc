"""Cutter location files of NX, SolidWorks CAM and CATIA. Motions are worked by hand from the records."""

from __future__ import annotations

import math

import pytest

from vmachining.nc import Motion, Program, parse_program
from vmachining.nc.rewrite_words import rewrite_apt_feeds
from vmachining.nc.toolcomments import cutter_notes

R, F, CW, CCW, D = Motion.RAPID, Motion.LINEAR, Motion.ARC_CW, Motion.ARC_CCW, Motion.DWELL


def read(text: str, **options: object) -> Program:
    options = {"dialect": "auto", "home": (0.0, 0.0, 50.0), **options}
    program = parse_program(text.encode(), "p.cls", **options)  # type: ignore[arg-type]
    assert program.dialect == "apt" and not program.errors, program.errors
    return program


NX = """TOOL PATH/FACE,TOOL,MILL_D20
TLDATA/MILL,20.0000,0.0000,75.0000,0.0000,0.0000
MSYS/10.0000,0.0000,0.0000,1.0000000,0.0000000,0.0000000,0.0000000,1.0000000,0.0000000
$$ centerline data
PAINT/PATH
PAINT/SPEED,10
LOAD/TOOL,4,ADJUST,4
SPINDL/RPM,2000,CLW
PAINT/COLOR,186
RAPID
GOTO/0.0000,0.0000,20.0000,0.0000000,0.0000000,1.0000000
FEDRAT/MMPM,250.0000
GOTO/0.0000,0.0000,-1.0000
CIRCLE/5.0000,0.0000,-1.0000,0.0000000,0.0000000,-1.0000000,5.0000,0.0600,0.5000,20.0000,0.0000
GOTO/10.0000,0.0000,-1.0000
RAPID
GOTO/10.0000,0.0000,20.0000
PAINT/TOOL,NOMORE
END-OF-PATH
TOOL PATH/SIDE,TOOL,MILL_D20
TLDATA/MILL,20.0000,0.0000,75.0000,0.0000,0.0000
MSYS/10.0000,5.0000,0.0000,0.0000000,1.0000000,0.0000000,0.0000000,0.0000000,1.0000000
RAPID
GOTO/1.0000,2.0000,30.0000,0.0000000,0.0000000,1.0000000
FEDRAT/MMPM,100.0000
GOTO/1.0000,2.0000,3.0000
END-OF-PATH
"""


def test_an_nx_file_with_two_coordinate_systems():
    """The second MSYS: origin (10, 5, 0), x = Y, y = Z, so z = X; seen from the first: (X, Y, Z) = (z, x + 5, y)."""
    program = read(NX)
    ends = [(m.motion, tuple(round(v, 9) for v in m.end)) for m in program.moves]
    assert ends == [
        (R, (0, 0, 20)), (F, (0, 0, -1)), (CW, (10, 0, -1)), (R, (10, 0, 20)),
        (R, (30, 6, 2)), (F, (3, 6, 2)),
    ]  # fmt: skip
    assert program.moves[2].center == (5.0, 0.0)
    assert program.moves[-1].axis_end == pytest.approx((1, 0, 0))
    assert [m.feed_mm_min for m in program.moves] == [None, 250, 250, None, None, 100]
    assert {m.tool for m in program.moves} == {4} and program.ended
    assert [f.code for f in program.findings if f.severity != "I"] == []


def test_feeds_in_inches_say_the_unit():
    text = "TOOL PATH/A,TOOL,B\nRAPID\nGOTO/1,0,0\nFEDRAT/IPM,10.0\nGOTO/2,0,0\nEND-OF-PATH\n"
    program = read(text)
    assert [m.end[0] for m in program.moves] == [25.4, 50.8] and program.moves[1].feed_mm_min == 254.0
    assert "I213" in {f.code for f in program.findings}
    assert read(text, units="mm").moves[-1].end[0] == 2.0


HOLES = """PARTNO/1
UNIT/MM
LOAD/TOOL,15
SPINDL/1334,RPM,CLW
TRNTYP/WORLD,0,0,0
CSYS/1.,0,0,0,0,1.,0,0,0,0,1.,0
RAPID/
GOTO/1.,2.,25.
CYCLE/INIT
{cycle}
GOTO/1.,2.,0
GOTO/5.,2.,0
CYCLE/OFF
FINI
"""


@pytest.mark.parametrize(
    ("cycle", "z"),
    [
        ("CYCLE/DRILL,FEDTO,5.4,MMPM,125.,RAPTO,3.,RTRCTO,25.,DWELL,0",
         [(R, 3), (F, -5.4), (R, 25), (R, 25), (R, 3), (F, -5.4), (R, 25)]),
        ("CYCLE/DRILL,FEDTO,5.4,MMPM,125.,RAPTO,3.,DWELL,2",
         [(R, 3), (F, -5.4), (D, -5.4), (R, 3), (R, 3), (F, -5.4), (D, -5.4), (R, 3)]),
        ("CYCLE/DEEP2,FEDTO,8.,1STPECK,5.,SUBPECK,2.,MMPM,125.,RAPTO,3.,RTRCTO,25.",
         [(R, 3), (F, -5), (R, 3), (R, -4.75), (F, -7), (R, 3), (R, -6.75), (F, -8), (R, 25), (R, 25),
          (R, 3), (F, -5), (R, 3), (R, -4.75), (F, -7), (R, 3), (R, -6.75), (F, -8), (R, 25)]),
        ("CYCLE/TAP,FEDTO,6.,MMPM,125.,RAPTO,3.,RTRCTO,25.",
         [(R, 3), (F, -6), (F, 3), (R, 25), (R, 25), (R, 3), (F, -6), (F, 3), (R, 25)]),
    ],
)  # fmt: skip
def test_cycles(cycle, z):
    moves = read(HOLES.format(cycle=cycle), peck_clearance_mm=0.25).moves[1:]
    assert [(m.motion, round(m.end[2], 9)) for m in moves] == z
    assert {m.feed_mm_min for m in moves if m.motion is F} == {125.0}
    assert {round(m.end[0], 9) for m in moves} == {1.0, 5.0}


def test_a_cycle_that_is_not_known_is_refused_by_name():
    found = parse_program(HOLES.format(cycle="CYCLE/THREAD,FEDTO,5.").encode(), "p", dialect="apt").errors
    assert [(f.code, f.line) for f in found][:1] == [("E208", 10)] and "THREAD" in found[0].message


def test_six_numbers_make_a_circle_and_its_axis_may_be_tilted():
    """About the axis (0, -sin 30, cos 30) through (0, 0, 0), from (2, 0, 0) a quarter turn to (0, 2 cos 30, 2 sin 30)."""
    c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
    text = (
        "UNITS/MM\nMULTAX\nRAPID\nGOTO/2,0,0,0,-.5,.8660254038\nFEDRAT/100,MMPM\n"
        f"CIRCLE/0,0,0,0,-.5,.8660254038\nGOTO/0,{2 * c:.9f},{2 * s:.9f}\nFINI\n"
    )
    program = read(text)
    lines = program.moves[1:]
    assert [f.code for f in program.findings if f.line == 6 or f.code == "I361"] == ["I361"]
    assert lines[-1].end == pytest.approx((0, 2 * c, 2 * s), abs=1e-9)
    for move in lines:
        middle = [(a + b) / 2 for a, b in zip(move.start, move.end, strict=True)]
        assert math.hypot(*move.end) == pytest.approx(2.0, abs=1e-8)
        assert 2.0 - math.hypot(*middle) <= 5e-4  # the sagitta of a chord
        assert -0.5 * move.end[1] + 0.8660254038 * move.end[2] == pytest.approx(0.0, abs=1e-8)
    assert sum(math.dist(m.start, m.end) for m in lines) == pytest.approx(math.pi, rel=1e-3)


def test_an_arc_as_catia_writes_it():
    """From (10, 0) towards +Y about (0, 0): counter-clockwise to (0, 10)."""
    text = (
        "UNITS/MM\nRAPID\nGOTO/10,0,0\nFEDRAT/ 100.0,MMPM\nINDIRV/ 0.0, 1.0, 0.0\n"
        "TLON,GOFWD/ (CIRCLE/ 0.0, 0.0, 0.0,$\n 10.0),ON,2,INTOF,$\n(LINE/ 0.0, 0.0, 0.0,$\n0.0, 10.0, 0.0)\nFINI\n"
    )
    last = read(text).moves[-1]
    assert (last.motion, last.center, last.end) == (CCW, (0.0, 0.0), (0.0, 10.0, 0.0))


def test_cutters_of_cl_files():
    notes = cutter_notes(NX.split("\n"), 1.0)
    assert {n: (note.kind, note.diameter_mm, note.corner_mm) for n, note in notes.items()} == {
        4: (None, 20.0, 0.0)
    }
    drill = "TOOL PATH/A,TOOL,D8\nTLDATA/DRILL,MILL,8.0000,0.0000,80.0000,118.0000,35.0000\nRAPID"
    assert cutter_notes(drill.split("\n"), 1.0)[1][2:6] == ("drill", 8.0, None, 118.0)
    apt = "CUTTER/12.,0,6.,3.605164,31.,0,149.\nLOAD/TOOL,16"
    assert cutter_notes(apt.split("\n"), 1.0)[16][2:6] == ("drill", 12.0, None, 118.0)


@pytest.mark.parametrize("head", ["UNITS/INCHES\n", "UNIT/INCH\n", "UNIT/MM\n", "", "FEDRAT/IPM,10\n"])
def test_feeds_written_into_a_cl_file_are_those_that_it_is_read_with(head):
    """Each motion by itself, in the unit that the file names by a record, by its feeds, or not at all."""
    text = f"LOADTL/1\nSPINDL/900,CLW\n{head}FEDRAT/20\nGOTO/0,0,1\nGOTO/1,0,1\nCIRCLE/1,1,1,0,0,1,1\nGOTO/2,1,1\n"
    text += "RAPID\nGOTO/0,0,9\nFINI\n"
    first = parse_program(text.encode(), "a.cls", dialect="apt")
    cuts = [move for move in first.moves if move.feed_mm_min]
    feeds = {move.line: 127.0 * (k + 1) for k, move in enumerate(cuts)}
    written = "".join(rewrite_apt_feeds([(line, "\n") for line in text.splitlines()], feeds).lines)
    second = parse_program(written.encode(), "a.cls", dialect="apt")
    assert [m.feed_mm_min for m in second.moves if m.feed_mm_min] == pytest.approx(
        [*feeds.values()], rel=1e-6
    )
    assert [(m.motion, m.end) for m in second.moves] == [(m.motion, m.end) for m in first.moves]


def test_records_that_look_like_a_fanuc_head_are_a_cl_file_and_user_events_are_noted():
    """OPSTOP alone in a line is no program number; NX writes the events that a user gave his post as they are called."""
    text = NX.replace(
        "PAINT/PATH\n", "PAINT/PATH\nOPSTOP\nNX_PROCESSOR_CS_NAME/G54\nNX_PROCESSOR_CS_NAME/G55\n", 1
    )
    program = read(text)
    assert len(program.moves) == len(read(NX).moves)
    assert sum("event of the user's post" in f.message for f in program.findings) == 1


def test_a_file_for_turning_is_one_finding():
    program = parse_program(
        b"LOADTL/2\nSPINDL/RPM,900,CLW\nFEDRAT/9,IPM\nGOTO/1.,.1\nGOTO/.8,-1.\nFINI\n", "t", dialect="auto"
    )
    assert [(f.code, f.line) for f in program.errors] == [("E109", 4)]


def test_tools_of_catia_leave_fields_empty_and_remarks_of_creo_continue():
    text = (
        "$$-> CSYS / 1.0, 0.0, 0.0, 0.0, $\n            0.0, 1.0, 0.0, 0.0, $\n            0.0, 0.0, 1.0, 0.0\nUNITS/MM\n"
        "TOOLNO/7,MILL,   10.0,    2.0,  ,  100.0,$\n   50.0,   ,   60.0\nLOADTL/7\n$$-> CUTTER / 12.0\nFEDRAT/300.0,MMPM\n"
        "GOTO/1.0,2.0,3.0\nFINI\n"
    )
    (move,) = read(text).moves
    assert (move.tool, move.end) == (7, (1.0, 2.0, 3.0))
    assert cutter_notes(text.splitlines(), 1.0)[7].diameter_mm == 12.0
    wrong = parse_program(b"UNITS/MM\nFEDRAT/300.0,MMPM\nGOTO/1.0,,3.0\nFINI\n", "p.cls", dialect="apt")
    assert [f.code for f in wrong.errors] == ["E102"]
