"""The published semi-finish of stairs in five axes, on a part of our own: the exact rule against the engines of a job."""

from __future__ import annotations

import re

import numpy as np
import pytest

import vmachining as vm
from tests.models.shipped import MODELS, generator
from tests.oracles import chips
from vmachining.engagement.analytic import engaged
from vmachining.feed import ChipAreaStrategy, FeedBlocks, FeedLimits, Parts, plan_feeds
from vmachining.force import edge_forces, shipped
from vmachining.job.predict import predict

MAKE = generator("semi_finish")
FOLDER = MODELS / "semi_finish"


def found_at(cutter, places, angles=720):
    """The exact rule on the stairs themselves."""
    where = MAKE.records(cutter).at(places, feed_mm_min=MAKE.FEED)
    phi = 2.0 * np.pi * np.arange(angles) / angles
    return engaged(
        MAKE.CUTTERS[cutter], MAKE.analytic(), where.tip, where.frame, phi, where.velocity, axis_rate=where.axis_rate
    )  # fmt: skip


def removed(cutter):
    """mm^3: the rate of removal, the integral of N . V over the engaged surface, over the time of the pass."""
    found, corner = MAKE.chips(cutter), MAKE.CUTTERS[cutter]
    density = chips.removal_density(found.lower, found.upper, found.speeds, corner.rm, corner.r)
    seconds = np.repeat(MAKE.records(cutter).lengths, 16) / 16.0 * 60.0 / MAKE.FEED
    rate = density.mean(axis=1) * 2.0 * np.pi
    return float((0.5 * (rate[1:] + rate[:-1]) * seconds).sum())


@pytest.mark.parametrize("name", ["bull.csv", "flat.csv"])
def test_program_is_what_its_generator_writes(name):
    assert (FOLDER / name).read_text(encoding="ascii") == MAKE.program(name.removesuffix(".csv"))


@pytest.mark.parametrize("cutter", ["bull", "flat"])
def test_the_pass_takes_the_published_time(cutter):
    assert MAKE.records(cutter).lengths.sum() / MAKE.FEED * 60.0 == pytest.approx(MAKE.SECONDS, abs=1e-5)


def test_the_rule_agrees_with_points_along_the_edge():
    """Chip area of the flat cutter by a hundred thousand points of its edges: inside of a step, N . V positive."""
    found = found_at("flat", [6.3, 21.7], angles=24)
    x, tops = MAKE.stairs()
    s = (np.arange(4000) + 0.5) / 4000 * MAKE.CUTTERS["flat"].flute
    for k in range(2):
        m, tip = found.frame[k], found.tip[k]
        phi = found.phi[0][:, None]
        e_r = np.sin(phi)[..., None] * m[:, 0] + np.cos(phi)[..., None] * m[:, 1]
        q = tip + 10.0 * e_r + s[:, None] * m[:, 2]
        v = found.velocity[k] + np.cross(np.cross(m[:, 2], found.axis_rate[k]), q - tip)
        step = np.clip(np.searchsorted(x, q[..., 0], side="right") - 1, 0, len(tops) - 1)
        inside = (
            (q[..., 0] >= x[0])
            & (q[..., 0] <= x[-1])
            & (np.abs(q[..., 1]) <= MAKE.HALF)
            & (q[..., 2] <= tops[step])
        )
        rate = np.where(inside, np.maximum((v * e_r).sum(axis=-1), 0.0), 0.0).sum(axis=1) * (s[1] - s[0])
        area = MAKE.PER_TOOTH * rate / np.linalg.norm(found.velocity[k])
        corner_only = found_no_bottom(found, k)
        np.testing.assert_allclose(area, corner_only, atol=2 * MAKE.PER_TOOTH * (s[1] - s[0]))


def found_no_bottom(found, k):
    """(m,) mm^2 of the same place without the disc inside the corner."""
    one = engaged(
        found.corner, MAKE.analytic(), found.tip[k], found.frame[k], found.phi[0], found.velocity[k],
        axis_rate=found.axis_rate[k], bottom=False,
    )  # fmt: skip
    return one.chip_area(MAKE.PER_TOOTH)[0]


@pytest.mark.parametrize(("file", "cutter"), [("job.toml", "bull"), ("flat.toml", "flat")])
def test_a_job_sees_the_chips_of_the_rule(file, cutter):
    """Contact of a job, by distances, at the stations of three blocks: both of their ends as well."""
    blocks = [4, 22, 42]  # the first block goes down beside the stock
    job = vm.Job.load(FOLDER / file)
    seen = predict(job, blocks).stations
    assert set(seen["at"]) >= {0.0, 1.0}
    for block, at, peak in seen.select("block", "at", "peak_n").iter_rows():
        # at its end a block is looked at 1e-4 mm before it, where its own motion counts
        exact = found_at(cutter, [block - 1 + min(at, 1.0 - 2e-5)])
        f = edge_forces(
            job.tools[1].cutter, shipped("aluminium_like_constant"), exact.phi[0], exact.lower, exact.upper,
            frame=exact.frame, velocity=exact.velocity, axis_rate=exact.axis_rate, feed_per_tooth=MAKE.PER_TOOTH, teeth=2,
        )  # fmt: skip
        # where an edge meets a wall the force jumps: the job takes the larger side, 720 angles stand up to 0.25 degrees beside
        assert peak == pytest.approx(f.resultant.max(), rel=0.02), (block, at)


@pytest.mark.parametrize("at", [0.0, 0.01, 0.5, 1.0])
def test_heights_over_cells_know_a_front_that_only_touches(at):
    """Where a block begins the front of the tool lies on what the block before it has cut."""
    exact = found_at("bull", [3.0 + min(at, 1.0 - 1e-9)], angles=360).chip_area(MAKE.PER_TOOTH).max()
    cells = vm.engage(vm.Job.load(FOLDER / "job.toml"), 4, at=at, method="analytic", pitch=0.05)
    assert MAKE.PER_TOOTH * cells.chip_per_feed.max() == pytest.approx(exact, rel=0.01)


@pytest.mark.parametrize("cutter", ["bull", "flat"])
def test_six_blocks_a_feed_save_what_their_areas_say(cutter):
    """The scheduler on the areas of the rule, and the rule of proportion written out."""
    length, area = MAKE.records(cutter).lengths, MAKE.largest_areas(cutter)
    n = len(length)
    rows = FeedBlocks(range(1, n + 1), ["cut"] * n, length, [MAKE.FEED] * n, np.ones(n))
    strategy = ChipAreaStrategy(Parts.whole(rows), area / MAKE.FEED, rows.groups)
    found = plan_feeds(rows, strategy, FeedLimits(min_mm_min=1.0, max_mm_min=1e5), every_blocks=6)
    assert found.total_exact_time_s == pytest.approx(MAKE.scheduled_seconds(cutter), rel=1e-12)
    assert len(np.unique(found.feed_mm_min)) <= 8  # 46 blocks in runs of six


@pytest.mark.slow  # 50 s: two simulations of 48 turning blocks
def test_the_demo_brackets_the_volume_and_keeps_the_reference(tmp_path):
    result = vm.run(FOLDER / "job.toml", out=tmp_path / "out")
    rows = result.blocks
    assert rows["proven"].all() and set(rows["engine"]) == {"columns"}
    # the tool comes down into the first step, which is no part of the pass
    way_down, over = rows[:1], rows[1:]
    lo, hi = over["removed_lo_mm3"].sum(), over["removed_hi_mm3"].sum()
    assert way_down["removed_lo_mm3"][0] > 0.0 and lo <= removed("bull") <= hi and hi - lo < 0.01 * hi
    feeds = rows["scheduled_feed_mm_min"].to_numpy()[1:47]  # block 0 goes down to the pass: a run of its own
    assert all(len(set(feeds[k : k + 6])) == 1 for k in range(0, 46, 6))


def test_the_jobs_keep_the_largest_chip_of_the_pass():
    for name, cutter in (("job.toml", "bull"), ("flat.toml", "flat")):
        reference = vm.Job.load(FOLDER / name).keys.feed.reference
        assert reference == pytest.approx(MAKE.largest_areas(cutter).max(), rel=1e-3)


def test_the_page_states_the_numbers_of_the_generator():
    page = (FOLDER / "README.md").read_text(encoding="utf-8")
    for line in MAKE.table().splitlines():
        for number in re.findall(r"\d+\.\d+(?= (?:mm|s,|%))", line):
            assert number in page, line
    assert f"| {removed('bull'):.1f} mm^3 | {removed('flat'):.1f} mm^3 |" in page
