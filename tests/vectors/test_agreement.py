"""Vectors against engines of another kind: tips lie on the workpiece of the mesh engine; facets against exact sweeps."""

from __future__ import annotations

import numpy as np
import pytest

from tests.vectors.test_vectors import block, vectors
from vmachining.engines import engine_class
from vmachining.engines.protocol import Options
from vmachining.engines.vectors import VectorEngine, VectorSettings
from vmachining.stock import BoxStock, MeshStock
from vmachining.sweep import Pose, Sweep
from vmachining.tool import BallNose, BullNose, FlatEnd

CHORD = 0.02
STOCK = BoxStock((0, 0, 0), (40, 30, 20))


def part() -> MeshStock:
    """A plate with a dome, a saddle z = 9 + (u^2 - v^2) / 40 about (30, 15), a wall and a bar that hangs over."""
    from manifold3d import Manifold

    plate = Manifold.cube((40, 30, 6)) + Manifold.sphere(7.0, 64).translate((10, 15, 6))
    wall = Manifold.cube((3, 30, 14)).translate((37, 0, 0)) + Manifold.cube((8, 4, 3)).translate((31, 0, 12))

    def bent(points: np.ndarray) -> np.ndarray:
        u, v = points[:, 0], points[:, 1]
        top = 9.0 + (u * u - v * v) / 40.0
        return np.column_stack([u + 25.0, v + 15.0, np.where(points[:, 2] > 0.5, top, 5.0)])

    saddle = Manifold.cube((12, 12, 1)).translate((-6, -6, 0)).refine(12).warp_batch(bent)
    below = Manifold.cube((40, 30, 20))
    mesh = ((plate + saddle + wall) ^ below).to_mesh64()
    return MeshStock(np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts, np.int64))


def sweeps() -> list[Sweep]:
    """Roughing by a flat, finishing by a ball, a wall and the overhang by tools that lean."""
    flat, ball = FlatEnd(diameter=8.0, length=40.0), BallNose(diameter=6.0, length=40.0)
    bull = BullNose(diameter=6.0, corner_radius=1.5, length=40.0)
    rough = [Sweep(flat, [-6, y, 14.5], [33, y, 14.5]) for y in (2.0, 8.0, 14.0, 20.0, 26.0)]
    dome = [
        Sweep(ball, [10 + 9 * np.cos(a), 15 + 9 * np.sin(a), 8], [10, 15, 13.2])
        for a in np.arange(0, 6.2, 0.7)
    ]
    saddle = [Sweep(ball, [19, y, 9.8], [31, y, 9.4]) for y in (10.0, 12.0, 15.0, 18.0)]
    lean = [
        Sweep(bull, Pose((34, 25, 8), (-0.28, 0, 0.96)), Pose((34, 12, 9), (-0.6, 0, 0.8))),
        Sweep(bull, Pose((31, -4, 8), (0, -0.8, 0.6)), Pose((33, 3, 8.5), (0, -0.96, 0.28))),
    ]
    return rough + dome + saddle + lean


@pytest.mark.slow  # the mesh engine cuts two tools that lean
def test_tips_lie_on_the_workpiece_of_the_mesh_engine() -> None:
    settings = VectorSettings(pitch=0.5, spacing=1.0, theta_v=np.radians(60.0), depth=4.0)
    ours = VectorEngine(STOCK, Options(chord=CHORD, design=part(), vectors=settings))
    theirs = engine_class("mesh").of(STOCK, Options(chord=CHORD))
    for number, sweep in enumerate(sweeps()):
        ours.cut(sweep, number)
        theirs.cut(sweep, number)
    found = theirs.surface()
    mesh = MeshStock(found.vertices, found.triangles)
    v, laid = ours.along, ours.along.laid
    measured = (
        (v.length > laid.low) & ~laid.behind & (v.length < settings.depth - 1e-6) & (np.abs(v.length) > 1e-5)
    )
    tips = (laid.point + v.length[:, None] * laid.normal)[measured]
    assert measured.sum() > 300
    off = np.abs(mesh.signed_distance(tips))
    again = ours.part.meet(laid.point[measured], laid.normal[measured], settings.depth)
    open_ = (
        v.length[measured] < again - 1e-6
    )  # those that end at the part itself say nothing of the workpiece
    assert open_.sum() > 100 and off[open_].max() <= 2 * CHORD
    for base, lengths, x, y in ours.upright.tiles():
        on = (base.facet >= 0) & (lengths > (base.low - base.start) + 1e-3)
        i, j = np.nonzero(on)
        tips = np.column_stack([x[i], y[j], base.start[on] + lengths[on]])
        hanging = x[i] > 30.0  # material above the tool: not for upright vectors
        assert np.abs(mesh.signed_distance(tips[~hanging])).max(initial=0.0) <= 2 * CHORD


@pytest.mark.parametrize(
    "sweep",
    [
        block([-6, 2, 1], [7, -3, 4]),
        Sweep(
            BullNose(diameter=12.0, corner_radius=2.0, length=30.0),
            Pose((-5, 0, 0), (0.28, 0, 0.96)),
            Pose((5, 2, 1), (-0.28, 0.0, 0.96)),
        ),
    ],
    ids=["ball", "five axes"],
)
def test_tips_lie_on_the_sweep_that_made_them(sweep: Sweep) -> None:
    """By distances, which the lengths are not made of; float32 lengths of 20 mm are rounded by 1e-6 mm."""
    rng = np.random.default_rng(8)
    point = rng.uniform([-8, -8, -12], [8, 8, -4], (300, 3))
    normal = rng.normal(size=(300, 3)) * 0.3 + [0, 0, 1]
    found = vectors(point, normal, np.array(20.0), low=-5.0)
    found.cut(sweep)
    hit = (found.length < 20.0) & (found.length > -5.0)
    assert hit.sum() > 80
    tips = found.laid.point + found.length[:, None].astype(float) * found.laid.normal
    assert np.abs(sweep.signed_distance(tips[hit])).max() <= 1e-5
