"""Benchmarks of a clone: `vmachining bench`, one JSON object per line. They are no part of the wheel.

| case | says |
|---|---|
| `abs` | analytic engagement against B-rep solids of parts of our own: percent of the cut length per rotation angle |
| `accuracy` | bracket and error of single sweeps with a closed form, over the chord |
| `brep` | seconds per block of the B-rep gate over a long program |
| `brep-workers` | two B-rep workers against one: times, start-up, processors used, memory of the largest |
| `brep-chains` | random chains through the gate: agreed, retried, refused, disputed, silently wrong; plain booleans beside |
| `columns` | certified columns: time of 1 mm blocks by cutter and width, finishing, deep and arcs, beside the mesh engine |
| `columns-long` | passes over the same part again and again: time a block, memory, checkpoint; `--blocks 1000000` |
| `columns-solid` | 2,000 deep blocks of a ball: columns against one manifold3d solid cut block by block |
| `columns-plates` | cutters of 0.5 to 50 mm on plates of 1 to 2,000 mm: a matrix, then random ones, against counts |
| `columns5-counts` | columns in any direction: brackets of a block in six directions, in parts, turned, and rays: all meet |
| `columns5-widths` | turning blocks by tool and family: time and width of columns, mesh (0.05 mm) and dexels (0.1 mm) |
| `columns-counts` | brackets of columns against counts: random programs, none may lie outside; by family, cutter and seed |
| `dexel-grid` | dexel grids: blocks a second, errors, widths, five-axis blocks, share of the memory's bandwidth |
| `dexel-grid-long` | 500,000 blocks over 100 x 60 x 20 mm at 0.5 mm: whether time a block stays flat |
| `dexel-order` | dexel grids, three directions: how errors against closed forms fall with the spacing |
| `dexel-rate` | 10,000 random blocks with closed forms: how often the stated interval holds them |
| `dexel-shipped` | dexel grids against proven brackets in all programs that come with vmachining: holds, misses, errors, widths |
| `drop` | drop cutter on 100,352 triangles: drops a second of each cutter, OpenCAMLib beside it |
| `engage` | what the cutting edge touches: distances against B-rep solids on curved stock, time of both |
| `engagement-columns` | contact columns of shipped programs against B-rep solids at the same places |
| `force` | a five-axis pass, schedules of 100,000 blocks by every strategy, columns per station |
| `half_cylinder` | time per block of a ball finishing a half cylinder, against one global solid cut block by block |
| `half_cylinder_long` | the same over 20,000 blocks: whether time and memory stay flat |
| `machine` | inverse kinematics, deviation of joint-linear blocks and pulse trains: rates and errors |
| `methods` | a height map, voxels, one global mesh and plain OCCT booleans, judged by the reference set |
| `nc` | lines per second of the NC reader, memory of a million lines |
| `nc_fuzz` | damaged programs: only declared errors, no hang, no word skipped in silence |
| `posts` | programs of CAM posts in the folders of VMACHINING_POSTS: read clean, named by one finding, causes |
| `rays` | microseconds per ray of exact sweeps, three and five axes; the tilting capsule against its closed form |
| `run` | whole runs of 2,000 blocks in one process and in two: stages, memory; one manifold3d solid in the same run; `--blocks` |
| `sweep5` | five-axis meshes against reference volumes: error, bracket, time; time of finishing blocks |
| `sweep-gauntlet` | 1,000 random and hard sweeps: solids, STEP, bracket, exact volume, rays, membership; by family and seed |
| `thin_chips` | width of the brackets of 1 mm finishing blocks, at two chords |
| `vectors` | discrete vectors on the published half cylinder: DVV, DNV, hybrid; times and errors beside the published times |
| `vectors-blocks` | discrete vectors block by block, with removals: three and five axes, exact sweeps and facets |
| `vectors-fine` | the same with 100 million upright vectors |
| `vectors-run` | the same blocks through the engine as `run` uses it, with removals and tables, memory beside it |
| `vectors-mould` | discrete vectors on the published mould cover, 78,524 blocks: 67,368,000 upright, 5 million along normals |
| `vectors-mould-small` | the same body and blocks, vectors ten times as far apart |
| `zmap` | analytic engagement against a compiled Z-map on a staircase: time and error over the pitch |

Times of one run are compared with each other only; machines are noisy.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

from vmachining.errors import InputError

__all__ = ["CASES", "SEEDED", "SIZED", "bench", "case", "described"]

CASES = {
    "abs": "abs",
    "accuracy": "accuracy",
    "brep": "brep",
    "brep-chains": "brep_chains",
    "brep-workers": "brep",
    "columns": "columns",
    "columns-counts": "columns_counts",
    "columns5-counts": "columns5_counts",
    "columns5-widths": "columns5_widths",
    "columns-long": "columns_long",
    "columns-plates": "columns_plates",
    "columns-solid": "columns",
    "dexel-grid": "dexel_grid",
    "dexel-grid-long": "dexel_grid",
    "dexel-order": "dexel_order",
    "dexel-rate": "dexel_grid",
    "dexel-shipped": "dexel_shipped",
    "drop": "drop",
    "engage": "engage",
    "engagement-columns": "force",
    "force": "force",
    "half_cylinder": "half_cylinder",
    "half_cylinder_long": "half_cylinder",
    "machine": "machine",
    "methods": "methods",
    "nc": "nc",
    "nc_fuzz": "nc",
    "posts": "posts",
    "rays": "rays",
    "run": "run",
    "sweep5": "sweep5",
    "sweep-gauntlet": "gauntlet",
    "thin_chips": "half_cylinder",
    "vectors": "vectors",
    "vectors-blocks": "vectors",
    "vectors-fine": "vectors",
    "vectors-run": "vectors",
    "vectors-mould": "mould",
    "vectors-mould-small": "mould",
    "zmap": "zmap",
}
"""File of each case; a case loads only what it measures."""

SIZED = ("columns-long", "columns", "columns-solid", "run")
"""Cases that take `blocks`."""

SEEDED = ("columns-counts", "columns5-counts", "columns-plates", "sweep-gauntlet")
"""Cases that take `first`, `blocks` and `journal`: they resume, and run in parts."""


TAKES = {
    "abs": "45 s",
    "accuracy": "15 s",
    "brep": "over 2 min",
    "brep-chains": "hours",
    "brep-workers": "over 2 min",
    "columns": "2 min",
    "columns-counts": "90 s",
    "columns5-counts": "2 min",
    "columns5-widths": "3 min",
    "columns-long": "1 min",
    "columns-plates": "1 min",
    "columns-solid": "1 min",
    "dexel-grid": "15 s",
    "dexel-grid-long": "30 s",
    "dexel-order": "10 s",
    "dexel-rate": "1 min",
    "dexel-shipped": "3 min",
    "drop": "30 s",
    "engage": "1 min",
    "engagement-columns": "3 min",
    "force": "15 s",
    "half_cylinder": "90 s",
    "half_cylinder_long": "over 5 min",
    "machine": "20 s",
    "methods": "15 min",
    "nc": "1 min",
    "nc_fuzz": "2 min",
    "posts": "10 s",
    "rays": "20 s",
    "run": "2 min",
    "sweep5": "3 min",
    "sweep-gauntlet": "1 h",
    "thin_chips": "75 s",
    "vectors": "25 s",
    "vectors-blocks": "10 s",
    "vectors-fine": "15 s",
    "vectors-run": "1 min",
    "vectors-mould": "65 s",
    "vectors-mould-small": "10 s",
    "zmap": "20 s",
}
"""On one core, kernels compiled; "over": stopped then, on a busy machine; "hours" and "1 h": from a few seeds."""


def described(name: str) -> tuple[str, str]:
    """What a case says, from the table above, and how long it takes."""
    rows = re.findall(r"^\| `([\w-]+)` \| (.+?) \|$", __doc__ or "", re.MULTILINE)
    return dict(rows).get(name, ""), TAKES.get(name, "not measured")


def case(name: str) -> Callable[..., Iterator[dict[str, Any]]]:
    """The function of a case."""
    module = import_module(f"{__name__}.{CASES[name]}")
    found: Callable[..., Iterator[dict[str, Any]]] = getattr(module, name.replace("-", "_"))
    return found


def bench(
    names: list[str],
    *,
    listed: bool,
    blocks: int | None,
    seeds: str | None,
    journal: Path | None,
    as_json: bool,
    emit: Callable[[Any], None],
) -> int:
    """`vmachining bench`. emit : takes each record."""
    for name in names:
        if name not in CASES:
            raise InputError(f"unknown case {name!r}", remedy=f"known: {', '.join(sorted(CASES))}")
    if listed:
        for name in names or sorted(CASES):
            about, takes = described(name)
            if as_json:
                emit({"case": name, "about": about, "takes": takes})
            else:
                print(f"{name:<19}  {takes:<14}  {about}")
        return 0
    options = _seeded(seeds, journal)
    if options and not (names and set(names) <= set(SEEDED)):
        raise InputError("--seeds and --journal belong to one case", remedy=f"name {', '.join(SEEDED)}")
    if blocks is not None:
        if options or not (names and set(names) <= set(SIZED)):
            raise InputError("--blocks belongs to some cases", remedy=f"name {', '.join(SIZED)}")
        options["blocks"] = blocks
    for name in names or sorted(CASES):
        for record in case(name)(**options):
            emit(record)
            sys.stdout.flush()
    return 0


def _seeded(seeds: str | None, journal: Path | None) -> dict[str, Any]:
    """Arguments of a case that goes by seeds."""
    options: dict[str, Any] = {} if journal is None else {"journal": journal}
    if seeds is not None:
        try:
            first, last = (int(word) for word in seeds.split(":"))
        except ValueError as exc:
            raise InputError(
                f"--seeds {seeds!r} is not a range", remedy="give FIRST:LAST, like 0:200"
            ) from exc
        options |= {"first": first, "blocks": last - first}
    return options
