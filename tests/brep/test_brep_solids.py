"""Swept solids: OCCT accepts them, their volume is the closed form, STEP keeps it."""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np
import pytest

from vmachining import BallNose, BullNose, FlatEnd, ProfileTool, Sweep, SweepError, Taper
from vmachining.engines import brep
from vmachining.geometry import Arc, Line
from vmachining.sweep import shadow
from vmachining.tool import Cutter

TOOLS: dict[str, Cutter] = {
    "flat": FlatEnd(diameter=10, length=40),
    "ball": BallNose(diameter=10, length=40),
    "bull": BullNose(diameter=10, corner_radius=2, length=40),
    "taper": Taper(diameter=6, corner_radius=1, taper_deg=10, length=30),
    "taper ball": Taper(diameter=6, corner_radius=3, taper_deg=10, length=30),
    "cone": ProfileTool(points=[[0, 0], [5, 5], [5, 30]]),
    "waist": ProfileTool(points=[[0, 0], [5, 0], [10, 5], [8, 10], [8, 20], [12, 20], [12, 60]]),
}
STRAIGHT = {
    "level": Line((1, 2, 3), (21, 9, 3)),
    "ramp": Line((0, 0, 0), (20, 7, 3)),
    "shallow": Line((0, 0, 0), (20, 7, -0.05)),
    "steep": Line((0, 0, 5), (2, 7, -40)),
    "nearly upright": Line((0, 0, 0), (0.2, 0.07, 40)),
    "plunge": Line((0, 0, 0), (0, 0, -5)),
    "retract": Line((1, 2, 0), (1, 2, 7)),
    "rest": Line((1, 2, 3), (1, 2, 3)),
    "nearly level": Line((0, 0, 0), (100, 0, -1e-9)),
}
ROUND = {
    "wide": Arc((30, 0, 0), (0, 0, 0), angle=2.0),
    "far round, clockwise": Arc((30, 0, 0), (0, 0, 0), angle=-5.0),
    "centre in the tool": Arc((3, 0, 0), (0, 0, 0), angle=1.0),
    "centre in the tool, nearly half": Arc((3.5, 0, 0), (0, 0, 0), angle=-2.9),
    "centre on the wall": Arc((5, 0, 0), (0, 0, 0), angle=1.5),
    "full": Arc((30, 0, 0), (0, 0, 0), angle=2 * pi),
    "full, centre in the tool": Arc((3.5, 0, 0), (0, 0, 0), angle=-2 * pi),
    "helix": Arc((30, 0, 0), (0, 0, 0), angle=2.0, rise=3),
    "helix down, clockwise": Arc((30, 0, 0), (0, 0, 0), angle=-4.0, rise=-10),
}


NO_FORMULA = [
    "ramp", "shallow", "steep", "nearly upright", "plunge", "retract", "nearly level", "helix",
    "helix down, clockwise",
]  # fmt: skip
"""Motions on which the cutter with a waist has no closed form."""

WITH_FORMULA = [
    (name, motion)
    for motion in [*STRAIGHT, *ROUND]
    for name in TOOLS
    if name != "waist" or motion not in NO_FORMULA
]


@pytest.mark.parametrize(("name", "motion"), WITH_FORMULA)
@pytest.mark.slow  # 4 s
def test_solid_is_valid_and_has_the_closed_form_volume(name: str, motion: str) -> None:
    sweep = Sweep.along(TOOLS[name], (STRAIGHT | ROUND)[motion])
    found = brep.inspect(brep.solid(sweep).wrapped)
    assert found.valid and found.closed
    assert found.volume == pytest.approx(sweep.volume, rel=3e-8)  # curves are fitted to 3e-8 mm
    assert found.shortest_mm > 1e-3
    apexes = 3 if motion in ROUND else 2
    pointed = (
        name == "cone" or "centre" in motion or motion in ("plunge", "retract", "rest") or "full" in motion
    )
    assert found.degenerate <= (apexes if pointed else 0)


@pytest.mark.parametrize("motion", NO_FORMULA)
@pytest.mark.slow  # 10 s
def test_solids_of_a_cutter_with_a_waist_hold_the_points_of_its_sweep(motion: str) -> None:
    from OCP.BRepClass3d import BRepClass3d_SolidClassifier
    from OCP.gp import gp_Pnt
    from OCP.TopAbs import TopAbs_State

    sweep = Sweep.along(TOOLS["waist"], (STRAIGHT | ROUND)[motion])
    parts = brep.solids(sweep)
    assert all(brep.inspect(part.shape).valid for part in parts)
    points = np.random.default_rng(3).uniform(*sweep.bounds, (150, 3))
    distance = sweep.signed_distance(points)
    held = np.zeros(len(points), dtype=bool)
    for part in parts:
        sorter = BRepClass3d_SolidClassifier(part.shape)
        for k, p in enumerate(points.tolist()):
            sorter.Perform(gp_Pnt(*p), 1e-7)
            held[k] |= sorter.State() == TopAbs_State.TopAbs_IN
    clear = np.abs(distance) > 1e-4
    assert (held == (distance < 0.0))[clear].all()
    assert 20 < np.count_nonzero(held) < 140  # both kinds of points were asked


def test_straight_sweeps_of_a_ball_have_faces_of_the_plain_kinds() -> None:
    for motion in ("level", "ramp", "plunge"):
        solid = brep.solid(Sweep.along(TOOLS["ball"], STRAIGHT[motion]))
        kinds = {face.geomType() for face in solid.Faces()}
        assert kinds <= {"PLANE", "CYLINDER", "SPHERE", "EXTRUSION"}, motion
        if motion != "ramp":  # the rim of the upper disc draws an oblique extrusion of a circle
            assert "EXTRUSION" not in kinds


@pytest.mark.parametrize("motion", ["level", "ramp", "wide", "centre in the tool", "helix"])
@pytest.mark.parametrize("name", ["flat", "bull", "ball"])
def test_step_keeps_the_volume(name: str, motion: str, tmp_path: Path) -> None:
    import cadquery as cq

    sweep = Sweep.along(TOOLS[name], (STRAIGHT | ROUND)[motion])
    path = tmp_path / "sweep.step"
    cq.exporters.export(cq.Workplane(brep.solid(sweep)), str(path))
    back = cq.importers.importStep(str(path)).vals()
    assert len(back) == 1 and back[0].isValid()
    assert brep.volume(back[0].wrapped) == pytest.approx(sweep.volume, rel=3e-8)


def test_scale_and_place_do_not_matter() -> None:
    for factor in (0.02, 20.0):
        tool = BullNose(diameter=10 * factor, corner_radius=2 * factor, length=40 * factor)
        start, end = factor * np.array([700.0, -300, 40]), factor * np.array([720.0, -307, 37])
        sweep = Sweep(tool, start, end)
        assert brep.volume(brep.solid(sweep).wrapped) == pytest.approx(sweep.volume, rel=1e-7)


def test_volume_of_known_bodies() -> None:
    import cadquery as cq

    assert brep.volume(cq.Solid.makeSphere(3, angleDegrees1=-90).wrapped) == pytest.approx(36 * pi, rel=1e-13)
    assert brep.volume(cq.Solid.makeTorus(7, 2).wrapped) == pytest.approx(2 * pi**2 * 7 * 4, rel=1e-13)
    assert brep.volume(cq.Solid.makeCone(4, 1, 6).wrapped) == pytest.approx(42 * pi, rel=1e-13)
    halved = cq.Solid.makeBox(1, 2, 3)
    from OCP.BRep import BRep_Builder
    from OCP.TopAbs import TopAbs_Orientation
    from OCP.TopoDS import TopoDS_Compound

    skin = TopoDS_Compound()
    BRep_Builder().MakeCompound(skin)
    inner = cq.Face.makePlane(2, 3, (0.5, 1, 1.5), (1, 0, 0)).wrapped
    for face in (halved.wrapped, inner.Oriented(TopAbs_Orientation.TopAbs_INTERNAL)):
        BRep_Builder().Add(skin, face)
    assert brep.volume(skin) == pytest.approx(6.0, rel=1e-13)
    drilled = cq.Workplane().box(10, 10, 10).faces(">Z").workplane().hole(4).val()
    assert brep.volume(drilled.wrapped) == pytest.approx(1000 - 40 * pi, rel=1e-13)


def test_several_solids_cover_an_arc_that_meets_itself() -> None:
    sweep = Sweep.along(TOOLS["ball"], Arc((3, 0, 0), (0, 0, 0), angle=-6))
    parts = brep.solids(sweep)
    assert len(parts) > 1
    assert all(brep.volume(part.shape) < sweep.volume for part in parts)
    assert sum(brep.volume(part.shape) for part in parts) > sweep.volume
    with pytest.raises(SweepError, match="union of"):
        brep.solid(sweep)


UPRIGHT = {
    "valley": Arc((-20, 0, 20), (0, 0, 20), 1, angle=-0.9 * pi / 2),
    "valley from level": Arc((0, 0, 0), (0, 0, 20), 1, angle=-pi / 3),
    "hill": Arc((0, 0, 0), (0, 0, -20), 1, angle=pi / 3),
    "YZ": Arc((0, -14, 6), (0, 0, 20), 0, angle=0.7),
    "YZ with rise": Arc((0, -14, 6), (0, 0, 20), 0, angle=0.7, rise=7),
}


@pytest.mark.parametrize("motion", UPRIGHT)
@pytest.mark.parametrize("name", ["flat", "ball"])
def test_arcs_in_upright_planes_have_the_volume_of_their_shadows(name: str, motion: str) -> None:
    path, tool = UPRIGHT[motion], TOOLS[name]
    parts = brep.solids(Sweep.along(tool, path))
    assert len(parts) == 1 and brep.inspect(parts[0].shape).closed
    # nothing is entered twice while the tip rises or falls all the way: V(K) + the shadow along every step
    t, w = np.polynomial.legendre.leggauss(200)
    velocity = path.velocity(0.5 * (t + 1.0))
    passed = [shadow(tool.profile, float(np.hypot(*v[:2])), float(v[2])) for v in velocity]
    truth = tool.profile.volume + 0.5 * float(w @ np.array(passed))
    assert brep.volume(parts[0].shape) == pytest.approx(truth, rel=1e-6)


def test_a_torus_that_begins_level_is_closed_in_on() -> None:
    """Its grazing curve has a corner at the start: parts ever shorter towards it, and poses, whose union is the sweep."""
    path, tool = UPRIGHT["valley from level"], TOOLS["bull"]
    sweep = Sweep.along(tool, path)
    parts = [part.shape for part in brep.solids(sweep)]
    points = np.random.default_rng(0).uniform(*sweep.bounds, (400, 3))
    distance = sweep.signed_distance(points)
    clear = np.abs(distance) > 1e-3
    assert (brep.held(parts, points[clear]) == (distance[clear] < 0.0)).all()
    assert 100 < (distance < 0.0).sum() < 380


def test_what_cannot_be_built_is_refused_by_name() -> None:
    stepped = ProfileTool(points=[[0, 0], [1, 0.2], [1, 1], [2, 2], [2, 20]])
    with pytest.raises(SweepError, match="narrows to a point"):
        brep.solids(Sweep.along(stepped, UPRIGHT["valley from level"]))
