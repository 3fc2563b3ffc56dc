"""One block told in several ways has one volume: what two engines or two tellings say of it must meet.

No judge of one kind sees everything: brackets of the same block turned with its stock, of its parts in time, of rays that know
no mesh, and of columns where the axis stands still."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.turned_blocks import HI, KINDS, LO, TOOLS, case_of, in_parts, turned
from vmachining.engines.columns import ColumnsEngine
from vmachining.engines.dexel import RayEngine
from vmachining.engines.mesh import MeshEngine
from vmachining.engines.protocol import NOTHING, Engine, Options, Removal
from vmachining.geometry import Line
from vmachining.stock import BoxStock, Stock
from vmachining.sweep import Pose, Sweep, Turn

BOX, OPTIONS = BoxStock(LO, HI), Options(chord=0.05)


def told(engine: Engine, earlier: list[Sweep], block: list[Sweep]) -> Removal:
    for sweep in earlier:
        engine.cut(sweep)
    total = NOTHING
    for sweep in block:
        total = total.plus(engine.cut(sweep))
    return total


def judged(seed: int) -> dict[str, Removal]:
    """What is said of one block."""
    case = case_of(seed)
    stock: Stock
    stock, moved = turned(case, seed)
    return {
        "mesh": told(MeshEngine.of(BOX, OPTIONS), case.earlier, [case.block]),
        "turned": told(MeshEngine.of(stock, OPTIONS), moved.earlier, [moved.block]),
        "parts": told(MeshEngine.of(BOX, OPTIONS), case.earlier, in_parts(case, 3)),
        "rays": told(RayEngine(BOX), case.earlier, [case.block]),
    }


def disagreeing(seed: int) -> str | None:
    said = judged(seed)
    lo, hi = max(r.lo for r in said.values()), min(r.hi for r in said.values())
    proven = all(said[name].proven for name in ("mesh", "turned", "parts"))
    return None if lo <= hi and proven else f"{seed} {case_of(seed).name}: {said}"


@pytest.mark.slow  # 6 s
def test_a_block_has_one_volume_however_it_is_told() -> None:
    found = [disagreeing(seed) for seed in range(1000, 1000 + len(KINDS) * len(TOOLS), 7)]
    assert [each for each in found if each] == []


@pytest.mark.long
def test_three_hundred_blocks_have_one_volume_however_they_are_told() -> None:
    """Five minutes."""
    found = [disagreeing(seed) for seed in range(300)]
    assert [each for each in found if each] == []


@pytest.mark.parametrize("tool", TOOLS)
def test_without_a_turn_brackets_meet_those_of_columns(tool: str) -> None:
    """A path of poses whose axis stands still, or turns by next to nothing, against proven columns along it."""
    start, end, up = np.array([-3.0, 0.5, -2.0]), np.array([-1.5, 1.0, -2.2]), np.array([0.0, 0.0, 1.0])
    truth = ColumnsEngine.of(BOX, Options()).cut(Sweep.along(TOOLS[tool], Line(start, end)))
    assert truth.proven
    for lean in (0.0, 1e-9):
        last = np.array([np.sin(lean), 0.0, np.cos(lean)])
        path = Turn.great_circle(Pose(start, up), Pose(end, last))
        said = MeshEngine.of(BOX, OPTIONS).cut(Sweep.along(TOOLS[tool], path))
        assert said.lo <= truth.hi and truth.lo <= said.hi and said.proven
