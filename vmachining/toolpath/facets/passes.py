"""Raster paths in three axes: parallel lines on which the tool rests on the part. Source: spec D.10.

1. Lines stand apart by a given step, or by scallops of a given height. The next line is where the highest scallop between it
   and the last one has that height; scallops follow from three tips across the feed (on both lines and halfway), see `scallops`.
2. On each line the tip's height is a function of the way. Its chords are divided until it stays within the chord tolerance of
   them at three inner points; what is left above a chord lifts both of its ends, so that no checked point is cut into.
3. Where the height jumps (a flat end at a wall) the tool goes upright: first up, then ahead; first ahead, then down.
4. Lines are linked on the part, there and back, by chords treated like those of lines.

Known limits: a scallop is that of a cutter whose outline across the feed is a circle between the two lines; of bull nose and
flat end it is an upper bound. Faces steeper than `STEEP_DEG` do not choose the step: they are reported; cut them with waterlines.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import NamedTuple, TypeAlias

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.errors import InputError
from vmachining.toolpath.clpath import CLPath, Mark, positive
from vmachining.toolpath.facets.drop import Surface
from vmachining.toolpath.facets.mesh import FacetMesh
from vmachining.toolpath.facets.ridges import scallop_step, upright_ridges, widest_step

Span: TypeAlias = tuple[float, float]

INNER = np.array([0.25, 0.5, 0.75])
STEEP_DEG = 75.0
LEAST_STEP = 0.05
"""Smallest step over, as a share of that on a plane; also the shortest chord, as a share of the chord tolerance."""

STRAIGHT = 1e-12
"""Sine of the turn between chords that are one."""

BETWEEN = np.arange(1, 6) / 6.0
"""Passes between two of them that tell what these leave, as shares of the step over."""

ROUNDS = 40
MOST_POINTS = 5_000_000


class Raster(NamedTuple):
    """path. offsets : (k,) mm across the feed, of the lines. contacts : points on the part, floor and links are in path.marks."""

    path: CLPath
    offsets: Floats


@dataclass(frozen=True, slots=True)
class Chords:
    """Points of straight ways in plan, divided. way : (n,) index of the way. xy : (n, 2). z : (n,) mm. touches : (n,)."""

    way: Ints
    xy: Floats
    z: Floats
    touches: Bools


def checked_sizes(chord: float, scallop: float | None, step: float | None) -> None:
    """Raises InputError for sizes that are not positive, or both or none of scallop and step."""
    positive(chord=chord, scallop=scallop, step=step)
    if (scallop is None) == (step is None):
        raise InputError("give a scallop height or a step over, one of them")


def overhang_notes(mesh: FacetMesh) -> list[str]:
    """What a tool from above does not see, or hardly: facets that look down over others, steep ones, and how much of them."""
    up = mesh.normals[:, 2]
    down = up < -1e-6
    low, high = mesh.bounds[:, 2]
    inner = down & (mesh.corners[:, :, 2].min(axis=1) > low + 1e-6 * max(high - low, 1e-9))
    steep = (up > 1e-6) & (up < np.cos(np.radians(STEEP_DEG)))
    found = []
    if inner.any():
        found.append(
            f"overhangs: {int(inner.sum())} facets ({float(mesh.areas[inner].sum()):.4g} mm2) look down above the bottom, "
            "the tool comes from above and does not reach them"
        )
    if steep.any():
        found.append(
            f"steep: {int(steep.sum())} facets ({float(mesh.areas[steep].sum()):.4g} mm2) are steeper than "
            f"{STEEP_DEG:g} degrees, passes from above lie far apart on them; waterlines reach them better"
        )
    return found


def raster(
    surface: Surface,
    radius: float,
    corner_radius: float,
    *,
    chord: float,
    scallop: float | None = None,
    step: float | None = None,
    direction_deg: float = 0.0,
    floor: float | None = None,
    clear: float | None = None,
    zigzag: bool = True,
) -> Raster:
    """Parallel passes over the whole part.

    radius, corner_radius : mm, of the cutter.
    chord : mm, largest distance of the path from where the tool rests on the part.
    scallop, step : mm; one of them: height of the ridges that stay, or distance of the lines in plan.
    direction_deg : of the lines, from +x.
    floor : mm; the tip goes no lower. Default: the bottom of the part.
    clear : mm, height of rapids. Default: 5 mm above the part.
    Raises InputError: Sizes that are not positive or do not fit each other, or more than `MOST_POINTS` points.
    """
    checked_sizes(chord, scallop, step)
    low, high = surface.mesh.bounds
    bottom = float(low[2]) if floor is None else floor
    top = float(high[2]) + 5.0 if clear is None else clear
    along, across, (u0, u1), (v0, v1) = directions(surface.mesh, direction_deg)
    notes = overhang_notes(surface.mesh)
    if step is not None:
        offsets = np.linspace(v0, v1, int(np.ceil((v1 - v0) / step - 1e-9)) + 1)
    else:
        assert scallop is not None
        extent = (u0, u1), (v0, v1)
        offsets, more = _offsets(surface, radius, corner_radius, scallop, along, across, extent, bottom)
        notes += more
    starts, ends = (u * along + offsets[:, None] * across for u in (u0, u1))
    ways = np.stack([starts, ends], axis=1)
    if zigzag:  # line, link, line back, ...
        back = np.arange(len(offsets)) % 2 == 1
        ways[back] = ways[back, ::-1]
        links = np.stack([ways[:-1, 1], ways[1:, 0]], axis=1)
        place = np.concatenate([np.arange(len(ways)) * 2, np.arange(len(links)) * 2 + 1])
        ways = np.concatenate([ways, links])[np.argsort(place)]
    found = on_part(surface, radius, corner_radius, ways, chord=chord, floor=bottom)
    marks = np.where(found.touches, Mark.CONTACT, Mark.FREE)
    tips = np.column_stack([found.xy, found.z])
    if zigzag:
        marks[found.way % 2 == 1] = Mark.LINK
        pieces = [CLPath.upright(tips, marks)]
    else:
        pieces = [CLPath.upright(tips[found.way == k], marks[found.way == k]) for k in range(len(offsets))]
    if not found.touches.any():
        raise InputError("the tool touches nothing above the floor", remedy="a lower floor")
    return Raster(CLPath.joined(pieces, clear_mm=top, notes=tuple(notes)), offsets)


def directions(mesh: FacetMesh, degrees: float) -> tuple[Floats, Floats, Span, Span]:
    """(2,) unit in plan, along passes at an angle from +x, and across them to the left; extents of the part in both, mm."""
    turn = np.radians(degrees)
    along = np.array([np.cos(turn), np.sin(turn)])
    across = np.array([-along[1], along[0]])
    corners = np.array(list(product(*mesh.bounds[:, :2].T)))
    spans = [(float((corners @ way).min()), float((corners @ way).max())) for way in (along, across)]
    return along, across, spans[0], spans[1]


def on_part(
    surface: Surface, radius: float, corner_radius: float, ways: Floats, *, chord: float, floor: float
) -> Chords:
    """The tool resting on the part along straight ways in plan (k, 2, 2), in chords that nowhere lie below what was checked.

    A peak of the part lifts the tool over a width, by an outline as round as its corner: the first points stand so close that
    what passes between two of them is below the chord tolerance, if it is round.
    """
    longest = 2.0 * np.sqrt(8.0 * corner_radius * chord) if corner_radius > 0.0 else radius / 4.0
    longest = min(max(longest, 0.02 * radius), radius / 2.0)
    sizes = np.linalg.norm(ways[:, 1] - ways[:, 0], axis=1)
    counts = np.maximum(np.ceil(sizes / longest).astype(np.int64), 1) + 1
    if counts.sum() > MOST_POINTS:
        raise InputError(f"the path has {counts.sum()} points and more", remedy="larger chord or step")
    way = np.repeat(np.arange(len(ways)), counts)
    t = np.concatenate([np.linspace(0.0, 1.0, n) for n in counts])
    least = LEAST_STEP * chord

    def drop(which: Ints, share: Floats) -> tuple[Floats, Bools]:
        xy = ways[which, 0] + share[:, None] * (ways[which, 1] - ways[which, 0])
        found = surface.drop(xy, radius, corner_radius, floor=floor)
        return found.z, found.touches

    z, touches = drop(way, t)
    over = np.full(len(way), np.nan)  # of the chord that begins here: how far the tool has to stay above it
    for _ in range(ROUNDS):
        asked = np.flatnonzero(np.isnan(over[:-1]) & (way[1:] == way[:-1]))
        if not len(asked):
            break
        t0, t1, z0, z1 = t[asked], t[asked + 1], z[asked], z[asked + 1]
        share = t0[:, None] + INNER * (t1 - t0)[:, None]
        inner, hits = drop(np.repeat(way[asked], 3), share.ravel())
        excess = inner.reshape(-1, 3) - (z0[:, None] + INNER * (z1 - z0)[:, None])
        short = (t1 - t0) * sizes[way[asked]] <= least
        split = (np.abs(excess).max(axis=1) > chord) & ~short
        over[asked] = np.where(split, np.nan, np.maximum(excess.max(axis=1), 0.0))
        over[asked[short]] = np.where(np.abs(z1 - z0)[short] > chord, np.inf, over[asked[short]])
        at = asked[split] + 1
        middle = 3 * np.flatnonzero(split) + 1
        way, t = np.insert(way, at, way[asked[split]]), np.insert(t, at, share[split, 1])
        z, touches = np.insert(z, at, inner.ravel()[middle]), np.insert(touches, at, hits[middle])
        over = np.insert(over, at, np.nan)
        if len(way) > MOST_POINTS:
            raise InputError("the path has too many points", remedy="a larger chord tolerance")
    xy = ways[way, 0] + t[:, None] * (ways[way, 1] - ways[way, 0])
    return _thinned(_lifted(Chords(way, xy, z, touches), np.nan_to_num(over, nan=0.0, posinf=np.inf)))


def _lifted(found: Chords, over: Floats) -> Chords:
    """Chords raised by what stands above them; jumps as an upright move at their lower side."""
    jump = np.flatnonzero(np.isinf(over))
    flat = np.where(np.isinf(over), 0.0, over)
    lift = flat.copy()
    lift[1:] = np.maximum(lift[1:], np.where(found.way[1:] == found.way[:-1], flat[:-1], 0.0))
    z = found.z + lift
    if not len(jump):
        return Chords(found.way, found.xy, z, found.touches)
    upper = np.maximum(z[jump], z[jump + 1])
    lower = np.where(z[jump] <= z[jump + 1], jump, jump + 1)
    return Chords(
        np.insert(found.way, jump + 1, found.way[jump]),
        np.insert(found.xy, jump + 1, found.xy[lower], axis=0),
        np.insert(z, jump + 1, upper),
        np.insert(found.touches, jump + 1, True),
    )


def _thinned(found: Chords) -> Chords:
    """Without the points that lie on the straight line between their neighbours of the same way and kind."""
    way, touches = found.way, found.touches
    back, ahead = (
        np.diff(np.column_stack([found.xy, found.z]), axis=0)[k] for k in (slice(None, -1), slice(1, None))
    )
    same = (way[:-2] == way[1:-1]) & (way[1:-1] == way[2:]) & (touches[:-2] == touches[1:-1])
    same &= touches[1:-1] == touches[2:]
    off = np.linalg.norm(np.cross(back, ahead), axis=1)
    size = np.linalg.norm(back, axis=1) * np.linalg.norm(ahead, axis=1)
    straight = (off <= STRAIGHT * size) & ((back * ahead).sum(axis=1) > 0.0)
    keep = np.concatenate([[True], ~(same & straight), [True]])
    return Chords(way[keep], found.xy[keep], found.z[keep], touches[keep])


def _offsets(
    surface: Surface,
    radius: float,
    corner_radius: float,
    scallop: float,
    along: Floats,
    across: Floats,
    extent: tuple[Span, Span],
    floor: float,
) -> tuple[Floats, list[str]]:
    """Offsets of lines whose highest scallop has the asked height, within 2 % below it."""
    (u0, u1), (v0, v1) = extent
    if scallop >= radius:
        raise InputError(f"a scallop of {scallop:g} mm is not below the radius of the cutter, {radius:g} mm")
    plane = float(scallop_step(scallop, corner_radius)) if corner_radius > scallop else 2.0 * scallop
    most = 2.0 * (radius - corner_radius) + plane if corner_radius < radius else plane
    most = min(max(most * 0.9 if corner_radius < radius else 4.0 * plane, plane), max(v1 - v0, 1e-9))
    least = LEAST_STEP * plane
    stations = np.linspace(u0, u1, int(np.clip((u1 - u0) / min(plane, radius / 4.0), 16, 4000)) + 1)
    limit = np.cos(np.radians(STEEP_DEG))
    steep, seen, bound = 0, 0, False

    def tips(v: float) -> tuple[Floats, Bools]:
        xy = stations[:, None] * along + v * across
        found = surface.drop(xy, radius, corner_radius, floor=floor)
        return found.z, found.touches

    offsets = [v0]
    s = plane
    while offsets[-1] < v1 - 1e-9:
        v = offsets[-1]
        last = tips(v)
        walls = touched = 0

        def highest(width: float, v: float = v, last: tuple[Floats, Bools] = last) -> float:
            nonlocal walls, touched
            shares = np.array([*BETWEEN, 1.0])
            found = [last, *(tips(v + share * width) for share in shares)]
            z = np.array([height for height, _ in found])
            slopes = np.gradient(z, stations, axis=1)
            heights, up = upright_ridges(z, slopes, width * np.insert(shares, 0, 0.0), radius, corner_radius)
            on = np.all([touches for _, touches in found], axis=0)
            level = on & (up >= limit)
            walls, touched = int((on & ~level).sum()), int(on.sum())
            return float(heights[level].max(initial=0.0))

        good = widest_step(highest, scallop, start=s, least=least, most=most)
        s = good if good > 0.0 else least
        bound = bound or good == 0.0
        steep, seen = steep + walls, seen + touched
        offsets.append(min(v + s, v1))
    found = []
    if steep:
        found.append(
            f"{100.0 * steep / max(seen, 1):.3g} % of the passes lie on faces steeper than {STEEP_DEG:g} degrees: scallops are "
            "higher there, waterlines reach them better"
        )
    if bound:
        found.append(f"some lines stand {least:.3g} mm apart, the smallest step, and leave higher scallops")
    return np.array(offsets), found
