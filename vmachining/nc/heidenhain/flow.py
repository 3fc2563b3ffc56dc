"""Which block of a conversational program comes next: Q parameters and FN, labels, calls, jumps."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from typing import Final

from vmachining.nc.execution import FREE, Block, Execution, FormulaError, evaluate
from vmachining.nc.heidenhain.contour import AXES
from vmachining.nc.heidenhain.text import Word, blocks
from vmachining.nc.model import PenError, misread, refused
from vmachining.nc.pen import Pen
from vmachining.nc.settings import Settings

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
        return next((why for q in _NAMES.findall(text) if (why := self.unknown.get(_plain(q)))), None)

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
            why = f"what FN 18 read (ID{kind} NR{nr} IDX{idx}): only the machine knows it"
            return self.lose(found[1], why)
        self.set(found[1], value)
        return "done", ""


def _plain(name: str) -> str:
    """Q05 is Q5."""
    head = name.rstrip("0123456789")
    return f"{head}{int(name[len(head) :][:9] or '0')}"


_LABEL: Final = re.compile(r'LBL\s*(?:(\d+)|"([^"]*)"|([A-Z_]\w*))$')
_CALL: Final = re.compile(
    r'CALL\s+LBL\s*(?:(\d+)|"([^"]*)"|(Q[LR]?\d+))(?:\s*REP\s*([+-]?Q?\d+)(?:\s*/\s*\d+)?)?\s*$'
)
_PGM: Final = re.compile(r"(?:SEL\s+PGM|CALL\s+PGM|PGM\s+CALL|CALL\s+SELECTED\s+PGM)\b\s*(.*)")
_SIMPLE: Final = re.compile(
    r"(APPR|DEP)\s+(P?(?:LT|LN|CT|LCT))\b|(LN|LP|CTP|CT|CR|CC|CP|C|L|RND|CHF)(?![A-Z]{2}|[A-HJ-Z](?=[A-Z]))"
)

_FREE: Final = re.compile(r"F(?:POL|LT?|CT?|SELECT)\b(?![ ]*=)")


class Flow(Execution):
    """A conversational program being executed."""

    suffixes = (".h", ".hnc", ".nc", ".txt")

    def __init__(
        self, lines: Sequence[str], settings: Settings, split: Callable[[Sequence[str]], list[Block]] = blocks
    ) -> None:
        super().__init__(settings)
        self.q = Parameters(self.pen)
        self.split = split
        self.blocks = split(lines)
        self.labels = _labels(self.blocks)
        self.counts: dict[int, int] = {}
        self.begun = False
        self.direction = ""
        self.shortest = False
        """M126: rotary axes go the shorter way round."""
        self.rapid = False
        self.comp = 0
        self.cycle: tuple[int, dict[str, float]] | None = None
        self.modal = False
        self.preset: float | None = None
        self.stock: list[tuple[str, dict[int, float]]] = []
        self.selected = ""

    def keep(self) -> tuple[dict[str, int], dict[int, int], dict[str, float]]:
        """Labels, counts of repetitions, QL parameters."""
        return self.labels, self.counts, self.q.local()

    def restore(self, kept: tuple[dict[str, int], dict[int, int], dict[str, float]]) -> None:
        """The calling program has its own again."""
        if kept[0] is not self.labels:
            self.labels, self.counts = kept[:2]
            self.q.local(kept[2])

    def execute(self, block: Block) -> None:
        text = block.text
        found = _SIMPLE.match(text)
        if found is not None and not text.startswith(("CALL", "CYCL")):
            self._path(found, text[found.end() :])
            return
        if _FREE.match(text) is not None:
            what = "let the control write the contour out as L and C blocks"
            raise PenError("E208", FREE, text.split(" ", 1)[0], what)
        head = text.split(" ", 1)[0]
        do = getattr(self, "_do_" + head.lower().replace("#", ""), None) if head.isalpha() else None
        if do is not None:
            do(text)
            return
        try:
            result = self.q.execute(text)
        except PenError:
            self.ended = "GOTO" in text  # what comes next is not known
            raise
        if result is not None:
            self._flow(*result)
            return
        rest = self._read_words(text)
        if not rest:
            raise misread(text[:40])
        if all(w.key not in ("PR", "PA") for w in rest) and any(w.key in AXES for w in rest):
            line = _SIMPLE.match("L")  # a block parallel to an axis, by the axis keys: X+20 R0 F100
            assert line is not None
            self._path(line, text)
            return
        if any(w.key in ("PR", "PA") for w in rest):
            raise PenError("E109", f"'{text[:40]}' has coordinates and no path function", text[:40])
        self._modes(rest, moves=False)

    def _flow(self, kind: str, value: str) -> None:
        if kind == "jump":
            label = value.strip().strip('"')
            if label.startswith("Q"):
                label = f"{self.q.number(label):g}"
            if label not in self.labels:
                raise self.lost(PenError("E412", f"label {label} does not exist", value))
            self.at = self.labels[label]
        elif kind == "stop":
            raise self.lost(PenError("E418", value))
        elif kind == "note":
            self.pen.note("I408", f"{value} moves nothing: accepted", value, once=value)

    def _do_lbl(self, text: str) -> None:
        found = _LABEL.match(text)
        if found is None:
            raise PenError("E109", f"'{text[:40]}' is not a label", text[:40])
        if found[1] is not None and int(found[1]) == 0 and self.stack and not self.stack[-1].whole:
            self.leave(whole=False)

    def _do_call(self, text: str) -> None:
        if (found := _CALL.fullmatch(text)) is not None:
            label = found[1] or found[2] or f"{self.q.number(found[3]):g}"
            label = str(int(label)) if label.isdigit() else label
            if label not in self.labels:
                raise self.lost(PenError("E412", f"label {label} does not exist", label))
            if found[4] is None:
                self.enter(self.blocks, self.labels[label], whole=False)
                return
            here, times = self.at, int(self.q.number(found[4]))
            done = self.counts.get(here, 0)
            if done < times:
                self.counts[here] = done + 1
                self.at = self.labels[label]
            else:
                self.counts.pop(here, None)
            return
        if (found := _PGM.match(text)) is not None:
            self._call_file(found[1])
            return
        raise misread(text[:40])

    _do_pgm = _do_call

    def _do_sel(self, text: str) -> None:
        if (found := re.match(r"SEL\s+PGM\s*(.+)", text)) is not None:
            self.selected = found[1]
            return
        if re.match(r"SEL\s+(?:TABLE|PATTERN|CORR-TABLE|CONTOUR|CYCLE)", text) is None:
            raise refused(f"{text[:40]}", text[:20])
        self.pen.note("I408", f"{text[:20]}: what uses it is refused", text[:20], once=text[:9])

    def _call_file(self, name: str) -> None:
        name = (name or self.selected).strip().strip('"')
        plain = re.split(r"[\\/:]", name)[-1].strip()
        stem = plain.rsplit(".", 1)[0]
        if self.absent(name, stem):
            return
        called = self.split(self.lines_of(name, stem))
        line = self.outer or self.pen.line
        self.enter(called, 0)
        self.labels, self.counts, self.outer = _labels(called), {}, line
        self.q.local({})

    def _do_begin(self, text: str) -> None:
        found = re.match(r"BEGIN\s+PGM\b\s*(.*?)\s*\b(MM|INCH|IN)?\s*$", text)
        if found is None:
            raise misread(text[:40])
        scale = 25.4 if found[2] in ("INCH", "IN") else 1.0
        if self.begun and scale != self.pen.scale:
            raise PenError("E208", "a called program in another unit", found[2] or "")
        self.pen.scale, self.begun = scale, True

    def _do_end(self, text: str) -> None:
        self.pen.flush()
        self.ended = not self.leave()

    def _read_words(self, text: str) -> list[Word]:
        """Words of a block of motions and modes."""
        raise NotImplementedError

    def _path(self, found: re.Match[str], rest: str) -> None:
        """A path function."""
        raise NotImplementedError

    def _modes(self, given: list[Word], *, moves: bool, defer: bool = False) -> Callable[[], None]:
        """F, compensation, M codes."""
        raise NotImplementedError


def _labels(found: Sequence[Block]) -> dict[str, int]:
    out: dict[str, int] = {}
    for index, block in enumerate(found):
        if block.text.startswith("LBL") and (hit := _LABEL.match(block.text)) is not None:
            name = str(int(hit[1])) if hit[1] is not None else hit[2] or hit[3]
            if name != "0":
                out.setdefault(name, index + 1)
    return out
