"""`toolpath drop` and `toolpath surface` as users call them."""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh

import vmachining as vm
from vmachining.cli.main import run


@pytest.fixture
def block(tmp_path):
    """A block 20 x 10 x 6 mm with its bottom at z = 0."""
    solid = trimesh.creation.box((20, 10, 6)).apply_translation((10, 5, 3))
    path = tmp_path / "block.stl"
    path.write_bytes(solid.export(file_type="stl"))
    return path


def test_drop_tells_what_is_touched(block, capsys):
    assert (
        run(["toolpath", "drop", str(block), "--points", "5,5;-2,5;40,5", "--tool", "ball:10", "--json"]) == 0
    )
    rows = json.loads(capsys.readouterr().out)["points"]
    assert rows[0]["z_mm"] == pytest.approx(6.0)
    assert rows[1]["z_mm"] == pytest.approx(6.0 - 5.0 + np.sqrt(5.0**2 - 2.0**2))
    assert rows[1]["contact"] == "edge" and rows[2]["z_mm"] is None and rows[2]["contact"] == "none"


@pytest.mark.parametrize("tool", [[], ["--tool", "none"]])
def test_drop_without_a_tool_is_heights(block, capsys, tool):
    call = ["toolpath", "drop", str(block), "--points", "5,5;40,5", *tool]
    assert run([*call, "--json"]) == 0
    assert [row["z_mm"] for row in json.loads(capsys.readouterr().out)["points"]] == [
        pytest.approx(6.0),
        None,
    ]
    assert run([*call, "--floor", "0"]) == 2
    assert "--floor limits a tool" in capsys.readouterr().err


@pytest.mark.parametrize("suffix", [".nc", ".csv", ".cls"])
def test_a_surface_becomes_a_job_that_runs(block, tmp_path, capsys, suffix):
    out = tmp_path / f"path{suffix}"
    call = ["toolpath", "surface", str(block), "--tool", "ball:6", "--step", "4", "--chord", "0.05"]
    assert run([*call, "--out", str(out)]) == 0
    job = vm.Job.load(out.with_suffix(".toml"))
    assert not [
        f for f in vm.read_program(out, dialect=job.keys.program.dialect).findings if f.severity != "I"
    ]
    assert job.tools


def test_five_axes_and_levels(block, tmp_path, capsys):
    call = ["toolpath", "surface", str(block), "--tool", "bull:6:1", "--chord", "0.05", "--json"]
    assert run([*call, "--step", "4", "--lead", "5", "--normals", "facet"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["axes"] == 5
    assert run([*call, "--levels", "3"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["axes"] == 3 and told["feed_length_mm"] > 2 * 60.0  # once around the block, twice


@pytest.mark.parametrize(
    ("words", "low", "high"),
    [
        ([], (0, 0, 0), (20, 10, 6)),
        (["--turn", "90,0,0"], (0, -6, 0), (20, 0, 10)),
        (["--turn", "90,0,0", "--to-origin"], (0, 0, 0), (20, 6, 10)),
        (["--turn", "90,0,90", "--move", "1,2,3"], (1, 2, 3), (7, 22, 13)),
        (["--turn", "0,0,45", "--to-origin", "--move", "0,0,-6"], (0, 0, -6), (30 / 2**0.5, 30 / 2**0.5, 0)),
    ],
)
def test_a_part_is_turned_put_to_the_origin_and_moved(block, capsys, words, low, high):
    """A block of 20 x 10 x 6 mm in closed form; its top is what the passes lie on."""
    assert run(["toolpath", "surface", str(block), "--tool", "ball:6", "--step", "4", *words, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert np.array(told["box_mm"]) == pytest.approx(np.array([low, high], dtype=float), abs=1e-9)
    assert told["feed_length_mm"] > 0.0


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (["--step", "1", "--move", "1,2"], "--move 1,2: three numbers"),
        (["--step", "1", "--turn", "1,2,inf"], "--turn 1,2,inf: three numbers"),
        (["--tool", "drill:6"], "not a cutter"),
        (["--lead", "5", "--sharp", "nan"], "'--sharp': nan"),
        (["--lead", "5", "--sharp", "-1"], "from 0 to 180"),
        (["--scallop", "-1"], "a number above 0"),
        (["--step", "1", "--scallop", "0.1"], "one of them"),
        (["--step", "1", "--out", "path.txt"], ".nc"),
        (["--waterline", "99"], "no waterline"),
        (["--step", "1", "--lead", "5", "--out", "five.nc"], "no tool axis"),
    ],
)
def test_bad_asks_are_told(block, capsys, change, word, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    call = ["toolpath", "surface", str(block), "--tool", "ball:6", *change]
    assert run(call) == 2
    assert word in capsys.readouterr().err


def test_a_facet_that_is_turned_over_is_refused_with_its_edges(block, capsys):
    solid = trimesh.load(block)
    corners = solid.triangles.copy()
    corners[3] = corners[3][::-1]
    turned = trimesh.Trimesh(corners.reshape(-1, 3), np.arange(36).reshape(-1, 3), process=False)
    block.write_bytes(turned.export(file_type="stl"))
    assert run(["toolpath", "drop", str(block), "--points", "5,5"]) == 2
    said = capsys.readouterr().err
    assert "turned over" in said and said.count(" to (") == 3


def test_a_part_that_is_inside_out_is_refused(block, capsys):
    solid = trimesh.load(block)
    solid.invert()
    block.write_bytes(solid.export(file_type="stl"))
    assert run(["toolpath", "drop", str(block), "--points", "5,5"]) == 2
    assert "inside out" in capsys.readouterr().err


def test_a_step_file_is_triangulated(tmp_path, capsys):
    import cadquery as cq

    path = tmp_path / "bar.step"
    cq.exporters.export(cq.Workplane("YZ").circle(8).extrude(30), str(path))
    chord = 0.02
    call = [
        "toolpath",
        "drop",
        str(path),
        "--points",
        "15,0;15,4",
        "--tool",
        "ball:6",
        "--chord",
        str(chord),
        "--json",
    ]
    assert run(call) == 0
    rows = json.loads(capsys.readouterr().out)["points"]
    # facets lie inside the cylinder, by the chord at most
    for row, y in zip(rows, (0.0, 4.0), strict=True):
        exact = np.sqrt((8 + 3) ** 2 - y**2) - 3
        assert exact - 1.5 * chord <= row["z_mm"] <= exact + 1e-6


def test_distance_of_facets_from_their_solid(tmp_path, capsys):
    """Facets with corners on a sphere: middles of edges lie inside by R - |a + b| / 2, those of facets by R - |a + b + c| / 3."""
    cq = pytest.importorskip("cadquery")
    ball = trimesh.creation.icosphere(subdivisions=2, radius=10.0)
    facets, solid = tmp_path / "ball.stl", tmp_path / "ball.step"
    facets.write_bytes(ball.export(file_type="stl"))
    cq.exporters.export(cq.Workplane().sphere(10.0), str(solid))
    assert run(["toolpath", "distance", str(facets), str(solid), "--chord", "0.005", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    sagitta = 10.0 - np.linalg.norm(ball.triangles.mean(axis=1), axis=1).min()
    assert told["inside_mm"] == pytest.approx(sagitta, abs=told["known_to_mm"])
    assert told["outside_mm"] <= told["known_to_mm"] and not told["warnings"]
    assert run(["toolpath", "distance", str(facets), str(solid), "--chord", "0.05", "--scale", "25.4"]) == 0
    assert "--scale 25.4 for inches" in capsys.readouterr().err
    assert run(["toolpath", "distance", str(solid), str(facets)]) == 2
    assert "expected an .stl" in capsys.readouterr().err
