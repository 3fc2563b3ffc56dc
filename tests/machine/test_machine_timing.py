"""Block times: hand-computed profiles, and the laws every time model keeps."""

from __future__ import annotations

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vmachining.errors import FeedError, KinematicsError
from vmachining.machine import MachineLimits, block_times, feed_path_ratio

A500 = MachineLimits(max_acceleration_mm_s2=500.0)
programs = st.lists(
    st.tuples(st.sampled_from([0.0, 0.01, 0.5, 3.0, 40.0]), st.floats(10, 5000), st.booleans()),
    min_size=1,
    max_size=30,
)


def times(length, feed, limits=A500, rapid=None, **more):
    return block_times(length, feed, [False] * len(length) if rapid is None else rapid, limits, **more)


@pytest.mark.parametrize(
    ("length", "feed", "want"),
    [
        # one block: 0.1 s up, 0.1 s down, 5 of the 10 mm in between at 50 mm/s
        ([10.0], [3000.0], [0.3]),
        ([10.0, 2.0, 10.0], [3000.0, 600.0, 3000.0], [0.282, 0.2, 0.282]),
        # never reaches its feed: 2 sqrt(L / a)
        ([0.5], [3000.0], [0.06324555320336758]),
    ],
)
def test_profiles_by_hand(length, feed, want):
    np.testing.assert_allclose(times(length, feed).accelerated_s, want, rtol=1e-14)


def test_blocks_without_length_are_transparent():
    plain = times([10.0, 2.0, 10.0], [3000.0, 600.0, 3000.0])
    padded = times([0, 10.0, 0, 0, 2.0, 10.0, 0], [1, 3000.0, 1, np.nan, 600.0, 3000.0, 1])
    np.testing.assert_array_equal(padded.accelerated_s[[1, 4, 5]], plain.accelerated_s)
    assert padded.total_accelerated_s == plain.total_accelerated_s


def test_a_stop_and_a_dwell_bring_the_axes_to_rest():
    through = times([10.0, 10.0], [3000.0, 3000.0])
    stopped = times([10.0, 10.0], [3000.0, 3000.0], stop=[True, False])
    dwelt = times([10.0, 0.0, 10.0], [3000.0, np.nan, 3000.0], dwell_s=[0, 1.5, 0])
    np.testing.assert_allclose(through.accelerated_s, [0.25, 0.25])
    np.testing.assert_allclose(stopped.accelerated_s, [0.3, 0.3])
    np.testing.assert_allclose(dwelt.accelerated_s, [0.3, 1.5, 0.3])
    np.testing.assert_allclose(dwelt.ideal_s, [0.2, 1.5, 0.2])
    # before the first motion there is nothing to stop
    np.testing.assert_allclose(times([0, 10.0], [1, 3000.0], dwell_s=[2, 0]).accelerated_s, [2.0, 0.3])


def test_rapids_and_caps():
    limits = MachineLimits(rapid_mm_min=6000.0, max_feed_mm_min=1200.0)
    result = block_times(
        [10, 10, 10], [np.nan, 3000, 3000], [True, False, False], limits, cap_mm_min=[9, 6e9, 60]
    )
    np.testing.assert_allclose(result.ideal_s, [0.1, 0.5, 10.0])
    assert np.isnan(result.junction_mm_s).all()
    unlimited = block_times([10], [np.nan], [True], MachineLimits())
    assert unlimited.total_ideal_s == 0.0
    np.testing.assert_allclose(
        block_times([10], [np.nan], [True], A500).accelerated_s, [2 * np.sqrt(10 / 500)]
    )


@settings(max_examples=200, deadline=None)
@given(program=programs)
def test_accelerated_times_are_never_shorter_and_obey_the_limits(program):
    length, feed, rapid = (np.array(column) for column in zip(*program, strict=True))
    limits = MachineLimits(max_acceleration_mm_s2=700.0, rapid_mm_min=9000.0)
    result = block_times(length, feed, rapid, limits)
    assert (result.accelerated_s >= result.ideal_s * (1 - 1e-12)).all()
    speed = np.where(rapid, 9000.0, feed) / 60
    moving = length > 0
    for side in (result.junction_mm_s[:-1], result.junction_mm_s[1:]):
        assert (side[moving] <= speed[moving] * (1 + 1e-12)).all()
    change = np.abs(np.diff(result.junction_mm_s**2))
    assert (change <= 2 * 700.0 * length * (1 + 1e-9) + 1e-9).all()
    assert result.junction_mm_s[0] == result.junction_mm_s[-1] == 0.0
    # driven backwards it takes as long
    back = block_times(length[::-1], feed[::-1], rapid[::-1], limits)
    np.testing.assert_allclose(back.accelerated_s[::-1], result.accelerated_s, rtol=1e-9, atol=1e-12)


@settings(max_examples=50, deadline=None)
@given(program=programs, parts=st.integers(2, 6))
def test_cutting_a_block_into_pieces_of_equal_feed_keeps_the_time(program, parts):
    length, feed, _ = (np.array(column) for column in zip(*program, strict=True))
    whole = times(length, feed)
    pieces = times(np.repeat(length / parts, parts), np.repeat(feed, parts))
    assert pieces.total_accelerated_s == pytest.approx(whole.total_accelerated_s, rel=1e-9)


def test_a_hundred_thousand_blocks_take_well_below_a_second():
    rng = np.random.default_rng(1)
    n = 100_000
    length, feed, rapid = rng.uniform(0.1, 2, n), rng.uniform(100, 4000, n), rng.random(n) < 0.1
    times([1.0], [1.0])
    begin = time.perf_counter()
    block_times(length, feed, rapid, A500)
    assert time.perf_counter() - begin < 1.0


def test_feed_path_ratio():
    assert feed_path_ratio([3.0, 1.0, 4.0], [False, True, True]) == 3 / 8
    assert feed_path_ratio([], []) == 0.0


def test_bad_columns_are_refused():
    with pytest.raises(FeedError, match="block 1 has length 2 mm and feed nan"):
        times([1.0, 2.0], [100.0, np.nan])
    with pytest.raises(FeedError, match="shape"):
        times([1.0, 2.0], [100.0])
    with pytest.raises(FeedError, match="cap"):
        times([1.0], [100.0], cap_mm_min=[0.0])
    with pytest.raises(KinematicsError, match="negative"):
        times([-1.0], [100.0])
    with pytest.raises(KinematicsError, match="dwell"):
        times([1.0], [100.0], dwell_s=[-1.0])
    with pytest.raises(KinematicsError, match="stop"):
        times([1.0], [100.0], stop=[True, False])


def test_accelerations_of_single_blocks():
    """One block at 500 as before; the next at 2000: 5 mm at 50 mm/s from 50 to rest, ramp of 0.625 mm."""
    alone = times([10.0], [3000.0])
    np.testing.assert_array_equal(
        times([10.0], [3000.0], acceleration_mm_s2=[np.inf]).accelerated_s, alone.accelerated_s
    )
    np.testing.assert_array_equal(
        times([10.0], [3000.0], MachineLimits(), acceleration_mm_s2=[500.0]).accelerated_s,
        alone.accelerated_s,
    )
    two = times([10.0, 5.0], [3000.0, 3000.0], MachineLimits(), acceleration_mm_s2=[500.0, 2000.0])
    # up to 50 mm/s in 0.1 s over 2.5 mm, 7.5 mm steady; then 4.375 mm steady and 0.025 s down
    np.testing.assert_allclose(two.accelerated_s, [0.1 + 0.15, 4.375 / 50 + 0.025], rtol=1e-14)
    # a block without a limit changes its speed at once
    free = times([10.0, 5.0], [3000.0, 3000.0], MachineLimits(), acceleration_mm_s2=[500.0, np.inf])
    np.testing.assert_allclose(free.accelerated_s, [0.25, 0.1], rtol=1e-9)
    with pytest.raises(KinematicsError, match="one positive value per block"):
        times([10.0], [3000.0], acceleration_mm_s2=[0.0])
