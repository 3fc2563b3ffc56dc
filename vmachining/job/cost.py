"""Which engine cuts a job, and what it will cost on the mesh engine: estimated before the first block, and refused where it
cannot be done, or where by the boxes of its sweeps nothing is cut.

A cutter of convex runs has about n = 2 a (m + 1) triangles: a facets around its circle, m along its meridian, each of
them no deeper than sag = chord / `FACET_SHARE`. Preparing one takes 0.2 ms and 2 kB for each triangle. A block then
takes, s of a processor (measured, see docs/measured/cost.md; right within a factor of about three):

    line             0.03 + 1e-5 n
    level arc        0.15 + 1.1e-3 k + 7e-7 k^2     k facets of its path
    other arc        k (0.005 + 1e-5 n)
    turning tool     0.04 mm / chord for every half radian

The kernel merges points nearer than about 1e-12 of the largest coordinate. A thousandth of the chord is allowed for
that, so the stock may reach 1e9 chords from the origin; beyond 1e11 brackets were seen that miss the truth.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from math import asin, ceil, pi, sqrt
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.mesh.facets import FACET_SHARE, MAX_STEP, MIN_STEPS
from vmachining.engines.relay import best_engine, handed_on
from vmachining.errors import JobError, StockError
from vmachining.geometry import Arc
from vmachining.job.contact import ToolParts
from vmachining.job.jobfile import Job
from vmachining.job.paths import CutterPath
from vmachining.job.reading import IDLE, refuse_unknown_tools
from vmachining.job.toolpath import Toolpath
from vmachining.nc import Motion
from vmachining.stock import Stock
from vmachining.sweep import Sweep, Turn
from vmachining.tool import Profile

MOST_FACETS = 300_000
"""Triangles of one cutter: about two minutes to prepare, and 1 GB with those of its other side."""

MOST_DAYS = 30.0
"""Of a processor. Not a week more or less: what is refused takes years."""

REACH_CHORDS = 1e9
"""Largest coordinate of the stock over the chord, see above."""

APART_SECONDS = 1.0
"""A program with a block this long is cut by a separate process, which can be ended within a block."""

APART_SAVES = 10.0
"""s between checkpoints of such a program: what is ended within a block loses little more than that block."""

SAMPLE = 2000
"""Motions that are examined; the others are assumed to be like them."""

DAY = 86400.0


class Cost(NamedTuple):
    """facets : {tool: triangles of its cutter, about}. seconds, longest_s : of a processor, all blocks and the longest one."""

    facets: dict[int, float]
    seconds: float
    longest_s: float


def _steps(radius: float, angle: float, sag: float) -> float:
    """Facets of an arc, as `arc_steps` of the engine makes them, also where 1 - sag / radius is 1."""
    if radius <= 0.0 or angle <= 0.0:
        return 1.0
    step = min(MAX_STEP, 4.0 * asin(min(1.0, sqrt(sag / (2.0 * radius)))))  # sag = R (1 - cos(step / 2))
    return max(MIN_STEPS, ceil(angle / step - 1e-9)) if angle / step < 2.0**52 else angle / step


def cutter_facets(profile: Profile, chord: float) -> float:
    """Triangles of a cutter whose circles and meridian have facets of at most chord / `FACET_SHARE`."""
    sag = chord / FACET_SHARE
    total = 0.0
    for run in profile.convex_pieces():
        around = 2 * _steps(run.max_radius, pi, sag)
        along = 0.0
        for k, radius in enumerate(run.radii):
            a, b = run.points[k] - run.centers[k], run.points[k + 1] - run.centers[k]
            turn = float(np.arccos(np.clip(a @ b / radius**2, -1.0, 1.0))) if radius > 0.0 else 0.0
            along += _steps(float(radius), turn, sag)  # 1 of a straight one
        total += 2 * around * (along + 1)
    return total


def feed_motions(
    toolpath: Toolpath, tools: Mapping[int, ToolParts]
) -> tuple[list[tuple[int, CutterPath]], float]:
    """(tool and path of some feed motions, spread over the program; how many each of them represents)."""
    moves = [(m.tool, k) for k, m in enumerate(toolpath.moves) if m.motion not in IDLE and m.tool in tools]
    chosen = [(tool, toolpath.paths[k]) for tool, k in moves[:: max(1, len(moves) // SAMPLE)]]
    return chosen, len(moves) / max(1, len(chosen))


def estimate(
    toolpath: Toolpath,
    tools: Mapping[int, ToolParts],
    chord: float,
    only: Callable[[Sweep], bool] | None = None,
) -> Cost:
    """The cost of the feed motions of a program; `only`: of those of whose sweep it says so."""
    facets = {number: cutter_facets(parts.cutter, chord) for number, parts in tools.items()}
    chosen, each = feed_motions(toolpath, tools)
    seconds = [
        _seconds(path, tools[tool].cutter, facets[tool], chord)
        for tool, path in chosen
        if only is None or only(Sweep.along(tools[tool].cutter, path))
    ]
    return Cost(facets, each * sum(seconds), max(seconds, default=0.0))


def _seconds(path: object, cutter: Profile, facets: float, chord: float) -> float:
    line = 0.03 + 1e-5 * facets
    if isinstance(path, Turn) and not (path.is_steady and path.is_straight):
        return line + 0.04 / chord * max(1.0, 2.0 * path.rotation)
    if not isinstance(path, Arc):
        return line
    k = _steps(path.radius + cutter.max_radius, abs(path.angle), chord / FACET_SHARE)
    is_level = path.axis == 2 and path.rise == 0.0
    return 0.15 + 1.1e-3 * k + 7e-7 * k**2 if is_level else line + k * (0.005 + 1e-5 * facets)


def refuse_fine(job: Job, tools: Mapping[int, ToolParts], chord: float) -> None:
    """What the job file alone tells: facets of tools and of a round bar, and how far a box or bar reaches.

    Raises JobError: The chord asks for more than can be made; says the number, and a chord that can.
    """
    limits = [
        _facets_at_most(f"tool {n}", partial(cutter_facets, parts.cutter)) for n, parts in tools.items()
    ]
    keys, scale = job.keys.stock, job.scale
    if (bar := keys.cylinder) is not None:
        radius = scale * bar.radius
        limits.append(_facets_at_most("the round stock", lambda at: 8 * _steps(radius, pi, at / FACET_SHARE)))
        far = max(abs(v) + bar.radius for v in bar.center)
        limits.append(_limit_of_reach(scale * max(far, *map(abs, bar.z))))
    if keys.box is not None:
        limits.append(_limit_of_reach(scale * max(map(abs, (*keys.box.min, *keys.box.max)))))
    _refuse(job, chord, limits)


def refuse_costly(
    job: Job, toolpath: Toolpath, tools: Mapping[int, ToolParts], bounds: Floats, chord: float, *,
    only: Callable[[Sweep], bool] | None = None,
) -> Cost:  # fmt: skip
    """The cost of a job that can be done.

    bounds : (2, 3) mm, box of the stock. only : see `estimate`.

    Raises JobError: It would take longer than `MOST_DAYS`, or coordinates of the stock have too few digits for the
        chord; says the number, and a chord with which it can be done.
    """
    cost = estimate(toolpath, tools, chord, only)

    def days(at: float) -> str | None:
        long = (cost if at == chord else estimate(toolpath, tools, at, only)).seconds / DAY
        return f"the program would take about {long:,.0f} days" if long > MOST_DAYS else None

    _refuse(job, chord, [_limit_of_reach(float(np.abs(bounds).max())), days])
    return cost


Limit = Callable[[float], str | None]
"""What is wrong with a chord, None if nothing is."""


def _facets_at_most(name: str, count: Callable[[float], float]) -> Limit:
    def limit(chord: float) -> str | None:
        if (found := count(chord)) <= MOST_FACETS:
            return None
        shown = f"{found:,.0f}" if found < 1e12 else f"{found:.3g}"
        return f"{name} would have {shown} facets, more than {MOST_FACETS:,}"

    return limit


def _limit_of_reach(reach: float) -> Limit:
    text = f"the stock reaches {reach:g} mm from the origin, where the kernel knows points to {1e-12 * reach:.1g} mm"
    return lambda chord: text if reach > REACH_CHORDS * chord else None


def _refuse(job: Job, chord: float, limits: Sequence[Limit]) -> None:
    """JobError with all that is wrong, and the first of 1, 2, 5, 10, ... times a power of ten mm that is not."""
    if not (found := [text for limit in limits if (text := limit(chord)) is not None]):
        return
    exponent = max(int(np.floor(np.log10(chord))), -15)
    larger = (float(f"{digit}e{power}") for power in range(exponent, exponent + 20) for digit in (1, 2, 5))
    enough = (v for v in larger if v > chord and all(limit(v) is None for limit in limits))
    feasible = next(enough, None)
    remedy = "make the program shorter" if feasible is None else f"take chord_mm = {feasible:g} or more"
    what = f"chord_mm = {chord:g} cannot be done: {'; '.join(found)}"
    raise JobError(what, **job.where("accuracy", "chord_mm"), remedy=remedy)


SHARES = 4
"""Shares of the workpiece that columns cut where processes pay (`Entry.divided_from`), however many processes
there are, so that numbers do not depend on how many: one needs 8 to 15 % more time for them than for an undivided workpiece."""


class Choice(NamedTuple):
    """engine : its name. longest_s : s of the longest block of the mesh engine. alone : columns take every motion."""

    engine: str
    longest_s: float
    alone: bool


def affordable(
    job: Job,
    toolpath: Toolpath,
    tools: Mapping[int, ToolParts],
    stock: Stock,
    asked: str | None,
    chord: float,
) -> Choice:
    """The engine.

    asked : "columns" or "mesh"; None: what `engines.relay.best_engine` says.

    Raises JobError: What the mesh engine would have to cut cannot be done with this chord, see `refuse_costly`.
    """
    if asked == "mesh":
        return Choice(asked, refuse_costly(job, toolpath, tools, stock.bounds, chord).longest_s, False)
    hands_on = handed_on(stock)
    looked, _ = feed_motions(toolpath, tools)
    handed = [hands_on(Sweep.along(tools[tool].cutter, path)) for tool, path in looked]
    engine = best_engine(handed) if asked is None else asked
    if engine != "mesh" and not any(handed):
        return Choice(engine, 0.0, True)
    by_mesh = {tool: tools[tool] for (tool, _), hand in zip(looked, handed, strict=True) if hand}
    refuse_fine(job, tools if engine == "mesh" else by_mesh, chord)
    only = None if engine == "mesh" else hands_on
    return Choice(
        engine, refuse_costly(job, toolpath, tools, stock.bounds, chord, only=only).longest_s, False
    )


def refuse_no_cut(job: Job, toolpath: Toolpath, tools: Mapping[int, ToolParts], stock: Stock) -> None:
    """No simulation for a cut without a tool, or for a path that by its box alone misses the stock.

    Raises NCError, StockError: It is one of these.
    """
    refuse_unknown_tools(toolpath.program, tools)
    if not any(m.motion not in IDLE for m in toolpath.near(tools, stock.bounds)):
        raise never_reached(job, toolpath, tools, stock)


def never_reached(job: Job, toolpath: Toolpath, tools: Mapping[int, ToolParts], stock: Stock) -> StockError:
    lo, hi = stock.bounds.round(3).tolist()
    what = f"no feed move of {Path(toolpath.program.name).name} reaches the stock, which lies from {lo} to {hi} mm"
    remedy = "compare work offset, units and home of the program with the stock"
    rapid = next((m for m in toolpath.near(tools, stock.bounds) if m.motion is Motion.RAPID), None)
    if rapid is not None:
        what += f"; the rapid in line {rapid.line} goes into its box, but rapids cut nothing"
        remedy = f"program cuts with G1, G2 or G3, or {remedy}"
    return StockError(what, **job.where("stock"), remedy=remedy)
