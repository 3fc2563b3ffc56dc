"""deviation.html: the part, the vectors on it, and how far the workpiece is from it, in three dimensions."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vmachining.engines.dexel import DexelEngine
from vmachining.engines.vectors import VectorEngine
from vmachining.errors import InputError
from vmachining.job import RunResult
from vmachining.job.deviation import ends_against
from vmachining.job.stock import design_mesh
from vmachining.report.figures import write_page
from vmachining.report.scene import Layer, Scene
from vmachining.report.thin import thin_mesh
from vmachining.stock import MeshStock

MOST_POINTS = 40_000
"""Drawn; those outside of the tolerance first."""

DRAWN_MM = 0.1
"""Share of the part's size that the largest vector is drawn with."""


def write_deviation(result: RunResult, path: Path) -> None:
    """Write the page of a result of the vectors or the dexel engine.

    Raises InputError: Another engine made the result.
    """
    engine, keys = result.stock, result.job.keys.design
    if keys is not None and isinstance(engine, DexelEngine):
        scene = ends_scene(result, engine, keys.tolerance_mm)
    elif keys is not None and isinstance(engine, VectorEngine):
        scene = deviation_scene(engine, keys.tolerance_mm)
    else:
        raise InputError("only the engines vectors and dexel measure a deviation")
    write_page(
        path, [], kind="deviation from the design", name=result.job.name,
        subtitle=f"tolerance {keys.tolerance_mm:g} mm · all lengths in mm", scene=scene,
    )  # fmt: skip


def ends_scene(result: RunResult, engine: DexelEngine, tolerance: float) -> Scene:
    """The part in grey, and the ends of rays outside of the tolerance at their feet, coloured by deviation."""
    part = design_mesh(result.job)
    assert part is not None
    columns, told = ends_against(engine, part, tolerance)
    points = np.column_stack([columns[name][:MOST_POINTS] for name in ("x_mm", "y_mm", "z_mm")])
    block = np.array([-1 if k is None else k for k in columns["block"][:MOST_POINTS]], dtype=np.int64)
    values = np.asarray(columns["deviation_mm"], dtype=np.float64)[:MOST_POINTS]
    reach = max(3.0 * tolerance, 0.2 * max(told["max_overcut_mm"], told["max_undercut_mm"]))
    layer = Layer(name="ends of rays outside of the tolerance", points=points, values=values, blocks=block)
    return _scene(part, [layer], reach)


def _scene(mesh: MeshStock, layers: list[Layer], reach: float) -> Scene:
    thin = thin_mesh(mesh.vertices, mesh.triangles, np.zeros(len(mesh.triangles), dtype=np.int64))
    part = Layer(
        name="design", points=thin.vertices, triangles=thin.triangles, colour="#c9d0d9", opacity=0.35
    )
    return Scene(
        title="Where it was measured", layers=[part, *layers], reach=reach,
        words="Red: too much is removed, blue: material is left; hover to see the values of a point",
    )  # fmt: skip


def deviation_scene(engine: VectorEngine, tolerance: float) -> Scene:
    """The part in grey; feet of vectors coloured by deviation; vectors outside of the tolerance as lines."""
    part = engine.part
    shown = engine.deviation(tolerance, outside_only=False, most=MOST_POINTS // 2)
    outside = engine.deviation(tolerance, most=MOST_POINTS // 2)
    largest = float(np.abs(outside.deviation).max(initial=0.0))
    named = ((shown, "all vectors (thinned)", 2.0), (outside, "outside of the tolerance", 4.0))
    layers = [
        Layer(name=name, points=found.point, values=found.deviation, blocks=found.block, size=size)
        for found, name, size in named if len(found.point)
    ]  # fmt: skip
    if largest > 0.0:
        stretch = DRAWN_MM * part.size / largest
        lines = np.full((3 * len(outside.point), 3), np.nan)
        lines[0::3] = outside.point
        lines[1::3] = outside.point + stretch * outside.deviation[:, None] * outside.normal
        layers.append(Layer(name=f"deviation, {stretch:.3g} times", points=lines))
    return _scene(part.mesh, layers, max(3.0 * tolerance, 0.2 * largest))
