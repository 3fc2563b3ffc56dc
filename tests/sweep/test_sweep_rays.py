"""Ray intervals: on the surface, consistent with membership, adding up to known volumes."""

from itertools import pairwise
from math import asin, pi, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from strategies import paths, tools
from sweep_inventions import (
    BALL,
    BULL,
    FLAT,
    PATHS,
    STEPPED,
    TOOLS,
    lengths_volume,
    lines,
    smooth_rule,
    sphere,
)

from vmachining.errors import SweepError
from vmachining.geometry import Arc, Line
from vmachining.sweep import Sweep
from vmachining.tool import Profile

ON_SURFACE = 1e-11
"""mm: what the kernels promise for an end of an interval."""


def check_intervals(sweep: Sweep, origins, directions) -> None:
    found = sweep.ray_intervals(origins, directions)
    ray = np.repeat(np.arange(len(origins)), found.counts)
    for s in (found.enter, found.leave):
        assert (
            np.abs(sweep.signed_distance(origins[ray] + s[:, None] * directions[ray])).max(initial=0)
            < ON_SURFACE
        )
    same = ray[1:] == ray[:-1]
    assert (found.enter < found.leave).all()
    assert (found.leave[:-1][same] < found.enter[1:][same]).all()
    t = np.random.default_rng(5).uniform(-120, 120, (len(origins), 8))
    d = sweep.signed_distance((origins[:, None] + t[..., None] * directions[:, None]).reshape(-1, 3)).reshape(
        t.shape
    )
    inside = np.zeros(t.shape, dtype=bool)
    for i, a, b in zip(ray, found.enter, found.leave, strict=True):
        inside[i] |= (t[i] >= a) & (t[i] <= b)
    clear = np.abs(d) > ON_SURFACE
    assert (inside == (d < 0))[clear].all()


@pytest.mark.parametrize("tool", TOOLS)
@pytest.mark.parametrize("path", PATHS)
def test_rays_agree_with_the_distance(tool, path):
    sweep = Sweep.along(TOOLS[tool], PATHS[path])
    origins, directions = lines(sweep, 40)
    check_intervals(sweep, origins, directions)
    for axis in np.eye(3):
        check_intervals(sweep, origins[:10], np.broadcast_to(axis, (10, 3)))


@settings(deadline=None, max_examples=60)
@given(profile=tools(), path=paths())
def test_rays_agree_with_the_distance_anywhere(profile: Profile, path):
    sweep = Sweep.along(profile, path)
    check_intervals(sweep, *lines(sweep, 6))


@settings(deadline=None, max_examples=30)
@given(profile=tools(), path=paths())
def test_a_ray_through_parts_is_the_union(profile: Profile, path):
    whole = Sweep.along(profile, path)
    origins, directions = lines(whole, 5)
    parts = [part.ray_intervals(origins, directions) for part in whole.split([0.3, 0.8])]
    joint = whole.ray_intervals(origins, directions)
    first = np.concatenate([[0], np.cumsum(joint.counts)])
    for i in range(len(origins)):
        pieces = []
        for part in parts:
            begin = int(part.counts[:i].sum())
            span = slice(begin, begin + int(part.counts[i]))
            pieces += list(zip(part.enter[span], part.leave[span], strict=True))
        merged: list[list[float]] = []
        for a, b in sorted(pieces):
            if merged and a <= merged[-1][1] + 1e-9:
                merged[-1][1] = max(merged[-1][1], b)
            else:
                merged.append([a, b])
        mine = np.stack([joint.enter, joint.leave], axis=1)[first[i] : first[i + 1]]
        assert len(mine) == len(merged)
        assert mine == pytest.approx(np.array(merged).reshape(-1, 2), abs=1e-7)


def test_ray_through_a_capsule():
    r, rng = 4.0, np.random.default_rng(0)
    sweep = Sweep(sphere(r).shifted(-r), (0, 0, 0), (20, 10, -15))
    axis = np.array([20.0, 10, -15]) / sqrt(725)
    origins = rng.normal(size=(200, 3)) * 3 + rng.uniform(0, 1, (200, 1)) * [20, 10, -15]
    u = rng.normal(size=(200, 3))
    u /= np.linalg.norm(u, axis=1)[:, None]
    found = sweep.ray_intervals(origins, u)
    # first and last crossing of sphere, cylinder, sphere
    ends = np.full((200, 2), np.nan)
    for centre in (np.zeros(3), np.array([20.0, 10, -15])):
        b, c = ((origins - centre) * u).sum(1), ((origins - centre) ** 2).sum(1) - r * r
        root = np.sqrt(np.where(b * b - c > 0, b * b - c, np.nan))
        ends = np.stack([np.fmin(ends[:, 0], -b - root), np.fmax(ends[:, 1], -b + root)], axis=1)
    p, v = origins - np.outer(origins @ axis, axis), u - np.outer(u @ axis, axis)
    a, b, c = (v * v).sum(1), (p * v).sum(1), (p * p).sum(1) - r * r
    root = np.sqrt(np.where(b * b - a * c > 0, b * b - a * c, np.nan))
    for side, t in ((0, (-b - root) / a), (1, (-b + root) / a)):
        along = ((origins + t[:, None] * u) * axis).sum(1)
        t = np.where((along >= 0) & (along <= sqrt(725)), t, np.nan)
        ends[:, side] = (np.fmin, np.fmax)[side](ends[:, side], t)
    hit = ~np.isnan(ends[:, 0])
    assert (found.counts == hit).all()
    assert found.enter == pytest.approx(ends[hit, 0], abs=1e-10)
    assert found.leave == pytest.approx(ends[hit, 1], abs=1e-10)


def test_ray_across_a_ring():
    ring = Sweep.along(FLAT, Arc((30, 0, 0), (0, 0, 0), 2, angle=2 * pi))
    found = ring.ray_intervals([(-100, 0, 10), (-100, 0, 60), (0, 0, 0)], [(1, 0, 0), (1, 0, 0), (0, 0, 1)])
    assert found.counts.tolist() == [2, 0, 0]
    assert found.enter == pytest.approx([60, 120], abs=1e-11)
    assert found.leave == pytest.approx([80, 140], abs=1e-11)


def test_rays_in_the_plane_of_a_flat_bottom_and_along_a_wall():
    """Grazing rays: the sweep is closed, a ray in its face is inside. Nothing may hang."""
    sweep = Sweep(FLAT, (0, 0, 0), (40, 0, 0))
    found = sweep.ray_intervals([(-50, 0, 0), (-50, 0, 1e-9), (-50, 0, -1e-9)], (1, 0, 0))
    assert found.counts.tolist() == [1, 1, 0]
    assert found.leave - found.enter == pytest.approx([60, 60])
    for path in (PATHS["arc"], PATHS["helix"], PATHS["upright"]):
        curved = Sweep.along(BALL, path)
        curved.ray_intervals([(35, 0, 0), (35 - 1e-7, 0, 0), (25, 0, 0), (0, 0, 0)], (0, 0, 1))


def test_a_ray_up_the_axis_of_a_helix():
    """All poses are equally far there: the worst case of the search."""
    sweep = Sweep.along(BALL, Arc((3, 0, 0), (0, 0, 0), 2, angle=4, rise=-8))
    found = sweep.ray_intervals([(0, 0, 0)], (0, 0, 1))
    depth = 5 - sqrt(25 - 9)  # the ball's surface 3 mm from its axis, above its tip
    assert found.enter == pytest.approx([-8 + depth], abs=1e-9)
    assert found.leave == pytest.approx([50], abs=1e-9)


def test_holes_between_turns_are_seen():
    turns = Sweep.along(FLAT.profile.clip(0, 3), Arc((30, 0, 0), (0, 0, 0), 2, angle=6 * pi, rise=-30))
    found = turns.ray_intervals([(30, 0, 0)], (0, 0, 1))
    # seen from the path, the disc stays for the angle psi with 2 30 sin(psi / 2) = 10 and sinks with it
    sink = 30 / (6 * pi) * 2 * asin(10 / 60)
    assert found.enter == pytest.approx([-30, -20 - sink, -10 - sink, -sink], abs=1e-10)
    assert found.leave == pytest.approx([-27 + sink, -17 + sink, -7 + sink, 3], abs=1e-10)


def test_the_neck_of_a_stepped_tool_is_empty():
    sweep = Sweep(STEPPED, (0, 0, 0), (30, 0, 0))
    found = sweep.ray_intervals([(15, -20, 5), (15, -20, 15), (15, 6, -5)], [(0, 1, 0), (0, 1, 0), (0, 0, 1)])
    assert found.counts.tolist() == [1, 1, 2]
    assert found.enter == pytest.approx([17, 12, 15, 30], abs=1e-10)  # the cone is 6 wide at z = 25
    assert found.leave == pytest.approx([23, 28, 25, 35], abs=1e-10)


QUADRATURE = {
    "flat ramp": (FLAT, Line((0, 0, 0), (30, 0, -12))),
    "ball ramp": (BALL, Line((0, 0, 0), (10, 20, 25))),
    "bull steep": (BULL, Line((0, 0, 0), (5, 3, -40))),
    "stepped level": (STEPPED, Line((0, 0, 0), (20, 5, 0))),
    "bull plunge": (BULL, Line((0, 0, 0), (0, 0, -15))),
    "bull arc": (BULL, Arc((30, 0, 0), (0, 0, 0), 2, angle=2)),
    "stepped pivot": (STEPPED, Arc((4, 0, 0), (0, 0, 0), 2, angle=4)),
    "flat turn": (FLAT, Arc((12, 0, 0), (0, 0, 0), 2, angle=2 * pi)),
    "ball almost a turn": (BALL, Arc((12, 0, 0), (0, 0, 0), 2, angle=6)),
}


@pytest.mark.parametrize("case", QUADRATURE)
@pytest.mark.parametrize("axis", [0, 2])
def test_volume_by_rays(case, axis):
    """Midpoint rule, n x n rays: error below 3 (1 / n)^1.5 of the box, and the closed form is met."""
    tool, path = QUADRATURE[case]
    sweep = Sweep.along(tool, path)
    curved = isinstance(path, Arc) and axis == 0
    n = 40 if curved else 120
    assert sweep.volume is not None
    box = float(np.prod(np.diff(sweep.bounds, axis=0)))
    assert abs(lengths_volume(sweep, axis, n) - sweep.volume) < 3 * n**-1.5 * box


@pytest.mark.parametrize("tool", ["flat", "ball", "bull"])
def test_volume_of_a_ramp_by_gauss_lines(tool):
    """Upright Gauss lines, fitted to the rim of the plan view: the error falls, and ends below 2e-6."""
    sweep = Sweep(TOOLS[tool], (0, 0, 0), (30, 0, -12))
    r, errors = sweep.profile.max_radius, []
    for n in (24, 96):
        x, w = smooth_rule(n)
        across, along_weight = 2 * r * x - r, 2 * r * w
        half = np.sqrt(r * r - across**2)
        total = 0.0
        for y, h, weight in zip(across, half, along_weight, strict=True):
            cuts = sorted({-h, h, 30 - h, 30 + h, 0.0, 30.0})
            for a, b in pairwise(cuts):
                lines_x = a + (b - a) * x
                origins = np.stack([lines_x, np.full(n, y), np.zeros(n)], axis=1)
                total += weight * (b - a) * float(w @ sweep.ray_intervals(origins, (0, 0, 1)).lengths)
        assert sweep.volume is not None
        errors.append(abs(total / sweep.volume - 1))
    assert errors[1] < max(errors[0] / 4, 1e-9)
    assert errors[1] < 2e-6


@pytest.mark.parametrize("path", ["upright", "sideways"])
def test_volume_from_two_sides(path):
    """No closed form here: upright and level rays must find the same volume."""
    sweep = Sweep.along(BULL, PATHS[path])
    box = float(np.prod(np.diff(sweep.bounds, axis=0)))
    assert abs(lengths_volume(sweep, 2, 36) - lengths_volume(sweep, 0, 36)) < 3 * 36**-1.5 * box
    assert sweep.volume is None


def test_one_direction_serves_all_and_is_normalised():
    sweep = Sweep(FLAT, (0, 0, 0), (0, 0, 0))
    found = sweep.ray_intervals([(0, 0, -5), (3, 3, -7), (50, 0, 0)], (0, 0, 10))
    assert found.counts.tolist() == [1, 1, 0]
    assert found.enter == pytest.approx([5, 7], abs=1e-12)
    assert found.lengths == pytest.approx([50, 50, 0], abs=1e-12)
    assert sweep.ray_intervals(np.empty((0, 3)), (0, 0, 1)).counts.shape == (0,)


@pytest.mark.parametrize(
    ("origins", "directions", "word"),
    [
        ([(0, 0)], (0, 0, 1), "origins"),
        ([(0, 0, np.nan)], (0, 0, 1), "origins"),
        ([(0, 0, 0)], (0, 0, 0), "length zero"),
        ([(0, 0, 0)], (0, np.inf, 0), "directions"),
        ([(0, 0, 0)] * 3, [(0, 0, 1)] * 2, "3 rows"),
        ([(0, 0, 0)], [(0, 0)], "directions"),
    ],
)
def test_bad_rays(origins, directions, word):
    with pytest.raises(SweepError, match=word):
        Sweep(FLAT, (0, 0, 0), (1, 0, 0)).ray_intervals(origins, directions)
