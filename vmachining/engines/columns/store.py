"""Profiles and paths as arrays, for checkpoints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from vmachining.arrays import Floats
from vmachining.geometry import Arc, Line, Path
from vmachining.tool import Profile

__all__ = ["PATH", "packed_path", "packed_profiles", "path_of", "profiles_of"]

PATH = 10
"""Numbers that say a path."""


def packed_profiles(profiles: Sequence[Profile]) -> dict[str, Any]:
    """Arrays by name; see `profiles_of`."""
    arrays: dict[str, Any] = {}
    for k, p in enumerate(profiles):
        arrays |= {f"points{k}": p.points, f"centers{k}": p.centers, f"radii{k}": p.radii}
    return arrays


def profiles_of(arrays: Mapping[str, Floats]) -> list[Profile]:
    """What `packed_profiles` was given."""
    found: list[Profile] = []
    while f"points{len(found)}" in arrays:
        k = len(found)
        found.append(Profile(arrays[f"points{k}"], arrays[f"centers{k}"], arrays[f"radii{k}"]))
    return found


def packed_path(path: Path, row: Floats) -> None:
    """A path into a row (PATH,): start, end or centre, axis (-1 for a line), angle, rise, 0."""
    row[:3] = path.start
    if isinstance(path, Line):
        row[3:6], row[6:10] = path.end, (-1.0, 0.0, 0.0, 0.0)
    else:
        row[3:6], row[6:10] = path.center, (path.axis, path.angle, path.rise, 0.0)


def path_of(row: Floats) -> Path:
    """What `packed_path` was given."""
    if row[6] < 0.0:
        return Line(row[:3], row[3:6])
    return Arc(row[:3], row[3:6], int(row[6]), angle=float(row[7]), rise=float(row[8]))
