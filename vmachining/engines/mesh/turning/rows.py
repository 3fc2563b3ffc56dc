"""Rows of circles that represent a convex body of revolution while its axis turns.

A row is one circle of the body with one normal (n_r, n_z). Arcs get rows as their facets need, lines as the
twist of the motion needs, a sharp edge gets two rows of the same circle, one for each of its normals, and the
discs at both ends run from the axis to their rim. Columns are angles about the axis, the same for all rows.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.engines.mesh.facets import Side, arc_steps, fair_radius, grown, meridian, narrowed
from vmachining.sweep.grazing import whole_meridian
from vmachining.tool import Profile

LINE, ROUND, RIM = 0, 1, 2
"""What lies between two rows: a line, an arc, or nothing but the fan of normals of an edge."""

TANGENT = 1e-9
"""Normals closer than this are one: see `tool.profile`."""


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """n circles of a body.

    circles (n, 4): h, r, n_r, n_z, of the body that moves; resting (n, 2): h, r of facets at rest, which are wider
    where facets shall be unbiased; group (n,): rows of one circle share a
    number; between (n - 1, 6): LINE, ROUND or RIM, and for arcs centre (r, z), radius, normal angles of both
    rows, rad.
    """

    circles: Floats
    resting: Floats
    group: Ints
    between: Floats
    columns: int


class _Piece(NamedTuple):
    """Line or arc of a closed meridian. normal: of a line. radius 0: a line."""

    start: Floats
    end: Floats
    normal: Floats
    center: Floats
    radius: float
    beta: tuple[float, float]

    def normal_at(self, last: bool) -> Floats:
        if self.radius == 0.0:
            return self.normal
        return _unit(self.beta[last])


def _unit(beta: float) -> Floats:
    return np.array([np.cos(beta), np.sin(beta)])


def rows_of(
    profile: Profile, sag: float, offset: float, spacing: float, columns: int, side: Side
) -> Rows | None:
    """Rows of a convex profile whose surface has been moved outward by `offset` mm (inward if negative).

    sag : mm, depth of the facets of an arc. spacing : mm, largest distance of rows on a line.

    Returns None if nothing is left of the body.
    """
    pieces = _pieces(profile)
    moved = _moved(pieces, offset)
    if moved is None:  # a feature smaller than the offset: a polygon that is on the safe side
        line: Floats | None = meridian(profile, sag, side)
        assert line is not None
        line = narrowed(line, -offset, -offset) if offset < 0.0 else grown(line, offset, offset)
        if line is None or len(line) < 2 or not line[-1, 1] > line[0, 1]:
            return None
        moved = _moved(_pieces(Profile(line)), 0.0)
        assert moved is not None
    return _rows(moved, sag, spacing, columns, side)


def _pieces(profile: Profile) -> list[_Piece]:
    """The meridian from the axis at the bottom to the axis at the top."""
    nowhere, out = np.full(2, np.nan), list[_Piece]()
    for s in whole_meridian(profile):
        a, b = np.array([s.r0, s.z0]), np.array([s.r1, s.z1])
        if s.is_arc:
            out.append(_Piece(a, b, nowhere, np.array([s.cr, s.cz]), s.radius, s.beta))
        else:
            n = np.array([b[1] - a[1], a[0] - b[0]])
            out.append(_Piece(a, b, n / np.linalg.norm(n), nowhere, 0.0, (0.0, 0.0)))
    return out


def _moved(pieces: list[_Piece], offset: float) -> list[_Piece] | None:
    """The parallel meridian with sharp corners, None if a piece would vanish or corners are not simple."""
    if offset == 0.0:
        return pieces
    joints = [_on_axis(pieces[0], offset, last=False)]
    joints += [_joint(below, above, offset) for below, above in pairwise(pieces)]
    joints.append(_on_axis(pieces[-1], offset, last=True))
    out = []
    for piece, start, end in zip(pieces, joints[:-1], joints[1:], strict=True):
        if start is None or end is None:
            return None
        if piece.radius == 0.0:
            if not (end - start) @ (piece.end - piece.start) > 0.0:
                return None
            out.append(piece._replace(start=start, end=end))
            continue
        radius = piece.radius + offset
        if radius <= abs(offset):
            return None
        first, last = (float(np.arctan2(*(p - piece.center)[::-1])) for p in (start, end))
        if not last > first:
            return None
        out.append(piece._replace(start=start, end=end, radius=radius, beta=(first, last)))
    return out


def _on_axis(piece: _Piece, offset: float, *, last: bool) -> Floats | None:
    """Where the parallel of the first or last piece meets the axis."""
    at = piece.end if last else piece.start
    if piece.radius == 0.0:
        n = piece.normal
        return None if n[1] == 0.0 else np.array([0.0, (n @ at + offset) / n[1]])
    rest = (piece.radius + offset) ** 2 - piece.center[0] ** 2
    if piece.radius + offset <= 0.0 or rest < 0.0:
        return None
    return np.array([0.0, piece.center[1] + (1.0 if last else -1.0) * float(np.sqrt(rest))])


def _joint(below: _Piece, above: _Piece, offset: float) -> Floats | None:
    """Where the parallels of two neighbours meet."""
    at, n, m = below.end, below.normal_at(True), above.normal_at(False)
    if abs(n[0] * m[1] - n[1] * m[0]) < TANGENT:
        return np.asarray(at + offset * n)
    if below.radius == 0.0 and above.radius == 0.0:
        corner = np.linalg.solve(np.stack([n, m]), np.array([n @ at, m @ at]) + offset)
        return np.asarray(corner, dtype=np.float64)
    if below.radius > 0.0 and above.radius > 0.0:
        return None
    arc, normal, last = (below, m, True) if below.radius > 0.0 else (above, n, False)
    reach = (normal @ at + offset - normal @ arc.center) / (arc.radius + offset)
    if not -1.0 < reach < 1.0 or arc.radius + offset <= 0.0:
        return None
    middle, half = float(np.arctan2(normal[1], normal[0])), float(np.arccos(reach))
    beta = middle + (-half if last else half)
    return np.asarray(arc.center + (arc.radius + offset) * _unit(beta))


def _rows(pieces: list[_Piece], sag: float, spacing: float, columns: int, side: Side) -> Rows:
    circles: list[tuple[float, float, float, float]] = []
    resting: list[tuple[float, float]] = []
    between: list[tuple[float, ...]] = []
    group: list[int] = []
    still = (0.0,) * 5
    width = 2.0 * np.pi / columns
    wide = float(np.sqrt(width / np.sin(width))) if side is Side.FAIR else 1.0

    def row(at: Floats, normal: Floats, facet: Floats, number: int) -> None:
        circles.append((float(at[1]), max(float(at[0]), 0.0), float(normal[0]), float(normal[1])))
        resting.append((float(facet[1]), max(float(facet[0]), 0.0) * wide))
        group.append(number)

    for index, piece in enumerate(pieces):
        first = piece.normal_at(False)
        if index == 0:
            row(piece.start, first, piece.start, 0)
        else:
            before = pieces[index - 1].normal_at(True)
            if abs(before[0] * first[1] - before[1] * first[0]) >= TANGENT:
                between.append((RIM, *still))
                row(piece.start, first, piece.start, group[-1])
        if piece.radius == 0.0:
            length = float(np.linalg.norm(piece.end - piece.start))
            steps = max(1, int(np.ceil(length / spacing - 1e-9)))
            for k in range(1, steps + 1):
                at = piece.end if k == steps else piece.start + k / steps * (piece.end - piece.start)
                between.append((LINE, *still))
                row(at, piece.normal, at, group[-1] + 1)
            continue
        begin, end = piece.beta
        steps = arc_steps(piece.radius, end - begin, sag)
        angles = np.linspace(begin, end, steps + 1)
        k_fair = fair_radius(steps, (end - begin) / steps) if side is Side.FAIR else 1.0
        for k in range(1, steps + 1):
            normal = _unit(float(angles[k]))
            at = piece.end if k == steps else piece.center + piece.radius * normal
            facet = at if k == steps else piece.center + k_fair * piece.radius * normal
            between.append((ROUND, *piece.center, piece.radius, float(angles[k - 1]), float(angles[k])))
            row(at, normal, facet, group[-1] + 1)
    table, faces = np.array(circles), np.array(resting)
    table[[0, -1], 1] = faces[[0, -1], 1] = 0.0
    return Rows(table, faces, np.array(group, dtype=np.int64), np.array(between), columns)
