"""`run --engine vectors`: deviation tables, summary and pages of a job whose answer is known in closed form."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import polars as pl
import pytest
import trimesh

import vmachining as vm
from tests.tinyjob import SLOT_MM3, write_job
from vmachining.cli.main import run as command
from vmachining.errors import InputError, StockError

DEPTH, GROOVE = 1.0, 0.5
"""mm: of the slot (y 2 to 6, wanted), of the groove beside it (nobody wants it)."""

DESIGN = """
[design]
stl = "part.stl"
tolerance_mm = 0.01

[vectors]
pitch_mm = 0.1
spacing_mm = 0.25
"""


def solid(ring: list[tuple[float, float]], length: float, path: Path) -> None:
    """An STL of a polygon (y, z), counterclockwise, drawn along x from 0."""
    from manifold3d import CrossSection, Manifold

    body = Manifold.extrude(CrossSection([np.array(ring)]), length)
    mesh = body.to_mesh64()
    y, z, x = np.array(mesh.vert_properties)[:, :3].T
    trimesh.Trimesh(np.column_stack([x, y, z]), np.array(mesh.tri_verts), process=False).export(path)


def slotted(path: Path, scale: float = 1.0, floor: float = -DEPTH) -> None:
    """The stock of the tiny job with the slot that its line 7 cuts."""
    ring = [(0, -4), (18, -4), (18, 0), (6, 0), (6, floor), (2, floor), (2, 0), (0, 0)]
    solid([(scale * y, scale * z) for y, z in ring], 10.0 * scale, path)


def job(folder: Path, more: str = "", **how: float) -> Path:
    """The tiny job with a design."""
    file = write_job(folder)
    slotted(folder / "part.stl", **how)
    file.write_text(file.read_text() + DESIGN + more)
    return file


@pytest.mark.slow  # 5 s
def test_overcut_has_a_depth_a_place_and_a_block(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert command(["run", str(job(tmp_path)), "--out", str(out), "--engine", "vectors", "--quiet"]) == 0
    rows = pl.read_parquet(out / "deviation.parquet")
    assert pl.read_csv(out / "deviation.csv").height == rows.height > 100
    flat = rows.filter(pl.col("kind") == "upright")
    assert set(flat["state"]) == {"over"}
    assert np.allclose(flat["deviation_mm"], -GROOVE, rtol=0, atol=2**-24)
    assert flat["y_mm"].min() > 6.0 and flat["z_mm"].to_numpy() == pytest.approx(0.0)
    blocks = pl.read_parquet(out / "blocks.parquet")
    cutting = blocks.filter(pl.col("line").is_in([10, 11, 12]))["block"].to_list()
    assert set(flat["block"]) <= set(cutting) and flat["block"].null_count() == 0
    summary = json.loads((out / "summary.json").read_text())
    assert summary["deviation"]["cut_beneath"] > 0  # outer walls, whose vectors the groove crosses
    assert summary["max_overcut_mm"] == pytest.approx(GROOVE, abs=0.21) and summary[
        "max_undercut_mm"
    ] == pytest.approx(0.0, abs=1e-6)
    assert 0.5 < summary["within_tolerance"] < 1.0
    slot = blocks.filter(pl.col("line") == 7).row(0, named=True)
    assert slot["removed_lo_mm3"] <= SLOT_MM3 <= slot["removed_hi_mm3"]
    assert slot["removed_mm3"] == pytest.approx(SLOT_MM3, rel=0.03)
    page = (out / "report.html").read_text()
    assert "Deviation from the design" in page and "not proven" in page
    assert (out / "deviation.html").stat().st_size > 1000


def test_material_that_is_left(tmp_path: Path) -> None:
    result = vm.run(job(tmp_path, floor=-2.0), engine="vectors")
    deepest = 2.0 - DEPTH  # the slot's floor is wanted one deeper
    assert result.summary["max_undercut_mm"] >= deepest - 1e-6
    rows = pl.read_parquet(result.folder / "deviation.parquet")
    floor = rows.filter((pl.col("kind") == "upright") & (pl.col("z_mm") < -1.5))
    assert np.allclose(floor["deviation_mm"], deepest, rtol=0, atol=1e-6) and set(floor["state"]) == {"under"}


def test_designs_that_do_not_fit(tmp_path: Path) -> None:
    file, out = job(tmp_path, scale=1 / 25.4), tmp_path / "out"
    with pytest.raises(StockError, match=r"differ in size by a factor of 25.4"):
        vm.run(file, engine="vectors", out=out)
    slotted(tmp_path / "part.stl")
    mesh = trimesh.load_mesh(tmp_path / "part.stl")
    mesh.apply_translation([30.0, 0.0, 0.0]).export(tmp_path / "part.stl")
    with pytest.raises(StockError, match="only 0 % of the design's box is in the stock"):
        vm.run(file, engine="vectors", out=out)
    boxes = [trimesh.creation.box((6.0, 10.0, 3.0)).apply_translation([x, 8.0, -2.0]) for x in (4.0, 6.0)]
    trimesh.util.concatenate(boxes).export(tmp_path / "part.stl")
    with pytest.raises(StockError, match="design: the surface passes through itself"):
        vm.run(file, engine="vectors", out=out)
    assert not (out / "manifest.json").exists()


def test_an_open_design_and_none_at_all(tmp_path: Path) -> None:
    file = job(tmp_path)
    mesh = trimesh.load_mesh(tmp_path / "part.stl")
    trimesh.Trimesh(mesh.vertices, mesh.faces[1:], process=False).export(tmp_path / "part.stl")
    with pytest.raises(StockError, match=r"design: .*open: 3 edges"):
        vm.run(file, engine="vectors")
    with pytest.raises(StockError, match=r"the job has none"):
        vm.run(write_job(tmp_path), engine="vectors")


def test_a_density_beyond_the_memory_is_refused_with_one_that_fits(tmp_path: Path) -> None:
    file = job(tmp_path)
    text = file.read_text()
    file.write_text(text.replace("pitch_mm = 0.1", "pitch_mm = 1e-5"))
    with pytest.raises(InputError, match=r"upright vectors at a pitch of 1e-05 mm .* GB") as refused:
        vm.run(file, engine="vectors")
    assert "take pitch_mm = " in str(refused.value.remedy)


def test_a_run_goes_on_from_a_checkpoint(tmp_path: Path) -> None:
    from vmachining.engines.vectors import VectorEngine
    from vmachining.errors import EngineError

    engine = vm.run(job(tmp_path), engine="vectors").stock
    assert isinstance(engine, VectorEngine)
    engine.save(tmp_path / "point")
    again = VectorEngine.load(tmp_path / "point")
    assert again.volume == engine.volume
    one, two = engine.deviation(0.01), again.deviation(0.01)
    assert one.summary == two.summary and (one.block == two.block).all() and (one.length == two.length).all()
    (tmp_path / "point").write_bytes(b"cos\nsystem\n(S'true'\ntR.")
    with pytest.raises(EngineError, match=r"holds os\.system"):
        VectorEngine.load(tmp_path / "point")


def test_other_engines_say_that_they_did_not_look(tmp_path: Path) -> None:
    result = vm.run(job(tmp_path), engine="dexel")
    assert "not looked at" in result.summary["design_note"]
