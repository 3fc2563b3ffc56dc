"""The `times` commands of the tree, and their bodies."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vmachining.cli.options import Json, arg, command, examples, opt

if TYPE_CHECKING:
    from vmachining.job.times import Laid
    from vmachining.machine import Machine

times = typer.Typer(
    help="Machine times: fit a machine to its logs, compare predicted with logged times.",
    epilog=examples("times compare run.log --program part.nc --machine mill.toml"),
    no_args_is_help=True, rich_markup_mode=None,
)  # fmt: skip

Logs = Annotated[
    list[Path], arg("LOG...", "time|item|value, MTConnect XML, or CSV with time and line; also .gz.")
]
Programs = Annotated[list[Path], opt("P", "Program that ran: one for all logs, or one per log, in order.")]


@command(times, "fit", shown=("times fit a.log b.log --program a.nc --program b.nc --out mill.toml",))
def fit_command(
    logs: Logs,
    *,
    program: Programs,
    out: Annotated[Path, opt("FILE", "The machine file that is written.")],
    as_json: Json = False,
) -> int:
    """Fit the parameters of a machine to its logs: accelerations, corner tolerance, rapid, tool changes.

    The file has a table [machine] with keys of a job file.
    """
    from dataclasses import asdict

    from vmachining.cli.main import Code
    from vmachining.cli.screen import emit, note
    from vmachining.job.files import write_atomic
    from vmachining.job.times import fit
    from vmachining.job.times.fit import machine_text

    found = fit(_laid(logs, program))
    for text in found.left_out:
        note(f"not used: {text}")
    text = machine_text(found, [log.name for log in logs])
    write_atomic(out, text.encode("utf-8"))
    if as_json:
        record = {key: value for key, value in asdict(found.limits).items() if value is not None}
        emit({"machine": record, "mean_error": found.error, "windows": found.windows, "seconds": found.seconds,
              "left_out": list(found.left_out)})  # fmt: skip
    else:
        print(text, end="")
    return Code.DONE


@command(times, "compare", shown=("times compare run.log --program part.nc --machine mill.toml --json",))
def compare_command(
    logs: Logs,
    *,
    program: Programs,
    machine: Annotated[Path | None, opt("FILE", "From `times fit`; without it: feeds alone.")] = None,
    table: Annotated[Path | None, opt("CSV", "Every interval of the log, with its load.")] = None,
    figure: Annotated[
        Path | None, opt("HTML", "Page: feed as programmed, reachable and logged; tools; loads.")
    ] = None,
    as_json: Json = False,
) -> int:
    """Compare predicted with logged times: whole, per tool, per block, at the overrides of the log."""
    from vmachining.cli.main import Code
    from vmachining.cli.screen import emit, note
    from vmachining.job.files import write_atomic
    from vmachining.job.mill import Mill
    from vmachining.job.time_words import assumed
    from vmachining.job.times import compare, together
    from vmachining.machine import MachineLimits
    from vmachining.report.figures import html_name

    mill = None if machine is None else Mill.load(machine)
    limits = MachineLimits() if mill is None else mill.limits
    page = None if figure is None else html_name(figure, "--figure")
    laid = _laid(logs, program, None if mill is None else mill.chain)
    for text in assumed(limits, program=laid[0].driven.toolpath.program):
        note(text)
    found = []
    for one in laid:
        for words in (one.clock(), one.another):
            if words is not None:
                note(words)
        found.append(compare(one, limits))
    for each in [] if as_json else found:
        print(
            f"{each.name}: predicted {each.predicted_s:.1f} s, logged {each.logged_s:.1f} s ({100 * each.error:+.1f} %), "
            f"feeds alone {each.ideal_s:.1f} s"
        )
        for tool in each.tools:
            print(
                f"  tool {tool['tool']}: predicted {tool['predicted_s']:.1f} s, logged {tool['logged_s']:.1f} s "
                f"({100 * tool['error']:+.1f} %)"
            )
        for reason, seconds in each.left_out.items():
            print(f"  not compared: {seconds:.0f} s of {reason}")
    if table is not None:
        import polars as pl

        rows = pl.concat([one.blocks.with_columns(pl.lit(one.name).alias("log")) for one in found])
        write_atomic(table, rows.write_csv().encode("utf-8"))
    if page is not None:
        from vmachining.report.times import write_times

        write_times(found, page)
        note(f"{page}: written")
    if as_json:
        emit(together(found))
    return Code.DONE


@command(
    times,
    "join",
    shown=("times join run.log --results out/part", "times join a.log b.log --results out/part --json"),
)
def join_command(
    logs: Logs,
    *,
    results: Annotated[Path, opt("DIR", "Result directory of run, of the same program.")],
    machine: Annotated[Path | None, opt("FILE", "From `times fit`; default: [machine] of the job.")] = None,
    as_json: Json = False,
) -> int:
    """Join logs with the table of a run: removal rate, force and power beside feed and load of the log, per interval.

    Writes logged.csv and logged.parquet beside the results; `figure DIR --kind logged` draws them.
    """
    import polars as pl

    from vmachining.cli.main import Code
    from vmachining.cli.screen import emit, note
    from vmachining.job.files import write_atomic
    from vmachining.job.mill import Mill
    from vmachining.job.times import compare, join, lay, of_result, read_log
    from vmachining.job.timing import machine_limits

    job, driven, blocks = of_result(results)
    mill = None if machine is None else Mill.load(machine)
    limits = machine_limits(job) if mill is None else mill.limits
    if mill is not None and mill.chain is not None:
        note(f"{machine}: its table [machine] counts; axes are those of the job")
    tables: list[pl.DataFrame] = []
    left: dict[str, float] = {}
    for path in logs:
        laid = lay(read_log(path), driven)
        for words in (laid.clock(), laid.another):
            if words is not None:
                note(words)
        for reason, seconds in laid.left_out.items():
            note(f"{path.name}: not compared: {seconds:.0f} s of {reason}")
            left[reason] = left.get(reason, 0.0) + seconds
        tables.append(join(compare(laid, limits), blocks).with_columns(pl.lit(path.name).alias("log")))
    rows = pl.concat(tables)
    write_atomic(results / "logged.csv", rows.write_csv().encode("utf-8"))
    buffer = io.BytesIO()
    rows.write_parquet(buffer)
    write_atomic(results / "logged.parquet", buffer.getvalue())
    kept = rows.filter(pl.col("compared"))
    loads = kept.filter(pl.col("load").is_not_nan() & pl.col("mrr_mm3_min").is_not_nan())
    told: dict[str, object] = {
        "intervals": len(kept), "logged_s": float(kept["logged_s"].sum()), "removed_mm3": float(kept["removed_mm3"].sum()),
        "left_out_s": left, "intervals_with_load": len(loads),
        "files": [str(results / f"logged.{kind}") for kind in ("csv", "parquet")],
    }  # fmt: skip
    for name in ("mrr_mm3_min", "force_n", "power_w"):
        both = loads.filter(pl.col(name).is_not_nan())
        rank = both.select(pl.corr("load", name, method="spearman")).item() if len(both) > 2 else None
        told[f"load_rank_correlation_{name}"] = rank if rank is not None and rank == rank else None
    if as_json:
        emit(told)
        return Code.DONE
    for key, value in told.items():
        if key != "left_out_s":
            print(f"{key}: {'not known' if value is None else value}")
    if not len(loads):
        note("the log has no load of the spindle: its columns are empty")
    return Code.DONE


def _laid(logs: list[Path], programs: list[Path], chain: Machine | None = None) -> list[Laid]:
    from vmachining.cli.screen import note
    from vmachining.errors import InputError, NCError
    from vmachining.job.reading import refuse_unread
    from vmachining.job.times import lay, read_log
    from vmachining.job.timing import Driven
    from vmachining.job.toolpath import Toolpath
    from vmachining.nc import read_program

    if len(programs) not in (1, len(logs)):
        raise InputError(
            f"{len(logs)} logs and {len(programs)} programs", remedy="give one --program, or one for each log"
        )
    driven: dict[Path, Driven] = {}
    for path in programs:
        if path not in driven:
            program = read_program(path, dialect="auto")
            if program.errors:
                note(
                    f"{path}: {len(program.errors)} findings that `vmachining nc check` names; what is read is timed"
                )
            try:
                refuse_unread(program)
            except NCError as exc:
                note(f"{exc}; the path that is read is timed")
            driven[path] = Driven.of(Toolpath.of(program, chain))
    out = []
    for k, path in enumerate(logs):
        log = read_log(path)
        if log.skipped:
            note(f"{path}: left out {log.skipped} unreadable {'entry' if log.skipped == 1 else 'entries'}")
        out.append(lay(log, driven[programs[k] if len(programs) > 1 else programs[0]]))
    return out
