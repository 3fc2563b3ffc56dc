"""The deviation of the finished workpiece from the design: tables, and how far the ends of rays are off."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vmachining.engines.protocol import Engine
from vmachining.job.files import atomic_path, write_table
from vmachining.job.folder import ResultFolder
from vmachining.job.jobfile import Job
from vmachining.job.stock import design_mesh
from vmachining.job.table import DIGITS
from vmachining.stock import MeshStock

if TYPE_CHECKING:
    from vmachining.engines.dexel import DexelEngine


def deviation_tables(job: Job, engine: Engine, place: ResultFolder) -> dict[str, Any] | None:
    """Write deviation.csv and deviation.parquet; the keys of the summary. None for engines that measure none."""
    design = job.keys.design
    if design is None:
        return None
    from vmachining.engines.dexel import DexelEngine
    from vmachining.engines.vectors import VectorEngine

    if isinstance(engine, DexelEngine):
        part = design_mesh(job)
        assert part is not None
        columns, told = ends_against(engine, part, design.tolerance_mm)
    elif isinstance(engine, VectorEngine):
        found = engine.deviation(design.tolerance_mm)
        columns = found.columns(design.tolerance_mm)
        told = found.summary | {
            "pitch_mm": engine.pitch, "spacing_mm": engine.spacing, "theta_v_deg": engine.theta_v_deg,
            "mode": engine.settings.mode,
        }  # fmt: skip
    else:
        return None
    import polars as pl

    text = {"kind": pl.String, "state": pl.String, "block": pl.Int64, "facet": pl.Int64}
    frame = pl.DataFrame(columns, schema={name: text.get(name, pl.Float64) for name in columns})
    with place.making("deviation.csv", "deviation.parquet"):
        write_table(frame, place.path / "deviation.parquet")
        with atomic_path(place.path / "deviation.csv") as temporary:
            frame.write_csv(temporary, float_precision=DIGITS)
    return {
        "deviation": told,
        **{name: told[name] for name in ("max_overcut_mm", "max_undercut_mm", "within_tolerance")},
    }


MOST_ROWS = 100_000
"""Rows of the table; those that deviate most."""

STEP_MM = 1e-4
"""Of the differences that give the direction of a distance."""


def ends_against(
    engine: DexelEngine, part: MeshStock, tolerance: float
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Columns of deviation.csv and its summary, as discrete vectors have them.

    A row is an end of a ray: its foot on the design, the direction from there outwards, the distance (> 0 material is left,
    < 0 too much is taken), and the block that made it.
    """
    points, blocks, axes = engine.ends()
    distance = part.signed_distance(points)
    over, under = distance < -tolerance, distance > tolerance
    kept = np.flatnonzero(over | under)
    kept = kept[np.argsort(-np.abs(distance[kept]), kind="stable")][:MOST_ROWS]
    # unit directions in which the distance to the part grows
    steps, there = STEP_MM * np.eye(3), points[kept]
    slopes = [part.signed_distance(there + step) - part.signed_distance(there - step) for step in steps]
    normal = np.column_stack(slopes) if len(kept) else np.zeros((0, 3))
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.divide(normal, size, out=np.zeros_like(normal), where=size > 0.0)
    foot = points[kept] - distance[kept, None] * normal
    names = np.array(["ray along x", "ray along y", "ray along z"])
    columns: dict[str, Any] = {
        "kind": names[axes[kept]].tolist(), "state": np.where(over[kept], "over", "under").tolist(),
        "x_mm": foot[:, 0], "y_mm": foot[:, 1], "z_mm": foot[:, 2],
        "nx": normal[:, 0], "ny": normal[:, 1], "nz": normal[:, 2],
        "length_mm": distance[kept], "deviation_mm": distance[kept],
        "block": [None if k < 0 else k for k in blocks[kept].tolist()], "facet": [None] * len(kept),
    }  # fmt: skip
    total = len(distance)
    summary = {
        "vectors": total, "upright_vectors": int((axes == 2).sum()), "normal_vectors": int((axes != 2).sum()),
        "tolerance_mm": tolerance,
        "max_overcut_mm": max(float(-distance.min(initial=0.0)), 0.0),
        "max_undercut_mm": max(float(distance.max(initial=0.0)), 0.0),
        "within_tolerance": 1.0 - int((over | under).sum()) / total if total else None,
        "over": int(over.sum()), "under": int(under.sum()), "consumed": 0, "entered_from_behind": 0, "cut_beneath": 0,
        "part_outside_stock": 0, "rows": len(kept), "pitch_mm": engine.spacing, "spacing_mm": engine.spacing,
        "theta_v_deg": None, "mode": "rays",
    }  # fmt: skip
    return columns, summary
