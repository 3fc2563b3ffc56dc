"""`engage` for many positions of a job: a table of intervals and a row of sums for every position.

Positions are independent, so they are shared by processes; each reads the job once. Tables go to disk in parts while
they come, so memory does not grow with their number.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import active_children, get_context
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import polars as pl

from vmachining.arrays import Floats
from vmachining.disk import Scratch
from vmachining.engagement import Engagement, chip_points, chip_table
from vmachining.errors import EngineError, InputError, SweepError
from vmachining.job.brep import parse_blocks, refuse_beyond
from vmachining.job.engage import Scene, engage
from vmachining.job.files import atomic_path, write_table
from vmachining.job.jobfile import Job
from vmachining.job.simulate import Stopped
from vmachining.job.timing import machine_limits, move_times
from vmachining.job.toolpath import Toolpath
from vmachining.tolerance import LENGTH_EPS_MM

MOST_POSITIONS = 1_000_000

POSITION_COLUMNS: dict[str, Any] = {
    "block": pl.Int64, "line": pl.Int64, "at": pl.Float64, "tip_x_mm": pl.Float64, "tip_y_mm": pl.Float64, "tip_z_mm": pl.Float64,
    "i": pl.Float64, "j": pl.Float64, "k": pl.Float64, "entry_deg": pl.Float64, "exit_deg": pl.Float64, "arcs": pl.Int64,
    "ap_mm": pl.Float64, "ae_mm": pl.Float64, "length_max_mm": pl.Float64, "length_mean_mm": pl.Float64, "area_mm2": pl.Float64,
    "area_fraction": pl.Float64, "chip_per_feed_max_mm": pl.Float64, "removal_mm3_per_mm": pl.Float64, "note": pl.String,
}  # fmt: skip
"""One row per position. entry_deg, exit_deg: of the first engaged arc, from the feed where it has a direction (90 is
straight ahead), else of the tool; arcs: how many there are. chip_per_feed_max_mm: largest chip area per mm of feed per tooth.
note: what a reader must know, or why there is no answer."""

BATCH = 16
"""Positions of one errand at most: a message costs little next to them, and progress is seen."""


class Position(NamedTuple):
    """A fraction of a block."""

    block: int
    at: float


def positions(scene: Scene, blocks: str, *, at: float = 0.5, every_mm: float | None = None) -> list[Position]:
    """Where to ask: once in each cutting block, or every so many millimetres of its path.

    blocks : "all", or numbers such as "7,10-20"; rapids are left out.
    at : fraction of each block, if `every_mm` is None.
    every_mm : largest step along the path; each block is divided evenly and asked in the middle of every part.
    Raises InputError: No such block, none that cuts, a step that is not a length, or more than a million positions.
    """
    if every_mm is not None and not every_mm > 0.0:
        raise InputError(f"a step of {every_mm:g} mm: expected a positive length")
    lengths: dict[int, float] = {}
    for block, _, path in scene.cuts:
        lengths[block] = lengths.get(block, 0.0) + path.length
    if blocks.strip().lower() == "all":
        wanted = sorted(lengths)
    else:
        ranges = parse_blocks(blocks, "--block", "all, or blocks such as 7,10-20")
        refuse_beyond(ranges, len(scene.blocks) - 1, "--block")
        wanted = sorted({k for part in ranges for k in part if k in lengths})
    if not wanted:
        raise InputError("--block: these blocks are rapids, which cut nothing", remedy="ask for others")
    if every_mm is None:
        return [Position(block, at) for block in wanted]
    moved = {block: lengths[block] if lengths[block] > LENGTH_EPS_MM else 0.0 for block in wanted}
    counts = {block: max(1, int(-(-length // every_mm))) for block, length in moved.items()}
    if (total := sum(counts.values())) > MOST_POSITIONS:
        remedy = f"take fewer blocks, or a step of {every_mm * total / MOST_POSITIONS:.3g} mm"
        raise InputError(f"{total} positions, {MOST_POSITIONS} at most", remedy=remedy)
    return [Position(block, (k + 0.5) / n) for block, n in counts.items() for k in range(n)]


def engage_many(
    job: Job,
    asked: Sequence[Position],
    folder: Path,
    *,
    workers: int = 1,
    progress: Callable[[str, int, int], None] | None = None,
    chips: bool = False,
    **options: Any,
) -> pl.DataFrame:
    """What the edge touches at many positions.

    Writes `engagement.parquet` (a row per position, angle and interval, see `Engagement.table`) and `positions.csv` and
    `.parquet` (a row per position, see `POSITION_COLUMNS`) into `folder`, ordered as requested.

    options : of `engage`: method, angles, phase, edge, bottom, seconds.
    workers : processes.
    chips : write `chips.parquet`, too: `chip_table` of all positions, with block, at, time_s, path_mm (of the tip, in feed
        motions of the program) and feed_per_tooth_mm; where that feed is not known, areas and thicknesses are per mm of it;
        and `chip_points.parquet`, see `chip_points`.
    Returns the table of positions. A position that has no answer (no B-rep solid, OCCT gave up) has a note and no
        numbers.
    Raises Stopped: Ctrl-C; the positions that have answers are in the files.
    """
    errands, first, size = list[Sequence[Position]](), 0, 1
    while first < len(asked):  # what a position costs is known after the first
        errands.append(asked[first : first + size])
        first, size = first + size, min(2 * size, BATCH)
    rows: list[list[dict[str, Any]]] = [[] for _ in errands]
    done, stopped = 0, False
    with Scratch(folder) as parts:
        try:
            for k, found in _answers(job, errands, parts, workers, options, chips):
                rows[k] = found
                done += len(found)
                if progress is not None:
                    progress("engagement", done, len(asked))
        except KeyboardInterrupt:
            stopped = done < len(asked)
            if not done:
                raise
        known = [k for k, found in enumerate(rows) if found and _part(parts, k).exists()]
        table = pl.DataFrame([row for found in rows for row in found], schema=POSITION_COLUMNS)
        number = pl.struct("block", "at").rank("dense").cast(pl.Int64).alias("position") - 1
        for kind in ("engagement", *(("chips", "chip_points") if chips else ())):
            told = pl.scan_parquet([_part(parts, k, kind) for k in known])
            with atomic_path(folder / f"{kind}.parquet") as temporary:
                (told if kind == "engagement" else told.with_columns(number)).sink_parquet(temporary)
    write_table(table, folder / "positions.parquet", folder / "positions.csv")
    if stopped:
        left = (errand[0].block for errand, found in zip(errands, rows, strict=True) if not found)
        begin = next(left, None)  # none, if the stop came with the last one
        again = f"--block {begin}-{errands[-1][-1].block} --out another directory"
        rest = "" if begin is None else f"; the rest begins with block {begin}: {again}"
        then = f"they are in {folder / 'positions.csv'}{rest}"
        raise Stopped("engagement", done, len(asked), "position", then)
    return table


def _part(folder: Path, number: int, kind: str = "engagement") -> Path:
    return folder / f"{kind}-{number:06d}.parquet"


def _answers(
    job: Job,
    errands: Sequence[Sequence[Position]],
    folder: Path,
    workers: int,
    options: dict[str, Any],
    chips: bool,
) -> Iterator[tuple[int, list[dict[str, Any]]]]:
    """(number of the errand, its rows), as they come."""
    if workers <= 1 or len(errands) < 2:
        desk = _Desk.open(job, folder, options, chips)
        for number, errand in enumerate(errands):
            yield number, desk.answer(number, errand)
        return
    # fresh interpreters: a fork would copy kernels that run their own threads
    desk_of = (job, folder, options, chips)
    with ProcessPoolExecutor(workers, get_context("spawn"), _open_desk, desk_of) as pool:
        waiting = {pool.submit(_answer, k, errand): k for k, errand in enumerate(errands)}
        try:
            for future in as_completed(waiting):
                yield waiting[future], future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for process in active_children():  # errands under way would be waited for
                process.terminate()
            raise


@dataclass(frozen=True, slots=True, eq=False)
class _Desk:
    """Where errands are answered: a job that has been read, and the folder for parts."""

    scene: Scene
    folder: Path
    options: dict[str, Any]
    clock: Clock | None
    path: dict[int, tuple[float, float]]
    """Of every block: mm of feed motions before it, and its own."""

    @classmethod
    def open(cls, job: Job, folder: Path, options: dict[str, Any], chips: bool) -> _Desk:
        scene = Scene.of(job)
        clock = Clock.of(job, Toolpath.of(scene.program, job.machine)) if chips else None
        path: dict[int, tuple[float, float]] = {}
        gone = 0.0
        for block, _, cut in scene.cuts:
            before, own = path.get(block, (gone, 0.0))
            path[block] = before, own + cut.length
            gone += cut.length
        return cls(scene, folder, options, clock, path)

    def answer(self, number: int, errand: Sequence[Position]) -> list[dict[str, Any]]:
        tables, rows, chips, points = [], [], [], []
        for position in errand:
            try:
                found = engage(self.scene, position.block, at=position.at, **self.options)
            except (EngineError, SweepError) as error:  # of this position; the others have answers
                line = self.scene.blocks[position.block].line
                rows.append({"block": position.block, "line": line, "at": position.at, "note": str(error)})
                continue
            tables.append(found.table())
            rows.append(_row(found))
            if self.clock is not None:
                start, own = self.path[position.block]
                table, shape = _chips(found, position, self.clock, start + position.at * own)
                chips.append(table)
                points.append(shape)
        for kind, frames in (("chips", chips), ("chip_points", points), ("engagement", tables)):
            if frames:
                write_table(pl.concat(frames), _part(self.folder, number, kind))
        return rows


_desk: _Desk


def _open_desk(job: Job, folder: Path, options: dict[str, Any], chips: bool) -> None:
    """Begin of a worker's life: the job is read once."""
    global _desk
    _desk = _Desk.open(job, folder, options, chips)


def _answer(number: int, errand: Sequence[Position]) -> list[dict[str, Any]]:
    return _desk.answer(number, errand)


def _chips(
    found: Engagement, position: Position, clock: Clock, path_mm: float
) -> tuple[pl.DataFrame, pl.DataFrame]:
    """The chip of one position at the programmed feed, and its points."""
    feed = float(clock.feed_per_tooth[position.block])
    tooth = feed if feed == feed else 1.0
    head = {
        "block": position.block, "at": position.at, "time_s": clock.at(*position), "path_mm": path_mm,
        "feed_per_tooth_mm": feed if feed == feed else None,
    }  # fmt: skip
    kinds = {"block": pl.Int64}
    lead = [pl.lit(value, dtype=kinds.get(name, pl.Float64)).alias(name) for name, value in head.items()]
    table, points = chip_table(found, feed_per_tooth=tooth), chip_points(found, feed_per_tooth=tooth)
    return table.select(*lead, pl.all()), points.select(*lead[:2], pl.all())


def _row(found: Engagement) -> dict[str, Any]:
    s = found.summary
    arcs = s["arcs_feed_deg"] if s["arcs_feed_deg"] is not None else s["arcs_deg"]
    chip = found.chip_per_feed
    tip, axis = s["tip_mm"], s["axis"]
    return {
        "block": found.block, "line": found.line, "at": found.at,
        "tip_x_mm": tip[0], "tip_y_mm": tip[1], "tip_z_mm": tip[2], "i": axis[0], "j": axis[1], "k": axis[2],
        "entry_deg": arcs[0][0] if arcs else None, "exit_deg": arcs[0][1] if arcs else None, "arcs": len(arcs),
        "ap_mm": s["ap_mm"], "ae_mm": s["ae_mm"], "length_max_mm": s["length_max_mm"], "length_mean_mm": s["length_mean_mm"],
        "area_mm2": s["area_mm2"], "area_fraction": s["area_fraction"],
        "chip_per_feed_max_mm": float(chip.max()) if (chip == chip).all() else None,
        "removal_mm3_per_mm": s["removal_mm3_per_mm"], "note": "; ".join(found.notes) or None,
    }  # fmt: skip


class Clock(NamedTuple):
    """begin, seconds : (n,) s of every block. feed_per_tooth : (n,) mm, NaN where feed, speed or teeth are unknown."""

    begin: Floats
    seconds: Floats
    feed_per_tooth: Floats

    @classmethod
    def of(cls, job: Job, toolpath: Toolpath) -> Clock:
        """Of a program that has been read.

        Raises NCError: A feed move without a feed.
        """
        times = move_times(toolpath, machine_limits(job), block_delete=job.keys.program.block_delete).seconds
        start = np.concatenate([[0.0], np.cumsum(times)])
        blocks = toolpath.blocks
        begin = np.array([start[min(block.moves)] for block in blocks])
        end = np.array([start[max(block.moves) + 1] for block in blocks])
        default = job.keys.force.spindle_rev_min if job.keys.force is not None else None
        feed = np.full(len(blocks), np.nan)
        for block in blocks:
            for move, _ in toolpath.cuts(block):
                teeth = job.tools[move.tool].flutes if move.tool in job.tools else None
                speed = abs(move.spindle_rpm) or default
                if teeth and speed and move.feed_mm_min:
                    feed[block.number] = move.feed_mm_min / (teeth * speed)
        return cls(begin, end - begin, feed)

    def at(self, block: int, share: float) -> float:
        """s at a fraction of a block."""
        return float(self.begin[block] + share * self.seconds[block])
