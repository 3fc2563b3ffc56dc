"""Where the tool must not touch: rapids with any part of it, cutting moves with shank and holder.

A contact is what surely takes material: the lower bound of what the part would remove is above zero. So the facets of
two fitting surfaces (a retract along the wall just cut, a shank as wide as its cutter) never count as one, and a real
contact deeper than about four chords is always found. The warning gives the estimate.

Checks are ordered and answered later, because the workpiece may be cut by other processes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

from vmachining.arrays import Floats
from vmachining.job.executor import Executor, Later
from vmachining.job.paths import CutterPath
from vmachining.sweep import Sweep, Turn
from vmachining.tool import Profile, Tool

TURNING_CHORD_MM = 0.1
"""Checks of a tool that turns use facets at least this coarse: rapids turn far, and a warning needs no digits."""


class ToolParts(NamedTuple):
    """The three bodies of a tool, made once per job."""

    cutter: Profile
    shank: Profile | None
    holder: Profile | None

    @classmethod
    def of(cls, tool: Tool) -> ToolParts:
        return cls(tool.cutter, tool.shank, tool.holder_profile)


Found: TypeAlias = Callable[[], list[str]]
"""Warnings, once somebody asks for them."""


class Contacts:
    """Contact checks of one workpiece.

    executor : Executor, who cuts; a check sees the workpiece as it is after all orders before it, and does not change
        it.
    bounds : (2, 3) mm, box of the raw stock: nothing outside of it can be touched.
    """

    def __init__(self, executor: Executor, bounds: Floats) -> None:
        self._executor = executor
        self._bounds = bounds

    def rapid(self, tool: ToolParts, path: CutterPath) -> Found:
        """Warnings of a rapid: what each part of the tool would remove."""
        parts = (("tool", tool.cutter), ("shank", tool.shank), ("holder", tool.holder))
        checks = self._checks(parts, path, "{} would remove {:.4g} mm3")
        return lambda: [f"rapid through material: {', '.join(texts)}"] if (texts := checks()) else []

    def cutting(self, tool: ToolParts, path: CutterPath) -> Found:
        """Warnings of a cutting move, asked after its cutter has cut."""
        parts = (("shank", tool.shank), ("holder", tool.holder))
        return self._checks(parts, path, "{} touches the stock: {:.4g} mm3")

    def _checks(self, parts: Sequence[tuple[str, Profile | None]], path: CutterPath, words: str) -> Found:
        """Orders for the parts whose box meets the stock; what is found of them, in words with a name and mm^3."""
        ordered: list[tuple[str, Later]] = []
        for name, profile in parts:
            if profile is None:
                continue
            if isinstance(path, Turn):
                lo, hi = Sweep.along(profile, path).bounds
            else:
                r = profile.max_radius
                lo, hi = path.bounds + [[-r, -r, profile.z_min], [r, r, profile.z_max]]
            if (lo >= self._bounds[1]).any() or (hi <= self._bounds[0]).any():
                continue
            within = TURNING_CHORD_MM if isinstance(path, Turn) else None
            ordered.append((name, self._executor.touch(profile, path, within)))
        return lambda: [
            words.format(name, taken.estimate) for name, volume in ordered if (taken := volume()).lo > 0.0
        ]
