"""Kernels of contact against dense samples: which stretch of an edge may stand in material, and how fast ends are found."""

from __future__ import annotations

import numpy as np
import pytest

from vmachining.engagement.along import blade
from vmachining.engagement.along.kernels.edge_kernels import next_share
from vmachining.engagement.along.kernels.stretch_kernels import standing
from vmachining.engagement.along.kernels.tile_kernels import Tiles
from vmachining.jit import kernel
from vmachining.tool import BallNose, BullNose, Edge, FlatEnd, Taper

TOOLS = (
    BallNose(diameter=10, length=40),
    BullNose(diameter=10, corner_radius=2, length=40),
    FlatEnd(diameter=10, length=40),
    Taper(diameter=2, taper_deg=20, corner_radius=1, length=30),
)


@kernel
def stretch(tiles, tile, shape, piece, now, e_x, e_y, a, b):
    return standing(tiles, tile, shape, piece, now, e_x, e_y, a, b)


@pytest.mark.parametrize("tool", TOOLS, ids=lambda tool: type(tool).__name__)
def test_no_material_of_a_tile_lies_outside_the_stretch(tool):
    """Every place of 2,000 along the edge that stands below the top of its tile is in it, and tiles of places in it are listed,
    for 60 random plates and angles."""
    rng, shape = np.random.default_rng(7), blade(Edge(tool, bottom=True))
    shorter = 0
    for _ in range(60):
        top = rng.uniform(-3.0, 12.0, (12, 12)) * (rng.uniform(size=(12, 12)) < 0.4)
        none = np.zeros((0, 2), dtype=np.int64)
        tiles = Tiles(
            np.full((12, 12), -1), none, np.zeros((0, 8)), top, np.zeros(2), 1.25, np.array([0, -1]), none[:, 0]
        )  # fmt: skip
        now = np.zeros(22)
        now[:3], now[5] = rng.uniform([5.0, 5.0, -2.0], [10.0, 10.0, 3.0]), 1.0
        phi = rng.choice([0.0, 0.5 * np.pi, rng.uniform(0.0, 2.0 * np.pi)])
        e_x, e_y = np.sin(phi), np.cos(phi)
        for piece, row in enumerate(shape.rows):
            if row[6] > 0.0 and row[8] > 1e-9:
                continue
            begin, end = shape.joints[piece], shape.joints[piece + 1]
            a, b = np.sort(rng.uniform(begin, end, 2))
            tile = np.empty(100, dtype=np.int64)
            low, high, most, count = stretch(tiles, tile, shape, piece, now, e_x, e_y, a, b)
            s = np.linspace(a, b, 2000)
            if row[6] > 0.0:
                beta = row[7] + (s - begin) / row[6]
                r, z = row[4] + row[6] * np.cos(beta), row[5] + row[6] * np.sin(beta)
            else:
                share = (s - begin) / (end - begin)
                r, z = row[0] + share * (row[2] - row[0]), row[1] + share * (row[3] - row[1])
            i, j = (
                np.clip(np.floor((now[k] + r * e) / 1.25).astype(int), 0, 11)
                for k, e in enumerate((e_x, e_y))
            )
            if count >= 0:
                assert np.isin((12 * i + j)[(s > low + 1e-9) & (s < high - 1e-9)], tile[:count]).all()
            over = top[i, j] - now[2] - z
            inside = s[over > 1e-9]
            assert (inside >= low - 1e-9).all() and (inside <= high + 1e-9).all()
            assert over.max() <= most + 1e-9
            shorter += high - low < 0.9 * (b - a)
    assert shorter > 20


@pytest.mark.parametrize(
    ("name", "function", "zero", "most"),
    [
        ("smooth", lambda x: np.cos(x) - 0.3, np.arccos(0.3), 8),
        ("kink", lambda x: min(0.2 * x, 5.0 * (x - 1.0)) - 0.1, 1.02, 12),
        ("floor", lambda x: -1e-7 if x < 1.3 else x - 1.3 - 1e-7, 1.3 + 1e-7, 30),
        ("cubic", lambda x: (x - 0.7) ** 3, 0.7, 35),
    ],
)
def test_the_end_of_a_part_is_found_in_few_questions(name, function, zero, most):
    """To 1e-6 of a bracket of 2; halving alone takes 21, and nothing takes twice as many."""
    a, b = 0.0, 2.0
    f, g = function(a), function(b)
    t, asked = 0.5, 0
    while abs(b - a) > 1e-6 and asked < 60:
        x = a + t * (b - a)
        v = function(x)
        asked += 1
        if (v > 0.0) == (f > 0.0):
            c, e = a, f
        else:
            c, e, b, g = b, g, a, f
        a, f = x, v
        if v == 0.0:
            break
        t = next_share(a, b, c, f, g, e, 0.5e-6 / abs(b - a))
    assert a == pytest.approx(zero, abs=2e-6)
    assert asked <= most
