"""figure, strategies and view: what lies in a result directory, for papers, on the screen and in a browser."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vmachining.cli.job_commands import Figure as FigureOptions
from vmachining.cli.job_commands import RunOptions, Strategies, View
from vmachining.cli.jobs import run_job
from vmachining.cli.main import Code
from vmachining.cli.screen import emit, note
from vmachining.cli.single import from_clone
from vmachining.errors import InputError, VMachiningError
from vmachining.job import Job
from vmachining.job.batch import safe_name
from vmachining.job.files import read_manifest

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vmachining.report.live import Live

OPTIONAL = {"logged": "logged.parquet", "references": "references.csv"}
"""Kinds of `run` that are drawn only where their table is there or where they are asked for."""


def figure(o: FigureOptions) -> int:
    folder = o.results
    from vmachining.report import paper
    from vmachining.report.paper import FORMATS, KINDS, OVER, Results, draw

    suffixes = _chosen(o.formats, FORMATS, "--format")
    if folder.is_file():
        figures = from_clone("benchmarks.figures")
        drawn = figures.draw_bench(figures.load_bench(folder), width_mm=o.width)
        return _written(drawn, [], folder.parent if o.out is None else o.out, suffixes, o)
    # kinds that other commands than `run` leave tables for: the table, who reads it, who draws it
    more: dict[str, tuple[str, Callable[[Path], Any], Callable[..., Figure]]] = {
        "chips": ("chips.parquet", paper.ChipTable.load, paper.draw_chips),
        "section": ("section.parquet", paper.load_section, paper.draw_section),
        "trace": ("forces_measured.csv", paper.load_trace, paper.draw_trace),
        "deviation": ("deviation.parquet", paper.load_deviation, paper.draw_deviation),
    }
    found = [name for name, (file, _, _) in more.items() if (folder / file).is_file()]
    alone = bool(found) and not (folder / "blocks.parquet").is_file()
    kinds = _chosen(o.kind, tuple(found) if alone else (*KINDS, *more), "--kind", every=True)
    if o.over is not None and o.over not in OVER:
        raise InputError(f"--over {o.over!r}: expected {' or '.join(OVER)}")
    every = () if alone else tuple(k for k in KINDS if k not in OPTIONAL or (folder / OPTIONAL[k]).is_file())
    wanted = kinds or [*found, *every]
    results = Results.load(folder) if set(wanted) & set(KINDS) else None
    drawn, missing = {}, []
    for kind in wanted:
        try:
            if kind in more:
                _, load, drawer = more[kind]
                drawn[kind] = drawer(load(folder), width_mm=o.width)
            elif results is not None:
                drawn[kind] = draw(results, kind, over=o.over, width_mm=o.width)
        except InputError as exc:
            if kinds or alone or "matplotlib" in str(exc):
                raise
            missing.append(f"{kind}: {exc.message}")
    return _written(drawn, missing, o.out if o.out is not None else folder, suffixes, o)


def _written(
    drawn: dict[str, Figure], missing: list[str], folder: Path, suffixes: list[str], o: FigureOptions
) -> int:
    from vmachining.report.paper import write_figures

    paths = write_figures(drawn, folder, suffixes)
    if o.as_json:
        emit({"files": [str(path) for path in paths], "missing": missing})
    else:
        for path in paths:
            print(path)
        for text in missing:
            note(f"not drawn: {text}")
    return Code.DONE


def _chosen(text: str, known: tuple[str, ...], option: str, *, every: bool = False) -> list[str]:
    """Words of a comma list; none for "all", where that is a word."""
    if every and text.strip().lower() == "all":
        return []
    words = [word.strip().lower() for word in text.split(",") if word.strip()]
    if not words or not set(words) <= set(known):
        wrong = next((word for word in words if word not in known), "")
        raise InputError(f"{option} {wrong!r}: expected {', '.join(known)}{', or all' * every}")
    return list(dict.fromkeys(words))


def strategies(o: Strategies) -> int:
    """`vmachining strategies`: runs a job, judges all strategies by simulation, then shows the comparison."""
    from vmachining.report.paper import Results

    folder = target = o.target
    _refuse_engine(target, o.engine)
    if not target.is_dir():
        job = Job.load(target)
        if job.keys.feed is None:
            remedy = "give strategy, min_mm_min and max_mm_min under [feed]"
            raise InputError(
                "no [feed] table: the limits of the feed are missing", file=target, remedy=remedy
            )
        folder = o.out if o.out is not None else Path("out") / safe_name(job.name)
        options, quiet = RunOptions(engine=o.engine), o.quiet or o.as_json
        code = run_job(target, options, out=folder, resume=o.resume, quiet=quiet, every_strategy=True)
        if code != Code.DONE:
            return code
    results = Results.load(folder)
    if results.strategies is None:
        raise InputError("no comparison of strategies", file=folder, remedy="run a job with a [feed] table")
    # strategies that are not in the table, and why
    told = "; ".join(text for text in results.summary.get("contact_notes", ()) if "are empty" in text)
    lacks = {"chip_area": "nothing is known of the chips", "force": "the job has no [force] table"}
    known = results.strategies["strategy"].to_list()
    missing = {name: told or why for name, why in lacks.items() if name not in known}
    if o.as_json:
        emit({"name": results.name, "strategies": results.strategies.to_dicts(), "not_compared": missing})
        return Code.DONE
    _table(results.name, results.strategies)
    for name, why in missing.items():
        note(f"not compared: {name.replace('_', ' ')}: {why}")
    if still := results.summary.get("untouched_lines"):
        where = f"(from line {still[0]} on)"
        note(f"{len(still)} lines keep their feed in every program: it cannot be changed {where}")
    return Code.DONE


def _refuse_engine(target: Path, engine: str | None) -> None:
    if target.is_dir() and engine is not None:
        raise InputError(
            f"--engine {engine}: {target} is a result, and nothing is cut", remedy="give the job"
        )


def _table(name: str, table: Any) -> None:
    """The comparison on the screen, in plain columns."""
    units = dict(zip(table["strategy"], table["unit"], strict=True))
    heads = (
        "strategy", "reference", "judged", "time s", "machine s", "inserted", "volume mm3/min", "chip mm2",
        f"force {units.get('force') or 'N'}",
    )  # fmt: skip
    lines = [heads]
    for row in table.iter_rows(named=True):
        unit = (row["unit"] or "").replace("³", "3").replace("²", "2")
        goal = "-" if row["reference"] is None else f"{row['reference']:.5g} {unit}"
        loads = []
        for load in ("volume", "chip_area", "force"):
            peak, spread = row[f"{load}_peak"], row[f"{load}_spread"]
            loads.append("-" if peak is None else f"{peak:.5g} ({100.0 * spread:.1f} %)")
        title = row["strategy"].replace("_", " ") + (" (written)" if row["asked_for"] else "")
        machine = "-" if row["machine_time_s"] is None else f"{row['machine_time_s']:.2f}"
        lines.append(
            (title, goal, row["judged"], f"{row['time_s']:.2f}", machine, str(row["inserted"]), *loads)
        )
    first, *wide = (max(map(len, column)) for column in zip(*lines, strict=True))
    print(f"{name}: peaks (standard deviation over mean, in the time that cuts)")
    for title, *line in lines:
        cells = (cell.rjust(size) for cell, size in zip(line, wide, strict=True))
        print(f"  {'  '.join([title.ljust(first), *cells])}")


LOOK_SECONDS = 0.5
"""Between two looks at the files of a job."""


def view(o: View) -> int:
    """`vmachining view`: serves until Ctrl-C; of a job, runs it first and whenever its files change."""
    from vmachining.report.live import LOOPBACK, REPORT, Live, serve

    target = o.target
    _refuse_engine(target, o.engine)
    if target.is_dir():
        manifest = read_manifest(target)
        if manifest is None or REPORT not in manifest.get("outputs", ()):
            remedy = "give a job file, or what run had as --out"
            raise InputError("no result directory with a report", file=target, remedy=remedy)
        live = Live(target, str(manifest.get("job", target.name)))
    else:
        job = Job.load(target)
        live = Live(o.out if o.out is not None else Path("out") / safe_name(job.name), job.name)
    server = serve(live, o.port)
    try:
        print(f"http://{LOOPBACK}:{server.server_port}/", flush=True)
        note("Ctrl-C ends it")
        if not target.is_dir():
            return _runs(target, live, o.engine, o.once)
        while True:
            time.sleep(3600.0)
    except KeyboardInterrupt:
        return Code.DONE
    finally:
        server.shutdown()


def _runs(file: Path, live: Live, engine: str | None, once: bool) -> int:
    """Run the job, then look at its files; a failure of the first run is that of the command."""
    from vmachining.report.live import live_page

    first = True
    while True:
        seen = _times(file)
        live.progress("program", 0, 1)
        try:
            live.page = live_page(Job.load(file))
            run_job(file, RunOptions(engine=engine), out=live.folder, told=live.progress)
            live.ended()
        except (VMachiningError, OSError) as exc:
            if first:
                raise
            live.ended(str(exc))
            note(f"vmachining: {exc}")
        first = False
        while once or _times(file) == seen:
            time.sleep(LOOK_SECONDS)
        note("files have changed: running again")


def _times(file: Path) -> dict[str, float | None]:
    """When the files of a job were changed; the job file alone where it cannot be read."""
    found: dict[str, float | None] = {}
    paths = [file]
    with suppress(VMachiningError, OSError):
        paths += Job.load(file).inputs.values()
    for path in paths:
        try:
            found[str(path)] = path.stat().st_mtime
        except OSError:
            found[str(path)] = None
    return found
