"""Somebody's volumes of many cases against a reference set: a directory of packs, whose manifest names every byte."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import polars as pl

from vmachining.errors import InputError
from vmachining.job.files import MANIFEST, read_manifest, sha256
from vmachining.oracle.compare import Comparison, compare
from vmachining.oracle.results import csv_table

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
        """One sentence."""
        good = sum(found.agrees for found in self.cases.values())
        more = f"; no results of {', '.join(self.missing)}" if self.missing else ""
        word = "agrees" if self.agrees else "disagrees"
        return f"{word}: {good} of {len(self.cases)} cases have all of their blocks inside{more}"

    def table(self) -> pl.DataFrame:
        """One row per case: name, blocks judged, inside, low, high, missing, extra, disputed, the error of the sum, agrees."""
        rows = []
        for name, found in self.cases.items():
            n = found.counts
            total = found.total[1]
            rows.append(
                {
                    CASE: name, "judged": sum(n[word] for word in ("inside", "low", "high", "missing", "disputed")),
                    **{word: n[word] for word in ("inside", "low", "high", "missing", "extra", "disputed")},
                    "outside_mm3": found.outside_mm3,
                    "error_of_the_sum": (found.removed_mm3 - total) / total if total else None,
                    "agrees": found.agrees,
                }
            )  # fmt: skip
        return pl.DataFrame(rows)

    def to_dict(self) -> dict[str, Any]:
        """All of it as JSON takes it."""
        return {
            "agrees": self.agrees, "verdict": self.verdict, "reference": self.reference, "missing": list(self.missing),
            "summary": self.table().to_dicts(), "cases": {name: found.to_dict() for name, found in self.cases.items()},
        }  # fmt: skip


def compare_set(
    results: Path, reference: Path, *, tolerance_rel: float = 0.0, tolerance_mm3: float = 0.0
) -> SetComparison:
    """Somebody's volumes of the cases of a set.

    results : a directory with CASE.csv, or with CASE/blocks.csv as a run leaves it; or one CSV file with a column `case`.
    reference : directory of a set.
    Raises InputError: No results of any case, results of a case that the set does not have, a pack that changed; see
        `compare`.
    """
    manifest = read_manifest(reference)
    if manifest is None or manifest.get("kind") != SET_KIND or not isinstance(manifest.get("cases"), dict):
        raise InputError("is not a finished set", file=str(reference), remedy=f"vmachining pack {reference}")
    known: dict[str, str] = manifest["cases"]
    for name, digest in known.items():
        path = reference / name / MANIFEST
        if not path.is_file() or sha256(path) != digest:
            raise InputError(
                "is missing or differs from the one that the set was made with", file=str(path), remedy="fetch the set again"
            )  # fmt: skip
    found = {
        name: compare(table, reference / name, tolerance_rel=tolerance_rel, tolerance_mm3=tolerance_mm3)
        for name, table in _tables_by_case(results, tuple(known))
    }
    if not found:
        raise InputError(
            "no results of any case",
            file=str(results),
            remedy=f"give {next(iter(known))}.csv in it, and so on",
        )
    return SetComparison(found, tuple(name for name in known if name not in found), str(reference))


def _tables_by_case(results: Path, known: Sequence[str]) -> Iterator[tuple[str, Any]]:
    """Results by case."""
    if results.is_dir():
        for name in known:
            for path in (results / f"{name}.csv", results / name / "blocks.csv"):
                if path.is_file():
                    yield name, path
                    break
        return
    line, names, rows = csv_table(results)
    if CASE not in names:
        raise InputError(
            f"no column {CASE}", file=str(results), line=line,
            remedy=f"name one case as reference, such as {known[0]}, or add the column",
        )  # fmt: skip
    at = names.index(CASE)
    tables: dict[str, list[list[str]]] = {}
    for number, row in rows:
        if row[at] not in known:
            raise InputError(
                f"the set has no case {row[at]!r}", file=str(results), line=number, remedy=f"one of {', '.join(known)}"
            )  # fmt: skip
        tables.setdefault(row[at], []).append(row)
    for name, lines in tables.items():
        yield name, {key: [line[k] for line in lines] for k, key in enumerate(names) if key != CASE}
