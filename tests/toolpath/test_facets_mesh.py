"""STL files, indexed meshes, normals, CL points: samples of the specification (D.1, D.2, D.5, D.6), closed shapes, bad files."""

from __future__ import annotations

import struct

import numpy as np
import pytest
import trimesh

from vmachining.errors import InputError
from vmachining.toolpath.facets import FacetMesh, cl_points, edge_normal, read_stl, scallop_step

P = [(-23.517967, 37.264384), (-28.063816, 37.147100), (-32.328247, 36.763299), (-36.324177, 36.105235)]
SAMPLE = np.array(
    [
        [(0, *P[0]), (40, *P[1]), (40, *P[0])],
        [(0, *P[0]), (0, *P[1]), (40, *P[1])],
        [(0, *P[1]), (40, *P[2]), (40, *P[1])],
        [(0, *P[1]), (0, *P[2]), (40, *P[2])],
        [(0, *P[2]), (40, *P[3]), (40, *P[2])],
    ]
)
STORED = np.array(
    [(0, -0.025791834, 0.99966733)] * 2 + [(0, -0.08963807, 0.9959744)] * 2 + [(0, -0.16249497, 0.98670937)]
)


def text(facets=5, stop=None):
    words = ["solid"]
    for n, corners in zip(STORED[:facets], SAMPLE[:facets], strict=True):
        words += [f"  facet normal {n[0]:+.6e} {n[1]:.8e} {n[2]:.8e}", "    outer loop"]
        words += [f"      VERTEX {x:.6f} {y:.6f} {z:.6f}" for x, y, z in corners]
        words += ["    endloop", "  endfacet"]
    return "\n".join(words[:stop] if stop else [*words, "endsolid"]) + "\n"


def test_the_sample(tmp_path):
    (path := tmp_path / "a.stl").write_text(text())
    facets = read_stl(path)
    assert facets.corners == pytest.approx(SAMPLE, abs=1e-6) and not facets.notes
    mesh = FacetMesh.of(facets.corners)
    assert (len(mesh.vertices), len(mesh.edges), len(mesh.border), mesh.euler) == (7, 11, 7, 1)
    assert mesh.areas == pytest.approx([90.947235, 90.947235, 85.633346, 85.633346, 80.995073], abs=1e-5)
    assert mesh.normals[[0, 2, 4], 1:] == pytest.approx(
        np.array([(-0.02579166, 0.99966734), (-0.08963821, 0.99597439), (-0.16249482, 0.98670940)]), abs=1e-7
    )


def test_a_file_that_is_cut_off(tmp_path):
    lines = text().splitlines()
    end = next(
        k for k, line in enumerate(lines) if "endfacet" in line and lines[: k + 1].count("  endfacet") == 5
    )
    (path := tmp_path / "a.stl").write_text(
        "\n".join(lines[: end - 2]) + "\n"
    )  # in the middle of the 5th facet
    with pytest.raises(InputError, match="unexpected end of file in facet 5") as caught:
        read_stl(path)
    assert caught.value.line == end - 2
    assert len(read_stl(path, recover=True).corners) == 4
    path.write_text("\n".join(lines[: end - 1]) + "\n")  # its three corners are there
    assert len(read_stl(path, recover=True).corners) == 5


def test_binary_is_known_by_its_size(tmp_path):
    record = b"".join(struct.pack("<12fH", *n, *c.ravel(), 0) for n, c in zip(STORED, SAMPLE, strict=True))
    (path := tmp_path / "a.stl").write_bytes(b"solid like text".ljust(80) + struct.pack("<I", 5) + record)
    assert read_stl(path).corners == pytest.approx(SAMPLE, rel=1e-6)
    path.write_bytes(path.read_bytes()[:-7])
    with pytest.raises(InputError, match="334 bytes"):
        read_stl(path)
    bad = record[:12] + struct.pack("<f", float("nan")) + record[16:]
    path.write_bytes(b" " * 80 + struct.pack("<I", 5) + bad)
    with pytest.raises(InputError, match="facet 1 has a coordinate"):
        read_stl(path)
    path.write_bytes(b" " * 80 + struct.pack("<I", 0))
    with pytest.raises(InputError, match="empty"):
        read_stl(path)


@pytest.mark.parametrize(
    ("change", "words", "line"),
    [
        (("vertex", "vertx"), "expected 'vertex'", 4),
        (("36.763299", "36.7632x9"), "not a number", 19),
        (("endloop", "endlop"), "expected 'endloop'", 7),
    ],
)
def test_text_that_is_wrong(tmp_path, change, words, line):
    (path := tmp_path / "a.stl").write_text(text().lower().replace(*change, 1))
    with pytest.raises(InputError, match=words) as caught:
        read_stl(path)
    assert caught.value.line == line


def test_normals_that_do_not_fit_are_told(tmp_path):
    (path := tmp_path / "a.stl").write_text(text().replace("9.9966733", "-9.9966733", 1))
    assert "1 stored normals" in read_stl(path).notes[0] and "facet 1" in read_stl(path).notes[0]


def test_closed_shapes_and_what_is_wrong_with_others():
    box = trimesh.creation.box((2, 3, 4)).triangles
    good = FacetMesh.of(box)
    assert good.is_closed and good.euler == 2 and not good.notes
    assert np.nanmax(good.dihedral()) == pytest.approx(np.pi / 2)
    assert sorted(len(good.fan(v)) for v in range(8)) == sorted(np.bincount(good.triangles.ravel()).tolist())
    torus = FacetMesh.of(trimesh.creation.torus(5, 2).triangles)
    assert torus.is_closed and torus.euler == 0
    assert "2 facets without area" in FacetMesh.of([*box, box[0][[0, 0, 1]], box[0][[0, 1, 1]]]).notes[0]
    assert "1 duplicate facets" in FacetMesh.of([*box, box[3]]).notes[0]
    assert "open: 3 edges" in FacetMesh.of(box[1:]).notes[0]
    turned = box.copy()
    turned[4] = turned[4][::-1]
    assert "1 facets are turned over, first facet 5 with the edges" in FacetMesh.of(turned).notes[0]
    with pytest.raises(InputError, match="without area"):
        FacetMesh.of([[(0, 0, 0), (1, 1, 1), (2, 2, 2)]])


def test_fans_are_in_order():
    mesh = FacetMesh.of(trimesh.creation.icosphere(1, 1.0).triangles)
    fan = mesh.fan(3)
    for one, two in zip(fan, np.roll(fan, -1), strict=True):
        assert two in mesh.neighbours[one]


def test_normals_of_a_corner_and_of_an_edge():
    o, x, y, z = np.zeros(3), np.array([-1.0, 0, 0]), np.array([0, -1.0, 0]), np.array([0, 0, -1.0])
    corner = [(o, x, x + y), (o, x + y, y), (o, y, z), (o, z, x)]  # +z twice, +x, +y; all of area 1/2
    areas = [0.5 * np.linalg.norm(np.cross(b - a, c - a)) for a, b, c in corner]
    assert areas == pytest.approx([0.5] * 4)
    mesh = FacetMesh.of(np.array(corner))
    at = int(np.flatnonzero((mesh.vertices == 0).all(axis=1))[0])
    for weights in ("resultant", "area"):
        assert mesh.vertex_normals(weights)[at] == pytest.approx((0.408248, 0.408248, 0.816497), abs=1e-6)
    assert mesh.vertex_normals("angle")[at] == pytest.approx((3**-0.5,) * 3, abs=1e-12)
    one, two = (0, 0, 1), (0.6, 0, 0.8)
    assert edge_normal(one, two, 0.25) == pytest.approx((0.155963, 0, 0.987763), abs=1e-6)
    assert edge_normal(one, two, 0.5) == pytest.approx((0.316228, 0, 0.948683), abs=1e-6)
    with pytest.raises(InputError, match="cancel"):
        edge_normal(one, (0, 0, -1), 0.5)


@pytest.mark.parametrize(
    ("cc", "n", "f", "sizes", "lead", "tilt", "cl", "axis"),
    [
        ((0, 0, 0), (0, 0, 1), (1, 0, 0), (5, 1), 10, 0, (-4.112879, 0, 0.709785), (0.173648, 0, 0.984808)),
        ((0, 0, 0), (0, 0, 1), (1, 0, 0), (5, 5), 10, 0, (-0.868241, 0, 0.075961), (0.173648, 0, 0.984808)),
        ((0, 0, 0), (0, 0, 1), (1, 0, 0), (5, 0), 10, 0, (-4.924039, 0, 0.868241), (0.173648, 0, 0.984808)),
        ((0, 0, 0), (0, 0, 1), (1, 0, 0), (5, 1), 10, 5, (-3.691602, 1.824702, 0.793751), (0.173648, -0.085832, 0.981060)),
        ((10, 20, 5), (0, -0.6, 0.8), (1, 0, 0), (6, 1.5), 15, -10, (6.019529, 17.059721, 4.621040),
         (0.258819, -0.436566, 0.861640)),
        ((10, 20, 5), (0, -0.6, 0.8), (0, 0.8, 0.6), (8, 2), 3, 0, (10, 14.932787, 1.595536), (0, -0.557309, 0.830305)),
    ],
)  # fmt: skip
def test_cl_points_of_the_specification(cc, n, f, sizes, lead, tilt, cl, axis):
    found = cl_points([cc], [n], [f], *sizes, lead_deg=lead, tilt_deg=tilt)
    assert found.cl[0] == pytest.approx(cl, abs=2e-6) and found.axis[0] == pytest.approx(axis, abs=1e-6)


def test_cl_points_that_cannot_be():
    with pytest.raises(InputError, match="below the surface"):
        cl_points([(0, 0, 0)], [(0, 0, -1)], [(1, 0, 0)], 5, 1, axis=(0, 0, 1))
    with pytest.raises(InputError, match="along the normal"):
        cl_points([(0, 0, 0)], [(0, 0, 1)], [(0, 0, 1)], 5, 1)
    standing = cl_points([(1, 2, 3)], [(0, 0, 1)], [(1, 0, 0)], 5, 1)
    assert standing.cl[0] == pytest.approx((1, 2, 3))


def test_scallops_of_plane_and_cylinder():
    ball, h = 5.0, 0.01
    assert scallop_step(h, ball) == pytest.approx(2 * np.sqrt(2 * ball * h - h * h), abs=1e-12)
    for rho in (40.0, -40.0):
        step = float(scallop_step(h, ball, 1 / rho))
        # two balls on the circle, `step` apart along it: their intersection lies h off the circle
        centre = rho + ball
        half = step / (2 * abs(rho))
        near = centre * np.cos(half) - np.sqrt(ball**2 - (centre * np.sin(half)) ** 2)
        assert near - rho == pytest.approx(h, abs=1e-9)
        assert step == pytest.approx(np.sqrt(8 * h * ball * rho / (rho + ball)), rel=2e-3)
