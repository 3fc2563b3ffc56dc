"""Formulas of controls whose parameters are words: `Q1 = ( Q13 - Q23 ) * SIN 30`, `R1 = SIN(R2) + 2 * R3`.

Precedence, weakest first: OR and XOR, AND, comparison, + and -, * / DIV MOD, sign and functions, power `^`. A
function without brackets takes what stands next to it. Angles are degrees. The dialect says which names have a value.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Mapping
from typing import Final

MOST: Final = 1e12
DEEPEST: Final = 60

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
        if depth > DEEPEST:
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
        if depth > DEEPEST:
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
        if token == "PI":
            return math.pi
        if token in ("TRUE", "FALSE"):
            return float(token == "TRUE")
        found = self.name(token)
        if found is None:
            raise FormulaError(f"{token} has no value here")
        return found
