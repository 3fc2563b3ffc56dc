"""Faces of some 1e-5 mm and less: where OCCT errs on them, and what is done about it."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks import gauntlet
from vmachining import BullNose, Sweep, Turn
from vmachining.engines import brep
from vmachining.engines.brep.envelopes.grazing_curve import GrazingCurve
from vmachining.engines.brep.envelopes.pieces import turn_pieces
from vmachining.engines.brep.envelopes.segments import ArcTurn, Moving
from vmachining.engines.brep.envelopes.sheets import enveloped
from vmachining.engines.brep.occt import inside
from vmachining.engines.brep.occt.booleans import box_of
from vmachining.engines.brep.occt.step_out import difference
from vmachining.engines.brep.occt.tolerances import STEP_REL
from vmachining.engines.brep.translations.caps import Tool
from vmachining.errors import EngineError, SweepError
from vmachining.tool import Profile

TILT = Turn.rotary((0, 0, 0), (2, -4, 2.5), "ac", {"a": 0.3, "c": 0.2}, {"a": 0.35, "c": 0.5})


def faces_of(shape: Any) -> list[Any]:
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    out, found = [], TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE)
    while found.More():
        out.append(TopoDS.Face_s(found.Current()))
        found.Next()
    return out


def solid_of(faces: list[Any]) -> Any:
    from OCP.BRep import BRep_Builder
    from OCP.TopoDS import TopoDS_Shell, TopoDS_Solid

    make, shell, solid = BRep_Builder(), TopoDS_Shell(), TopoDS_Solid()
    make.MakeShell(shell)
    for face in faces:
        make.Add(shell, face)
    shell.Closed(True)
    make.MakeSolid(solid)
    make.Add(solid, shell)
    return solid


def test_step_turns_no_solid_with_slivers_inside_out(tmp_path: Path) -> None:
    """A cone that turns about a line through its axis, but for 1e-6 mm along it: sheets of 6e-13 mm^2.

    The second half fails once OCCT classifies such a shell rightly.
    """
    path = gauntlet.gauntlet_block(358).path
    assert isinstance(path, Turn)
    nan = np.full((1, 2), np.nan)
    cone = Profile(np.array([[4.882, 11.3528], [7.4845, 25.7047]]), nan, np.zeros(1))
    pieces = turn_pieces(cone, path.drifting(-1e-6 * path.axis(0.5)), 1e-6)
    shapes = [piece.built.builder.solid() for piece in pieces]
    volumes = [brep.volume(shape) for shape in shapes]
    found = brep.write_solids(tmp_path / "sweep.step", shapes)
    assert found == pytest.approx(sum(volumes), rel=len(shapes) * STEP_REL)
    faces = faces_of(shapes[0])
    turned = [solid_of([faces[k], *faces[:k], *faces[k + 1 :]]) for k in range(len(faces))]
    turned = [solid for solid in turned if inside.inside_out(solid)]
    assert turned and not inside.inside_out(shapes[0])
    assert brep.inspect(turned[0]).valid and brep.volume(turned[0]) == pytest.approx(volumes[0], rel=1e-9)
    with pytest.raises(EngineError, match=r"back with 1 of 2 solids inside out; split"):
        brep.write_solids(tmp_path / "turned.step", [turned[0], shapes[-1]])
    assert not (tmp_path / "turned.step").exists()


@pytest.mark.parametrize(
    ("back", "wanted", "said"),
    [
        ([3.0, 1.0, 2.0], [1.0, 2.0, 3.0], ""),
        ([1.0], [1.0, 2.0], "1 solids instead of 2"),
        ([-1.0, -2.0, 3.0], [1.0, 2.0, 3.0], "2 of 3 solids inside out"),
        (
            [-1.0, 2.25],
            [2.0, 1.0],
            "1 of 2 solids inside out and 1 of 2 solids of another volume, by up to 0.25 mm3",
        ),
        ([np.nan], [1.0], "1 of 1 solids of another volume, by up to nan mm3"),
    ],
)
def test_a_file_that_differs_is_described_in_few_words(
    back: list[float], wanted: list[float], said: str
) -> None:
    assert difference(back, wanted) == said


@pytest.fixture(scope="module")
def slivered() -> tuple[Sweep, list[Any], list[Any]]:
    """Seed 977: a sweep, its solids, and those of their faces for which OCCT has no answer for any line: a sliver of a torus,
    4e-3 x 7e-5 mm wide."""
    from OCP.gp import gp_Dir, gp_Lin, gp_Pnt
    from OCP.IntCurvesFace import IntCurvesFace_Intersector

    sweep = gauntlet.gauntlet_block(977)
    shapes, silent = [part.shape for part in brep.solids(sweep)], []
    for face in [face for shape in shapes for face in faces_of(shape)]:
        meet = IntCurvesFace_Intersector(face, 1e-7)
        meet.Perform(gp_Lin(gp_Pnt(0.0, 0.0, 0.0), gp_Dir(1.0, 2.0, 3.0)), 0.0, 1e6)
        if not meet.IsDone():
            silent.append(face)
    return sweep, shapes, silent


def test_points_are_told_beside_a_face_that_no_line_can_meet(
    slivered: tuple[Sweep, list[Any], list[Any]],
) -> None:
    sweep, shapes, silent = slivered
    assert silent
    points = gauntlet._near(sweep)
    gap = sweep.signed_distance(points)
    clear = np.abs(gap) > gauntlet.NEAR_MM
    assert (brep.held(shapes, points[clear]) == (gap[clear] < 0.0)).all()


def test_a_point_without_an_answer_is_named_and_the_gauntlet_goes_on(
    slivered: tuple[Sweep, list[Any], list[Any]],
) -> None:
    """The sliver alone, and a point in its box."""
    silent = slivered[2]
    alone, point = solid_of(silent[:1]), box_of(silent[0]).mean(axis=0, keepdims=True)
    with pytest.raises(EngineError, match=r"OCCT cannot tell where lines through \[.*\] mm meet a solid"):
        brep.held([alone], point)
    said = gauntlet.strange_points([alone], point, np.array([0.5]))
    assert said.startswith("points of the solids: brep engine: OCCT cannot tell")


class BreaksOff(ArcTurn):
    """A segment that has no points on its far half."""

    def points(self, of: Any, st: Any, s: Any) -> Any:
        found = super().points(of, st, s)
        found[len(found) // 2 :, 0] = np.nan
        return found


def test_a_curve_that_breaks_off_between_its_nodes_is_refused() -> None:
    """Nodes are refined in time: the curve may end at a moment at which nobody had looked before."""
    tool = Tool.of(BullNose(diameter=10, corner_radius=2, length=30).profile)
    grazing = GrazingCurve(tool, Moving(TILT))
    enveloped(grazing, 1e-6)
    turns = [k for k, segment in enumerate(grazing.segments) if isinstance(segment, ArcTurn)]
    for k in turns:
        whole = grazing.segments[k]
        grazing.segments[k] = BreaksOff(**{field.name: getattr(whole, field.name) for field in fields(whole)})
    with pytest.raises(SweepError, match="ends on its way over a face"):
        enveloped(grazing, 1e-6)


def test_a_point_close_to_a_spline_face_is_told_by_whole_lines():
    """7.6e-5 mm outside: rays that began there lost the face they entered by, half of them called it inside."""
    sweep = gauntlet.gauntlet_block(11)
    point = np.array([[28.944985204474662, -1.3447801277680909, 16.889041187727337]])
    assert 7e-5 < sweep.signed_distance(point)[0] < 8e-5
    faces = inside._Faces(brep.solids(sweep)[0].shape)
    ways = np.random.default_rng(2).normal(size=(60, 3))
    assert not any(faces.odd(point[0], way) for way in ways)
