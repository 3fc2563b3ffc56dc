"""Motions that break sweep implementations: degenerate, singular, closing, tangential; named in `HARD`."""

from __future__ import annotations

import numpy as np

from benchmarks.sweep5 import turned, unit
from vmachining.geometry import Arc, Line
from vmachining.sweep import Motion, Pose, Sweep, Turn
from vmachining.tool import BallNose, BullNose, Cutter, FlatEnd, Taper

__all__ = ["HARD", "hard_sweep"]

HARD = (
    "zero length", "spin", "plunge", "level", "tiny ramp", "along a tilted axis", "across a tilt",
    "tilt about the tip", "ball about its centre", "tilt about the middle", "pivot on the surface", "full circle",
    "tilt from upright", "two arcs", "chord is born", "axis rate vanishes", "through the singular pose",
    "wide joint move", "tight helix", "degenerate tool",
)  # fmt: skip


def hard_sweep(name: str, cutter: Cutter, size: float, rng: np.random.Generator) -> Sweep:
    """One of the motions for a cutter of a diameter `size`, scaled to it."""
    if name == "ball about its centre":
        cutter = BallNose(diameter=size, length=cutter.length)
    if name == "degenerate tool":
        cutter = (
            BullNose(diameter=size, corner_radius=1e-3 * size, length=2 * size),
            BullNose(diameter=size, corner_radius=0.499 * size, length=2 * size),
            Taper(diameter=size, taper_deg=12, corner_radius=0.0, length=size),
            BallNose(diameter=size, length=0.5 * size),
            FlatEnd(diameter=size, length=0.05 * size),
        )[int(rng.integers(5))]
    return Sweep.along(cutter, _path(name, cutter.length, size, rng))


def _path(name: str, length: float, size: float, rng: np.random.Generator) -> Motion:
    tilt = unit(rng.normal(size=3) + [0.0, 0.0, 2.0])
    deg = np.radians
    way = unit(rng.normal(size=3)) * size * float(10.0 ** rng.uniform(-1.0, 1.0))
    lines = {
        "plunge": [0.0, 0.0, -size * rng.uniform(0.1, 3.0) * rng.choice([-1.0, 1.0])],
        "level": [way[0], way[1], 0.0],
        "tiny ramp": [5.0 * size, 0.0, -size * float(rng.choice([1e-10, 1e-7, 1e-4]))],
    }
    if name in lines:
        return Line((0, 0, 0), lines[name])
    steady = {
        "zero length": np.zeros(3),
        "spin": np.zeros(3),
        "along a tilted axis": tilt * size * rng.uniform(-3.0, 3.0),
        "across a tilt": np.cross(tilt, unit(rng.normal(size=3))) * size,
    }
    if name in steady:
        return Turn.great_circle(Pose((0, 0, 0), tilt), Pose(steady[name], tilt))
    pivots = {
        "tilt about the tip": 0.0,
        "ball about its centre": 0.5 * size,
        "tilt about the middle": 0.5 * length,
    }
    if name in pivots:
        ends = (0, 0, 1), turned(np.array([0.0, 0.0, 1.0]), rng, deg(rng.uniform(1.0, 40.0)))
        return Turn.through((0, 0, 0), (0, 0, 0), "axis", *ends, control_height=pivots[name])
    if name == "pivot on the surface":
        return Arc(
            (0, 0, 0), (0.5 * size * rng.choice([0.6, 1.0]), 0, 0), 2, angle=deg(rng.uniform(10.0, 170.0))
        )
    if name == "full circle":
        return Arc((0, 0, 0), (size * rng.uniform(0.2, 3.0), 0, 0), 2, angle=2.0 * np.pi)
    if name == "tight helix":
        return Arc((0, 0, 0), (0.3 * size, 0, 0), 2, angle=deg(rng.uniform(30.0, 180.0)), rise=-0.2 * size)
    if name == "tilt from upright":  # the whole corner circle grazes at the start
        return Turn.rotary(
            (0, 0, 0), (0, 5.0 * size, 0), "ac", (0.0, 0.0), (deg(rng.uniform(5.0, 60.0)), 0.0)
        )
    if name == "two arcs":
        return Turn.rotary((0, 0, 0), (0, size, 0), "ac", (deg(1.0), 0.0), (deg(2.0), 0.0))
    if name == "chord is born":
        lean = deg(rng.uniform(5.0, 20.0)) * rng.choice([-1.0, 1.0])
        return Turn.rotary((0, 0, 0), (2.0 * size, 0, 0), "ac", (0.0, deg(90.0)), (lean, deg(90.0)))
    if name == "axis rate vanishes":
        return Turn.great_circle(Pose((0, 0, 0), tilt), Pose(way, turned(tilt, rng, 1e-9)))
    rows = (
        ("R", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), -1.0), ("R", (1.0, 0.0, 0.0), (0.0, 0.0, -50.0), -1.0),
        *(("L", tuple(row), (0.0, 0.0, 0.0), 1.0) for row in np.eye(3).tolist()),
    )  # fmt: skip
    if name == "through the singular pose":
        far = deg(rng.choice([-10.0, 170.0]) * rng.uniform(0.2, 1.0))
        q0 = np.array([deg(90.0), deg(1.0), 0.0, -0.87, 0.0])
        return Turn.joints(rows, q0, q0 + [far, -deg(2.0) * rng.integers(2), *way])
    if name == "wide joint move":
        q0 = np.array([deg(90.0), deg(30.0), 0.0, 61.602540378, 43.301270189])
        return Turn.joints(rows, q0, q0 - [deg(rng.uniform(10.0, 90.0)), 0, 0, 0, 0])
    end = turned(tilt, rng, deg(rng.uniform(0.5, 10.0)))
    return Turn.great_circle(Pose((0, 0, 0), tilt), Pose(way, end))
