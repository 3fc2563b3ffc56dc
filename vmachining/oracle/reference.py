"""The side that is known: a folder of `vmachining run`, a reference pack, or a result in memory."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import polars as pl

from vmachining.errors import InputError
from vmachining.job.files import MANIFEST, read_manifest, sha256
from vmachining.job.result import RunResult
from vmachining.oracle.results import VOLUME, finite
from vmachining.textfile import parse_json

BRACKET = ("removed_lo_mm3", VOLUME, "removed_hi_mm3")
NEEDED = ("block", "line", "text", "motion", *BRACKET)
NO_FOLDER = "give the directory that vmachining run or vmachining pack wrote"


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """Volumes with their brackets.

    blocks : columns block, line, text, motion, removed_lo_mm3, removed_mm3, removed_hi_mm3, disputed; program order.
    total : (lo, estimate, hi) of the whole program, mm^3, narrower than the sum of the blocks.
    slack_mm3 : what the triangles of a curved STEP stock can do to any one block; 0 otherwise.
    name, source : of the job; where it was read.
    """

    blocks: pl.DataFrame
    total: tuple[float, float, float]
    slack_mm3: float
    name: str
    source: str

    def by(self, key: str) -> pl.DataFrame:
        """One row per block, or the sums per line: key, text, rapid, count, the bracket, disputed."""
        sums = [pl.col(name).sum() for name in BRACKET]
        rapid = (pl.col("motion") == "rapid").all().alias("rapid")
        return self.blocks.group_by(key, maintain_order=True).agg(
            pl.col("text").first(), rapid, pl.len().alias("count"), *sums, pl.col("disputed").any()
        )


def read_reference(reference: Path | str | RunResult) -> Reference:
    """Read a reference.

    Raises InputError: No such folder, not a complete result, a file that changed since the pack was made or is not one
        of its own, a table that lacks a column or a value.
    """
    if isinstance(reference, RunResult):
        return _checked(reference.blocks, reference.summary, reference.job.name, "result")
    folder = Path(reference)
    if not folder.is_dir():
        what = "not a directory" if folder.exists() else "no such directory"
        raise InputError(what, file=str(folder), remedy=NO_FOLDER)
    manifest = read_manifest(folder)
    if manifest is None:
        raise InputError(f"no {MANIFEST} in it: not a result", file=str(folder), remedy=NO_FOLDER)
    if manifest.get("complete") is not True:
        raise InputError(
            "the run in this directory is not complete", file=str(folder), remedy="finish it with --resume"
        )
    files = manifest.get("files", {})
    for name, digest in files.items() if isinstance(files, dict) else ():
        path = folder / name
        if path.is_file() and sha256(path) != digest:
            raise InputError(
                "differs from the file that was made here", file=str(path),
                remedy="fetch the pack again, or run the job again",
            )  # fmt: skip
    path = folder / "blocks.parquet"
    if not path.is_file():
        path = folder / "blocks.csv"
    if isinstance(files, dict) and files and path.name not in files:
        raise InputError(
            "is not a file that was made here",
            file=str(path),
            remedy="fetch the pack again, or run the job again",
        )
    try:
        blocks = (
            pl.read_parquet(path)
            if path.suffix == ".parquet"
            else pl.read_csv(path, infer_schema_length=None)
        )
    except (OSError, pl.exceptions.PolarsError) as exc:
        raise InputError(f"cannot read the table: {str(exc).splitlines()[0]}", file=str(path)) from exc
    try:
        summary = parse_json((folder / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as exc:
        raise InputError(f"cannot read: {exc}", file=str(folder / "summary.json")) from exc
    return _checked(blocks, summary, str(manifest.get("job", folder.name)), str(folder), path)


def _checked(
    blocks: pl.DataFrame, summary: Any, name: str, source: str, path: Path | None = None
) -> Reference:
    where: dict[str, Any] = {"file": str(path) if path is not None else source}
    if lacking := [column for column in NEEDED if column not in blocks.columns]:
        raise InputError(f"no column {lacking[0]}", **where, remedy=NO_FOLDER)
    has_status = "brep_status" in blocks.columns
    disputed = (pl.col("brep_status") == "disputed").fill_null(False) if has_status else pl.lit(False)
    try:
        table = blocks.select(
            pl.col("block", "line").cast(pl.Int64), pl.col("text", "motion").cast(pl.String),
            pl.col(*BRACKET).cast(pl.Float64), disputed.alias("disputed"),
        )  # fmt: skip
    except pl.exceptions.PolarsError as exc:
        raise InputError(f"not a table of blocks: {str(exc).splitlines()[0]}", **where) from exc
    lo, estimate, hi = (table[column] for column in BRACKET)
    whole = lo.is_finite() & hi.is_finite() & (lo <= estimate) & (estimate <= hi)
    if len(table) == 0 or not whole.fill_null(False).all():
        raise InputError("a block without a bracket", **where, remedy="run the job again")
    held = {"stock_slack_mm3": 0.0, **summary} if isinstance(summary, dict) else {}
    numbers = {column: finite(held.get(column)) for column in (*BRACKET, "stock_slack_mm3")}
    if empty := [column for column, number in numbers.items() if number is None]:
        raise InputError(f"the summary has no number {empty[0]}", file=source, remedy=NO_FOLDER)
    lowest, middle, highest, slack = (number for number in numbers.values() if number is not None)
    return Reference(table, (lowest, middle, highest), slack, name, source)
