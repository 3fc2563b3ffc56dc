"""Booleans of OCCT, asked whether they worked; boxes, and whether anything is left."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from vmachining.arrays import Floats
from vmachining.errors import EngineError


def _operated(operation: Any, one: Any, others: Sequence[Any], fuzzy: float) -> Any:
    """Result of a boolean; asked whether it worked."""
    from OCP.TopTools import TopTools_ListOfShape

    arguments, tools = TopTools_ListOfShape(), TopTools_ListOfShape()
    arguments.Append(one)
    for other in others:
        tools.Append(other)
    operation.SetArguments(arguments)
    operation.SetTools(tools)
    operation.SetNonDestructive(True)
    operation.SetCheckInverted(False)  # no solid of ours is inside out; asking takes longer than many cuts
    if fuzzy > 0.0:
        operation.SetFuzzyValue(fuzzy)
    try:
        operation.Build()
    except Exception as exc:  # OCCT raises whatever it meets
        raise EngineError(f"the boolean failed: {exc}", engine="brep") from exc
    if not operation.IsDone() or operation.Shape().IsNull():
        raise EngineError("the boolean returns nothing", engine="brep")
    return operation.Shape()


def common(one: Any, other: Any, fuzzy: float) -> Any:
    """What two shapes share. Raises EngineError if OCCT does not say that it is done."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Common

    return _operated(BRepAlgoAPI_Common(), one, [other], fuzzy)


def minus(one: Any, others: Sequence[Any], fuzzy: float) -> Any:
    """A shape without others. Raises EngineError if OCCT does not say that it is done."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut

    return _operated(BRepAlgoAPI_Cut(), one, others, fuzzy)


def box_of(shape: Any) -> Floats:
    """(2, 3) mm, a little wider than the shape."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib

    box = Bnd_Box()
    BRepBndLib.Add_s(shape, box, False)
    if box.IsVoid():
        return np.array([[np.inf] * 3, [-np.inf] * 3])
    low, high = box.CornerMin(), box.CornerMax()
    return np.array([[low.X(), low.Y(), low.Z()], [high.X(), high.Y(), high.Z()]])


def apart(one: Any, other: Any) -> bool:
    """Whether the boxes of two shapes do not touch."""
    a, b = box_of(one), box_of(other)
    return bool((a[0] > b[1]).any() or (b[0] > a[1]).any())


def is_empty(shape: Any) -> bool:
    """Whether a shape has no face."""
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer

    return not TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE).More()


def quiet() -> None:
    """OCCT keeps its messages to itself."""
    from OCP.Message import Message

    Message.DefaultMessenger_s().ChangePrinters().Clear()
