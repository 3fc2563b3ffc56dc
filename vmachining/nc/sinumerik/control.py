"""Runs a Sinumerik program: flow, variables, subprograms; what a block does is in `blocks.py`."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from vmachining.nc.execution import Block, Execution, FormulaError, evaluate
from vmachining.nc.model import PenError, misread, refused
from vmachining.nc.settings import Settings
from vmachining.nc.sinumerik.text import arguments, units

_HEADS: Final = re.compile(r"(IF|ELSE|ENDIF|WHILE|ENDWHILE|FOR|ENDFOR|LOOP|ENDLOOP|UNTIL|REPEATB|REPEAT|"
                           r"GOTOF|GOTOB|GOTOC|GOTOS|GOTO|CASE|"
                           r"DEF|PROC|EXTERN|CALL|EXTCALL|PCALL|M17|RET)\b[ ]*(.*)")  # fmt: skip
_JUMP: Final = re.compile(r"(GOTO[FBC]?)[ ]*\(?[ ]*(N?[ ]*\d+|[A-Z_][A-Z0-9_]*)[ ]*\)?$")
_OPENS: Final = {"IF": "ENDIF", "WHILE": "ENDWHILE", "FOR": "ENDFOR", "LOOP": "ENDLOOP"}

_NAME: Final = re.compile(r"\$?[A-Z_][A-Z0-9_$]*")
_READABLE: Final = ("$P_TOOLNO", "$P_GWPS", "$P_TOOLR", "$TC_DP6", "$P_EP", "$AA_IW", "$AA_IM", "$P_GP")
_PARAMETER: Final = re.compile(r"\b(?:REAL|INT|BOOL|CHAR|STRING\[\d+\]|STRING|AXIS)[ ]+([A-Z_]\w*)")
_IDLE: Final = frozenset(
    {"$P_SEARCH", "$P_SEARCHL", "$P_SEARCH1", "$P_SIM", "$P_ISTEST", "$P_DRYRUN", "$P_TEST"}
)
"""No search, test or simulation: the program is read as it cuts."""


class Flow(Execution):
    """Which block comes next, and what names are worth."""

    suffixes = (".spf", ".mpf", ".nc")

    def __init__(self, lines: Sequence[str], settings: Settings) -> None:
        super().__init__(settings)
        found = units(lines)
        self.programs = {unit.name: unit.blocks for unit in found if unit.name}
        self.blocks = found[0].blocks
        self.pairs = _pair(self.blocks)
        self.r: dict[str, float] = {}
        self.variables: dict[str, float] = {}
        self.arrays: set[str] = set()
        """Names declared with an index: their elements are variables NAME[1] and NAME[1,2]."""
        self.unknown: dict[str, str] = {}
        """Names that hold what only the machine knows: what they were set to."""
        self.zeros: dict[int, dict[str, float]] = {}
        """Settable offsets that the program writes into $P_UIFR, mm by axis."""
        self.loops: dict[int, float] = {}

    def keep(self) -> tuple[dict[int, int], dict[int, float], dict[str, float]]:
        """Pairs of blocks, counts of loops, variables."""
        return self.pairs, self.loops, self.variables

    def restore(self, kept: tuple[dict[int, int], dict[int, float], dict[str, float]]) -> None:
        """The calling program has its own again."""
        self.pairs, self.loops, self.variables = kept

    # ---- names ----

    def value(self, name: str) -> float | None:
        """What a name in a formula is worth."""
        if re.fullmatch(r"R\d{1,5}", name):
            return self.r.get(f"R{int(name[1:])}")
        name, pen = self._element(name), self.pen
        if (found := self.variables.get(name)) is not None:
            return found
        if name in _IDLE:
            return 0.0
        if name in ("$P_TOOLR", "$TC_DP6", "$P_TOOLRAD"):
            return pen.radius() / pen.scale
        if (hit := re.fullmatch(r"\$(?:P_EP|AA_IW|AA_IM|P_GP)\[([XYZ])\]", name)) is not None:
            return pen.at["XYZ".index(hit[1])] / pen.scale
        return {"$P_TOOLNO": float(pen.tool), "$P_GWPS": abs(pen.rpm)}.get(name)

    def _element(self, name: str) -> str:
        """NAME[R1+1] with the value of its index."""
        base, bracket, inside = name.partition("[")
        if not bracket or base not in self.arrays:
            return name
        parts = (self.number(part) for part in arguments(inside.rstrip().removesuffix("]")))
        return f"{base}[{','.join(f'{part:g}' for part in parts)}]"

    def number(self, text: str, word: str = "") -> float:
        """Value of an expression.

        Raises PenError: E108
        """
        try:
            return evaluate(text, self.value)
        except FormulaError as exc:
            why = self._unknown_in(text)
            what = f"{why}: only the machine knows it" if why else str(exc)
            raise PenError("E108", what, word or text[:30]) from None

    def _unknown_in(self, text: str) -> str:
        """What in an expression only the machine knows, "" where that is nothing."""
        for name in map(str, _NAME.findall(text)):
            if name in self.unknown:
                return self.unknown[name]
            if name.startswith("$") and not name.startswith(_READABLE):
                return name
        return ""

    def assign(self, name: str, text: str) -> bool:
        """R1=..., NAME=...; False where the name is not a variable."""
        if name.startswith("$"):
            self._machine_data(name, text)
            return True
        name = self._element(name)
        store, key = self.variables, name
        if (hit := re.fullmatch(r"R(?:(\d{1,5})|\[(.+)\])", name)) is not None:
            store, key = self.r, f"R{int(hit[1] or self.number(hit[2])) % 100000}"
        elif name not in {*self.variables, *self.unknown} and name.partition("[")[0] not in self.arrays:
            return False
        if text.startswith('"'):
            store[key] = 0.0
        elif why := self._unknown_in(text):
            store.pop(key, None)
            self.unknown[key] = why if " was set to " in why else f"{key} was set to {why}"
            return True
        else:
            store[key] = self.number(text, name)
        self.unknown.pop(key, None)
        return True

    def zero_changed(self) -> None:
        """A settable offset has another value from its next G54 on."""
        raise NotImplementedError

    def _machine_data(self, name: str, text: str) -> None:
        """$P_UIFR and the radius of a tool are honoured; frames and data of the machine refused, the rest is noted."""
        pen, base = self.pen, name.split("[", 1)[0]
        if (hit := re.fullmatch(r"\$P_UIFR\[(\d+)(?:,([XYZABC]),TR)?\]", name.replace(" ", ""))) is not None:
            whole = re.fullmatch(r"CTRANS[ ]*\((.*)\)", text)
            pairs = [(hit[2], text)] if hit[2] else []
            if whole is not None:
                given = arguments(whole[1])
                pairs = list(zip(given[::2], given[1::2], strict=False))
            if pairs and all(axis in ("X", "Y", "Z") or self.number(value) == 0.0 for axis, value in pairs):
                kept = self.zeros.setdefault(int(hit[1]), {}) if hit[2] else {}
                self.zeros[int(hit[1])] = kept | {axis: self.number(v) * pen.scale for axis, v in pairs}
                self.zero_changed()
                return
        if (hit := re.fullmatch(r"\$TC_DP6\[(\d+),1\]", name.replace(" ", ""))) is not None:
            pen.known_radius[int(hit[1])] = self.number(text, name) * pen.scale
            return
        if re.match(r"\$P_\w*FR(?:AME)?\b|\$M[ACN]_", base):
            raise PenError("E208", f"{base} sets a frame or the data of the machine", base,
                           "write TRANS and ROT, or give the work offsets in the job")  # fmt: skip
        pen.accept(f"{base}=", base, base)

    # ---- running ----

    def execute(self, block: Block) -> None:
        """One block: steering here, the rest by `block`."""
        text = block.text
        found = _HEADS.match(text)
        if found is None:
            self.block(text)
            return
        getattr(self, f"_on_{found[1].lower()}")(found[2], text)

    def block(self, text: str) -> None:
        """A block that does not steer."""
        raise NotImplementedError

    # ---- structure ----

    def _end_of(self, start: int) -> int:
        if start not in self.pairs:
            raise self.lost(PenError("E411", "this block is never closed"))
        return self.pairs[start]

    def _true(self, text: str) -> bool:
        try:
            return self.number(text) != 0.0
        except PenError as exc:
            raise self.lost(exc) from None

    def _on_if(self, rest: str, text: str) -> None:
        place = rest.find("GOTO")
        if place >= 0:
            if self._true(rest[:place].strip()):
                self._go(rest[place:])
            return
        here = self.at - 1
        end = self._end_of(here)
        if not self._true(rest):
            self.at = self.pairs.get(-here - 1, end) + 1

    def _on_else(self, rest: str, text: str) -> None:
        start = self.pairs.get(self.at - 1)
        if start is None:
            raise self.lost(PenError("E411", "ELSE without its IF"))
        self.at = self._end_of(start) + 1

    def _on_endif(self, rest: str, text: str) -> None:
        if self.at - 1 not in self.pairs:
            raise PenError("E411", "ENDIF without its IF")

    def _on_while(self, rest: str, text: str) -> None:
        end = self._end_of(self.at - 1)
        if not self._true(rest):
            self.at = end + 1

    def _back(self, rest: str, text: str) -> None:
        start = self.pairs.get(self.at - 1)
        if start is None:
            raise self.lost(PenError("E411", f"{text[:10]} without its beginning"))
        self.at = start

    _on_endwhile = _on_endloop = _on_endfor = _back

    def _on_loop(self, rest: str, text: str) -> None:
        self._end_of(self.at - 1)

    def _on_for(self, rest: str, text: str) -> None:
        found = re.fullmatch(r"([A-Z_][A-Z0-9_]*(?:\[[^\]]*\])?)[ ]*=[ ]*(.+?)[ ]+TO[ ]+(.+)", rest)
        if found is None:
            raise self.lost(PenError("E411", "FOR name = first TO last is expected", text[:30]))
        here, end = self.at - 1, self._end_of(self.at - 1)
        now = self.loops[here] + 1.0 if here in self.loops else self.number(found[2])
        self.loops[here] = now
        if now > self.number(found[3]):
            self.loops.pop(here)
            self.at = end + 1
            return
        if not self.assign(found[1], f"{now!r}"):
            raise self.lost(PenError("E108", f"{found[1]} is not defined", found[1]))

    def _on_repeat(self, rest: str, text: str) -> None:
        if not rest.strip():
            self._end_of(self.at - 1)
            return
        found = re.fullmatch(r"([A-Z_]\w*)(?:[ ]+([A-Z_]\w*))?(?:[ ]*P[ ]*=?[ ]*(.+))?", rest)
        if found is None:
            raise self.lost(PenError("E411", "REPEAT needs the form REPEAT LABEL P=n", text[:30]))
        here = self.at - 1
        times = int(self.number(found[3])) if found[3] else 1
        first = self._label(found[1], backwards=True)
        last = here if found[2] is None or found[2] == "P" else self._label(found[2], backwards=True) + 1
        done = self.loops.get(here, 0.0)
        if done >= times:
            self.loops.pop(here, None)
            return
        self.loops[here] = done + 1.0
        if last == here:
            self.at = first
        else:
            self.enter(self.blocks, first, stop=last, back=here, whole=False)

    def _on_repeatb(self, rest: str, text: str) -> None:
        found = re.fullmatch(r"([A-Z_]\w*)(?:[ ]*P[ ]*=?[ ]*(.+))?", rest)
        if found is None:
            raise PenError("E411", "REPEATB needs the form REPEATB LABEL P=n", text[:30])
        place = self._label(found[1], backwards=True)
        for _ in range(min(int(self.number(found[2])) if found[2] else 1, 10_000)):
            self.execute(self.blocks[place])

    def _on_until(self, rest: str, text: str) -> None:
        start = self.pairs.get(self.at - 1)
        if start is None:
            raise self.lost(PenError("E411", "UNTIL without its REPEAT"))
        if not self._true(rest):
            self.at = start + 1

    def _on_goto(self, rest: str, text: str) -> None:
        self._go(text)

    _on_gotof = _on_gotob = _on_gotoc = _on_goto

    def _on_gotos(self, rest: str, text: str) -> None:
        self.ended = True  # back to the start, for machines that load parts by themselves: read once

    def _on_case(self, rest: str, text: str) -> None:
        found = re.fullmatch(r"\((.+)\)[ ]*OF\b(.*?)(?:\bDEFAULT[ ]+(GOTO.+))?", rest)
        branches = [] if found is None else re.findall(r"([+-]?[\w.]+)[ ]+(GOTO[FBC]?[ ]+\w+)", found[2])
        if found is None or not branches:
            what = "CASE needs the form CASE(value) OF constant GOTOF LABEL ..."
            raise self.lost(PenError("E411", what, "CASE"))
        try:
            value = self.number(found[1])
            goal = next((jump for constant, jump in branches if self.number(constant) == value), found[3])
        except PenError as exc:
            raise self.lost(exc) from None
        if goal:
            self._go(goal)

    def _go(self, text: str) -> None:
        found = _JUMP.match(text.strip())
        if found is None:
            raise self.lost(PenError("E412", f"'{text[:30]}' names no label", text[:30]))
        self.at = self._label(found[2], backwards=found[1] == "GOTOB" or (found[1] != "GOTOF" and None))

    def _label(self, name: str, *, backwards: bool | None) -> int:
        number = re.fullmatch(r"N?[ ]*(\d+)", name)
        here = self.at - 1
        found = [
            k for k, b in enumerate(self.blocks) if (b.n == int(number[1]) if number else b.label == name)
        ]
        before, after = [k for k in found if k <= here], [k for k in found if k > here]
        found = before[::-1] if backwards else after if backwards is False else after + before
        if not found:
            raise self.lost(PenError("E412", f"label {name} does not exist", name))
        return found[0]

    # ---- subprograms ----

    def call(self, name: str, given: Sequence[str] = (), times: int = 1) -> None:
        """A subprogram of the archive or of a file; an unknown word is one, or a cycle of the machine's builder."""
        plain = self._plain(name)
        if plain not in self.programs and self.absent(name, plain):
            return
        blocks, own = self._program(name)
        values = [self.number(text) if text and not text.startswith('"') else 0.0 for text in given]
        for _ in range(max(1, times)):
            line = None if own else self.outer or self.pen.line
            self.enter(blocks, 0)
            self.outer = line or self.outer
            self.pairs, self.loops, self.variables = _pair(blocks), {}, {}
            found = next((b for b in blocks[:20] if b.text.startswith("PROC ")), None)
            if found is not None:
                names = _PARAMETER.findall(found.text)
                self.variables.update(zip(names, [*values, *[0.0] * len(names)], strict=False))

    @staticmethod
    def _plain(name: str) -> str:
        plain = re.split(r"[\\/:]", name.strip().strip('"'))[-1].upper()
        return re.sub(r"^_N_|[._](?:SPF|MPF)$", "", plain)

    def _program(self, name: str) -> tuple[Sequence[Block], bool]:
        """Blocks of a called program, and whether it stands in the archive."""
        plain = self._plain(name)
        own = self.programs.get(plain)
        return (own, True) if own is not None else (units(self.lines_of(name, plain))[0].blocks, False)

    def _on_call(self, rest: str, text: str) -> None:
        found = re.match(r'"([^"]*)"|([A-Z_]\w*)[ ]*(?:\((.*)\))?', rest)
        if found is None or rest.startswith("BLOCK"):
            raise self.lost(refused(f"{text[:30]}", text[:20]))
        self.pen.flush()
        self.call(found[1] or found[2], arguments(found[3] or ""))

    def _on_extcall(self, rest: str, text: str) -> None:
        found = re.search(r'"([^"]*)"', rest)
        if found is None:
            raise self.lost(PenError("E412", "EXTCALL without a name in quotes", text[:20]))
        self.pen.flush()
        self.call(found[1])

    _on_pcall = _on_call

    def _on_m17(self, rest: str, text: str) -> None:
        self.pen.flush()
        self.ended = not self.leave()

    _on_ret = _on_m17

    def _on_proc(self, rest: str, text: str) -> None:
        """Its parameters were bound by the call; a subprogram says itself what it takes."""

    _on_extern = _on_proc

    def _on_def(self, rest: str, text: str) -> None:
        found = re.match(
            r"(?:(?:NCK|CHAN|SYNR|SYNW|SYNRW)[ ]+)*(REAL|INT|BOOL|CHAR|STRING[ ]*\[[ ]*\d+[ ]*\]|AXIS|FRAME)[ ]+(.*)",
            rest,
        )
        if found is None:
            raise misread(text[:40])
        for part in arguments(found[2]):
            name, equal, value = part.partition("=")
            name, value = name.strip(), value.strip()
            if (array := re.fullmatch(r"([A-Z_][A-Z0-9_]*)[ ]*\[[^\]]*\]", name)) is not None:
                self.arrays.add(array[1])
                continue  # its elements have no value before one is set
            if not re.fullmatch(r"[A-Z_][A-Z0-9_]*", name):
                raise PenError("E109", f"'{part[:40]}' is not a variable that is supported", part[:40])
            self.variables[name] = 0.0
            if equal and found[1] in ("REAL", "INT", "BOOL") and not value.startswith('"'):
                self.assign(name, value)


def _pair(blocks: Sequence[Block]) -> dict[int, int]:
    """Index of an opening block -> that of its end (an IF: of its ELSE too, by -index-1), and back."""
    out: dict[int, int] = {}
    opened: list[tuple[int, str]] = []
    for k, block in enumerate(blocks):
        found = _HEADS.match(block.text)
        if found is None:
            continue
        head, rest = found[1], found[2]
        if head == "IF" and "GOTO" in rest:
            continue
        if head in _OPENS:
            opened.append((k, _OPENS[head]))
        elif head == "REPEAT" and not rest.strip():
            opened.append((k, "UNTIL"))
        elif head == "ELSE" and opened and opened[-1][1] == "ENDIF":
            out[-opened[-1][0] - 1] = k
            out[k] = opened[-1][0]
        elif head in ("ENDIF", "ENDWHILE", "ENDFOR", "ENDLOOP", "UNTIL") and opened and opened[-1][1] == head:
            start, _ = opened.pop()
            out[start], out[k] = k, start
    return out
