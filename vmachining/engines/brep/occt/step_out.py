"""Solids into STEP files, with named and coloured faces, and what comes back of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.Interface import Interface_Static
from OCP.Quantity import Quantity_Color, Quantity_TypeOfColor
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.TCollection import TCollection_ExtendedString, TCollection_HAsciiString
from OCP.TDataStd import TDataStd_Name
from OCP.TDocStd import TDocStd_Document
from OCP.XCAFDoc import XCAFDoc_ColorType, XCAFDoc_DocumentTool

from vmachining.engines.brep.occt.measure import volume
from vmachining.engines.brep.occt.parts import solids_of
from vmachining.engines.brep.occt.step import shapes_in
from vmachining.engines.brep.occt.tolerances import STEP_REL
from vmachining.errors import EngineError

ORIGIN = "vmachining"
"""In the header of a STEP file, as the system it comes from: files of ours are known by it."""


class LabelledFace(NamedTuple):
    """face : TopoDS_Face. rgb : 0 to 1."""

    face: Any
    name: str
    rgb: tuple[float, float, float]


def write_labelled(path: Path, shape: Any, name: str, faces: Iterable[LabelledFace]) -> None:
    """A shape with a name, and names and colours of its faces. Raises EngineError: OCCT cannot; nothing is left then."""
    document = TDocStd_Document(TCollection_ExtendedString("XmlOcaf"))
    shape_tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    color_tool = XCAFDoc_DocumentTool.ColorTool_s(document.Main())
    root = shape_tool.AddShape(shape, False)
    TDataStd_Name.Set_s(root, TCollection_ExtendedString(name))
    for face in faces:
        label = shape_tool.AddSubShape(root, face.face)
        if label.IsNull():
            continue
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(face.name))
        color = Quantity_Color(*face.rgb, Quantity_TypeOfColor.Quantity_TOC_sRGB)
        color_tool.SetColor(label, color, XCAFDoc_ColorType.XCAFDoc_ColorSurf)
    writer = STEPCAFControl_Writer()
    Interface_Static.SetIVal_s("write.stepcaf.subshapes.name", 1)  # known once a writer exists
    writer.SetColorMode(True)
    writer.SetNameMode(True)
    writer.Transfer(document)
    header = APIHeaderSection_MakeHeader(writer.ChangeWriter().Model())
    header.SetOriginatingSystem(TCollection_HAsciiString(ORIGIN))
    _written(path, writer.Write(str(path)))


def solids_in(path: Path | str) -> list[Any]:
    """TopoDS_Solids of a file that is known to be good; `step.read_step` asks what others hand in."""
    return [solid for shape in shapes_in(str(path)) for solid in solids_of(shape)]


def volumes_in(path: Path) -> list[float]:
    """mm^3 of the solids of a file, as read back."""
    return [volume(solid) for solid in solids_in(path)]


def difference(back: Sequence[float], wanted: Sequence[float]) -> str:
    """What became of some volumes (mm^3), in words; nothing if they are the same."""
    if len(back) != len(wanted):
        return f"{len(back)} solids instead of {len(wanted)}"
    inverted = sum(value < 0.0 for value in back)
    gaps = [abs(abs(a) - b) for a, b in zip(sorted(map(abs, back)), sorted(wanted), strict=True)]
    other = sum(not gap <= STEP_REL * value for gap, value in zip(gaps, sorted(wanted), strict=True))
    found = [f"{count} of {len(back)} solids {what}" for count, what in (
        (inverted, "inside out"), (other, f"of another volume, by up to {max(gaps, default=0.0):.3g} mm3")) if count]  # fmt: skip
    return " and ".join(found)


def _written(path: Path, status: Any) -> None:
    if status != IFSelect_ReturnStatus.IFSelect_RetDone:
        path.unlink(missing_ok=True)
        raise EngineError(f"OCCT cannot write {path.name}", engine="brep")
