"""Shapes without a tool: the paths that a control can drive, rotations.

| file | holds |
|---|---|
| `path.py` | `Line` and `Arc` (circle or helix about an axis direction); `RayIntervals`: where lines are inside a solid |
| `rotation.py` | rotation matrices, angles between directions, great circles |
"""

from vmachining.geometry.path import Arc, Line, Path, RayIntervals, arc_between
from vmachining.geometry.rotation import rotation, unit

__all__ = ["Arc", "Line", "Path", "RayIntervals", "arc_between", "rotation", "unit"]
