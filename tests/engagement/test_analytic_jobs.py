"""`engage --method analytic` beside the exact distances, and the height map of a job that has run."""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh
from tinyjob import JOB, write_job

import vmachining as vm
from vmachining.cli.main import run
from vmachining.engagement.analytic import Corner, engaged, heights_of
from vmachining.engines.mesh import StockMesh
from vmachining.engines.mesh.facets import Side
from vmachining.errors import InputError, ToolError
from vmachining.job import Scene, height_map
from vmachining.stock import BoxStock, CylinderStock, MeshStock

SLOT, PLUNGE, ARC, LINE = 2, 5, 6, 7


def load(folder, **change):
    return vm.Job.load(write_job(folder, **change))


def test_a_slot_in_a_box_is_exact(tmp_path):
    """Walls of the box lie on the cells, so nothing is approximated."""
    scene = Scene.of(load(tmp_path))
    for at in (0.2, 0.5, 0.7):
        exact, found = (vm.engage(scene, SLOT, at=at, method=m, pitch=0.5) for m in ("dexel", "analytic"))
        assert found.arcs == pytest.approx(exact.arcs, abs=2e-9)
        assert found.lengths == pytest.approx(
            exact.lengths,
            abs=3e-9,  # distances count 1e-9 of a touch as inside
        )
        assert found.removal_per_mm == pytest.approx(exact.removal_per_mm, rel=1e-8)
        assert found.notes == ("the workpiece is known by its heights over cells of 0.5 mm",)
    assert set(found.table().drop_nulls("upper_by")["upper_by"]) == {"stock"}


@pytest.mark.parametrize(("block", "at"), [(PLUNGE, 0.95), (ARC, 0.6), (LINE, 0.6)])
def test_walls_of_earlier_cuts_are_within_half_a_cell(tmp_path, block, at):
    scene = Scene.of(load(tmp_path))
    pitch = 0.02
    exact = vm.engage(scene, block, at=at, bottom=True)
    found = vm.engage(scene, block, at=at, bottom=True, method="analytic", pitch=pitch)
    # round walls of cells: an end of an arc moves by at most a diagonal of a cell over the slope of rim against wall
    assert abs(found.lengths - exact.lengths).mean() < 0.02 * exact.lengths.max()
    assert found.removal_per_mm == pytest.approx(exact.removal_per_mm, rel=0.02)
    coarse = vm.engage(scene, block, at=at, bottom=True, method="analytic", pitch=10 * pitch)
    assert coarse.removal_per_mm == pytest.approx(exact.removal_per_mm, rel=0.2)


def test_other_cutters_are_refused(tmp_path):
    job = load(tmp_path, swap={'type = "flat"': 'type = "taper"\ntaper_deg = 5'})
    with pytest.raises(ToolError, match="flat, bull and ball cutters only; take dexel or brep"):
        vm.engage(job, SLOT, method="analytic")


def test_the_command_says_how_the_workpiece_is_known(tmp_path, capsys):
    job = write_job(tmp_path)
    assert run(["engage", str(job), "--block", "2", "--method", "analytic", "--pitch", "0.25", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["method"] == "analytic" and "cells of 0.25 mm" in record["notes"][0]


def test_the_height_map_of_a_job_holds_what_is_left(tmp_path):
    job = load(tmp_path)
    after = height_map(job, pitch=0.05)
    slot = height_map(job, pitch=0.05, after=SLOT)
    cell = np.outer(np.diff(slot.x), np.diff(slot.y))
    assert 4 * 180 - (cell * (slot.top + 4)).sum() == pytest.approx(40.0, rel=1e-9)  # the slot, 4 x 1 x 10
    removed = vm.run(job).summary["removed_mm3"]
    assert 4 * 180 - (cell * (after.top + 4)).sum() == pytest.approx(removed, rel=0.01)
    assert after.floor == -4 and after.x[[0, -1]] == pytest.approx([0, 10])
    part = height_map(job, pitch=0.5, region=((2, 3), (4, 5)))
    assert part.top == pytest.approx(np.full((4, 4), -1.0))
    with pytest.raises(InputError, match="does not meet the stock"):
        height_map(job, pitch=0.5, region=((50, 3), (60, 5)))
    with pytest.raises(InputError, match="pitch of 0 mm"):
        height_map(job, pitch=0.0)


def test_a_semi_finish_of_a_roughed_part(tmp_path):
    """After the slot at z -1, a bull nose crosses it at z -0.5: engaged on the walls beside the slot only."""
    stock = height_map(load(tmp_path), pitch=0.5, after=SLOT)
    found = engaged(Corner(1, 1), stock, (5, 4, -0.5), np.eye(3), np.radians([0.0, 45, 90, 180]), (0, 1, 0))
    # ahead is +y: phi 0; the wall of the slot at y = 6 is where the tool reaches exactly
    assert not found.cut_length.any()
    found = engaged(Corner(1, 1), stock, (5, 4.5, -0.5), np.eye(3), np.radians([0.0]), (0, 1, 0))
    # wall y = 6 cuts off rho >= 1.5 of the corner: sin lam = 0.5, up to the top z = 0, 0.5 above the tip
    assert (found.lower[0, 0, 0], found.upper[0, 0, 0]) == pytest.approx((np.pi / 6, np.pi / 3), abs=1e-12)


def test_heights_of_stocks_of_three_kinds():
    bar = CylinderStock((1.0, 2.0), 5.0, (-3.0, 4.0))
    mesh = StockMesh.of(bar, 0.001).solids[Side.INNER].to_mesh64()
    facets = MeshStock(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts, dtype=np.int64))
    one, two = (heights_of(s, [], 0.5, np.array([[-3.0, -2, -9], [5, 6, 9]])) for s in (bar, facets))
    assert (np.isfinite(one.top) == np.isfinite(two.top)).all() and one.top[8, 8] == two.top[8, 8] == 4.0
    assert heights_of(BoxStock((0, 0, 0), (1, 1, 1)), [], 0.5, np.array([[5.0, 5, 5], [6, 6, 6]])) is None


def test_heights_of_triangles_lie_a_sagitta_below_the_sphere_at_most():
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=5.0)
    found = heights_of(MeshStock(mesh.vertices, mesh.faces), [], 0.19)
    x, y = (0.5 * (v[1:] + v[:-1]) for v in (found.x, found.y))
    aside = np.hypot(x[:, None], y)
    assert np.isneginf(found.top[aside > 5.0]).all()
    well = aside < 4.5
    below = np.sqrt(25.0 - aside[well] ** 2) - found.top[well]
    edge = mesh.edges_unique_length.max()
    # a facet of sides e lies within e^2 / (6 R) of the sphere along its normal, whose z is above 0.4 here
    assert (below >= -1e-12).all() and below.max() <= edge**2 / (6 * 5.0) / 0.4 and well.sum() > 1000


def test_tiny_job_is_what_the_numbers_assume():
    assert "min = [0, 0, -4], max = [10, 18, 0]" in JOB
