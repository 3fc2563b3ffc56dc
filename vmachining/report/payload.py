"""What the page draws: columns, surface, path, tools and raw heights in one compressed container.

The container is gzip of `[uint32 length][JSON header][arrays]`; `frontend/src/data.js` reads it. Its size is bounded:
rows, triangles and motions beyond a budget are thinned, and the page says so. Nothing here is computed again; the cut
that the page plays is a picture made in the browser from the path and the cutters.
"""

from __future__ import annotations

import base64
import gzip
import json
import struct
from collections.abc import Container
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from vmachining.arrays import Floats, Ints
from vmachining.errors import KinematicsError
from vmachining.geometry import Arc, Line
from vmachining.job import Job, RunResult
from vmachining.job.contact import ToolParts
from vmachining.job.stock import raw_stock
from vmachining.job.toolpath import Toolpath, program_lines
from vmachining.machine import Machine, follow
from vmachining.nc import Motion, Program
from vmachining.report.contact_map import contact_maps
from vmachining.report.design import Deviation
from vmachining.report.numbers import floats
from vmachining.report.thin import ThinMesh, thin_rows
from vmachining.stock import Stock
from vmachining.sweep import Turn
from vmachining.tool import Profile

MAX_SEGMENTS = 200_000
"""Straight pieces of the drawn path; beyond it every n-th motion is drawn."""

MAX_SOURCE = 3_000_000
"""Characters of a program that is shown whole; of a longer one only the lines of the drawn blocks are."""

CELLS = 50_000
"""Cells of the grid on which the cut is played: about 100,000 triangles, which a browser without a graphics card turns."""

LEAST_PERCENT = 1e-3
"""Widths of brackets are drawn in decades above it, and linearly from 0 to it: below there is hardly more than rounding."""

CORNERS = 400_000
"""Of the cubic cells in space that take the place of the grid where a tool leans or undercuts."""

BAND = 2
"""Cells from the surface within which distances are kept."""

MAX_FOLLOWED = 20_000
"""Points of a path whose joints are sought where the program does not name them."""

ARC_STEP = 0.1
"""rad of an arc per drawn piece."""

UPRIGHT = 1e-9
"""Axes that lean by less are played over a grid of heights, unless a cutter is narrower above than below."""

LOADS = (
    ("force_n", "force", "N"),
    ("chip_area_mm2", "chip area", "mm²"),
    ("mrr_mm3_min", "removal rate", "mm³/min"),
    ("chip_thickness_mm", "chip thickness", "mm"),
    ("ap_mm", "axial depth ap", "mm"),
    ("ae_mm", "radial depth ae", "mm"),
    ("engaged_fraction", "engaged share of a turn", ""),
    ("power_w", "power at the cutter", "W"),
    ("feed_mm_min", "feed as programmed", "mm/min"),
    ("scheduled_feed_mm_min", "feed scheduled", "mm/min"),
)
"""Columns that can colour the part, in the order in which the first one that is filled becomes the load."""

GROWING = ("removed_mm3", "removed_lo_mm3", "removed_hi_mm3", "mrr_mm3_min")
"""Columns that a live page fills while the run makes them."""

MORE = (
    ("removed_mm3", "removed volume", "mm³"),
    ("length_mm", "path", "mm"),
    ("time_s", "time", "s"),
    ("scheduled_time_s", "time scheduled", "s"),
)


BLOCK = ("block", "block number", "")

PARTS = ("meridian", "shank", "holder")
"""Names of `ToolParts` on the page."""


@dataclass(frozen=True, slots=True)
class Payload:
    """text : base64 of the container. stride : every how manieth motion is drawn. rows : blocks that are drawn.

    field : what the cut is played over, "grid" of heights, "volume" of cells in space, or nothing. maps : blocks whose
    contact is drawn.
    """

    text: str
    stride: int
    rows: int
    field: str = ""
    maps: int = 0

    @property
    def played(self) -> str:
        """How the cut is played, for the reader."""
        over = {"grid": "a grid of heights", "volume": "cubic cells"}[self.field]
        return f"While it plays, the part is drawn over {over}: a picture, not a measurement."


def load_column(blocks: pl.DataFrame) -> tuple[str, str, str]:
    """Column, name and unit of what loads the cutter most directly: force, else chip area, else removal rate."""
    return next(entry for entry in LOADS[:3] if blocks[entry[0]].count() or entry[0] == "mrr_mm3_min")


def payload(
    result: RunResult, blocks: pl.DataFrame, mesh: ThinMesh, deviation: Deviation | None = None
) -> Payload:
    """The container of a result, its surface thinned to `mesh`, with how far that is from the design."""
    load = load_column(blocks)
    contact, maps = contact_maps(result, blocks, load[0])
    mapped = np.searchsorted(blocks["block"].to_numpy(), [record["block"] for record in contact])
    thinned = (thin_rows(len(blocks), blocks[name].to_numpy()) for name in ("removed_mm3", load[0]))
    rows = np.unique(np.concatenate([*thinned, mapped.astype(np.int64)]))
    drawn = blocks[rows]
    value, lo, hi = (drawn[f"removed{end}_mm3"].to_numpy() for end in ("", "_lo", "_hi"))
    width = np.where(hi > lo, 100.0, 0.0)  # of each bracket in percent of the volume
    np.divide(100.0 * (hi - lo), value, out=width, where=value > 0.0)
    time = np.nan_to_num(blocks["time_s"].fill_null(0.0).to_numpy())
    length = np.nan_to_num(blocks["length_mm"].fill_null(0.0).to_numpy())
    arrays: dict[str, Any] = {
        **_along(drawn, rows, time, length),
        **{f"removed_{end}_mm3": floats(drawn, f"removed_{end}_mm3").astype("<f4") for end in ("lo", "hi")},
        "bracket_percent": np.minimum(width, 100.0).astype("<f4"), "face_block": mesh.block.astype("<i4"),
        "warned": drawn["warning"].is_not_null().to_numpy().astype("u1"),
        "vertices": mesh.vertices.astype("<f4").ravel(), "triangles": mesh.triangles.astype("<u4").ravel(),
    }  # fmt: skip
    filled = [entry for entry in (*LOADS, *MORE) if drawn[entry[0]].count()]
    arrays |= {name: floats(drawn, name).astype("<f4") for name, _, _ in filled} | maps
    arrays |= _rotary(result.toolpath, drawn["block"].to_numpy())
    tools, tool_index = _tools(result.job)
    hits = drawn.filter(pl.col("warning").str.contains("rapid", literal=True).fill_null(False))["block"]
    path, stride = _path(result.toolpath, drawn["block"].to_numpy(), tool_index, set(hits.to_list()))
    field = _field(result.job, tools, path) | _machine(result.job.machine, path)
    arrays |= path
    arrays |= field.pop("arrays")
    if result.schedule is not None:
        arrays["scheduled_mrr_mm3_min"] = np.asarray(result.schedule.after_rate, dtype="<f4")[rows]
    known = set(arrays)
    loads = _titled({name for name, _, _ in filled}, *LOADS)
    loads.sort(key=lambda entry: entry["name"] != load[0])
    if deviation is not None:
        arrays["deviation_mm"] = deviation.distance.astype("<f4")
        loads += _titled(["deviation_mm"], ("deviation_mm", "deviation from the design", "mm"))
        loads[-1]["reach"] = deviation.reach
    loads += _titled(["bracket_percent", "block"], ("bracket_percent", "width of the bracket", "%"), BLOCK)
    header = {
        "texts": [text or "" for text in drawn["text"].to_list()], "source": _source(result.program, blocks),
        "warnings": dict(drawn.filter(pl.col("warning").is_not_null()).select("block", "warning").iter_rows()),
        "loads": loads, "details": _titled(known, *MORE, *LOADS), "curves": _curves(known), "tools": tools, **field,
        "ends": {"time": float(time.sum()), "length": float(length.sum())}, "contact": contact,
        "job": Path(result.inputs["job"]["file"]).name if "job" in result.inputs else "JOB.toml",
    }  # fmt: skip
    return Payload(packed(header, arrays), stride, len(rows), next(iter(field)), len(contact))


def path_payload(toolpath: Toolpath, job: Job | None = None) -> Payload:
    """The container of a program: its path and feeds, with a pointer for each tool; of a job, with its tools and stock.

    With a job the page is live: it asks the server for the rows that the run has made, and cuts along.
    """
    moves, paths = toolpath.moves, toolpath.paths
    feed = np.array(
        [moves[block.moves[-1]].feed_mm_min for block in toolpath.blocks], dtype=np.float64
    )  # NaN of None
    length = np.array([sum(paths[k].length for k in block.moves) for block in toolpath.blocks])
    time = np.divide(60.0 * length, feed, out=np.zeros(len(feed)), where=feed > 0.0)
    table = pl.DataFrame(
        {"block": [b.number for b in toolpath.blocks], "line": [b.line for b in toolpath.blocks],
         "text": [b.text for b in toolpath.blocks], "feed_mm_min": feed, "length_mm": length, "time_s": time}
    )  # fmt: skip
    rows = thin_rows(len(table), np.nan_to_num(feed))
    drawn = table[rows]
    numbers = sorted({block.tool for block in toolpath.blocks})
    tools, index = ([], {n: k for k, n in enumerate(numbers)}) if job is None else _tools(job)
    path, stride = _path(toolpath, drawn["block"].to_numpy(), index, ())
    if job is None:
        size = 0.04 * float(np.ptp(path["points"].reshape(-1, 3), axis=0).max() or 1.0)
        pointer = [[0.0, 0.0], [0.4 * size, size], [0.4 * size, 3.0 * size], [0.0, 3.0 * size]]
        tools = [{"number": n, "meridian": pointer, "shank": None, "holder": None} for n in numbers]
    field: dict[str, Any] = (
        {"arrays": {}} if job is None else _field(job, tools, path) | _machine(job.machine, path)
    )
    growing = {} if job is None else {name: np.full(len(rows), np.nan, dtype="<f4") for name in GROWING}
    arrays = {
        **_along(drawn, rows, time, length),
        "warned": np.zeros(len(rows), dtype="u1"),
        "vertices": np.zeros(0, dtype="<f4"), "triangles": np.zeros(0, dtype="<u4"), "face_block": np.zeros(0, dtype="<i4"),
        **{name: floats(drawn, name).astype("<f4") for name in ("feed_mm_min", "length_mm", "time_s")}, **path, **growing,
        **_rotary(toolpath, drawn["block"].to_numpy()),
        **field.pop("arrays"),
    }  # fmt: skip
    header = {
        "texts": drawn["text"].to_list(), "source": _source(toolpath.program, table), "warnings": {},
        "loads": [*_titled(arrays, *LOADS), *_titled(["block"], BLOCK)], "details": _titled(arrays, *MORE, *LOADS),
        "curves": _curves(set(arrays)), "ends": {"time": float(time.sum()), "length": float(length.sum())}, "tools": tools,
        **field, "live": job is not None,
    }  # fmt: skip
    return Payload(packed(header, arrays), stride, len(rows), next(iter(field), ""))


def _along(drawn: pl.DataFrame, rows: Ints, time: Floats, length: Floats) -> dict[str, Any]:
    """Where the blocks that are drawn are: their lines, and time and path before them."""
    return {
        "block": drawn["block"].to_numpy().astype("<i4"), "line": drawn["line"].to_numpy().astype("<i4"),
        "begin_s": (np.cumsum(time) - time)[rows].astype("<f4"), "begin_mm": (np.cumsum(length) - length)[rows].astype("<f4"),
    }  # fmt: skip


def _titled(names: Container[str], *entries: tuple[str, str, str]) -> list[dict[str, Any]]:
    """Name, label and unit of those of the columns that there are."""
    return [{"name": n, "label": label, "unit": unit} for n, label, unit in entries if n in names]


def _rotary(toolpath: Toolpath, numbers: Ints) -> dict[str, Floats]:
    """Angles that the program names, `rotary_a_deg` and so on, at the end of blocks; NaN before an axis is first named."""
    wanted, names = set(numbers.tolist()), {n for move in toolpath.moves for n in move.rotary_deg or ()}
    if not names:
        return {}
    found: dict[str, list[float]] = {name: [] for name in sorted(names)}
    now = dict.fromkeys(found, float("nan"))
    for block in toolpath.blocks:
        for index in block.moves:
            now |= dict(toolpath.moves[index].rotary_deg or {})
        if block.number in wanted:
            for name, values in found.items():
                values.append(now[name])
    return {f"rotary_{name}_deg": np.array(values, dtype="<f4") for name, values in found.items()}


def _source(program: Program, blocks: pl.DataFrame) -> list[str] | None:
    """Lines of the program, where every block names a line of this one file; else the page shows blocks alone."""
    if len(program.data) > MAX_SOURCE or program.files:
        return None
    lines = program_lines(program)
    named = blocks.select("line", "text").unique()
    known = all(0 < line <= len(lines) and lines[line - 1] == text for line, text in named.iter_rows())
    return lines if known else None


def _curves(known: set[str]) -> list[dict[str, Any]]:
    """Plots over the program, of the columns that are filled."""

    def line(name: str, label: str, colour: str, hidden: bool = False) -> dict[str, Any]:
        return {"name": name, "label": label, "colour": f"--{colour}", "hidden": hidden}

    before, after = "before", "after"
    turning = sorted(name for name in known if name.startswith("rotary_"))
    wanted = [
        ("Rotary axes", "degrees", [line(name, name.split("_")[1].upper(), colour) for name, colour in
            zip(turning, ("first", "second", "third", "fourth", "fifth"), strict=False)], None, None),
        ("Removed volume of a block, with its bracket", "mm³", [line("removed_mm3", "removed", "first"),
            line("removed_hi_mm3", "to", "first", True), line("removed_lo_mm3", "from", "first", True)], [2, 3], None),
        ("Width of the bracket", "% of the volume", [line("bracket_percent", "width", "second")], None, LEAST_PERCENT),
        ("Removal rate", "mm³/min", [line("mrr_mm3_min", "as programmed", before),
            line("scheduled_mrr_mm3_min", "scheduled", after)], None, None),
        ("Feed", "mm/min", [line("feed_mm_min", "as programmed", before),
            line("scheduled_feed_mm_min", "scheduled", after)], None, None),
        ("Depth of cut", "mm", [line("ap_mm", "axial ap", "first"), line("ae_mm", "radial ae", "second")], None, None),
        ("Engaged share of a turn", "of 1", [line("engaged_fraction", "engaged", before)], None, None),
        ("Largest chip area of a tooth", "mm²", [line("chip_area_mm2", "chip area", after)], None, None),
        ("Largest chip thickness", "mm", [line("chip_thickness_mm", "chip thickness", "third")], None, None),
        ("Peak of the resultant force", "N", [line("force_n", "force", "fourth")], None, None),
        ("Mean power at the cutter", "W", [line("power_w", "power", "fifth")], None, None),
    ]  # fmt: skip
    made = []
    for title, unit, lines, band, decades in wanted:
        there = [entry for entry in lines if entry["name"] in known]
        if there:
            made.append({"title": title, "unit": unit, "lines": there, "band": band, "log": decades})
    return made


def _tools(job: Job) -> tuple[list[dict[str, Any]], dict[int, int]]:
    """Meridians of cutter, shank and holder, and the place of each tool number in the list."""
    made = [
        {
            "number": number,
            **{name: _meridian(part) for name, part in zip(PARTS, ToolParts.of(tool), strict=True)},
        }
        for number, tool in sorted(job.tools.items())
    ]
    return made, {number: k for k, number in enumerate(sorted(job.tools))}


def _meridian(profile: Profile | None) -> list[list[float]] | None:
    """Points (r, z) from the tip up, closed at the axis; arcs in twelve pieces."""
    if profile is None:
        return None
    points = [[0.0, profile.z_min]]
    for piece in profile.segments:
        if piece.is_arc:
            beta, size = np.linspace(*piece.beta, 13), piece.radius
            points += np.stack([piece.cr + size * np.cos(beta), piece.cz + size * np.sin(beta)], 1).tolist()
        else:
            points += [[piece.r0, piece.z0], [piece.r1, piece.z1]]
    points.append([0.0, profile.z_max])
    return [[round(float(r), 5), round(float(z), 5)] for r, z in points]


def _path(
    toolpath: Toolpath, numbers: Ints, tools: dict[int, int], hits: Container[int]
) -> tuple[dict[str, Any], int]:
    """Straight pieces of the path: kind 1 feed, 2 rapid, 3 rapid through material, 0 a jump that is not drawn."""
    moving = toolpath.blocks.motion
    stride = max(1, len(moving) * 2 // MAX_SEGMENTS)
    machine = toolpath.machine
    turning = [] if machine is None else [machine.axes[k].name.lower() for k in machine.rotary]
    drawn, owner = moving[::stride].tolist(), toolpath.blocks.owner[::stride]
    moves, paths = [toolpath.moves[k] for k in drawn], [toolpath.paths[k] for k in drawn]
    steps = np.array([
        max(2, int(np.ceil(abs(path.angle) / ARC_STEP))) if isinstance(path, Arc)
        else 8 if isinstance(path, Turn) and not path.is_straight else 1
        for path in paths
    ], dtype=np.int64)  # fmt: skip
    last = np.cumsum(steps + 1) - 1
    points, leans = list[Floats](), np.tile([0.0, 0.0, 1.0], (int(last[-1]) + 1, 1))
    turns, angles = [], dict.fromkeys(turning, 0.0)
    for move, path, n, end in zip(moves, paths, steps.tolist(), last.tolist(), strict=True):
        if isinstance(path, Line):
            points += path.start, path.end
        else:
            t = np.linspace(0.0, 1.0, n + 1)
            points.append(path.position(t).ravel())
            if isinstance(path, Turn):
                leans[end - n : end + 1] = path.axis(t)
        if turning:
            first, angles = angles | dict(move.rotary_start or {}), angles | dict(move.rotary_deg or {})
            share = np.linspace(0.0, 1.0, n + 1)
            turns.append([[first[k] + s * (angles[k] - first[k]) for k in turning] for s in share])
    kind = np.array([
        1 if move.motion is not Motion.RAPID else 3 if number in hits else 2
        for move, number in zip(moves, owner.tolist(), strict=True)
    ])  # fmt: skip
    kinds = np.repeat(kind, steps + 1)
    kinds[last] = 0
    row = np.maximum(np.searchsorted(numbers, owner, side="right") - 1, 0)
    cutter = np.array([tools.get(move.tool, 255) for move in moves])
    arrays = {
        "points": np.concatenate(points).astype("<f4"), "kind": kinds[:-1].astype("u1"),
        "segment_row": np.repeat(row, steps + 1)[:-1].astype("<i4"),
        "segment_tool": np.repeat(cutter, steps + 1)[:-1].astype("u1"),
    }  # fmt: skip
    if (np.abs(leans - [0.0, 0.0, 1.0]) > UPRIGHT).any():
        arrays["axes"] = leans.astype("<f4").ravel()
        if turning:
            arrays["turns"] = np.concatenate(turns).astype("<f4").ravel()
    return arrays, stride


def _machine(machine: Machine | None, path: dict[str, Any]) -> dict[str, Any]:
    """The rotary axes of a machine as they lie in the workpiece at home, from the workpiece to the tool.

    Where the program does not name their angles, `turns` (degrees, a row for every point) are added to the path if the
    machine reaches it.
    """
    if machine is None or "axes" not in path:
        return {}
    if "turns" not in path:
        tips, leans = (path[name].reshape(-1, 3).astype(np.float64) for name in ("points", "axes"))
        if len(tips) > MAX_FOLLOWED:
            return {}
        try:
            joints = follow(machine, tips, leans).joints[:, list(machine.rotary)]
        except KinematicsError:  # a page of a path that this machine cannot drive still shows the path
            return {}
        path["turns"] = np.degrees(joints).astype("<f4").ravel()
    turn, origin = machine.work[:3, :3], machine.work[:3, 3]
    return {"machine": [
        {"name": axis.name, "direction": (axis.direction @ turn).tolist(), "point": ((axis.point - origin) @ turn).tolist(),
         "sign": axis.sign, "table": k < machine.table}
        for k in machine.rotary for axis in [machine.axes[k]]
    ]}  # fmt: skip


def _field(job: Job, tools: list[dict[str, Any]], path: dict[str, Any]) -> dict[str, Any]:
    """The raw stock for the cut that is played: "grid" or "volume" for the header, and "arrays"."""
    stock = raw_stock(job)
    undercuts = (
        (np.diff(tool["meridian"][:-1], axis=0)[:, 0] < -UPRIGHT).any() for tool in tools
    )  # narrower above than below
    if "axes" in path or any(undercuts):
        return _volume(stock)
    low, high = stock.bounds
    pitch = float(np.sqrt(np.prod(high[:2] - low[:2]) / CELLS))
    columns, lines = (int(np.ceil((high[k] - low[k]) / pitch)) for k in (0, 1))
    x, y = low[0] + (np.arange(columns) + 0.5) * pitch, low[1] + (np.arange(lines) + 0.5) * pitch
    places = np.stack(np.meshgrid(np.minimum(x, high[0]), np.minimum(y, high[1])), axis=-1).reshape(-1, 2)
    rays = stock.crossings(places)
    last = np.cumsum(rays.counts) - 1
    heights = np.full(len(places), low[2])
    there = rays.counts > 0
    heights[there] = rays.leave[last[there]]
    grid = {
        "low": low[:2].tolist(),
        "pitch": pitch,
        "columns": columns,
        "rows": lines,
        "floor": float(low[2]),
    }
    return {"grid": grid, "arrays": {"heights": heights.astype("<f4")}}


def _volume(stock: Stock) -> dict[str, Any]:
    """Distances to the surface of the stock at the corners of cubic cells: 127 at `BAND` cells outside, -127 inside."""
    low, high = stock.bounds
    pitch = float(np.cbrt(np.prod(high - low) / CORNERS))
    low = low - (BAND - 0.5) * pitch
    size = np.ceil((high - low) / pitch).astype(int) + BAND
    x, y, z = (low[k] + pitch * np.arange(size[k]) for k in range(3))
    places = np.stack(np.meshgrid(z, y, x, indexing="ij")[::-1], axis=-1).reshape(-1, 3)
    levels = np.round(127.0 * np.clip(stock.signed_distance(places) / (BAND * pitch), -1.0, 1.0))
    grid = {"low": low.tolist(), "pitch": pitch, "size": size.tolist()}
    return {"volume": grid, "arrays": {"volume": levels.astype("i1")}}


def packed(header: dict[str, Any], arrays: dict[str, Any]) -> str:
    """The container as base64; every part begins at a multiple of 8 bytes, as typed arrays of browsers need it."""
    places, parts, offset = {}, [], 0
    for name, array in arrays.items():
        data, raw = np.asarray(array), np.asarray(array).tobytes()
        places[name] = {
            "kind": f"{data.dtype.kind}{data.dtype.itemsize}",
            "offset": offset,
            "length": int(data.size),
        }
        parts.append(raw + b"\0" * (-len(raw) % 8))
        offset += len(parts[-1])
    text = json.dumps(header | {"arrays": places}, allow_nan=False, separators=(",", ":")).encode()
    text += b" " * (-(4 + len(text)) % 8)
    body = struct.pack("<I", len(text)) + text + b"".join(parts)
    return base64.b64encode(gzip.compress(body, 3, mtime=0)).decode("ascii")
