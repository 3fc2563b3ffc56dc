"""Programs that go over the same part again and again: sweeps that are lowest nowhere are forgotten, and change nothing."""

from __future__ import annotations

import math
from itertools import islice

import numpy as np
import pytest

import vmachining as vm
from benchmarks import columns_long as long
from vmachining.engines import relay
from vmachining.engines.columns import ColumnsEngine, FlatStock
from vmachining.engines.columns import engine as room
from vmachining.engines.protocol import Options
from vmachining.engines.relay import ColumnsFirst
from vmachining.geometry import Line
from vmachining.stock import BoxStock
from vmachining.sweep import Sweep

STOCK = BoxStock((0, 0, -20), (60, 30, 0))
FLAT = vm.FlatEnd(diameter=6, length=60).cutter


@pytest.fixture
def soon(monkeypatch):
    """Tidied whenever there are twice eight sweeps."""
    monkeypatch.setattr(room, "TIDY", 16)
    monkeypatch.setattr(relay, "TIDY", 16)


def test_what_is_kept_does_not_grow_with_the_program(soon, monkeypatch):
    """Passes of 169 blocks over 12 x 6 mm: one pass is what the surface shows, so that is kept, twice and at most doubled."""
    monkeypatch.setattr(long, "LENGTH", 12)
    monkeypatch.setattr(long, "WIDTH", 6)
    (short,), (much,) = (list(long.columns_long(passes * 169)) for passes in (2, 14))
    assert much["kept"] <= 2 * 2 * 169 and much["checkpoint_mb"] < 1.2 * short["checkpoint_mb"]
    # 14 passes are whole, the last at 6.65 mm: rows every 0.5 mm of a ball of 5 mm leave scallops of 0.5^2 / 8 / 5 mm
    half = 0.5 * much["width_of_the_sum"] * much["removed_mm3"]
    assert much["removed_mm3"] + half >= 12 * 6 * (6.65 - 0.25 / 40)
    assert much["removed_mm3"] - half <= 12 * 6 * 6.65


def slots(depths):
    for k, depth in enumerate(depths):
        y = 5.0 + 20.0 * (k % 2)
        yield Sweep.along(FLAT, Line((-5, y, -depth), (65, y, -depth)))


def test_blocks_after_forgetting_hold_their_closed_form(soon):
    """Two slots, deeper at every turn: each takes 60 x 6 mm times the step, and one last slot across the rest."""
    engine = ColumnsEngine(FlatStock.of(STOCK), 1e-4, 0.0)
    step = 0.1
    for k, sweep in enumerate(slots(step * (1 + j // 2) for j in range(100))):
        found = engine.cut(sweep, k)
        assert found.lo <= 60 * 6 * step <= found.hi
    assert engine.kept <= 16
    across = engine.cut(Sweep.along(FLAT, Line((30, -5, -5), (30, 35, -5))))
    assert across.lo <= 6 * 5 * (30 - 12) <= across.hi
    assert engine.in_use().tolist() == [-1, 98, 99]
    blocks = set(np.unique(engine.surface().block).tolist())
    assert blocks >= {98, 99} and blocks <= {-1, 98, 99}


def test_mesh_cuts_what_is_left_of_the_noted_sweeps(soon, tmp_path):
    """A dovetail under a slot that a hundred blocks have cut: closed form, and two of these blocks are enough."""
    work = ColumnsFirst.of(STOCK, Options(chord=0.05))
    for k, sweep in enumerate(slots(0.04 * (1 + j // 2) for j in range(200))):
        work.cut(sweep, k)
    assert work.kept <= 64
    work.save(tmp_path / "state.npz")
    work = ColumnsFirst.load(tmp_path / "state.npz")
    dovetail = vm.Taper(diameter=10, taper_deg=-20, length=9)
    under = work.cut(Sweep.along(dovetail, Line((-10, 5, -8), (70, 5, -8))), 200)
    assert under.engine == "mesh"
    tan = math.tan(math.radians(20.0))
    wings = 2 * (2 - 4 * tan) ** 2 / (2 * tan)
    assert under.lo <= 60 * (2 * (5 * 4 - tan * 8) + wings) <= under.hi
    shank = Sweep.along(vm.FlatEnd(diameter=8, length=60).cutter, Line((-10, 5, -4), (70, 5, -4)))
    beside = work.touch(shank)
    # both are known to within the chord of the mesh engine along the flanks of the dovetail
    assert beside.estimate == pytest.approx(60 * ((8 - 6) * 4 - wings), abs=60 * 2 * 4 * 0.05)


def test_parts_forget_what_is_of_no_use_to_the_whole(soon, tmp_path):
    """A part does not know the tiles of the others: it keeps what it noted until the whole says what is needed."""
    from vmachining.engines.protocol import Share

    start = ColumnsFirst.of(STOCK, Options(chord=0.05))
    start.save(tmp_path / "start.npz")
    parts = [ColumnsFirst.load(tmp_path / "start.npz", share=Share(k, 2)) for k in range(2)]
    sweeps = list(slots(0.04 * (1 + j // 2) for j in range(100)))
    total = 0.0
    for k, sweep in enumerate(sweeps):
        total += start.summed([part.cut(sweep, k) for part in parts]).estimate
    assert total == pytest.approx(2 * 60 * 6 * 2.0, rel=3e-3)
    assert all(part.kept >= 100 for part in parts)
    for k, part in enumerate(parts):
        part.save(tmp_path / f"{k}.npz")
    whole = ColumnsFirst.join([ColumnsFirst.load(tmp_path / f"{k}.npz") for k in range(2)])
    needed = whole.in_use()
    assert needed.tolist() == [98, 99]
    for part in parts:
        part.forget_others(needed)
    assert all(part.kept <= 2 + 2 * 16 for part in parts)
    dovetail = Sweep.along(vm.Taper(diameter=10, taper_deg=-20, length=9), Line((-10, 5, -8), (70, 5, -8)))
    found = start.summed([part.cut(dovetail, 100) for part in parts])
    alone = ColumnsFirst.of(STOCK, Options(chord=0.05))
    for k, sweep in enumerate(islice(sweeps, 98, 100)):
        alone.cut(sweep, k)
    assert found.bracket == pytest.approx(alone.cut(dovetail, 100).bracket, rel=1e-6)
