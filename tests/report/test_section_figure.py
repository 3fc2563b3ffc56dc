"""UE and LE on a section of the workpiece, and the angle of LE, against closed forms on a plate."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest

from vmachining.cli.main import run as command
from vmachining.errors import InputError
from vmachining.job import Job
from vmachining.job.engage import Scene, engage
from vmachining.job.section import section_table
from vmachining.report.paper import draw_section, load_section

LEAD, TOP, R, RM = 15.0, 2.0, 5.0, 5.0
JOB = """name = "lead"
[program]
file = "lead.csv"
dialect = "poses"
[[tools]]
number = 1
type = "bull"
diameter_mm = 20
corner_radius_mm = 5
length_mm = 60
helix_deg = 30
[stock]
box = { min = [-20, -20, -10], max = [100, 20, 2] }
"""


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    """A bull nose that leans by its lead along x, its lowest point on z = 0, in a plate up to z = 2."""
    folder = tmp_path_factory.mktemp("lead")
    a = np.radians(LEAD)
    axis, ahead = np.array([np.sin(a), 0.0, np.cos(a)]), np.array([np.cos(a), 0.0, -np.sin(a)])
    tip = R * np.array([0.0, 0.0, 1.0]) - RM * ahead - R * axis
    rows = [
        ",".join(map(str, (*(tip + [x, 0, 0]), *axis, 1000, rapid, 1))) for x, rapid in ((0.0, 1), (60.0, 0))
    ]
    (folder / "lead.csv").write_text("x_mm,y_mm,z_mm,i,j,k,feed_mm_min,rapid,tool\n" + "\n".join(rows) + "\n")
    (folder / "job.toml").write_text(JOB)
    return folder / "job.toml"


@pytest.fixture(scope="module")
def table(job):
    scene = Scene.of(Job.load(job))
    block = scene.cuts[0][0]
    found = pl.concat([engage(scene, block, at=at, angles=72).table() for at in (0.4, 0.8)])
    with pytest.raises(InputError, match="nothing is engaged at this angle"):
        section_table(scene, found, 270.0)
    return section_table(scene, found, 90.0)


def part(table, name):
    return table.filter(pl.col("part") == name).select("u", "v", "w").to_numpy().T


def test_ue_lies_on_the_plate_and_le_on_its_plane(table):
    u, v, off = part(table, "along_ue")
    np.testing.assert_allclose(u, [0.0, 24.0], atol=1e-6)  # 0.4 of 60 mm apart
    np.testing.assert_allclose(v, TOP, atol=1e-8)
    np.testing.assert_allclose(off, 0.0, atol=1e-8)
    np.testing.assert_allclose(part(table, "along_le")[1], 0.0, atol=1e-6)
    _, z, w = part(table, "along")
    np.testing.assert_allclose(w, z - TOP, atol=1e-12)  # nothing was cut before


def test_the_angle_of_le_is_that_of_the_closed_form(table):
    """N . V = 0 on a corner that does not turn: tan = tan(lead) / sin(phi)."""
    phi, angle, lead = part(table, "lead_le")
    np.testing.assert_allclose(lead, LEAD, atol=1e-9)
    assert len(phi) > 40
    np.testing.assert_allclose(
        np.tan(np.radians(angle)), np.tan(np.radians(LEAD)) / np.sin(np.radians(phi)), rtol=1e-6
    )
    phi, angle, _ = part(table, "lead_form")
    front = (phi > 1.0) & (phi < 179.0)
    expected = np.degrees(np.arctan(np.tan(np.radians(LEAD)) / np.sin(np.radians(phi))))
    np.testing.assert_allclose(angle[front], expected[front], rtol=1e-9)
    assert np.isnan(angle[phi > 181.0]).all()  # a leaning tool clears what lies behind


def test_the_plane_through_the_axis_shows_the_leaning_plate(table):
    """Along the axis the plate is TOP cos(lead) above its foot and rises by tan(lead) with the distance ahead."""
    r, h, w = part(table, "across")
    a = np.radians(LEAD)
    tip_z = R - R * np.cos(a) + RM * np.sin(a)
    np.testing.assert_allclose(np.sign(w), np.sign(tip_z + h * np.cos(a) - r * np.sin(a) - TOP))
    ((x, y, _),) = (part(table, "across_ue").T).tolist()
    assert tip_z + y * np.cos(a) - x * np.sin(a) == pytest.approx(TOP, abs=1e-8)
    assert np.hypot(x - RM, y - R) == pytest.approx(R, abs=1e-9)
    figure = draw_section(table)
    assert [line.get_label() for line in figure.axes[0].lines] == ["UE", "LE"]


def test_the_command_writes_table_and_picture(job, tmp_path, capsys):
    words = [
        "engage",
        str(job),
        "--block",
        "all",
        "--angles",
        "24",
        "--section",
        "90",
        "--out",
        str(tmp_path),
    ]
    assert command(words) == 0
    assert {"section.parquet", "figure_section.png"} <= {path.name for path in tmp_path.iterdir()}
    assert len(part(load_section(tmp_path), "along_ue")[0]) == 1
    assert command([*words, "--edge", "helix"]) == 2
    assert "takes the straight edge" in capsys.readouterr().err
    with pytest.raises(InputError, match="no section"):
        load_section(tmp_path / "none")
