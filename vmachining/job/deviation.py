"""The deviation of the finished workpiece from the design: settings of the vectors, and the tables."""

from __future__ import annotations

from math import radians
from typing import Any

from vmachining.engines.protocol import Engine
from vmachining.engines.settings import VectorSettings
from vmachining.job.files import atomic_path
from vmachining.job.folder import ResultFolder
from vmachining.job.gouge import ends_against
from vmachining.job.jobfile import Job
from vmachining.job.model import Vectors
from vmachining.job.stock import design_mesh
from vmachining.job.table import DIGITS


def vector_settings(job: Job) -> VectorSettings:
    """What a job asks of discrete vectors.

    Raises InputError: Lengths or angles that do not go together, or an error above the radius of the smallest tool.
    """
    from vmachining.engines.vectors import spacing_for

    keys = job.keys.vectors or Vectors()
    spacing = keys.spacing_mm
    if keys.error_mm is not None:
        spacing = spacing_for(keys.error_mm, min(tool.profile.max_radius for tool in job.tools.values()))
    return VectorSettings(
        mode=keys.mode,
        pitch=keys.pitch_mm,
        spacing=spacing,
        theta_v=None if keys.theta_v_deg is None else radians(keys.theta_v_deg),
        theta_sharp=radians(keys.theta_sharp_deg),
        allowance=keys.allowance_mm,
        depth=keys.depth_mm,
        casting=keys.casting_mm,
    )


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
            "pitch_mm": engine.pitch,
            "spacing_mm": engine.spacing,
            "theta_v_deg": engine.theta_v_deg,
            "mode": engine.settings.mode,
        }
    else:
        return None
    import polars as pl

    text = {"kind": pl.String, "state": pl.String, "block": pl.Int64, "facet": pl.Int64}
    frame = pl.DataFrame(columns, schema={name: text.get(name, pl.Float64) for name in columns})
    with place.making("deviation.csv", "deviation.parquet"):
        with atomic_path(place.path / "deviation.parquet") as temporary:
            frame.write_parquet(temporary)
        with atomic_path(place.path / "deviation.csv") as temporary:
            frame.write_csv(temporary, float_precision=DIGITS)
    return {
        "deviation": told,
        "max_overcut_mm": told["max_overcut_mm"],
        "max_undercut_mm": told["max_undercut_mm"],
        "within_tolerance": told["within_tolerance"],
    }
