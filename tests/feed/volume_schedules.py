"""Schedules by volume as the tests ask for them."""

from __future__ import annotations

from vmachining.feed import VolumeStrategy, plan_feeds, sampled
from vmachining.feed.strategy import Parts


def schedule_volume(blocks, limits, *, reference="auto", conservative=False):
    """One feed per block."""
    strategy = VolumeStrategy(Parts.whole(blocks), blocks.volumes(conservative), blocks.groups)
    return plan_feeds(blocks, strategy, limits, reference=reference)


def schedule_volume_inserting(blocks, samples, limits, *, conservative=False, air_mm3=1e-9, **options):
    """Several feeds in a block, by the volume along it."""
    return plan_feeds(blocks, sampled(blocks, samples, conservative, air_mm3), limits, insert=True, **options)
