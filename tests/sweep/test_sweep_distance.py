"""Signed distance and membership against truths that know nothing of the kernels."""

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from strategies import coordinates, paths, tools
from sweep_inventions import PATHS, TOOLS, around, holds, sphere

from vmachining.geometry import Arc, Line
from vmachining.sweep import Sweep
from vmachining.tool import Cutter, Profile

ROUNDING = 1e-11
"""mm: some hundred ulp of coordinates of 100 mm."""


SLIDING = 1e-7
"""mm: promised where a surface of a curved motion slides nearly along itself, see the room of turned sweeps."""


def promised(path) -> float:
    return ROUNDING if isinstance(path, Line) else SLIDING


def distance_to_segment(points, a, b):
    d = b - a
    t = np.clip((points - a) @ d / max(d @ d, 1e-300), 0, 1)
    return np.linalg.norm(points - a - t[:, None] * d, axis=1)


def distance_to_arc(points, arc: Arc):
    """Circle without rise, angle below a turn: in-plane nearest point or the nearer end."""
    q = np.delete(points - arc.center, arc.axis, axis=1)
    if arc.axis == 1:
        q = q[:, ::-1]  # (x, z) -> (z, x), the plane axes about y
    height = points[:, arc.axis] - arc.center[arc.axis]
    ahead = (np.sign(arc.angle) * (np.arctan2(q[:, 1], q[:, 0]) - arc.start_angle)) % (2 * pi)
    on = np.hypot(np.hypot(q[:, 0], q[:, 1]) - arc.radius, height)
    ends = [np.linalg.norm(points - end, axis=1) for end in (arc.start, arc.end)]
    return np.where(ahead <= abs(arc.angle), on, np.minimum(*ends))


@settings(deadline=None, max_examples=50)
@given(a=coordinates(), b=coordinates())
def test_a_swept_ball_is_a_capsule(a, b):
    r = 4.0
    sweep = Sweep(sphere(r), a, b)
    points = around(sweep, 40)
    up = np.array([0, 0, r])
    truth = distance_to_segment(points, np.array(a) + up, np.array(b) + up) - r
    assert sweep.signed_distance(points) == pytest.approx(truth, abs=ROUNDING)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("angle", [0.3, -2.0, 5.9])
@pytest.mark.parametrize("r", [4.0, 15.0])
def test_a_ball_on_a_circle_is_a_piece_of_a_torus(axis, angle, r):
    """The circle has radius 10: for r = 15 the tube covers its own centre."""
    start = np.roll([10.0, 0, 0], axis + 1)
    arc = Arc(start, (0, 0, 0), axis, angle=angle)
    sweep = Sweep.along(sphere(r).shifted(-r), arc)
    points = around(sweep, 300)
    assert sweep.signed_distance(points) == pytest.approx(distance_to_arc(points, arc) - r, abs=ROUNDING)


@pytest.mark.parametrize("tool", TOOLS)
@pytest.mark.parametrize("path", PATHS)
def test_membership_agrees_with_many_poses(tool, path):
    """A pose that contains a point proves it inside; a point deeper than half a step is in some pose."""
    sweep = Sweep.along(TOOLS[tool], PATHS[path])
    points = around(sweep, 150)
    poses = 801
    d = sweep.signed_distance(points)
    seen = holds(sweep.profile, points[:, None] - sweep.path.position(np.linspace(0, 1, poses))).any(axis=1)
    assert (d[seen] <= 1e-9).all()
    step = sweep.path.length / (poses - 1)
    assert seen[d < -step / 2 - 1e-9].all()


@pytest.mark.parametrize("tool", TOOLS)
def test_a_tool_at_rest_is_its_meridian(tool):
    """Outside, the distance to a densely sampled surface is an upper bound that converges linearly."""
    profile = TOOLS[tool].profile
    sweep = Sweep(profile, (0, 0, 0), (0, 0, 0))
    surface = []
    for s in profile.segments:
        t = np.linspace(0, 1, 4001)
        if s.is_arc:
            low, high = s.beta
            beta = low + (high - low) * t
            surface.append(np.stack([s.cr + s.radius * np.cos(beta), s.cz + s.radius * np.sin(beta)], axis=1))
        else:
            surface.append(np.stack([s.r0 + (s.r1 - s.r0) * t, s.z0 + (s.z1 - s.z0) * t], axis=1))
    for r, z in profile.points[[0, -1]]:
        surface.append(np.stack([np.linspace(0, r, 4001), np.full(4001, z)], axis=1))
    border = np.concatenate(surface)
    points = around(sweep, 100)
    flat = np.stack([np.hypot(points[:, 0], points[:, 1]), points[:, 2]], axis=1)
    gap = np.linalg.norm(flat[:, None] - border, axis=2).min(axis=1)
    d = sweep.signed_distance(points)
    inside = holds(profile, points)
    assert ((d <= 0) == inside).all()
    assert d[~inside] == pytest.approx(gap[~inside], abs=0.01)
    assert (-d[inside] <= gap[inside] + ROUNDING).all()
    if profile.is_convex:
        assert -d[inside] == pytest.approx(gap[inside], abs=0.01)


@settings(deadline=None, max_examples=60)
@given(profile=tools(), path=paths())
def test_distance_is_one_lipschitz_and_zero_on_crossings(profile: Profile, path):
    sweep = Sweep.along(profile, path)
    a, b = around(sweep, 12, 1), around(sweep, 12, 2)
    change = np.abs(sweep.signed_distance(a) - sweep.signed_distance(b))
    assert (change <= np.linalg.norm(a - b, axis=1) + 2 * promised(path)).all()


@settings(deadline=None, max_examples=40)
@given(profile=tools(), path=paths(), shift=coordinates(200))
def test_moving_everything_changes_nothing(profile: Profile, path, shift):
    move = np.array(shift)
    if isinstance(path, Line):
        moved = Line(path.start + move, path.end + move)
    else:
        moved = Arc(path.start + move, path.center + move, path.axis, angle=path.angle, rise=path.rise)
    here, there = Sweep.along(profile, path), Sweep.along(profile, moved)
    points = around(here, 10)
    assert there.signed_distance(points + move) == pytest.approx(
        here.signed_distance(points), abs=promised(path)
    )


@settings(deadline=None, max_examples=40)
@given(profile=tools(), path=paths())
def test_the_mirrored_motion_sweeps_the_mirror_image(profile: Profile, path):
    mirror = np.array([-1.0, 1.0, 1.0])  # x -> -x: turning about x keeps its sense, about y and z reverses
    if isinstance(path, Line):
        image = Line(path.start * mirror, path.end * mirror)
    elif path.axis == 0:
        image = Arc(path.start * mirror, path.center * mirror, 0, angle=path.angle, rise=-path.rise)
    else:
        image = Arc(path.start * mirror, path.center * mirror, path.axis, angle=-path.angle, rise=path.rise)
    here, there = Sweep.along(profile, path), Sweep.along(profile, image)
    points = around(here, 10)
    assert there.signed_distance(points * mirror) == pytest.approx(
        here.signed_distance(points), abs=promised(path)
    )


@settings(deadline=None, max_examples=40)
@given(profile=tools(), path=paths())
def test_going_back_sweeps_the_same(profile: Profile, path):
    if isinstance(path, Line):
        back = Line(path.end, path.start)
    else:
        back = Arc(path.end, path.center, path.axis, angle=-path.angle, rise=-path.rise)
    here, there = Sweep.along(profile, path), Sweep.along(profile, back)
    points = around(here, 10)
    assert there.signed_distance(points) == pytest.approx(here.signed_distance(points), abs=promised(path))


@settings(deadline=None, max_examples=30)
@given(profile=tools(), path=paths())
def test_a_split_motion_is_the_union_of_its_parts(profile: Profile, path):
    whole = Sweep.along(profile, path)
    points = around(whole, 10)
    parts = [part.signed_distance(points) for part in whole.split([0.2, 0.2, 0.55])]
    assert np.min(parts, axis=0) == pytest.approx(whole.signed_distance(points), abs=promised(path))


@pytest.mark.parametrize("tool", TOOLS)
@pytest.mark.parametrize("path", PATHS)
def test_the_box_is_tight(tool, path):
    """Every face of the box is touched: some point on it is in the sweep, none just outside it."""
    cutter: Cutter = TOOLS[tool]
    sweep = Sweep.along(cutter, PATHS[path])
    t = np.linspace(0, 1, 20001)
    tip = sweep.path.position(t)
    r = cutter.profile.max_radius
    low = np.array([*(tip.min(axis=0)[:2] - r), tip[:, 2].min()])
    high = np.array([*(tip.max(axis=0)[:2] + r), tip[:, 2].max() + cutter.length])
    assert sweep.bounds == pytest.approx(np.stack([low, high]), abs=1e-5)  # sagitta of the samples
    assert (sweep.bounds[0] <= low + 1e-12).all()
    assert (sweep.bounds[1] >= high - 1e-12).all()
