"""Boolean values inside the bracket that are not true, and blocks around an instant at which the grazing curve jumps."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from vmachining import BallNose, Bracket, FlatEnd, Job
from vmachining.bench.gauntlet import gauntlet_block
from vmachining.bench.referee import referee
from vmachining.engines.brep import (
    Blank,
    Ladder,
    Status,
    solids,
    volume,
)
from vmachining.engines.brep import faceted as meshes
from vmachining.engines.brep.booleans import box_of
from vmachining.engines.brep.cover import Tries, _Work
from vmachining.engines.brep.ladder import quiet
from vmachining.job.blocks import group_blocks
from vmachining.job.brep import _sweeps, blank
from vmachining.job.contact import ToolParts
from vmachining.job.reading import read_job_program
from vmachining.sweep.folds import poses, standing

BOX = Blank("box", (0, -20, -20), (30, 20, 0))
TOOL = FlatEnd(diameter=10, length=40)


@pytest.mark.parametrize("block", [242, 337])
def test_a_boolean_that_loses_a_sliver_of_a_chip_does_not_stand(block: int) -> None:
    """models/mould, 1 mm blocks of a ball: plain booleans are 0.15 % too low and 0.2 % too high, well inside any bracket."""
    job = Job.load(Path(__file__).parents[2] / "models" / "mould" / "job.toml")
    program, tools = read_job_program(job), {number: ToolParts.of(tool) for number, tool in job.tools.items()}
    cuts = islice(group_blocks(program, job.machine), block + 1)
    sweeps = [_sweeps(cut, program, tools, job.machine) for cut in cuts]
    stock, box = blank(job), box_of(blank(job).shape())
    quiet()
    rays, spread = referee(
        [sweep for cut in sweeps for sweep in cut], sum(map(len, sweeps[:block])), (box[0], box[1]), 256
    )
    assert spread < 1e-3 * rays
    work, bracket = Ladder(stock, sweeps), Bracket(0.96 * rays, rays, 1.04 * rays)
    plain = work.removed(block, bracket, rungs=("plain",))
    assert plain.status is Status.REFUSED and "is not true, rays find" in plain.reason
    assert abs(plain.tried[0] - rays) > spread  # type: ignore[operator]
    verdict = work.removed(block, bracket)
    assert verdict.removed_mm3 == pytest.approx(rays, abs=spread)


def test_an_instant_at_which_the_curve_jumps_is_closed_in_on() -> None:
    """A tool that tilts as it leaves along its axis: parts ever shorter towards the instant, and poses around it.

    The union as a mesh against points by exact distances, wherever it is not nearer than mesh and poses can tell.
    """
    sweep = gauntlet_block(944)
    quiet()
    parts = [part.shape for part in solids(sweep)]
    lo, hi = sweep.bounds
    union = meshes.united(parts, [volume(part) for part in parts], 2e-3, np.stack([lo, hi])).solid
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
