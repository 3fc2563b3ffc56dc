"""times fit, times compare and times join."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import polars as pl

from vmachining.cli.judge_commands import CompareTimes, Fit, Join
from vmachining.cli.main import Code
from vmachining.cli.screen import emit, note
from vmachining.errors import InputError, NCError
from vmachining.job.files import write_atomic, write_table
from vmachining.job.mill import Mill
from vmachining.job.reading import refuse_unread
from vmachining.job.times import Laid, compare, fit, join, lay, of_result, read_log, together
from vmachining.job.times.fit import machine_text
from vmachining.job.timing import Driven, assumed, machine_limits
from vmachining.job.toolpath import Toolpath
from vmachining.machine import Machine, MachineLimits
from vmachining.nc import read_program
from vmachining.report.figures import html_name, write_times


def fit_(o: Fit) -> int:
    found = fit(_laid(o.logs, o.program))
    for text in found.left_out:
        note(f"not used: {text}")
    text = machine_text(found, [log.name for log in o.logs])
    write_atomic(o.out, text)
    if o.as_json:
        record = {key: value for key, value in asdict(found.limits).items() if value is not None}
        emit({"machine": record, "mean_error": found.error, "windows": found.windows, "seconds": found.seconds,
              "left_out": list(found.left_out)})  # fmt: skip
    else:
        print(text, end="")
    return Code.DONE


def compare_(o: CompareTimes) -> int:
    mill = None if o.machine is None else Mill.load(o.machine)
    limits = MachineLimits() if mill is None else mill.limits
    page = None if o.figure is None else html_name(o.figure, "--figure")
    laid = _laid(o.logs, o.program, None if mill is None else mill.chain)
    for text in assumed(limits, program=laid[0].driven.toolpath.program):
        note(text)
    found = []
    for one in laid:
        _doubts(one)
        found.append(compare(one, limits))
    for each in [] if o.as_json else found:
        print(
            f"{each.name}: {_beside(each.predicted_s, each.logged_s, each.error)}, feeds alone {each.ideal_s:.1f} s"
        )
        for tool in each.tools:
            print(f"  tool {tool['tool']}: {_beside(tool['predicted_s'], tool['logged_s'], tool['error'])}")
        for reason, seconds in each.left_out.items():
            print(f"  not compared: {seconds:.0f} s of {reason}")
    if o.table is not None:
        rows = pl.concat([one.blocks.with_columns(pl.lit(one.name).alias("log")) for one in found])
        write_atomic(o.table, rows.write_csv())
    if page is not None:
        write_times(found, page)
        note(f"{page}: written")
    if o.as_json:
        emit(together(found))
    return Code.DONE


def join_(o: Join) -> int:
    job, driven, blocks = of_result(o.results)
    mill = None if o.machine is None else Mill.load(o.machine)
    limits = machine_limits(job) if mill is None else mill.limits
    if mill is not None and mill.chain is not None:
        note(f"{o.machine}: its table [machine] counts; axes are those of the job")
    tables: list[pl.DataFrame] = []
    left: dict[str, float] = {}
    for path in o.logs:
        laid = lay(read_log(path), driven)
        _doubts(laid)
        for reason, seconds in laid.left_out.items():
            note(f"{path.name}: not compared: {seconds:.0f} s of {reason}")
            left[reason] = left.get(reason, 0.0) + seconds
        tables.append(join(compare(laid, limits), blocks).with_columns(pl.lit(path.name).alias("log")))
    rows = pl.concat(tables)
    write_table(rows, o.results / "logged.csv", o.results / "logged.parquet")
    kept = rows.filter(pl.col("compared"))
    loads = kept.filter(pl.col("load").is_not_nan() & pl.col("mrr_mm3_min").is_not_nan())
    told: dict[str, object] = {
        "intervals": len(kept), "logged_s": float(kept["logged_s"].sum()), "removed_mm3": float(kept["removed_mm3"].sum()),
        "left_out_s": left, "intervals_with_load": len(loads),
        "files": [str(o.results / f"logged.{kind}") for kind in ("csv", "parquet")],
    }  # fmt: skip
    for name in ("mrr_mm3_min", "force_n", "power_w"):
        both = loads.filter(pl.col(name).is_not_nan())
        rank = both.select(pl.corr("load", name, method="spearman")).item() if len(both) > 2 else None
        told[f"load_rank_correlation_{name}"] = rank if rank is not None and rank == rank else None
    if o.as_json:
        emit(told)
        return Code.DONE
    for key, value in told.items():
        if key != "left_out_s":
            print(f"{key}: {'not known' if value is None else value}")
    if not len(loads):
        note("the log has no load of the spindle: its columns are empty")
    return Code.DONE


def _beside(predicted: float, logged: float, error: float) -> str:
    return f"predicted {predicted:.1f} s, logged {logged:.1f} s ({100 * error:+.1f} %)"


def _doubts(laid: Laid) -> None:
    for words in (laid.clock(), laid.another):
        if words is not None:
            note(words)


def _laid(logs: list[Path], programs: list[Path], chain: Machine | None = None) -> list[Laid]:
    if len(programs) not in (1, len(logs)):
        remedy = "give one --program, or one for each log"
        raise InputError(f"{len(logs)} logs and {len(programs)} programs", remedy=remedy)
    driven: dict[Path, Driven] = {}
    for path in programs:
        if path not in driven:
            program = read_program(path, dialect="auto")
            if count := len(program.errors):
                note(f"{path}: {count} findings that `vmachining nc check` names; what is read is timed")
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
