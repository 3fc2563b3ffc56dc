"""New feeds in Heidenhain and Sinumerik programs: what is written, by hand; and read back, only the feeds asked for differ."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vmachining.nc import BlockEdit, ToolEntry, parse_program, rewrite_feeds

HEIDENHAIN = """\
0 BEGIN PGM A MM
1 TOOL CALL 1 Z S5000 F800
2 L Z+50 R0 FMAX M3
3 L X-10 Y+20 R0 FMAX
4 L Z-4 R0 F300
5 L X+30 R0 F600
6 L X+40 M8 ; modal
7 L X+70 R0 F AUTO
8 LBL 1
9 L IX+5 IY+1
9 L IX+1
10 CALL LBL 1 REP 2
11 L X+120 F500
12 L X+130
13 RND R2
14 L Y+60
15 L Z+50 R0 FMAX M2
16 END PGM A MM
"""

SINUMERIK = """\
G17 G90 G71 G94
T1 D1 S5000 M3
G0 X-10 Y20 Z5
G1 Z-4 F300
X30 F=600
X40
G2 X50 Y30 CR=10 ; an arc
F700
G1 X60
HERE: G91 G1 X5
REPEATB HERE P=2
G90 G0 Z50
M30
"""


def edited(text, name, dialect, feeds):
    """The written program's lines, and what could not take a feed."""
    program = parse_program(text.encode(), name, dialect=dialect)
    assert not program.errors, program.errors
    found = rewrite_feeds(program, {line: BlockEdit(line, (feed,), (1.0,)) for line, feed in feeds.items()})
    again = parse_program(found.data, name, dialect=dialect)
    assert not again.errors
    assert [m._replace(feed_mm_min=None) for m in again.moves] == [
        m._replace(feed_mm_min=None) for m in program.moves
    ]
    taken = {line: feed for line, feed in feeds.items() if line not in found.untouched}
    for before, after in zip(program.moves, again.moves, strict=True):
        want = taken.get(before.line, before.feed_mm_min) if before.feed_mm_min is not None else None
        # rounded down to 0.1 mm/min
        assert after.feed_mm_min == want or want - 0.1 - 1e-9 <= after.feed_mm_min <= want + 1e-9
    return found.data.decode().splitlines(), found.untouched


def test_heidenhain_by_hand():
    lines, untouched = edited(HEIDENHAIN, "a.h", "heidenhain", {6: 450.07, 7: 333.0})
    assert lines[5] == "5 L X+30 R0 F450.0" and lines[6] == "6 L X+40 F333.0 M8 ; modal" and untouched == ()
    assert lines[7] == "7 L X+70 R0 F AUTO" and lines[9:] == HEIDENHAIN.splitlines()[9:]
    lines, untouched = edited(HEIDENHAIN, "a.h", "heidenhain", {6: 450.0})
    assert lines[6] == "6 L X+40 F600.0 M8 ; modal"  # F is modal: what it was


def test_heidenhain_leaves_what_others_inherit():
    """The loop after line 8 inherits its feed; its lines run three times; the rounding after line 14 has no F of its own."""
    lines, untouched = edited(HEIDENHAIN, "a.h", "heidenhain", {8: 400.0, 10: 400.0, 14: 400.0, 16: 100.0})
    assert untouched == (8, 10, 14, 16) and lines == HEIDENHAIN.splitlines()
    lines, untouched = edited(
        HEIDENHAIN.replace("13 RND R2\n", ""), "a.h", "heidenhain", {13: 100.0, 15: 90.0}
    )
    assert lines[12:15] == ["11 L X+120 F100.0", "12 L X+130 F500.0", "14 L Y+60 F90.0"]


def test_sinumerik_by_hand():
    lines, untouched = edited(SINUMERIK, "a.mpf", "sinumerik", {5: 450.0, 7: 333.33, 9: 100.0})
    assert (
        lines[4] == "X30 F450.0"
        and lines[5] == "X40 F600.0"
        and lines[6] == "G2 X50 Y30 CR=10 F333.3 ; an arc"
    )
    assert (
        untouched == (9,) and lines[8] == "G1 X60 F700.0"
    )  # the loop after it inherits its feed: it keeps what it had
    assert lines[7] == "F700" and lines[9:] == SINUMERIK.splitlines()[9:]


def test_inches_and_feed_per_revolution_keep_their_unit():
    inch = "G17 G90 G70 G94\nT1 D1 S1000 M3\nG0 X0 Y0 Z1\nG1 Z-.1 F10\nX1\nM30\n"
    lines, _ = edited(inch, "a.mpf", "sinumerik", {5: 127.0})
    assert lines[4] == "X1 F5.0"
    turns = "G17 G90 G71 G95\nT1 D1 S1000 M3\nG0 X0 Y0 Z1\nG1 Z-1 F0.2\nX10\nM30\n"
    lines, _ = edited(turns, "a.mpf", "sinumerik", {5: 150.0})
    assert lines[4] == "X10 F0.15"


@pytest.mark.parametrize(
    ("text", "name", "dialect"), [(HEIDENHAIN, "a.h", "heidenhain"), (SINUMERIK, "a.mpf", "sinumerik")]
)
@given(data=st.data())
def test_any_feeds_read_back(text, name, dialect, data):
    lines = sorted(
        {
            m.line
            for m in parse_program(text.encode(), name, dialect=dialect).moves
            if m.feed_mm_min is not None
        }
    )
    edited(text, name, dialect, data.draw(st.dictionaries(st.sampled_from(lines), st.floats(1.0, 9000.0))))


BEGIN = "G17 G90 G71 G94\nT1 D1 S5000 M3\nG0 X-10 Y20 Z5\nG1 Z-4 F300\n"
CHANGES = {
    "feed per revolution later": "X10 F500\nG95 F0.1\nX20\nX30\nG94 F400\nX40\n",
    "the same feed per revolution": "X10 F500\nG95\nF0.1\nX20\nX30\n",
    "inches later": "X10 F500\nG700\nX2\nX3\n",
    "another speed": "G95\nX10 F0.1\nS2500\nX20\nX30\n",
    "another speed and F": "G95\nX10 F0.1\nS2500\nF0.2\nX20\nX30\n",
    "rounded on and on": "X10 F500\nRNDM=1\nX20\nY10 F100\nX40\n",
    "lone F": "F100\nX10\nF200\nG4 F2\nX20\nX30 F300\nF400\nF500\nX40\nG94\nX50\n",
    "packed": "N10X10.5Y2.F500\nN20X20.5Y3.\nN30F300.5X30.5\nN40X40\n",
}


@pytest.mark.parametrize("what", CHANGES)
def test_what_an_f_counts_may_change_in_a_sinumerik_program(what):
    text = BEGIN + CHANGES[what] + "G0 Z50\nM30\n"
    moves = parse_program(text.encode(), "a", dialect="sinumerik").moves
    for line in sorted({m.line for m in moves if m.feed_mm_min is not None}):
        _, untouched = edited(text, "a", "sinumerik", {line: 37.0})
        assert (untouched == ()) == (what not in ("inches later", "rounded on and on")), line


def test_arcs_whose_contour_keeps_the_feed():
    """A contour of radius 10 cut from inside by a tool of radius 2: the centre has 0.8 F. 300 there is F375."""
    text = (
        "G17 G90 G71 G94\nT1 D1 S5000 M3\nM6\nM3\nG0 X0 Y-20 Z5\nG41 G1 X10 Y-5 F500\nY0\nG3 X0 Y10 CR=10\n"
        "G1 X-20 F200\nG40 Y0\nM30\n"
    )
    tools = {1: ToolEntry(1, 4.0, 50.0)}
    program = parse_program(text.encode(), "a", dialect="sinumerik", tools=tools)
    found = rewrite_feeds(program, {8: BlockEdit(8, (300.0,), (1.0,))})
    lines = found.data.decode().splitlines()
    assert lines[7] == "G3 X0 Y10 CR=10 F375.0" and lines[8] == "G1 X-20 F200" and found.untouched == ()
    again = parse_program(found.data, "a", dialect="sinumerik", tools=tools)
    assert [m.feed_mm_min for m in again.moves if m.line == 8] == [pytest.approx(300.0)]


@pytest.mark.parametrize(
    "body",
    [
        "L X+10 M128 F1000\nL X+20\nL X+30 F AUTO\n",
        "L X+10 M103 F0.5\nL X+20\nL X+30 F AUTO\n",
        "L X+10 F500\nL M128 F1000\nL X+20\nL M129\nL X+30\n",
        "L X+10 F500\nM136\nL X+20 F0.1\nL X+30\n",
    ],
)
def test_an_f_of_another_function_is_no_feed(body):
    """M128 F and M103 F are limits and shares; M136 makes F millimetres per revolution."""
    head = (
        "BEGIN PGM A MM\nTOOL CALL 1 Z S5000 F800\nL Z+50 R0 FMAX M3\nL X-10 Y+20 R0 FMAX\nL Z-4 R0 F AUTO\n"
    )
    text = head + body + "L Z+50 R0 FMAX M2\nEND PGM A MM\n"
    moves = parse_program(text.encode(), "a.h", dialect="heidenhain").moves
    for line in sorted({m.line for m in moves if m.feed_mm_min is not None}):
        edited(text, "a.h", "heidenhain", {line: 37.0})
