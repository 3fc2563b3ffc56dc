"""Columns divided among several processes: brackets of parts add up to proven brackets of the whole."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from referee import ball, bull, flat

from benchmarks.columns_counts import BAR, counted
from benchmarks.columns_counts.programs import drawn
from vmachining.engines.columns import ColumnsEngine, FlatStock
from vmachining.engines.columns.goal import goal_of
from vmachining.engines.protocol import Removal, Share
from vmachining.geometry import Arc, Line
from vmachining.stock import CylinderStock, Triangles
from vmachining.sweep import Sweep

BOX = FlatStock((-20.0, -20.0, -40.0), (40.0, 20.0, 0.0))


class Parts:
    """What so many processes do, in this one."""

    def __init__(self, engine: ColumnsEngine, parts: int, folder) -> None:
        engine.save(folder / "start.npz")
        self.whole = engine
        self.parts = [ColumnsEngine.load(folder / "start.npz", share=Share(k, parts)) for k in range(parts)]

    def cut(self, sweep: Sweep, block: int | None = None) -> Removal:
        return self.whole.summed([part.cut(sweep, block) for part in self.parts])

    def touch(self, sweep: Sweep) -> Removal:
        return self.whole.summed([part.touch(sweep) for part in self.parts])

    def joined(self, folder) -> ColumnsEngine:
        for k, part in enumerate(self.parts):
            part.save(folder / f"{k}.npz")
        return ColumnsEngine.join([ColumnsEngine.load(folder / f"{k}.npz") for k in range(len(self.parts))])


@given(
    st.lists(st.tuples(st.floats(0, 10), st.floats(1e-3, 1)), min_size=1, max_size=5),
    st.floats(1e-4, 0.1),
    st.floats(0, 10),
)
@settings(deadline=None)
def test_parts_that_are_as_narrow_as_they_should_be_make_a_block_that_is(parts, relative, absolute):
    """Whatever the volumes of the parts are: the sum of their widths is at most max(relative * volume, absolute).

    (A part that has no tiles of the block has nothing of its volume either.)
    """
    tiles, widths = sum(share for _, share in parts), 0.0
    for volume, share in parts:
        goal = goal_of(relative, absolute, share / tiles)
        wide = goal.relative * volume
        widths += max(wide - goal.less, goal.weight * wide + goal.floor)
    asked = max(relative * sum(volume for volume, _ in parts), absolute)
    assert widths <= asked * (1 + 1e-12)


@pytest.mark.parametrize("parts", [2, 3])
@pytest.mark.parametrize("make", [ball, bull, flat])
def test_slots_and_rings_of_parts_hold_the_closed_form(make, parts, tmp_path):
    """A turned slot, a plunge at its end, half a ring: each asked once more, nothing is left."""
    tool, r, _ = make()
    engine = ColumnsEngine(BOX, 1e-3, 0.0)
    work, alone = Parts(engine, parts, tmp_path), ColumnsEngine(BOX, 1e-3, 0.0)
    ways = (
        Line((0, 0, -7), (12, 9, -7)),
        Line((12, 9, 1), (12, 9, -11)),
        Arc((12, 9, -7), (12, 0, -7), angle=-pi),
        Line((12, -9, -7), (-12, -9, -2)),
    )
    total = np.zeros(3)
    for block, way in enumerate(ways):
        sweep = Sweep.along(tool, way)
        before, found = work.touch(sweep), work.cut(sweep, block)
        one = alone.cut(sweep, block)
        assert found.note is None
        assert max(found.lo, before.lo, one.lo) <= min(found.hi, before.hi, one.hi)
        assert found.width <= 1e-3 * found.estimate
        assert work.cut(sweep, block).hi <= 1e-6
        total += found.bracket
    joined = work.joined(tmp_path)
    v = joined.volume
    assert v.lo <= alone.volume.hi and alone.volume.lo <= v.hi
    assert total[0] <= BOX.volume - v.lo and BOX.volume - v.hi <= total[2]
    if make is flat:  # the slot alone
        slot = ColumnsEngine(BOX, 1e-3, 0.0)
        work = Parts(slot, parts, tmp_path)
        found = work.cut(Sweep.along(tool, ways[0]))
        assert found.lo <= 7.0 * (2 * r * 15 + pi * r * r) <= found.hi


@pytest.mark.parametrize("seed", [3, 20, 37])
def test_a_random_program_in_parts_against_counts(seed, tmp_path):
    """Random programs: the sum of the parts against columns of the referee, which shares no code with any engine."""
    program = drawn(seed)
    work = Parts(ColumnsEngine(program.stock, 0.02, 1e-3), 2, tmp_path)
    rng = np.random.default_rng(seed)
    for k, sweep in enumerate(program.sweeps):
        found = work.cut(sweep, k)
        volume, error = counted(program, k, found.hi, 24, rng)
        assert found.lo - BAR * error <= volume <= found.hi + BAR * error


def test_parts_go_on_after_they_were_joined_and_divided_again(tmp_path):
    """Cut in two parts, join, cut in three, join, cut alone: the surface is that of a workpiece that was never divided."""
    tool, _, _ = ball()
    rows = [Line((-10, y, -1 - 0.1 * y), (30, y, -2)) for y in (0.0, 1.0, 2.0)]
    alone = ColumnsEngine(BOX, 0.01)
    engine = ColumnsEngine(BOX, 0.01)
    for block, (parts, way) in enumerate(zip((2, 3, 1), rows, strict=True)):
        sweep = Sweep.along(tool, way)
        alone.cut(sweep, block)
        if parts == 1:
            engine.cut(sweep, block)
        else:
            work = Parts(engine, parts, tmp_path)
            work.cut(sweep, block)
            engine = work.joined(tmp_path)
    assert engine.volume.lo <= alone.volume.hi and alone.volume.lo <= engine.volume.hi
    one, other = engine.surface(), alone.surface()
    assert np.array_equal(np.unique(one.block), np.unique(other.block))
    assert np.abs(one.vertices.max(axis=0) - other.vertices.max(axis=0)).max() < 1e-9
    again = Sweep.along(tool, Line((-9, 1.5, -1.5), (25, 0.5, -1.9)))
    mine, theirs = engine.touch(again), alone.touch(again)
    assert max(mine.lo, theirs.lo) <= min(mine.hi, theirs.hi)


def test_a_round_bar_in_parts_stays_round(tmp_path):
    """A plunge beside its axis, on the side that sorts first: what is left is the bar less a cylinder."""
    tool, r, _ = flat()
    bar = FlatStock.of(CylinderStock((2.0, 1.0), 15.0, (-40.0, 0.0)))
    work = Parts(ColumnsEngine(bar, 0.01), 2, tmp_path)
    work.cut(Sweep.along(tool, Line((-3, 0, 1), (-3, 0, -3))), 0)
    joined = work.joined(tmp_path)
    left = pi * (15.0**2 * 40.0 - r**2 * 3.0)
    assert joined.volume.lo <= left <= joined.volume.hi and joined.volume.width < 1e-3 * left
    shown = joined.surface()
    assert Triangles(shown.vertices, shown.triangles).volume == pytest.approx(left, rel=2e-3)


def test_a_block_that_cannot_be_as_narrow_says_so_once_it_is_summed(tmp_path):
    """1e-9 of a ramp is asked: a part alone says nothing to the user, the sum says what was reached."""
    tool, _, _ = bull()
    work = Parts(ColumnsEngine(BOX, 1e-9, 0.0), 2, tmp_path)
    found = work.cut(Sweep.along(tool, Line((-10, -3, -2), (10, 5, -6))))
    assert found.note is not None and "1e-07 % or 0 mm3 as requested" in found.note
    assert f"{100 * found.width / found.estimate:.3g} %" in found.note


def test_parts_that_keep_different_sweeps_are_joined(tmp_path):
    """Plunges here and there: a part forgets those that lie in squares of others, and the whole knows them all."""
    tool, _, _ = ball(2.0)
    work = Parts(ColumnsEngine(BOX, 0.01, tile_mm=1.0), 3, tmp_path)
    places = [(x, y) for x in (-15.0, 0.0, 11.0, 33.0) for y in (-15.0, 1.0, 14.0)]
    plunges = [Sweep.along(tool, Line((x, y, 1), (x, y, -3))) for x, y in places]
    for block, sweep in enumerate(plunges):
        assert work.cut(sweep, block).lo > 0.0
    for part in work.parts:
        part.tidy()
    assert all(part.kept < len(places) for part in work.parts)
    joined = work.joined(tmp_path)
    assert joined.in_use().tolist() == list(range(len(plunges)))
    assert all(joined.cut(sweep).hi <= 1e-6 for sweep in plunges)
