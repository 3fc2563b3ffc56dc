"""Single five-axis sweeps: mesh volumes against reference rows, time of typical finishing blocks.

Reference volumes (mm^3): tilts about a point of the axis in closed form, moves by the flux of the advancing
surface less what is entered twice, both confirmed by an independent quadrature of line lengths, good to 1e-5.
All cutters are cut flat 50 mm above the tip.
"""

from __future__ import annotations

from collections.abc import Iterator
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from manifold3d import Manifold

from vmachining.arrays import Floats, Ints
from vmachining.engines.mesh.solids import manifold
from vmachining.engines.mesh.turning import turning_pieces
from vmachining.sweep import Pose, Sweep, Turn
from vmachining.tool import BallNose, BullNose, Cutter, FlatEnd

__all__ = [
    "MOTIONS",
    "SIDES",
    "TOOLS",
    "VOLUMES",
    "block",
    "reference",
    "sweep5",
    "turned",
    "unit",
    "united",
    "winding",
]

SIDES = ("inner", "fair", "outer")

TOOLS: dict[str, Cutter] = {
    "F20": FlatEnd(diameter=20, length=50),
    "B10": BallNose(diameter=10, length=50),
    "N20": BullNose(diameter=20, corner_radius=5, length=50),
    "N30": BullNose(diameter=30, corner_radius=5, length=50),
}


class Motion(NamedTuple):
    """Control point from and to (mm), tilt and turn about z (deg), height of the control point (mm)."""

    start: tuple[float, float, float]
    end: tuple[float, float, float]
    tilt: tuple[float, float]
    turn: tuple[float, float] = (0.0, 0.0)
    height: float = 0.0


MOTIONS = {
    "in the plane of the tilt": Motion((0, 0, 0), (0, 100, 0), (30, 30)),
    "across the tilt": Motion((0, 0, 0), (100, 0, 0), (30, 30)),
    "tilt about the tip": Motion((0, 0, 0), (0, 0, 0), (0, 30)),
    "tilt about a low point": Motion((0, 0, 0), (0, 0, 0), (0, 30), height=5),
    "tilt about the middle": Motion((0, 0, 0), (0, 0, 0), (0, 40), height=25),
    "falling": Motion((0, 0, 0), (0, 100, 0), (0, 60), height=5),
    "twist": Motion((0, 0, 0), (0, 100, 0), (24, 60), (180, 240), 5),
    "skew": Motion((0, 0, 0), (60, 20, -5), (5, 25), (20, 50)),
    "rolling forward": Motion((0, 0, 0), (40, 0, 0), (0, 15), (90, 90)),
    "leaning back": Motion((0, 0, 0), (40, 0, 0), (0, -15), (90, 90)),
}

VOLUMES = {
    "in the plane of the tilt": {"F20": 118018.466914, "B10": 48657.720519, "N20": 113150.550024},
    "across the tilt": {"F20": 115707.963268, "B10": 52723.081940, "N20": 114335.506503},
    "tilt about the tip": {"F20": 29303.046344, "B10": 10388.235526, "N20": 28997.324063},
    "tilt about a low point": {"F20": 26944.460271, "B10": 9108.414692, "N20": 26422.2019},
    "tilt about the middle": {"F20": 25004.905565, "B10": 7936.8653, "N20": 23868.2528},
    "falling": {"F20": 92483.90, "B10": 36211.19243, "N20": 87844.256, "N30": 154689.04},
    "twist": {"F20": 120313.35764, "B10": 49596.57912, "N20": 115414.98850, "N30": 197356.57686},
    "skew": {"F20": 86296.04, "B10": 37996.67, "N20": 85020.84, "N30": 140557.72},
    "rolling forward": {"F20": 63446.00, "B10": 26657.024, "N20": 62330.807, "N30": 106800.68},
    "leaning back": {"F20": 50356.03, "B10": 20076.65561, "N20": 48986.6680, "N30": 86509.15},
}


def reference(motion: str, tool: str) -> Sweep:
    """The sweep of one reference row."""
    m = MOTIONS[motion]
    first, last = ({"a": np.radians(a), "c": np.radians(c)} for a, c in zip(m.tilt, m.turn, strict=True))
    return Sweep.along(TOOLS[tool], Turn.through(m.start, m.end, "ac", first, last, control_height=m.height))


def united(sweep: Sweep, chord: float, side: str) -> Manifold:
    """One solid of all pieces."""
    solids = [manifold(*piece) for piece in turning_pieces(sweep, chord, side)]
    total = solids[0]
    for solid in solids[1:]:
        total = total + solid
    return total


def sweep5(chord: float = 0.01) -> Iterator[dict[str, Any]]:
    """Every reference row, then the time of typical finishing blocks."""
    list(turning_pieces(block(0), chord, "fair"))  # compiles
    for motion, row in VOLUMES.items():
        for tool, exact in row.items():
            sweep = reference(motion, tool)
            begin = perf_counter()
            pieces = list(turning_pieces(sweep, chord, "fair"))
            seconds = perf_counter() - begin
            lo, fair, hi = (float(united(sweep, chord, side).volume()) for side in SIDES)
            yield {
                "case": "sweep5",
                "motion": motion,
                "tool": tool,
                "chord_mm": chord,
                "exact_mm3": exact,
                "fair_error_rel": (fair - exact) / exact,
                "width_rel": (hi - lo) / exact,
                "inside": lo <= exact <= hi,
                "pieces": len(pieces),
                "triangles": sum(len(t) for _, t in pieces),
                "mesh_seconds": seconds,
                "seconds": perf_counter() - begin,
            }
    times, triangles = [], []
    for seed in range(200):
        sweep = block(seed)
        begin = perf_counter()
        solids = [manifold(*piece) for piece in turning_pieces(sweep, chord, "outer")]
        times.append(perf_counter() - begin)
        triangles.append(sum(s.num_tri() for s in solids))
    yield {
        "case": "sweep5",
        "motion": "finishing blocks, 1 to 5 mm and degrees",
        "chord_mm": chord,
        "blocks": len(times),
        "median_ms": 1e3 * float(np.median(times)),
        "p90_ms": 1e3 * float(np.percentile(times, 90)),
        "triangles": float(np.median(triangles)),
    }


def block(seed: int) -> Sweep:
    """A random finishing block: 10 mm cutter, 1 to 5 mm, 1 to 5 degrees, mostly across the axis."""
    rng = np.random.default_rng(seed)
    cutters: tuple[Cutter, ...] = (
        FlatEnd(diameter=10, length=30),
        BallNose(diameter=10, length=30),
        BullNose(diameter=10, corner_radius=2, length=30),
    )
    axis = unit(rng.normal(size=3) * [1, 1, 0.3] + [0, 0, 1.5])
    way = rng.normal(size=3)
    way = unit(way - 0.9 * (way @ axis) * axis) * rng.uniform(1.0, 5.0)
    start, end = Pose((0, 0, 0), axis), Pose(way, turned(axis, rng, np.radians(rng.uniform(1.0, 5.0))))
    return Sweep.along(cutters[seed % 3], Turn.great_circle(start, end))


def winding(points: Floats, mesh: tuple[Floats, Ints]) -> Floats:
    """(n,) times that a closed mesh goes round each point: solid angles by Van Oosterom and Strackee (1983)."""
    corners = mesh[0][mesh[1]]
    out = np.empty(len(points))
    for i, p in enumerate(points):
        a, b, c = np.moveaxis(corners - p, 1, 0)
        x, y, z = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        volume = np.einsum("ij,ij->i", a, np.cross(b, c))
        below = x * y * z + (a * b).sum(1) * z + (b * c).sum(1) * x + (c * a).sum(1) * y
        out[i] = 2.0 * np.arctan2(volume, below).sum() / (4.0 * np.pi)
    return out


def turned(axis: Floats, rng: np.random.Generator, angle: float) -> Floats:
    """A direction at `angle` (rad) from the axis."""
    across = rng.normal(size=3)
    across = unit(across - (across @ axis) * axis)
    return np.asarray(np.cos(angle) * axis + np.sin(angle) * across)


def unit(vector: Floats) -> Floats:
    return np.asarray(vector / np.linalg.norm(vector))
