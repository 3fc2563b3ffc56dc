"""The cutting edge: the meridian of a cutter as a curve, straight in its plane or wound around the axis.

Symbols: s arc length along the meridian from its lowest point off the bottom disc, mm; s < 0 runs from the axis
out to it. r, z radius and height. beta angle of the outward normal above the horizontal. chi helix angle.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Bools, Floats, Ints
from vmachining.errors import ToolError
from vmachining.tool.cutters import Cutter
from vmachining.tool.profile import Profile, Segment

FLAT = Segment(0.0, 0.0, 0.0, 0.0, float("nan"), float("nan"), 0.0)


class EdgePoints(NamedTuple):
    """Points of an edge in the meridian plane, each (n,): radius, height, unit outward normal, lag in rad."""

    r: Floats
    z: Floats
    n_r: Floats
    n_z: Floats
    lag: Floats


class EdgeParts(NamedTuple):
    """Stretches of the edge at several rotation angles, one per row, each column (n,).

    row : which angle. piece : segment of the edge, so that no stretch goes over a joint.
    lower, upper : s, mm. lower_by, upper_by : what ends it there, in the codes of whoever divides.
    """

    row: Ints
    piece: Ints
    lower: Floats
    upper: Floats
    lower_by: Ints
    upper_by: Ints

    def take(self, chosen: Bools | Ints) -> EdgeParts:
        return EdgeParts._make(column[chosen] for column in self)


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Edge:
    """One cutting edge of a cutter.

    Edge(tool) is the straight edge: the meridian itself, in one plane with the axis. With `helix_deg` the edge
    has a constant lead: at height z it lags by z tan(chi) / R after its tip, R the largest radius, so that chi
    is the helix angle on that radius. `bottom` prolongs the edge over the bottom disc to the axis.

    profile : the part that cuts. twist : rad/mm, lag per height. segments : pieces from the bottom up, the
    disc first where there is one. joints : (m + 1,) mm, s at their ends.

    Raises ToolError: A helix angle that is not between -90 and 90 degrees.
    """

    profile: Profile
    twist: float
    segments: tuple[Segment, ...]
    joints: Floats
    _rows: Floats

    def __init__(self, tool: Cutter | Profile, *, helix_deg: float = 0.0, bottom: bool = False) -> None:
        profile = tool.cutter if isinstance(tool, Cutter) else tool
        if not -90.0 < helix_deg < 90.0:
            raise ToolError(f"helix_deg {helix_deg:g} must lie between -90 and 90", word="helix_deg")
        segments = profile.segments
        r, z = (float(v) for v in profile.points[0])
        disc = bottom and r > 0.0
        if disc:
            segments = (FLAT._replace(z0=z, z1=z, r1=r), *segments)
        sizes = [
            s.radius * (s.beta[1] - s.beta[0]) if s.is_arc else np.hypot(s.r1 - s.r0, s.z1 - s.z0)
            for s in segments
        ]
        joints = np.cumsum([-r if disc else 0.0, *sizes])
        if disc:
            joints[1] = 0.0
        joints.setflags(write=False)
        for name, value in (
            ("profile", profile), ("twist", float(np.tan(np.radians(helix_deg))) / profile.max_radius),
            ("segments", segments), ("joints", joints),
            ("_rows", np.array([(*s[:4], s.cr, s.cz, s.radius, *s.beta) for s in segments])),
        ):  # fmt: skip
            object.__setattr__(self, name, value)

    @property
    def rows(self) -> Floats:
        """(m, 9) r0, z0, r1, z1, centre r and z, radius (0: a line), normal angle at both ends, of every segment."""
        return self._rows

    @property
    def length(self) -> float:
        """mm of the meridian, the disc included where the edge has it."""
        return float(self.joints[-1] - self.joints[0])

    @property
    def stretch(self) -> float:
        """Upper bound of the length of the edge in space per mm of s: 1 / cos(chi), 1 for a straight edge."""
        return float(np.hypot(1.0, self.twist * self.profile.max_radius))

    @property
    def area(self) -> float:
        """mm^2 of the surface the edge draws around the axis."""
        pieces = np.arange(len(self.segments))
        return float(2.0 * np.pi * self.moment(pieces, self.joints[:-1], self.joints[1:]).sum())

    def whole(self, rows: int, code: int) -> EdgeParts:
        """All of the edge at `rows` rotation angles; both ends of every segment carry a code."""
        pieces = len(self.segments)
        piece = np.tile(np.arange(pieces), rows)
        ends = np.full(rows * pieces, code)
        row = np.repeat(np.arange(rows), pieces)
        return EdgeParts(row, piece, self.joints[piece], self.joints[piece + 1], ends, ends)

    def piece_at(self, s: ArrayLike) -> Ints:
        """(n,) segment that holds s; the upper one at a joint."""
        found = np.searchsorted(self.joints, np.asarray(s, dtype=np.float64), side="right") - 1
        return np.clip(found, 0, len(self.segments) - 1).astype(np.int64)

    def at(self, piece: Ints, s: ArrayLike) -> EdgePoints:
        """Points at s (n,) on segments `piece` (n,), whose own normals are taken at joints."""
        t = np.asarray(s, dtype=np.float64) - self.joints[piece]
        r0, z0, r1, z1, cr, cz, radius, low, high = self._rows[piece].T
        size = self.joints[piece + 1] - self.joints[piece]
        round_ = radius > 0.0
        with np.errstate(invalid="ignore", divide="ignore"):
            beta = np.where(round_, low + t / radius, low)
            beta = np.where(round_ & (t >= size), high, beta)
            share = np.clip(t / size, 0.0, 1.0)
            r = np.where(round_, cr + radius * np.cos(beta), r0 + share * (r1 - r0))
            z = np.where(round_, cz + radius * np.sin(beta), z0 + share * (z1 - z0))
        return EdgePoints(np.maximum(r, 0.0), z, np.cos(beta), np.sin(beta), z * self.twist)

    def widest(self, parts: EdgeParts) -> Floats:
        """(n,) mm: s within every stretch where the radius is largest (its lower end on a cylinder)."""
        _, _, _, _, _, _, radius, low, _ = self._rows[parts.piece].T
        level = self.joints[parts.piece] - radius * low  # normal of an arc at right angles to the axis
        ends = self.at(parts.piece, parts.lower).r < self.at(parts.piece, parts.upper).r
        line = np.where(ends, parts.upper, parts.lower)
        return np.asarray(np.where(radius > 0.0, np.clip(level, parts.lower, parts.upper), line))

    def moment(self, piece: Ints, lower: Floats, upper: Floats) -> Floats:
        """(n,) mm^2: integral of r ds between s `lower` and `upper`, exact; 2 pi times it is an area."""
        a, b = self.at(piece, lower), self.at(piece, upper)
        _, _, _, _, cr, _, radius, _, _ = self._rows[piece].T
        line = 0.5 * (a.r + b.r) * (upper - lower)
        arc = np.nan_to_num(cr) * (upper - lower) + radius**2 * (b.n_z - a.n_z)
        return np.asarray(np.where(radius > 0.0, arc, line))
