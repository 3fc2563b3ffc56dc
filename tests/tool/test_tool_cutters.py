"""Cutters: shapes against solid geometry, and refusals that name the field."""

import re
from math import cos, pi, radians, sin, tan

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from vmachining.errors import ToolError
from vmachining.tool import AptTool, BallNose, BullNose, FlatEnd, ProfileTool, Taper

NAN, INF = float("nan"), float("inf")


def bull_volume(R: float, r: float, H: float) -> float:
    """Pappus: core cylinder, quarter ring of the corner, cylinder above."""
    c = R - r
    corner = pi * r**2 / 4 * 2 * pi * (c + 4 * r / (3 * pi))
    return pi * c**2 * r + corner + pi * R**2 * (H - r)


def cone(r0: float, r1: float, h: float) -> float:
    return pi * h / 3 * (r0**2 + r0 * r1 + r1**2)


@settings(deadline=None)
@given(R=st.floats(0.1, 50), share=st.floats(0, 1), extra=st.floats(0, 80))
def test_bull_nose_volume(R: float, share: float, extra: float):
    r = min(share * R, R)
    if r < 1e-3 * R:
        r = 0.0
    H = r + extra + 0.01
    tool = BullNose(diameter=2 * R, corner_radius=r, length=H)
    assert tool.profile.volume == pytest.approx(bull_volume(R, r, H), rel=1e-12)
    assert tool.profile.is_convex
    assert tool.profile.z_min == 0
    assert tool.profile.z_max == H


def test_limits_of_the_bull_nose_are_flat_and_ball():
    flat, ball = FlatEnd(diameter=8, length=30), BallNose(diameter=8, length=30)
    assert (
        BullNose(diameter=8, corner_radius=0, length=30).profile.points.tolist()
        == flat.profile.points.tolist()
    )
    assert (
        BullNose(diameter=8, corner_radius=4, length=30).profile.points.tolist()
        == ball.profile.points.tolist()
    )
    assert BullNose(diameter=8, corner_radius=1e-9, length=30).profile.volume == pytest.approx(
        flat.profile.volume
    )


def test_a_ball_as_long_as_its_radius_has_no_cylinder():
    tool = BallNose(diameter=10, length=5)
    assert tool.profile.volume == pytest.approx(2 / 3 * pi * 125, rel=1e-14)


@pytest.mark.parametrize("half", [5, 30, 60, -5])
@pytest.mark.parametrize("corner", [0, 1, 3])
def test_taper_is_tangent_and_its_volume_adds_up(half, corner):
    H, R, b = 12.0, 3.0, radians(half)
    tool = Taper(diameter=2 * R, corner_radius=corner, taper_deg=half, length=H)
    assert tool.profile.is_convex
    c, z1 = R - corner, corner * (1 - sin(b))
    r1 = c + corner * cos(b)
    r2 = r1 + (H - z1) * tan(b)
    # corner: integral of (c + sqrt(q^2 - u^2))^2 over u from -q to -q sin b, with u = -q sin t
    q, a = corner, b
    area = q**2 / 2 * ((pi / 2 - a) - sin(a) * cos(a))
    turned = pi * (c**2 * z1 + 2 * c * area + q**2 * z1 - q**3 / 3 * (1 - sin(a) ** 3))
    assert tool.profile.volume == pytest.approx(turned + cone(r1, r2, H - z1), rel=1e-12)
    if corner:
        lower, upper = tool.profile.normals[0, 1], tool.profile.normals[1, 0]
        assert lower == pytest.approx(upper, abs=1e-12)


def test_apt_draws_the_other_cutters():
    apt = {"alpha_deg": 0, "beta_deg": 0, "h": 40}
    cases = [
        (AptTool(d=20, r=0, e=10, f=0, **apt), FlatEnd(diameter=20, length=40)),
        (AptTool(d=20, r=10, e=0, f=10, **apt), BallNose(diameter=20, length=40)),
        (AptTool(d=20, r=5, e=5, f=5, **apt), BullNose(diameter=20, corner_radius=5, length=40)),
        (
            AptTool(d=6, r=0, e=0, f=0, alpha_deg=0, beta_deg=10, h=40),
            Taper(diameter=6, taper_deg=10, length=40),
        ),
    ]
    for a, b in cases:
        assert a.profile.points == pytest.approx(b.profile.points, abs=1e-12)
        assert a.profile.volume == pytest.approx(b.profile.volume, rel=1e-13)
        assert a.length == b.length == 40


def test_apt_drill_point():
    drill = AptTool(d=10, r=0, e=5, f=0, alpha_deg=31, beta_deg=0, h=60)
    tip = 5 * tan(radians(31))
    assert drill.profile.volume == pytest.approx(pi * 25 * tip / 3 + pi * 25 * (60 - tip), rel=1e-13)
    assert drill.diameter == 10


@pytest.mark.parametrize("alpha", [0, 10, 40])
@pytest.mark.parametrize("beta", [0, 5, -3])
def test_a_tangent_apt_corner_is_smooth(alpha, beta):
    a, b, r, d = radians(alpha), radians(beta), 2.0, 20.0
    u = d / 2 * (1 - tan(a) * tan(b))
    # the centre is r away from both lines, inside: solve the two normal forms
    lines = np.array([[-sin(a), cos(a)], [-cos(b), sin(b)]])
    e, f = np.linalg.solve(lines, [r, r - u * cos(b)])
    tool = AptTool(d=d, r=r, e=e, f=f, alpha_deg=alpha, beta_deg=beta, h=50)
    assert tool.profile.is_convex
    along = tool.profile.normals
    for below, above in zip(along[:-1, 1], along[1:, 0], strict=True):
        assert below == pytest.approx(above, abs=1e-6)


@settings(deadline=None)
@given(
    d=st.floats(2, 60), share=st.floats(0.05, 0.45), alpha=st.floats(0, 12), beta=st.floats(-8, 20),
    digits=st.sampled_from([6, 9]),
)  # fmt: skip
def test_the_tangent_values_of_a_refusal_are_taken_as_they_are_printed(d, share, alpha, beta, digits):
    """A corner that misses tells e and f that touch; written with six decimals or nine digits they do."""
    wrong = {
        "d": round(d, 3), "r": round(share * d, 3), "e": 1000.0, "f": 1000.0, "alpha_deg": round(alpha, 2),
        "beta_deg": round(beta, 2), "h": d,
    }  # fmt: skip
    with pytest.raises(ToolError) as caught:
        AptTool(**wrong)
    e, f = (float(v) for v in re.findall(r"= (-?[\d.]+(?:e-?\d+)?)", caught.value.remedy))
    assume(e >= 0)
    told = {"e": e, "f": f} if digits == 9 else {"e": round(e, 6), "f": round(f, 6)}
    profile = AptTool(**wrong | told).profile
    slope = np.tan(np.radians(wrong["alpha_deg"]))
    foot = (e + f * slope) / (1 + slope**2)  # of the centre, on the bottom line
    assert np.hypot(profile.points[:, 0] - foot, profile.points[:, 1] - foot * slope).min() < 3e-6


def test_the_tool_of_the_issue_is_taken():
    """Its message had recommended exactly these e and f."""
    AptTool(d=10.8, r=1.547, e=4.03722425, f=1.74774151, alpha_deg=2.82, beta_deg=7.61, h=25)
    with pytest.raises(ToolError, match=r"misses the bottom line by 0\.001 mm"):
        AptTool(d=10.8, r=1.546, e=4.03722425, f=1.74774151, alpha_deg=2.82, beta_deg=7.61, h=25)


def test_apt_corner_that_misses_tells_the_tangent_one():
    with pytest.raises(ToolError, match="misses the side line") as caught:
        AptTool(d=20, r=2, e=5, f=2, alpha_deg=0, beta_deg=0, h=50)
    assert "e = 8, f = 2" in str(caught.value)


def test_a_longer_apt_or_free_tool_continues_as_a_cylinder():
    apt = AptTool(d=6, r=0, e=3, f=0, alpha_deg=0, beta_deg=45, h=4, length=10)
    assert apt.profile.points.tolist() == pytest.approx(np.array([[3, 0], [7, 4], [7, 10]]))
    free = ProfileTool(points=[(0, 0), (5, 5)], length=9)
    assert free.profile.points.tolist() == [[0, 0], [5, 5], [5, 9]]
    assert ProfileTool(points=[(0, 0), (5, 5)]).length == 5


def test_parts_of_a_tool():
    holder = ((20, 70), (20, 90), (30, 90), (30, 120))
    tool = BallNose(
        diameter=10, length=80, flute_length=25, shank_diameter=12, holder=holder, flutes=2, helix_deg=30
    )
    assert tool.cutter.z_max == 25
    assert tool.profile.z_max == 80
    assert tool.shank is not None
    assert tool.shank.points.tolist() == [[6, 25], [6, 80]]
    assert tool.holder_profile is not None
    assert tool.holder_profile.volume == pytest.approx(pi * (400 * 20 + 900 * 30))
    assert tool.name == "ball D10"
    bare = BallNose(diameter=10, length=80)
    assert bare.cutter is bare.profile
    assert bare.shank is None
    assert bare.holder_profile is None


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: FlatEnd(diameter=0, length=5), "diameter"),
        (lambda: FlatEnd(diameter=-2, length=5), "diameter"),
        (lambda: FlatEnd(diameter=NAN, length=5), "diameter"),
        (lambda: FlatEnd(diameter=INF, length=5), "diameter"),
        (lambda: FlatEnd(diameter=2, length=0), "length"),
        (lambda: BullNose(diameter=10, corner_radius=6, length=20), "corner_radius"),
        (lambda: BullNose(diameter=10, corner_radius=-1, length=20), "corner_radius"),
        (lambda: BullNose(diameter=10, corner_radius=NAN, length=20), "corner_radius"),
        (lambda: BallNose(diameter=10, length=4), "length"),
        (lambda: BallNose(diameter=10, length=40, flute_length=41), "flute_length"),
        (lambda: BallNose(diameter=10, length=40, flute_length=0), "flute_length"),
        (lambda: BallNose(diameter=10, length=40, shank_diameter=-1), "shank_diameter"),
        (lambda: BallNose(diameter=10, length=40, flutes=0), "flutes"),
        (lambda: BallNose(diameter=10, length=40, helix_deg=90), "helix_deg"),
        (lambda: BallNose(diameter=10, length=40, holder=[(5, 20), (6, 10)]), "holder"),
        (lambda: Taper(diameter=6, taper_deg=90, length=40), "taper_deg"),
        (lambda: Taper(diameter=6, taper_deg=-10, length=40), "taper_deg"),
        (lambda: Taper(diameter=6, taper_deg=5, corner_radius=4, length=40), "corner_radius"),
        (lambda: AptTool(d=20, r=-1, e=0, f=0, alpha_deg=0, beta_deg=0, h=5), "r"),
        (lambda: AptTool(d=20, r=0, e=0, f=0, alpha_deg=-5, beta_deg=0, h=5), "alpha_deg"),
        (lambda: AptTool(d=20, r=0, e=0, f=0, alpha_deg=0, beta_deg=90, h=5), "beta_deg"),
        (lambda: AptTool(d=20, r=10, e=0, f=10, alpha_deg=0, beta_deg=0, h=5), "apt"),
        (lambda: AptTool(d=20, r=0, e=0, f=0, alpha_deg=0, beta_deg=0, h=0), "h"),
        (lambda: ProfileTool(points=[(1, 1), (1, 5)]), "profile"),
        (lambda: ProfileTool(points=[(1, 0)]), "profile"),
        (lambda: ProfileTool(points=[(1, 0), (1, 5)], length=4), "length"),
    ],
)
def test_refusals_name_the_field(make, word):
    with pytest.raises(ToolError) as caught:
        make()
    assert caught.value.word == word


@pytest.mark.parametrize(
    ("length", "want"), [(np.inf, "finite"), (-np.inf, "above zero"), (np.nan, "above zero")]
)
def test_a_length_without_end_is_said_so(length, want):
    with pytest.raises(ToolError, match=f"length {length} mm must be {want}"):
        FlatEnd(diameter=10, length=length)
