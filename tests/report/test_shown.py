"""What Python and notebooks show: short texts, small tables, and names that say what is missing."""

from __future__ import annotations

import re
import subprocess
import sys
from io import BytesIO

import numpy as np
import pytest
from PIL import Image
from tinyjob import FEED, JOB, write_job

import vmachining as vm
from vmachining.errors import ToolError
from vmachining.report.paper.body import png, viewed

TOOL = vm.BullNose(diameter=20, corner_radius=5, length=60)


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder = tmp_path_factory.mktemp("job")
    return vm.run(write_job(folder, job=JOB + FEED), chord=0.2)


def test_run_takes_the_file_of_a_job(result):
    assert result.job.name == "tiny" and result.job.keys.accuracy.chord_mm == 0.2
    with pytest.raises(vm.JobError, match="cannot read the job file"):
        vm.run("nowhere.toml")


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda: vm.BullNose(20, 5),
            "takes its sizes by name; BullNose(diameter=20, corner_radius=5, length=...)",
        ),
        (lambda: vm.BallNose(diameter=8), "lacks length [length]; BallNose(diameter=8, length=...)"),
        (lambda: vm.FlatEnd(), "lacks diameter and length"),
        (
            lambda: vm.BullNose(diameter=20, corner=5, length=60),
            "has no corner [corner]; did you mean corner_radius?",
        ),
        (lambda: vm.FlatEnd(diameter="10", length=5), "diameter = '10' is not a number"),
        (lambda: vm.ProfileTool(), "lacks points"),
        (lambda: vm.AptTool(20), "AptTool(d=20, r=..., e=..., f=..., alpha_deg=..., beta_deg=..., h=...)"),
    ],
)
def test_cutters_say_what_is_missing(make, words):
    with pytest.raises(ToolError) as caught:
        make()
    assert words in str(caught.value)


def test_cutters_show_how_they_were_made():
    tools = [
        TOOL,
        vm.FlatEnd(diameter=10, length=50, flute_length=20, name="rougher"),
        vm.Taper(diameter=6, taper_deg=10, length=40),
        vm.AptTool(d=20, r=5, e=5, f=5, alpha_deg=0, beta_deg=0, h=60),
    ]
    assert repr(TOOL) == "BullNose(diameter=20, corner_radius=5, length=60)"
    for tool in tools:
        assert eval(repr(tool), vars(vm)) == tool


def test_reprs_are_short_and_say_what_matters(result, tmp_path):
    sweep = vm.Sweep(TOOL, (0, 0, 0), (50, 0, 10))
    program = vm.read_program(result.job.program_path)
    lines = [
        (sweep, "Sweep(Profile(r up to 10, z 0 to 60, 1 arc), Line((0, 0, 0) to (50, 0, 10)))"),
        (vm.Arc((10, 0, 0), (0, 0, 0), angle=3.141592653589793), "180 degrees about z"),
        (
            vm.Turn.great_circle(vm.Pose((0, 0, 0)), vm.Pose((5, 0, 0), (1, 0, 0))),
            "axis (0, 0, 1) to (1, 0, 0)",
        ),
        (result.job, "Job('tiny', program 'tiny.nc', tools {1: flat D4}, stock box)"),
        (program, "Program("),
        (result, f"RunResult('tiny', {result.summary['blocks']} blocks"),
    ]
    for thing, words in lines:
        assert words in repr(thing) and len(repr(thing)) < 200
        assert "array(" not in repr(thing)


def well_formed(text: str) -> list[str]:
    """Tags open and close in order; returns the cells."""
    stack: list[str] = []
    for closing, name in re.findall(r"<(/?)([a-z]+)>", text):
        if closing:
            assert stack.pop() == name
        else:
            stack.append(name)
    assert not stack
    return re.findall(r"<td>(.*?)</td>", text)


def test_a_notebook_shows_sums_and_the_head_of_the_table(result):
    cells = well_formed(result._repr_html_())
    removed, between = (cells[cells.index(name) + 1] for name in ("removed", "between"))
    numbers = [
        float(number) for number in re.findall(r"[\d.]+", f"{removed.split()[0]} {between.split(' mm3')[0]}")
    ]
    assert numbers == pytest.approx([result.summary[f"removed{k}_mm3"] for k in ("", "_lo", "_hi")], rel=1e-5)
    assert "N60 G1 X14 F600" in cells and any("scheduled" in cell for cell in cells)


def test_engagements_and_comparisons_are_shown(result, tmp_path):
    found = vm.engage(result.job, 2, at=0.5)
    assert "Engagement(block 2 at 0.5, dexel, engaged" in repr(found) and len(repr(found)) < 300
    assert "axial" in well_formed(found._repr_html_())
    blocks = result.blocks.select("block", "removed_mm3").to_dict(as_series=False)
    verdict = vm.compare(blocks, result)
    assert repr(verdict).startswith("Comparison(") and verdict.verdict in repr(verdict)
    assert "verdict" in well_formed(verdict._repr_html_())


def test_programs_sweeps_and_surfaces_are_shown():
    """Boxes by arithmetic; a name and a word of the program that are tags stay text."""
    program = vm.parse_program(b"G21 G90\nG1 X1 F100\nG99999 X2\nM2\n", "<i>a</i>.nc")
    cells = well_formed(program._repr_html_())
    assert cells[cells.index("motions") + 1] == str(len(program.moves)) and "E208" in cells
    assert "<i>" not in program._repr_html_() and "&lt;i&gt;a" in program._repr_html_()

    tool = vm.FlatEnd(diameter=10, length=40)
    cells = well_formed(vm.Sweep(tool, (0, 0, -2), (50, 0, -2))._repr_html_())
    assert cells[cells.index("box, mm") + 1] == "x -5 to 55, y -5 to 5, z -2 to 38"
    assert "radius 5 mm" in cells[cells.index("cutter") + 1]

    part = vm.Workpiece(vm.Box((0, 0, -20), (60, 40, 0)))
    part.cut(vm.Sweep(tool, (-10, 20, -5), (70, 20, -5)))
    cells = well_formed(part.surface()._repr_html_())
    assert cells[cells.index("box, mm") + 1] == "x 0 to 60, y 0 to 40, z -20 to 0"
    assert cells[cells.index("cut by blocks") + 1] == "1"


def test_names_of_the_package_are_clean():
    names = [name for name in dir(vm) if not name.startswith("__")]
    assert names == sorted(vm.__all__, key=str) or set(names) == set(vm.__all__)
    fresh = "import vmachining as vm; print(sorted(n for n in dir(vm) if n[0] != '_') == sorted(vm.__all__))"
    done = subprocess.run([sys.executable, "-c", fresh], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "True"


def test_the_picture_is_a_png_of_what_is_seen():
    """Decoded by Pillow; a pyramid whose four slopes have four shades."""
    points = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [1, 1, 1.0]])
    triangles = np.array([[0, 2, 1], [0, 3, 2], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    with Image.open(BytesIO(png(points, triangles))) as picture:
        picture.load()
    assert picture.format == "PNG" and picture.mode == "RGBA"
    seen = viewed(points, triangles)[0][::-1]
    assert np.abs(np.asarray(picture) / 255.0 - seen).max() <= 0.5 / 255.0 + 1e-12
    opaque = np.unique(np.asarray(picture)[seen[..., 3] == 1.0], axis=0)
    assert len(opaque) >= 2  # at least the two slopes in front


def test_a_run_that_leaves_nothing_of_the_stock(tmp_path):
    """A cutter wider and deeper than the block: page, files and pictures show nothing instead of failing."""
    box = {"box = { min = [0, 0, -4], max = [10, 18, 0] }": "box = { min = [0, -3, -4], max = [10, 3, 0] }"}
    program = "G21 G90\nT1 M6\nS1000 M3\nG0 X-30 Y0 Z-4\nG1 X30 F500\nM30\n"
    swap = {"diameter_mm = 4": "diameter_mm = 40", **box}
    result = vm.run(write_job(tmp_path, program=program, swap=swap))
    result.write(tmp_path / "out", stock=("stl", "3mf", "glb"))
    assert result.removed.estimate == pytest.approx(240.0, rel=1e-6) and len(result.surface.triangles) == 0
    assert "240" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert result.surface.plot() is not None
    with pytest.raises(vm.InputError, match="nothing is left of the stock"):
        result.plot("stock")
