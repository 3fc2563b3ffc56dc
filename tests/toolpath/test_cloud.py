"""Clouds of points as parts: a plane at any place, tables that other commands write, what is no surface."""

from __future__ import annotations

import json

import numpy as np
import pytest

from vmachining.cli.main import run as command
from vmachining.errors import InputError
from vmachining.toolpath.facets import Surface, height_field, read_cloud


def plane(at: np.ndarray) -> np.ndarray:
    return 1.0 + 0.3 * at[..., 0] - 0.2 * at[..., 1]


def written(file, points) -> str:
    file.write_text(
        "x_mm;y_mm;z_mm\n" + "\n".join(";".join(f"{v!r}" for v in row) for row in points.tolist())
    )
    return str(file)


def test_a_plane_is_known_between_its_points(tmp_path):
    rng = np.random.default_rng(4)
    at = rng.uniform(-10.0, 10.0, (400, 2))
    mesh = read_cloud_of(tmp_path, np.column_stack([at, plane(at)]))
    assert (mesh.normals[:, 2] > 0.0).all() and "400 points" in mesh.notes[0]
    asked = rng.uniform(-6.0, 6.0, (200, 2))
    z, which = Surface(mesh).heights(asked)
    assert (which >= 0).all()
    np.testing.assert_allclose(z, plane(asked), atol=1e-9)


def read_cloud_of(tmp_path, points):
    file = tmp_path / "cloud.csv"
    written(file, points)
    return read_cloud(file)


def test_heights_that_drop_writes_are_a_part_again(tmp_path, capsys):
    x = np.linspace(0.0, 20.0, 11)
    grid = np.stack(np.meshgrid(x, x, indexing="ij"), axis=-1)
    z = 3.0 * np.sin(0.3 * grid[..., 0]) * np.cos(0.2 * grid[..., 1])
    mesh = height_field(x, x, z)
    cloud = written(tmp_path / "cloud.csv", mesh.vertices)
    assert command(["toolpath", "drop", cloud, "--points", "grid:2"]) == 0
    table = capsys.readouterr().out
    again = tmp_path / "again.csv"
    again.write_text(table)
    assert command(["toolpath", "drop", str(again), "--points", "grid:2", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["points"]
    np.testing.assert_allclose([row["z_mm"] for row in rows], z.ravel(), atol=1e-8)


def test_a_path_over_a_cloud(tmp_path, capsys):
    x = np.linspace(0.0, 20.0, 9)
    at = np.stack(np.meshgrid(x, x, indexing="ij"), axis=-1).reshape(-1, 2)
    cloud = written(tmp_path / "cloud.csv", np.column_stack([at, plane(at)]))
    out = tmp_path / "path.csv"
    assert command(["toolpath", "surface", cloud, "--tool", "ball:6", "--step", "4", "--out", str(out)]) == 0
    capsys.readouterr()
    rows = np.genfromtxt(out, delimiter=",", names=True)
    tips = np.column_stack([rows["x_mm"], rows["y_mm"], rows["z_mm"]])[rows["rapid"] == 0]
    inside = tips[((tips[:, :2] > 2.0) & (tips[:, :2] < 18.0)).all(axis=1)]
    # a ball on a plane of normal n: R / n_z above it with its centre
    rise = 3.0 * np.sqrt(1.0 + 0.3**2 + 0.2**2) - 3.0
    np.testing.assert_allclose(inside[:, 2], plane(inside) + rise, atol=2e-4)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("0 0 0\n1 0 0\n0 1 0\n0 0 2\n", "two heights"),
        ("0,0,0\n1,1,0\n2,2,0\n", "span no surface"),
        ("0,0,0\n1,0,0\n", "span no surface"),
        ("x,y,z\n0,0,0\n1,a,0\n0,1,0\n", "expected x, y, z"),
        ("# nothing\n", "no line of numbers"),
    ],
)
def test_what_is_no_surface_is_refused(tmp_path, text, words):
    (tmp_path / "c.xyz").write_text(text)
    with pytest.raises(InputError, match=words):
        read_cloud(tmp_path / "c.xyz")


def test_a_cloud_far_from_the_origin_keeps_its_points(tmp_path):
    at = np.stack(np.meshgrid(np.arange(20.0), np.arange(20.0), indexing="ij"), axis=-1).reshape(-1, 2) / 64.0
    near, far = (read_cloud_of(tmp_path, np.column_stack([at + move, plane(at)])) for move in (0.0, 5e6))
    for mesh in (near, far):
        assert len(np.unique(mesh.triangles)) == 400 and mesh.notes == (
            "surface through 400 points, flat between them",
        )
    assert far.areas.sum() == pytest.approx(near.areas.sum(), rel=1e-9)


def test_points_closer_than_rounding_are_one(tmp_path):
    at = np.stack(np.meshgrid(np.arange(5.0), np.arange(5.0), indexing="ij"), axis=-1).reshape(-1, 2)
    grid = np.column_stack([at, plane(at)])
    close = grid[[3, 7, 12]] + [[1e-13, 0.0, 0.0], [0.0, -1e-13, 1e-13], [0.0, 0.0, 0.0]]
    mesh = read_cloud_of(tmp_path, np.concatenate([grid, close]))
    assert len(np.unique(mesh.triangles)) == len(mesh.vertices) == 25
    assert mesh.notes[1] == "3 points that repeat others were dropped"
    with pytest.raises(InputError, match="two heights at x 1, y 2"):
        read_cloud_of(tmp_path, np.concatenate([grid, close + [0.0, 0.0, 1.0]])[[*range(25), 26]])


def test_a_gap_is_told(tmp_path):
    at = np.stack(np.meshgrid(np.r_[0:5, 40:45], np.arange(5), indexing="ij"), axis=-1).reshape(-1, 2)
    mesh = read_cloud_of(tmp_path, np.column_stack([at, 0.0 * at[:, 0]]))
    assert "8 facets close gaps" in mesh.notes[1]
