"""The Python interface as a notebook uses it: intervals, a workpiece, jobs without TOML."""

from __future__ import annotations

import io
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
import trimesh
from matplotlib.image import imread

import vmachining as vm

ROOT = Path(__file__).parents[2]
TOOLS = [
    vm.FlatEnd(diameter=10, length=40, flutes=2, helix_deg=30),
    vm.BallNose(diameter=6, length=40, flute_length=20, shank_diameter=6, name="ball"),
    vm.BullNose(diameter=20, corner_radius=5, length=60, holder=((20, 60), (20, 90))),
    vm.Taper(diameter=4, taper_deg=5, corner_radius=2, length=30),
    vm.AptTool(d=20, r=5, e=5, f=5, alpha_deg=0, beta_deg=0, h=60),
    vm.ProfileTool(points=((0, 0), (5, 0), (10, 5), (10, 60))),
]


def test_intervals_add_end_by_end():
    a, b = vm.Interval(1, 2, 3), vm.Interval(10, 20, 30, proven=False)
    assert a + a == vm.Interval(2, 4, 6) and sum([a, a, a]) == vm.Interval(3, 6, 9)
    assert (a + b).proven is False and (b - a) == vm.Interval(7, 18, 29, proven=False)
    assert 2.5 in a and 3.5 not in a and a.holds(3.5, slack=0.5)
    assert a.width == 2 and a.error == 1
    assert tuple(a) == (1, 2, 3) and np.array([a, a]).shape == (2, 3)
    assert f"{a:.2f}" == "2.00 [1.00, 3.00]" and "stated" in str(b)
    with pytest.raises(AttributeError):
        a.lo = 0  # type: ignore[misc]
    with pytest.raises(TypeError):
        a + 1.0


@pytest.mark.parametrize("engine", ["columns", "mesh", "dexel", "rays"])
def test_a_workpiece_of_any_engine(engine):
    """A slot from side to side and a second one across it: 120 * 10 * 5 and (60 - 10) * 10 * 5 mm3."""
    wp = vm.Workpiece(vm.Box((0, 0, -20), (120, 60, 0)), engine=engine, width=1e-4)
    tool = vm.FlatEnd(diameter=10, length=40)
    along, across = vm.Sweep(tool, (-10, 30, -5), (130, 30, -5)), vm.Sweep(tool, (60, -10, -5), (60, 70, -5))
    assert wp.would_remove(along).holds(6000, 1e-6)
    assert wp.cut(along).holds(6000, 1e-6) and wp.cut(across).holds(2500, 1e-6)
    assert "<td>2</td>" in wp._repr_html_() and str(wp.removed) in wp._repr_html_()
    assert wp.removed.holds(8500, 1e-6) and wp.volume.holds(120 * 60 * 20 - 8500, 1e-6)
    if engine in ("columns", "mesh"):
        assert wp.removed.proven
        mesh = wp.surface().to_trimesh()
        assert mesh.is_watertight and set(mesh.face_attributes["block"]) == {-1, 1, 2}
        assert mesh.volume == pytest.approx(wp.volume.estimate, rel=1e-6)


def test_a_surface_for_other_programs(tmp_path):
    """A box of 10 x 20 x 30 mm: glTF has metres and y upright; pyvista keeps mm and blocks."""
    surface = vm.Workpiece(vm.Box((0, 0, 0), (10, 20, 30)), engine="mesh").surface()
    surface.export(tmp_path / "box.glb")
    box = trimesh.load(tmp_path / "box.glb", force="mesh")
    assert box.bounds.tolist() == pytest.approx(np.array([[0, 0, -0.02], [0.01, 0.03, 0]]), abs=1e-9)
    assert box.volume == pytest.approx(6e-6, rel=1e-6)
    pytest.importorskip("pyvista", reason="pyvista is not installed")
    mesh = surface.to_pyvista()
    assert mesh.volume == pytest.approx(6000.0) and set(mesh.cell_data["block"]) == {-1}


def test_a_workpiece_from_files(tmp_path):
    box = vm.Workpiece(vm.Box((0, 0, 0), (10, 20, 30)), engine="mesh")
    box.surface().export(tmp_path / "box.stl")
    assert vm.Workpiece(tmp_path / "box.stl").volume.holds(6000, 1e-3)
    assert vm.Workpiece(ROOT / "models/slot/part.step").volume.lo > 0
    with pytest.raises(vm.StockError):
        vm.Workpiece(tmp_path / "none.stl")
    with pytest.raises(vm.InputError, match="design"):
        vm.Workpiece(vm.Box((0, 0, 0), (1, 1, 1)), engine="vectors")


PROGRAM = "G21 G90 G17\nT1 M6\nS1000 M3\nG0 X-10 Y30 Z5\nG1 Z-5 F200\nX130 F300\nG0 Z50\nM30\n"


def test_a_job_from_values(tmp_path):
    (tmp_path / "part.nc").write_text(PROGRAM)
    job = vm.Job(
        program={"file": "part.nc", "home": [0, 0, 50]}, tools=TOOLS, stock=vm.Box((0, 0, -20), (120, 60, 0)),
        feed=vm.Feed(strategy="volume", max_mm_min=900), name="part", folder=tmp_path,
    )  # fmt: skip
    assert list(job.tools) == [1, 2, 3, 4, 5, 6] and list(job.tools.values()) == TOOLS
    assert vm.run(job.replace(feed=None), contact="none", width="0.1%").removed.holds(6000, 1e-6)
    with pytest.raises(vm.JobError, match=r"width '2\.0'"):
        vm.run(job, width=2.0)
    assert "part.nc" in job._repr_html_() and "box" in job._repr_html_()

    finer = job.replace(accuracy={"width": 0.001}, feed={"min_mm_min": 100})
    assert finer.keys.accuracy.width == 0.001 and job.keys.accuracy.width != 0.001
    assert finer.keys.feed == vm.Feed(strategy="volume", max_mm_min=900, min_mm_min=100)
    with pytest.raises(vm.JobError, match="nonsense"):
        job.replace(nonsense=1)
    with pytest.raises(vm.JobError, match="no such file"):
        job.replace(program={"file": "other.nc"})

    (tmp_path / "jobs").mkdir()
    finer.save(tmp_path / "jobs" / "job.toml")
    again = vm.Job.load(tmp_path / "jobs" / "job.toml")
    assert list(again.tools.values()) == TOOLS and again.program_path.samefile(job.program_path)
    assert again.replace(program="../part.nc").keys.model_dump() | {
        "program": 0
    } == finer.keys.model_dump() | {"program": 0}
    assert tomllib.loads((tmp_path / "jobs/job.toml").read_text())["program"]["file"] == "../part.nc"


def test_a_bar_and_a_step_file_as_stock(tmp_path):
    (tmp_path / "part.nc").write_text(PROGRAM.replace("Y30", "Y0"))
    bar = vm.Cylinder((0, 0), 40, (-20, 0))
    job = vm.Job(program=tmp_path / "part.nc", tools=TOOLS[:1], stock=bar)
    assert vm.Workpiece(bar).volume.holds(math.pi * 1600 * 20, 1e-6)
    assert job.keys.stock.cylinder is not None and job.keys.stock.cylinder.radius == 40
    part = ROOT / "models/slot/part.step"
    assert job.replace(stock=part).stock_path == part
    assert job.replace(stock={"stl": str(ROOT / "models/slot/job.toml")}).keys.stock.stl is not None


def ink(figure):
    """Share of the pixels that a notebook shows and that are not white."""
    picture = imread(io.BytesIO(figure._repr_png_()))
    return float((picture[..., :3].min(axis=2) < 0.98).mean())


def test_pictures_show_what_they_are_of():
    """A notebook gets a PNG of each; a body fills its picture, and one block is a small part of its stock."""
    tool = vm.BallNose(diameter=10, length=40)
    result = vm.run(ROOT / "models/slot/job.toml")
    for kind in ("load", "bracket", "feed", "engagement", "stock"):
        assert 0.005 < ink(result.plot(kind)) < 0.9
    assert result.plot("feed", over="block").axes[-1].get_xlabel() == "block"
    sweep = vm.Sweep(tool, (0, 0, 0), (30, 0, 0))
    shown = sweep.plot()
    assert ink(shown) > 0.3 and len(shown.axes[0].lines) == 1
    assert ink(vm.Workpiece(vm.Box((0, 0, 0), (10, 10, 10))).surface().plot()) > 0.3
    with pytest.raises(vm.InputError, match="no figure has kind 'loads'; kind: load, "):
        result.plot("loads")


def test_contact_of_a_block_of_a_run():
    """Slot of the width of the tool: half a turn, to the depth of the floor."""
    result = vm.run(ROOT / "models/slot/job.toml")
    rows = result.blocks
    deep = rows.filter(rows["removed_mm3"] == rows["removed_mm3"].max())["block"][0]
    found, same = result.contact(deep), vm.engage(ROOT / "models/slot/job.toml", deep)
    assert found.summary == same.summary and not found.is_air
    assert 0.2 < ink(found.plot()) < 0.95 and found.plot().axes[0].get_title().startswith(f"block {deep}")


def test_wrong_input_is_a_value_error():
    """Callers of a library catch ValueError, and get our message with it."""
    for wrong in (
        lambda: vm.BallNose(diameter=-1, length=40),
        lambda: vm.Sweep(vm.BallNose(diameter=10, length=40), (0, 0), (1, 1, 1)),
        lambda: vm.parse_program(b"G1", "a.nc", dialect="cobol"),
        lambda: vm.run(ROOT / "models/slot/job.toml", engine="cobol"),
    ):
        with pytest.raises(ValueError) as found:
            wrong()
        assert isinstance(found.value, vm.VMachiningError)
