"""What the cutting edge touches: seconds per instant, and distances against B-rep solids on curved stock.

Random chains of passes into a round bar with random cutters, from a fixed seed; the tool stands at a random
fraction of the last block. Both methods look at the same angles; what only one of them calls engaged is the
error. Blocks that OCCT has no solid for are counted. OCCT runs in this process, so that its start is not measured.
"""

from __future__ import annotations

from collections.abc import Iterator
from time import perf_counter
from typing import Any

import numpy as np

from vmachining.engagement import (
    By,
    CylinderStock,
    Engagement,
    Past,
    RayWorkpiece,
    contact,
    facing_parts,
    sweeps_near,
)
from vmachining.errors import EngineError, SweepError
from vmachining.geometry import Arc, Line
from vmachining.oracle import compare_engagement
from vmachining.sweep import Motion, Pose, Stance, Sweep, Turn
from vmachining.tool import BallNose, BullNose, Cutter, Edge, FlatEnd, Taper

__all__ = ["engage"]

CASES, ANGLES = 40, 90
RADIUS, BOTTOM = 20.0, -30.0


def engage() -> Iterator[dict[str, Any]]:
    """One record per case, and the sum of them."""
    from vmachining.engines.brep import Blank
    from vmachining.engines.brep.workpiece.members import Members

    bar = Blank("cylinder", (0.0, 0.0, BOTTOM), (0.0, 0.0, 0.0), center=(0.0, 0.0), radius=RADIUS)
    stock = CylinderStock((0.0, 0.0), RADIUS, (BOTTOM, 0.0))
    worst, refused, times = 0.0, 0, np.zeros(2)
    warm = True
    for seed in range(CASES):
        rng = np.random.default_rng(seed)
        tool = _tool(rng)
        past = [Past(k, Sweep.along(_tool(rng), _pass(rng))) for k in range(int(rng.integers(1, 8)))]
        path, t = _pass(rng), float(rng.uniform(0.05, 0.95))
        edge, now = Edge(tool), Stance.on(path, t)
        phi = 2.0 * np.pi * (np.arange(ANGLES) + 0.5) / ANGLES
        near = sweeps_near(edge, now, phi, facing_parts(edge, now, phi), past)
        if warm:  # compile time is not ours
            contact(edge, now, RayWorkpiece(stock, near), angles=ANGLES, phase=0.5)
            warm = False
        begin = perf_counter()
        rays = contact(edge, now, RayWorkpiece(stock, near), angles=ANGLES, phase=0.5)
        mine = perf_counter() - begin
        record: dict[str, Any] = {
            "case": "engage", "seed": seed, "tool": tool.name, "motion": type(path).__name__.lower(),
            "sweeps": len(near), "intervals": len(rays.parts.row), "dexel_s": mine,
        }  # fmt: skip
        begin = perf_counter()
        try:
            work = Members(bar, [(one.block, one.sweep) for one in near], By.STOCK)
            built = perf_counter()
            solids = contact(edge, now, work, angles=ANGLES, phase=0.5)
        except (SweepError, EngineError) as exc:
            refused += 1
            yield record | {"refused": str(exc)}
            continue
        theirs = perf_counter() - built
        one, other = (
            Engagement(edge, now, found, name) for found, name in ((solids, "brep"), (rays, "dexel"))
        )
        error = compare_engagement(one, other).worst_mm
        worst, times = max(worst, error), times + [mine, theirs]
        yield record | {"brep_s": theirs, "build_s": built - begin, "error_mm": error}
    done = max(CASES - refused, 1)
    yield {
        "case": "engage", "cases": CASES, "refused": refused, "worst_mm": worst, "dexel_s": times[0] / done,
        "brep_s": times[1] / done,
    }  # fmt: skip


def _tool(rng: np.random.Generator) -> Cutter:
    d = float(rng.uniform(4.0, 14.0))
    corner = float(rng.uniform(0.1, 0.4)) * d
    return (
        FlatEnd(diameter=d, length=40),
        BallNose(diameter=d, length=40),
        BullNose(diameter=d, corner_radius=corner, length=40),
        Taper(diameter=d, taper_deg=float(rng.uniform(1.0, 15.0)), corner_radius=corner, length=40),
    )[int(rng.integers(4))]


def _pass(rng: np.random.Generator) -> Motion:
    """A level or falling line, an arc, a leaning line, a turn; somewhere in the upper part of the bar."""
    p = np.append(rng.uniform(-15.0, 15.0, 2), rng.uniform(-6.0, -0.5))
    q = p + np.append(rng.normal(0.0, 12.0, 2), rng.choice([0.0, -0.7]))
    kind = int(rng.integers(5))
    if kind < 2:
        return Line(p, q)
    if kind == 2:
        return Arc(p, p + np.append(rng.normal(0.0, 15.0, 2), 0.0), angle=float(rng.uniform(-2.0, 2.0)))
    a, b = (np.append(rng.normal(0.0, 0.2, 2), 1.0) for _ in range(2))
    first, last = a / np.linalg.norm(a), (a if kind == 3 else b) / np.linalg.norm(a if kind == 3 else b)
    return Turn.great_circle(Pose(p, first), Pose(q, last))
