"""Statements about all programs."""

from __future__ import annotations

import math
from itertools import pairwise

from hypothesis import given, settings
from hypothesis import strategies as st

from vmachining.errors import NCError
from vmachining.nc import CATALOGUE, Motion, lex_line, move_record, parse_program

more = settings(max_examples=150)

NUMBERS = st.decimals(-999, 999, places=3).map(str)
AXES = st.dictionaries(st.sampled_from("XYZ"), NUMBERS, min_size=1)
HEAD = "G21 G90 F100 S10 M3\nG0 X0 Y0 Z0\n"
BLOCKS = st.one_of(
    st.tuples(st.sampled_from(["G0", "G1", "G01"]), AXES).map(
        lambda t: [t[0], *(a + v for a, v in t[1].items())]
    ),
    st.tuples(st.sampled_from(["G2", "G3"]), NUMBERS, NUMBERS).map(lambda t: [t[0], "I" + t[1], "J" + t[2]]),
    st.tuples(st.sampled_from(["G92", "G28", "G55 G0", "G53 G90 G0"]), AXES).map(
        lambda t: [*t[0].split(), *(a + v for a, v in t[1].items())]
    ),
    st.sampled_from(
        ["G90", "G91", "G54", "G92.1", "F50", "M5", "M3", "G61", "G40", "G80", "G98", "G99", "G18"]
    ).map(lambda w: [w]),
    st.tuples(st.sampled_from(["G81", "G85", "G10 L2 P1", "G52", "G41.1 D2", "G42.1 D6"]), AXES).map(
        lambda t: [*t[0].split(), *([] if "." in t[0] else [a + v for a, v in t[1].items()])]
    ),
    st.tuples(st.sampled_from(["G83 Q99", "G82 P1", "G73 Q70 L2"]), NUMBERS, NUMBERS).map(
        lambda t: [*t[0].split(), "X" + t[1], "R" + t[2], "Z-999"]
    ),
    st.integers(-180, 180).map(lambda r: ["G10", "L2", "P1", f"R{r}"]),
    st.tuples(st.sampled_from(["G0", "G1"]), NUMBERS, NUMBERS).map(lambda t: [t[0], "@" + t[1], "^" + t[2]]),
)


@more
@given(blocks=st.lists(BLOCKS, max_size=8), data=st.data())
def test_order_case_and_blanks_mean_nothing(blocks, data):
    plain = HEAD + "\n".join("".join(words) for words in blocks)
    other = HEAD
    for words in blocks:
        text = data.draw(st.sampled_from(["", " ", "\t"])).join(data.draw(st.permutations(words)))
        other += data.draw(st.sampled_from([text.lower(), text.upper(), " " + "  ".join(text) + " "])) + "\n"
    a, b = parse_program(plain.encode(), "a"), parse_program(other.encode(), "b")
    assert a.moves == b.moves
    assert sorted((f.line, f.code) for f in a.findings) == sorted((f.line, f.code) for f in b.findings)


@more
@given(blocks=st.lists(BLOCKS, max_size=10))
def test_short_cut_and_long_way_agree(blocks):
    text = HEAD + "\n".join(" ".join(words) for words in blocks)
    slow = text.replace("\n", "()\n") + "()"  # a comment keeps a line from the short cut
    assert parse_program(text.encode(), "a").moves == parse_program(slow.encode(), "b").moves


@more
@given(blocks=st.lists(BLOCKS, max_size=10))
def test_path_is_continuous_and_arcs_are_round(blocks):
    moves = parse_program((HEAD + "\n".join(" ".join(b) for b in blocks)).encode(), "a").moves
    for before, after in pairwise(moves):
        assert before.end == after.start
    for move in moves:
        if move.center is not None:
            radii = [math.dist(p[:2], move.center) for p in (move.start, move.end)]
            assert abs(radii[0] - radii[1]) <= 2.9 + 1e-9 * radii[0]
        feeds = move.motion not in (Motion.RAPID, Motion.DWELL)
        assert (move.feed_mm_min is not None and move.feed_mm_min > 0) == feeds
        assert move_record(move)["end_mm"] == list(move.end_machine)


@more
@given(points=st.lists(st.tuples(NUMBERS, NUMBERS), min_size=1, max_size=6))
def test_inches_and_millimetres(points):
    inch = "G20\n" + "\n".join(f"G0 X{x} Y{y}" for x, y in points)
    mm = "G21\n" + "\n".join(f"G0 X[{x} * 25.4] Y[{y} * 25.4]" for x, y in points)
    for a, b in zip(
        parse_program(inch.encode(), "a").moves, parse_program(mm.encode(), "b").moves, strict=True
    ):
        assert math.dist(a.end, b.end) < 1e-9


LIKELY = st.text("GGXYZMNFSTPRIJKH0123456789.+-#<>=[]()/%;:O \t\n\r'é", max_size=60)


@given(data=st.one_of(st.binary(max_size=80), LIKELY.map(str.encode)))
@settings(max_examples=600)
def test_nothing_breaks_the_reader(data):
    try:
        program = parse_program(data, "fuzz")
    except NCError:
        return
    lines = data.decode("utf-8-sig", errors="replace").replace("\r\n", "\n").replace("\r", "\n").split("\n")
    for finding in program.findings:
        assert finding.code in CATALOGUE
        assert 1 <= finding.line <= max(1, len(lines)) and finding.col >= 1


@given(text=LIKELY.filter(lambda t: "\n" not in t and "\r" not in t))
@settings(max_examples=600)
def test_spans_never_overlap_and_cover_their_text(text):
    line = lex_line(text)
    spans = [
        (s.col, s.length) for part in (line.words, line.comments, line.errors, line.assignments) for s in part
    ]
    places = sorted(spans)
    for (col, length), (following, _) in pairwise(places):
        assert col + length <= following
    for word in line.words:
        assert text[word.col - 1 : word.col - 1 + word.length] == word.text == word.text.strip(" \t")
