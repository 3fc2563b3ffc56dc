"""Shapes without a tool: brackets of numbers, and the paths that a control can drive.

| file | holds |
|---|---|
| `bracket.py` | `Bracket(lo, estimate, hi)`, the way every volume is reported |
| `path.py` | `Line` and `Arc` (circle or helix about an axis direction) with position, velocity, split |
"""

from vmachining.geometry.bracket import Bracket
from vmachining.geometry.path import Arc, Line, Path, arc_between

__all__ = ["Arc", "Bracket", "Line", "Path", "arc_between"]
