"""The rungs of the ladder (`ladder.py`) by name, and what is said of a block.

| rung | what is done otherwise |
|---|---|
| `plain` | one cut after the other, fuzzy value 0 |
| `fuzzy 1e-05`, `1e-04`, `1e-03` | OCCT may take points that close for one, mm |
| `turned` | everything turned by an odd angle first |
| `reversed` | earlier sweeps in the opposite order |
| `joint` | all earlier sweeps in one operation |
| `late stock` | earlier sweeps leave the sweep first, the stock is met last |
| `halves` | the block in two halves, the second after the first |
| `grown` | earlier sweeps grown by 1e-5 mm, the bracket widened by what that can change |
| `facets` | meshes of the solids, ever finer: the value and its error must lie in the bracket (`faceted.py`) |
| `sections` | areas of level sections, integrated: the value and its error must lie in the bracket (`sections.py`) |
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import StrEnum
from time import process_time
from typing import NamedTuple

from vmachining.engines.protocol import Removal

__all__ = [
    "FACETS",
    "MESHES",
    "NEXT",
    "RAYS",
    "RUNGS",
    "SECTIONS",
    "SOLIDS",
    "STEADY",
    "Clock",
    "Found",
    "Status",
    "Verdict",
    "steady_first",
]

FACETS, SECTIONS = "facets", "sections"
STEADY = (FACETS, SECTIONS)
"""The rungs that need no boolean of solids."""

SOLIDS, MESHES, RAYS, NEXT = "solids", "meshes", "rays", "next"
"""What is told before any rung, and within `facets`: solids or meshes of the block, or of one that reaches it, are built; what is
told after a rung: rays are asked of its value; and before another rung: what was tried until then is done with."""

RUNGS = (
    "plain", "fuzzy 1e-05", "fuzzy 1e-04", "fuzzy 1e-03", "turned", "reversed", "joint", "late stock", "halves",
    "grown", *STEADY,
)  # fmt: skip


class Status(StrEnum):
    """agreed: at the first attempt; retried: at a later one; refused: at none; disputed: the judges exclude each other;
    skipped: nobody asked."""

    AGREED = "agreed"
    RETRIED = "retried"
    REFUSED = "refused"
    DISPUTED = "disputed"
    SKIPPED = "skipped"


class Verdict(NamedTuple):
    """removed_mm3 : of a boolean of solids; None if refused, disputed or skipped. rung : what worked. reason : why not.
    tried : value per rung. error_mm3 : how far `removed_mm3` is from the truth at most. rays : what exact rays find, where
    they were asked.

    seconds : of a processor, all rungs and the processes they cost. slack_mm3 : by how much the rung that worked,
    or else the last one, widened the bracket at both ends; negative: the value's own error, kept inside. sure_mm3 : how far
    from the truth the value is at most if rays or a steady rung are right; inf: none could tell; None: it was not in doubt, and
    rays or the bracket see no error of `TIGHT_REL`, or what a steady rung says of its own error.
    """

    status: Status
    removed_mm3: float | None
    rung: str
    reason: str
    seconds: float
    sweeps: int
    tried: tuple[float | None, ...] = ()
    slack_mm3: float = 0.0
    sure_mm3: float | None = None
    error_mm3: float | None = None
    rays: Removal | None = None

    @property
    def number(self) -> int:
        """Of the attempt that worked, from 1; 0 if none did."""
        return RUNGS.index(self.rung) + 1 if self.rung in RUNGS else 0


class Found(NamedTuple):
    """Of one rung. used : earlier sweeps. slack : mm^3 by which it widens the gate; negative: the value's own error. own : mm^3,
    what the rung itself changes of the value or says of its error: all that rays and steady rungs forgive."""

    rung: str
    value: float
    used: int
    slack: float
    own: float


def steady_first(rungs: Sequence[str], steady: Sequence[str] = STEADY) -> list[str]:
    """The rungs, the steady ones before the others."""
    return sorted(rungs, key=lambda rung: steady.index(rung) if rung in steady else len(steady))


class Clock:
    """s of a processor that a block has taken, without meshes for other blocks, too (`MESHES`), until something else is told."""

    def __init__(self, told: Callable[[str], None]) -> None:
        self._told, self._begin, self._apart, self._since = told, process_time(), 0.0, 0.0

    def tell(self, what: str) -> None:
        if self._since:
            self._apart += process_time() - self._since
        self._since = process_time() if what == MESHES else 0.0
        self._told(what)

    def own(self) -> float:
        return process_time() - self._begin - self._apart
