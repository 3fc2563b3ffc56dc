"""The mesh engine against closed forms: brackets, conservation, air, splitting, rigid motion."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from vmachining.engines.mesh import MeshEngine, StockMesh, box_stock, solid
from vmachining.errors import StockError
from vmachining.geometry import Arc, Line
from vmachining.interval import Interval
from vmachining.stock import CylinderStock, closed_mesh
from vmachining.sweep import Sweep
from vmachining.tool import BallNose, BullNose, FlatEnd, Taper

TOOLS = {
    "flat": FlatEnd(diameter=10, length=30),
    "ball": BallNose(diameter=10, length=30),
    "bull": BullNose(diameter=10, corner_radius=2, length=30),
    "taper": Taper(diameter=6, taper_deg=8, corner_radius=1, length=30),
}
PATHS = {
    "level": Line((0, 0, 0), (12, 5, 0)),
    "ramp": Line((0, 0, 0), (12, 5, -4)),
    "plunge": Line((0, 0, 0), (0, 0, -6)),
    "retract": Line((0, 0, 0), (3, 0, 9)),
    "arc": Arc((15, 0, 0), (0, 0, 0), angle=1.3),
    "arc about the inside": Arc((2, 0, 0), (0, 0, 0), angle=-2.0),
    "circle": Arc((15, 0, 0), (0, 0, 0), angle=2 * np.pi),
    "helix": Arc((15, 0, 0), (0, 0, 0), angle=-1.0, rise=-3.0),
}


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("tool", TOOLS)
def test_sweeps_lie_between_their_inner_and_outer_solid(tool: str, path: str) -> None:
    sweep = Sweep.along(TOOLS[tool].profile, PATHS[path])
    inner, fair, outer = (solid(sweep, 0.02, side).volume() for side in ("inner", "fair", "outer"))
    assert inner <= fair <= outer
    if sweep.volume is not None:  # closed form or converged flux
        assert inner <= sweep.volume * (1 + 1e-10)
        assert outer >= sweep.volume * (1 - 1e-10)


@pytest.mark.parametrize("tool", TOOLS)
def test_bracket_shrinks_with_the_chord(tool: str) -> None:
    sweep = Sweep.along(TOOLS[tool].profile, PATHS["ramp"])
    assert sweep.volume is not None
    width, error = [], []
    for chord in (0.08, 0.02):
        inner, fair, outer = (solid(sweep, chord, side).volume() for side in ("inner", "fair", "outer"))
        width.append(outer - inner)
        error.append(abs(fair - sweep.volume) / sweep.volume)
    assert width[1] < 0.5 * width[0]  # first order in the chord: a quarter, but numbers of facets are whole
    assert error[1] < 1e-4


def test_slots_with_closed_forms_lie_in_their_brackets() -> None:
    through = Line((5, -3, 6), (5, 13, 6))
    for tool, exact in (
        (FlatEnd(diameter=4, length=20), 160.0),
        (BallNose(diameter=4, length=20), (2 * np.pi + 8) * 10),
    ):
        engine = MeshEngine(box_stock((0, 0, 0), (10, 10, 10)), 0.01)
        bracket = engine.cut(Sweep.along(tool.profile, through)).bracket
        assert bracket.holds(exact)
        assert bracket.width < 0.01 * exact
        assert abs(bracket.estimate - exact) < 1e-4 * exact


def chain(engine: MeshEngine, points: np.ndarray, tool: BallNose) -> np.ndarray:
    return np.array([engine.cut(Sweep.along(tool.profile, Line(a, b))).bracket for a, b in pairwise(points)])


ZIGZAG = np.array([[-8.0, 3, -1], [28, 3, -1], [28, 5, -2], [-8, 5, -1], [-8, 7, -1.5], [28, 8, -3]])


def test_volume_is_conserved_and_a_second_cut_removes_nothing() -> None:
    engine = MeshEngine(box_stock((0, 0, -10), (20, 15, 0)), 0.02, tile_mm=4)
    tool = BallNose(diameter=6, length=40)
    removed = chain(engine, ZIGZAG, tool)
    lost = engine.stock_volume.estimate - engine.volume.estimate
    assert removed[:, 1].sum() == pytest.approx(lost, rel=1e-9)
    assert (removed[:, 0] <= removed[:, 1]).all() and (removed[:, 1] <= removed[:, 2]).all()
    again = chain(engine, ZIGZAG, tool)
    assert again[:, 1].sum() <= 1e-9 * lost
    assert engine.cut(Sweep.along(tool.profile, Line((0, 0, 5), (20, 15, 5)))).bracket == Interval(
        0.0, 0.0, 0.0
    )


def test_tiles_and_splitting_change_no_volume_beyond_the_bracket() -> None:
    tool = BallNose(diameter=6, length=40)
    sums = []
    for tile, parts in ((40.0, 1), (5.0, 1), (2.5, 1), (5.0, 7)):
        engine = MeshEngine(box_stock((0, 0, -10), (20, 15, 0)), 0.02, tile_mm=tile)
        points = np.concatenate(
            [Line(a, b).position(np.linspace(0, 1, parts + 1)[:-1]) for a, b in pairwise(ZIGZAG)]
            + [ZIGZAG[-1:]]
        )
        sums.append(chain(engine, points, tool).sum(axis=0))
    assert np.ptp([s[1] for s in sums[:3]]) < 1e-9 * sums[0][1]  # tiles only change the rounding
    assert sums[3][0] <= sums[0][2] and sums[0][0] <= sums[3][2]


def test_rigid_motion_changes_nothing_beyond_rounding() -> None:
    tool = BallNose(diameter=6, length=40)
    shift = np.array([100.5, -37.25, 12.0])
    here = chain(MeshEngine(box_stock((0, 0, -10), (20, 15, 0)), 0.02), ZIGZAG, tool)
    there_stock = box_stock(np.array([0, 0, -10]) + shift, np.array([20, 15, 0]) + shift)
    there = chain(MeshEngine(there_stock, 0.02), ZIGZAG + shift, tool)
    assert np.abs(here - there).max() < 1e-9 * here[:, 1].sum()


def test_a_saved_workpiece_goes_on_where_it_stopped(tmp_path) -> None:
    tool = BallNose(diameter=6, length=40)
    whole = MeshEngine(box_stock((0, 0, -10), (20, 15, 0)), 0.02)
    expected = chain(whole, ZIGZAG, tool)
    first = MeshEngine(box_stock((0, 0, -10), (20, 15, 0)), 0.02)
    done = chain(first, ZIGZAG[:3], tool)
    first.save(tmp_path / "half.npz")
    rest = chain(MeshEngine.load(tmp_path / "half.npz"), ZIGZAG[2:], tool)
    assert np.abs(np.concatenate([done, rest]) - expected).max() < 1e-9 * expected[:, 1].sum()


def test_round_stock_is_bracketed() -> None:
    engine = MeshEngine(StockMesh.of(CylinderStock((0, 0), 10.0, (0, 5))), 0.01)
    assert engine.stock_volume.holds(np.pi * 100 * 5)


def test_an_open_mesh_is_refused_with_a_count() -> None:
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]
    with pytest.raises(StockError, match="open"):
        closed_mesh(points, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 4]])
