"""Which earlier sweeps a block needs, and where it can take something: nothing is missed beside them."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.brep_chains import bar_of, chain_of
from vmachining import BallNose, FlatEnd, Sweep
from vmachining.engines.dexel.rays.lengths import material
from vmachining.engines.mesh import MeshEngine
from vmachining.engines.protocol import Options
from vmachining.geometry import Line
from vmachining.stock import BoxStock
from vmachining.sweep.candidates import columns
from vmachining.sweep.near import SweepIndex


def sweeps_of(number: int) -> tuple[np.ndarray, list[Sweep]]:
    """Box of the stock and sweeps of a chain of the gauntlet."""
    bar = np.array(bar_of([number]))
    return bar, chain_of(1, number, MeshEngine.of(BoxStock(*bar), Options(chord=1.0))).sweeps


def test_only_sweeps_that_reach_the_region_are_subtracted() -> None:
    tool = FlatEnd(diameter=10, length=40)
    far = [Line((-10, y, -1), (40, y, -1)) for y in (-15.0, 15.0)]
    buried = [Line((-10, 0, -1), (40, 0, -1)), Line((-10, 0, -2), (40, 0, -2))]
    sweeps = [Sweep.along(tool, path) for path in (*far, *buried, Line((-10, 2, -3), (40, 2, -3)))]
    needed = SweepIndex(sweeps).needed(4, np.array([[0, -20, -20], [30, 20, 0]], dtype=float))
    assert needed[0] == 3 and set(needed) <= {2, 3}  # the deeper slot first; the far ones not at all


def test_a_pass_needs_the_last_one_and_few_before_it() -> None:
    """What two equal balls share beside the one halfway between them lies in that one: distances to axes are convex."""
    tool, box = BallNose(diameter=10, length=40), np.array([[0, -20, -20], [30, 20, 0]], dtype=float)
    passes = [Sweep.along(tool, Line((-10, y, -2), (40, y, -2))) for y in range(8)]
    needed = SweepIndex(passes).needed(7, box)
    assert 6 in needed and len(needed) <= 2


@pytest.mark.parametrize(
    "number", [2, 5, 17, *(pytest.param(n, marks=pytest.mark.long) for n in (4, 13, 97))]
)
@pytest.mark.slow  # 7 s
def test_sweeps_that_are_not_needed_take_nothing_from_what_is_left(number: int) -> None:
    """Random points of a block in the stock: those in any earlier sweep are in one that is needed."""

    bar, sweeps = sweeps_of(number)
    index, rng, held = SweepIndex(sweeps), np.random.default_rng(number), 0
    for k, sweep in enumerate(sweeps):
        low, high = np.maximum(sweep.bounds[0], bar[0]), np.minimum(sweep.bounds[1], bar[1])
        points = low + rng.random((20000, 3)) * (high - low)
        points = points[sweep.signed_distance(points) < 0.0]
        needed = index.needed(k, bar)
        inside = {j: sweeps[j].signed_distance(points) < 0.0 for j in index.meets(np.stack([low, high]), k)}
        any_one = np.any([*inside.values(), np.zeros(len(points), dtype=bool)], axis=0)
        assert not any_one[~np.any([*(inside[j] for j in needed), ~any_one], axis=0)].any()
        held += int(any_one.sum())
    assert held > 1000


@pytest.mark.parametrize("number", [0, 1, 2, 3, 5, pytest.param(6, marks=pytest.mark.long)])
def test_a_block_takes_nothing_beside_its_columns(number: int) -> None:
    """Chains of the gauntlet, one family each: places all over the sweep, and what uprights lose there, as deep as is said."""
    bar, sweeps = sweeps_of(number)
    rng, seen = np.random.default_rng(number), 0
    for k in range(1, min(len(sweeps), 8)):
        sweep, earlier = sweeps[k], sweeps[:k]
        box = np.stack([np.maximum(sweep.bounds[0], bar[0]), np.minimum(sweep.bounds[1], bar[1])])
        places = rng.uniform(box[0, :2], box[1, :2], (4000, 2))
        lost = material(sweep, earlier, BoxStock(*box), places)
        found = columns(sweep, earlier, box, 3000)
        keys = np.round((found.low - box[0, :2]) / found.side).astype(int).tolist()
        raster = {tuple(key): tall for key, tall in zip(keys, found.tall.tolist(), strict=True)}
        assert len(raster) == len(found.low)
        stands = np.floor((places[lost > 1e-9] - box[0, :2]) / found.side).astype(int).tolist()
        assert all(tuple(key) in raster for key in stands)
        assert all(
            deep <= raster[tuple(key)] for key, deep in zip(stands, lost[lost > 1e-9].tolist(), strict=True)
        )
        assert len(found.low) * found.side.prod() < 1.001 * np.ptp(box[:, :2], axis=0).prod()
        seen += len(stands)
    assert seen > 300
