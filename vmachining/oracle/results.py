"""Both sides, read strictly: somebody's volumes (a CSV file, a table or a mapping), and what is known (a folder of
`vmachining run`, a reference pack, or a result in memory)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import repeat
from pathlib import Path
from typing import Any

import polars as pl

from vmachining.errors import InputError
from vmachining.job.files import MANIFEST, read_manifest, read_table, sha256
from vmachining.job.result import RunResult
from vmachining.textfile import csv_rows, finite, parse_json

KEYS = ("block", "line")
"""In this order: a table that has both is keyed by block, the finer of the two."""

VOLUME, TEXT = "removed_mm3", "text"
LARGEST = 1e30
"""mm, mm^3: no workpiece has more, and sums, differences and ratios of such numbers stay finite."""

WHOLE_BITS = 63
"""Blocks and lines are columns of 64 bits."""

TABLE = "results are a CSV table"
WANTED = "give a header with block or line, and removed_mm3"


@dataclass(frozen=True, slots=True)
class Results:
    """Removed volume by key.

    key : "block" or "line". removed_mm3 : {number: mm^3}; rows of one line are summed. source : file name, or "table".
    texts : {number: (place, text)} of a table that repeats the lines of the program.
    """

    key: str
    removed_mm3: dict[int, float]
    source: str
    texts: dict[int, tuple[dict[str, Any], str]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """Columns as they were handed in, equally long. lines : of the rows, where they come from a text file."""

    columns: Mapping[str, Sequence[Any]]
    source: str
    lines: Sequence[int] | None = None

    @classmethod
    def read(
        cls,
        given: Path | str | pl.DataFrame | Mapping[str, Sequence[Any]],
        chosen: Callable[[Sequence[str], str, int | None], Sequence[str]],
        source: str = "table",
    ) -> Table:
        """Columns of a CSV or Parquet file, a polars table or a mapping.

        chosen : the names that are needed, of those that there are, with source and line of the header; refuses others.
        source : what errors call a table that is not a file.
        Raises InputError: Unreadable, a name twice, columns of several lengths, or what `chosen` refuses.
        """
        if isinstance(given, (str, Path)):
            path = table_in(Path(given), "blocks") or Path(given)
            if path.suffix == ".parquet":
                return cls.read(frame_of(path), chosen, str(path))
            line, names, rows = csv_table(path)
            needed = chosen(names, str(path), line)
            if twice := [name for name in needed if names.count(name) > 1]:
                raise InputError(
                    f"column {twice[0]} twice", file=path, line=line, remedy="rename one of them"
                )
            numbered = list(rows)
            columns = {name: [row[names.index(name)] for _, row in numbered] for name in needed}
            return cls(columns, str(path), [number for number, _ in numbered])
        held = given if isinstance(given, Mapping) else given.to_dict()
        columns = {name: list(held[name]) for name in chosen(list(held), source, None)}
        first, *others = columns
        for name in others:
            if len(columns[name]) != len(columns[first]):
                sizes = f"{len(columns[first])} values of {first}, {len(columns[name])} of {name}"
                raise InputError(f"{source}: {sizes}")
        return cls(columns, source)

    def where(self, row: int) -> dict[str, Any]:
        """file and line keywords of an error about one row, which counts from 0."""
        if self.lines is None:
            return {"file": f"{self.source} row {row + 1}"}
        return {"file": self.source, "line": self.lines[row]}


def table_in(folder: Path, stem: str) -> Path | None:
    """Path of a table in a result directory, Parquet if there is one, else CSV; None if there is neither."""
    paths = folder / f"{stem}.parquet", folder / f"{stem}.csv"
    return next((path for path in paths if path.is_file()), None)


def frame_of(path: Path) -> pl.DataFrame:
    """A table of ours, in either format.

    Raises InputError: It cannot be read.
    """
    try:
        return read_table(path)
    except (OSError, pl.exceptions.PolarsError) as exc:
        raise InputError(f"cannot read the table: {str(exc).splitlines()[0]}", file=path) from exc


def read_results(results: Path | str | pl.DataFrame | Mapping[str, Sequence[Any]]) -> Results:
    """Read results.

    results : a CSV file (comma, semicolon or tab; a header; blank lines and lines that open with # are skipped), a
        Parquet file, a result directory, a polars table, or a mapping of columns. Columns `block` (from 0) or `line`
        (from 1), and `removed_mm3`; `text`, the line of the program, tells another program; others are ignored. Several
        rows of one line are summed; a block may come once.
    Raises InputError: Unreadable, no such columns, a value that is not a finite number or beyond `LARGEST`, a block twice;
        names file and line.
    """
    return _gather(Table.read(results, _chosen))


def csv_table(path: Path) -> tuple[int, list[str], Iterator[tuple[int, list[str]]]]:
    """Line of the header, its names, and (line, cells) of the rows below, each as long as the header.

    Raises InputError: It cannot be read, or is not a CSV table; while the rows are read: one is longer or shorter.
    """
    rows = csv_rows(path, "results", TABLE)
    line, header = next(rows, (1, []))
    names = [name.strip() for name in header]

    def even() -> Iterator[tuple[int, list[str]]]:
        for number, row in rows:
            if len(row) != len(names):
                what = f"{len(row)} cells where the header has {len(names)}"
                remedy = "a decimal comma needs ; between cells" if len(row) > len(names) else None
                raise InputError(what, file=path, line=number, remedy=remedy)
            yield number, row

    return line, names, even()


def _chosen(known: Sequence[str], source: str, line: int | None) -> list[str]:
    """Key column, volumes, and texts where there are some, of a table that has what is needed."""
    if not known:
        raise InputError("no table in it", file=source, line=line, remedy=WANTED)
    key = next((name for name in KEYS if name in known), None)
    for name, there in (("block or line", key), (VOLUME, VOLUME in known)):
        if not there:
            shown = ", ".join(known[:8]) + (", ..." if len(known) > 8 else "")
            raise InputError(f"no column {name} among {shown}", file=source, line=line, remedy=WANTED)
    assert key is not None
    return [key, VOLUME, *([TEXT] if TEXT in known else [])]


def _gather(table: Table) -> Results:
    key, *_ = table.columns
    parts: dict[int, list[float]] = {}
    texts: dict[int, tuple[dict[str, Any], str]] = {}
    columns = (table.columns.get(name, repeat(None)) for name in (key, VOLUME, TEXT))
    count = len(table.columns[key])
    for row, (name, value, text) in enumerate(zip(*columns, strict=False)):
        where = table.where(row)
        number, volume = whole(name, key, where), finite(value)
        if volume is None:
            what = f"{VOLUME} {value!r} of {key} {number} is not a finite number"
            remedy = "write a number with a decimal point, 0 for a block that removes nothing"
            raise InputError(what, **where, remedy=remedy)
        if abs(volume) > LARGEST:
            raise InputError(f"{VOLUME} {value!r} of {key} {number} is beyond {LARGEST:g} mm3", **where)
        if key == "block" and number in parts:
            remedy = "key rows by line if they are to be summed"
            raise InputError(f"block {number} comes twice", **where, remedy=remedy)
        parts.setdefault(number, []).append(volume)
        if isinstance(text, str) and text.strip():
            texts.setdefault(number, (where, text))
    if not count:
        raise InputError("a header and no results", file=table.source, remedy="one row per block or line")
    volumes = {number: math.fsum(values) for number, values in parts.items()}
    return Results(key, volumes, table.source, texts)


def whole(value: Any, key: str, where: Mapping[str, Any]) -> int:
    """The number of a block or line that a cell holds; InputError with `where` if it holds none."""
    number = finite(value)
    if number is None or number != math.floor(number):
        remedy = "remove rows that have none"
        raise InputError(f"{key} {value!r} is not a whole number", **where, remedy=remedy)
    if not -(2.0**WHOLE_BITS) <= number < 2.0**WHOLE_BITS:
        raise InputError(f"{key} {value!r} is too large for a number of a {key}", **where)
    return int(number)


BRACKET = ("removed_lo_mm3", VOLUME, "removed_hi_mm3")
NEEDED = ("block", "line", "text", "motion", *BRACKET)
NO_FOLDER = "give the directory that vmachining run or vmachining pack wrote"


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """Volumes with their brackets.

    blocks : columns block, line, text, motion, removed_lo_mm3, removed_mm3, removed_hi_mm3, disputed; program order.
    total : (lo, estimate, hi) of the whole program, mm^3, narrower than the sum of the blocks.
    slack_mm3 : what the triangles of a curved STEP stock can do to any one block; 0 otherwise.
    source : where it was read.
    """

    blocks: pl.DataFrame
    total: tuple[float, float, float]
    slack_mm3: float
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
        return _checked(reference.blocks, reference.summary, "result")
    folder = Path(reference)
    if not folder.is_dir():
        what = "not a directory" if folder.exists() else "no such directory"
        raise InputError(what, file=folder, remedy=NO_FOLDER)
    manifest = read_manifest(folder)
    if manifest is None:
        raise InputError(f"no {MANIFEST} in it: not a result", file=folder, remedy=NO_FOLDER)
    if manifest.get("complete") is not True:
        what = "the run in this directory is not complete"
        raise InputError(what, file=folder, remedy="finish it with --resume")
    again = "fetch the pack again, or run the job again"
    files = manifest.get("files", {})
    for name, digest in files.items() if isinstance(files, dict) else ():
        path = folder / name
        if path.is_file() and sha256(path) != digest:
            raise InputError("differs from the file that was made here", file=path, remedy=again)
    path = table_in(folder, "blocks") or folder / "blocks.parquet"
    if isinstance(files, dict) and files and path.name not in files:
        raise InputError("is not a file that was made here", file=path, remedy=again)
    blocks = frame_of(path)
    try:
        summary = parse_json((folder / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as exc:
        raise InputError(f"cannot read: {exc}", file=folder / "summary.json") from exc
    return _checked(blocks, summary, str(folder), path)


def _checked(blocks: pl.DataFrame, summary: Any, source: str, path: Path | None = None) -> Reference:
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
    return Reference(table, (lowest, middle, highest), slack, source)
