"""Clusters of facets: all of the cutter is in them, and what they leave out no tile can see."""

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


@pytest.mark.parametrize("tool", CUTTERS)
def test_every_facet_is_in_one_cluster_and_in_its_box(tool):
    body = facets(CUTTERS[tool].cutter, 0.01, Side.INNER).parts[0].body
    first, boxes = body.clusters
    assert (np.diff(first, axis=0) >= 0).all() and (first[0] == 0).all()
    assert first[-1].tolist() == [len(body.triangles), len(body.edges)]
    for low, high, (box_low, box_high) in zip(first[:-1], first[1:], boxes, strict=True):
        points = body.points[body.triangles[low[0] : high[0]]].reshape(-1, 3)
        assert (points.min(axis=0) == box_low).all() and (points.max(axis=0) == box_high).all()
        corners = set(body.triangles[low[0] : high[0]].ravel().tolist())
        assert set(body.edges[low[1] : high[1], :2].ravel().tolist()) <= corners
    # an edge lies between the two triangles that it names
    for u, v, left, right in body.edges[::7].tolist():
        assert {u, v} <= set(body.triangles[left].tolist()) & set(body.triangles[right].tolist())


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


def _sorted(rows):
    return rows[np.lexsort(rows.T)]


@pytest.mark.parametrize("tool", CUTTERS)
def test_what_clusters_leave_out_cannot_be_seen(tool):
    """Looking at every facet finds the same mesh."""
    part = facets(CUTTERS[tool].cutter, 0.01, Side.INNER).parts[0]
    body = part.body
    first, boxes = body.clusters
    everywhere = np.stack([np.full((len(boxes), 3), -1e3), np.full((len(boxes), 3), 1e3)], axis=1)
    shape = body.points, body.triangles, body.normals, body.edges
    rng = np.random.default_rng(5)
    compared = 0
    for cos, sin, start, step, lo, hi, heights, cell in _views(body, rng):
        apex = start + [0.0, 0.0, body.height[0] + 0.999 * (body.height[1] - body.height[0])]
        meshes = [
            _kernels.swept_facets(
                Cutter(*shape, first, around),
                Way(cos, sin, start, step),
                View(lo, hi, apex, lo, heights, cell),
                True,
                np.inf,
            )
            for around in (boxes, everywhere)
        ]
        found = [_sorted(points[triangles].reshape(-1, 9)) for points, triangles, _ in meshes]
        # a mesh is empty where a facet that was looked at has all of the window beyond its plane
        assert len(found[1]) == 0 or np.array_equal(*found)
        compared += len(found[1]) > 0
    assert compared > 3


@pytest.mark.parametrize("tool", CUTTERS)
def test_facets_left_out_take_nothing_below_the_roof(tool):
    """Columns as high as the roof lose the same to the facets that are seen as to all of them."""
    body = facets(CUTTERS[tool].cutter, 0.02, Side.INNER).parts[0].body
    shape, rng = (body.points, body.triangles, body.normals, body.edges), np.random.default_rng(9)
    left_out = taken = 0
    for cos, sin, start, step, lo, hi, heights, cell in _views(body, rng):
        apex = start + [0.0, 0.0, body.height[0] + 0.999 * (body.height[1] - body.height[0])]
        view = Way(cos, sin, start, step), View(lo, hi, apex, lo, heights, cell)
        some, whole = (
            _kernels.swept_facets(Cutter(*shape, *body.clusters), *view, cull, np.inf)
            for cull in (True, False)
        )
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
