"""Chip area and force behind the same protocol: reference numbers, and what any correct schedule keeps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vmachining.errors import FeedError
from vmachining.feed import (
    ChipAreaStrategy,
    FeedBlocks,
    FeedLimits,
    ForceStrategy,
    Parts,
    VolumeStrategy,
    plan_feeds,
)
from vmachining.force import feasible_feeds, peak_levels

WIDE = FeedLimits(min_mm_min=0.1, max_mm_min=1e6)


def blocks(lengths, feeds, tool=None):
    n = len(lengths)
    return FeedBlocks(range(1, n + 1), ["cut"] * n, lengths, feeds, np.ones(n), tool=tool)


def force_rows(a, b, per_feed=1.0):
    """p, q, r of |a f + b|^2."""
    a = np.asarray(a, dtype=float) * per_feed
    return np.array([[a @ a, a @ np.asarray(b), np.asarray(b) @ np.asarray(b)]])


def test_chip_areas_of_the_specification():
    """Twelve segments of 0.5 mm in two blocks of six: 3000 and 3750 mm/min, 0.12 s become 0.108 s."""
    area = np.array([0.9, 2.0, 1.1, 0.8, 0.6, 0.5, 0.9, 1.6, 1.2, 0.4, 0.2, 0.1, 0.3])
    g = np.array([area[0:7].max(), area[6:13].max()]) / 3000
    rows = blocks([3.0, 3.0], [3000, 3000])
    strategy = ChipAreaStrategy(Parts.whole(rows), g, rows.groups)
    found = plan_feeds(rows, strategy, WIDE)
    np.testing.assert_allclose(found.exact_mm_min, [3000, 3750], rtol=1e-14)
    assert found.total_old_time_s == pytest.approx(0.12) and found.total_time_s == pytest.approx(0.108)
    assert found.reference == pytest.approx(2.0) and found.unit == "mm²"


@pytest.mark.parametrize("shared", [{"every_blocks": 6}, {"every_mm": 3.0}])
def test_six_blocks_share_a_feed(shared):
    """The same areas with a block for every segment: shared ends belong to both, each block has its larger one."""
    area = np.array([0.9, 2.0, 1.1, 0.8, 0.6, 0.5, 0.9, 1.6, 1.2, 0.4, 0.2, 0.1, 0.3])
    rows = blocks([0.5] * 12, [3000] * 12)
    strategy = ChipAreaStrategy(Parts.whole(rows), np.maximum(area[:-1], area[1:]) / 3000, rows.groups)
    found = plan_feeds(rows, strategy, WIDE, **shared)
    np.testing.assert_allclose(found.exact_mm_min, [3000] * 6 + [3750] * 6, rtol=1e-14)
    assert found.total_time_s == pytest.approx(0.108)


def test_what_ends_a_run_of_blocks_that_share_a_feed():
    """A rapid, another tool and a line that is run twice; the rest is counted anew after each."""
    kind = ["cut"] * 3 + ["rapid"] + ["cut"] * 7
    line = [1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 10]
    tool = [1] * 6 + [2] * 5
    load = np.array([1, 2, 4, 0, 2, 1, 4, 1, 4, 2, 1]) / 100.0
    rows = FeedBlocks(line, kind, [1.0] * 11, [100.0] * 11, [1.0] * 11, tool=tool)
    strategy = ChipAreaStrategy(Parts.whole(rows), load, np.zeros(11, dtype=int))
    found = plan_feeds(rows, strategy, WIDE, every_blocks=2)
    np.testing.assert_allclose(found.feed_mm_min, [200, 200, 100, 100, 200, 200, 100, 100, 100, 100, 400])
    with pytest.raises(FeedError, match="not both"):
        plan_feeds(rows, strategy, WIDE, every_blocks=2, insert=True)


def test_a_plunge_does_not_hold_the_pass_that_follows():
    """Its limit is its programmed feed; the two blocks of the pass, a quarter of its load, get four times as much."""
    load, caps = np.array([4, 1, 1]) / 100.0, [100.0, np.inf, np.inf]
    rows = FeedBlocks(
        [1, 2, 3],
        ["cut"] * 3,
        [1.0] * 3,
        [100.0] * 3,
        [1.0] * 3,
        cap_mm_min=caps,
        plunge=[True, False, False],
    )
    strategy = ChipAreaStrategy(Parts.whole(rows), load, np.zeros(3, dtype=int))
    np.testing.assert_allclose(plan_feeds(rows, strategy, WIDE, every_blocks=3).feed_mm_min, [100, 400, 400])


def test_force_limited_feed_of_the_specification():
    """Flat slot a = 5, constant coefficients, |F_xy| <= 3000 N, one tooth: f = 0.76730652255858."""
    # at phi: F_xy^2 = (Ft^2 + Fr^2) with Ft = (700 f sin + 25) 5, Fr = (250 f sin + 18) 5; largest at 90 degrees
    rows = np.concatenate(
        [force_rows([700 * 5 * s, 250 * 5 * s], [125, 90]) for s in np.sin(np.linspace(0, np.pi, 91))]
    )
    first, last = np.array([0]), np.array([len(rows)])
    f = feasible_feeds(rows, first, last, np.array([3000.0**2]))
    assert f[0] == pytest.approx(0.76730652255858, rel=1e-13)
    assert np.sqrt(peak_levels(rows, first, last, f)[0]) == pytest.approx(3000.0, rel=1e-13)


def test_a_limit_below_the_edge_forces_has_no_feed():
    rows = force_rows([100, 0, 0], [60, 80, 0])
    assert feasible_feeds(rows, np.array([0]), np.array([1]), np.array([99.0**2]))[0] == 0.0
    assert feasible_feeds(rows, np.array([0]), np.array([0]), np.array([1.0]))[0] == np.inf
    block = blocks([10.0], [600])
    strategy = ForceStrategy(Parts.whole(block), rows, np.array([0]), np.array([1]), block.groups)
    assert strategy.least[0] == pytest.approx(100.0)
    found = plan_feeds(block, strategy, FeedLimits(min_mm_min=50, max_mm_min=1000), reference=99.0)
    assert found.feed_mm_min[0] == 50 and found.limit[0] == "min"


def test_each_tool_has_its_own_reference():
    rows = blocks([10.0, 10.0, 10.0], [100, 100, 100], tool=[1, 1, 2])
    strategy = ChipAreaStrategy(Parts.whole(rows), np.array([1.0, 4.0, 2.0]) / 100, rows.groups)
    found = plan_feeds(rows, strategy, WIDE)
    np.testing.assert_allclose(found.feed_mm_min, [400, 100, 100])
    assert found.references == {1: 4.0, 2: 2.0}


@pytest.mark.parametrize("options", [{"reference": "mean"}, {"rule": "mean", "reference": 1.0}])
def test_peaks_have_no_mean(options):
    rows = blocks([10.0], [100])
    strategy = ChipAreaStrategy(Parts.whole(rows), np.array([0.01]), rows.groups)
    with pytest.raises(FeedError, match="has no mean"):
        plan_feeds(rows, strategy, WIDE, **options)


@st.composite
def jobs(draw):
    """Blocks with parts of a fixed step, and a strategy of each kind on them."""
    n = draw(st.integers(1, 6))
    lengths = draw(st.lists(st.floats(0.3, 20.0), min_size=n, max_size=n))
    rows = blocks(lengths, draw(st.lists(st.floats(50.0, 3000.0), min_size=n, max_size=n)))
    parts = Parts.stepped(rows, np.full(n, 0.5))
    m = len(parts.end)
    number = st.just(0.0) | st.floats(0.01, 5.0)
    load = np.array(draw(st.lists(number, min_size=m, max_size=m)))
    edge = np.array(draw(st.lists(number, min_size=m, max_size=m)))
    kind = draw(st.sampled_from(["volume", "chip area", "force"]))
    group = rows.groups[parts.block]
    if kind == "volume":
        return rows, VolumeStrategy(parts, load * parts.length, group)
    if kind == "chip area":
        return rows, ChipAreaStrategy(parts, load / 1e3, group)
    cuts = load > 0
    quads = np.concatenate(
        [force_rows([a / 1e3, a / 2e3, 0], [e, 0, e]) for a, e in zip(load, edge, strict=True)]
    )
    at = np.arange(m)
    return rows, ForceStrategy(parts, quads, at, at + cuts, group)


@given(job=jobs(), tau=st.floats(0.0, 1.0))
@settings(deadline=None, max_examples=120)
def test_what_every_strategy_keeps(job, tau):
    rows, strategy = job
    limits = FeedLimits(min_mm_min=10.0, max_mm_min=5000.0)
    found = plan_feeds(rows, strategy, limits, insert=True, tau=tau)
    # 1: the path stays, ends of blocks are hit exactly
    assert (found.sub_end[found.sub_offset[1:] - 1] == 1.0).all()
    np.testing.assert_allclose(np.bincount(found.sub_block, found.sub_length_mm), rows.length_mm, rtol=1e-12)
    # 3: between the limits
    assert (found.sub_feed_mm_min >= 10.0).all() and (found.sub_feed_mm_min <= 5000.0).all()
    # 10: the reference is the largest load as it was, so no block is slower
    assert (found.sub_exact_mm_min >= rows.feed_mm_min[found.sub_block] * (1 - 1e-9)).all() or (
        rows.feed_mm_min > 5000.0
    ).any()
    # safe: no part exceeds the reference, unless the smallest feed binds
    start = np.searchsorted(found.sub_block + found.sub_end, strategy.parts.block + strategy.parts.end - 1e-9)
    feed = found.sub_exact_mm_min[np.minimum(start, len(found.sub_end) - 1)]
    over = strategy.loads(feed) > found.reference * (1 + 1e-9)
    assert not (over & (feed > 10.0 * (1 + 1e-9))).any()
    # 8: with a given reference the original feeds do not matter
    goal = found.reference or 1.0
    other = blocks(rows.length_mm, rows.feed_mm_min * 0.5 + 7.0)
    one = plan_feeds(rows, strategy, limits, reference=goal, insert=True, tau=tau)
    two = plan_feeds(other, strategy, limits, reference=goal, insert=True, tau=tau)
    np.testing.assert_array_equal(one.sub_exact_mm_min, two.sub_exact_mm_min)
    # 9: finer is never slower
    finer = plan_feeds(rows, strategy, limits, reference=goal, insert=True, tau=tau / 2)
    assert finer.total_exact_time_s <= one.total_exact_time_s * (1 + 1e-12)
    # 11: air is crossed at the upper limit
    whole = plan_feeds(rows, strategy, limits, reference=goal)
    air = ~np.array(
        [
            strategy.cuts[a:b].any()
            for a, b in zip(strategy.parts.offset[:-1], strategy.parts.offset[1:], strict=True)
        ]
    )
    assert (whole.feed_mm_min[air] == 5000.0).all()


@given(
    load=st.floats(0.01, 5.0), more=st.floats(1.0, 3.0), edge=st.floats(0.0, 2.0), goal=st.floats(2.5, 50.0)
)
@settings(deadline=None)
def test_a_bigger_load_never_gets_a_bigger_feed(load, more, edge, goal):
    quads = np.concatenate([force_rows([a, 0.3 * a, 0], [edge, 0, edge / 2]) for a in (load, load * more)])
    first = np.array([0, 1])
    one, two = feasible_feeds(quads, first, first + 1, np.full(2, goal**2))
    assert two <= one * (1 + 1e-12)
