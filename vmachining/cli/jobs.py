"""run and demo."""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from dataclasses import dataclass, fields
from importlib.resources import files
from pathlib import Path
from typing import Any

from vmachining.cli.main import Code
from vmachining.cli.screen import emit, note, progress_bar
from vmachining.cli.stop import Watch, watched
from vmachining.errors import InputError
from vmachining.job import Job, RunResult, Stopped, check_formats, run
from vmachining.job.batch import already_complete, safe_name
from vmachining.job.brep import JUDGED, blank, disputes, parse_blocks, parse_brep, refuse_beyond
from vmachining.job.files import read_manifest
from vmachining.job.folder import FolderLock
from vmachining.job.reading import read_job_program
from vmachining.job.simulate import Progress
from vmachining.job.toolpath import Toolpath
from vmachining.tolerance import BREP_SECONDS

__all__ = ["RunOptions", "demo_job", "demo_models", "list_demos", "run_demo", "run_job", "told_disputes"]

ENGINES_OF_DEMOS = {"mould_cover": "vectors"}
"""What a model shows is another engine's than that of `run`: vectors measure a part."""

FEW = 10
"""Disputed blocks on the terminal; the table has them all."""

SHOWN = 5
"""Warnings on the terminal."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOptions:
    """Options of `vmachining run` that change what is computed or written, as they were given."""

    engine: str | None = None
    width: str | None = None
    chord: float | None = None
    spacing: float | None = None
    directions: int | None = None
    brep: str = "none"
    brep_seconds: float | None = None
    workers: int | None = None
    stock: str = "stl"
    stock_at: str | None = None

    def words(self) -> list[str]:
        """Those that are not as by default, on a command line."""
        found: list[str] = []
        for field in fields(self):
            value = getattr(self, field.name)
            if value != field.default:
                word = f"{value:g}" if isinstance(value, float) else str(value)
                found += [f"--{field.name.replace('_', '-')}", word]
        return found


def run_job(
    file: Path,
    options: RunOptions,
    *,
    out: Path | None = None,
    resume: bool = False,
    quiet: bool = False,
    as_json: bool = False,
    told: Progress | None = None,
    every_strategy: bool = False,
) -> int:
    """`vmachining run`, or `strategies` with `every_strategy`. told : hears of the progress, too."""
    parse_brep(options.brep)
    formats = check_formats(options.stock)
    steps = parse_blocks(options.stock_at, "--stock-at") if options.stock_at is not None else ()
    job = Job.load(file)
    if options.chord is not None:
        job = job.with_chord(options.chord)
    if options.width is not None:
        job = job.with_width(options.width)
    job = job.with_spacing(options.spacing, options.directions)
    if steps or "step" in formats:  # said before hours of cutting
        blank(job)
    if steps:
        refuse_beyond(steps, len(Toolpath.of(read_job_program(job), job.machine).blocks) - 1, "--stock-at")
    folder = out if out is not None else Path("out") / safe_name(job.name)
    silent = quiet or as_json
    if resume and (summary := already_complete(job, folder)) is not None:
        note(f"{folder} is complete already", quiet=silent)
        if as_json:
            emit(summary)
        return Code.DONE
    with FolderLock(folder) as lock:
        command = "strategies" if every_strategy else "run"
        again = ["vmachining", command, str(file), "--out", str(folder), "--resume", *options.words()]
        with (
            progress_bar(quiet=silent) as bar,
            watched(_both(bar, told), lambda watch: _cut_short(watch, folder, again)) as progress,
        ):
            try:
                result = run(
                    job, engine=options.engine, chord=options.chord, out=folder, resume=resume, workers=options.workers,
                    brep=options.brep, brep_seconds=options.brep_seconds or BREP_SECONDS, progress=progress, lock=lock,
                    every_strategy=every_strategy,
                )  # fmt: skip
            except Stopped as exc:
                note(
                    f"vmachining: {exc}; the rows so far are in {folder}, nothing is lost: {shlex.join(again)}"
                )
                return Code.INTERRUPTED
        result.write(folder, stock=formats, stock_at=[block for part in steps for block in part])
    if as_json:
        emit(result.summary)
    else:
        note(_told(result, folder), quiet=quiet)
        note("\n".join(told_disputes(result)), quiet=not quiet or not result.summary["brep"]["disputed"])
    counts = result.summary["brep"]
    refused = counts["disputed"] or counts["refused"] or "stock_step_refused" in result.summary
    return Code.FINDINGS if refused else Code.DONE


def _both(one: Progress | None, other: Progress | None) -> Progress | None:
    """Whoever wants to hear of the progress."""
    if one is None or other is None:
        return one or other

    def told(stage: str, done: int, total: int) -> None:
        one(stage, done, total)
        other(stage, done, total)

    return told


def _cut_short(watch: Watch, folder: Path, again: Sequence[str]) -> str:
    """What is known of a run that was ended within a block."""
    stage, done, total = watch.place or ("start", 0, 0)
    where = f"block {done + 1} of {total} ({stage})" if total else "the start"
    kept = (read_manifest(folder) or {}).get("checkpoints", {})
    told = ", ".join(f"{entry['done']} of {entry['total']} ({name})" for name, entry in kept.items())
    state = f"kept are the blocks up to {told}" if told else "no checkpoint was due yet, so it starts again"
    return f"ended within {where}, which took too long to finish; {state}: {shlex.join(again)}"


def run_demo(name: str = "slot", *, out: Path | None, stock: str, quiet: bool, as_json: bool) -> int:
    """`vmachining demo`."""
    options = RunOptions(engine=ENGINES_OF_DEMOS.get(name), stock=stock)
    return run_job(demo_job(name), options, out=out, quiet=quiet, as_json=as_json)


def list_demos(*, as_json: bool) -> int:
    """`vmachining demo --list`: seconds are of a processor, kernels compiled."""
    for name, job in demo_models().items():
        page = job.parent / "README.md"
        about, seconds = _about(page), _takes(page)
        if as_json:
            emit({"name": name, "about": about, "job": str(job), "processor_s": seconds})
        else:
            print(f"{name:<20}  {'' if seconds is None else f'{seconds:g} s':>6}  {about}")
    return Code.DONE


def _about(readme: Path) -> str:
    """First sentence of a model's page, behind its heading."""
    text = readme.read_text(encoding="utf-8") if readme.is_file() else ""
    parts = [part for part in text.split("\n\n") if part.strip() and not part.startswith("#")]
    words = " ".join(parts[0].split()) if parts else ""
    return re.split(r"(?<=[.:;])\s", words, maxsplit=1)[0].rstrip(".:;")


def _takes(readme: Path) -> float | None:
    """Seconds of a processor that a model's page states."""
    text = readme.read_text(encoding="utf-8") if readme.is_file() else ""
    found = re.search(r"^Processor time of `vmachining demo \w+`: ([\d.]+) s", text, flags=re.MULTILINE)
    return float(found[1]) if found else None


def demo_models() -> dict[str, Path]:
    """Job of each shipped model by its name: inside an installed package, or beside it in a source tree."""
    package = Path(str(files("vmachining")))
    for root in (package / "models", package.parent / "models"):
        # the reference set has a script and no job of its own
        scripts = [path for path in sorted(root.glob("*/make.py")) if (path.parent / "job.toml").is_file()]
        if scripts:
            return {path.parent.name: path.parent / "job.toml" for path in scripts}
    raise InputError("no models are installed with this package")


def demo_job(name: str = "slot") -> Path:
    """Job file of a shipped model."""
    known = demo_models()
    if name not in known:
        raise InputError(f"no model {name!r}", remedy=f"one of {', '.join(known)}")
    return known[name]


def _files(s: dict[str, Any]) -> list[str]:
    """What the triangles in a file hold where it is not what the summary says."""
    told = []
    for name, volume in s.get("stock_files_mm3", {}).items():
        if abs(volume - s["final_mm3"]) > 1e-6 * s["final_mm3"]:
            rounding = volume - s["stock_mesh_mm3"]
            told.append(
                f"  stock     {name} holds {volume - s['final_mm3']:+.2g} mm3 beside the estimate, {rounding:+.2g} of it by "
                "rounding of its coordinates"
            )
    return told


def _no_step(summary: dict[str, Any]) -> list[str]:
    """Why there is no STEP of the workpiece, if one was asked for."""
    return [f"  stock     {summary['stock_step_refused']}"] if "stock_step_refused" in summary else []


def told_disputes(result: RunResult) -> list[str]:
    """What is wrong with one of our engines: blocks whose intervals exclude each other, the first few of them."""
    if not result.summary["brep"]["disputed"]:
        return []
    found = disputes(result.blocks)
    lines = [f"  block {block} (line {line}): {one}, {other}" for block, line, _, one, other in found[:FEW]]
    more = [f"  and {len(found) - FEW} more, see blocks.csv"] if len(found) > FEW else []
    head = "DISPUTED: two of our engines exclude each other, one of them is wrong; please report it"
    return [head, *lines, *more]


def _second(counts: dict[str, Any]) -> list[str]:
    """What the B-rep engine said, if it was asked."""
    if not counts["asked"]:
        return []
    said = ", ".join(f"{counts[word]} {word}" for word in JUDGED)
    return [f"  B-rep     {counts['asked']} blocks asked: {said}"]


def _first_warnings(result: RunResult) -> list[str]:
    """The first warnings with their lines, and where the others are."""
    import polars as pl

    rows = result.blocks.filter(pl.col("warning").is_not_null()).select("line", "warning")
    found = sorted([*rows.head(SHOWN).iter_rows(), *((line, text) for line, _, text in result.findings)])
    left = result.summary["warnings"] - len(found[:SHOWN])
    more = [f"            and {left} more in blocks.csv and report.html"] if left > 0 else []
    return [*(f"            line {line}: {text}" for line, text in found[:SHOWN]), *more]


def _machine(machine: dict[str, Any] | None) -> list[str]:
    """Where the rotary axes of the machine lie: presets have offsets of their own."""
    return [] if machine is None else [f"  machine   {machine['name']}: {', '.join(machine['rotary'])}"]


def _told(result: RunResult, folder: Path) -> str:
    """The summary for people."""
    s = result.summary
    lines = [
        *told_disputes(result),
        f"{result.job.name}: {s['blocks']} blocks in {s['seconds']:.1f} s",
        f"  removed   {s['removed_mm3']:.6g} mm3   +-{result.removed.error:.2g}",
        f"  between   {s['removed_lo_mm3']:.6g} and {s['removed_hi_mm3']:.6g} mm3",
        f"  time      {s['time_s']:.2f} s"
        + (f" -> {s['scheduled_time_s']:.2f} s scheduled" if s["scheduled_time_s"] is not None else ""),
        f"  warnings  {s['warnings']}",
        *_first_warnings(result),
        *_machine(s.get("machine")),
        *_second(s["brep"]),
        *_files(s),
        *_no_step(s),
        *(f"  note      {text}" for text in s["notes"]),
        *(f"  contact   {text}" for text in s.get("contact_notes", ())),
    ]
    if (schedule := result.schedule) is not None and schedule.note:
        lines.append(f"  schedule  {schedule.note}")
    if left := len(s.get("unsplit_lines", ())) + len(s.get("untouched_lines", ())):
        lines.append(f"  schedule  {left} lines could not take the feed they want, see the warnings")
    lines.append(f"  files     {folder}")
    return "\n".join(lines)
