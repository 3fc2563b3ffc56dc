"""Dialect `sinumerik`: programs of SINUMERIK 840D, 828D and their kin.

| file | holds |
|---|---|
| `text.py` | lines -> programs of an archive -> blocks -> words |
| `control.py` | jumps, loops, variables, subprograms |
| `modes.py`, `places.py`, `blocks.py` | modes; frames; motions |
| `turning.py` | lathes |
| `cycles.py`, `milling.py` | drilling cycles and patterns; milling cycles |
| `known.py` | words that are noted or refused |

What is honoured, accepted with a note and refused: docs/sinumerik.md. Positions become moves in `nc/pen.py`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from vmachining.nc.lexer import split_lines
from vmachining.nc.model import Declared, Finding, Move
from vmachining.nc.settings import Settings
from vmachining.nc.sinumerik.blocks import Control
from vmachining.nc.sinumerik.turning import as_turning

__all__ = ["read_sinumerik"]


class Read(NamedTuple):
    """What a program became."""

    moves: list[Move]
    findings: list[Finding]
    ended: bool
    files: tuple[str, ...]
    declared: Declared


def read_sinumerik(text: str, settings: Settings, decode: Callable[[bytes, str], str] | None) -> Read:
    """Read a program; `decode` makes text of the files that it calls."""
    lines = split_lines(text)
    settings, said = as_turning(lines, settings)
    control = Control(lines, settings, decode)
    control.pen.findings += said
    control.run()
    pen = control.pen
    pen.line, pen.n, pen.text = max(1, len(lines)), None, ""
    if not control.ended and not control.broken:
        pen.note("W401", "the program has no M30, M2 or M17")
    elif not pen.moves and pen.findings == said:
        pen.note("W406", "the program contains no motion")
    unit = "" if control.feed_inch is None else "inch" if control.feed_inch else "mm"
    names = {number: name for name, number in control.names.items()}
    declared = Declared(unit, control.stock, tools=tuple(sorted(pen.called)), names=names)
    return Read(pen.moves, pen.findings, control.ended, tuple(map(str, control.paths)), declared)
