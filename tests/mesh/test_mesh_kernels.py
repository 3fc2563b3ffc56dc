"""A closed mesh has two triangles at every edge, one each way; what is not must be noticed."""

from collections import Counter
from itertools import combinations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from vmachining.engines.mesh._kernels import _closed
from vmachining.engines.mesh.facets import Side
from vmachining.engines.mesh.solids import pieces
from vmachining.engines.mesh.straight import facets
from vmachining.engines.mesh.window._kernels import roof
from vmachining.geometry import Line
from vmachining.sweep import Sweep
from vmachining.tool import BallNose, BullNose, Taper

TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, -1], [0.3, 0.3, 0.3]], dtype=float)


def ways(triangles):
    """How often every edge is run along, by direction."""
    return Counter((int(t[k]), int(t[k - 2])) for t in triangles for k in range(3))


def test_a_tetrahedron_is_closed():
    points, triangles, sound = _closed(TETRAHEDRON, CORNERS)
    assert sound and (triangles == TETRAHEDRON).all() and (points == CORNERS).all()


@pytest.mark.parametrize(
    ("name", "triangles"),
    [
        ("one triangle turned", np.concatenate([TETRAHEDRON[:3], TETRAHEDRON[3:, ::-1]])),
        # a second tetrahedron 0, 1, 4, 5 on the edge 0-1: four triangles there
        ("four at an edge", np.concatenate([TETRAHEDRON, [[0, 4, 1], [0, 1, 5], [1, 4, 5], [4, 0, 5]]])),
    ],
)
def test_broken_meshes_are_noticed(name, triangles):
    assert not _closed(triangles, CORNERS)[2], name


def test_whatever_is_left_of_a_hull_is_closed_by_a_cone():
    """Random parts of a convex mesh, some of which hang together by a point only."""
    rng = np.random.default_rng(3)
    cloud = rng.normal(size=(60, 3))
    body = ConvexHull(cloud / np.linalg.norm(cloud, axis=1)[:, None])
    outward = np.cross(*np.diff(body.points[body.simplices], axis=1).transpose(1, 0, 2))
    inward = np.einsum("ij,ij->i", outward, body.points[body.simplices[:, 0]]) < 0.0
    whole = np.where(inward[:, None], body.simplices[:, ::-1], body.simplices).astype(np.int64)
    points, pinched = np.concatenate([body.points, [[0.0, 0.0, 0.0]]]), 0
    for share in np.linspace(0.05, 1.0, 60):
        kept = whole[rng.random(len(whole)) < share]
        places, triangles, sound = _closed(kept.copy(), points)
        edges = ways(triangles)
        assert sound and all(edges[v, u] == n == 1 for (u, v), n in edges.items())
        pinched += len(places) > len(points)
        corners = places[triangles]
        volume = np.linalg.det(corners).sum() / 6.0
        assert volume == pytest.approx(np.linalg.det(points[kept]).sum() / 6.0, abs=1e-12)
    assert pinched > 10


def test_the_roof_lies_over_the_solid_and_touches_it():
    """A wedge z = x / 2 over a square. Its walls are as high as their edges, also where they end within a cell."""
    points = np.array([[0, 0, 0], [4, 0, 2], [4, 3.9, 2], [0, 3.9, 0], [0, 0, -9], [4, 0, -9]], dtype=float)
    slope, wall = [[0, 1, 2], [0, 2, 3]], [[4, 5, 1], [4, 1, 0]]
    right_edge = 0.5 * np.arange(1, 9)[:, None]
    for triangles in (slope, slope + wall):
        heights = np.empty((8, 8))
        roof(points, np.array(triangles), np.zeros(3), 0.5, heights)
        assert (heights >= right_edge / 2 - 1e-12).all()
        assert (heights <= right_edge / 2 + 1e-6).all()


def test_a_wall_without_a_roof_is_as_high_as_its_edges():
    """A triangle upright over a diagonal, against points of its edges."""
    corners, cell = np.array([[0.1, 0.23, 0.0], [3.7, 2.93, 1.0], [2.3, 1.88, 3.0]]), 0.5
    heights = np.empty((8, 6))
    roof(corners, np.array([[0, 1, 2]]), np.zeros(3), cell, heights)
    share = np.linspace(0.0, 1.0, 20_000)[:, None]
    points = np.concatenate([a + share * (b - a) for a, b in combinations(corners, 2)])
    i, j = (points[:, :2] // cell).astype(int).T
    assert (heights[i, j] >= points[:, 2]).all()
    highest = np.full(heights.shape, -np.inf)
    np.maximum.at(highest, (i, j), points[:, 2])
    met = np.isfinite(highest)
    assert (np.isfinite(heights) == met).all()
    assert (heights[met] <= highest[met] + 1e-3).all()


@pytest.mark.parametrize("side", list(Side))
@pytest.mark.parametrize("rise", [0.0, -0.4])
def test_the_mesh_of_a_straight_sweep_is_convex_whatever_its_heading(side: Side, rise: float) -> None:
    """Facets that lie along the motion once went with it or stayed as rounding had it, and the mesh folded."""
    rng = np.random.default_rng(8)
    for tool in (
        BullNose(diameter=8, corner_radius=1.5, length=30),
        BallNose(diameter=6, length=30),
        Taper(diameter=3, corner_radius=0.7, taper_deg=10, length=30),
    ):
        for angle in rng.uniform(0.0, 2.0 * np.pi, 12):
            start = rng.uniform(-20.0, 20.0, 3)
            sweep = Sweep.along(tool, Line(start, start + [np.cos(angle), np.sin(angle), rise]))
            (piece,) = pieces(sweep, facets(tool.cutter, 0.02, side), None)
            corners = piece.points[piece.triangles]
            normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            sizes = np.linalg.norm(normals, axis=1)
            flat = sizes > 1e-7  # mm^2; slivers have no direction
            normals = normals[flat] / sizes[flat, None]
            beyond = piece.points @ normals.T - np.einsum("ij,ij->i", corners[flat][:, 0], normals)
            assert beyond.max() < 1e-7
