"""1,000 single sweeps against independent truths, by seed: random five-axis blocks and the known hard motions.

Seed s belongs to family s mod 10 of `FAMILIES`; the family `hard` goes round `HARD`. Tools are flat, ball, bull nose
and taper of 1 to 20 mm, two to six times as long; blocks are 0.1 to 100 mm long and turn by 0.1 to 50 degrees.

A block passes if

- the meshes are ordered and hold what they must (`_trial`): the volume by the flux identity lies in the bracket,
  the inner mesh in the exact sweep, the exact sweep in the outer mesh;
- so does the mean of sixteen grids of rays, within six times its standard error;
- its B-rep solids are valid, read back from STEP with their volumes, hold exactly the points of the exact sweep
  among a hundred near its surface, and one alone has a volume in the bracket.

A block without B-rep solids (`refused`, with its reason) does not pass, but is not wrong. One that a referee has
no answer for counts as wrong, and the run continues.

`journal`, a file of one row per seed, makes a run that was cut resume where it was. What was measured:
`docs/measured/gate.md`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

import numpy as np

from benchmarks.hard import HARD, hard_sweep
from benchmarks.journal import journaled
from benchmarks.sweep5 import SIDES, turned, unit, winding
from vmachining.arrays import Floats
from vmachining.engines.mesh.solids import solid
from vmachining.engines.mesh.turning import turning_pieces
from vmachining.errors import VMachiningError
from vmachining.sweep import Pose, Sweep, Turn
from vmachining.tool import BallNose, BullNose, Cutter, FlatEnd, Taper

__all__ = ["FAMILIES", "MACHINES", "gauntlet_block", "strange_points", "sweep_gauntlet"]

FAMILIES = (
    "finishing", "free", "pivot", "in plane", "along the axis", "rotary", "hardly turning", "joints", "tilting",
    "hard",
)  # fmt: skip

BREP = ("solid", "solids", "refused", "wrong")
"""One B-rep solid, several whose union is the sweep, none and a named reason, or one that contradicts a truth."""

Z, X, Y = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
SLIDES = (("L", X, (0.0, 0.0, 0.0), 1.0), ("L", Y, (0.0, 0.0, 0.0), 1.0), ("L", Z, (0.0, 0.0, 0.0), 1.0))
MACHINES = (
    (("R", Z, (0.0, 0.0, 0.0), -1.0), ("R", X, (0.0, 0.0, -50.0), -1.0), *SLIDES),  # table C, A
    (*SLIDES, ("R", Z, (0.0, 0.0, 150.0), 1.0), ("R", X, (0.0, 0.0, 150.0), 1.0)),  # head C, A
    (("R", Z, (0.0, 0.0, 0.0), -1.0), *SLIDES, ("R", Y, (0.0, 0.0, 150.0), 1.0)),  # table C, head B
)
"""Chains from workpiece to tool: kind, direction, point on the axis (mm), sign."""

NEAR_MM = 6e-5
"""Points closer to the surface than this are not asked: a fold and a gap of 3e-5 mm each."""

POINTS = 96
SETS, RAYS = 16, 9
"""Grids of rays, each shifted at random, and rays per side of one."""


def sweep_gauntlet(
    blocks: int = 1000, first: int = 0, journal: str | Path | None = None
) -> Iterator[dict[str, Any]]:
    """A row per block, then a table by family and one line of all.

    journal : file to which every row goes at once; blocks that it holds already are not done again.
    """
    rows = []
    for row in journaled(range(first, first + blocks), journal, _row):
        rows.append(row)
        yield row
    for family in FAMILIES:
        yield {
            "case": "sweep-gauntlet",
            "family": family,
            **_sums([r for r in rows if r["family"] == family]),
        }
    yield {"case": "sweep-gauntlet", "first": first, **_sums(rows)}


def _sums(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Counts of verdicts and times of some blocks, and the seeds of those that did not pass."""
    times = [row["brep_seconds"] for row in rows]
    return {
        "blocks": len(rows),
        "passed": sum(not row["failed"] and row["brep"] in BREP[:2] for row in rows),
        **{word: sum(row["brep"] == word for row in rows) for word in BREP},
        "failed": [row["seed"] for row in rows if row["failed"]],
        "refused_seeds": [row["seed"] for row in rows if row["brep"] == "refused"],
        "brep_median_seconds": float(np.median(times)) if times else None,
        "without_exact_volume": sum(row["exact_mm3"] is None for row in rows),
        "seconds": sum(row["seconds"] for row in rows),
    }


def _row(seed: int) -> dict[str, Any]:
    """What came out of one seed; times are CPU seconds."""
    begin = process_time()
    family = FAMILIES[seed % len(FAMILIES)]
    row: dict[str, Any] = {"case": "sweep-gauntlet", "seed": seed, "family": family}
    if family == "hard":
        row["motion"] = HARD[seed // len(FAMILIES) % len(HARD)]
    sweep = gauntlet_block(seed)
    bracket = exact = None
    try:
        problems, exact, bracket = _trial(sweep)
    except Exception as error:  # a refusal or a bug: counted, so that the run continues
        problems = [f"{type(error).__name__}: {error}"]
    verdict, reason, count, spent = _brep(sweep, bracket)
    if verdict == "wrong":
        problems.append(f"B-rep: {reason}")
    return row | {
        "brep": verdict, "solids": count, "reason": reason, "failed": problems, "exact_mm3": exact,
        "bracket_mm3": bracket, "brep_seconds": spent, "seconds": process_time() - begin,
    }  # fmt: skip


def _brep(sweep: Sweep, bracket: tuple[float, float] | None) -> tuple[str, str, int, float]:
    """(word of `BREP`, reason, solids, CPU seconds): bracket of the mesh, exact points, STEP and back."""
    from vmachining.engines import brep

    begin = process_time()
    try:
        parts = brep.solids(sweep)
    except VMachiningError as error:
        return "refused", str(error), 0, process_time() - begin
    except Exception as error:  # a bug: counted, so that the run continues
        return "wrong", f"{type(error).__name__}: {error}", 0, process_time() - begin
    spent, count = process_time() - begin, len(parts)
    if count == 1 and bracket is not None:
        found = brep.volume(parts[0].shape)
        if not bracket[0] * (1 - 1e-6) <= found <= bracket[1] * (1 + 1e-6):
            return "wrong", f"{found:.9g} mm3 outside [{bracket[0]:.9g}, {bracket[1]:.9g}]", count, spent
    points = _near(sweep)
    strange = strange_points([part.shape for part in parts], points, sweep.signed_distance(points))
    if strange:
        return "wrong", strange, count, spent
    with TemporaryDirectory() as folder:
        try:
            brep.write_solids(Path(folder) / "sweep.step", [part.shape for part in parts])
        except VMachiningError as error:
            return "wrong", str(error), count, spent
    return ("solid" if count == 1 else "solids"), "", count, spent


def strange_points(shapes: Sequence[Any], points: Floats, gap: Floats) -> str:
    """What is wrong with solids where points (n, 3) mm have the distances (n,) mm from the sweep, negative inside; "" nothing.

    A referee without an answer is not a pass.
    """
    from vmachining.engines import brep

    clear = np.abs(gap) > NEAR_MM
    try:
        strange = brep.held(shapes, points[clear]) != (gap[clear] < 0.0)
    except VMachiningError as error:
        return f"points of the solids: {error}"
    if not strange.any():
        return ""
    return (
        f"{strange.sum()} points on the wrong side, up to {float(np.abs(gap[clear][strange]).max()):.2g} mm"
    )


def _near(sweep: Sweep) -> Floats:
    """(n, 3) mm: points around the surface of the tool at random times, 1e-4 to 1e-2 mm off on both sides."""
    rng, body = np.random.default_rng(2), sweep.profile
    z = rng.uniform(body.z_min, body.z_max, POINTS)
    r = body.radius_at(z) + rng.choice([-1e-2, -1e-4, 1e-4, 1e-2], POINTS)
    z += rng.choice([0.0, 0.0, 1e-4, -1e-4], POINTS)
    t, u = rng.random(POINTS), rng.uniform(0.0, 2.0 * np.pi, POINTS)
    path = sweep.path
    axis = path.axis(t) if isinstance(path, Turn) else np.broadcast_to([0.0, 0.0, 1.0], (POINTS, 3))
    x = np.cross(axis, unit(np.array([0.6, 0.5, 0.3])))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    m = np.cos(u)[:, None] * x + np.sin(u)[:, None] * np.cross(axis, x)
    tips = np.array([path.position(float(v)) for v in t])
    return np.asarray(tips + z[:, None] * axis + r[:, None] * m)


def _trial(sweep: Sweep) -> tuple[list[str], float | None, tuple[float, float]]:
    """What is wrong with the meshes of a sweep; its exact volume; its bracket."""
    problems = []
    chord = sweep.profile.max_radius / 200.0
    solids = {side: solid(sweep, chord, side) for side in SIDES}
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
    if sweep.upright() is None and isinstance(sweep.path, Turn):
        rng = np.random.default_rng(1)
        outer = np.array(solids["outer"].to_mesh64().vert_properties)[:, :3]
        near = outer[rng.integers(len(outer), size=60)] + chord * rng.normal(size=(60, 3))
        held = np.any([np.abs(winding(near, p)) > 0.5 for p in turning_pieces(sweep, chord, "outer")], axis=0)
        if (sweep.contains(near) & ~held).any():
            problems.append("a point of the sweep is outside the outer mesh")
    mean, error = _by_rays(sweep)
    if not lo - 6.0 * error <= mean <= hi + 6.0 * error:
        problems.append(f"rays {mean:.9g} +- {error:.2g} outside [{lo:.9g}, {hi:.9g}]")
    return problems, exact, (lo, hi)


def _by_rays(sweep: Sweep) -> tuple[float, float]:
    """Volume by lengths of rays in an odd direction, mm^3, and its standard error."""
    rng = np.random.default_rng(3)
    w = unit(np.array([0.31, 0.17, 0.93]))
    a = unit(np.cross(w, [0.0, 1.0, 0.0]))
    frame = np.array([a, np.cross(w, a), w])
    box = np.array(sweep.bounds)
    corners = np.array([[box[i, 0], box[j, 1], box[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    lo, hi = (corners @ frame.T).min(axis=0), (corners @ frame.T).max(axis=0)
    grid = np.stack(np.meshgrid(*2 * [np.arange(RAYS)], indexing="ij"), axis=-1).reshape(-1, 2)
    places = (grid[None] + rng.random((SETS, 1, 2))) / RAYS
    flat = np.concatenate([lo[:2] + places * (hi - lo)[:2], np.full((*places.shape[:2], 1), lo[2])], axis=2)
    lengths = sweep.ray_intervals(flat.reshape(-1, 3) @ frame, w).lengths.reshape(SETS, -1)
    found = lengths.mean(axis=1) * float(np.prod((hi - lo)[:2]))
    return float(found.mean()), float(found.std(ddof=1) / np.sqrt(SETS))


def gauntlet_block(seed: int) -> Sweep:
    """The sweep of a seed."""
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
    if family == "hard":
        return hard_sweep(HARD[seed // len(FAMILIES) % len(HARD)], cutter, size, rng)
    return Sweep.along(cutter, _motion(family, size, slim, rng))


def _motion(family: str, size: float, slim: float, rng: np.random.Generator) -> Turn:
    """A random motion of a family."""
    axis = unit(rng.normal(size=3) + [0, 0, 1.5])
    wide = family in ("free", "joints")
    travel = float(10.0 ** rng.uniform(-1.0, 2.0 if wide else 1.0))
    angle = float(np.radians(10.0 ** rng.uniform(-1.0, 1.7 if family == "free" else 1.0)))
    way = unit(rng.normal(size=3)) * travel
    end = turned(axis, rng, angle)
    if family == "pivot":  # about a point of the axis, perhaps not quite
        height = slim * rng.uniform(0.0, 1.0)
        way = height * (axis - end) + way * rng.choice([0.0, 1e-3, 0.02])
    elif family == "in plane":
        side = unit(end - (end @ axis) * axis)
        way = travel * (rng.normal() * side + 0.1 * rng.normal() * axis)
    elif family == "along the axis":
        way = axis * travel * rng.choice([-1.0, 1.0])
    elif family == "hardly turning":
        end = turned(axis, rng, float(10.0 ** rng.uniform(-9.0, -3.0)))
    elif family == "rotary":
        angles = rng.uniform(-0.8, 0.8, 2)
        return Turn.rotary((0, 0, 0), way, "ac", angles, angles + rng.normal(size=2) * angle)
    elif family == "joints":
        chain = MACHINES[int(rng.integers(len(MACHINES)))]
        rotary = np.array([row[0] == "R" for row in chain])
        q0 = np.where(rotary, rng.uniform(-0.8, 0.8, len(chain)), rng.uniform(-60.0, 60.0, len(chain)))
        step = rng.normal(size=len(chain)) * np.where(rotary, min(angle, travel / 50.0), 0.5 * travel)
        return Turn.joints(chain, q0, q0 + step)
    elif family == "tilting":  # a point of the axis moves across it, in the plane of the tilt
        side = unit(end - (end @ axis) * axis)
        height = slim * rng.uniform(-0.5, 1.5)
        return Turn.through(
            (0, 0, 0), travel * side * rng.choice([0.0, 1.0]), "axis", axis, end, control_height=height
        )
    return Turn.great_circle(Pose((0, 0, 0), axis), Pose(way, end))
