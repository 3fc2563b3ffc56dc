"""A closed mesh has two triangles at every edge, one each way; what is not must be noticed."""

import numpy as np
import pytest

from vmachining.engines.mesh._kernels import _twofold, roof

TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


def test_a_tetrahedron_is_closed():
    assert _twofold(TETRAHEDRON, 4)


@pytest.mark.parametrize(
    ("name", "triangles"),
    [
        ("open", TETRAHEDRON[:3]),
        ("one triangle turned", np.concatenate([TETRAHEDRON[:3], TETRAHEDRON[3:, ::-1]])),
        # a second tetrahedron 0, 1, 4, 5 on the edge 0-1: four triangles there
        ("four at an edge", np.concatenate([TETRAHEDRON, [[0, 4, 1], [0, 1, 5], [1, 4, 5], [4, 0, 5]]])),
    ],
)
def test_broken_meshes_are_noticed(name, triangles):
    assert not _twofold(triangles, 6), name


def test_the_roof_lies_over_the_solid_and_touches_it():
    """A wedge z = x / 2 over a square, its plane as two triangles, walls and floor left out: they are below."""
    points = np.array([[0, 0, 0], [4, 0, 2], [4, 4, 2], [0, 4, 0]], dtype=float)
    heights = np.empty((8, 8))
    roof(points, np.array([[0, 1, 2], [0, 2, 3]]), np.zeros(3), 0.5, heights)
    right_edge = 0.5 * np.arange(1, 9)
    assert (heights >= right_edge[:, None] / 2 - 1e-12).all()
    assert (heights <= right_edge[:, None] / 2 + 1e-6).all()
