"""The grid of rays: closed forms in its intervals, the order of its error, sums over rays, and the promises of the protocol."""

from __future__ import annotations

from itertools import pairwise
from math import log, pi
from pathlib import Path

import numpy as np
import pytest
from closedforms import FAMILIES, HI, LO, Case, cap, case_of, segment, slot
from scipy.stats import binom

from vmachining import BallNose, BullNose, FlatEnd, Sweep
from vmachining.engines.dexel import CONFIDENCE, DexelEngine
from vmachining.engines.protocol import NOTHING, Options, Removal, Request
from vmachining.errors import EngineError, InputError
from vmachining.geometry import Line
from vmachining.stock import BoxStock, CylinderStock, Stock
from vmachining.sweep import Pose
from vmachining.tool import Profile

BOX = BoxStock(LO, HI)
RISK = 1e-3
"""Probability that a true statement about a rate fails here."""


def engine_of(spacing: float, directions: int = 3, stock: Stock = BOX) -> DexelEngine:
    return DexelEngine(stock, Options(spacing=spacing, directions=directions))


def unit(x: float, y: float) -> np.ndarray:
    return np.array([x, y, 1.0]) / np.linalg.norm([x, y, 1.0])


def removed(case: Case, engine: DexelEngine) -> Removal:
    for sweep in case.earlier:
        engine.cut(sweep)
    total = NOTHING
    for sweep in case.block:
        total = total.plus(engine.cut(sweep))
    return total


@pytest.mark.parametrize(("spacing", "directions"), [(1.5, 3), (0.8, 1)])
def test_closed_forms_lie_in_the_interval_as_often_as_it_says(spacing: float, directions: int) -> None:
    seeds = range(30_000, 30_000 + 30 * len(FAMILIES))
    misses = 0
    for seed in seeds:
        case = case_of(seed)
        found = removed(case, engine_of(spacing, directions, case.stock or BOX))
        assert found.lo <= found.estimate <= found.hi and not found.proven
        misses += not found.lo <= case.truth <= found.hi
    assert misses <= binom.ppf(1.0 - RISK, len(seeds), 1.0 - CONFIDENCE)


def test_five_axis_blocks_against_the_flux_of_their_sweeps() -> None:
    """Random blocks of 5 to 40 mm inside of the stock remove their own volume, known to 1e-4 without any ray."""
    rng = np.random.default_rng(7)
    stock = BoxStock((-70, -70, -40), (70, 70, 70))
    for k in range(12):
        d = rng.uniform(6.0, 16.0)
        tool = (
            BallNose(diameter=d, length=30),
            FlatEnd(diameter=d, length=30),
            BullNose(diameter=d, corner_radius=d / 4, length=30),
        )[k % 3]
        way = rng.normal(size=3) * [1.0, 1.0, 0.3]
        way *= rng.uniform(5.0, 40.0) / np.linalg.norm(way)
        axes = [unit(*rng.uniform(-0.4, 0.4, 2)) for _ in range(2)]
        sweep = Sweep(tool, Pose((0, 0, 0), axes[0]), Pose(way, axes[1]))
        found = engine_of(2.0, stock=stock).cut(sweep, 0)
        truth = sweep.flux().volume
        assert found.lo <= truth <= found.hi
        assert found.estimate == pytest.approx(truth, rel=0.03)


def shapes() -> dict[str, tuple[Sweep, float]]:
    flat, ball = FlatEnd(diameter=10, length=30), BallNose(diameter=10, length=30)
    turned, depth = np.array([np.cos(0.3), np.sin(0.3), 0.0]), 4.0
    ends = -10.0 * turned, 10.0 * turned
    down = np.array([0.0, 0.0, depth])
    return {
        "slot": (Sweep.along(flat, Line(ends[0] - down, ends[1] - down)), depth * (200.0 + 25.0 * pi)),
        "slot along the raster": (Sweep.along(flat, Line((-10, 0, -depth), (10, 0, -depth))), depth * (200.0 + 25.0 * pi)),
        "groove": (Sweep.along(ball, Line(ends[0] - down, ends[1] - down)), 20.0 * segment(5.0, depth) + cap(5.0, depth)),
        "plunge": (Sweep.along(ball, Line((0.1, 0.2, 5), (0.1, 0.2, -3))), cap(5.0, 3.0)),
    }  # fmt: skip


@pytest.mark.parametrize("name", shapes())
def test_the_error_falls_with_the_power_three_halves_of_the_spacing(name: str) -> None:
    """Root mean square over places of the stock under the rays, three directions, spacings of 2 to 0.5 mm."""
    sweep, truth = shapes()[name]
    rng, errors = np.random.default_rng(0), []
    for spacing in (2.0, 1.0, 0.5):
        off = []
        for _ in range(24):
            shift = np.array([*rng.uniform(0.0, 2.0, 2), 0.0])
            found = engine_of(spacing, stock=BoxStock(LO - shift, HI)).touch(sweep)
            off.append(found.estimate / truth - 1.0)
        errors.append(float(np.sqrt(np.mean(np.square(off)))))
    order = log(errors[0] / errors[-1]) / log(4.0)
    assert order >= 1.5 - 0.35  # of 24 places, each error is known to a seventh: 0.2 of the order, twice
    assert errors[-1] < 0.01


def test_rays_lose_exactly_what_blocks_say() -> None:
    """Ramps, arcs of other blocks, undercuts: the sum over all blocks is what is gone from each direction, to rounding."""
    engine = engine_of(1.0)
    raw = [grid.lengths.copy() for grid in engine.grids]
    totals = np.zeros(3)
    for seed in range(2 * len(FAMILIES)):
        case = case_of(seed)
        for sweep in (*case.earlier, *case.block):
            for k, grid in enumerate(engine.grids):
                before = grid.lengths
                around = np.concatenate([np.zeros(3), np.eye(3).reshape(-1), [0.0, 1e3, -1e3, 1e3]])
                totals[k] += grid.removed(sweep, around, seed, cut=True).volume / grid.lattice.cell
                assert (grid.lengths <= before).all()
    for k, grid in enumerate(engine.grids):
        assert totals[k] == pytest.approx(float((raw[k] - grid.lengths).sum()), rel=1e-9)


def test_a_prism_leaves_out_no_ray_that_matters() -> None:
    """With the prism around the sweep or with everything: the same lengths, for turning tools and arcs too."""
    from vmachining.engines.dexel.around import stadium

    everything = np.concatenate([np.zeros(3), np.eye(3).reshape(-1), [0.0, 1e3, -1e3, 1e3]])
    tool = BullNose(diameter=8, corner_radius=2, length=30)
    sweeps = [Sweep(tool, Pose((-9, 3, -6), unit(0.3, 0.1)), Pose((12, -4, -9), unit(-0.2, 0.3)))]
    sweeps += [case_of(seed).block[0] for seed in range(len(FAMILIES))]
    for sweep in sweeps:
        one, other = engine_of(1.0), engine_of(1.0)
        for grid, same in zip(one.grids, other.grids, strict=True):
            grid.removed(sweep, stadium(sweep, 0.0), 0, cut=True)
            same.removed(sweep, everything, 0, cut=True)
            assert (grid.lengths == same.lengths).all()


def test_air_is_proven_and_what_was_cut_is_not_cut_again() -> None:
    case = slot(np.random.default_rng(3))
    engine = engine_of(0.5)
    before = engine.touch(case.block[0])
    first, again = engine.cut(case.block[0], 0), engine.cut(case.block[0], 1)
    assert before.estimate == pytest.approx(first.estimate, rel=1e-12)
    assert again.estimate == again.lo == 0.0 and case.truth <= first.hi and first.lo <= case.truth
    lifted = Sweep.along(case.block[0].profile.shifted(50.0), case.block[0].path)
    assert engine.cut(lifted, 2) == Removal(0.0, 0.0, 0.0, proven=True)
    whole = engine.stock_volume.estimate
    assert engine.volume.estimate == pytest.approx(whole - first.estimate, rel=1e-12)
    assert engine.volume.lo <= whole - case.truth <= engine.volume.hi


def test_undercut_leaves_material_above_the_tool() -> None:
    """A T-slot cutter, 20 mm wide and 4 high below a neck of 8: the slot it leaves is closed above beside the neck."""
    tool = Profile([(0, 0), (10, 0), (10, 4), (4, 4), (4, 30)])
    engine = engine_of(0.5, stock=BoxStock((0, -20, -15), (40, 20, 0)))
    found = engine.cut(Sweep.along(tool, Line((-15, 0, -10), (60, 0, -10))), 0)
    truth = 40.0 * (20.0 * 4.0 + 8.0 * 6.0)
    assert found.lo <= truth <= found.hi and found.estimate == pytest.approx(truth, rel=0.005)
    assert int(engine.grids[0].lists.parts.max()) == 2


def test_an_interrupted_engine_goes_on_as_if_nothing_happened(tmp_path: Path) -> None:
    case = case_of(1)
    engine = engine_of(1.0)
    for sweep in case.earlier:
        engine.cut(sweep, 0)
    engine.save(tmp_path / "checkpoint.npz")
    again = DexelEngine.load(tmp_path / "checkpoint.npz")
    assert again.cut(case.block[0], 1) == engine.cut(case.block[0], 1)
    assert again.volume == engine.volume and (again.surface().block == engine.surface().block).all()
    (tmp_path / "bad").write_bytes(b"no checkpoint")
    with pytest.raises(EngineError, match="cannot be read: it is not a checkpoint"):
        DexelEngine.load(tmp_path / "bad")


def test_a_round_stock_is_seen_alike_from_all_sides() -> None:
    engine = engine_of(0.25, stock=CylinderStock((1.0, 2.0), 10.0, (-5.0, 0.0)))
    for grid in engine.grids:
        assert grid.raw.sum() * grid.lattice.cell == pytest.approx(500.0 * pi, rel=2e-3)


def test_a_spacing_that_does_not_fit_is_refused_with_one_that_does() -> None:
    with pytest.raises(
        InputError, match=r"rays at a spacing of 1e-05 mm need .* GB, and .* GB can be had"
    ) as told:
        engine_of(1e-5)
    spacing = float(str(told.value.remedy).split()[2].strip(","))
    assert 1e-4 < spacing < 0.5
    with pytest.raises(InputError, match="directions = 2"):
        engine_of(1.0, directions=2)


def edges_of(triangles: np.ndarray) -> np.ndarray:
    """Directed edges that lack their opposite, 0 in a closed surface."""
    ends = np.concatenate([triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
    n = int(triangles.max()) + 1
    forth, back = np.sort(ends[:, 0] * n + ends[:, 1]), np.sort(ends[:, 1] * n + ends[:, 0])
    return np.flatnonzero(forth != back)


@pytest.mark.parametrize("directions", [1, 3])
def test_the_surface_is_closed_and_knows_its_blocks(directions: int) -> None:
    engine = engine_of(0.7, directions, stock=BoxStock((-20, -20, -12), (20, 20, 0)))
    for k, (sweep, _) in enumerate(shapes().values()):
        engine.cut(sweep, k)
    found = engine.surface()
    assert not len(edges_of(found.triangles))
    a, b, c = found.vertices[found.triangles].transpose(1, 0, 2)
    volume = float((a * np.cross(b, c)).sum() / 6.0)
    assert volume == pytest.approx(engine.volume.estimate, rel=2e-3 if directions == 3 else 0.01)
    assert set(np.unique(found.block).tolist()) >= {-1, 0, 1}
    own = found.vertices[found.triangles[found.block == 0]].mean(axis=1)
    assert (
        np.abs(shapes()["slot"][0].signed_distance(own)).max() < 1.5 * 0.7
    )  # half a cell of the raster, and the places within


def test_edges_of_the_stock_are_sharp() -> None:
    """Planes through ends of rays meet in the edges and corners of a box; means of ends would cut them off by half a cell."""
    found = engine_of(1.0, stock=BoxStock((-20, -20, -12), (20, 20, 0))).surface()
    a, b, c = found.vertices[found.triangles].transpose(1, 0, 2)
    assert float((a * np.cross(b, c)).sum() / 6.0) == pytest.approx(40.0 * 40.0 * 12.0, rel=2e-4)


def test_vertices_come_nearer_with_the_spacing() -> None:
    """Below the rim of a groove a vertex is a mean of points of the surface, within a cell: off by (cell)^2 / (8 R) or so, but
    for ends that the shifts of the rays bring from next door."""
    sweep, _ = shapes()["groove"]
    off = []
    for spacing in (1.0, 0.25):
        engine = engine_of(spacing, stock=BoxStock((-20, -20, -12), (20, 20, 0)))
        engine.cut(sweep, 0)
        found = engine.surface()
        own = found.vertices[np.unique(found.triangles[found.block == 0])]
        off.append(float(np.sqrt(np.mean(sweep.signed_distance(own[own[:, 2] < -1.0]) ** 2))))
    assert off[0] < 0.1 and off[1] < off[0] / 4.0


@pytest.mark.parametrize("directions", [1, 3])
def test_many_blocks_at_once_are_the_same_blocks(directions: int) -> None:
    """Ball, flat and bull nose, ramps, plunges, air and retraces, an undercut, asked one by one and all together."""
    rng = np.random.default_rng(5)
    tools = (
        BallNose(diameter=9, length=60),
        FlatEnd(diameter=7, length=60),
        BullNose(diameter=8, corner_radius=2, length=60),
    )
    requests = []
    for tool in tools:
        tips = np.column_stack([rng.uniform(-20, 20, (12, 2)), rng.uniform(-6, 2, 12)])
        tips[3, :2], tips[6] = tips[2, :2], tips[4]
        requests += [Request(Sweep(tool, a, b), len(requests) + k) for k, (a, b) in enumerate(pairwise(tips))]
        requests.append(Request(requests[-1].sweep, cuts=False))
    wide = Profile([(0, 0), (6, 0), (6, 3), (2, 3), (2, 30)])  # an undercut, on level lines
    tips = np.column_stack([rng.uniform(-20, 20, (8, 2)), np.full(8, -9.0)])
    requests += [Request(Sweep(wide, a, b), len(requests) + k) for k, (a, b) in enumerate(pairwise(tips))]
    tips = np.column_stack(
        [rng.uniform(-20, 20, (8, 2)), rng.uniform(-8, -2, 8)]
    )  # rays of several intervals
    requests += [Request(Sweep(tools[0], a, b), len(requests) + k) for k, (a, b) in enumerate(pairwise(tips))]
    small = BoxStock((-20, -20, -10), (20, 20, 0))
    one, other = engine_of(0.5, directions, small), engine_of(0.5, directions, small)
    apart = [one.cut(r.sweep, r.block) if r.cuts else one.touch(r.sweep) for r in requests]
    for found, wanted in zip(other.answer(requests), apart, strict=True):
        # threads leave out differences between their rows, which are in the weights of three directions
        assert found.estimate == pytest.approx(
            wanted.estimate, rel=1e-9 if directions == 1 else 1e-3, abs=1e-9
        )
        assert found.lo <= wanted.estimate <= found.hi
    for grid, same in zip(one.grids, other.grids, strict=True):
        assert np.abs(grid.lengths - same.lengths).max() < 1e-9
        (points, blocks, _), (_, owners, _) = one.ends(), other.ends()
        assert (
            len(points) == len(owners) and (blocks == owners).mean() > 0.97
        )  # where two blocks share a surface
    assert other.volume.estimate == pytest.approx(one.volume.estimate, rel=1e-4)


def test_a_polyline_in_one_call() -> None:
    """Passes across the whole stock, links outside: the volume is that of the scallops' profile, in closed form."""
    r, pitch, depth, size = 5.0, 2.5, 1.0, 30.0
    x = np.arange(-6.0, 37.0, 1.0)
    tips = np.concatenate([
        np.column_stack([x if k % 2 else x[::-1], np.full(len(x), k * pitch), np.full(len(x), -depth)]) for k in range(13)
    ])  # fmt: skip
    engine = engine_of(0.1, 1, BoxStock((0, 0, -8), (size, size, 0)))
    found = engine.cut_path(BallNose(diameter=2 * r, length=60), tips)
    y = np.linspace(0.0, pitch / 2.0, 20_001)
    profile = depth - r + np.sqrt(r * r - y * y)
    truth = size * size * float(np.trapezoid(profile, y)) / (pitch / 2.0)
    total = sum(each.estimate for each in found)
    assert len(found) == len(tips) - 1 and total == pytest.approx(truth, rel=2e-4)
    assert engine.volume.lo <= size * size * 8.0 - truth <= engine.volume.hi
