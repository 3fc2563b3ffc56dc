"""What the tool takes in every block: contact, chips, force and power at stations along it.

A station is one revolution at a fraction of a block, in the stock after all earlier blocks and this one up to there. The
columns of a block are the largest values of its stations. Nothing is carried along but the list of sweeps: each block asks
those near it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Container, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np
import polars as pl

from vmachining.arrays import Bools, Floats, Ints
from vmachining.engagement.along import Sample, Sweeps, Teeth, fractions, samples_along
from vmachining.engines.pickled import load_values, save_values
from vmachining.errors import InputError, JobError
from vmachining.force import Coefficients, Load, deflection_force, load_rows, power_w, shipped, turn_load
from vmachining.job.blocks import Block
from vmachining.job.engage import plain_stock
from vmachining.job.jobfile import Job
from vmachining.job.model import Feed
from vmachining.job.paths import CutterPath
from vmachining.job.simulate import CHECKPOINT_SECONDS, Progress, Stopped
from vmachining.job.table import CONTACT
from vmachining.job.toolpath import Toolpath
from vmachining.nc import Move
from vmachining.tolerance import LENGTH_EPS_MM
from vmachining.tool import Edge, Tool

__all__ = [
    "Forcing",
    "Stations",
    "Watched",
    "coefficients_of",
    "engagement_pass",
    "no_stations",
    "spin_of",
    "step_mm",
]

MAX_PARTS = 64
"""Stations of one block at most, less one, where blocks are to be divided."""


LEAST_PITCH_MM = 0.05
"""Teeth closer to each other than this leave no room for a chip: the smallest end mills (0.1 mm, two flutes) have 0.16 mm."""


class Forcing(NamedTuple):
    """How forces are computed. coefficients; rev_min : where the program gives none; extrapolate : beyond their heights."""

    coefficients: Coefficients
    rev_min: float | None
    extrapolate: bool


def coefficients_of(job: Job) -> Forcing | None:
    """Of [force] in the job file; None without.

    Raises
    ------
    JobError
        Neither a file nor a shipped set; a file that is wrong says so itself.
    """
    keys = job.keys.force
    if keys is None:
        return None
    path = job.folder / keys.coefficients
    if path.is_file():
        found = Coefficients.load(path)
    else:
        try:
            found = shipped(keys.coefficients)
        except InputError as exc:
            raise JobError(
                f"coefficients = {keys.coefficients!r} is neither a file in {job.folder.resolve()} nor a shipped set",
                **job.where("force", "coefficients"), remedy=exc.remedy,
            ) from exc  # fmt: skip
    return Forcing(found, keys.spindle_rev_min, keys.extrapolate)


def step_mm(feed: Feed, length: float) -> float:
    """Distance of stations on a block that may be divided: the shortest block, doubled until there are at most 64."""
    step = feed.min_length_mm
    while length > MAX_PARTS * step * (1.0 + 1e-9):
        step *= 2.0
    return step


@dataclass(slots=True, eq=False)
class Stations:
    """Loads along the blocks, for schedulers.

    block : (s,) of every station, in program order. area_per_feed : mm^2 per mm/min, NaN where nothing is known of the
    spindle or the teeth. rows : p, q, r of the load in F mm/min (see `ForceStrategy`); first, last : of every station.
    step : (n,) mm between stations of block k, NaN where they are at equal fractions. known : (n,) bool, force known.
    columns : block, the seven columns, note. notes : of the job.
    """

    columns: pl.DataFrame
    block: Ints
    area_per_feed: Floats
    rows: Floats
    first: Ints
    last: Ints
    step: Floats
    known: Bools
    notes: tuple[str, ...] = ()

    def parts(self, *, divided: bool) -> tuple[Ints, Ints]:
        """First and last station of every part, both ends included; a part without stations has last < first.

        divided : one part between two stations, else one part per block.
        """
        n = len(self.columns)
        count = np.bincount(self.block, minlength=n)
        start = np.concatenate([[0], np.cumsum(count)])[:-1]
        if not divided:
            return start, start + count - 1
        counts = np.maximum(count - 1, 1)
        owner = np.repeat(np.arange(n), counts)
        number = np.arange(len(owner)) - (np.cumsum(counts) - counts)[owner]
        first = start[owner] + number
        return first, np.where(count[owner] > 1, first + 1, first + count[owner] - 1)


@dataclass(slots=True, eq=False)
class _Collector:
    """Growing columns of the pass."""

    values: list[tuple[float, ...]] = field(default_factory=list)
    notes: list[str | None] = field(default_factory=list)
    known: list[bool] = field(default_factory=list)
    step: list[float] = field(default_factory=list)
    block: list[int] = field(default_factory=list)
    area: list[float] = field(default_factory=list)
    rows: list[Floats] = field(default_factory=list)
    count: list[int] = field(default_factory=list)


class Saves(Protocol):
    """What has a state to go on from."""

    def save(self, path: Path) -> None: ...


Checkpoint = Callable[[Saves, int], None]


def engagement_pass(
    job: Job,
    toolpath: Toolpath,
    *,
    stop: Callable[[], bool] = lambda: False,
    progress: Progress = lambda *_: None,
    name: str = "engagement",
    feed: Feed | None = None,
    divided: bool | None = None,
    watch: Watch | None = None,
    only: Container[int] | None = None,
    known: Path | None = None,
    checkpoint: Checkpoint = lambda *_: None,
) -> Stations:
    """The seven columns of every block of a program, and the loads a scheduler needs.

    feed : the scheduler's keys, None without one: how far stations are apart if it may divide blocks, and which component
    of the force it limits. divided : whether blocks may be divided; None: as `feed` says, not for volumes. watch : called
    with every motion that cuts. only : blocks to look at; the others sweep. known : a checkpoint to go on
    from. checkpoint : called with what can save its state, and the blocks done: now and then, when stopped, and at the end.

    Raises
    ------
    Stopped
        The user asked to stop.
    JobError
        Coefficients that are not there.
    """
    work = _Pass(job, toolpath, coefficients_of(job), feed, divided, watch, only)
    if known is not None:
        work.load(known)
    return work.run(stop, progress, name, checkpoint)


def no_stations(blocks: int, why: str) -> Stations:
    """Of a job whose contact nobody asked for."""
    empty = {name: pl.Series([None] * blocks, dtype=pl.Float64) for name in CONTACT}
    columns = pl.DataFrame(
        {"block": pl.Series(range(blocks), dtype=pl.Int64), **empty, "contact_note": pl.Series([None] * blocks, dtype=pl.String)}
    )  # fmt: skip
    none = np.zeros(0, dtype=np.int64)
    return Stations(
        columns, none, np.zeros(0), np.empty((0, 3)), none, none, np.full(blocks, np.nan),
        np.ones(blocks, dtype=np.bool_), (why,),
    )  # fmt: skip


class Watched(NamedTuple):
    """One motion as the pass has seen it. fine : forces can be computed. scale : chip scale at the programmed feed."""

    block: Block
    move: Move
    teeth: Teeth
    samples: list[Sample]
    rev_min: float
    scale: float
    fine: bool


Watch = Callable[[Watched], None]


class _Pass:
    def __init__(
        self,
        job: Job,
        toolpath: Toolpath,
        forcing: Forcing | None,
        feed: Feed | None,
        divided: bool | None = None,
        watch: Watch | None = None,
        only: Container[int] | None = None,
    ) -> None:
        self.watch, self.only = watch, only
        self.job, self.toolpath, self.forcing, self.feed = job, toolpath, forcing, feed
        stock, _ = plain_stock(job)
        radii = [tool.cutter.max_radius for tool in job.tools.values()]
        self.sweeps = Sweeps(stock, min(radii))
        self.teeth = {number: _teeth(tool, forcing is not None) for number, tool in job.tools.items()}
        self.missing: dict[str, str] = {}
        self.out = _Collector()
        if divided is None:
            divided = feed is not None and feed.insert_blocks and feed.strategy != "volume"
        self.divided = feed if divided else None

    def save(self, path: Path) -> None:
        """All that is known of the blocks so far; their sweeps are made again from the program."""
        out = self.out
        lists = {
            f.name: np.array(getattr(out, f.name)) for f in fields(out) if f.name not in ("notes", "rows")
        }
        rows = np.concatenate(out.rows) if out.rows else np.empty((0, 3))
        save_values(path, {"missing": self.missing, "notes": out.notes, "rows": rows, **lists})

    def load(self, path: Path) -> None:
        state = load_values(path, "engagement")
        self.missing, notes, rows = state.pop("missing"), state.pop("notes"), state.pop("rows")
        lists = {name: values.tolist() for name, values in state.items()}
        cuts = np.split(rows, np.cumsum(lists["count"]).astype(int))[:-1]
        self.out = _Collector(notes=notes, rows=cuts, **lists)

    def run(
        self, stop: Callable[[], bool], progress: Progress, name: str, checkpoint: Checkpoint
    ) -> Stations:
        first, total = len(self.out.step), len(self.toolpath.blocks)
        progress(name, first, total)
        for block in self.toolpath.blocks[:first]:
            for move, path in self._cutting(block):
                self.sweeps.add(block.number, self.job.tools[move.tool].cutter, path)
        saved = time.monotonic()
        for block in self.toolpath.blocks[first:]:
            if stop():
                checkpoint(self, block.number)
                raise Stopped(name, block.number, total)
            self._block(block)
            progress(name, block.number + 1, total)
            if time.monotonic() - saved > CHECKPOINT_SECONDS:
                checkpoint(self, block.number + 1)
                saved = time.monotonic()
        if first < total:
            checkpoint(self, total)
        return self._result()

    def _cutting(self, block: Block) -> list[tuple[Move, CutterPath]]:
        return [(move, path) for move, path in self.toolpath.cuts(block) if move.tool in self.teeth]

    def _block(self, block: Block) -> None:
        out = self.out
        cutting = self._cutting(block)
        out.step.append(float("nan"))
        if not cutting:
            out.values.append((float("nan"),) * len(CONTACT))
            out.notes.append(None)
            out.known.append(True)
            return
        best = np.full(len(CONTACT), np.nan)
        notes: list[str] = []
        known = True
        for move, path in cutting:
            if self.only is None or block.number in self.only:
                values, fine, told = self._move(block, move, path)
                best = np.fmax(best, values)
                known &= fine
                notes += [text for text in told if text not in notes]
            self.sweeps.add(block.number, self.job.tools[move.tool].cutter, path)
        out.values.append(tuple(best.tolist()))
        out.notes.append("; ".join(notes) or None)
        out.known.append(known)

    def _move(self, block: Block, move: Move, path: CutterPath) -> tuple[Floats, bool, list[str]]:
        """Columns of one motion, whether its forces are known, and what to warn of."""
        teeth, radius = self.teeth[move.tool], self.job.tools[move.tool].cutter.max_radius
        if self.divided is not None and path.length > LENGTH_EPS_MM:
            step = step_mm(self.divided, path.length)
            n = max(1, int(np.ceil(path.length / step - 1e-6)))
            at = np.append(np.minimum(np.arange(n) * step / path.length, 1.0), 1.0)
            self.out.step[-1] = step
        else:
            at = fractions(path.length, radius)
        samples = samples_along(self.sweeps, block.number, path, teeth, at)
        rev_min, scale, per_feed = self._rates(move, path)
        values = np.full(len(CONTACT), np.nan)
        values[0] = _largest([s.chips.ae for s in samples])
        values[1] = max(s.chips.ap for s in samples)
        values[2] = max(s.chips.fraction for s in samples)
        if np.isfinite(scale):
            values[3] = scale * max(s.chips.area_rate for s in samples)
            values[4] = scale * max(s.chips.thickness_rate for s in samples)
        told: list[str] = []
        loads: list[Load | None] = [None] * len(samples)
        fine = self.forcing is not None and np.isfinite(scale)
        if self.forcing is not None and fine:
            loads = [turn_load(s, teeth, self.forcing.coefficients, spin=spin_of(move)) for s in samples]
            met = [load.heights for load in loads if load is not None]
            low, high = min((h[0] for h in met), default=0.0), max((h[1] for h in met), default=0.0)
            if met and (text := self.forcing.coefficients.outside(low, high)) is not None:
                told.append(f"force: {text}" + (", taken all the same" if self.forcing.extrapolate else ""))
                fine = self.forcing.extrapolate
            if fine:
                values[5] = max((load.peak(scale) for load in loads if load is not None), default=0.0)
                torque = max((load.torque(scale) for load in loads if load is not None), default=0.0)
                values[6] = float(power_w(torque, rev_min))
        if self.watch is not None:
            self.watch(Watched(block, move, teeth, samples, rev_min, scale, fine))
        self._keep(block, move, samples, loads if fine else [None] * len(samples), rev_min, per_feed)
        return values, bool(fine), told

    def _rates(self, move: Move, path: CutterPath) -> tuple[float, float, float]:
        """rev/min; chip scale at the programmed feed; chip scale per mm/min. NaN where something is missing."""
        none = float("nan"), float("nan"), float("nan")
        default = self.forcing.rev_min if self.forcing is not None else None
        rev_min = abs(move.spindle_rpm) or default
        count = self.job.tools[move.tool].flutes
        if count is None:
            self.missing.setdefault(f"flutes {move.tool}", f"tool {move.tool} cuts, which has no flutes")
            return none
        if rev_min is None:
            self.missing.setdefault("speed", f"the program gives no spindle speed (from line {move.line} on)")
            return none
        if path.length > LENGTH_EPS_MM and move.feed_mm_min:
            per_feed = 1.0 / (path.length * count * rev_min)
            return rev_min, per_feed * move.feed_mm_min, per_feed
        if move.duration_s:
            return rev_min, 60.0 / move.duration_s / (count * rev_min), float("nan")
        return none

    def _keep(
        self,
        block: Block,
        move: Move,
        samples: list[Sample],
        loads: list[Load | None],
        rev_min: float,
        per_feed: float,
    ) -> None:
        """Stations for the scheduler; blocks of several motions keep their feed and have none."""
        if len(block.moves) > 1:
            return
        out, forcing = self.out, self.forcing
        component = self.feed.component if self.feed is not None else "resultant"
        count = self.job.tools[move.tool].flutes or 1
        # f = F / (m n); beyond the largest feed nobody asks
        top = max(self.feed.max_mm_min if self.feed is not None else 0.0, move.feed_mm_min or 0.0)
        for sample, load in zip(samples, loads, strict=True):
            out.block.append(block.number)
            out.area.append(sample.chips.area_rate * per_feed)
            rows = np.empty((0, 3))
            if load is not None and forcing is not None and np.isfinite(per_feed):
                teeth = count * rev_min
                watt = 2.0 * np.pi * rev_min / 60e3
                rows = load_rows(load, component, per_feed * teeth, top / teeth, watt)
                rows = rows / np.array([teeth * teeth, teeth, 1.0])
                if component == "deflection":
                    rows = rows / self._stiffness(move.tool) ** 2
            out.rows.append(rows)
            out.count.append(len(rows))

    def _stiffness(self, tool: int) -> float:
        """N across the axis that bend the tool by 1 mm."""
        keys = self.job.keys.force
        assert keys is not None and keys.stick_out_mm is not None
        wide = keys.shank_mm or 2.0 * self.job.tools[tool].cutter.max_radius
        return deflection_force(1.0, keys.stick_out_mm, wide, keys.modulus_n_mm2)

    def _result(self) -> Stations:
        out = self.out
        table = np.array(out.values).reshape(-1, len(CONTACT))
        columns = pl.DataFrame(
            {
                "block": pl.Series(range(len(self.toolpath.blocks)), dtype=pl.Int64),
                **{
                    name: pl.Series(table[:, k], dtype=pl.Float64).fill_nan(None)
                    for k, name in enumerate(CONTACT)
                },
                "contact_note": pl.Series(out.notes, dtype=pl.String),
            }
        )
        ends = np.cumsum(out.count, dtype=np.int64) if out.count else np.zeros(0, dtype=np.int64)
        counts = np.array(out.count, dtype=np.int64)
        rows = np.concatenate(out.rows) if out.rows else np.empty((0, 3))
        return Stations(
            columns, np.array(out.block, dtype=np.int64), np.array(out.area), np.ascontiguousarray(rows), ends - counts, ends,
            np.array(out.step), np.array(out.known, dtype=np.bool_), self._notes(),
        )  # fmt: skip

    def _notes(self) -> tuple[str, ...]:
        notes = [f"chip, force and power columns are empty where {text}" for text in self.missing.values()]
        notes += [
            text for number, tool in self.job.tools.items() if (text := _crowded(number, tool)) is not None
        ]
        if self.forcing is not None:
            low, high = self.forcing.coefficients.height_mm
            tall = max(float(tool.cutter.z_max) for tool in self.job.tools.values())
            notes += self.forcing.coefficients.negative(low, min(high, tall))
        return tuple(notes)


def _crowded(number: int, tool: Tool) -> str | None:
    """Words for more teeth than fit on the circle of a tool, None if they do."""
    round_ = 2.0 * np.pi * tool.cutter.max_radius
    if tool.flutes is None or round_ >= LEAST_PITCH_MM * tool.flutes:
        return None
    apart = round_ / tool.flutes
    return f"{tool.flutes} flutes of tool {number} stand {apart:.2g} mm apart: is their number right?"


def _teeth(tool: Tool, forces: bool) -> Teeth:
    edge = Edge(tool, bottom=True)
    wound = tool.helix_deg if forces and tool.flutes is not None else None
    helical = Edge(tool, helix_deg=wound, bottom=True) if wound else None
    return Teeth(edge, helical, tool.flutes or 1)


def spin_of(move: Move) -> int:
    return -1 if move.spindle_rpm < 0.0 else 1


def _largest(values: Sequence[float]) -> float:
    known = [v for v in values if not np.isnan(v)]
    return max(known) if known else float("nan")
