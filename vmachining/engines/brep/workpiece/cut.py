"""The workpiece as one valid B-rep solid whose faces know the block that cut them.

The stock loses one sweep after the other. After each cut the volume must have fallen by an amount inside the
bracket of that block, else the cut is done again with a fuzzy value. Where no value brings a block into its bracket the
cut before it is done in another way, and so on: a cut may leave an edge over which only the next one falls. What cannot
be cut at all ends in a refusal, not in a file. Pieces that hold nothing, which OCCT leaves where walls meet, are dropped. At the
end it must call the solid valid and closed.

Faces: one whose middle lies on the skin of the stock belongs to no block; any other one was made by the earliest block that
removes something and has that point on the boundary of its sweep (distances below `ON_SWEEP_MM`). In the STEP file every face
carries the name of its block and tool, and one colour per block.
"""

from __future__ import annotations

import colorsys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.brep.blank import shape_of
from vmachining.engines.brep.occt.booleans import box_of, minus
from vmachining.engines.brep.occt.measure import volume
from vmachining.engines.brep.occt.parts import distance, faces_of, place, point_inside, without_crumbs
from vmachining.engines.brep.occt.step_out import LabelledFace, volumes_in, write_labelled
from vmachining.engines.brep.occt.tolerances import ON_SWEEP_MM, WORKPIECE_STEP_REL
from vmachining.engines.brep.occt.validity import refuse_unsound
from vmachining.engines.brep.removal.gate import OWN_MM3
from vmachining.engines.brep.swept import solids
from vmachining.errors import EngineError, SweepError
from vmachining.interval import Interval
from vmachining.stock import Blank
from vmachining.sweep import Sweep
from vmachining.sweep.near import SweepIndex
from vmachining.sweep.reach import meets, reaching

FUZZY = (0.0, 1e-5, 1e-4, 1e-3)

BACK, MORE = 3, 60
"""Cuts before a block that are done again in other ways if it cannot be cut, and times that is done for a workpiece."""


def workpiece(stock: Blank, blocks: Sequence[Sequence[Sweep]], brackets: Sequence[Interval]) -> Any:
    """TopoDS_Shape of the stock after all blocks.

    Raises EngineError: No way of cutting a block stays inside its bracket; names the block. The result is not valid or
        closed.
    Raises SweepError: A block that removes something has no B-rep solid; names the block.
    """
    shape = shape_of(stock)
    box = box_of(shape)
    found: tuple[Any, float] | None = (shape, volume(shape))
    numbers = [k for k, bracket in enumerate(brackets) if bracket.hi > 0.0 and _near(blocks[k], box)]
    trail: list[_Ways] = []
    spare, failed, why = MORE, -1, ""
    while found is None or len(trail) < len(numbers):
        if found is not None:
            number = numbers[len(trail)]
            trail.append(_Ways(*found, block_solids(blocks[number], box, number), brackets[number]))
        found = trail[-1].next()
        if found is None:
            ways = trail.pop()
            if len(trail) > failed:
                failed, why = len(trail), ways.refusal()
            spare -= 1
            if spare < 0 or not trail or len(trail) <= failed - BACK:
                raise EngineError(why, engine="brep", block=numbers[failed])
    assert found is not None
    refuse_unsound(found[0])
    return found[0]


class _Ways:
    """The workpiece before a block, and the ways of cutting it that were not tried yet."""

    def __init__(self, shape: Any, before: float, tools: Sequence[Any], bracket: Interval) -> None:
        self._shape, self._before, self._tools, self._bracket = shape, before, tools, bracket
        self._left, self._removed = list(FUZZY), list[str]()

    def next(self) -> tuple[Any, float] | None:
        """(shape, volume) after the next cut that stays inside the bracket."""
        while self._left:
            fuzzy = self._left.pop(0)
            rest = self._shape
            try:
                for tool in self._tools:
                    rest = without_crumbs(minus(rest, [tool], fuzzy))
                after = volume(rest)
            except EngineError as exc:  # as a wrong volume: the next fuzzy value may work
                self._removed.append(f"({exc.reason})")
                continue
            if self._bracket.holds(self._before - after, OWN_MM3 + 1e-9 * self._before):
                return rest, after
            self._removed.append(f"{self._before - after:.6g}")
        return None

    def refusal(self) -> str:
        bounds = f"[{self._bracket.lo:.6g}, {self._bracket.hi:.6g}]"
        return f"removes {', '.join(self._removed) or 'nothing else'} mm3, the bracket is {bounds}"


def _near(sweeps: Sequence[Sweep], box: Floats) -> list[Sweep]:
    return [sweep for sweep in sweeps if meets(sweep, box)]


def block_solids(sweeps: Sequence[Sweep], box: Floats, number: int) -> list[Any]:
    """TopoDS_Solids of what a block sweeps near a box (2, 3); errors name the block."""
    try:
        return [part.shape for sweep in _near(sweeps, box) for part in solids(reaching(sweep, box))]
    except SweepError as exc:
        raise SweepError(f"block {number}: {exc}") from exc
    except EngineError as exc:
        raise EngineError(f"block {number}: {exc.reason}", engine="brep") from exc


def owners(
    shape: Any, stock: Blank, blocks: Sequence[Sequence[Sweep]], brackets: Sequence[Interval]
) -> list[tuple[Any, int]]:
    """(TopoDS_Face, block that made it) for all faces; -1 for the stock."""
    skin = faces_of(shape_of(stock))
    boxes = np.array([box_of(face) for face in skin])
    cutting = [(k, block) for k, block in enumerate(blocks) if brackets[k].hi > 0.0]
    sweeps = [sweep for _, block in cutting for sweep in block]
    block_of = [number for number, block in cutting for _ in block]
    index = SweepIndex(sweeps)
    out = []
    for face in faces_of(shape):
        point = point_inside(face)
        around = ((boxes[:, 0] <= point + ON_SWEEP_MM) & (boxes[:, 1] >= point - ON_SWEEP_MM)).all(axis=1)
        spot = place(point)
        if any(distance(spot, skin[k]) <= ON_SWEEP_MM for k in np.flatnonzero(around)):
            out.append((face, -1))
            continue
        near = index.meets(np.stack([point - ON_SWEEP_MM, point + ON_SWEEP_MM]), len(sweeps))
        made = (k for k in near if abs(float(sweeps[k].signed_distance(point[None])[0])) <= ON_SWEEP_MM)
        out.append((face, next((block_of[k] for k in made), -1)))
    return out


def write_step(
    path: Path,
    stock: Blank,
    blocks: Sequence[Sequence[Sweep]],
    brackets: Sequence[Interval],
    labels: Sequence[str],
) -> float:
    """Write the workpiece as STEP, faces named and coloured by block; returns its volume, mm^3.

    labels : name of every block, such as "block 12 line 30 tool 1".

    Raises EngineError, SweepError: As `workpiece`; or the file cannot be written, or reads back with another volume.
    """
    shape = workpiece(stock, blocks, brackets)
    faces = (
        LabelledFace(face, labels[block] if block >= 0 else "stock", _color(block))
        for face, block in owners(shape, stock, blocks, brackets)
    )
    write_labelled(path, shape, "workpiece", faces)
    exact, back = volume(shape), float(sum(volumes_in(path)))
    if abs(back - exact) > WORKPIECE_STEP_REL * exact:
        raise EngineError(f"{path.name} reads back with {back:.9g} mm3 instead of {exact:.9g}", engine="brep")
    return exact


def _color(block: int) -> tuple[float, float, float]:
    """One colour per block, hues of neighbours far apart (golden ratio); grey for the stock."""
    hue = (block * 0.618033988749895) % 1.0
    return colorsys.hsv_to_rgb(hue, 0.45, 0.9) if block >= 0 else (0.75, 0.75, 0.75)
