"""Raster paths in five axes: the tool touches the part at chosen points, its axis leans by lead and tilt.

1. Lines of a raster are projected along z onto the facets: CC points. Normals there are those of the facets, or of their
   vertices by one of three weights, mixed over the facet.
2. Lead and tilt give the axis, the cutter its tip (`cl_points`).
3. Interference: in the frame of the tool the part is asked how far the tool has to be lifted (`Surface.lift`). Where that is
   more than the chord tolerance, other tilts within the limit are tried, the nearest first; if none is free the tool is lifted
   along its axis. Each point says which.
4. Chords of tip and axis are divided until the tip halfway lies within the chord tolerance of the one that belongs there, and the
   tool on the chord is free; what is left lifts both ends.
5. Lines are linked by a chord if the tool is free on it, and above the part otherwise.

Known limits: shank endless and as thick as the cutter; points where the part is not under the line are left out.
Source: spec D.5, D.6, D.10.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.errors import InputError
from vmachining.toolpath.clpath import CLPath, Mark
from vmachining.toolpath.facets.drop import Surface
from vmachining.toolpath.facets.mesh import FacetMesh
from vmachining.toolpath.facets.passes import checked_sizes, directions, overhang_notes
from vmachining.toolpath.facets.ridges import Located, cl_points, leaning_ridges, scallop_step, widest_step

NormalKind = Literal["facet", "resultant", "area", "angle"]
SHARP_DEG = 30.0
"""Edges of round surfaces turn by less (a full circle of 12 facets has 30), edges of a part mostly by more."""

TILT_STEP_DEG = 2.5
INNER = np.array([0.25, 0.5, 0.75])
LEAST = 0.05
"""Shortest chord, as a share of the chord tolerance."""

ROUNDS = 14

RIDGE_PLACES = 33
"""Between two passes."""


def normals_at(
    mesh: FacetMesh, points: Floats, triangles: Ints, kind: NormalKind = "angle", *, sharp_deg: float = 180.0
) -> Floats:
    """(n, 3), unit: normals of a mesh at points on given triangles; those of the corners mixed, or the facet's.

    Shares are area coordinates. On an edge that is `edge_normal`, at a vertex its own normal; facets that meet at more
    than `sharp_deg` are not mixed.
    """
    return _mixed(mesh, points, triangles, _corner_normals(mesh, kind, sharp_deg))


def _corner_normals(mesh: FacetMesh, kind: NormalKind, sharp_deg: float) -> Floats:
    """(m, 3, 3): what is mixed over each facet."""
    if kind == "facet":
        return np.broadcast_to(mesh.normals[:, None], mesh.corners.shape)
    return mesh.corner_normals(kind, sharp_deg=sharp_deg)


def _mixed(mesh: FacetMesh, points: Floats, triangles: Ints, normals: Floats) -> Floats:
    """(n, 3), unit: normals (m, 3, 3) of corners at points on given triangles."""
    corners = mesh.corners[triangles]
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    n = np.cross(b - a, c - a)
    size = (n * n).sum(axis=1)
    parts = [(np.cross(q - p, points - p) * n).sum(axis=1) / size for p, q in ((b, c), (c, a), (a, b))]
    share = np.clip(np.stack(parts, axis=1), 0.0, 1.0)
    mixed = (share[:, :, None] * normals[triangles]).sum(axis=1)
    size = np.linalg.norm(mixed, axis=1)
    if (size < 1e-12).any():
        raise InputError(
            f"the normals cancel at point {int(np.argmin(size))}",
            remedy="take facet normals, or a smaller sharp-edge angle",
        )
    return np.asarray(mixed / size[:, None])


@dataclass(frozen=True, slots=True, eq=False)
class _Ways:
    """What does not change along a path."""

    surface: Surface
    radius: float
    corner: float
    lead: float
    tilt: float
    limit: float
    normals: Floats
    chord: float
    along: Floats
    across: Floats

    def touching(self, cc: Floats, n: Floats, feed: Floats, delta: float = 0.0) -> Located:
        """See `cl_points`; delta : degrees of tilt more than asked."""
        lead, tilt = self.lead, self.tilt + delta
        return cl_points(cc, n, feed, self.radius, self.corner, lead_deg=lead, tilt_deg=tilt)


def _directions(tool: _Ways, points: Floats, which: Ints, sign: float) -> tuple[Floats, Floats]:
    """(n, 3): upward normals at points on given triangles, and the feed there, along the part."""
    n = _mixed(tool.surface.mesh, points, which, tool.normals)
    n[n[:, 2] < 0.0] *= -1.0
    feed = np.tile([*(sign * tool.along), 0.0], (len(points), 1))
    feed[:, 2] = -(feed * n).sum(axis=1) / np.maximum(n[:, 2], 1e-6)
    return n, feed


class _Poses(NamedTuple):
    """u : (n,) mm along the line. tips, axes : (n, 3). marks : (n,). hit : (n,), whether the part is under the point."""

    u: Floats
    tips: Floats
    axes: Floats
    marks: Ints
    hit: Bools


def five_axis_raster(
    surface: Surface,
    radius: float,
    corner_radius: float,
    *,
    chord: float,
    scallop: float | None = None,
    step: float | None = None,
    lead_deg: float = 0.0,
    tilt_deg: float = 0.0,
    tilt_limit_deg: float = 30.0,
    direction_deg: float = 0.0,
    normals: NormalKind = "angle",
    sharp_deg: float = SHARP_DEG,
) -> CLPath:
    """Parallel passes with a leaning tool, there and back; lead and tilt go with the feed of each pass.

    chord : mm, largest distance of the path from where the tool touches, and what interference is let pass.
    scallop, step : mm; one of them, step in plan.
    lead_deg, tilt_deg : of the axis, see `cl_points`. tilt_limit_deg : how far the tilt may leave the asked one.
    normals : of the facets, or of their vertices by a weight. sharp_deg : facets that meet at more are not mixed: the
        edge belongs to the part. 180 mixes all of them.
    Rapids go a radius and 5 mm above the part.
    Raises InputError: Sizes that do not fit, or no point on the part.
    """
    checked_sizes(chord, scallop, step)
    mesh = surface.mesh
    top = float(mesh.bounds[1, 2]) + radius + 5.0
    along, across, (u0, u1), (v0, v1) = directions(mesh, direction_deg)
    inset = 1e-9 * (v1 - v0)  # a line on the border of the part may miss it by rounding
    mixed = _corner_normals(mesh, normals, sharp_deg)
    tool = _Ways(
        surface, radius, corner_radius, lead_deg, tilt_deg, tilt_limit_deg, mixed, chord, along, across
    )
    pieces: list[CLPath] = []
    v, sign = v0 + inset, 1.0
    fixed = None if step is None else (v1 - v0) / int(np.ceil((v1 - v0) / step - 1e-9))
    while True:
        pieces += _line(tool, v, (u0, u1) if sign > 0 else (u1, u0))
        if v >= v1 - 2.0 * inset:
            break
        gap = fixed if fixed is not None else _gap(tool, v, (u0, u1), sign, scallop or 0.0)
        v, sign = min(v + gap, v1 - inset), -sign
    if not pieces:
        raise InputError("no line of the raster meets the part")
    marks = np.concatenate([piece.marks for piece in pieces])
    notes = overhang_notes(mesh)
    for mark, what in ((Mark.TURNED, "tilted otherwise"), (Mark.RAISED, "lifted along their axis")):
        if count := int((marks == mark).sum()):
            notes.append(f"{count} of {len(marks)} points are {what}: the tool would have cut into the part")
    return CLPath.joined(_linked(tool, pieces), clear_mm=top, notes=tuple(notes))


def _poses(tool: _Ways, v: float, u: Floats, sign: float) -> _Poses:
    """Poses on a line, free of interference."""
    xy = u[:, None] * tool.along + v * tool.across
    z, which = tool.surface.heights(xy)
    hit = which >= 0
    tips, axes = np.zeros((len(u), 3)), np.tile([0.0, 0.0, 1.0], (len(u), 1))
    marks = np.full(len(u), int(Mark.CONTACT), dtype=np.int64)
    at = np.flatnonzero(hit)
    if not len(at):
        return _Poses(u, tips, axes, marks, hit)
    cc = np.column_stack([xy, z])[at]
    n, feed = _directions(tool, cc, which[at], sign)
    tips[at], axes[at] = tool.touching(cc, n, feed)
    lift = np.zeros(len(u))
    lift[at] = tool.surface.lift(tips[at], axes[at], tool.radius, tool.corner)
    blocked = at[lift[at] > tool.chord]
    local = np.searchsorted(at, blocked)
    steps = TILT_STEP_DEG * np.arange(1, int(tool.limit / TILT_STEP_DEG + 1e-9) + 1)
    for delta in np.column_stack([steps, -steps]).ravel():  # the nearest first
        if not len(blocked):
            break
        t, a = tool.touching(cc[local], n[local], feed[local], delta)
        free = (tool.surface.lift(t, a, tool.radius, tool.corner) <= tool.chord) & (a[:, 2] > 0.1)
        tips[blocked[free]], axes[blocked[free]] = t[free], a[free]
        marks[blocked[free]], lift[blocked[free]] = int(Mark.TURNED), 0.0
        blocked, local = blocked[~free], local[~free]
    marks[blocked] = int(Mark.RAISED)
    return _Poses(u, tips + lift[:, None] * axes, axes, marks, hit)


def _between(p: Floats, q: Floats, share: Floats) -> Floats:
    """(n, m, 3): along chords (n, 3)."""
    return np.asarray(p[:, None] + share[None, :, None] * (q - p)[:, None])


def _turned(p: Floats, q: Floats, share: Floats) -> Floats:
    """(n, m, 3): axes on the great circle between axes (n, 3), which are not opposite."""
    angle = np.arccos(np.clip((p * q).sum(axis=1), -1.0, 1.0))[:, None]
    small = angle < 1e-7
    sine = np.where(small, 1.0, np.sin(angle))
    one = np.where(small, 1.0 - share, np.sin((1.0 - share) * angle) / sine)
    two = np.where(small, share, np.sin(share * angle) / sine)
    mixed = one[:, :, None] * p[:, None] + two[:, :, None] * q[:, None]
    return np.asarray(mixed / np.linalg.norm(mixed, axis=2, keepdims=True))


def _chord_lift(tool: _Ways, tips: Floats, axes: Floats, at: Ints) -> tuple[Floats, Floats]:
    """Of the chords that begin at `at`: inner tips (k, 3, 3), and the largest lift on them (k,)."""
    inner = _between(tips[at], tips[at + 1], INNER)
    leaning = _turned(axes[at], axes[at + 1], INNER)
    lift = tool.surface.lift(inner.reshape(-1, 3), leaning.reshape(-1, 3), tool.radius, tool.corner)
    return inner, lift.reshape(-1, len(INNER)).max(axis=1)


def _line(tool: _Ways, v: float, ends: tuple[float, float]) -> list[CLPath]:
    """Pieces of one pass where the part is under it."""
    first, last = ends
    sign = 1.0 if last > first else -1.0
    inset = 1e-9 * abs(last - first)
    first, last = first + sign * inset, last - sign * inset
    count = max(2, int(np.ceil(abs(last - first) / (tool.radius / 4.0))) + 1)
    poses = _poses(tool, v, np.linspace(first, last, count), sign)
    done = np.zeros(len(poses.u) - 1, dtype=np.bool_)
    least = LEAST * tool.chord
    for _ in range(ROUNDS):
        asked = np.flatnonzero(~done)
        if not len(asked):
            break
        middle = _poses(tool, v, 0.5 * (poses.u[asked] + poses.u[asked + 1]), sign)
        both = poses.hit[asked] & poses.hit[asked + 1]
        split = poses.hit[asked] != poses.hit[asked + 1]  # where the part begins or ends
        on = np.flatnonzero(both)
        if len(on):
            inner, lift = _chord_lift(tool, poses.tips, poses.axes, asked[on])
            off = np.linalg.norm(middle.tips[on] - inner[:, 1], axis=1)
            split[on] = (off > tool.chord) | (lift > tool.chord) | ~middle.hit[on]
        split &= np.abs(poses.u[asked + 1] - poses.u[asked]) > least
        done[asked] = ~split
        at = asked[split] + 1
        poses = _Poses(*(np.insert(a, at, b[split], axis=0) for a, b in zip(poses, middle, strict=True)))
        done = np.insert(done, at, False)
    pieces = []
    cut = np.flatnonzero(np.diff(np.concatenate([[False], poses.hit, [False]]).astype(np.int64)))
    for begin, end in zip(cut[::2], cut[1::2], strict=True):
        if end - begin < 2:
            continue
        tips, axes, marks = poses.tips[begin:end].copy(), poses.axes[begin:end], poses.marks[begin:end]
        for _ in range(8):  # what is left above a chord lifts both of its ends
            _, lift = _chord_lift(tool, tips, axes, np.arange(len(tips) - 1))
            if lift.max() <= 0.1 * tool.chord:
                break
            raised = np.maximum(np.append(lift, 0.0), np.insert(lift, 0, 0.0))
            tips += raised[:, None] * axes
            marks = np.where(raised > tool.chord, int(Mark.RAISED), marks)
        pieces.append(CLPath(tips, axes, np.zeros(len(tips), np.bool_), marks))
    return pieces


def _linked(tool: _Ways, pieces: list[CLPath]) -> list[CLPath]:
    """Neighbours joined by a chord where the tool is free on it."""
    share = np.linspace(0.0, 1.0, 17)[1:-1]
    out = [pieces[0]]
    for piece in pieces[1:]:
        last = out[-1]
        ends = [np.stack([a[-1], b[0]]) for a, b in ((last.tips, piece.tips), (last.axes, piece.axes))]
        tips = _between(ends[0][:1], ends[0][1:], share)[0]
        near = np.linalg.norm(ends[0][1] - ends[0][0]) <= 2.0 * tool.radius
        if near and (ends[1][0] * ends[1][1]).sum() > 0.5:
            axes = _turned(ends[1][:1], ends[1][1:], share)[0]
            if tool.surface.lift(tips, axes, tool.radius, tool.corner).max() <= 0.5 * tool.chord:
                out[-1] = last.followed_by(piece)
                continue
        out.append(piece)
    return out


def _gap(tool: _Ways, v: float, ends: tuple[float, float], sign: float, scallop: float) -> float:
    """Step over in plan whose highest scallop has the asked height; the next pass goes the other way, and leans the other way."""
    count = int(np.clip(abs(ends[1] - ends[0]) / (tool.radius / 4.0), 16, 2000))
    stations = np.linspace(*ends, count + 2)[1:-1]
    ball = max(tool.corner, scallop)
    base = float(scallop_step(scallop, ball)) if scallop < ball else 2.0 * scallop

    def highest(s: float) -> float:
        shares = np.linspace(0.0, 1.0, RIDGE_PLACES)
        xy = stations[:, None, None] * tool.along + (v + s * shares[:, None]) * tool.across
        z, which = tool.surface.heights(xy.reshape(-1, 2))
        z, which = z.reshape(xy.shape[:2]), which.reshape(xy.shape[:2])
        on = (which >= 0).all(axis=1)
        if not on.any():
            return 0.0
        part, which = np.concatenate([xy, z[:, :, None]], axis=2)[on], which[on]
        frames = []
        for k, way in ((0, sign), (RIDGE_PLACES // 2, sign), (-1, -sign)):
            points = part[:, k]
            n, f = _directions(tool, points, which[:, k], way)
            frames.append((n, f, tool.touching(points, n, f)))
        (_, _, one), (n, f, _), (_, _, two) = frames
        return float(leaning_ridges(part, n, f, (one, two), tool.radius, tool.corner).max())

    return widest_step(highest, scallop, start=base, least=0.02 * base, most=4.0 * tool.radius) or 0.02 * base
