"""One line of a program -> its words, each with its exact place in the raw text.

    line    = [ "/" ] [ N-word ] { word | comment | "#" assignment } [ ";" rest ]
    word    = letter value          blanks between and inside words mean nothing
    comment = "(" any character but parentheses ")"
    "%" alone, and "O"/":" lines: a program number, or a label and its control word with [conditions]
    letters are A to Z, and @ ^ for polar coordinates; TRAORI and TRAFOOF count as M128 and M129

Nothing here knows what a word means; `value` is None where the number is an expression still to be evaluated.
The lexer never raises: everything it cannot read is a `LexError`, and it continues after it.
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from vmachining.nc.expressions import Expression, ExpressionError, Name, parse_name, parse_value
from vmachining.nc.files import keyword_control

MAX_LINE: Final = 256
"""Longest line in characters; the line buffer of RS-274 controls."""

MAX_VALUE: Final = 1e9
"""No machine goes a thousand kilometres."""

_NUMBER: Final = r"(?>(?:[+-][ \t]*)?(?:[0-9][0-9 \t]*(?:\.[0-9 \t]*)?|\.[ \t]*[0-9][0-9 \t]*))"
_PLAIN: Final = re.compile(rf"([A-Za-z@^])[ \t]*+({_NUMBER})(?![.+\-])")
_VALUE_START: Final = re.compile(r"[ \t]*+(?:[+-][ \t]*+)?(?:\[|#|[A-Za-z]{2,}[ \t]*+\[)")
_NUMBER_RUN: Final = re.compile(r"[ \t]*+[+\-.0-9][+\-.0-9 \t]*")
_MISWRITTEN: Final = re.compile(
    r"([A-Za-z])[ \t]*([+-]?(?:[0-9]*,[0-9]+|(?=[0-9.]*[Oo])[0-9Oo.]+|[0-9]*\.?[0-9]+(?P<power>[eE][+-]?[0-9]+)))(?![A-Za-z0-9,])"
)
"""X1,5; X1O and XO; X1e3."""

_SUSPECT: Final = frozenset(",oOeE")
_LENGTHS: Final = frozenset("XYZABCUVWIJKRFQPS")
_KEYWORD: Final = re.compile(
    r"([A-Za-z]{3,}[0-9]*)(?![A-Za-z0-9\[]|[ \t]*\[)|((?:IF|WHILE|GOTO|THEN)(?=[ \t]*\[))"
)
_CORNER: Final = re.compile(r",[ \t]*([CRA])(?=[ \t]*[-+0-9.#\[])", re.IGNORECASE)
_COMMENT: Final = re.compile(r"\(([^()]*)\)")
_BLANK: Final = re.compile(r"[ \t]*")
_ILLEGAL: Final = re.compile(r"[^A-Za-z@^(;)#\x80-\U0010ffff]+")
_NON_ASCII: Final = re.compile(r"[^\x00-\x7f]+")
_TRANSFORM: Final = re.compile(
    r"TRA(?:(ORI)|FOOF)(?![A-Za-z0-9])(?:[ \t]*\([ \t]*\d*[ \t]*\))?", re.IGNORECASE
)
_O_LINE: Final = re.compile(
    r"(?:O[ \t]*(?P<label>[0-9][0-9 \t]*|<[^<>]*>)?|:[ \t]*(?P<number>[0-9][0-9 \t]*))", re.IGNORECASE
)
_O_FLOW: Final = re.compile(
    r"[ \t]*(sub|endsub|call|return|if|elseif|else|endif|while|endwhile|do|repeat|endrepeat"
    r"|break|continue)(?![a-z])",
    re.IGNORECASE,
)


class Word(NamedTuple):
    """A letter and its number.

    letter : upper case. value : None while it is an expression. col : 1-based column of the letter.
    length : characters from the letter to the last character of the number. text : those characters.
    """

    letter: str
    value: float | None
    col: int
    length: int
    text: str
    expression: Expression | None = None


class Assignment(NamedTuple):
    """`#target = value`, with its place."""

    target: Name
    value: Expression
    col: int
    length: int
    text: str


class Span(NamedTuple):
    """A place in the line: 1-based first column and number of characters."""

    col: int
    length: int


class LexError(NamedTuple):
    """What could not be read. `text` is the offending part of the line; hint : better than that of the catalogue."""

    code: str
    col: int
    length: int
    text: str
    message: str
    hint: str = ""


class LexedLine(NamedTuple):
    """Everything on one line.

    text : the raw line without its line end. words : in order, N included. comments : places, delimiters
    included. percent : the line is a tape mark. label : text of an O word or None; flow : its lower-case
    control word ("sub", "if", ...) or None; arguments : the values in brackets after the control word.
    """

    text: str
    words: tuple[Word, ...] = ()
    assignments: tuple[Assignment, ...] = ()
    comments: tuple[Span, ...] = ()
    errors: tuple[LexError, ...] = ()
    block_delete: bool = False
    percent: bool = False
    label: Word | None = None
    flow: str | None = None
    arguments: tuple[Expression, ...] = ()


def split_lines(text: str) -> list[str]:
    """Lines of a program; LF, CRLF and CR each end one. A last empty line is dropped."""
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if lines and not lines[-1]:
        lines.pop()
    return lines


def lex_line(text: str) -> LexedLine:
    """Read one line (without its line end).

    text : str, the raw line.
    Returns LexedLine: With `errors` E101 to E107 where something could not be read; `words` then holds the rest.
    """
    if len(text) > MAX_LINE:
        excess = text[MAX_LINE : MAX_LINE + 40]
        message = f"the line has {len(text)} characters, at most {MAX_LINE} are read"
        error = LexError("E105", MAX_LINE + 1, len(text) - MAX_LINE, excess, message)
        return LexedLine(text, errors=(error,))
    if text.strip(" \t") == "%":
        return LexedLine(text, percent=True)
    return _Scanner(text).scan()


class _Scanner:
    """Walks along one line and collects what it finds."""

    __slots__ = ("arguments", "assignments", "comments", "errors", "text", "words")

    def __init__(self, text: str) -> None:
        self.text = text
        self.words: list[Word] = []
        self.assignments: list[Assignment] = []
        self.comments: list[Span] = []
        self.errors: list[LexError] = []
        self.arguments: list[Expression] = []

    def scan(self) -> LexedLine:
        text, size = self.text, len(self.text)
        at = self._blank(0)
        block_delete = text[at : at + 1] == "/"
        if block_delete:
            at = self._blank(at + 1)
        if text[at : at + 1] in ("N", "n"):
            at = self._blank(self._item(at))
        label, flow, at = self._o_line(at)
        at = self._blank(at)
        while at < size:
            at = self._blank(self._item(at))
        if label is not None:
            self._only_label(flow)
        found = tuple(self.words), tuple(self.assignments), tuple(self.comments), tuple(self.errors)
        return LexedLine(text, *found, block_delete, False, label, flow, tuple(self.arguments))

    def _only_label(self, flow: str | None) -> None:
        """An O word has its line alone: the first thing behind it is an error, the rest is not looked at."""
        places = [(word.col, word.length) for word in self.words if word.letter != "N"]
        places += [(item.col, item.length) for item in self.assignments]
        self.words = [word for word in self.words if word.letter == "N"]
        self.assignments = []
        if places:
            col, length = min(places)
            what = f"{flow} and its values" if flow else "a program number"
            self._error("E101", col - 1, col - 1 + length, f"only a comment may follow {what}")

    def _blank(self, at: int) -> int:
        found = _BLANK.match(self.text, at)
        return found.end() if found else at

    def _error(self, code: str, start: int, end: int, message: str, hint: str = "") -> None:
        self.errors.append(LexError(code, start + 1, end - start, self.text[start:end], message, hint))

    def _miswritten(self, at: int) -> int:
        """A number with a decimal comma, letters O for zeros, or an exponent: the place behind it, or `at`."""
        found = _MISWRITTEN.match(self.text, at)
        if found is None or (found[1] in "Nn" and "," not in found[2]):
            return at
        word, number = found[0].rstrip(" \t"), found[2].strip(" \t")
        if "," in number:
            what, hint = "has a decimal comma", f"write {found[1]}{number.replace(',', '.')}"
        elif found["power"] is not None:
            if found[1].upper() not in _LENGTHS:
                return at  # M67E1 is M67 and E1
            what, hint = "has an exponent, which no control reads", "write the number out"
        else:
            fixed = number.upper().replace("O", "0")
            what, hint = "holds the letter O where a zero is meant", f"write {found[1]}{fixed}"
        self._error("E102", at, at + len(word), f"{word} {what}", hint)
        return at + len(word)

    def _item(self, at: int) -> int:
        """Read what starts at 0-based `at`; returns the place behind it."""
        text = self.text
        if plain := _PLAIN.match(text, at):
            letter, digits = plain[1].upper(), plain[2]
            end = plain.start(2) + len(digits.rstrip(" \t"))
            if text[end : end + 1] in _SUSPECT and (behind := self._miswritten(at)) > at:
                return behind
            value = float(digits.replace(" ", "").replace("\t", ""))
            if abs(value) > MAX_VALUE:
                self._error("E102", at, end, f"{text[at:end][:40]} is out of range, beyond {MAX_VALUE:,.0f}")
                return end
            if letter != "O":
                self.words.append(Word(letter, value, at + 1, end - at, text[at:end]))
                return end
        char = text[at]
        if char == "(":
            return self._comment(at)
        if char == ";":
            self.comments.append(Span(at + 1, len(text) - at))
            return len(text)
        if char == "#":
            return self._assignment(at)
        if char in "Tt" and (found := _TRANSFORM.match(text, at)):
            code = 128.0 if found[1] else 129.0
            self.words.append(Word("M", code, at + 1, len(found[0]), found[0]))
            return found.end()
        if (char.isascii() and char.isalpha()) or char in "@^":
            return self._word(at)
        if char == ")":
            self._error("E104", at, at + 1, "')' closes no comment")
            return at + 1
        if not char.isascii():
            found = _NON_ASCII.match(text, at)
            end = found.end() if found else at + 1
            self._error("E106", at, end, "only ASCII characters are allowed outside a comment")
            return end
        if char == "," and (found := _CORNER.match(text, at)):
            return self._corner(at, found)
        found = _ILLEGAL.match(text, at)
        end = max(at + 1, at + len(found[0].rstrip(" \t")) if found else 0)
        what = f"character {char!r} cannot stand here"
        if char == "[":
            what = "'[' may only stand where a number is expected"
        self._error("E101", at, end, what)
        return end

    def _corner(self, at: int, found: re.Match[str]) -> int:
        """`,R2.` and `,C1.`: a word of two characters, of the Fanuc family."""
        end = self._item(found.start(1))
        if self.words and self.words[-1].col == found.start(1) + 1:
            word = self.words[-1]
            self.words[-1] = word._replace(
                letter="," + word.letter, col=at + 1, length=end - at, text=self.text[at:end]
            )
        return end

    def _comment(self, at: int) -> int:
        found = _COMMENT.match(self.text, at)
        if found:
            self.comments.append(Span(at + 1, found.end() - at))
            return found.end()
        self._error("E104", at, len(self.text), "the comment is not closed, or holds another '('")
        return len(self.text)

    def _word(self, at: int) -> int:
        """A letter whose value is an expression, or is missing or malformed."""
        text = self.text
        letter = text[at].upper()
        if found := _KEYWORD.match(text, at):
            control = keyword_control(found[0])
            if control or not _VALUE_START.match(text, at + 1):
                whose = f": a keyword of {control} controls" if control else ""
                self._error("E110", at, found.end(), f"'{found[0]}' is not a word of G-code{whose}")
                return found.end()
        if (behind := self._miswritten(at)) > at:
            return behind
        if letter == "O":
            self._error("E101", at, at + 1, "an O word must come first in its line")
            return at + 1
        if _VALUE_START.match(text, at + 1):
            try:
                expression, end = parse_value(text, at + 1)
            except ExpressionError as exc:
                return self._bad_expression(at, exc)
            end = at + len(text[at:end].rstrip(" \t"))
            self.words.append(Word(letter, None, at + 1, end - at, text[at:end], expression))
            return end
        if run := _NUMBER_RUN.match(text, at + 1):
            end = at + len(text[at : run.end()].rstrip(" \t"))
            self._error("E102", at, end, f"'{text[at:end]}' does not hold one plain number")
            return end
        self._error("E103", at, at + 1, f"letter {letter} has no number")
        return at + 1

    def _assignment(self, at: int) -> int:
        text = self.text
        try:
            target, end = parse_name(text, at)
            end = self._blank(end)
            if text[end : end + 1] != "=":
                raise ExpressionError("a parameter that opens a word must be assigned: '=' is expected", end)
            value, end = parse_value(text, end + 1)
        except ExpressionError as exc:
            return self._bad_expression(at, exc)
        end = at + len(text[at:end].rstrip(" \t"))
        self.assignments.append(Assignment(target, value, at + 1, end - at, text[at:end]))
        return end

    def _bad_expression(self, at: int, exc: ExpressionError) -> int:
        """Nobody knows where a broken expression ends: the line up to a comment goes with it."""
        comment = re.search(r"[(;]", self.text[at:])
        end = at + comment.start() if comment else len(self.text)
        end = max(at + 1, at + len(self.text[at:end].rstrip(" \t")))
        known = "_hal[" in self.text.lower() or "_ini[" in self.text.lower()
        hint = "write the value into the program, or leave the line out" if known else ""
        self._error("E107", at, end, f"{exc} (column {exc.at + 1})", hint)
        return end

    def _o_line(self, at: int) -> tuple[Word | None, str | None, int]:
        """`O1234`, `:1234`, `o<name> sub`, `o[#1] call`: the label, the control word, the place behind."""
        found = _O_LINE.match(self.text, at)
        if found is None:
            return None, None, at
        digits = found["label"] or found["number"]
        if digits is None:
            begin = self._blank(at + 1)
            if self.text[begin : begin + 1] not in ("[", "#"):
                self._error("E103", at, at + 1, "the O word has no number")
                return None, None, at + 1
            try:
                computed, end = parse_value(self.text, begin)
            except ExpressionError as exc:
                return None, None, self._bad_expression(at, exc)
            end = at + len(self.text[at:end].rstrip(" \t"))
            label = Word("O", None, at + 1, end - at, self.text[at:end], computed)
        else:
            end = at + len(found[0].rstrip(" \t"))
            value = float(re.sub(r"[ \t]", "", digits)) if digits[0] != "<" else None
            label = Word("O", value, at + 1, end - at, self.text[at:end])
        flow = _O_FLOW.match(self.text, end)
        if flow is None:
            return label, None, end
        at = self._blank(flow.end())
        while self.text[at : at + 1] in ("[", "("):
            if self.text[at] == "(":
                at = self._blank(self._comment(at))
                continue
            try:
                argument, at = parse_value(self.text, at)
            except ExpressionError as exc:
                return label, flow[1].lower(), self._bad_expression(at, exc)
            self.arguments.append(argument)
            at = self._blank(at)
        return label, flow[1].lower(), at
