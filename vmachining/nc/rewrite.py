"""New feeds into a program, every other byte as it was.

    rewrite_feeds(program, {line: BlockEdit(line, feeds, ends)}) -> Rewritten

1. A block that keeps one feed: its F word is replaced where it stands, or added after the last word.
2. F is modal: where the feed in force in the new program differs from the one the original had there, the
   next block that feeds gets an explicit F. Nothing is written where nothing changes.
3. A block with several feeds is cut by `rewrite_pieces.split_block`; new lines carry end words and F only.
4. A feed in the program is never above the one asked for: rounded down to 0.1 mm/min, in inch programs to
   0.0001 in/min, per revolution to 1e-6, in inverse time (G93, an F on every line) to seven digits.
   There the written points round the length of a piece, so its feed can be above by a share of 1e-5.
5. Left alone: canned cycles, rigid taps, G53 blocks, feed per revolution with the spindle stopped, degrees per minute,
   and everything that does not run once in the order of the file (`rewrite_words.py`): `Rewritten.untouched`. Not cut, and
   given their smallest feed: `Rewritten.unsplit`.
6. In tables of poses cells of feeds change, in cutter location files FEDRAT records are added, in Heidenhain and Sinumerik
   programs F words; no motion is cut (`rewrite_words.py`).

An F word that stands in one block with G20 or G21 is in the units before the block, as `read_program` has it.
"""

from __future__ import annotations

import codecs
import math
import re
from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final, NamedTuple

from vmachining.errors import FeedError, NCError
from vmachining.nc.dialects import is_g_code
from vmachining.nc.lexer import MAX_LINE, LexedLine, Word, lex_line
from vmachining.nc.rewrite_pieces import LineEdit, Modes, Pieces, move_path, number_text, split_block
from vmachining.nc.rewrite_words import (
    LANGUAGES,
    find_regions,
    rewrite_apt_feeds,
    rewrite_pose_feeds,
    rewrite_word_feeds,
)
from vmachining.nc.run import SLOWEST_MM_MIN
from vmachining.tolerance import LENGTH_EPS_MM

if TYPE_CHECKING:
    from vmachining.nc.model import Move, Program

LINES: Final = re.compile(r"([^\r\n]*)(\r\n|\r|\n|\Z)")

SLACK: Final = 1e-12
"""Relative: two feeds this close are one (the product and quotient of a unit conversion)."""

RESTORED_DECIMALS: Final = 6
"""Of an original feed that is known only as a result (`F#1`, or set before a change of units)."""


class BlockEdit(NamedTuple):
    """New feeds of the block in one line.

    feeds_mm_min : one per sub-block. ends : fraction of the path where each sub-block ends; rising, last 1.
    """

    line: int
    feeds_mm_min: tuple[float, ...]
    ends: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Rewritten:
    """A program with new feeds.

    data : its bytes. source_line : for every new line the 1-based line of the original it came from.
    unsplit : lines that were to be cut and got their smallest feed instead.
    untouched : lines whose feed could not be changed.
    """

    data: bytes
    source_line: tuple[int, ...]
    unsplit: tuple[int, ...] = ()
    untouched: tuple[int, ...] = ()


def rewrite_feeds(program: Program, edits: Mapping[int, BlockEdit]) -> Rewritten:
    """Write feeds into a program.

    program : Program, read without errors (a missing M30 does not count).
    edits : by line
        Lines that are not named keep their effective feed. With no edit the bytes are the same.
    Raises NCError: The program has errors, a line has no feed motion or would become too long.
    Raises FeedError: A feed that is not positive, or ends that do not rise to 1.
    """
    program.require_clean(allow={"W401"})
    for line, edit in edits.items():
        _check(edit, line)
    if program.dialect in ("poses", "apt") or (program.dialect in LANGUAGES and not program.files):
        return _by_line(program, edits)
    if not is_g_code(program.dialect):
        count = sum(1 for m in LINES.finditer(_decode(program.data)[2]) if m[0])
        return Rewritten(program.data, tuple(range(1, count + 1)), (), tuple(sorted(edits)))
    return _Rewriter(program, edits).run()


def _by_line(program: Program, edits: Mapping[int, BlockEdit]) -> Rewritten:
    """Languages that are not G-code: motions that were to be divided get their smallest feed."""
    mark, codec, text = _decode(program.data)
    lines = [(m[1], m[2]) for m in LINES.finditer(text) if m[0]]
    was = {move.line: move.feed_mm_min for move in program.moves}
    feeds: dict[int, float] = {}
    for line, edit in edits.items():
        feed, old = min(edit.feeds_mm_min), was.get(line)
        same = old is not None and abs(feed - old) <= SLACK * feed
        feeds[line] = old if same and old is not None else math.floor(feed * 10.0 * (1 + SLACK)) / 10.0
    unsplit = tuple(sorted(line for line, edit in edits.items() if len(set(edit.feeds_mm_min)) > 1))
    if program.dialect == "poses":
        made = rewrite_pose_feeds(lines, feeds)
    else:
        changed = {line: feed for line, feed in feeds.items() if feed != was.get(line)}
        if program.dialect in LANGUAGES:
            made = rewrite_word_feeds(program.dialect, lines, program.moves, changed)
        else:
            made = rewrite_apt_feeds(lines, changed)
    source = made.source_line or tuple(range(1, len(lines) + 1))
    return Rewritten(mark + "".join(made.lines).encode(codec), source, unsplit, made.untouched)


def _check(edit: BlockEdit, line: int) -> None:
    if not edit.feeds_mm_min or len(edit.feeds_mm_min) != len(edit.ends):
        raise FeedError(f"{len(edit.feeds_mm_min)} feeds for {len(edit.ends)} sub-blocks", line=line)
    for feed in edit.feeds_mm_min:
        if not (math.isfinite(feed) and feed > 0):
            raise FeedError(f"feed {feed} mm/min is not a positive number", line=line)
    if edit.ends[-1] != 1.0 or not all(a < b for a, b in pairwise((0.0, *edit.ends))):
        raise FeedError(f"ends {edit.ends} do not rise from 0 to 1", line=line)


@dataclass(slots=True)
class _Modal:
    """F in force in the new program, against the original.

    synced : both are the same. now : the number in force in the new program where they differ (None: not
    known in the present units and feed mode). was : the number in force in the original, where it is literal.
    """

    synced: bool = True
    now: float | None = None
    was: float | None = None

    def forget(self) -> None:
        """Units or feed mode changed: numbers written before mean something else."""
        self.now = self.was = None

    def original(self, word: Word) -> None:
        """The original F word stands."""
        self.synced, self.was = True, word.value

    def holds(self, number: float, own: bool) -> bool:
        """Whether the wanted number is in force already."""
        if self.synced:
            return own or (self.was is not None and self.was == number)
        return self.now == number

    def write(self, number: float, own: bool) -> None:
        """The wanted number was written."""
        self.synced, self.now = own or number == self.was, number


class _Rewriter:
    """Walks through the lines once, with the modes and the modal feed of both programs."""

    def __init__(self, program: Program, edits: Mapping[int, BlockEdit]) -> None:
        self.program, self.edits = program, edits
        self.mark, self.codec, text = _decode(program.data)
        self.lines = [(m[1], m[2]) for m in LINES.finditer(text) if m[0]]
        self.runs: dict[int, list[int]] = {}
        for k, move in enumerate(program.moves):
            self.runs.setdefault(move.line, []).append(k)
        self.lexed = [lex_line(body) for body, _ in self.lines]
        self.modes, self.modal = Modes(), _Modal()
        self.deletes = self._deletes()
        self.first, self.last = self._tape()
        self.regions = find_regions(self.lexed, self.first, self.last)
        self.edited: tuple[Move, ...] = ()
        self.unsplit: list[int] = []
        self.untouched: list[int] = []

    def run(self) -> Rewritten:
        for line in self.edits:
            if not self._cutting(line):
                raise NCError("no feed motion to give a feed to", file=self.program.name, line=line)
        out: list[str] = []
        source: list[int] = []
        newline = self.lines[0][1] if self.lines and self.lines[0][1] else "\n"
        for line, (_, ending) in enumerate(self.lines, 1):
            texts = self._line(line)
            for text in texts:
                if len(text) > MAX_LINE and len(text) > len(self.lines[line - 1][0]):
                    raise NCError(
                        f"with its feed the line has {len(text)} characters, at most {MAX_LINE} are read",
                        file=self.program.name, line=line, remedy="shorten its comment",
                    )  # fmt: skip
            out += [text + (ending or newline) for text in texts[:-1]] + [texts[-1] + ending]
            source += [line] * len(texts)
        data = self.mark + "".join(out).encode(self.codec)
        return Rewritten(data, tuple(source), tuple(self.unsplit), tuple(self.untouched))

    def _deletes(self) -> bool:
        """Whether lines with "/" were skipped: one of them asks for a motion that was not made."""
        marked = [k for k, lexed in enumerate(self.lexed, 1) if lexed.block_delete]
        if any(k in self.runs for k in marked):
            return False
        return any(word.letter in "XYZ" for k in marked for word in self.lexed[k - 1].words)

    def _tape(self) -> tuple[int, int]:
        """First and last line whose words count."""
        marks = [k for k, lexed in enumerate(self.lexed, 1) if lexed.percent]
        driven = sorted(self.runs)
        if not driven:
            return 1, len(self.lines)
        begin = bisect_left(marks, driven[0])
        end = bisect_left(marks, driven[-1])
        return (marks[begin - 1] if begin else 1), (marks[end] if end < len(marks) else len(self.lines))

    def _cutting(self, line: int) -> list[Move]:
        """Feed motions of a line."""
        moves = self.program.moves
        return [moves[k] for k in self.runs.get(line, ()) if moves[k].feed_mm_min is not None]

    def _line(self, line: int) -> list[str]:
        lexed = self.lexed[line - 1]
        if not self.first <= line <= self.last or (lexed.block_delete and self.deletes):
            return [lexed.text]
        before, self.modes = self.modes, self.modes.after(lexed)
        if line in self.regions.closed or line in self.regions.gates:
            return self._closed(line, lexed, before)
        if before.feed != self.modes.feed:
            self.modal.forget()
        feed_word = next((word for word in lexed.words if word.letter == "F"), None)
        texts = None
        if (edit := self.edits.get(line)) is not None:
            texts = self._edited(edit, lexed, feed_word, before.unit)
            if texts is None:
                self.untouched.append(line)
        if texts is None:
            texts = [self._kept(lexed, feed_word, self._cutting(line), before.unit)]
        if before.unit != self.modes.unit:
            self.modal.forget()
        return texts

    def _closed(self, line: int, lexed: LexedLine, before: Modes) -> list[str]:
        """A line that is left alone; where it opens a region, after the original F if another is in force."""
        texts = [lexed.text]
        if line in self.regions.gates and not self.modal.synced and before.feed != 93 and self.edited:
            move = self.edited[0]
            number = self._number(move, move.feed_mm_min or 0.0, 0.0, before.unit)
            if number is not None:
                texts.insert(0, "F" + self._restored(number))
        self.modal.synced, self.modal.was, self.modal.now = True, None, None
        if line in self.edits:
            self.untouched.append(line)
        return texts

    def _kept(self, lexed: LexedLine, feed_word: Word | None, cutting: Sequence[Move], unit: float) -> str:
        """A line without new feed; it gets its original one where another would be in force."""
        if feed_word is not None:
            self.modal.original(feed_word)
            return lexed.text
        if not cutting or self.modes.feed == 93 or self.modal.synced or _taps(cutting):
            return lexed.text
        numbers = [self._number(move, move.feed_mm_min or 0.0, 0.0, unit) for move in cutting]
        if None in numbers or max(n for n in numbers if n) > min(n for n in numbers if n) * (1 + SLACK):
            raise NCError(
                "the feed in force depends on what ran before, and would change",
                file=self.program.name, line=cutting[0].line, remedy="give the block its own F",
            )  # fmt: skip
        text = self._restored(numbers[0] or 0.0)
        if self.modal.holds(float(text), False):
            return lexed.text
        change = LineEdit(lexed)
        change.add("F" + text)
        self.modal.write(float(text), True)
        return change.text()

    def _restored(self, number: float) -> str:
        if self.modal.was is not None and abs(self.modal.was - number) <= 1e-9 * number:
            return number_text(self.modal.was, 10)
        return _floor_text(number, RESTORED_DECIMALS)

    def _edited(
        self, edit: BlockEdit, lexed: LexedLine, feed_word: Word | None, unit: float
    ) -> list[str] | None:
        """A line with new feeds, or None where its feed cannot be changed."""
        moves = [self.program.moves[k] for k in self.runs[edit.line]]
        cutting = self._cutting(edit.line)
        inverse = self.modes.feed == 93
        machine = any(w.letter == "G" and w.value == 53.0 for w in lexed.words)
        timed = any(move.duration_s is not None for move in moves)
        fixed = (len(moves) > 1 or feed_word is None) if inverse else timed
        if len(cutting) != len(moves) or _taps(cutting) or machine or fixed:
            return None
        self.edited = tuple(cutting)
        pieces = None
        if len(edit.ends) > 1:
            # the F of new lines would be in other units than the F of this one
            if len(moves) == 1 and unit == self.modes.unit and moves[0].rotation_deg == 0.0:
                pieces = split_block(lexed, moves[0], self.modes, edit.ends)
            if pieces is None:
                self.unsplit.append(edit.line)
        if pieces is None:
            pieces = Pieces(LineEdit(lexed), (), (), (0,), (_driven_length(cutting[0], feed_word),))
            feeds: tuple[float, ...] = (min(edit.feeds_mm_min),)
        else:
            feeds = edit.feeds_mm_min
        wanted = [
            self._feed_text(cutting, feeds[k], length, unit, whole=not pieces.rest)
            for k, length in zip(pieces.owner, pieces.lengths, strict=True)
        ]
        if any(want is None for want in wanted):
            return None
        return self._write(pieces, [want for want in wanted if want is not None], feed_word)

    def _write(self, pieces: Pieces, wanted: Sequence[tuple[str, bool]], feed_word: Word | None) -> list[str]:
        """Put the F words of all pieces; (text, whether it is the original feed) each."""
        text, own = wanted[0]
        if feed_word is None:
            if not self.modal.holds(float(text), own):
                pieces.first.add("F" + text)
                self.modal.write(float(text), own)
        elif own or feed_word.value == float(text):
            self.modal.original(feed_word)
        else:
            pieces.first.swap(feed_word, text)
            self.modal.was = feed_word.value
            self.modal.write(float(text), False)
        letter = "f" if pieces.first.lower() else "F"
        out = [pieces.first.text()]
        for words, (text, own) in zip(pieces.rest, wanted[1:], strict=True):
            extra: tuple[str, ...] = ()
            if self.modes.feed == 93 or not self.modal.holds(float(text), own):
                extra = (letter + text,)
                self.modal.write(float(text), own)
            out.append(" ".join((*words, *extra)))
        if pieces.rest and pieces.tail:
            out[-1] = " ".join((out[-1], *pieces.tail))
        return out

    def _feed_text(
        self, cutting: Sequence[Move], feed: float, length: float, unit: float, *, whole: bool
    ) -> tuple[str, bool] | None:
        """Text of the number to write for a feed, and whether it is the feed the block has now."""
        numbers = [self._number(move, feed, length, unit) for move in cutting]
        known = [number for number in numbers if number is not None]
        if len(known) < len(numbers):
            return None
        number = min(known)
        same = all(abs(feed - (move.feed_mm_min or 0.0)) <= SLACK * feed for move in cutting)
        if same and (self.modes.feed != 93 or whole):
            return self._restored(number), True
        if self.modes.feed == 93:
            decimals = max(1, 6 - math.floor(math.log10(number)))
        elif self.modes.feed == 95:
            decimals = 6
        else:
            decimals = 1 if unit == 1.0 else 4
        text = _floor_text(number, decimals)
        if float(text) <= 0:
            raise NCError(f"feed {feed} mm/min is too small to be written", line=cutting[0].line)
        return text, False

    def _number(self, move: Move, feed: float, length: float, unit: float) -> float | None:
        """What F must say for a feed in mm/min over a length in mm; None where nothing can say it."""
        if self.modes.feed == 95:
            return feed / (unit * abs(move.spindle_rpm)) if move.spindle_rpm else None
        if self.modes.feed == 93:
            return feed / length if length > 0 else None
        return feed / unit


def _decode(data: bytes) -> tuple[bytes, str, str]:
    """Byte order mark, codec that gives the same bytes back, and text: as the reader reads it."""
    mark = codecs.BOM_UTF8 if data.startswith(codecs.BOM_UTF8) else b""
    try:
        return mark, "utf-8", data[len(mark) :].decode("utf-8")
    except UnicodeDecodeError:
        return b"", "latin-1", data.decode("latin-1")


def _taps(cutting: Sequence[Move]) -> bool:
    """Whether these are the moves of G33.1, whose feed is its pitch: in and, the spindle reversed, out."""
    return len({move.spindle_rpm for move in cutting}) > 1


def _driven_length(move: Move, feed_word: Word | None) -> float:
    """mm of a whole block, for inverse time: as the reader measured it (arcs, cutter compensation), or its path."""
    path = move_path(move)
    if path is None or path.length <= LENGTH_EPS_MM:
        return 0.0
    if feed_word is not None and feed_word.value and move.feed_mm_min and move.feed_mm_min > SLOWEST_MM_MIN:
        return move.feed_mm_min / feed_word.value
    return path.length  # the F is computed, or the reader bounded the feed from below


def _floor_text(number: float, decimals: int) -> str:
    """Fixed-point text rounded down, where a multiple of the last place stays itself."""
    scale = 10.0**decimals
    return number_text(math.floor(number * scale * (1 + 0.1 * SLACK)) / scale, decimals)
