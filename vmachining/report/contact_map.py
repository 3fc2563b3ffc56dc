"""What the tool touches in some blocks: maps over rotation and edge, and force over a turn, for the page to draw.

The blocks are as many for a long program as for a short one; the page says how to get those of any other block.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import polars as pl

from vmachining.arrays import Floats, Ints
from vmachining.engagement.along import Sample
from vmachining.force import turn_series
from vmachining.job import RunResult
from vmachining.job.engagement_columns import Watched, coefficients_of, engagement_pass, spin_of
from vmachining.job.stations import MOST_MAPPED
from vmachining.sweep import Stance

MOST_LOADED, SPREAD = 24, 40
"""Blocks with a map: those with the largest load, and others evenly through the program."""

CELLS = 48
"""Of a map along the edge, from its lower end to a little beyond the highest place that cuts."""

HEAD = 1.1
LEVELS = 254


def contact_maps(
    result: RunResult, blocks: pl.DataFrame, load: str
) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """Of every block that is drawn a record for the header of the page, and the arrays `contact_maps` and
    `contact_turns` they point into. load : column by which blocks are chosen.

    A map has `angles` columns of `CELLS` bytes, upwards: 0 where nothing is touched, else 1 + 254 h / top. Column k stands at
    90 + 360 k / angles degrees; 90 is straight ahead of the feed, or where that is axial the first direction of the tool.
    A turn has as many forces (N, resultant of all teeth); place k is 360 k / angles.
    """
    cuts = blocks.filter((pl.col("ap_mm") > 0) & (pl.col(load) > 0)).select("block", load)
    top = cuts.top_k(MOST_LOADED, by=load)
    rest = cuts.join(top, on="block", how="anti", maintain_order="left")
    chosen = dict(pl.concat([top, rest.gather_every(max(1, -(-len(rest) // SPREAD)))]).iter_rows())
    if not chosen or len(blocks) > MOST_MAPPED:
        return [], {}
    forcing = coefficients_of(result.job)
    best: dict[int, tuple[tuple[float, float], Watched, Sample]] = {}

    def watch(seen: Watched) -> None:
        for sample in seen.samples:
            # of chips of one size the one of the widest contact
            size = float(f"{sample.chips.area_rate:.9g}"), sample.chips.fraction
            if sample.straight is not None and size > best.get(seen.block.number, ((0.0, 0.0),))[0]:
                best[seen.block.number] = size, seen, sample

    engagement_pass(
        result.job, result.toolpath, watch=watch, only=frozenset(chosen), divided=False, sweeps=result.sweeps
    )
    records: list[dict[str, Any]] = []
    maps: list[Ints] = []
    turns: list[Floats] = []
    for block, (_, seen, sample) in sorted(best.items()):
        record, chips = _map(seen, sample)
        record |= {"block": block, "load": chosen[block], "map": sum(len(one) for one in maps), "turn": None}
        maps.append(chips)
        if seen.fine and forcing is not None:
            spin = spin_of(seen.move)
            phi, columns = turn_series(sample, seen.teeth, forcing.coefficients, seen.scale, spin=spin)
            place = (np.degrees(phi) - record["begin"] + 90.0) % 360.0  # the grid starts straight ahead
            order, even = np.argsort(place), np.arange(record["angles"]) * (360.0 / record["angles"])
            force = np.linalg.norm(columns[:, :3], axis=1)[order]
            record["turn"] = sum(len(one) for one in turns)
            turns.append(np.interp(even, place[order], force, period=360.0))
        records.append(record)
    if not records:
        return [], {}
    arrays: dict[str, Any] = {"contact_maps": np.concatenate(maps)}
    if turns:
        arrays["contact_turns"] = np.concatenate(turns).astype("<f4")
    return records, arrays


def _map(seen: Watched, sample: Sample) -> tuple[dict[str, Any], Ints]:
    """Chip thickness over rotation angle and edge at one station."""
    now, cutting, edge = sample.now, sample.straight, seen.teeth.edge
    assert cutting is not None
    stance = Stance(*(now[k : k + 3] for k in range(0, 18, 3)))
    hits = cutting.hits[cutting.hits[:, 0] < cutting.grid]
    low = min(0.0, float(hits[:, 2].min(initial=0.0)))
    high = low + HEAD * (float(hits[:, 3].max(initial=0.0)) - low) or 1.0
    s = low + (np.arange(CELLS) + 0.5) * (high - low) / CELLS
    thick = np.full((cutting.grid, CELLS), -1.0)
    inside = (s >= hits[:, 2:3]) & (s <= hits[:, 3:])
    row, cell = np.nonzero(inside)
    angle, piece = hits[row, 0].astype(np.int64), hits[row, 1].astype(np.int64)
    speed = stance.normal_speed(edge, cutting.phi[angle], piece, s[cell])
    np.maximum.at(thick, (angle, cell), np.maximum(speed, 0.0))
    known = np.isfinite(seen.scale)
    thick *= seen.scale if known else 1.0 / max(float(np.linalg.norm(stance.velocity)), 1e-300)
    top = float(thick.max(initial=0.0))
    levels = np.where(thick < 0.0, 0, 1 + np.round(LEVELS * thick / (top or 1.0)))
    record = {
        "at": round(sample.at, 4), "angles": cutting.grid, "low": low, "high": high, "top": top,
        "unit": "mm" if known else "of the feed per tooth", "fed": stance.feed_angle is not None,
        "teeth": seen.teeth.number, "begin": float(np.degrees(cutting.phi[0])),
    }  # fmt: skip
    return record, levels.astype("u1").ravel()
