"""dda: pulse trains of a program."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vmachining.cli.main import Code
from vmachining.cli.nc import note_findings, read
from vmachining.cli.nc_commands import Checking, Dda
from vmachining.cli.screen import emit, note
from vmachining.errors import InputError, KinematicsError
from vmachining.geometry import Arc, Line
from vmachining.job.files import atomic_path
from vmachining.job.folder import refuse_target
from vmachining.job.paths import move_path
from vmachining.machine import Interpolator, PulseBlock, write_csv, write_npz
from vmachining.nc import Motion, Program

CSV_HEADER, NPZ_MEMBER, GENERATOR = b"block,line,tick,time_s,x,y,z\n", b"steps.npy", b"vmachining dda"
"""What tells files of this command from others."""

STEADY: dict[str, Any] = dict.fromkeys(("axis_start", "axis_end", "rotary_start", "rotary_deg"))
"""Of a move whose axes rest: dda drives X, Y and Z alone, wherever the others stand."""


def dda(o: Dda) -> int:
    name, out, plot, blu, as_json = o.program, o.out, o.plot, o.blu, o.as_json
    if out is not None and out.suffix.lower() not in (".csv", ".npz"):
        raise InputError(f"--out {out}: expected a name that ends in .csv or .npz")
    inputs = {} if name == "-" else {"program": Path(name)}
    if out is not None:
        refuse_target(out, inputs, CSV_HEADER if out.suffix.lower() == ".csv" else NPZ_MEMBER)
    if plot is not None:
        if plot.suffix.lower() not in (".html", ".htm"):
            raise InputError(f"--plot {plot}: expected a name that ends in .html")
        refuse_target(plot, inputs, GENERATOR)
    interpolator = Interpolator(
        blu_mm=blu, register=o.register, mode=o.mode, split=o.split, max_pulse_hz=o.max_rate
    )
    names = ("dialect", "tools", "tools_units", "home", "travel", "machine")
    reading = Checking(**{name: getattr(o, name) for name in names}, blu=blu)
    program = read(name, reading)
    program.require_clean(allow={"W401"})
    note_findings(program)
    paths, blocks = _interpolated(program, interpolator)
    for block in blocks:
        if as_json:
            emit({
                "line": block.line, "kind": block.kind, "start_blu": block.start.tolist(),
                "pulses": block.train.counts.tolist(), "missing": block.missing.tolist(), "ticks": block.train.ticks,
                "train": block.train.text(), "tick": block.train.tick.tolist(), "feed_mm_min": block.feed_mm_min,
                "frn": block.frn, "clock_hz": block.clock_hz, "peak_hz": block.peak_hz, "time_s": block.time_s,
                "deviation_blu": block.deviation_blu, "limit_blu": block.limit_blu if math.isfinite(block.limit_blu) else None,
            })  # fmt: skip
        elif out is None:
            print(_block_line(block))
    if out is not None:
        with atomic_path(out) as temporary:
            if out.suffix.lower() == ".csv":
                write_csv(temporary, blocks)
            else:
                write_npz(temporary, blocks, interpolator)
    if plot is not None:
        from vmachining.report.scene import write_pulses

        write_pulses(plot, blocks, paths, blu, name=program.name)
    summary = _summary(blocks, interpolator)
    if as_json:
        emit({"summary": summary})
    else:
        note(
            f"{program.name}: {summary['blocks']} blocks, {summary['pulsing_ticks']} pulsing ticks, "
            f"{summary['time_s']:.3f} s, at most {summary['deviation_blu']:.3f} BLU "
            f"({summary['deviation_blu'] * blu:.4f} mm) off, {summary['beyond_limit']} blocks beyond their limit"
            + (f"; pulse trains: {out}" if out is not None else "")
        )
    return Code.FINDINGS if summary["beyond_limit"] else Code.DONE


def _interpolated(program: Program, interpolator: Interpolator) -> tuple[list[Line | Arc], list[PulseBlock]]:
    paths: list[Line | Arc] = []
    blocks: list[PulseBlock] = []
    for move in program.moves:
        if move.motion is Motion.DWELL:
            continue
        # axes that were not named before stood at zero
        before, after = move.rotary_start or {}, move.rotary_deg or {}
        turns = (
            any(value != before.get(name, 0.0) for name, value in after.items())
            or move.axis_start != move.axis_end
        )
        path = None if turns else move_path(move._replace(**STEADY))
        if not isinstance(path, Line | Arc):
            what = "a rotary axis moves" if path is None else "an arc in a tilted plane"
            remedy = "dda drives X, Y and Z in lines and arcs of the main planes"
            raise KinematicsError(what, file=program.name, line=move.line, remedy=remedy)
        if not path.length:
            continue
        feed = None if move.motion is Motion.RAPID else move.feed_mm_min
        try:
            blocks += interpolator.blocks(path, feed, move.line)
        except KinematicsError as exc:
            raise KinematicsError(exc.message, file=program.name, line=move.line, remedy=exc.remedy) from exc
        paths.append(path)
    return paths, blocks


def _block_line(block: PulseBlock) -> str:
    counts = zip("XYZ", block.train.counts.tolist(), strict=True)
    pulses = " ".join(f"{axis}{count:+d}" for axis, count in counts)
    limit = f"{block.limit_blu:.3f}" if math.isfinite(block.limit_blu) else "-"
    lost = f"  missing {block.missing.tolist()}" if block.missing.any() else ""
    return (
        f"{block.line:>7}  {block.kind:<5}  {pulses:<24}  FRN {block.frn:<9.4g}  {block.clock_hz:>10.6g} Hz  "
        f"{block.time_s:>9.4f} s  off {block.deviation_blu:.3f} of {limit} BLU{lost}"
    )


def _summary(blocks: Sequence[PulseBlock], interpolator: Interpolator) -> dict[str, Any]:
    pulses = [np.abs(block.train.steps).sum(axis=0, dtype=np.int64) for block in blocks]
    return {
        "blocks": len(blocks), "blu_mm": interpolator.blu_mm, "register": interpolator.register, "mode": interpolator.mode,
        "pulses": np.sum(pulses, axis=0).tolist() if pulses else [0, 0, 0],
        "missing": np.sum([block.missing for block in blocks], axis=0).tolist() if blocks else [0, 0, 0],
        "pulsing_ticks": sum(len(block.train.tick) for block in blocks), "ticks": sum(block.train.ticks for block in blocks),
        "time_s": sum(block.time_s for block in blocks), "peak_hz": max((block.peak_hz for block in blocks), default=0.0),
        "deviation_blu": max((block.deviation_blu for block in blocks), default=0.0),
        "beyond_limit": sum(block.deviation_blu > block.limit_blu + 1e-9 for block in blocks),
    }  # fmt: skip
