"""Lines that run often, or that make many moves, keep the feeds that they had."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from readback import check, read, rewrite

from vmachining.errors import NCError
from vmachining.nc import ToolEntry
from vmachining.nc.rewrite import BlockEdit, rewrite_feeds

HEAD = "G21 G90 S100 M3\nG0 X0 Y0 Z5\nF100 G1 Z0\n"


def test_a_loop_runs_with_the_feed_it_had():
    text = HEAD + "G1 X10\no1 repeat [3]\nG1 Y[1 + #<_y>]\no1 endrepeat\nG1 X0\nM2\n"
    again, written = rewrite(text, {4: (40.0,), 6: (50.0,), 8: (60.0,)})
    assert written.untouched == (6,)
    assert b"X10 F40.0\nF100.0\no1 repeat" in written.data
    assert [m.feed_mm_min for m in again.moves if m.feed_mm_min] == [100, 40, 100, 100, 100, 60]


def test_subprograms_are_left_alone_wherever_they_are_called():
    text = HEAD + "o<a> sub\nG1 X[#1]\no<a> endsub\nG1 X10\no<a> call [7]\nG1 Y5\no<a> call [8]\nG1 Y6\nM2\n"
    again, written = rewrite(text, {5: (9.0,), 7: (30.0,), 9: (40.0,)})
    assert written.untouched == (5,)
    assert [m.feed_mm_min for m in again.moves if m.feed_mm_min] == [100, 30, 100, 40, 100, 100]


def test_a_subprogram_behind_the_end():
    text = HEAD + "G1 X10\nM98 P7 L2\nG1 X20\nM30\nO7\nG1 Z-1\nZ0\nM99\n"
    again, written = rewrite(text, {4: (30.0,), 6: (40.0,), 9: (50.0,)})
    assert written.untouched == (9,)
    assert [m.feed_mm_min for m in again.moves if m.feed_mm_min] == [100, 30, *[100] * 4, 40]


def test_a_body_that_changes_modes_closes_the_program():
    text = HEAD + "G1 X10\no1 if [1]\nG91 G1 X1\no1 endif\nG90 G1 X0\nM2\n"
    program = read(text)
    written = rewrite_feeds(program, {4: BlockEdit(4, (30.0,), (1.0,))})
    assert written.data == program.data and written.untouched == (4,)


@pytest.mark.parametrize(
    ("code", "last"), [("G[40/2]", "X20"), ("G#7", "X20"), ("G[90+3] G1 X12 F100", "X20 F50"), ("M70", "X20")]
)
def test_behind_a_computed_code_or_saved_modes_nothing_is_changed(code, last):
    text = "#7=20\n" + HEAD + f"G1 X10\n{code}\nG1 {last}\nM2\n"
    again, written = rewrite(text, {5: (30.0,), 7: (40.0, 50.0)})
    assert written.untouched == (7,)
    assert f"X10 F30.0\nF100.0\n{code}\nG1 {last}\n".encode() in written.data
    wanted = [m.feed_mm_min for m in read(text).moves]
    assert [m.feed_mm_min for m in again.moves][-1] == wanted[-1]


@pytest.mark.parametrize("code", ["G81 X1 Z-3 R2", "G83 Q1 X1 Z-3 R2", "G85 X1 Z-3 R2", "G89 P1 X1 Z-3 R2"])
def test_cycles_are_left_alone(code):
    text = HEAD + f"G1 X4\nG98 {code}\nX9\nG80\nG1 X2\nM2\n"
    _, written = rewrite(text, {4: (30.0,), 5: (40.0,), 6: (50.0,), 8: (60.0,)})
    assert written.untouched == (5, 6)


def test_rigid_taps_keep_their_pitch_and_the_feed_behind_them():
    text = HEAD + "G1 X4\nG33.1 Z-3 K2\nG1 X2\nM2\n"
    again, written = rewrite(text, {4: (30.0,), 5: (40.0,)})
    assert written.untouched == (5,)
    assert [m.feed_mm_min for m in again.moves][2:] == [30, 200, 200, 100]


def test_compensated_blocks_get_one_feed_and_are_not_cut():
    text = "F100 G41.1 D6 G1 X20\nY20\nX0\nG1 Y-20\nG40 Y-40\nX20 Y-50\nM2\n"
    _, written = rewrite("G21 S1 M3\n" + text, {3: (30.0, 40.0), 4: (50.0,), 7: (20.0, 30.0)})
    assert written.unsplit == (3,)


def test_inverse_time_under_compensation_counts_the_programmed_length():
    text = "G21 S1 M3\nF100 G41.1 D6 G1 X20\nG93 Y20 F5\nX0 F5\nG94 G1 Y-20 F100\nG40 Y-40\nM2\n"
    again, written = rewrite(text, {3: (37.0,), 4: (40.0,)})
    # 37 / 20 and 40 / 20 per minute, 20 mm being programmed whatever the offset path is
    assert b"Y20 F1.85\nX0 F2.0\n" in written.data
    assert {m.line: m.feed_mm_min for m in again.moves}[4] == pytest.approx(40)


def test_nothing_is_cut_under_rotated_coordinates():
    text = HEAD + "G10 L2 P1 R30\nG1 X40 Y10\nG1 X0 Y0\nM2\n"
    _, written = rewrite(text, {5: (30.0, 50.0)})
    assert written.unsplit == (5,)


def test_a_table_of_poses_gets_new_cells_and_keeps_every_other_byte():
    data = "# by hand\r\nx_mm, y_mm,z_mm, feed_mm_min,rapid\r\n0,0,0,5,1\r\n1,0,0, 50 ,0\n2,0,0,,0\n\n3,0,0,,0\n4,0,0,7,0"
    written = rewrite_feeds(read(data, dialect="poses"), {4: BlockEdit(4, (20.55, 30.0), (0.5, 1.0))})
    want = data.replace(" 50 ", " 20.5 ").replace("2,0,0,,0", "2,0,0,50,0")
    assert written.data == want.encode() and written.unsplit == (4,) and len(written.source_line) == 8


def test_a_table_of_poses_without_feeds_or_with_quotes_is_left_alone():
    data = 'x_mm,y_mm,z_mm,feed_mm_min\n0,0,0,5\n1,0,0,"5"\n'
    program = read(data, dialect="poses")
    written = rewrite_feeds(program, {3: BlockEdit(3, (2.0,), (1.0,))})
    assert written.data == program.data and written.untouched == (3,) and len(written.source_line) == 3


CELLS = st.tuples(st.sampled_from(["", "120", "75.5", " 60"]), st.booleans())


@given(rows=st.lists(CELLS, min_size=2, max_size=9), data=st.data())
@settings(max_examples=100, deadline=None)
def test_any_table_of_poses_reads_back(rows, data):
    lines = ["x_mm,y_mm,z_mm,feed_mm_min,rapid", "0,0,0,100,1"]
    lines += [f"{k},0,0,{feed},{int(rapid)}" for k, (feed, rapid) in enumerate(rows, 1)]
    program = read("\n".join(lines) + "\n", dialect="poses")
    lined = {m.line: m.feed_mm_min for m in program.moves if m.feed_mm_min is not None}
    chosen = data.draw(st.lists(st.sampled_from(sorted(lined)), unique=True)) if lined else []
    edits = {k: BlockEdit(k, (data.draw(st.integers(50, 3000)) / 10.0,), (1.0,)) for k in chosen}
    written = rewrite_feeds(program, edits)
    again = read(written.data.decode(), dialect="poses")
    wanted = lined | {k: edit.feeds_mm_min[0] for k, edit in edits.items()}
    assert {m.line: m.feed_mm_min for m in again.moves if m.feed_mm_min is not None} == pytest.approx(wanted)
    assert [m._replace(feed_mm_min=None) for m in again.moves] == [
        m._replace(feed_mm_min=None) for m in program.moves
    ]
    assert rewrite_feeds(again, edits).data == written.data and not written.untouched
    if not edits:
        assert written.data == program.data


PIECES = st.sampled_from(
    ["G1 X{}", "G1 Y{} F70", "G0 X{}", "G1 X{} Y{}", "G81 X{} Z-2 R2", "o{} repeat [2]", "G2 X{} I4 J4 F30",
     "o<s> call [{}]", "G41.1 D1 G1 X{}", "G40 G1 X-50 Y{}", "F{}", "M98 P77", "G33.1 Z-{} K1", "M70", "M72"]
)  # fmt: skip


@given(pieces=st.lists(st.tuples(PIECES, st.integers(1, 99)), max_size=12), data=st.data())
@settings(max_examples=200, deadline=None)
def test_any_mixture_reads_back(pieces, data):
    lines, depth = (HEAD + "o<s> sub\nG1 Z[-#1]\no<s> endsub").split("\n"), []
    for text, number in pieces:
        lines.append(text.format(number, number + 1) if "repeat" not in text else f"o{len(lines)} repeat [2]")
        if "repeat" in text:
            depth.append(len(lines) - 1)
    lines += [f"o{k} endrepeat" for k in reversed(depth)]
    text = "\n".join([*lines, "M30", "O77", "G1 Y[#<_y>+1]", "M99", ""])
    try:
        program = read(text, tools={0: ToolEntry(0, 1.0, 0.0)}, max_steps=500)
    except NCError:  # a wrong program is not rewritten
        return
    feeds = sorted({m.line for m in program.moves if m.feed_mm_min is not None})
    chosen = data.draw(st.lists(st.sampled_from(feeds), unique=True)) if feeds else []
    edits = {k: BlockEdit(k, (float(data.draw(st.integers(5, 300))),), (1.0,)) for k in chosen}
    check(program, edits, tools={0: ToolEntry(0, 1.0, 0.0)}, max_steps=500)
