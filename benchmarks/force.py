"""Forces and schedules: seconds, and the columns of blocks against B-rep solids.

`force` times a five-axis pass (1,000 positions, 360 angles, 50 segments, 4 teeth), scheduling 100,000 blocks from given
samples by every strategy, and the pass of the columns per station of a shipped program. `engagement-columns` compares the
columns at random stations of shipped programs with what OCCT says of the same place, bottom included.
"""

from __future__ import annotations

from collections.abc import Iterator
from time import perf_counter, process_time
from typing import Any

import numpy as np

from vmachining.engagement.frames import frame_of
from vmachining.errors import EngineError, SweepError
from vmachining.feed import (
    ChipAreaStrategy,
    FeedBlocks,
    FeedLimits,
    ForceStrategy,
    Parts,
    VolumeStrategy,
    plan_feeds,
)
from vmachining.force import Forces, bull_edge, edge_forces, shipped
from vmachining.job import Job, Scene, engage
from vmachining.job.engagement_columns import Watched, engagement_pass
from vmachining.job.reading import read_job_program
from vmachining.job.toolpath import Toolpath
from vmachining.nc import Motion

__all__ = ["engagement_columns", "force"]

POSITIONS, ANGLES, SEGMENTS, TEETH = 1000, 360, 50, 4
BLOCKS, SAMPLES = 100_000, 8
PLACES = {"slot": 14, "pocket": 10, "mould": 10, "half_cylinder": 6}
"""Stations compared, by model."""

SEED = 7


def _model(name: str) -> Job:
    from vmachining.cli.demo import demo_job

    return Job.load(demo_job().parent.parent / name / "job.toml")


def force() -> Iterator[dict[str, Any]]:
    """See the module."""
    phi = 2.0 * np.pi * np.arange(ANGLES) / ANGLES
    front = (phi > 0.0) & (phi < np.pi)
    lower, upper = np.full((2, POSITIONS, ANGLES, 2), np.nan)
    lower[:, front], upper[:, front] = (0.0, 2.0 * np.pi), (2.0 * np.pi, 2.0 * np.pi + 4.0)
    lean = np.linspace(-0.2, 0.2, POSITIONS)
    axis = np.column_stack([np.sin(lean), 0.5 * np.sin(lean), np.cos(lean)])
    frames = frame_of(axis / np.linalg.norm(axis, axis=1, keepdims=True))
    velocity = np.tile([1.0, 0.2, 0.0], (POSITIONS, 1))
    tool, coefficients = bull_edge(12.0, 4.0, 40.0), shipped("bull_d32_r4_published")

    def once(n: int) -> Forces:
        return edge_forces(
            tool, coefficients, phi, lower[:n], upper[:n], frame=frames[:n], velocity=velocity[:n], feed_per_tooth=0.2,
            axis_rate=1e-4 * velocity[:n], teeth=TEETH, chi=0.2, segments=SEGMENTS // 2,
        )  # fmt: skip

    begin = perf_counter()
    once(2)
    compile_s = perf_counter() - begin
    begin, work = perf_counter(), process_time()
    found = once(POSITIONS)
    yield {
        "case": "force", "what": "five-axis pass", "positions": POSITIONS, "angles": ANGLES, "segments": SEGMENTS,
        "teeth": TEETH, "seconds": perf_counter() - begin, "processor_seconds": process_time() - work,
        "first_call_seconds": compile_s, "peak_n": float(found.resultant.max()),
    }  # fmt: skip
    yield from _schedules()
    yield from _columns()


def _schedules() -> Iterator[dict[str, Any]]:
    rng = np.random.default_rng(SEED)
    rows = FeedBlocks(
        np.arange(BLOCKS),
        np.array(["cut"] * BLOCKS),
        rng.uniform(1.0, 10.0, BLOCKS),
        np.full(BLOCKS, 800.0),
        np.ones(BLOCKS),
    )
    parts = Parts.equal(rows, np.full(BLOCKS, SAMPLES))
    m = len(parts.end)
    load, group = rng.gamma(2.0, 1.0, m), rows.groups[parts.block]
    a, b = 1e-2 * load, rng.uniform(0.0, 1.0, m)
    quads = np.column_stack([a * a, a * b, b * b])
    at = np.arange(m)
    limits = FeedLimits(min_mm_min=60.0, max_mm_min=4000.0)
    for name, strategy in (
        ("volume", VolumeStrategy(parts, load * parts.length, group)),
        ("chip_area", ChipAreaStrategy(parts, load / 1e3, group)),
        ("force", ForceStrategy(parts, quads, at, at + 1, group)),
    ):
        plan_feeds(rows, strategy, limits, insert=True)
        begin, work = perf_counter(), process_time()
        found = plan_feeds(rows, strategy, limits, insert=True)
        yield {
            "case": "force", "what": f"schedule by {name}", "blocks": BLOCKS, "samples": m, "inserted": found.inserted,
            "seconds": perf_counter() - begin, "processor_seconds": process_time() - work,
        }  # fmt: skip


def _columns() -> Iterator[dict[str, Any]]:
    for name in ("slot", "pocket"):
        job = _model(name)
        program = read_job_program(job)
        toolpath = Toolpath.of(program, job.machine)
        blocks = toolpath.blocks
        engagement_pass(job, toolpath, only=range(8))
        work = process_time()
        found = engagement_pass(job, toolpath)
        spent = process_time() - work
        cutting = sum(block.motion != Motion.RAPID for block in blocks)
        yield {
            "case": "force", "what": f"columns of models/{name}", "blocks": cutting, "stations": len(found.block),
            "processor_ms_per_block": 1e3 * spent / cutting,
            "processor_ms_per_station": 1e3 * spent / max(len(found.block), 1),
        }  # fmt: skip


def engagement_columns() -> Iterator[dict[str, Any]]:
    """See the module."""
    rng = np.random.default_rng(SEED)
    for name, count in PLACES.items():
        job = _model(name)
        program = read_job_program(job)
        toolpath = Toolpath.of(program, job.machine)
        blocks = toolpath.blocks
        cutting = [block.number for block in blocks if block.motion != Motion.RAPID and len(block.moves) == 1]
        chosen = sorted(rng.choice(cutting, size=min(count, len(cutting)), replace=False).tolist())
        seen: list[Watched] = []
        engagement_pass(job, toolpath, watch=seen.append, only=frozenset(chosen))
        scene = Scene.of(job)
        for one in seen:
            sample = one.samples[len(one.samples) // 2]
            row: dict[str, Any] = {
                "case": "engagement-columns",
                "model": name,
                "block": one.block.number,
                "at": sample.at,
            }
            # the grid of B-rep through straight ahead, as ours
            ahead = float(
                np.degrees(
                    np.arctan2(sample.now[6:9] @ sample.now[12:15], sample.now[6:9] @ sample.now[15:18])
                )
            )
            try:
                begin = process_time()
                true = engage(
                    scene,
                    one.block.number,
                    at=sample.at,
                    method="brep",
                    angles=72,
                    phase=ahead / 5.0 % 1.0,
                    bottom=True,
                )
            except (EngineError, SweepError) as exc:
                yield row | {"refused": str(exc)[:80]}
                continue
            length = float(np.linalg.norm(sample.now[6:9]))
            chip = float(np.nan_to_num(true.chip_per_feed).max()) if not true.is_air else 0.0
            arc = min(float(np.ptp(true.arcs, axis=1).sum()) / (2.0 * np.pi), 1.0) if not true.is_air else 0.0
            mine = sample.chips
            yield row | {
                "chip_per_feed_mm": mine.area_rate / length, "chip_error_mm": mine.area_rate / length - chip,
                "ap_error_mm": mine.ap - true.ap, "ae_error_mm": _less(mine.ae, true.ae),
                "fraction_error": mine.fraction - arc, "brep_processor_seconds": process_time() - begin,
            }  # fmt: skip


def _less(a: float, b: float) -> float | None:
    return None if np.isnan(a) or np.isnan(b) else a - b
