"""Force over time along the blocks of a job: a revolution at every station."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import polars as pl

from vmachining.arrays import Floats
from vmachining.errors import InputError, JobError
from vmachining.force import Overlay, Turns, power_w, shipped, turn_load, turn_series
from vmachining.job.engagement_columns import Watched, coefficients_of, engagement_pass, spin_of
from vmachining.job.jobfile import Job
from vmachining.job.timing import machine_limits, move_times
from vmachining.job.toolpath import Toolpath
from vmachining.progress import Progress

SERIES: dict[str, Any] = {
    "block": pl.Int64, "line": pl.Int64, "at": pl.Float64, "time_s": pl.Float64, "phi_deg": pl.Float64,
    "fx_n": pl.Float64, "fy_n": pl.Float64, "fz_n": pl.Float64, "resultant_n": pl.Float64,
    "torque_n_mm": pl.Float64, "tangential_n": pl.Float64,
}  # fmt: skip
"""Columns of the revolutions: forces on the tool in workpiece axes; phi of the first tooth in the tool frame."""

STATIONS: dict[str, Any] = {
    "block": pl.Int64, "line": pl.Int64, "at": pl.Float64, "time_s": pl.Float64, "feed_mm_min": pl.Float64,
    "spindle_rev_min": pl.Float64, "peak_n": pl.Float64, "mean_torque_n_mm": pl.Float64, "power_w": pl.Float64,
}  # fmt: skip
"""Columns of the stations: largest force and mean torque of a revolution."""


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """series : rows of `SERIES`, a revolution after the other. stations : rows of `STATIONS`. notes : what is missing.

    teeth : of every tool that cuts.
    """

    series: pl.DataFrame
    stations: pl.DataFrame
    notes: tuple[str, ...]
    teeth: frozenset[int]

    def turns(self, angles: int = 360) -> Turns:
        """The revolutions at so many even angles, which a measured trace is laid over.

        Raises InputError: Blocks with different spindle speeds or tools.
        """
        speeds = self.stations["spindle_rev_min"].unique().sort().to_list()
        if len(speeds) > 1 or len(self.teeth) > 1:
            turns, teeth = ", ".join(f"{v:g}" for v in speeds), ", ".join(map(str, sorted(self.teeth)))
            what = f"blocks with spindle speeds {turns} rev/min and tools of {teeth} teeth"
            raise InputError(
                f"{what}: a trace is compared with one of each", remedy="choose blocks with --block"
            )
        grid = np.arange(angles) * 360.0 / angles
        begin, kept = np.unique(self.series.select("block", "at").to_numpy(), axis=0, return_inverse=True)
        force = np.zeros((len(begin), angles, 3))
        columns = self.series.select("phi_deg", "fx_n", "fy_n", "fz_n").to_numpy()
        for k in range(len(begin)):
            turn = columns[kept == k]
            if len(turn) > 1:  # one row of zeros is air
                for q in range(3):
                    force[k, :, q] = np.interp(grid, turn[:, 0] % 360.0, turn[:, 1 + q], period=360.0)
        found = self.stations.sort("block", "at").select("time_s", "block")
        order = np.argsort(found["time_s"].to_numpy(), kind="stable")
        return Turns(
            found["time_s"].to_numpy()[order], found["block"].to_numpy()[order], force[order], float(speeds[0]),
            next(iter(self.teeth)),
        )  # fmt: skip


def predict(
    job: Job, blocks: Sequence[int] | None = None, *, progress: Progress = lambda *_: None
) -> Prediction:
    """Forces of a job without simulating its volumes.

    blocks : numbers as in the table of `run`; None: all that cut.

    Raises JobError: No [force] table.
    Raises InputError: Blocks that are not there or do not cut; program, tools or stock of the job cannot be used; no
        block has forces.
    """
    forcing = coefficients_of(job)
    if forcing is None:
        remedy = f"add [force] with coefficients = a file, or one of {', '.join(shipped())}"
        raise JobError("forces need a [force] table", **job.where(), remedy=remedy)
    toolpath = Toolpath.of_job(job)
    every = toolpath.blocks
    cutting = {block.number for block in every if block.motion != "rapid"}
    if blocks is not None and (odd := [k for k in blocks if k not in cutting]):
        there = 0 <= odd[0] < len(every)
        what = f"block {odd[0]} does not cut" if there else f"there is no block {odd[0]}"
        raise InputError(what, remedy="see the table of a run")
    times = move_times(toolpath, machine_limits(job), block_delete=job.keys.program.block_delete).seconds
    begin = np.concatenate([[0.0], np.cumsum(times)])
    index = {id(move): k for k, move in enumerate(toolpath.moves)}
    series: list[Floats] = []
    teeth: set[int] = set()
    stations: list[tuple[float, ...]] = []

    def watch(seen: Watched) -> None:
        if not seen.fine:
            return
        teeth.add(seen.teeth.number)
        k = index[id(seen.move)]
        spin = spin_of(seen.move)
        for sample in seen.samples:
            at = begin[k] + sample.at * times[k]
            phi, columns = turn_series(sample, seen.teeth, forcing.coefficients, seen.scale, spin=spin)
            frame = sample.now[[12, 13, 14, 15, 16, 17, 3, 4, 5]].reshape(3, 3)
            force = columns[:, :3] @ frame
            turned = (phi - phi[0]) / (2.0 * np.pi) * 60.0 / seen.rev_min
            head = np.broadcast_to([seen.block.number, seen.block.line, sample.at], (len(phi), 3))
            series.append(
                np.column_stack([
                    head, at + turned, np.degrees(phi), force, np.linalg.norm(force, axis=1), columns[:, 3:5],
                ])
            )  # fmt: skip
            load = turn_load(sample, seen.teeth, forcing.coefficients, spin=spin)
            peak, torque = (0.0, 0.0) if load is None else (load.peak(seen.scale), load.torque(seen.scale))
            stations.append((
                seen.block.number, seen.block.line, sample.at, at, seen.move.feed_mm_min or float("nan"), seen.rev_min, peak,
                torque, float(power_w(torque, seen.rev_min)),
            ))  # fmt: skip

    found = engagement_pass(
        job, toolpath, progress=progress, name="forces", watch=watch,
        only=None if blocks is None else frozenset(blocks),
    )  # fmt: skip
    told = [
        f"{f'{count} blocks from block {first} on' if count > 1 else f'block {first}'}: {note}"
        for note, first, count in found.columns.filter(pl.col("contact_note").is_not_null())
        .group_by("contact_note", maintain_order=True)
        .agg(pl.col("block").first(), pl.len())
        .iter_rows()
    ]
    notes = (*found.notes, *told)
    if not stations:
        raise InputError(f"no block has forces: {'; '.join(notes) or 'nothing cuts'}")
    rows = _table(np.concatenate(series), SERIES), _table(np.array(stations), STATIONS)
    return Prediction(*rows, notes, frozenset(teeth))


def measured_table(over: Overlay) -> pl.DataFrame:
    """A row for each sample of a trace: its time, time of the program, rotation, block (-1: air), predicted and measured."""
    names = ("fx", "fy", "fz")
    return pl.DataFrame({
        "trace_s": over.seconds - over.start_s, "program_s": over.seconds, "phi_deg": 360.0 * (over.phi % 1.0),
        "block": over.block, **{f"{n}_n": over.predicted[:, k] for k, n in enumerate(names)},
        **{f"{n}_measured_n": over.measured[:, k] for k, n in enumerate(names)},
    })  # fmt: skip


def _table(rows: Floats, schema: dict[str, Any]) -> pl.DataFrame:
    columns = [pl.Series(name, rows[:, k]).cast(kind) for k, (name, kind) in enumerate(schema.items())]
    return pl.DataFrame(columns).fill_nan(None)
