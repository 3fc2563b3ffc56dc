"""Facets that a tile cannot see are left out of its meshes."""

import numpy as np
import pytest
from manifold3d import Manifold, OpType
from somecutters import TOOLS

from vmachining.engines.mesh import _kernels
from vmachining.engines.mesh._kernels import Cutter, View, Way
from vmachining.engines.mesh.facets import Side
from vmachining.engines.mesh.solids import manifold
from vmachining.engines.mesh.straight import facets
from vmachining.tool import BallNose

CUTTERS = {**TOOLS, "large ball": BallNose(diameter=10, length=30)}


def _views(body, rng):
    """Windows of a millimetre or two about the lower part of a sweep, with an uneven roof."""
    for _ in range(12):
        turn = rng.uniform(0.0, 2.0 * np.pi)
        start = rng.uniform(-1.0, 1.0, 3)
        step = np.array([np.cos(turn), np.sin(turn), rng.choice([0.0, 0.4, -0.4])]) * rng.uniform(0.3, 1.5)
        low, top = start[2] + body.height[0] + min(step[2], 0.0), start[2] + body.height[1]
        at = start[:2] + rng.uniform(-1.1, 1.1, 2) * body.reach
        lo = np.array([*at, low - 0.2])
        hi = np.array([*(at + rng.uniform(0.3, 2.0, 2)), low + rng.uniform(0.3, 0.6) * (top - low)])
        cell = 0.19
        shape = tuple(np.ceil((hi - lo)[:2] / cell + 1e-9).astype(int))
        heights = np.where(rng.random(shape) < 0.3, -np.inf, rng.uniform(lo[2], hi[2], shape))
        yield np.cos(turn), np.sin(turn), start, step, lo, hi, heights, cell


@pytest.mark.parametrize("tool", CUTTERS)
def test_facets_left_out_take_nothing_below_the_roof(tool):
    """Columns as high as the roof lose the same to the facets that are seen as to all of them."""
    body = facets(CUTTERS[tool].cutter, 0.02, Side.INNER).parts[0].body
    cutter, rng = Cutter(body.points, body.triangles, body.normals, body.edges), np.random.default_rng(9)
    left_out = taken = 0
    for cos, sin, start, step, lo, hi, heights, cell in _views(body, rng):
        apex = start + [0.0, 0.0, body.height[0] + 0.999 * (body.height[1] - body.height[0])]
        view = Way(cos, sin, start, step), View(lo, hi, apex, lo, heights, cell)
        some, whole = (_kernels.swept_facets(cutter, *view, cull, np.inf) for cull in (True, False))
        columns = [
            Manifold.cube((cell, cell, heights[i, j] - lo[2])).translate(
                (*(lo[:2] + cell * np.array([i, j])), lo[2])
            )
            for i, j in zip(*np.nonzero(heights > lo[2]), strict=True)
        ]
        room = Manifold.cube((hi - lo).tolist()).translate(lo.tolist())
        stock = Manifold.batch_boolean(columns, OpType.Add) ^ room
        lost = [
            float((stock ^ manifold(points, triangles)).volume()) if len(triangles) else 0.0
            for points, triangles, sound in (some, whole)
            if sound
        ]
        if len(lost) == 2:
            assert lost[0] == pytest.approx(lost[1], abs=1e-7)
            left_out += len(some[1]) < len(whole[1])
            taken += lost[1] > 1e-3
    assert left_out > 6 and taken > 3


@pytest.mark.parametrize("tool", CUTTERS)
def test_an_edge_lies_between_the_two_triangles_that_it_names(tool):
    body = facets(CUTTERS[tool].cutter, 0.01, Side.INNER).parts[0].body
    for u, v, left, right in body.edges[::7].tolist():
        assert {u, v} <= set(body.triangles[left].tolist()) & set(body.triangles[right].tolist())
