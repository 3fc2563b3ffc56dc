"""Text of conversational programs: blocks, and the words of a motion block.

A block may run over several lines: `~` at the end continues it, and so do the `Q200=...` lines of a cycle that carry
no block number. Comments open with `;`, structure lines with `*`. Decimal commas are points.

DIN/ISO programs (dialect `heidenhain-iso`) are turned into conversational blocks, which then run:

    %PART G71 *            BEGIN PGM PART MM (G70: INCH)      N10 ... *   a block
    G30 G17 X Y Z, G31     BLK FORM 0.1, 0.2                  G99 T1 L R  TOOL DEF      T1 G17 S F   TOOL CALL
    G00 G01                L (FMAX, F)                        G02 G03     C about I J, or CR with R
    G05 G06                C in the sense before, CT          G10 G11     LP (H angle, R radius)
    G12 G13 G15 G16        CP, CP, CP, CTP                    G24 G25     CHF, RND
    I J, G29               CC                                 G40 G41 G42 R0, RL, RR
    G54 X Y Z              cycle 7                            G28 X       cycle 8
    G73 H, G72 F           cycles 10, 11                      G04 F       cycle 9
    G80 A B C              cycle 19                           G247 Q339   cycle 247
    G200 ... G262 Q...     the cycle of that number           G79, M99    CYCL CALL
    G98 L1, L1,3           LBL 1, CALL LBL 1 REP 3            G98 L0      LBL 0
    D00 Q5 P01 +10         FN 0: Q5 = +10                     %NAME       CALL PGM NAME
    D12 P01 a P02 b P03 1  FN 12: IF a LT b GOTO LBL 1
    G90 G91                absolute, incremental              G71 G70     mm, inch

Everything else is refused by name. Source: HEIDENHAIN TNC 640, user's manual ISO programming (public).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final, NamedTuple

from vmachining.nc.execution import Block

LONGEST: Final = 4096
TERM: Final = r"([+-]?\s*(?:Q[LR]?\d+|\d+\.?\d*|\.\d+))"
"""A number or a parameter, as a group of a pattern."""


class Word(NamedTuple):
    """key : "X", "PA", "LEN", "RL", "M", "FMAX", ...; value : text of the number or parameter, "" without one."""

    key: str
    value: str
    incremental: bool
    text: str


_NUMBERED: Final = re.compile(r"[ \t]*(/?)[ \t]*(\d+)(?:[ \t]+|$)")
"""A control writes the slash of a skipped block before its number, `/ 13 STOP`; `13 /STOP` is the older form."""
_PARAMETER: Final = re.compile(r"[ \t]*Q\d{3,4}[ \t]*=", re.IGNORECASE)
_CYCLE: Final = re.compile(r"[ \t]*/?[ \t]*\d*[ \t]*/?[ \t]*CYCL[ \t]+DEF[ \t]+\d{3}\b", re.IGNORECASE)
_ASIDE: Final = re.compile(r"\(.*\)")
"""A line in round brackets, which no block is: a remark that editors and simulators write."""
_COMMA: Final = re.compile(r"(?<=\d),(?=\d)")
_QUOTED: Final = re.compile(r'"[^"]*"')


def spans(text: str) -> frozenset[int]:
    """`3-6 14`: the numbers 3 to 6 and 14."""
    ends = ([int(number) for number in part.split("-")] for part in text.split())
    return frozenset(number for pair in ends for number in range(pair[0], pair[-1] + 1))


def blocks(lines: Sequence[str]) -> list[Block]:
    """Every block; empty lines and comments are left out."""
    out: list[Block] = []
    at = 0
    while at < len(lines):
        first, raw = at, lines[at]
        parts = [raw]
        cycle = _CYCLE.match(raw) is not None
        size = len(raw)
        while at + 1 < len(lines) and size < LONGEST:
            more = lines[at + 1]
            if not (parts[-1].rstrip().endswith("~") or (cycle and _PARAMETER.match(more))):
                break
            parts.append(more)
            size += len(more)
            at += 1
        at += 1
        number = _NUMBERED.match(raw)
        n = int(number[2][:9]) if number else None
        parts[0] = raw[number.end() :] if number else raw
        text = " ".join(_bare(part) for part in parts).strip()
        skip = text.startswith("/")
        text = text[1:].lstrip() if skip else text
        skip = skip or bool(number and number[1])
        if _ASIDE.fullmatch(text):
            continue
        if text and not text.startswith("*") and not parts[0].lstrip().startswith(";"):
            out.append(Block(first + 1, n, text, raw, skip=skip))
    return out


def _bare(part: str) -> str:
    """Without comment and continuation mark, in capitals but for what is quoted."""
    cut = _QUOTED.sub(lambda hit: "\0" * len(hit[0]), part)
    end = cut.find(";")
    part = part if end < 0 else part[:end]
    part = part.rstrip().rstrip("~")
    kept: list[str] = []

    def hold(hit: re.Match[str]) -> str:
        kept.append(hit[0])
        return "\0"

    part = _COMMA.sub(".", _QUOTED.sub(hold, part).upper())
    for text in kept:
        part = part.replace("\0", text, 1)
    return part.replace("\t", " ").strip()


_VALUE: Final = r"[ ]*([+-]?[ ]*(?:\d+\.?\d*|\.\d+|Q[LR]?\d+))"
_WORD: Final = re.compile(
    r"[ ]*(?:(?P<dir>DR)[ ]*(?P<sign>[+-])(?![ ]*[\dQ.])"
    r"|(?P<fmax>F[ ]*(?:MAX|AUTO))"
    rf"|(?P<mb>MB)(?:[ ]*(?P<mbmax>MAX)|{_VALUE})"
    r"|(?P<comp>R[LR0](?![\d.Q])|R(?![ ]*[+-]?[ ]*[\dQ.+-]))"
    r"|(?P<par>R[+-])(?![ ]*[\dQ.])"
    rf"|(?P<inc>I?)(?P<key>P[AR]|LEN|CCA|N[XYZ]|T[XYZ]|[XYZABCUVWHE]|F[UZT]?|R|DR|M|LA|S|T){_VALUE}"
    r"|(?P<bare>F|M)(?![A-Z0-9+.-]))"
)


def words(text: str) -> tuple[list[Word], str]:
    """Words of a motion block behind its keyword, and the rest of the text."""
    out: list[Word] = []
    at = 0
    while at < len(text):
        found = _WORD.match(text, at)
        if found is None or found.end() == at:
            break
        at = found.end()
        body = found[0].strip()
        if found["dir"]:
            out.append(Word("DR", found["sign"], False, body))
        elif found["fmax"]:
            out.append(Word("FMAX" if "MAX" in body else "FAUTO", "", False, body))
        elif found["mb"]:
            out.append(Word("MB", found["mbmax"] or found[6], False, body))
        elif found["comp"]:
            out.append(Word("COMP", found["comp"], False, body))
        elif found["par"]:
            out.append(Word("PAR", found["par"], False, body))
        elif found["key"]:
            value = re.sub(r"[ ]", "", found[11])
            out.append(Word(found["key"], value, bool(found["inc"]), body))
        elif found["bare"] == "F":
            out.append(Word("F", "", False, body))
    return out, text[at:].strip()


_ISO_WORD: Final = re.compile(
    rf"[ ]*(?:(Q\d{{3,4}})[ ]*=[ ]*([+-]?(?:\d+\.?\d*|\.\d+|Q\d+))|([A-Z]){_VALUE})"
)
_HEAD: Final = re.compile(r"%[ ]*(\S+?)[ ]*(?:[ ]G(7[01])|G(7[01]))[ ]*$")
_CALL: Final = re.compile(r"%[ ]*:?[ ]*(\S+)$")
_FN: Final = re.compile(r"D[ ]*(\d+)[ ]+(Q\d+)[ ]*((?:P\d+[ ]*[+-]?[ ]*(?:Q?\d+\.?\d*|\.\d+)[ ]*)*)$")
_OPERATORS: Final = {0: "{a}", 1: "{a} + {b}", 2: "{a} - {b}", 3: "{a} * {b}", 4: "{a} DIV {b}", 5: "SQRT {a}",
                     6: "SIN {a}", 7: "COS {a}", 8: "{a} LEN {b}", 13: "{a} ANG {b}"}  # fmt: skip
_JUMPS: Final = {9: "EQU", 10: "NE", 11: "GT", 12: "LT"}
_JUMP: Final = re.compile(rf"D[ ]*(0?9|1[0-2])[ ]+P01{_VALUE}[ ]*P02{_VALUE}[ ]*P03[ ]*\+?(\d+)")
_MOTIONS: Final = frozenset({0, 1, 2, 3, 5, 6, 10, 11, 12, 13, 15, 16})
_CYCLES: Final = frozenset({*range(200, 300), 32, 36})
_QUIET: Final = frozenset({17, 40, 41, 42, 50, 51, 62, 70, 71, 90, 91})


class _State:
    def __init__(self) -> None:
        self.motion, self.absolute, self.began = 0, True, ""


def conversational(lines: Sequence[str]) -> list[Block]:
    """Blocks of the conversational language; what has no counterpart becomes a block that is refused by name."""
    out: list[Block] = []
    state = _State()
    held, begin = "", 0
    for number, raw in enumerate(lines, 1):
        text = raw.split(";", 1)[0].upper().replace("\t", " ").strip()
        text = re.sub(r"\*?[ ]*$", "", text) if text.endswith("*") else text
        # the values of a cycle may stand on their own lines: with another line it is complete
        if held and not re.match(r"Q\d{3,4}[ ]*=", text):
            out += [Block(begin, None, block, held) for block in _translate(held, state)]
            held = ""
        elif held:
            held = f"{held} {text}"
            continue
        if not text:
            continue
        found = re.match(r"N[ ]*(\d{1,9})[ ]*", text)
        n = int(found[1]) if found else None
        text = text[found.end() :] if found else text
        if re.match(r"G[ ]*2\d\d(?![\d.])", text):
            held, begin = text.rstrip("~ "), number
            continue
        out += [Block(number, n, block, raw) for block in _translate(text.strip(), state)]
    return out + [Block(begin, None, block, held) for block in (_translate(held, state) if held else [])]


def _translate(text: str, state: _State) -> list[str]:
    if not text:
        return []
    if (head := _HEAD.fullmatch(text)) is not None:
        unit = "MM" if "71" in (head[2], head[3]) else "INCH"
        if state.began:
            return [f"END PGM {state.began} {unit}"]
        state.began = head[1]
        return [f"BEGIN PGM {head[1]} {unit}"]
    if (call := _CALL.fullmatch(text)) is not None:
        return [f"CALL PGM {call[1]}"]
    if (fn := _FN.fullmatch(text)) is not None:
        return [_function(int(fn[1]), fn[2], fn[3])]
    if (jump := _JUMP.fullmatch(text)) is not None:
        return [f"FN {int(jump[1])}: IF {jump[2]} {_JUMPS[int(jump[1])]} {jump[3]} GOTO LBL {int(jump[4])}"]
    if (label := re.fullmatch(r"G98[ ]*L[ ]*(\d+)(.*)", text)) is not None:
        rest = _translate(label[2].strip(), state)
        return [f"LBL {int(label[1])}", *rest]
    if (repeat := re.fullmatch(r"L[ ]*(\d+)(?:[ ]*[,.][ ]*(\d+))?", text)) is not None:
        times = f" REP{repeat[2]}/{repeat[2]}" if repeat[2] and int(repeat[2]) else ""
        return [f"CALL LBL {int(repeat[1])}{times}"]
    if re.match(r"Q\d+[ ]*=", text) and not text.startswith("Q2"):
        return [text]
    text = re.sub(r"^(G[ ]*2\d\d)[ ]*[A-PR-Z][A-Z .-]*?(?=[ ]+Q\d|$)", r"\1", text)  # the name of a cycle
    words, at = list[tuple[str, str]](), 0
    while at < len(text):
        found = _ISO_WORD.match(text, at)
        if found is None:
            return [f"NOT-UNDERSTOOD {text[at:][:40]}"]
        words.append((found[1] or found[3], (found[2] or found[4]).replace(" ", "")))
        at = found.end()
    return _block(words, state)


def _function(number: int, target: str, rest: str) -> str:
    terms = re.findall(r"P\d+[ ]*([+-]?)[ ]*(Q?\d+\.?\d*|\.\d+)", rest)
    signed = [f"{sign or '+'}{value}" for sign, value in terms]
    if number in _OPERATORS and len(signed) >= ("{b}" in _OPERATORS[number]) + 1:
        return f"FN {number}: {target} = " + _OPERATORS[number].format(a=signed[0], b=signed[-1])
    return f"NOT-UNDERSTOOD D{number:02d}"


def _block(words: list[tuple[str, str]], state: _State) -> list[str]:
    codes = [int(float(v)) for k, v in words if k == "G" and v.replace(".", "", 1).isdigit()]
    out: list[str] = []
    for code in codes:
        if code in (90, 91):
            state.absolute = code == 90
    values = dict(words)
    step = "" if state.absolute else "I"

    def axes(letters: str = "XYZABC", prefix: str | None = None) -> str:
        mark = step if prefix is None else prefix
        return " ".join(f"{mark}{k}{_signed(v)}" for k, v in words if k in letters)

    special = next((c for c in codes if c not in _MOTIONS and c not in _QUIET and c not in (24, 25)), None)
    if special in (30, 31):
        mark = "I" if special == 31 and not state.absolute else ""
        return [f"BLK FORM 0.{special - 29}{' Z' if special == 30 else ''} {axes('XYZ', mark)}"]
    if special == 99:
        length, radius = (_signed(values.get(letter, "0")) for letter in "LR")
        return [f"TOOL DEF {values.get('T', '0')} L{length} R{radius}"]
    if special == 54:
        return ["CYCL DEF 7.0", *(f"CYCL DEF 7.{k} {step}{letter}{_signed(v)}" for k, (letter, v) in
                                  enumerate(((a, b) for a, b in words if a in "XYZABC"), 1))]  # fmt: skip
    old = {
        28: (8, " ".join(k for k, _ in words if k in "XYZABC")), 73: (10, f"{step}ROT{_signed(values.get('H', '0'))}"),
        72: (11, f"SCL{values.get('F', '0')}"), 4: (9, f"DWELL {values.get('F', '')}"), 80: (19, axes("ABC", "")),
    }  # fmt: skip
    if special in old:
        number, rest = old[special]
        return [f"CYCL DEF {number}.0", f"CYCL DEF {number}.1 {rest}"]
    if special in (29, 38):
        return ["CC" if special == 29 else "STOP"]
    if special is not None and special in _CYCLES:
        given = " ".join(f"{k}={v}" for k, v in words if k.startswith("Q"))
        return [f"CYCL DEF {special} {given}"]
    if special == 79:
        out.append("CYCL CALL" + "".join(f" M{v}" for k, v in words if k == "M"))
        return out
    if special is not None:
        return [f"NOT-UNDERSTOOD G{special}"]
    if "T" in values:
        tail = "".join(f" {k}{values[k]}" for k in "SF" if k in values)
        out.append(f"TOOL CALL {values['T']} Z{tail}")
        words = [w for w in words if w[0] not in "TSF" and w != ("G", "17")]
        if not any(k in "XYZMHIJ" for k, _ in words):
            return out
    elif "S" in values:
        out.append(f"TOOL CALL Z S{values['S']}")
    motion = next((c for c in codes if c in _MOTIONS), None)
    if motion is not None:
        state.motion = motion
    return out + _motion(words, codes, state, step)


def _motion(words: list[tuple[str, str]], codes: list[int], state: _State, step: str) -> list[str]:
    values = dict(words)
    axes = dict(zip("IJK", "XYZ", strict=True))
    pole = " ".join(f"{step}{axes[k]}{_signed(v)}" for k, v in words if k in axes)
    out = [f"CC {pole}"] if pole else []
    tail = []
    comp = next((c for c in codes if c in (40, 41, 42)), None)
    if comp is not None:
        tail.append({40: "R0", 41: "RL", 42: "RR"}[comp])
    if "F" in values:
        tail.append(f"F{values['F']}")
    tail += [f"M{v}" for k, v in words if k == "M"]
    if 25 in codes or 24 in codes:
        return [*out, f"RND R{values.get('R', '0')}" if 25 in codes else f"CHF {values.get('R', '0')}"]
    place = " ".join(f"{step}{k}{_signed(v)}" for k, v in words if k in "XYZABC")
    polar = " ".join(f"{step}{'PA' if k == 'H' else 'PR'}{_signed(v)}" for k, v in words if k in "HR")
    motion = state.motion
    rapid = motion in (0, 10)
    if rapid and comp != 41 and comp != 42 and (place or polar):
        tail.append("FMAX")
    if motion in (0, 1):
        if not place and not any(k == "M" for k, _ in words) and comp is None and "F" not in values:
            return out
        return [*out, " ".join(["L", place, *tail]) if place or comp is not None else " ".join(tail)]
    if motion in (10, 11):
        return [*out, " ".join(["LP", polar, place, *tail])]
    if not (place or polar):
        return [*out, " ".join(tail)] if tail else out
    turn = {2: "DR-", 3: "DR+", 12: "DR-", 13: "DR+"}.get(motion, "")
    if motion in (2, 3, 5):
        if "R" in values:
            return [*out, " ".join(["CR", place, f"R{_signed(values['R'])}", turn, *tail])]
        return [*out, " ".join(["C", place, turn, *tail])]
    head = {6: "CT", 16: "CTP"}.get(motion, "CP")
    return [*out, " ".join([head, polar if motion != 6 else "", place, turn, *tail])]


def _signed(value: str) -> str:
    return value if value[:1] in "+-" else f"+{value}"
