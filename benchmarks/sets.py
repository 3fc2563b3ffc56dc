"""A reference set is made: a directory of packs that belong together; `vmachining compare` compares with one.

`set.toml` lists the cases. Each is a folder beside it that holds a job and its inputs; its pack is made there, or in a folder
of the same name elsewhere. A set keeps the digest of every pack's manifest, and that manifest those of all files, so the
digest of the set's manifest names every byte.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import polars as pl

from vmachining.errors import InputError
from vmachining.job import Job
from vmachining.job.files import (
    MANIFEST,
    make_folder,
    read_manifest,
    sha256,
    versions,
    write_atomic,
    write_json,
)
from vmachining.oracle.compare import SET_KIND
from vmachining.oracle.pack import KIND, write_pack
from vmachining.oracle.readme import CC0
from vmachining.progress import Progress
from vmachining.textfile import parse_toml

__all__ = ["SET_FILE", "Case", "CaseSet", "write_set"]

SET_FILE = "set.toml"

Begun = Callable[[str, int, int], None]
"""Told the name of a case, how many are done, how many there are."""


@dataclass(frozen=True, slots=True)
class Case:
    """A line of `set.toml`.

    name : its folder. shows : what it is there for, a few words. engine : who computes it.
    engagement : how many blocks have a table of engaged intervals. stock : formats of the finished workpiece.
    """

    name: str
    shows: str
    engine: str = "mesh"
    engagement: int = 4
    stock: tuple[str, ...] = ("3mf",)


@dataclass(frozen=True, slots=True)
class CaseSet:
    """`set.toml` as data. title, about : for the page. cite : how a paper names the set."""

    folder: Path
    title: str
    about: str
    cite: str
    cases: tuple[Case, ...]

    @classmethod
    def load(cls, folder: Path) -> CaseSet:
        """The set of a directory.

        Raises
        ------
        InputError
            No `set.toml`, or one that lacks a key, has one too many, or names a folder without a job.
        """
        path = folder / SET_FILE
        try:
            data = parse_toml(path.read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as exc:
            raise InputError(
                f"cannot read: {getattr(exc, 'strerror', None) or exc}", file=str(path),
                remedy=f"a set is a directory with a {SET_FILE}",
            ) from exc  # fmt: skip
        known = {"title", "about", "cite", "cases"}
        if unknown := sorted(data.keys() ^ known):
            raise InputError(f"key {unknown[0]!r}: expected {', '.join(sorted(known))}", file=str(path))
        cases: list[Case] = []
        for entry in data["cases"]:
            try:
                case = Case(**{**entry, **({"stock": tuple(entry["stock"])} if "stock" in entry else {})})
            except TypeError as exc:
                raise InputError(f"a case {entry.get('name')!r}: {exc}", file=str(path)) from exc
            if case.name in {c.name for c in cases} or Path(case.name).name != case.name:
                raise InputError(f"a case {case.name!r}: expected a folder name, once", file=str(path))
            if not (folder / case.name / "job.toml").is_file():
                raise InputError(f"a case {case.name!r} without {case.name}/job.toml", file=str(path))
            cases.append(case)
        return cls(folder, data["title"], data["about"], data["cite"], tuple(cases))


def write_set(
    folder: Path,
    out: Path | None = None,
    *,
    resume: bool = True,
    begun: Begun = lambda *_: None,
    progress: Progress | None = None,
) -> dict[str, dict[str, Any]]:
    """Make every pack of a set, its page and its manifest; summaries by case.

    Parameters
    ----------
    folder : with `set.toml`. out : where the packs go; None: beside their jobs.
    resume : a pack that was made from the same inputs, options and versions is left as it is.

    Raises
    ------
    InputError
        See `CaseSet.load` and `write_pack`.
    """
    cases, out = CaseSet.load(folder), out or folder
    summaries: dict[str, dict[str, Any]] = {}
    for k, case in enumerate(cases.cases):
        begun(case.name, k, len(cases.cases))
        job, target = Job.load(folder / case.name / "job.toml"), out / case.name
        if not (resume and _is_made(job, target, case)):
            write_pack(
                job, target, stock=case.stock, licence="cc0", engagement=case.engagement, engine=case.engine,
                progress=progress, among_inputs=True,
            )  # fmt: skip
        summaries[case.name] = _summary(target)
    make_folder(out)
    write_atomic(out / "LICENCE.md", CC0)
    write_atomic(out / "README.md", _page(cases, out, summaries))
    if out != folder:
        write_atomic(out / SET_FILE, (folder / SET_FILE).read_text(encoding="utf-8"))
    names = ("LICENCE.md", "README.md", SET_FILE)
    manifest = {
        "kind": SET_KIND, "format": 1, "complete": True,
        "versions": {key: text for key, text in versions().items() if key not in ("python", "platform")},
        "cases": {case.name: sha256(out / case.name / MANIFEST) for case in cases.cases},
        "files": {name: sha256(out / name) for name in names},
    }  # fmt: skip
    write_json(out / MANIFEST, manifest)
    return summaries


def _is_made(job: Job, target: Path, case: Case) -> bool:
    """Whether the pack of a case is there, whole, of these inputs, options and versions."""
    manifest = read_manifest(target) or {}
    files = manifest.get("files")
    if manifest.get("kind") != KIND or manifest.get("complete") is not True or not isinstance(files, dict):
        return False
    now = {key: text for key, text in versions().items() if key not in ("python", "platform")}
    options = manifest.get("options", {})
    asked = {"engine": case.engine, "stock": list(case.stock), "engagement": case.engagement}
    if manifest.get("versions") != now or any(options.get(key) != value for key, value in asked.items()):
        return False
    if any(
        not (target / name).is_file() or sha256(target / name) != digest for name, digest in files.items()
    ):
        return False
    return all(files.get(path.name) == sha256(path) for path in job.inputs.values())


def _summary(pack: Path) -> dict[str, Any]:
    """What the page says of a pack."""
    blocks = pl.read_parquet(pack / "blocks.parquet")
    cut = blocks.filter(pl.col("removed_mm3") > 0.0)
    relative = (cut["removed_hi_mm3"] - cut["removed_lo_mm3"]) / cut["removed_mm3"]
    return {
        "blocks": len(blocks), "removing": len(cut), "proven": int(cut["proven"].sum()),
        "removed_mm3": float(blocks["removed_mm3"].sum()),
        "width_median": float(relative.median() or 0.0),  # type: ignore[arg-type]  # a float column
        "axes": 3 if bool((blocks["k"] == 1.0).all()) else 5,
        "tools": sorted({tool.name for tool in Job.load(pack / "job.toml").tools.values()}),
        "bytes": sum(path.stat().st_size for path in pack.iterdir()),
    }  # fmt: skip


def _page(cases: CaseSet, out: Path, summaries: Mapping[str, Mapping[str, Any]]) -> str:
    """README.md of a set: one page."""
    rows = "\n".join(
        f"| [`{case.name}`]({case.name}/README.md) | {case.shows} | {s['axes']} | {'; '.join(s['tools'])} | {s['blocks']} | "
        f"{s['removed_mm3']:.3f} | {100.0 * s['width_median']:.2g} % | {s['proven']} of {s['removing']} | {case.engine} |"
        for case in cases.cases
        for s in (summaries[case.name],)
    )
    total, size = sum(s["blocks"] for s in summaries.values()), sum(s["bytes"] for s in summaries.values())
    return f"""\
# {cases.title}

{cases.about.strip()}

{len(cases.cases)} programs, {total} blocks, {size / 1e6:.1f} MB. Licence: CC0 1.0, see `LICENCE.md`.

| case | shows | axes | cutters | blocks | removed, mm³ | width of a block's bracket, median | proven | engine |
|---|---|---|---|---|---|---|---|---|
{rows}

## What is in a case

`job.toml` and the program say what is cut, in which stock, with which cutters. `blocks.csv` has one row per NC block with the
volume that it removes, between `removed_lo_mm3` and `removed_hi_mm3`; the column `proven` says whether these are proven bounds.
`engagement.csv` has the engaged intervals of the cutting edge in the middle of chosen blocks. `stock_before.stl` and
`stock_after.3mf` are the workpiece.
`README.md` explains every column. Nothing has to be installed to use them.

## How to judge a simulation

Compute the removed volume of every block. A volume outside of proven bounds is wrong. Inside it is not proved right, but no error
larger than the width of the bracket is left. With vmachining, where `results/CASE.csv` has the columns `block` (or `line`) and
`removed_mm3`, or one table has a column `case` beside them:

    vmachining compare results .

## How to cite

{cases.cite.strip()}

The SHA-256 of `{MANIFEST}` names every byte of the set: it holds the digests of all packs, and those of their files.
This makes the set again, the same bytes with the same versions:

    vmachining pack .
"""
