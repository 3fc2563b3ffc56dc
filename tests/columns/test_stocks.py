"""Stocks of facets: prisms over any outline, tops of facets, steps; against closed forms and other engines."""

from __future__ import annotations

import numpy as np
import pytest
from referee import ball, flat

import vmachining as vm
from vmachining.engines.columns import ColumnsEngine, FlatStock
from vmachining.engines.mesh import MeshEngine
from vmachining.engines.protocol import Options
from vmachining.errors import StockError
from vmachining.geometry import Line
from vmachining.stock import BoxStock, MeshStock
from vmachining.stock.shapes import prism
from vmachining.sweep import Sweep

BIG = vm.FlatEnd(diameter=200.0, length=60.0)
TRIANGLE = np.array([[0.0, 0.0], [30.0, 4.0], [7.0, 25.0]])


def line(tool, a, b) -> Sweep:
    return Sweep.along(tool, Line(a, b))


def wedge() -> MeshStock:
    """20 x 10 mm, 10 mm high at x = 0 and 5 at x = 20."""
    low = np.array([[0, 0, 0], [20, 0, 0], [20, 10, 0], [0, 10, 0.0]])
    points = np.concatenate([low, low + np.array([10.0, 5.0, 5.0, 10.0])[:, None] * [0, 0, 1]])
    quads = [(3, 2, 1, 0), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    return MeshStock(points, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]))


def test_a_plunge_wider_than_a_prism_takes_its_outline():
    stock = FlatStock.of(MeshStock(*prism(TRIANGLE, -9.0, 0.0)))
    found = ColumnsEngine(stock, 1e-4, 0.0).cut(line(BIG, (10, 10, 1), (10, 10, -4)))
    area = 0.5 * (30.0 * 25.0 - 4.0 * 7.0)
    assert found.lo <= 4.0 * area <= found.hi
    assert found.width <= 1.01e-4 * 4.0 * area


def test_a_level_cut_of_a_wedge():
    """Above 7 mm are 12 mm of its length, half of 3 mm on average."""
    engine = ColumnsEngine(FlatStock.of(wedge()), 1e-4, 0.0)
    found = engine.cut(line(BIG, (10, 5, 12), (10, 5, 7)))
    assert found.lo <= 0.5 * 3.0 * 12.0 * 10.0 <= found.hi
    assert found.width <= 1.01e-4 * 180.0
    assert engine.stock_volume.estimate == pytest.approx(1500.0, rel=1e-12)
    assert engine.volume.holds(1320.0)


def test_a_box_of_triangles_is_a_box():
    low, high = (-6.0, -5.0, -10.0), (7.0, 6.0, 0.0)
    tool, _, _ = ball()
    ways = [((-8, 0, -3), (9, 1, -5)), ((-8, 3, -3), (9, 2, -6)), ((0, 0, 1), (0, 0, -9))]
    engines = [
        ColumnsEngine(s, 0.01)
        for s in (FlatStock.of(MeshStock(*BoxStock(low, high).mesh(0.0)[0])), FlatStock(low, high))
    ]
    for a, b in ways:
        one, other = (engine.cut(line(tool, a, b)) for engine in engines)
        assert one.lo == pytest.approx(other.lo, abs=1e-6) and one.hi == pytest.approx(other.hi, abs=1e-6)


def test_the_workpiece_of_one_job_is_the_stock_of_the_next():
    """What columns leave, as triangles: the next blocks agree with the mesh engine on the same triangles."""
    first = ColumnsEngine(FlatStock((0.0, 0.0, -10.0), (30.0, 20.0, 0.0)))
    tool, _, _ = flat()
    first.cut(line(tool, (-5, 6, -3), (35, 9, -3)))
    first.cut(line(tool, (20, -5, -12), (20, 8, -12)))
    surface = first.surface()
    left = MeshStock(surface.vertices, surface.triangles)
    columns, mesh = ColumnsEngine(FlatStock.of(left), 0.01), MeshEngine.of(left, Options(chord=0.1))
    for a, b in (((0, 4, -2), (30, 16, -4)), ((15, 10, 1), (15, 10, -6)), ((2, 2, -5), (28, 2, -5))):
        sweep = line(ball(4.0)[0], a, b)
        one, other = columns.cut(sweep), mesh.cut(sweep)
        assert max(one.lo, other.lo) <= min(one.hi, other.hi)
        assert one.width <= 0.0101 * one.estimate


def test_what_hangs_over_or_stands_on_a_slope_is_refused():
    upside_down = wedge()
    turned = MeshStock(upside_down.vertices * [1.0, -1.0, -1.0], upside_down.triangles)
    with pytest.raises(StockError, match="flat bottom"):
        FlatStock.of(turned)


def test_a_checkpoint_keeps_the_stock(tmp_path):
    tool, _, _ = flat()
    engine = ColumnsEngine(FlatStock.of(wedge()))
    engine.cut(line(tool, (0, 2, 6), (20, 2, 4)))
    engine.save(tmp_path / "state.npz")
    other = ColumnsEngine.load(tmp_path / "state.npz")
    sweep = line(tool, (0, 5, 6), (20, 6, 4))
    assert engine.cut(sweep) == other.cut(sweep)
    assert engine.volume == other.volume
