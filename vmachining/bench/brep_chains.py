"""Random chains of blocks through the B-rep ladder: how often it agrees, and whether it is ever silently wrong.

Every chain cuts its own plot of one long bar, so that one program holds them all. Each value is held against
the bracket of the mesh engine (that is the gate) and against a height map made of exact ray intervals (that is
the referee: independent of both). The same blocks go through plain successive booleans as a baseline.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.brep import Blank, check_blocks, solids, volume
from vmachining.engines.mesh import MeshEngine, box_stock
from vmachining.errors import VMachiningError
from vmachining.geometry import Arc, Bracket, Line, Path
from vmachining.sweep import Sweep
from vmachining.tool import BallNose, BullNose, Cutter, FlatEnd, ProfileTool, Taper

__all__ = ["brep_chains", "families"]

PLOT, DEEP, CHORD = 60.0, 20.0, 0.02
GRID = {"helix": 32, "bore": 32}
COMMON_GRID = 120
"""Rays along one side of a plot, one at a random place of each cell (walls lie along the cells), twice: the
difference tells the error. A ray through a helix costs half a millisecond, one through a line a microsecond."""

FAMILIES = ("zigzag", "contour", "ramp", "helix", "bore")


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


def families(family: str, rng: np.random.Generator, radius: float) -> list[Path]:
    """A random chain of 5 to 20 blocks on a plot 0..60 x 0..60, top at z = 0."""
    out: list[Path] = []
    count = int(rng.integers(5, 21))
    depth = float(rng.uniform(0.5, 4.0))
    if family in ("zigzag", "ramp"):
        step = float(rng.uniform(0.3, 1.4)) * radius
        sink = 0.0 if family == "zigzag" else float(rng.uniform(0.05, 1.0))
        at = np.array([5.0, 10.0, -depth if sink == 0.0 else 0.0])
        for k in range(count):
            to = at.copy()
            if k % 2:
                to[1] = 10.0 + (at[1] - 10.0 + step) % 40.0
            else:
                to[0] = 60.0 - at[0] if k % 4 == 0 else 5.0
            to[2] = max(at[2] - sink * float(rng.uniform(0, 1)), -10.0)
            out.append(Line(at, to))
            at = to
    elif family == "contour":
        corner = float(rng.uniform(0.2, 2.0)) * radius
        half = 22.0
        while len(out) < count and half > corner + 2.0:
            out += _rounded(half, min(corner, half - 1.0), -depth, bool(rng.integers(2)))
            half -= float(rng.uniform(0.4, 1.2)) * radius
        out = out[:count]
    else:
        share = (1.15, 2.5) if family == "helix" else (0.3, 0.9)
        rc = float(rng.uniform(*share)) * radius
        angle = float(rng.choice([np.pi / 2, np.pi, 2 * np.pi])) * float(rng.choice([-1, 1]))
        at = np.array([30.0 + rc, 30.0, 0.5])
        for _ in range(min(count, 8)):
            arc = Arc(at, (30.0, 30.0, 0.0), angle=angle, rise=-float(rng.uniform(0.2, 1.0)))
            out.append(arc)
            at = np.array(arc.end)
        out.append(Arc(at, (30.0, 30.0, 0.0), angle=np.sign(angle) * 2 * np.pi))
        out += [
            Line(a, b) for a, b in pairwise([at, at + [radius, 0, 0], at + [radius, 8, 0], at + [0, 8, 1]])
        ]
    return out


def _rounded(half: float, corner: float, z: float, reverse: bool) -> list[Path]:
    """Rectangle with rounded corners around the middle of the plot."""
    c = 30.0
    flat = half - corner
    out: list[Path] = []
    for k in range(4):
        turn = np.pi / 2 * k
        spin = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        a, b, m = (
            np.append(spin @ p + c, z) for p in ([half, -flat], [half, flat], [flat, flat])
        )  # fmt: skip
        out += [Line(a, b), Arc(b, m, angle=np.pi / 2)]
    if not reverse:
        return out
    return [
        Line(path.end, path.start)
        if isinstance(path, Line)
        else Arc(path.end, path.center, angle=-path.angle)
        for path in reversed(out)
    ]


def brep_chains(chains: int = 200, seed: int = 1, workers: int = 2) -> Iterator[dict[str, Any]]:
    """Counts per family, then the totals; failures with the seed of their chain."""
    lo, hi = np.array([0.0, 0.0, -DEEP]), np.array([PLOT * chains, PLOT, 0.0])
    engine = MeshEngine(box_stock(tuple(lo), tuple(hi)), CHORD)
    sweeps: list[Sweep] = []
    owner: list[tuple[int, str, str]] = []
    for chain in range(chains):
        rng = np.random.default_rng([seed, chain])
        kind, tool = tools(rng)
        family = FAMILIES[chain % len(FAMILIES)]
        for path in families(family, rng, tool.profile.radius_at(2.0).item()):
            sweeps.append(Sweep.along(tool, _shifted(path, PLOT * chain)))
            owner.append((chain, family, kind))
    brackets = [engine.cut(sweep, block=k) for k, sweep in enumerate(sweeps)]
    referee = [_Map(chain, FAMILIES[chain % len(FAMILIES)]) for chain in range(chains)]
    rays = [referee[chain].cut(sweep) for sweep, (chain, _, _) in zip(sweeps, owner, strict=True)]
    baseline = _successive(sweeps, [chain for chain, _, _ in owner])
    counts: dict[str, Counter[str]] = {family: Counter() for family in FAMILIES}
    rungs: Counter[str] = Counter()
    stock = Blank("box", tuple(lo.tolist()), tuple(hi.tolist()))
    asked = dict(enumerate(brackets))
    for k, verdict in check_blocks(stock, [[s] for s in sweeps], asked, workers=workers, seconds=90.0):
        chain, family, kind = owner[k]
        here = counts[family]
        here["blocks"] += 1
        here[str(verdict.status)] += 1
        rungs[verdict.rung] += 1
        value = verdict.removed_mm3
        if value is not None and abs(value - rays[k][0]) > rays[k][1]:
            here["silently wrong"] += 1
            yield {"case": "brep-chains", "wrong": k, "seed": [seed, chain], "brep": value, "rays": rays[k]}
        if value is None:
            yield {
                "case": "brep-chains", "refused": k, "seed": [seed, chain], "family": family, "tool": kind,
                "reason": verdict.reason, "tried": verdict.tried, "bracket": brackets[k],
            }  # fmt: skip
        plain = baseline[k]
        here["baseline wrong"] += not _holds(brackets[k], plain)
        here["baseline silently wrong"] += plain is not None and not _holds(brackets[k], plain)
    for family in FAMILIES:
        yield {"case": "brep-chains", "family": family, **counts[family]}
    total: Counter[str] = sum(counts.values(), Counter())
    good = total["agreed"] + total["retried"]
    yield {
        "case": "brep-chains", "chains": chains, **total, "agreed_or_retried": good / max(total["blocks"], 1),
        "rungs": dict(rungs),
    }  # fmt: skip


def _holds(bracket: Bracket, value: float | None) -> bool:
    return value is not None and bracket.holds(value, 1e-6 * (1.0 + abs(value)))


def _shifted(path: Path, x: float) -> Path:
    move = np.array([x, 0.0, 0.0])
    if isinstance(path, Line):
        return Line(path.start + move, path.end + move)
    assert isinstance(path, Arc)
    return Arc(path.start + move, path.center + move, path.axis, angle=path.angle, rise=path.rise)


class _Map:
    """Height of the stock over two grids of vertical rays: every sweep here reaches above the stock."""

    def __init__(self, chain: int, family: str) -> None:
        count = GRID.get(family, COMMON_GRID)
        cell = PLOT / count
        rng = np.random.default_rng(chain)
        corner = np.stack(np.meshgrid(np.arange(count), np.arange(count), indexing="ij"), axis=-1)
        grids = [
            (corner.reshape(-1, 2) + rng.random((count * count, 2))) * cell + [PLOT * chain, 0.0]
            for _ in range(2)
        ]
        self._places, self._cell = grids, cell * cell
        self._top: list[Floats] = [np.zeros(count * count) for _ in grids]

    def cut(self, sweep: Sweep) -> tuple[float, float]:
        """(removed mm^3, its error bar): the mean of both grids; five times their difference, 1 % and a floor.

        The floor is a cell seen wrongly 1 mm deep, and an edge of 10 mm by 0.01 mm^2.
        """
        found = []
        lo, hi = sweep.bounds
        for places, top in zip(self._places, self._top, strict=True):
            near = np.flatnonzero(((places >= lo[:2]) & (places <= hi[:2])).all(axis=1))
            origins = np.column_stack([places[near], np.zeros(len(near))])
            intervals = sweep.ray_intervals(origins, (0.0, 0.0, 1.0))
            first = np.cumsum(intervals.counts) - intervals.counts
            hit = intervals.counts > 0
            low = np.full(len(near), np.inf)
            low[hit] = intervals.enter[first[hit]]
            new = np.maximum(np.minimum(top[near], low), -DEEP)
            found.append(float((top[near] - new).sum()) * self._cell)
            top[near] = new
        value = 0.5 * sum(found)
        return value, 5.0 * abs(found[0] - found[1]) + 0.01 * value + self._cell + 0.1


def _successive(sweeps: list[Sweep], chain: list[int]) -> list[float | None]:
    """Removed volumes by cutting one solid block by block, as a plain script would."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut

    out: list[float | None] = []
    current, before, last = None, 0.0, -1
    for sweep, number in zip(sweeps, chain, strict=True):
        if number != last:
            x = PLOT * number
            current = Blank("box", (x, 0.0, -DEEP), (x + PLOT, PLOT, 0.0)).shape()
            before, last = volume(current), number
        try:
            for part in solids(sweep):
                current = BRepAlgoAPI_Cut(current, part.shape).Shape()
            after = volume(current)
        except VMachiningError:
            out.append(None)
            continue
        out.append(before - after)
        before = after
    return out
