"""Profiles, paths, sweeps and stocks as arrays and JSON, for checkpoints (`vmachining.checkpoint`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vmachining.arrays import Floats
from vmachining.geometry import Arc, Line, Path
from vmachining.interval import Interval
from vmachining.numerics.series import Series
from vmachining.stock import BoxStock, CylinderStock, MeshStock, StepStock, Stock
from vmachining.sweep import Sweep, Turn
from vmachining.tool import Profile

PATH = 10
"""Numbers that say a path."""

LINE, TURN = -1.0, -2.0
"""In the place of an arc's axis."""


def packed_bracket(bracket: Interval) -> list[float]:
    """lo, estimate, hi, and whether they are proven; see `bracket_of`."""
    return [*bracket, bracket.proven]


def bracket_of(saved: Sequence[float]) -> Interval:
    """What `packed_bracket` was given."""
    lo, estimate, hi, proven = saved
    return Interval(lo, estimate, hi, bool(proven))


def packed_profiles(profiles: Sequence[Profile]) -> dict[str, Any]:
    """Arrays by name; see `profiles_of`."""
    arrays: dict[str, Any] = {}
    for k, p in enumerate(profiles):
        arrays |= {f"points{k}": p.points, f"centers{k}": p.centers, f"radii{k}": p.radii}
    return arrays


def profiles_of(arrays: Mapping[str, Floats]) -> list[Profile]:
    """What `packed_profiles` was given."""
    found: list[Profile] = []
    while f"points{len(found)}" in arrays:
        k = len(found)
        found.append(Profile(arrays[f"points{k}"], arrays[f"centers{k}"], arrays[f"radii{k}"]))
    return found


def packed_path(path: Path | Turn, row: Floats) -> None:
    """A path into a row (PATH,): start, end or centre, axis (`LINE`, `TURN`), angle, rise, 0.

    Of a `Turn` only its ends: how it turns between them is in `packed_sweeps`.
    """
    row[:3] = path.start
    if isinstance(path, Arc):
        row[3:6], row[6:10] = path.center, (path.axis, path.angle, path.rise, 0.0)
    else:
        row[3:6], row[6:10] = path.end, (LINE if isinstance(path, Line) else TURN, 0.0, 0.0, 0.0)


def path_of(row: Floats) -> Path:
    """What `packed_path` was given; not a `Turn`."""
    if row[6] == LINE:
        return Line(row[:3], row[3:6])
    return Arc(row[:3], row[3:6], int(row[6]), angle=float(row[7]), rise=float(row[8]))


def packed_sweeps(sweeps: Sequence[Sweep]) -> dict[str, Any]:
    """Arrays by name; see `sweeps_of`."""
    profiles = {id(sweep.profile): sweep.profile for sweep in sweeps}
    number = {key: k for k, key in enumerate(profiles)}
    paths = np.zeros((len(sweeps), PATH))
    for sweep, row in zip(sweeps, paths, strict=True):
        packed_path(sweep.path, row)
    turns = [sweep.path for sweep in sweeps if isinstance(sweep.path, Turn)]
    return {
        "paths": paths, "tools": np.array([number[id(sweep.profile)] for sweep in sweeps], dtype=np.int64),
        **packed_turns(turns), **packed_profiles(list(profiles.values())),
    }  # fmt: skip


def packed_turns(turns: Sequence[Turn]) -> dict[str, Any]:
    """Arrays by name; see `turns_of`."""
    return {
        **_packed_series("tip", [turn.tip_series for turn in turns]),
        **_packed_series("axis", [turn.axis_series for turn in turns]),
    }


def turns_of(paths: Floats, arrays: Mapping[str, Any]) -> list[Turn]:
    """What `packed_turns` was given; paths : (n, PATH) their rows of `packed_path`."""
    series = zip(paths, _series_of("tip", arrays), _series_of("axis", arrays), strict=True)
    return [Turn(row[:3], row[3:6], tip, axis) for row, tip, axis in series]


def sweeps_of(arrays: Mapping[str, Any]) -> list[Sweep]:
    """What `packed_sweeps` was given."""
    profiles, found = profiles_of(arrays), list[Sweep]()
    turns = iter(turns_of(arrays["paths"][arrays["paths"][:, 6] == TURN], arrays))
    for row, tool in zip(arrays["paths"], arrays["tools"].tolist(), strict=True):
        path = next(turns) if row[6] == TURN else path_of(row)
        found.append(Sweep.along(profiles[tool], path))
    return found


def _packed_series(name: str, series: Sequence[Series]) -> dict[str, Any]:
    """counts (n,), frequencies (m,) and terms (m, 2, 3) of all, one after the other."""
    frequencies = [np.zeros(0), *(each.frequencies for each in series)]
    terms = [np.zeros((0, 2, 3), dtype=complex), *(each.terms for each in series)]
    return {
        f"{name}_counts": np.array([len(each.frequencies) for each in series], dtype=np.int64),
        f"{name}_frequencies": np.concatenate(frequencies), f"{name}_terms": np.concatenate(terms),
    }  # fmt: skip


def _series_of(name: str, arrays: Mapping[str, Any]) -> list[Series]:
    ends = np.cumsum(arrays[f"{name}_counts"])[:-1]
    frequencies, terms = arrays[f"{name}_frequencies"], arrays[f"{name}_terms"]
    if terms.shape != (len(frequencies), 2, 3):
        raise ValueError(f"{len(frequencies)} frequencies with terms of shape {terms.shape}")
    if not len(arrays[f"{name}_counts"]):
        return []
    return [Series(*pair) for pair in zip(np.split(frequencies, ends), np.split(terms, ends), strict=True)]


def packed_stock(stock: Stock) -> tuple[dict[str, Any], dict[str, Any]]:
    """JSON and arrays; see `stock_of`."""
    if isinstance(stock, BoxStock):
        return {"kind": "box", "low": stock.lo.tolist(), "high": stock.hi.tolist()}, {}
    if isinstance(stock, CylinderStock):
        return {"kind": "cylinder", "center": stock.center, "radius": stock.radius, "z": stock.z}, {}
    if not isinstance(stock, MeshStock):
        raise TypeError(f"a stock of type {type(stock).__name__} has no checkpoint")
    arrays = {"vertices": stock.vertices, "triangles": stock.triangles}
    if not isinstance(stock, StepStock):
        return {"kind": "mesh"}, arrays
    state = {"kind": "step", "file": stock.file, "exact_mm3": stock.exact_mm3, "chord": stock.chord}
    return state, arrays | {"curved": stock.curved}


def stock_of(state: Mapping[str, Any], arrays: Mapping[str, Any]) -> Stock:
    """What `packed_stock` was given."""
    match state["kind"]:
        case "box":
            return BoxStock(state["low"], state["high"])
        case "cylinder":
            (x, y), (low, high) = state["center"], state["z"]
            return CylinderStock((x, y), float(state["radius"]), (low, high))
    mesh = mesh_of(arrays["vertices"], arrays["triangles"])
    if state["kind"] == "mesh":
        return mesh
    return StepStock(
        mesh, file=str(state["file"]), exact_mm3=float(state["exact_mm3"]), curved=arrays["curved"],
        chord=float(state["chord"]),
    )  # fmt: skip


def mesh_of(vertices: Floats, triangles: Any) -> MeshStock:
    """A mesh whose triangles have their corners among the vertices: kernels do not ask again."""
    if len(triangles) and not (triangles.min() >= 0 and triangles.max() < len(vertices)):
        raise ValueError("a triangle has corners that are not there")
    return MeshStock(vertices, triangles)
