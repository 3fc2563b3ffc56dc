"""Tools that turn about a fixed line through their axis: halves of closed-form volume whose union is the sweep."""

from __future__ import annotations

import numpy as np
import pytest

from vmachining import BallNose, BullNose, FlatEnd, ProfileTool, Sweep, Taper, Turn
from vmachining.engines import brep
from vmachining.engines.brep.envelopes.decomposition import _grade, _lift
from vmachining.engines.brep.envelopes.fixed_axis import FixedAxis, halves
from vmachining.errors import SweepError
from vmachining.tool import Cutter

START, END = (v / np.linalg.norm(v) for v in np.array([[0.1, 0.05, 1.0], [0.3, -0.2, 1.0]]))
TURNED = float(np.arccos(START @ END))


def about(cutter: Cutter, height: float) -> Sweep:
    """A point of the axis stands."""
    move = Turn.through(np.zeros(3), np.zeros(3), "axis", START, END, control_height=height)
    return Sweep.along(cutter, move)


def pieces(sweep: Sweep) -> list[tuple[object, float]]:
    """Shape and closed form of every half."""
    assert isinstance(sweep.path, Turn)
    about = FixedAxis.of(sweep.path)
    assert about is not None
    return [(build.solid(), volume) for build, volume in halves(sweep.profile, about)]


def test_a_cylinder_about_its_middle_is_four_quarters() -> None:
    """Each leads with one side, 2 R v dh, and with half a disc that turns about its diameter."""
    radius, length = 4.0, 18.0
    found = pieces(about(FlatEnd(diameter=2 * radius, length=length), 0.5 * length))
    arm = 0.5 * length
    exact = 0.5 * np.pi * radius**2 * arm + TURNED * (radius * arm**2 + 2.0 / 3.0 * radius**3)
    assert len(found) == 4
    for shape, volume in found:
        assert volume == pytest.approx(exact, rel=1e-12)
        assert brep.volume(shape) == pytest.approx(exact, rel=1e-9)


def test_a_cylinder_about_its_tip_leads_with_its_top_and_half_its_plane() -> None:
    """Above the pivot its side trails: the flux is that of the plane, 2 R z dz, and of half the top disc."""
    radius, length = 4.0, 18.0
    found = pieces(about(FlatEnd(diameter=2 * radius, length=length), 0.0))
    exact = 0.5 * np.pi * radius**2 * length + TURNED * (radius * length**2 + 2.0 / 3.0 * radius**3)
    assert [volume for _, volume in found] == pytest.approx([exact, exact], rel=1e-12)
    assert [brep.volume(shape) for shape, _ in found] == pytest.approx([exact, exact], rel=1e-9)


TAPER = Taper(diameter=6, corner_radius=1.5, taper_deg=12, length=20)
CONE = ProfileTool(points=[[1, 0], [5, 3], [5, 12], [2, 15]])


@pytest.mark.parametrize("height", [-7.0, 0.0, 0.8, 3.0, 9.0, 19.0, 31.0])
@pytest.mark.parametrize(
    "cutter",
    [
        FlatEnd(diameter=8, length=19),
        BallNose(diameter=8, length=19),
        BullNose(diameter=8, corner_radius=1.5, length=19),
        TAPER,
        CONE,
    ],
    ids=["flat", "ball", "bull", "taper", "profile"],
)
def test_the_halves_hold_what_the_exact_sweep_holds(cutter: Cutter, height: float) -> None:
    """Pivots below the tool, in its tip, corner, side and top, and above it."""
    check(about(cutter, height))


@pytest.mark.parametrize("cutter", [FlatEnd(diameter=8, length=19), BallNose(diameter=8, length=19), TAPER])
def test_a_tilted_tool_may_turn_about_a_line_beside_it(cutter: Cutter) -> None:
    """A table C under a tilted spindle: the axis runs on a cone, and meets that of the table 50 mm below."""
    a = 0.4
    rows = (
        ("R", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), -1.0), ("R", (1.0, 0.0, 0.0), (0.0, 0.0, 0.0), -1.0),
        *(("L", tuple(row), (0.0, 0.0, 0.0), 1.0) for row in np.eye(3).tolist()),
    )  # fmt: skip
    q0 = np.array([0.0, a, 0.0, 0.0, 50.0])
    sweep = Sweep.along(cutter, Turn.joints(rows, q0, q0 + [0.7, 0, 0, 0, 0]))
    assert isinstance(sweep.path, Turn)
    about = FixedAxis.of(sweep.path)
    assert about is not None
    assert about.angle == pytest.approx(0.7, abs=1e-9)
    assert about.height == pytest.approx(-50.0, abs=1e-6)
    check(sweep)


def check(sweep: Sweep) -> None:
    """Valid halves of their closed forms whose union holds points as the exact sweep does."""
    shapes = []
    for shape, exact in pieces(sweep):
        found = brep.inspect(shape)
        assert found.valid and found.closed
        assert found.volume == pytest.approx(exact, rel=1e-8)
        shapes.append(shape)
    rng = np.random.default_rng(2)
    lo, hi = sweep.bounds
    points = rng.uniform(lo, hi, (60, 3))
    gap = sweep.signed_distance(points)
    near = points[np.abs(gap) < 1.0]  # and close to the surface: along a step of the distance
    step = 1e-6
    slope = [(sweep.signed_distance(near + step * e) - sweep.signed_distance(near)) / step for e in np.eye(3)]
    at = sweep.signed_distance(near)
    points = np.concatenate(
        [points, near - (at - rng.choice([-1e-3, 1e-3], len(at)))[:, None] * np.array(slope).T]
    )
    gap = sweep.signed_distance(points)
    clear = np.abs(gap) > 1e-6
    assert (brep.held(shapes, points[clear]) == (gap[clear] < 0.0)).all()


@pytest.mark.parametrize(("cutter", "height"), [(TAPER, 9.0), (FlatEnd(diameter=8, length=20), 10.0)])
def test_a_block_about_its_pivot_has_solids_within_a_second(cutter: Cutter, height: float) -> None:
    """The envelope folds there, so that halves are taken."""
    parts = brep.solids(about(cutter, height))
    assert len(parts) == 4
    assert max(part.fit_mm for part in parts) < 1e-9


def test_other_motions_have_no_hinge() -> None:
    """A pivot that moves by 1e-5 mm, an axis that turns about a line that turns, one that stands."""
    drift = Turn.through(np.zeros(3), (1e-5, 0, 0), "axis", START, END, control_height=4.0)
    both = Turn.rotary((0, 0, 0), (0, 0, 0), "ac", {"a": 0.5, "c": 0.0}, {"a": 0.7, "c": 0.4})
    still = Turn.through(np.zeros(3), (1, 2, 3), "axis", START, START)
    assert [FixedAxis.of(move) for move in (drift, both, still)] == [None, None, None]


def test_a_ball_about_its_centre_has_no_halves() -> None:
    """All of it grazes: the sweep is two poses of the rest, which others find."""
    sweep = about(BallNose(diameter=8, length=19), 4.0)
    with pytest.raises(SweepError, match="centre of a ball"):
        pieces(sweep)


def test_a_planar_block_is_cut_where_its_speed_along_the_axis_has_grown() -> None:
    """The axis turns by theta = T t while a point of it moves across its first direction by w t: lift w sin(T t) / T."""
    side = END - (END @ START) * START
    way = 0.5 * side / np.linalg.norm(side)
    move = Turn.through(np.zeros(3), way, "axis", START, END, control_height=7.0)
    lift = _lift(move)
    t = np.linspace(0.0, 1.0, 65)
    assert lift == pytest.approx(0.5 * np.sin(TURNED * t) / TURNED, abs=1e-12)
    assert lift is not None
    share = _grade(lift)
    assert share is not None  # a sixteenth of the largest, where one begins at zero
    assert np.sin(TURNED * share) == pytest.approx(np.sin(TURNED) / 16.0, rel=1e-4)
    assert _grade(lift[::-1]) == pytest.approx(1.0 - share, abs=1e-12)
    rest = _lift(move.part(share, 1.0))
    assert rest is not None
    further = _grade(rest)
    assert further is not None
    third = _lift(move.part(share + further * (1.0 - share), 1.0))
    assert third is not None and _grade(third * (1.0 - 1e-6) + 1e-6) is None
    assert _lift(Turn.through(np.zeros(3), (1, 2, 3), "axis", START, END)) is None
    head = move.part(0.0, 5e-3)
    assert FixedAxis.of(head) is None and FixedAxis.of(head, 1e-5) is not None


def test_an_oblique_line_through_the_tool_has_no_halves() -> None:
    cone = Turn.rotary((0, 0, 0), (0, 0, 0), "ac", {"a": 0.5, "c": 0.0}, {"a": 0.5, "c": 0.4})
    with pytest.raises(SweepError, match="oblique"):
        pieces(Sweep.along(FlatEnd(diameter=8, length=20), cone))
