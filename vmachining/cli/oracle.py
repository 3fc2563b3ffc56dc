"""compare and pack."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vmachining import oracle
from vmachining.cli.jobs import told_disputes
from vmachining.cli.judge_commands import Compare, Pack
from vmachining.cli.main import Code
from vmachining.cli.options import belong
from vmachining.cli.screen import emit, note
from vmachining.cli.single import from_clone
from vmachining.cli.stop import stoppable
from vmachining.errors import InputError
from vmachining.job import Job, check_formats
from vmachining.job.batch import safe_name
from vmachining.job.brep import parse_brep
from vmachining.oracle.compare import FINDINGS
from vmachining.progress import stop_flag

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

WORST = 10

LONG = "ended within a block, which took too long to finish"


def compare(o: Compare) -> int:
    """`vmachining compare`: with a reference, two results on one page, or our engines."""
    widened = ("tolerance_rel", "tolerance_mm3", "tolerance_mm")
    if o.html is not None or o.engines is not None:
        belong(o, widened, "widens the brackets for results of other software, but no such results are given")
    if o.engines is None:
        belong(o, ("out", "blocks"), "goes with --engines")
    else:
        belong(o, ("html",), "compares two results, and --engines has one job")
    if o.html is not None:
        return _pages(o.results, o.reference, o.html, as_json=o.as_json)
    return _compared(o.results, o.reference, o) if o.engines is None else _engines(o)


def _compared(results: Path, reference: Path | None, o: Compare) -> int:
    """Of volumes, or of engaged intervals where the table has them; of many cases with a set."""
    if reference is None:
        remedy = "give a result directory; or a job and --engines to compare our engines with each other"
        raise InputError("compare needs a reference", remedy=remedy)
    more = {"tolerance_rel": o.tolerance_rel, "tolerance_mm3": o.tolerance_mm3}
    if oracle.is_set(reference):
        if o.tolerance_mm is not None:
            remedy = "name one case of the set as reference"
            raise InputError("tables of engagement are compared case by case", remedy=remedy)
        return _answer(oracle.compare_set(results, reference, **more), _show_set, o)
    if oracle.is_engagement_table(results):
        if o.tolerance_rel or o.tolerance_mm3:
            raise InputError("a table of engagement is compared in mm", remedy="take --tolerance-mm")
        given = {} if o.tolerance_mm is None else {"tolerance_mm": o.tolerance_mm}
        return _answer(oracle.compare_engagement(results, reference, **given), _show_edges, o)
    if o.tolerance_mm is not None:
        raise InputError(
            "--tolerance-mm is for tables of engagement", remedy="take --tolerance-mm3 for volumes"
        )
    return _answer(oracle.compare(results, reference, **more), _show, o)


def _answer(found: Any, show: Callable[[Console, Any], None], o: Compare) -> int:
    """A comparison as JSON, or shown with its verdict; the exit code."""
    from rich.console import Console
    from rich.text import Text

    if o.as_json:
        emit(found.to_dict())
    else:
        console = Console(highlight=False)
        show(console, found)
        style = "green" if found.agrees else "red"
        console.print(Text(f"verdict    {found.verdict}", style=style), soft_wrap=True)
    return Code.DONE if found.agrees else Code.FINDINGS


def _table(title: str, heads: Iterable[str], words: Container[str]) -> Table:
    """Columns of numbers to the right, of words to the left."""
    from rich.table import Table

    table = Table(title=title, title_justify="left")
    for name in heads:
        table.add_column(name, justify="left" if name in words else "right")
    return table


def _engines(o: Compare) -> int:
    from vmachining.report.comparison import write_engines

    names = oracle.engine_names(o.engines or "")
    if o.reference is not None:
        raise InputError("--engines compares our engines on a job", remedy=f"leave out {o.reference}")
    job = Job.load(o.results)
    folder = o.out if o.out is not None else Path("out") / f"{safe_name(job.name)}-engines"
    with (
        stoppable(lambda _: LONG, lambda: "nothing was written", quiet=o.as_json) as progress,
        stop_flag() as stop,
    ):
        found = oracle.compare_engines(job, names, blocks=o.blocks, progress=progress, stop=stop)
    told = found.to_dict()
    write_engines(told, folder)
    if o.as_json:
        emit(told)
    else:
        _show_engines(found)
        note(f"files      {folder}")
    return Code.DONE if found.agrees else Code.FINDINGS


def _pages(one: Path, other: Path | None, page: Path, *, as_json: bool) -> int:
    """`vmachining compare A [B] --html PAGE`: two results on one page; 1 where intervals of a piece exclude each other."""
    from vmachining.report.comparison import Side, compare_results, write_comparison
    from vmachining.report.figures import html_name

    html_name(page, "--html")
    names: tuple[str | None, str | None] = (None, None)
    if other is None:
        other, names = one / "scheduled_blocks.parquet", ("as programmed", "scheduled")
        if not other.is_file():
            remedy = "name a second result, or run the job with [feed]"
            raise InputError("the result has no schedule to compare with", file=one, remedy=remedy)
    elif one.name == other.name:
        names = ("A", "B")
    found = compare_results(Side.of(one, names[0]), Side.of(other, names[1]))
    write_comparison(found, page)
    told = found.to_dict()
    if as_json:
        emit(told)
    else:
        differ, proven = told["pieces_that_differ"], told["pieces_that_differ_proven"]
        stated = "" if differ == proven else f", {differ - proven} of them by intervals that are stated"
        note(f"{differ} of {told['pieces']} pieces differ{stated}; wrote {page}")
    return Code.FINDINGS if told["pieces_that_differ"] else Code.DONE


def _show_engines(found: oracle.EngineComparison) -> None:
    """A row per engine, the pairs that exclude each other, the verdict."""
    from rich.console import Console

    from vmachining.report.numbers import share

    console = Console(highlight=False)
    heads = ("engine", "blocks", "removed mm3", "ms/block", "width", "off", "proven", "apart")
    table = _table(f"{found.job}: {len(found.block)} blocks that cut", heads, ("engine",))
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
        blocks = ", ".join([*map(str, each["blocks"][:WORST]), *["..."] * (len(each["blocks"]) > WORST)])
        console.print(f"{' and '.join(each['engines'])} do not overlap at blocks {blocks}", soft_wrap=True)
    console.print("verdict    " + ("they agree" if found.agrees else "they disagree"), soft_wrap=True)


def _show(console: Console, found: oracle.Comparison) -> None:
    from rich.text import Text

    lo, estimate, hi = found.total
    error = found.removed_mm3 - estimate
    total = {True: "inside", False: "outside", None: "blocks are missing"}[found.total_inside]
    worst = found.worst(WORST)
    if len(worst):
        findings = sum(found.counts[name] for name in FINDINGS)
        heads = (found.key, "text", "status", "theirs", "lo", "hi", "error", "relative", "outside")
        table = _table(f"worst {len(worst)} of {findings} findings", heads, ("text", "status"))
        for row in worst.iter_rows(named=True):
            columns = ("removed_mm3", "lo_mm3", "hi_mm3", "error_mm3", "relative_error", "outside_mm3")
            cells = ["" if row[name] is None else f"{row[name]:.6g}" for name in columns]
            table.add_row(str(row[found.key]), Text(row["text"] or ""), row["status"], *cells)
        console.print(table)
    relative = f" ({error / estimate:+.3g} of it)" if estimate else ""
    console.print(f"theirs     {found.removed_mm3:.6f} mm3 in all", soft_wrap=True)
    console.print(f"reference  {estimate:.6f} mm3, between {lo:.6f} and {hi:.6f}", soft_wrap=True)
    console.print(f"error      {error:+.6g} mm3{relative}; total {total}", soft_wrap=True)


def _show_set(console: Console, found: oracle.SetComparison) -> None:
    heads = ("case", "judged", "inside", "low", "high", "missing", "extra", "sum", "agrees")
    table = _table(f"{len(found.cases)} cases of {found.reference}", heads, ("case",))
    for row in found.table().iter_rows(named=True):
        error = row["error_of_the_sum"]
        counts = (str(row[name]) for name in ("judged", "inside", "low", "high", "missing", "extra"))
        agrees = "yes" if row["agrees"] else "disputed" if row["disputed"] else "no"
        cells = [row["case"], *counts, "" if error is None else f"{100.0 * error:+.3g} %", agrees]
        table.add_row(*cells, style=None if row["agrees"] else "red")
    console.print(table)


def _show_edges(console: Console, found: oracle.EngagementComparison) -> None:
    worst = found.worst(WORST)
    if len(worst):
        heads = ("block", "at", "phi_deg", "status", "error mm", "theirs mm", "reference mm")
        table = _table(f"worst {len(worst)} angles", heads, ("status",))
        for block, at, phi, status, *numbers in worst.iter_rows():
            cells = ["" if v is None else f"{v:.6g}" for v in numbers]
            table.add_row(str(block), f"{at:g}", f"{phi:g}", status, *cells)
        console.print(table)
    if found.ignored:
        console.print(f"ignored    {found.ignored} angles that the reference does not have", soft_wrap=True)


def pack(o: Pack) -> int:
    """`vmachining pack`: of one job, or of all cases of a set."""
    if o.job.is_dir():
        return _pack_set(o)
    parse_brep(o.brep)
    formats = check_formats(o.stock)
    job = Job.load(o.job)
    folder = o.out if o.out is not None else Path("out") / f"{safe_name(job.name)}-pack"
    silent = o.quiet or o.as_json
    none = "no pack was written"
    with stoppable(lambda _: f"{LONG}; {none}", lambda: none, quiet=silent) as progress:
        result = oracle.write_pack(
            job, folder, stock=formats, brep=o.brep, licence=o.licence, engagement=o.engagement, engine=o.engine,
            workers=o.workers, progress=progress,
        )  # fmt: skip
    summary = result.summary
    if o.as_json:
        emit(summary)
    else:
        lo, hi = summary["removed_lo_mm3"], summary["removed_hi_mm3"]
        if told := told_disputes(result):
            note("\n".join(told))
        removed = f"{summary['blocks']} blocks remove {lo:.6g} to {hi:.6g} mm3"
        note(f"{job.name}: {removed}: {folder}", quiet=o.quiet)
        if "stock_step_refused" in summary:
            note(f"no STEP of the workpiece: {summary['stock_step_refused']}", quiet=o.quiet)
        for text in summary.get("engagement_refused", ()):
            note(f"no engagement of {text}", quiet=o.quiet)
    refused = {"stock_step_refused", "engagement_refused"} & summary.keys()
    counts = summary["brep"]
    return Code.FINDINGS if counts["disputed"] or counts["refused"] or refused else Code.DONE


def _pack_set(o: Pack) -> int:
    """All packs of a set; those that are made already stay."""
    silent, folder = o.quiet or o.as_json, o.job
    begun: list[str] = []

    def said(name: str, done: int, total: int) -> None:
        begun.append(name)
        note(f"{done + 1} of {total}: {name}", quiet=silent)

    write_set = from_clone("benchmarks.sets").write_set
    with stoppable(
        lambda _: f"ended within {begun[-1]}; the same command continues with it",
        lambda: f"the same command continues with {begun[-1]}", quiet=silent,
    ) as progress:  # fmt: skip
        summaries = write_set(folder, o.out, begun=said, progress=progress)
    if o.as_json:
        emit({"set": str(o.out or folder), "cases": summaries})
    else:
        blocks, size = (sum(s[key] for s in summaries.values()) for key in ("blocks", "bytes"))
        note(
            f"{len(summaries)} packs, {blocks} blocks, {size / 1e6:.1f} MB: {o.out or folder}", quiet=o.quiet
        )
    return Code.DONE
