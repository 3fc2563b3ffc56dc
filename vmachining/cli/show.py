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
    from vmachining.report.paper import Results

OPTIONAL = {"logged": "logged.parquet", "references": "references.csv"}
"""Kinds of `run` that are drawn only where their table is there or where they are asked for."""


def figure(o: FigureOptions) -> int:
    folder = o.results
    from vmachining.report import paper
    from vmachining.report.paper import FORMATS, KINDS, OVER, Results, draw

    if folder.is_file():
        return _benched(folder, o)
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
    suffixes = _chosen(o.formats, FORMATS, "--format")
    if o.over is not None and o.over not in OVER:
        raise InputError(f"--over {o.over!r}: expected {' or '.join(OVER)}")
    drawn: dict[str, Figure] = {}
    missing: list[str] = []
    for name in [kind for kind in kinds if kind in more] if kinds else found:
        try:
            _, load, drawer = more[name]
            drawn[name] = drawer(load(folder), width_mm=o.width)
        except InputError as exc:
            if kinds or alone:
                raise
            missing.append(f"{name}: {exc.message}")
    every = () if alone else tuple(k for k in KINDS if k not in OPTIONAL or (folder / OPTIONAL[k]).is_file())
    others = [kind for kind in kinds if kind in KINDS] if kinds else every
    results = Results.load(folder) if others else None
    for name in others:
        assert results is not None
        try:
            drawn[name] = draw(results, name, over=o.over, width_mm=o.width)
        except InputError as exc:
            if kinds or "matplotlib" in str(exc):
                raise
            missing.append(f"{name}: {exc.message}")
    return _written(drawn, missing, o.out if o.out is not None else folder, suffixes, o)


def _benched(file: Path, o: FigureOptions) -> int:
    """Diagrams of a file of `bench`."""
    from vmachining.report.paper import FORMATS

    figures = from_clone("benchmarks.figures")
    drawn = figures.draw_bench(figures.load_bench(file), width_mm=o.width)
    return _written(
        drawn, [], o.out if o.out is not None else file.parent, _chosen(o.formats, FORMATS, "--format"), o
    )


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
    from vmachining.job import Job
    from vmachining.job.batch import safe_name
    from vmachining.report.paper import Results

    folder = target = o.target
    if target.is_dir() and o.engine is not None:
        raise InputError(
            f"--engine {o.engine}: {target} is a result, and nothing is cut", remedy="give the job"
        )
    if not target.is_dir():
        job = Job.load(target)
        if job.keys.feed is None:
            raise InputError(
                "no [feed] table: the limits of the feed are missing",
                file=target, remedy="give strategy, min_mm_min and max_mm_min under [feed]",
            )  # fmt: skip
        folder = o.out if o.out is not None else Path("out") / safe_name(job.name)
        code = run_job(
            target, RunOptions(engine=o.engine), out=folder, resume=o.resume, quiet=o.quiet or o.as_json, every_strategy=True
        )  # fmt: skip
        if code != Code.DONE:
            return code
    results = Results.load(folder)
    if results.strategies is None:
        raise InputError("no comparison of strategies", file=folder, remedy="run a job with a [feed] table")
    missing = _missing(results)
    if o.as_json:
        emit({"name": results.name, "strategies": results.strategies.to_dicts(), "not_compared": missing})
        return Code.DONE
    _table(results.name, results.strategies)
    for name, why in missing.items():
        note(f"not compared: {name.replace('_', ' ')}: {why}")
    if still := results.summary.get("untouched_lines"):
        note(
            f"{len(still)} lines keep their feed in every program: it cannot be changed (from line {still[0]} on)"
        )
    return Code.DONE


def _missing(results: Results) -> dict[str, str]:
    """Strategies that are not in the table, and why."""
    assert results.strategies is not None
    told = "; ".join(text for text in results.summary.get("contact_notes", ()) if "are empty" in text)
    gone = [name for name in ("chip_area", "force") if name not in results.strategies["strategy"].to_list()]
    return {
        name: told or ("the job has no [force] table" if name == "force" else "nothing is known of the chips")
        for name in gone
    }


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
    wide = [max(map(len, column)) for column in zip(*lines, strict=True)]
    print(f"{name}: peaks (standard deviation over mean, in the time that cuts)")
    for line in lines:
        cells = [
            line[0].ljust(wide[0]),
            *(cell.rjust(size) for cell, size in zip(line[1:], wide[1:], strict=True)),
        ]
        print(f"  {'  '.join(cells)}")


LOOK_SECONDS = 0.5
"""Between two looks at the files of a job."""


def view(o: View) -> int:
    """`vmachining view`: serves until Ctrl-C; of a job, runs it first and whenever its files change."""
    from vmachining.report.live import LOOPBACK, REPORT, Live, serve

    target = o.target
    if target.is_dir():
        if o.engine is not None:
            raise InputError(
                f"--engine {o.engine}: {target} is a result, and nothing is cut", remedy="give the job"
            )
        manifest = read_manifest(target)
        if manifest is None or REPORT not in manifest.get("outputs", ()):
            raise InputError(
                "no result directory with a report", file=target, remedy="give a job file, or what run had as --out"
            )  # fmt: skip
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
    from vmachining.report.backplot import live_page

    first = True
    while True:
        seen = _times(file)
        live.progress("program", 0, 1)
        try:
            live.page = live_page(Job.load(file))
            code = run_job(file, RunOptions(engine=engine), out=live.folder, told=live.progress)
            if code == Code.INTERRUPTED:
                return code
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
