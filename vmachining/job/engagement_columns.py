"""What the tool takes in every block: contact, chips, force and power at stations along it.

A station is one revolution at a fraction of a block, in the stock after all earlier blocks and this one up to there. The
columns of a block are the largest values of its stations. All motions of the program are rows of `Sweeps`; blocks are asked in
chunks, and any chunk by itself gives the same numbers.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
import polars as pl

from vmachining.arrays import Bools, Floats, Ints
from vmachining.checkpoint import Saved, opened
from vmachining.engagement.along import Sample, Seen, Sweeps, Teeth, contact_along, fractions
from vmachining.engagement.along.kernels.edge_kernels import TOUCH_MM
from vmachining.errors import InputError, JobError
from vmachining.force import Coefficients, Load, deflection_force, load_rows, power_w, shipped, turn_load
from vmachining.job.chunks import in_order, threads_for
from vmachining.job.engage import plain_stock
from vmachining.job.folder import usable
from vmachining.job.jobfile import Job
from vmachining.job.model import Feed
from vmachining.job.paths import CutterPath
from vmachining.job.simulate import CHECKPOINT_SECONDS, Stopped
from vmachining.job.stations import CuttingMotions, Stations
from vmachining.job.table import CONTACT
from vmachining.job.toolpath import Block, Toolpath
from vmachining.nc import Move
from vmachining.progress import Progress
from vmachining.tolerance import LENGTH_EPS_MM
from vmachining.tool import Edge, Tool

CHUNK, CHUNK_SLOW = 256, 32
"""Blocks that are asked together: where distances have closed forms, and elsewhere, so that a stop is heard within seconds."""

MAX_PARTS = 64
"""Stations of one block at most, less one, where blocks are to be divided."""


FLUTES = "flutes "
"""Before the number of a tool without flutes, among what is missing."""

EMPTY = "chip, force and power columns are empty where"

LEAST_PITCH_MM = 0.05
"""Teeth closer to each other than this leave no room for a chip: the smallest end mills (0.1 mm, two flutes) have 0.16 mm."""


class Forcing(NamedTuple):
    """How forces are computed. coefficients; rev_min : where the program gives none; extrapolate : beyond their heights."""

    coefficients: Coefficients
    rev_min: float | None
    extrapolate: bool


def coefficients_of(job: Job) -> Forcing | None:
    """Of [force] in the job file; None without.

    Raises JobError: Neither a file nor a shipped set; a file that is wrong says so itself.
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


OF_BLOCKS = {"values": (len(CONTACT),), "known": (), "step": ()}
OF_STATIONS = {"block": (), "area": (), "count": ()}
KINDS: dict[str, type] = {"known": np.bool_, "block": np.int64, "count": np.int64}
"""Arrays of a chunk with the shape of a row, those of blocks and of stations; the type of what is not a float."""


@dataclass(slots=True, eq=False)
class _Chunk:
    """Of consecutive blocks.

    values (n, 8), notes, known, step : of every block. block, area, count (s,) : of every station that a scheduler needs, with
    `count` rows (r, 3) of its load. missing : what chips and forces lack, {key: text}. seen : for `watch`.
    """

    values: Floats
    known: Bools
    step: Floats
    block: Ints
    area: Floats
    count: Ints
    rows: Floats
    notes: list[str | None]
    missing: dict[str, str]
    seen: list[Watched] = field(default_factory=list)

    @classmethod
    def without(cls, blocks: int) -> _Chunk:
        """Of so many blocks that nobody asks about."""
        empty = np.zeros(0)
        return cls(
            np.full((blocks, len(CONTACT)), np.nan), np.ones(blocks, dtype=np.bool_), np.full(blocks, np.nan),
            np.zeros(0, dtype=np.int64), empty, np.zeros(0, dtype=np.int64), np.empty((0, 3)), [None] * blocks, {},
        )  # fmt: skip

    @classmethod
    def joined(cls, chunks: Sequence[_Chunk]) -> _Chunk:
        """All of them, in their order."""
        shapes: dict[str, tuple[int, ...]] = {**OF_BLOCKS, **OF_STATIONS, "rows": (3,)}
        arrays: dict[str, Any] = {
            name: np.concatenate([
                np.empty((0, *shape), KINDS.get(name, np.float64)), *(getattr(chunk, name) for chunk in chunks)
            ]) for name, shape in shapes.items()
        }  # fmt: skip
        # the first one counts
        missing = dict(item for chunk in reversed(chunks) for item in chunk.missing.items())
        return cls(notes=[note for chunk in chunks for note in chunk.notes], missing=missing, **arrays)

    def split(self, sizes: Ints, missing: Sequence[dict[str, str]]) -> Iterator[_Chunk]:
        """What was joined, again; sizes : (c, 3) blocks, stations and rows of each."""
        ends = np.cumsum(sizes, axis=0)
        for (b, s, r), (to_b, to_s, to_r), lacks in zip(ends - sizes, ends, missing, strict=True):
            own = {name: getattr(self, name)[b:to_b] for name in OF_BLOCKS}
            own |= {name: getattr(self, name)[s:to_s] for name in OF_STATIONS}
            yield _Chunk(**own, rows=self.rows[r:to_r], notes=self.notes[b:to_b], missing=lacks)


class Saves(Protocol):
    """What has a state to continue from."""

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
    known: Sequence[Path] = (),
    checkpoint: Checkpoint = lambda *_: None,
    workers: int | None = 1,
    part: tuple[int, int] | None = None,
    sweeps: Sweeps | None = None,
) -> Stations:
    """The columns of contact of every block of a program, and the loads a scheduler needs.

    feed : the scheduler's keys, None without one: how far stations are apart if it may divide blocks, and which component
    of the force it limits. divided : whether blocks may be divided; None: as `feed` says, not for volumes. watch : called
    with every motion that cuts. only : blocks to look at; the others sweep. known : checkpoints, whose chunks are not done
    again. checkpoint : called with what can save its state, and the blocks done: now and then, when stopped, and at the end.
    workers : threads that do chunks of blocks side by side; None: one for each core. They change no number.
    part : (k, n) does every n-th chunk only, from number k on; what it returns is of these. sweeps : those of an earlier pass
    over the same program.

    Raises Stopped: The user asked to stop.
    Raises JobError: Coefficients that are not there.
    """
    work = _Pass(job, toolpath, coefficients_of(job), feed, divided, watch, only, sweeps)
    for path in known:
        with usable(path) as file:
            work.load(file)
    return work.run(stop, progress, name, checkpoint, workers, part or (0, 1))


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
        sweeps: Sweeps | None = None,
    ) -> None:
        self.watch, self.only = watch, only
        self.job, self.toolpath, self.forcing, self.feed = job, toolpath, forcing, feed
        self.teeth = {number: _teeth(tool, forcing is not None) for number, tool in job.tools.items()}
        self.cutters = {number: tool.cutter for number, tool in job.tools.items()}
        self.sweeps = sweeps or Sweeps(plain_stock(job)[0])
        self.motions = CuttingMotions.of(
            toolpath, job.tools, forcing.rev_min if forcing is not None else None
        )
        self.done: dict[int, _Chunk] = {}  # by first block
        self.size = 0  # blocks of a chunk, where a checkpoint says it
        if divided is None:
            divided = feed is not None and feed.insert_blocks and feed.strategy != "volume"
        self.divided = feed if divided else None

    def save(self, path: Path) -> None:
        """All that is known of the blocks so far; their sweeps are made again from the program."""
        firsts = sorted(self.done)
        chunks = [self.done[first] for first in firsts]
        out = _Chunk.joined(chunks)
        arrays = {name: getattr(out, name) for name in (*OF_BLOCKS, *OF_STATIONS, "rows")}
        sizes = np.array([(len(c.known), len(c.block), len(c.rows)) for c in chunks], dtype=np.int64)
        state = {
            "size": self.size,
            "first": firsts,
            "missing": [chunk.missing for chunk in chunks],
            "notes": out.notes,
        }
        Saved("contact", state, {"sizes": sizes.reshape(-1, 3), **arrays}).write(path)

    def load(self, path: Path) -> None:
        """The chunks of a checkpoint."""
        with opened(path, "contact") as saved:
            state, arrays = saved.state, dict(saved.arrays)
            sizes, self.size = arrays.pop("sizes"), int(state["size"])
            whole = _Chunk(notes=state["notes"], missing={}, **arrays)
            self.done |= dict(zip(state["first"], whole.split(sizes, state["missing"]), strict=True))

    def run(
        self,
        stop: Callable[[], bool],
        progress: Progress,
        name: str,
        checkpoint: Checkpoint,
        workers: int | None,
        part: tuple[int, int],
    ) -> Stations:
        every, is_swept = len(self.toolpath.blocks), self.size == 0
        if is_swept:
            self._sweep()
        size = self.size = self.size or (CHUNK if self.sweeps.is_quick else CHUNK_SLOW)
        begins = range(0, every, size)[part[0] :: part[1]]
        ranges = [range(a, min(a + size, every)) for a in begins if a not in self.done]
        total = sum(min(size, every - a) for a in begins)
        done = total - sum(map(len, ranges))
        progress(name, done, total)
        if ranges and not is_swept:
            self._sweep()
        hands = [self.sweeps, *self.sweeps.twins(threads_for(workers, len(ranges)) - 1)]
        saved = time.monotonic()
        with closing(in_order(self._chunk, ranges, hands)) as chunks:
            for numbers in ranges:
                if stop():
                    checkpoint(self, done)
                    raise Stopped(name, done, total)
                chunk = self.done[numbers.start] = next(chunks)
                if self.watch is not None:
                    [self.watch(seen) for seen in chunk.seen]
                    chunk.seen.clear()
                done += len(numbers)
                progress(name, done, total)
                if time.monotonic() - saved > CHECKPOINT_SECONDS or done == total:
                    checkpoint(self, done)
                    saved = time.monotonic()
        if not ranges:
            checkpoint(self, done)  # chunks of several parts are those of one run from here on
        return self._result()

    def _sweep(self) -> None:
        if not len(self.sweeps):
            cutters = (self.cutters[tool] for tool in self.motions.tool.tolist())
            self.sweeps.extend(zip(cutters, self.motions.path, strict=True))

    def _chunk(self, sweeps: Sweeps, numbers: range) -> _Chunk:
        """Contact of consecutive blocks in one question."""
        every, first = self.motions, numbers.start
        asked = np.arange(every.first[first], every.first[numbers.stop])
        if self.only is not None:
            asked = asked[[int(k) in self.only for k in every.block[asked]]]
        if not len(asked):
            return _Chunk.without(len(numbers))
        owner, tools, motions = every.block[asked] - first, every.tool[asked].tolist(), asked.tolist()
        step = np.full(len(numbers), np.nan)
        at = [
            self._stations(every.path[k], tool, step[o : o + 1])
            for k, tool, o in zip(motions, tools, owner.tolist(), strict=True)
        ]
        # a block begins with what the end of the one before it saw, asked or not
        keep = self.forcing is not None or self.watch is not None
        ends = [] if keep else np.setdiff1d(asked - 1, asked).tolist()
        questions = [
            *zip(motions, at, strict=True),
            *((k, np.ones(1)) for k in ends if k >= every.first[first]),
        ]
        questions.sort(key=lambda one: one[0])
        seen = contact_along(
            sweeps, questions, [self.teeth[int(every.tool[k])].edge for k, _ in questions], keep=keep
        )  # fmt: skip
        columns = seen.columns[np.isin(seen.motion, asked)]
        lengths = np.array([len(t) for t in at], dtype=np.int64)
        begin = np.cumsum(lengths) - lengths
        scale, per_feed = every.scale[asked], every.per_feed[asked]
        rows = np.full((len(asked), len(CONTACT)), np.nan)
        area, thick, ae, ap, fraction, planned = np.fmax.reduceat(columns, begin).T
        # a chip of 1e-7 mm has no width that means something
        ae, ap = (np.where(depth < TOUCH_MM, 0.0, depth) for depth in (ae, ap))
        rows[:, [0, 1, 2, 3, 4, 7]] = np.column_stack(
            [ae, ap, fraction, scale * area, scale * thick, planned]
        )
        station = np.repeat(np.arange(len(asked)), lengths)
        out = _Chunk(
            np.full((len(numbers), len(CONTACT)), np.nan), np.ones(len(numbers), dtype=np.bool_), step,
            every.block[asked][station],
            columns[:, 0] * per_feed[station], np.zeros(len(station), dtype=np.int64), np.empty((0, 3)),
            [None] * len(numbers), self._missing(asked),
        )  # fmt: skip
        # blocks of several motions keep their feed, and a scheduler needs nothing of them
        single = every.single[out.block]
        if keep:
            self._loads(out, asked, owner, range(first, numbers.stop), rows, seen, begin, single)
        else:
            out.known[owner] = False
        out.block, out.area, out.count = out.block[single], out.area[single], out.count[single]
        np.fmax.at(out.values, owner, rows)
        return out

    def _stations(self, path: CutterPath, tool: int, step: Floats) -> Floats:
        """Fractions of a motion; of blocks that may be divided a step (1,) apart, which is noted."""
        if self.divided is None or path.length <= LENGTH_EPS_MM:
            return fractions(path.length, self.cutters[tool].max_radius)
        step[0] = apart = step_mm(self.divided, path.length)
        n = max(1, int(np.ceil(path.length / apart - 1e-6)))
        return np.append(np.minimum(np.arange(n) * apart / path.length, 1.0), 1.0)

    def _missing(self, asked: Ints) -> dict[str, str]:
        """Why motions have no chips."""
        blunt = [
            tool
            for tool in np.unique(self.motions.tool[asked]).tolist()
            if self.job.tools[tool].flutes is None
        ]
        found = {f"{FLUTES}{tool}": "" for tool in blunt}
        still = asked[np.isnan(self.motions.rev_min[asked]) & ~np.isin(self.motions.tool[asked], blunt)]
        if len(still):
            line = self.motions.move[int(still[0])].line
            found["speed"] = f"the program gives no spindle speed (from line {line} on)"
        return found

    def _loads(
        self, out: _Chunk, asked: Ints, owner: Ints, numbers: range, values: Floats, seen: Seen, begin: Ints, single: Bools
    ) -> None:  # fmt: skip
        """Forces of motions, which go to their columns of `values`, and what a scheduler needs of them; `watch` hears of all."""
        kept: list[Floats] = []
        every, ends = self.motions, [*begin.tolist()[1:], len(single)]
        for i, (k, o) in enumerate(zip(asked.tolist(), owner.tolist(), strict=True)):
            move, stations = every.move[k], range(int(begin[i]), ends[i])
            rev_min, scale, fine = float(every.rev_min[k]), float(every.scale[k]), False
            teeth, forcing = self.teeth[move.tool], self.forcing
            samples: list[Sample] = []
            if self.watch is not None or (forcing is not None and np.isfinite(scale)):
                samples = [seen.sample(s, teeth) for s in stations]
            if forcing is not None and np.isfinite(scale):
                loads = [turn_load(s, teeth, forcing.coefficients, spin=spin_of(move)) for s in samples]
                fine = self._forces(loads, scale, rev_min, values[i], out.notes, o)
                if fine and single[stations.start]:
                    for s, load in zip(stations, loads, strict=True):
                        if load is not None and np.isfinite(every.per_feed[k]):
                            kept.append(self._rows(load, move, rev_min, float(every.per_feed[k])))
                            out.count[s] = len(kept[-1])
            out.known[o] &= fine
            if self.watch is not None:
                block = self.toolpath.blocks[numbers[o]]
                out.seen.append(Watched(block, move, teeth, samples, rev_min, scale, fine))
        out.rows = np.concatenate([out.rows, *kept])

    def _forces(
        self, loads: list[Load | None], scale: float, rev_min: float, values: Floats, notes: list[str | None], at: int
    ) -> bool:  # fmt: skip
        """Columns of force and power of one motion, with what to warn of in `notes`; whether they are known."""
        assert self.forcing is not None
        met = [load for load in loads if load is not None]
        heights = [load.heights for load in met]
        low, high = min((h[0] for h in heights), default=0.0), max((h[1] for h in heights), default=0.0)
        if met and (text := self.forcing.coefficients.outside(low, high)) is not None:
            text = f"force: {text}" + (", taken anyway" if self.forcing.extrapolate else "")
            if text not in (notes[at] or "").split("; "):
                notes[at] = "; ".join(filter(None, (notes[at], text)))
            if not self.forcing.extrapolate:
                return False
        values[5] = max((load.peak(scale) for load in met), default=0.0)
        values[6] = float(power_w(max((load.torque(scale) for load in met), default=0.0), rev_min))
        return True

    def _rows(self, load: Load, move: Move, rev_min: float, per_feed: float) -> Floats:
        """(r, 3) of a load, see `Stations`: f = F / (m n); beyond the largest feed nobody asks."""
        component = self.feed.component if self.feed is not None else "resultant"
        top = max(self.feed.max_mm_min if self.feed is not None else 0.0, move.feed_mm_min or 0.0)
        teeth, watt = (self.job.tools[move.tool].flutes or 1) * rev_min, 2.0 * np.pi * rev_min / 60e3
        rows = load_rows(load, component, per_feed * teeth, top / teeth, watt) / np.array(
            [teeth * teeth, teeth, 1.0]
        )
        return np.asarray(rows / self._stiffness(move.tool) ** 2 if component == "deflection" else rows)

    def _stiffness(self, tool: int) -> float:
        """N across the axis that bend the tool by 1 mm."""
        keys = self.job.keys.force
        assert keys is not None and keys.stick_out_mm is not None
        wide = keys.shank_mm or 2.0 * self.job.tools[tool].cutter.max_radius
        return deflection_force(1.0, keys.stick_out_mm, wide, keys.modulus_n_mm2)

    def _result(self) -> Stations:
        out = _Chunk.joined([self.done[first] for first in sorted(self.done)])
        columns = {name: pl.Series(out.values[:, k]).fill_nan(None) for k, name in enumerate(CONTACT)}
        table = pl.DataFrame({
            "block": pl.Series(range(len(out.known)), dtype=pl.Int64), **columns,
            "contact_note": pl.Series(out.notes, dtype=pl.String),
        })  # fmt: skip
        ends = np.cumsum(out.count)
        return Stations(
            table, out.block, out.area, out.rows, ends - out.count, ends, out.step, out.known, self._notes(out.missing),
            self.sweeps if len(self.sweeps) else None,
        )  # fmt: skip

    def _notes(self, missing: Mapping[str, str]) -> tuple[str, ...]:
        notes = [f"{EMPTY} {text}" for key, text in missing.items() if not key.startswith(FLUTES)]
        blunt = sorted(int(key.removeprefix(FLUTES)) for key in missing if key.startswith(FLUTES))
        if blunt:
            which = f"tool {blunt[0]} cuts" if len(blunt) == 1 else f"tools {', '.join(map(str, blunt))} cut"
            notes.append(f"{EMPTY} {which}, of which no flutes are given: write `flutes = N` under [[tools]]")
        notes += [
            text for number, tool in self.job.tools.items() if (text := _crowded(number, tool)) is not None
        ]
        if self.forcing is not None:
            low, high = self.forcing.coefficients.height_mm
            tall = max(float(cutter.z_max) for cutter in self.cutters.values())
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
