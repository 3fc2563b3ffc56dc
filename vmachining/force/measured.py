"""A measured force trace over the predicted one: reading, alignment, deviation per axis, and what is wrong with the trace.

A prediction knows the force over a revolution at stations of the path; between two of them it is interpolated at the same
rotation angle. A dynamometer starts at some instant and angle that nobody wrote down: both are searched. First the offset
in time, by the mean and the spread of each component within one revolution, which no angle changes; then offset and angle
together, by least squares of the components.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.errors import InputError
from vmachining.textfile import csv_rows, finite


class MeasuredColumns(NamedTuple):
    """names : of the columns found. values : (n, columns). lines : (n,) in the file."""

    names: tuple[str, ...]
    values: Floats
    lines: Ints


def read_columns(path: Path | str, wanted: tuple[str, ...], what: str) -> MeasuredColumns:
    """The wanted columns in their order, others are left alone; "a|b" represents either.

    Raises InputError: No such file, columns that are missing or name another unit, cells that are no numbers, no row;
        names line and column.
    """
    rows = csv_rows(Path(path), what, "give a CSV file with a header")
    header = [name.strip() for name in next(rows, (1, []))[1]]
    names = []
    for want in wanted:
        either = want.split("|")
        if found := [name for name in either if name in header]:
            names.append(found[0])
            continue
        stems = {name.split("_")[0] for name in either}
        told = " or ".join(map(repr, either))
        if close := [name for name in header if name.lower().split("_")[0] in stems]:
            raise InputError(
                f"column {close[0]!r} has no unit or another one: expected {told}", file=str(path), line=1,
                remedy="names end in their unit: lengths in mm, feed in mm per tooth, time in s, angles in deg, forces in N",
            )  # fmt: skip
        raise InputError(
            f"column {told} is missing (there are {', '.join(header) or 'none'})", file=str(path), line=1,
            remedy=f"give {', '.join(wanted).replace('|', ' or ')}",
        )  # fmt: skip
    values: list[list[float]] = []
    lines: list[int] = []
    for line, cells in rows:
        cell = dict(zip(header, cells, strict=False))
        numbers = []
        for name in names:
            if (number := finite(cell.get(name, ""))) is None:
                raise InputError(
                    f"{name} = {cell.get(name, '')!r} is not a number", file=str(path), line=line
                )
            numbers.append(number)
        values.append(numbers)
        lines.append(line)
    if not values:
        raise InputError(
            "there are no rows", file=str(path), remedy="a header, and one row for each measurement"
        )
    return MeasuredColumns(tuple(names), np.array(values), np.array(lines))


FORCES = ("fx_n", "fy_n", "fz_n")
GAP = 1.5
"""Steps of the median sampling that make a gap."""
FEW = 8.0
"""Samples between two teeth below which peaks fall between samples."""
ALIKE = 0.7
"""Least correlation of a trace with the program that it was taken from: forces of a wrong program reach 0.5 by their teeth."""
MOST = 20_000
"""Samples of a trace that the search looks at."""
UNITS = {1e-3: "kN", 1e3: "mN", 1.0 / 4.4482216: "lbf", 1.0 / 9.80665: "kgf"}
"""Size of a trace in another unit, over its size in N."""


@dataclass(frozen=True, slots=True, eq=False)
class Turns:
    """Predicted revolutions.

    seconds : (k,) of the program, rising. block : (k,) numbers. force : (k, m, 3) N on the tool, workpiece axes, at m even
    angles of a turn from 0. rev_min, teeth : of the spindle and the tool.
    """

    seconds: Floats
    block: Ints
    force: Floats
    rev_min: float
    teeth: int

    def at(self, seconds: Floats, turn: Floats) -> tuple[Floats, Ints]:
        """(n, 3) N at times and angles in turns, and (n,) blocks; 0 and -1 where no block cuts."""
        after = np.clip(np.searchsorted(self.seconds, seconds, side="right"), 1, len(self.seconds) - 1)
        before = after - 1
        span = self.seconds[after] - self.seconds[before]
        share = np.clip((seconds - self.seconds[before]) / np.where(span > 0.0, span, 1.0), 0.0, 1.0)[:, None]
        m = self.force.shape[1]
        place = np.mod(turn, 1.0) * m
        left = place.astype(np.int64) % m
        part = (place - np.floor(place))[:, None]
        right = (left + 1) % m
        ends = [self.force[k, left] * (1.0 - part) + self.force[k, right] * part for k in (before, after)]
        block = self.block[before]
        inside = (block == self.block[after]) & (seconds >= self.seconds[0]) & (seconds <= self.seconds[-1])
        found = ends[0] * (1.0 - share) + ends[1] * share
        return np.where(inside[:, None], found, 0.0), np.where(inside, block, -1)


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """A measured trace: seconds (n,) from its first sample, force (n, 3) N on the tool, workpiece axes. notes : gaps."""

    seconds: Floats
    force: Floats
    notes: tuple[str, ...] = ()


class AxisDeviation(NamedTuple):
    """Of one component, N: root mean square of measured less predicted, in percent of the largest measured; means and peaks."""

    rms_n: float
    percent: float
    mean_n: float
    mean_measured_n: float
    peak_n: float
    peak_measured_n: float


@dataclass(frozen=True, slots=True, eq=False)
class Overlay:
    """An aligned trace.

    start_s : of the trace, in program time. turn : rotation of the first tooth there, turns. seconds : (n,) of the program.
    phi : (n,) turns. block : (n,), -1 in air. predicted, measured : (n, 3) N. correlation : of all components together.
    notes : what is wrong with the trace.
    """

    start_s: float
    turn: float
    seconds: Floats
    phi: Floats
    block: Ints
    predicted: Floats
    measured: Floats
    correlation: float
    notes: tuple[str, ...]

    @property
    def axes(self) -> dict[str, AxisDeviation]:
        """x, y, z."""
        found = {}
        for k, axis in enumerate("xyz"):
            p, m = self.predicted[:, k], self.measured[:, k]
            rms, top = float(np.sqrt(((m - p) ** 2).mean())), float(np.abs(m).max())
            percent = 100.0 * rms / top if top > 0.0 else float("nan")
            found[axis] = AxisDeviation(
                rms, percent, float(p.mean()), float(m.mean()), float(np.abs(p).max()), top
            )
        return found


def read_trace(
    path: Path | str, *, on: Literal["tool", "workpiece"] = "tool", rev_min: float | None = None
) -> Trace:
    """A CSV file with `time_s` or `phi_deg` (rising over the revolutions), and `fx_n, fy_n, fz_n` in workpiece axes.

    on : what the forces act on; a dynamometer under the workpiece says those on the workpiece. rev_min : for `phi_deg`.

    Raises InputError: No such file or column, another unit, no number, time that does not rise; names line and column.
    """
    found = read_columns(path, ("time_s|phi_deg", *FORCES), "force trace")
    first = found.values[:, 0]
    if found.names[0] == "phi_deg":
        if rev_min is None:
            raise InputError("phi_deg needs a spindle speed", file=str(path), remedy="give time_s")
        first = first / (6.0 * rev_min)
    step = np.diff(first)
    if len(first) < 3:
        raise InputError(
            f"{len(first)} samples are not a trace", file=str(path), remedy="give at least one revolution"
        )
    if (step <= 0.0).any():
        line = int(found.lines[1 + int(np.argmax(step <= 0.0))])
        raise InputError(f"{found.names[0]} does not rise", file=str(path), line=line, remedy="sort the rows")
    usual = float(np.median(step))
    gaps = np.flatnonzero(step > GAP * usual)
    notes: tuple[str, ...] = ()
    if len(gaps):
        k = int(gaps[np.argmax(step[gaps])])
        notes = (
            f"{len(gaps)} gaps; the largest, {step[k]:.4g} s where samples are {usual:.4g} s apart, before line "
            f"{found.lines[k + 1]}: compared is what there is",
        )
    return Trace(first - first[0], found.values[:, 1:] * (1.0 if on == "tool" else -1.0), notes)


def align(turns: Turns, trace: Trace) -> Overlay:
    """Search where in the program, and at which angle, a trace begins.

    Raises InputError: Fewer than two samples between teeth: nothing can be aligned; less than one revolution; no force.
    """
    second, per_tooth = _sampling(turns, trace)
    start, turn = _search(turns, trace, second, free=False)
    if _likeness(turns.at(trace.seconds + start, turn + trace.seconds / second)[0], trace.force) < ALIKE:
        start, turn = _search(turns, trace, second, free=True)  # the same forces in another unit
    predicted, block = turns.at(trace.seconds + start, turn + trace.seconds / second)
    phi = turn + trace.seconds / second
    alike = _likeness(predicted, trace.force)
    notes = [*trace.notes, *_doubts(turns, trace, predicted, block < 0, alike)]
    if per_tooth < FEW:
        notes.append(f"{per_tooth:.3g} samples from tooth to tooth: peaks between samples are not seen")
    return Overlay(
        start, turn, trace.seconds + start, phi, block, predicted, trace.force, alike, tuple(notes)
    )


def _likeness(predicted: Floats, measured: Floats) -> float:
    size = float(np.sqrt((predicted**2).sum() * (measured**2).sum()))
    return float((predicted * measured).sum()) / size if size > 0.0 else 0.0


def _miss(predicted: Floats, measured: Floats, *, free: bool) -> float:
    """Sum of squares of measured less predicted; `free`: less the predicted at the size that fits best."""
    if not free:
        return float(((predicted - measured) ** 2).sum())
    size = float((predicted**2).sum())
    both = max(0.0, float((predicted * measured).sum()))
    return float((measured**2).sum()) - (both**2 / size if size > 0.0 else 0.0)


def _search(turns: Turns, trace: Trace, second: float, *, free: bool) -> tuple[float, float]:
    """Program time, s, and rotation of the first tooth, turns, at the first sample."""
    seen = slice(None, None, max(1, len(trace.seconds) // MOST))
    time, force = trace.seconds[seen], trace.force[seen]

    def miss(offset: float, turn: float) -> float:
        return _miss(turns.at(time + offset, turn + time / second)[0], force, free=free)

    best = min(
        (miss(offset, turn), offset, turn)
        for offset in _offsets(turns, trace, second, free=free)
        for turn in np.arange(0.0, 1.0, 1.0 / 36.0)
    )
    from scipy.optimize import minimize  # slow to load

    found = minimize(
        lambda x: miss(best[1] + x[0] * second, best[2] + x[1] / 36.0), [0.0, 0.0], method="Nelder-Mead",
        options={"xatol": 1e-3, "fatol": 0.0, "maxiter": 120},
    )  # fmt: skip
    return float(best[1] + found.x[0] * second), float((best[2] + found.x[1] / 36.0) % 1.0)


def _sampling(turns: Turns, trace: Trace) -> tuple[float, float]:
    """Seconds of a revolution, and samples from tooth to tooth."""
    second = 60.0 / turns.rev_min
    if trace.seconds[-1] < 0.99 * second:
        raise InputError(
            f"a trace of {trace.seconds[-1]:.4g} s, where one revolution takes {second:.4g} s",
            remedy="give at least one revolution, in seconds",
        )
    if not trace.force.any():
        raise InputError("all forces of the trace are 0")
    per_tooth = second / turns.teeth / float(np.median(np.diff(trace.seconds)))
    if per_tooth < 2.0:
        raise InputError(
            f"{per_tooth:.3g} samples from tooth to tooth: expected 2 or more, and {FEW:g} to see peaks",
            remedy="is the time in seconds, and the spindle speed that of the program?",
        )
    return second, per_tooth


def _features(seconds: Floats, force: Floats, second: float) -> tuple[Floats, Floats]:
    """(r,) revolutions that have samples, counted from the first, and (r, 6) mean and spread of each component in them."""
    turn = (seconds / second + 1e-9).astype(np.int64)
    kept, index, count = np.unique(turn, return_inverse=True, return_counts=True)
    mean = np.column_stack([np.bincount(index, force[:, k]) / count for k in range(3)])
    square = np.column_stack([np.bincount(index, force[:, k] ** 2) / count for k in range(3)])
    return kept.astype(np.float64), np.hstack([mean, np.sqrt(np.maximum(square - mean**2, 0.0))])


def _offsets(turns: Turns, trace: Trace, second: float, *, free: bool) -> Floats:
    """(8,) or fewer, s: where the trace may begin, best first, one revolution apart at least."""
    kept, seen = _features(trace.seconds, trace.force, second)
    mean, spread = turns.force.mean(axis=1), turns.force.std(axis=1)
    even = Turns(turns.seconds, turns.block, np.stack([mean, mean], axis=1), turns.rev_min, turns.teeth)
    wide = Turns(turns.seconds, turns.block, np.stack([spread, spread], axis=1), turns.rev_min, turns.teeth)
    half = 0.5 * trace.seconds[-1]
    span = turns.seconds[-1] - turns.seconds[0]
    count = int(np.clip((span + 1e-12) / second, 1, 4000)) + 1
    begin = np.linspace(turns.seconds[0] - half, turns.seconds[-1] - half, count)
    middle = (kept + 0.5) * second
    score = np.empty(count)
    for k, offset in enumerate(begin):
        told = np.hstack([t.at(middle + offset, 0.0 * middle)[0] for t in (even, wide)])
        score[k] = _miss(told, seen, free=free)
    order = np.argsort(score)[:8]
    return np.asarray(begin[order])


def _doubts(turns: Turns, trace: Trace, predicted: Floats, air: Bools, alike: float) -> list[str]:
    """What an aligned trace shows."""
    notes = []
    outside = air & (
        np.linalg.norm(trace.force, axis=1) > 0.2 * float(np.linalg.norm(trace.force, axis=1).max())
    )
    if outside.mean() > 0.05:
        notes.append(
            f"{100.0 * outside.mean():.3g} % of the samples have forces where no block of the prediction cuts"
        )
    beat, teeth = _beat(trace), turns.teeth * turns.rev_min / 60.0
    if beat is not None and abs(beat / teeth - round(beat / teeth)) > 0.05 * max(beat / teeth, 1.0):
        run_out = turns.rev_min / 60.0
        if abs(beat / run_out - round(beat / run_out)) > 0.05 or beat < 0.95 * run_out:
            notes.append(
                f"the trace beats at {beat:.5g} Hz, teeth of the program pass at {teeth:.5g} Hz: "
                + "another spindle speed, or time not in s"
            )
    if alike < ALIKE:
        notes.append(
            f"correlation {alike:.2f} with the prediction: another program, other blocks, other axes, or forces on the "
            + "workpiece (--on workpiece)"
        )
    elif (below := float((predicted**2).sum())) > 0.0:
        ratio = float((predicted * trace.force).sum()) / below
        for size, unit in UNITS.items():
            if abs(ratio / size - 1.0) < 0.25 and not 0.5 < ratio < 2.0:
                notes.append(f"forces are {ratio:.3g} of the predicted ones: {unit} instead of N?")
    return notes


def _beat(trace: Trace) -> float | None:
    """Hz of the strongest oscillation; None where the trace has gaps or less than four periods of it."""
    step = np.diff(trace.seconds)
    if trace.notes or len(step) < 16:
        return None
    power = sum(np.abs(np.fft.rfft(f - f.mean())) ** 2 for f in trace.force.T)
    k = int(np.argmax(power))
    return float(k / (len(trace.seconds) * np.median(step))) if k >= 4 else None
