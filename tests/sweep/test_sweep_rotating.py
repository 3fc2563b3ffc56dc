"""Rays and distances where the tool axis turns, against poses, against each other, and against ball sweeps."""

from __future__ import annotations

from math import pi, radians
from time import process_time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from slowness import slowness
from strategies import coordinates, tools, turns
from sweep_inventions import BALL, FLAT, TOOLS, around, lines, sphere
from test_sweep_turning import TURNS, UP, tilted

from vmachining.errors import SweepError
from vmachining.geometry import Arc, Line
from vmachining.sweep import Pose, Sweep, Turn
from vmachining.tool import BullNose, FlatEnd, Profile

ON_SURFACE = 1e-10
"""mm: 1e-11 is proven in depth, and rounding of coordinates of 100 mm; surfaces that slide along themselves for
more than 1000 stretches of time are not among the cases."""

SHORT = Turn.great_circle(Pose((0, 0, 0), tilted(20, 30)), Pose((1, 0, 0), tilted(21, 35)))
MOTIONS = TURNS | {"short": SHORT}


def in_some_pose(profile: Profile, turn: Turn, points: np.ndarray, poses: int) -> np.ndarray:
    """Whether one of many poses holds a point: enough to be inside."""
    seen = np.zeros(len(points), dtype=bool)
    for t in np.linspace(0, 1, poses):
        w = points - turn.position(t)
        z = w @ turn.axis(t)
        rho = np.sqrt(np.maximum((w * w).sum(1) - z * z, 0))
        seen |= (z >= profile.z_min) & (z <= profile.z_max) & (rho <= profile.radius_at(z))
    return seen


@pytest.mark.parametrize("tool", TOOLS)
@pytest.mark.parametrize("name", MOTIONS)
def test_membership_agrees_with_many_poses(tool, name):
    """A pose that holds a point proves it inside; a point deeper than half a step is in some pose."""
    profile, turn, poses = TOOLS[tool].profile, MOTIONS[name], 501
    sweep = Sweep.along(profile, turn)
    points = around(sweep, 400)
    d = sweep.signed_distance(points)
    seen = in_some_pose(profile, turn, points, poses)
    assert (d[seen] <= 1e-9).all()
    rate = np.linalg.norm(turn.velocity(np.linspace(0, 1, 50)), axis=1).max() + 75 * turn.axis_series.bound(1)
    assert seen[d < -rate / (poses - 1)].all()
    assert (sweep.contains(points) == (d <= 0)).all()
    assert (sweep.contains(points, slack=2.0) == (d <= 2.0)).all()


@pytest.mark.parametrize("tool", TOOLS)
@pytest.mark.parametrize("name", MOTIONS)
def test_rays_agree_with_the_distance(tool, name):
    sweep = Sweep.along(TOOLS[tool], MOTIONS[name])
    for origins, directions in (lines(sweep, 60), (around(sweep, 20, 9), np.tile(UP, (20, 1)))):
        check(sweep, origins, directions)


def check(sweep: Sweep, origins: np.ndarray, directions: np.ndarray) -> None:
    found = sweep.ray_intervals(origins, directions)
    ray = np.repeat(np.arange(len(origins)), found.counts)
    for s in (found.enter, found.leave):
        d = sweep.signed_distance(origins[ray] + s[:, None] * directions[ray])
        assert np.abs(d).max(initial=0) < ON_SURFACE
    same = ray[1:] == ray[:-1]
    assert (found.leave[:-1][same] < found.enter[1:][same]).all()
    s = np.random.default_rng(5).uniform(-120, 120, (len(origins), 12))
    points = (origins[:, None] + s[..., None] * directions[:, None]).reshape(-1, 3)
    d = sweep.signed_distance(points).reshape(s.shape)
    inside = np.zeros(s.shape, dtype=bool)
    for i, a, b in zip(ray, found.enter, found.leave, strict=True):
        inside[i] |= (s[i] >= a) & (s[i] <= b)
    assert (inside == (d < 0))[np.abs(d) > ON_SURFACE].all()


@settings(deadline=None, max_examples=60)
@given(profile=tools(), turn=turns())
def test_rays_agree_with_the_distance_anywhere(profile: Profile, turn: Turn):
    sweep = Sweep.along(profile, turn)
    check(sweep, *lines(sweep, 5))


@settings(deadline=None, max_examples=40)
@given(profile=tools(), turn=turns())
def test_distance_is_one_lipschitz(profile: Profile, turn: Turn):
    sweep = Sweep.along(profile, turn)
    a, b = around(sweep, 12, 1), around(sweep, 12, 2)
    change = np.abs(sweep.signed_distance(a) - sweep.signed_distance(b))
    assert (change <= np.linalg.norm(a - b, axis=1) + 1e-9).all()


@pytest.mark.parametrize("seed", range(9))
def test_lines_that_leave_a_flat_cutter_over_its_rim(seed):
    """Against 10,001 poses in closed form: each lies in what is found, which is hardly longer than all of them.

    Lines close to the rim: chords that close at a corner, ends that turn back at an edge.
    """
    rng = np.random.default_rng(seed)
    lean, spin = rng.uniform(1.0, 40.0), rng.uniform(0.0, 360.0)
    start = Pose((0, 0, 0), tilted(lean, spin))
    end = Pose(rng.normal(size=3) * [0.6, 0.6, 0.2], tilted(lean + rng.uniform(0.1, 2.0), spin + 1.0))
    turn, r, top, u = (
        Turn.great_circle(start, end),
        FLAT.diameter / 2.0,
        FLAT.profile.z_max,
        np.eye(3)[seed % 3],
    )
    t, angle = np.linspace(0.0, 1.0, 10_001), rng.uniform(0.0, 2.0 * pi, (60, 1))
    tips, axes, across = turn.position(t), turn.axis(t), np.linalg.svd(turn.axis(0.5)[None])[2][1:]
    rim = (r + 0.3 * rng.normal(size=(60, 1))) * (np.cos(angle) * across[0] + np.sin(angle) * across[1])
    origins = turn.position(0.5) + rim
    found = Sweep.along(FLAT, turn).ray_intervals(origins, u)
    last = np.cumsum(found.counts)
    for o, b, n in zip(origins, last, found.counts, strict=True):
        w = o - tips
        z, up = (w * axes).sum(axis=1), axes @ u
        x, v = w - z[:, None] * axes, u - up[:, None] * axes
        a, half, rest = (v * v).sum(axis=1), (x * v).sum(axis=1), (x * x).sum(axis=1) - r * r
        root = np.sqrt(np.where(half**2 > a * rest, half**2 - a * rest, np.nan))
        discs = np.sort([-z / up, (top - z) / up], axis=0)
        low, high = np.maximum((-half - root) / a, discs[0]), np.minimum((-half + root) / a, discs[1])
        low, high = low[low < high], high[low < high]
        enter, leave = found.enter[b - n : b], found.leave[b - n : b]
        of = np.searchsorted(enter, low + ON_SURFACE) - 1
        assert (of >= 0).all() and (high <= leave[of] + ON_SURFACE).all()
        order = np.argsort(low)
        before = np.maximum.accumulate(high[order])[:-1]
        held = (high.max() - low.min() - np.maximum(low[order][1:] - before, 0.0).sum()) if len(low) else 0.0
        assert (leave - enter).sum() - held < 0.02


def test_a_part_of_a_ray_is_that_part_of_the_whole_ray():
    """Also of no length, or where the sweep is not."""
    rng = np.random.default_rng(2)
    sweep = Sweep.along(TOOLS["bull"], SHORT)
    for way in np.eye(3):
        origins = rng.uniform(-8.0, 8.0, (300, 3)) * (1.0 - way)
        between = np.sort(rng.uniform(-12.0, 25.0, (300, 2)), axis=1)
        between[:20, 1] = between[:20, 0]
        whole, part = sweep.ray_intervals(origins, way), sweep.ray_intervals(origins, way, between=between)
        long, short = np.zeros((2, 300))
        ray = np.repeat(np.arange(300), whole.counts)
        seen = np.minimum(whole.leave, between[ray, 1]) - np.maximum(whole.enter, between[ray, 0])
        np.add.at(long, ray, np.maximum(seen, 0.0))
        np.add.at(short, np.repeat(np.arange(300), part.counts), part.leave - part.enter)
        assert (long > 0.0).sum() > 50
        np.testing.assert_allclose(short, long, atol=ON_SURFACE)
    with pytest.raises(SweepError, match="between: expected 300 rows"):
        sweep.ray_intervals(origins, way, between=between[:, ::-1])


@pytest.mark.parametrize("tool", TOOLS)
def test_a_ray_is_answered_alike_alone_and_after_any_other(tool):
    """A ray beside one that passes by is asked first whether it passes by, too: that may only save time."""
    sweep = Sweep.along(TOOLS[tool].profile, SHORT)
    lo, hi = sweep.bounds
    x, y = np.meshgrid(*(np.linspace(lo[k] - 1.0, hi[k] + 1.0, 12) for k in (0, 1)), indexing="ij")
    origins = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    between = np.tile([lo[2] - 1.0, 0.8 * lo[2] + 0.2 * hi[2]], (x.size, 1))
    for part in (None, between):
        rows = sweep.ray_intervals(origins, UP, between=part)
        assert 0 < np.count_nonzero(rows.counts) < x.size
        order = np.random.default_rng(1).permutation(x.size)
        mixed = sweep.ray_intervals(origins[order], UP, between=None if part is None else part[order])
        first = np.cumsum(mixed.counts) - mixed.counts
        for k, ray in enumerate(order.tolist()):
            alone = sweep.ray_intervals(
                origins[ray : ray + 1], UP, between=None if part is None else part[ray : ray + 1]
            )
            n = int(alone.counts[0])
            assert n == mixed.counts[k] == rows.counts[ray]
            begin = int(rows.counts[:ray].sum())
            for ends, mine in ((mixed, first[k]), (rows, begin)):
                assert (ends.enter[mine : mine + n] == alone.enter).all()
                assert (ends.leave[mine : mine + n] == alone.leave).all()


@settings(deadline=None, max_examples=30)
@given(profile=tools(), turn=turns())
def test_a_split_motion_is_the_union_of_its_parts(profile: Profile, turn: Turn):
    whole = Sweep.along(profile, turn)
    points = around(whole, 10)
    parts = [part.signed_distance(points) for part in whole.split([0.2, 0.55])]
    assert np.min(parts, axis=0) == pytest.approx(whole.signed_distance(points), abs=1e-9)


@settings(deadline=None, max_examples=30)
@given(a=coordinates(), b=coordinates(), angles=st.tuples(*[st.floats(-1.5, 1.5)] * 4))
def test_a_ball_held_at_its_centre_sweeps_a_capsule_whatever_the_axis_does(a, b, angles):
    r = 4.0
    turn = Turn.through(a, b, "ac", angles[:2], angles[2:], control_height=r)
    capsule = Sweep(sphere(r).shifted(-r), a, b)
    sweep = Sweep.along(sphere(r), turn)
    points = around(capsule, 30)
    assert sweep.signed_distance(points) == pytest.approx(capsule.signed_distance(points), abs=1e-9)
    origins, directions = lines(capsule, 5)
    ours, truth = sweep.ray_intervals(origins, directions), capsule.ray_intervals(origins, directions)
    assert ours.lengths == pytest.approx(truth.lengths, abs=1e-5)  # sqrt of the depth at a graze


def test_a_rigid_motion_of_everything_changes_nothing():
    rng = np.random.default_rng(3)
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.linalg.det(q))
    shift = np.array([30.0, -20, 11])
    a, b = tilted(10, 0), tilted(35, 80)
    here = Sweep(FLAT, Pose((0, 0, 0), a), Pose((20, 10, 5), b))
    there = Sweep(FLAT, Pose(shift, q @ a), Pose(q @ [20, 10, 5] + shift, q @ b))
    points = around(here, 200)
    moved = points @ q.T + shift
    assert there.signed_distance(moved) == pytest.approx(here.signed_distance(points), abs=1e-10)
    origins, directions = lines(here, 50)
    far = there.ray_intervals(origins @ q.T + shift, directions @ q.T)
    assert far.enter == pytest.approx(here.ray_intervals(origins, directions).enter, abs=1e-8)


@pytest.mark.parametrize("name", ["lean", "ac", "ab"])
def test_going_back_sweeps_the_same(name):
    turn = TURNS[name]
    back = {
        "lean": Turn.great_circle(Pose(turn.end, tilted(15, 0)), Pose(turn.start, UP)),
        "ac": Turn.rotary(turn.end, turn.start, "ac", {"a": 1.0, "c": 4 * pi / 3}, {"a": 0.4, "c": pi}),
        "ab": Turn.rotary(turn.end, turn.start, "ab", (1.7, 0.5), (0.1, -1.0)),
    }[name]
    here, there = Sweep.along(BALL, turn), Sweep.along(BALL, back)
    points = around(here, 200)
    assert there.signed_distance(points) == pytest.approx(here.signed_distance(points), abs=1e-9)


def test_a_vanishing_turn_is_the_straight_motion():
    tiny = Sweep.along(FLAT, Turn.rotary((0, 0, 0), (30, 5, -2), "ac", (0, 0), (1e-9, 0)))
    plain = Sweep.along(FLAT, Line((0, 0, 0), (30, 5, -2)))
    points = around(plain, 300)
    assert tiny.signed_distance(points) == pytest.approx(plain.signed_distance(points), abs=1e-7)  # 1e-9 * 50


def test_faces_that_slide_in_their_plane_and_axes_that_only_spin():
    """f = 0 on whole faces: nothing to prove, nothing may hang."""
    spin = Sweep.along(FLAT, Turn.rotary((0, 0, 0), (0, 0, 0), "ac", (radians(30), 0), (radians(30), 0)))
    assert spin.ray_intervals([(0, 0, -9)], UP).counts.tolist() == [1]
    pivot = Sweep.along(FLAT, Turn.through((0, 0, 0), (0, 0, 0), "ac", (0, 0), (0.5, 0), control_height=25))
    found = pivot.ray_intervals([(0, 0, 25), (11, 0, 25)], [(1, 0, 0), (0, 1, 0)])
    assert found.enter == pytest.approx([-10])
    assert found.leave == pytest.approx([10])


@pytest.mark.parametrize(
    "tool", [FlatEnd(diameter=12, length=40), BullNose(diameter=12, corner_radius=2, length=40)]
)
def test_points_on_the_axis_of_a_helix_as_wide_as_the_tool_are_quick(tool):
    """Every pose is as near as any other there: 2,000 points took 10 s. rho = a all along, g(a, z - z_tip) is closed."""
    pitch, turns = 1.0, 3
    sweep = Sweep.along(tool.cutter, Arc([6, 0, 0], [0, 0, 0], angle=2 * np.pi * turns, rise=-pitch * turns))
    z = np.linspace(-5.0, 39.0, 2000)
    r = tool.corner_radius if isinstance(tool, BullNose) else 0.0
    w = z[:, None] + np.linspace(0.0, pitch * turns, 301)  # height above the tip, which is lowest at the end
    u, v = r, np.maximum(r - w, 0.0)  # rho - rc = r
    wall = np.where(w <= r, np.hypot(u, v) - r, np.maximum(0.0, w - 40.0))
    sweep.signed_distance([[1.0, 0.0, 0.0]])  # compiles
    begin = process_time()
    found = sweep.signed_distance(np.column_stack([0 * z, 0 * z, z]))
    assert process_time() - begin < 1.0 * slowness()
    np.testing.assert_allclose(found, wall.min(axis=1), atol=2e-5)  # heights 0.01 mm apart
