"""Random programs of three-axis blocks by family and seed, as plain numbers and as what the engine is given."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

import vmachining as vm
from benchmarks.columns_counts.stocks import drawn_stock
from vmachining.arrays import Floats
from vmachining.engines.columns import FlatStock
from vmachining.geometry import Arc, Line
from vmachining.sweep import Sweep

__all__ = ["CUTTERS", "FAMILIES", "Program", "drawn"]

FAMILIES = (
    "anywhere", "finishing", "plunges", "retraces", "tiny", "far", "half outside", "steep", "two cutters",
    "round stock", "level arcs", "helices", "arcs of all planes", "prism", "steps", "facets",
)  # fmt: skip
CUTTERS = ("ball", "flat", "bull", "cone", "tapered ball", "rounded cone", "drill")

BLOCKS = {"arcs of all planes": 6, "helices": 6, "level arcs": 6, "finishing": 20}
"""Of a program; others have 10."""

FAR_MM = 1e4
LONG_MM = 60.0
"""Of cutters: their tops never dip below the top of the stock."""


class Program(NamedTuple):
    """cutters, moves, box : see `_kernels.py`. low, high : of the stock. top : its height over places (n, 2), the bottom
    where it is not. sweeps, stock : for the engine."""

    family: str
    cutter: str
    cutters: Floats
    moves: Floats
    box: Floats
    low: Floats
    high: Floats
    top: Callable[[Floats], Floats]
    sweeps: list[Sweep]
    stock: FlatStock


def _cutter(rng: np.random.Generator, kind: str) -> tuple[list[float], vm.Tool]:
    """Numbers of `_kernels.py` and the tool."""
    R = float(rng.choice([1.0, 3.0, 5.0, rng.uniform(0.5, 6.0)]))
    share = rng.uniform(0.1, 0.9)
    if kind == "ball":
        return [0.0, 0.0, 0.0, R, R, R, R, 0.0, R], vm.BallNose(diameter=2 * R, length=LONG_MM)
    if kind == "flat":
        return [0.0, R, R, 0.0, 0.0, R, 0.0, 0.0, R], vm.FlatEnd(diameter=2 * R, length=LONG_MM)
    if kind == "bull":
        c = share * R
        numbers = [0.0, R - c, R - c, c, c, R, c, 0.0, R]
        return numbers, vm.BullNose(diameter=2 * R, corner_radius=c, length=LONG_MM)
    # a cutter of APT: bottom line, corner circle that touches it, flank that touches the circle
    alpha, beta, e, c = 0.0, np.radians(rng.uniform(5.0, 60.0)), share * R, rng.uniform(0.1, 1.0) * R
    if kind == "cone":
        c = 0.0
    elif kind == "tapered ball":
        e = 0.0
    elif kind == "drill":
        alpha, beta, c = np.radians(rng.uniform(10.0, 50.0)), 0.0, 0.0
    else:
        alpha, beta = np.radians(rng.uniform(2.0, 20.0)), np.radians(rng.uniform(5.0, 50.0))
    r0, r1 = e + c * np.sin(alpha), e + c * np.cos(beta)
    f = r0 * np.tan(alpha) + c * np.cos(alpha)
    z1 = f - c * np.sin(beta)
    h = z1 + rng.uniform(1.0, 6.0)
    widest = r1 + (h - z1) * np.tan(beta)
    d = 2.0 * (r1 - z1 * np.tan(beta)) / (1.0 - np.tan(alpha) * np.tan(beta))
    tool = vm.AptTool(
        d=float(d), r=float(c), e=float(e), f=float(f), alpha_deg=float(np.degrees(alpha)),
        beta_deg=float(np.degrees(beta)), h=float(h), length=LONG_MM,
    )  # fmt: skip
    rising = 1.0 / np.tan(beta) if beta else 0.0
    return [np.tan(alpha), r0, e, f, c, r1, z1, rising, widest], tool


def _lines(rng: np.random.Generator, family: str, low: Floats, high: Floats) -> list[Floats]:
    """Rows (start, end) of straight blocks."""
    way: list[Floats] = []
    inner = np.array([*low[:2], low[2] + 1.0]), np.array([*high[:2], high[2] - 0.5])
    if family == "half outside":
        inner = low - [4.0, 4.0, 2.0], high + [4.0, 4.0, 0.0]
    here = rng.uniform(*inner)
    step, rise = rng.choice([0.2, 0.5, 1.0]), rng.uniform(0.0, 0.3)
    for k in range(BLOCKS.get(family, 10)):
        kind = rng.random()
        there = rng.uniform(*inner)
        if family == "finishing":  # rows that share their side lines
            there = here + ([0.0, step, 0.0] if k % 7 == 6 else [1.0 if k // 7 % 2 == 0 else -1.0, 0.0, 0.0])
            there[2] = -1.0 + rise * np.sin(there[0]) + rise * np.cos(there[1])
            if k == 0:
                here = np.array([*rng.uniform(low[:2], high[:2] - 4.0), -1.0])
                there = here + [1.0, 0.0, 0.0]
        elif family == "plunges" and kind < 0.7:
            there = here + [0.0, 0.0, rng.uniform(-4.0, 2.0)]
            if kind < 0.3:
                there = here + rng.choice([0.0, 0.5, 1.0], 3) * [1.0, 1.0, -2.0]
        elif family == "steep" and kind < 0.7:
            there = here + rng.choice([1e-9, 1e-5, 1e-3, 0.1, 1.0]) * rng.normal(size=3)
            there[2] = here[2] + rng.uniform(-4.0, 2.0)
        elif family == "tiny" and kind < 0.8 and way:
            there = here + rng.normal(size=3) * rng.choice([0.1, 1e-2, 1e-4])
        elif family == "retraces" and way:
            a, b = way[-1][:3], way[-1][3:]
            if kind < 0.3:
                there = a.copy()
            elif kind < 0.5:
                there = here + (a - here) * rng.choice([0.25, 0.5])
            elif kind < 0.7:
                there = here + [0.0, rng.choice([-0.3, 0.3]), 0.0]
            elif kind < 0.85:
                there = here + (b - a) * rng.choice([0.5, 1.0])
        elif kind < 0.12 and way:
            there = way[-1][:3].copy()
        elif kind < 0.25:
            there = here + [0.0, 0.0, rng.uniform(-4.0, 2.0)]
        elif kind < 0.4:
            there = here + [rng.choice([-3.0, -1.0, -0.5, 0.5, 1.0, 3.0]), 0.0, 0.0]
        there = np.array(there)
        there[2] = np.clip(there[2], low[2] - 2.0, high[2] + 1.0)
        way.append(np.concatenate([here, there]))
        here = there
    return way


def _arcs(rng: np.random.Generator, family: str, low: Floats, high: Floats) -> list[Arc]:
    """Arcs and helices of small and large radius, up to a turn, some of them run back."""
    way: list[Arc] = []
    for k in range(BLOCKS[family]):
        if way and rng.random() < 0.15:
            last = way[-1]
            way.append(Arc(last.end, last.center, last.axis, angle=-last.angle, rise=-last.rise))
            continue
        start = rng.uniform([*low[:2], low[2] + 1.0], [*high[:2], high[2] - 0.5])
        axis = 2 if family != "arcs of all planes" else int(k % 2)
        r, a = rng.choice([0.3, 2.0, 5.0, 14.0, 80.0]), rng.uniform(0.0, 2 * np.pi)
        angle = rng.choice([-1.0, 1.0]) * rng.uniform(0.05, 1.0) * min(2 * np.pi, 40.0 / r)
        rise = 0.0 if family == "level arcs" else rng.choice([rng.uniform(-3.0, 3.0), rng.uniform(-0.3, 0.3)])
        aside = np.zeros(3)
        aside[(axis + 1) % 3], aside[(axis + 2) % 3] = r * np.cos(a), r * np.sin(a)
        way.append(Arc(start, start + aside, axis, angle=angle, rise=rise))
    return way


def drawn(seed: int) -> Program:
    """The program of a seed: family seed mod 16, cutter seed // 16 mod 7."""
    rng = np.random.default_rng([seed, 34])
    family = FAMILIES[seed % len(FAMILIES)]
    first = seed // len(FAMILIES) % len(CUTTERS)
    kinds = [first] if family != "two cutters" else [first, int(rng.integers(len(CUTTERS)))]
    made = [_cutter(rng, CUTTERS[k]) for k in kinds]
    low, high = np.array([-6.0, -5.0, -10.0]), np.array([7.0, 6.0, 0.0])
    at = np.array([FAR_MM, -FAR_MM, 0.0]) if family == "far" else np.zeros(3)
    curved = family in ("level arcs", "helices", "arcs of all planes")
    paths: list[Line | Arc] = []
    rows = []
    for way in _arcs(rng, family, low, high) if curved else _lines(rng, family, low, high):
        which = float(rng.integers(len(made)))
        if isinstance(way, Arc):
            rows.append([way.axis, *way.start, *way.center, way.angle, way.rise, which])
            paths.append(way)
        else:
            rows.append([-1.0, *way, 0.0, 0.0, which])
            paths.append(Line(way[:3] + at, way[3:] + at))
    moves, cutters = np.array(rows), np.array([numbers for numbers, _ in made])
    sweeps = [Sweep.along(made[int(row[9])][1], path) for row, path in zip(rows, paths, strict=True)]
    stock, top, low, high = drawn_stock(rng, family, low, high, at)
    box = _boxes(moves, cutters)
    name = "+".join(CUTTERS[k] for k in kinds)
    return Program(family, name, cutters, moves, box, low, high, top, sweeps, stock)


def _boxes(moves: Floats, cutters: Floats) -> Floats:
    """(n, 4): what a move reaches in plan at most: a line by its ends, an arc by all of its circle and its rise."""
    out = np.zeros((len(moves), 4))
    for row, box in zip(moves, out, strict=True):
        points = np.stack([row[1:4], row[4:7]])
        if row[0] >= 0.0:
            r, axis = float(np.linalg.norm(row[1:4] - row[4:7])), int(row[0])
            points = np.stack([row[4:7] - r, row[4:7] + r])
            points[:, axis] = row[1 + axis], row[1 + axis] + row[8]
        R = cutters[int(row[9]), 8]
        box[:2], box[2:] = points.min(axis=0)[:2] - R, points.max(axis=0)[:2] + R
    return out
