"""Drop cutter: the specification's table, OpenCAMLib on triangles in generic position, brute force, exact tangency."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from vmachining.errors import InputError, ToolError
from vmachining.tool import BallNose, BullNose, FlatEnd, Taper
from vmachining.toolpath.facets import Contact, FacetMesh, Surface, height_field, radii

PLACES = [(3, 3), (-1, 5), (5, -1), (-1, -1), (0, 11), (7, 5), (12.5, 0)]
FLAT = ([2.5, 3.366025404, 0.5, 0.366025404, 5.0, 2.5, -np.inf], "FEFEVEN")
BALL = ([1.736067977, 2.436491673, -0.267949192, -0.585786438, 4.732050808, 1.5, -np.inf], "FEEVVEN")
BULL = ([2.309016994, 3.151238015, 0.309016994, 0.151238015, 5.0, 2.297517198, -np.inf], "FEFEVEN")
LETTER = {Contact.NONE: "N", Contact.VERTEX: "V", Contact.EDGE: "E", Contact.FACET: "F"}


def surface(*triangles):
    return Surface(FacetMesh.of(np.array(triangles, dtype=float)))


@pytest.mark.parametrize(("radius", "corner", "truth"), [(2, 0, FLAT), (2, 2, BALL), (2, 0.5, BULL)])
def test_table_of_the_specification(radius, corner, truth):
    found = surface([(0, 0, 0), (10, 0, 0), (0, 10, 5)]).drop(PLACES, radius, corner)
    assert found.z == pytest.approx(np.array(truth[0]), abs=1e-9)
    # a contact at the border of a facet is one with its edge as well
    same = {"F": "FE", "E": "FEV", "V": "EV", "N": "N"}
    assert all(LETTER[Contact(k)] in same[t] for k, t in zip(found.kind, truth[1], strict=True))


def test_exact_tangency_counts():
    found = surface([(1, -3, 2), (3, 0, 3), (-1, 3, 3)]).drop([(0, -1.5)], 3, 0)
    assert found.z[0] == pytest.approx(3.0, abs=1e-12)


def random_triangles(count, seed):
    rng = np.random.default_rng(seed)
    return rng.uniform(-10, 10, (count, 3, 3)), rng.uniform(-12, 12, (count, 2))


@pytest.mark.parametrize(
    "count", [1_000, pytest.param(10_000, marks=pytest.mark.long)]
)  # OpenCAMLib, one by one
@pytest.mark.parametrize(
    ("radius", "corner", "error"), [(4.0, 0.0, 1e-9), (4.0, 4.0, 1e-9), (4.0, 1.0, 1e-8), (3.0, 2.7, 1e-8)]
)
def test_opencamlib_agrees_on_triangles_in_generic_position(radius, corner, error, count):
    ocl = pytest.importorskip("opencamlib.ocl", reason="opencamlib is not installed")
    if corner == 0.0:
        cutter = ocl.CylCutter(2 * radius, 100.0)
    elif corner == radius:
        cutter = ocl.BallCutter(2 * radius, 100.0)
    else:
        cutter = ocl.BullCutter(2 * radius, corner, 100.0)
    corners, places = random_triangles(count, 11)
    theirs = np.empty(len(corners))
    for k, (triangle, (x, y)) in enumerate(zip(corners, places, strict=True)):
        point = ocl.CLPoint(x, y, -1000.0)
        cutter.dropCutter(point, ocl.Triangle(*(ocl.Point(*p) for p in triangle)))
        theirs[k] = point.z
    ours = np.array([surface(t).drop([p], radius, corner).z[0] for t, p in zip(corners, places, strict=True)])
    touched = theirs > -1000.0
    assert (touched == np.isfinite(ours)).all() and touched.sum() > count // 5
    assert np.abs(ours - theirs)[touched].max() <= error


@pytest.mark.parametrize(("radius", "corner"), [(3.0, 0.0), (3.0, 3.0), (3.0, 0.8)])
def test_a_part_against_every_sampled_point_of_it(radius, corner):
    mesh = trimesh.creation.icosphere(2, 8.0)
    part = Surface(FacetMesh.of(mesh.triangles))
    rng = np.random.default_rng(5)
    places = rng.uniform(-11, 11, (200, 2))
    # all points of all triangles on a grid of barycentric coordinates
    n = 40
    i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
    keep = i + j <= n
    weights = np.stack([i[keep], j[keep], n - i[keep] - j[keep]], axis=1) / n
    points = np.einsum("wk,mkx->mwx", weights, mesh.triangles).reshape(-1, 3)
    step = np.linalg.norm(mesh.triangles[:, 0] - mesh.triangles[:, 1], axis=1).max() / n
    found = part.drop(places, radius, corner)
    for place, z in zip(places, found.z, strict=True):
        rho = np.linalg.norm(points[:, :2] - place, axis=1)
        over = np.clip(rho - (radius - corner), 0.0, corner)
        tip = np.where(rho <= radius, points[:, 2] - corner + np.sqrt(corner**2 - over**2), -np.inf).max()
        assert tip <= z + 1e-9
        if np.isfinite(tip) and rho.min() < 0.5 * radius:  # well over the part: sampling misses little
            assert z - tip <= 6.0 * step


def test_many_triangles_are_as_each_alone():
    corners, _ = random_triangles(300, 2)
    places = np.random.default_rng(3).uniform(-14, 14, (150, 2))
    found = Surface(FacetMesh.of(corners)).drop(places, 2.5, 1.0)
    alone = np.max([surface(t).drop(places, 2.5, 1.0).z for t in corners], axis=0)
    assert found.z == pytest.approx(alone, abs=1e-9)
    for k in np.flatnonzero(found.touches)[:40]:
        one = surface(corners[found.triangle[k]]).drop(places[k : k + 1], 2.5, 1.0)
        assert one.z[0] == pytest.approx(found.z[k], abs=1e-9)


def test_heights_of_the_specification():
    part = surface([(2, 1, 4), (9, 3, 1), (4, 8, 6)])
    z, which = part.heights([(5, 4), (4.6, 3.2), (9, 9)])
    assert z == pytest.approx([11 / 3, 3.533333333, -np.inf], abs=1e-9) and which.tolist() == [0, 0, -1]
    assert part.mesh.normals[0] == pytest.approx([0.452679, -0.362143, 0.814822], abs=1e-6)
    assert part.mesh.areas[0] == pytest.approx(27.613403, abs=1e-6)


def test_a_wall_and_nothing():
    wall = surface([(0, 0, 0), (0, 10, 0), (0, 0, 7)])
    found = wall.drop([(1, 0), (1, 10), (3, 5), (-1, 5)], 2, 0)
    assert found.z == pytest.approx(
        [7.0, 7 * (1 - (10 - np.sqrt(3)) / 10), -np.inf, 7 * (0.5 + np.sqrt(3) / 10)]
    )
    assert found.kind[2] == Contact.NONE and found.triangle[2] == -1
    assert wall.drop([(3, 5)], 2, 0, floor=-4.0).z[0] == -4.0


def test_cutters():
    assert radii(FlatEnd(diameter=10, length=30)) == (5.0, 0.0)
    assert radii(BallNose(diameter=10, length=30)) == (5.0, 5.0)
    assert radii(BullNose(diameter=10, corner_radius=1, length=30)) == (5.0, 1.0)
    with pytest.raises(ToolError, match="flat, ball or bull"):
        radii(Taper(diameter=4, taper_deg=5, length=30))
    with pytest.raises(InputError, match="not a cutter"):
        surface([(0, 0, 0), (1, 0, 0), (0, 1, 0)]).drop([(0, 0)], 1.0, 2.0)


@pytest.mark.parametrize(("radius", "corner"), [(3.0, 0.0), (3.0, 3.0), (3.0, 1.0)])
def test_a_surface_lifts_a_tool_as_the_highest_of_its_triangles_does(radius, corner):
    """Edges in valleys are left out where a triangle has neighbours; alone it has none."""
    rng = np.random.default_rng(1)
    x, y = np.sort(rng.uniform(0, 12, (2, 7)))
    mesh = height_field(x, y, rng.uniform(-2, 2, (7, 7)), bottom=-9.0)
    places = rng.uniform(-2, 14, (300, 2))
    alone = [surface(triangle).drop(places, radius, corner).z for triangle in mesh.corners]
    assert Surface(mesh).drop(places, radius, corner).z == pytest.approx(np.max(alone, axis=0), abs=1e-9)
