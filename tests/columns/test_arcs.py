"""Arcs and helices about level axes against closed forms; counts of random ones: `test_counts.py`.

Half circles of radius r in an upright plane. In a slice beside the plane a ball is a disc of radius w, a flat end a segment
of half width w, and what the slice loses has a closed form; over all slices by Gauss's rule in the angle asin(y / R).
"""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from referee import ball, flat

import vmachining as vm
from vmachining.engines.columns import ColumnsEngine, FlatStock
from vmachining.engines.protocol import NOTHING
from vmachining.errors import EngineError
from vmachining.geometry import Arc, Line
from vmachining.sweep import Sweep

WIDTH = 2e-3


def over_slices(radius: float, area) -> float:
    """Integral of area(w) over the slices."""
    x, weight = np.polynomial.legendre.leggauss(400)
    angle = 0.5 * pi * x
    return float((0.5 * pi * weight * radius * np.cos(angle) * area(radius * np.cos(angle))).sum())


def ring(r: float, above: float) -> np.ndarray:
    """Area of a half disc of radius r within `above` of its straight edge."""
    h = np.minimum(above, r)
    return h * np.sqrt(np.maximum(r * r - h * h, 0.0)) + r * r * np.arcsin(np.minimum(h / r, 1.0))


def half_circle(r: float, tip: float, axis: int, hill: bool, turn: float = pi) -> Arc:
    """About x or y, centre over the origin; `tip` is the height of the ends."""
    start = [-r, 0.0, tip] if axis == 1 else [0.0, -r, tip]
    way = 1.0 if (axis == 1) == hill else -1.0
    return Arc(start, (0.0, 0.0, tip), axis, angle=way * turn)


def box(top: float, bottom: float = -40.0) -> FlatStock:
    return FlatStock((-25.0, -25.0, bottom), (25.0, 25.0, top))


def check(found, exact: float) -> None:
    assert found.proven and found.note is None
    assert found.lo <= exact <= found.hi
    assert found.width <= WIDTH * exact


radii = pytest.mark.parametrize("r", [0.5, 3.0, 5.0, 9.0])
axes = pytest.mark.parametrize("axis", [0, 1])


@axes
@radii
def test_a_valley_of_a_ball_is_half_a_torus_and_what_is_above(r, axis):
    """pi / 2 (r + w)^2 in each slice: with Pappus, half of the outer side of a torus, and all over it."""
    tool, R, _ = ball()
    found = ColumnsEngine(box(0.0), WIDTH).cut(Sweep.along(tool, half_circle(r, -R, axis, hill=False)))
    exact = pi * R * r * r + 0.5 * pi**2 * r * R * R + 2.0 / 3.0 * pi * R**3
    assert exact == pytest.approx(over_slices(R, lambda w: 0.5 * pi * (r + w) ** 2), rel=1e-9)
    check(found, exact)


@axes
@radii
def test_a_valley_of_a_flat_end(r, axis):
    tool, R, _ = flat()
    found = ColumnsEngine(box(0.0), WIDTH).cut(Sweep.along(tool, half_circle(r, 0.0, axis, hill=False)))
    check(found, pi * R * R * r + pi * R * r * r)


@axes
@radii
def test_a_hill_of_a_ball(r, axis):
    """Under a tight hill only the ends are left; under a wide one a smaller hill between them."""
    tool, R, _ = ball()
    top = r + 1.0

    def area(w):
        wide = 0.5 * pi * np.maximum(r - w, 0.0) ** 2 - pi * w * w
        u = np.minimum(r, w)  # of each end, the part on its side of the middle
        tight = -2.0 * (0.25 * pi * w * w + 0.5 * (u * np.sqrt(w * w - u * u) + w * w * np.arcsin(u / w)))
        return top * 2.0 * (r + w) - np.where(w < r, wide, tight)

    found = ColumnsEngine(box(top), WIDTH).cut(Sweep.along(tool, half_circle(r, -R, axis, hill=True)))
    check(found, over_slices(R, area))


@axes
@radii
def test_a_hill_of_a_flat_end(r, axis):
    """Over each place the pose that is farthest from the middle and covers it."""
    tool, R, _ = flat()
    top = r + 1.0

    def area(w):
        s = np.minimum(w, r)
        return top * 2.0 * (r + w) - (r * r * np.arccos(s / r) - s * np.sqrt(r * r - s * s))

    found = ColumnsEngine(box(top), WIDTH).cut(Sweep.along(tool, half_circle(r, 0.0, axis, hill=True)))
    check(found, over_slices(R, area))


def test_a_full_circle_takes_what_its_lower_half_takes_and_its_upper_half_nothing():
    tool, R, _ = ball()
    exact = over_slices(R, lambda w: 0.5 * pi * (6.0 + w) ** 2)
    engine = ColumnsEngine(box(0.0), WIDTH)
    check(engine.cut(Sweep.along(tool, half_circle(6.0, -R, 1, hill=False, turn=2.0 * pi))), exact)
    assert engine.cut(Sweep.along(tool, half_circle(6.0, -R, 1, hill=True))).hi <= 1e-3 * exact


def test_a_valley_into_the_bottom():
    tool, R, _ = ball()
    found = ColumnsEngine(box(0.0, -4.0), WIDTH).cut(Sweep.along(tool, half_circle(6.0, -R, 1, hill=False)))
    check(found, over_slices(R, lambda w: ring(6.0 + w, 4.0)))


def test_an_arc_run_again_or_higher_takes_nothing():
    tool, R, _ = ball()
    engine = ColumnsEngine(box(0.0), WIDTH)
    way = Arc((-8.0, 0.0, -R), (0.0, 0.0, -R), 1, angle=-pi / 3, rise=2.0)
    engine.cut(Sweep.along(tool, way))
    back = Arc(way.end, way.center, 1, angle=pi / 3, rise=-2.0)
    assert engine.cut(Sweep.along(tool, back)) == NOTHING
    above = Arc(way.position(0.9) + [0, 0, 0.5], way.center + [0, 0, 0.5], 1, angle=0.3 * pi / 3, rise=-0.6)
    assert engine.cut(Sweep.along(tool, above)) == NOTHING


@pytest.mark.parametrize("make", [ball, flat])
@pytest.mark.parametrize("rise", [0.0, 7.0])
def test_a_helix_at_once_and_in_pieces(make, rise):
    tool, _, _ = make()
    way = Arc((-5.0, -3.0, -2.0), (0.0, 0.0, -4.0), 1, angle=-3.5, rise=rise)
    whole = ColumnsEngine(box(4.0), WIDTH).cut(Sweep.along(tool, way))
    parts = ColumnsEngine(box(4.0), WIDTH)
    found = [parts.cut(Sweep.along(tool, piece)) for piece in way.split([0.13, 0.4, 0.41, 0.8])]
    assert max(whole.lo, sum(p.lo for p in found)) <= min(whole.hi, sum(p.hi for p in found))


def test_a_helix_so_steep_that_it_is_a_plunge():
    """A turn of 1 nm radius, and one of 1 mm on which the tool falls by 30 m: a plunge as wide as the helix."""
    tool, r, _ = flat()
    narrow = Arc((1e-6, 0.0, 5.0), (0.0, 0.0, 5.0), angle=2.0 * pi, rise=-9.0)
    check(ColumnsEngine(box(0.0), WIDTH).cut(Sweep.along(tool, narrow)), 4.0 * pi * r * r)
    long = vm.FlatEnd(diameter=8.0, length=1e5)
    wide = Arc((1.0, 0.0, 3e4 - 4.0), (0.0, 0.0, 3e4 - 4.0), angle=2.0 * pi, rise=-3e4)
    found = ColumnsEngine(box(0.0), WIDTH).cut(Sweep.along(long, wide))
    assert found.lo <= 4.0 * pi * r * r <= found.hi <= 4.03 * pi * r * r


def test_an_arc_that_dips_so_deep_that_the_tool_sinks_is_refused():
    """Both ends are high enough."""
    short = vm.BallNose(diameter=10.0, length=8.0)
    engine = ColumnsEngine(box(0.0))
    sweep = Sweep.along(short, half_circle(6.0, -4.0, 1, hill=False))
    assert not engine.accepts(sweep)
    with pytest.raises(EngineError, match="dips below"):
        engine.cut(sweep)
    level = Line((-6.0, 0.0, -4.0), (6.0, 0.0, -4.0))
    assert engine.accepts(Sweep.along(short, level))
