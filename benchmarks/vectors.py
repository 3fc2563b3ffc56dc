"""Discrete vectors on the half cylinder of the sources (spec E.7, B1), re-created: DVV, DNV, hybrid; beside the exact answer.

Axis y = 0, z = 0 along x, radius 50, 100 x 100 mm; ball of radius 5; 100 passes of 214 chords over the arc and a link, 21,500
blocks. Vectors are measured against the true cylinder, not against facets of it. Processor time of one core, compilation
apart. The published seconds are of 2004.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from math import cos, pi, sin
from resource import RUSAGE_SELF, getrusage
from time import process_time
from typing import Any, Literal

import numpy as np
from manifold3d import CrossSection, Manifold

from benchmarks.vector_batch import Points, ball_grid, ball_vectors
from vmachining.arrays import Floats
from vmachining.engines.protocol import Options, Request
from vmachining.engines.vectors import (
    VectorEngine,
    VectorSettings,
    simulation_spacing,
    spacing_for,
    wall_angle,
)
from vmachining.geometry import Line
from vmachining.stock import BoxStock, MeshStock
from vmachining.sweep import Pose, Sweep
from vmachining.tool import BallNose, BullNose

__all__ = ["blocks", "half_cylinder", "peak_mb", "vectors", "vectors_blocks", "vectors_fine", "vectors_run"]

RADIUS, BALL, SIDE = 50.0, 5.0, 100.0
PASSES, CHORDS = 100, 214
ALLOWANCE, DEEPEST = 2.0, 10.0
LINKS_RAD = 0.15
"""Nearer to the ends than this, links between passes cut as well; they are not in the closed form."""

ERROR, COARSE_ERROR = 0.001, 0.0025
"""mm: of the hybrid's table and of the pure runs (errata E-8)."""

PUBLISHED = {0.025: (570, 555, 15), 0.04: (243, 218, 92), 0.05: (318, 128, 190), 0.1: (735, 47, 688)}
"""gamma: seconds of the hybrid, of its DVV and of its DNV; 218 + 92 is not 243 (errata E-7)."""

FACETS, TOGETHER, WALL = 720, 1024, pi * 88.0 / 180.0
"""Of the part in a run, 0.00012 mm inside of the cylinder; blocks that the engine gets at once, as from `run`; theta_V of
pure DVV."""

PUBLISHED_DVV, PUBLISHED_DNV = 1930.0, 586.0


def blocks() -> Floats:
    """(21501, 3) mm: centres of the ball; block k goes from row k to row k + 1. Block 0 is a link."""
    angle = np.linspace(0.0, pi, CHORDS + 1)
    reach = RADIUS + BALL
    arc = np.column_stack([reach * np.cos(angle), reach * np.sin(angle)])
    rows = [np.array([[-0.5, reach, 0.0]])]
    for k in range(PASSES):
        yz = arc if k % 2 == 0 else arc[::-1]
        rows.append(np.column_stack([np.full(len(yz), 0.5 + k), yz]))
    return np.concatenate(rows)


def vectors() -> Iterator[dict[str, Any]]:
    """One record per run."""
    path = blocks()
    ball_grid(path[:20], BALL, 0.0, -50.0, 1.0, (100, 100), _half_cylinder)  # compiled, apart
    ball_vectors(path[:20], BALL, _normals(5.0, 0.5), ALLOWANCE, DEEPEST)
    delta = spacing_for(ERROR, BALL, RADIUS)
    for gamma, published in PUBLISHED.items():
        theta = wall_angle(gamma, delta)
        upright, along = _grid(path, gamma, theta), _normal(path, delta, theta)
        yield {
            "case": "vectors", "run": "hybrid", "gamma_mm": gamma, "delta_mm": delta, "theta_v_deg": float(np.degrees(theta)),
            "upright": upright["vectors"], "along_normals": along["vectors"], "seconds_upright": upright["seconds"],
            "seconds_normals": along["seconds"], "seconds": upright["seconds"] + along["seconds"],
            "published_seconds": published[0], "published_upright": published[1], "published_normals": published[2],
            "overcut_mm": max(upright["overcut_mm"], along["overcut_mm"]),
            "undercut_mm": max(upright["undercut_mm"], along["undercut_mm"]), "peak_mb": peak_mb(),
        }  # fmt: skip
    for error in (0.01, 0.005, COARSE_ERROR):
        delta = simulation_spacing(error, BALL)
        yield {
            "case": "vectors", "run": "pure DNV", "epsilon_mm": error, "delta_mm": delta,
            "published_seconds": PUBLISHED_DNV if error == COARSE_ERROR else None,
        } | _normal(path, delta, 0.0)  # fmt: skip
    for gamma in sorted(PUBLISHED, reverse=True):
        yield {"case": "vectors", "run": "pure DVV", "gamma_mm": gamma} | _grid(path, gamma, pi / 2)


def vectors_fine() -> Iterator[dict[str, Any]]:
    """The grid of 100 million vectors, pure DVV with theta_V = 88 degrees."""
    path = blocks()
    ball_grid(path[:20], BALL, 0.0, -50.0, 1.0, (100, 100), _half_cylinder)
    record = {"case": "vectors-fine", "run": "pure DVV", "gamma_mm": 0.01, "published_seconds": PUBLISHED_DVV}
    yield record | _grid(path, 0.01, np.radians(88.0))


def vectors_run() -> Iterator[dict[str, Any]]:
    """The engine as `run` uses it on the half cylinder by facets: the removal of every block, and the table of deviations."""
    path = blocks()
    tool = BallNose(diameter=2 * BALL, length=100.0).cutter
    tips = path - [0.0, 0.0, BALL]
    requests = [Request(Sweep.along(tool, Line(a, b)), k) for k, (a, b) in enumerate(pairwise(tips))]
    design, raw = half_cylinder(FACETS), BoxStock((0.0, -55.0, 0.0), (SIDE, 55.0, RADIUS + BALL))
    delta, coarse = spacing_for(ERROR, BALL, RADIUS), simulation_spacing(COARSE_ERROR, BALL)
    runs: tuple[tuple[Literal["dvv", "dnv", "hybrid"], float | None, float], ...] = (
        ("dvv", 0.1, delta), ("dvv", 0.05, delta), ("dvv", 0.025, delta), ("hybrid", 0.1, delta), ("hybrid", 0.05, delta),
        ("dnv", None, coarse),
    )  # fmt: skip
    VectorEngine(raw, Options(design=design, vectors=VectorSettings(pitch=1.0, spacing=2.0))).answer(
        requests[:50]
    )
    for mode, gamma, spacing in runs:
        asked = VectorSettings(
            mode=mode, pitch=gamma, spacing=spacing, theta_v=WALL if mode == "dvv" else None, allowance=ALLOWANCE
        )  # fmt: skip
        begin = process_time()
        engine = VectorEngine(raw, Options(design=design, vectors=asked))
        laid, begin = process_time() - begin, process_time()
        for k in range(0, len(requests), TOGETHER):
            engine.answer(requests[k : k + TOGETHER])
        cut, begin = process_time() - begin, process_time()
        found = engine.deviation(0.05).summary
        yield {
            "case": "vectors-run", "run": mode, "gamma_mm": gamma, "delta_mm": spacing, "theta_v_deg": engine.theta_v_deg,
            "blocks": len(requests), "upright": found["upright_vectors"], "along_normals": len(engine.along),
            "seconds": laid + cut + process_time() - begin, "seconds_laid": laid, "seconds_cut": cut,
            "overcut_mm": found["max_overcut_mm"], "undercut_mm": found["max_undercut_mm"],
            "bytes_per_normal_vector": engine.along.bytes_each, "peak_mb": peak_mb(),
        }  # fmt: skip


def half_cylinder(facets: int) -> MeshStock:
    """The part by facets whose corners lie on the cylinder, as many as asked for."""
    phi = np.linspace(0.0, pi, facets + 1)
    ring = np.column_stack([RADIUS * np.cos(phi), RADIUS * np.sin(phi)])
    mesh = Manifold.extrude(CrossSection([ring]), SIDE).to_mesh64()
    y, z, x = np.array(mesh.vert_properties)[:, :3].T
    return MeshStock(np.column_stack([x, y, z]), np.array(mesh.tri_verts, dtype=np.int64))


def vectors_blocks(blocks: int = 20) -> Iterator[dict[str, Any]]:
    """Cost of a block one by one, with its removal: a bull nose D12 over a plate 60 x 40, grid 0.2 mm, normals 0.5 mm."""
    design = MeshStock(*BoxStock((0, 0, 0), (60, 40, 15)).mesh(1.0)[0])
    tool = BullNose(diameter=12, corner_radius=2, length=40)
    for axes in (3, 5):
        asked = VectorSettings(pitch=0.2, spacing=0.5)
        engine = VectorEngine(BoxStock((-2, -2, 0), (62, 42, 18)), Options(design=design, vectors=asked))
        lean = np.radians(17.0 + 0.6 * np.arange(blocks + 2)) * (axes == 5)
        poses = [
            Pose((2.0 + k, 20.0, 14.9), (sin(a), 0.0, cos(a))) for k, a in enumerate(lean.tolist(), start=-1)
        ]
        engine.cut(Sweep(tool, poses[0], poses[1]))  # compiled, apart
        begin = process_time()
        for k in range(blocks):
            engine.cut(Sweep(tool, poses[k + 1], poses[k + 2]), k)
        yield {
            "case": "vectors-blocks", "axes": axes, "blocks": blocks,
            "upright": engine.upright.shape[0] * engine.upright.shape[1], "along_normals": len(engine.along),
            "ms_per_block": 1e3 * (process_time() - begin) / blocks,
        }  # fmt: skip


def _half_cylinder(x: Floats, y: Floats) -> Floats:
    """(n, m) mm: height of the part."""
    return np.asarray(np.broadcast_to(np.sqrt(RADIUS**2 - y * y), (len(x), len(y))))


def _normals(delta: float, theta: float) -> Points:
    """Points at the middles of a grid of spacing delta on the cylinder where it is steeper than theta."""
    first = pi / 2 - theta  # phi from the horizontal
    nx, n = max(1, round(SIDE / delta)), max(1, round(RADIUS * first / delta))
    x = (np.arange(nx) + 0.5) * SIDE / nx
    phi = (np.arange(n) + 0.5) * first / n
    phi = np.concatenate([phi, pi - phi])
    at, turn = (v.reshape(-1) for v in np.meshgrid(x, phi, indexing="ij"))
    normal = np.column_stack([np.zeros(len(at)), np.cos(turn), np.sin(turn)])
    return Points(np.column_stack([at, RADIUS * normal[:, 1:]]), normal, np.zeros(len(at), dtype=np.int64))


def _exact(x: Floats, normal: Floats) -> Floats:
    """Length of a vector of the cylinder after all passes, where no link reaches.

    In a plane across the axis the ball over pass x0 is a circle of radius h, h^2 = 25 - (x - x0)^2, whose centre runs along
    chords of the circle of radius 55. Along the normal at phi the boundary of what h sweeps is the chord's parallel, or the
    circle about a node.
    """
    step = pi / CHORDS
    phi = np.arctan2(normal[:, 2], normal[:, 1])
    off = phi - step * np.round(phi / step)  # from the nearest node
    off_mid = phi - step * (np.floor(phi / step) + 0.5)  # from the middle of the chord
    best = np.full(len(x), np.inf)
    reach = RADIUS + BALL
    for near in (-0.5, 0.5, 1.5):
        x0 = np.clip(np.floor(x) + near, 0.5, PASSES - 0.5)
        room = BALL**2 - (x - x0) ** 2
        h = np.sqrt(np.clip(room, 0.0, None))
        # a chord's parallel: distance reach cos(step / 2) - h from the axis, direction off_mid from its normal
        chord = (reach * cos(step / 2) - h) / np.cos(off_mid)
        foot = np.abs(chord * np.sin(off_mid)) <= reach * sin(step / 2)
        node = reach * np.cos(off) - np.sqrt(np.clip(h**2 - (reach * np.sin(off)) ** 2, 0.0, None))
        best = np.minimum(best, np.where(foot, chord, node) - RADIUS)
    return best


def _normal(path: Floats, delta: float, theta: float) -> dict[str, Any]:
    points = _normals(delta, theta)
    begin = process_time()
    length = ball_vectors(path, BALL, points, ALLOWANCE, DEEPEST)
    seconds = process_time() - begin
    inner = points.normal[:, 2] > sin(LINKS_RAD)  # links between passes take more at both ends
    wanted = _exact(points.point[inner, 0], points.normal[inner])
    error = np.abs(length[inner] - wanted)
    error -= 0.5 * np.spacing(np.abs(wanted).astype(np.float32))
    return {
        "vectors": len(length), "seconds": seconds, "overcut_mm": float(-length.min()), "undercut_mm": float(length.max()),
        "error_beyond_rounding_mm": max(float(error.max(initial=0.0)), 0.0), "peak_mb": peak_mb(),
    }  # fmt: skip


def _grid(path: Floats, gamma: float, theta: float) -> dict[str, Any]:
    """Upright vectors; deviations where the part is not steeper than theta."""
    count = round(SIDE / gamma)
    begin = process_time()
    found = ball_grid(path, BALL, 0.0, -SIDE / 2, SIDE / count, (count, count), _half_cylinder)
    y = -SIDE / 2 + (np.arange(count) + 0.5) * SIDE / count
    slope = np.abs(y) / RADIUS  # sine of theta
    shown = slope <= sin(theta)
    most, least = -np.inf, np.inf
    for k in range(0, count, 512):  # reporting: extremes of L cos theta
        rows = found[k : k + 512, shown] * np.sqrt(1.0 - slope[shown] ** 2).astype(np.float32)
        most, least = max(most, float(rows.max())), min(least, float(rows.min()))
    return {
        "vectors": found.size, "seconds": process_time() - begin, "overcut_mm": -least, "undercut_mm": most,
        "peak_mb": peak_mb(),
    }  # fmt: skip


def peak_mb() -> float:
    """Memory of this process at its largest, MB."""
    return float(getrusage(RUSAGE_SELF).ru_maxrss) / 1024.0
