"""sweep, block, and what only a clone has."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any

from vmachining.cli.judge_commands import Bench, Block, Sweep
from vmachining.cli.main import Code
from vmachining.cli.screen import emit, note, status_line
from vmachining.errors import InputError

STEP_MARK, PLOT_MARK, PICTURE_MARK = b"'vmachining'", b"vmachining sweep", b"vmachining"
"""What tells files of this command from others: the system a STEP file comes from, the generator of a page or a picture."""


def sweep(o: Sweep) -> int:
    name, step, plot, brep = o.file, o.step, o.plot, not o.no_brep
    if step is not None and not brep:
        raise InputError(
            "--step writes the B-rep solid, which --no-brep leaves out", remedy="drop one of them"
        )
    from vmachining.interval import Interval
    from vmachining.job.folder import refuse_target
    from vmachining.job.single import read_sweep, sweep_record
    from vmachining.report.paper import TIMES, draw_regions, is_picture, write_figure

    drawn = plot is not None and is_picture(plot, "--plot")
    if o.at is not None and not drawn:
        raise InputError(
            "--at chooses the curves of a picture", remedy="add --plot regions.pdf, or .svg, .png"
        )
    times: Sequence[float] = TIMES
    if o.at is not None:
        with suppress(ValueError):
            times = sorted({float(word) for word in o.at.split(",")})
        if times is TIMES or not all(0.0 <= t <= 1.0 for t in times):
            raise InputError(
                f"--at {o.at}: expected fractions of the motion from 0 to 1, such as 0.1,0.5,0.9"
            )
    for target, mark in ((step, STEP_MARK), (plot, PICTURE_MARK if drawn else PLOT_MARK)):
        if target is not None:
            refuse_target(target, {"sweep": Path(name)}, mark)
    found = read_sweep(name)

    def tell(bracket: Interval) -> None:
        if not o.as_json:
            sure = "" if bracket.proven else "   stated"
            print(f"{bracket.estimate:.9g} mm3   [{bracket.lo:.9g}, {bracket.hi:.9g}]{sure}", flush=True)

    with status_line() as said:
        record = sweep_record(found, o.chord, step, said, brep=brep, seconds=o.seconds, known=tell)
        if plot is not None:
            said(f"writing {plot.name}")
            from vmachining.report.scene import plot_sweep

            if drawn:
                write_figure(draw_regions(found, times=times), plot)
            else:
                plot_sweep(plot, found, o.chord)
    refused = record.get("step_refused")
    code = Code.FINDINGS if refused else Code.DONE
    if refused:
        note(f"vmachining: {step} was not written: {refused}")
    if o.as_json:
        emit(record)
        return code
    if record["brep_mm3"] is not None:
        fit = f", splines within {record['brep_fit_mm']:.1g} mm" if record["brep_fit_mm"] else ""
        print(f"{record['brep_mm3']:.9g} mm3   B-rep, {record['brep_faces']} faces{fit}")
    elif brep:
        late = "; --seconds gives it more time" if "no answer within" in str(record["brep_note"]) else ""
        print(f"no B-rep value: {record['brep_note']}{late}")
    return code


def bench(o: Bench) -> int:
    done: int = from_clone("benchmarks").bench(
        o.cases or [], listed=o.listed, blocks=o.blocks, seeds=o.seeds, journal=o.journal, as_json=o.as_json, emit=emit
    )  # fmt: skip
    return done


def from_clone(module: str) -> Any:
    """A module of the benchmarks, which are no part of the wheel.

    Raises InputError: There is no clone around.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as exc:
        if exc.name != "benchmarks":
            raise
        what = "benchmarks and the making of reference sets are not installed with the package"
        raise InputError(what, remedy="clone the source: the same command works there") from exc


def block(o: Block) -> int:
    """`vmachining block`. Exit code 1: a block is wider than was requested."""
    from vmachining.job import Job, blocks_alone
    from vmachining.job.brep import parse_blocks

    numbers = [k for text in o.blocks for part in parse_blocks(text, "BLOCKS") for k in part]
    job, share = Job.load(o.job), None
    if o.width is not None:
        share = job.with_width(o.width).keys.accuracy.width
    code = Code.DONE
    for found in blocks_alone(job, numbers, width=share):
        lo, estimate, hi = found.bracket
        if found.is_wider:
            code = Code.FINDINGS
        if o.as_json:
            emit(found.to_dict())
            continue
        relative = f"{100.0 * (hi - lo) / estimate:.3g} %" if estimate > 0.0 else "exact" if hi == lo else "-"
        print(
            f"block {found.block} (line {found.line}): {estimate:.9g} mm3   [{lo:.9g}, {hi:.9g}]   {relative}   "
            f"{found.engine}, {found.earlier} earlier sweeps, {found.seconds:.3g} s"
        )
        if found.warning is not None:
            print(f"  {found.warning}")
    return code
