"""Volumes along edges: exact where sheets bend fast, against the flux identity."""

from __future__ import annotations

import numpy as np
import pytest
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
from OCP.GeomAPI import GeomAPI_Interpolate
from OCP.gp import gp_Pnt, gp_Vec
from OCP.TColgp import TColgp_HArray1OfPnt

from vmachining import FlatEnd, Sweep, Turn
from vmachining.arrays import Floats
from vmachining.engines import brep
from vmachining.engines.brep.envelopes.grazing_curve import GrazingCurve
from vmachining.engines.brep.envelopes.pieces import turn_pieces
from vmachining.engines.brep.envelopes.segments import LineSide, Moving
from vmachining.engines.brep.occt.shapes import Cylinder, Frame, interpolated
from vmachining.engines.brep.occt.tolerances import CONFUSION_MM, CURVE_FIT_MM, MISS_MM
from vmachining.engines.brep.occt.topology import Builder, Use
from vmachining.engines.brep.translations.caps import Tool


@pytest.mark.parametrize("aside", [0.007, 0.01])
def test_sheets_that_turn_round_the_tool_within_a_hundredth_of_their_height(aside: float) -> None:
    """A pivot in the tool moves aside: the grazing curve of the cylinder jumps half around at that height.

    Straight edges of such a sheet once had nodes in four spans, whatever its knots: 2e-4 of the volume were missing.
    """
    end = (float(np.sin(0.011)), 0.0, float(np.cos(0.011)))
    path = Turn.through((0, 0, 0), (0, aside, 0), "axis", (0, 0, 1), end, control_height=4)
    cutter = FlatEnd(diameter=15, length=55)
    for piece in turn_pieces(cutter.profile, path, 1e-6):
        exact = piece.sweep.flux()
        assert exact.error < 1e-7 * exact.volume
        assert brep.volume(piece.built.builder.solid()) == pytest.approx(exact.volume, rel=1e-7)


def test_folds_between_narrow_bounds_are_seen() -> None:
    """The same with more of a turn: 3e-3 mm inside the sweep, between two hundredths of the height.

    What lies inside, and how deep, says the exact distance; pieces keep to their bound.
    """
    end = (float(np.sin(0.05)), 0.0, float(np.cos(0.05)))
    path = Turn.through((0, 0, 0), (0, 0.1, 0), "axis", (0, 0, 1), end, control_height=4)
    profile = FlatEnd(diameter=15, length=55).profile

    def deepest(grazing: GrazingCurve, sweep: Sweep) -> float:
        """mm, over the sheets of the side at half time."""
        s, half = np.linspace(0.0, 0.15, 301), grazing.moving.state(np.array([0.5]))
        sides = [segment for segment in grazing.segments if isinstance(segment, LineSide)]
        return -float(min(sweep.signed_distance(side.points(grazing, half, s)[0]).min() for side in sides))

    whole = GrazingCurve(Tool.of(profile), Moving(path))
    assert deepest(whole, Sweep.along(profile, path)) > 30.0 * MISS_MM
    pieces = turn_pieces(profile, path, 1e-6)
    assert max(deepest(piece.built.grazing, piece.sweep) for piece in pieces) < 1.2 * MISS_MM


@pytest.mark.parametrize("wide", [3e-3, 1e-3, 3e-4])
def test_edges_that_bend_sharply_lie_on_their_cylinder(wide: float) -> None:
    """Half around within a share of the height: the curve in the parameters of the face begins at its knots."""
    surface = Cylinder(Frame(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])), 4.0)

    def points(s: Floats) -> Floats:
        u = 3.0 + np.arctan((s - 0.52) / wide)
        return np.column_stack([4.0 * np.cos(u), 4.0 * np.sin(u), 50.0 * s])

    curve = interpolated(points, 0.0, 1.0, CURVE_FIT_MM)
    build = Builder()
    path, miss = build._inverted(surface, curve, *build._run(surface, Use(build.edge(curve))))
    s = np.linspace(0.0, 1.0, 20001)
    assert (
        miss <= CONFUSION_MM
        and np.linalg.norm(surface.at(path(s)) - curve.at(s), axis=1).max() < 2.0 * CONFUSION_MM
    )


def test_edges_over_the_seam_of_a_periodic_spline() -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 9)[:-1]
    corners = TColgp_HArray1OfPnt(1, len(turn))
    for k, (x, y) in enumerate(zip(5.0 * np.cos(turn), 3.0 * np.sin(turn) + np.sin(2.0 * turn), strict=True)):
        corners.SetValue(k + 1, gp_Pnt(float(x), float(y), 0.0))
    through = GeomAPI_Interpolate(corners, True, 1e-9)
    through.Perform()
    curve = through.Curve()
    begin, period = curve.FirstParameter(), curve.LastParameter() - curve.FirstParameter()

    def prism(one: float, two: float) -> float:
        """Between the curve and its chord, 2 mm high."""
        a, b = (begin + share * period for share in (one, two))
        wire = BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(curve, a, b).Edge())
        if two - one < 1.0:
            wire.Add(BRepBuilderAPI_MakeEdge(curve.Value(b), curve.Value(a)).Edge())
        face = BRepBuilderAPI_MakeFace(wire.Wire()).Face()
        return brep.volume(BRepPrimAPI_MakePrism(face, gp_Vec(0.0, 0.0, 2.0)).Shape())

    whole = prism(0.0, 1.0)
    # both sides of a chord, one of them over the seam
    for one, two in ((0.0, 0.4), (0.25, 0.75), (0.3, 0.9)):
        assert prism(one, two) + prism(two, one + 1.0) == pytest.approx(whole, rel=1e-12)
