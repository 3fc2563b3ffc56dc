"""Random blocks of tools that turn, as five-axis programs have them, and the same block told in other ways."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from vmachining.geometry import rotation
from vmachining.stock import BoxStock, MeshStock
from vmachining.sweep import Pose, Sweep, Turn
from vmachining.tool import BallNose, BullNose, FlatEnd, Taper

LO, HI = np.array([-8.0, -8.0, -8.0]), np.array([8.0, 8.0, 0.0])
"""The box that all of them are cut from, mm."""

TOOLS = {
    "ball": BallNose(diameter=6, length=40).profile,
    "bull": BullNose(diameter=8, corner_radius=1, length=40).profile,
    "flat": FlatEnd(diameter=6, length=40).profile,
    "cone": Taper(diameter=4, taper_deg=8, corner_radius=2, length=40).profile,
    "blade": Taper(diameter=1.5, taper_deg=4, corner_radius=0.75, length=40).profile,
}

KINDS = ("point", "swarf", "slot", "pivot", "plunge", "retrace")


STAIRS = np.array([[-8.0, -8.0], [8.0, -8.0], [8.0, -1.0], [0.0, -1.0], [0.0, 0.0], [-8.0, 0.0]])
"""x and z of a stock with one step."""


def stairs() -> MeshStock:
    """The box less what lies beyond a step down in its middle."""
    n = len(STAIRS)
    corners = [[x, y, z] for y in (-8.0, 8.0) for x, z in STAIRS]
    facets = [(0, k, k + 1) for k in range(1, n - 1)] + [(n, n + k + 1, n + k) for k in range(1, n - 1)]
    for k in range(n):
        j = (k + 1) % n
        facets += [(k, n + k, n + j), (k, n + j, j)]
    return MeshStock(np.array(corners), np.array(facets))


def hills(seed: int) -> MeshStock:
    """The box with a top of 18 to 200 random facets, up to some millimetres deep."""
    rng = np.random.default_rng([seed, 2])
    n, depth = int(rng.choice([3, 6, 10])), float(rng.choice([0.1, 0.5, 1.0]))
    line = np.linspace(-8.0, 8.0, n + 1)
    top = np.array([[x, y, -depth * abs(rng.normal())] for x in line for y in line])
    number = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    facets: list[tuple[int, int, int]] = []
    corners = (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
    quads = zip(*(part.ravel().tolist() for part in corners), strict=True)
    for a, b, c, d in quads:
        facets += [(a, b, c), (a, c, d)] if rng.random() < 0.5 else [(a, b, d), (b, c, d)]
    around = np.concatenate([number[:-1, 0], number[-1, :-1], number[:0:-1, -1], number[0, :0:-1]]).tolist()
    low = top[around] * [1.0, 1.0, 0.0] + [0.0, 0.0, -8.0]
    m, first = len(around), len(top)
    for k in range(m):
        j = (k + 1) % m
        facets += [
            (around[j], around[k], first + k), (around[j], first + k, first + j), (first + j, first + k, first + m)
        ]  # fmt: skip
    return MeshStock(np.concatenate([top, low, [[0.0, 0.0, -8.0]]]), np.array(facets))


class Case(NamedTuple):
    """Blocks before, and the block that is asked for."""

    name: str
    earlier: list[Sweep]
    block: Sweep


def unit(vector: np.ndarray) -> np.ndarray:
    return np.asarray(vector / np.linalg.norm(vector))


def tilted(axis: np.ndarray, rng: np.random.Generator, degrees: float) -> np.ndarray:
    """An axis so far from another one, in any direction."""
    aside = unit(np.cross(axis, unit(rng.normal(size=3))))
    return unit(np.cos(np.radians(degrees)) * axis + np.sin(np.radians(degrees)) * aside)


def case_of(seed: int) -> Case:
    """Five to eight blocks of about a millimetre that turn 0.1 to 2 degrees each; the last one is asked for."""
    rng = np.random.default_rng(seed)
    kind, tool = KINDS[seed % len(KINDS)], list(TOOLS)[seed // len(KINDS) % len(TOOLS)]
    profile = TOOLS[tool]
    lean = {"point": 20.0, "swarf": 35.0, "slot": 8.0}.get(kind, 15.0) * rng.uniform(0.2, 1.0)
    axis = tilted(np.array([0.0, 0.0, 1.0]), rng, lean)
    way = unit(np.append(rng.normal(size=2), 0.1 * rng.normal()))
    if kind == "plunge":
        way = -axis
    if kind == "swarf":  # along the wall that the flank cuts
        way = unit(np.cross(axis, [way[0], way[1], 0.0]))
    depth = {"point": 1.0, "swarf": 5.0, "slot": 2.0}.get(kind, 1.5) * rng.uniform(0.3, 1.0)
    tip = np.append(rng.uniform(-2.0, 2.0, 2), -depth if kind != "plunge" else 1.0)
    poses = [Pose(tip, axis)]
    for _ in range(int(rng.integers(2, 5))):
        step = 0.0 if kind == "pivot" else rng.uniform(0.5, 1.5)
        tip, axis = tip + step * way, tilted(axis, rng, 10.0 ** rng.uniform(-1.0, 0.3))
        poses.append(Pose(tip, axis))
    sweeps = [Sweep.along(profile, Turn.great_circle(a, b)) for a, b in pairwise(poses)]
    if kind == "retrace":
        sweeps.append(Sweep.along(profile, Turn.great_circle(poses[-1], poses[-2])))
    return Case(f"{kind} {tool}", sweeps[:-1], sweeps[-1])


def turned(case: Case, seed: int) -> tuple[MeshStock, Case]:
    """Stock and tool turned and moved together."""
    rng = np.random.default_rng([seed, 1])
    turn, shift = rotation(unit(rng.normal(size=3)), rng.uniform(0.3, 3.0)), rng.uniform(-20.0, 20.0, 3)

    def moved(sweep: Sweep) -> Sweep:
        path = sweep.path
        assert isinstance(path, Turn)
        ends = (Pose(turn @ path.position(t) + shift, unit(turn @ path.axis(t))) for t in (0.0, 1.0))
        return Sweep.along(sweep.profile, Turn.great_circle(*ends))

    box = BoxStock(LO, HI).mesh(0.0)[0]
    stock = MeshStock(box.vertices @ turn.T + shift, box.triangles)
    return stock, Case(case.name, [moved(sweep) for sweep in case.earlier], moved(case.block))


def in_parts(case: Case, count: int) -> list[Sweep]:
    """The block as so many parts in time."""
    path = case.block.path
    assert isinstance(path, Turn)
    return [
        Sweep.along(case.block.profile, part) for part in path.split([k / count for k in range(1, count)])
    ]
