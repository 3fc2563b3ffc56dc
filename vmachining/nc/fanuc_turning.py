"""Marks of programs for turning, and what they say of their lathe: diameters or radii, the sense of arcs, G code system B."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Final, Literal

from vmachining.nc.checks import finding
from vmachining.nc.fanuc_lines import REMARK
from vmachining.nc.model import Finding, Motion, Move, Point
from vmachining.nc.settings import Settings

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
_CHANGE: Final = re.compile(r"(?<![A-Z#])M0*6(?![0-9])", re.IGNORECASE)
_ROTARY: Final = re.compile(
    r"(?<![A-Z#,])C[ \t]*[-+.0-9].*G0*0(?![0-9])|G0*0(?![0-9.]).*(?<![A-Z#,])C[ \t]*[-+.0-9]"
    r"|G1?12(?:\.1)?(?![0-9])|(?<![A-Z#])H[-+.0-9]",
    re.IGNORECASE,
)
_ASSIGNED: Final = re.compile(
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
    if (
        "Y" in seen
    ):  # a lathe with a Y axis: every T names a tool and its register, and no word is one of a mill
        tools = [hit[1] for line in bare for hit in _ANY_T.finditer(line)]
        paired = bool(tools) and all(_PAIR.fullmatch(text) for text in tools)
        return paired and any(map(_TURNS.search, bare)) and not any(map(_MILLS.search, bare))
    if not {"X", "Z"} <= seen:
        return False
    turret = any(map(_TURRET.search, bare)) and not any(map(_CHANGE.search, bare))
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
    home: Point = (
        scale * far["X"] / (2.0 if diameters else 1.0) + 50.0,
        0.0,
        max(settings.home[2], scale * far["Z"] + 50.0),
    )
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


def _assigned(hit: re.Match[str]) -> str:
    """Nothing; of a shift of the zero the code of Fanuc."""
    return ("G10 P0" if hit[0].upper().startswith(("VZOF", "VZSH")) else "").ljust(len(hit[0]))


def plain_lathe(lines: list[str]) -> list[str]:
    """Lines of Okuma lathes: offsets and drawings that change no path become empty, `G85 N10` becomes `G85 P10`."""
    out = []
    for line in lines:
        if _DRAWING.match(line):
            line = ""
        elif "=" in line or "TLID" in line:
            line = _ASSIGNED.sub(_assigned, line)
        out.append(_LAP.sub(r"\1 P\2", line))
    return out


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
