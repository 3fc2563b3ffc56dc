"""Swept solids of tools that turn: accepted by OCCT, of the reference volume, kept by STEP, in parts where they fold."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.gauntlet import gauntlet_block
from benchmarks.sweep5 import VOLUMES, block, reference
from vmachining import BallNose, BullNose, FlatEnd, ProfileTool, Sweep, Taper, Turn
from vmachining.engines import brep
from vmachining.engines.brep.envelopes.decomposition import _flattened
from vmachining.engines.judges import Judge
from vmachining.engines.protocol import Removal
from vmachining.sweep import Pose

TAPER = Taper(diameter=6, corner_radius=1.5, taper_deg=8, length=30)
TILT = Turn.rotary((0, 0, 0), (2, -4, 2.5), "ac", {"a": 0.3, "c": 0.2}, {"a": 0.35, "c": 0.5})


def checked(sweep: Sweep, volume: float) -> brep.Inspection:
    """The one solid of a sweep, with the volume somebody else found."""
    (part,) = brep.solids(sweep)
    found = brep.inspect(part.shape)
    assert found.valid and found.closed and found.degenerate == 0
    assert found.shortest_mm > 1e-2
    assert 0.0 < part.fit_mm < 1e-5
    assert found.volume == pytest.approx(volume, rel=1e-6)  # last digits of the table; fit 1e-6 mm
    return found


@pytest.mark.parametrize("tool", ["F20", "B10", "N20", "N30"])
def test_the_twist_of_the_reference_table(tool: str) -> None:
    checked(reference("twist", tool), VOLUMES["twist"][tool])


@pytest.mark.parametrize("seed", [1, 4, 6, 10, 11, 13, 19, 20])
def test_finishing_blocks_have_the_volume_of_the_flux(seed: int) -> None:
    """Seeds 6, 10 and 19 tilt about a line in a flat face: the flux alone counts 1e-4 of the volume twice."""
    sweep = block(seed)
    checked(sweep, sweep.flux().volume)


def test_a_tapered_bull_nose_on_rotary_angles() -> None:
    sweep = Sweep.along(TAPER, TILT)
    checked(sweep, sweep.flux().volume)


def test_a_block_does_not_depend_on_where_it_is() -> None:
    """Another pose of the whole motion has the same volume and as many faces."""
    start, end = (v / np.linalg.norm(v) for v in np.array([[0.2, 0.1, 1.0], [0.25, 0.2, 1.0]]))
    turn = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # x to y, y to z, z to x
    found = []
    for frame, shift in ((np.eye(3), 0.0), (turn, 50.0)):
        way = frame @ np.array([3.0, 1.0, 1.4])
        move = Turn.through(np.full(3, shift), shift + way, "axis", frame @ start, frame @ end)
        (part,) = brep.solids(Sweep.along(FlatEnd(diameter=8, length=20), move))
        found.append(brep.inspect(part.shape))
    assert found[0].faces == found[1].faces
    assert found[0].volume == pytest.approx(found[1].volume, rel=1e-8)


def test_step_keeps_the_solid(tmp_path: Path) -> None:
    import cadquery as cq

    sweep = Sweep.along(BullNose(diameter=10, corner_radius=2, length=30), TILT)
    shape = brep.solid(sweep)
    cq.exporters.export(cq.Workplane(shape), str(tmp_path / "sweep.step"))
    (back,) = cq.importers.importStep(str(tmp_path / "sweep.step")).vals()
    found = brep.inspect(back.wrapped)  # type: ignore[union-attr]
    assert found.valid and found.closed
    assert found.volume == pytest.approx(brep.volume(shape.wrapped), rel=1e-9)


def test_a_wanted_fit_is_reached() -> None:
    sweep = Sweep.along(BallNose(diameter=10, length=30), TILT)
    coarse, fine = (brep.solids(sweep, fit_mm=fit)[0].fit_mm for fit in (1e-3, 1e-7))
    assert fine < coarse < 1e-3 and fine < 3e-7


GAP, FOLD, OFF = 3e-5, 3e-5, 3e-5
"""mm: what may be missing between parts, lie inside a sheet, and be off a plane."""


def strangers(sweep: Sweep, count: int, slack: float = GAP + FOLD) -> list[float]:
    """Distances (mm) of points near the sweep's surface on whose place its solids and the exact sweep disagree."""
    rng, body = np.random.default_rng(1), sweep.profile
    z = rng.uniform(body.z_min, body.z_max, count)
    r = body.radius_at(z) + rng.choice([-0.01, -1e-4, 1e-4, 0.01], count)
    t, u = rng.random(count), rng.uniform(0.0, 2.0 * np.pi, count)
    axis = sweep.path.axis(t)  # type: ignore[union-attr]
    x = np.cross(axis, [0.6, 0.64, 0.48])
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    m = np.cos(u)[:, None] * x + np.sin(u)[:, None] * np.cross(axis, x)
    points = sweep.path.position(t) + z[:, None] * axis + r[:, None] * m
    distance = sweep.signed_distance(points)
    shapes = [part.shape for part in brep.solids(sweep)]
    assert all(brep.inspect(shape).valid for shape in shapes)
    held = brep.held(shapes, points)
    wrong = (held != (distance < 0.0)) & (np.abs(distance) > slack)
    return distance[wrong].tolist()


@pytest.mark.parametrize(
    ("cutter", "height", "drift"),
    [
        (FlatEnd(diameter=9, length=25), 15.0, (0.02, 0.03, 0.01)),
        pytest.param(
            *(Taper(diameter=4, corner_radius=1, taper_deg=10, length=14), 8.0, (0.01, -0.01, 0.02)),
            marks=pytest.mark.long,
        ),
        (BallNose(diameter=8, length=20), 12.0, (0.0, 0.0, 0.0)),
    ],
)
@pytest.mark.slow  # 4 s
def test_a_pivot_in_the_tool_is_covered_by_parts(
    cutter: FlatEnd | Taper | BallNose, height: float, drift: tuple[float, float, float]
) -> None:
    """The envelope folds in one pose after the other; without drift the motion is planar."""
    start, end = (v / np.linalg.norm(v) for v in np.array([[0.1, 0.05, 1.0], [0.14, 0.06, 1.0]]))
    move = Turn.through((0, 0, 0), height * (start - end) + drift, "axis", start, end)
    assert strangers(Sweep.along(cutter, move), 300) == []


def test_a_block_that_hardly_leaves_its_plane_is_covered_by_planar_parts() -> None:
    """The axis passes its pivot at 6e-4 mm: front and rear of the flat end swap within no time, and sheets are sharp."""
    start = np.array([0.1, 0.05, 1.0]) / np.linalg.norm([0.1, 0.05, 1.0])
    across = np.cross(np.cross(start, [1, 0, 0]), start)
    across /= np.linalg.norm(across)
    end = np.cos(0.02) * start + np.sin(0.02) * np.cross(across, start)

    def move(slip: float) -> Turn:
        return Turn.great_circle(Pose((0, 0, 0), start), Pose(34.4 * (start - end) + slip * across, end))

    for slip, count in ((1.1e-5, 1), (1e-4, 2), (1e-2, 0)):
        planes, off = _flattened(move(slip))
        assert len(planes) == count and off == pytest.approx(slip / (2 * count) if count else 0.0, rel=1e-6)
        for k, part in enumerate(planes):
            t = np.linspace(0.0, 1.0, 11)
            apart = part.position(t) - move(slip).position((k + t) / count)
            assert np.abs(part.velocity(t) @ across).max() < 1e-12
            assert np.linalg.norm(apart, axis=1).max() == pytest.approx(off, rel=1e-6)
    sweep = Sweep.along(FlatEnd(diameter=19.5, length=42), move(1.1e-5))
    assert strangers(sweep, 100, GAP + FOLD + OFF) == []
    assert 5e-6 < max(part.fit_mm for part in brep.solids(sweep)) < GAP + FOLD + OFF


def test_a_taper_that_leaves_a_pocket_and_tilts_grazes_twice_on_its_cone() -> None:
    """Circles between two heights trail all round; the curve turns back below on one side and above on the other."""
    start = np.array([0.1, 0.05, 1.0]) / np.linalg.norm([0.1, 0.05, 1.0])
    side = np.cross(start, [1, 0, 0]) / np.linalg.norm(np.cross(start, [1, 0, 0]))
    end = np.cos(0.1) * start + np.sin(0.1) * side
    move = Turn.great_circle(Pose((0, 0, 0), start), Pose(4.0 * start, end))
    cutter = Taper(diameter=3, corner_radius=0.75, taper_deg=1.5, length=12)
    part = Sweep.along(
        cutter, move.part(0.6, 0.61)
    )  # the pivot is 2.4 mm up and 40 mm aside: turns 1 mm from it
    assert len(brep.solids(part)) == 1
    assert strangers(part, 200) == []


def test_a_chord_of_which_one_end_folds_first_keeps_its_sheet_as_long_as_that_is_shallow() -> None:
    """A block of the gauntlet on rotary angles, by its seed: between both ends the chord lies inside in part."""
    assert strangers(gauntlet_block(485), 100) == []


def test_a_tilt_about_the_middle_of_the_axis_is_covered_by_parts() -> None:
    assert strangers(reference("tilt about the middle", "F20"), 300) == []


@pytest.mark.parametrize("tool", ["ball", "flat"])
def test_booleans_find_what_the_second_half_of_a_turn_adds(tool: str) -> None:
    """In a box that holds all of it, the second half removes the whole sweep less the first half."""
    cutter = {"ball": BallNose(diameter=10, length=20), "flat": FlatEnd(diameter=10, length=20)}[tool]
    whole = Sweep.along(cutter, TILT)
    halves = whole.split([0.5])
    added = whole.flux().volume - halves[0].flux().volume
    blank = brep.Blank("box", (-40.0, -40.0, -40.0), (40.0, 40.0, 60.0))
    work = brep.BlockChecker(blank, [[half] for half in halves])
    found = work.check(1, [Judge("mesh", Removal(added * (1 - 1e-4), added, added * (1 + 1e-4)))])
    assert found.status in (brep.Status.AGREED, brep.Status.RETRIED)
    assert found.removed_mm3 == pytest.approx(added, rel=1e-4)


def test_a_block_leaves_out_what_stays_above_the_stock() -> None:
    """A cutter that is ten times longer removes the same."""
    blank = brep.Blank("box", (-40.0, -40.0, -40.0), (40.0, 40.0, 4.0))
    found = []
    for length in (20.0, 200.0):
        sweep = Sweep.along(BallNose(diameter=10, length=length), TILT)
        work = brep.BlockChecker(blank, [[sweep]])
        found.append(work.check(0, [Judge("mesh", Removal(0.0, 1.0, 1e9))], ["plain"]).tried[0][1])
    assert found[0] == pytest.approx(found[1], rel=1e-7)


@pytest.mark.parametrize(
    ("motion", "tool"), [("rolling forward", "B10"), ("rolling forward", "F20"), ("falling", "F20")]
)
def test_parts_of_a_reference_row_share_the_cutter_between_them(motion: str, tool: str) -> None:
    """Two parts in time hold the whole, the cutter at the cut twice, and what is entered again twice."""
    sweep = reference(motion, tool)
    parts = brep.solids(sweep)
    reports = [brep.inspect(part.shape) for part in parts]
    assert all(r.valid and r.closed and r.degenerate == 0 for r in reports)
    total = sum(r.volume for r in reports) - (len(parts) - 1) * sweep.profile.volume
    exact = VOLUMES[motion][tool]
    again = sweep.flux().again
    # the pose at a cut is left out by 1e-4 mm of motion; what two parts enter is in both of them
    assert exact * (1.0 - 3e-6) <= total <= exact * (1.0 + 3e-6) + again
    if len(parts) == 1:
        assert total == pytest.approx(exact, rel=1e-6)


def test_a_lens_of_a_tilting_face_needs_no_cut() -> None:
    """The top of this cutter begins to rise behind its rim on the way: one solid anyway."""
    sweep = block(14)
    (part,) = brep.solids(sweep)
    assert brep.inspect(part.shape).volume == pytest.approx(sweep.flux().volume, rel=1e-6)
    assert sweep.flux().again > 1e-4 * sweep.flux().volume


@pytest.mark.parametrize("way", [8.0, -8.0])
def test_a_taper_that_moves_along_its_axis_grazes_on_all_of_its_top_edge(way: float) -> None:
    """Neither its side nor its corner grazes anywhere."""
    start = np.array([0.1, 0.2, 1.0]) / np.linalg.norm([0.1, 0.2, 1.0])
    end = np.array([0.11, 0.2, 1.0]) / np.linalg.norm([0.11, 0.2, 1.0])
    move = Turn.through((0, 0, 0), way * start, "axis", start, end)
    sweep = Sweep.along(Taper(diameter=2, corner_radius=0.5, taper_deg=12, length=15), move)
    checked(sweep, sweep.flux().volume)


@pytest.mark.parametrize("half_angle", [30.0, 60.0])
@pytest.mark.parametrize("rise", [-6.0, -1.0, 1.0, 6.0])
def test_the_grazing_curve_of_a_pointed_cone_goes_through_its_tip(half_angle: float, rise: float) -> None:
    """Sideways it does, down and up it turns back below the rim or is not there at all."""
    radius = 3.0
    height = radius / np.tan(np.radians(half_angle))
    cone = ProfileTool(points=[[0, 0], [radius, height], [radius, height + 8]])
    tilted = np.array([0.03, -0.05, 1.0]) / np.linalg.norm([0.03, -0.05, 1.0])
    sweep = Sweep.along(cone, Turn.through((0, 0, 0), (2, -1, rise), "axis", (0, 0, 1), tilted))
    parts = brep.solids(sweep)
    for part in parts:
        found = brep.inspect(part.shape)
        assert found.valid and found.closed and part.fit_mm < 1e-4
    rng = np.random.default_rng(5)
    lo, hi = sweep.bounds
    points = rng.uniform(lo, hi, (400, 3))
    gap = sweep.signed_distance(points)
    clear = np.abs(gap) > 1e-3
    assert (brep.held([part.shape for part in parts], points[clear]) == (gap[clear] < 0.0)).all()
    if len(parts) == 1:
        assert brep.volume(parts[0].shape) == pytest.approx(sweep.flux().volume, rel=1e-6)
