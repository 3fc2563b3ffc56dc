"""The workpiece as one valid B-rep solid whose faces know the block that cut them.

The stock loses one sweep after the other. After each cut the volume must have fallen by an amount inside the
bracket of that block, else the cut is done again with a fuzzy value. Where no value brings a block into its bracket the
cut before it is done in another way, and so on: a cut may leave an edge over which only the next one falls. What cannot
be cut at all ends in a refusal, not in a file. Pieces that hold nothing, which OCCT leaves where walls meet, are dropped. At the
end it must call the solid valid and closed.

Faces: one whose middle lies on the skin of the stock belongs to no block; any other one was made by the earliest block that
removes something and has that point on the boundary of its sweep (distances below `ON_MM`). In the STEP file every face
carries the name of its block and tool, and one colour per block.
"""

from __future__ import annotations

import colorsys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.brep.blank import Blank
from vmachining.engines.brep.occt.booleans import box_of, is_empty, minus
from vmachining.engines.brep.occt.measure import volume
from vmachining.engines.brep.occt.validity import inspect
from vmachining.engines.brep.removal.gate import OWN_MM3
from vmachining.engines.brep.swept import solids
from vmachining.errors import EngineError, SweepError
from vmachining.geometry import Bracket
from vmachining.sweep import Sweep
from vmachining.sweep.near import SweepIndex
from vmachining.sweep.reach import meets, reaching

__all__ = ["owners", "workpiece", "write_step"]

FUZZY = (0.0, 1e-5, 1e-4, 1e-3)

BACK, MORE = 3, 60
"""Cuts before a block that are done again in other ways if it cannot be cut, and times that is done for a workpiece."""

CRUMB_MM3 = 1e-9
"""A cube of 1e-3 mm: solids of less are none. Crumbs seen held 4e-21."""

ON_MM = 1e-4
"""A point of a face is on a sweep within OCCT's tolerance of intersection curves."""


def workpiece(stock: Blank, blocks: Sequence[Sequence[Sweep]], brackets: Sequence[Bracket]) -> Any:
    """TopoDS_Shape of the stock after all blocks.

    Raises
    ------
    EngineError
        No way of cutting a block stays inside its bracket; names the block. The result is not valid or closed.
    SweepError
        A block that removes something has no B-rep solid; names the block.
    """
    shape = stock.shape()
    box = box_of(shape)
    found: tuple[Any, float] | None = (shape, volume(shape))
    numbers = [k for k, bracket in enumerate(brackets) if bracket.hi > 0.0 and _near(blocks[k], box)]
    trail: list[_Ways] = []
    spare, failed, why = MORE, -1, ""
    while found is None or len(trail) < len(numbers):
        if found is not None:
            number = numbers[len(trail)]
            trail.append(_Ways(*found, _tools(blocks[number], box, number), brackets[number]))
        found = trail[-1].next()
        if found is None:
            ways = trail.pop()
            if len(trail) > failed:
                failed, why = len(trail), ways.refusal()
            spare -= 1
            if spare < 0 or not trail or len(trail) <= failed - BACK:
                raise EngineError(why, engine="brep", block=numbers[failed])
    assert found is not None
    _check(found[0])
    return found[0]


class _Ways:
    """The workpiece before a block, and the ways of cutting it that were not tried yet."""

    def __init__(self, shape: Any, before: float, tools: Sequence[Any], bracket: Bracket) -> None:
        self._shape, self._before, self._tools, self._bracket = shape, before, tools, bracket
        self._left, self._removed = list(FUZZY), list[str]()

    def next(self) -> tuple[Any, float] | None:
        """(shape, volume) after the next cut that stays inside the bracket."""
        while self._left:
            fuzzy = self._left.pop(0)
            rest = self._shape
            try:
                for tool in self._tools:
                    rest = _whole(minus(rest, [tool], fuzzy))
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


def _whole(shape: Any) -> Any:
    """The shape without those of its solids that hold nothing; as it is where it has faces that belong to none.

    Raises
    ------
    EngineError
        A solid is inside out.
    """
    import cadquery as cq

    pieces = cq.Shape.cast(shape).Solids()
    held = [volume(piece.wrapped) for piece in pieces]
    if min(held, default=0.0) < -CRUMB_MM3:
        raise EngineError("a piece is inside out", engine="brep")
    kept = [piece for piece, value in zip(pieces, held, strict=True) if value > CRUMB_MM3]
    if len(kept) == len(pieces) or _is_loose(shape):
        return shape
    return cq.Compound.makeCompound(kept).wrapped


def _is_loose(shape: Any) -> bool:
    """Whether it has faces that belong to no solid."""
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer

    kinds = TopAbs_ShapeEnum
    return bool(TopExp_Explorer(shape, kinds.TopAbs_FACE, kinds.TopAbs_SOLID).More())


def _near(sweeps: Sequence[Sweep], box: Floats) -> list[Sweep]:
    return [sweep for sweep in sweeps if meets(sweep, box)]


def _tools(sweeps: Sequence[Sweep], box: Floats, number: int) -> list[Any]:
    """Solids of a block."""
    try:
        return [part.shape for sweep in _near(sweeps, box) for part in solids(reaching(sweep, box))]
    except SweepError as exc:
        raise SweepError(f"block {number}: {exc}") from exc
    except EngineError as exc:
        raise EngineError(f"block {number}: {exc.reason}", engine="brep") from exc


def _check(shape: Any) -> None:
    """Valid, and every shell closed and the skin of a solid that holds something; there may be several, or a hole inside."""
    from OCP.BRep import BRep_Tool
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer

    if not inspect(shape).valid:
        raise EngineError("OCCT does not call the workpiece a valid shape", engine="brep")
    loose = _is_loose(shape)
    shells = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_SHELL)
    while shells.More() and not loose:
        loose = not BRep_Tool.IsClosed_s(shells.Current())
        shells.Next()
    if loose:
        raise EngineError("OCCT does not call the workpiece closed", engine="brep")
    if is_empty(_whole(shape)):
        raise EngineError("nothing is left of the stock", engine="brep")


def owners(
    shape: Any, stock: Blank, blocks: Sequence[Sequence[Sweep]], brackets: Sequence[Bracket]
) -> list[tuple[Any, int]]:
    """(TopoDS_Face, block that made it) for all faces; -1 for the stock."""
    import cadquery as cq
    from OCP.BRepExtrema import BRepExtrema_DistShapeShape

    skin = [face.wrapped for face in cq.Shape.cast(stock.shape()).Faces()]
    boxes = np.array([box_of(face) for face in skin])
    cutting = [(k, block) for k, block in enumerate(blocks) if brackets[k].hi > 0.0]
    sweeps = [sweep for _, block in cutting for sweep in block]
    block_of = [number for number, block in cutting for _ in block]
    index = SweepIndex(sweeps)
    out = []
    for face in cq.Shape.cast(shape).Faces():
        point = _inside(face)
        around = ((boxes[:, 0] <= point + ON_MM) & (boxes[:, 1] >= point - ON_MM)).all(axis=1)
        place = cq.Vertex.makeVertex(*point.tolist()).wrapped
        if any(BRepExtrema_DistShapeShape(place, skin[k]).Value() <= ON_MM for k in np.flatnonzero(around)):
            out.append((face.wrapped, -1))
            continue
        near = index.meets(np.stack([point - ON_MM, point + ON_MM]), len(sweeps))
        made = (block_of[k] for k in near if abs(float(sweeps[k].signed_distance(point[None])[0])) <= ON_MM)
        out.append((face.wrapped, next(made, -1)))
    return out


def _inside(face: Any) -> Floats:
    """(3,) point of a face, off its edges: the middle of its largest triangle."""
    vertices, triangles = face.tessellate(0.1, 0.3)
    points = np.array([v.toTuple() for v in vertices]).reshape(-1, 3)
    if triangles:
        a, b, c = points[np.array(triangles)].transpose(1, 0, 2)
        best = int(np.argmax(np.linalg.norm(np.cross(b - a, c - a), axis=1)))
        middle = (a[best] + b[best] + c[best]) / 3.0
    else:  # a face too thin for OCCT to triangulate
        middle = np.array([v.toTuple() for v in face.Vertices()]).mean(axis=0)
    import cadquery as cq

    # triangles of a curved face lie beside it: back onto the surface
    from OCP.BRepExtrema import BRepExtrema_DistShapeShape

    near = BRepExtrema_DistShapeShape(cq.Vertex.makeVertex(*middle.tolist()).wrapped, face.wrapped)
    p = near.PointOnShape2(1)
    return np.array([p.X(), p.Y(), p.Z()])


def write_step(
    path: Path,
    stock: Blank,
    blocks: Sequence[Sequence[Sweep]],
    brackets: Sequence[Bracket],
    labels: Sequence[str],
) -> float:
    """Write the workpiece as STEP, faces named and coloured by block; returns its volume, mm^3.

    labels : name of every block, such as "block 12 line 30 tool 1".

    Raises
    ------
    EngineError, SweepError
        As `workpiece`; or the file cannot be written, or reads back with another volume.
    """
    import cadquery as cq
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.Interface import Interface_Static
    from OCP.Quantity import Quantity_Color, Quantity_TypeOfColor
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDataStd import TDataStd_Name
    from OCP.TDocStd import TDocStd_Document
    from OCP.XCAFDoc import XCAFDoc_ColorType, XCAFDoc_DocumentTool

    shape = workpiece(stock, blocks, brackets)
    document = TDocStd_Document(TCollection_ExtendedString("XmlOcaf"))
    shape_tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    color_tool = XCAFDoc_DocumentTool.ColorTool_s(document.Main())
    root = shape_tool.AddShape(shape, False)
    TDataStd_Name.Set_s(root, TCollection_ExtendedString("workpiece"))
    for face, block in owners(shape, stock, blocks, brackets):
        label = shape_tool.AddSubShape(root, face)
        if label.IsNull():
            continue
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(labels[block] if block >= 0 else "stock"))
        hue = (block * 0.618033988749895) % 1.0
        rgb = colorsys.hsv_to_rgb(hue, 0.45, 0.9) if block >= 0 else (0.75, 0.75, 0.75)
        color = Quantity_Color(*rgb, Quantity_TypeOfColor.Quantity_TOC_sRGB)
        color_tool.SetColor(label, color, XCAFDoc_ColorType.XCAFDoc_ColorSurf)
    writer = STEPCAFControl_Writer()
    Interface_Static.SetIVal_s("write.stepcaf.subshapes.name", 1)  # known once a writer exists
    writer.SetColorMode(True)
    writer.SetNameMode(True)
    writer.Transfer(document)
    if writer.Write(str(path)) != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise EngineError(f"OCCT cannot write {path.name}", engine="brep")
    exact = volume(shape)
    shapes = [cq.Shape.cast(v.wrapped) for v in cq.importers.importStep(str(path)).vals()]  # type: ignore[union-attr]
    back = float(sum(volume(part.wrapped) for whole in shapes for part in whole.Solids()))
    if abs(back - exact) > 1e-6 * exact:
        raise EngineError(f"{path.name} reads back with {back:.9g} mm3 instead of {exact:.9g}", engine="brep")
    return exact
