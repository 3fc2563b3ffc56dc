"""Searches in time whose stack of stretches is too small, or that are given up: what it costs, and that it is told."""

from __future__ import annotations

from math import cos, radians, sin

import numpy as np
import pytest
from sweep_inventions import FLAT, TOOLS, around, lines
from test_sweep_turning import TURNS

from vmachining.sweep import Pose, Sweep, Turn
from vmachining.sweep.flux import _kernels as flux
from vmachining.sweep.flux import flux_volume
from vmachining.sweep.rotating import _kernels as rotating
from vmachining.sweep.rotating.pose import _kernels as pose
from vmachining.tool import FlatEnd, Profile

FULL = 1
"""Rows of a stack that is full at once."""


def packed(profile: Profile, turn: Turn):
    q = Sweep.along(profile, turn)._moved()
    assert q is not None
    poses = np.zeros((3, 12))
    for k in range(3):
        pose.state(q.waves, 0.5 * k, poses[k])
    return q, poses


def intervals(q, rows: int, origins, directions) -> list[list[float]]:
    counts, (lo, hi) = np.zeros(len(origins), dtype=np.int64), np.full((2, len(origins), 64), np.nan)
    rotating.rays(q, rows, origins, directions, counts, lo, hi)
    return [[*low[:n], *high[:n]] for low, high, n in zip(lo, hi, counts.tolist(), strict=True)]


@pytest.mark.parametrize("name", ["ac", "middle"])
@pytest.mark.parametrize("tool", ["flat", "bull"])
def test_a_full_stack_grows_and_changes_nothing(name, tool):
    """The same intervals and distances, to the last bit, as with room for every stretch."""
    profile = TOOLS[tool].profile
    q, poses = packed(profile, TURNS[name])
    sweep = Sweep.along(profile, TURNS[name])
    origins, directions = lines(sweep, 25)
    origins = origins - sweep.path.start
    small, large = (intervals(q, rows, origins, directions) for rows in (FULL, 4096))
    assert small == large and any(small)
    for x, y, z in around(sweep, 25) - sweep.path.start:
        found = []
        for rows in (FULL, 4096):
            best = np.inf
            for piece in range(len(q.ends) - 1):
                i0, i1 = q.ends[piece, 2], q.ends[piece + 1, 2]
                for k in range(2):
                    best = min(best, pose.near(q.seg, i0, i1, poses[2 * k], x, y, z)[0])
                best = rotating.distance_piece(
                    q.seg, i0, i1, q.limits[piece], q.waves, x, y, z, poses[::2].copy(), best, q.tol, -np.inf,
                    np.zeros((rows, 7)), np.zeros(12),
                )  # fmt: skip
            found.append(best)
        assert found[0] == found[1]


@pytest.mark.parametrize("small", [1e-3, 1e-6, 1e-9, 1e-12])
def test_a_side_that_almost_slides_along_itself(small):
    """A flat cutter plunges while its axis turns by a hair: at most as wide as the cylinder and the hair.

    Rays across it have a chord 2 sqrt(R^2 - y^2), moved and widened by at most the turn times the way along the
    axis; points beside it have their distance to the cylinder.
    """
    turn = Turn.great_circle(Pose((0, 0, 0), (0, 0, 1)), Pose((0, 0, -30), (small, 0, 1)))
    sweep = Sweep.along(FLAT.profile, turn)
    reach = 100.0 * small + 1e-7  # what 1000 stretches without a proof may cost, and the turn itself
    y, z = np.meshgrid([0.0, 3.0, 9.9], [-20.0, 0.0, 20.0])
    origins = np.column_stack([np.full(9, -60.0), y.ravel(), z.ravel()])
    found = sweep.ray_intervals(origins, (1.0, 0.0, 0.0))
    half = np.sqrt(100.0 - origins[:, 1] ** 2)
    assert (found.counts == 1).all()
    slope = 10.0 / half  # a chord answers a shift of the side by the inverse of the slope of the circle
    assert (np.abs(found.enter - (60.0 - half)) <= slope * reach).all()
    assert (np.abs(found.leave - (60.0 + half)) <= slope * reach).all()
    d = sweep.signed_distance([(11.0, 0.0, 0.0), (0.0, 9.0, 0.0), (0.0, -12.5, -10.0)])
    assert np.abs(d - (1.0, -1.0, 2.5)).max() <= reach


def test_a_search_that_has_no_room_says_so():
    """`visited` is told to look with three rows: it finds the point, proves it new, or gives up aloud."""
    turn = Turn.through((0, 0, 0), (0, 0, 0), "axis", (0, 0, 1), (np.sin(0.5), 0, np.cos(0.5)))
    q, _ = packed(FLAT.profile, turn)
    points = around(Sweep.along(FLAT.profile, turn), 300) - turn.start
    answers = [
        [flux.visited(q.seg, q.ends, q.limits, q.waves, *point, 1.0, 1e-9, 1000, np.zeros((rows, 7)), np.zeros(12))
         for point in points]
        for rows in (3, 160)
    ]  # fmt: skip
    small, large = (np.array(found) for found in answers)
    sure = ~small[:, 1]
    assert (small[sure, 0] == large[sure, 0]).all()  # what is not given up is the answer
    assert small[:, 1].any() and not large[:, 1].any()


@pytest.mark.parametrize("patience", [0, 2, 8, 1000])
def test_what_is_given_up_is_in_the_error_of_the_volume(patience):
    """Tilting by 30 degrees about the tip re-enters 193.018 mm^3: V = 29303.046344 by a closed form."""
    profile, tilted = FLAT.profile, Pose((0, 0, 0), (0, -sin(radians(30)), cos(radians(30))))
    turn = Turn.great_circle(Pose((0, 0, 0), (0, 0, 1)), tilted)
    q, _ = packed(profile, turn)
    found = flux_volume(profile, q, wanted=1e-3, patience=patience)
    assert abs(found.volume - 29303.046344) <= found.error
    assert (found.error > 10.0) == (patience < 1000)  # impatience is dear, and that is told


def test_what_a_cylinder_enters_is_bounded_where_one_of_its_circles_all_but_stands_still():
    """Bottom and top enter the integral of |V.a - w x| over a disc, the side 2 R times that of the speed along the axis."""
    r, high, way, w = 3.0, 40.0, 0.03, radians(20)
    flat = FlatEnd(diameter=2 * r, length=high).profile
    turn = Turn.great_circle(Pose((0, 0, 0), (0, 0, 1)), Pose((0, way, 0), (sin(w), 0, cos(w))))
    # the tip moves along the axis of the turn: V.a = 0, the speed at height z is hypot(w z, way)
    side = r / w * (w * high * np.hypot(w * high, way) + way**2 * np.arcsinh(w * high / way))
    truth = side + w * 4.0 * r**3 / 3.0
    found = flux_volume(flat, packed(flat, turn)[0], wanted=1e-3)
    assert (
        found.entered - found.slack < flat.volume + truth < found.entered
    )  # Gauss alone ends 2e-5 mm^3 below
    assert found.slack == pytest.approx(flat.volume + truth - (found.body + found.flux), rel=0.1)
