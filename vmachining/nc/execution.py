"""Runs the blocks of a program: which one comes next, calls and their ends, files that are called, findings.

What a block does is for the dialect (`execute`). A block that cannot be executed is left out with one finding; where
nobody knows which block comes next (`lost`), reading ends, because nothing after it is known.

Formulas of controls whose parameters are words: `Q1 = ( Q13 - Q23 ) * SIN 30`, `R1 = SIN(R2) + 2 * R3`.

Precedence, weakest first: OR and XOR, AND, comparison, + and -, * / DIV MOD, sign and functions, power `^`. A
function without brackets takes what stands next to it. Angles are degrees. The dialect says which names have a value.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

from vmachining.errors import NCError
from vmachining.nc.files import decode_program, find_file
from vmachining.nc.lexer import split_lines
from vmachining.nc.model import Declared, PenError, Reading
from vmachining.nc.pen import Pen
from vmachining.nc.settings import Settings

MOST: Final = 1e12
MOST_NESTED: Final = 60

_TOKEN: Final = re.compile(
    r"[ \t]*(?:(\d+\.?\d*(?:EX?[+-]?\d+)?|\.\d+)|([A-Z_$][A-Z0-9_.$]*)|(==|<>|>=|<=|[-+*/^()<>=\[\],]))",
    re.IGNORECASE,
)


class FormulaError(Exception):
    """No value: wrong text, an unknown name, a division by zero."""


def _safe(call: Callable[..., float]) -> Callable[..., float]:
    def run(*values: float) -> float:
        try:
            return call(*values)
        except (ValueError, ZeroDivisionError, OverflowError) as exc:
            raise FormulaError(f"no value: {exc}") from None

    return run


_UNARY: Final[Mapping[str, Callable[[float], float]]] = {
    "SIN": lambda v: math.sin(math.radians(v)),
    "COS": lambda v: math.cos(math.radians(v)),
    "TAN": _safe(lambda v: math.tan(math.radians(v))),
    "ASIN": _safe(lambda v: math.degrees(math.asin(v))),
    "ACOS": _safe(lambda v: math.degrees(math.acos(v))),
    "ATAN": lambda v: math.degrees(math.atan(v)),
    "SQRT": _safe(math.sqrt),
    "SQ": lambda v: v * v,
    "POT": lambda v: v * v,
    "LN": _safe(math.log),
    "LOG": _safe(math.log10),
    "EXP": _safe(math.exp),
    "ABS": abs,
    "INT": math.trunc,
    "TRUNC": math.trunc,
    "FRAC": lambda v: v - math.trunc(v),
    "NEG": lambda v: -v,
    "SGN": lambda v: float((v > 0.0) - (v < 0.0)),
    "ROUND": lambda v: math.floor(abs(v) + 0.5) * (1.0 if v >= 0.0 else -1.0),
    "NOT": lambda v: float(not v),
}
_PAIRS: Final[Mapping[str, Callable[[float, float], float]]] = {
    "ATAN2": lambda a, b: math.degrees(math.atan2(a, b)),
    "POT": _safe(lambda a, b: a**b),
    "MINVAL": min,
    "MAXVAL": max,
}


_CONSTANTS: Final = {"PI": math.pi, "TRUE": 1.0, "FALSE": 0.0}


def _near(a: float, b: float) -> bool:
    return abs(a - b) <= 1e-12 * max(abs(a), abs(b), 1.0)


def _divided(function: Callable[[float, float], float]) -> Callable[[float, float], float]:
    def run(a: float, b: float) -> float:
        if b == 0.0:
            raise FormulaError("division by zero")
        if not abs(a) <= 1e300:
            raise FormulaError("out of range")
        return function(a, b)

    return run


_LEVELS: Final[tuple[dict[str, Callable[[float, float], float]], ...]] = (
    {"OR": lambda a, b: float(bool(a) or bool(b)), "XOR": lambda a, b: float(bool(a) != bool(b))},
    {"AND": lambda a, b: float(bool(a) and bool(b))},
    {
        "==": lambda a, b: float(_near(a, b)),
        "=": lambda a, b: float(_near(a, b)),
        "<>": lambda a, b: float(not _near(a, b)),
        ">": lambda a, b: float(a > b and not _near(a, b)),
        "<": lambda a, b: float(a < b and not _near(a, b)),
        ">=": lambda a, b: float(a > b or _near(a, b)),
        "<=": lambda a, b: float(a < b or _near(a, b)),
    },
    {"+": operator.add, "-": operator.sub},
    {
        "*": operator.mul,
        "/": _divided(operator.truediv),
        "DIV": _divided(lambda a, b: math.trunc(a / b)),
        "MOD": _divided(math.fmod),
        "%": _divided(math.fmod),
    },
)
"""Operators of two values, weakest first."""


def evaluate(text: str, name: Callable[[str], float | None]) -> float:
    """Value of a formula.

    name : value of a parameter by its name in capitals, None where it has no value. An index in brackets becomes part of
        the name: `R[3]` is R3, `$P_EP[X]` stays as it is.
    Raises FormulaError.
    """
    parser = _Parser(text, name)
    value = parser.weakest(0)
    if parser.peek() is not None:
        raise FormulaError(f"'{parser.peek()}' does not belong there")
    if not abs(value) <= MOST:
        raise FormulaError(f"{value:g} is out of range")
    return float(value)


class _Parser:
    def __init__(self, text: str, name: Callable[[str], float | None]) -> None:
        self.name = name
        self.tokens: list[str] = []
        at = 0
        text = text.rstrip()
        while at < len(text):
            found = _TOKEN.match(text, at)
            if found is None:
                raise FormulaError(f"'{text[at:].strip()[:20]}' is not understood")
            self.tokens.append((found[1] or found[2] or found[3]).upper())
            at = found.end()
        self.at = 0

    def peek(self) -> str | None:
        return self.tokens[self.at] if self.at < len(self.tokens) else None

    def take(self) -> str:
        token = self.peek()
        if token is None:
            raise FormulaError("the formula ends too early")
        self.at += 1
        return token

    def want(self, token: str) -> None:
        if self.take() != token:
            raise FormulaError(f"'{token}' is missing")

    def weakest(self, depth: int, level: int = 0) -> float:
        """Operators of a level and of those that bind stronger, from left to right."""
        if depth > MOST_NESTED:
            raise FormulaError("brackets are nested too deep")
        if level == len(_LEVELS):
            return self.power(depth)
        value = self.weakest(depth, level + 1)
        while (word := self.peek()) is not None and word in _LEVELS[level]:
            self.take()
            value = _LEVELS[level][word](value, self.weakest(depth, level + 1))
        return value

    def power(self, depth: int) -> float:
        value = self.single(depth)
        if self.peek() == "^":
            self.take()
            other = self.power(depth + 1)
            try:
                result = value**other
            except (ZeroDivisionError, OverflowError):
                raise FormulaError("a power without value") from None
            if isinstance(result, complex):
                raise FormulaError("a power without value")
            value = result
        return value

    def index(self, depth: int) -> str:
        """A number, or the letter of an axis: `$P_EP[X]`."""
        token = self.peek() or ""
        if token in "XYZABC" and len(token) == 1 and self.tokens[self.at + 1 : self.at + 2] in (["]"], [","]):
            return self.take()
        return f"{self.weakest(depth + 1):g}"

    def single(self, depth: int) -> float:
        if depth > MOST_NESTED:
            raise FormulaError("brackets are nested too deep")
        token = self.take()
        if token in ("+", "-"):
            value = self.single(depth + 1)
            return -value if token == "-" else value
        if token == "(":
            value = self.weakest(depth + 1)
            self.want(")")
            return value
        if token[0].isdigit() or token[0] == ".":
            try:
                return float(token.replace("EX", "E"))
            except ValueError:
                raise FormulaError(f"'{token}' is not a number") from None
        if token in _PAIRS and self.peek() == "(":
            mark = self.at
            self.take()
            first = self.weakest(depth + 1)
            if self.peek() == ",":
                self.take()
                second = self.weakest(depth + 1)
                self.want(")")
                return _PAIRS[token](first, second)
            self.at = mark
        if token in _UNARY:
            return _UNARY[token](self.single(depth + 1))
        if self.peek() == "[":
            self.take()
            index = [self.index(depth)]
            while self.peek() == ",":
                self.take()
                index.append(self.index(depth))
            self.want("]")
            token = f"{token}{','.join(index)}" if len(token) == 1 else f"{token}[{','.join(index)}]"
        found = _CONSTANTS[token] if token in _CONSTANTS else self.name(token)
        if found is None:
            raise FormulaError(f"{token} has no value here")
        return found


MAX_FINDINGS: Final = 1000
ONCE: Final = frozenset({"E368"})
"""Causes that lie in the job: one finding for all words."""

FREE: Final = "free contours (FK: FPOL, FL, FLT, FC, FCT) are not supported"
MILLS: Final = "a milling cycle (pocket, slot, stud, face, contour): the control chooses its path"
DEEPEST: Final = 50
"""Calls in calls."""


class Block(NamedTuple):
    """line : 1-based, of its first line. text : capitals, without number, label and comments; raw : as it stands there.

    skip : it begins with the mark of optional blocks.
    """

    line: int
    n: int | None
    text: str
    raw: str
    label: str = ""
    skip: bool = False


class _Frame(NamedTuple):
    """Where a call comes back to. stop : block before which a repeated part ends. whole : of a program, not of a part."""

    blocks: Sequence[Block]
    at: int
    line: int | None
    stop: int | None
    whole: bool
    kept: Any


class Execution:
    """A program that is being executed.

    outer : line of the main program while a called file runs. ended : nothing more is read; broken : for a fault.
    """

    suffixes: tuple[str, ...] = ()
    """Of files that hold called programs."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.pen = Pen(settings)
        self.blocks: Sequence[Block] = ()
        self.at = self.steps = 0
        self.stack: list[_Frame] = []
        self.outer: int | None = None
        self.ended = self.broken = False
        self.names: dict[str, int] = {}
        """Numbers of tools that are called by name."""
        self.paths: list[Path] = []

    def run(self) -> None:
        pen = self.pen
        while not self.ended and not self.broken:
            part = bool(self.stack) and self.stack[-1].stop == self.at
            if part or self.at >= len(self.blocks):
                if not self.leave(whole=not part):
                    break
                continue
            block = self.blocks[self.at]
            self.at += 1
            self.steps += 1
            pen.line, pen.n, pen.text = self.outer or block.line, block.n, block.raw
            if self.steps > self.settings.max_steps + 2 * len(self.blocks):
                self._break("E413", f"over {self.settings.max_steps} blocks were repeated")
                return
            try:
                if not (block.skip and self.settings.block_delete):
                    self.execute(block)
            except PenError as exc:
                self._tell(exc)
            except RecursionError:
                pen.note("E102", "the block is nested too deep")
            if len(pen.findings) >= MAX_FINDINGS:
                self._break("E408", f"{len(pen.findings)} findings so far: the rest is not examined")
                return
        try:
            pen.end()
        except PenError as exc:
            self._tell(exc)

    def reading(self, declared: Declared) -> Reading:
        """What the program became, without the moves before the line where it is to restart."""
        pen = self.pen
        begin = self.settings.start_line
        first = next((k for k, move in enumerate(pen.moves) if move.line >= begin), len(pen.moves))
        names = {number: name for name, number in self.names.items()}
        declared = declared._replace(tools=tuple(sorted(pen.called)), names=names)
        return Reading(pen.moves[first:], pen.findings, self.ended, tuple(map(str, self.paths)), declared)

    def _break(self, code: str, message: str) -> None:
        self.pen.note(code, message)
        self.broken = True

    def _tell(self, exc: PenError) -> None:
        """One finding; the same cause again says nothing new, of some not even for another word."""
        pen = self.pen
        alone = exc.code in ONCE or str(exc) in (FREE, MILLS)
        pen.note(exc.code, str(exc), exc.word, once=str(exc) if alone else f"{exc} {exc.word}")
        if exc.hint and pen.findings and pen.findings[-1].message == str(exc):
            pen.findings[-1] = pen.findings[-1]._replace(hint=exc.hint)

    def execute(self, block: Block) -> None:
        raise NotImplementedError

    def lost(self, exc: PenError) -> PenError:
        """The way on is not known: reading ends."""
        self.ended = True
        return exc

    def tool_of_name(self, label: str, word: str) -> int:
        """Number of a tool that is called by name."""
        if label.upper() not in self.names:
            self.names[label.upper()] = len(self.names) + 1
            self.pen.note("W367", f'tool "{label}" is taken as number {self.names[label.upper()]}', word)
        return self.names[label.upper()]

    # ---- calls ----

    def keep(self) -> Any:
        """What a dialect keeps for each program: put aside by a call."""
        return None

    def restore(self, kept: Any) -> None:
        """Back after a call."""

    def enter(
        self, blocks: Sequence[Block], at: int, *, stop: int | None = None, back: int | None = None,
        whole: bool = True,
    ) -> None:  # fmt: skip
        """Go to a block; `leave` comes back to the one that follows now, or to `back`."""
        if len(self.stack) >= DEEPEST:
            raise self.lost(PenError("E414", "calls are nested too deep"))
        here = self.at if back is None else back
        self.stack.append(_Frame(self.blocks, here, self.outer, stop, whole, self.keep()))
        self.blocks, self.at = blocks, at

    def leave(self, *, whole: bool = True) -> bool:
        """Back from a call (whole : of a program, with the parts open in it); False in the main program."""
        while self.stack:
            frame = self.stack.pop()
            self.blocks, self.at, self.outer = frame.blocks, frame.at, frame.line
            self.restore(frame.kept)
            if frame.whole or not whole:
                return True
        return False

    def absent(self, name: str, stem: str) -> bool:
        """Whether the file of a called program is missing: that is said, and the rest is read."""
        if self._find(stem) is not None:
            return False
        self.pen.note("W383", f"the program {name[:60]} that is called here is missing: its moves are not read", name[:40],
                      once=stem)  # fmt: skip
        return True

    def lines_of(self, name: str, stem: str) -> list[str]:
        """Lines of the file that holds a called program.

        Raises PenError: E412, and reading ends.
        """
        path = self._find(stem)
        if path is None:
            raise self.lost(PenError(
                "E412", f"the called program {name[:60]} is missing", name[:40],
                f"put {stem[:40]}{self.suffixes[0]} next to the program, or name its folder under subroutines; an empty file "
                "is enough if it does not move the tool",
            ))  # fmt: skip
        self.pen.flush()
        try:
            text = decode_program(path.read_bytes(), str(path))
        except (OSError, NCError) as exc:
            raise self.lost(PenError("E412", f"{path.name}: {exc}", name[:40])) from None
        if path not in self.paths:
            self.paths.append(path)
        return split_lines(text)

    def _find(self, stem: str) -> Path | None:
        if not re.fullmatch(r"[\w.+ -]+", stem):
            return None
        wanted = [stem.lower() + suffix for suffix in self.suffixes]
        return find_file(self.settings.subroutines, lambda entry: entry.name.lower() in wanted)
