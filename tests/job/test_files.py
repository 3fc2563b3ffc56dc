"""Files are whole or absent; STEP stock is closed or refused."""

from __future__ import annotations

import json

import numpy as np
import pytest

from vmachining.errors import InputError, StockError
from vmachining.job import check_formats
from vmachining.job.files import atomic_path, sha256, write_atomic, write_json


def test_a_failed_write_leaves_the_old_file(tmp_path):
    target = tmp_path / "a.csv"
    write_atomic(target, "old")
    with pytest.raises(RuntimeError), atomic_path(target) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert target.read_text() == "old" and [p.name for p in tmp_path.iterdir()] == ["a.csv"]
    with pytest.raises(ValueError):
        write_json(target, {"x": float("nan")})
    assert target.read_text() == "old"
    write_json(target, {"ä": 1})
    assert json.loads(target.read_text(encoding="utf-8")) == {"ä": 1}


def test_sha256_of_a_known_text(tmp_path):
    (tmp_path / "abc").write_text("abc")
    assert sha256(tmp_path / "abc").startswith("ba7816bf8f01cfea414140de5dae2223")
    with pytest.raises(InputError, match="none: cannot read"):
        sha256(tmp_path / "none")


def test_stock_formats():
    assert check_formats("stl, 3MF") == ("stl", "3mf") and check_formats("") == ()
    assert check_formats("step") == ("step",)
    with pytest.raises(InputError, match="'obj'"):
        check_formats("obj")


cq = pytest.importorskip("cadquery")
from vmachining.engines.brep import read_step  # noqa: E402


def export(shape, path):
    cq.exporters.export(cq.Workplane(shape), str(path), exportType="STEP")
    return path


def test_a_step_part_comes_back_with_its_volume(tmp_path, capfd):
    part = cq.Workplane().box(20, 10, 5).edges("|Z").fillet(2).faces(">Z").workplane().hole(4)
    exact = (200 - (4 - np.pi) * 4 - 4 * np.pi) * 5
    solid = read_step(export(part.val(), tmp_path / "part.step"), chord=0.01)
    assert solid.volume == pytest.approx(exact, rel=1e-9)
    from vmachining.engines.mesh import StockMesh
    from vmachining.stock import closed_mesh

    stock = StockMesh.of(closed_mesh(solid.vertices, solid.triangles))
    np.testing.assert_allclose(stock.bounds, [[-10, -5, -2.5], [10, 5, 2.5]], atol=1e-7)
    assert capfd.readouterr().out == ""


def test_several_solids_are_one_stock(tmp_path):
    boxes = [cq.Solid.makeBox(1, 1, 1), cq.Solid.makeBox(1, 1, 1, cq.Vector(2, 0, 0))]
    assert read_step(export(cq.Compound.makeCompound(boxes), tmp_path / "two.step")).volume == pytest.approx(
        2
    )


def test_step_files_that_are_no_closed_solid(tmp_path, capfd):
    shell = cq.Shell.makeShell(cq.Workplane().box(1, 2, 3).faces("not >Z").vals())
    overlap = [cq.Solid.makeBox(1, 1, 1), cq.Solid.makeBox(1, 1, 1, cq.Vector(0.5, 0, 0))]
    face = cq.Face.makePlane(2, 2)
    both = cq.Compound.makeCompound([cq.Solid.makeBox(1, 1, 1), cq.Shell.makeShell([face])])
    (tmp_path / "text.step").write_text("solid teapot")
    (tmp_path / "torn.step").write_text("ISO-10303-21;\nHEADER; garbage")
    for name, shape, words in (
        ("open", shell, "no solid, only 1 shell"),
        ("overlap", cq.Compound.makeCompound(overlap), "overlap"),
        ("face", face, "no solid"),
        ("both", both, "open shell"),
        ("text", None, "not a STEP file"),
        ("torn", None, "cannot read it|no solid"),
        ("none", None, "No such file"),
    ):
        path = tmp_path / f"{name}.step"
        if shape is not None:
            export(shape, path)
        with pytest.raises(StockError, match=words) as caught:
            read_step(path)
        assert str(path) in str(caught.value)
    assert capfd.readouterr().out == ""
