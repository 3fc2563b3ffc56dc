"""Where the tool must not touch: rapids with any part of it, cutting moves with shank and holder.

Decided with the part made smaller by twice the chord, so that the facets of two fitting surfaces (a retract
along the wall just cut, a shank as wide as its cutter) never count as a contact. A real contact deeper than
about four chords is always found; its volume is then measured with the part itself, in those tiles of the
workpiece where the smaller part touches.

Checks are ordered and answered later, because the workpiece may be cut by other processes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

from vmachining.arrays import Floats
from vmachining.engines.mesh import Crew
from vmachining.geometry import Bracket
from vmachining.job.paths import CutterPath
from vmachining.sweep import Sweep, Turn
from vmachining.tool import Profile, Tool

__all__ = ["Contacts", "Found", "ToolParts", "nothing", "smaller"]

MARGIN_CHORDS = 2.0
"""The stock may be a chord too large and the part 2/3 chord (facets of circle and meridian); 2 > 5/3."""


def smaller(profile: Profile, margin: float) -> tuple[Profile, ...]:
    """Convex pieces of a body, each shrunk so that its surface lies at least `margin` (mm) inside.

    Each is scaled about a point of its axis, which keeps arcs circular; a convex body holds its scaled self.
    A piece thinner than the margin disappears.
    """
    out = []
    for piece in profile.convex_pieces():
        height = piece.z_max - piece.z_min
        anchor = piece.z_min + min(piece.max_radius, height / 2)
        reach = min(piece.max_radius, anchor - piece.z_min)
        if reach <= margin:
            continue
        out.append(piece.shifted(-anchor).scaled(1.0 - margin / reach).shifted(anchor))
    return tuple(out)


TURNING_CHORD_MM = 0.1
"""Checks of a tool that turns use facets at least this coarse: rapids turn far, and a warning needs no digits."""


class ToolParts(NamedTuple):
    """The three bodies of a tool, made once per job."""

    cutter: Profile
    shank: Profile | None
    holder: Profile | None

    @classmethod
    def of(cls, tool: Tool) -> ToolParts:
        """Parts of a tool."""
        return cls(tool.cutter, tool.shank, tool.holder_profile)


Found: TypeAlias = Callable[[], list[str]]
"""Warnings, once somebody asks for them."""


def nothing() -> list[str]:
    """No warnings."""
    return []


class Contacts:
    """Contact checks of one workpiece.

    Parameters
    ----------
    crew : Crew
        Who cuts; a check sees the workpiece as it is after all orders before it, and does not change it.
    bounds : (2, 3) mm
        Box of the raw stock: nothing outside of it can be touched.
    """

    def __init__(self, crew: Crew, bounds: Floats) -> None:
        self._crew = crew
        self._bounds = bounds
        self._small: dict[tuple[int, float], tuple[Profile, tuple[Profile, ...]]] = {}

    def rapid(self, tool: ToolParts, path: CutterPath) -> Found:
        """Warnings of a rapid: what each part of the tool would remove."""
        parts = (("tool", tool.cutter), ("shank", tool.shank), ("holder", tool.holder))
        checks = self._checks(parts, path)

        def found() -> list[str]:
            texts = [
                f"{name} would remove {v:.4g} mm3" for name, volume in checks if (v := volume()[1]) > 0.0
            ]
            return [f"rapid through material: {', '.join(texts)}"] if texts else []

        return found if checks else nothing

    def cutting(self, tool: ToolParts, path: CutterPath) -> Found:
        """Warnings of a cutting move, asked after its cutter has cut."""
        checks = self._checks((("shank", tool.shank), ("holder", tool.holder)), path)

        def found() -> list[str]:
            return [
                f"{name} touches the stock: {v:.4g} mm3"
                for name, volume in checks
                if (v := volume()[1]) > 0.0
            ]

        return found if checks else nothing

    def _checks(
        self, parts: Sequence[tuple[str, Profile | None]], path: CutterPath
    ) -> list[tuple[str, Callable[[], Bracket]]]:
        """Orders for the parts whose box meets the stock."""
        ordered = []
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
            turns = isinstance(path, Turn)
            chord = max(self._crew.chord, TURNING_CHORD_MM) if turns else self._crew.chord
            small = self._smaller(profile, MARGIN_CHORDS * chord)
            ordered.append((name, self._crew.touch(profile, path, small, chord)))
        return ordered

    def _smaller(self, profile: Profile, margin: float) -> tuple[Profile, ...]:
        known = self._small.get((id(profile), margin))
        if known is None:  # the profile is kept, so that its id stays its own
            known = self._small[id(profile), margin] = (profile, smaller(profile, margin))
        return known[1]
