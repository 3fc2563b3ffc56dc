"""Meshes of sweeps with a turning axis: closed, inside, around, unbiased, and of second order.

Reference volumes and where they come from: `benchmarks.sweep5`.
"""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.sweep5 import SIDES, TOOLS, VOLUMES, block, reference, united, winding
from vmachining.engines.mesh import MeshEngine, box_stock
from vmachining.engines.mesh.solids import manifold
from vmachining.engines.mesh.turning import turning_pieces
from vmachining.errors import EngineError
from vmachining.geometry import Line
from vmachining.interval import Interval
from vmachining.sweep import Pose, Sweep, Turn
from vmachining.tool import ProfileTool, Taper

FAIR = 1e-4 / 0.01  # relative error of a fair mesh per mm of chord: asked for at 0.01 mm


pytestmark = pytest.mark.filterwarnings("ignore::vmachining.errors.AccuracyWarning")  # axes by hand


# cheap rows of every kind here; all of them at 0.01 mm are the bench case `sweep5`
@pytest.mark.parametrize(
    ("motion", "tool"),
    [
        pytest.param(m, t, marks=[pytest.mark.long] if m == "in the plane of the tilt" else [])
        for m, row in VOLUMES.items()
        for t in row
        if m in ("twist",) or t == "B10" or "lean" in m
    ]
    + [("tilt about the tip", "F20"), ("skew", "N20"), ("rolling forward", "N30")],
)
@pytest.mark.slow  # 4 s
def test_reference_volumes_lie_between_inner_and_outer(motion: str, tool: str) -> None:
    chord, exact = 0.08, VOLUMES[motion][tool]
    inner, fair, outer = (united(reference(motion, tool), chord, side).volume() for side in SIDES)
    assert inner * (1 - 1e-5) <= exact <= outer * (1 + 1e-5)
    assert abs(fair - exact) < FAIR * chord * exact


def test_width_and_error_are_first_order_in_the_chord_and_facets_of_second() -> None:
    """Both fall with the chord; the grid, whose square the chord is, only doubles when it falls to a quarter."""
    exact = VOLUMES["leaning back"]["B10"]
    width, error, size = [], [], []
    for chord in (0.16, 0.04, 0.01):
        inner, fair, outer = (united(reference("leaning back", "B10"), chord, side) for side in SIDES)
        width.append(outer.volume() - inner.volume())
        error.append(abs(fair.volume() - exact) / exact)
        size.append(fair.num_tri())
    assert width[1] < width[0] / 3 and width[2] < width[1] / 3
    assert error[2] < 1e-4 and error[2] < error[0] / 6
    assert size[2] < 6 * size[1]  # rows and columns double: four times


def body_distance(cutter: str, points: np.ndarray) -> np.ndarray:
    """A bound from below of the distance to the cutter in its frame, with the right sign. points (..., 3)."""
    r, z = np.hypot(points[..., 0], points[..., 1]), points[..., 2]
    ends = np.maximum(-z, z - 50.0)
    if cutter == "F20":
        return np.maximum(r - 10.0, ends)
    if cutter == "B10":
        return np.maximum(np.hypot(r, np.minimum(z - 5.0, 0.0)) - 5.0, z - 50.0)
    corner = np.hypot(np.maximum(r - 5.0, 0.0), np.minimum(z - 5.0, 0.0)) - 5.0  # N20
    return np.maximum(corner, z - 50.0)


def truth(sweep: Sweep, cutter: str, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(surely inside, surely outside), from poses so close that nothing moves by more than `step` / 2."""
    turn = sweep.path
    assert isinstance(turn, Turn)
    steps = 4000
    t = np.linspace(0.0, 1.0, steps + 1)
    least = np.full(len(points), np.inf)
    for tip, axis in zip(turn.position(t), turn.axis(t), strict=True):
        from_tip = points - tip
        z = from_tip @ axis
        r = np.linalg.norm(from_tip - z[:, None] * axis, axis=1)
        least = np.minimum(least, body_distance(cutter, np.stack([r, 0 * r, z], axis=1)))
    reach = (
        np.linalg.norm(turn.velocity(t), axis=1).max()
        + 65.0 * np.linalg.norm(turn.axis_rate(t), axis=1).max()
    )
    return least < 0.0, least > reach / steps / 2


@pytest.mark.parametrize(
    ("motion", "tool"),
    [("leaning back", "F20"), ("skew", "N20"), ("tilt about the middle", "F20"), ("falling", "B10")],
)
def test_points_near_the_surface_obey_inner_and_outer(motion: str, tool: str) -> None:
    chord = 0.2
    sweep, rng = reference(motion, tool), np.random.default_rng(5)
    mesh = united(sweep, chord, "fair").to_mesh64()
    corners = np.array(mesh.vert_properties)[np.array(mesh.tri_verts, dtype=np.int64)][..., :3]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    chosen = corners[rng.choice(len(area), 250, p=area / area.sum())]
    weights = rng.dirichlet([1, 1, 1], len(chosen))
    points = np.einsum("ij,ijk->ik", weights, chosen) + rng.normal(size=(len(chosen), 3)) * chord / 2
    inside, outside = truth(sweep, tool, points)
    assert inside.sum() > 50 and outside.sum() > 50
    held = {
        side: np.any(
            [np.abs(winding(points, piece)) > 0.5 for piece in turning_pieces(sweep, chord, side)], axis=0
        )
        for side in ("inner", "outer")
    }
    assert not (held["inner"] & outside).any()
    assert held["outer"][inside].all()


def test_a_steady_axis_gives_the_closed_form() -> None:
    for tool, cutter in TOOLS.items():
        tilted = Sweep(cutter, Pose((0, 0, 0), (0.3, -0.2, 1)), Pose((8, 5, -3), (0.3, -0.2, 1)))
        inner, fair, outer = (united(tilted, 0.04, side).volume() for side in SIDES)
        assert tilted.volume is not None and inner < tilted.volume < outer, tool
        assert abs(fair - tilted.volume) < FAIR * 0.04 * tilted.volume


@pytest.mark.parametrize(
    "start, end",
    [
        (Pose((0, 0, 0)), Pose((0, 0, 0))),  # rest
        (Pose((0, 0, 0), (0, 1, 1)), Pose((0, -3, -3), (0, 1, 1))),  # plunge along the axis
        (Pose((0, 0, 0), (0, 1, 1)), Pose((4, 0, 0), (0, 1, 1))),  # discs slide in their planes
        (Pose((0, 0, 0)), Pose((3, 0, 0), (1e-9, 0, 1))),  # hardly turns
        (Pose((0, 0, 0), (0, 0, -1)), Pose((3, 0, 1), (0, 0.1, -1))),  # points down
        (Pose((0, 0, 0), (1, 0, 0)), Pose((1, 0, 0), (1, 0.2, 0))),  # starts along the axis
    ],
)
def test_degenerate_motions_stay_closed_and_ordered(start: Pose, end: Pose) -> None:
    for cutter in (TOOLS["F20"], TOOLS["B10"], Taper(diameter=2, taper_deg=10, corner_radius=0.5, length=20)):
        turn = Turn.great_circle(start, end)
        sweep = Sweep.along(cutter, turn)
        if not isinstance(sweep.path, Turn):
            continue  # upright: the other engine room
        inner, fair, outer = (united(sweep, 0.05, side).volume() for side in SIDES)
        assert 0.0 < inner < fair < outer
        assert outer - inner < 0.15 * outer


def test_there_and_back_sweep_the_same() -> None:
    a, b = Pose((0, 0, 0), (0, 0.1, 1)), Pose((3, 1, -1), (0.1, 0, 1))
    there, back = (united(Sweep(TOOLS["N20"], *pair), 0.02, "fair").volume() for pair in ((a, b), (b, a)))
    assert there == pytest.approx(back, rel=FAIR * 0.02)


def test_a_chained_block_lacks_only_what_the_first_pose_cuts() -> None:
    sweep = Sweep(TOOLS["F20"], Pose((0, 0, 0), (0, 0.1, 1)), Pose((3, 1, -1), (0.1, 0, 1)))
    pieces = [manifold(*p) for p in turning_pieces(sweep, 0.05, "fair", chained=True)]
    still = Sweep(TOOLS["F20"], Pose((0, 0, 0), (0, 0.1, 1)), Pose((0, 0, 0), (0, 0.1, 1)))
    total = united(still, 0.05, "fair")
    for piece in pieces:
        total = total + piece
    assert total.volume() == pytest.approx(united(sweep, 0.05, "fair").volume(), rel=FAIR * 0.05)


def test_a_body_with_a_waist_is_swept_by_its_convex_parts() -> None:
    waist = ProfileTool(points=[(4, 0), (2, 6), (2, 10), (5, 16)])
    steady = Sweep(waist, Pose((0, 0, 0), (0, 1, 2)), Pose((7, 0, 0), (0, 1, 2)))
    inner, fair, outer = (united(steady, 0.02, side).volume() for side in SIDES)
    assert steady.volume is not None and inner < steady.volume < outer
    assert abs(fair - steady.volume) < 5e-4 * steady.volume


def test_only_turns_are_taken() -> None:
    with pytest.raises(EngineError, match="Turn"):
        list(turning_pieces(Sweep.along(TOOLS["F20"], Line((0, 0, 0), (1, 0, 0))), 0.01, "fair"))


def test_the_engine_removes_what_a_turning_cutter_sweeps() -> None:
    sweep = block(4)  # a ball, 1 to 5 mm and degrees, all of it inside the stock
    assert sweep.volume is not None
    lo, hi = sweep.bounds + [[-1.0], [1.0]]
    engine = MeshEngine(box_stock(lo, hi), 0.05)
    removed = engine.cut(sweep).bracket
    assert removed.holds(sweep.volume)
    assert removed.estimate == pytest.approx(engine.stock_volume.estimate - engine.volume.estimate, rel=1e-9)
    assert engine.cut(sweep).estimate < 1e-6 * removed.estimate
    away = Pose((0, 0, 200), (0, 0.1, 1)), Pose((1, 0, 200), (0.1, 0, 1))
    assert engine.cut(Sweep(TOOLS["B10"], *away)).bracket == Interval(0.0, 0.0, 0.0)


def test_chained_blocks_fill_the_bracket_of_the_whole() -> None:
    """A path in three blocks: neighbours share their pose, and the sum is the volume of their union."""
    path = Sweep(TOOLS["B10"], Pose((0, 0, 0), (0, 0.1, 1)), Pose((9, 2, -1), (0.15, 0, 1)))
    lo, hi = path.bounds + [[-1.0], [1.0]]
    engine = MeshEngine(box_stock(lo, hi), 0.05)
    total = np.sum([engine.cut(part).bracket for part in path.split([0.3, 0.7])], axis=0)
    assert path.volume is not None and total[0] <= path.volume <= total[2]
    assert abs(total[1] - path.volume) < 0.25 * (total[2] - total[0])
