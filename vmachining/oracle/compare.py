"""Join results and reference, and judge every block by its bracket; of one case, or of all cases of a set of packs."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import polars as pl

from vmachining.errors import InputError
from vmachining.htmltable import facts_html, table_html
from vmachining.job.files import MANIFEST, read_manifest, sha256
from vmachining.job.result import RunResult
from vmachining.oracle.results import (
    BRACKET,
    LARGEST,
    Reference,
    Results,
    csv_table,
    read_reference,
    read_results,
    table_in,
)

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
        return f"Comparison({self.verdict}: {self._counted})"

    def _repr_html_(self) -> str:
        (lo, _, hi), worst = self.total, self.worst(5)
        facts = [
            ("verdict", self.verdict),
            ("blocks", self._counted),
            ("theirs", f"{self.removed_mm3:.9g} mm³"),
        ]
        facts.append(("reference", f"between {lo:.9g} and {hi:.9g} mm³"))
        return facts_html("Comparison", facts) + (
            table_html(worst.columns, worst.rows()) if len(worst) else ""
        )

    @property
    def _counted(self) -> str:
        return ", ".join(f"{count} {status}" for status, count in self.counts.items() if count)

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
        n = self.counts
        judged = n["inside"] + n["low"] + n["high"] + n["missing"] + n["disputed"]
        unit = "blocks" if self.key == "block" else "lines"
        given = [f"{self.tolerance_rel:g} of the volume"] if self.tolerance_rel else []
        given += [f"{self.tolerance_mm3:g} mm3"] if self.tolerance_mm3 else []
        given += [f"{self.slack_mm3:.3g} mm3 for the triangles of the stock"] if self.slack_mm3 else []
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

    results : CSV file, table or mapping; see `read_results`.
    reference : folder of `vmachining run` or of `write_pack`, or a `RunResult`.
    tolerance_rel, tolerance_mm3 : every bracket is widened at both ends by the estimate times the one plus
        the other, the one of a line of several blocks by `tolerance_mm3` for each of them. Rounding alone
        can need some: a volume that is the difference of two stocks of V mm^3 is good to some 1e-16 V.

    Raises InputError: See `read_results` and `read_reference`; a tolerance that is negative or endless; results that repeat
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
    schema = {key: number_, "text": text_, "status": text_, "removed_mm3": real, "reference_mm3": real}
    schema |= dict.fromkeys(("lo_mm3", "hi_mm3", "error_mm3", "relative_error", "outside_mm3"), real)
    return pl.DataFrame(rows, schema=schema, orient="row")


SET_KIND = "vmachining reference set"
CASE = "case"
"""Column of a table of results that names the case of a row."""


def is_set(folder: Path) -> bool:
    """Whether a directory is a set that was made, or is to be one."""
    return (folder / "set.toml").is_file() or (read_manifest(folder) or {}).get("kind") == SET_KIND


@dataclass(frozen=True, slots=True, eq=False)
class SetComparison:
    """Somebody's volumes of several cases against a set. cases : by name. missing : cases without results."""

    cases: Mapping[str, Comparison]
    missing: tuple[str, ...]
    reference: str

    @property
    def agrees(self) -> bool:
        """Every case that has results agrees."""
        return all(found.agrees for found in self.cases.values())

    @property
    def verdict(self) -> str:
        good = sum(found.agrees for found in self.cases.values())
        more = f"; no results of {', '.join(self.missing)}" if self.missing else ""
        word = "agrees" if self.agrees else "disagrees"
        return f"{word}: {good} of {len(self.cases)} cases have all of their blocks inside{more}"

    def table(self) -> pl.DataFrame:
        """One row per case: name, blocks judged, inside, low, high, missing, extra, disputed, the error of the sum, agrees."""
        rows, kinds = [], ("inside", "low", "high", "missing", "extra", "disputed")
        for name, found in self.cases.items():
            n, total = found.counts, found.total[1]
            rows.append({
                CASE: name, "judged": sum(n[kind] for kind in kinds if kind != "extra"), **{kind: n[kind] for kind in kinds},
                "outside_mm3": found.outside_mm3, "error_of_the_sum": (found.removed_mm3 - total) / total if total else None,
                "agrees": found.agrees,
            })  # fmt: skip
        return pl.DataFrame(rows)

    def to_dict(self) -> dict[str, Any]:
        return {
            "agrees": self.agrees, "verdict": self.verdict, "reference": self.reference, "missing": list(self.missing),
            "summary": self.table().to_dicts(), "cases": {name: found.to_dict() for name, found in self.cases.items()},
        }  # fmt: skip


def compare_set(
    results: Path, reference: Path, *, tolerance_rel: float = 0.0, tolerance_mm3: float = 0.0
) -> SetComparison:
    """Somebody's volumes of the cases of a set.

    results : a directory with CASE.csv or CASE.parquet, or with CASE/blocks.* as a run leaves it; or one CSV file with a
        column `case`.
    reference : directory of a set.
    Raises InputError: No results of any case, results of a case that the set does not have, a pack that changed; see
        `compare`.
    """
    manifest = read_manifest(reference)
    if manifest is None or manifest.get("kind") != SET_KIND or not isinstance(manifest.get("cases"), dict):
        raise InputError("is not a finished set", file=reference, remedy=f"vmachining pack {reference}")
    known: dict[str, str] = manifest["cases"]
    for name, digest in known.items():
        path = reference / name / MANIFEST
        if not path.is_file() or sha256(path) != digest:
            raise InputError(
                "is missing or differs from the one that the set was made with", file=path, remedy="fetch the set again"
            )  # fmt: skip
    found = {
        name: compare(table, reference / name, tolerance_rel=tolerance_rel, tolerance_mm3=tolerance_mm3)
        for name, table in _tables_by_case(results, tuple(known))
    }
    if not found:
        remedy = f"give {next(iter(known))}.csv in it, and so on"
        raise InputError("no results of any case", file=results, remedy=remedy)
    return SetComparison(found, tuple(name for name in known if name not in found), str(reference))


def _tables_by_case(results: Path, known: Sequence[str]) -> Iterator[tuple[str, Any]]:
    if results.is_dir():
        for name in known:
            path = table_in(results, name) or table_in(results / name, "blocks")
            if path is not None:
                yield name, path
        return
    line, names, rows = csv_table(results)
    if CASE not in names:
        raise InputError(
            f"no column {CASE}", file=results, line=line,
            remedy=f"name one case as reference, such as {known[0]}, or add the column",
        )  # fmt: skip
    at = names.index(CASE)
    tables: dict[str, list[list[str]]] = {}
    for number, row in rows:
        if row[at] not in known:
            what, remedy = f"the set has no case {row[at]!r}", f"one of {', '.join(known)}"
            raise InputError(what, file=results, line=number, remedy=remedy)
        tables.setdefault(row[at], []).append(row)
    for name, lines in tables.items():
        yield name, {key: [line[k] for line in lines] for k, key in enumerate(names) if key != CASE}
