"""All blocks at once give the lengths that blocks give one by one, and the published half cylinder its closed forms."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from benchmarks.vector_batch import Points, ball_grid, ball_vectors
from benchmarks.vectors import BALL, RADIUS, _exact, _half_cylinder, _normals, blocks
from tests.vectors.test_vectors import R, block, vectors
from vmachining.sweep import Sweep

PATH = blocks()
NEST = np.array(
    [[0, 0, 6], [9, 1, 5], [9, 1, 9], [3, 8, 4], [-4, 3, 7], [-4, 3, 2], [6, -5, 8], [2, 2, 3.5]], dtype=float
)
"""Centres: ramps, plunges and a long move."""


@pytest.mark.parametrize("pitch", [0.13, 0.5])
def test_a_grid_is_as_low_as_the_lowest_exact_ray(pitch: float) -> None:
    shape = (int(24 / pitch), int(24 / pitch))
    found = ball_grid(NEST, R, -9.0, -9.0, pitch, shape, lambda x, y: np.zeros((len(x), len(y))), top=20.0)
    x = -9.0 + (np.arange(shape[0]) + 0.5) * pitch
    places = np.stack(np.meshgrid(x, x, [0.0], indexing="ij"), axis=-1).reshape(-1, 3)
    wanted = np.full(len(places), 20.0)
    for a, b in pairwise(NEST):
        rays = block(a.tolist(), b.tolist()).ray_intervals(places, (0, 0, 1))
        has = rays.counts > 0
        wanted[has] = np.minimum(wanted[has], rays.enter)
    assert np.abs(found.reshape(-1) - wanted).max() <= 2.0**-20 + 1e-9  # float32 below 20


def test_vectors_are_as_short_as_block_by_block() -> None:
    rng = np.random.default_rng(5)
    point, normal = rng.uniform([-6, -6, -2], [10, 10, 8], (600, 3)), rng.normal(size=(600, 3))
    normal[:, 2] = np.abs(normal[:, 2])
    one = vectors(point, normal, np.array(12.0), low=-40.0)
    for a, b in pairwise(NEST):
        one.cut(block(a.tolist(), b.tolist()))
    found = ball_vectors(
        NEST, R, Points(one.laid.point, one.laid.normal, np.zeros(len(one), int)), 12.0, 40.0, shank=55.0
    )
    assert (found < 12.0).sum() > 200
    assert np.array_equal(found, one.length)


def test_the_half_cylinder_of_the_sources() -> None:
    """Spec E.7, B1: lengths along normals in closed form; cusps 0.0251, chords -0.00149."""
    assert len(PATH) - 1 == 21_500
    points = _normals(1.37, 0.0)
    inner = points.normal[:, 2] > np.sin(0.15)
    length = ball_vectors(PATH, BALL, points, 2.0, 10.0)
    wanted = _exact(points.point[inner, 0], points.normal[inner])
    assert (
        np.abs(length[inner] - wanted) <= 0.5 * np.spacing(np.abs(wanted).astype(np.float32)) + 1e-9
    ).all()
    assert length.min() >= -0.00149 and length.max() <= 0.0251


def test_heights_of_the_half_cylinder_are_exact_rays_of_the_blocks_near() -> None:
    count = 40
    found = ball_grid(PATH, BALL, 0.0, -50.0, 100.0 / count, (count, count), _half_cylinder)
    at = np.array([[3, 20], [17, 5], [25, 33], [39, 39]])
    for i, j in at:
        x, y = (i + 0.5) * 2.5, -50.0 + (j + 0.5) * 2.5
        lowest = np.inf
        for k in np.flatnonzero(np.hypot(PATH[:-1, 0] - x, PATH[:-1, 1] - y) < 2.0 * BALL):
            sweep: Sweep = block(PATH[k].tolist(), PATH[k + 1].tolist())
            rays = sweep.ray_intervals([[x, y, 0.0]], (0, 0, 1))
            lowest = min(lowest, *rays.enter.tolist(), np.inf)
        assert found[i, j] == pytest.approx(lowest - np.sqrt(RADIUS**2 - y * y), abs=2e-9)
