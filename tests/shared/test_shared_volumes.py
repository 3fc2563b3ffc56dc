"""Removed volumes with a closed form, published outside this project, through the public interface."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import pytest

import vmachining as vm
from benchmarks.rays import capsule
from vmachining.engines.mesh import MeshEngine, StockMesh, box_stock

TABLE = Path(__file__).parents[3] / "shared" / "data" / "volumes.csv"
pytestmark = pytest.mark.skipif(not TABLE.is_file(), reason=f"no shared data: {TABLE} is absent")

CHORDS = (0.1, 0.02)


def truth(case: str) -> tuple[float, float]:
    """Value and its own tolerance, mm^3."""
    with TABLE.open(encoding="utf-8", newline="") as file:
        rows = {row["case"]: row for row in csv.DictReader(file)}
    return float(rows[case]["removed_mm3"]), float(rows[case]["tolerance"])


def cube() -> StockMesh:
    return box_stock((0, 0, 0), (10, 10, 10))


def plate() -> StockMesh:
    return box_stock((-10, -10, -30), (110, 110, 10))


SLOT = ((5, -3, 6), (5, 13, 6))
CUTS: dict[str, tuple[Callable[[], StockMesh], Callable[[], vm.Sweep]]] = {
    "through slot": (cube, lambda: vm.Sweep(vm.FlatEnd(diameter=4, length=30), *SLOT)),
    "ball plunge": (cube, lambda: vm.Sweep(vm.BallNose(diameter=4, length=30), (5, 5, 10), (5, 5, 6))),
    "ball slot": (cube, lambda: vm.Sweep(vm.BallNose(diameter=4, length=30), *SLOT)),
    "bull slot": (
        plate,
        lambda: vm.Sweep(vm.BullNose(diameter=20, corner_radius=5, length=60), (0, 0, 0), (100, 0, 0)),
    ),
}


@pytest.mark.parametrize("chord", CHORDS)
@pytest.mark.parametrize("case", CUTS)
def test_removed_volume_is_bracketed(case: str, chord: float) -> None:
    stock, sweep = CUTS[case]
    engine = MeshEngine(stock(), chord=chord)
    before = engine.volume
    bracket = engine.cut(sweep()).bracket
    value, tolerance = truth(case)
    assert bracket.holds(value, slack=tolerance)
    assert bracket.lo <= bracket.estimate <= bracket.hi
    assert before.estimate - engine.volume.estimate == pytest.approx(
        bracket.estimate, abs=1e-9 * before.estimate
    )
    assert engine.cut(sweep()).lo == 0.0  # what is gone is gone


@pytest.mark.parametrize("case", CUTS)
def test_bracket_shrinks_with_the_chord(case: str) -> None:
    stock, sweep = CUTS[case]
    wide, narrow = (MeshEngine(stock(), chord=chord).cut(sweep()).width for chord in CHORDS)
    assert narrow <= max(wide / 2, 1e-6)


def ball_alone() -> vm.Sweep:
    """A full ball of radius 0.2 mm without a shank: two arcs of a meridian."""
    r = 0.2
    whole = vm.Profile(points=[[0, 0], [r, r], [0, 2 * r]], centers=[[0, r], [0, r]], radii=[r, r])
    return vm.Sweep(whole, (0, 0, 0), (0.5, 0, 0))


@pytest.mark.parametrize("chord", CHORDS)
def test_swept_ball(chord: float) -> None:
    value, tolerance = truth("sphere sweep")
    bracket = vm.swept_volume(ball_alone(), chord=chord / 10)
    assert bracket.holds(value, slack=tolerance)
    assert bracket.estimate == pytest.approx(value, abs=tolerance)


def test_tilting_capsule() -> None:
    """The five-axis case: flux integral and closed form agree, and both with the table to 2 of its tolerances.

    The axis of the capsule fills a convex plane region, so the sweep is that region grown by the ball; the value in
    the table comes from random points and is 1.4 of its tolerances low.
    """
    sweep, exact = capsule()
    flux = sweep.flux()
    assert flux.volume == pytest.approx(exact, rel=1e-9)
    published, tolerance = truth("capsule 5-axis")
    assert abs(exact - published) < 2 * tolerance
    lo, estimate, hi = vm.swept_volume(sweep, chord=0.05)
    assert lo <= exact <= hi and estimate == pytest.approx(exact, rel=1e-9)
