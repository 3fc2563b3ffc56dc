"""What upright vectors cannot see, and surfaces that are gone though a tip stands beyond them: closed forms on a T."""

from __future__ import annotations

from math import asin, sqrt

import numpy as np
import pytest
from manifold3d import Manifold

from vmachining.engines.protocol import Options, Request
from vmachining.engines.vectors import VectorEngine, VectorSettings
from vmachining.engines.vectors.deviation import KINDS
from vmachining.geometry import Line
from vmachining.stock import BoxStock, MeshStock
from vmachining.sweep import Sweep
from vmachining.tool import BallNose, Cutter, FlatEnd, Profile

BAR = 4.5, 6.5
"""Heights of the bar of the T, which hangs over by 3 mm all around its stem."""


def engine(top: float = BAR[1]) -> VectorEngine:
    body = Manifold.cube((4, 4, 5)).translate((3, 3, 0)) + Manifold.cube((10, 10, 2)).translate(
        (0, 0, BAR[0])
    )
    mesh = body.to_mesh64()
    design = MeshStock(np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts, np.int64))
    settings = VectorSettings(pitch=0.1, spacing=0.25)
    return VectorEngine(BoxStock((0, 0, 0), (10, 10, top)), Options(design=design, vectors=settings))


def head(radius: float, thick: float) -> Profile:
    """A T-slot cutter with a neck of 1 mm."""
    return Profile([(0, 0), (radius, 0), (radius, thick), (0.5, thick), (0.5, 40)])


def along(tool: Profile | Cutter, y: float, z: float) -> Sweep:
    """From one side of the stock to the other."""
    return Sweep.along(tool, Line((-6, y, z), (16, y, z)))


@pytest.mark.parametrize("together", [False, True])
def test_cuts_under_and_in_standing_material_hold_their_closed_forms(together: bool) -> None:
    """A slot below the bar from the side, two cuts from above it, and one far from it all."""
    r = 1.5  # of the ball, whose centre moves 0.75 inside along the top: the part of a half disc right of the side
    half_disc = 0.5 * (r * r * asin(1.0) + 0.75 * sqrt(r * r - 0.75**2) + r * r * asin(0.75 / r))
    cuts = [
        (along(head(2.5, 3.0), -1.0, 0.0), 10 * 1.5 * 3.0),
        (along(FlatEnd(diameter=1, length=30), 0.5, 6.0), 10 * 1.0 * 0.5),
        (along(BallNose(diameter=2 * r, length=30), 0.75, 6.5 - r), 10 * (half_disc - 1.0 * 0.5)),
        (along(BallNose(diameter=2 * r, length=30), 8.0, 6.5 - r), 10 * 0.5 * np.pi * r * r),
    ]
    vectors = engine()
    requests = [Request(sweep, k) for k, (sweep, _) in enumerate(cuts)]
    found = vectors.answer(requests) if together else [vectors.cut(r.sweep, r.block) for r in requests]
    for removal, (_, truth) in zip(found, cuts, strict=True):
        assert removal.lo <= removal.estimate <= removal.hi and not removal.proven
        assert removal.lo <= truth <= removal.hi
    assert [removal.note is None for removal in found] == [False, False, False, True]
    assert found[3].width < 0.2 * cuts[3][1]


def test_a_short_ball_under_material_is_no_slot_up_to_the_top() -> None:
    ball = Sweep.along(BallNose(diameter=2, length=2), Line((-6, 5, 2), (16, 5, 2)))
    truth = 10 * (np.pi / 2 + 2.0)  # half a disc, and the shank above it
    removal = engine().cut(ball)
    assert removal.note is not None and removal.lo <= truth <= removal.hi < 1.3 * truth


def test_an_overhang_that_is_gone_is_consumed() -> None:
    """A cutter from above takes the bar's edge off, and 2.5 mm of air and stock below it."""
    vectors = engine()
    vectors.cut(Sweep.along(FlatEnd(diameter=8, length=40), Line((-1.5, -6, 2), (-1.5, 16, 2))))
    found = vectors.deviation(0.01)
    rows = {name: np.asarray(values) for name, values in found.columns(0.01).items()}
    below = (rows["kind"] == "overhang") & (np.abs(rows["z_mm"] - BAR[0]) < 1e-9)
    gone, left = below & (rows["x_mm"] < 2.4), below & (rows["x_mm"] > 2.6)
    assert gone.sum() > 100 < left.sum()
    assert set(rows["state"][gone]) == {"consumed"} and np.allclose(
        rows["deviation_mm"][gone], BAR[0] - BAR[1]
    )
    assert set(rows["state"][left]) == {"under"} and np.allclose(rows["deviation_mm"][left], BAR[0])


def test_a_top_that_is_gone_below_standing_material_is_consumed() -> None:
    """The stock stands 1.5 mm above the bar; a T-slot cutter takes the bar from the side, and 0.5 mm above it."""
    vectors = engine(top=8.0)
    vectors.cut(along(head(4.0, 3.0), -2.0, 4.0))
    found = vectors.deviation(0.01)
    upright = found.kind == KINDS.index("upright")
    gone = upright & (found.point[:, 1] < 1.9) & (found.point[:, 2] > 6.4)
    left = upright & (found.point[:, 1] > 2.1) & (found.point[:, 2] > 6.4)
    assert (
        found.consumed[gone].all()
        and np.allclose(found.deviation[gone], -2.0, atol=1e-6)
        and gone.sum() > 100
    )
    assert not found.consumed[left].any() and np.allclose(found.deviation[left], 1.5) and left.sum() > 100
