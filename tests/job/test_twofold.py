"""Files of workpieces: every edge has two triangles for who joins equal corners, and nothing else has changed."""

import json
import zipfile
from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from manifold3d import Manifold
from tinyjob import PROGRAM, write_job

from vmachining.job import Job, run
from vmachining.job.twofold import twofold
from vmachining.stock.shapes import Triangles

CUBE = Manifold.cube((1, 1, 1))
PASSES = (
    "T1 M6\nS8000 M3\nG0 X-4 Y4 Z5\nZ-1\nG1 X14 F600\nG0 Z5\nX-4 Y8\nZ-1\nG1 X14\nG0 Z5\nX-4 Y12\nG0 Z-2\nG1 X14\n"
    "G0 Z5\nX2 Y-4\nZ-3\nG1 Y22\nG0 Z5\nX6\nY-4\nZ-4\nG1 Y22\nG0 Z9\nM30\n"
)
"""Level passes side by side and across, whose walls and floors meet along lines."""


def single(points):
    return points.astype(np.float32).astype(np.float64)


def as_a_reader_has_it(points, triangles):
    """Corner by corner, as an STL file holds them; trimesh then joins equal ones."""
    corners = single(points)[triangles].reshape(-1, 3)
    return trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3))


def read_3mf(path):
    """Its one object; trimesh itself needs another package for the format."""
    with zipfile.ZipFile(path) as package:
        mesh = ElementTree.fromstring(package.read("3D/3dmodel.model"))
    points, faces = (
        [[kind(one.get(key)) for key in keys] for one in mesh.iter() if one.tag.endswith(tag)]
        for tag, keys, kind in (("}vertex", "xyz", float), ("}triangle", ("v1", "v2", "v3"), int))
    )
    return trimesh.Trimesh(points, faces)


def arrays(solid):
    mesh = solid.to_mesh64()
    return np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts).astype(np.int64)


@pytest.mark.parametrize("place", [(0, 0, 0), (1e4 + 0.1, 3, 0.2)])
@settings(deadline=None, max_examples=25)
@given(st.lists(st.tuples(*[st.integers(0, 3)] * 3), min_size=2, max_size=30))
def test_heaps_of_cubes_that_touch_along_edges(place, cells):
    solid = sum((CUBE.translate(tuple(map(float, cell))) for cell in cells), Manifold()).translate(place)
    points, triangles, _ = twofold(*arrays(solid), single, 2.0**-24)
    shape = as_a_reader_has_it(points, triangles)
    assert shape.is_watertight and shape.is_winding_consistent
    # each coordinate is within half a unit in the last place, and a new point within four of its edge
    assert shape.volume == pytest.approx(
        len(set(cells)), abs=6 * len(set(cells)) * 5 * max(1e-6, 1e4 * 2**-24 * (place[0] > 0))
    )


def test_two_cubes_at_an_edge_were_no_solid_before():
    both = arrays(CUBE + CUBE.translate((1, 1, 0)))
    assert not as_a_reader_has_it(*both).is_watertight
    points, triangles, _ = twofold(*both, single, 2.0**-24)
    assert as_a_reader_has_it(points, triangles).is_watertight and len(triangles) == len(both[1]) + 2


@pytest.mark.parametrize("suffix", ["stl", "3mf", "glb"])
@pytest.mark.parametrize("program", [PROGRAM, PASSES], ids=["tiny", "passes"])
def test_a_finished_workpiece_is_watertight_and_its_volume_is_told(program, suffix, tmp_path):
    result = run(Job.load(write_job(tmp_path, program=program)), engine="mesh")
    result.write(tmp_path / "o", stock=(suffix,), report=False)
    file = tmp_path / f"o/stock.{suffix}"
    part = read_3mf(file) if suffix == "3mf" else trimesh.load_mesh(file)
    if suffix == "glb":  # the reader applies the node: metres, y upright; a corner of every face is its own
        head = json.loads(file.read_bytes()[20:].split(b"BIN\0")[0][:-4])
        assert [a["count"] for a in head["accessors"]] == [3 * len(part.faces)] * 2
        part.merge_vertices(merge_tex=True, merge_norm=True, digits_vertex=9)
        part.apply_scale(1e3)
        # as in the job: 10 wide, 18 deep, 4 high, its top at z = 0
        assert np.allclose(part.bounds, [[0, -4, -18], [10, 0, 0]], atol=1e-5)
    assert part.is_watertight
    told = result.summary["stock_files_mm3"][f"stock.{suffix}"]
    assert told == pytest.approx(part.volume, rel=1e-6)
    assert result.summary["final_lo_mm3"] - 1e-3 <= told <= result.summary["final_hi_mm3"] + 1e-3


def test_what_a_round_bar_and_far_coordinates_do_to_the_file_is_told(tmp_path):
    """The polygon in the bar has less than the bar; at 1e4 mm its 32 bits lose or add some."""
    far = PROGRAM.replace("X-4 Y4", "X9996 Y4").replace("X14", "X10014").replace("X3 Y12", "X10003 Y12")
    far = far.replace("X7 Y12", "X10007 Y12")
    box = "box = { min = [0, 0, -4], max = [10, 18, 0] }"
    bar = "cylinder = { center = [10005, 9], radius = 9, z = [-4, 0] }"
    result = run(Job.load(write_job(tmp_path, program=far, swap={box: bar})))
    result.write(tmp_path / "o", stock=("stl", "3mf"))
    s = result.summary
    held, page = s["stock_files_mm3"], (tmp_path / "o/report.html").read_text(encoding="utf-8")
    exact = np.pi * 81 * 4
    cell = (
        np.sqrt(2.0) * 4.0 / 2 / 20
    )  # a twentieth of the radius, its diagonal: walls are chords of it, at the bar and in the cut
    sag = cell**2 / 8 * 4 * (2 * np.pi + 2 * np.pi)
    assert s["removed_lo_mm3"] - sag <= exact - held["stock.3mf"] <= s["removed_hi_mm3"] + sag
    assert held["stock.3mf"] == pytest.approx(s["stock_mesh_mm3"], abs=1e-4)
    # what is told of the STL is what is in it: its corners, added in double precision about the middle of the bar
    facets = np.fromfile(
        tmp_path / "o/stock.stl", dtype=[("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")], offset=84
    )
    a, b, c = (facets["c"].astype(np.float64) - [10005.0, 9.0, -2.0]).transpose(1, 0, 2)
    in_file = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0
    # both sums round each triangle's share, of a box of 18 x 18 x 4 at most, to 2^-53
    rounding = len(facets) * 18 * 18 * 4 * 2.0**-53
    assert abs(held["stock.stl"] - in_file) <= rounding
    # and that is not the volume of the mesh, for x is rounded to 2^-10 mm: the difference is not a rounding of the sums
    assert abs(held["stock.stl"] - s["stock_mesh_mm3"]) > 100 * rounding
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    assert np.abs(facets["n"] - normal / np.maximum(size, 1e-300)).max() <= 2.0**-22
    assert "stock.stl holds" in page and "rounding of its coordinates" in page


def test_an_open_surface_stays_as_it_is():
    points, triangles = arrays(CUBE)
    open_ = Triangles(points, triangles[1:])
    assert len(twofold(*open_, single, 2.0**-24)[1]) == len(triangles) - 1
