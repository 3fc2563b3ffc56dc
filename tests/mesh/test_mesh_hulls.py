"""Hulls of poses against exact distances to the sweep: what is proven to lie inside does, what is proven to hold it does."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.sweep5 import winding
from benchmarks.turned_blocks import HI, KINDS, LO, TOOLS, case_of
from vmachining.engines.mesh.facets import Side
from vmachining.engines.mesh.turning.hulls import turning_hulls
from vmachining.sweep import Pose, Sweep, Turn
from vmachining.tool import ProfileTool

BOX = np.array([LO, HI])
DRILL = ProfileTool(points=[(0.0, 0.0), (3.0, 1.5), (3.0, 30.0)]).profile
CHORD = 0.05

pytestmark = pytest.mark.filterwarnings("ignore::vmachining.errors.AccuracyWarning")  # axes by hand


def surface(sweep: Sweep, rng: np.random.Generator, count: int) -> np.ndarray:
    """Points on the cutter's surface in random poses, more of them soon after the first, and in the box."""
    profile, path = sweep.profile, sweep.path
    assert isinstance(path, Turn)
    t = rng.random(count) ** 3
    rows = []
    for s in profile.segments:
        share = rng.random(count)
        if s.is_arc:
            beta = s.beta[0] + share * (s.beta[1] - s.beta[0])
            rows.append((s.cr + s.radius * np.cos(beta), s.cz + s.radius * np.sin(beta)))
        else:
            share *= min(
                1.0, 8.0 / max(s.z1 - s.z0, 1e-9)
            )  # near the bottom: the rest never comes into the box
            rows.append((s.r0 + share * (s.r1 - s.r0), s.z0 + share * (s.z1 - s.z0)))
    rows.append((rng.random(count) * profile.points[0, 0], np.full(count, profile.z_min)))
    r, z = np.array(rows)[rng.integers(len(rows), size=count), :, np.arange(count)].T
    axis = path.axis(t)
    x = np.cross(axis, [0.3, -0.8, 0.5])
    x /= np.linalg.norm(x, axis=1)[:, None]
    y = np.cross(axis, x)
    u = rng.uniform(0.0, 2.0 * np.pi, count)[:, None]
    found = path.position(t) + z[:, None] * axis + r[:, None] * (np.cos(u) * x + np.sin(u) * y)
    return found[((found > BOX[0]) & (found < BOX[1])).all(axis=1)]


def held(points: np.ndarray, meshes: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    if not meshes:
        return np.zeros(len(points), dtype=bool)
    return np.any([np.abs(winding(points, mesh)) > 0.5 for mesh in meshes], axis=0)


def wrong(sweep: Sweep, seed: int) -> str | None:
    rng, path = np.random.default_rng(seed), sweep.path
    assert isinstance(path, Turn)
    inner = turning_hulls(sweep, CHORD, Side.INNER, BOX, chained=False)
    outer = turning_hulls(sweep, CHORD, Side.OUTER, BOX, chained=False)
    after = turning_hulls(sweep, CHORD, Side.OUTER, BOX, chained=True)
    if inner is None or outer is None or after is None:
        return f"{seed}: not proven"
    for points, triangles in inner:  # hulls are convex: farthest out in the middle of facets and edges
        corners = points[triangles]
        middles = np.concatenate([corners.mean(axis=1), 0.5 * (corners[:, 0] + corners[:, 1])])
        middles = rng.permutation(middles[((middles > BOX[0]) & (middles < BOX[1])).all(axis=1)])[:400]
        if len(middles) and sweep.signed_distance(middles).max() > 1e-8:
            return f"{seed}: beyond the sweep by {sweep.signed_distance(middles).max()}"
    on = surface(sweep, rng, 160)
    near = on + 0.3 * CHORD * rng.normal(size=on.shape)
    far = sweep.signed_distance(near)
    swept = np.concatenate([on, near[far < -1e-8]])
    if not held(swept, outer).all():
        return f"{seed}: not around"
    first = Sweep.along(sweep.profile, path.part(0.0, 0.0))
    new = swept[first.signed_distance(swept) > 1e-8]
    if not held(new, after).all():
        return f"{seed}: not around what the first pose leaves"
    return None


@pytest.mark.parametrize("tool", TOOLS)
def test_hulls_lie_inside_and_around_sweeps(tool: str) -> None:
    place = list(TOOLS).index(tool)
    seeds = [len(KINDS) * (len(TOOLS) * kind + place) + kind for kind in range(len(KINDS))]
    found = [wrong(case_of(seed).block, seed) for seed in seeds]
    assert [each for each in found if each] == []


@pytest.mark.long
def test_hulls_of_six_hundred_sweeps() -> None:
    """Ten minutes."""
    found = [wrong(case_of(seed).block, seed) for seed in range(600)]
    assert [each for each in found if each] == []


def test_drills_and_other_paths_have_hulls() -> None:
    """A conical bottom, rotary angles with a control point above the tip, and a path whose tip bends."""
    ball = TOOLS["ball"]
    sweeps = [
        Sweep.along(DRILL, Turn.great_circle(Pose((0, 0, -2), (0, 0, 1)), Pose((1, 0.5, -2.2), (0.02, 0.01, 1)))),
        Sweep.along(ball, Turn.rotary([-2, 0, -1.5], [0, 1, -1.7], "ac", {"a": 0.1, "c": 0.3}, {"a": 0.12, "c": 0.4})),
        Sweep.along(
            ball,
            Turn.through([-2, 0, 28.5], [0, 1, 28.3], "bc", {"b": 0.1, "c": 0.3}, {"b": 0.12, "c": 0.35}, control_height=30.0),
        ),
    ]  # fmt: skip
    found = [wrong(sweep, seed) for seed, sweep in enumerate(sweeps)]
    assert [each for each in found if each] == []


def test_after_a_block_most_of_the_first_pose_is_left_out() -> None:
    """Of a ball that goes on by a millimetre the rear half takes nothing more."""
    path = Turn.great_circle(Pose((0, 0, -2), (0, 0, 1)), Pose((1, 0, -2), (0.01, 0, 1)))
    sweep = Sweep.along(TOOLS["ball"], path)
    whole, rest = (turning_hulls(sweep, CHORD, Side.OUTER, BOX, chained=chained) for chained in (False, True))
    assert whole is not None and rest is not None
    behind = np.array([[-2.99 * np.cos(u), 0.0, 1.0 - 2.99 * np.sin(u)] for u in np.linspace(0.45, 1.2, 20)])
    behind = behind[behind[:, 2] < 0.0]
    assert held(behind, whole).all() and not held(behind, rest).any()


def test_wide_turns_are_too_many_hulls() -> None:
    path = Turn.great_circle(Pose((0, 0, -2), (0, 0, 1)), Pose((2, 0, -2), (0.8, 0, 0.6)))
    assert turning_hulls(Sweep.along(TOOLS["flat"], path), 0.01, Side.OUTER, BOX, chained=False) is None
