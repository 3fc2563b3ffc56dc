"""Other ways of computing, judged by the reference set: a height map, voxels, one global mesh, plain OCCT booleans.

Every method is given the exact sweep of every block (`Sweep`, `engines.mesh.solid`, `engines.brep.solids`), so what is
measured is the representation of the workpiece alone: programs that approximate sweeps as well do worse.

| method | workpiece | a block removes |
|---|---|---|
| `height map` | one height per cell of the plan | what upright lines lose above where they enter the sweep |
| `voxels` | cubes, in or out | those whose middle lies in the sweep, counted along upright lines |
| `global mesh` | one manifold3d solid | the difference of its volume before and after; sweeps by facets, fair on average |
| `plain OCCT` | one B-rep solid, boolean after boolean | the difference of its volume before and after |
"""

from __future__ import annotations

import platform
from collections.abc import Callable, Iterator, Sequence
from importlib.metadata import version
from pathlib import Path
from time import process_time
from typing import Any, Protocol

import numpy as np
import polars as pl

from benchmarks.sets import CaseSet
from vmachining.errors import EngineError, SweepError
from vmachining.job import Job, Scene
from vmachining.job.stock import raw_stock
from vmachining.oracle import Comparison, compare
from vmachining.stock import Stock
from vmachining.sweep import Sweep

__all__ = ["METHODS", "case_results", "methods", "methods_table", "shipped_set"]

PITCH, CHORD = 0.25, 0.02
"""mm: cells of heights and voxels; facets of the global mesh."""

BLOCK_SECONDS, CASE_SECONDS = 60.0, 180.0
"""Of a processor: what one block may take, and the time after which no further block of a case is begun."""


class Workpiece(Protocol):
    """What a method keeps; `cut` gives mm^3."""

    def cut(self, sweep: Sweep) -> float: ...


class HeightMap:
    """Heights over the middles of cells; what a sweep undercuts is lost with all that stands on it."""

    def __init__(self, stock: Stock) -> None:
        self.places, self.area = _cells(stock)
        rays = stock.crossings(self.places)
        self.floor, self.top = np.zeros((2, len(self.places)))
        inside = rays.counts > 0
        first = np.cumsum(rays.counts)[inside] - rays.counts[inside]
        last = np.cumsum(rays.counts)[inside] - 1
        self.floor[inside], self.top[inside] = rays.enter[first], rays.leave[last]

    def cut(self, sweep: Sweep) -> float:
        """Down to where the line from below enters the sweep."""
        near = _near(self.places, sweep)
        rays = sweep.ray_intervals(np.pad(self.places[near], ((0, 0), (0, 1))), (0.0, 0.0, 1.0))
        hit = rays.counts > 0
        first = np.cumsum(rays.counts)[hit] - rays.counts[hit]
        at = near[hit]
        new = np.clip(rays.enter[first], self.floor[at], self.top[at])
        removed = float((self.top[at] - new).sum()) * self.area
        self.top[at] = new
        return removed


class Voxels:
    """Cubes of the size of a cell, by their middles."""

    def __init__(self, stock: Stock) -> None:
        self.places, self.area = _cells(stock)
        low, high = stock.bounds[:, 2]
        count = int(np.ceil((high - low) / PITCH))
        self.low, self.step = float(low), float(high - low) / count
        self.full = np.zeros((len(self.places), count), dtype=np.bool_)
        self._mark(np.arange(len(self.places)), stock.crossings(self.places), value=True)

    def _mark(self, at: Any, rays: Any, *, value: bool) -> int:
        """Set the cubes on intervals of upright lines; how many changed."""
        line = np.repeat(at, rays.counts)
        levels = [
            np.clip(np.ceil((ends - self.low) / self.step - 0.5), 0, self.full.shape[1]).astype(np.int64)
            for ends in (rays.enter, rays.leave)
        ]
        changed = 0
        for k, a, b in zip(line.tolist(), levels[0].tolist(), levels[1].tolist(), strict=True):
            if b > a:
                part = self.full[k, a:b]
                changed += int((part != value).sum())
                part[:] = value
        return changed

    def cut(self, sweep: Sweep) -> float:
        """Cubes whose middle the sweep holds."""
        near = _near(self.places, sweep)
        rays = sweep.ray_intervals(np.pad(self.places[near], ((0, 0), (0, 1))), (0.0, 0.0, 1.0))
        return self._mark(near, rays, value=False) * self.area * self.step


class GlobalMesh:
    """One solid of triangles."""

    def __init__(self, stock: Stock) -> None:
        from vmachining.engines.mesh.solids import manifold

        around, _ = stock.mesh(CHORD)
        self.solid = manifold(around.vertices, around.triangles)
        self.volume = float(self.solid.volume())

    def cut(self, sweep: Sweep) -> float:
        """manifold3d tells of errors by a status; an empty solid is none."""
        from manifold3d import Error

        from vmachining.engines.mesh import solid

        self.solid = self.solid - solid(sweep, chord=CHORD, side="fair")
        if self.solid.status() != Error.NoError:
            raise EngineError(f"manifold3d: {self.solid.status()}", engine="mesh")
        before, self.volume = self.volume, float(self.solid.volume())
        return before - self.volume


class PlainOcct:
    """One solid of faces; volumes by OCCT's own integral."""

    def __init__(self, stock: Stock) -> None:
        from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
        from OCP.gp import gp_Pnt

        self.shape = BRepPrimAPI_MakeBox(*(gp_Pnt(*p) for p in stock.bounds.tolist())).Shape()
        self.volume = _occt_volume(self.shape)

    def cut(self, sweep: Sweep) -> float:
        """One boolean after the other, no fuzzy value, nothing asked but whether it is done."""
        from vmachining.engines.brep import solids
        from vmachining.engines.brep.occt.booleans import minus

        self.shape = minus(self.shape, [part.shape for part in solids(sweep)], 0.0)
        before, self.volume = self.volume, _occt_volume(self.shape)
        return before - self.volume


METHODS: dict[str, tuple[Callable[[Stock], Workpiece], str]] = {
    "height map": (HeightMap, f"cells of {PITCH:g} mm"),
    "voxels": (Voxels, f"cubes of {PITCH:g} mm"),
    "global mesh": (GlobalMesh, f"facets within {CHORD:g} mm"),
    "plain OCCT": (PlainOcct, f"default tolerances, {BLOCK_SECONDS:g} s a block, {CASE_SECONDS:g} s a case"),
}
"""What makes the workpiece, and its settings."""


def _cells(stock: Stock) -> tuple[Any, float]:
    """Middles of cells (n, 2) over the plan of a stock, and their area."""
    low, high = stock.bounds[:, :2]
    counts = np.ceil((high - low) / PITCH - 1e-9).astype(int)
    cell = (high - low) / counts
    axes = [low[k] + cell[k] * (np.arange(counts[k]) + 0.5) for k in (0, 1)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2), float(cell.prod())


def _near(places: Any, sweep: Sweep) -> Any:
    """Indices of places below or above the box of a sweep."""
    low, high = sweep.bounds[:, :2]
    return np.flatnonzero(((places >= low) & (places <= high)).all(axis=1))


def _occt_volume(shape: Any) -> float:
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    found = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, found)
    return float(found.Mass())


def case_cuts(job_file: Path, method: str) -> Iterator[tuple[float, float]]:
    """(mm^3 removed, seconds of the processor since the begin) of every cut of a case, in order."""
    begin = process_time()
    job = Job.load(job_file)
    workpiece = METHODS[method][0](raw_stock(job))
    for _, tool, path in Scene.of(job).cuts:
        yield workpiece.cut(Sweep.along(job.tools[tool].cutter, path)), process_time() - begin


def case_results(
    job_file: Path, method: str, *, seconds: float = BLOCK_SECONDS, limit: float = CASE_SECONDS
) -> dict[str, Any]:
    """block, removed_mm3 (lists), why it ended early (or None), seconds of the processor.

    The method runs in a separate process, for OCCT may crash or not come back from a block.
    """
    from vmachining.engines.brep import isolated_steps

    scene = Scene.of(Job.load(job_file))
    removed = dict.fromkeys((block.number for block in scene.blocks), 0.0)
    block, ended, spent = 0, None, 0.0
    found = isolated_steps(case_cuts, job_file, method, seconds=seconds)
    try:
        for block, _, _ in scene.cuts:
            if spent > limit:
                raise EngineError(f"{limit:g} s are over", engine=method)
            volume, spent = next(found)
            removed[block] += volume
    except (EngineError, SweepError) as exc:  # a solid that is wrong once is wrong for good
        ended = f"block {block}: {exc.message}"
        removed = {key: value for key, value in removed.items() if key < block}
    finally:
        found.close()
    return {"block": list(removed), "removed_mm3": list(removed.values()), "ended": ended, "seconds": spent}


def methods(folder: Path | None = None, names: Sequence[str] = tuple(METHODS)) -> Iterator[dict[str, Any]]:
    """One record per method and program; last, all of them as a table."""
    folder = folder or shipped_set()
    records: list[dict[str, Any]] = []
    for method in names:
        for case in CaseSet.load(folder).cases:
            record = {
                "case": "methods",
                "method": method,
                "settings": METHODS[method][1],
                "program": case.name,
            }
            found = case_results(folder / case.name / "job.toml", method)
            records.append(record | _judged(found, compare(_table(found), folder / case.name)))
            yield records[-1]
    yield {"case": "methods", "table": methods_table(records)}


def shipped_set() -> Path:
    """The reference set that comes with the package."""
    from vmachining.cli.demo import demo_job

    return demo_job("slot").parent.parent / "reference_pack"


def _table(found: dict[str, Any]) -> pl.DataFrame:
    return pl.DataFrame({"block": found["block"] or [0], "removed_mm3": found["removed_mm3"] or [0.0]})


def _judged(found: dict[str, Any], said: Comparison) -> dict[str, Any]:
    """How many blocks that remove something are inside, outside or unanswered; errors relative to the block."""
    rows = said.blocks.filter((pl.col("hi_mm3") > 0.0) & (pl.col("status") != "idle"))
    answered = rows.filter(pl.col("removed_mm3").is_not_null())
    off = answered.filter(pl.col("status").is_in(("low", "high")))
    errors = answered.filter(pl.col("reference_mm3") > 0.0)["relative_error"].abs()
    return {
        "judged": len(rows), "inside": len(answered) - len(off), "outside": len(off),
        "unanswered": len(rows) - len(answered),
        "median_error": errors.median(), "worst_error": errors.max(),
        "error_of_the_sum": None if found["ended"] else (said.removed_mm3 - said.total[1]) / said.total[1],
        "seconds": found["seconds"], "ended": found["ended"],
    }  # fmt: skip


def methods_table(records: Sequence[dict[str, Any]]) -> str:
    """Markdown: one row per program, one column per method, blocks inside of blocks judged; totals and versions below."""
    names = list(dict.fromkeys(r["method"] for r in records))
    programs = list(dict.fromkeys(r["program"] for r in records))
    cell = {(r["program"], r["method"]): r for r in records}
    lines = ["| program | " + " | ".join(names) + " |", "|---|" + "---|" * len(names)]
    for program in programs:
        shown = []
        for name in names:
            r = cell.get((program, name))
            if r is None:
                shown.append("not run")
                continue
            share = r.get("median_error")
            error = (
                ""
                if share is None
                else f", {100.0 * share:.0f} %"
                if share >= 0.1
                else f", {100.0 * share:.2g} %"
            )
            shown.append(
                f"{r['inside']} of {r['judged']}{error}"
                + (f" (gave up after {r['judged'] - r['unanswered']} blocks)" if r["ended"] else "")
            )
        lines.append(f"| {program} | " + " | ".join(shown) + " |")
    total = []
    for name in names:
        mine = [r for r in records if r["method"] == name]
        inside, judged = (sum(r[key] for r in mine) for key in ("inside", "judged"))
        seconds = sum(r.get("seconds") or 0.0 for r in mine)
        total.append(f"**{inside} of {judged}**, {seconds:.0f} s")
    lines.append("| all, processor time | " + " | ".join(total) + " |")
    settings = "; ".join(f"{name}: {METHODS[name][1]}" for name in names)
    versions = ", ".join(
        f"{name} {version(name)}" for name in ("vmachining", "numpy", "manifold3d", "cadquery-ocp")
    )
    return "\n".join([*lines, "", f"{settings}. Python {platform.python_version()}, {versions}."]) + "\n"
