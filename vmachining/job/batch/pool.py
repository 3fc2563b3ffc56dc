"""What does jobs for a batch, seen from `run_many`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple, Protocol, TypeAlias

from vmachining.job.batch.one import Order, Row

JobProgress: TypeAlias = Callable[[int, str, int, int], None]
"""Called with the number of the job, the name of its stage, blocks done and blocks in all."""


class Ended(NamedTuple):
    """A job that is through.

    job : its number. row : None where nobody is left who could have sent one; `status` and `message` say why.
    """

    job: int
    row: Row | None
    message: str = ""
    status: str = "failed"


class Pool(Protocol):
    """Processes, somewhere, that do a job each."""

    @property
    def room(self) -> int:
        """How many more jobs can be given now; 0 for ever once the pool is lost."""

    @property
    def busy(self) -> bool:
        """Whether a job is on its way."""

    @property
    def lost(self) -> str:
        """Why no job will ever be done any more; empty while that is not so."""

    def give(self, index: int, order: Order) -> None:
        """Have a job done."""

    def stop(self) -> None:
        """Let every job stop after the block that it is at."""

    def wait(self, seconds: float) -> Iterator[Ended]:
        """Jobs that are through, as soon as there are any, after some time at the latest."""

    def close(self) -> None:
        """Send everybody home."""
