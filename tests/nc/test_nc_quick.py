"""The short cut of the reader against its long way: a word that means nothing (M48) sends every block the long way."""

from __future__ import annotations

import math
import random
import re

import pytest

from vmachining.nc import ToolEntry, blocks, move_record, parse_program
from vmachining.nc.templates import Templates

TOOLS = {1: ToolEntry(1, 10.0, 50.0)}
MODES = [
    "G90",
    "G91",
    "G17",
    "G18",
    "G19",
    "G20",
    "G21",
    "G94 F100",
    "G93",
    "G54",
    "G55",
    "G43 H1",
    "G49",
    "M5",
    "M3",
    "G92 X1",
    "#1=[#1+1]",
]


def number(rng: random.Random) -> str:
    return rng.choice(("{:.3f}", "{:.0f}", "{:.1f}", "{:.0f}.")).format(
        rng.choice((-1, 1)) * rng.random() * 20
    )


def value(rng: random.Random, terms: bool) -> str:
    kind = rng.random() if terms else 1.0
    if kind < 0.2:
        return rng.choice(("#1", "-#1", "#<a>", "#[#1 * 0 + 2]", "#7"))
    if kind < 0.5:
        return f"[{number(rng)} {rng.choice('+-*/')} #1 {rng.choice(('+', '-', 'MOD', 'GT'))} {abs(float(number(rng))) + 1:.2f}]"
    if kind < 0.6:
        return rng.choice(
            (f"[SIN[{number(rng)}]*9]", f"ATAN[{number(rng)}]/[#1]", f"[SQRT[#1]-{number(rng)}]")
        )
    return number(rng)


def line(rng: random.Random, count: int, here: str) -> str:
    if rng.random() < 0.15:
        return rng.choice(MODES)
    terms = rng.random() < 0.4
    words = [f"N{count * 10 if rng.random() < 0.9 else 5}"] if rng.random() < 0.5 else []
    code = rng.choice(("", "", "G0", "G1", "G01", "G2", "G3"))
    words += [code] if code else []
    words += [letter + value(rng, terms) for letter in "XYZ" if rng.random() < 0.5]
    words += [letter + value(rng, terms) for letter in "AC" if rng.random() < 0.1]
    if code in ("G2", "G3") or rng.random() < 0.1:  # a full circle, or one that is mostly wrong
        words = [w for w in words if w[0] not in "XYZ"] + [here] if rng.random() < 0.5 else words
        words += [letter + number(rng) for letter in "IJK" if rng.random() < 0.5]
    words += [f"F{abs(float(number(rng))) + 1:.1f}"] if rng.random() < 0.3 else []
    words += ["#1=[#1 + 0.5]"] if rng.random() < 0.1 else []
    return (" " if rng.random() < 0.5 else "").join(words)


@pytest.mark.parametrize("dialect", ["iso", "fanuc"])
@pytest.mark.parametrize("seed", range(12))
def test_both_ways_make_the_same_moves(dialect, seed):
    rng, here = random.Random(seed), "X#5420 Y#5421" if dialect == "iso" else "X#5041 Y#5042"
    body = [line(rng, count, here) for count in range(150)]
    head = [
        "O1" if dialect == "fanuc" else "G21",
        "G21 G90 G17 G94 F50 S1 M3",
        "#1=2 #2=5",
        "T1 M6",
        "A0 C0 G0",
    ]
    head += ["#<a>=3"] if dialect == "iso" else []
    options = {"dialect": dialect, "tools": TOOLS, "rotary": "AC", "work_offsets": {"G55": (1.0, 2.0, 3.0)}}
    short = parse_program("\n".join([*head, *body, "M2"]).encode(), "p", **options)
    slow = [re.sub(r"(?=#1=)|$", " M48 ", text, count=1) if text else text for text in body]
    long = parse_program("\n".join([*head, *slow, "M2"]).encode(), "p", **options)
    assert len(short.moves) == len(long.moves) > 30
    for one, two in zip(short.moves, long.moves, strict=True):
        for name, a, b in zip(one._fields, one, two, strict=True):
            assert a == b or a == pytest.approx(b, abs=1e-9, rel=1e-12), (name, one, two)
    kept = ("M48", "I214")
    notes = [[(f.line, f.code, f.message) for f in p.findings if f.word != kept[0]] for p in (short, long)]
    assert notes[0] == notes[1]


def test_moves_carry_spindle_and_coolant_on_both_ways():
    text = "G21 S9 M3 M8 F1\nG1 X1\nM7\nX2\nX3 M48\nM9 M5\nG0 X4\nX5 A1\nA2 M8\nX6\nM2"
    moves = parse_program(text.encode(), "p", rotary="A").moves
    records = [move_record(move) for move in moves]
    assert [r["spindle_rpm"] for r in records] == [9, 9, 9, 0, 0, 0, 0]
    assert [r["coolant"] for r in records] == ["flood", *["mist and flood"] * 2, "", "", "flood", "flood"]


def test_inverse_time_after_a_tool_length_counts_the_way_of_the_machine():
    """G43 with a tool of 12.7 mm: the control sees Z-12.7, so the block is hypot(20.2, 5, 23.4411 + 12.7) long."""
    tools = {1: ToolEntry(1, 1.0, 12.7)}
    text = "G21 S1 M3\nT1 M6\nM3\nG43 H1\nG93\nG1 X-20.2 Y5 Z23.4411 F6.7\nX0 F2\nM2"
    first, second = parse_program(text.encode(), "p", tools=tools, home=(0.0, 0.0, 0.0)).moves
    assert first.feed_mm_min == pytest.approx(6.7 * math.hypot(20.2, 5.0, 36.1411), rel=1e-12)
    assert second.feed_mm_min == pytest.approx(40.4, rel=1e-12)


@pytest.mark.parametrize("dialect", ["iso", "fanuc"])
def test_cycles_make_no_rapid_without_length_and_none_above_their_plane(dialect):
    """Q below the clearance of pecks, and levels in inches that differ by a rounding."""
    head = "O1\n" if dialect == "fanuc" else ""
    text = (
        head
        + "G20 G90 G98 S1 M3 F9\nG0 X0 Y0 Z1.1\nG0 Z[1.1-1]\nG83 X1 R.1 Z-.3 Q.15\nG81 X2 R.1 Z-.3\nG73 X3 R.1 Z-.3 Q.15\nG80\nM2"
    )
    moves = parse_program(text.encode(), "p", dialect=dialect, tools=TOOLS, home=(0.0, 0.0, 100.0)).moves[2:]
    assert all(math.dist(m.start, m.end) > 1e-6 for m in moves)
    assert max(m.end[2] for m in moves) == pytest.approx(2.54, abs=1e-9)


@pytest.mark.parametrize("dialect", ["iso", "fanuc", "mts"])
@pytest.mark.parametrize(
    "text",
    [
        "N[1] G1 X2",
        "N#1 X2",
        "N-3 X#1",
        "N+3 X#1",
        "N1.5 X#1",
        "G-1 X#1",
        "G- 1 X[2]",
        "G-0 X#1",
        "G+1 X#1",
        "N 7 X3\nN 7 X#1",
        "N99 X1\nn 7 X2",
        "G81 X1 Z-3 R1\nG1 X2\nX#4001\nX#4009",
    ],
)
def test_lines_that_are_odd_are_read_alike_on_both_ways(text, dialect, monkeypatch):
    program = f"O1\nG21 G90 F50 S1 M3\n#1=2\nG0 X0 Y0\n{text}\nX9\nM2".encode()
    short = parse_program(program, "p", dialect=dialect)
    monkeypatch.setattr(blocks, "BLOCK", re.compile("(?!)"))
    monkeypatch.setattr(Templates, "words", lambda self, line: None)
    long = parse_program(program, "p", dialect=dialect)
    assert (short.moves, short.findings) == (long.moves, long.findings)
