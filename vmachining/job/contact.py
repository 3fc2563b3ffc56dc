"""Where the tool must not touch: rapids with any part of it, cutting moves with shank and holder.

Decided with the part made smaller by twice the chord, so that the facets of two fitting surfaces (a retract
along the wall just cut, a shank as wide as its cutter) never count as a contact. A real contact deeper than
about four chords is always found; its volume is then measured with the part itself.
"""

from __future__ import annotations

from typing import NamedTuple

from vmachining.arrays import Floats
from vmachining.engines.mesh import MeshEngine
from vmachining.geometry import Path
from vmachining.sweep import Sweep
from vmachining.tool import Profile, Tool

__all__ = ["Contacts", "ToolParts", "smaller"]

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


class ToolParts(NamedTuple):
    """The three bodies of a tool, made once per job."""

    cutter: Profile
    shank: Profile | None
    holder: Profile | None

    @classmethod
    def of(cls, tool: Tool) -> ToolParts:
        """Parts of a tool."""
        return cls(tool.cutter, tool.shank, tool.holder_profile)


class Contacts:
    """Contact checks of one workpiece.

    Parameters
    ----------
    engine : MeshEngine
        The workpiece as it is when a check is made; it is not changed.
    bounds : (2, 3) mm
        Box of the raw stock: nothing outside of it can be touched.
    """

    def __init__(self, engine: MeshEngine, bounds: Floats) -> None:
        self._engine = engine
        self._bounds = bounds
        self._small: dict[int, tuple[Profile, tuple[Profile, ...]]] = {}

    def rapid(self, tool: ToolParts, path: Path) -> list[str]:
        """Warnings of a rapid: what each part of the tool would remove."""
        parts = (("tool", tool.cutter), ("shank", tool.shank), ("holder", tool.holder))
        found = [
            f"{name} would remove {volume:.4g} mm3"
            for name, profile in parts
            if profile is not None and (volume := self._touched(profile, path)) > 0.0
        ]
        return [f"rapid through material: {', '.join(found)}"] if found else []

    def cutting(self, tool: ToolParts, path: Path) -> list[str]:
        """Warnings of a cutting move, asked after its cutter has cut."""
        found = []
        for name, profile in (("shank", tool.shank), ("holder", tool.holder)):
            if profile is not None and (volume := self._touched(profile, path)) > 0.0:
                found.append(f"{name} touches the stock: {volume:.4g} mm3")
        return found

    def _touched(self, profile: Profile, path: Path) -> float:
        """mm^3 that the part would remove, 0 if it does not get deeper than the margin."""
        whole = Sweep.along(profile, path)
        box = whole.bounds
        if (box[0] >= self._bounds[1]).any() or (box[1] <= self._bounds[0]).any():
            return 0.0
        known = self._small.get(id(profile))
        if known is None:  # the profile is kept, so that its id stays its own
            known = self._small[id(profile)] = (profile, smaller(profile, MARGIN_CHORDS * self._engine.chord))
        pieces = known[1]
        if not any(self._engine.touch(Sweep.along(piece, path)) > 0.0 for piece in pieces):
            return 0.0
        return self._engine.touch(whole)
