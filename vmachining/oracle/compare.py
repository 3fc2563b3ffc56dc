"""Join results and reference, and judge every block by its bracket."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import polars as pl

from vmachining.errors import InputError
from vmachining.htmltable import facts_html, table_html
from vmachining.job.result import RunResult
from vmachining.oracle.reference import BRACKET, Reference, read_reference
from vmachining.oracle.results import LARGEST, Results, read_results

STATUSES = ("inside", "low", "high", "missing", "extra", "disputed", "idle")
"""low, high: provably too little, too much. disputed: engines of the reference exclude each other, nobody can be judged by it.
idle: a rapid left out, or a zero for what the reference does not have; it is not a finding."""

FINDINGS = ("low", "high", "missing", "extra", "disputed")


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """What became of every block.

    key : "block" or "line".
    blocks : one row per key: key, text, status, removed_mm3 (theirs), reference_mm3, lo_mm3, hi_mm3 (the
        bracket as judged, tolerances included), error_mm3 = theirs - ours, relative_error, outside_mm3 (how
        far outside the bracket, 0 inside). Empty where there is nothing to compare.
    removed_mm3, total : their sum; our (lo, estimate, hi), tolerances included.
    tolerance_rel, tolerance_mm3 : what was requested. slack_mm3 : see `Reference`.
    """

    key: str
    blocks: pl.DataFrame
    removed_mm3: float
    total: tuple[float, float, float]
    tolerance_rel: float
    tolerance_mm3: float
    slack_mm3: float
    results: str
    reference: str

    def __repr__(self) -> str:
        found = ", ".join(f"{count} {status}" for status, count in self.counts.items() if count)
        return f"Comparison({self.verdict}: {found})"

    def _repr_html_(self) -> str:
        """What a notebook shows: the verdict, and the worst blocks."""
        lo, _, hi = self.total
        facts = [
            ("verdict", self.verdict),
            ("blocks", ", ".join(f"{count} {status}" for status, count in self.counts.items() if count)),
            ("theirs", f"{self.removed_mm3:.9g} mm³"),
            ("reference", f"between {lo:.9g} and {hi:.9g} mm³"),
        ]  # fmt: skip
        worst = self.worst(5)
        return facts_html("Comparison", facts) + (
            table_html(worst.columns, worst.rows()) if len(worst) else ""
        )

    @property
    def counts(self) -> dict[str, int]:
        """{status: how many}, all statuses named."""
        found = Counter(self.blocks["status"].to_list())
        return {status: found[status] for status in STATUSES}

    @property
    def agrees(self) -> bool:
        """Every block is inside, none is missing or disputed, nothing is removed where there is no block."""
        return not any(self.counts[status] for status in FINDINGS)

    @property
    def total_inside(self) -> bool | None:
        """Whether the sum lies in the bracket of the whole program; None if blocks are missing."""
        if self.counts["missing"]:
            return None
        return self.total[0] <= self.removed_mm3 <= self.total[2]

    @property
    def outside_mm3(self) -> float:
        """The largest distance outside a bracket: with this much more `tolerance_mm3` none would be outside."""
        return float(self.blocks["outside_mm3"].max() or 0.0)  # type: ignore[arg-type]  # a float column

    def worst(self, count: int = 10) -> pl.DataFrame:
        """Findings, the farthest outside first, then the missing ones by their volume."""
        found = self.blocks.filter(pl.col("status").is_in(FINDINGS))
        order = [pl.col("outside_mm3").fill_null(-1.0), pl.col("reference_mm3").fill_null(0.0)]
        return found.sort(order, descending=True, maintain_order=True).head(count)

    @property
    def verdict(self) -> str:
        """One sentence, with the tolerance it rests on."""
        n = self.counts
        judged = n["inside"] + n["low"] + n["high"] + n["missing"] + n["disputed"]
        unit = "blocks" if self.key == "block" else "lines"
        given = []
        if self.tolerance_rel:
            given.append(f"{self.tolerance_rel:g} of the volume")
        if self.tolerance_mm3:
            given.append(f"{self.tolerance_mm3:g} mm3")
        if self.slack_mm3:
            given.append(f"{self.slack_mm3:.3g} mm3 for the triangles of the stock")
        tail = f", brackets widened by {' + '.join(given)}" if given else ""
        if self.agrees:
            doubt = "" if self.total_inside else "; their sum is not, so something small is wrong throughout"
            return f"agrees: all {judged} {unit} are inside{tail}{doubt}"
        faults = [
            (n["low"] + n["high"], f"outside (up to {self.outside_mm3:.3g} mm3)"),
            (n["missing"], "missing"),
            (n["extra"], "that the reference does not have"),
            (n["disputed"], "that the reference itself disputes"),
        ]
        said = ", ".join(f"{count} {text}" for count, text in faults if count)
        return f"disagrees: of {judged} {unit} {n['inside']} are inside, {said}{tail}"

    def to_dict(self) -> dict[str, Any]:
        """All of it as JSON takes it."""
        return {
            "agrees": self.agrees, "verdict": self.verdict, "key": self.key, "results": self.results,
            "reference": self.reference, "tolerance_rel": self.tolerance_rel,
            "tolerance_mm3": self.tolerance_mm3, "stock_slack_mm3": self.slack_mm3, **self.counts,
            "removed_mm3": self.removed_mm3, "reference_mm3": self.total[1], "reference_lo_mm3": self.total[0],
            "reference_hi_mm3": self.total[2], "error_mm3": self.removed_mm3 - self.total[1],
            "total_inside": self.total_inside, "outside_mm3": self.outside_mm3,
            "worst": self.worst().to_dicts(), "blocks": self.blocks.to_dicts(),
        }  # fmt: skip


def compare(
    results: Path | str | pl.DataFrame | Mapping[str, Sequence[Any]],
    reference: Path | str | RunResult,
    *,
    tolerance_rel: float = 0.0,
    tolerance_mm3: float = 0.0,
) -> Comparison:
    """Somebody's volumes against the brackets of a reference.

    Parameters
    ----------
    results : CSV file, table or mapping; see `read_results`.
    reference : folder of `vmachining run` or of `write_pack`, or a `RunResult`.
    tolerance_rel, tolerance_mm3 : every bracket is widened at both ends by the estimate times the one plus
        the other, the one of a line of several blocks by `tolerance_mm3` for each of them. Rounding alone
        can need some: a volume that is the difference of two stocks of V mm^3 is good to some 1e-16 V.

    Raises
    ------
    InputError
        See `read_results` and `read_reference`; a tolerance that is negative or endless; results that repeat
        other lines than those of the reference are of another program.
    """
    for name, value in (("tolerance_rel", tolerance_rel), ("tolerance_mm3", tolerance_mm3)):
        if not 0.0 <= value <= LARGEST:
            raise InputError(f"{name} {value:g}: expected a number from 0 to {LARGEST:g}")
    known, given = read_reference(reference), read_results(results)
    _refuse_another_program(given, known)
    table = _join(given, known, tolerance_rel, tolerance_mm3)
    lo, estimate, hi = known.total
    more = tolerance_rel * estimate + tolerance_mm3 * len(known.blocks)
    return Comparison(
        given.key, table, math.fsum(given.removed_mm3.values()), (lo - more, estimate, hi + more),
        tolerance_rel, tolerance_mm3, known.slack_mm3, given.source, known.source,
    )  # fmt: skip


def _refuse_another_program(given: Results, known: Reference) -> None:
    """InputError at the first line of the program that both sides know and that differs by more than blanks."""
    for number, ours in known.by(given.key).select(given.key, "text").iter_rows():
        where, theirs = given.texts.get(number, ({}, None))
        if theirs is not None and "".join(theirs.split()) != "".join((ours or "").split()):
            raise InputError(
                f"belongs to another program: {given.key} {number} is {theirs.strip()!r} here and "
                f"{(ours or '').strip()!r} in {known.source}",
                **where,
                remedy="compare results of one program; without a column text numbers alone are compared",
            )


def _join(given: Results, known: Reference, rel: float, mm3: float) -> pl.DataFrame:
    """One row per key, in program order, the extra ones at the end."""
    key = given.key
    rows: list[tuple[Any, ...]] = []
    ours = known.by(key)
    for number, text, rapid, count, lo, estimate, hi, disputed in ours.select(
        key, "text", "rapid", "count", *BRACKET, "disputed"
    ).iter_rows():
        more = count * (mm3 + known.slack_mm3) + rel * estimate
        low, high = lo - more, hi + more
        value = given.removed_mm3.get(number)
        if value is None:
            status = "idle" if rapid else "missing"
            rows.append((number, text, status, None, estimate, low, high, None, None, None))
            continue
        status = "low" if value < low else "high" if value > high else "inside"
        status = "disputed" if disputed else status
        error = value - estimate
        outside = max(low - value, value - high, 0.0)
        relative = error / estimate if estimate else None
        rows.append((number, text, status, value, estimate, low, high, error, relative, outside))
    for number in sorted(given.removed_mm3.keys() - set(ours[key].to_list())):
        value = given.removed_mm3[number]
        status = "extra" if abs(value) > mm3 else "idle"
        rows.append((number, None, status, value, None, None, None, None, None, max(abs(value) - mm3, 0.0)))
    number_, text_, real = pl.Int64, pl.String, pl.Float64
    schema = {
        key: number_, "text": text_, "status": text_, "removed_mm3": real, "reference_mm3": real, "lo_mm3": real,
        "hi_mm3": real, "error_mm3": real, "relative_error": real, "outside_mm3": real,
    }  # fmt: skip
    return pl.DataFrame(rows, schema=schema, orient="row")
