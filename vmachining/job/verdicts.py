"""Verdicts of the B-rep engine on disk as they come: an interrupted run asks for none of them again, but for refusals with
more time."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from contextlib import suppress
from io import StringIO
from pathlib import Path
from zlib import crc32

from vmachining.disk import writing
from vmachining.engines.brep import Status, Verdict
from vmachining.engines.judges import Judge, intersection
from vmachining.engines.protocol import Removal
from vmachining.job.files import atomic_path

NAMES = (
    "block", "status", "removed_brep_mm3", "removed_brep_error_mm3", "number", "attempt", "seconds", "sweeps", "reason",
    "limit_s", "dexel_lo_mm3", "dexel_mm3", "dexel_hi_mm3", "check",
)  # fmt: skip
"""check : CRC-32 of the cells before it."""


class VerdictFile:
    """One row per verdict, in the order they come.

    path : Path, continues where it ends; a torn last row (power cut) is dropped, and so is one that was changed.
    judges : {block: what is said of it}
        Values that they do not allow any more, and blocks that are not there, are not `known`.
    seconds : limit of a block; refusals that had less are not `known`.
    """

    def __init__(self, path: Path, judges: Mapping[int, Sequence[Judge]], seconds: float) -> None:
        self._limits: dict[int, float] = {}
        self._seconds = seconds
        self.known: dict[int, Verdict] = {}
        text = path.read_text(encoding="utf-8", errors="replace") if path.exists() else ""
        for row in csv.DictReader(StringIO(text[: text.rfind("\n") + 1], newline="")):
            with suppress(TypeError, ValueError, KeyError):
                cells = tuple(row.values())
                if cells == _checked(*cells[:-1]):
                    self._take(row, judges)
        with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
            sheet = csv.writer(file, lineterminator="\n")
            sheet.writerow(NAMES)
            sheet.writerows(_row(block, known, self._limits[block]) for block, known in self.known.items())
        self._path, self._file = path, path.open("a", encoding="utf-8", newline="")
        self._sheet = csv.writer(self._file, lineterminator="\n")

    def _take(self, row: Mapping[str, str], judges: Mapping[int, Sequence[Judge]]) -> None:
        block, value, limit = int(row["block"]), _number(row["removed_brep_mm3"]), float(row["limit_s"])
        verdict = Verdict(
            Status(row["status"]), value, _number(row["removed_brep_error_mm3"]), row["attempt"], int(row["number"]),
            row["reason"], float(row["seconds"]), int(row["sweeps"]), judges=_judges(row),
        )  # fmt: skip
        holds = limit >= self._seconds
        if value is not None:  # it still lies where the judges of today allow it, within its error
            truth, error = intersection(judges[block]), verdict.error_mm3 or 0.0
            holds = truth is not None and truth.lo - error <= value <= truth.hi + error
        if holds and block in judges:
            self.known[block], self._limits[block] = verdict, limit

    def add(self, block: int, verdict: Verdict) -> None:
        """Write one row and hand it to the operating system."""
        with writing(self._path):
            self._sheet.writerow(_row(block, verdict, self._seconds))
            self._file.flush()
        self.known[block] = verdict

    def __enter__(self) -> VerdictFile:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()


def _row(block: int, verdict: Verdict, limit: float) -> tuple[str, ...]:
    rays = next((judge.removal for judge in verdict.judges if judge.name == "dexel"), None)
    return _checked(
        str(block), str(verdict.status), _text(verdict.removed_mm3), _text(verdict.error_mm3), str(verdict.number),
        verdict.attempt, repr(verdict.seconds), str(verdict.sweeps), verdict.reason, repr(limit),
        *map(_text, (None, None, None) if rays is None else rays[:3]),
    )  # fmt: skip


def _checked(*cells: str) -> tuple[str, ...]:
    return *cells, f"{crc32(repr(cells).encode()):08x}"


def _text(value: float | None) -> str:
    return "" if value is None else repr(float(value))


def _number(text: str) -> float | None:
    return float(text) if text else None


def _judges(row: Mapping[str, str]) -> tuple[Judge, ...]:
    lo, estimate, hi = (_number(row[name]) for name in NAMES[-4:-1])
    if lo is None or estimate is None or hi is None:
        return ()
    return (Judge("dexel", Removal(lo, estimate, hi, proven=False)),)
