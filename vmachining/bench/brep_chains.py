"""Random chains of blocks through the B-rep ladder: how often it agrees, and whether it is ever silently wrong.

Chains of 5 to 20 blocks, each on a plot of its own; a batch of them shares one long bar. Every value is held
against the bracket of the mesh engine (that is the gate) and against rays (that is the referee: independent of
both): sets of random vertical rays, exact intervals of stock and sweeps along each, and the spread of the sets
as error bar. A value outside of it is asked again with sixteen times the rays. The same blocks go through plain
successive booleans as a baseline.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.brep import Blank, check_blocks, isolated, solids, volume
from vmachining.engines.mesh import MeshEngine, box_stock
from vmachining.errors import EngineError, SweepError, VMachiningError
from vmachining.geometry import Arc, Bracket, Line
from vmachining.sweep import Motion, Pose, Sweep, Turn
from vmachining.tool import BallNose, BullNose, Cutter, FlatEnd, ProfileTool, Taper

__all__ = ["FAMILIES", "brep_chains", "families", "referee"]

PLOT, DEEP, CHORD = 60.0, 20.0, 0.02

FAMILIES = ("zigzag", "contour", "ramp", "helix", "bore", "smooth", "kinked")
"""helix: its axis beside the cutter, bore: in it. smooth, kinked: five axes."""

CURVED = ("helix", "bore", "smooth", "kinked")
"""Families whose rays take 20 to 500 us instead of one: fewer of them."""

SETS = 16
"""Sets of rays: their mean is t-distributed with 15 degrees of freedom."""

BAR = 7.0
"""Standard errors of that mean: one false alarm in 200,000 blocks that are right."""

ASKED_S, BASE_S = 120.0, 240.0
"""s per block of the ladder and per chain of the baseline."""


def tools(rng: np.random.Generator) -> tuple[str, Cutter]:
    """A random cutter of a random kind."""
    d = float(rng.uniform(5, 12))
    kind = str(rng.choice(["flat", "ball", "bull", "taper", "taper ball", "chamfer"]))
    length = 40.0
    made: dict[str, Cutter] = {
        "flat": FlatEnd(diameter=d, length=length),
        "ball": BallNose(diameter=d, length=length),
        "bull": BullNose(diameter=d, corner_radius=float(rng.uniform(0.1, 0.45)) * d, length=length),
        "taper": Taper(
            diameter=d / 2, corner_radius=0.1 * d, taper_deg=float(rng.uniform(3, 15)), length=length
        ),
        "taper ball": Taper(
            diameter=d / 2, corner_radius=d / 4, taper_deg=float(rng.uniform(3, 15)), length=length
        ),
        "chamfer": ProfileTool(points=[[0, 0], [d / 2, d / 2], [d / 2, length]]),
    }
    return kind, made[kind]


def families(family: str, rng: np.random.Generator, radius: float) -> list[Motion]:
    """A random chain of 5 to 20 blocks on a plot 0..60 x 0..60, top at z = 0."""
    count = int(rng.integers(5, 21))
    depth = float(rng.uniform(0.5, 4.0))
    if family in ("zigzag", "ramp"):
        return _zigzag(family == "ramp", rng, radius, count, depth)
    if family == "contour":
        return _contour(rng, radius, count, depth)
    if family in ("helix", "bore"):
        return _wound(family == "bore", rng, radius, count)
    return _turning(family == "kinked", rng, radius, count, depth)


def _zigzag(ramp: bool, rng: np.random.Generator, radius: float, count: int, depth: float) -> list[Motion]:
    out: list[Motion] = []
    step = float(rng.uniform(0.3, 1.4)) * radius
    sink = float(rng.uniform(0.05, 1.0)) if ramp else 0.0
    at = np.array([5.0, 10.0, 0.0 if ramp else -depth])
    for k in range(count):
        to = at.copy()
        if k % 2:
            to[1] = 10.0 + (at[1] - 10.0 + step) % 40.0
        else:
            to[0] = 60.0 - at[0] if k % 4 == 0 else 5.0
        to[2] = max(at[2] - sink * float(rng.uniform(0, 1)), -10.0)
        out.append(Line(at, to))
        at = to
    return out


def _contour(rng: np.random.Generator, radius: float, count: int, depth: float) -> list[Motion]:
    """Rings of a rectangle with rounded corners, from outside in."""
    out: list[Motion] = []
    corner, half = float(rng.uniform(0.2, 2.0)) * radius, 22.0
    while len(out) < count and half > corner + 2.0:
        out += _rounded(half, min(corner, half - 1.0), -depth, bool(rng.integers(2)))
        half -= float(rng.uniform(0.4, 1.2)) * radius
    return out[:count]


def _wound(inside: bool, rng: np.random.Generator, radius: float, count: int) -> list[Motion]:
    """Helices down, a circle at the bottom, and a way out."""
    out: list[Motion] = []
    rc = float(rng.uniform(*((0.3, 0.9) if inside else (1.15, 2.5)))) * radius
    angle = float(rng.choice([np.pi / 2, np.pi, 2 * np.pi])) * float(rng.choice([-1, 1]))
    at = np.array([30.0 + rc, 30.0, 0.5])
    for _ in range(min(count, 8)):
        arc = Arc(at, (30.0, 30.0, 0.0), angle=angle, rise=-float(rng.uniform(0.2, 1.0)))
        out.append(arc)
        at = np.array(arc.end)
    out.append(Arc(at, (30.0, 30.0, 0.0), angle=np.sign(angle) * 2 * np.pi))
    stops = [at, at + [radius, 0, 0], at + [radius, 8, 0], at + [0, 8, 1]]
    return [*out, *(Line(a, b) for a, b in pairwise(stops))]


def _turning(kinked: bool, rng: np.random.Generator, radius: float, count: int, depth: float) -> list[Motion]:
    """Passes side by side of blocks of 2 to 8 mm; the axis swings slowly, or takes a new aim at every block."""
    out: list[Motion] = []
    step, size = float(rng.uniform(0.3, 1.2)) * radius, float(rng.uniform(2.0, 8.0))
    row = int(rng.integers(3, 8))
    lean, swing = float(rng.uniform(0.0, 0.3)), float(rng.uniform(0.05, 0.4))
    phase = float(rng.uniform(0.0, 2 * np.pi))

    def pose(k: int) -> Pose:
        line, along = divmod(k, row)
        x = 15.0 + size * (along if line % 2 == 0 else row - 1 - along)
        tip = np.array([x, 15.0 + step * line, -depth + 0.3 * np.sin(0.4 * x + phase)])
        if kinked:
            tip[2] += float(rng.uniform(-0.3, 0.3))
            tip[1] += float(rng.uniform(-0.2, 0.2)) * radius
            tilt, toward = float(rng.uniform(0.0, 0.35)), float(rng.uniform(0.0, 2 * np.pi))
        else:
            tilt, toward = lean + 0.2 * swing * np.sin(0.08 * x + phase), phase + swing * np.cos(0.06 * x)
        axis = [np.sin(tilt) * np.cos(toward), np.sin(tilt) * np.sin(toward), np.cos(tilt)]
        return Pose(tip, axis)

    here = pose(0)
    for k in range(1, count + 1):
        there = pose(k)
        out.append(Turn.great_circle(here, there))
        here = there
    return out


def _rounded(half: float, corner: float, z: float, reverse: bool) -> list[Motion]:
    """Rectangle with rounded corners around the middle of the plot."""
    c = 30.0
    flat = half - corner
    out: list[Line | Arc] = []
    for k in range(4):
        turn = np.pi / 2 * k
        spin = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        a, b, m = (
            np.append(spin @ p + c, z) for p in ([half, -flat], [half, flat], [flat, flat])
        )  # fmt: skip
        out += [Line(a, b), Arc(b, m, angle=np.pi / 2)]
    if not reverse:
        return list(out)
    return [
        Line(path.end, path.start)
        if isinstance(path, Line)
        else Arc(path.end, path.center, angle=-path.angle)
        for path in reversed(out)
    ]


class _Chain(NamedTuple):
    """One chain on its plot: the sweeps, their brackets, what rays and plain booleans find."""

    number: int
    family: str
    tool: str
    sweeps: list[Sweep]
    brackets: list[Bracket]


def brep_chains(
    chains: int = 200,
    seed: int = 1,
    workers: int = 2,
    only: Sequence[str] = FAMILIES,
    batch: int = 7,
    baseline: bool = True,
) -> Iterator[dict[str, Any]]:
    """Counts per family and in total after every batch of chains; failures with the seed of their chain."""
    counts: dict[str, Counter[str]] = {family: Counter() for family in only}
    rungs: Counter[str] = Counter()
    seconds: dict[str, list[float]] = {family: [] for family in only}
    for first in range(0, chains, batch):
        numbers = range(first, min(first + batch, chains))
        bar = _bar(numbers)
        engine = MeshEngine(box_stock(tuple(bar[0]), tuple(bar[1])), CHORD, certify=True)
        made = [_chain(seed, number, only[number % len(only)], engine) for number in numbers]
        yield from _held(made, bar, seed, workers, counts, rungs, seconds)
        if baseline:
            _base(made, bar, workers, counts)
        for family in only:
            spent = seconds[family]
            middle = round(float(np.median(spent)), 2) if spent else None
            yield {"case": "brep-chains", "family": family, **counts[family], "median_s": middle}
        total: Counter[str] = sum(counts.values(), Counter())
        good = total["agreed"] + total["retried"]
        yield {
            "case": "brep-chains", "chains": numbers[-1] + 1, **total,
            "agreed_or_retried": good / max(total["blocks"], 1), "rungs": dict(rungs),
        }  # fmt: skip


def _bar(numbers: range) -> tuple[Floats, Floats]:
    """Corners of the stock of some chains: plots with as much left between them."""
    low = np.array([2.0 * PLOT * numbers[0], 0.0, -DEEP])
    return low, np.array([2.0 * PLOT * numbers[-1] + PLOT, PLOT, 0.0])


def _chain(seed: int, number: int, family: str, engine: MeshEngine) -> _Chain:
    rng = np.random.default_rng([seed, number])
    kind, tool = tools(rng)
    at = np.array([2.0 * PLOT * number, 0.0, 0.0])
    paths = families(family, rng, tool.profile.radius_at(2.0).item())
    sweeps = [Sweep.along(tool, _shifted(path, at)) for path in paths]
    return _Chain(
        number, family, kind, sweeps, [engine.cut(sweep, block=k) for k, sweep in enumerate(sweeps)]
    )


def _held(
    made: Sequence[_Chain], bar: tuple[Floats, Floats], seed: int, workers: int, counts: dict[str, Counter[str]],
    rungs: Counter[str], seconds: dict[str, list[float]],
) -> Iterator[dict[str, Any]]:  # fmt: skip
    """Every block of some chains by the ladder, held against bracket and rays."""
    stock = Blank("box", tuple(bar[0].tolist()), tuple(bar[1].tolist()))
    where = [(chain, k) for chain in made for k in range(len(chain.sweeps))]
    blocks = [[chain.sweeps[k]] for chain, k in where]
    asked = {number: chain.brackets[k] for number, (chain, k) in enumerate(where)}
    for number, verdict in check_blocks(stock, blocks, asked, workers=workers, seconds=ASKED_S):
        chain, k = where[number]
        here = counts[chain.family]
        here["blocks"] += 1
        here[str(verdict.status)] += 1
        rungs[verdict.rung] += 1
        seconds[chain.family].append(verdict.seconds)
        about = {
            "case": "brep-chains", "seed": [seed, chain.number], "family": chain.family,
            "tool": chain.tool, "block": k, "bracket": list(chain.brackets[k]),
        }  # fmt: skip
        value = verdict.removed_mm3
        if value is None:
            yield about | {"refused": verdict.reason, "tried": verdict.tried, "seconds": verdict.seconds}
            continue
        count = 16 if chain.family in CURVED else 48
        rays = referee(chain.sweeps, k, bar, count)
        if abs(value - rays[0]) > rays[1]:
            here["asked again"] += 1
            rays = referee(chain.sweeps, k, bar, 4 * count)
        in_bracket = chain.brackets[k].holds(value, verdict.slack_mm3)
        if abs(value - rays[0]) > rays[1] or not in_bracket:
            here["silently wrong"] += 1
            yield about | {"wrong": value, "rays": rays[0], "bar": rays[1], "rung": verdict.rung}


def _base(
    made: Sequence[_Chain], bar: tuple[Floats, Floats], workers: int, counts: dict[str, Counter[str]]
) -> None:
    """The same blocks by plain successive booleans."""

    def one(chain: _Chain) -> list[tuple[float, bool] | None]:
        try:
            return isolated(_successive, bar, chain.sweeps, BASE_S, seconds=1.5 * BASE_S)
        except (EngineError, SweepError):
            return [None] * len(chain.sweeps)

    with ThreadPoolExecutor(max_workers=workers) as pool:
        for chain, found in zip(made, pool.map(one, made), strict=True):
            here = counts[chain.family]
            for plain, bracket in zip(found, chain.brackets, strict=True):
                if plain is None:
                    here["baseline failed"] += 1
                elif not bracket.holds(plain[0], 1e-6 * (1.0 + abs(plain[0]))):
                    here["baseline silently wrong" if plain[1] else "baseline wrong, not valid"] += 1
                else:
                    here["baseline right"] += 1


def _shifted(path: Motion, move: Floats) -> Motion:
    if isinstance(path, Line):
        return Line(path.start + move, path.end + move)
    if isinstance(path, Arc):
        return Arc(path.start + move, path.center + move, path.axis, angle=path.angle, rise=path.rise)
    return Turn.great_circle(Pose(path.start + move, path.axis(0.0)), Pose(path.end + move, path.axis(1.0)))


def referee(
    sweeps: Sequence[Sweep], block: int, stock: tuple[Floats, Floats], count: int
) -> tuple[float, float]:
    """Removed volume of a block by vertical rays, and its error bar, mm^3.

    stock : corners of the box. count : rays along a side of one of `SETS` sets, one at a random place per cell.

    Notes
    -----
    The bar is `BAR` standard errors, and what lies between the rays: a cell 0.5 mm deep.
    """
    rng = np.random.default_rng([block, count])
    low, high = np.maximum(sweeps[block].bounds[0], stock[0]), np.minimum(sweeps[block].bounds[1], stock[1])
    if (low >= high).any():
        return 0.0, 0.0
    corner = np.stack(np.meshgrid(np.arange(count), np.arange(count), indexing="ij"), axis=-1).reshape(-1, 2)
    cell = (high - low)[:2] / count
    near = [s for s in sweeps[:block] if (s.bounds[0] < high).all() and (s.bounds[1] > low).all()]
    found = np.empty(SETS)
    for k in range(SETS):
        places = low[:2] + (corner + rng.random(corner.shape)) * cell
        found[k] = _left(sweeps[block], near, places, float(stock[0][2]), float(stock[1][2])) * cell.prod()
    error = float(found.std(ddof=1)) / np.sqrt(SETS)
    return float(found.mean()), BAR * error + 0.5 * float(cell.prod()) / SETS + 1e-6 * float(found.mean())


def _left(sweep: Sweep, earlier: Sequence[Sweep], places: Floats, bottom: float, top: float) -> float:
    """mm of upright rays at (n, 2) places in the sweep and the stock, and in no earlier sweep."""
    rays, stops, own, others = [], [], [], []
    who = np.arange(len(places))
    for number, body in enumerate((sweep, *earlier)):
        origins = np.column_stack([places[who], np.zeros(len(who))])
        inside = body.ray_intervals(origins, (0.0, 0.0, 1.0))
        ray = np.repeat(who, inside.counts)
        lo, hi = np.clip(inside.enter, bottom, top), np.clip(inside.leave, bottom, top)
        step = np.repeat([1, -1], len(ray))
        rays.append(np.tile(ray, 2))
        stops.append(np.concatenate([lo, hi]))
        own.append(step if number == 0 else 0 * step)
        others.append(0 * step if number == 0 else step)
        if number == 0:
            who = np.unique(ray[hi > lo])
    ray, stop, a, b = (np.concatenate(column) for column in (rays, stops, own, others))
    order = np.lexsort([stop, ray])
    ray, stop, a, b = ray[order], stop[order], np.cumsum(a[order]), np.cumsum(b[order])
    same = ray[1:] == ray[:-1]
    return float((np.diff(stop) * (same & (a[:-1] > 0) & (b[:-1] == 0))).sum())


def _successive(
    stock: tuple[Floats, Floats], sweeps: Sequence[Sweep], seconds: float
) -> list[tuple[float, bool] | None]:
    """(removed volume, whether OCCT calls what is left valid) by cutting one solid, as a plain script would.

    None: a sweep without solid, no answer, or none any more after `seconds`.
    """
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepCheck import BRepCheck_Analyzer

    begin = perf_counter()
    current = Blank("box", tuple(stock[0].tolist()), tuple(stock[1].tolist())).shape()
    before = volume(current)
    out: list[tuple[float, bool] | None] = []
    for sweep in sweeps:
        if perf_counter() - begin > seconds:
            out.append(None)
            continue
        try:
            for part in solids(sweep):
                current = BRepAlgoAPI_Cut(current, part.shape).Shape()
            after = volume(current)
        except VMachiningError:
            out.append(None)
            continue
        out.append((before - after, bool(BRepCheck_Analyzer(current).IsValid())))
        before = after
    return out
