"""Boolean values inside the bracket that are not true, and blocks around an instant at which the grazing curve jumps."""

from __future__ import annotations

import numpy as np
import pytest

from vmachining import BallNose, Bracket, BullNose, Sweep
from vmachining.bench.brep_chains import bar_of, chain_of
from vmachining.bench.gauntlet import gauntlet_block
from vmachining.bench.referee import referee
from vmachining.engines.brep import Blank, Ladder, solids
from vmachining.engines.brep import faceted as meshes
from vmachining.engines.brep.cover import Tries, _Work
from vmachining.engines.brep.ladder import SOLIDS, quiet
from vmachining.engines.mesh import MeshEngine, box_stock
from vmachining.geometry import Arc
from vmachining.sweep.folds import poses, standing


@pytest.mark.parametrize(("number", "block"), [(21, 5), (21, 9), (146, 4)])
def test_a_value_inside_the_bracket_is_held_against_meshes(number: int, block: int) -> None:
    """Grooves of a taper beside each other: plain booleans give 0, fuzzy ones of one block are 0.5 % low.

    A taper that turns sharply: all booleans agree on 0.16 % too much.
    """
    bar = bar_of([number])
    engine = MeshEngine(box_stock(tuple(bar[0]), tuple(bar[1])), 0.02, certify=True)
    chain = chain_of(1, number, engine)
    stock = Blank("box", tuple(bar[0].tolist()), tuple(bar[1].tolist()))
    quiet()
    verdict = Ladder(stock, [[sweep] for sweep in chain.sweeps]).removed(block, chain.brackets[block])
    rays, spread = referee(chain.sweeps, block, bar, 192)
    value = verdict.removed_mm3
    assert value is not None and chain.brackets[block].holds(value, verdict.slack_mm3)
    assert abs(value - rays) <= spread + abs(verdict.slack_mm3)
    assert spread < 0.1 * (chain.brackets[block].hi - chain.brackets[block].lo)


def test_a_doubtful_helix_is_held_against_sections() -> None:
    """Far from the estimate of its bracket; OCCT's meshes of its sheets, which go up to the axis, may take minutes."""
    tool = BullNose(diameter=8, corner_radius=3, length=40)
    entry = Sweep.along(tool, Arc((17, 0, -0.2), (15, 0, 0), angle=-np.pi, rise=-0.6))
    heard = list[str]()
    work = Ladder(Blank("box", (0, -20, -20), (30, 20, 0)), [[entry]])
    verdict = work.removed(0, Bracket(20.0, 21.0, 30.0), told=heard.append)
    assert heard == [SOLIDS, "plain", "sections"]
    rays, spread = referee([entry], 0, np.array([[0.0, -20.0, -20.0], [30.0, 20.0, 0.0]]), 96)
    assert verdict.removed_mm3 == pytest.approx(rays, abs=spread) and spread < 1e-3 * rays


def test_an_instant_at_which_the_curve_jumps_is_closed_in_on() -> None:
    """A tool that tilts as it leaves along its axis: parts ever shorter towards the instant, and poses around it.

    The union as a mesh against points by exact distances, wherever it is not nearer than mesh and poses can tell.
    """
    sweep = gauntlet_block(944)
    quiet()
    parts = [part.shape for part in solids(sweep)]
    lo, hi = sweep.bounds
    union = meshes.united(parts, 2e-3, np.stack([lo, hi]))
    points = np.random.default_rng(0).uniform(lo, hi, (400, 3))
    distance = sweep.signed_distance(points)
    clear = np.abs(distance) > 0.02 * sweep.profile.max_radius
    tiny = 1e-3
    for point, d in zip(points[clear], distance[clear], strict=True):
        ball = meshes.Manifold.cube([tiny] * 3, True).translate(point.tolist())
        inside = float((union ^ ball).volume()) > 0.5 * tiny**3
        assert inside == (d < 0.0), (point, d)
    assert clear.sum() > 200 and (distance[clear] < 0.0).any()


def test_poses_alone_cover_what_hardly_moves() -> None:
    """Beside the sharp rim of a flat end what poses miss falls with their distance, not with its square."""
    sweep = gauntlet_block(944)
    whole, short = sweep.path, sweep.path.part(0.5, 0.5 + 1e-6)
    assert poses(sweep.profile, whole, 3e-5, 16) is None  # type: ignore[arg-type]
    assert poses(sweep.profile, standing(whole, 0.5), 3e-5, 16) == 1  # type: ignore[arg-type]
    count = poses(sweep.profile, short, 3e-5, 16)  # type: ignore[arg-type]
    assert count is not None and 1 <= count <= 16


def test_a_body_is_not_taken_for_one_that_is_gone() -> None:
    """Bodies are remembered while the parts of a block are tried; memory that is free again holds other ones."""
    path = gauntlet_block(944).path
    work = _Work[float](path, lambda body, *_: [body.points[:, 0].max()], lambda *_: [], Tries())  # type: ignore[arg-type]
    for diameter in range(2, 40):
        assert work._built(BallNose(diameter=diameter, length=60).profile, 0.0, 1.0) == [diameter / 2]
