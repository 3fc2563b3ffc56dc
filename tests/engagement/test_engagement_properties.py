"""Engagement against membership by sampled poses, and under motions that must not matter."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from vmachining.engagement import (
    BoxStock,
    CylinderStock,
    Engagement,
    Past,
    RayWorkpiece,
    contact,
    facing_parts,
    sweeps_near,
)
from vmachining.geometry import Arc, Line
from vmachining.sweep import Pose, Stance, Sweep, Turn
from vmachining.tool import BallNose, BullNose, Edge, FlatEnd, ProfileTool, Taper

POSES, SAMPLES, ANGLES = 300, 120, 8


def a_tool(rng):
    d = rng.uniform(3, 14)
    return (
        FlatEnd(diameter=d, length=30),
        BallNose(diameter=d, length=30),
        BullNose(diameter=d, corner_radius=d * rng.uniform(0.05, 0.45), length=30),
        Taper(diameter=d, taper_deg=rng.uniform(-2, 20), corner_radius=rng.choice([0, 0.3 * d]), length=20),
        ProfileTool(points=[(1, 0), (d / 2, 2), (d / 2, 6), (d / 2 + 1, 6), (d / 2 - 1, 15), (d / 2, 25)]),
    )[rng.integers(5)]


def a_motion(rng):
    def axis():
        a = np.append(rng.normal(0, 0.3, 2), 1.0)
        return a / np.linalg.norm(a)

    p = np.append(rng.uniform(-6, 6, 2), rng.uniform(-5, -0.5))
    q = p + np.append(rng.normal(0, 6, 2), rng.normal())
    kind = rng.integers(4)
    if kind == 0:
        return Line(p, q)
    if kind == 1:
        center = p + np.append(rng.normal(0, 5, 2), 0)
        return Arc(p, center, angle=rng.uniform(-6, 6), rise=rng.choice([0, rng.normal()]))
    if kind == 2:
        return Turn.great_circle(Pose(p, axis()), Pose(q, axis()))
    leaning = axis()
    return Turn.great_circle(Pose(p, leaning), Pose(q, leaning))


def depth(profile, path, times, points):
    """mm, at least how deep points lie in the tool at one of the poses; negative where in none. No kernel."""
    deepest = np.full(len(points), -np.inf)
    for t in times:
        axis = path.axis(t) if isinstance(path, Turn) else np.array([0.0, 0.0, 1.0])
        arm = points - path.position(t)
        h = arm @ axis
        rho = np.linalg.norm(arm - h[:, None] * axis, axis=1)
        height = np.clip(h, profile.z_min, profile.z_max)
        aside = profile.radius_at(height) - rho
        deepest = np.maximum(deepest, np.minimum(aside, np.minimum(h - profile.z_min, profile.z_max - h)))
    return deepest


@pytest.mark.parametrize("seed", range(10))
def test_poses_that_can_be_seen_agree(seed):
    """Every sample of the edge well inside an interval is in the stock, in front, and in no pose of the past;
    every sample well outside of all intervals is not."""
    rng = np.random.default_rng(seed)
    tool = a_tool(rng)
    edge = Edge(tool, helix_deg=rng.choice([0.0, 30.0]), bottom=bool(rng.integers(2)))
    past = [Past(k, Sweep.along(a_tool(rng), a_motion(rng))) for k in range(rng.integers(1, 4))]
    path, t = a_motion(rng), float(rng.uniform(0.1, 1.0))
    now = Stance.on(path, t)
    stock = BoxStock((-8, -8, -6), (8, 8, 0)) if seed % 2 else CylinderStock((0, 0), 8, (-6, 0))
    own = Sweep.along(tool, path.split([t])[0])
    phase = rng.uniform(0, 1)
    phi = 2 * pi * (np.arange(ANGLES) + phase) / ANGLES
    near = sweeps_near(edge, now, phi, facing_parts(edge, now, phi), past)
    found = contact(edge, now, RayWorkpiece(stock, near), [Past(9, own)], angles=ANGLES, phase=phase)

    s = np.linspace(edge.joints[0], edge.joints[-1], SAMPLES + 2)[1:-1]
    row, s = np.repeat(np.arange(ANGLES), SAMPLES), np.tile(s, ANGLES)
    piece = edge.piece_at(s)
    points = now.points(edge, phi[row], piece, s)
    speed = now.normal_speed(edge, phi[row], piece, s) / now.speed(edge)
    engaged, margin = np.zeros(len(s), dtype=bool), np.full(len(s), np.inf)
    for k, lower, upper in zip(found.parts.row, found.parts.lower, found.parts.upper, strict=True):
        if k < ANGLES:
            mine = row == k
            engaged |= mine & (s >= lower) & (s <= upper)
            away = np.minimum(abs(s - lower), abs(s - upper))
            margin = np.where(mine, np.minimum(margin, away), margin)
    times = np.linspace(0, 1, POSES)
    taken = np.max([depth(one.sweep.profile, one.sweep.path, times, points) for one in past], axis=0)
    covered = depth(tool.cutter, path, times[times < 0.98] * t, points)
    out = stock.signed_distance(points)
    never = (speed < -1e-6) | (out > 1e-6) | (taken > 1e-5) | (covered > 1e-4)
    assert not (engaged & never & (margin > 1e-3)).any()
    # between two poses a point can be up to 0.1 mm deep in a sweep that none of them shows; its own past is
    # met on the surface, so there only the distance itself can tell
    surely = (speed > 1e-4) & (out < -1e-4) & (taken < -0.1) & (own.signed_distance(points) > -1e-9)
    assert not (~engaged & surely & (margin > 1e-3)).any()


@pytest.mark.parametrize("turn", [0.4, 2.5])
def test_turning_the_whole_scene_turns_nothing_but_the_frame(turn):
    """About z: arcs from the feed, lengths, depths and rates stay; phi itself moves by the turn."""
    cos, sin = np.cos(turn), np.sin(turn)
    spin = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
    tool = BullNose(diameter=10, corner_radius=2, length=30)
    stock = CylinderStock((0, 0), 20, (-30, 0))

    def seen(matrix):
        passes = [((-30, 3, -2), (30, 5, -1)), ((-30, -9, -1), (30, -4, -3))]
        past = [Past(k, Sweep(tool, matrix @ a, matrix @ b)) for k, (a, b) in enumerate(passes)]
        now = Stance.on(Line(matrix @ (-5, -1, -3), matrix @ (9, 1, -2.8)), 0.5)
        edge = Edge(tool)
        return Engagement(edge, now, contact(edge, now, RayWorkpiece(stock, past), angles=180), "dexel")

    one, other = seen(np.eye(3)), seen(spin)
    assert one.summary["arcs_feed_deg"] == [
        pytest.approx(arc, abs=1e-6) for arc in other.summary["arcs_feed_deg"]
    ]
    assert (one.ap, one.ae) == pytest.approx((other.ap, other.ae), abs=1e-6)
    # trapezia of two grids of 2 degrees over lengths that start like roots
    assert one.removal_per_mm == pytest.approx(other.removal_per_mm, rel=4e-3)


def test_time_runs_one_way_but_a_straight_block_may_be_split():
    """The tool in the middle of a block, and at the end of its first half, touches the same."""
    tool = BallNose(diameter=10, length=30)
    whole = Line((-9, 0, -3), (9, 1, -3.5))
    first, second = whole.split([0.5])
    stock, edge = BoxStock((-50, -50, -20), (50, 50, 0)), Edge(tool)
    middle = contact(edge, Stance.on(whole, 0.5), RayWorkpiece(stock, []), angles=90)
    end = contact(edge, Stance.on(first, 1.0), RayWorkpiece(stock, []), angles=90)
    begin = contact(
        edge, Stance.on(second, 0.0), RayWorkpiece(stock, [Past(0, Sweep.along(tool, first))]), angles=90
    )
    for other in (end, begin):
        assert other.arcs == pytest.approx(middle.arcs, abs=1e-6)
        assert other.parts.upper[:40] == pytest.approx(middle.parts.upper[:40], abs=1e-6)
