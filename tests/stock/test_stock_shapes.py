"""Raw stock as a value: lines through it, distances, meshes around and inside of it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vmachining.errors import StockError
from vmachining.stock import BoxStock, CylinderStock, MeshStock, closed_mesh

BOX = BoxStock((-3, -2, -5), (4, 6, 1))
BAR = CylinderStock((1, 2), 5, (-3, 4))


def volume(mesh):
    a, b, c = mesh.vertices[mesh.triangles].transpose(1, 0, 2)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


@pytest.mark.parametrize("chord", [0.5, 0.01])
def test_meshes_around_and_inside_of_a_cylinder(chord):
    around, inside = BAR.mesh(chord)
    exact = math.pi * 25 * 7
    assert volume(inside) < exact < volume(around)
    r_out, r_in = (np.hypot(*(m.vertices[:, :2] - BAR.center).T) for m in (around, inside))
    apothem = 5.0 * math.cos(2 * math.pi / len(inside.vertices))  # len / 2 corners
    assert r_out.max() - apothem <= chord and r_in.max() == pytest.approx(5.0)
    # Huygens: fourth order in the step, which is below (2 sqrt(2 sag / r))
    step = 4 * math.pi / len(around.vertices)
    assert (volume(around) + 2 * volume(inside)) / 3 == pytest.approx(exact, rel=step**4)


@pytest.mark.parametrize("stock", [BOX, BAR], ids=["box", "cylinder"])
def test_crossings_are_where_the_distance_changes_its_sign(stock):
    lo, hi = stock.bounds
    places = np.random.default_rng(2).uniform(lo[:2] - 1, hi[:2] + 1, (500, 2))
    rays = stock.crossings(places)
    assert set(rays.counts.tolist()) == {0, 1}
    inside = places[rays.counts == 1]
    for heights in (rays.enter, rays.leave):
        assert np.abs(stock.signed_distance(np.column_stack([inside, heights]))).max() < 1e-12
    middle = np.column_stack([places, np.full(len(places), lo[2:] / 2 + hi[2:] / 2)])
    assert ((stock.signed_distance(middle) < 0) == (rays.counts == 1)).all()


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=20, deadline=None)
def test_lines_through_a_mesh_meet_what_the_solids_say(seed):
    """Two boxes, one on top of the other and turned, and a third apart above: touching ends are joined."""
    rng = np.random.default_rng(seed)
    parts = [BoxStock((0, 0, 0), (4, 4, 1)), BoxStock((1, 1, 1), (3, 3, 2)), BoxStock((0, 0, 3), (4, 4, 4))]
    meshes = [part.mesh(0.1)[0] for part in parts]
    stock = MeshStock(
        np.concatenate([m.vertices for m in meshes]),
        np.concatenate([m.triangles + 8 * k for k, m in enumerate(meshes)]),
    )
    places = np.concatenate([rng.uniform(-0.5, 4.5, (40, 2)), rng.integers(-1, 6, (40, 2)).astype(float)])
    rays = stock.crossings(places)
    edge = np.isin(places, (0.0, 1.0, 3.0, 4.0)).any(axis=1)  # there either answer is right
    inside = ((places > 0) & (places < 4)).all(axis=1)
    assert (rays.counts[~edge] == np.where(inside, 2, 0)[~edge]).all()
    assert len(rays.enter) == len(rays.leave) == rays.counts.sum()
    tall = ((places > 1) & (places < 3)).all(axis=1)
    assert rays.lengths[~edge] == pytest.approx(np.where(inside, np.where(tall, 3.0, 2.0), 0.0)[~edge])


def test_lines_through_the_corners_of_a_mesh_close():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.3, 0.3, 0.3 + 1e-13]])
    mesh = MeshStock(points[:4], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    rays = mesh.crossings(points[:, :2])
    assert len(rays.enter) == len(rays.leave) == rays.counts.sum() and (rays.leave >= rays.enter).all()
    assert rays.counts[4] == 1 and rays.lengths[4] == pytest.approx(0.4)


def test_a_mesh_that_is_open_is_refused():
    cube, _ = BOX.mesh(0.1)
    assert closed_mesh(*cube).bounds == pytest.approx(BOX.bounds)
    with pytest.raises(StockError, match="open: 3 edges"):
        closed_mesh(cube.vertices, cube.triangles[1:])
    with pytest.raises(StockError, match="encloses no volume"):
        closed_mesh(cube.vertices, cube.triangles[:, ::-1])
