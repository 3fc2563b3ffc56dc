"""Dialect `sinumerik`: programs of SINUMERIK 840D, 828D and their kin.

| file | holds |
|---|---|
| `text.py` | lines -> programs of an archive -> blocks -> words, some of them noted or refused |
| `control.py` | jumps, loops, variables, subprograms |
| `modes.py`, `places.py`, `blocks.py` | modes; frames, lathes; motions |
| `cycles.py` | drilling cycles, patterns, milling cycles |

What is honoured, accepted with a note and refused: docs/sinumerik.md. Positions become moves in `nc/pen.py`.
"""

from __future__ import annotations

from vmachining.nc.lexer import split_lines
from vmachining.nc.model import Declared, Reading
from vmachining.nc.settings import Settings
from vmachining.nc.sinumerik.blocks import Control
from vmachining.nc.sinumerik.places import as_turning

__all__ = ["read_sinumerik"]


def read_sinumerik(text: str, settings: Settings) -> Reading:
    """Read a program."""
    lines = split_lines(text)
    settings, said = as_turning(lines, settings)
    control = Control(lines, settings)
    control.pen.findings += said
    control.run()
    pen = control.pen
    pen.line, pen.n, pen.text = max(1, len(lines)), None, ""
    if not control.ended and not control.broken:
        pen.note("W401", "the program has no M30, M2 or M17")
    elif not pen.moves and pen.findings == said:
        pen.note("W406", "the program contains no motion")
    unit = "" if control.feed_inch is None else "inch" if control.feed_inch else "mm"
    return control.reading(Declared(unit, control.stock))
