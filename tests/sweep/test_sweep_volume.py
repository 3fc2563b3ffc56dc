"""Volumes: laws they obey, and degenerate motions."""

from math import pi

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from strategies import coordinates, paths, tools
from sweep_inventions import BALL, BULL, CONE, DRILL, FLAT, STEPPED, lengths_volume, sphere

from vmachining.geometry import Arc, Line
from vmachining.sweep import Sweep, shadow
from vmachining.tool import BullNose, FlatEnd, Profile, ProfileTool

CONVEX = [FLAT, BALL, BULL, CONE, DRILL]
RING = {"start": (12, 0, 0), "center": (0, 0, 0), "axis": 2}


@settings(deadline=None)
@given(profile=tools(), a=coordinates(), b=coordinates())
def test_going_back_keeps_the_volume(profile, a, b):
    assert Sweep(profile, a, b).volume == Sweep(profile, b, a).volume


@settings(deadline=None)
@given(profile=tools(), path=paths(), factor=st.floats(0.1, 30))
def test_volume_scales_with_the_cube(profile: Profile, path, factor):
    if isinstance(path, Line):
        big = Line(path.start * factor, path.end * factor)
    else:
        centre, rise = path.center * factor, path.rise * factor
        big = Arc(path.start * factor, centre, path.axis, angle=path.angle, rise=rise)
    small, large = Sweep.along(profile, path).volume, Sweep.along(profile.scaled(factor), big).volume
    assume(small is not None and large is not None)
    assert large == pytest.approx(small * factor**3, rel=1e-9)


@settings(deadline=None)
@given(profile=tools(), a=coordinates(), b=coordinates(), share=st.floats(0.01, 0.99))
def test_two_halves_share_one_tool(profile, a, b, share):
    """Sweeps of a split straight move overlap in the sweep of a point, the tool itself."""
    whole = Sweep(profile, a, b)
    assume(whole.volume is not None)
    parts = [p.volume for p in whole.split([share])]
    assume(None not in parts)
    assert sum(parts) - profile.volume == pytest.approx(whole.volume, rel=1e-9)


@pytest.mark.parametrize("tool", CONVEX)
def test_shadow_seen_from_above_and_from_the_side(tool):
    assert shadow(tool.profile, 0.0, 1.0) == pytest.approx(pi * tool.profile.max_radius**2, rel=1e-12)
    assert shadow(tool.profile, 1.0, 0.0) == pytest.approx(tool.profile.meridian_area, rel=1e-12)


@pytest.mark.parametrize("level", [5e-324, 1e-309, 1e-160])
@pytest.mark.parametrize("tool", CONVEX)
def test_shadow_seen_from_next_to_above(tool, level):
    assert shadow(tool.profile, level, 1.0) == pytest.approx(pi * tool.profile.max_radius**2, rel=1e-12)


@given(angle=st.floats(0, pi / 2))
def test_shadow_of_a_sphere_is_a_disc(angle):
    assert shadow(sphere(3), np.cos(angle), np.sin(angle)) == pytest.approx(9 * pi, rel=1e-12)


@given(angle=st.floats(0, pi / 2))
def test_shadow_of_cylinder_and_ball_nose(angle):
    """Cylinder: rectangle and ellipse. Ball nose: half disc below, half ellipse and rectangle above."""
    c, s = np.cos(angle), np.sin(angle)
    assert shadow(FLAT.profile, c, s) == pytest.approx(20 * 50 * c + 100 * pi * s, rel=1e-12)
    assert shadow(BALL.profile, c, s) == pytest.approx(25 * pi / 2 * (1 + s) + 10 * 45 * c, rel=1e-12)


@pytest.mark.parametrize("tool", CONVEX)
@pytest.mark.parametrize("dz", [-1e-9, -1e-6, 1e-6, -1e-3])
def test_a_tiny_ramp_is_almost_level(tool, dz):
    level, ramp = Sweep(tool, (0, 0, 0), (100, 0, 0)), Sweep(tool, (0, 0, 0), (100, 0, dz))
    # either lies in the other one drawn out by |dz| upright, which adds |dz| times its plan view
    bound = 1.001 * abs(dz) * (pi * tool.profile.max_radius**2 + 200 * tool.profile.max_radius)
    assert abs(ramp.volume - level.volume) <= bound + 1e-8
    points = np.random.default_rng(0).uniform((-20, -20, -10), (120, 20, 60), (200, 3))
    assert ramp.signed_distance(points) == pytest.approx(level.signed_distance(points), abs=abs(dz) + 1e-11)


@pytest.mark.parametrize("tool", CONVEX)
@pytest.mark.parametrize("angle", [5e-324, 2e-305, -1e-160, 1e-30, 1e-9])
def test_a_helix_of_next_to_no_angle_is_a_plunge(tool, angle):
    """It lies in the plunge drawn out by radius times angle, which adds that times the shadow seen from the side."""
    plunge = Sweep(tool, (12, 0, 0), (12, 0, -3)).volume
    helix = Sweep.along(tool, Arc(**RING, angle=angle, rise=-3.0)).volume
    if helix is not None:
        shade = tool.profile.meridian_area + 3 * 2 * tool.profile.max_radius
        assert plunge * (1 - 1e-12) <= helix <= plunge * (1 + 1e-12) + 12 * abs(angle) * shade


@pytest.mark.parametrize("tool", [*CONVEX, STEPPED])
def test_no_motion_is_the_tool(tool):
    for path in (
        Line((1, 2, 3), (1, 2, 3)),
        Arc((1, 2, 3), (5, 2, 3), 2, angle=0.0),
        Arc((1, 2, 3), (1, 2, 3), 2, angle=6),
    ):
        assert Sweep.along(tool, path).volume == pytest.approx(tool.profile.volume, rel=1e-14)


@pytest.mark.parametrize("tool", [*CONVEX, STEPPED])
def test_after_a_full_turn_nothing_is_added(tool):
    """Any angle from 2 pi on sweeps the same ring: Pappus per height, the hole where the disc leaves one."""
    volumes = [Sweep.along(tool, Arc(**RING, angle=a)).volume for a in (2 * pi, -2 * pi, 7.0, 40.0)]
    assert volumes == pytest.approx([volumes[0]] * 4, rel=1e-13)
    assert tool.profile.max_radius < 12
    assert volumes[0] == pytest.approx(12 * 2 * pi * tool.profile.meridian_area, rel=1e-12)


@pytest.mark.parametrize("R", [3.0, 12.0, 20.0])
@pytest.mark.parametrize("angle", [0.5, 3.0, 2 * pi])
def test_arc_of_a_cylinder_by_plane_geometry(R, angle):
    """Axis outside, on and inside the cutter. Inside or on it, a full turn leaves the disc 12 + R."""
    H = 10.0
    area = Sweep.along(FlatEnd(diameter=2 * R, length=H), Arc(**RING, angle=angle)).volume / H
    if R <= 12:
        ring = 2 * R * 12 * angle
        if angle == 2 * pi:
            assert area == pytest.approx(ring, rel=1e-13)
            return
        if R == 3 or angle < pi:
            assert area == pytest.approx(ring + pi * R * R, rel=1e-13)
            return
    if angle == 2 * pi:
        assert area == pytest.approx(pi * (12 + R) ** 2, rel=1e-13)
        return
    # polar quadrature of the outline seen from a centre: count the plane by a fine polar grid of the union
    s = (np.arange(4000) + 0.5) / 4000 * (12 + R)
    cos = np.clip((s * s + 144 - R * R) / (24 * s), -1, 1)
    span = np.where(s < R - 12, 2 * pi, np.where(s < abs(R - 12), 0, 2 * np.arccos(cos) + angle))
    assert area == pytest.approx(float((s * np.minimum(span, 2 * pi)).sum() * (12 + R) / 4000), rel=1e-4)


def test_almost_a_full_turn_is_continuous():
    """The last step of a turn adds a sliver: its area vanishes with the gap to the power 3/2 or faster."""
    full = Sweep.along(BULL, Arc(**RING, angle=2 * pi)).volume
    for gap in (1e-2, 1e-4, 1e-6):
        almost = Sweep.along(BULL, Arc(**RING, angle=2 * pi - gap)).volume
        assert 0 <= full - almost + 1e-7 <= 12 * gap * 1000


def test_axis_on_the_surface_of_the_cutter():
    """r_c = R exactly, approached from both sides."""
    middle = [
        Sweep.along(FLAT, Arc((r, 0, 0), (0, 0, 0), 2, angle=2)).volume for r in (10 - 1e-9, 10, 10 + 1e-9)
    ]
    assert middle == pytest.approx([middle[1]] * 3, rel=1e-8)
    assert middle[1] == pytest.approx(50 * (100 * pi + 10 * 2 * 20), rel=1e-13)


def test_bull_nose_without_cylinder_and_with_tiny_corner():
    """H = r: the cylinder vanishes. r -> 0: the flat end mill."""
    low = BullNose(diameter=20, corner_radius=5, length=5)
    assert Sweep(low, (0, 0, 0), (30, 0, 0)).volume == pytest.approx(
        low.profile.volume + 30 * (2 * 5 * 5 + pi * 25 / 2), rel=1e-13
    )
    sharp = BullNose(diameter=20, corner_radius=1e-9, length=50)
    for end in ((30, 0, 0), (30, 0, -10), (0, 0, -10)):
        assert Sweep(sharp, (0, 0, 0), end).volume == pytest.approx(
            Sweep(FLAT, (0, 0, 0), end).volume, rel=1e-9
        )


def test_a_sphere_along_a_helix_is_a_tube():
    """Pappus: a disc moving along its normal sweeps area times way, and the two half balls close the tube."""
    path = Arc((20, 0, 0), (0, 0, 0), 2, angle=4, rise=-15)
    ball = sphere(3)
    tube = 9 * pi * path.length + 36 * pi
    assert Sweep.along(ball, path).volume == pytest.approx(tube, rel=1e-12)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_sphere_on_an_upright_circle_by_rays(axis):
    path = Arc(np.roll([20.0, 0, 0], axis + 1), (0, 0, 0), axis, angle=2)
    sweep = Sweep.along(sphere(6), path)
    tube = 36 * pi * 40 + 4 / 3 * pi * 216
    errors = [abs(lengths_volume(sweep, 2, n) / tube - 1) for n in (20, 60)]
    assert errors[1] < 3e-3
    assert errors[1] < errors[0]


@pytest.mark.parametrize("tool", [FLAT, BALL, BULL, CONE])
def test_helix_volume_by_rays(tool):
    sweep = Sweep.along(tool, Arc((30, 0, 0), (0, 0, 0), 2, angle=2, rise=-12))
    assert sweep.volume is not None
    box = float(np.prod(np.diff(sweep.bounds, axis=0)))
    assert abs(lengths_volume(sweep, 2, 60) - sweep.volume) < 3 * 60**-1.5 * box


def test_a_flat_helix_tends_to_the_arc_and_a_straight_one_to_the_ramp():
    arc = Sweep.along(BULL, Arc((30, 0, 0), (0, 0, 0), 2, angle=2)).volume
    assert Sweep.along(BULL, Arc((30, 0, 0), (0, 0, 0), 2, angle=2, rise=1e-9)).volume == pytest.approx(
        arc, rel=1e-9
    )
    wide = Sweep.along(BULL, Arc((1e6, 0, 0), (0, 0, 0), 2, angle=3e-5, rise=-10)).volume
    assert wide == pytest.approx(Sweep(BULL, (0, 0, 0), (30, 0, -10)).volume, rel=1e-9)


@pytest.mark.parametrize(
    ("tool", "path"),
    [
        (BULL, Arc((30, 0, 0), (0, 0, 0), 1, angle=1)),
        (BULL, Arc((0, 30, 0), (0, 0, 0), 0, angle=1, rise=2)),
        (BULL, Arc((30, 0, 0), (0, 0, 0), 2, angle=2 * pi, rise=-5)),
        (BULL, Arc((5, 0, 0), (0, 0, 0), 2, angle=1, rise=-5)),
        (STEPPED, Line((0, 0, 0), (10, 0, 1))),
        (STEPPED, Line((0, 0, 0), (0, 0, 1))),
        (STEPPED, Arc((30, 0, 0), (0, 0, 0), 2, angle=1, rise=-5)),
    ],
)
def test_no_closed_form_is_said_to_be_known_where_none_is(tool, path):
    assert Sweep.along(tool, path).volume is None


def test_plunge_of_a_step_drill():
    """Not convex, but without a waist: the widest circle leaves its cylinder."""
    drill = ProfileTool(points=[(2, 0), (2, 10), (5, 10), (5, 30)])
    assert Sweep(drill, (0, 0, 0), (0, 0, -7)).volume == pytest.approx(
        pi * (4 * 10 + 25 * 20 + 25 * 7), rel=1e-14
    )
