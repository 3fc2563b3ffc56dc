"""B-rep and distances against each other on curved stock: two ways that share only the facing condition."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from vmachining.engagement import By, CylinderStock, Past, RayWorkpiece, contact, facing_parts
from vmachining.engines.brep import Blank, BrepWorkpiece
from vmachining.engines.brep.workpiece.members import Members
from vmachining.errors import EngineError
from vmachining.geometry import Arc, Line
from vmachining.sweep import Pose, Stance, Sweep, Turn
from vmachining.tool import BallNose, BullNose, Edge, FlatEnd, ProfileTool, Taper

AGREE_MM = 1e-4
"""The promise; the largest difference seen here is some 1e-7 mm, OCCT's confusion of points."""

BAR = Blank("cylinder", (0.0, 0.0, -20.0), (0.0, 0.0, 0.0), center=(0.0, 0.0), radius=12.0)
ROUND = CylinderStock((0.0, 0.0), 12.0, (-20.0, 0.0))
TOOLS = {
    "flat": FlatEnd(diameter=10, length=30),
    "ball": BallNose(diameter=10, length=30),
    "bull": BullNose(diameter=10, corner_radius=2, length=30),
    "taper": Taper(diameter=6, taper_deg=12, corner_radius=1, length=30),
}
LEAN = (0.17364817766693, -0.085831651177431, 0.98106026219041)


def before(tool):
    """Passes that the tool meets: level, ramp, arc."""
    return [
        Sweep(tool, (-50, 2, -1), (50, 2, -1)),
        Sweep(tool, (-30, -6, -2.5), (30, 1, -1.5)),
        Sweep.along(tool, Arc((8, 0, -2), (0, 0, -2), angle=2.5)),
    ]


NOW = {
    "ramp": (Line((-3, 1, -2.5), (6, 0, -2.8)), 0.3),
    "arc": (Arc((0, -9, -3), (0, 0, -3), angle=2.0), 0.6),
    "lean": (Turn.great_circle(Pose((-3, -4, -3), LEAN), Pose((5, -5, -3.5), LEAN)), 0.5),
    "turn": (
        Turn.great_circle(Pose((-4, -4, -3), (0, 0, 1)), Pose((5, -5, -3.5), (0.2, 0.3, 0.87**0.5))),
        0.5,
    ),
}


def assert_same(one, other):
    """Equal stretches, but for those shorter than what may be overlooked."""
    a, b = (parts.take(np.lexsort((parts.lower, parts.piece, parts.row))) for parts in (one, other))
    a, b = (parts.take(parts.upper - parts.lower > 0.01) for parts in (a, b))
    assert a.row.tolist() == b.row.tolist() and a.piece.tolist() == b.piece.tolist()
    assert len(a.row) > 0
    assert np.abs(a.lower - b.lower).max() < AGREE_MM and np.abs(a.upper - b.upper).max() < AGREE_MM
    assert (a.lower_by == b.lower_by).all() and (a.upper_by == b.upper_by).all()


@pytest.mark.parametrize("motion", NOW)
@pytest.mark.parametrize("name", TOOLS)
def test_solids_and_distances_agree_on_curved_stock(name, motion):
    tool = TOOLS[name]
    sweeps = list(enumerate(before(tool)))
    edge, now = Edge(tool), Stance.on(*NOW[motion])
    phi = 2 * pi * np.arange(48) / 48
    parts = facing_parts(edge, now, phi)
    solids = Members(BAR, sweeps, By.STOCK).holds(edge, now, phi, parts)
    rays = RayWorkpiece(ROUND, [Past(*one) for one in sweeps]).holds(edge, now, phi, parts)
    assert_same(solids, rays)


def test_wound_edges_agree_too():
    tool = TOOLS["bull"]
    sweeps = list(enumerate(before(tool)))
    edge, now = Edge(tool, helix_deg=35, bottom=True), Stance.on(*NOW["ramp"])
    phi = 2 * pi * np.arange(36) / 36
    parts = facing_parts(edge, now, phi)
    solids = Members(BAR, sweeps, By.STOCK).holds(edge, now, phi, parts)
    rays = RayWorkpiece(ROUND, [Past(*one) for one in sweeps]).holds(edge, now, phi, parts)
    assert_same(solids, rays)


def test_a_process_of_its_own_gives_arcs_and_keeps_its_time():
    tool = TOOLS["ball"]
    sweeps = [(4, before(tool)[0])]
    edge, now = Edge(tool), Stance.on(*NOW["ramp"])
    rays = contact(edge, now, RayWorkpiece(ROUND, [Past(*one) for one in sweeps]), angles=24)
    with BrepWorkpiece(BAR, sweeps) as work:
        solids = contact(edge, now, work, angles=24)
        work.seconds = 1e-6
        with pytest.raises(EngineError, match=r"brep engine: .*no answer within 1e-06 s"):
            contact(edge, now, work, angles=24)
    # the angle where an arc ends feels an error of the ends by one over the slope of the length
    assert solids.arcs == pytest.approx(rays.arcs, abs=1e-4)
    assert_same(
        solids.parts.take(solids.parts.row < solids.grid), rays.parts.take(rays.parts.row < rays.grid)
    )
    assert work._worker is None  # the process is gone


def test_a_sweep_without_a_solid_is_refused_by_name():
    stepped = ProfileTool(points=[[0, 0], [1, 0.2], [1, 1], [2, 2], [2, 20]])
    bottom = Sweep.along(stepped, Arc((10, 0, -2), (10, 0, 0), 1, angle=1.0))
    with pytest.raises(EngineError, match="block 7: OCCT says the swept solid is not valid"):
        Members(BAR, [(7, bottom)], By.STOCK)
