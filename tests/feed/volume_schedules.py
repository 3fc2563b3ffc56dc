"""Schedules by volume as the tests ask for them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from vmachining.feed import VolumeStrategy, plan_feeds, sampled
from vmachining.feed.strategy import Parts


def schedule_volume(blocks, limits, *, reference="auto", conservative=False):
    """One feed per block."""
    strategy = VolumeStrategy(Parts.whole(blocks), blocks.volumes(conservative), blocks.groups)
    return plan_feeds(blocks, strategy, limits, reference=reference)


class Samples(NamedTuple):
    """Equal samples of every block, one after the other. offset : (n + 1,) where those of a block begin."""

    volume_mm3: Any
    offset: Any


def schedule_volume_inserting(blocks, samples, limits, **options):
    """Several feeds in a block, by the volume along it."""
    strategy = sampled(blocks, samples.volume_mm3, np.diff(samples.offset).astype(np.int64))
    return plan_feeds(blocks, strategy, limits, insert=True, **options)
