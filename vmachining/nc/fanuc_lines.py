"""Lines of the Fanuc family made plain for the lexer, and findings folded to one for each cause.

Marks of programs for turning, and what they say of their lathe: diameters or radii, the sense of arcs, G code system B.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Final, Literal

from vmachining.nc.findings import finding
from vmachining.nc.lexer import MAX_LINE
from vmachining.nc.model import Finding, Motion, Move
from vmachining.nc.settings import Settings

_NX_HEADER: Final = re.compile(r"^\s*Information listing created by\b", re.IGNORECASE)
_RULE: Final = re.compile(r"^\s*={20,}\s*$")
_NAMED: Final = re.compile(
    r"^([ \t]*(?:[Nn][0-9]+[ \t]*)?)[oO](?![ \t]*[0-9#<\[])([ \t]*[A-Za-z_][^()]*)?(?=$|\()"
)
_COLON: Final = re.compile(r"^([ \t]*):[ \t]*([0-9]+)(?=[ \t]*[A-Za-z])")
_BLOCK: Final = re.compile(r"^[ \t]*:[ \t]*[A-Za-z]")
_O_WORDS: Final = re.compile(r"^([ \t]*)[oO][ \t]*([0-9]{1,9})(?=[ \t]*[GMXYZTSF][ \t]*[-+0-9.])")
_ANGLED: Final = re.compile(r"<[^<>]*>")
_SKIP: Final = re.compile(r"(?<=[0-9 \t])/[1-9]?(?=[ \t]*[A-Za-z])|^[ \t]*/[1-9](?=[A-Za-z \t])|//[0-9]?")
_PERCENT: Final = re.compile(
    r"^[ \t]*%[ \t]*[A-Za-z][A-Za-z0-9]*[ \t]*$|^[ \t]*%[ \t]*[oO:][0-9]+[ \t]*(?:\(.*)?$"
)
_OKUMA_NAME: Final = re.compile(r"^[ \t]*\$[^%]*%[ \t]*$")
_PRINT: Final = re.compile(
    r"^[ \t]*(?:[Nn][0-9]+[ \t]*)?(?:POPEN|PCLOS|DPRNT|BPRNT|SETVN|MSG_OK)\b.*", re.IGNORECASE
)
_REMARK: Final = re.compile(r"^[ \t]*//[ \t]*[A-Z][A-Z ]", re.IGNORECASE)
_ASSIGNED: Final = re.compile(r"(#(?:[0-9]+|\[[^=]*\])[ \t]*=[ \t]*)([^=(;]+)(?=$|\(|;)")
_OPERATION: Final = re.compile(r"[\]0-9.][ \t]*(?:[-+*/]|MOD|AND|OR|XOR|EQ|NE|GT|GE|LT|LE)", re.IGNORECASE)
_REMARKS: Final = re.compile(r"\([^()]*\)|;.*")
_CONTROL: Final = re.compile(r"[\x00-\x08\x0b-\x1f\x7f]")


def prepare(line: str) -> str:
    """A line in the form that the lexer knows; columns stay, what means nothing becomes blanks or a comment."""
    if line.isascii() and line.isalnum() and line[0] not in "Pp":
        return line
    if not line.isprintable():
        line = _CONTROL.sub(" ", line)
    if "(" in line or ")" in line:
        line = _plain_comments(line)
    if len(line) > MAX_LINE:
        line = _REMARKS.sub(lambda hit: f"({hit[0][1:60].rstrip(')')})" if len(hit[0]) > 60 else hit[0], line)
    bare = line.lstrip(" \t")
    if not bare:
        return line
    first = bare[0]
    if first == "/" and _REMARK.match(line):
        return ""
    if first in "%$" and (_PERCENT.match(line) or _OKUMA_NAME.match(line)):
        return "%" if first == "%" else ""
    if first in "oO" or (first in "nN" and "O" in bare.upper()):
        if (named := _NAMED.match(line)) is not None:
            return f"{named[1]}({line[len(named[1]) + 1 :].replace('(', '[').replace(')', ']')})"
        line = _O_WORDS.sub(r"\1N\2", line)
    elif first == ":":
        line = _COLON.sub(r"\1N\2", line)
        if _BLOCK.match(line):
            line = line.replace(":", " ", 1)
    if "<" in line and "#<" not in line:
        line = _ANGLED.sub(lambda hit: " " * len(hit[0]), line)
    if "/" in line and "[" not in line:
        code, mark, rest = line.partition("(")
        code = _SKIP.sub(lambda hit: (" " if hit.start() else "/").ljust(len(hit[0])), code)
        line = code + mark + rest
    if _PRINT.match(line):
        return ""
    if "[" in line:
        line = _SHORT.sub(lambda hit: SHORT[hit[1].upper()] + "[", line)
        line = _POWER.sub(r"[[\1]**[\2]]", _ANGLE.sub(r"ATAN[\1]/[\2]", line))
    return bracketed(line) if "=" in line else line


SHORT: Final = {"SQR": "SQRT", "RND": "ROUND"}
_SHORT: Final = re.compile(r"(?<![A-Z])(SQR|RND)\[", re.IGNORECASE)
_INSIDE: Final = r"((?:[^\[\],]|\[[^\[\]]*\])+)"
_ANGLE: Final = re.compile(rf"(?<![A-Z])ATAN\[{_INSIDE},{_INSIDE}\]", re.IGNORECASE)
_POWER: Final = re.compile(rf"(?<![A-Z])POW\[{_INSIDE},{_INSIDE}\]", re.IGNORECASE)
"""Functions of two values: the core writes ATAN[y]/[x] and [[x]**[y]]."""


def bracketed(line: str) -> str:
    """`#1 = #1 + 1` as `#1 = [#1 + 1]`: these controls need no brackets about the whole."""
    return _ASSIGNED.sub(
        lambda hit: f"{hit[1]}[{hit[2].rstrip()}]" if _OPERATION.search(hit[2]) else hit[0], line
    )


def _plain_comments(line: str) -> str:
    """Comments within comments become brackets, an open one is closed."""
    depth, out = 0, list(line)
    for k, char in enumerate(line):
        if char == "(":
            depth += 1
            if depth > 1:
                out[k] = "["
        elif char == ")":
            if depth > 1:
                out[k] = "]"
            elif depth == 0:
                out[k] = " "
            depth = max(0, depth - 1)
    return "".join(out) + (")" if depth else "")


def without_header(lines: list[str]) -> list[str]:
    """The window that NX lists a program in opens with a header between two rules: it becomes empty lines."""
    if not any(_NX_HEADER.match(line) for line in lines[:10]):
        return lines
    rules = [k for k, line in enumerate(lines[:30]) if _RULE.match(line)]
    if len(rules) < 2:
        return lines
    return ["" if k <= rules[1] else line for k, line in enumerate(lines)]


_CHANGE: Final = re.compile(r"(?<![A-Z#])T[ \t]*[0-9]", re.IGNORECASE)
_M: Final = re.compile(r"(?<![A-Z#])M[ \t]*0*([0-9]{1,4})(?![0-9.])", re.IGNORECASE)
REMARK: Final = re.compile(r"\([^()]*\)?|;.*")
"""A comment, closed or not."""


def tool_changer(lines: list[str]) -> int:
    """The M code that stands beside every T, in a program without M6; 0 where none does."""
    found = set[int]()
    for line in lines:
        if "T" not in line and "M" not in line:
            continue
        bare = REMARK.sub(" ", line) if "(" in line or ";" in line else line
        codes = {int(text) for text in _M.findall(bare)}
        if 6 in codes:
            return 0
        if _CHANGE.search(bare):
            found = found & codes if found else codes
            if not found:
                return 0
    return found.pop() if len(found) == 1 else 0


_NUMBERS: Final = re.compile(r"[-+]?[0-9.]+")
_OTHER_MACHINES: Final = {
    "UW": "U and W are steps of X and Z: this is a program for turning, which is not read",
    "UV": "U and V guide the upper end of a wire: this is a program for wire erosion, which is not read",
}


def folded(findings: list[Finding]) -> list[Finding]:
    """One finding for each cause: the first, with the number of lines that say the same; of a lathe nothing else."""
    others = [item for item in findings if item.code == "E209"]
    turning = next((item for item in others if "belongs to a lathe" in item.message), None)
    what = "" if turning is None else f"{turning.message}: this is a program for turning, which is not read"
    if turning is None and others:
        missing = {item.message[-1] for item in others if "has no axis" in item.message}
        what = next((text for axes, text in _OTHER_MACHINES.items() if missing.issuperset(axes)), "")
        turning = others[0] if what else None
    if turning is not None:
        return [turning._replace(message=what), *(item for item in findings if item.severity != "E")]
    out, places, more = list[Finding](), dict[tuple[str, str], int](), dict[int, int]()
    for item in findings:
        key = item.code, _NUMBERS.sub("#", item.message.partition(" uses ")[0])
        if (item.severity == "E" or item.code == "W382") and key in places:
            more[places[key]] = more.get(places[key], 0) + 1
            continue
        places.setdefault(key, len(out))
        out.append(item)
    for at, count in more.items():
        out[at] = out[at]._replace(message=f"{out[at].message}; {count} more lines say the same")
    return out


_AXIS: Final = re.compile(r"(?<![A-Z#])([XYZ])[ \t]*=?[ \t]*([-+]?[0-9]*\.?[0-9]*)", re.IGNORECASE)
_TURRET: Final = re.compile(
    r"(?<![A-Z#])T[ \t]*(?:0[1-9]|[1-9][0-9])[0-9]{2}(?:[0-9]{2})?(?![0-9])", re.IGNORECASE
)
_ANY_T: Final = re.compile(r"(?<![A-Z#])T[ \t]*([0-9]+)", re.IGNORECASE)
_PAIR: Final = re.compile(r"([0-9]{2})(?:\1|00)")
_TURNS: Final = re.compile(r"(?<![A-Z])G0*9[679](?![0-9.])", re.IGNORECASE)
_MILLS: Final = re.compile(
    r"(?<![A-Z#])(?:M[ \t]*0*6(?![0-9])|G[ \t]*4[34](?![0-9])|H[ \t]*[0-9])", re.IGNORECASE
)
"""Every T; one with its register; spindles and feeds of lathes; tool changes and tool lengths of mills."""
_ARC_K: Final = re.compile(r"(?<![A-Z#])G0*[23](?![0-9.]).*(?<![A-Z#])K[-+.0-9]", re.IGNORECASE)
_PLANE: Final = re.compile(r"(?<![A-Z#])G1[789](?![0-9.])", re.IGNORECASE)
_TOOL_CHANGE: Final = re.compile(r"(?<![A-Z#])M0*6(?![0-9])", re.IGNORECASE)
_ROTARY: Final = re.compile(
    r"(?<![A-Z#,])C[ \t]*[-+.0-9].*G0*0(?![0-9])|G0*0(?![0-9.]).*(?<![A-Z#,])C[ \t]*[-+.0-9]"
    r"|G1?12(?:\.1)?(?![0-9])|(?<![A-Z#])H[-+.0-9]",
    re.IGNORECASE,
)
_VARIABLES: Final = re.compile(
    r"(?<![A-Z0-9#])V[A-Z]{2,6}[0-9]?(?:\[[0-9]+\])?[ \t]*=(?:[ \t]*V[A-Z]+[0-9]?\[[0-9]+\](?![ \t]*=)|[-+*/.0-9])+"
    r"|\b[TO]G[ \t]*=[ \t]*[0-9]+|\bTLID\b"
)
"""Offsets, loads and drawings, numbers of tools, and their life: system variables of Okuma that change no path."""
_SYSTEM_B: Final = re.compile(
    r"(?<![A-Z])G9[15](?![0-9.])|^[^XZUW]*(?<![A-Z])G94(?![0-9.])[^XZUW]*$", re.IGNORECASE
)
_INCH: Final = re.compile(r"(?<![A-Z#])G(?:20|70)(?![0-9.])[^PQ]*$", re.IGNORECASE)
_N: Final = re.compile(r"[ \t]*/?[ \t]*N[ \t]*([0-9]{1,9})(?![0-9.])", re.IGNORECASE)
_HEAD: Final = re.compile(r"[ \t]*[O:][ \t]*[0-9]+", re.IGNORECASE)
_LAP: Final = re.compile(r"(G0*8[567])[ \t]*N[ \t]*([0-9]+)", re.IGNORECASE)
_DRAWING: Final = re.compile(r"^[ \t]*(?:DEF[ \t]+WORK|PT[ \t]+L|CLEAR|DRAW|END[ \t]*$)", re.IGNORECASE)


def is_lathe(lines: Sequence[str], findings: Sequence[Finding]) -> bool:
    """Whether a program is one for turning: words that only lathes have, or no Y and tools of a turret or arcs in X Z."""
    for item in findings:
        if item.code == "E209" and ("lathe" in item.message or "turning" in item.message):
            return True
    bare = [REMARK.sub(" ", line) for line in lines[:2000]]
    seen = {hit[1].upper() for line in bare for hit in _AXIS.finditer(line)}
    # a lathe with a Y axis: every T names a tool and its register, and no word is one of a mill
    if "Y" in seen:
        tools = [hit[1] for line in bare for hit in _ANY_T.finditer(line)]
        paired = bool(tools) and all(_PAIR.fullmatch(text) for text in tools)
        return paired and any(map(_TURNS.search, bare)) and not any(map(_MILLS.search, bare))
    if not {"X", "Z"} <= seen:
        return False
    turret = any(map(_TURRET.search, bare)) and not any(map(_TOOL_CHANGE.search, bare))
    return turret or (any(map(_ARC_K.search, bare)) and not any(map(_PLANE.search, bare)))


def as_lathe(lines: Sequence[str], settings: Settings, diameters: bool) -> tuple[Settings, list[Finding]]:
    """How such a program is read, and that it is; the tool begins and comes home where it is clear of all coordinates."""
    kind: Literal["diameter", "radius"] = "diameter" if diameters else "radius"
    far = {"X": 0.0, "Z": 0.0}
    for line in lines:
        for hit in _AXIS.finditer(REMARK.sub(" ", line)):
            try:
                far[hit[1].upper()] = max(far.get(hit[1].upper(), 0.0), float(hit[2]))
            except ValueError:
                continue
    inch = settings.units == "inch" or any(map(_INCH.search, lines[:200]))
    scale = 25.4 if inch else 1.0
    radius = scale * far["X"] / (2.0 if diameters else 1.0)
    home = radius + 50.0, 0.0, max(settings.home[2], scale * far["Z"] + 50.0)
    turns = "C" if any(_ROTARY.search(REMARK.sub(" ", line)) for line in lines[:2000]) else ""
    rotary = settings.rotary if turns in settings.rotary else settings.rotary + turns
    control = replace(settings.control, lathe=kind)
    what = f"a program for turning, X words are {'diameters' if diameters else 'radii'}: its path is read, no material is turned"
    hint = f'confirm it: lathe = "{kind}" under [program.control], or --control lathe=mill where it is a mill'
    said = finding("W380", 1, None, what, hint=hint)
    return replace(settings, control=control, home=home, rotary=rotary), [said]


def swapped(moves: Sequence[Move]) -> bool:
    """Whether most arcs go the long way round, which no contour for turning does: G2 and G3 are counted from below."""
    long = arcs = 0
    for move in moves:
        if move.center is None or move.plane != "zx":
            continue
        (az, ax), (bz, bx) = ((p[2] - move.center[0], p[0] - move.center[1]) for p in (move.start, move.end))
        turn = math.atan2(az * bx - ax * bz, az * bz + ax * bx) % (2.0 * math.pi)
        arcs += 1
        long += (turn if move.motion is Motion.ARC_CCW else 2.0 * math.pi - turn) > math.pi + 1e-3
    return 2 * long > arcs


def plain_lathe(lines: list[str]) -> list[str]:
    """Lines of Okuma lathes: offsets and drawings that change no path become empty, `G85 N10` becomes `G85 P10`.

    Of a shift of the zero stays the code of Fanuc.
    """

    def plain(hit: re.Match[str]) -> str:
        return ("G10 P0" if hit[0].upper().startswith(("VZOF", "VZSH")) else "").ljust(len(hit[0]))

    return [
        _LAP.sub(r"\1 P\2", "" if _DRAWING.match(line) else _VARIABLES.sub(plain, line)) for line in lines
    ]


def numbered(line: str) -> int:
    """N of a line, -1 without."""
    found = _N.match(line)
    return int(found[1]) if found else -1


def heads(line: str) -> bool:
    """Whether another program begins here."""
    return bool(_HEAD.match(line))


def has_system_b(lines: Sequence[str]) -> bool:
    """Whether a code of G code system B stands somewhere."""
    return any(_SYSTEM_B.search(REMARK.sub(" ", line)) for line in lines)
