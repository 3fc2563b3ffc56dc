"""A reference pack: a job with all of its inputs, its volumes, its finished stock, every file hashed.

The same job and versions give the same bytes: nothing in a pack tells when, where or how fast it was made, and
one process cuts unless more are asked for (tiles that are joined in another order round differently).
"""

from __future__ import annotations

import json
import os
import re
import shlex
import tomllib
from collections.abc import Iterable, Mapping
from copy import copy
from pathlib import Path
from typing import Any

import polars as pl

from vmachining.disk import LOCK, Scratch
from vmachining.errors import EngineError, InputError, JobError, SweepError
from vmachining.job import Job, RunResult, Scene, engage, run
from vmachining.job.brep import blank, write_step
from vmachining.job.engage import Method
from vmachining.job.files import (
    MANIFEST,
    atomic_path,
    make_folder,
    read_manifest,
    sha256,
    versions,
    write_atomic,
    write_json,
)
from vmachining.job.folder import LOCK_FILE, FolderLock, ResultFolder
from vmachining.job.reading import read_job_program
from vmachining.job.stock import STOCK_FORMATS, raw_stock, write_stock
from vmachining.job.table import readable
from vmachining.oracle.readme import CC0, COLUMNS_MEAN, NO_LICENCE, readme
from vmachining.progress import Progress
from vmachining.stock import Triangles

KIND = "vmachining reference pack"
LIKEWISE = {
    "x_mm": ("y_mm", "z_mm"),
    "i": ("j", "k"),
    "removed_dexel_mm3": ("removed_dexel_lo_mm3", "removed_dexel_hi_mm3"),
}
COLUMNS = [name for first in COLUMNS_MEAN for name in (first, *LIKEWISE.get(first, ()))]
LEFT_OUT = (
    "seconds", "stage_seconds", "peak_mb", "time_s", "scheduled_time_s", "ideal_time_s", "scheduled_ideal_time_s",
)  # fmt: skip
"""Keys of a summary that tell about the machine, or about feeds, which a pack is not about."""

STATIONS, MOST_STATIONS, ANGLES = 10, 10_000, 36
"""Tables of engagement: how many blocks, how many at most, rotation angles of each."""

PROVEN = ("mesh", "columns")
"""Engines that can prove their intervals; the column `proven` says of which blocks they do."""

WORDS = {"none": NO_LICENCE, "cc0": CC0}
"""Licences that have a name."""

OWN = (
    "job.toml", "README.md", "LICENCE.md", "summary.json", "stock_before.stl",
    *(f"stock_after.{suffix}" for suffix in STOCK_FORMATS),
    *(f"{name}.{suffix}" for name in ("blocks", "engagement") for suffix in ("csv", "parquet")),
)  # fmt: skip
"""Names of files that a pack may have, the manifest and the inputs apart."""

INPUTS = (("program", "file"), ("machine", "file"), ("stock", "stl"), ("stock", "step"))
"""Keys of a job file that name files."""

ROLE = {"program": "the NC program", "machine": "the machine", "stock": "the raw stock as it was given"}
SUBPROGRAM = "a subprogram that the program calls"

QUOTED = r"(?:\"[^\"]*\"|'[^']*')"
ARRAY = r"\[(?:[^\]\"'#]|\"(?:\\.|[^\"\\])*\"|'[^']*'|#[^\n]*\n)*\]"
"""Values of a job file as they may be written: a string on one line, an array over several."""


def write_pack(
    job: Job | Path | str,
    folder: Path | str,
    *,
    stock: Iterable[str] = ("stl",),
    brep: str = "none",
    licence: str = "none",
    engagement: int = STATIONS,
    engine: str = "mesh",
    workers: int | None = 1,
    progress: Progress | None = None,
    among_inputs: bool = False,
) -> RunResult:
    """Run a job and lay everything down that somebody needs who checks an engine against it.

    job : a job, or its file. A [feed] section is kept in the copy and not acted upon.
    folder : a new or empty directory, or an earlier pack, which is replaced; files in it that were changed or added
        since are refused where the new pack has a file of that name with other bytes, and stay where it has none.
    stock : formats of the finished workpiece: "stl", "3mf", "step". A STEP that the B-rep engine refuses is
        not written; `summary["stock_step_refused"]` then says why.
    brep : blocks that the B-rep engine checks; see `run`.
    licence : "none", "cc0", or the name of a text file. Nobody but you can give away your program.
    engagement : how many blocks, spread evenly over those that remove something, get a table of what the cutting
        edge touches in their middle; 0 for none. A STEP stock is met by its faces; what OCCT refuses is left out
        and told in `summary["engagement_refused"]`.
    engine : who computes the volumes, "mesh" or "columns"; blocks whose bounds are not proven say so.
    workers : processes that cut; more than one changes last digits.
    among_inputs : the directory may also hold the job and its inputs, and nothing else, without being a pack yet.

    Raises InputError: The job cannot be run, or was not read from a file; the directory holds something else; two inputs
        share a name; another process is writing there; a STEP of a stock that has too many triangles for one.
    """
    job = Job.of(job)
    folder, formats = Path(folder), tuple(stock)
    if not 0 <= engagement <= MOST_STATIONS:
        raise InputError(f"engagement of {engagement} blocks: expected 0 to {MOST_STATIONS}")
    if engine not in PROVEN:
        remedy = f"take {', '.join(PROVEN)}"
        raise InputError(f"engine {engine!r}: a pack needs bounds that are proven", remedy=remedy)
    if unknown := [name for name in formats if name not in STOCK_FORMATS]:
        raise InputError(f"unknown stock format {unknown[0]!r}", remedy=f"take {', '.join(STOCK_FORMATS)}")
    terms = _licence(licence)
    # a file of terms is known by its name in the pack, so that the pack tells nothing of where it was made
    term = licence if licence in WORDS else "LICENCE.md"
    if "step" in formats:
        blank(job)
    inputs, told = _inputs(job)
    given = {**inputs, "LICENCE.md": terms.encode()}
    ours = set(inputs) if among_inputs else set()
    _refuse_other_files(folder, ours)
    place = ResultFolder(folder, kind=KIND, names=(*OWN, *given), pattern=None)
    place.refuse_foreign(job.inputs, same=_same(folder, given))
    result = run(_without_feed(job), engine=engine, brep=brep, workers=workers, progress=progress)
    with Scratch() as made:
        # everything is made before the first byte of an earlier pack goes: it may hold our own inputs
        for name, data in given.items():
            (made / name).write_bytes(data)
        told |= _outputs(result, made, formats)
        told |= _engagement(result, made, engagement)
        summary = {key: value for key, value in result.summary.items() if key not in LEFT_OUT}
        write_json(made / "summary.json", summary)
        told |= {
            "summary.json": "totals with their bounds", "LICENCE.md": "who may do what with this",
            MANIFEST: "SHA-256 of every file, options, versions",
        }  # fmt: skip
        accuracy = job.keys.accuracy
        exact = {"width": accuracy.width, "width_mm3": accuracy.width_mm3} if engine == "columns" else {}
        options: dict[str, Any] = {
            "engine": engine, "chord_mm": accuracy.chord_mm, **exact, "brep": brep, "stock": list(formats), "licence": term,
            "engagement": engagement,
        }  # fmt: skip
        asked = f"chord {accuracy.chord_mm:g} mm"
        if exact:
            asked = f"asked of each block: {100.0 * accuracy.width:g} % or {accuracy.width_mm3:g} mm^3"
        write_atomic(made / "README.md", readme(job.name, summary, asked, told, _command(options)))
        names = sorted(path.name for path in made.iterdir() if path.name != LOCK)
        manifest = {
            "kind": KIND, "format": 1, "job": job.name, "complete": True,
            "options": options,
            "versions": {key: text for key, text in versions().items() if key not in ("python", "platform")},
            "files": {name: sha256(made / name) for name in names},
        }  # fmt: skip
        make_folder(folder)
        with FolderLock(folder) as lock:
            lock.acquire()
            _refuse_other_files(folder, ours)
            same = _same(folder, {name: (made / name).read_bytes() for name in names})
            place.refuse_foreign(job.inputs, same=same)
            place.forget(keep=same)
            files = dict.fromkeys(names)
            place.manifest = {"kind": KIND, "complete": False, "process": os.getpid(), "files": files}
            place.save()
            for name in names:
                if name not in same:
                    write_atomic(folder / name, (made / name).read_bytes())
            write_json(folder / MANIFEST, manifest)
    return result


def _command(options: Mapping[str, Any]) -> str:
    """What makes a pack again in its own folder; every option is named, for defaults may change."""
    stock = ",".join(options["stock"])
    words = ["vmachining", "pack", "job.toml", "--out", ".", "--stock", stock]
    for name in ("engine", "brep", "licence", "engagement"):
        words += [f"--{name}", str(options[name])]
    return shlex.join(words)


def _engagement(result: RunResult, made: Path, count: int) -> dict[str, str]:
    """Tables of engagement in the middle of some blocks; what they are."""
    removing = result.blocks.filter(pl.col("removed_lo_mm3") > 0.0)["block"].to_list()
    count = min(count, len(removing))
    chosen = [removing[(k * (len(removing) - 1)) // max(count - 1, 1)] for k in range(count)]
    method: Method = "brep" if result.job.keys.stock.step is not None else "dexel"
    scene, tables, refused = Scene.of(result.job), [], []
    for block in chosen:
        try:
            found = engage(scene, block, at=0.5, method=method, angles=ANGLES, phase=0.5)
        except (EngineError, SweepError) as exc:
            refused.append(f"block {block}: {exc}")
            continue
        tables.append(found.table())
    if refused:
        result.summary["engagement_refused"] = refused
    if not tables:
        return {}
    table = pl.concat(tables)
    readable(table.lazy()).collect().write_csv(made / "engagement.csv")
    table.write_parquet(made / "engagement.parquet")
    return {
        "engagement.csv": "what the cutting edge touches in the middle of some blocks, see below",
        "engagement.parquet": "the same, typed",
    }


def _without_feed(job: Job) -> Job:
    """The same cuts, nothing scheduled: a pack is about volumes."""
    other = copy(job)
    object.__setattr__(other, "keys", job.keys.model_copy(update={"feed": None}))
    return other


def _licence(licence: str) -> str:
    if licence in WORDS:
        return WORDS[licence]
    try:
        return Path(licence).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as exc:
        what, remedy = getattr(exc, "strerror", None) or "not a UTF-8 text", "take cc0, none, or a text file"
        raise InputError(f"cannot read the licence: {what}", file=licence, remedy=remedy) from exc


def _same(folder: Path, new: Mapping[str, bytes]) -> set[str]:
    """Names of files that have their bytes already, as where a pack is made again in its own directory."""
    paths = {name: folder / name for name in new}
    return {
        name
        for name, path in paths.items()
        if path.is_file() and not path.is_symlink() and path.read_bytes() == new[name]
    }


def _refuse_other_files(folder: Path, ours: set[str]) -> None:
    """Refuse a directory that holds more than `ours` and is not a pack, and what is not a directory."""
    there = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    if not there.is_dir():
        raise InputError("is a file, not a directory", file=there, remedy="choose another --out")
    if not folder.is_dir() or not {path.name for path in folder.iterdir()} - ours - {LOCK_FILE}:
        return
    manifest = read_manifest(folder)
    if manifest is None or manifest.get("kind") != KIND:
        raise InputError("holds other files", file=folder, remedy="choose a new directory by --out")
    if not isinstance(manifest.get("files"), dict):
        what, remedy = "this manifest of a pack lists no files", "choose a new directory by --out"
        raise InputError(what, file=folder / MANIFEST, remedy=remedy)


def _inputs(job: Job) -> tuple[dict[str, bytes], dict[str, str]]:
    """Bytes of job file and inputs by their names in the pack, and what they are; names lose their folders."""
    if job.source is None:
        raise JobError("a pack needs a job that was read from a file", remedy="Job.load(...)")
    text = job.source.read_bytes().decode("utf-8-sig")
    wanted: dict[str, Any] = tomllib.loads(text)
    lines = text.splitlines(keepends=True)
    files, told = {}, {"job.toml": "the job: tools, stock, accuracy"}
    taken = {*OWN, MANIFEST}

    def take(path: Path, role: str, shown: str, section: str, key: str) -> None:
        if path.name in taken:
            what = f"{shown}: a pack has another file of that name"
            raise JobError(what, **job.where(section, key), remedy="rename it")
        taken.add(path.name)
        files[path.name], told[path.name] = path.read_bytes(), role

    def rewrite(section: str, key: str, value: Any, form: str) -> None:
        wanted[section][key] = value
        if (place := job.where(section, key)["line"]) is None:
            return
        rest = "".join(lines[place - 1 :])
        hit = re.search(rf"(\b{key}[\"']?\s*=\s*){form}", rest)
        if hit is not None:
            short = hit[1] + json.dumps(value, ensure_ascii=False)
            lines[place - 1 :] = (rest[: hit.start()] + short + rest[hit.end() :]).splitlines(keepends=True)

    for section, key in INPUTS:
        name = wanted.get(section, {}).get(key)
        if not isinstance(name, str):
            continue
        path = job.folder / name
        take(path, ROLE[section], f"{key} = {name!r}", section, key)
        if path.name != name:
            rewrite(section, key, path.name, QUOTED)
    # a subprogram is found by its name next to the program; an M98 and an O call may have read one file twice
    for path in map(Path, dict.fromkeys(read_job_program(job).files)):
        take(path, SUBPROGRAM, f"the subprogram {path.name!r}", "program", "file")
    if wanted["program"].get("subroutines"):
        rewrite("program", "subroutines", [], ARRAY)  # last: it may take lines away
    copy = "".join(lines)
    if tomllib.loads(copy) != wanted:
        what, remedy = (
            "the names of its input files cannot be shortened",
            "put program and stock next to the job file",
        )
        raise JobError(what, file=job.source, remedy=remedy)
    return {"job.toml": copy.encode(), **files}, told


def _outputs(result: RunResult, made: Path, formats: tuple[str, ...]) -> dict[str, str]:
    """Write tables and solids; what they are."""
    told = {"blocks.csv": "one row per block, see below", "blocks.parquet": "the same, typed"}
    table: pl.DataFrame = result.blocks.select(COLUMNS)
    readable(table.lazy()).collect().write_csv(made / "blocks.csv")
    table.write_parquet(made / "blocks.parquet")
    around, _ = raw_stock(result.job).mesh(result.job.keys.accuracy.chord_mm)
    write_stock(around, made / "stock_before.stl")
    told["stock_before.stl"] = "the raw stock as triangles, mm"
    for suffix in formats:
        target = made / f"stock_after.{suffix}"
        if suffix != "step":
            vertices, triangles, _ = result.surface
            write_stock(Triangles(vertices, triangles), target)
            told[target.name] = "the finished workpiece as triangles, mm; " + (
                "but for rounding nowhere less material than there is"
                if result.stock.name == "mesh"
                else "through exact points, and off by parts of their distance between them"
            )
            continue
        try:
            write_step(result, target)
        except EngineError as exc:  # every other file is right without it
            result.summary["stock_step_refused"] = str(exc)
            continue
        _undate(target)
        told[target.name] = "the finished workpiece as B-rep, faces named by the block that cut them"
    return told


def _undate(step: Path) -> None:
    """OCCT stamps the time into the header of a STEP file; a pack has none."""
    text = step.read_bytes()
    stamp = rb"'\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d'"
    with atomic_path(step) as temporary:
        temporary.write_bytes(re.sub(stamp, b"'1970-01-01T00:00:00'", text, count=1))
