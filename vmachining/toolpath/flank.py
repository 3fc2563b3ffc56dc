"""`flank_path`: a ruled face cut with the side of the tool, along its rulings (swarf milling).

The tool is a cylinder of radius R. Its axis goes through both ends of a ruling, each moved by R along the normal there. Where the
normals are the same along a ruling (planes, cylinders, cones, every developable face) the tool touches all of it. Where they
turn by an angle a it cuts in by R (1 - cos(a / 2)), in the middle; `Flank.overcut` says how much.

Between two rulings the tool goes straight. `Flank.between` says how deep it is in the face there: its poses at both ends and
halfway, against both rulings and the one halfway, where each rail is the arc that its tangents suggest. On a cylinder of radius
r that is (r + R) (1 - cos(a / 2)) for rulings an angle a apart and the tool outside.

Known limit: other rulings are not looked at. Hollow faces that are narrower than the tool may be gouged there: `--engine vectors`
with the part as `[design]` measures it.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Bools, Floats, Ints, rows
from vmachining.errors import InputError
from vmachining.toolpath.clpath import CLPath, Mark, positive

PLACES = np.linspace(0.0, 1.0, 17)
LEAST_MM = 1e-9
TOLD_MM = 1e-6
"""Overcut that is worth a note."""

STEP_MM, STEP_SHARE = 1e-5, 1e-6
"""Places on a rail closer than that, or than this share of the median step, are one: their direction is rounding."""


class Flank(NamedTuple):
    """path : of the tip, from the first ruling to the last. overcut : (n,) mm, depth of the tool in the face at each ruling.
    twist : (n,) rad between the normals of its ends. between : (n - 1,) mm, depth on the way from each ruling to the next."""

    path: CLPath
    overcut: Floats
    twist: Floats
    between: Floats


def flank_path(
    lower: ArrayLike,
    upper: ArrayLike,
    radius: float,
    *,
    side: Literal["left", "right"] = "left",
    below_mm: float = 0.0,
) -> Flank:
    """The path along rulings from `lower` to `upper` (n, 3) mm, in the order in which they are cut.

    radius : mm, of the cutter. side : where the tool stands, seen along the feed with the spindle up.
    below_mm : how far the tip goes below the lower rail, along the axis.
    Rapids go a radius and 5 mm above the face.
    Raises InputError: Fewer than two rulings, a ruling of no length or along the feed, a rail that turns back, an axis
    that turns over.
    """
    low, high = rows(lower, -1, 3, name="lower"), rows(upper, -1, 3, name="upper")
    if len(low) != len(high) or len(low) < 2:
        raise InputError(
            f"{len(low)} and {len(high)} places on the rails: give as many on both, two at least"
        )
    positive(radius=radius)
    ruling = _unit(high - low, "ruling {k} has no length")
    sign = 1.0 if side == "left" else -1.0
    rails = [_Rail.of(rail) for rail in (low, high)]
    if all(rail.tangent is None for rail in rails):
        raise InputError("neither rail has a length: all rulings are one")
    still = [_still(rail, other) for rail, other in (rails, rails[::-1])]
    own = [rail.normals(ruling) for rail in rails]
    n0 = sign * _chosen(own[0], own[1], still[0] & ~still[1])
    n1 = sign * _chosen(own[1], own[0], still[1] & ~still[0])
    first, second = low + radius * n0, high + radius * n1
    axes = _unit(second - first, "the axis of ruling {k} has no length")
    shared = PLACES[None, :, None]
    face = (1.0 - shared) * low[:, None] + shared * high[:, None]
    worst = _depth(face, first, axes, radius)
    twist = np.arccos(np.clip((n0 * n1).sum(axis=1), -1.0, 1.0))
    # the flat end stands square to the axis through the lower end of the ruling, or below it
    foot = np.einsum("ij,ij->i", low - first, axes)
    tips = first + (np.minimum(foot, 0.0) - below_mm)[:, None] * axes
    mean = _unit(axes[:-1] + axes[1:], "the axis turns over after ruling {k}")
    poses = ((tips[:-1], axes[:-1]), (0.5 * (tips[:-1] + tips[1:]), mean), (tips[1:], axes[1:]))
    middle = [rail.middle(at) for rail, at in zip(rails, still, strict=True)]
    halfway = (1.0 - shared) * middle[0][:, None] + shared * middle[1][:, None]
    faces = (face[:-1], halfway, face[1:])
    depths = [
        _depth(faces[j], *poses[i], radius) for i in range(3) for j in range(3) if (i, j) not in ((0, 0), (2, 2))
    ]  # fmt: skip
    between = np.max(depths, axis=0)
    marks = np.full(len(tips), int(Mark.CONTACT), dtype=np.int64)
    top = float(max(low[:, 2].max(), high[:, 2].max())) + radius + 5.0
    piece = CLPath(tips, axes, np.zeros(len(tips), np.bool_), marks)
    notes = _notes(rails, worst, between)
    return Flank(CLPath.joined([piece], clear_mm=top, notes=notes), worst, twist, between)


class _Rail(NamedTuple):
    """points : (n, 3). group : (n,), the same number for neighbours that are one place. tangent : (n, 3) unit, the same for
    one place; None: the rail is one place. step : mm, below which places are one."""

    points: Floats
    group: Ints
    tangent: Floats | None
    step: float

    @classmethod
    def of(cls, points: Floats) -> _Rail:
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        least = max(STEP_MM, STEP_SHARE * float(np.median(steps)))
        group = _groups(points, steps, least)
        places = points[np.unique(group, return_index=True)[1]]
        if len(places) == 1:
            return cls(points, group, None, least)
        chords = np.diff(places, axis=0)
        at = np.concatenate([[0.0], np.cumsum(np.linalg.norm(chords, axis=1))])
        tangent = np.gradient(places, at, axis=0)
        if len(places) > 2:  # the ends of the arcs through the first and the last chord
            tangent[0] = _mirrored(tangent[1:2], chords[:1])[0]
            tangent[-1] = _mirrored(tangent[-2:-1], chords[-1:])[0]
        return cls(points, group, _unit(tangent[group], "the rail turns back at ruling {k}"), least)

    def normals(self, ruling: Floats) -> Floats | None:
        """(n, 3): tangent x ruling turned to the left of the feed, the rulings going up."""
        if self.tangent is None:
            return None
        return _unit(np.cross(ruling, self.tangent), "ruling {k} goes along its rail")

    def middle(self, still: Bools) -> Floats:
        """(n - 1, 3): the middle of the arc from each place to the next. still : where the rail has a corner."""
        straight = 0.5 * (self.points[:-1] + self.points[1:])
        if self.tangent is None:
            return straight
        chord = np.diff(self.points, axis=0)
        moves = (self.group[1:] != self.group[:-1])[:, None]
        start, end = self.tangent[:-1], self.tangent[1:]
        cut0, cut1 = still[:-1, None], still[1:, None]
        away, back = _mirrored(end, chord), _mirrored(start, chord)
        first = np.where(cut0, np.where(cut1, chord, away), start)
        last = np.where(cut1, np.where(cut0, chord, back), end)
        length = np.linalg.norm(chord, axis=1)[:, None]
        # sagitta c / 2 tan(a / 4), a between the tangents
        half = 0.5 * np.linalg.norm(first + last, axis=1)[:, None]
        bulge = 0.25 * length * (first - last) / (1.0 + half)
        return np.asarray(straight + np.where(moves & ~(cut0 & cut1), bulge, 0.0))


def _groups(points: Floats, steps: Floats, least: float) -> Ints:
    """Numbers of the places, where neighbours within `least` of the first of them are one."""
    if (steps >= least).all():
        return np.arange(len(points))
    group = np.zeros(len(points), dtype=np.int64)
    first = 0
    for k in range(1, len(points)):
        new = bool(np.linalg.norm(points[k] - points[first]) >= least)
        first = k if new else first
        group[k] = group[k - 1] + new
    return group


def _still(rail: _Rail, other: _Rail) -> Bools:
    """(n,): rulings where the rail stands still and the other one moves."""
    step = (np.diff(rail.group) == 0) & (np.diff(other.group) != 0)
    return np.asarray(np.append(step, False) | np.append(False, step))


def _chosen(own: Floats | None, other: Floats | None, still: Bools) -> Floats:
    """Where a rail stands still the face is a cone: its apex has the normals of its rim."""
    if own is None:
        assert other is not None
        return other
    return own if other is None else np.asarray(np.where(still[:, None], other, own))


def _mirrored(tangent: Floats, chord: Floats) -> Floats:
    """The tangent at the other end of the arc over each chord."""
    square = np.maximum((chord * chord).sum(axis=1), LEAST_MM**2)
    return np.asarray(2.0 * ((tangent * chord).sum(axis=1) / square)[:, None] * chord - tangent)


def _depth(face: Floats, place: Floats, axis: Floats, radius: float) -> Floats:
    """(n,) mm: how deep the deepest of the places (n, m, 3) lies in an endless cylinder through `place` along `axis`."""
    off = face - place[:, None]
    along = (off * axis[:, None]).sum(axis=2)
    far = np.linalg.norm(off - along[:, :, None] * axis[:, None], axis=2)
    return np.asarray(np.maximum(radius - far, 0.0).max(axis=1))


def _notes(rails: list[_Rail], worst: Floats, between: Floats) -> tuple[str, ...]:
    found = []
    same = np.flatnonzero(np.all([np.diff(rail.group) == 0 for rail in rails], axis=0))
    if len(same):
        pairs = ", ".join(f"{k} and {k + 1}" for k in same[:5].tolist()) + (", ..." if len(same) > 5 else "")
        found.append(
            f"rulings {pairs} are one within {max(rail.step for rail in rails):.3g} mm: they share their normals"
        )
    if worst.max() > TOLD_MM:
        k = int(np.argmax(worst.round(12)))
        found.append(f"{float(worst[k]):.3g} mm of overcut where the face is twisted, at ruling {k} most")
    if between.max() > TOLD_MM and between.max() > worst.max():
        k = int(np.argmax(between.round(12)))
        found.append(
            f"{float(between[k]):.3g} mm of overcut on the straight way from ruling {k} to {k + 1}: give rulings closer together"
        )
    return tuple(found)


def _unit(v: Floats, said: str) -> Floats:
    size = np.linalg.norm(v, axis=1)
    if (size < LEAST_MM).any():
        raise InputError(said.format(k=int(np.argmin(size))))
    return np.asarray(v / size[:, None])
