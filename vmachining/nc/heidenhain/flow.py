"""Which block of a conversational program comes next: labels, calls, jumps."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Final

from vmachining.nc.execution import FREE, Block, Execution
from vmachining.nc.heidenhain.contour import AXES
from vmachining.nc.heidenhain.parameters import Parameters
from vmachining.nc.heidenhain.planes import Planes
from vmachining.nc.heidenhain.text import Word, blocks
from vmachining.nc.refusal import PenError, misread, refused
from vmachining.nc.settings import Settings

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
        self.planes = Planes()
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
        """One block."""
        text = block.text
        found = _SIMPLE.match(text)
        if found is not None and not text.startswith(("CALL", "CYCL")):
            self._path(found, text[found.end() :])
            return
        if _FREE.match(text) is not None:
            raise PenError(
                "E208", FREE, text.split(" ", 1)[0], "let the control write the contour out as L and C blocks"
            )
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

    def _do_pgm(self, text: str) -> None:
        self._do_call(text)

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
