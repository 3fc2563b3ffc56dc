"""The meridian: exact integrals against closed forms, and cuts that lose nothing."""

from math import pi, sqrt

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from strategies import stacks

from vmachining.errors import ToolError
from vmachining.tool import Profile, convex_cover

NAN = float("nan")


def sphere(radius: float) -> Profile:
    return Profile([(0, 0), (0, 2 * radius)], [(0, radius)], [radius])


def half_torus(centre: float, radius: float) -> Profile:
    """Outer half of a torus with a flat core."""
    return Profile([(centre, -radius), (centre, radius)], [(centre, 0)], [radius])


def test_sphere():
    ball = sphere(3)
    assert ball.volume == pytest.approx(4 / 3 * pi * 27, rel=1e-15)
    assert ball.area == pytest.approx(4 * pi * 9, rel=1e-15)
    assert ball.meridian_area == pytest.approx(pi * 9, rel=1e-15)
    assert ball.max_radius == 3
    assert ball.widest_z == 3
    assert ball.is_convex
    assert ball.radius_at([-1, 0, 1.2, 3, 6]) == pytest.approx([0, 0, sqrt(9 - 1.8**2), 3, 0], abs=1e-15)


def test_half_torus_by_pappus():
    c, r = 7.0, 2.0
    body = half_torus(c, r)
    core = pi * c**2 * 2 * r
    ring = (
        pi * r**2 / 2 * 2 * pi * (c + 4 * r / (3 * pi))
    )  # area of the half disc times the way of its centroid
    assert body.volume == pytest.approx(core + ring, rel=1e-14)
    outside = pi * r * 2 * pi * (c + 2 * r / pi)
    assert body.area == pytest.approx(outside + 2 * pi * c**2, rel=1e-14)
    assert body.meridian_area == pytest.approx(2 * (2 * r * c + pi * r**2 / 2), rel=1e-14)


def test_cone_frustum():
    cone = Profile([(2, 0), (5, 4)])
    assert cone.volume == pytest.approx(pi * 4 / 3 * (4 + 10 + 25), rel=1e-15)
    assert cone.area == pytest.approx(pi * (4 + 25 + 7 * 5), rel=1e-15)
    assert cone.normals[0] == pytest.approx(np.array([[0.8, -0.6], [0.8, -0.6]]))


def test_the_ends_lose_horizontal_steps_and_the_middle_keeps_them():
    body = Profile([(0, 0), (5, 0), (5, 2), (3, 2), (4, 2), (4, 6), (0, 6)])
    assert body.points.tolist() == [[5, 0], [5, 2], [4, 2], [4, 6]]
    assert body.radius_at(2.0) == 5


def test_normals_turn_along_an_arc():
    normals = half_torus(4, 1).normals[0]
    assert normals == pytest.approx(np.array([[0.0, -1.0], [0.0, 1.0]]), abs=1e-15)


def test_pieces_of_a_stepped_body():
    body = Profile([(3, 0), (3, 10), (8, 10), (8, 20), (5, 20), (7, 30)])
    assert [p.points.tolist() for p in body.convex_pieces()] == [
        [[3, 0], [3, 10]],
        [[8, 10], [8, 20]],
        [[5, 20], [7, 30]],
    ]
    narrow, wide, top = convex_cover(body)
    assert narrow.points.tolist() == [[3, 0], [3, 10], [3, 20]]  # grows through the wide part above
    assert wide.points.tolist() == [[8, 10], [8, 20]]  # a wide part cannot grow into narrow ones
    assert top.points.tolist() == [[3, 10], [5, 20], [7, 30]]  # its flank continues down


@settings(deadline=None)
@given(stacks())
def test_convex_pieces_are_convex_and_fill_the_body(body: Profile):
    pieces = body.convex_pieces()
    assert all(p.is_convex for p in pieces)
    assert sum(p.volume for p in pieces) == pytest.approx(body.volume, rel=1e-12)
    assert sum(p.meridian_area for p in pieces) == pytest.approx(body.meridian_area, rel=1e-12)
    if len(pieces) == 1:
        assert body.is_convex


@settings(deadline=None)
@given(stacks(), st.floats(0, 1))
def test_the_cover_is_the_body(body: Profile, share: float):
    z = body.z_min + share * (body.z_max - body.z_min)
    cover = convex_cover(body)
    assert all(p.is_convex for p in cover)
    assert max(float(p.radius_at(z)) for p in cover) == pytest.approx(float(body.radius_at(z)), abs=1e-9)


@settings(deadline=None)
@given(stacks(), st.floats(0.05, 0.95))
def test_cutting_in_two_keeps_the_volume(body: Profile, share: float):
    z = body.z_min + share * (body.z_max - body.z_min)
    assume(body.z_min < z < body.z_max)
    halves = body.clip(body.z_min, z), body.clip(z, body.z_max)
    assert sum(h.volume for h in halves) == pytest.approx(body.volume, rel=1e-12)
    assert sum(h.meridian_area for h in halves) == pytest.approx(body.meridian_area, rel=1e-12)


def test_clip_of_an_arc_is_a_spherical_segment():
    part = sphere(3).clip(1, 4)  # heights -2 to 1 about the centre
    assert part.volume == pytest.approx(pi * (9 * 3 - (1 + 8) / 3), rel=1e-14)


def test_extrusion_adds_the_widest_cylinder():
    ball = sphere(3)
    longer = ball.extruded(-7)
    assert longer.z_min == -7
    assert longer.z_max == 6
    assert longer.volume == pytest.approx(ball.volume + 9 * pi * 7, rel=1e-14)
    with pytest.raises(ToolError, match="waist"):
        Profile([(3, 0), (2, 1), (3, 2)]).extruded(1)


def test_shift_and_scale():
    body = half_torus(4, 1)
    assert body.shifted(10).z_min == 9
    assert body.shifted(10).volume == pytest.approx(body.volume, rel=1e-14)
    assert body.scaled(25.4).volume == pytest.approx(25.4**3 * body.volume, rel=1e-14)


@pytest.mark.parametrize(
    ("points", "centers", "radii", "word"),
    [
        ([(1, 0)], None, None, "two points"),
        ([(1, 0, 0), (1, 1, 0)], None, None, "two points"),
        ([(1, 0), (-1, 2)], None, None, "negative"),
        ([(1, 0), (NAN, 2)], None, None, "finite"),
        ([(1, 0), (2, 5), (2, 4)], None, None, "falls from 5 to 4"),
        ([(1, 0), (2, 0)], None, None, "no height"),
        ([(0, 0), (0, 2)], None, None, "no volume"),
        ([(0, 0), (3, 3)], [(0, 2.9)], [3], "misses its circle"),
        ([(3, 0), (0, 3)], [(3, 3)], [3], "hollow"),
        ([(1, 0), (1, 2)], [(0, 1)], [-1], "arc radius -1"),
        ([(1, 0), (1, 2)], None, [1, 1], "1 segments need"),
    ],
)
def test_bodies_that_cannot_exist(points, centers, radii, word):
    with pytest.raises(ToolError, match=word):
        Profile(points, centers, radii)


def test_clip_outside():
    with pytest.raises(ToolError, match="nothing between"):
        sphere(1).clip(5, 6)


def test_what_lies_on_the_axis_up_to_rounding_is_no_part_of_the_body():
    """A corner of APT about the axis began 2e-16 mm above the tip: a first piece without a radius, and no convex body."""
    nan = float("nan")
    points = [(0.0, 0.0), (0.0, 2e-16), (1.0, 1.0), (1.0, 5.0)]
    profile = Profile(points, [(nan, nan), (0.0, 1.0), (nan, nan)], [0.0, 1.0, 0.0])
    assert profile.is_convex
    assert len(profile.segments) == 2
