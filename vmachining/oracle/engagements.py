"""Somebody's engaged intervals against ours, angle by angle."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import polars as pl

from vmachining.engagement import Engagement
from vmachining.errors import InputError
from vmachining.job.files import read_manifest, sha256
from vmachining.oracle.results import csv_rows

__all__ = ["EngagementComparison", "compare_engagement", "is_engagement_table"]

TOLERANCE_MM = 1e-4
"""What our own two methods promise to agree to on curved stock; planes are good to 1e-6 mm."""

ANGLE_DEG = 1e-6
"""Two rotation angles closer than this are one: on a radius of 50 mm they are 1e-6 mm apart."""

KEYS = ("block", "phi_deg", "lower_mm", "upper_mm")
WANTED = "want the columns block, phi_deg, lower_mm and upper_mm, and at where a block comes more than once"
FINDINGS = ("outside", "missing")
NO_TABLE = "give the directory that vmachining engage --out or vmachining pack wrote"

Interval: TypeAlias = tuple[float, float]
Place: TypeAlias = tuple[int, float, float]
"""block, at, phi_deg."""


@dataclass(frozen=True, slots=True, eq=False)
class EngagementComparison:
    """What became of every angle of the reference.

    angles : one row per block, at and phi_deg: status (inside, outside, missing, idle), error_mm (how much of the
        edge only one of the two calls engaged), length_mm (theirs), reference_mm. Missing: no row of theirs where
        the reference cuts; idle: no row where it does not.
    ignored : angles of theirs that the reference does not have. tolerance_mm : as asked for.
    """

    angles: pl.DataFrame
    ignored: int
    tolerance_mm: float
    results: str
    reference: str

    @property
    def counts(self) -> dict[str, int]:
        """{status: how many}, all statuses named."""
        found = Counter(self.angles["status"].to_list())
        return {status: found[status] for status in ("inside", *FINDINGS, "idle")}

    @property
    def agrees(self) -> bool:
        """No angle is outside or missing, and at least one of theirs could be compared."""
        return not any(self.counts[status] for status in FINDINGS) and self.counts["inside"] > 0

    @property
    def worst_mm(self) -> float:
        """The largest error."""
        return float(self.angles["error_mm"].max() or 0.0)  # type: ignore[arg-type]  # a float column

    def worst(self, count: int = 10) -> pl.DataFrame:
        """Findings, the largest error first."""
        found = self.angles.filter(pl.col("status").is_in(FINDINGS))
        return found.sort("error_mm", descending=True, maintain_order=True).head(count)

    @property
    def verdict(self) -> str:
        """One sentence, with the tolerance it rests on."""
        n = self.counts
        judged = n["inside"] + n["outside"] + n["missing"]
        tail = f"within {self.tolerance_mm:g} mm of the edge, the largest error is {self.worst_mm:.3g} mm"
        if self.agrees:
            return f"agrees: all {judged} angles {tail}"
        if not n["inside"] + n["outside"]:
            return "disagrees: no angle of the reference is in the table (same block, at and phi_deg)"
        said = ", ".join(f"{n[name]} {name}" for name in FINDINGS if n[name])
        return f"disagrees: of {judged} angles {n['inside']} are {tail}; {said}"

    def to_dict(self) -> dict[str, Any]:
        """All of it as JSON takes it."""
        return {
            "agrees": self.agrees, "verdict": self.verdict, "results": self.results, "reference": self.reference,
            "tolerance_mm": self.tolerance_mm, **self.counts, "ignored": self.ignored,
            "worst_mm": self.worst_mm, "worst": self.worst().to_dicts(), "angles": self.angles.to_dicts(),
        }  # fmt: skip


def compare_engagement(
    results: Path | str | pl.DataFrame | Mapping[str, Sequence[Any]] | Engagement,
    reference: Path | str | pl.DataFrame | Engagement,
    *,
    tolerance_mm: float = TOLERANCE_MM,
) -> EngagementComparison:
    """Somebody's engaged intervals against a table of ours.

    Parameters
    ----------
    results : CSV file (comma, semicolon or tab), table, mapping of columns, or an `Engagement`. Columns block,
        phi_deg, lower_mm and upper_mm (s along the edge), one row per interval; at where the reference has several
        instants of a block. Rows with an empty interval say that nothing is engaged there; angles that touch
        nothing may be left out.
    reference : folder of `vmachining engage --out` or of `write_pack`, its table, or an `Engagement`.
    tolerance_mm : of the edge that only one of the two may call engaged, per angle.

    Raises
    ------
    InputError
        Unreadable, columns or numbers missing, a tolerance that is negative, a reference that changed since it
        was made.
    """
    if not (math.isfinite(tolerance_mm) and tolerance_mm >= 0.0):
        raise InputError(f"tolerance_mm {tolerance_mm:g}: want a number from 0")
    known, source = _reference(reference)
    given, name = _given(results, known)
    rows: list[tuple[Any, ...]] = []
    left = dict(given)
    for place, ours in known.items():
        theirs = _near(left, place)
        length = math.fsum(b - a for a, b in ours)
        if theirs is None:
            status = "missing" if length > tolerance_mm else "idle"
            rows.append((*place, status, length if length > tolerance_mm else 0.0, None, length))
            continue
        error = _difference(theirs, ours)
        status = "inside" if error <= tolerance_mm else "outside"
        rows.append((*place, status, error, math.fsum(b - a for a, b in theirs), length))
    schema = {
        "block": pl.Int64, "at": pl.Float64, "phi_deg": pl.Float64, "status": pl.String,
        "error_mm": pl.Float64, "length_mm": pl.Float64, "reference_mm": pl.Float64,
    }  # fmt: skip
    table = pl.DataFrame(rows, schema=schema, orient="row")
    return EngagementComparison(table, len(left), tolerance_mm, name, source)


def is_engagement_table(path: Path | str) -> bool:
    """Whether a CSV file has the columns of intervals; False for whatever cannot be read."""
    try:
        _, header = next(csv_rows(Path(path)))
    except (InputError, StopIteration):
        return False
    return {"phi_deg", "lower_mm"} <= {name.strip() for name in header}


def _reference(reference: Path | str | pl.DataFrame | Engagement) -> tuple[dict[Place, list[Interval]], str]:
    if isinstance(reference, Engagement):
        return _gathered(reference.table().to_dict(as_series=False), "engagement"), "engagement"
    if isinstance(reference, pl.DataFrame):
        return _gathered(reference.to_dict(as_series=False), "table"), "table"
    folder = Path(reference)
    if not folder.is_dir():
        raise InputError(
            "not a directory" if folder.exists() else "no such directory", file=str(folder), remedy=NO_TABLE
        )
    path = next(
        (folder / f"engagement.{s}" for s in ("parquet", "csv") if (folder / f"engagement.{s}").is_file()),
        None,
    )
    if path is None:
        raise InputError("no table of engagement in it", file=str(folder), remedy=NO_TABLE)
    files = (read_manifest(folder) or {}).get("files")
    if isinstance(files, dict) and files.get(path.name, "") != sha256(path):
        raise InputError(
            "differs from the file that the pack was made with", file=str(path), remedy="fetch the pack again"
        )
    if path.suffix == ".csv":
        return _gathered(_csv(path), str(path)), str(folder)
    try:
        table = pl.read_parquet(path)
    except (OSError, pl.exceptions.PolarsError) as exc:
        raise InputError(f"cannot read the table: {str(exc).splitlines()[0]}", file=str(path)) from exc
    return _gathered(table.to_dict(as_series=False), str(path)), str(folder)


def _given(
    results: Path | str | pl.DataFrame | Mapping[str, Sequence[Any]] | Engagement,
    known: Mapping[Place, list[Interval]],
) -> tuple[dict[Place, list[Interval]], str]:
    if isinstance(results, Engagement):
        results = results.table()
    if isinstance(results, pl.DataFrame):
        results = results.to_dict(as_series=False)
    name = "table"
    if isinstance(results, (str, Path)):
        name = str(results)
        results = _csv(Path(results))
    if "at" in results:
        return _gathered(results, name), name
    instants = {block: {at for b, at, _ in known if b == block} for block, _, _ in known}
    several = next((block for block, ats in instants.items() if len(ats) > 1), None)
    if several is not None:
        raise InputError(f"the reference has several instants of block {several}", file=name, remedy=WANTED)
    only = {block: next(iter(ats)) for block, ats in instants.items()}
    return _gathered(results, name, only), name


def _csv(path: Path) -> dict[str, list[Any]]:
    rows = csv_rows(path)
    line, header = next(rows, (1, []))
    names = [name.strip() for name in header]
    columns: dict[str, list[Any]] = {name: [] for name in names}
    for number, row in rows:
        if len(row) != len(names):
            raise InputError(
                f"{len(row)} cells where the header has {len(names)}", file=str(path), line=number
            )
        for name, cell in zip(names, row, strict=True):
            columns[name].append(cell)
    _wanted(columns, str(path), line)
    return columns


def _wanted(columns: Iterable[str], source: str, line: int | None = None) -> None:
    lacking = next((name for name in KEYS if name not in set(columns)), None)
    if lacking is not None:
        raise InputError(f"no column {lacking}", file=source, line=line, remedy=WANTED)


def _gathered(
    columns: Mapping[str, Sequence[Any]], source: str, only: Mapping[int, float] | None = None
) -> dict[Place, list[Interval]]:
    """Intervals by place, rising and joined; an empty list where nothing is engaged."""
    _wanted(columns, source)
    out: dict[Place, list[Interval]] = {}
    for number, (block, phi, lower, upper) in enumerate(
        zip(*(columns[k] for k in KEYS), strict=True), start=1
    ):
        where = f"{source} row {number}"
        name = _number(block, "block", where)
        # a table of `contact` alone has no blocks
        key = int(name) if name is not None else -1
        at = _number(columns["at"][number - 1], "at", where) if "at" in columns else (only or {}).get(key)
        angle = _number(phi, "phi_deg", where)
        a, b = _number(lower, "lower_mm", where), _number(upper, "upper_mm", where)
        if angle is None or (a is None) != (b is None):
            raise InputError("an angle or one end of an interval is empty", file=where, remedy=WANTED)
        if a is not None and b is not None and a > b:
            raise InputError(f"lower_mm {a:g} lies above upper_mm {b:g}", file=where)
        if at is None:
            continue  # a block that the reference does not have
        place = (key, round(at, 9), angle % 360.0)
        held = out.setdefault(place, [])
        if a is not None and b is not None:
            held.append((a, b))
    return {place: list(_joined(sorted(held))) for place, held in out.items()}


def _joined(intervals: Iterable[Interval]) -> Iterator[Interval]:
    """Overlapping or touching intervals as one."""
    last: Interval | None = None
    for a, b in intervals:
        if last is not None and a <= last[1]:
            last = (last[0], max(last[1], b))
            continue
        if last is not None:
            yield last
        last = (a, b)
    if last is not None:
        yield last


def _near(table: dict[Place, list[Interval]], place: Place) -> list[Interval] | None:
    """Takes out the intervals of a place, its angle written with fewer digits or not."""
    if place in table:
        return table.pop(place)
    block, at, phi = place
    for other in [p for p in table if p[0] == block and abs(p[1] - at) <= 1e-9]:
        gap = abs(other[2] - phi)
        if min(gap, 360.0 - gap) <= ANGLE_DEG:
            return table.pop(other)
    return None


def _difference(one: Sequence[Interval], other: Sequence[Interval]) -> float:
    """Length that lies in one of two unions of intervals only, mm."""
    both = math.fsum(
        max(0.0, min(b, d) - max(a, c)) for a, b in one for c, d in other
    )  # fmt: skip
    return max(0.0, math.fsum(b - a for a, b in (*one, *other)) - 2.0 * both)


def _number(value: Any, name: str, where: str) -> float | None:
    """A finite number, None for an empty cell."""
    if value is None or (isinstance(value, str) and not value.strip()):
        return None
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        raise InputError(f"{name} {value!r} is no finite number", file=where)
    return number
