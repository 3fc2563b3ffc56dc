"""Frames, edge points, facing condition and chips against the reference numbers of the literature put right.

The numbers are those of the errata of Hendriko's chapter 5 (mpmath, 30 digits, printed to 14), and integrals that
have to agree because the volume is conserved.
"""

from __future__ import annotations

from math import acos, cos, pi, radians, sin, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import chips
from scipy.integrate import quad

from vmachining.engagement import chip, frames
from vmachining.errors import InputError

rad = np.radians


def near(value, *, abs=2e-13, rel=2e-13):  # 14 printed digits
    return pytest.approx(value, abs=abs, rel=rel)


@pytest.mark.erratum(
    "book",
    "5-2",
    "third row begins with +cos A sin B",
    "-cos A sin B: with the plus the determinant is 0.7731 at (10, 20) degrees",
)
def test_rotation_and_its_inverse():
    m = frames.rotation(rad(10), rad(-15))
    assert m == near(np.array([
        [0.96592582628907, 0, -0.25881904510252],
        [-0.044943455527548, 0.98480775301221, -0.16773125949652],
        [0.25488700224418, 0.17364817766693, 0.95125124256420],
    ]))  # fmt: skip
    assert np.degrees(acos(m[2, 2])) == near(17.963860129831)
    assert np.degrees(frames.angles_of(m[:, 2])) == near([10, -15])
    m = frames.rotation(rad(10), rad(20))
    m[2, 0] *= -1  # 5-2 as printed is not a rotation
    assert np.linalg.det(m) == pytest.approx(0.7731, abs=5e-5)


@pytest.mark.erratum(
    "book",
    "5-6",
    "epsilon = atan(dy / dx), 26.565 degrees in the example",
    "atan2 in the plane of the tool: 26.436 degrees",
)
def test_lead_and_tilt_about_a_level_and_a_sloping_surface():
    al, be = rad(10), rad(5)
    w = frames.axis_of_lean(al, be, (1, 0, 0), (0, 0, 1))
    assert w == near([0.17364817766693, -0.085831651177431, 0.98106026219041])
    assert np.degrees(frames.angles_of(w)) == near([5, 10])
    n = frames.unit((0.1, -0.2, 1))
    t = frames.feed_direction((1, 0.5, 0), n)
    assert t == near([0.89442719099992, 0.44721359549996, 0])
    w = frames.axis_of_lean(al, be, t, n)
    assert w == near([0.28851733358756, -0.18874553774290, 0.93868677960311])
    assert np.degrees(frames.angles_of(w)) == near([11.369091035920, 16.769211752554])
    assert np.degrees(chips.lean_of(w, t, n)) == near([10, 5])
    m = frames.frame_of(w)
    assert m.T @ t == near([0.88182664896193, 0.43843821865062, 0.17364817766693])
    eps = frames.feed_angle(t, m)
    assert np.degrees(eps) == near(26.436252825162)
    assert np.degrees(np.arctan(t[1] / t[0])) == pytest.approx(26.565, abs=1e-3)  # 5-6 as printed
    u = chips.feed_frame(w, t)
    turned = m @ [[cos(eps), -sin(eps), 0], [sin(eps), cos(eps), 0], [0, 0, 1]]
    assert u == near(turned)
    assert chips.world(m.T @ w, m, (1, 2, 3)) == near(w + [1, 2, 3])


@given(st.floats(-1.4, 1.4), st.floats(-1.4, 1.4), st.floats(-3, 3))
@settings(deadline=None, max_examples=50)
def test_a_tool_placed_at_a_contact_touches_there(lead, tilt, phi):
    n = frames.unit((0.3 * sin(phi), -0.2, 1.0))
    t = frames.feed_direction((cos(phi), sin(phi), 0), n)
    m = frames.frame_of(frames.axis_of_lean(lead, tilt, t, n))
    for rm, r in ((7.0, 3.0), (0.0, 10.0)):
        tip = frames.tip_of_contact((1, 2, 3), n, m[:, 2], rm, r, toward=t)
        at = frames.feed_angle(np.array([1.0, 2, 3]) - tip - r * m[:, 2], m)  # contact seen from the axis
        lam = np.arccos(np.clip(m[:, 2] @ n, -1, 1))
        if abs(sin(lam)) > 1e-6 and lam < pi / 2:
            s, phi_c = chip.arc_length(lam, r), pi / 2 - at
            assert chip.edge_points(tip, m, phi_c, s, rm, r) == pytest.approx([1, 2, 3], abs=1e-7)
            assert chips.edge_normals(m, phi_c, s, r) == pytest.approx(-n, abs=1e-7)


def test_a_level_contact_of_a_corner_needs_a_direction():
    with pytest.raises(InputError, match="any point of the bottom"):
        frames.tip_of_contact((0, 0, 0), (0, 0, 1), (0, 0, 1), 5, 5)
    tip = frames.tip_of_contact((0, 0, 0), (0, 0, 1), (0, 0, 1), 10, 0, toward=(1, 0, 0))
    assert tip == near([-10, 0, 0])


def test_points_of_a_flat_cutter():
    m = frames.rotation(rad(4), rad(12))
    c = chip.edge_points((0, 0, 0), m, rad(70), 0.0, 10, 0)
    assert c == near([9.1915808244900, 3.5481553668589, -1.7103904348126])
    assert chip.edge_points((0, 0, 0), m, rad(70), 7.9018937598191, 10, 0)[2] == near(6.0)
    assert chip.edge_points((0, 0, 0), m, rad(70), 8.6980158181444, 10, 0)[0] == near(11.0)


def test_points_of_a_bull_nose():
    m = frames.rotation(rad(3), rad(8))
    q = chip.edge_points(
        (0, 0, 0), m, rad(75), rad([75.268096116474, 55.050864479220, 32.489359170958, 90]) * 5, 5, 5
    )
    assert (q[0, 2], q[1, 0], q[2, 1]) == near((2.5, 9.0, 2.0))
    assert q[3] == near([10.261120530269, 2.3958659874891, 3.7375435292826])
    normal = chips.edge_normals(m, rad(30), rad(40) * 5, 5)
    along = chip.edge_points((0, 0, 0), m, rad(30), rad(40) * 5 + np.array([1e-6, -1e-6]), 5, 5)
    assert normal @ (along[0] - along[1]) == pytest.approx(0, abs=1e-14)


@pytest.mark.parametrize(
    ("lead", "phi", "lam"),
    [
        (10, 30, 19.425400140683), (10, 60, 11.508393365822), (10, 90, 10), (5, 45, 7.0532266567986),
        (-8, 270, -8), (-8, 210, -15.699699786408),
    ],
)  # fmt: skip
def test_the_lower_engagement_point(lead, phi, lam):
    m = frames.rotation(0, rad(lead))
    speeds = chip.edge_speeds((1, 0, 0), m, rad(phi))
    a, b = chip.corner_speeds(speeds, 5, 5)
    assert np.degrees(chips.limit_angle(a, b)) == near(lam)
    lower, upper = chip.facing_range(a, b)
    assert np.degrees((lower, upper)) == near((lam, 90) if lam > 0 else (0, -lam))


def test_the_lower_engagement_point_of_a_tool_that_turns():
    m = frames.rotation(0, rad(10))
    speeds = chip.edge_speeds((50, 0, 0), m, rad(60), omega=(0, 0.8, 0))
    assert np.degrees(chips.limit_angle(*chip.corner_speeds(speeds, 5, 5))) == near(6.4570828331217)
    # the condition is that of every point, V + omega x (Q - T)
    s = np.array([-4.0, -1.0, 2.0, 5.0, 12.0])
    q = chip.edge_points((0, 0, 0), m, rad(60), s, 5, 5)
    v = np.array([50.0, 0, 0]) + np.cross([0, 0.8, 0], q)
    n = chips.edge_normals(m, rad(60), s, 5)
    assert chip.normal_speed(s, speeds, 5, 5) == pytest.approx((v * n).sum(axis=1), abs=1e-12)


# phi0, lam of LE and UE, q, book depth, depth, area per feed (and as printed) of the example A9
A9 = [
    (90, 10.0, 63.1301023542, 4.6364760900081, 2.6237329074372, 2.0, 2.0),
    (45, 14.001942165517, 56.1249908519, 3.6759294527805, None, 1.6719770030972, 0.92687291849286),
    (20, 27.273169556804, 47.0687569966, 1.7274908909566, None, 0.94143286655323, 0.11196714996255),
]


@pytest.mark.parametrize(("phi", "le", "ue", "q", "book", "deep", "area"), A9)
def test_chip_of_a_bull_nose_in_a_slab(phi, le, ue, q, book, deep, area):
    m = frames.rotation(0, rad(10))
    tip = frames.tip_of_contact((0, 0, 0), (0, 0, 1), m[:, 2], 5, 5)
    assert tip == near([-5.7922796533957, 0, 0.94420212327361])
    lower, upper = rad([le]) * 5, rad([ue]) * 5
    speeds = chip.edge_speeds((1, 0, 0), m, rad(phi))
    scale = chip.feed_scale(1.0, speeds)
    coarse = {"abs": 2e-11}  # lam of UE has 12 digits
    assert chip.cut_length(lower, upper) == near(q, **coarse)
    assert chip.exact_depth(lower, upper, tip, m, rad(phi), 5, 5) == near(deep, **coarse)
    assert chip.chip_area(lower, upper, speeds, 5, 5, scale) == near(area, **coarse)
    if book is not None:
        assert chips.book_depth(lower, upper, 5, rad(10)) == near(book, **coarse)
        assert chip.book_chip_area(lower, upper, 1.0, rad(10), rad(90)) == near(4.5660376000957, **coarse)
    h = chip.chip_thickness(5 * rad([le, ue]), speeds, 5, 5, scale)
    assert h[0] == pytest.approx(0, abs=1e-12) and h[1] > 0


@pytest.mark.erratum(
    "book",
    "5-30, 5-31 on the corner",
    "chip thickness equal along the edge",
    "f max(0, V . N): the print is 2.3 to 3.9 times too large",
)
def test_printed_chip_area_of_a_corner_is_too_large():
    """5-31 over the exact area for an upright tool: q / (r (1 - cos lam))."""
    m = np.eye(3)
    speeds = chip.edge_speeds((1, 0, 0), m, pi / 2)
    for lam, ratio in ((30, 3.908), (60, 2.094), (90, 1.571)):
        ends = [0.0], [rad(lam) * 4]
        book = chip.book_chip_area(*ends, 0.2, 0.0, pi / 2)
        assert book / chip.chip_area(*ends, speeds, 6, 4, 0.2) == pytest.approx(ratio, abs=6e-4)


def test_integrals_along_the_edge_are_those_of_the_normal_speed():
    m = frames.rotation(0.1, -0.2)
    rm, r, phi = 6.0, 4.0, 0.7
    speeds = chip.edge_speeds((3.0, -1.0, -2.0), m, phi, axis_rate=np.cross((0.1, 0.2, -0.3), m[:, 2]))
    for lower, upper in ((-5.0, -0.5), (0.3, 5.9), (4 * pi / 2 + 1, 11.0)):
        for around, found in ((False, chip.chip_area), (True, chips.removal_density)):

            def f(s, around=around):
                return float(chip.normal_speed(s, speeds, rm, r) * (chip.radius(s, rm, r) if around else 1.0))

            args = (1.0,) if not around else ()
            assert found([lower], [upper], speeds, rm, r, *args) == pytest.approx(
                quad(f, lower, upper)[0], rel=1e-12
            )


def test_empty_intervals_hold_nothing():
    none = np.full((2, 3), np.nan)
    assert (chip.pieces(none, none, 4.0) == chip.EdgePiece.NONE).all()
    speeds = chip.edge_speeds((1, 0, 0), np.eye(3), np.zeros(2))
    zero = np.zeros(2)
    assert (chip.cut_length(none, none) == zero).all() and (chip.axial_depth(none, none, 4.0) == zero).all()
    assert (chip.chip_area(none, none, speeds, 6, 4, 1.0) == zero).all()
    assert (chip.exact_depth(none, none, (0, 0, 0), np.eye(3), np.zeros(2), 6, 4) == zero).all()
    assert chips.spindle_scale(2, 3000) == near(
        chip.feed_scale(0.1, chip.edge_speeds((10, 0, 0), np.eye(3), 0))
    )


def test_section_i_slot_of_a_bull_nose():
    """D32 r4, ap 3, F800, 2 teeth at 2000 / min: chip area 0.6, thickness 0.193649 at the top of the slot."""
    speeds = chip.edge_speeds((800 / 60, 0, 0), np.eye(3), pi / 2)
    top = [4 * acos(1 - 3 / 4)]
    scale = chips.spindle_scale(2, 2000)
    assert chip.chip_area([0.0], top, speeds, 12, 4, scale) == near(0.6)
    assert chip.chip_thickness(top, speeds, 12, 4, scale) == pytest.approx(0.2 * sqrt(15) / 4)
    assert chip.axial_depth([0.0], top, 4) == near(3.0) and radians(90) == chip.QUARTER
