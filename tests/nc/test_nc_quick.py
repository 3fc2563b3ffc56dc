"""The short cut of the reader against its long way: a word that means nothing (M48) sends every block the long way."""

from __future__ import annotations

import math
import random
import re

import pytest

from vmachining.nc import ToolEntry, blocks, move_record, parse_program
from vmachining.nc.quick import Repeated, Templates

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


CALLS = ["G81{} Z-3 R1", "G99 G83{} Z-5.5 R2 Q2", "G98 G83{} Z-5.5 R2 Q2", "G82{} Z-1 R1 P0.5", "G73{} Z-4 R1 Q1.5",
         "G84{} Z-2 R1", "G85{} Z-2 R1", "G86{} Z-2 R1 P.1", "G89{} Z-2 R1 P.1", "G81{} R1 Z-2 F60",
         "G90 G81{} Z-3 R1 L2"]  # fmt: skip
BETWEEN = [
    "G80", "G98", "G99", "G91", "G90", "G54", "G55", "G43 H1", "G49", "G20", "G21", "G92 X1", "G18", "G17", "F70", "F80",
    "S5 M3", "M8", "M9", "G0 Z9", "G0 Z.5", "G1 Z-1", "G10 L2 P1 X3 R20", "G10 L2 P1 X0 R0", "G0 A5", "Z-3.5", "R1.5", "L2 X7",
]  # fmt: skip


def place(rng: random.Random) -> str:
    return " ".join(letter + rng.choice((number(rng), "7")) for letter in "XY" if rng.random() < 0.8)


def series(rng: random.Random) -> list[str]:
    """A call of a cycle, holes, what may stand between them, and mostly an end."""
    out = [rng.choice(CALLS).format(f" {place(rng)}" if rng.random() < 0.8 else "")]
    for _ in range(rng.randrange(1, 7)):
        out.append(place(rng) or "X1")
        if rng.random() < 0.12:
            out.append(rng.choice(BETWEEN))
    return [
        *out,
        *(["G80"] if rng.random() < 0.7 else []),
        *([rng.choice(BETWEEN)] if rng.random() < 0.2 else []),
    ]


@pytest.mark.parametrize("dialect", ["iso", "fanuc"])
@pytest.mark.parametrize("seed", range(4))
def test_holes_that_repeat_a_pattern_are_those_of_the_long_way(dialect, seed, monkeypatch):
    rng = random.Random(1000 + seed)
    body = [text for _ in range(50) for text in ("G90 G17 G21 G94", *series(rng))]
    body = [f"N{k}{text}" if rng.random() < 0.2 else text for k, text in enumerate(body, 1)]
    if seed % 3 == 0:
        body += ["M98 P7 L3", "M98 P7"]
    head = ["O1" if dialect == "fanuc" else "G21", "G21 G90 G17 G94 F50 S1 M3", "T1 M6", "M3", "G0 Z9"]
    tail = ["M2", "O7", "G81 X1 Y2 Z-1 R1", "X3", "X4 Y5", "G80", "M99"]
    data = "\n".join([*head, *body, *tail]).encode()
    options = {"dialect": dialect, "tools": TOOLS, "rotary": "A", "work_offsets": {"G55": (1.0, 2.0, 3.0)}}
    taken, real = [], Repeated.moves
    monkeypatch.setattr(Repeated, "moves", lambda *a: taken.append(real(*a)) or taken[-1])
    short = parse_program(data, "p", **options)
    monkeypatch.setattr(blocks, "AGAIN", re.compile("(?!)"))
    long = parse_program(data, "p", **options)
    assert (short.moves, short.findings) == (long.moves, long.findings)
    assert sum(made is not None for made in taken) > 20


def test_a_pattern_of_another_level_offset_or_feed_is_not_taken():
    """Smallest programs: the second hole differs by what stands between, and lies where the control puts it."""
    head = "G21 G90 S1 M3 F100\nG0 X0 Y0 Z5\nG81 X1 Y1 Z-1 R1\nX2\n"
    for between, level, feed in (
        ("G0 Z9\nG81 X2 Z-1 R1", 9.0, 100.0),
        ("F50", 5.0, 50.0),
        ("G99", 1.0, 100.0),
    ):
        moves = parse_program(f"{head}{between}\nX3\nX4\nM2".encode(), "p").moves
        assert (moves[-1].end, moves[-2].feed_mm_min) == ((4.0, 1.0, level), feed)
    moves = parse_program(f"{head}G92 X0 Y0\nX3\nX4 Y7\nM2".encode(), "p").moves
    assert moves[-1].end == (6.0, 8.0, 5.0) and moves[-1].end_program == (4.0, 7.0, 5.0)


def contour(rng: random.Random) -> list[str]:
    """Compensation on, lines and arcs of half and whole turns, levels, feeds and dwells, and off again."""
    x, y = rng.randrange(-90, 90), rng.randrange(-90, 90)
    out = [
        f"G0 X{x} Y{y}",
        rng.choice(("G41 D1", "G42 D1", "G41", "G42 D2")) + f" G1 X{x + 30} F{rng.randrange(50, 99)}",
    ]
    for _ in range(rng.randrange(2, 9)):
        dx, dy = rng.randrange(-60, 60), rng.randrange(-60, 60)
        out.append(rng.choice((
            f"G1 X{x + dx} Y{y + dy}", f"X{x + dx}.5", f"Y{y + dy}", f"G2 X{x + dx} Y{y + dy} R{abs(dx) + abs(dy) + 9}",
            f"G91 G3 X{dx} Y{dy} I{dx / 2} J{dy / 2}", f"G90 G1 X{x + dx} Y{y + dy} F{abs(dx) + 9}", f"G91 G1 X{dx} Y{dy}",
            f"Z-{rng.randrange(9)}", f"G1 X{x + dx} Y{y + dy} Z-3", f"G90 G0 X{x + dx}", "G4 P.1", "M8", "X#1", "Y[#1+2]",
            "G1 G90",
        )))  # fmt: skip
    return [*out, f"G90 G40 G1 X{x} Y{y} F90", "G91 X5" if rng.random() < 0.2 else "X9", "G90"]


@pytest.mark.parametrize("dialect", ["iso", "fanuc"])
@pytest.mark.parametrize("corner", ["arc", "exact", "line"])
def test_compensated_moves_are_those_of_the_long_way(dialect, corner, monkeypatch):
    rng = random.Random(f"{dialect} {corner}")
    head = [
        "O1" if dialect == "fanuc" else "G21",
        "G21 G90 G17 G94 F50 S1 M3",
        "#1=2",
        "T1 M6",
        "M3",
        "G0 Z9",
    ]
    data = "\n".join([*head, *(text for _ in range(20) for text in contour(rng)), "M2"]).encode()
    options = {
        "dialect": dialect,
        "crc_corner": corner,
        "tools": {1: ToolEntry(1, 6.0, 0.0), 2: ToolEntry(2, 1.0, 0.0)},
    }
    taken, real = [], blocks.offset
    monkeypatch.setattr(blocks, "offset", lambda *a: taken.append(real(*a)) or taken[-1])
    short = parse_program(data, "p", **options)
    monkeypatch.setattr(blocks, "BLOCK", re.compile("(?!)"))
    monkeypatch.setattr(Templates, "words", lambda self, line: None)
    long = parse_program(data, "p", **options)
    assert len(short.moves) == len(long.moves) > 50 and short.findings == long.findings
    for one, two in zip(short.moves, long.moves, strict=True):
        for name, a, b in zip(one._fields, one, two, strict=True):
            assert a == b or a == pytest.approx(b, abs=1e-9, rel=1e-12), (name, one, two)
    assert sum(made is not None for made in taken) > 20


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
