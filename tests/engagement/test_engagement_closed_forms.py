"""Engaged intervals against closed forms: staircases, slabs, slots, leaning tools in plane stock.

Planes and circles meet in closed form, so every truth here is arithmetic. The tolerance is the one promised for
planar stock, 1e-6 mm; at the ends of arcs the angle is the arc over the radius.
"""

from __future__ import annotations

from math import acos, atan, cos, hypot, pi, radians, sin, sqrt, tan

import numpy as np
import pytest

from vmachining.engagement import (
    BoxStock,
    By,
    CylinderStock,
    Engagement,
    MeshStock,
    Past,
    RayWorkpiece,
    contact,
    engaged_parts,
    facing_parts,
)
from vmachining.engines.mesh import StockMesh
from vmachining.engines.mesh.facets import Side
from vmachining.geometry import Arc, Line
from vmachining.sweep import Pose, Stance, Sweep, Turn
from vmachining.tool import AptTool, BallNose, BullNose, Edge, FlatEnd, ProfileTool, Taper

MM = 1e-6
FAR = 500.0


def slab(top, *, low=-FAR):
    return BoxStock((-FAR, -FAR, low), (FAR, FAR, top))


def lean(a_deg, b_deg):
    """Tool axis of the tilts theta_A about x, theta_B about y."""
    a, b = radians(a_deg), radians(b_deg)
    return np.array([sin(b), -sin(a) * cos(b), cos(a) * cos(b)])


def stance(tip=(0, 0, 0), axis=(0, 0, 1), velocity=(1, 0, 0), at=0.5):
    """The tool at `tip` in the middle of a straight block, leaning and not turning."""
    tip, velocity = np.array(tip, float), np.array(velocity, float)
    start, end = tip - at * velocity, tip + (1 - at) * velocity
    if tuple(axis) == (0, 0, 1):
        return Stance.on(Line(start, end), at)
    return Stance.on(Turn.great_circle(Pose(start, axis), Pose(end, axis)), at)


class Stairs:
    """Blocks side by side in x, as one body: distance is good for signs and 1-Lipschitz, that is enough."""

    def __init__(self, breaks, tops, y=(-FAR, FAR)):
        boxes = zip(breaks[:-1], breaks[1:], tops, strict=True)
        self.boxes = [BoxStock((a, y[0], -FAR), (b, y[1], h)) for a, b, h in boxes]

    def signed_distance(self, points):
        return np.min([box.signed_distance(points) for box in self.boxes], axis=0)


# theta_A, theta_B, phi, R, r, tip, x breaks, tops, y limits, lam0, engaged (s of the meridian), sum of lengths
R90 = 5 * pi / 2
STAIRS = {
    "S1": (5, 20, 60, 10, 0, (0, 0, 0), (-20, 2, 8, 11, 30), (3, 4.5, 2, 7), None, 0,
           [(0, 4.82304275299), (8.36799598608, 10.1642565464)], 6.6193033133193),
    "S2": (4, 20, 60, 10, 5, (0, 0, 0), (-30, 1, 4.5, 9.5, 40), (4, -1, 1, 9), None, 0,
           [(0, 5 * radians(76.1914155083)), (5 * radians(80.2572253237), R90 + 7.38098937134)], 14.880162165120),
    "S3": (4, -30, 100, 10, 5, (0, 0, 0), (-30, 6.5, 14.5, 40), (10, 3, 0), None, 0,
           [(0, 5 * radians(42.9594550207)), (5 * radians(76.2780346944), R90 + 1.02962318146)], 5.9760102284609),
    "S4": (0, -25, 75, 10, 5, (0, 0, 0), (-30, 6.5, 13.75, 40), (10, 1.5, 1), None, 0,
           [(0, 5 * radians(34.8650740144)), (R90 + 0.334035901267, R90 + 1.52959308954)], 4.2381088657855),
    "S5": (-3, 10, 110, 11, 3, (0, 0, 0), (-15, 5, 12, 25), (6, 4, 8), None, 12,
           [(3 * radians(12), 3 * pi / 2 + 2.68969396482)], 6.7737644144894),
    "S6": (0, 30, 90, 10, 0, (0, 0, 6), (-20, 11, 40), (-1, 9), None, 0,
           [(4.67949192431, 9.23760430703)], 4.5581123827228),
    "S7": (-20, 15, 150, 10, 0, (0, 0, 0), (-20, 0, 30), (12, 12), (-9, -2), 0, [(0, 11.297092910526)], 11.297092910526),
}  # fmt: skip


@pytest.mark.parametrize("name", STAIRS)
def test_staircases_of_the_literature(name):
    """Reference intervals made with mpmath; no facing condition, as there."""
    a, b, phi, radius, r, tip, breaks, tops, y, lam0, want, q = STAIRS[name]
    tool = BullNose(diameter=2 * radius, corner_radius=r, length=60)
    work = RayWorkpiece(Stairs(breaks, tops, y or (-FAR, FAR)), [])
    now = stance(tip, lean(a, b))
    found = engaged_parts(Edge(tool), now, np.array([radians(phi)]), work, facing=False)
    lower, upper = np.maximum(found.lower, r * radians(lam0)), found.upper
    assert (upper - lower).sum() == pytest.approx(q, abs=MM)
    joints = [s for pair in want for s in pair]
    ends = np.sort(np.concatenate([lower, upper]))
    inner = [e for e in ends if min(abs(e - s) for s in joints) > MM]
    assert set(np.round(inner, 6)) <= {round(r * pi / 2, 6)}  # only the joint of torus and cylinder besides
    assert all(np.abs(ends - s).min() <= MM for s in joints)


A9 = {90: (10, 63.1301023542, 4.6364760900081, 2.0), 45: (14.001942165517, 56.1249908519, 3.6759294527805, 0.92687291849286),
      20: (27.273169556804, 47.0687569966, 1.7274908909566, 0.11196714996255)}  # fmt: skip


def bull_in_slab(angles=360):
    """Bull nose D20 r5, lead 10 degrees, contact at the origin, slab top z = 2, feed +x."""
    tool = BullNose(diameter=20, corner_radius=5, length=60)
    now = stance((-5.7922796533957, 0, 0.94420212327361), lean(0, 10))
    edge = Edge(tool)
    return Engagement(edge, now, contact(edge, now, RayWorkpiece(slab(2.0), []), angles=angles), "dexel")


@pytest.mark.parametrize("phi", A9)
def test_leading_bull_nose_in_a_slab(phi):
    lam0, lam1, length, chip = A9[phi]
    found = bull_in_slab()
    mine = np.flatnonzero(found.intervals.row == phi)
    assert len(mine) == 1
    part = found.intervals.take(mine)
    assert part.lower[0] == pytest.approx(5 * radians(lam0), abs=MM) and part.lower_by[0] == By.FACING
    assert part.upper[0] == pytest.approx(5 * radians(lam1), abs=MM) and part.upper_by[0] == By.STOCK
    assert found.lengths[phi] == pytest.approx(length, abs=MM)
    assert found.chip_per_feed[phi] == pytest.approx(chip, abs=MM)


def test_removal_rate_is_the_frontal_area():
    """Area of the silhouette ahead below z = 2 (spec: 24.8634301), by the integral over the engaged surface."""
    found = bull_in_slab(angles=1440)
    # trapezia of a curve that starts like a root at both ends of the arc: error about (0.25 deg)^1.5 of it
    assert found.removal_per_mm == pytest.approx(24.8634301, rel=3e-4)
    assert found.ae == pytest.approx(
        2 * np.abs(found.points(found.intervals, upper=True)[:, 1]).max(), rel=1e-3
    )


@pytest.mark.parametrize(("lead", "phi0", "lam"), [
    (10, 30, 19.425400140683), (10, 60, 11.508393365822), (10, 90, 10), (5, 45, 7.0532266567986),
])  # fmt: skip
def test_lower_end_by_the_facing_condition(lead, phi0, lam):
    tool = BullNose(diameter=20, corner_radius=5, length=60)
    parts = facing_parts(Edge(tool), stance((0, 0, 0), lean(0, lead)), np.array([radians(phi0)]))
    assert parts.lower[0] == pytest.approx(5 * radians(lam), abs=1e-9)


def test_a_negative_lead_cuts_behind():
    """lam in [0, 8] degrees at phi0 = 270, and the cylinder does not cut there."""
    tool = BullNose(diameter=20, corner_radius=5, length=60)
    parts = facing_parts(Edge(tool), stance((0, 0, 0), lean(0, -8)), np.array([radians(270)]))
    assert len(parts.row) == 1
    assert (parts.lower[0], parts.upper[0]) == pytest.approx((0.0, 5 * radians(8)), abs=1e-9)


@pytest.mark.parametrize(("spin", "lam"), [(0.8, 6.4570828331217), (0.0, 11.508393365822)])
def test_turning_moves_the_lower_end(spin, lam):
    """Tilt 10 degrees, V = (50, 0, 0), omega = (0, spin, 0): the velocity of the tube centre decides."""
    axis = lean(0, 10)
    rate = np.cross([0, spin, 0], axis)
    upright = stance((0, 0, 0), axis, (50, 0, 0))
    parts = facing_parts(
        Edge(BullNose(diameter=20, corner_radius=5, length=60)),
        upright._replace(axis_rate=rate),
        np.array([radians(60)]),
    )
    assert parts.lower[0] == pytest.approx(5 * radians(lam), abs=1e-9)


@pytest.mark.parametrize("heading", [0.0, 90.0, 237.0])
def test_slot_by_a_flat_end(heading):
    """Engaged over the front half, all of the depth; rate = width times depth."""
    way = np.array([cos(radians(heading)), sin(radians(heading)), 0])
    now = stance((0, 0, -3), velocity=7 * way)
    edge = Edge(FlatEnd(diameter=10, length=30))
    found = Engagement(edge, now, contact(edge, now, RayWorkpiece(slab(0.0), [])), "dexel")
    assert np.degrees(found.feed_angle) % 360 == pytest.approx(heading, abs=1e-9)
    assert found.summary["arcs_feed_deg"] == [pytest.approx([0.0, 180.0], abs=1e-6)]
    rows = found.table().drop_nulls("lower_mm")
    assert np.allclose(rows["length_mm"], 3.0, atol=MM) and np.allclose(rows["ue_z_mm"], 0.0, atol=MM)
    assert ((rows["phi_feed_deg"] > 0) & (rows["phi_feed_deg"] < 180)).all()
    assert (found.ap, found.ae) == pytest.approx((3.0, 10.0), abs=MM)
    assert found.area_fraction == pytest.approx(0.5 * 3 / 30, abs=1e-7)
    # chip area f ap sin(phi0); its mean over the arc is 2 ae / (pi ae) of the full width
    assert found.chip_per_feed.max() == pytest.approx(3.0, abs=1e-3)
    assert found.removal_per_mm == pytest.approx(30.0, rel=3e-5)  # trapezia of a sine over 1 degree steps


@pytest.mark.parametrize("side", [2.0, 5.0, 8.0])
def test_side_milling_enters_where_the_wall_is(side):
    """Wall at y = 5 - side below the axis: radial depth `side`, entry at acos(1 - side / R)."""
    edge, now = Edge(FlatEnd(diameter=10, length=30)), stance((0, 0, -4))
    stock = BoxStock((-FAR, -FAR, -FAR), (FAR, side - 5.0, 0.0))
    found = Engagement(edge, now, contact(edge, now, RayWorkpiece(stock, [])), "dexel")
    entry = pi - acos(1 - side / 5.0)  # phi0 = 180 lies at y = -5
    assert found.arcs == pytest.approx(np.array([[entry, pi]]), abs=1e-7)
    assert found.ae == pytest.approx(side, abs=MM)


@pytest.mark.parametrize("depth", [0.05, 1.0, 4.0, 7.5])
def test_ball_in_a_slab(depth):
    """Upper end at lam = acos(1 - depth / r), above the equator on the cylinder; from the very tip."""
    edge, now = Edge(BallNose(diameter=10, length=30)), stance((0, 0, -depth))
    found = Engagement(edge, now, contact(edge, now, RayWorkpiece(slab(0.0), [])), "dexel")
    want = 5 * acos(1 - depth / 5) if depth <= 5 else 5 * pi / 2 + depth - 5
    parts = found.intervals
    assert np.allclose(parts.upper, want, atol=MM) and np.allclose(parts.lower, 0.0, atol=MM)
    assert found.arcs == pytest.approx(np.array([[0.0, pi]]), abs=1e-6)
    assert found.ap == pytest.approx(depth, abs=MM)
    width = 2 * sqrt(depth * (10 - depth)) if depth <= 5 else 10
    assert found.ae == pytest.approx(width, abs=1e-5)


@pytest.mark.parametrize("tilt", [(0, 15), (12, -7), (-25, 30)])
@pytest.mark.parametrize("corner", [5.0, 3.0, 0.0])
def test_leaning_tools_in_a_slab(tilt, corner):
    """Upper ends by plane and circle or plane and line, rederived from A.4: a cos lam + b sin lam = g."""
    top = 1.5
    axis = lean(*tilt)
    tool = BullNose(diameter=10, corner_radius=corner, length=40)
    now = stance((0.3, -0.2, 0.1), axis)
    phi = 2 * pi * np.arange(72) / 72
    found = engaged_parts(Edge(tool), now, phi, RayWorkpiece(slab(top), []), facing=False)
    rm = 5.0 - corner
    for k, angle in enumerate(phi):
        e_r = now.radial(np.array([angle]))[0]
        joint = now.tip + 5.0 * e_r + corner * axis
        mine = found.take(found.row == k)
        if corner and joint[2] > top:
            a, b = -corner * axis[2], corner * e_r[2]
            g = top - now.tip[2] - rm * e_r[2] - corner * axis[2]
            tau, half = np.arctan2(b, a), np.arccos(np.clip(g / hypot(a, b), -1, 1))
            roots = [x for x in ((tau - half) % (2 * pi), (tau + half) % (2 * pi)) if x <= pi / 2]
            lowest = now.tip[2] + rm * e_r[2]
            want = [] if not roots else [corner * x for x in sorted(roots)]
            if lowest < top:
                want = [0.0, *want]
        else:
            want = [0.0, corner * pi / 2 + (top - joint[2]) / axis[2]] if joint[2] < top else []
        got = np.concatenate([mine.lower, mine.upper])
        got = sorted(s for s in got if not (corner and abs(s - corner * pi / 2) < 1e-9 and s not in want))
        assert got == pytest.approx(want, abs=MM)


def test_taper_and_free_meridian_in_a_slab():
    """A cone of 10 degrees from a corner of 2 mm, and the same as a meridian with straight corner."""
    now = stance((0, 0, -12))
    taper = Edge(Taper(diameter=8, taper_deg=10, corner_radius=2, length=30))
    found = engaged_parts(taper, now, np.array([pi / 2]), RayWorkpiece(slab(0.0), []))
    corner = 2 * (pi / 2 - radians(10))
    flank = (12 - 2 * (1 - sin(radians(10)))) / cos(radians(10))
    assert found.upper.max() == pytest.approx(corner + flank, abs=MM)
    free = Edge(ProfileTool(points=[(1, 0), (4, 3), (4, 10), (6, 10), (6, 30)]))
    found = engaged_parts(free, now, np.array([pi / 2]), RayWorkpiece(slab(0.0), []))
    assert found.upper.max() == pytest.approx(3 * sqrt(2) + 7 + 2 + 2, abs=MM)  # over the step too
    point = Edge(AptTool(d=10, r=0, e=0, f=0, alpha_deg=30, beta_deg=0, h=30))
    found = engaged_parts(point, now, np.array([pi / 2]), RayWorkpiece(slab(0.0), []))
    assert found.upper.max() == pytest.approx(5 / cos(radians(30)) + 12 - 5 * tan(radians(30)), abs=MM)


def test_a_wound_edge_lags_with_its_height():
    """Side milling of ap 6 mm at a wall, helix 30 degrees: the chip enters at the height whose lag is used up."""
    helix, radius = radians(30), 5.0
    edge = Edge(FlatEnd(diameter=10, length=30), helix_deg=30)
    now = stance((0, 0, -6))
    stock = BoxStock((-FAR, -FAR, -FAR), (FAR, -2.0, 0.0))  # engaged for phi0 in (acos(-0.4), 180)
    entry = acos(-0.4)
    for angle in (entry + 0.3, pi + 0.2):
        part = engaged_parts(edge, now, np.array([angle]), RayWorkpiece(stock, []))
        low = max(0.0, (angle - pi) * radius / tan(helix))
        high = min(6.0, (angle - entry) * radius / tan(helix))
        assert (part.lower[0], part.upper[0]) == pytest.approx((low, high), abs=MM)
    found = Engagement(edge, now, contact(edge, now, RayWorkpiece(stock, [])), "dexel")
    want = pi + 6 * tan(helix) / radius
    assert found.arcs == pytest.approx(np.array([[entry, want]]), abs=1e-7)
    k = int(np.degrees(pi + 0.2))
    flat = found.intervals.take(found.intervals.row == k)
    assert found.lengths[k] == pytest.approx((flat.upper[0] - flat.lower[0]) / cos(helix), abs=MM)


def test_plunging_cuts_with_the_bottom():
    """A flat end that sinks: the cylinder slides, the disc cuts from the axis to the rim, all round."""
    edge, now = Edge(FlatEnd(diameter=10, length=30), bottom=True), stance((0, 0, -3), velocity=(0, 0, -1))
    found = Engagement(edge, now, contact(edge, now, RayWorkpiece(slab(0.0), [])), "dexel")
    assert np.allclose(found.intervals.lower, -5.0) and np.allclose(found.intervals.upper, 0.0)
    assert found.feed_angle is None and np.isnan(found.ae) and found.summary["ae_mm"] is None
    assert found.removal_per_mm == pytest.approx(25 * pi, rel=1e-12)
    without = Edge(FlatEnd(diameter=10, length=30))
    assert Engagement(without, now, contact(without, now, RayWorkpiece(slab(0.0), [])), "dexel").is_air


# -- earlier sweeps ----------------------------------------------------------------------------------------


def test_a_second_pass_is_met_in_the_rest():
    """Two level flat slots 6 mm apart: the second cuts where the first did not, entry at asin(1 / 5)."""
    tool = FlatEnd(diameter=10, length=30)
    first = Past(3, Sweep(tool, (-50, 0, -2), (50, 0, -2)))
    edge, now = Edge(tool), stance((0, -6, -2))
    found = Engagement(edge, now, contact(edge, now, RayWorkpiece(slab(0.0), [first])), "dexel")
    # wall of the first at y = -5, one above the axis of the second: cos(phi) = 1 / 5
    assert found.arcs == pytest.approx(np.array([[acos(0.2), pi]]), abs=1e-7)
    lower = Past(4, Sweep(tool, (-50, -6, -1.5), (50, -6, -1.5)))
    found = Engagement(edge, now, contact(edge, now, RayWorkpiece(slab(0.0), [first, lower])), "dexel")
    part = found.intervals
    assert np.allclose(part.upper, 0.5, atol=MM) and (part.upper_by == 4).all()


def test_a_jump_of_the_length_is_found_at_its_angle():
    """A slot of 2 mm beside one of 1 mm, walls at y = -5: 1 mm deep where cos(phi) > 1 / 5, 2 mm beyond."""
    tool = FlatEnd(diameter=10, length=30)
    shallow = Past(3, Sweep(tool, (-50, 0, -1), (50, 0, -1)))
    edge, now = Edge(tool), stance((0, -6, -2))
    found = Engagement(edge, now, contact(edge, now, RayWorkpiece(slab(0.0), [shallow])), "dexel")
    assert found.arcs == pytest.approx(np.array([[0.0, pi]]), abs=1e-7)
    sides = found.contact.phi[found.contact.grid + 2 : found.contact.grid + 4]
    assert sides == pytest.approx(np.full(2, acos(0.2)), abs=2e-9) and sides[0] < sides[1]
    # 4 mm of width 1 mm deep, 6 mm 2 mm deep; trapezia of a sine over 1 degree
    assert found.removal_per_mm == pytest.approx(4.0 + 12.0, rel=5e-5)
    assert found.area == pytest.approx(5 * (acos(0.2) + 2 * (pi - acos(0.2))), abs=1e-6)


def test_the_end_of_the_block_before_is_no_air():
    """At p = 0 the tool stands on the end pose of the block before; the front cuts anyway."""
    for tool in (FlatEnd(diameter=10, length=30), BallNose(diameter=10, length=30)):
        before = Past(0, Sweep(tool, (-9, 0, -3), (0, 0, -3)))
        edge, now = Edge(tool), Stance.on(Line((0, 0, -3), (9, 0, -3)), 0.0)
        fresh = contact(edge, now, RayWorkpiece(slab(0.0), []))
        after = contact(edge, now, RayWorkpiece(slab(0.0), [before]))
        assert np.allclose(after.arcs, fresh.arcs, atol=1e-6)
        assert np.allclose(after.parts.upper[after.parts.row < 360], fresh.parts.upper[fresh.parts.row < 360])
        again = contact(edge, now, RayWorkpiece(slab(0.0), [Past(0, Sweep(tool, (-9, 0, -3), (9, 0, -3)))]))
        assert len(again.parts.row) == 0  # cutting twice touches nothing the second time


def test_a_ball_beside_its_last_pass():
    """Step over 2 mm, ball R5, 1 mm deep. A point of the sphere lies on the tube beside where
    (5 sin(lam) cos(phi) - 2)^2 + 25 cos(lam)^2 = 25, hence sin(lam) = 0.4 / (1 + cos(phi))."""
    tool = BallNose(diameter=10, length=30)
    before = Past(0, Sweep(tool, (-50, 2, -1), (50, 2, -1)))
    edge, now = Edge(tool), stance((0, 0, -1))
    found = Engagement(edge, now, contact(edge, now, RayWorkpiece(slab(0.0), [before])), "dexel")
    for k in (10, 45, 80):
        part = found.intervals.take(found.intervals.row == k)
        limit = np.arcsin(0.4 / (1 + cos(radians(k))))
        assert part.upper_by[0] == 0
        assert part.upper[0] == pytest.approx(5 * limit, abs=MM)
    assert found.intervals.upper_by[found.intervals.row == 170].tolist() == [By.STOCK]


def test_an_arc_that_comes_back_meets_its_own_past():
    """A flat end that circles a centre inside of it: after half a turn its front is in what it has cut."""
    tool = FlatEnd(diameter=10, length=30)
    path = Arc((1, 0, -2), (0, 0, -2), angle=2 * pi)
    edge = Edge(tool)

    def front(t):
        now = Stance.on(path, t)
        own = [Past(0, Sweep.along(tool, path.split([t])[0]))]
        return contact(edge, now, RayWorkpiece(slab(0.0), []), own, angles=72)

    early, late = front(0.25), front(1.0)
    assert np.ptp(early.arcs) == pytest.approx(pi, abs=0.7) and len(early.parts.row)
    assert len(late.parts.row) == 0
    # no pose before covers what is engaged: the first one, about (1, 0), is the nearest to the rear of the front
    now = Stance.on(path, 0.25)
    points = now.points(edge, early.phi[early.parts.row], early.parts.piece, early.parts.lower)
    assert (np.hypot(points[:, 0] - 1, points[:, 1]) >= 5 - 1e-6).all()


# -- stocks ------------------------------------------------------------------------------------------------


def test_round_stock_is_met_on_its_circle():
    """Flat end R5 at (12, 0) into a bar R10: circles cross at cos(u) = (12^2 + 25 - 100) / (2 12 5) from -x."""
    edge, now = Edge(FlatEnd(diameter=10, length=30)), stance((12, 0, -3), velocity=(0, 1, 0))
    found = contact(edge, now, RayWorkpiece(CylinderStock((0, 0), 10.0, (-20, 0)), []))
    half = acos((144 + 25 - 100) / 120)
    # phi from +y to +x: -x is at 270 degrees; the front is y > 0, phi up to 360
    assert found.arcs == pytest.approx(np.array([[1.5 * pi, 1.5 * pi + half]]), abs=1e-7)


def test_triangles_are_met_as_exactly_as_planes():
    corners = np.array([(x, y, z) for x in (-20, 20) for y in (-20, 20) for z in (-9, 0)], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    mesh, box = MeshStock(corners, triangles), BoxStock((-20, -20, -9), (20, 20, 0))
    points = np.random.default_rng(3).uniform(-25, 25, (3000, 3))
    assert mesh.signed_distance(points) == pytest.approx(box.signed_distance(points), abs=1e-12)
    tool = BallNose(diameter=10, length=30)
    now = stance((19, 0, -2), lean(10, 20))
    a, b = (contact(Edge(tool), now, RayWorkpiece(stock, [])) for stock in (mesh, box))
    assert np.allclose(a.arcs, b.arcs, atol=1e-8) and np.allclose(a.parts.upper, b.parts.upper, atol=1e-8)


def test_a_round_mesh_is_as_good_as_its_chord():
    chord = 0.01
    solid = StockMesh.of(CylinderStock((0, 0), 10.0, (-20, 0)), chord).solids[Side.INNER].to_mesh64()
    mesh = MeshStock(np.array(solid.vert_properties)[:, :3], np.array(solid.tri_verts, dtype=np.int64))
    edge, now = Edge(BallNose(diameter=10, length=30)), stance((12, 0, -3), velocity=(0, 1, 0))
    fine, coarse = (
        engaged_parts(edge, now, np.radians([280.0, 300.0]), RayWorkpiece(stock, []))
        for stock in (CylinderStock((0, 0), 10.0, (-20, 0)), mesh)
    )
    assert np.allclose(fine.lower, coarse.lower, atol=5 * chord)
    assert np.allclose(fine.upper, coarse.upper, atol=5 * chord)


def test_air_is_empty():
    edge, now = Edge(BallNose(diameter=10, length=30)), stance((0, 0, 3))
    found = Engagement(edge, now, contact(edge, now, RayWorkpiece(slab(0.0), [])), "dexel")
    assert found.is_air and not len(found.arcs) and found.area == 0.0 and (found.ap, found.ae) == (0.0, 0.0)
    table = found.table()
    assert len(table) == 360 and table["length_mm"].sum() == 0.0 and table["lower_mm"].null_count() == 360
    assert not found.map().share.any()
    sliding = stance((0, 0, 0))  # the tip touches the top of the stock and slides on it
    assert len(contact(edge, sliding, RayWorkpiece(slab(0.0), [])).parts.row) == 0


def test_a_line_along_a_wall_is_no_contact():
    """A slot of 10 mm followed again, 1e-10 mm to the side: at 0 degrees exactly the wall touches, nothing is cut."""
    tool = FlatEnd(diameter=10, length=30)
    before = Past(0, Sweep(tool, (-50, 0, -2), (50, 0, -2)))
    for aside in (0.0, 1e-10, -1e-10):
        edge, now = Edge(tool), stance((0, aside, -2), velocity=(1, 1e-7, 0))
        found = contact(edge, now, RayWorkpiece(slab(0.0), [before]))
        assert not len(found.arcs) and not len(found.parts.row)


def test_the_map_holds_the_areas():
    found = bull_in_slab()
    chart = found.map(cells=400)
    assert chart.share.shape == (360, 400) and chart.share.min() >= 0.0 and chart.share.max() <= 1.0
    assert chart.share @ np.diff(chart.s) == pytest.approx(found.lengths, abs=1e-9)
    assert atan(found.area_fraction) > 0
