"""Random chains of blocks for the B-rep gauntlet: three-axis passes, contours, ramps, helices, five-axis passes."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from vmachining.geometry import Arc, Line
from vmachining.sweep import Motion, Pose, Turn
from vmachining.tool import BallNose, BullNose, Cutter, FlatEnd, ProfileTool, Taper

__all__ = ["DEEP", "FAMILIES", "PLOT", "families", "tools"]

PLOT, DEEP = 60.0, 20.0
"""mm, the plot of a chain and its stock below z = 0."""

FAMILIES = ("zigzag", "contour", "ramp", "helix", "bore", "smooth", "kinked")
"""helix: its axis beside the cutter, bore: in it. smooth, kinked: five axes."""


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
