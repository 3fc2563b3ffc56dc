"""What a run has cost: seconds of every stage, and memory."""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

STAGES = ("read", "cut", "contact", "plan", "judge", "check", "files")
"""In their order: program and stock; removed volumes; contact, chips and forces; feeds and the program with them; second opinions
of exact rays; the B-rep engine; tables, surface and report."""


class Spent:
    """Wall time by stage. A stage within another one is not counted twice; nothing is counted outside of all.

    seconds : {stage: s}, of earlier processes that worked on the same run, too. workers_mb : peak of other processes.
    """

    def __init__(self, earlier: Mapping[str, float] | None = None) -> None:
        self.seconds = dict(earlier or {})
        self.workers_mb = 0.0
        self._under_way: list[str] = []
        self._since = 0.0

    def _count(self) -> None:
        now = time.perf_counter()
        if self._under_way:
            stage = self._under_way[-1]
            self.seconds[stage] = self.seconds.get(stage, 0.0) + now - self._since
        self._since = now

    @contextmanager
    def on(self, stage: str) -> Iterator[None]:
        """The time within is that of a stage."""
        self._count()
        self._under_way.append(stage)
        try:
            yield
        finally:
            self._count()
            self._under_way.pop()

    def add(self, earlier: Mapping[str, float]) -> None:
        """Time of earlier processes."""
        for stage, seconds in earlier.items():
            self.seconds[stage] = self.seconds.get(stage, 0.0) + seconds

    def summary(self) -> dict[str, Any]:
        """Keys of summary.json, up to now."""
        self._count()
        order = {stage: self.seconds[stage] for stage in STAGES if stage in self.seconds}
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        own = peak / (1024.0 * 1024.0 if sys.platform == "darwin" else 1024.0)
        return {
            "seconds": sum(self.seconds.values()),
            "stage_seconds": order,
            "peak_mb": own + self.workers_mb,
        }


def in_words(stage_seconds: Mapping[str, float]) -> str:
    """Such as "cut 2.1 s, contact 0.6 s"; stages below a hundredth of the whole are left out."""
    least = 0.01 * sum(stage_seconds.values())
    return ", ".join(
        f"{stage} {seconds:.2g} s" if seconds < 100 else f"{stage} {seconds:.0f} s"
        for stage, seconds in stage_seconds.items()
        if seconds >= least
    )
