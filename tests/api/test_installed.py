"""Packages that add an engine and a dialect: those of `docs/add_an_engine.md` and `docs/add_a_dialect.md`, installed."""

from __future__ import annotations

import math
import re
import sys
import tomllib
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from tinyjob import write_job

import vmachining as vm
from vmachining import engines, nc
from vmachining.engines.protocol import Options
from vmachining.errors import EngineError
from vmachining.geometry import Line
from vmachining.installed import Installed
from vmachining.stock import BoxStock, CylinderStock
from vmachining.sweep import Pose, Sweep, Turn
from vmachining.tool import BallNose, FlatEnd

DOCS = Path(__file__).resolve().parents[2] / "docs"


@cache
def pieces(page, language):
    return re.findall(rf"```{language}\n(.*?)```", (DOCS / page).read_text("utf-8"), re.DOTALL)


def install(page, folder):
    """What pip makes of a package: its module, and its name and entry points beside it."""
    (package,) = (tomllib.loads(text)["project"] for text in pieces(page, "toml"))
    module = package["name"].replace("-", "_")
    (folder / f"{module}.py").write_text("\n".join(pieces(page, "python")))
    about = folder / f"{module}-{package['version']}.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {package['name']}\nVersion: {package['version']}\n"
    )
    groups = package["entry-points"].items()
    lines = [f"[{group}]\n" + "\n".join(f"{k} = {v}" for k, v in points.items()) for group, points in groups]
    (about / "entry_points.txt").write_text("\n\n".join(lines) + "\n")


@pytest.fixture
def fresh(monkeypatch, tmp_path):
    """A folder on the path, and tables that have looked at no package yet."""
    monkeypatch.syspath_prepend(tmp_path)
    for table in (engines.ENGINES, nc.dialects.TABLE):
        monkeypatch.delitem(vars(table), "_others", raising=False)
    yield tmp_path
    for name in ("vm_coarse", "vm_hpgl"):
        sys.modules.pop(name, None)
    for table in (engines.ENGINES, nc.dialects.TABLE):
        vars(table).pop("_others", None)


@pytest.fixture
def coarse(fresh):
    """The class, found by its name."""
    install("add_an_engine.md", fresh)
    return engines.engine_class("coarse")


PLOT = "IN;SP1;\nVS2;\nPU400,400;\nPD800,400,800,800,400,800,400,400;\nPU;\n"


def test_a_dialect_of_a_package_is_recognised_and_cuts_a_square(fresh):
    install("add_a_dialect.md", fresh)
    program = vm.parse_program(PLOT.encode(), "square.plt", dialect="auto")
    assert program.dialect == "hpgl" and not program.errors
    assert [move.line for move in program.moves] == [3, 3, 4, 4, 4, 4, 4, 5]
    tools = [FlatEnd(diameter=2, length=20)]
    (fresh / "square.plt").write_text(PLOT)
    job = vm.Job(
        program={"file": str(fresh / "square.plt"), "dialect": "hpgl"},
        tools=tools,
        stock=vm.Box((0, 0, -5), (30, 30, 0)),
    )
    removed = vm.run(job).blocks["removed_mm3"].sum()
    # a 10 mm square along its outline, 2 mm wide, 0.2 mm deep: outer 12 x 12 with rounded corners, inner 8 x 8
    assert removed == pytest.approx(0.2 * (144 - (4 - math.pi) - 64), rel=1e-3)
    wrong = vm.parse_program(b"IN;\nPU10;\nCI40;\n", "w.plt", dialect="hpgl")
    assert [(f.line, f.word) for f in wrong.errors] == [(2, "PU10;"), (3, "CI40;")]


def test_without_the_package_the_names_are_unknown(fresh):
    with pytest.raises(vm.InputError, match=r"unknown engine 'coarse'; one of columns, mesh"):
        engines.engine_class("coarse")
    with pytest.raises(vm.NCError, match="dialect 'hpgl' is not supported"):
        vm.parse_program(PLOT.encode(), "square.plt", dialect="hpgl")


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ("mesh = vm_bad:ENTRY", "entry 'mesh' of vmachining.engines: this name is taken"),
        ("bad = vm_bad:ENTRY", "is int, not Entry"),
        ("bad = vm_bad:OTHER", "does not load"),
    ],
)
def test_a_wrong_package_is_named(fresh, entry, said):
    (fresh / "vm_bad.py").write_text("ENTRY = 3\n")
    (fresh / "vm_bad-1.dist-info").mkdir()
    (fresh / "vm_bad-1.dist-info" / "METADATA").write_text(
        "Metadata-Version: 2.1\nName: vm-bad\nVersion: 1\n"
    )
    (fresh / "vm_bad-1.dist-info" / "entry_points.txt").write_text(f"[vmachining.engines]\n{entry}\n")
    table = Installed("vmachining.engines", engines.Entry, engines.ENGINES.own)
    assert table["mesh"] is engines.ENGINES["mesh"]  # ours are found without a look at packages
    with pytest.raises(vm.InputError, match=f"vm-bad: .*{said}.*uninstall vm-bad"):
        list(table)


def test_a_job_runs_with_it(coarse, tmp_path):
    job = vm.Job.load(write_job(tmp_path))
    result = vm.run(job, engine="coarse", out=tmp_path / "out")
    rows = result.blocks
    slot = rows.filter(rows["line"] == 7)
    assert rows["engine"].unique().to_list() == ["coarse"] and result.summary["brackets"] == coarse.proof
    assert slot["removed_lo_mm3"][0] < 40.0 < slot["removed_hi_mm3"][0]  # exact, see tinyjob
    proven = vm.run(job).blocks
    assert (rows["removed_lo_mm3"] <= proven["removed_hi_mm3"]).all()
    assert (rows["removed_hi_mm3"] >= proven["removed_lo_mm3"]).all()
    result.write(tmp_path / "files", stock=("stl", "3mf"))
    assert (tmp_path / "files" / "stock.stl").is_file() and (tmp_path / "files" / "report.html").is_file()


def test_its_interval_holds_closed_forms(coarse):
    box = coarse.of(BoxStock((0, 0, -10), (30, 20, 0)), Options())
    ball = Sweep.along(BallNose(diameter=10, length=40).cutter, Line((-10, 10, -5), (40, 10, -5)))
    found = box.cut(ball)
    assert found.lo < math.pi * 25 / 2 * 30 < found.hi and not found.proven
    # midpoints of strips of h = 0.5 at the two ends of a half disc: 2 (2^-1/2 - 1) zeta(-1/2) h^1.5 sqrt(2 R) = 0.136
    assert found.estimate - math.pi * 25 / 2 * 30 == pytest.approx(0.136 * 30, rel=0.05)
    assert box.cut(ball).hi == 0.0
    assert box.volume.estimate == pytest.approx(6000 - found.estimate, rel=1e-12)
    bar = coarse.of(CylinderStock((1, 2), 8, (-5, 0)), Options())
    plunge = Sweep.along(FlatEnd(diameter=6, length=40).cutter, Line((1, 2, 5), (1, 2, -2)))
    assert bar.touch(plunge).lo < math.pi * 9 * 2 < bar.touch(plunge).hi


def test_it_goes_on_from_a_file_and_refuses_what_it_cannot(coarse, tmp_path):
    engine = coarse.of(BoxStock((0, 0, -10), (30, 20, 0)), Options())
    flat = FlatEnd(diameter=10, length=5).cutter
    engine.cut(Sweep.along(flat, Line((-10, 10, -4), (15, 10, -4))), 3)
    engine.save(tmp_path / "half")
    again = coarse.load(tmp_path / "half")
    assert again.volume == engine.volume and again.chord == engine.chord
    assert np.unique(again.surface().block).tolist() == [-1, 3]
    with pytest.raises(EngineError, match="coarse engine, block 4: material is left above"):
        again.cut(Sweep.along(flat, Line((-10, 10, -8), (40, 10, -8))), 4)
    lean = Turn.great_circle(Pose((0, 0, 0)), Pose((9, 0, 0), (0.6, 0, 0.8)))
    assert not again.takes(Sweep.along(flat, lean))
    with pytest.raises(EngineError, match="turns"):
        again.touch(Sweep.along(flat, lean))
    assert again.volume == engine.volume
