"""Feeds that can be computed by hand or with a closed form of the removed area."""

from __future__ import annotations

import numpy as np
import pytest
from volume_schedules import Samples, schedule_volume, schedule_volume_inserting

from vmachining.errors import FeedError
from vmachining.feed import (
    FeedBlocks,
    FeedLimits,
    Limit,
    floor_feed,
    sampled,
)
from vmachining.nc.rewrite import BlockEdit

SIX = FeedBlocks(range(1, 7), ["cut"] * 6, [5.0] * 6, [600.0] * 6, [20, 20, 50, 50, 0, 35])
WIDE = FeedLimits(min_mm_min=200, max_mm_min=2000)


def test_six_blocks():
    schedule = schedule_volume(SIX, WIDE, reference=6000)
    np.testing.assert_allclose(schedule.exact_mm_min, [1500, 1500, 600, 600, 2000, 6000 / 7], rtol=1e-14)
    assert schedule.feed_mm_min.tolist() == [1500, 1500, 600, 600, 2000, 857.1]
    assert schedule.total_exact_time_s == pytest.approx(1.9, rel=1e-14)
    assert schedule.total_old_time_s == pytest.approx(3.0, rel=1e-14)
    assert schedule.limit == (Limit.NONE,) * 4 + (Limit.AIR, Limit.NONE)
    assert schedule.edits()[6] == BlockEdit(6, (857.1,), (1.0,))


def slot_entry(samples=20, radius=5.0, depth=2.0, length=10.0):
    """Volume of each sample of a flat end mill entering the side of a block: swept area to penetration u."""
    u = np.linspace(0, length, samples + 1)
    inside = np.clip(radius - u, 0, radius)
    area = radius**2 * np.arccos(inside / radius) - inside * np.sqrt(radius**2 - inside**2)
    area += np.where(u > radius, 2 * radius * (u - radius), 0)
    return depth * np.diff(area)


def entry(tau, rule):
    volume = slot_entry()
    blocks = FeedBlocks([1], ["cut"], [10.0], [600.0], [volume.sum()])
    return schedule_volume_inserting(
        blocks, Samples(volume, [0, 20]), FeedLimits(min_mm_min=100, max_mm_min=1500),
        reference=12000, tau=tau, rule=rule,
    )  # fmt: skip


def test_slot_entry_volumes():
    volume = slot_entry()
    np.testing.assert_allclose(volume[:3], [2.936295344, 5.238760096, 6.599886570], atol=5e-10)
    assert volume.sum() == pytest.approx(178.53981633974, abs=1e-10)


def test_slot_entry_with_inserted_blocks():
    schedule = entry(0.25, "safe")
    np.testing.assert_allclose(schedule.sub_end * 10, [0.5, 1, 1.5, 2.5, 5, 10], rtol=1e-14)
    want = [1500, 1145.309174365, 909.106533376, 719.038079617, 601.003179867, 600]
    np.testing.assert_allclose(schedule.sub_exact_mm_min, want, atol=5e-10)
    assert schedule.sub_feed_mm_min.tolist() == [1500, 1145.3, 909.1, 719.0, 601.0, 600]
    assert schedule.total_exact_time_s == pytest.approx(0.912220755, abs=5e-10)
    assert schedule.inserted == 5
    assert schedule.feed_mm_min[0] == pytest.approx(600 / schedule.total_time_s)


def test_slot_entry_finer_and_by_the_mean():
    fine = entry(0.1, "safe")
    assert len(fine.sub_end) == 7
    assert fine.total_exact_time_s == pytest.approx(0.906011916, abs=5e-10)
    for tau in (0.25, 0.1):
        assert entry(tau, "mean").total_exact_time_s == pytest.approx(0.898017605, abs=5e-10)


def test_automatic_references():
    assert schedule_volume(SIX, WIDE).reference == pytest.approx(6000)
    assert schedule_volume(SIX, WIDE, reference="max").reference == pytest.approx(6000)
    mean = schedule_volume(SIX, FeedLimits(max_mm_min=1e6), reference="mean")
    assert mean.reference == pytest.approx(175 / (25 / 600))
    cuts = SIX.volume_mm3 > 0
    assert mean.exact_time_s[cuts].sum() == pytest.approx(mean.old_time_s[cuts].sum())


def test_the_conservative_schedule_uses_the_upper_end_of_the_bracket():
    blocks = FeedBlocks([1, 2], ["cut"] * 2, [5, 5], [600] * 2, [20, 0], [25, 1])
    assert schedule_volume(blocks, WIDE, reference=6000, conservative=True).feed_mm_min.tolist() == [
        1200,
        2000,
    ]
    with pytest.raises(FeedError, match="volume_hi_mm3"):
        schedule_volume(SIX, WIDE, conservative=True)


def test_only_cuts_get_a_feed():
    blocks = FeedBlocks(
        [1, 2, 3, 4, 5],
        ["rapid", "cut", "other", "cut", "cut"],
        [50, 5, 5, 0, 5],
        [np.nan, 600, 500, 400, 7000],
        [0, 20, 20, 0, 20],
    )
    schedule = schedule_volume(blocks, WIDE, reference=6000)
    np.testing.assert_array_equal(schedule.feed_mm_min, [np.nan, 1500, 500, 400, 1500])
    assert schedule.scheduled.tolist() == [False, True, False, False, True]
    assert sorted(schedule.edits()) == [2, 5]
    assert schedule.total_time_s == pytest.approx(60 * (5 / 1500 + 5 / 500 + 5 / 1500))


def test_every_limit_has_its_word():
    blocks = FeedBlocks(
        range(1, 8), ["cut"] * 7, [5.0] * 7, [600.0] * 7, [20, 0, 1, 20, 500, 500, 0],
        cap_mm_min=[np.inf, np.inf, np.inf, 700, np.inf, 150, 150],
    )  # fmt: skip
    schedule = schedule_volume(blocks, WIDE, reference=6000)
    assert schedule.limit == (
        Limit.NONE, Limit.AIR, Limit.MAX, Limit.AXIS, Limit.MIN, Limit.INFEASIBLE_MIN, Limit.INFEASIBLE_MIN
    )  # fmt: skip
    assert schedule.feed_mm_min.tolist() == [1500, 2000, 2000, 700, 200, 150, 150]


def test_a_line_that_runs_twice_gets_its_smallest_feed():
    blocks = FeedBlocks(
        [1, 2, 1, 3, 3], ["cut", "cut", "cut", "cut", "rapid"], [5] * 5, [600] * 5, [20, 20, 40, 20, 0]
    )
    schedule = schedule_volume(blocks, WIDE, reference=6000)
    assert schedule.feed_mm_min.tolist() == [750, 1500, 750, 600, 600]
    assert schedule.edits() == {1: BlockEdit(1, (750.0,), (1.0,)), 2: BlockEdit(2, (1500.0,), (1.0,))}
    samples = Samples([1, 19, 1, 39, 1, 1], [0, 2, 2, 4, 5, 6])
    inserted = schedule_volume_inserting(blocks, samples, WIDE, reference=6000)
    assert inserted.inserted == 0


def test_nothing_cut_means_all_air():
    blocks = FeedBlocks([1, 2], ["cut", "cut"], [5, 5], [600, np.nan], [0, 0])
    for reference in ("auto", "mean", 500.0):
        schedule = schedule_volume(blocks, WIDE, reference=reference)
        assert schedule.feed_mm_min.tolist() == [2000, 2000]
    assert schedule_volume(FeedBlocks([], [], [], [], []), WIDE).edits() == {}
    empty = schedule_volume_inserting(FeedBlocks([], [], [], [], []), Samples([], [0]), WIDE)
    assert (empty.total_time_s, empty.limit, empty.inserted) == (0.0, (), 0)


def test_neighbours_written_alike_become_one_block():
    blocks = FeedBlocks([1], ["cut"], [16.0], [600.0], [7 * 10.0])
    samples = Samples([0] * 9 + [10.0] * 7, [0, 16])
    schedule = schedule_volume_inserting(blocks, samples, WIDE, reference=6000)
    assert (schedule.sub_end * 16).tolist() == [9, 16]
    assert schedule.sub_feed_mm_min.tolist() == [2000, 600]


def test_samples_shorter_than_the_shortest_block():
    blocks = FeedBlocks([1, 2], ["cut"] * 2, [1.0, 0.4], [600.0] * 2, [11.0, 11.0])
    samples = Samples([10, 1, 0, 0, 10, 1], [0, 4, 6])
    schedule = schedule_volume_inserting(blocks, samples, WIDE, reference=6000, min_length_mm=0.5)
    assert schedule.sub_end.tolist() == [0.5, 1.0, 1.0]
    exact = schedule_volume_inserting(blocks, samples, WIDE, reference=6000, min_length_mm=0.25)
    assert exact.sub_end.tolist() == [0.25, 0.5, 1.0, 1.0]


def test_rounding_goes_down_but_not_off_the_step():
    assert floor_feed([857.1999, 857.1, 0.1 * 3, 1200.0]).tolist() == [857.1, 857.1, 0.3, 1200.0]
    every = np.arange(1, 40000) / 10
    np.testing.assert_array_equal(floor_feed(every), every)


def test_a_smallest_feed_between_two_steps_is_kept():
    blocks = FeedBlocks([1], ["cut"], [5.0], [600.0], [1e6])
    assert (
        schedule_volume(blocks, FeedLimits(min_mm_min=60.05, max_mm_min=90), reference=1).feed_mm_min[0]
        == 60.1
    )


@pytest.mark.parametrize(
    ("limits", "text"),
    [
        ({"min_mm_min": float("nan"), "max_mm_min": 5}, "min_mm_min is nan"),
        ({"max_mm_min": float("inf")}, "max_mm_min is inf"),
        ({"min_mm_min": -1, "max_mm_min": 5}, "min_mm_min is -1"),
        ({"min_mm_min": 10, "max_mm_min": 5}, "min_mm_min 10 is above max_mm_min 5"),
    ],
)
def test_impossible_limits_are_refused(limits, text):
    with pytest.raises(FeedError, match=text):
        FeedLimits(**limits)


@pytest.mark.parametrize("reference", [0, -5.0, float("nan"), float("inf"), "best", True])
def test_impossible_references_are_refused(reference):
    with pytest.raises(FeedError, match="reference"):
        schedule_volume(SIX, WIDE, reference=reference)


@pytest.mark.parametrize(
    ("column", "value", "text"),
    [
        ("length_mm", [1, float("nan")], "8: length_mm is nan"),
        ("length_mm", [1, -1], "8: length_mm is -1"),
        ("volume_mm3", [1, -1], "8: volume_mm3 is -1"),
        ("volume_mm3", [1], "expected shape"),
        ("feed_mm_min", [1, 0], "8: feed_mm_min is 0"),
        ("feed_mm_min", [1], "feed_mm_min: expected shape"),
        ("kind", ["cut", "plunge"], "'plunge' is not one of"),
        ("kind", ["cut"], "kind: expected shape"),
        ("cap_mm_min", [1, 0], "8: cap_mm_min is 0"),
        ("volume_hi_mm3", [5, 0.5], "8: volume_hi_mm3 is below"),
    ],
)
def test_impossible_blocks_are_refused(column, value, text):
    columns = {
        "line": [7, 8],
        "kind": ["cut", "cut"],
        "length_mm": [1, 1],
        "feed_mm_min": [1, 1],
        "volume_mm3": [1, 1],
    }
    with pytest.raises(FeedError, match=text):
        FeedBlocks(**{**columns, column: value})


def test_noise_below_zero_is_zero():
    assert FeedBlocks([1], ["cut"], [1], [1], [-1e-12]).volume_mm3.tolist() == [0.0]


def test_impossible_samples_are_refused():
    for volume, counts in (([1, 1, 1], [2]), ([-1.0], [1]), ([np.nan], [1])):
        with pytest.raises(FeedError, match="sample volume_mm3"):
            sampled(FeedBlocks([1], ["cut"], [5], [600], [3]), volume, np.array(counts))
    samples = Samples([1, 1, 1], [0, 3])
    with pytest.raises(FeedError, match="samples are for 1 blocks"):
        schedule_volume_inserting(SIX, samples, WIDE)
    one = FeedBlocks([1], ["cut"], [5], [600], [3])
    for option, value in (("tau", -1.0), ("min_length_mm", 0.0), ("rule", "fast")):
        with pytest.raises(FeedError, match=option):
            schedule_volume_inserting(one, samples, WIDE, **{option: value})


def test_an_automatic_reference_wants_feeds():
    blocks = FeedBlocks([9], ["cut"], [5], [np.nan], [3])
    with pytest.raises(FeedError, match="9: a block that cuts has no feed"):
        schedule_volume(blocks, WIDE)
    assert schedule_volume(blocks, WIDE, reference=600).feed_mm_min[0] == 1000


def test_a_cap_that_leaves_nothing_is_refused():
    blocks = FeedBlocks([9], ["cut"], [5], [600], [3], cap_mm_min=[0.05])
    with pytest.raises(FeedError, match="9: the cap leaves less than"):
        schedule_volume(blocks, WIDE)
