"""Discrete vectors on the mould cover of the sources (spec E.7, B2), re-created: 1000 x 955 x 340 mm, ball D30, 78,524 blocks.

Lips from z = 0 to 20, rim flats 10 wide, walls of 5 degrees draft up to the top at z = 340, and 111 blind slots in it,
15 x 200 x 8 mm, which the ball cannot enter. Passes along x, straight blocks between places found by the drop cutter; blocks
that bridge an edge cut its corner.

`python -m benchmarks.mould DIR` writes the job at its size: program, part, stock, for `vmachining run --engine vectors`.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from itertools import pairwise
from math import cos, radians, sin, tan
from pathlib import Path
from time import process_time
from typing import Any, Literal

import numpy as np
from manifold3d import Manifold

from benchmarks.vector_batch import ball_grid
from benchmarks.vectors import peak_mb
from vmachining.arrays import Floats
from vmachining.engines.protocol import Options, Request
from vmachining.engines.vectors import VectorEngine, VectorSettings, simulation_spacing
from vmachining.geometry import Line
from vmachining.job.stock import write_stock
from vmachining.stock import BoxStock, MeshStock, Triangles
from vmachining.sweep import Sweep
from vmachining.sweep.ball import ball_block
from vmachining.tool import BallNose

__all__ = ["blocks", "body", "vectors_mould", "vectors_mould_small", "write_job"]

LENGTH, WIDTH, HEIGHT, RIM, DRAFT = 1000.0, 955.0, 340.0, 20.0, radians(5.0)
BALL, PASSES, NODES = 15.0, 268, 293
SLOT, SLOT_PITCH, SLOT_LENGTH, SLOT_DEPTH = 15.0, 25.0, 200.0, 8.0
COLUMNS, ROWS = 37, (-300.0, 0.0, 300.0)
TOP = np.array([LENGTH, WIDTH]) / 2.0 - 10.0 - (HEIGHT - RIM) * tan(DRAFT)
"""(2,) half lengths of the top: 462.0 and 439.5."""

WINDOW = (8400, 8020)
"""Vectors of the published grid at 0.1 mm: 840 x 802 mm."""

CASTING, DEEPEST, ERROR = 2.0, 10.0, 0.005

TOGETHER, TOLERANCE = 1024, 0.05
"""Blocks that the engine gets at once, as from `run`; mm, of the table."""


def blocks() -> Floats:
    """(78525, 3) mm: centres of the ball."""
    x, y = np.linspace(-LENGTH / 2, LENGTH / 2, NODES), np.linspace(-WIDTH / 2, WIDTH / 2, PASSES)
    at = np.array([(a, b) for k, b in enumerate(y) for a in (x if k % 2 == 0 else x[::-1])])
    path = np.column_stack([at, _centre(at)])
    return np.concatenate([path[:1] + [-1.0, 0.0, 0.0], path])


def _slot(at: Floats) -> Floats:
    """(n,) mm to the nearest wall of the slot that a place is in; negative outside."""
    column = np.clip(np.round(at[:, 0] / SLOT_PITCH), -(COLUMNS // 2), COLUMNS // 2) * SLOT_PITCH
    row = np.array(ROWS)[np.abs(at[:, 1:] - np.array(ROWS)).argmin(axis=1)]
    return np.asarray(
        np.minimum(SLOT / 2 - np.abs(at[:, 0] - column), SLOT_LENGTH / 2 - np.abs(at[:, 1] - row))
    )


def _centre(at: Floats) -> Floats:
    """(n,) mm: lowest height of the ball's centre at which it touches the body: edges, walls, rim."""
    inside = np.maximum(_slot(at), 0.0)
    over = HEIGHT + np.sqrt(BALL**2 - inside**2)
    beyond = (np.abs(at) - TOP).max(axis=1)
    edge = HEIGHT + np.sqrt(np.clip(BALL**2 - beyond**2, 0.0, None))
    wall = HEIGHT + (BALL - beyond * cos(DRAFT)) / sin(DRAFT)
    off = np.where(wall <= HEIGHT + BALL * sin(DRAFT), np.maximum(wall, RIM + BALL), edge)
    return np.asarray(np.where(beyond <= 0.0, over, off))


def _height(x: Floats, y: Floats) -> Floats:
    """(n, m) mm of the top within the window: slots and what is between them."""
    column = np.clip(np.round(x / SLOT_PITCH), -(COLUMNS // 2), COLUMNS // 2) * SLOT_PITCH
    row = np.array(ROWS)[np.abs(y[:, None] - np.array(ROWS)).argmin(axis=1)]
    slotted = (np.abs(x - column) < SLOT / 2)[:, None] & (np.abs(y - row) < SLOT_LENGTH / 2)
    return np.where(slotted, HEIGHT - SLOT_DEPTH, HEIGHT)


def body() -> MeshStock:
    """The cover as a closed mesh."""
    x, y = LENGTH / 2, WIDTH / 2
    foot = Manifold.cube((LENGTH, WIDTH, RIM)).translate((-x, -y, 0.0))
    signs = [(a, b) for a in (-1.0, 1.0) for b in (-1.0, 1.0)]
    corners = [(a * (x - 10.0), b * (y - 10.0), RIM) for a, b in signs]
    corners += [(a * TOP[0], b * TOP[1], HEIGHT) for a, b in signs]
    slot = Manifold.cube((SLOT, SLOT_LENGTH, SLOT_DEPTH + 1.0)).translate(
        (-SLOT / 2, -SLOT_LENGTH / 2, HEIGHT - SLOT_DEPTH)
    )
    slots = [
        slot.translate((k * SLOT_PITCH, row, 0.0))
        for k in range(-(COLUMNS // 2), COLUMNS // 2 + 1)
        for row in ROWS
    ]
    mesh = (foot + Manifold.hull_points(np.array(corners)) - Manifold.compose(slots)).to_mesh64()
    return MeshStock(np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts, dtype=np.int64))


def vectors_mould() -> Iterator[dict[str, Any]]:
    """67,368,000 upright vectors at 0.1 mm, those along the normals of all walls, and a run over the whole cover."""
    yield from _mould("vectors-mould", 0.1, simulation_spacing(ERROR, 10.0))


def vectors_mould_small() -> Iterator[dict[str, Any]]:
    """The same body and path at ten times the pitch."""
    yield from _mould("vectors-mould-small", 1.0, 10.0 * simulation_spacing(ERROR, 10.0))


def _mould(case: str, gamma: float, delta: float) -> Iterator[dict[str, Any]]:
    path = blocks()
    warm = _engine(10.0, 50.0, "hybrid")
    warm.answer(_requests(path[100:110], 0))  # compiled, apart
    yield {"case": case, "run": "DVV", "gamma_mm": gamma} | _window(path, gamma)
    yield {"case": case, "run": "DNV", "delta_mm": delta} | _run(path, 50.0, delta, "dnv")
    yield {"case": case, "run": "DVV, block by block", "gamma_mm": gamma} | _run(path, gamma, delta, "dvv")
    yield {"case": case, "run": "hybrid, block by block", "gamma_mm": gamma, "delta_mm": delta} | _run(
        path, gamma, delta, "hybrid"
    )


def _window(path: Floats, gamma: float) -> dict[str, Any]:
    """The published grid, all blocks at once."""
    shape = tuple(round(n * 0.1 / gamma) for n in WINDOW)
    ball_grid(path[:20], BALL, -5.0, -5.0, 1.0, (10, 10), _height)  # compiled, apart
    begin = process_time()
    found = ball_grid(
        path, BALL, -0.5 * shape[0] * gamma, -0.5 * shape[1] * gamma, gamma, (shape[0], shape[1]), _height
    )
    middle: Floats = (np.arange(shape[1], dtype=np.float64) + 0.5 - 0.5 * shape[1]) * gamma
    slot = [np.inf, -np.inf]
    flat = [np.inf, -np.inf]
    for i in range(0, shape[0], 256):
        rows = found[i : i + 256]
        x: Floats = (np.arange(i, i + len(rows), dtype=np.float64) + 0.5 - 0.5 * shape[0]) * gamma
        low = _height(x, middle) < HEIGHT
        for which, ends in ((low, slot), (~low, flat)):
            if which.any():
                ends[:] = min(ends[0], float(rows[which].min())), max(ends[1], float(rows[which].max()))
    return {
        "blocks": len(path) - 1, "vectors": found.size, "seconds": process_time() - begin, "published_seconds": 710,
        "bytes_per_vector": found.nbytes / found.size, "top_overcut_mm": -flat[0], "top_undercut_mm": flat[1],
        "slots_least_mm": slot[0], "slots_most_mm": slot[1], "peak_mb": peak_mb(),
    }  # fmt: skip


def _engine(gamma: float, delta: float, mode: Literal["dvv", "dnv", "hybrid"]) -> VectorEngine:
    asked = VectorSettings(
        mode=mode, pitch=gamma, spacing=delta, theta_v=radians(79.479), casting=CASTING, depth=DEEPEST
    )
    raw = BoxStock((-LENGTH / 2, -WIDTH / 2, 0.0), (LENGTH / 2, WIDTH / 2, HEIGHT + CASTING))
    return VectorEngine(raw, Options(design=body(), vectors=asked))


def _requests(path: Floats, first: int) -> list[Request]:
    tool = BallNose(diameter=2 * BALL, length=400.0).cutter
    tips = path - [0.0, 0.0, BALL]
    return [Request(Sweep.along(tool, Line(a, b)), k) for k, (a, b) in enumerate(pairwise(tips), first)]


def _run(path: Floats, gamma: float, delta: float, mode: Literal["dvv", "dnv", "hybrid"]) -> dict[str, Any]:
    """The engine as `run` uses it: the removal of every block, and the table of deviations. dnv: vectors on walls alone."""
    begin = process_time()
    engine = _engine(gamma, delta, "hybrid" if mode == "dnv" else mode)
    laid = process_time() - begin
    begin, removed = process_time(), 0.0
    for k in range(0, len(path) - 1, TOGETHER):
        requests = _requests(path[k : k + TOGETHER + 1], k)
        if mode == "dnv":
            balls = [ball for r in requests if (ball := ball_block(r.sweep)) is not None]
            engine.along.cut_balls(np.array([ball.row for ball in balls]), [r.sweep for r in requests])
        else:
            removed += sum(r.estimate for r in engine.answer(requests))
    cut = process_time() - begin
    begin = process_time()
    length, size = engine.along.length, engine.upright.lengths
    shown = None if mode == "dnv" else engine.deviation(TOLERANCE).summary
    upright, along = (0 if mode == "dnv" else size.size), len(length)
    held = (upright and size.nbytes) + engine.along.bytes_each * along
    return {
        "blocks": len(path) - 1, "upright": upright, "along_normals": along, "seconds": laid + cut + process_time() - begin,
        "seconds_laid": laid, "seconds_cut": cut, "seconds_reported": process_time() - begin,
        "published_seconds": {"dvv": 710, "dnv": 233, "hybrid": 943}[mode], "bytes_per_vector": held / (upright + along),
        "untouched": int((length == CASTING).sum()), "least_mm": float(length.min(initial=0.0)),
        "removed_mm3": removed, "max_overcut_mm": shown and shown["max_overcut_mm"], "peak_mb": peak_mb(),
    }  # fmt: skip


JOB = """\
name = "mould"

[program]
file = "mould.nc"
dialect = "iso"
home = [0, 0, 500]

[machine]
chain = "xyz"
rapid_mm_min = 20000
max_feed_mm_min = 6000

[[tools]]
number = 1
type = "ball"
diameter_mm = 30
length_mm = 400
flutes = 2

[stock]
box = {{ min = [-500, -477.5, 0], max = [500, 477.5, 342] }}

[design]
stl = "part.stl"
tolerance_mm = {tolerance}

[vectors]
mode = "hybrid"
pitch_mm = {gamma}
spacing_mm = {delta}
theta_v_deg = 79.479
casting_mm = {casting}
depth_mm = {deepest}
"""


def write_job(folder: Path, gamma: float = 0.1, path: Floats | None = None) -> Path:
    """Program, part and job file of the experiment; the job file. gamma : mm, pitch of upright vectors. path : of the centre."""
    tips = (blocks() if path is None else path) - [0.0, 0.0, BALL]
    folder.mkdir(parents=True, exist_ok=True)
    first, second, *rest = (f"X{x:.4f} Y{y:.4f} Z{z:.4f}" for x, y, z in tips)
    lines = [
        "(MOULD COVER, BALL D30)",
        "G21 G17 G90 G94",
        "T1 M6",
        "S3000 M3",
        "G0 Z450",
        f"G0 {first.split(' Z')[0]}",
    ]
    lines += [f"G0 {first}", f"G1 {second} F4000", *rest, "G0 Z450", "M30"]
    (folder / "mould.nc").write_text("\n".join(lines) + "\n", encoding="ascii")
    part = body()
    write_stock(Triangles(part.vertices, part.triangles), folder / "part.stl")
    job = folder / "job.toml"
    delta = round(simulation_spacing(ERROR, 10.0) * gamma / 0.1, 6)
    job.write_text(
        JOB.format(gamma=gamma, delta=delta, tolerance=TOLERANCE, casting=CASTING, deepest=DEEPEST),
        encoding="utf-8",
    )
    return job


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python -m benchmarks.mould DIR")
    print(write_job(Path(sys.argv[1])))
