"""Finish passes: reference numbers of the literature put right, closed forms against brackets, true surfaces."""

from __future__ import annotations

from math import asin, atan, cos, degrees, inf, pi, sin, sqrt, tan

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.abs_chains import circle_chain, corner_circle_chain, ray_length
from scipy.optimize import brentq

from vmachining.engagement import chip, frames
from vmachining.engagement.analytic import (
    Corner,
    EndPlace,
    HeightStock,
    NormalGrid,
    Patch,
    Section,
    Shape,
    circle_length,
    corner_circle,
    corner_line,
    end_place,
    engaged,
    finished,
    interpolated_heights,
    section,
    section_radius,
    slope_length,
    staged_length,
    staged_lengths,
    station,
    station_ends,
)
from vmachining.errors import InputError

rad = np.radians


def near(value, tol=2e-12):
    return pytest.approx(value, abs=tol, rel=tol)


def arc(radius, mu_deg, at):
    return Section(Shape.CONVEX if radius > 0 else Shape.CONCAVE, radius, float(rad(mu_deg)), at)


def line(mu_deg, at=0.0):
    return Section(Shape.SLOPE if mu_deg else Shape.FLAT, inf, float(rad(mu_deg)), at)


# -- shape from normals ------------------------------------------------------------------------------------------


@pytest.mark.erratum(
    "book",
    "6-1, 6-2",
    "chord without a sign",
    "its sign is that of the run: else a neighbour on the other side turns convex to concave",
)
def test_a_radius_from_two_normals_is_exact_and_knows_sides():
    at = [(100 * sin(rad(m)), 100 * cos(rad(m)), rad(m)) for m in (3, 5)]
    assert section_radius(*at[0], *at[1]) == near(100.0) and section_radius(*at[1], *at[0]) == near(100.0)
    hollow = [(t, -z, -m) for t, z, m in at]
    assert section_radius(*hollow[0], *hollow[1]) == near(-100.0)
    chord = np.hypot(at[1][0] - at[0][0], at[1][1] - at[0][1])
    assert chord == near(3.4904812874567)
    # 6-1 as printed has no sign of the run: a neighbour at smaller t turns convex to concave
    assert chord / (2 * sin((at[0][2] - at[1][2]) / 2)) == near(-100.0)


def test_shapes_go_by_direction():
    assert (
        section(0, 0, 0.1, 2, -0.2, 0.1).shape is Shape.SLOPE
        and section(0, 0, 0, 2, 0, 0).shape is Shape.FLAT
    )
    # a cylinder about y, and a saddle
    tube = Patch.of_normals((0, 0, 0, 0, 0), (2, 0, -0.02, atan(0.02), 0), (0, 2, 0, 0, 0))
    assert (tube.along_x.shape, tube.along_y.shape, tube.kind) == (Shape.CONVEX, Shape.FLAT, "convex flat")
    saddle = Patch(0.0, arc(50, 0, 0), arc(-50, 0, 0))
    assert saddle.kind == "saddle" and Patch(0.0, arc(50, 0, 0), arc(60, 0, 0)).kind == "convex"
    with pytest.raises(InputError, match="must lie beside it"):
        Patch.of_normals((0, 0, 0, 0, 0), (0, 1, 0, 0, 0), (0, 2, 0, 0, 0))


@pytest.mark.erratum("book", "6-7", "+tan mu", "-tan mu: the limit of 6-5 for R to infinity")
def test_a_linear_profile_descends_with_a_positive_tilt():
    """6-7 as printed ascends; the limit of 6-5 for R to infinity says that it falls."""
    flat, huge = line(10), arc(1e9, 10, 0.0)
    assert flat.rise(3.0) == near(-3 * tan(rad(10))) and huge.rise(3.0) == pytest.approx(
        float(flat.rise(3.0)), rel=1e-6
    )


def test_a_grid_of_normals_finds_the_patch():
    def ball(x, y):
        return np.sqrt(100.0**2 - np.square(x) - np.square(y)) - 100

    class Ball:
        height = staticmethod(ball)

    grid = NormalGrid.sampled(Ball(), np.arange(-10, 11, 2.0), np.arange(-6, 7, 2.0))
    patch = grid.patch(0.3, -0.2)
    assert (patch.along_x.radius, patch.along_y.radius) == (near(100, 1e-7), near(100, 1e-7))
    assert grid.patch(10.9, 0).along_x.at == 10.0  # at a border the neighbour inside


# -- published stages put right ------------------------------------------------------------------------------------


def test_lengths_in_a_plane():
    got = [circle_length(2, rad(10), r, rad(t)) for r, t in ((80, 15), (80, -15), (-80, 15), (-80, -15))]
    assert got == near([1.9754461144588, 2.1709880878750, 1.9788340453537, 2.1754874078780], 2e-13)
    assert slope_length(2, rad([12, -12]), rad(10)) == near([2.1099323417163, 1.9574876500545], 2e-13)


@given(st.floats(20, 500), st.floats(0.01, 6), st.floats(-0.7, 0.7), st.floats(-0.5, 0.5), st.booleans())
@settings(deadline=None, max_examples=200)
def test_circle_length_ends_on_the_circle(radius, cq, tilt, lean, hollow):
    big = -radius if hollow else radius
    s = float(circle_length(cq, tilt, big, lean))
    x, z = big * sin(tilt) + s * sin(lean), big * cos(tilt) - cq + s * cos(lean)
    assert np.hypot(x, z) == pytest.approx(radius, rel=1e-13) and s > 0


@pytest.mark.erratum("book", "6-12, 6-13, 6-33, 6-50", "pc = sin(...)", "asin(...)")
@pytest.mark.erratum("book", "6-15", "R^2 CO^2 under the root, which is negative", "R CO")
def test_the_published_triangles_put_right():
    convex, concave = (circle_chain(2, rad(10), r, rad(15)) for r in (80, -80))
    assert convex.co == near(78.031157360609) and concave.co == near(81.970351231185)
    assert np.degrees(convex[1:5]) == near(
        [0.25500943174640, 175.25500943175, 4.6279559583033, 0.11703460995033], 1e-11
    )
    assert np.degrees(concave[1:4]) == near([9.7572454596619, 5.2427545403381, 174.62774447681])
    assert (convex.cs, concave.cs) == near((1.9754461144588, 1.9788340453537), 1e-9)
    through = circle_chain(2, 0.0, -80, 0.0)  # 0 / 0 where the line goes through the centre
    assert through.cs == near(2.0)


@given(st.floats(30, 300), st.floats(0.1, 5), st.floats(-0.5, 0.5), st.floats(-0.4, 0.4), st.booleans())
@settings(deadline=None, max_examples=150)
def test_triangles_and_root_agree_but_for_cancellation(radius, cq, tilt, lean, hollow):
    big = -radius if hollow else radius
    chain = circle_chain(cq, tilt, big, lean)
    # their error: rounding of R^2 over the sine of a small angle
    if chain.pb > 1e-2 and np.pi - chain.pb > 1e-2:
        assert chain.cs == pytest.approx(float(circle_length(cq, tilt, big, lean)), rel=1e-6)


# -- errata: printed forms of chapter 6 and the number that shows it ------------------------------------------------


@pytest.mark.erratum("book", "6-11, 6-32, 6-47", "180 - |theta| - |delta + alpha|", "180 - |theta - delta_C|")
def test_printed_angle_at_the_point_takes_one_side_only():
    """6-11: pb = 180 - |th| - |d + pa| for 180 - |th - dC|; right only for d > 0 and the opposite lean."""
    for lean, right in ((-15, True), (15, False)):
        chain = circle_chain(2, rad(10), 80, rad(lean))
        printed = pi - abs(rad(lean)) - abs(rad(10) + chain.pa)
        assert bool(abs(printed - chain.pb) < 1e-12) is right


@pytest.mark.erratum("book", "6-17, 6-37", "R^2 sin / CO, above 1", "|R| sin / CO")
def test_printed_concave_forms_have_no_root():
    """6-15: R^2 CO^2 for R CO makes the root negative; 6-17: R^2 sin / CO is 13.56 > 1."""
    chain = circle_chain(2, rad(10), -80, rad(15))
    assert 80**2 * sin(rad(10)) / chain.co == pytest.approx(13.56, abs=5e-3)
    assert 4 + 6400 + 2 * 2 * 80 * cos(rad(10)) > 0 > 4 + 6400 - 2 * 80**2 * chain.co**2


@pytest.mark.erratum(
    "book", "6-28", "any slope: 1.84888 mm", "exact for no slope or one tilt only; 1.85025 mm"
)
def test_printed_radius_of_a_slope_is_exact_without_slope_only():
    """6-28: 1.84888 for 1.85025 with S_x sloping by 10 degrees."""
    patch, c = Patch(0.0, line(-10), arc(100, 8, 0.0)), (1, 3, -2)
    assert staged_length(patch, c, rad(5), rad(12)).cn == pytest.approx(1.84888, abs=5e-6)
    assert ray_length(patch, c, frames.axis_of(rad(5), rad(12))) == pytest.approx(1.85025, abs=5e-6)


@pytest.mark.erratum("book", "6-46", "Cs^2 / (2 CO R)", "(CO^2 + R^2 - Cs^2) / (2 CO R)")
def test_printed_distance_on_the_corner_misplaces_the_square():
    """6-46: Cs^2 / (2 CO R) alone inside acos is not an angle of the triangle."""
    co3 = sqrt(1.5**2 + 80**2 - 2 * 1.5 * 80 * cos(rad(8)))
    right = degrees(np.arccos((co3**2 + 80**2 - 1.5**2) / (2 * co3 * 80)))
    printed = degrees(np.arccos(1.5**2 / (2 * co3 * 80)))
    assert right < 1 and printed > 89


MODEL = Patch(20.0, arc(90, 6, 10.0), arc(-120, -4, 5.0))


def test_the_published_model_and_its_stages():
    c, a, b = (14, -2, 18), rad(5), rad(12)
    assert np.degrees([MODEL.along_x.tilt(14), MODEL.along_y.tilt(-2)]) == near(
        [8.5674097583450, -0.65451196919125]
    )
    assert (MODEL.along_x.rise(14), MODEL.along_y.rise(-2)) == near((-0.51125557720062, -0.28448442518644))
    found = staged_length(MODEL, c, a, b)
    assert (found.cq, found.cs, found.cn) == near((1.2042599976129, 1.1926121483882, 1.1960168104045))
    assert -found.radius == near(122.71907471169)
    assert ray_length(MODEL, c, frames.axis_of(a, b)) == near(1.1959089408242)


@pytest.mark.parametrize(
    ("first", "cq", "exact", "staged"),
    [
        (line(0), 1.5318285623970, 1.5958993056576, 1.5958993056576),
        (line(-10), 1.7081555431054, 1.8502509293868, 1.8488836279159),
    ],
    ids=["flat", "slope"],
)
def test_stages_with_a_straight_profile(first, cq, exact, staged):
    patch, c = Patch(0.0, first, arc(100, 8, 0.0)), (1, 3, -2)
    found = staged_length(patch, c, rad(5), rad(12))
    assert (found.cq, found.cn) == near((cq, staged))
    assert ray_length(patch, c, frames.axis_of(rad(5), rad(12))) == near(exact)


def test_patches_of_a_position():
    """More patches come nearer to a sphere; a rim above the model is not engaged."""
    ball, corner = Ball(100.0), Corner(10, 0, 40)
    grid = NormalGrid.sampled(ball, np.arange(-40, 41, 2.0), np.arange(-40, 41, 2.0))
    slopes = [-v / sqrt(1e4 - 12**2 - 8**2) for v in (12.0, 8.0)]
    tip, m, t = on_surface(float(ball.height(12.0, 8.0)), slopes, (12.0, 8.0), 10, 0, corner, 1.0)
    phi = rad(np.arange(50, 131, 10.0)) - frames.feed_angle(t, m)
    true = finished(corner, ball, tip, m, phi, t, bottom=False).cut_length[0]
    off = [
        float(np.abs(staged_lengths(grid, corner, (12, 8, 0), tip, m, phi, t, patches=n) / true - 1).max())
        for n in (1, 2, None)
    ]
    assert off[2] < off[1] < 0.02 and off[2] < off[0] < 0.02 and off[2] < 2e-3
    behind = staged_lengths(grid, corner, (12, 8, 0), tip, m, [rad(270) - frames.feed_angle(t, m)], t)
    assert behind.tolist() == [0.0]
    for wrong, words in (({"corner": Corner(5, 5)}, "flat cutter"), ({"patches": 3}, "3 patches")):
        given = {"corner": corner, "patches": 1, **wrong}
        with pytest.raises(InputError, match=words):
            staged_lengths(grid, given["corner"], (12, 8, 0), tip, m, phi, t, patches=given["patches"])


def test_a_point_above_the_model_is_refused():
    with pytest.raises(InputError, match="is -5"):
        staged_length(Patch(0.0, line(0), line(0)), (0, 0, 5), 0.0, 0.1)
    with pytest.raises(InputError, match="no height over the point"):
        staged_length(Patch(0.0, arc(10, 0, 0.0), line(0)), (11, 0, -5), 0.0, 0.1)


@given(st.integers(0, 10**9))
@settings(deadline=None, max_examples=80)
def test_rays_end_on_the_model(seed):
    """Closed forms and roots against a bracketed solve, to 1e-9."""
    rng = np.random.default_rng(seed)

    def profile():
        kind = rng.integers(3)
        if kind == 0:
            return line(float(rng.uniform(-20, 20)))
        return arc(float(rng.uniform(40, 200)) * (1 if kind == 1 else -1), float(rng.uniform(-8, 8)), 0.0)

    patch = Patch(float(rng.uniform(-5, 5)), profile(), profile())
    c = np.append(rng.uniform(-5, 5, 2), 0.0)
    c[2] = patch.height(c[0], c[1]) - rng.uniform(0.1, 4)
    w = frames.axis_of(*rng.uniform(-0.25, 0.25, 2))

    def above(s):
        q = c + s * w
        return float(q[2] - patch.height(q[0], q[1]))

    want = brentq(above, 0.0, 30.0, xtol=1e-13) if above(30.0) > 0 else brentq(above, 0.0, 10.0, xtol=1e-13)
    assert ray_length(patch, c, w) == pytest.approx(want, rel=1e-9)
    up = frames.angles_of(w)
    if patch.along_x.shape in (Shape.FLAT,):
        assert staged_length(patch, c, *map(float, up)).cn == pytest.approx(want, rel=1e-9)
    for a, b in ((0.0, up.theta_b), (up.theta_a, 0.0)):  # exact where the tool leans in one direction
        one = ray_length(patch, c, frames.axis_of(a, b))
        assert staged_length(patch, c, float(a), float(b)).cn == pytest.approx(float(one), rel=1e-9)


# -- corner ----------------------------------------------------------------------------------------------------


def test_ends_of_a_corner_in_a_plane():
    got = [np.degrees(corner_circle(5, r, rad(10), rad(8), 1.5)) for r in (80, -80)]
    assert got == near([45.876331064160, 49.008487424995])
    leans = ((0, 10), (8, 10), (8, -10), (-8, 10), (0, -10))
    lines = [np.degrees(corner_line(5, 1.5, rad(g), rad(t))) for g, t in leans]
    assert lines == near(
        [56.779510111137, 67.157942369849, 43.387336603027, 47.387336603027, 36.779510111137]
    )


@given(st.floats(30, 300), st.floats(0.3, 3.5), st.floats(-0.4, 0.4), st.floats(-0.35, 0.35))
@settings(deadline=None, max_examples=150)
def test_the_chain_of_triangles_is_the_same_and_both_are_on_the_circle(radius, cs, tilt, lean):
    lam = float(corner_circle(5, radius, lean, tilt, cs))
    if np.isnan(lam):
        return
    w, e = np.array([sin(lean), cos(lean)]), np.array([cos(lean), -sin(lean)])
    q = 5 * w + 5 * (sin(lam) * e - cos(lam) * w)
    centre = np.array([-radius * sin(tilt), cs - radius * cos(tilt)])
    assert np.linalg.norm(q - centre) == pytest.approx(radius, rel=1e-12)
    assert corner_circle_chain(5, radius, lean, tilt, cs) == pytest.approx(lam, abs=2e-7)  # the chain cancels


@pytest.mark.erratum(
    "book",
    "6-51, 6-55, 6-56",
    "signs that give more than 5 degrees beside 67.158 in the example",
    "wu = Cs + r (1 + sin theta tan g - cos theta), lam = 90 + g + theta - asin(...)",
)
def test_printed_forms_of_a_corner_fail():
    """6-55 with Cs - r (1 + ...): for g = 0 it must be 6-53; 6-12 with sin for asin; 6-51."""
    r, cs, g, th = 5, 1.5, rad(8), rad(10)
    wu = cs - r * (1 + sin(th) * tan(g) - cos(th))
    printed = degrees(pi / 2 - g + th - asin((r - wu) * cos(g) / r))
    assert abs(printed - 67.157942369849) > 5
    d, big = 83.512431462760, 80
    assert r - (r**2 - big**2 + d**2) / (2 * d) == pytest.approx(1.4117545237000, abs=1e-10)
    assert (r - r**2 - big**2 + d**2) / (2 * d) == pytest.approx(3.31882, abs=2e-5)
    # 6-10 and 6-12: pc = asin(CO sin pb / R), 4.62796 degrees; with sin for asin the length is off
    co, pb = 78.031157360609, rad(175.25500943175)
    pc = asin(co * sin(pb) / big)
    assert degrees(pc) == near(4.6279559583033)
    for angle, length in ((pc, 1.9754461144588), (sin(co * sin(pb) / big), None)):
        pd = pi - pb - angle
        cs2 = sqrt(big**2 + co**2 - 2 * big * co * cos(pd))
        if length:
            assert cs2 == pytest.approx(length, rel=1e-9)
        else:
            assert abs(cs2 - 1.9754461144588) > 1e-4


@pytest.mark.erratum("book", "6.4.1", "three cases", "a fourth: D_C <= 0 < D_P")
def test_places_of_the_end():
    assert [end_place(*d) for d in ((1, -1), (1, 1), (-1, -1), (-1, 1))] == [
        EndPlace.CORNER, EndPlace.CYLINDER, EndPlace.NONE, EndPlace.FOLDED
    ]  # fmt: skip
    with pytest.raises(InputError, match="0, 90 and 180"):
        station(MODEL, Corner(5, 5), (0, 0, 0), np.eye(3), 0.3)


def on_surface(height, slopes, cc, lead, tilt, corner, depth, feed=(1, 0, 0)):
    """Tip and frame with the contact `depth` below a surface along its normal, lead and tilt about the normal."""
    n = frames.unit([-slopes[0], -slopes[1], 1.0])
    t = frames.feed_direction(feed, n)
    axis = frames.axis_of_lean(rad(lead), rad(tilt), t, n)
    contact = np.array([*cc, height]) - depth * n
    return frames.tip_of_contact(contact, n, axis, corner.rm, corner.r, toward=t), frames.frame_of(axis), t


@pytest.mark.parametrize("corner", [Corner(10, 0), Corner(5, 5), Corner(0, 10)], ids=["flat", "bull", "ball"])
def test_a_plane_is_met_as_a_slab_and_as_sloping_planes_are(corner):
    phi = rad(np.arange(0.5, 360, 7))
    tip, m, t = on_surface(0.0, (0, 0), (0, 0), 10, 5, corner, 1.5)
    level = Patch(0.0, line(0), line(0))
    one = finished(corner, level, tip, m, phi, t)
    two = engaged(corner, HeightStock.staircase((-200, 200), (0,)), tip, m, phi, t)
    assert one.cut_length == pytest.approx(two.cut_length, abs=1e-9)
    assert one.chip_area() == pytest.approx(two.chip_area(), abs=1e-9)
    # the same, all turned by a slope of 12 degrees about y: nothing may change but rotation angles
    sloping = Patch(0.0, line(12), line(0))
    tip, m, t = on_surface(0.0, (-tan(rad(12)), 0), (0, 0), 10, 5, corner, 1.5)
    three = finished(corner, sloping, tip, m, rad(np.arange(0.25, 360, 0.5)), t)
    four = finished(corner, level, *on_surface(0.0, (0, 0), (0, 0), 10, 5, corner, 1.5)[:2],
                    rad(np.arange(0.25, 360, 0.5)), (1, 0, 0))  # fmt: skip
    assert three.chip_area().mean() == pytest.approx(four.chip_area().mean(), rel=1e-5)


class Ball:
    """A sphere of radius R whose top is at the origin, from above; hollow: a bowl."""

    def __init__(self, radius, hollow=False):
        self.radius, self.sign = radius, -1.0 if hollow else 1.0

    def height(self, x, y):
        return self.sign * (np.sqrt(self.radius**2 - np.square(x) - np.square(y)) - self.radius)


@pytest.mark.parametrize("hollow", [False, True], ids=["ball", "bowl"])
@pytest.mark.parametrize("corner", [Corner(10, 0), Corner(5, 5)], ids=["flat", "bull"])
def test_the_model_near_the_end_is_within_two_parts_in_a_thousand_of_a_sphere(corner, hollow):
    ball = Ball(60.0, hollow)
    grid = NormalGrid.sampled(ball, np.arange(-40, 41, 2.0), np.arange(-40, 41, 2.0))
    at = (6.0, 4.0)
    slopes = [-ball.sign * v / sqrt(60.0**2 - 52.0) for v in at]
    tip, m, t = on_surface(ball.height(*at), slopes, at, 10, 3, corner, 1.5)
    phi = rad(np.arange(20, 161, 10.0))
    true = finished(corner, ball, tip, m, phi, t, bottom=False)
    for k in range(len(phi)):
        if true.cut_length[0, k] < 0.2:
            continue
        end = true.points(upper=True)[0, k]
        end = end[~np.isnan(end[:, 0])][-1]
        model = finished(corner, grid.patch(end[0], end[1]), tip, m, phi[k : k + 1], t, bottom=False)
        assert model.cut_length[0, 0] == pytest.approx(true.cut_length[0, k], rel=2e-3)


def test_a_true_sphere_is_met_exactly():
    """UE of a corner on a sphere in closed form: tube circle against sphere."""
    ball, corner = Ball(80.0), Corner(5, 5)
    tip, m, t = on_surface(0.0, (0, 0), (0, 0), 10, 5, corner, 1.5)
    phi = rad(np.arange(25, 156, 5.0))
    found = finished(corner, ball, tip, m, phi, t, bottom=False)
    e = chip.radial(m, phi)
    d = tip + 5 * e + 5 * m[:, 2] - np.array([0, 0, -80.0])  # O4 - O3
    a, b = -d @ m[:, 2], (d * e).sum(axis=1)
    g = (80.0**2 - 25 - (d * d).sum(axis=1)) / 10
    lam = np.arctan2(b, a) - np.arccos(g / np.hypot(a, b))
    lam = np.mod(lam, 2 * pi)
    ue = np.nan_to_num(found.upper[0]).max(axis=1)
    on_corner = (ue > 0) & (ue < 5 * pi / 2)
    assert on_corner.sum() > 10 and ue[on_corner] == pytest.approx(5 * lam[on_corner], rel=1e-10)


@pytest.mark.erratum(
    "book",
    "6-57, 6-58",
    "heights between three stations by sin phi",
    "a solve at every angle; the interpolation is off by tens of percent on slopes",
)
def test_stations_are_near_the_direct_solve_and_their_interpolation_is_not():
    """Side slope of 8 degrees, lead 10: stations within 0.4 %, the published interpolation off by tens of %."""
    corner, slope = Corner(5, 5), Patch(0.0, line(0), line(8))
    tip, m, t = on_surface(0.0, (0, -tan(rad(8))), (0, 0), 10, 0, corner, 2.0)
    phi = rad(np.arange(0.0, 181, 15))
    true = finished(corner, slope, tip, m, phi, t, facing=False, bottom=False)
    length = true.cut_length[0]
    for p in (0.0, pi / 2, pi):
        k = round(p / rad(15))
        if length[k] > 0.2:
            assert station(slope, corner, tip, m, p).s == pytest.approx(length[k], rel=4e-3)
    published = station_ends(slope, corner, tip, m, phi)
    planes = station_ends(slope, corner, tip, m, phi, rule="plane")
    off = [np.nanmax(np.abs(v - length) / length) for v in (published, planes)]
    assert off[0] > 0.1 and off[1] < 0.08


def test_interpolation_of_heights():
    z, phi = (1.0, 3.0, 2.0), rad([0, 30, 90, 150, 180])
    assert interpolated_heights(phi, z) == near([1, 2, 3, 2.5, 2])
    slope = np.array([0.1, 0.3])  # a plane over a circle: z = 5 + 0.1 x + 0.3 y
    circle = 5 + 8 * (slope[0] * np.sin(phi) + slope[1] * np.cos(phi))
    assert interpolated_heights(phi, circle[[0, 2, 4]], rule="plane") == near(circle)
    with pytest.raises(InputError, match="unknown rule"):
        interpolated_heights(phi, z, rule="linear")


def test_walls_end_a_path_and_a_model_that_ends_is_told():
    corner, flat = Corner(10, 0, 30), Patch(0.0, line(0), line(0))
    m = frames.rotation(0, rad(10))
    phi = rad([80.0, 90, 100])
    free = finished(corner, flat, (0, 0, -2), m, phi, (1, 0, 0))
    short = finished(corner, flat, (0, 0, -2), m, phi, (1, 0, 0), x=(-np.inf, 9.9))
    stairs = engaged(corner, HeightStock.staircase((-99, 9.9), (0,)), (0, 0, -2), m, phi, (1, 0, 0))
    assert short.cut_length == pytest.approx(stairs.cut_length, abs=1e-9)
    assert (short.cut_length < free.cut_length).all()
    with pytest.raises(InputError, match="no height at x"):
        finished(corner, Patch(0.0, arc(9, 0, 0.0), line(0)), (0, 0, -2), m, phi, (1, 0, 0))
