"""Single five-axis sweeps: mesh volumes against reference rows, and random blocks against the exact sweep.

Reference volumes (mm^3): tilts about a point of the axis in closed form, moves by the flux of the advancing
surface less what is entered twice, both confirmed by an independent quadrature of line lengths, good to 1e-5.
All cutters are cut flat 50 mm above the tip.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, process_time
from typing import Any, NamedTuple

import numpy as np
from manifold3d import Manifold

from vmachining.arrays import Floats, Ints
from vmachining.engines.mesh.solids import manifold
from vmachining.engines.mesh.turning import turning_pieces
from vmachining.errors import VMachiningError
from vmachining.sweep import Pose, Sweep, Turn
from vmachining.tool import BallNose, BullNose, Cutter, FlatEnd, Taper

__all__ = [
    "MOTIONS",
    "SIDES",
    "TOOLS",
    "VOLUMES",
    "block",
    "reference",
    "sweep5",
    "sweep_gauntlet",
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
    axis = _unit(rng.normal(size=3) * [1, 1, 0.3] + [0, 0, 1.5])
    way = rng.normal(size=3)
    way = _unit(way - 0.9 * (way @ axis) * axis) * rng.uniform(1.0, 5.0)
    start, end = Pose((0, 0, 0), axis), Pose(way, _turned(axis, rng, np.radians(rng.uniform(1.0, 5.0))))
    return Sweep.along(cutters[seed % 3], Turn.great_circle(start, end))


FAMILIES = ("finishing", "free", "pivot", "in plane", "along the axis", "rotary", "hardly turning")


def sweep_gauntlet(blocks: int = 1000, first: int = 0) -> Iterator[dict[str, Any]]:
    """Random blocks of every family and tool, 0.1 to 100 mm: solid, bracket, exact volume, exact membership.

    A row per failure and per block without B-rep solid, named by its seed, and one count per family at the end.
    """
    counts = {family: [0, 0] for family in FAMILIES}
    kernel = {family: dict.fromkeys(BREP, 0) for family in FAMILIES}
    unknown = crevices = 0
    begin = perf_counter()
    brep_seconds = []
    for seed in range(first, first + blocks):
        family = FAMILIES[seed % len(FAMILIES)]
        counts[family][0] += 1
        sweep = _random_block(seed)
        bracket = None
        try:
            problems, exact, crevice, bracket = _trial(sweep)
        except VMachiningError as error:
            problems, exact, crevice = [f"{type(error).__name__}: {error}"], None, False
        verdict, reason, spent = _brep(sweep, bracket)
        kernel[family][verdict] += 1
        brep_seconds.append(spent)
        if verdict == "wrong":
            problems.append(f"B-rep: {reason}")
        elif verdict == "refused":
            yield {"case": "sweep-gauntlet", "seed": seed, "family": family, "brep_refused": reason}
        unknown += exact is None
        crevices += crevice
        if problems:
            yield {"case": "sweep-gauntlet", "seed": seed, "family": family, "failed": problems}
        else:
            counts[family][1] += 1
    yield {
        "case": "sweep-gauntlet",
        "blocks": blocks,
        "passed": sum(good for _, good in counts.values()),
        "by_family": {family: f"{good} of {all_}" for family, (all_, good) in counts.items()},
        "without_exact_volume": unknown,
        "outer_with_crevices": crevices,
        "brep_by_family": kernel,
        "brep_median_seconds": float(np.median(brep_seconds)),
        "seconds": perf_counter() - begin,
    }


BREP = ("solid", "solids", "refused", "wrong")
"""One B-rep solid, several whose union is the sweep, none and a named reason, or one that contradicts a gate."""


def _brep(sweep: Sweep, bracket: tuple[float, float] | None) -> tuple[str, str, float]:
    """(word of `BREP`, reason, CPU seconds): valid by OCCT, volume of the flux, bracket of the mesh, STEP and back."""
    from vmachining.engines import brep

    begin = process_time()
    try:
        parts = brep.solids(sweep)
    except VMachiningError as error:
        return "refused", str(error), process_time() - begin
    spent = process_time() - begin
    if len(parts) == 1 and bracket is not None:
        found = brep.volume(parts[0].shape)
        if not bracket[0] * (1 - 1e-6) <= found <= bracket[1] * (1 + 1e-6):
            return "wrong", f"{found:.9g} mm3 outside [{bracket[0]:.9g}, {bracket[1]:.9g}]", spent
    with TemporaryDirectory() as folder:
        try:
            brep.write_solids(Path(folder) / "sweep.step", [part.shape for part in parts])
        except VMachiningError as error:
            return "wrong", str(error), spent
    return "solid" if len(parts) == 1 else "solids", "", spent


def _trial(sweep: Sweep) -> tuple[list[str], float | None, bool, tuple[float, float]]:
    """What is wrong with the meshes of a sweep; its exact volume; whether the outer mesh has crevices; bracket."""
    problems = []
    chord = sweep.profile.max_radius / 200.0
    solids = {side: united(sweep, chord, side) for side in SIDES}
    lo, fair, hi = (float(solids[side].volume()) for side in SIDES)
    if not 0.0 < lo <= fair <= hi:
        problems.append(f"order {lo:.9g} {fair:.9g} {hi:.9g}")
    exact = sweep.volume
    if exact is not None:
        if not lo * (1 - 1e-5) <= exact <= hi * (1 + 1e-5):
            problems.append(f"exact {exact:.9g} outside [{lo:.9g}, {hi:.9g}]")
        if (
            abs(fair - exact) > 0.25 * (hi - lo) + 1e-5 * exact
        ):  # facets of the envelope: 2/3 SAG of the width
            problems.append(f"fair {fair:.9g} off exact {exact:.9g}")
    inner = np.array(solids["inner"].to_mesh64().vert_properties)[:, :3]
    inner = inner[:: max(1, len(inner) // 40)]
    if not sweep.contains(inner, slack=1e-6 * chord).all():
        problems.append("a vertex of the inner mesh is outside")
    rng = np.random.default_rng(1)
    outer = np.array(solids["outer"].to_mesh64().vert_properties)[:, :3]
    near = outer[rng.integers(len(outer), size=60)] + chord * rng.normal(size=(60, 3))
    held = np.any([np.abs(winding(near, p)) > 0.5 for p in turning_pieces(sweep, chord, "outer")], axis=0)
    if (sweep.contains(near) & ~held).any():
        problems.append("a point of the sweep is outside the outer mesh")
    crevice = bool((sweep.signed_distance(outer) < -1e-6 * chord).any())
    return problems, exact, crevice, (lo, hi)


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


def _random_block(seed: int) -> Sweep:
    """A block of the family that the seed belongs to."""
    rng = np.random.default_rng(seed)
    size = float(10.0 ** rng.uniform(0.0, 1.3))
    slim = size * rng.uniform(2.0, 6.0)
    cutters: tuple[Cutter, ...] = (
        FlatEnd(diameter=size, length=slim),
        BallNose(diameter=size, length=slim),
        BullNose(diameter=size, corner_radius=size * rng.uniform(0.05, 0.45), length=slim),
        Taper(diameter=size, taper_deg=rng.uniform(1, 15), corner_radius=size / 4, length=slim),
    )
    cutter = cutters[int(rng.integers(len(cutters)))]
    family = FAMILIES[seed % len(FAMILIES)]
    axis = _unit(rng.normal(size=3) + [0, 0, 1.5])
    travel = float(10.0 ** rng.uniform(-1.0, 2.0 if family == "free" else 1.0))
    angle = float(np.radians(10.0 ** rng.uniform(-1.0, 1.7 if family == "free" else 1.0)))
    way = _unit(rng.normal(size=3)) * travel
    end = _turned(axis, rng, angle)
    if family == "pivot":  # about a point of the axis, perhaps not quite
        height = slim * rng.uniform(0.0, 1.0)
        way = height * (axis - end) + way * rng.choice([0.0, 1e-3, 0.02])
    elif family == "in plane":
        side = _unit(end - (end @ axis) * axis)
        way = travel * (rng.normal() * side + 0.1 * rng.normal() * axis)
    elif family == "along the axis":
        way = axis * travel * rng.choice([-1.0, 1.0])
    elif family == "hardly turning":
        end = _turned(axis, rng, float(10.0 ** rng.uniform(-9.0, -3.0)))
    elif family == "rotary":
        angles = rng.uniform(-0.8, 0.8, 2)
        return Sweep.along(
            cutter, Turn.rotary((0, 0, 0), way, "ac", angles, angles + rng.normal(size=2) * angle)
        )
    return Sweep.along(cutter, Turn.great_circle(Pose((0, 0, 0), axis), Pose(way, end)))


def _turned(axis: Floats, rng: np.random.Generator, angle: float) -> Floats:
    """A direction at `angle` (rad) from the axis."""
    across = rng.normal(size=3)
    across = _unit(across - (across @ axis) * axis)
    return np.asarray(np.cos(angle) * axis + np.sin(angle) * across)


def _unit(vector: Floats) -> Floats:
    return np.asarray(vector / np.linalg.norm(vector))
