"""Somebody's engaged intervals against ours, angle by angle."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, TypeAlias

import polars as pl

from vmachining.engagement import Engagement
from vmachining.errors import InputError
from vmachining.job.files import read_manifest, sha256
from vmachining.oracle.results import LARGEST, TABLE, Table, frame_of, table_in, whole
from vmachining.textfile import csv_rows, finite

TOLERANCE_MM = 1e-4
"""What our own two methods promise to agree to on curved stock; planes are good to 1e-6 mm."""

ANGLE_DEG = 1e-6
"""Two rotation angles closer than this are one: on a radius of 50 mm they are 1e-6 mm apart."""

CELL_DEG = 2.0 * ANGLE_DEG
CELLS = round(360.0 / CELL_DEG)
"""Angles are looked up by cells of this width: rounding puts no near one two cells away."""

AT_DIGITS, AT = 9, 1e-9
"""Instants are rounded; two that are no farther apart than this are one."""

KEYS = ("block", "phi_deg", "lower_mm", "upper_mm")
WANTED = "give the columns block, phi_deg, lower_mm and upper_mm, and at where a block comes more than once"
FINDINGS = ("outside", "missing")
NUMBER = "write a number with a decimal point; both ends stay empty where nothing is engaged"
NO_BLOCK = -1
"""Stands for the block in a table of `contact` alone."""

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

    def __repr__(self) -> str:
        found = ", ".join(f"{count} {status}" for status, count in self.counts.items() if count)
        return f"EngagementComparison({self.verdict}: {found})"

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
        return float(self.angles["error_mm"].max() or 0.0)  # type: ignore[arg-type]  # a float column

    def worst(self, count: int = 10) -> pl.DataFrame:
        """Findings, the largest error first."""
        found = self.angles.filter(pl.col("status").is_in(FINDINGS))
        return found.sort("error_mm", descending=True, maintain_order=True).head(count)

    @property
    def verdict(self) -> str:
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

    results : CSV file (comma, semicolon or tab), table, mapping of columns, or an `Engagement`. Columns block,
        phi_deg, lower_mm and upper_mm (s along the edge), one row per interval; at where the reference has several
        instants of a block. Rows with an empty interval say that nothing is engaged there; angles that touch
        nothing may be left out.
    reference : folder of `vmachining engage --out` or of `write_pack`, its table, or an `Engagement`.
    tolerance_mm : of the edge that only one of the two may call engaged, per angle.
    Raises InputError: Unreadable, columns or numbers missing, a tolerance that is negative, a reference that changed
        since it was made.
    """
    if not 0.0 <= tolerance_mm <= LARGEST:
        raise InputError(f"tolerance_mm {tolerance_mm:g}: expected a number from 0 to {LARGEST:g}")
    known, source = _reference(reference)
    given, name = _intervals_of(results, known)
    rows: list[tuple[Any, ...]] = []
    left = dict(given)
    nearby = _by_cell(given)
    for place, ours in known.items():
        theirs = _near(left, nearby, place)
        length = math.fsum(b - a for a, b in ours)
        if theirs is None:
            status = "missing" if length > tolerance_mm else "idle"
            rows.append((*place, status, length if length > tolerance_mm else 0.0, None, length))
            continue
        error = _difference(theirs, ours)
        status = "inside" if error <= tolerance_mm else "outside"
        rows.append((*place, status, error, math.fsum(b - a for a, b in theirs), length))
    reals = ("error_mm", "length_mm", "reference_mm")
    schema = {"block": pl.Int64, "at": pl.Float64, "phi_deg": pl.Float64, "status": pl.String}
    table = pl.DataFrame(rows, schema=schema | dict.fromkeys(reals, pl.Float64), orient="row")
    return EngagementComparison(table, len(left), tolerance_mm, name, source)


def is_engagement_table(path: Path | str) -> bool:
    """Whether a file has the columns of intervals; False for whatever cannot be read."""
    try:
        is_parquet = Path(path).suffix == ".parquet"
        header = (
            frame_of(Path(path)).columns if is_parquet else next(csv_rows(Path(path), "results", TABLE))[1]
        )
    except (InputError, StopIteration):
        return False
    return {"phi_deg", "lower_mm"} <= {name.strip() for name in header}


def _reference(reference: Path | str | pl.DataFrame | Engagement) -> tuple[dict[Place, list[Interval]], str]:
    if isinstance(reference, Engagement):
        return _gathered(Table.read(reference.table(), _chosen)), "engagement"
    if isinstance(reference, pl.DataFrame):
        return _gathered(Table.read(reference, _chosen)), "table"
    folder = Path(reference)
    if not folder.is_dir():
        what = "not a directory" if folder.exists() else "no such directory"
        raise InputError(what, file=folder, remedy=NO_TABLE)
    path = table_in(folder, "engagement")
    if path is None:
        raise InputError("no table of engagement in it", file=folder, remedy=NO_TABLE)
    files = (read_manifest(folder) or {}).get("files")
    if isinstance(files, dict) and files.get(path.name, "") != sha256(path):
        what = "differs from the file that the pack was made with"
        raise InputError(what, file=path, remedy="fetch the pack again")
    return _gathered(Table.read(path, _chosen)), str(folder)


def _intervals_of(
    results: Path | str | pl.DataFrame | Mapping[str, Sequence[Any]] | Engagement,
    known: Mapping[Place, list[Interval]],
) -> tuple[dict[Place, list[Interval]], str]:
    if isinstance(results, Engagement):
        results = results.table()
    table = Table.read(results, _chosen)
    instants: dict[int, set[float]] = defaultdict(set)
    for block, at, _ in known:
        instants[block].add(at)
    nameless = NO_BLOCK in instants
    if "at" in table.columns:
        return _gathered(table, nameless=nameless), table.source
    several = next((block for block, ats in instants.items() if len(ats) > 1), None)
    if several is not None:
        what = f"the reference has several instants of block {several}"
        raise InputError(what, file=table.source, remedy=WANTED)
    only = {block: next(iter(ats)) for block, ats in instants.items()}
    return _gathered(table, only, nameless=nameless), table.source


def _chosen(names: Sequence[str], source: str, line: int | None) -> list[str]:
    """The columns that are needed, of a table that has them."""
    lacking = next((name for name in KEYS if name not in names), None)
    if lacking is not None:
        raise InputError(f"no column {lacking}", file=source, line=line, remedy=WANTED)
    return [name for name in (*KEYS, "at") if name in names]


def _gathered(
    table: Table, only: Mapping[int, float] | None = None, *, nameless: bool = True
) -> dict[Place, list[Interval]]:
    """Intervals by place, rising and joined; an empty list where nothing is engaged.

    only : the instant of every block, where there is no column of them. nameless : whether a block may be empty.
    """
    used = list(table.columns)
    if not table.columns["block"]:
        remedy = "one row per interval, and one row without ends for an angle without contact"
        raise InputError("a header and no results", file=table.source, remedy=remedy)
    out: dict[Place, list[Interval]] = {}
    for row, (block, *cells) in enumerate(zip(*table.columns.values(), strict=True)):
        where = table.where(row)
        key = NO_BLOCK if nameless and _empty(block) else whole(block, "block", where)
        angle, a, b, *rest = (_number(v, name, where) for v, name in zip(cells, used[1:], strict=True))
        if angle is None or (a is None) != (b is None) or rest == [None]:
            what = "an instant" if rest == [None] else "an angle or one end of an interval"
            raise InputError(f"{what} is empty", **where, remedy=WANTED)
        if a is not None and b is not None and a > b:
            raise InputError(
                f"lower_mm {a:g} lies above upper_mm {b:g}", **where,
                remedy="both count along the edge, from its lowest point",
            )  # fmt: skip
        at = rest[0] if rest else (only or {}).get(key)
        if at is None:
            continue  # a block that the reference does not have
        place = (key, round(at, AT_DIGITS), angle % 360.0)
        held = out.setdefault(place, [])
        if a is not None and b is not None:
            held.append((a, b))
    return {place: list(_joined(sorted(held))) for place, held in out.items()}


def _joined(intervals: Iterable[Interval]) -> Iterator[Interval]:
    """Overlapping or touching intervals as one."""
    out: list[Interval] = []
    for a, b in intervals:
        if out and a <= out[-1][1]:
            a, b = out[-1][0], max(out.pop()[1], b)
        out.append((a, b))
    return iter(out)


def _cell(place: Place) -> tuple[int, int, int]:
    """Block, and cells of instant and angle: what is near lies in the same ones or the next."""
    block, at, phi = place
    return block, round(at / AT), math.floor(phi / CELL_DEG) % CELLS


def _by_cell(places: Iterable[Place]) -> dict[tuple[int, int, int], list[Place]]:
    """Places by their cells, so that a near one is found without a look at all of them."""
    found: dict[tuple[int, int, int], list[Place]] = defaultdict(list)
    for place in places:
        found[_cell(place)].append(place)
    return found


def _near(
    table: dict[Place, list[Interval]], nearby: Mapping[tuple[int, int, int], list[Place]], place: Place
) -> list[Interval] | None:
    """Takes out the intervals of a place, its angle written with fewer digits or not."""
    if place in table:
        return table.pop(place)
    _, at, phi = place
    block, instant, angle = _cell(place)
    for i, k in product((0, -1, 1), (0, -1, 1)):
        for other in nearby.get((block, instant + i, (angle + k) % CELLS), ()):
            gap = abs(other[2] - phi)
            if other in table and abs(other[1] - at) <= AT and min(gap, 360.0 - gap) <= ANGLE_DEG:
                return table.pop(other)
    return None


def _difference(one: Sequence[Interval], other: Sequence[Interval]) -> float:
    """Length that lies in one of two unions of intervals only, mm."""
    both = math.fsum(max(0.0, min(b, d) - max(a, c)) for a, b in one for c, d in other)
    return max(0.0, math.fsum(b - a for a, b in (*one, *other)) - 2.0 * both)


def _empty(value: Any) -> bool:
    return value is None or (isinstance(value, str) and not value.strip())


def _number(value: Any, name: str, where: Mapping[str, Any]) -> float | None:
    """A finite number, None for an empty cell."""
    if _empty(value):
        return None
    number = finite(value)
    if number is None:
        raise InputError(f"{name} {value!r} is not a finite number", **where, remedy=NUMBER)
    if abs(number) > LARGEST:
        raise InputError(f"{name} {value!r} is beyond {LARGEST:g}", **where)
    return number
