"""Bounds in advance: against closed forms, and against two workpieces that know nothing of frustums."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from manifold3d import Manifold
from scipy.optimize import nnls

from vmachining.engines.mesh import MeshEngine, box_stock, cylinder_stock
from vmachining.engines.mesh.facets import Side
from vmachining.engines.mesh.gap import supports
from vmachining.engines.mesh.skin import thick, untag
from vmachining.engines.mesh.solids import manifold, pieces
from vmachining.engines.mesh.straight import facets
from vmachining.errors import EngineError
from vmachining.geometry import Arc, Line
from vmachining.sweep import Pose, Sweep
from vmachining.sweep.turned import meridian_rows
from vmachining.tool import BallNose, BullNose, FlatEnd, ProfileTool, Taper

TOOLS = {
    "flat": FlatEnd(diameter=6, length=30),
    "ball": BallNose(diameter=6, length=30),
    "bull": BullNose(diameter=8, corner_radius=1.5, length=30),
    "taper": Taper(diameter=3, taper_deg=10, corner_radius=0.7, length=30),
}
DOVETAIL = ProfileTool(points=[(0, 0), (4, 0), (2, 3), (2, 30)]).cutter
LO, HI = (0.0, 0.0, -10.0), (24.0, 18.0, 0.0)


def segment(radius, depth):
    return radius**2 * np.arccos(1 - depth / radius) - (radius - depth) * np.sqrt(
        depth * (2 * radius - depth)
    )


@pytest.mark.parametrize(
    ("tool", "depth", "section"),
    [
        ("flat", 2.0, 6.0 * 2.0),
        ("ball", 1.0, segment(3.0, 1.0)),
        ("bull", 3.0, 8.0 * 3.0 - (2 - np.pi / 2) * 1.5**2),
    ],
)
@pytest.mark.parametrize("path", ["line", "circle"])
def test_grooves_with_a_closed_form(tool, depth, section, path):
    """A groove along a line, and around a circle: Pappus and Guldin, the section is symmetric about its way."""
    way = Line((-10, 9, -depth), (34, 9, -depth))
    length = 24.0
    if path == "circle":
        way, length = Arc((17, 9, -depth), (12, 9, -depth), angle=2 * np.pi), 2 * np.pi * 5.0
    engine = MeshEngine(box_stock((0, -10, -10), (24, 30, 0)), 0.01)
    lo, estimate, hi = engine.cut(Sweep.along(TOOLS[tool].cutter, way)).bracket
    exact = section * length
    assert lo <= exact * (1 + 1e-12) and exact * (1 - 1e-12) <= hi
    assert hi - lo < 0.02 * exact
    assert abs(estimate - exact) < 1e-4 * exact
    again = engine.cut(Sweep.along(TOOLS[tool].cutter, way)).bracket
    assert again.lo == 0.0 and again.estimate <= 1e-9 * exact


steps = st.sampled_from(["pass", "pass", "ramp", "plunge", "jump", "arc", "helix", "upright arc"])


@settings(max_examples=12, deadline=None, phases=[Phase.generate])
@given(st.data(), st.sampled_from(sorted(TOOLS)), st.booleans(), st.sampled_from([0.05, 0.02]))
def test_both_kinds_of_bracket_hold_one_truth(data, tool, is_round, chord):
    """Random programs: both brackets contain the truth, so they overlap; the estimate lies in the narrower one."""

    def number(low, high):
        return data.draw(st.floats(low, high, allow_nan=False))

    def stock():
        return cylinder_stock((12, 9), 9.0, (-10, 0), chord=chord) if is_round else box_stock(LO, HI)

    once, twice = MeshEngine(stock(), chord), MeshEngine(stock(), chord, certify=True)
    cutter = TOOLS[tool].cutter
    at = np.array([number(-2, 26), number(-2, 20), number(-3, 1)])
    for k in range(8):
        kind = data.draw(steps)
        angle = number(-3.0, 3.0)
        path: Line | Arc
        if kind == "plunge":
            path = Line(at, at + [0.0, 0.0, number(-3, 3)])
        elif kind in ("arc", "helix"):
            centre = at + data.draw(st.sampled_from([1.0, 3.0, 8.0])) * np.array(
                [np.cos(angle), np.sin(angle), 0.0]
            )
            path = Arc(at, centre, angle=angle, rise=0.0 if kind == "arc" else number(-2, 2))
        elif kind == "upright arc":
            path = Arc(at, at + [2.0, 0.0, 1.0], angle=0.3 * angle, axis=1)
        else:
            rise = 0.0 if kind == "pass" else number(-2, 2)
            path = Line(at, at + [number(-14, 14), number(-14, 14), rise])
        sweep = Sweep.along(cutter, path)
        a, b = once.cut(sweep, k).bracket, twice.cut(sweep, k).bracket
        noise = 1e-9 * (1.0 + b.hi)
        assert a.lo <= b.hi + noise and b.lo <= a.hi + noise
        assert a.lo <= a.estimate <= a.hi
        at = path.position(1.0)
        if kind == "jump":
            at = np.array([number(-2, 26), number(-2, 20), number(-5, 1)])
    left, other = once.volume, twice.volume
    assert left.lo <= other.hi and other.lo <= left.hi


def test_a_finished_slope_against_quadrature():
    """Overlapping passes of a ball on a slope: the heights they leave are ellipses across the way."""
    once, twice = (MeshEngine(box_stock(LO, HI), 0.01, certify=c) for c in (False, True))
    cutter, radius, slope = TOOLS["ball"].cutter, 3.0, -0.05
    sides = np.arange(2.0, 16.0, 0.8)
    corners = [
        (x, y, -1.0 + slope * x - 0.02 * y)
        for k, y in enumerate(sides)
        for x in ((-4, 28) if k % 2 else (28, -4))
    ]
    for a, b in pairwise(corners):
        quick, sure = (engine.cut(Sweep.along(cutter, Line(a, b))).bracket for engine in (once, twice))
        assert sure.lo <= quick.estimate <= sure.hi
    y = (np.arange(18_000) + 0.5) / 1000
    x = (np.arange(24) + 0.5)[:, None]  # heights are linear along the passes: any number of columns will do
    heights = np.zeros((24, len(y)))
    for side in sides:
        across = radius**2 - (y - side) ** 2
        low = (
            -1.0 + slope * x - 0.02 * side + radius - np.sqrt(np.maximum(across, 0.0)) * np.hypot(1.0, slope)
        )
        heights = np.where(across > 0.0, np.minimum(heights, low), heights)
    truth = -float(heights.sum()) / 1000
    gone = once.stock_volume.estimate - once.volume.estimate
    assert gone == pytest.approx(truth, rel=1e-4)
    assert once.volume.holds(18 * 24 * 10 - truth) and twice.volume.holds(18 * 24 * 10 - truth)


@pytest.mark.parametrize("tool", TOOLS)
def test_no_facet_lies_deeper_than_its_gauge(tool):
    """Points of the true surface, seen from the facet below them."""
    for part, run in zip(
        *(lambda f: (f.parts, f.runs))(facets(TOOLS[tool].cutter, 0.02, Side.INNER)), strict=True
    ):
        assert part.gauge is not None
        corners = part.body.points[part.body.triangles]
        plane = np.einsum("ij,ij->i", part.body.normals, corners[:, 0])
        z = np.linspace(run.z_min, run.z_max, 400)
        turn = np.linspace(0, 2 * np.pi, 73)[:, None]
        r = run.radius_at(z)
        true = np.stack([r * np.cos(turn), r * np.sin(turn), z + 0 * turn], axis=-1).reshape(-1, 3)
        above = (true @ part.body.normals.T).max(axis=0) - plane
        assert (above <= part.gauge.most + 1e-12).all()
        assert (part.gauge.mean <= part.gauge.most + 1e-12).all() and (part.gauge.mean >= 0.0).all()


@pytest.mark.parametrize("tool", TOOLS)
def test_the_bulk_bounds_what_is_between_a_facet_and_the_surface(tool):
    """Against 400 points a facet, each followed to the surface by halving."""
    rng = np.random.default_rng(5)
    sweep = Sweep(TOOLS[tool], (0, 0, 0), (0, 0, 0))
    part = facets(TOOLS[tool].cutter, 0.05, Side.INNER).parts[0]
    body, known = part.body, part.gauge
    assert known is not None
    for t in rng.choice(np.flatnonzero((body.areas > 1e-6) & (known.most > 1e-9)), 12, replace=False):
        k = np.arange(20)
        u, v = np.meshgrid((k + 0.5) / 20, (k + 0.5) / 20)
        u, v = np.where(u + v > 1.0, 1.0 - u, u).ravel(), np.where(u + v > 1.0, 1.0 - v, v).ravel()
        a, b, c = body.points[body.triangles[t]]
        at = a + u[:, None] * (b - a) + v[:, None] * (c - a)
        low, high = np.zeros(400), np.full(400, known.most[t])
        for _ in range(40):
            middle = 0.5 * (low + high)
            inside = sweep.signed_distance(at + middle[:, None] * body.normals[t]) <= 0.0
            low, high = np.where(inside, middle, low), np.where(inside, high, middle)
        true = body.areas[t] * low.mean()
        assert true <= known.bulk[t] <= 1.15 * true  # nine tangents of a parabola: 1 + 1/9 in one direction


@pytest.mark.parametrize("tool", ["flat", "ball", "bull"])
@pytest.mark.parametrize("step", [(8, 3, 0), (8, 3, -2), (5, 0, 6), (0, 0, 4), (0.3, 0.1, 0)])
def test_a_bracket_is_hardly_wider_than_what_the_mesh_lacks(tool, step):
    """Deep in the stock, where all of the layer is in material; lo is the mesh."""
    sweep = Sweep(TOOLS[tool], (0, 0, 0), step)
    engine = MeshEngine(box_stock((-20, -20, -20), (30, 30, 60)), 0.01, tile_mm=200.0)
    lo, estimate, hi = engine.cut(sweep).bracket
    missing = sweep.volume - lo
    assert missing > 0.0 and hi >= sweep.volume
    assert hi - lo <= 1.1 * missing  # tangents and cones, a few per cent each
    assert abs(estimate - sweep.volume) <= 1e-3 * missing


@pytest.mark.parametrize("step", [(8, 3, -2), (5, 0, 6), (3, 0, 0)])
def test_the_shadow_of_a_cone_is_no_parabola(step):
    """Its straight sides once made the estimate of a ramp wrong by a quarter of what the facets lack."""
    sweep = Sweep(TOOLS["taper"], (0, 0, 0), step)
    engine = MeshEngine(box_stock((-20, -20, -20), (30, 30, 60)), 0.01, tile_mm=200.0)
    lo, estimate, _ = engine.cut(sweep).bracket
    assert abs(estimate - sweep.volume) <= 0.03 * (sweep.volume - lo)  # a quadrature over tall facets


def test_supports_of_a_ball_and_of_a_cylinder():
    angle = np.linspace(-np.pi / 2, np.pi / 2, 19)
    n = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ball = meridian_rows(BallNose(diameter=6, length=3.0).cutter)  # half a ball
    lower = n[:, 1] <= 0
    assert supports(ball, n[lower]) == pytest.approx(3.0 + 3.0 * n[lower, 1], abs=1e-12)
    rod = meridian_rows(FlatEnd(diameter=6, length=30).cutter)
    assert supports(rod, n) == pytest.approx(3.0 * n[:, 0] + np.maximum(30.0 * n[:, 1], 0.0), abs=1e-12)


def test_a_mean_travels_with_its_facet():
    mean = np.array([0.0, 1e-6, 0.0034567, 0.0799])
    ids = thick(np.arange(12).reshape(4, 3), mean, np.arange(4), 0.01)
    assert len(set(ids.tolist())) == 4 and (ids < 2**31).all()
    assert untag(ids, 0.01) == pytest.approx(mean, abs=0.01 / 2**14)  # half a step of 2^-13 chords
    assert (untag(np.arange(5000), 0.01) == 0.0).all()


@pytest.mark.parametrize("facets_in_a_row", [400, 2**14, 50_000])
def test_neighbours_share_an_id_only_in_one_plane(facets_in_a_row):
    """manifold3d would mesh them anew as one facet: numbers that return after 2^14 must not meet."""
    n = facets_in_a_row
    strip = np.stack([np.arange(n), np.arange(n) + 1, np.arange(n) + 2], axis=1)
    half = np.arange(n) // 2
    kin = np.where(half % 2 == 0, half // 2, half // 2 + 2**14)  # two triangles each, then one that clashes
    mean = np.full(n, 0.003)
    ids = thick(strip, mean, kin, 0.01)
    assert ((ids[1:] == ids[:-1]) == (kin[1:] == kin[:-1])).all() and (ids < 2**31).all()
    assert np.abs(untag(ids, 0.01) - mean).max() <= 4 * 0.01 / 2**13


def test_ids_of_a_large_and_fine_ball():
    """More facets than numbers: whoever shares an edge and an id lies in one plane."""
    body = facets(BallNose(diameter=40, length=60).cutter, 0.004, Side.INNER).parts[0]
    assert body.gauge is not None and len(np.unique(body.body.planes)) > 2**14
    ids = thick(body.body.triangles, body.gauge.mean, body.body.planes, 0.004)
    left, right = body.body.edges[:, 2], body.body.edges[:, 3]
    together = ids[left] == ids[right]
    bend = np.einsum("ij,ij->i", body.body.normals[left], body.body.normals[right])
    assert (bend[together] > 1.0 - 1e-9).all() and together.any()


def test_turning_tools_want_two_workpieces():
    turn = Sweep(TOOLS["ball"].cutter, Pose((5, 5, -1), (0, 0, 1)), Pose((15, 5, -1), (0.6, 0, 0.8)))
    with pytest.raises(EngineError, match="certify"):
        MeshEngine(box_stock(LO, HI)).cut(turn)


def is_accounted_for(engine, point):
    """Whether a point that a block has cut is gone from the workpiece, or held by one place of the skin."""
    speck = Manifold.cube((1e-4, 1e-4, 1e-4), True).translate(tuple(point.tolist()))
    if (engine.whole() ^ speck).volume() == 0.0:
        return True
    places = np.concatenate([tile.places.skin.corners for tile in engine._root.leaves()])
    near = places[((places.min(axis=1) <= point) & (places.max(axis=1) >= point)).all(axis=1)]
    weights = (np.vstack([(corners - point).T, np.ones(8)]) for corners in near)
    return min((nnls(w, np.array([0.0, 0.0, 0.0, 1.0]))[1] for w in weights), default=1.0) < 1e-9


def test_no_cutter_is_too_thin_for_a_helix():
    """Thinner than its polygon's chords are deep, it has once cut nothing."""
    cutter = FlatEnd(diameter=0.06, length=5).cutter
    sweep = Sweep.along(cutter, Arc((10, 0, -1), (0, 0, -1), angle=1.0, rise=-0.5))
    engine = MeshEngine(box_stock((-12, -12, -2), (12, 12, 0)), 0.5)
    about = 0.06 * 10.0 * 1.25
    lo, estimate, hi = engine.cut(sweep).bracket
    assert 0.0 < lo < about < hi and abs(estimate - about) < 0.01 * about


@pytest.mark.parametrize("certify", [False, True])
def test_a_helix_beside_the_stock_removes_nothing(certify):
    """A bar just beyond the wall of the hole, where a chord of the path comes nearest to it."""
    half, radius = np.pi / 16, 8.0
    begin = radius * np.array([np.cos(half), -np.sin(half)])
    path = Arc((*begin, -2), (0, 0, -2), angle=np.pi / 2, rise=1e-3)
    sweep = Sweep.along(FlatEnd(diameter=6, length=5).cutter, path)
    wall = radius - 3.0
    engine = MeshEngine(box_stock((wall - 1.0, -0.02, -1), (wall - 1e-4, 0.02, 0)), 0.5, certify=certify)
    assert sweep.signed_distance([[wall - 1e-4, y, -0.5] for y in (-0.02, 0.0, 0.02)]).min() > 0.0
    assert engine.cut(sweep).lo == 0.0


def test_what_is_left_under_the_rear_of_a_flat_end_is_stored():
    """Down a helix, chords of the circle of the bottom leave slivers behind the tool too."""
    cutter = FlatEnd(diameter=20, length=30).cutter
    engine = MeshEngine(box_stock((-22, -22, -10), (22, 22, 0)), 0.2)
    engine.cut(Sweep.along(cutter, Line((0, 0, 1), (0, 0, -1))))
    sweep = Sweep.along(cutter, Arc((0, 0, -1), (0, 0.5, -1), angle=3.0, rise=-1.0))
    engine.cut(sweep)
    at = np.array(
        [[7.563883, -6.381085, -1.629429], [9.908209, -1.558445, -1.881688], [6.976283, -6.671511, -1.763472]]
    )
    assert (sweep.signed_distance(at) < 0.0).all()
    assert all(is_accounted_for(engine, point) for point in at)


def test_what_a_chained_block_leaves_to_the_one_before_stays_accounted_for():
    """A disc that goes up after an arc in an upright plane: the top of its start has been narrowed away."""
    cutter = ProfileTool(points=[(4, 0), (4, 1.5), (1.5, 1.5)], length=30).cutter
    engine = MeshEngine(box_stock((0, 0, -10), (20, 20, 0)), 0.05)
    arc = Arc((10, 10, -6), (10, 10, -3), angle=-0.5, axis=1)
    p = arc.end
    engine.cut(Sweep.along(cutter, arc))
    engine.cut(Sweep.along(cutter, Line(p, p + [-0.75, -0.3, 1.3])))
    for x, y in ((14.2052343, 10.7750103), (13.0307682, 10.1689316), (14.5007221, 9.6862677)):
        assert is_accounted_for(engine, np.array([x, y, p[2] + 1.5 - 4e-4]))


def test_rings_of_round_tips_do_not_cross_themselves():
    """A volume taken twice would come out of the tip of the groove."""
    sweep = Sweep.along(TOOLS["ball"].cutter, Arc((10, 0, -1), (0, 0, -1), angle=2 * np.pi))
    *_, ring = pieces(sweep, facets(sweep.profile, 0.2, Side.INNER), None)
    solid = manifold(ring.points, ring.triangles)
    block = Manifold.cube((30, 30, 3)).translate((-15, -15, -3))
    assert abs(((block - solid) ^ solid).volume()) < 1e-9


@pytest.mark.parametrize("tool", ["ball", "bull", "dovetail"])
def test_what_blocks_with_a_shed_rear_leave_stays_accounted_for(tool):
    """Level blocks that turn, then straight on up and down, each from where the last one ended."""
    cutter = TOOLS[tool].cutter if tool in TOOLS else DOVETAIL
    rng = np.random.default_rng(11)
    engine = MeshEngine(box_stock((0, 0, -10), (20, 20, 0)), 0.1)
    at, heading, sweeps = np.array([6.0, 10.0, -3.0]), 0.0, []
    for k in range(24):
        level = k < 16
        heading += rng.choice([0.0, 0.4, -1.2, 2.8]) if level else 0.0
        step = np.array([np.cos(heading), np.sin(heading), 0.0 if level else rng.uniform(-0.6, 0.6)])
        sweeps.append(Sweep.along(cutter, Line(at, at + rng.choice([0.3, 1.5]) * step)))
        engine.cut(sweeps[-1])
        at = sweeps[-1].path.end
        heading += np.pi if not (3 < at[0] < 17 and 3 < at[1] < 17) else 0.0
    mesh = engine.whole().to_mesh64()
    a, b, c = (mesh.vert_properties[mesh.tri_verts[:, k], :3] for k in range(3))
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=1)
    which = rng.choice(len(a), 1500, p=size / size.sum())
    shares = rng.dirichlet([1.0, 1.0, 1.0], 1500)[..., None]
    points = (np.stack([a, b, c], axis=1)[which] * shares).sum(axis=1)
    points -= normal[which] / size[which, None] * rng.uniform(1e-3, 0.05, (1500, 1))
    gone = np.min([sweep.signed_distance(points) for sweep in sweeps], axis=0) < -1e-3
    assert gone.sum() > 20
    assert all(is_accounted_for(engine, point) for point in points[gone][:150])
