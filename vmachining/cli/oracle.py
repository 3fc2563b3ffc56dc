"""compare and pack."""

from __future__ import annotations

from pathlib import Path

from vmachining.cli.jobs import told_disputes
from vmachining.cli.main import Code
from vmachining.cli.screen import emit, note, progress_bar
from vmachining.cli.stop import watched
from vmachining.errors import InputError
from vmachining.job import Job, Stopped, check_formats
from vmachining.job.batch import safe_name
from vmachining.job.brep import parse_brep
from vmachining.job.stopping import stop_flag
from vmachining.oracle import (
    Comparison,
    EngagementComparison,
    EngineComparison,
    SetComparison,
    compare_engagement,
    compare_set,
    engine_names,
    is_engagement_table,
    is_set,
    write_pack,
    write_set,
)
from vmachining.oracle import compare as judged
from vmachining.oracle import compare_engines as run_engines
from vmachining.oracle.compare import FINDINGS

__all__ = ["compare", "compare_engines", "pack"]

WORST = 10


def compare(
    results: Path,
    reference: Path | None,
    *,
    tolerance_rel: float,
    tolerance_mm3: float,
    tolerance_mm: float | None,
    as_json: bool,
) -> int:
    """`vmachining compare`: of volumes, or of engaged intervals where the table has them; of many cases with a set."""
    if reference is None:
        raise InputError(
            "compare wants a reference",
            remedy="give a result directory; or a job and --engines to compare our engines with each other",
        )
    if is_set(reference):
        if tolerance_mm is not None:
            raise InputError(
                "tables of engagement are compared case by case",
                remedy="name one case of the set as reference",
            )
        all_ = compare_set(results, reference, tolerance_rel=tolerance_rel, tolerance_mm3=tolerance_mm3)
        if as_json:
            emit(all_.to_dict())
        else:
            _show_set(all_)
        return Code.DONE if all_.agrees else Code.FINDINGS
    if is_engagement_table(results):
        if tolerance_rel or tolerance_mm3:
            raise InputError("a table of engagement is compared in mm", remedy="take --tolerance-mm")
        given = {} if tolerance_mm is None else {"tolerance_mm": tolerance_mm}
        edges = compare_engagement(results, reference, **given)
        if as_json:
            emit(edges.to_dict())
        else:
            _show_edges(edges)
        return Code.DONE if edges.agrees else Code.FINDINGS
    if tolerance_mm is not None:
        raise InputError(
            "--tolerance-mm is for tables of engagement", remedy="take --tolerance-mm3 for volumes"
        )
    found = judged(results, reference, tolerance_rel=tolerance_rel, tolerance_mm3=tolerance_mm3)
    if as_json:
        emit(found.to_dict())
    else:
        _show(found)
    return Code.DONE if found.agrees else Code.FINDINGS


def compare_engines(
    file: Path, engines: str, *, reference: Path | None, out: Path | None, blocks: int | None, as_json: bool
) -> int:
    """`vmachining compare JOB.toml --engines ...`."""
    from vmachining.report.engines import write_engines

    names = engine_names(engines)
    if reference is not None:
        raise InputError("--engines compares our engines on a job", remedy=f"leave out {reference}")
    job = Job.load(file)
    folder = out if out is not None else Path("out") / f"{safe_name(job.name)}-engines"
    with (
        progress_bar(quiet=as_json) as bar,
        watched(bar, lambda _: "ended within a block, which took too long to finish") as progress,
        stop_flag() as stop,
    ):
        try:
            found = run_engines(job, names, blocks=blocks, progress=progress, stop=stop)
        except Stopped as exc:
            note(f"vmachining: {exc}; nothing was written")
            return Code.INTERRUPTED
    told = found.to_dict()
    write_engines(told, folder)
    if as_json:
        emit(told)
    else:
        _show_engines(found)
        note(f"files      {folder}")
    return Code.DONE if found.agrees else Code.FINDINGS


def _show_engines(found: EngineComparison) -> None:
    """A row per engine, the pairs that exclude each other, the verdict."""
    from rich.console import Console
    from rich.table import Table

    from vmachining.report.numbers import share

    console = Console(highlight=False)
    table = Table(title=f"{found.job}: {len(found.block)} blocks that cut", title_justify="left")
    for name in ("engine", "blocks", "removed mm3", "ms/block", "width", "off", "proven", "apart"):
        table.add_column(name, justify="left" if name == "engine" else "right")
    for row in found.summary():
        width, off = (share(row[k]) for k in ("width", "off"))
        table.add_row(
            row["engine"], str(row["blocks"]), f"{row['removed_mm3']:.6g}", f"{row['ms_per_block']:.3g}", width, off,
            str(row["proven"]), str(row["disagrees"]),
        )  # fmt: skip
    console.print(table)
    for row in found.summary():
        if row["refused"]:
            console.print(f"{row['engine']}: {row['refused']}", soft_wrap=True, style="yellow", markup=False)
    for each in found.disagreements:
        blocks = ", ".join(map(str, each["blocks"][:WORST])) + (
            ", ..." if len(each["blocks"]) > WORST else ""
        )
        console.print(
            f"{' and '.join(each['engines'])} exclude each other at blocks {blocks}", soft_wrap=True
        )
    console.print("verdict    " + ("they agree" if found.agrees else "they disagree"), soft_wrap=True)


def _show(found: Comparison) -> None:
    """Totals, the worst blocks, the verdict."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = Console(highlight=False)
    lo, estimate, hi = found.total
    error = found.removed_mm3 - estimate
    total = {True: "inside", False: "outside", None: "blocks are missing"}[found.total_inside]
    worst = found.worst(WORST)
    if len(worst):
        findings = sum(found.counts[name] for name in FINDINGS)
        table = Table(title=f"worst {len(worst)} of {findings} findings", title_justify="left")
        for name in (found.key, "text", "status", "theirs", "lo", "hi", "error", "relative", "outside"):
            table.add_column(name, justify="left" if name in ("text", "status") else "right")
        for row in worst.iter_rows(named=True):
            columns = ("removed_mm3", "lo_mm3", "hi_mm3", "error_mm3", "relative_error", "outside_mm3")
            cells = ["" if row[name] is None else f"{row[name]:.6g}" for name in columns]
            table.add_row(str(row[found.key]), Text(row["text"] or ""), row["status"], *cells)
        console.print(table)
    relative = f" ({error / estimate:+.3g} of it)" if estimate else ""
    console.print(f"theirs     {found.removed_mm3:.6f} mm3 in all", soft_wrap=True)
    console.print(f"reference  {estimate:.6f} mm3, between {lo:.6f} and {hi:.6f}", soft_wrap=True)
    console.print(f"error      {error:+.6g} mm3{relative}; total {total}", soft_wrap=True)
    style = "green" if found.agrees else "red"
    console.print(Text(f"verdict    {found.verdict}", style=style), soft_wrap=True)


def _show_set(found: SetComparison) -> None:
    """A row per case, the verdict."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = Console(highlight=False)
    table = Table(title=f"{len(found.cases)} cases of {found.reference}", title_justify="left")
    for name in ("case", "judged", "inside", "low", "high", "missing", "extra", "sum", "agrees"):
        table.add_column(name, justify="left" if name == "case" else "right")
    for row in found.table().iter_rows(named=True):
        error = row["error_of_the_sum"]
        counts = (str(row[name]) for name in ("judged", "inside", "low", "high", "missing", "extra"))
        agrees = "yes" if row["agrees"] else "disputed" if row["disputed"] else "no"
        cells = [row["case"], *counts, "" if error is None else f"{100.0 * error:+.3g} %", agrees]
        table.add_row(*cells, style=None if row["agrees"] else "red")
    console.print(table)
    style = "green" if found.agrees else "red"
    console.print(Text(f"verdict    {found.verdict}", style=style), soft_wrap=True)


def _show_edges(found: EngagementComparison) -> None:
    """The worst angles, the verdict."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = Console(highlight=False)
    worst = found.worst(WORST)
    if len(worst):
        table = Table(title=f"worst {len(worst)} angles", title_justify="left")
        for name in ("block", "at", "phi_deg", "status", "error mm", "theirs mm", "reference mm"):
            table.add_column(name, justify="left" if name == "status" else "right")
        for block, at, phi, status, *numbers in worst.iter_rows():
            cells = ["" if v is None else f"{v:.6g}" for v in numbers]
            table.add_row(str(block), f"{at:g}", f"{phi:g}", status, *cells)
        console.print(table)
    if found.ignored:
        console.print(f"ignored    {found.ignored} angles that the reference does not have", soft_wrap=True)
    style = "green" if found.agrees else "red"
    console.print(Text(f"verdict    {found.verdict}", style=style), soft_wrap=True)


def pack(
    file: Path,
    *,
    out: Path | None,
    stock: str,
    brep: str,
    licence: str,
    engagement: int,
    engine: str,
    workers: int,
    quiet: bool,
    as_json: bool,
) -> int:
    """`vmachining pack`: of one job, or of all cases of a set."""
    if file.is_dir():
        return _pack_set(file, out=out, quiet=quiet, as_json=as_json)
    parse_brep(brep)
    formats = check_formats(stock)
    job = Job.load(file)
    folder = out if out is not None else Path("out") / f"{safe_name(job.name)}-pack"
    silent = quiet or as_json
    with (
        progress_bar(quiet=silent) as bar,
        watched(
            bar, lambda _: "ended within a block, which took too long to finish; no pack was written"
        ) as progress,
    ):
        try:
            result = write_pack(
                job, folder, stock=formats, brep=brep, licence=licence, engagement=engagement, engine=engine,
                workers=workers, progress=progress,
            )  # fmt: skip
        except Stopped as exc:
            note(f"vmachining: {exc}; no pack was written")
            return Code.INTERRUPTED
    summary = result.summary
    if as_json:
        emit(summary)
    else:
        lo, hi = summary["removed_lo_mm3"], summary["removed_hi_mm3"]
        if told := told_disputes(result):
            note("\n".join(told))
        note(f"{job.name}: {summary['blocks']} blocks remove {lo:.6g} to {hi:.6g} mm3: {folder}", quiet=quiet)
        if "stock_step_refused" in summary:
            note(f"no STEP of the workpiece: {summary['stock_step_refused']}", quiet=quiet)
        for text in summary.get("engagement_refused", ()):
            note(f"no engagement of {text}", quiet=quiet)
    counts = summary["brep"]
    refused = (
        counts["disputed"]
        or counts["refused"]
        or {"stock_step_refused", "engagement_refused"} & summary.keys()
    )
    return Code.FINDINGS if refused else Code.DONE


def _pack_set(folder: Path, *, out: Path | None, quiet: bool, as_json: bool) -> int:
    """All packs of a set; those that are made already stay."""
    silent = quiet or as_json
    begun: list[str] = []

    def said(name: str, done: int, total: int) -> None:
        begun.append(name)
        note(f"{done + 1} of {total}: {name}", quiet=silent)

    with (
        progress_bar(quiet=silent) as bar,
        watched(bar, lambda _: f"ended within {begun[-1]}; the same command goes on with it") as progress,
    ):
        try:
            summaries = write_set(folder, out, begun=said, progress=progress)
        except Stopped as exc:
            note(f"vmachining: {exc}; the same command goes on with {begun[-1]}")
            return Code.INTERRUPTED
    if as_json:
        emit({"set": str(out or folder), "cases": summaries})
    else:
        blocks, size = (sum(s[key] for s in summaries.values()) for key in ("blocks", "bytes"))
        note(f"{len(summaries)} packs, {blocks} blocks, {size / 1e6:.1f} MB: {out or folder}", quiet=quiet)
    return Code.DONE
