"""Q parameters and the FN functions that only compute."""

from __future__ import annotations

import math
import re
from typing import Final

from vmachining.nc.formula import FormulaError, evaluate
from vmachining.nc.pen import Pen
from vmachining.nc.refusal import PenError

_ASSIGN: Final = re.compile(r"(Q[LR]?\d+)\s*=\s*(.+)")
_FN: Final = re.compile(r"FN\s*(\d+)\s*:?\s*(.*)")
_TEXT: Final = re.compile(r'(?:DECLARE\s+STRING\s+)?(QS\d+)\s*=\s*(?:"([^"]*)"$)?')
_NAMES: Final = re.compile(r"Q[LR]?\d+")
_TERM: Final = r"\s*([+-]?\s*(?:Q[LR]?\d+|\d+\.?\d*|\.\d+))\s*"
_BINARY: Final = {
    1: (r"\+", lambda a, b: a + b), 2: ("-", lambda a, b: a - b), 3: (r"\*", lambda a, b: a * b),
    4: ("DIV", None), 8: ("LEN", math.hypot), 13: ("ANG", lambda a, b: math.degrees(math.atan2(a, b)) % 360.0),
}  # fmt: skip
_SINGLE: Final = {
    5: ("SQRT", math.sqrt),
    6: ("SIN", lambda v: math.sin(math.radians(v))),
    7: ("COS", lambda v: math.cos(math.radians(v))),
}
_COMPARE: Final = {9: "EQU", 10: "NE", 11: "GT", 12: "LT"}
_JUMP: Final = re.compile(rf"IF{_TERM}(EQU|NE|GT|LT){_TERM}GOTO\s*LBL\s*(.+)")
_READ: Final = re.compile(
    r"SYSREAD\s+(Q[LR]?\d+)\s*=\s*ID\s*(\d+)\s*(?:NR\s*([+-]?Q?\d+))?\s*(?:IDX\s*([+-]?Q?\d+))?"
)


class Parameters:
    """Values of Q, QL and QR by name."""

    def __init__(self, pen: Pen) -> None:
        self.pen = pen
        self.values: dict[str, float] = {}
        self.length: dict[int, float] = {}
        self.texts: dict[str, str] = {}
        self.unknown: dict[str, str] = {}
        """Parameters that hold what only the machine knows: what was read there."""

    def local(self, other: dict[str, float] | None = None) -> dict[str, float]:
        """The QL parameters, which every called program has for itself; other : those that take their place."""
        own = {k: v for k, v in self.values.items() if k.startswith("QL")}
        if other is not None:
            self.values = {k: v for k, v in self.values.items() if k not in own} | other
        return own

    def get(self, name: str) -> float | None:
        """Value of a parameter; None where it was never set."""
        name = _plain(name)
        if name in self.values:
            return self.values[name]
        if name == "Q108":
            return self.pen.radius() / self.pen.scale
        if name == "Q114":
            return self.length.get(self.pen.tool, 0.0)
        return {"Q109": 2.0, "Q110": 3.0 if self.pen.rpm > 0 else 4.0 if self.pen.rpm < 0 else -1.0,
                "Q113": 0.0 if self.pen.scale == 1.0 else 1.0}.get(name)  # fmt: skip

    def need(self, name: str) -> float:
        """Value of a parameter.

        Raises PenError: E108
        """
        value = self.get(name)
        if value is None:
            why = self.unknown.get(_plain(name))
            raise PenError("E108", f"{name} holds {why}" if why else f"{name} was never set", name)
        return value

    def set(self, name: str, value: float) -> None:
        """A parameter of a known value."""
        self.values[_plain(name)] = value
        self.unknown.pop(_plain(name), None)

    def lose(self, name: str, why: str) -> tuple[str, str]:
        """A parameter of a value that only the machine knows: an error where it is used."""
        self.values.pop(_plain(name), None)
        self.unknown[_plain(name)] = why
        return "done", ""

    def _unknown_in(self, text: str) -> str | None:
        """Why a term has no value here, None where it has one."""
        return (
            next((why for q in _NAMES.findall(text) if (why := self.unknown.get(_plain(q)))), None)
            if self.unknown
            else None
        )

    def number(self, text: str) -> float:
        """`+10.5`, `Q5`, `-Q5`."""
        text = text.replace(" ", "")
        sign, bare = (-1.0, text[1:]) if text.startswith("-") else (1.0, text.removeprefix("+"))
        if bare.startswith("Q"):
            return sign * self.need(bare)
        try:
            value = float(bare)
        except ValueError:
            raise PenError("E102", f"'{text[:30]}' is not a number", text) from None
        if not abs(value) < 1e9:
            raise PenError("E102", f"{text[:30]} is out of range", text)
        return sign * value

    def execute(self, text: str) -> tuple[str, str] | None:
        """An assignment or FN block; ("jump", label), ("stop", why), ("note", what) or None where the text is neither.

        Raises PenError.
        """
        if (found := _ASSIGN.fullmatch(text)) is not None:
            if (why := self._unknown_in(found[2])) is not None:
                return self.lose(found[1], why)
            try:
                value = evaluate(found[2], self._named)
            except FormulaError as exc:
                raise PenError("E108", str(exc), found[1]) from None
            self.set(found[1], value)
            return "done", ""
        if (found := _TEXT.match(text)) is not None:
            self.texts.pop(found[1], None)
            if found[2] is not None:
                self.texts[found[1]] = found[2]
            return "done", ""
        if text.startswith("IF ") and (found := _JUMP.fullmatch(text)) is not None:
            return self._jump(found)
        found = _FN.fullmatch(text)
        if found is None:
            return None
        return self._function(int(found[1]), found[2].strip())

    def _named(self, name: str) -> float | None:
        return self.get(name) if name.startswith("Q") else None

    def _jump(self, found: re.Match[str]) -> tuple[str, str]:
        a, b = self.number(found[1]), self.number(found[3])
        true = {"EQU": a == b, "NE": a != b, "GT": a > b, "LT": a < b}[found[2]]
        return ("jump", found[4].strip()) if true else ("done", "")

    def _function(self, number: int, body: str) -> tuple[str, str] | None:
        if number in _COMPARE:
            found = _JUMP.fullmatch(body)
            return None if found is None else self._jump(found)
        if number == 14:
            return "stop", f"FN 14: {body}"
        if number in (15, 16, 19, 20, 26, 27, 29, 37, 38):
            return "note", f"FN {number}"
        if number == 18:
            return self._read(body)
        if number == 28:
            for name in _NAMES.findall(body.partition("=")[0]):
                self.lose(name, "what FN 28 read from a table of the machine")
            return "note", "FN 28"
        if number == 17:
            raise PenError("E208", "FN 17 writes data of the machine, on which the path may depend", "FN 17")
        target, equal, term = body.partition("=")
        target = target.strip()
        if not equal or _NAMES.fullmatch(target) is None:
            return None
        if (why := self._unknown_in(term)) is not None:
            return self.lose(target, why)
        if number == 0:
            value = self.number(term)
        elif number in _SINGLE:
            word, call = _SINGLE[number]
            operand = self.number(term.strip().removeprefix(word))
            if number == 5 and operand < 0.0:
                raise PenError("E108", "the square root of a negative number", body)
            value = call(operand)
        elif number in _BINARY:
            word, pair = _BINARY[number]
            found = re.fullmatch(rf"{_TERM}{word}{_TERM}", term)
            if found is None:
                return None
            a, b = self.number(found[1]), self.number(found[2])
            if pair is None and b == 0.0:
                raise PenError("E108", "division by zero", body)
            value = a / b if pair is None else pair(a, b)
        else:
            return None
        if not abs(value) < 1e15:
            raise PenError("E108", f"{value:g} is out of range", body)
        self.set(target, float(value))
        return "done", ""

    def _read(self, body: str) -> tuple[str, str] | None:
        """FN 18: positions and the radius of the tool; what the machine alone knows is an error where it is used."""
        found = _READ.fullmatch(body)
        if found is None:
            return None
        kind = int(found[2][:9])
        nr, idx = (int(self.number(v)) if v else 0 for v in (found[3], found[4]))
        pen, value = self.pen, None
        if kind in (270, 240) and nr == 1 and idx in (1, 2, 3):
            # 270: programmed position; 240: the same in machine coordinates, which are those of the part here
            place = pen.at if kind == 270 else pen.frame.apply(pen.at)
            value = place[idx - 1] / pen.scale
        elif kind == 50 and nr == 2 and idx in (0, pen.tool) and pen.has_radius():
            value = pen.radius() / pen.scale
        elif kind == 60 and nr == 1:
            value = float(pen.tool)
        if value is None:
            return self.lose(
                found[1], f"what FN 18 read (ID{kind} NR{nr} IDX{idx}): only the machine knows it"
            )
        self.set(found[1], value)
        return "done", ""


def _plain(name: str) -> str:
    """Q05 is Q5."""
    head = name.rstrip("0123456789")
    return f"{head}{int(name[len(head) :][:9] or '0')}"
