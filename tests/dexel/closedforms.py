"""Random blocks whose removed volume has a closed form: slots and plunges in a box, turned to the raster at any angle, with
tools that widen below a neck, in stocks that hang over, and back on their own way."""

from __future__ import annotations

from collections.abc import Callable
from math import pi
from typing import NamedTuple

import numpy as np
from manifold3d import Manifold

from vmachining import BallNose, FlatEnd, Sweep
from vmachining.engines.dexel import RayEngine
from vmachining.geometry import Arc, Line
from vmachining.stock import BoxStock, Stock, closed_mesh
from vmachining.sweep import Pose, Turn
from vmachining.tool import Profile


class Case(NamedTuple):
    """A block, the blocks before it, what it removes, mm^3, and of which stock; None: the box from `LO` to `HI`."""

    name: str
    earlier: list[Sweep]
    block: list[Sweep]
    truth: float
    stock: Stock | None = None


def lune(radius: float, shift: float) -> float:
    """mm^2 of a disc that the same disc, `shift` aside, does not cover."""
    half = shift / 2.0
    common = 2.0 * radius**2 * np.arccos(half / radius) - half * np.sqrt(4.0 * radius**2 - shift**2)
    return float(pi * radius**2 - common)


def segment(radius: float, depth: float) -> float:
    """mm^2 of the part of a disc below a line `depth` above its lowest point."""
    return float(
        radius**2 * np.arccos(1.0 - depth / radius)
        - (radius - depth) * np.sqrt(2.0 * radius * depth - depth**2)
    )


def cap(radius: float, depth: float) -> float:
    """mm^3 of the part of a ball below a plane."""
    return pi * depth**2 * (3.0 * radius - depth) / 3.0


def path(rng: np.random.Generator, length: float, z: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(start, end, unit vector to the left) of a level line somewhere in the middle of the box, at any angle."""
    angle = rng.uniform(0.0, 2.0 * pi)
    way, left = np.array([np.cos(angle), np.sin(angle), 0.0]), np.array([-np.sin(angle), np.cos(angle), 0.0])
    start = np.array([*rng.uniform(-4.0, 4.0, 2), z]) - 0.5 * length * way
    return start, start + length * way, left


def slot(rng: np.random.Generator) -> Case:
    r, depth, length = rng.uniform(1.0, 6.0), rng.uniform(0.01, 8.0), rng.uniform(0.2, 20.0)
    start, end, _ = path(rng, length, -depth)
    sweep = Sweep.along(FlatEnd(diameter=2 * r, length=30), Line(start, end))
    return Case("slot", [], [sweep], depth * (2 * r * length + pi * r**2))


def beside(rng: np.random.Generator) -> Case:
    """A slot beside another one: a strip, and what a disc moved aside covers anew at its ends."""
    r, depth, length = rng.uniform(1.0, 6.0), rng.uniform(0.01, 8.0), rng.uniform(0.2, 20.0)
    wide = r * 10.0 ** rng.uniform(-2.5, 0.2)
    start, end, left = path(rng, length, -depth)
    tool = FlatEnd(diameter=2 * r, length=30)
    first, second = (Sweep.along(tool, Line(start + by, end + by)) for by in (0.0 * left, wide * left))
    return Case("beside", [first], [second], depth * (wide * length + lune(r, wide)))


def groove(rng: np.random.Generator) -> Case:
    """A ball: a segment along the way, and a cap at its ends; the axis leans as it likes."""
    r, length = rng.uniform(1.0, 6.0), rng.uniform(0.2, 20.0)
    depth = r * rng.uniform(0.02, 0.95)
    start, end, _ = path(rng, length, r - depth)  # of the centre
    lean, toward = rng.uniform(0.0, 0.4), rng.uniform(0.0, 2.0 * pi)
    axis = np.array([np.sin(lean) * np.cos(toward), np.sin(lean) * np.sin(toward), np.cos(lean)])
    tool = BallNose(diameter=2 * r, length=40)
    sweep = Sweep.along(tool, Turn.great_circle(Pose(start - r * axis, axis), Pose(end - r * axis, axis)))
    if np.cos(lean) * r < depth:  # the shank would cut
        return groove(rng)
    return Case("groove", [], [sweep], segment(r, depth) * length + cap(r, depth))


def deeper(rng: np.random.Generator) -> Case:
    """A slot again, deeper: a layer below it."""
    r, depth, length = rng.uniform(1.0, 6.0), rng.uniform(0.5, 8.0), rng.uniform(0.2, 20.0)
    layer = 10.0 ** rng.uniform(-4.0, 0.0)
    start, end, _ = path(rng, length, -depth)
    tool = FlatEnd(diameter=2 * r, length=30)
    down = np.array([0.0, 0.0, layer])
    sweeps = [Sweep.along(tool, Line(p, q)) for p, q in ((start, end), (start - down, end - down))]
    return Case("deeper", sweeps[:1], sweeps[1:], layer * (2 * r * length + pi * r**2))


def plunges(rng: np.random.Generator) -> Case:
    """Some plunges in one block, each somewhat deeper than another one before it."""
    r = rng.uniform(1.0, 3.0)
    tool = FlatEnd(diameter=2 * r, length=30)
    depth, more = rng.uniform(0.1, 6.0), 10.0 ** rng.uniform(-3.0, 0.5)
    holes = [np.array([x, y, 0.0]) for x in (-8.0, 0.0, 8.0) for y in (-8.0, 0.0, 8.0)]
    count = int(rng.integers(1, 9))
    chosen = [holes[k] + [*rng.uniform(-1, 1, 2), 0.0] for k in rng.permutation(9)[:count]]
    up = np.array([0.0, 0.0, 1.0])
    before = [Sweep.along(tool, Line(p + up, p - depth * up)) for p in chosen]
    block = [Sweep.along(tool, Line(p, p - (depth + more) * up)) for p in chosen]
    return Case("plunges", before, block, count * pi * r**2 * more)


def ring(rng: np.random.Generator) -> Case:
    """A full circle: an annulus."""
    r, depth = rng.uniform(0.5, 4.0), rng.uniform(0.01, 8.0)
    around = r * rng.uniform(1.05, 2.0)
    sweep = Sweep.along(
        FlatEnd(diameter=2 * r, length=30),
        Arc((around, 0.3, -depth), (0.0, 0.3, 0.0), angle=2.0 * pi * rng.choice([-1.0, 1.0])),
    )
    return Case("ring", [], [sweep], depth * pi * ((around + r) ** 2 - (around - r) ** 2))


def air(rng: np.random.Generator) -> Case:
    """A slot that lies in an earlier one."""
    case = slot(rng)
    return Case("air", case.block, case.block, 0.0)


def waist(rng: np.random.Generator) -> Case:
    """A tool that narrows to a neck and widens above it, back on its way: every upright line has lost two pieces before."""
    heights = np.cumsum(rng.uniform(0.3, 4.0, 4))
    radii = np.array([rng.uniform(2.0, 5.0), rng.uniform(0.5, 1.5), rng.uniform(1.6, 3.0), 3.2])
    tool = Profile([(0.0, 0.0), *zip(radii.tolist(), heights.tolist(), strict=True)])
    start, end, _ = path(rng, rng.uniform(0.2, 20.0), -rng.uniform(0.2, 12.0))
    return Case("waist", [Sweep.along(tool, Line(start, end))], [Sweep.along(tool, Line(end, start))], 0.0)


def undercut(rng: np.random.Generator) -> Case:
    """A T-slot cutter beside its own slot: a strip and a lune by each of its two radii."""
    head, neck = rng.uniform(3.0, 6.0), rng.uniform(1.0, 2.5)
    thick, depth, length = rng.uniform(0.2, 3.0), rng.uniform(3.0, 15.0), rng.uniform(0.2, 20.0)
    wide = neck * 10.0 ** rng.uniform(-2.5, 0.2)
    tool = Profile([(0.0, 0.0), (head, 0.0), (head, thick), (neck, thick), (neck, 30.0)])
    start, end, left = path(rng, length, -depth)
    first, second = (Sweep.along(tool, Line(start + by, end + by)) for by in (0.0 * left, wide * left))
    strips = ((thick, head), (depth - thick, neck))
    return Case("undercut", [first], [second], sum(h * (wide * length + lune(r, wide)) for h, r in strips))


def overhang(rng: np.random.Generator) -> Case:
    """A slot through a ledge and into what lies below it, and perhaps a shallower one before: the gap between is air."""
    r, length = rng.uniform(1.0, 6.0), rng.uniform(0.2, 20.0)
    ledge, gap, deep = rng.uniform(0.1, 4.0), rng.uniform(0.1, 6.0), rng.uniform(0.1, 4.0)
    slit = Manifold.cube((79.0, 80.0, gap)).translate((LO[0], LO[1], -ledge - gap))
    mesh = (Manifold.cube(HI - LO).translate(LO) - slit).to_mesh64()
    stock = closed_mesh(np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts), source="a ledge")
    start, end, _ = path(rng, length, -ledge - gap - deep)
    tool, area = FlatEnd(diameter=2 * r, length=40), 2 * r * length + pi * r**2
    cut = Sweep.along(tool, Line(start, end))
    head, high = deep + rng.uniform(0.1, 0.4) * gap, deep + rng.uniform(0.6, 0.9) * gap
    below = Profile([(0.0, 0.0), (r, 0.0), (r, head), (0.3, head), (0.3, 40.0)])
    above = Line(start + [0, 0, high], end + [0, 0, high])
    before, truth = [
        ([], ledge + deep),
        ([cut], 0.0),
        ([Sweep.along(tool, Line(start + [0, 0, deep], end + [0, 0, deep]))], deep),
        ([Sweep.along(tool, Line(start + [0, 0, 0.5 * deep], end + [0, 0, 0.5 * deep]))], 0.5 * deep),
        ([Sweep.along(tool, above), Sweep.along(below, Line(start, end))], 0.0),  # each takes one piece
    ][int(rng.integers(5))]
    return Case("overhang", before, [cut], truth * area, stock)


FAMILIES: tuple[Callable[[np.random.Generator], Case], ...] = (
    slot, beside, groove, deeper, plunges, ring, air, waist, undercut, overhang,
)  # fmt: skip

LO, HI = np.array([-40.0, -40.0, -20.0]), np.array([40.0, 40.0, 0.0])
"""The box that all of them are cut from, mm."""


def case_of(seed: int) -> Case:
    """A random block of one family after the other."""
    return FAMILIES[seed % len(FAMILIES)](np.random.default_rng(seed))


def engine_for(case: Case, **options: float) -> tuple[RayEngine, list[int]]:
    """An engine that has all sweeps of a case, and the numbers of those of its block."""
    engine = RayEngine(case.stock or BoxStock(LO, HI), **options)
    for sweep in case.earlier:
        engine.add(sweep)
    return engine, [engine.add(sweep) for sweep in case.block]
