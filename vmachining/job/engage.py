"""`engage`: the tool of a job at a fraction of one of its blocks, and what its cutting edge touches there."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, rows
from vmachining.engagement import (
    By,
    Engagement,
    Past,
    RayWorkpiece,
    Stock,
    Workpiece,
    contact,
    facing_parts,
    sweeps_near,
)
from vmachining.engagement.analytic import HeightStock, HeightWorkpiece, corner_of, heights_of
from vmachining.errors import InputError
from vmachining.geometry import Line
from vmachining.job.brep import blank
from vmachining.job.jobfile import Job
from vmachining.job.paths import CutterPath
from vmachining.job.stock import raw_stock
from vmachining.job.toolpath import Block, Toolpath
from vmachining.nc import Program
from vmachining.stock import StepStock
from vmachining.sweep import Stance, Sweep, Turn
from vmachining.sweep.bounds import body_bounds
from vmachining.tolerance import LENGTH_EPS_MM
from vmachining.tool import Edge, EdgeParts, Profile

Method = Literal["dexel", "brep", "analytic"]
EdgeKind = Literal["straight", "helix"]
METHODS: tuple[str, ...] = get_args(Method)
EDGES: tuple[str, ...] = get_args(EdgeKind)
PITCH_MM = 0.1
"""Cells of the heights that method "analytic" meets."""

CLIP_MM = 2.0
"""Earlier tools are cut off this far beyond the highest point that could lie in them."""

LEAST_ANGLES, MOST_ANGLES = 4, 100_000


def engage(
    job: Job | Path | str | Scene,
    block: int,
    *,
    at: float = 0.5,
    method: Method = "dexel",
    angles: int = 360,
    phase: float = 0.0,
    edge: EdgeKind = "straight",
    bottom: bool = False,
    seconds: float = 120.0,
    pitch: float = PITCH_MM,
) -> Engagement:
    """What the cutting edge touches with the tool at a fraction of a block, in the in-process workpiece.

    Parameters
    ----------
    job : or the file of one, or its `Scene`.
    block : number in the table of `run`, from 0.
    at : 0 to 1 of the length of its feed motions.
    method : "dexel": exact distances to stock and earlier sweeps, no kernel. "brep": curve of the edge against
        the B-rep solids of stock and earlier sweeps, by OCCT in a separate process. "analytic": closed forms
        against the heights of the workpiece over cells of `pitch`; flat, bull and ball cutters.
    angles, phase : the grid of rotation angles, 360 (k + phase) / angles degrees; phase from 0 to below 1.
    edge : "straight", the meridian; "helix", wound by the helix angle of the tool.
    bottom : the edge continues over the bottom disc to the axis.
    seconds : limit of one question to OCCT.
    pitch : mm, cells of method "analytic"; walls that do not lie on them are off by up to half of it.

    Raises
    ------
    InputError
        A block that is not there or only moves rapidly, a fraction or number of angles out of range, an unknown
        method or edge, a tool without helix angle, a stock of triangles for "brep"; program, tools or stock of
        the job cannot be used.
    SweepError
        Method "brep": an earlier block has no B-rep solid; names it.
    EngineError
        OCCT failed or took too long.
    """
    scene = job if isinstance(job, Scene) else Scene.of(Job.of(job))
    _check(at, method, angles, phase, edge, seconds, pitch)
    index, t = scene.place(block, at)
    _, number, path = scene.cuts[index]
    tool = scene.job.tools[number]
    helix = tool.helix_deg if edge == "helix" else 0.0
    if helix is None:
        remedy = "give helix_deg in its [[tools]] table, or a straight edge"
        raise InputError(f"tool {number} has no helix angle", remedy=remedy)
    cutting, stance = Edge(tool, helix_deg=helix, bottom=bottom), Stance.on(path, t)
    own: list[Past] = []  # the first part of the block, where it can cover the front of the tool
    if t > 0.0 and not (isinstance(path, Line) and tool.cutter.is_convex):
        own = [Past(block, Sweep.along(tool.cutter, path if t == 1.0 else path.split([t])[0]))]
    stock, notes = scene._stock(method)
    phi = 2.0 * np.pi * (np.arange(angles) + phase) / angles
    parts = facing_parts(cutting, stance, phi)
    if method == "dexel" or scene.job.keys.stock.step is None:  # where the stock is known without OCCT
        parts = RayWorkpiece(scene._stock("dexel")[0], []).holds(cutting, stance, phi, parts)
    region = _region(cutting, stance, phi, parts)
    # heights over cells cannot tell what the front of the tool only touches, which is what it has just cut
    room = 2.0 * pitch - t * path.length if method == "analytic" else 0.0
    past = scene._reaching(index, region, scene._without_ends(index, room))
    # heights need every sweep above the region, not only those that end the edge
    near = past if method == "analytic" else sweeps_near(cutting, stance, phi, parts, past)
    if method == "analytic":
        corner_of(tool.cutter)  # refuses other cutters before anything is computed
        notes += (f"the workpiece is known by its heights over cells of {pitch:g} mm",)
    if not bottom and tool.cutter.points[0, 0] > 0.0 and _bottom_leads(stance, tool.cutter):
        notes += ("the bottom disc leads too and may cut; the edge includes it only with --bottom",)
    with scene._workpiece(method, stock, near, seconds, pitch, region) as workpiece:
        found = contact(cutting, stance, workpiece, own, angles=angles, phase=phase)
    line = next(b.line for b in scene.blocks if b.number == block)
    wall = pitch if method == "analytic" else 0.0
    return Engagement(cutting, stance, found, method, at, block, line, notes, wall)


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A job with its program read, for several questions.

    cuts : (block, tool, path) of every feed motion in program order.
    """

    job: Job
    program: Program
    blocks: Sequence[Block]
    cuts: tuple[tuple[int, int, CutterPath], ...]
    _kept: dict[str, Any]

    @classmethod
    def of(cls, job: Job) -> Scene:
        """Read the program of a job. Raises as `engage` does."""
        toolpath = Toolpath.of_job(job)
        cuts = (
            (block.number, move.tool, path)
            for block in toolpath.blocks
            for move, path in toolpath.cuts(block)
        )
        return cls(job, toolpath.program, toolpath.blocks, tuple(cuts), {})

    def place(self, block: int, at: float) -> tuple[int, float]:
        """Position in `cuts`, and t in [0, 1] there. Raises InputError as `engage` does."""
        if not 0 <= block < len(self.blocks):
            last = len(self.blocks) - 1
            has = f"blocks 0 to {last}" if last >= 0 else "no block that moves"
            raise InputError(
                f"there is no block {block}: the program has {has}", remedy="see the table of a run"
            )
        mine = [k for k, cut in enumerate(self.cuts) if cut[0] == block]
        if not mine:
            known = self.blocks[block]
            raise InputError(
                f"block {block} is a rapid and cuts nothing: {known.text.strip()!r}",
                file=self.program.name, line=known.line, remedy="take a block with a feed motion",
            )  # fmt: skip
        sizes = np.array([self.cuts[k][2].length for k in mine])
        if sizes.max() <= LENGTH_EPS_MM:  # the tip rests, the tool turns
            sizes = np.ones(len(mine))
        ends = np.concatenate([[0.0], np.cumsum(sizes)]) / sizes.sum()
        which = min(int(np.searchsorted(ends, at, side="right")) - 1, len(mine) - 1)
        low, high = ends[which], ends[which + 1]
        return mine[which], float(np.clip((at - low) / (high - low), 0.0, 1.0))

    def _without_ends(self, index: int, room: float) -> dict[int, CutterPath | None]:
        """Cuts that lead up to a cut without their last `room` mm in all; None: nothing is left."""
        out: dict[int, CutterPath | None] = {}
        here = self.cuts[index][2].position(0.0)
        while room > 0.0 and index > 0:
            index -= 1
            path = self.cuts[index][2]
            if np.linalg.norm(path.position(1.0) - here) > LENGTH_EPS_MM:
                break
            out[index] = path.split([1.0 - room / path.length])[0] if path.length > room else None
            room, here = room - path.length, path.position(0.0)
        return out

    def _reaching(
        self, index: int, region: Floats, instead: Mapping[int, CutterPath | None] = MappingProxyType({})
    ) -> list[Past]:
        """Earlier sweeps whose box meets a region (2, 3), of tools as high as they can reach it."""
        reach, low, high = self._reaches(index, region)
        close = np.flatnonzero(((low <= region[1]) & (high >= region[0])).all(axis=1))
        out = []
        clips: dict[tuple[int, float], Profile] = {}
        for k in close:
            block, number, whole = self.cuts[k]
            path = instead.get(int(k), whole)
            if path is None:
                continue
            profile, top = self.job.tools[number].cutter, float(reach[k])
            if top < profile.z_max:
                if (number, top) not in clips:
                    clips[number, top] = profile.clip(profile.z_min, top)
                profile = clips[number, top]
            if isinstance(path, Turn) and not _meet(body_bounds(profile, path), region):
                continue
            sweep = Sweep.along(profile, path)
            if _meet(sweep.bounds, region):
                out.append(Past(block, sweep))
        return out

    def _boxes(self) -> tuple[Floats, Floats]:
        """(n, 2, 3) mm: boxes of the paths of all cuts. (n, 4): lowest and highest point and largest radius of their tools in
        mm, and 1 where the tool leans or turns."""
        if "boxes" not in self._kept:
            boxes = np.array([path.bounds for _, _, path in self.cuts]).reshape(-1, 2, 3)
            sizes = [
                (cutter.z_min, cutter.z_max, cutter.max_radius, float(isinstance(path, Turn)))
                for _, number, path in self.cuts
                for cutter in (self.job.tools[number].cutter,)
            ]
            self._kept["boxes"] = boxes, np.array(sizes).reshape(-1, 4)
        boxes, found = self._kept["boxes"]
        return boxes, found

    def _reaches(self, index: int, region: Floats) -> tuple[Floats, Floats, Floats]:
        """Of every earlier cut: height above its tip that can matter, and corners (n, 3) of a box around its sweep; mm."""
        boxes, sizes = (column[:index] for column in self._boxes())
        bottom, top, radius, turns = sizes.T
        away = np.maximum(np.maximum(region[1] - boxes[:, 0], boxes[:, 1] - region[0]), 0.0)
        reach = np.ceil(np.linalg.norm(away, axis=1) + CLIP_MM)
        top = np.minimum(top, reach)
        far = np.hypot(radius, np.maximum(np.abs(bottom), top))
        aside = np.where(turns > 0.0, far, radius)
        low = boxes[:, 0] - np.column_stack([aside, aside, np.where(turns > 0.0, far, -bottom)])
        high = boxes[:, 1] + np.column_stack([aside, aside, np.where(turns > 0.0, far, top)])
        return reach, low, high

    def _stock(self, method: str) -> tuple[Any, tuple[str, ...]]:
        """The stock as the method takes it, and what must be known of it; made once."""
        method = "brep" if method == "brep" else "dexel"
        if method not in self._kept:
            self._kept[method] = (blank(self.job), ()) if method == "brep" else plain_stock(self.job)
        stock, notes = self._kept[method]
        return stock, notes

    def distance(self, index: int, points: Floats) -> Floats:
        """(n,) mm of points (n, 3) to the workpiece that a cut meets, below 0 inside; a bound where two surfaces are near."""
        stock, _ = self._stock("dexel")
        out = stock.signed_distance(points)
        for one in self._reaching(index, np.stack([points.min(axis=0), points.max(axis=0)])):
            out = np.maximum(out, -one.signed_distance(points))
        return np.asarray(out)

    def heights(
        self, pitch: float, region: Floats | None = None, after: int | None = None
    ) -> HeightStock | None:
        """The workpiece after a block (None: after all) as heights over cells, see `heights_of`."""
        last = len(self.cuts) if after is None else sum(cut[0] <= after for cut in self.cuts)
        stock, _ = self._stock("analytic")
        return heights_of(stock, self._reaching(last, np.array(stock.bounds)), pitch, region)

    def _workpiece(
        self, method: str, stock: Any, past: list[Past], seconds: float, pitch: float, region: Floats
    ) -> AbstractContextManager[Workpiece]:
        if method == "analytic":
            return nullcontext(HeightWorkpiece(heights_of(stock, past, pitch, region)))
        if method == "dexel":
            return nullcontext(RayWorkpiece(stock, past))
        from vmachining.engines.brep import BrepWorkpiece

        return BrepWorkpiece(stock, [(one.block, one.sweep) for one in past], By.STOCK, seconds)


def _check(
    at: float, method: str, angles: int, phase: float, edge: str, seconds: float, pitch: float
) -> None:
    many = f"{angles} angles: expected {LEAST_ANGLES} to {MOST_ANGLES}"
    straight = "method 'analytic' works with the straight edge only"
    for right, wrong, remedy in (
        (method in METHODS, f"unknown method {method!r}", f"one of {', '.join(METHODS)}"),
        (math.isfinite(pitch) and pitch > 0.0, f"a pitch of {pitch:g} mm: expected a positive number", None),
        (method != "analytic" or edge != "helix", straight, "take dexel or brep for a helix"),
        (edge in EDGES, f"unknown edge {edge!r}", f"one of {', '.join(EDGES)}"),
        (0.0 <= at <= 1.0, f"the fraction {at:g} of the block is not between 0 and 1", "0.5 is its middle"),
        (LEAST_ANGLES <= angles <= MOST_ANGLES, many, "360 is one per degree"),
        (0.0 <= phase < 1.0, f"phase {phase:g} of the angles is not from 0 to below 1", None),
        (
            math.isfinite(seconds) and seconds > 0.0,
            f"a limit of {seconds} s: expected a positive number",
            None,
        ),
    ):
        if not right:
            raise InputError(wrong, remedy=remedy)


def _bottom_leads(stance: Stance, cutter: Profile) -> bool:
    """Whether some point of the bottom disc moves out of the tool, beyond rounding."""
    sink = -float(stance.velocity @ stance.axis)
    swing = float(cutter.points[0, 0]) * float(np.linalg.norm(stance.axis_rate))
    return sink + swing > 1e-9 * max(float(np.linalg.norm(stance.velocity)), swing)


def _region(edge: Edge, stance: Stance, phi: Floats, parts: EdgeParts) -> Floats:
    """(2, 3) mm: a box around parts of the edge, and around what lies between two angles."""
    if not len(parts.row):
        return np.array([[np.inf] * 3, [-np.inf] * 3])
    share = np.linspace(0.0, 1.0, 9)
    s = parts.lower[:, None] + (parts.upper - parts.lower)[:, None] * share
    row, piece = (np.repeat(column, len(share)) for column in (parts.row, parts.piece))
    points = stance.points(edge, phi[row], piece, s.ravel())
    # between two samples of a stretch, and to the next angle
    margin = edge.stretch * float((parts.upper - parts.lower).max()) / 16.0
    margin += 2.0 * np.pi * edge.profile.max_radius / len(phi)
    return np.stack([points.min(axis=0) - margin, points.max(axis=0) + margin])


def _meet(one: Floats, other: Floats) -> bool:
    return bool((one[0] <= other[1]).all() and (one[1] >= other[0]).all())


def plain_stock(job: Job) -> tuple[Stock, tuple[str, ...]]:
    """The stock without a kernel: box and cylinder exact, files by their triangles."""
    stock = raw_stock(job)
    if not isinstance(stock, StepStock) or stock.slack_mm3 <= 0.0:
        return stock, ()
    chord = job.keys.accuracy.chord_mm
    return stock, (f"the STEP stock is known by triangles within {chord:g} mm; method brep takes its faces",)


def height_map(
    job: Job, *, pitch: float, after: int | None = None, region: ArrayLike | None = None
) -> HeightStock:
    """The workpiece as a staircase for the analytic engagement: a rough-milled part for its semi-finish.

    Parameters
    ----------
    pitch : mm, largest size of a cell. Heights are exact on the vertical lines through the middles of cells.
    after : last block that has cut, None: all of them.
    region : (2, 2) or (2, 3) mm, corners of the part as designed; None: all of the stock.

    Raises
    ------
    InputError
        A pitch that is not positive, a region beside the stock; program, tools or stock cannot be used.
    StockError
        Too many cells.
    """
    if not (np.isfinite(pitch) and pitch > 0.0):
        raise InputError(f"a pitch of {pitch:g} mm: expected a positive number")
    scene = Scene.of(job)
    box = None
    if region is not None:
        box = np.array([[-np.inf] * 3, [np.inf] * 3])
        given = rows(region, 2, np.shape(region)[-1], name="region")
        box[:, : given.shape[1]] = given
    stock = scene.heights(pitch, box, after)
    if stock is None:
        raise InputError(
            "the region does not meet the stock", remedy="give its corners in work coordinates, mm"
        )
    return stock
