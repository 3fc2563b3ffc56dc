"""Profiles and paths as arrays, for checkpoints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vmachining.arrays import Floats
from vmachining.geometry import Arc, Line, Path
from vmachining.tool import Profile

__all__ = ["packed_paths", "packed_profiles", "paths_of", "profiles_of"]


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


def packed_paths(paths: Sequence[Path]) -> Floats:
    """(n, 10): start, end or centre, axis (-1 for a line), angle, rise, 0."""
    out = np.zeros((len(paths), 10))
    for row, path in zip(out, paths, strict=True):
        row[:3] = path.start
        if isinstance(path, Line):
            row[3:6], row[6] = path.end, -1.0
        else:
            row[3:6], row[6:9] = path.center, (path.axis, path.angle, path.rise)
    return out


def paths_of(rows: Floats) -> list[Path]:
    """What `packed_paths` was given."""
    return [
        Line(r[:3], r[3:6])
        if r[6] < 0.0
        else Arc(r[:3], r[3:6], int(r[6]), angle=float(r[7]), rise=float(r[8]))
        for r in rows
    ]
