"""Motions that break sweeps: degenerate, turning back into themselves, singular. Volumes by two ways."""

from __future__ import annotations

from math import pi, radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import coordinates
from test_sweep_turning import TURNS, UP, tilted

from vmachining.geometry import Arc
from vmachining.sweep import Pose, Sweep, Turn, breaks
from vmachining.sweep.flux import _kernels as flux_kernels
from vmachining.sweep.rotating._kernels import PATIENCE
from vmachining.tool import BallNose, BullNose, Cutter, FlatEnd, Profile, Taper

F20 = FlatEnd(diameter=20, length=50)
B10 = BallNose(diameter=10, length=50)
N20 = BullNose(diameter=20, corner_radius=5, length=50)
CUTTERS: dict[str, Cutter] = {"F20": F20, "B10": B10, "N20": N20}
FLUX = 1e-5
"""Relative: what the volume of a turning body promises."""


def by_lines(sweep: Sweep, n: int = 40, axis: int = 2) -> tuple[float, float]:
    """Midpoint rule over n x n rays, and a bound of its error: 3 n^-1.5 of the box."""
    low, high = sweep.bounds
    a, b = (k for k in range(3) if k != axis)
    step = (high - low) / n
    u, v = np.meshgrid(*(low[k] + step[k] * (np.arange(n) + 0.5) for k in (a, b)), indexing="ij")
    origins = np.zeros((n * n, 3))
    origins[:, a], origins[:, b], origins[:, axis] = u.ravel(), v.ravel(), low[axis]
    total = float(sweep.ray_intervals(origins, np.eye(3)[axis]).lengths.sum() * step[a] * step[b])
    return total, 3 * n**-1.5 * float(np.prod(high - low))


def check(sweep: Sweep, volume: float | None = None) -> None:
    """Flux, lines, and the expected value where there is one."""
    found = sweep.flux(1e-4 if volume is None else 2e-5).volume
    if volume is not None:
        assert found == pytest.approx(volume, rel=FLUX)
    lines, error = by_lines(sweep)
    assert abs(lines - found) < error
    assert found >= sweep.profile.volume * (1 - FLUX)


def table(start, angle, tool_home=UP) -> Turn:
    """Rotary table about z: the tip goes around the origin, all joints linear."""
    return Turn.joints([("R", UP, (0, 0, 0), 1)], [0], [angle], tip_home=start, axis_home=tool_home)


@pytest.mark.parametrize("tool", CUTTERS)
def test_nothing_moves_or_only_the_spin_does(tool):
    still = Pose((1, 2, 3), tilted(25, 40))
    for sweep in (
        Sweep(CUTTERS[tool], still, still),
        Sweep.along(CUTTERS[tool], Turn.rotary((0, 0, 0), (0, 0, 0), "hexa", (0, 0), (0, 2))),
        Sweep.along(CUTTERS[tool], Turn.rotary((0, 0, 0), (0, 0, 0), "ac", (0, 0), (0, 7))),
    ):
        assert sweep.volume == pytest.approx(sweep.profile.volume, rel=1e-12)
        assert len(breaks(sweep)) == 0


@pytest.mark.parametrize("tool", CUTTERS)
@pytest.mark.parametrize("way", [1, -1])
def test_along_its_own_tilted_axis_and_square_to_it(tool, way):
    axis, cutter = tilted(50, 110), CUTTERS[tool]
    side = np.cross(axis, UP) / np.linalg.norm(np.cross(axis, UP))
    along = Sweep(cutter, Pose((0, 0, 0), axis), Pose(way * 30 * axis, axis))
    R = cutter.profile.max_radius
    assert along.volume == pytest.approx(cutter.profile.volume + 30 * pi * R * R, rel=1e-12)
    across = Sweep(cutter, Pose((0, 0, 0), axis), Pose(way * 30 * side, axis))
    assert across.volume == pytest.approx(
        cutter.profile.volume + 30 * cutter.profile.meridian_area, rel=1e-12
    )


@pytest.mark.parametrize("angle", [1e-9, 1e-6, 1e-4])
@pytest.mark.parametrize("tool", CUTTERS)
def test_a_tiny_turn_changes_little(tool, angle):
    """The volume differs by less than angle * length * (area of the tool + travel * width)."""
    first = radians(30)
    plain = Sweep.along(CUTTERS[tool], Turn.rotary((0, 0, 0), (0, 60, 0), "ac", (first, 0), (first, 0)))
    tiny = Sweep.along(
        CUTTERS[tool], Turn.rotary((0, 0, 0), (0, 60, 0), "ac", (first, 0), (first + angle, 0))
    )
    bound = angle * 50 * (plain.profile.area + 2 * 60 * (50 + 20))
    assert abs((tiny.volume or 0) - (plain.volume or 0)) < bound + 1e-8 * (plain.volume or 0)


@pytest.mark.parametrize(
    ("tool", "radius", "angle"),
    [("F20", 6, pi / 2), ("N20", 6, pi / 2), ("B10", 3, pi / 2), ("F20", 10, 2.0), ("B10", 30, 1.0)],
)
def test_a_rotary_table_sweeps_like_the_arc(tool, radius, angle):
    """Axis of rotation outside, inside and on the surface of the tool; the arc has a closed form."""
    arc = Sweep.along(CUTTERS[tool], Arc((radius, 0, 0), (0, 0, 0), 2, angle=angle))
    check(Sweep.along(CUTTERS[tool], table((radius, 0, 0), angle)), arc.volume)


@pytest.mark.parametrize("tool", ["F20", "B10"])
def test_a_full_turn_enters_its_start_a_second_time(tool):
    """Closed path, no fold anywhere: only the search in time sees that V(K) is entered twice."""
    arc = Sweep.along(CUTTERS[tool], Arc((30, 0, 0), (0, 0, 0), 2, angle=2 * pi))
    sweep = Sweep.along(CUTTERS[tool], table((30, 0, 0), 2 * pi))
    found = sweep.flux(2e-5)
    assert arc.volume is not None
    assert abs(found.volume - arc.volume) < found.error < 1e-3 * arc.volume
    assert found.again == pytest.approx(sweep.profile.volume, rel=2e-3)


def test_a_tilted_tool_on_a_table_and_a_tilt_beyond_the_horizon():
    check(Sweep.along(N20, table((25, 5, 0), 1.5, tilted(20, 60))))
    check(Sweep(B10, Pose((0, 0, 0), tilted(80, 0)), Pose((20, 0, 0), tilted(110, 15))))


def test_the_axis_through_the_pole_by_both_branches():
    """From tilt 1 at azimuth 0 to tilt 1 at 170 degrees: c swings 170, or a changes its sign and c swings 10."""
    first = (radians(1), radians(90))
    long = Turn.rotary((0, 0, 0), (10, 0, 0), "ac", first, (radians(1), radians(260)))
    short = Turn.rotary((0, 0, 0), (10, 0, 0), "ac", first, (radians(-1), radians(80)))
    assert long.axis(1.0) == pytest.approx(short.axis(1.0), abs=1e-14)
    for turn in (long, short):
        check(Sweep.along(F20, turn))


def test_joint_motion_bows_away_from_the_chord():
    """Quarter turn of the table at 100 mm: the tip leaves the straight line by 100 (1 - cos 45) mm."""
    chain = [("R", UP, (0, 0, 0), -1), ("R", (1, 0, 0), (0, 0, -50), -1)]
    chain += [("L", d, (0, 0, 0), 1) for d in np.eye(3)]
    xyz = [0, 61.602540378, 43.301270189]
    turn = Turn.joints(chain, [pi / 2, radians(30), *xyz], [0, radians(30), *xyz])
    assert turn.position([0.0, 1.0]) == pytest.approx(np.array([[100, 0, 0], [0, 100, 0]]), abs=1e-8)
    bow = np.linalg.norm(turn.position(0.5) - [50, 50, 0])
    assert bow == pytest.approx(29.289322, abs=1e-6)
    assert Sweep.along(B10, turn).contains([turn.position(0.5) + 5 * turn.axis(0.5)]).all()
    assert not Sweep.along(B10, turn).contains([(50, 50, 20)]).any()


LEAN = Turn.rotary((0, 0, 0), (30, 10, -3), "ac", (0.1, 1.0), (0.35, 1.6))


def test_tools_at_the_limit_of_another():
    """A corner of 1e-6 mm is an edge, a corner of all but the radius is a ball, a ball may end at its equator."""
    sharp = BullNose(diameter=20, corner_radius=1e-6, length=50)
    cut = [Sweep.along(tool, LEAN).flux(1e-4).volume for tool in (sharp, F20)]
    assert cut[0] == pytest.approx(cut[1], rel=2e-6)
    round_ = BullNose(diameter=10, corner_radius=5 - 1e-7, length=50)
    cut = [Sweep.along(tool, LEAN).flux(1e-4).volume for tool in (round_, B10)]
    assert cut[0] == pytest.approx(cut[1], rel=2e-6)
    check(Sweep.along(BallNose(diameter=10, length=5), LEAN))
    check(Sweep.along(Profile([(0, 0), (8, 6), (8, 30)]), LEAN))  # a point at the tip
    check(Sweep.along(Taper(diameter=12, taper_deg=-10, length=25), LEAN))


def test_moving_along_a_generator_of_the_cone():
    """r = |c| along a whole line of the cone: every circle of it is tangent at once."""
    cone = Profile([(0, 0), (10, 20), (10, 40)])
    slope = np.array([10, 0, 20]) / np.sqrt(500)
    plain = Sweep(cone, (0, 0, 0), 30 * slope)
    moved = Sweep.along(cone, Turn.rotary((0, 0, 0), 30 * slope, "ac", (0, 0), (1e-9, 0)))
    assert moved.volume == pytest.approx(plain.volume, rel=1e-6)


@pytest.mark.parametrize("tool", CUTTERS)
def test_volume_does_not_depend_on_scale_frame_or_direction(tool):
    profile = CUTTERS[tool].profile
    a, b = tilted(5, 10), tilted(25, 70)
    whole = Sweep(profile, Pose((0, 0, 0), a), Pose((30, 10, -2), b))
    volume = whole.volume or 0.0
    back = Sweep(profile, Pose((30, 10, -2), b), Pose((0, 0, 0), a))
    assert back.volume == pytest.approx(volume, rel=FLUX)
    q, _ = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))
    q *= np.sign(np.linalg.det(q))
    turned = Sweep(profile, Pose((7, 8, 9), q @ a), Pose(q @ [30, 10, -2] + [7, 8, 9], q @ b))
    assert turned.volume == pytest.approx(volume, rel=FLUX)
    for s in (0.01, 30.0):
        big = Sweep(profile.scaled(s), Pose((0, 0, 0), a), Pose(s * np.array([30, 10, -2]), b))
        assert big.volume == pytest.approx(s**3 * volume, rel=FLUX)


@settings(deadline=None, max_examples=15)
@given(
    end=coordinates(30),
    angles=st.tuples(*[st.floats(-1, 1).map(lambda v: round(v, 3))] * 4),
    tool=st.sampled_from(sorted(CUTTERS)),
)
def test_flux_and_lines_agree_anywhere(end, angles, tool):
    sweep = Sweep.along(CUTTERS[tool], Turn.rotary((0, 0, 0), end, "ac", angles[:2], angles[2:]))
    lines, error = by_lines(sweep, 24)
    found = sweep.flux(1e-4) if not sweep.upright() else None
    volume = found.volume if found else sweep.volume
    assert volume is not None
    assert abs(lines - volume) < error + (found.error if found else 0.0)


def test_a_search_that_is_given_up_says_so(monkeypatch):
    """A ball about its own centre slides along itself: a point of its surface is never proven to be outside.

    What such points enter is uncertain, and has to be in the error estimate.
    """
    pivot = Sweep.along(B10, Turn.through((0, 0, 0), (0, 0, 0), "ac", (0, 0), (0.5, 0), control_height=5))
    q = pivot._moved()
    room = np.zeros((160, 7)), np.zeros(12)

    def visited(z: float) -> tuple[bool, bool]:
        """Of points on the axis at the start; the centre is at z = 5, the tip at 0."""
        return flux_kernels.visited(q.seg, q.ends, q.limits, q.waves, 0.0, 0.0, z, 1.0, 1e-7, PATIENCE, *room)

    assert visited(5.0) == (True, False)
    assert visited(-1.0) == (False, False)
    assert visited(0.0) == (False, True)

    sweep = Sweep.along(F20, TURNS["tip"])
    found, search, doubts = sweep.flux(1e-4), flux_kernels.reentry, []

    def certain(*args):
        search(*args)
        doubts.append(args[-1].max())
        args[-1][:] = 0.0

    monkeypatch.setattr(flux_kernels, "reentry", certain)
    sure = Sweep.along(F20, TURNS["tip"]).flux(1e-4)
    assert max(doubts) > 0.0 and found.volume == sure.volume
    assert found.error > sure.error
