"""Single vectors, spacings, features: closed forms and the tables of the sources, corrected where they are wrong."""

from __future__ import annotations

from math import acos, cos, degrees, hypot, pi, radians, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vmachining.arrays import Floats
from vmachining.engines.protocol import Options
from vmachining.engines.vectors import (
    NormalVectors,
    VectorEngine,
    VectorSettings,
    simulation_spacing,
    spacing_for,
    wall_angle,
)
from vmachining.engines.vectors.accuracy import representation_spacing
from vmachining.engines.vectors.along import Patches
from vmachining.engines.vectors.part import DesignPart, features
from vmachining.errors import InputError
from vmachining.geometry import Line
from vmachining.stock import BoxStock, MeshStock
from vmachining.sweep import Pose, Sweep
from vmachining.tool import BallNose, BullNose, FlatEnd, Profile
from vmachining.toolpath.facets import height_field

R = 5.0
BALL = BallNose(diameter=2 * R, length=60.0).cutter
LOW = -5.0


def vectors(point: Floats, normal: Floats, length: Floats, low: float = LOW) -> NormalVectors:
    """Vectors of given feet, directions and lengths: each stands on a facet without size."""
    point, normal = np.atleast_2d(np.asarray(point, float)), np.atleast_2d(np.asarray(normal, float))
    many, normal = len(point), normal / np.linalg.norm(normal, axis=1)[:, None]
    patches = Patches(
        np.repeat(point[:, None], 3, axis=1), normal, np.zeros(many, int), np.full(many, 4, np.uint8)
    )
    made = NormalVectors(patches, 1.0)
    made.set_ends(np.full(many, low), np.broadcast_to(length, many))
    return made


def block(start: list[float], end: list[float], cutter: Profile = BALL) -> Sweep:
    """The centre of the ball moves from start to end."""
    return Sweep.along(cutter, Line(np.array(start) - [0, 0, R], np.array(end) - [0, 0, R]))


LEVEL = block([-10, 0, 6], [10, 0, 6])
RAMP = block([-10, 0, 8], [10, 0, 4])
Y, N68 = [0, 0, 1], [0, 0.6, 0.8]


@pytest.mark.parametrize(
    ("sweep", "point", "normal", "length"),
    [  # spec E.6, and the closed forms behind it
        (LEVEL, [0, 0, 0], Y, 1.0),
        (LEVEL, [0, 3, 0], Y, 2.0),
        (LEVEL, [0, 0, 0], N68, 4.8 - sqrt(4.8**2 - 11.0)),
        (LEVEL, [12, 0, 0], Y, 6.0 - sqrt(21.0)),
        (LEVEL, [15, 0, 0], Y, 10.0),  # a touch
        (LEVEL, [0, 0, 2], Y, -1.0),
        (RAMP, [0, 0, 0], Y, 6.0 - R / cos(np.arctan(0.2))),
    ],
)
def test_reference_vectors(sweep: Sweep, point: list[float], normal: list[float], length: float) -> None:
    v = vectors(np.array(point), np.array(normal), np.array(10.0))
    v.cut(sweep)
    assert v.length[0] == np.float32(length)


def test_a_ball_at_rest_and_the_shank() -> None:
    v = vectors(np.array([3.0, 4.0, 0.0]), np.array(Y), np.array(20.0))
    v.cut(Sweep.along(BallNose(diameter=11.0, length=60.0).cutter, Line([0, 0, 4.5], [0, 0, 4.5])))
    assert v.length[0] == pytest.approx(10.0 - hypot(5.5, 0.0) + 5.5 - sqrt(5.5**2 - 25.0), abs=1e-6)
    v = vectors(np.array([0.0, 0.0, 20.0]), np.array([1.0, 0.0, 0.0]), np.array(4.0))
    v.cut(block([5.5, -10, 5], [5.5, 10, 5]))  # the ball misses the line, the shank does not
    assert v.length[0] == 0.5


@pytest.mark.parametrize(
    ("low", "length", "expected", "behind"),
    [(-3.0, 10.0, 10.0, 1), (-3.0, 4.0, -3.0, 0), (-6.0, 10.0, -4.0, 0), (-3.0, 7.0, 7.0, 1)],
)
def test_what_comes_from_behind(low: float, length: float, expected: float, behind: int) -> None:
    """A ball of radius 5 about x = 1 on the line: t_in = -4, t_out = 6."""
    v = vectors(np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array(length), low=low)
    v.cut(block([1, -1e-9, 0], [1, 1e-9, 0], BallNose(diameter=2 * R, length=2 * R).cutter))
    assert v.length[0] == pytest.approx(expected, abs=1e-6) and v.laid.behind[0] == behind


@pytest.mark.parametrize("low", [0.0, 1.0, 11.0])
def test_vectors_that_cannot_be(low: float) -> None:
    with pytest.raises(InputError, match="lambda"):
        vectors(np.zeros(3), np.array(Y), np.array(10.0), low=low)


def random_lines(seed: int, many: int = 400) -> tuple[Floats, Floats]:
    rng = np.random.default_rng(seed)
    normal = rng.normal(size=(many, 3))
    return rng.uniform(-20, 20, (many, 3)), normal / np.linalg.norm(normal, axis=1, keepdims=True)


SWEEPS = {
    "ball ramp": block([-6, 2, 1], [7, -3, 4]),
    "ball plunge": block([0, 0, 3], [0, 0, -4]),
    "flat": Sweep(FlatEnd(diameter=10.0, length=30.0), [-5, 0, -2], [6, 3, 1]),
    "bull, five axes": Sweep(
        BullNose(diameter=12.0, corner_radius=2.0, length=30.0),
        Pose((-5, 0, 0), (0.28, 0, 0.96)),
        Pose((5, 2, 1), (-0.28, 0.0, 0.96)),
    ),
}


@pytest.mark.parametrize("name", SWEEPS)
def test_lengths_are_those_of_exact_rays(name: str) -> None:
    """Half an ulp of float32 beside `Sweep.ray_intervals`, whose engine is another one for ball cutters."""
    sweep = SWEEPS[name]
    point, normal = random_lines(3)
    v = vectors(point, normal, np.array(15.0))
    v.cut(sweep)
    rays = sweep.ray_intervals(v.laid.point, v.laid.normal)
    first = np.cumsum(rays.counts) - rays.counts
    wanted = np.full(len(point), 15.0)
    for k in np.flatnonzero(rays.counts):
        for j in range(first[k], first[k] + rays.counts[k]):
            enter, leave = rays.enter[j], rays.leave[j]
            if LOW < enter < wanted[k]:
                wanted[k] = enter
            elif enter < LOW and leave >= wanted[k]:
                wanted[k] = LOW
    assert (wanted < 15.0).sum() > 20
    assert (np.abs(v.length - wanted) <= 0.5 * np.spacing(np.abs(wanted).astype(np.float32)) + 1e-9).all()


def plate(part: MeshStock | None = None, top: float = 3.0, **how: object) -> VectorEngine:
    """A plate 20 x 10, wanted up to z = 0, of a block up to `top`."""
    return VectorEngine(
        BoxStock((0, 0, -5), (20, 10, top)),
        Options(design=part or box((0, 0, -5), (20, 10, 0)), vectors=VectorSettings(**how)),  # type: ignore[arg-type]
    )


def box(lo: tuple[float, float, float], hi: tuple[float, float, float]) -> MeshStock:
    return MeshStock(*BoxStock(lo, hi).mesh(1.0)[0])


def test_upright_lengths_of_all_cutters_are_those_of_exact_rays() -> None:
    for sweep in SWEEPS.values():
        engine = plate(mode="dvv", pitch=0.5, spacing=1.0)
        engine.cut(sweep, 0)
        x, y = (
            engine.upright.low[k] + (np.arange(n) + 0.5) * 0.5 for k, n in enumerate(engine.upright.shape)
        )
        places = np.stack(np.meshgrid(x, y, [0.0], indexing="ij"), axis=-1).reshape(-1, 3)
        rays = sweep.ray_intervals(places, (0, 0, 1))
        wanted = np.full(len(places), 3.0)
        has = rays.counts > 0
        enter = rays.enter[(np.cumsum(rays.counts) - rays.counts)[has]]
        wanted[has] = np.clip(enter, -5.0, 3.0)  # through the plate: consumed
        got = engine.upright.lengths[0, 0][: len(x), : len(y)].reshape(-1)
        assert np.abs(got - wanted).max() <= 2.0**-23 + 1e-9  # float32 up to 5


@settings(max_examples=15, deadline=None)
@given(st.permutations(range(6)), st.integers(0, 1000))
def test_lengths_fall_and_do_not_depend_on_the_order(order: list[int], seed: int) -> None:
    rng = np.random.default_rng(seed)
    ends = rng.uniform([-2, -2, 4], [22, 12, 7], (6, 2, 3))
    point, normal = random_lines(seed, 60)
    normal[:, 2] = np.abs(normal[:, 2])  # up: nothing is entered from behind
    one, two = (vectors(point, normal, np.array(30.0), low=-60.0) for _ in range(2))
    for k in range(6):
        before = one.length.copy()
        one.cut(block(*ends[k].tolist()))
        assert (one.length <= before).all()
    for k in order:
        two.cut(block(*ends[k].tolist()))
    assert (one.length == two.length).all()


def test_volumes_of_blocks_add_up_and_a_second_cut_takes_nothing() -> None:
    engine = plate(mode="dvv", pitch=0.1, spacing=1.0)
    sweep = Sweep(FlatEnd(diameter=4.0, length=30.0), [-4, 5, 1], [24, 5, 1])
    touched = engine.touch(sweep)
    first, again = engine.cut(sweep, 0), engine.cut(sweep, 1)
    assert touched == first and not first.proven
    assert first.lo <= 20 * 4 * 2 <= first.hi and again.hi == 0.0
    assert engine.volume.estimate + first.estimate == pytest.approx(engine.stock_volume.estimate, rel=1e-12)


def test_no_facet_is_missed_at_the_border_of_a_tile() -> None:
    """A plane of 1,200 facets under eight tiles, and beyond the part the stock."""
    x, y = np.linspace(0.0, 20.0, 31), np.linspace(0.0, 10.0, 21)
    mesh = height_field(x, y, 0.1 * x[:, None] + 0.05 * y, bottom=-5.0)
    engine = VectorEngine(
        BoxStock((-3, 0, -6), (20, 10, 3)),
        Options(
            design=MeshStock(mesh.vertices, mesh.triangles), vectors=VectorSettings(mode="dvv", pitch=0.1)
        ),
    )
    seen = 0
    for base, lengths, x, y in engine.upright.tiles():
        has = ~np.isnan(lengths)
        plane = np.broadcast_to(0.1 * x[:, None] + 0.05 * y, has.shape)
        on = has & (x > 0.0)[:, None]
        assert np.abs(base.start[on] - plane[on]).max(initial=0.0) < 1e-12 and (base.facet[on] >= 0).all()
        assert np.abs(base.low[on] + 5.0).max(initial=0.0) < 1e-12
        off = has & ~on
        assert (base.facet[off] < 0).all() and (base.start[off] == -6.0).all()
        seen += int(has.sum())
    assert seen == 230 * 100


def test_rows_are_those_that_deviate_most_however_few_are_kept() -> None:
    engine = plate(mode="dvv", pitch=0.1, spacing=1.0)
    engine.cut(block([-4, 2, 6], [24, 8, 4]), 0)
    every, few = engine.deviation(0.01, most=10**6), engine.deviation(0.01, most=150)
    assert len(every.kind) > 10_000 and len(few.kind) == 150
    assert (np.abs(few.deviation) == np.abs(every.deviation[:150])).all()
    assert every.summary | {"rows": 150} == few.summary


@pytest.mark.erratum(
    "book", "4-3, 4-4", "sqrt(6 R e - e_R^2), R the diameter", "sqrt(6 R e - 3 e^2), R the radius"
)
@pytest.mark.erratum("book", "table 4-1", "theta 76.5 and 54.6 degrees", "76.6 and 54.7 degrees")
@pytest.mark.erratum("book", "4.1.5", "accuracy 0.0025", "spacings of the table fit 0.001 with R = 5")
def test_spacings_of_the_sources() -> None:
    """Spec E.3: numbers, and the sagitta that they are made for."""
    for radius, error, spacing in (
        (5, 0.001, 0.173196),
        (5, 0.0025, 0.273827),
        (10, 0.005, 0.547654),
        (15, 0.005, 0.670764),
    ):
        found = simulation_spacing(error, radius)
        assert found == pytest.approx(spacing, abs=1e-6)
        assert radius - sqrt(radius**2 - found**2 / 3) == pytest.approx(error, rel=1e-9)
    assert representation_spacing(0.0025, 50) == pytest.approx(0.9999875, abs=1e-9)
    assert representation_spacing(0.001, 50) == pytest.approx(0.6324524, abs=1e-6)
    assert spacing_for(0.001, 5, 50) == pytest.approx(0.173196, abs=1e-6)
    for pitch, theta in ((0.025, 81.701), (0.04, 76.648), (0.05, 73.221), (0.1, 54.736), (0.01, 86.690)):
        assert degrees(wall_angle(pitch, sqrt(0.03))) == pytest.approx(theta, abs=1e-3)
    for bad in (
        lambda: wall_angle(0.2, 0.2),
        lambda: representation_spacing(6, 5),
        lambda: simulation_spacing(-1, 5),
    ):
        with pytest.raises(InputError):
            bad()


def test_features_of_a_box_on_a_stem() -> None:
    """A T: walls, an overhang under its bar, sharp edges all around but at the lowest face."""
    from manifold3d import Manifold

    body = Manifold.cube((4, 4, 5)).translate((3, 3, 0)) + Manifold.cube((10, 10, 2)).translate((0, 0, 4.5))
    mesh = body.to_mesh64()
    part = DesignPart(MeshStock(np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts, np.int64)))
    found = features(part, radians(75), radians(30))
    area = 0.5 * np.linalg.norm(
        np.cross(part.corners[:, 1] - part.corners[:, 0], part.corners[:, 2] - part.corners[:, 0]), axis=1
    )
    assert area[found.wall].sum() == pytest.approx(4 * 4 * 4.5 + 4 * 10 * 2)
    assert area[found.overhang].sum() == pytest.approx(100 - 16)
    length = np.linalg.norm(found.edge[:, 1] - found.edge[:, 0], axis=1).sum()
    assert length == pytest.approx(
        8 * 10 + 4 * 2 + 4 * 4.5 + 4 * 4
    )  # bar, its corners, stem, where they meet
    assert np.allclose(np.linalg.norm(found.edge_normal, axis=1), 1.0)


def test_normal_vectors_end_at_the_stock_at_the_part_and_at_the_far_side() -> None:
    """A slot 3 wide: vectors on its walls must not cross it; lambda is the way through the wall beside it."""
    from manifold3d import Manifold

    body = Manifold.cube((20, 10, 8)) - Manifold.cube((3, 10, 8)).translate((2, 0, 4))
    mesh = body.to_mesh64()
    design = MeshStock(np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts, np.int64))
    engine = VectorEngine(
        BoxStock((-1, 0, 0), (20, 10, 9)),
        Options(design=design, vectors=VectorSettings(pitch=0.5, spacing=1.0, depth=6.0)),
    )
    v, laid = engine.along, engine.along.laid
    at = np.isclose(laid.point[:, 0], 2.0) & np.isclose(laid.normal[:, 0], 1.0)
    assert at.any() and np.allclose(v.length[at], 3.0) and np.allclose(laid.low[at], -2.0)
    at = np.isclose(laid.point[:, 0], 0.0) & np.isclose(laid.normal[:, 0], -1.0)
    deep = laid.point[at][:, 2] < 4.0
    assert np.allclose(v.length[at], 1.0)
    assert np.allclose(laid.low[at][~deep], -2.0) and np.allclose(laid.low[at][deep], -6.0)


def test_theta_follows_from_both_spacings() -> None:
    engine = plate(pitch=0.5, spacing=1.0)
    assert engine.theta_v == pytest.approx(acos(0.5)) and engine.theta_v < pi / 2
    with pytest.raises(InputError, match="not below the spacing"):
        plate(pitch=1.0, spacing=1.0)
