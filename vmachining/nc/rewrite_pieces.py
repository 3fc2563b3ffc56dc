"""One block of a program cut into several that drive the same path.

The first piece is the original line with other end words, so that its comments, N, modes, tool and spindle
words stay where they were; the following pieces are new lines of end words only. The last piece ends with the
original end words, verbatim in G90, or in G91 with the exact decimal remainder, so that the end point is the
same to the last bit. Points are written in program coordinates.

Whatever cannot be cut without changing its meaning (cycles, radius compensation, system parameters, ...) is
refused by returning None; the caller then gives the whole block one feed.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from itertools import pairwise
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from vmachining.arrays import Floats
from vmachining.geometry import Arc, Line, arc_between
from vmachining.nc.lexer import LexedLine, Word

if TYPE_CHECKING:
    from vmachining.nc.model import Move

MIN_PIECE_MM: Final = 0.01
"""Shorter pieces are not written: rounded ends would turn the direction, or close an arc to a full circle."""

LINE_DECIMALS: Final = 5
"""In mm; a point off by half of it lies within 1e-5 mm of the line. Inch: one more."""

ARC_DECIMALS: Final = 7
"""In mm; ends and centre are both rounded and the length depends on them to first order. Inch: one more."""

END_DECIMALS: Final = 9
"""Of an end that was not written as a number: it is where the next blocks start."""

R_LIMIT: Final = np.radians(150.0)
"""Largest piece in R form: near 180 degrees the centre depends on the square root of the rounding."""

CENTER_LIMIT: Final = np.radians(300.0)
"""Largest piece in centre form, away from the full circle."""

EVIDENCE_MM: Final = 1e-6
"""How well the words of a block must explain its motion before it is cut."""

KEEPS_MEANING: Final = frozenset(
    {1.0, 2.0, 3.0, 17.0, 18.0, 19.0, 20.0, 21.0, 40.0, 54.0, 55.0, 56.0, 57.0, 58.0, 59.0, 59.1, 59.2, 59.3,
     61.0, 61.1, 64.0, 90.0, 91.0, 90.1, 91.1, 93.0, 94.0, 95.0, 98.0, 99.0}
)  # fmt: skip
"""G codes that may stand in a block that is cut: modes, which the following pieces inherit."""

M_FIRST: Final = frozenset({3.0, 4.0, 6.0, 7.0, 8.0})
M_LAST: Final = frozenset({0.0, 1.0, 2.0, 5.0, 9.0, 30.0, 60.0})
"""M codes that act when the block is over."""

LETTERS: Final = frozenset("NGMFSTXYZIJKRP")
SYSTEM_PARAMETER: Final = re.compile(r"#\s*(?:<\s*_|5\d\d\d|#|\[)")
"""Parameters that may change while the block runs, such as the current position."""

AXES: Final = "XYZ"
CENTERS: Final = "IJK"
NORMAL: Final = {"yz": 0, "zx": 1, "xy": 2}
PLANE: Final = {"yz": (1, 2), "zx": (2, 0), "xy": (0, 1)}


@dataclass(frozen=True, slots=True)
class Modes:
    """What the words of a block mean, as far as rewriting needs to know.

    unit : mm per program unit. feed : 93, 94 or 95. compensated : cutter radius.
    """

    unit: float = 1.0
    absolute: bool = True
    absolute_centers: bool = False
    feed: int = 94
    compensated: bool = False

    def after(self, lexed: LexedLine) -> Modes:
        """Modes in force for the motion of this line."""
        now = self
        codes = {word.value for word in lexed.words if word.letter == "G"}
        for code, change in MODE_CHANGES.items():
            if code in codes:
                now = replace(now, **change)  # type: ignore[arg-type]
        return now


MODE_CHANGES: Final[dict[float, dict[str, float | bool | int]]] = {
    20.0: {"unit": 25.4}, 21.0: {"unit": 1.0}, 90.0: {"absolute": True}, 91.0: {"absolute": False},
    90.1: {"absolute_centers": True}, 91.1: {"absolute_centers": False},
    93.0: {"feed": 93}, 94.0: {"feed": 94}, 95.0: {"feed": 95},
    40.0: {"compensated": False}, 41.0: {"compensated": True}, 42.0: {"compensated": True},
    41.1: {"compensated": True}, 42.1: {"compensated": True},
}  # fmt: skip


def number_text(value: float | Decimal, decimals: int) -> str:
    """Shortest fixed-point text with at most `decimals` and at least one decimal, never "-0.0"."""
    text = f"{value:.{decimals}f}".rstrip("0")
    text = text + "0" if text.endswith(".") else text
    return text[1:] if text.startswith("-") and not text.strip("-0.") else text


@dataclass(slots=True)
class LineEdit:
    """Changes of one line, collected and then applied to its text; everything else stays as it is."""

    lexed: LexedLine
    swaps: dict[int, tuple[int, str]] = field(default_factory=dict)
    added: list[str] = field(default_factory=list)

    def swap(self, word: Word, number: str) -> None:
        """Another number after the same letter."""
        self.swaps[word.col] = (word.length, word.text[0] + number)

    def remove(self, word: Word) -> None:
        """Take the word out, and the blanks before it."""
        self.swaps[word.col] = (word.length, "")

    def add(self, text: str) -> None:
        """A word more, after the last one and before a comment at the end."""
        self.added.append(text)

    def lower(self) -> bool:
        return bool(self.lexed.words) and self.lexed.words[-1].text[0].islower()

    def text(self) -> str:
        out, lexed = self.lexed.text, self.lexed
        places = [(word.col, word.length) for word in lexed.words]
        places += [(item.col, item.length) for item in lexed.assignments]
        if self.added:
            last = max((col - 1 + length for col, length in places), default=len(out))
            glued = len(places) > 1 and all(c + n == d for (c, n), (d, _) in pairwise(sorted(places)))
            gap = "" if glued else " "
            words = [word.lower() if self.lower() else word for word in self.added]
            out = out[:last] + "".join(gap + word for word in words) + out[last:]
        for col, (length, new) in sorted(self.swaps.items(), reverse=True):
            head, tail = out[: col - 1], out[col - 1 + length :]
            if not new:
                head = head.rstrip(" \t")
                tail = tail if head else tail.lstrip(" \t")
            out = head + new + tail
        return out


class Written(NamedTuple):
    """A program with new feeds. lines : ends of lines included. untouched : those that were to get a feed and could not.

    source_line : 1-based line of the original of each; None: the same.
    """

    lines: list[str]
    untouched: tuple[int, ...] = ()
    source_line: tuple[int, ...] | None = None


class Pieces(NamedTuple):
    """A block cut in m pieces. F words are still missing.

    first : changes of the original line. rest : words of each new line. tail : M words that end the last.
    owner : (m,) which of the wanted sub-blocks a piece belongs to. lengths : (m,) mm.
    """

    first: LineEdit
    rest: tuple[tuple[str, ...], ...]
    tail: tuple[str, ...]
    owner: tuple[int, ...]
    lengths: tuple[float, ...]


def split_block(lexed: LexedLine, move: Move, modes: Modes, ends: Sequence[float]) -> Pieces | None:
    """Cut one block at fractions of its path.

    lexed : the line.
    move : its only motion, a line or an arc.
    modes : in force for this block.
    ends : rising fractions where the sub-blocks end, the last is 1.
    Returns None where the block cannot be cut without changing what it means.
    """
    words = {word.letter: word for word in lexed.words}
    path = move_path(move)
    if path is None or not _cuttable(lexed, modes):
        return None
    end = np.array(move.end_program)
    shift = np.array(move.end) - end
    start = np.array(move.start) - shift
    if not _explained(words, move, modes, start, end):
        return None
    fractions, owner = _fractions(path, ends, "R" in words)
    lengths = tuple(float(v) for v in np.diff([0.0, *fractions]) * path.length)
    if min(lengths) < MIN_PIECE_MM:
        return None
    points = np.vstack([start, path.position(fractions[:-1]) - shift, end])
    decimals = (ARC_DECIMALS if isinstance(path, Arc) else LINE_DECIMALS) + (modes.unit != 1.0)
    moved = set(PLANE[move.plane]) if isinstance(path, Arc) else set()
    axes = [a for a in range(3) if AXES[a] in words or a in moved]
    if isinstance(path, Line):  # inverse time is that of the piece as it is written
        base = np.zeros(3) if modes.absolute else start
        inner = points.copy()
        inner[1:-1, axes] = (np.round((points - base) / modes.unit, decimals) * modes.unit + base)[1:-1, axes]
        lengths = tuple(np.linalg.norm(np.diff(inner, axis=0), axis=1).tolist())
    texts = _absolute if modes.absolute else _increments
    targets = [texts(points[:, a] / modes.unit, words.get(AXES[a]), decimals) for a in axes]
    columns = dict(zip((AXES[a] for a in axes), targets, strict=True))
    if isinstance(path, Arc):
        center = path.center - shift
        columns |= _radius_or_center(words, path, points, center, modes, decimals, PLANE[move.plane])
    return _assemble(lexed, columns, owner, lengths)


def move_path(move: Move) -> Line | Arc | None:
    """The path of a feed motion; None for anything else."""
    if move.motion == "linear":
        return Line(move.start, move.end)
    if move.motion not in ("arc_cw", "arc_ccw") or move.center is None:
        return None
    center = list(move.start)
    for axis, value in zip(PLANE[move.plane], move.center, strict=True):
        center[axis] = value
    ccw = move.motion == "arc_ccw"
    return arc_between(move.start, move.end, center, NORMAL[move.plane], ccw=ccw, turns=move.turns)


def _cuttable(lexed: LexedLine, modes: Modes) -> bool:
    """Whether the line is a plain motion block."""
    if lexed.block_delete or lexed.assignments or lexed.label or lexed.errors or modes.compensated:
        return False
    letters = [word.letter for word in lexed.words if word.letter not in "GM"]
    if len(set(letters)) != len(letters) or not set(letters) <= LETTERS:
        return False
    for word in lexed.words:
        if word.letter == "G" and word.value not in KEEPS_MEANING:
            return False
        if word.letter == "M" and word.value not in M_FIRST | M_LAST:
            return False
        if word.value is None and SYSTEM_PARAMETER.search(word.text):
            return False
    return True


def _explained(words: dict[str, Word], move: Move, modes: Modes, start: Floats, end: Floats) -> bool:
    """Whether the words of the block say what the motion does; compensation, rotation and the like do not."""
    arc = move.motion != "linear"
    for axis, letter in enumerate(AXES):
        word = words.get(letter)
        if word is None:
            if abs(end[axis] - start[axis]) > EVIDENCE_MM:
                return False
        elif word.value is not None:
            want = end[axis] if modes.absolute else end[axis] - start[axis]
            if abs(word.value * modes.unit - want) > EVIDENCE_MM:
                return False
    if not arc:
        return not set(words) & set("IJKRP")
    return "P" not in words or words["P"].value == move.turns


def _fractions(
    path: Line | Arc, ends: Sequence[float], radius_form: bool
) -> tuple[list[float], tuple[int, ...]]:
    """Ends of the pieces, and the sub-block each belongs to. Large arcs get more pieces than requested."""
    out: list[float] = []
    owner: list[int] = []
    for k, (a, b) in enumerate(pairwise([0.0, *ends])):
        count = 1
        if isinstance(path, Arc):
            limit = R_LIMIT if radius_form else CENTER_LIMIT
            count = max(1, int(np.ceil((b - a) * abs(path.angle) / limit * (1 - 1e-12))))
        out += [a + (b - a) * j / count for j in range(1, count)] + [b]
        owner += [k] * count
    return out, tuple(owner)


def _absolute(values: Floats, word: Word | None, decimals: int) -> list[str]:
    """Targets in G90; the last one verbatim where it was written."""
    texts = [number_text(v, decimals) for v in values[1:].tolist()]
    texts[-1] = number_text(values[-1], END_DECIMALS) if word is None else word.text[1:]
    return texts


def _increments(values: Floats, word: Word | None, decimals: int) -> list[str]:
    """Steps in G91 whose decimal sum is exactly the programmed one."""
    step = Decimal(1).scaleb(-decimals)
    travel = [Decimal(v).quantize(step) for v in (values[1:] - values[0]).tolist()]
    if word is not None and word.value is not None:
        travel[-1] = Decimal(re.sub(r"[ \t]", "", word.text[1:]))
    else:
        travel[-1] = Decimal(values[-1] - values[0]).quantize(Decimal(1).scaleb(-END_DECIMALS))
    places = max(decimals, *(-int(t.as_tuple().exponent) for t in travel))
    return [number_text(b - a, places) for a, b in pairwise([Decimal(0), *travel])]


def _radius_or_center(
    words: dict[str, Word],
    arc: Arc,
    points: Floats,
    center: Floats,
    modes: Modes,
    decimals: int,
    plane: tuple[int, int],
) -> dict[str, list[str]]:
    """Columns R, or two of I J K, of an arc in pieces."""
    count = len(points) - 1
    if (radius := words.get("R")) is not None:
        literal = re.sub(r"[ \t+-]", "", radius.text[1:]) if radius.value is not None else None
        return {"R": [literal or number_text(arc.radius / modes.unit, decimals)] * count}
    out: dict[str, list[str]] = {}
    for axis in sorted(plane):
        # a piece starts at the point as written, so its centre is seen from there
        begins = [points[0, axis], *np.round(points[1:-1, axis] / modes.unit, decimals) * modes.unit]
        offsets = [center[axis] if modes.absolute_centers else center[axis] - begin for begin in begins]
        out[CENTERS[axis]] = [number_text(v / modes.unit, decimals) for v in offsets]
    return out


def _assemble(
    lexed: LexedLine, columns: dict[str, list[str]], owner: tuple[int, ...], lengths: tuple[float, ...]
) -> Pieces:
    """The edited first line and the words of the others; end words keep their order and letter case."""
    first = LineEdit(lexed)
    tail: list[str] = []
    order: list[tuple[str, str]] = []
    for word in lexed.words:
        if word.letter in columns:
            order.append((word.letter, word.text[0]))
            if _number(columns[word.letter][0]) != word.value:
                first.swap(word, columns[word.letter][0])
        elif word.letter == "M" and word.value in M_LAST:
            first.remove(word)
            tail.append(word.text)
        elif word.letter == "P":
            first.remove(word)
    lower = first.lower()
    for letter in columns:
        if letter not in {known for known, _ in order}:
            order.append((letter, letter.lower() if lower else letter))
            first.add(letter + columns[letter][0])
    order.sort(key=lambda known: known[0] in "IJKR")
    rest = tuple(
        tuple(written + columns[letter][k] for letter, written in order) for k in range(1, len(owner))
    )
    return Pieces(first, rest, tuple(tail), owner, lengths)


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
