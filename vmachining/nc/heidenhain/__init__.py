"""Dialect `heidenhain`: conversational programs of TNC controls.

| file | holds |
|---|---|
| `text.py` | lines -> blocks -> words; DIN/ISO programs, turned into conversational blocks |
| `flow.py` | labels, calls, jumps; Q parameters and FN |
| `definitions.py` | blank, tools, cycles |
| `control.py` | path blocks, M codes |
| `contour.py` | path functions, approaches and departures |
| `cycles.py` | drilling cycles and patterns |
| `coordinates.py` | datum shift, mirror, rotation, scale, tilted planes |

What is honoured, accepted with a note and refused: docs/heidenhain.md. Positions become moves in `nc/pen.py`.
Source: HEIDENHAIN TNC 640 user's manuals (public).
"""

from __future__ import annotations

from vmachining.nc.heidenhain.control import Control
from vmachining.nc.heidenhain.text import blocks, conversational
from vmachining.nc.lexer import split_lines
from vmachining.nc.model import Declared, Reading
from vmachining.nc.settings import Settings

__all__ = ["read_heidenhain"]


def read_heidenhain(text: str, settings: Settings, *, din_iso: bool = False) -> Reading:
    """Read a program; din_iso : in words of G-code."""
    lines = split_lines(text)
    control = Control(lines, settings, conversational if din_iso else blocks)
    control.run()
    pen = control.pen
    if not control.begun:
        pen.line, pen.n, pen.text = 1, None, ""
        pen.note("E109", "the program has no line %NAME G71" if din_iso else "the program has no BEGIN PGM")
    elif not control.ended and not control.broken:
        pen.line, pen.n, pen.text = max(1, len(lines)), None, ""
        pen.note("W401", "the program has no END PGM")
    elif not pen.moves and not pen.findings:
        pen.note("W406", "the program contains no motion")
    unit = "" if not control.begun else "mm" if pen.scale == 1.0 else "inch"
    return control.reading(Declared(unit, control.declared_stock(), dict(pen.known_radius)))
