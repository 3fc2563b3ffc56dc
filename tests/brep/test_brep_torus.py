"""A closed torus of triangles is a solid like any other, also with corners that a file rounded to 32 bits."""

import numpy as np
import pytest
import trimesh
from tinyjob import write_job

from vmachining.engines import brep
from vmachining.engines.brep.occt.polyhedron import polyhedron
from vmachining.engines.brep.occt.validity import inspect
from vmachining.errors import EngineError
from vmachining.job import Job, engage

PROGRAM = "T1 M6\nS1000 M3\nG0 X-4 Y4 Z5\nZ-1\nG1 X14 F600\nX20\nM30\n"


def torus(path):
    """Its middle lies between the lattice points of 32 bits, so that no quadrangle stays plane."""
    shape = trimesh.creation.torus(major_radius=10, minor_radius=3, major_sections=12, minor_sections=6)
    shape.apply_translation([5, 5, 0])
    shape.export(path)
    return trimesh.load_mesh(path)


def test_the_solid_has_the_volume_of_its_triangles(tmp_path):
    shape = torus(tmp_path / "t.stl")
    found = inspect(polyhedron(shape.triangles.reshape(-1, 9)))
    assert found.valid and found.closed
    assert found.volume == pytest.approx(shape.volume, rel=1e-9)


def test_engagement_in_it_agrees_with_distances(tmp_path):
    box = "box = { min = [0, 0, -4], max = [10, 18, 0] }"
    job = write_job(tmp_path, program=PROGRAM, swap={box: 'stl = "t.stl"'})
    torus(tmp_path / "t.stl")
    ours, theirs = (
        engage(Job.load(job), 2, at=0.95, method=m, angles=24, phase=0.5) for m in ("brep", "dexel")
    )
    assert not ours.is_air and np.abs(ours.lengths - theirs.lengths).max() < 1e-4


def test_an_error_of_the_worker_names_its_engine_once():
    """Three triangles of a tetrahedron: open."""
    corners = np.array([[0, 0, 0], [0, 1, 0], [1, 0, 0], [0, 0, 1]], dtype=float)
    faces = [[0, 1, 2], [0, 3, 1], [0, 2, 3]]
    with pytest.raises(EngineError) as caught:
        brep.isolated(polyhedron, corners[faces].reshape(-1, 9).tolist(), seconds=60.0)
    assert str(caught.value).count("brep engine") == 1
