"""Which answers of engines are bounds and which are stated."""

from __future__ import annotations

import pytest

from vmachining.engines.dexel import DexelEngine, RayEngine
from vmachining.engines.mesh import MeshEngine
from vmachining.engines.protocol import Options
from vmachining.engines.relay import ColumnsFirst
from vmachining.geometry import Line
from vmachining.stock import BoxStock
from vmachining.sweep import Pose, Sweep, Turn
from vmachining.tool import FlatEnd, ProfileTool

BOX = BoxStock((0, 0, -10), (40, 40, 0))
MILL = FlatEnd(diameter=6, length=30).profile
DRILL = ProfileTool(points=[(0.0, 0.0), (3.0, 1.5), (3.0, 30.0)]).profile
# leaning back while it rolls under its own bottom: the envelope of the disc folds
ROLLING = Sweep.along(
    MILL, Turn.great_circle(Pose((10, 10, -2), (0, 0, 1)), Pose((12, 10, -2), (0.28, 0, 0.96)))
)
ACROSS, AWAY = (Sweep.along(MILL, Line((5, y, -3), (15, y, -3))) for y in (10, 30))


def test_what_follows_an_unproven_block_is_unproven_where_they_meet(tmp_path) -> None:
    engine = MeshEngine.of(BOX, Options(chord=0.05))
    before = engine.cut(AWAY)
    assert before.proven and engine.volume.proven
    turning = engine.cut(ROLLING)
    assert turning.hi > 0.0 and not turning.proven and not engine.volume.proven
    engine.save(tmp_path / "half.npz")
    for each in (engine, MeshEngine.load(tmp_path / "half.npz")):
        assert not each.touch(ACROSS).proven and not each.cut(ACROSS).proven
        assert each.touch(AWAY).proven and not each.volume.proven


def test_columns_hand_on_what_is_not_proven() -> None:
    engine = ColumnsFirst.of(BOX, Options(chord=0.05))
    assert engine.cut(AWAY).proven and engine.cut(ROLLING).proven and engine.volume.proven
    assert not engine.cut(Sweep.along(DRILL, ROLLING.path)).proven and not engine.volume.proven
    assert not engine.cut(ACROSS).proven  # its box meets that of a block of the mesh engine
    assert engine.cut(Sweep.along(MILL, Line((30, 30, -3), (35, 30, -3)))).proven


@pytest.mark.parametrize("kind", [DexelEngine, RayEngine])
def test_a_workpiece_of_rays_is_stated(kind: type[DexelEngine] | type[RayEngine]) -> None:
    engine = kind(BOX, Options())
    assert engine.volume.proven
    assert not engine.cut(AWAY).proven
    assert engine.volume.lo <= 16000 - 10 * 6 * 3 - 3 * 3 * 3.1416 * 3 <= engine.volume.hi
    assert not engine.volume.proven and not (engine.volume + engine.stock_volume).proven
