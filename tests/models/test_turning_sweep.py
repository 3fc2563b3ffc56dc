"""The published test motion against poses of its cutter, sampled densely: volume, and what the three regions are."""

from __future__ import annotations

import numpy as np
import pytest

from tests.models.shipped import MODELS
from vmachining.job.single import read_sweep
from vmachining.sweep.regions import REGIONS, grazing_points, regions

RADIUS, CORNER, LENGTH, HEIGHT = 15.0, 5.0, 50.0, 5.0
POSES = 121
FILE = MODELS / "turning_sweep" / "sweep.json"


def depth(points: np.ndarray, t: float) -> np.ndarray:
    """(n,) mm inside of the cutter at time t, negative outside. Its axis (0, -sin a, cos a), a = 60 t degrees."""
    a = np.radians(60.0 * t)
    x, y, z = points[:, 0], points[:, 1] - 100.0 * t, points[:, 2]
    h = -y * np.sin(a) + z * np.cos(a) + HEIGHT
    rho = np.hypot(x, y * np.cos(a) + z * np.sin(a))
    corner = CORNER - np.hypot(rho - (RADIUS - CORNER), h - CORNER)
    below = np.where((h < CORNER) & (rho > RADIUS - CORNER), corner, np.minimum(RADIUS - rho, h))
    return np.minimum(below, LENGTH - h)


def surface(t: float, count: int, seed: int) -> np.ndarray:
    """(count, 3) places on corner and wall at time t."""
    rng = np.random.default_rng(seed)
    u, a = rng.uniform(0.0, 2.0 * np.pi, count), np.radians(60.0 * t)
    v, wall = rng.uniform(0.0, 0.5 * np.pi, count), rng.random(count) < 0.5
    rho = np.where(wall, RADIUS, RADIUS - CORNER + CORNER * np.sin(v))
    h = np.where(wall, rng.uniform(CORNER, LENGTH, count), CORNER - CORNER * np.cos(v)) - HEIGHT
    y = rho * np.sin(u)
    turned = [rho * np.cos(u), y * np.cos(a) - h * np.sin(a), y * np.sin(a) + h * np.cos(a)]
    return np.column_stack(turned) + [0.0, 100.0 * t, 0.0]


def test_the_volume():
    sweep = read_sweep(str(FILE))
    assert sweep.volume is not None
    low, high = np.array(sweep.bounds)
    cell = 1.6
    count = np.ceil((high - low) / cell).astype(int)
    rng = np.random.default_rng(35)
    at = np.stack(np.meshgrid(*map(np.arange, count), indexing="ij"), axis=-1).reshape(-1, 3)
    at = low + cell * (at + rng.random(at.shape))
    inside = np.zeros(len(at), dtype=np.bool_)
    for t in np.linspace(0.0, 1.0, 101):
        rest = np.flatnonzero(~inside)
        inside[rest] = depth(at[rest], t) > 0.0
    # a place in each cell: cells that the surface crosses (25,000 mm^2) err by half of themselves, independently
    crossed = 25_000.0 / cell**2
    sigma = 0.5 * np.sqrt(crossed) * cell**3
    assert abs(inside.sum() * cell**3 - sweep.volume) < 4.0 * sigma < 0.01 * sweep.volume
    # lines through the union of all poses, by others: spec row G1 N30
    assert sweep.volume == pytest.approx(154689.04, rel=1e-6)


@pytest.mark.parametrize(("t", "name"), [(0.0, "ingress"), (1.0, "egress")])
def test_what_is_left_of_the_first_and_the_last_pose(t, name):
    sweep = read_sweep(str(FILE))
    points = surface(t, 300, 7)
    step = 1e-3 if t == 0.0 else -1e-3
    later = depth(points, t + step)
    others = np.max([depth(points, s) for s in np.linspace(0.0, 1.0, POSES) if abs(s - t) > 1e-9], axis=0)
    # left behind by the next pose, or not yet reached by the one before, and by all others
    free = (later < -0.01) & (others < -0.01)
    assert free.sum() > 40
    assert {REGIONS[k] for k in regions(sweep, points[free])} == {name}


def test_the_envelope_touches_its_pose_alone():
    sweep = read_sweep(str(FILE))
    points = np.concatenate(grazing_points(sweep, 0.5))
    assert np.abs(depth(points, 0.5)).max() < 1e-6
    close = np.max([depth(points, 0.5 + s) for s in (-0.01, -0.003, 0.003, 0.01)], axis=0)
    beyond = np.max([depth(points, s) for s in np.linspace(0.0, 1.0, POSES)], axis=0)
    free = beyond < 1e-6
    assert free.sum() > 0.5 * len(points)
    # the surface slides along itself: away from the curve in time, the body falls back with the square
    assert (close[free] < 0.0).all()
    assert {REGIONS[k] for k in regions(sweep, points[free])} == {"grazing"}
