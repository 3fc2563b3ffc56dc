"""Numbers that are computed: `[#<scale> * 53.]`, `#5`, `SQRT[2]`, parsed once, evaluated when the block runs.

Grammar (RS-274 with named parameters; blanks and case mean nothing):

    value      = number | "[" expression "]" | "#" parameter | function | ("+" | "-") value
    expression = value { operator value }
    parameter  = "<" name ">" | value                        the value must be a whole number
    function   = name "[" expression "]"                     | "ATAN" "[" .. "]" "/" "[" .. "]"
               | "EXISTS" "[" "#" parameter "]"

Operators bind in five steps, each from left to right: `**`; `*` `/` `MOD`; `+` `-`; `EQ NE GT GE LT LE`;
`AND OR XOR`. Angles are degrees. `MOD` is never negative, `FIX` rounds down, `FUP` up, `ROUND` half away from
zero.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Mapping
from typing import Final, NamedTuple, Protocol

MAX_DEPTH: Final = 40
"""Brackets within brackets; a line holds 256 characters, nobody nests by hand beyond ten."""

MAX_NUMBER: Final = 5602
"""Highest numbered parameter of the reference control."""

NUMBER: Final = re.compile(r"(?:[0-9][0-9 \t]*(?:\.[0-9 \t]*)?|\.[ \t]*[0-9][0-9 \t]*)")
WORD: Final = re.compile(r"[A-Za-z]+")
BLANK: Final = re.compile(r"[ \t]*")
OPERATOR: Final = re.compile(r"\*\*|[*/+\-]|(?:MOD|AND|OR|XOR|EQ|NE|GT|GE|LT|LE)(?![A-Za-z])", re.IGNORECASE)
WHOLE: Final = 1e-4
"""How near a parameter number must be to a whole number: the reference control allows 0.0001."""


class ExpressionError(Exception):
    """The text is not an expression. `at`: 0-based place in the line."""

    def __init__(self, message: str, at: int) -> None:
        super().__init__(message)
        self.at = at


class NoValueError(Exception):
    """The expression is well formed and has no value: undefined parameter, division by zero, ..."""


class Name(NamedTuple):
    """A parameter by name (lower case, no blanks) or by the expression of its number."""

    name: str | None
    number: Expression | None


class Expression(NamedTuple):
    """One node: `op` is "number", "parameter", "exists", an operator or a function name."""

    op: str
    number: float = 0.0
    args: tuple[Expression, ...] = ()
    name: Name | None = None


class Parameters(Protocol):
    """What an expression may ask the control for. last : highest number of a parameter. functions : by name."""

    last: int
    functions: Mapping[str, Callable[[float], float]]

    def named(self, name: str) -> float | None:
        """Value of `#<name>`, None when it was never set."""

    def numbered(self, number: int) -> float | None:
        """Value of `#number`, None when there is no such parameter."""


def _unless(wrong: Callable[..., bool], why: str, function: Callable[..., float]) -> Callable[..., float]:
    """A function that has no value for some arguments."""

    def checked(*values: float) -> float:
        if wrong(*values):
            raise NoValueError(why.format(*values))
        return function(*values)

    return checked


def _inverse(function: Callable[[float], float], name: str) -> Callable[[float], float]:
    why = f"{name} of {{:g}}, which is outside -1..1"
    return _unless(lambda a: not -1.0 <= a <= 1.0, why, lambda a: math.degrees(function(a)))


BINARY: Final[Mapping[str, tuple[int, Callable[[float, float], float]]]] = {
    "**": (5, _unless(lambda a, b: (a < 0.0 and b != math.floor(b)) or (a == 0.0 and b < 0.0),
                      "{:g} ** {:g} has no real value", math.pow)),
    "*": (4, operator.mul),
    "/": (4, _unless(lambda a, b: b == 0.0, "division by zero", operator.truediv)),
    "MOD": (4, _unless(lambda a, b: b == 0.0, "MOD by zero",
                       lambda a, b: rest + abs(b) if (rest := math.fmod(a, b)) < 0.0 else rest)),
    "+": (3, operator.add),
    "-": (3, operator.sub),
    "EQ": (2, lambda a, b: float(a == b)),
    "NE": (2, lambda a, b: float(a != b)),
    "GT": (2, lambda a, b: float(a > b)),
    "GE": (2, lambda a, b: float(a >= b)),
    "LT": (2, lambda a, b: float(a < b)),
    "LE": (2, lambda a, b: float(a <= b)),
    "AND": (1, lambda a, b: float(a != 0.0 and b != 0.0)),
    "OR": (1, lambda a, b: float(a != 0.0 or b != 0.0)),
    "XOR": (1, lambda a, b: float((a != 0.0) != (b != 0.0))),
}  # fmt: skip

FUNCTIONS: Final[Mapping[str, Callable[[float], float]]] = {
    "ABS": abs,
    "ACOS": _inverse(math.acos, "ACOS"),
    "ASIN": _inverse(math.asin, "ASIN"),
    "COS": lambda a: math.cos(math.radians(a)),
    "EXP": math.exp,
    "FIX": lambda a: float(math.floor(a)),
    "FUP": lambda a: float(math.ceil(a)),
    "LN": _unless(lambda a: a <= 0.0, "LN of {:g}, which is not positive", math.log),
    "ROUND": lambda a: math.copysign(math.floor(abs(a) + 0.5), a),
    "SIN": lambda a: math.sin(math.radians(a)),
    "SQRT": _unless(lambda a: a < 0.0, "SQRT of {:g}, a negative number", math.sqrt),
    "TAN": lambda a: math.tan(math.radians(a)),
}

FANUC: Final[Mapping[str, Callable[[float], float]]] = {
    **FUNCTIONS,
    "FIX": lambda a: float(math.trunc(a)),
    "FUP": lambda a: math.copysign(math.ceil(abs(a)), a),
}
"""Of the Fanuc family: FIX drops the fraction and FUP goes away from zero, FIX[-1.2] = -1 and FUP[-1.2] = -2
(operator's manual 0i/30i, custom macro, arithmetic and logic operation)."""


def parse_value(text: str, at: int, depth: int = 0) -> tuple[Expression, int]:
    """Parse one value of `text` from 0-based place `at`; returns it and the place after it.

    Raises ExpressionError.
    """
    at = _skip(text, at)
    if depth > MAX_DEPTH:
        raise ExpressionError(f"brackets nested deeper than {MAX_DEPTH}", at)
    if at >= len(text):
        raise ExpressionError("the line ends where a value is expected", at)
    char = text[at]
    if found := NUMBER.match(text, at):
        return Expression("number", float(found[0].replace(" ", "").replace("\t", ""))), found.end()
    if char in "+-":
        inner, end = parse_value(text, at + 1, depth + 1)
        return (Expression("negative", args=(inner,)) if char == "-" else inner), end
    if char == "[":
        return _brackets(text, at, depth)
    if char == "#":
        name, end = parse_name(text, at, depth)
        return Expression("parameter", name=name), end
    if found := WORD.match(text, at):
        return _function(text, found, depth)
    raise ExpressionError(f"'{char}' where a value is expected", at)


def parse_name(text: str, at: int, depth: int = 0) -> tuple[Name, int]:
    """Parse `#<name>` or `#value` from the place of the `#`."""
    at = _skip(text, at + 1)
    if text[at : at + 1] == "<":
        end = text.find(">", at)
        if end < 0:
            raise ExpressionError("the parameter name has no closing '>'", at)
        if text[at + 1 : end].lower().lstrip(" \t").startswith(("_ini[", "_hal[")):
            name = f"#{text[at : end + 1]}"
            raise ExpressionError(
                f"{name} is known to a machine with its configuration only, not to a program", at
            )
        name = text[at + 1 : end].replace(" ", "").replace("\t", "").lower()
        if not name or not name.isascii() or set(name) & set("<#[]()"):
            raise ExpressionError(f"'{text[at : end + 1]}' is not a parameter name", at)
        return Name(name, None), end + 1
    number, end = parse_value(text, at, depth + 1)
    return Name(None, number), end


def _skip(text: str, at: int) -> int:
    found = BLANK.match(text, at)
    return found.end() if found else at


def _brackets(text: str, at: int, depth: int) -> tuple[Expression, int]:
    """`[ value { operator value } ]`, operators reduced by their step as they come."""
    if text[at : at + 1] != "[":
        raise ExpressionError("'[' is expected here", at)
    first, at = parse_value(text, at + 1, depth + 1)
    values, pending = [first], list[str]()

    def reduce(step: int) -> None:
        while pending and BINARY[pending[-1]][0] >= step:
            right, left = values.pop(), values.pop()
            values.append(Expression(pending.pop(), args=(left, right)))

    while True:
        at = _skip(text, at)
        if text[at : at + 1] == "]":
            reduce(0)
            return values[0], at + 1
        found = OPERATOR.match(text, at)
        if found is None:
            what = f"'{text[at]}'" if at < len(text) else "the end of the line"
            raise ExpressionError(f"{what} where an operator or ']' is expected", at)
        name = found[0].upper()
        reduce(BINARY[name][0])
        pending.append(name)
        value, at = parse_value(text, found.end(), depth + 1)
        values.append(value)


def _function(text: str, found: re.Match[str], depth: int) -> tuple[Expression, int]:
    name, at = found[0].upper(), _skip(text, found.end())
    if name == "EXISTS":
        inside = _skip(text, at + 1)
        if text[at : at + 1] != "[" or text[inside : inside + 1] != "#":
            raise ExpressionError("EXISTS needs a parameter in brackets: EXISTS[#<name>]", at)
        target, end = parse_name(text, inside, depth + 1)
        end = _skip(text, end)
        if text[end : end + 1] != "]":
            raise ExpressionError("EXISTS needs one parameter and then ']'", end)
        return Expression("exists", name=target), end + 1
    if name == "ATAN":
        over, end = _brackets(text, at, depth)
        end = _skip(text, end)
        if text[end : end + 1] != "/":
            raise ExpressionError("ATAN needs two brackets: ATAN[y]/[x]", end)
        under, end = _brackets(text, _skip(text, end + 1), depth)
        return Expression("ATAN", args=(over, under)), end
    if name not in FUNCTIONS:
        raise ExpressionError(f"'{found[0]}' is not a function", found.start())
    inner, end = _brackets(text, at, depth)
    return Expression(name, args=(inner,)), end


def evaluate(node: Expression, parameters: Parameters) -> float:
    """The value of an expression.

    Raises NoValueError: Undefined parameter, argument outside the domain of a function, result not finite.
    """
    try:
        value = _evaluate(node, parameters)
    except OverflowError:
        value = math.inf
    if not math.isfinite(value):
        raise NoValueError("the result is not a finite number")
    return value


def _evaluate(node: Expression, parameters: Parameters) -> float:
    op = node.op
    if op == "number":
        return node.number
    if op in ("parameter", "exists"):
        return _of_parameter(node.name, parameters, exists=op == "exists")
    args = [_evaluate(arg, parameters) for arg in node.args]
    if op == "negative":
        return -args[0]
    if op == "ATAN":
        return math.degrees(math.atan2(args[0], args[1]))
    if op in BINARY:
        return BINARY[op][1](args[0], args[1])
    return parameters.functions[op](args[0])


def to_least(node: Expression, parts: float) -> Expression:
    """An expression in the word of an address of the Fanuc family: there ROUND goes to least increments, `parts` in one."""
    args = tuple(to_least(arg, parts) for arg in node.args)
    if node.op != "ROUND" or parts == 1.0:
        return node._replace(args=args)
    number = Expression("number", parts)
    whole = Expression("ROUND", args=(Expression("*", args=(args[0], number)),))
    return Expression("/", args=(whole, number))


def parameter_number(node: Expression, parameters: Parameters) -> int:
    """The whole number that names a parameter."""
    number = _whole(node, parameters)
    if not 1 <= number <= parameters.last:
        raise NoValueError(f"#{number}: parameter numbers run from 1 to {parameters.last}")
    return number


def _whole(node: Expression, parameters: Parameters) -> int:
    value = evaluate(node, parameters)
    number = round(value)
    if abs(value - number) > WHOLE:
        raise NoValueError(f"#{value:g}: a parameter number must be whole")
    return number


def _of_parameter(name: Name | None, parameters: Parameters, *, exists: bool) -> float:
    """Value of a parameter, or whether it has one; then a number that no parameter has is an answer, not an error."""
    assert name is not None
    if name.name is not None:
        value, text = parameters.named(name.name), f"#<{name.name}>"
    else:
        assert name.number is not None
        number = (_whole if exists else parameter_number)(name.number, parameters)
        known = not exists or 1 <= number <= MAX_NUMBER
        value, text = parameters.numbered(number) if known else None, f"#{number}"
    if exists:
        return float(value is not None)
    if value is None:
        raise NoValueError(f"parameter {text} has no value")
    return value
