"""The engine that `docs/add_an_engine.md` adds: its own file and one line of the table, and no other room."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from tinyjob import write_job

import vmachining as vm
from vmachining import engines
from vmachining.engines.protocol import Options
from vmachining.errors import EngineError
from vmachining.geometry import Line
from vmachining.stock import BoxStock, CylinderStock
from vmachining.sweep import Pose, Sweep, Turn
from vmachining.tool import BallNose, FlatEnd

ROOT = Path(__file__).resolve().parents[2]
ROOM, LINE = re.findall(
    r"```python\n(.*?)```", (ROOT / "docs" / "add_an_engine.md").read_text("utf-8"), re.DOTALL
)


@pytest.fixture
def coarse(tmp_path, monkeypatch):
    """The class, in the table."""
    (tmp_path / "coarse.py").write_text(ROOM)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(engines, "ENGINES", dict(engines.ENGINES))
    exec(LINE.replace("vmachining.engines.coarse", "coarse"), vars(engines))
    return engines.engine_class("coarse")


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
