"""How far the finished surface is from the design: colours for the view, and the worst places with their blocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vmachining.arrays import Floats
from vmachining.job import RunResult
from vmachining.job.stock import design_mesh
from vmachining.report.numbers import number
from vmachining.report.thin import ThinMesh

COLOURED = 0.95
"""Share of the cut surface whose deviations the colours resolve; the rest has the colours of the ends."""

PLACES = 5
"""Listed of overcut and of material left, each at least `APART` of the part's size from the next."""

APART = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class Deviation:
    """distance : (n,) mm of the vertices of a surface to the design, > 0 material is left, < 0 too much is taken.

    tolerance : mm, of the job. reach : mm, where the colours end.
    """

    distance: Floats
    tolerance: float
    reach: float


def deviation_of(result: RunResult, mesh: ThinMesh) -> Deviation | None:
    """Distances of the vertices of a drawn surface to the `[design]` of its job; None without one."""
    part, keys = design_mesh(result.job), result.job.keys.design
    if part is None or keys is None or not len(mesh.vertices):
        return None
    distance = part.signed_distance(mesh.vertices)
    cut = np.unique(mesh.triangles[mesh.block >= 0])
    spread = np.quantile(np.abs(distance[cut]), COLOURED) if len(cut) else 0.0
    return Deviation(distance, keys.tolerance_mm, float(max(keys.tolerance_mm, spread)))


def worst_places(mesh: ThinMesh, deviation: Deviation) -> list[tuple[str, ...]]:
    """kind, mm, x, y, z and block of the largest overcuts and of the most material left by a cut, beyond the tolerance."""
    cut = mesh.block >= 0
    block = np.full(len(mesh.vertices), -1)
    block[mesh.triangles[cut].ravel()] = np.repeat(mesh.block[cut], 3)
    apart = APART * float(np.ptp(mesh.vertices, axis=0).max())
    rows = []
    for kind, sense in (("too much is taken", -1.0), ("material is left", 1.0)):
        depth = np.where(block >= 0, sense * deviation.distance, -np.inf)
        for _ in range(PLACES):
            worst = int(np.argmax(depth))
            if not depth[worst] > deviation.tolerance:
                break
            place = mesh.vertices[worst]
            rows.append(
                (kind, number(float(depth[worst]), 3), *(f"{v:.2f}" for v in place), str(block[worst]))
            )
            depth[np.linalg.norm(mesh.vertices - place, axis=1) < apart] = -np.inf
    return rows
