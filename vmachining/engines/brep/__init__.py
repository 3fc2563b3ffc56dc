"""OCCT: swept volumes as valid solids, removed volume per block that is never silently wrong, STEP.

Goal: a B-rep answer beside the mesh bracket. Every value is either inside the bracket or refused with a reason.

1. `solid(sweep)` builds the sweep of a block vertex by vertex: caps trimmed at the grazing curve, the sheet the
   curve draws, discs. No boolean, no sewing; planes, cylinders, cones, spheres, tori wherever these are exact.
2. `volume(shape)` integrates along edges in closed form per kind of face.
3. `Ladder.removed(k, bracket)` is stateless: (S_0 and W_k) minus the earlier sweeps that reach it. Which ones
   do is decided by cells and exact distances. The value must lie in the bracket, else the next rung is tried; one that
   is doubtful must be confirmed by another way, or, where nothing but a turning tool speaks against it, says how far it
   may be off.
4. `check_blocks` runs a ladder in worker processes with a time limit: a crash or a hang costs a rung, at worst
   one block. `isolated` runs any function like that.
5. `step_file` writes the workpiece: cut block by block, each cut gated, valid and closed at the end.
6. `read_step` is the door for STEP stock.

| file | holds |
|---|---|
| `shapes.py` | curves and surfaces with their numpy formula, its inverse, and their OCCT twin |
| `topology.py` | `Builder`: shared vertices and edges, faces with computed parameter curves |
| `caps.py` | poses, circles and segments of an upright tool |
| `level.py`, `upright.py` | level lines and arcs; plunges and full circles |
| `guides.py`, `ramp.py`, `front.py` | ramps and helices; helices whose axis lies in the tool, steep ones |
| `rings.py`, `stretches.py`, `grazes.py` | grazing curves of a tool that turns; valleys of flat faces that tilt |
| `turning.py`, `lens.py`, `turns.py` | solid of a tool that turns; lenses of its flat faces; parts in time, and gates |
| `hinge.py` | halves of a tool that turns about a fixed line through its axis |
| `cover.py` | parts of tool and block whose union is a sweep with a pivot in the tool |
| `swept.py` | `solid`, `solids`, `inspect` |
| `write.py` | `write_solids` |
| `inside.py` | `held`, `inside_out` |
| `measure.py` | `volume` |
| `ladder.py`, `rungs.py` | `Ladder`: the gate and what is tried; rungs by name, `Status`, `Verdict` |
| `doubt.py`, `traits.py` | what makes a value doubtful; what the ladder has to know of a sweep |
| `booleans.py` | what OCCT is asked, and whether it worked |
| `faceted.py` | removed volume from meshes of the solids, where sweeps are unions of many |
| `sections.py` | removed volume from areas of level sections, where booleans of solids hang or lie |
| `rays.py` | what exact rays say about a value that lies in its bracket |
| `live.py`, `outside.py` | where a block can take something: there they stand; what is not stock on them |
| `near.py`, `reach.py` | which earlier sweeps reach a region; what of a sweep can meet the stock |
| `workpiece.py` | the stock after all blocks as a valid solid, STEP with faces named and coloured by block |
| `edges.py`, `edgeworker.py` | `BrepWorkpiece`: which parts of a cutting edge lie in the workpiece |
| `workers.py`, `worker.py` | `check_blocks`, `step_file` and the process they drive |
| `polyhedron.py` | a stock of triangles as a solid of plane faces |
| `blank.py` | `Blank`: raw stock |
| `store.py` | solids and meshes that took long, on disk for the processes of a run |
| `step.py` | `read_step`: STEP -> closed solid -> triangles and exact volume |

Measured (2 cores, shared machine): solids take 15 to 60 ms, helices 100 ms; all tools and 3-axis motions of
tests/brep agree with `Sweep.volume` to 3e-8. `BRepGProp` (plain) is off by up to 1e-3 relative on a shallow ramp
of a bull nose, its adaptive Gauss-Kronrod variant took 70 to 110 s there; `volume` takes 50 ms and is right to
1e-9. A sphere's poles and a torus' seam must lie off the face, or pcurves turn wild: every face chooses its own
frame. Two sheets that meet at less than some 1e-5 mm are not valid for OCCT: such ramps are taken as level.

Chains of random blocks (`python -m vmachining.bench.brep_chains RECORD`), six kinds of cutter, blocks agreed or retried of
those asked, plain successive booleans beside them (right, wrong though valid, wrong and not valid, no answer):

| family | chains | agreed | retried | refused | plain booleans |
|---|---|---|---|---|---|
| zigzag | 29 of 29 | 324 | 41 | 0 | 317, 15, 33, 0 |
| contour | 29 of 29 | 383 | 13 | 0 | 395, 1, 0, 0 |
| ramp | 29 of 29 | 308 | 59 | 0 | 18 chains: 201, 13, 3, 1 |
| helix | 29 of 29 | 231 | 108 | 0 | 3 chains: 22, 8, 1, 4 |
| helical entry | 28 of 28 | 125 | 202 | 2 | 3 chains: 12, 4, 3, 17 |
| smooth | 28 of 28 | 193 | 135 | 0 | 3 chains: 31, 5, 10, 3 |
| kinked | 28 of 28 | 101 | 244 | 7 | 3 chains: 6, 0, 0, 40 |

The seven kinked ones are of chains 111 and 188 and of older code, at 120 s a block; with today's code 188 refuses none, 111 was
not run to its end, and one chain (97) had 300 s. The two helical entries are of chain 130: OCCT's meshes of them take more than
120 s, and their values are far from the estimates; rays bear one of them out since. Rays, with bars of 0.3 % of a value in the
median, called two values wrong, both of older code: chain 146 block 4, 0.16 % too much by all booleans, and smooth chain 5
block 2, where OCCT's mesh of a valid solid lacks 0.19 mm3 of 312 at a sag of 4e-3 and 0.24 at 2e-3. What meshes are known to
miss of their solids is part of their error since then, and rays are asked by the ladder itself. Rows are of several versions.
Run again with rays in pairs, which are as sharp as 5e-4: 14 zigzags, 6 contours, 5 ramps, 2 helices, 2 smooth chains (354
blocks) and 7 kinked ones (94); with the rays before them 7 kinked, 6 smooth chains and 5 helices (198). With values in doubt
asked of as many rays as others: two chains of every family but helical entries (168 blocks), and four of these (48) just
before. All of these 862 agreed or were retried, and none is outside of its bracket or of the referee's rays. The median is 0.6
to 0.8 s of a processor for contours and zigzags, 2 s for ramps, 9 s for smooth passes, 14 to 19 s for helical entries, kinked
passes and helices, beside another run.

Bull nose helices over each other (axis in the cutter): one cut of sheet by sheet takes 3 to 10 s, because OCCT
builds the cache of a spline of hundred knots again at every step across a knot, and some cuts lose a part. Degrees
of 9 to 17 with fewer knots were twice as fast or five times as slow, and lost other parts. Level sections take
0.3 to 0.4 s per height and 8 to 70 s per block, within 1e-4 to 1e-3 of the rays. Planar booleans of OCCT were seen to drop
faces, three ways of cutting to find three areas; the outlines are cut as polygons instead (no failure in
seven chains of helices; on ramps of cones some outlines do not close and are refused).
Unions of many solids are cut as their meshes: 1 to 100 s a block, inside the error bars (0.1 to 0.6 %) of the rays.
Of 91 sweeps of seven kinked chains (turns of up to 34 degrees in 1 to 8 mm) 23 have 5 to 171 solids.
models/slot: 108 of 109 blocks agreed, 1 was retried; models/pocket: 97 of 102 agreed, 5 were retried; of the first 528 of
models/mould 436 agreed, 92 were retried, chips of 1e-4 mm3 among them. Before rays were that sharp, of all its 2552 blocks 2364
agreed and 188 were retried, and models/half_cylinder had 2151 of 2151 agreed, 0.8 s each. Of 20 sampled blocks of a five-axis
impeller (4492 blocks) 3 agreed, 16 were retried, 1 was refused: booleans of its 29 neighbours' meshes take 159 s, more than
120. A block of overlapping passes takes 0.35 s (ball) to 0.7 s (flat, bull nose) of processor time beside another run, and the
same at the end of 2000 blocks as at their beginning (0.91 to 1.015 times as much); two ramps of a torus that cut into each
other take 23 s, because both meet in spline faces of a hundred knots. Workers stay below 0.9 GB, two of them are 1.9 times as
fast as one, the process that drives them has 0.4 s of work in 200 blocks.

Tools that turn: a spline sheet and its neighbours share nodes, so borders agree to rounding. Flat faces that tilt
re-enter nearly always; valleys and lenses cut that off in closed form, and the volume is V(K) + Phi - W of the
flux identity (gate 1e-5, mostly met to 1e-8). Where the envelope folds, parts of the tool and of the block and some
poses cover the sweep (`cover.py`; folds and gaps up to 3e-5 mm). Turns about a fixed line through the axis
are two or four solids of analytic faces (`hinge.py`, 0.1 s). In the sweep gauntlet (seeds 0 to 999) 994 blocks have
solids, 688 of them one, at most 328; 6 are refused (74 201 354 604 729 821), none contradicted a bracket, a ray or a
point, and one (742) is not written as STEP, which would change volumes of its parts by 2e-8. Processor time, gates
included: 0.11 s in the median; covers of a hundred solids take 5 to 90 s, and a block that is refused 36 to 108 s.
Jobs of 21 five-axis blocks each, before values were doubted: ball 20 agreed and 1 retried, bull nose 17 and 4, flat 13 and 8.

Known limits: a block whose solid cannot be built is refused by name, and so are blocks that need it as a
neighbour: cones that meet a steep slope on arcs in upright planes, steps of a cutter there, and what `turns.py`
says of tools that turn. A cutter that is not convex on a ramp, and arcs or helices that come
back to themselves, are several solids whose union is the sweep: a helical entry is the cutter at its lowest, and
what its front passes per half turn. A cone's apex brings one edge without length, which OCCT wants there.
Brackets of the mesh engine are those of the triangles of a curved STEP; jobs widen them by what the triangles
can change (`stock_slack_mm3` of the summary), so a gate on such a stock is that much weaker.
A workpiece as STEP is cut block by block in one process: minutes for a hundred blocks, not for thousands.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from vmachining.engines.brep.step import StepSolid, read_step

if TYPE_CHECKING:
    from vmachining.engines.brep.blank import Blank
    from vmachining.engines.brep.edges import BrepWorkpiece
    from vmachining.engines.brep.inside import held
    from vmachining.engines.brep.ladder import Ladder
    from vmachining.engines.brep.measure import volume
    from vmachining.engines.brep.rungs import RUNGS, Status, Verdict
    from vmachining.engines.brep.swept import Inspection, inspect, solid, solids
    from vmachining.engines.brep.workers import check_blocks, isolated, step_file
    from vmachining.engines.brep.write import Described, described, write_solids, write_sweep

__all__ = [
    "RUNGS",
    "Blank",
    "BrepWorkpiece",
    "Described",
    "Inspection",
    "Ladder",
    "Status",
    "StepSolid",
    "Verdict",
    "check_blocks",
    "described",
    "held",
    "inspect",
    "isolated",
    "read_step",
    "solid",
    "solids",
    "step_file",
    "volume",
    "write_solids",
    "write_sweep",
]

_FILES = {
    "edges": ("BrepWorkpiece",),
    "inside": ("held",),
    "blank": ("Blank",),
    "ladder": ("Ladder",),
    "measure": ("volume",),
    "rungs": ("RUNGS", "Status", "Verdict"),
    "swept": ("Inspection", "inspect", "solid", "solids"),
    "workers": ("check_blocks", "isolated", "step_file"),
    "write": ("Described", "described", "write_solids", "write_sweep"),
}
_HOME = {name: file for file, names in _FILES.items() for name in names}


def __getattr__(name: str) -> Any:
    """OCCT takes seconds to load: only for who asks for it."""
    if name in _HOME:
        return getattr(importlib.import_module(f"{__name__}.{_HOME[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
