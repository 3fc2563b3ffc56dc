"""Contact along blocks in one compiled walk: closed forms, and the engagement that distances give one angle after another."""

from __future__ import annotations

import manifold3d
import numpy as np
import pytest

from vmachining.engagement import Engagement, Past, RayWorkpiece, contact
from vmachining.engagement.along import Sweeps, Teeth, contact_along, fractions
from vmachining.engagement.along.block import _Walk
from vmachining.engagement.along.kernels.tile_kernels import gather
from vmachining.force import Coefficients, load_rows, power_w, turn_load
from vmachining.geometry import Arc, Line
from vmachining.stock import BoxStock, CylinderStock, MeshStock
from vmachining.sweep import Pose, Stance, Sweep, Turn
from vmachining.tool import BallNose, BullNose, Edge, FlatEnd, ProfileTool, Taper

K0 = Coefficients.constant(700, 250, 120, 25, 18, 4)
PLATE = BoxStock([0, 0, -20], [100, 60, 0])
FLAT = FlatEnd(diameter=10, length=60, flute_length=40)


def sample(tool, stock, path, earlier=(), at=0.5, teeth=2, helix=None):
    """One station of a block."""
    edge = Edge(tool, bottom=True)
    sweeps = Sweeps(stock)
    for one in (*earlier, path):
        sweeps.add(tool.cutter, one)
    helical = None if helix is None else Edge(tool, helix_deg=helix, bottom=True)
    known = Teeth(edge, helical, teeth)
    seen = contact_along(sweeps, [(len(earlier), np.array([at]))], [edge], keep=True)
    return seen.sample(0, known), known


@pytest.mark.parametrize(
    ("tool", "earlier", "speed", "feed", "wanted"),
    [
        (FLAT, (), 3000, 600, (0.5, 0.3, 0.1, 316.496, 327.810)),
        (FLAT, (27.5,), 3000, 600, (1 / 6, 0.259808, 0.0866025, 286.345, 91.7699)),
        (BullNose(diameter=32, corner_radius=4, length=60), (), 2000, 800,
         (0.5, 0.6, 0.193649, 603.15, 1226.801)),
    ],
)  # fmt: skip
def test_cases_of_the_specification(tool, earlier, speed, feed, wanted):
    """Slot, shoulder of ae = 2.5, slot of a bull nose, ap = 3, two teeth.

    The shoulder's 286.36 N of the specification is 286.345: both teeth are never in it together, and at 60 degrees one has
    h = 0.0866: (70 h' + 25) 3 with h' = h / f and so on, squared and summed.
    """
    before = [Line([-60, y, -3], [160, y, -3]) for y in earlier]
    path = Line([-6, 30, -3], [94, 30, -3])
    seen, teeth = sample(tool, BoxStock([0, -20, -20], [100, 80, 0]), path, before)
    scale = feed / (path.length * 2 * speed)
    load = turn_load(seen, teeth, K0)
    found = (
        seen.chips.fraction, seen.chips.area_rate * scale, seen.chips.thickness_rate * scale, load.peak(scale),
        float(power_w(load.torque(scale), speed)),
    )  # fmt: skip
    np.testing.assert_allclose(found, wanted, rtol=6e-6)
    assert seen.chips.ap == pytest.approx(3.0, abs=1e-6)


def test_a_shoulder_peaks_where_its_closed_form_does():
    h = 0.1 * np.sin(np.radians(60.0))
    parts = [(k * h + e) * 3 for k, e in ((700, 25), (250, 18), (120, 4))]
    assert np.linalg.norm(parts) == pytest.approx(286.345, abs=5e-4)


@pytest.mark.parametrize(
    ("tool", "path", "rate"),
    [
        (FLAT, Line([50, 30, 2], [50, 30, -8]), 10 * 5.0),  # plunge: the bottom alone, one radius wide
        (BullNose(diameter=20, corner_radius=5, length=60), Line([50, 30, 2], [50, 30, -18]), 20 * 10.0),
    ],
)
def test_a_plunge_is_cut_by_the_bottom(tool, path, rate):
    """The chip of a tooth is its projection across the feed: as wide as the radius, in a plate that is deep enough."""
    seen, _ = sample(tool, PLATE, path, at=0.9)
    assert seen.chips.fraction == 1.0 and np.isnan(seen.chips.ae)
    assert seen.chips.area_rate == pytest.approx(rate, rel=1e-9)
    assert seen.chips.ap == pytest.approx(0.0 if tool is FLAT else 5.0, abs=1e-6)


def test_a_plunge_of_a_flat_end_has_no_axial_depth_but_a_chip():
    seen, _ = sample(FLAT, PLATE, Line([50, 30, 2], [50, 30, -8]), at=0.9)
    assert seen.chips.ap == 0.0 and seen.chips.thickness_rate == pytest.approx(10.0)


def test_air_is_zero():
    seen, teeth = sample(FLAT, PLATE, Line([0, 30, 5], [50, 30, 5]))
    assert seen.chips == (0.0, 0.0, 0.0, 0.0, 0.0, 0.0) and turn_load(seen, teeth, K0) is None
    up, _ = sample(FLAT, PLATE, Line([50, 30, 5], [50, 30, 9]))
    assert np.isnan(up.chips.ae) and up.chips.ap == 0.0


def test_a_shallow_wall_is_not_missed_between_angles():
    """ae = 0.01 mm of R = 5: engaged over 3.6 degrees, less than a step of the grid."""
    ae = 0.01
    seen, _ = sample(FLAT, PLATE, Line([10, 60 + 5 - ae, -3], [90, 60 + 5 - ae, -3]))
    assert seen.chips.ae == pytest.approx(ae, rel=1e-3)
    assert seen.chips.fraction == pytest.approx(np.arccos(1 - ae / 5) / (2 * np.pi), rel=1e-3)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("low, high", [(0.5, 4.0), (20.0, 21.2), (2.0, 3.2)])
def test_a_rib_between_two_angles_is_seen(low, high, side):
    """A flat end of 50 mm crosses a rib of 3.5 or 1.2 mm: it cuts over 8.0 to 3 degrees, between angles ten degrees apart."""
    y = sorted((side * low, side * high))
    stock = BoxStock((-60, y[0], -10), (60, y[1], 0))
    seen, _ = sample(FlatEnd(diameter=50, length=50), stock, Line([-30, 0, -2], [30, 0, -2]), at=0.5)
    assert seen.chips.ae == pytest.approx(high - low, abs=2e-3) and seen.chips.ap == pytest.approx(
        2.0, abs=1e-6
    )
    arc = np.arcsin(high / 25.0) - np.arcsin(low / 25.0)
    assert seen.chips.fraction == pytest.approx(arc / (2 * np.pi), rel=1e-3)
    assert seen.chips.area_rate == pytest.approx(60.0 * 2.0 * np.sqrt(1.0 - (low / 25.0) ** 2), rel=2e-3)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("high", [21.2, 21.0])
def test_a_rib_beside_a_larger_contact_is_seen(side, high):
    """A deeper slot leaves 1.2 or 1 mm beyond it: 4.9 or 4 degrees of a flat end of 50 mm, which cuts 114 degrees elsewhere."""
    low, tool = 20.0, FlatEnd(diameter=50, length=50)
    y = sorted((-30.0 * side, high * side))
    stock = BoxStock((-60, y[0], -10), (60, y[1], 0))
    sweeps, edge = Sweeps(stock), Edge(tool, bottom=True)
    sweeps.add(FLAT.cutter, Line([-80, 15 * side, -6], [80, 15 * side, -6]))
    sweeps.add(tool.cutter, Line([-30, 0, -2], [30, 0, -2]))
    told = contact_along(sweeps, [(1, np.array([0.5]))], [edge]).chips(0)
    wide = np.arcsin(10 / 25) + np.pi / 2 + np.arcsin(high / 25) - np.arcsin(low / 25)
    assert told.fraction == pytest.approx(wide / (2 * np.pi), rel=1e-3)
    assert told.ae == pytest.approx(25.0 + high, abs=2e-3)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_rib_thinner_than_a_cell_is_seen_where_the_edge_begins(side):
    """Beside the tip of a ball of R = 10, 1 mm deep, a slot leaves 0.2 mm: closed forms, though a cell of the edge is 0.65 mm.

    At phi the edge crosses the rib from r = 0.05 / sin(phi) to 0.25 / sin(phi), at most where it leaves the stock: the chip per
    feed is cos(phi) times what it rises there.
    """
    low, high, tool = 0.05, 0.25, BallNose(diameter=20, length=60)
    y = sorted((-9.0 * side, high * side))
    slot = Line([-80, (low - 5.0) * side, -6], [80, (low - 5.0) * side, -6])
    sweeps = Sweeps(BoxStock((-60, y[0], -10), (60, y[1], 0)))
    sweeps.add(FLAT.cutter, slot)
    sweeps.add(tool.cutter, Line([-30, 0, -1], [30, 0, -1]))
    told = contact_along(sweeps, [(1, np.array([0.5]))], [Edge(tool, bottom=True)]).chips(0)
    phi, leaves = np.linspace(0.0, 0.5 * np.pi, 2_000_001)[1:], np.sqrt(100.0 - 81.0)
    ends = np.minimum(np.array([[low], [high]]) / np.sin(phi), leaves)
    area = 60.0 * np.cos(phi) * np.diff(-np.sqrt(100.0 - ends**2), axis=0)[0]
    assert told.area_rate == pytest.approx(area.max(), rel=2e-3)
    assert told.fraction == pytest.approx(0.25 - np.arcsin(low / leaves) / (2 * np.pi), abs=1e-4)
    assert told.planned == pytest.approx((area > 0.01 * area.max()).mean() / 4, abs=2e-4)
    assert told.ae == pytest.approx(high - low, abs=4e-3)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("r", [8.0, 3.0, 1.0])
@pytest.mark.parametrize("turns", [False, True])
def test_a_floor_at_the_height_of_a_corner_is_not_cut(side, r, turns):
    """A row beside a row: a bull nose lies on the floor before it, where an arc of r = 8 mm is 2.5e-4 mm long within 1e-9 mm.

    Poses are known to 2e-7 mm, in which 3.6e-3 mm lie. It cuts from where its bottom leaves the disc of the row before.
    """
    tool = BullNose(diameter=40, corner_radius=r, length=60)
    ends = [([-60, y * side, -3], [60, y * side, -3]) for y in (-5.0, 0.0)]
    up = [0.0, 0.0, 1.0]
    rows = [Turn.great_circle(Pose(a, up), Pose(b, up)) if turns else Line(a, b) for a, b in ends]
    seen, _ = sample(tool, BoxStock([-50, -50, -10], [50, 50, 0]), rows[1], rows[:1])
    beside = np.arcsin(1.0 - 5.0 / (20.0 - r)) / (2 * np.pi)
    assert seen.chips.fraction == pytest.approx(0.25 - beside, abs=2e-3)


@pytest.mark.parametrize("lead", [10.0, 4.0])
@pytest.mark.parametrize("place", [(0.0, 0.0), (17.3, -4.1)])
def test_a_flat_end_that_leans_forward_cuts_with_its_front(lead, place):
    """Its lowest point is the front of its edge, which lies on two surfaces: the wall moves into material, the disc out of it.

    At phi from the feed the wall cuts from s = 0 to (R sin(lead) cos(phi) - tip) / cos(lead), faster by L cos(lead) cos(phi).
    """
    lean, tool = np.radians(lead), FlatEnd(diameter=20, length=60)
    a, high = np.array([np.sin(lean), 0.0, np.cos(lean)]), 10.0 * np.sin(lean)
    start = np.array([*place, high - 0.5])  # 0.5 mm deep in front
    path = Turn.great_circle(Pose(start, a), Pose(start + [6.0, 0.0, 0.0], a))
    stock = BoxStock([-50, -50, -10], [80, 50, 0])
    for at in (0.3, 1.0):
        seen, _ = sample(tool, stock, path, at=at)
        assert seen.chips.fraction == pytest.approx(np.arccos(1.0 - 0.5 / high) / np.pi, abs=1e-4)
        assert seen.chips.area_rate == pytest.approx(3.0, rel=1e-3)


def test_the_last_station_may_stand_at_the_origin():
    """Sweeps without a closed form have no tip in their rows, which is not a tip at the origin that the tool came to before."""
    tool, found = Taper(diameter=6, taper_deg=4, corner_radius=1, length=24), []
    for x in (0.0, 0.25):
        stock = BoxStock([x - 20, -10, -10], [x + 20, 10, 1])
        before = [Line([x - 30, y, 0], [x + 30, y, 0]) for y in (-4.0, 12.0)]
        found.append(sample(tool, stock, Line([x - 15, 0, 0], [x, 0, 0]), before, at=1.0)[0].chips)
    assert found[0].fraction > 0.2 and found[0] == pytest.approx(found[1], rel=1e-6)


@pytest.mark.parametrize("degrees", [12.0, 8.0])
def test_a_part_beside_the_sweep_before_it_is_not_leapt_over(degrees):
    """A bull nose of D12 r1 that leans: what an earlier pass and the motion before it leave is 0.21 or 0.14 mm of its corner.

    How fast the sweep before it recedes changes six times as fast along the corner as a distance: no step may be as long.
    """
    tool, a = (
        BullNose(diameter=12, corner_radius=1, length=40),
        np.array([0.3, 0.0, 1.0]) / np.hypot(0.3, 1.0),
    )
    e, y = np.array([a[2], 0.0, -a[0]]), np.array([0.0, 1.0, 0.0])
    p = np.radians(-65.0 + degrees) + np.arccos(0.2)
    o, before = (
        0.4 * (np.cos(p) * e + np.sin(p) * a),
        -8.0 * (np.sin(np.radians(65)) * e + np.cos(np.radians(65)) * a),
    )
    turns = [
        Turn.great_circle(Pose(start, a), Pose(end, a))
        for start, end in ((o - 12 * y, o + 12 * y), (before, 0 * e), (0 * e, 5 * e))
    ]
    stock = BoxStock([-40, -40, -20], [40, 40, 3])
    seen, _ = sample(tool, stock, turns[2], turns[:2], at=0.0)
    past = [Past(k, Sweep.along(tool.cutter, turn)) for k, turn in enumerate(turns[:2])]
    edge, stance = Edge(tool, bottom=True), Stance.on(turns[2], 0.0)
    dense = Engagement(
        edge, stance, contact(edge, stance, RayWorkpiece(stock, past), [], angles=360), "dexel"
    )
    wide = np.ptp(dense.arcs, axis=1).sum() / (2 * np.pi)
    assert wide > 0.2 and seen.chips.fraction == pytest.approx(wide, abs=0.06)


def cases():
    """Tools, stocks, earlier passes and a block: pockets, arcs, ramps, three and five axes."""
    bull, ball = BullNose(diameter=12, corner_radius=3, length=50), BallNose(diameter=8, length=50)
    taper = Taper(diameter=8, taper_deg=10, length=40, corner_radius=1)
    bar = CylinderStock((50, 30), 25, (-20, 0))
    level = [Line([10, y, -2], [90, y, -2]) for y in (20, 27)]
    lean = Turn.great_circle(Pose([20, 30, -2], [0.2, 0.1, 0.97]), Pose([70, 34, -3], [-0.1, 0.25, 0.96]))
    first = Turn.great_circle(Pose([20, 24, -2], [0.2, 0.1, 0.97]), Pose([70, 27, -3], [-0.1, 0.25, 0.96]))
    return {
        "bull beside passes": (bull, PLATE, level, Line([15, 33, -3], [85, 33, -3])),
        "ball on a bar": (ball, bar, level, Line([20, 22, -4], [80, 38, -4])),
        "arc": (FLAT, PLATE, level, Arc([50, 40, -3], [50, 30, -3], angle=2.5)),
        "helix into the full": (FLAT, PLATE, [], Arc([54, 30, 0], [50, 30, 0], angle=7.0, rise=-4.0)),
        "ramp": (bull, PLATE, level, Line([20, 32, 1], [80, 36, -5])),
        "ramp up": (bull, PLATE, level, Line([20, 32, -5], [80, 36, 1])),
        "taper": (taper, PLATE, level, Line([15, 31, -4], [85, 31, -4])),
        "five axes": (bull, PLATE, [first], lean),
    }


@pytest.mark.parametrize("name", cases())
@pytest.mark.parametrize("at", [0.31, 0.77])
def test_the_walk_sees_what_distances_see(name, at):
    """`contact` asks one condition after the other, with a resolution of 0.01 mm: lengths and chips agree."""
    tool, stock, earlier, path = cases()[name]
    seen, _ = sample(tool, stock, path, earlier, at=at)
    edge, stance = Edge(tool, bottom=True), Stance.on(path, at)
    past = [Past(k, Sweep.along(tool.cutter, one)) for k, one in enumerate(earlier)]
    own = [] if isinstance(path, Line) else [Past(99, Sweep.along(tool.cutter, path.split([at])[0]))]
    found = Engagement(
        edge, stance, contact(edge, stance, RayWorkpiece(stock, past), own, angles=144, phase=0.13), "dexel"
    )
    if seen.straight is None:
        assert found.is_air
        return
    length = float(np.linalg.norm(stance.velocity))
    area = float(np.nanmax(found.chip_per_feed)) * length
    # its grid is another one: a peak between angles is missed by 1 - cos(1.25 degrees) and steep ends by a little more
    assert seen.chips.area_rate == pytest.approx(area, rel=0.02)
    assert seen.chips.ap == pytest.approx(found.ap, abs=0.05)
    assert seen.chips.ae == pytest.approx(found.ae, abs=0.1)
    arcs = float(np.ptp(found.arcs, axis=1).sum()) / (2 * np.pi)
    assert seen.chips.fraction == pytest.approx(min(arcs, 1.0), abs=0.004)


def test_triangles_are_a_stock_like_a_box():
    outer, _ = PLATE.mesh(0.1)
    path, earlier = Line([15, 33, -3], [85, 35, -4]), [Line([10, 27, -2], [90, 27, -2])]
    one, _ = sample(FLAT, PLATE, path, earlier)
    other, _ = sample(FLAT, MeshStock(outer.vertices, outer.triangles), path, earlier)
    np.testing.assert_allclose(one.chips, other.chips, rtol=1e-6, atol=1e-6)


def test_a_bar_given_in_whole_numbers_is_one_of_the_same_numbers():
    """Its box was one of whole numbers, and so were heights of material: 0.75 mm of a ridge above z = 0 counted as none."""
    earlier, path = [Line([0, 30, 0.75], [100, 30, 0.75])], Line([0, 30, 0.25], [100, 30, 0.25])
    one, _ = sample(FLAT, CylinderStock((50, 30), 25, (-20, 2)), path, earlier)
    other, _ = sample(FLAT, CylinderStock((50.0, 30.0), 25.0, (-20.0, 2.0)), path, earlier)
    assert one.chips == other.chips
    assert one.chips.ap == pytest.approx(0.5, abs=1e-6)


def test_a_helix_smooths_the_force_and_keeps_the_work():
    """A shoulder: the mean torque of elements that cut later is the same; its peak is lower."""
    path, earlier = Line([-6, 30, -8], [94, 30, -8]), [Line([-60, 27.5, -8], [160, 27.5, -8])]
    scale = 600 / (path.length * 2 * 3000)
    straight = turn_load(*sample(FLAT, PLATE, path, earlier), Coefficients.constant(700, 0, 0, 25))
    wound = turn_load(*sample(FLAT, PLATE, path, earlier, helix=30), Coefficients.constant(700, 0, 0, 25))
    # F_t alone: M = rho F_t cos(chi)
    assert wound.torque(scale) == pytest.approx(straight.torque(scale) * np.cos(np.radians(30)), rel=5e-3)
    assert wound.peak(scale) < 0.95 * straight.peak(scale)


def test_envelopes_hold_the_peak_at_every_feed():
    path = Line([-6, 30, -3], [94, 30, -3])
    seen, teeth = sample(BullNose(diameter=16, corner_radius=4, length=60), PLATE, path, teeth=3)
    load = turn_load(seen, teeth, K0)
    for component, width in (("resultant", 3), ("xy", 2)):
        rows = load_rows(load, component, 1 / path.length, 1.0)
        for f in (0.0, 0.01, 0.1, 0.5, 0.99):
            force = f / path.length * load.angles[:, :3] + load.angles[:, 3:6]
            peak = np.linalg.norm(force[:, :width], axis=1).max()
            assert np.sqrt((rows @ [f * f, 2 * f, 1]).max()) == pytest.approx(peak, rel=1e-12)
    assert len(rows) < 12


def test_stations():
    assert fractions(0.3, 5.0).tolist() == [0, 1]
    assert len(fractions(10.0, 5.0)) == 9 and len(fractions(1e3, 5.0)) == 17


@pytest.mark.parametrize(("fins", "thick"), [(4, 2.0), (6, 2.5), (12, 1.0), (20, 1.0)])
def test_fins_above_each_other_are_all_cut(fins, thick):
    """Triangles with gaps as wide as the fins: the chip of a slot is one feed times what stands, ap reaches from fin to fin."""
    stack = [
        manifold3d.Manifold.cube((100, 50, thick)).translate((0, -45, 2 * thick * k)) for k in range(fins)
    ]
    solid = sum(stack, manifold3d.Manifold.cube((100, 10, 2 * thick * fins))).to_mesh()
    comb = MeshStock(np.array(solid.vert_properties)[:, :3], np.array(solid.tri_verts, dtype=np.int64))
    tool = FlatEnd(diameter=10, length=2 * thick * fins + 15, flute_length=2 * thick * fins + 5)
    path = Line([10, -20, -1], [90, -20, -1])
    seen, _ = sample(tool, comb, path)
    assert seen.chips.area_rate / path.length == pytest.approx(fins * thick, rel=1e-7)
    assert seen.chips.ap == pytest.approx((2 * fins - 1) * thick, abs=1e-6)


@pytest.mark.parametrize(("fins", "thick"), [(4, 2.0), (12, 1.0), (40, 0.3)])
def test_fins_between_grooves_of_a_disc_cutter_are_all_cut(fins, thick):
    """The same of earlier sweeps that undercut: grooves from one side, as high as the fins that they leave."""
    high = 2 * thick * fins
    disc = ProfileTool(points=[(0, 0), (10, 0), (10, thick), (3, thick), (3, high + 20)])
    sweeps = Sweeps(BoxStock([0, -30, 0], [100, 30, high]))
    for k in range(fins):
        sweeps.add(disc.cutter, Line([-20, -34, (2 * k + 1) * thick], [120, -34, (2 * k + 1) * thick]))
    tool = FlatEnd(diameter=10, length=high + 15, flute_length=high + 5)
    path = Line([10, -29, -1], [90, -29, -1])
    sweeps.add(tool.cutter, path)
    edge = Edge(tool, bottom=True)
    chips = (
        contact_along(sweeps, [(fins, np.array([0.5]))], [edge], keep=True)
        .sample(0, Teeth(edge, None, 2))
        .chips
    )
    assert chips.area_rate / path.length == pytest.approx(fins * thick, rel=1e-6)
    assert chips.ap == pytest.approx(high - thick, abs=1e-6)


def test_a_sweep_that_a_station_cannot_reach_has_no_place_in_its_list():
    """It was marked as seen there, with the place that an earlier station had given it, or none: what stood in memory."""
    sweeps = Sweeps(PLATE)
    for y in (30, 37.3):  # the second begins in a tile under the tool, 0.3 mm beside it
        sweeps.add(BallNose(diameter=4, length=50).cutter, Line([10, y, -2], [90, y, -2]))
    path = Line([10, 30, -3], [90, 30, -3])
    sweeps.add(FLAT.cutter, path)
    reach = np.array([[45.0, 25.0, -3.0, 55.0, 35.0, 0.0]])
    walk = _Walk(sweeps, np.concatenate([reach, reach + [0, 9, 0, 0, 9, 0]]), 2, 5.0)  # a later station does
    now, near = np.zeros(22), np.full(8, -1)
    now[:3], now[5], now[6] = (50, 30, -3), 1.0, 80.0
    n, _ = gather(walk.tiles, walk.rows, now, 5.0, False, reach[0], 7, near)
    assert n == 1
    assert sorted(np.flatnonzero(walk.tiles.stamp == 7)) == sorted(near[:n])


def test_rows_near_a_box_and_motions_are_those_that_were_added():
    rng, tools = np.random.default_rng(5), (FLAT, BallNose(diameter=6, length=60))
    sweeps, added = Sweeps(BoxStock((0, 0, -10), (60, 60, 0))), []
    for batch in range(3):
        ends = rng.uniform((0, 0, -9), (60, 60, -1), (200, 2, 3))
        added += [(tools[k // 50 % 2].cutter, Line(*pair)) for k, pair in enumerate(ends)]
        sweeps.extend(added[200 * batch :])
        for k, (cutter, path) in enumerate(added):
            found, line = sweeps.motion(k)
            assert found is cutter and (line.start == path.start).all() and (line.end == path.end).all()
        for stop in (0, 100, 257, len(added)):
            low = rng.uniform(0, 50, 3) - (0, 0, 60)
            high, r = (
                low + rng.uniform(1, 20, 3),
                np.array([cutter.max_radius for cutter, _ in added[:stop]])[:, None],
            )
            a, b = (np.array([path.bounds[end] for _, path in added[:stop]]).reshape(-1, 3) for end in (0, 1))
            meets = (
                (a[:, :2] - r <= high[:2]).all(axis=1)
                & (b[:, :2] + r >= low[:2]).all(axis=1)
                & (a[:, 2] <= high[2])
            )
            assert sweeps.near(low, high, stop).tolist() == np.flatnonzero(meets).tolist()
