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
"""mm: of the slot (y 2 to 6, wanted), of the groove beside it (nobody needs it)."""

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
    deepest = 2.0 - DEPTH  # the slot's floor is expected one deeper
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
    with pytest.raises(StockError, match=r"the job has no design"):
        vm.run(write_job(tmp_path), engine="vectors")


def test_a_density_beyond_the_memory_is_refused_with_one_that_fits(tmp_path: Path) -> None:
    file = job(tmp_path)
    text = file.read_text()
    file.write_text(text.replace("pitch_mm = 0.1", "pitch_mm = 1e-5"))
    with pytest.raises(InputError, match=r"upright vectors at a pitch of 1e-05 mm .* GB") as refused:
        vm.run(file, engine="vectors")
    assert "take pitch_mm = " in str(refused.value.remedy) and "spacing" not in str(refused.value.remedy)
    assert refused.value.file == str(file) and refused.value.line


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
    with pytest.raises(EngineError, match="it is not a checkpoint"):
        VectorEngine.load(tmp_path / "point")


def test_other_engines_say_that_they_did_not_look(tmp_path: Path) -> None:
    result = vm.run(job(tmp_path), engine="rays")
    assert "not looked at" in result.summary["design_note"]


def ball_job(folder: Path) -> Path:
    """A ball cutter zigzags over a plate with a dome, and a flat one, with a holder that touches, cuts a slot between."""
    import trimesh

    folder.mkdir(parents=True, exist_ok=True)
    dome = trimesh.creation.icosphere(3, 6.0).apply_translation([10, 9, 0])
    plate = trimesh.creation.box((20, 18, 4)).apply_translation([10, 9, 2])
    trimesh.boolean.union(
        [plate, dome.slice_plane([0, 0, 1], [0, 0, 1], cap=True)], engine="manifold"
    ).export(folder / "part.stl")
    x = np.arange(-1.0, 22.0, 0.8)
    lines = ["G21 G17 G90 G94", "T1 M6", "S8000 M3", "G0 X-1 Y0 Z20"]
    for k, y in enumerate(np.arange(0.0, 18.1, 2.0)):
        for a in x if k % 2 == 0 else x[::-1]:
            high = max(4.0, np.sqrt(max(9.0**2 - (a - 10) ** 2 - (y - 9) ** 2, 0.0)) - 3.0)
            lines.append(f"G1 X{a:.3f} Y{y:.3f} Z{high:.4f} F900")
        if k == 4:
            lines += [
                "G0 Z20",
                "T2 M6",
                "S8000 M3",
                "G0 X1 Y13",
                "G1 Z3.5 F300",
                "G1 X8 Y13.5",
                "G2 X9 Y14.5 I0 J1",
                "G0 Z20",
                "T1 M6",
            ]
    (folder / "domes.nc").write_text("\n".join([*lines, "G0 Z20", "M30"]) + "\n")
    (folder / "job.toml").write_text(BALLS)
    return folder / "job.toml"


BALLS = """
name = "domes"
units = "mm"
[program]
file = "domes.nc"
home = [0, 0, 20]
[machine]
rapid_mm_min = 6000
max_feed_mm_min = 4000
[[tools]]
number = 1
type = "ball"
diameter_mm = 6
length_mm = 30
[[tools]]
number = 2
type = "flat"
diameter_mm = 3
length_mm = 6
flute_length_mm = 2
shank_diameter_mm = 6
[stock]
box = { min = [0, 0, 0], max = [20, 18, 7] }
[design]
stl = "part.stl"
tolerance_mm = 0.02
[vectors]
pitch_mm = 0.2
spacing_mm = 0.5
"""


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, vm.RunResult]:
    file = ball_job(tmp_path_factory.mktemp("domes"))
    return file, vm.run(file, engine="vectors", out=tmp_path_factory.mktemp("whole"))


def test_many_blocks_at_once_are_blocks_one_after_the_other(whole: tuple[Path, vm.RunResult]) -> None:
    """The run hands over many blocks in one call: every removal and every length is that of `Engine.cut` alone."""
    from vmachining.engines.protocol import Options
    from vmachining.engines.vectors import VectorEngine
    from vmachining.job import Job
    from vmachining.job.paths import move_path
    from vmachining.job.reading import read_job_program
    from vmachining.job.stock import design_mesh, raw_stock, vector_settings
    from vmachining.nc import Motion
    from vmachining.sweep import Sweep

    file, result = whole
    job = Job.load(file)
    one = VectorEngine(
        raw_stock(job),
        Options(design=design_mesh(job), vectors=vector_settings(job), chord=job.keys.accuracy.chord_mm),
    )
    cut = [m for m in read_job_program(job).moves if m.motion not in (Motion.RAPID, Motion.DWELL) and m.tool]
    removed = [
        one.cut(Sweep.along(job.tools[m.tool].cutter, move_path(m, None)), k) for k, m in enumerate(cut)
    ]
    rows = result.blocks.filter(pl.col("motion") != "rapid")
    assert len(rows) == len(cut) > 250
    for name, values in (
        ("removed_lo_mm3", [r.lo for r in removed]),
        ("removed_mm3", [r.estimate for r in removed]),
        ("removed_hi_mm3", [r.hi for r in removed]),
    ):
        assert rows[name].to_list() == values
    many = result.stock
    assert isinstance(many, VectorEngine)
    assert np.array_equal(one.upright.lengths, many.upright.lengths, equal_nan=True)
    assert np.array_equal(one.along.length, many.along.length)
    assert np.array_equal(one.along.laid.behind, many.along.laid.behind)
    assert "shank touches the stock" in " ".join(result.blocks["warning"].drop_nulls())


@pytest.mark.parametrize("done", [20, 100])
def test_an_interrupted_run_goes_on_to_the_same_tables(
    done: int, whole: tuple[Path, vm.RunResult], tmp_path: Path
) -> None:
    import os
    import signal

    from polars.testing import assert_frame_equal

    from vmachining.job import Stopped

    file, result = whole
    sent = []

    def progress(name: str, now: int, total: int) -> None:
        if name == "program" and now >= done and not sent:
            sent.append(now)
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(Stopped) as stopped:
        vm.run(file, engine="vectors", out=tmp_path, progress=progress)
    assert done <= stopped.value.done < len(result.blocks)
    again = vm.run(file, engine="vectors", out=tmp_path, resume=True)
    assert_frame_equal(again.blocks, result.blocks, check_exact=True)
    tables = [pl.read_parquet(folder / "deviation.parquet") for folder in (again.folder, result.folder)]
    assert_frame_equal(*tables, check_exact=True)
    assert again.summary["deviation"] == result.summary["deviation"]
