"""Small programs, byte for byte. Every case is also read back and compared with the original path."""

from __future__ import annotations

import pytest
from readback import read, rewrite

from vmachining.errors import FeedError, NCError
from vmachining.nc import parse_program
from vmachining.nc.rewrite import BlockEdit, rewrite_feeds

HEAD = "G21 G90 G17 G94\nS1000 M3\nG0 X0 Y0 Z0\n"
"""Three lines; the first line of a case is line 4."""
TWO = ((400.0, 200.0), (0.25, 1.0))

CASES = {
    "modal feed restored": (
        "N60 X10 F600\nN70 X20\nN80 Y10\nN90 X0\n",
        {4: (1500.0,), 5: (600.0,), 6: (857.142857,)},
        "N60 X10 F1500.0\nN70 X20 F600.0\nN80 Y10 F857.1\nN90 X0 F600.0\n",
    ),
    "comments, blanks and a rapid between": (
        "N1 G1  X1 F600\t(F5) ; F7\nX20 (F7)\nG0 X0\nG1 X5 ; end\nX6\n",
        {4: (900.04,)},
        "N1 G1  X1 F900.0\t(F5) ; F7\nX20 F600.0 (F7)\nG0 X0\nG1 X5 ; end\nX6\n",
    ),
    "same feed: nothing is written": ("G1 X1 F600\nX2\n", {4: (600.0,), 5: (600.0,)}, "G1 X1 F600\nX2\n"),
    "same rounded feed: nothing is written": ("G1 X1 F600\nX2\n", {4: (600.07,)}, "G1 X1 F600\nX2\n"),
    "equal neighbours share one F": ("G1 X1 F600\nX2\n", {4: (700.0,), 5: (700.0,)}, "G1 X1 F700.0\nX2\n"),
    "odd original feed": ("G1 X1 F123.4567\nX2\n", {4: (99.0,)}, "G1 X1 F99.0\nX2 F123.4567\n"),
    "no blanks": ("N1G1X1F600\nX2Y2\n", {4: (700.0,)}, "N1G1X1F700.0\nX2Y2F600.0\n"),
    "lower case": ("g1 x10 f600\nx20\n", {4: TWO}, "g1 x2.5 f400.0\nx10 f200.0\nx20 f600.0\n"),
    "F before the motion": ("F600\nG1 X1\nX2\n", {5: (300.0,)}, "F600\nG1 X1 F300.0\nX2 F600.0\n"),
    "own F behind a changed block": ("G1 X1 F600\nX2 F500\nX3\n", {4: (9.0,)}, "G1 X1 F9.0\nX2 F500\nX3\n"),
    "parameters": (
        "#1=600 #2=7.5\nG1 X[#2*2] Y-#2 F#1 M9\nX0 F[#1]\nX1\n",
        {5: TWO},
        "#1=600 #2=7.5\nG1 X3.75 Y-1.875 F400.0\nX[#2*2] Y-#2 F200.0 M9\nX0 F[#1]\nX1\n",
    ),
    "parameter feed restored": (
        "#1=600\nF#1\nG1 X5\nX6\n", {6: (50.0,)}, "#1=600\nF#1\nG1 X5 F50.0\nX6 F600.0\n",
    ),
    "split": ("N5 G1 X10 Y-4 F600 M8 (c)\n", {4: TWO}, "N5 G1 X2.5 Y-1.0 F400.0 M8 (c)\nX10 Y-4 F200.0\n"),
    "split, words in any order": ("F600 Z-1 X10 G1\n", {4: TWO}, "F400.0 Z-0.25 X2.5 G1\nZ-1 X10 F200.0\n"),
    "split, end of program on the block": (
        "G1 X10 F600 M30 (end)\n", {4: TWO}, "G1 X2.5 F400.0 (end)\nX10 F200.0 M30\n",
    ),
    "split, first codes": ("G1 X10 F600 M9 M5\n", {4: TWO}, "G1 X2.5 F400.0\nX10 F200.0 M9 M5\n"),
    "split G91": ("G91 G1 X1 F600\nX1\n", {4: ((3.0, 2.0, 3.0), (1 / 3, 2 / 3, 1.0))},
                  "G91 G1 X0.33333 F3.0\nX0.33334 F2.0\nX0.33333 F3.0\nX1 F600.0\n"),
    "split quarter in G91": (
        "G91\nG3 X-10 Y10 I-10 F300 (quarter)\n", {5: ((400.0, 200.0), (1 / 3, 1.0))},
        "G91\nG3 X-1.339746 Y5.0 I-10 F400.0 J0.0 (quarter)\n"
        "X-8.660254 Y5.0 I-8.660254 J-5.0 F200.0\n",
    ),
    "split R above 180 degrees": (
        "G0 Y10\nG3 X10 Y0 R-10 F300\n", {5: ((400.0, 200.0), (2 / 3, 1.0))},
        "G0 Y10\nG3 X-10.0 Y0 R10 F400.0\nX0.0 Y-10.0 R10\nX10 Y0 R10 F200.0\n",
    ),
    "split full circle": (
        "G2 I10 F300 M5\n", {4: ((400.0, 200.0), (0.25, 1.0))},
        "G2 I10 F400.0 X10.0 Y10.0 J0.0\nX0.0 Y0.0 I0.0 J-10.0 F200.0 M5\n",
    ),
    "split two turns of a helix": (
        "G2 I10 Z-8 P2 F300\n", {4: ((400.0, 200.0), (0.125, 1.0))},
        None,
    ),
    "inverse time": (
        "G93 G1 X10 F30\nX20 F60\nG94 X30 F100\n", {4: TWO, 5: (200.0,)},
        "G93 G1 X2.5 F160.0\nX10 F26.66666\nX20 F20.0\nG94 X30 F100\n",
    ),
    "feed per revolution": (
        "G95 G1 X10 F0.1\nX20\nS500 X30\nX40\n", {4: TWO, 6: (25.0,)},
        "G95 G1 X2.5 F0.4\nX10 F0.2\nX20 F0.1\nS500 X30 F0.05\nX40 F0.1\n",
    ),
    "G53 and G28 stay": (
        "G1 X1 F100\nG53 G1 X10 F200\nX20\nG28 X1\nX3\n", {4: (30.0,), 5: (100.0,), 8: (70.0,)},
        "G1 X1 F30.0\nG53 G1 X10 F200\nX20\nG28 X1\nX3 F70.0\n",
    ),
    "offsets": (
        "G0 X5\nG92 X0 Y0\nG1 X10 F100\nG55 X20\n", {6: TWO, 7: TWO},
        "G0 X5\nG92 X0 Y0\nG1 X2.5 F400.0\nX10 F200.0\nG55 X12.5 F400.0\nX20 F200.0\n",
    ),
    "block delete is not split": (
        "G1 X1 F100\n/X2 F50\nX3\n", {5: TWO}, "G1 X1 F100\n/X2 F200.0\nX3 F50.0\n",
    ),
    "position parameter is not split": ("G1 X[#5420+4] F300\n", {4: TWO}, "G1 X[#5420+4] F200.0\n"),
    "too short to split": ("G1 X0.015 F300\n", {4: TWO}, "G1 X0.015 F200.0\n"),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_golden(name, end):
    body, edits, want = CASES[name]
    if not body.lstrip("N0123456789 ").upper().startswith(("G", "F", "#")):
        body, edits, want = "G1\n" + body, {k + 1: v for k, v in edits.items()}, "G1\n" + want
    _, written = rewrite((HEAD + body).replace("\n", end), edits)
    if want is not None:
        assert written.data.decode().replace(end, "\n") == HEAD + want


def test_the_worked_example_byte_for_byte():
    head = b"%\r\nO1\r\nS1 M3 G1\r\n"
    program = read(head + b"N60 X10 F600 \r\nN70 X20\r\nN80 Y10\r\nN90 X0\r\nM30\r\n%\r\n")
    edits = {
        4: BlockEdit(4, (1500.0,), (1.0,)),
        5: BlockEdit(5, (600.0,), (1.0,)),
        6: BlockEdit(6, (6000 / 7,), (1.0,)),
    }
    written = rewrite_feeds(program, edits)
    assert written.data == (
        head + b"N60 X10 F1500.0 \r\nN70 X20 F600.0\r\nN80 Y10 F857.1\r\nN90 X0 F600.0\r\nM30\r\n%\r\n"
    )
    assert written.source_line == tuple(range(1, 10))


def test_source_lines_follow_inserted_blocks():
    _, written = rewrite(HEAD + "G1 X10 F600\nX0", {4: (1.0, 2.0, 3.0), 5: (4.0, 5.0)})
    assert written.source_line == (1, 2, 3, 4, 4, 4, 5, 5)
    assert written.data.endswith(b"X0 F5.0")


def test_refused_cuts_and_blocks_left_alone_are_named():
    _, written = rewrite(HEAD + "G1 X1 F100\nG53 G1 X10 F200\n/X20\n", {5: (100.0,), 6: (70.0, 80.0)})
    assert (written.untouched, written.unsplit) == ((5,), (6,))


@pytest.mark.parametrize("skip", [False, True])
def test_block_delete_follows_the_switch_of_the_reader(skip):
    _, written = rewrite(HEAD + "G1 X1 F100\n/X2 F50\nX3\n", {4: (70.0,)}, block_delete=skip)
    assert written.data.decode() == HEAD + "G1 X1 F70.0\n/X2 F50\nX3" + (" F100.0\n" if skip else "\n")


def test_inch_programs_are_written_in_inches_and_rounded_down():
    again, written = rewrite(
        "G20 G90\nS1 M3\nG0 X0\nG1 X1 F10\nX2\nG21 X80\n", {4: ((700.0, 800.0), (0.5, 1.0))}
    )
    assert written.data == b"G20 G90\nS1 M3\nG0 X0\nG1 X0.5 F27.559\nX1 F31.496\nX2 F10.0\nG21 X80\n"
    assert again.moves[1].feed_mm_min <= 700.0


@pytest.mark.parametrize("comment", ["(größer)", "(gr\xf6\xdfer \xff)", "; ünï\u2028 F9"])
def test_bytes_of_comments_survive_in_any_encoding(comment):
    for codec in ("utf-8", "latin-1", "utf-8-sig"):
        try:
            data = (HEAD + f"G1 X10 F5 {comment}\nX0\n").encode(codec)
        except UnicodeEncodeError:
            continue
        program = parse_program(data, "x.nc")
        assert rewrite_feeds(program, {}).data == data
        want = data.replace(b"F5", b"F7.0").replace(b"X0\n", b"X0 F5.0\n").replace(b"G0 X0 F5.0", b"G0 X0")
        assert rewrite_feeds(program, {4: BlockEdit(4, (7.0,), (1.0,))}).data == want


@pytest.mark.parametrize(
    ("edit", "error", "text"),
    [
        (BlockEdit(4, (float("nan"),), (1.0,)), FeedError, "feed nan"),
        (BlockEdit(4, (-3.0,), (1.0,)), FeedError, "not a positive"),
        (BlockEdit(4, (3.0, 4.0), (1.0,)), FeedError, "2 feeds for 1"),
        (BlockEdit(4, (3.0, 4.0), (0.5, 0.9)), FeedError, "do not rise"),
        (BlockEdit(4, (3.0, 4.0, 5.0), (0.5, 0.5, 1.0)), FeedError, "do not rise"),
        (BlockEdit(4, (1e-3,), (1.0,)), NCError, "too small"),
        (BlockEdit(3, (3.0,), (1.0,)), NCError, "no feed motion"),
        (BlockEdit(99, (3.0,), (1.0,)), NCError, "no feed motion"),
    ],
)
def test_edits_that_cannot_be_are_refused(edit, error, text):
    program = read(HEAD + "G1 X10 F5\n")
    with pytest.raises(error, match=text):
        rewrite_feeds(program, {edit.line: edit})


def test_a_program_with_errors_is_refused():
    program = parse_program((HEAD + "G1 X10 F5 X\n").encode(), "bad.nc")
    with pytest.raises(NCError, match=r"bad\.nc:4"):
        rewrite_feeds(program, {})


def test_a_line_that_grows_too_long_is_refused():
    program = read(HEAD + "G1 X10 F5 (" + "c" * 240 + ")\nX5\n")
    with pytest.raises(NCError, match="characters"):
        rewrite_feeds(program, {4: BlockEdit(4, (1234.5,), (1.0,))})


@pytest.mark.parametrize("mode", ["G90", "G91"])
def test_inverse_time_is_that_of_the_piece_as_written(mode):
    """0.062 of 1.898 mm end at 0.117676, written 0.11768: 3e-5 longer, and driven no faster than asked."""
    program = parse_program(f"G21 G1 G94 F500 X0 Y0 Z0\nG93 {mode}\nY1.898 F2\nM2\n".encode(), "test.nc")
    written = rewrite_feeds(program, {3: BlockEdit(3, (3.796, 3.796), (0.062, 1.0))})
    again = parse_program(written.data, "test.nc")
    first, second = (move for move in again.moves if move.end[1] > 0)
    assert first.end[1] == pytest.approx(0.11768, abs=1e-9) and second.end[1] == pytest.approx(
        1.898, abs=1e-9
    )
    for move in (first, second):
        assert 3.796 * (1.0 - 1e-6) <= move.feed_mm_min <= 3.796 * (1.0 + 1e-9)
