"""Cubics of poses, the closed form of turning tools in contact: against exact distances, and against upright tools."""

from __future__ import annotations

import numpy as np
import pytest

from vmachining.engagement.along import Sweeps, contact_along
from vmachining.engagement.along.kernels.distance_kernels import POSES, gap
from vmachining.geometry import Line
from vmachining.jit import kernel
from vmachining.stock import BoxStock
from vmachining.sweep import Pose, Sweep, Turn
from vmachining.tool import BallNose, BullNose, Edge, FlatEnd, Taper

TOOLS = (
    BallNose(diameter=6, length=30),
    BullNose(diameter=8, corner_radius=1, length=30),
    FlatEnd(diameter=8, length=30),
    Taper(diameter=6, taper_deg=4, corner_radius=3, length=24),
    Taper(diameter=4, taper_deg=12, length=24),
)


@kernel
def gaps(num, kind, points, out) -> None:
    for i in range(len(points)):
        out[i] = np.inf
        for k in range(len(num)):
            out[i] = gap(num, kind[k], k, points[i, 0], points[i, 1], points[i, 2], out[i])


@pytest.mark.parametrize("tool", TOOLS, ids=lambda tool: f"{type(tool).__name__} {tool.diameter:g}")
@pytest.mark.parametrize("degrees", [0.0, 1.0, 12.0, 40.0])
def test_cubics_of_poses_have_the_sign_of_exact_distances(tool, degrees):
    """Which search over time with a proof: beyond the depth that counts as a touch, and at most 1e-4 mm farther than they say."""
    rng = np.random.default_rng(int(degrees))
    for _ in range(4):
        start = rng.normal(size=3) * 0.4 + [0.0, 0.0, 1.0]
        start /= np.linalg.norm(start)
        side = np.cross(start, rng.normal(size=3))
        angle = np.radians(degrees)
        end = np.cos(angle) * start + np.sin(angle) * side / np.linalg.norm(side)
        tip = rng.normal(size=3)
        path = Turn.great_circle(
            Pose(tip, start), Pose(tip + rng.normal(size=3) * rng.uniform(0.3, 3.0), end)
        )
        sweeps = Sweeps(BoxStock([-50, -50, -50], [50, 50, 50]))
        sweeps.add(tool.cutter, path)
        rows = sweeps.rows()
        n = len(rows.kind) - 1
        assert (rows.kind[:n] == POSES).all()
        low, high = rows.box[:n, :3].min(axis=0), rows.box[:n, 3:].max(axis=0)
        points = rng.uniform(low - 1.0, high + 1.0, (3000, 3))
        exact, found = Sweep.along(tool.cutter, path).signed_distance(points), np.empty(len(points))
        gaps(rows.num[:n], rows.kind[:n], points, found)
        clear = np.abs(exact) > 2e-6
        assert np.array_equal(exact[clear] < 0.0, found[clear] < 0.0) and clear.sum() > 2900
        outside = exact > 0.0
        assert (found[outside] <= exact[outside] + 1.1e-4).all()
        boxes = (points[:, None] >= rows.box[:n, :3]) & (points[:, None] <= rows.box[:n, 3:])
        assert boxes.all(axis=2).any(axis=1)[exact < 0.0].all()


@pytest.mark.parametrize("tool", TOOLS, ids=lambda tool: f"{type(tool).__name__} {tool.diameter:g}")
def test_no_point_of_a_cutter_moves_farther_than_its_row_says(tool):
    """By how far sweeps are left out: the rim of a top that is wider than the bottom moves farthest, as rotations say."""
    path = Turn.great_circle(Pose([1, 2, 3], [0, 0, 1]), Pose([1, 2, 3], [np.sin(0.3), 0, np.cos(0.3)]))
    sweeps = Sweeps(BoxStock([-50, -50, -50], [50, 50, 50]))
    sweeps.add(tool.cutter, path)
    way = sweeps.rows().num[:-1, 34]
    rim = np.hypot(tool.cutter.max_radius, tool.cutter.z_max)
    chord = 2.0 * rim * np.sin(0.25 * 0.3 / len(way))  # half the turn of a row
    assert (chord <= way).all() and (way <= 1.001 * chord).all()


@pytest.mark.parametrize("tool", TOOLS[:3], ids=lambda tool: type(tool).__name__)
@pytest.mark.parametrize("rise", [0.0, -3.0])
def test_a_tool_that_lies_cuts_what_it_cuts_upright(tool, rise):
    """The scene turned by 90 degrees about x: poses against the closed forms of upright tools."""
    lines = [Line([-10, y, -2], [90, y, -2]) for y in (20.0, 22.5, 25.0)] + [
        Line([5, 27, -2.5], [75, 27.5, -2.5 + rise])
    ]
    upright, lying = Sweeps(BoxStock([0, 0, -20], [80, 40, 0])), Sweeps(BoxStock([0, 0, 0], [80, 20, 40]))
    for line in lines:
        upright.add(tool.cutter, line)
        # (x, y, z) -> (x, -z, y): z becomes -y
        (x0, y0, z0), (x1, y1, z1) = line.start, line.end
        lying.add(
            tool.cutter, Turn.great_circle(Pose([x0, -z0, y0], [0, -1, 0]), Pose([x1, -z1, y1], [0, -1, 0]))
        )
    edge, at = Edge(tool, bottom=True), np.array([0.25, 0.6, 0.9])
    assert (lying.rows().kind[: len(lines)] == POSES).all()
    one, other = (contact_along(s, [(len(lines) - 1, at)], [edge]).columns for s in (upright, lying))
    assert one[:, 0].min() > 0.1
    # ends of arcs are interpolated from other margins, and planned fractions between other angles
    np.testing.assert_allclose(other[:, :2], one[:, :2], rtol=2e-3)
    np.testing.assert_allclose(other[:, 2:4], one[:, 2:4], atol=5e-3)
    np.testing.assert_allclose(other[:, 4:], one[:, 4:], atol=2e-3)


@pytest.mark.parametrize("thick", [2.0, 0.5])
def test_a_rib_on_the_wall_of_a_leaning_tool_is_cut(thick):
    """30 mm up a wall of 40: over the front half it covers thick / cos of the axis, and r tan beside that."""
    lean, r = 0.1, 5.0
    tool, wide = FlatEnd(diameter=2 * r, length=60), FlatEnd(diameter=200, length=200)
    sweeps = Sweeps(BoxStock([-20, -20, -40], [20, 20, 0]))
    for z, up in ((-30.5 + thick, 1.0), (-30.5, -1.0)):
        sweeps.add(
            wide.cutter, Turn.great_circle(Pose([-30, 0, z], [0, 0, up]), Pose([30, 0, z], [0, 0, up]))
        )
    axis = np.array([np.sin(lean), 0.0, np.cos(lean)])
    sweeps.add(tool.cutter, Turn.great_circle(Pose([-5, 0, -39], axis), Pose([5, 0, -39], axis)))
    told = contact_along(sweeps, [(2, np.array([0.5]))], [Edge(tool, bottom=True)]).columns[0]
    assert told[3] == pytest.approx(thick / np.cos(lean) + r * np.tan(lean), rel=1e-3)
    assert told[4] == pytest.approx(0.5, abs=2e-3)
