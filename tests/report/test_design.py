"""How far the part is from the design, on the page: two slots of known depth in a block."""

from __future__ import annotations

import numpy as np
import pytest

import vmachining as vm
from vmachining.report import write_report
from vmachining.report.design import deviation_of, worst_places
from vmachining.report.thin import thin_mesh

DEEP, SHALLOW = 3.0, 1.5
PROGRAM = f"""G21 G90
T1 M6
S1000 M3
G0 X-10 Y12 Z5
G1 Z-{DEEP} F200
X70
G0 Z5
X-10 Y38
G1 Z-{SHALLOW}
X70
G0 Z50
M30
"""


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """A block of 60 x 50 x 20; the design is 2 mm lower: a slot of 3 mm is 1 mm too deep, one of 1.5 mm leaves 0.5 mm."""
    folder = tmp_path_factory.mktemp("design")
    (folder / "part.nc").write_text(PROGRAM)
    vm.Workpiece(vm.Box((0, 0, -20), (60, 50, -2)), engine="mesh").surface().export(folder / "design.stl")
    job = vm.Job(
        program="part.nc", tools=[vm.FlatEnd(diameter=8, length=30)], stock=vm.Box((0, 0, -20), (60, 50, 0)),
        design={"stl": "design.stl", "tolerance_mm": 0.1}, folder=folder,
    )  # fmt: skip
    return vm.run(job, contact="none")


def test_the_worst_places_are_the_floors_of_the_slots(result):
    surface = result.surface
    mesh = thin_mesh(surface.vertices, surface.triangles, surface.block)
    deviation = deviation_of(result, mesh)
    assert deviation is not None and deviation.tolerance == 0.1
    floor = np.abs(mesh.vertices[:, 2] + DEEP) < 1e-6
    inner = floor & (
        np.abs(mesh.vertices[:, 0] - 30) < 20
    )  # nearer to the top of the design than to its ends
    np.testing.assert_allclose(
        deviation.distance[inner], 2.0 - DEEP, atol=1e-5
    )  # atol: single precision of STL
    rows = worst_places(mesh, deviation)
    over = [row for row in rows if row[0] == "too much is taken"]
    left = [row for row in rows if row[0] == "material is left"]
    assert float(over[0][1]) == pytest.approx(DEEP - 2.0, abs=1e-3) and float(over[0][4]) == -DEEP
    assert {row[5] for row in over} == {str(block_to(result, 70, 12))}
    # the walls of both slots reach up to the raw face, 2 mm above the design
    assert float(left[0][1]) == pytest.approx(2.0, abs=1e-3)


def block_to(result, x, y):
    rows = result.blocks
    return int(rows["block"][int(np.argmin(np.hypot(rows["x_mm"] - x, rows["y_mm"] - y)))])


def test_the_page_lists_them(result, tmp_path):
    write_report(result, tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    assert "Where the part differs most from the design" in page and "too much is taken" in page
