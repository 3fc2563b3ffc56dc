"""Random programs with awkward features: any edit keeps the path, every other feed and every other byte."""

from __future__ import annotations

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from readback import check

from vmachining.nc import parse_program
from vmachining.nc.rewrite import BlockEdit, rewrite_feeds

TERMS = {"G17": ("X", "Y", "I", "J", "Z"), "G18": ("Z", "X", "K", "I", "Y"), "G19": ("Y", "Z", "J", "K", "X")}


class Writer:
    """Writes random correct blocks, and keeps the position and modes a programmer would."""

    def __init__(self, pick) -> None:
        self.pick = pick
        self.inch, self.absolute, self.centers, self.mode = pick.random() < 0.4, True, False, 94
        self.at = dict.fromkeys("XYZ", 0.0)
        self.number = 10
        unit = "G20" if self.inch else "G21"
        feed = pick.choice(["500", "200.5", " 1 2 3"])
        self.lines = [
            "%",
            "O12 (F100 in a comment)",
            f"{unit} G90 G94 G17",
            "S1000 M3",
            "G0 X0 Y0 Z0",
            f"F{feed}",
        ]

    def word(self, letter: str, value: float) -> str:
        text = f"{value:.4f}".rstrip("0").rstrip(".")
        shown = letter.lower() if self.pick.random() < 0.2 else letter
        return shown + ("0" if text in ("", "-0") else text)

    def target(self, letter: str, value: float) -> str:
        """End word; G91 moves by the rounded difference."""
        delta = round(value - self.at[letter], 4)
        self.at[letter] = value if self.absolute else self.at[letter] + delta
        return self.word(letter, value if self.absolute else delta)

    def feed(self) -> str:
        if self.mode == 93:
            return f"F{self.pick.choice([2, 0.5, 33.3])}"
        return self.pick.choice(["", "", "F300", "F450.25", "F80", "F1234.567", "f600", "F[100*3+7]"])

    def block(self, words: list[str]) -> None:
        pick = self.pick
        gap = pick.choice([" ", "", "  "])
        head = pick.choice(["", "", f"N{self.number}", "/"])
        self.number += 10
        tail = pick.choice(["", "", " (F999 end)", " ; F9", " ", "\t"])
        self.lines.append(head + gap + gap.join(word for word in words if word) + tail)

    def line(self) -> None:
        pick = self.pick
        letters = pick.sample("XYZ", pick.randint(1, 3))
        ends = [self.target(c, round(pick.uniform(-30, 30), pick.choice([0, 1, 3]))) for c in letters]
        self.block(["G1", *ends, self.feed(), pick.choice(["", "", "M9", "M8", "M1"])])

    def rapid(self) -> None:
        self.block(["G0", self.target("X", float(self.pick.randint(-20, 20)))])

    def offset(self) -> None:
        self.lines.append("G92 X5 Y-3")
        self.at |= {"X": 5.0, "Y": -3.0}

    def modes(self) -> None:
        pick = self.pick
        code = pick.choice(["G90", "G91", "G93", "G94", "G95", "G90.1", "G91.1", "G20", "G21"])
        more = ""
        if code in ("G93", "G94", "G95"):
            self.mode = int(code[1:])
            more = {93: "", 94: f" F{pick.choice([400, 0.2])}", 95: " F0.15"}[self.mode]
        elif code in ("G20", "G21"):
            if self.inch != (code == "G20"):
                factor = 1 / 25.4 if code == "G20" else 25.4
                self.at = {letter: value * factor for letter, value in self.at.items()}
            self.inch = code == "G20"
            more = f" G1 {self.target('X', 3.0)}{self.feed()}" if pick.random() < 0.5 else ""
        elif code in ("G90", "G91"):
            self.absolute = code == "G90"
        else:
            self.centers = code == "G90.1"
        self.lines.append(code + more)

    def arc(self, full: bool = False) -> None:
        """An arc about a random centre, or a circle of one or two turns; sometimes a helix."""
        pick = self.pick
        plane, code = pick.choice(["G17", "G18", "G19"]), pick.choice(["G2", "G3"])
        a, b, i, j, third = TERMS[plane]
        radius, toward = pick.uniform(2, 20), pick.uniform(0, 6.28)
        origin = (0.0, 0.0) if self.centers else (self.at[a], self.at[b])
        c = [round(self.at[a] - radius * np.cos(toward), 4), round(self.at[b] - radius * np.sin(toward), 4)]
        begin = np.arctan2(self.at[b] - c[1], self.at[a] - c[0])
        r = float(np.hypot(self.at[a] - c[0], self.at[b] - c[1]))
        sweep = pick.uniform(0.2, 6.0) * (1 if code == "G3" else -1)
        words = [plane, code]
        if not full:
            words.append(self.target(a, round(c[0] + r * np.cos(begin + sweep), 4)))
            words.append(self.target(b, round(c[1] + r * np.sin(begin + sweep), 4)))
        if pick.random() < 0.4:
            words.append(self.target(third, round(pick.uniform(-5, 5), 2)))
        if not full and pick.random() < 0.4:
            words.append(self.word("R", round(r, 4) * (-1 if abs(sweep) > np.pi else 1)))
        else:
            words += [self.word(i, c[0] - origin[0]), self.word(j, c[1] - origin[1])]
            words.append("P2" if full and pick.random() < 0.3 else "")
        self.block([*words, self.feed()])

    def circle(self) -> None:
        self.arc(full=True)


@st.composite
def programs(draw) -> str:
    """A correct program of lines, arcs and rapids in any plane, unit, distance and feed mode."""
    pick = draw(st.randoms(use_true_random=False))
    writer = Writer(pick)
    kinds = [writer.line] * 3 + [writer.arc] * 2 + [writer.circle, writer.rapid, writer.modes, writer.offset]
    for _ in range(pick.randint(2, 12)):
        pick.choice(kinds)()
    end = pick.choice(["\n", "\r\n", "\r"])
    return end.join([*writer.lines, "N9000 G0 Z5 M5", "M30", "%"]) + pick.choice(["", end])


@st.composite
def edited(draw):
    """A program and edits of some of its feed blocks."""
    text = draw(programs())
    program = read_any(text)
    pick = draw(st.randoms(use_true_random=False))
    edits = {}
    for move in program.moves:
        if move.feed_mm_min is None or pick.random() < 0.4:
            continue
        count = pick.choice([1, 1, 2, 3, 5])
        ends = [*sorted({round(pick.uniform(0.02, 0.98), 3) for _ in range(count - 1)}), 1.0]
        feeds = tuple(pick.choice([move.feed_mm_min, 600.0, 857.1, 1500.0, 123.45678]) for _ in ends)
        edits[move.line] = BlockEdit(move.line, feeds, tuple(ends))
    return program, edits


def read_any(text: str):
    return parse_program(text.encode(), "test.nc")


@settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much]
)
@given(edited())
def test_any_edit_keeps_the_path_and_every_other_feed(case):
    program, edits = case
    if program.errors:
        return
    again, written = check(program, edits)
    # its own feeds, wanted again, change nothing
    kept = rewrite_feeds(
        again, {m.line: BlockEdit(m.line, (m.feed_mm_min,), (1.0,)) for m in again.moves if m.feed_mm_min}
    )
    assert kept.data == written.data


@settings(max_examples=30, deadline=None)
@given(programs())
def test_without_edits_the_bytes_stay(text):
    program = read_any(text)
    if not program.errors:
        assert rewrite_feeds(program, {}).data == program.data


@settings(max_examples=60, deadline=None)
@given(edited())
def test_the_same_feeds_again_change_nothing(case):
    program, edits = case
    if program.errors:
        return
    single = {k: BlockEdit(k, (min(edit.feeds_mm_min),), (1.0,)) for k, edit in edits.items()}
    once = rewrite_feeds(program, single)
    twice = rewrite_feeds(read_any(once.data.decode()), single)
    assert twice.data == once.data
