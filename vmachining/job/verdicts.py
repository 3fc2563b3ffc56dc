"""Verdicts of the B-rep engine on disk as they come: an interrupted run asks for none of them again, but for refusals with
more time."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from contextlib import suppress
from io import StringIO
from pathlib import Path
from types import TracebackType

from vmachining.engines.brep import Status, Verdict
from vmachining.engines.protocol import Removal
from vmachining.geometry import Bracket
from vmachining.job.files import atomic_path, writing

__all__ = ["VerdictFile"]

NAMES = (
    "block", "status", "removed_brep_mm3", "slack_mm3", "rung", "seconds", "sweeps", "reason", "limit_s", "sure_mm3",
    "error_mm3", "rays_lo_mm3", "rays_mm3", "rays_hi_mm3",
)  # fmt: skip


class VerdictFile:
    """One row per verdict, in the order they come.

    Parameters
    ----------
    path : Path
        Goes on where it ends; a torn last row (power cut) is dropped.
    brackets : {block: Bracket}
        Values that do not lie in them any more, and blocks that are not there, are not `known`.
    seconds : limit of a block; refusals that had less are not `known`.
    """

    def __init__(self, path: Path, brackets: Mapping[int, Bracket], seconds: float) -> None:
        self._limits: dict[int, float] = {}
        self._seconds = seconds
        self.known: dict[int, Verdict] = {}
        text = path.read_text(encoding="utf-8", errors="replace") if path.exists() else ""
        for row in csv.DictReader(StringIO(text[: text.rfind("\n") + 1], newline="")):
            with suppress(TypeError, ValueError, KeyError):
                self._take(row, brackets)
        with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
            sheet = csv.writer(file, lineterminator="\n")
            sheet.writerow(NAMES)
            sheet.writerows(_row(block, known, self._limits[block]) for block, known in self.known.items())
        self._path, self._file = path, path.open("a", encoding="utf-8", newline="")
        self._sheet = csv.writer(self._file, lineterminator="\n")

    def _take(self, row: Mapping[str, str], brackets: Mapping[int, Bracket]) -> None:
        block, text = int(row["block"]), row["removed_brep_mm3"]
        verdict = Verdict(
            Status(row["status"]), float(text) if text else None, row["rung"], row["reason"],
            float(row["seconds"]), int(row["sweeps"]), slack_mm3=float(row["slack_mm3"]),
            sure_mm3=_number(row["sure_mm3"]), error_mm3=_number(row["error_mm3"]), rays=_interval(row),
        )  # fmt: skip
        value, limit = verdict.removed_mm3, float(row["limit_s"])
        holds = limit >= self._seconds if value is None else brackets[block].holds(value, verdict.slack_mm3)
        if holds and block in brackets:
            self.known[block], self._limits[block] = verdict, limit

    def add(self, block: int, verdict: Verdict) -> None:
        """Write one row and hand it to the operating system."""
        with writing(self._path):
            self._sheet.writerow(_row(block, verdict, self._seconds))
            self._file.flush()
        self.known[block] = verdict

    def __enter__(self) -> VerdictFile:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()


def _row(block: int, verdict: Verdict, limit: float) -> tuple[str, ...]:
    value = verdict.removed_mm3
    return (
        str(block), str(verdict.status), "" if value is None else repr(float(value)), repr(float(verdict.slack_mm3)),
        verdict.rung, repr(verdict.seconds), str(verdict.sweeps), verdict.reason, repr(limit),
        *map(_text, (verdict.sure_mm3, verdict.error_mm3, *(verdict.rays or (None, None, None))[:3])),
    )  # fmt: skip


def _text(value: float | None) -> str:
    return "" if value is None else repr(float(value))


def _number(text: str) -> float | None:
    return float(text) if text else None


def _interval(row: Mapping[str, str]) -> Removal | None:
    lo, estimate, hi = (_number(row[name]) for name in NAMES[-3:])
    if lo is None or estimate is None or hi is None:
        return None
    return Removal(lo, estimate, hi, proven=False)
