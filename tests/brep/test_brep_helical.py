"""Helices whose axis lies in the cutter: valid solids that hold the points of the sweep, and a closed form."""

from __future__ import annotations

from itertools import pairwise
from math import pi

import numpy as np
import pytest
from scipy.integrate import quad

from vmachining import BallNose, BullNose, FlatEnd, ProfileTool, Sweep, Taper
from vmachining.engines import brep
from vmachining.engines.brep import Blank, BlockChecker
from vmachining.engines.judges import Judge
from vmachining.engines.protocol import Removal
from vmachining.geometry import Arc
from vmachining.tool import Cutter

TOOLS: dict[str, Cutter] = {
    "flat": FlatEnd(diameter=10, length=40),
    "ball": BallNose(diameter=10, length=40),
    "bull": BullNose(diameter=10, corner_radius=2, length=40),
    "taper": Taper(diameter=6, corner_radius=1, taper_deg=10, length=30),
    "taper ball": Taper(diameter=6, corner_radius=3, taper_deg=10, length=30),
    "cone": ProfileTool(points=[[0, 0], [5, 5], [5, 30]]),
}
PATHS = {
    "full turn": Arc((3, 0, 0), (0, 0, 0), angle=2 * pi, rise=1),
    "down, clockwise, more than a turn": Arc((3, 0, 0), (0, 0, 0), angle=-2.5 * pi, rise=-2),
    "down, clockwise, two turns": Arc((3, 0, 0), (0, 0, 0), angle=-4 * pi, rise=-2),
    "axis on the wall": Arc((5, 0, 0), (0, 0, 0), angle=2 * pi, rise=-0.2),
    "axis beside the wall": Arc((5.2, 0, 0), (0, 0, 0), angle=2 * pi, rise=-0.2),
    "tiny": Arc((0.2, 0, 0), (0, 0, 0), angle=1, rise=0.1),
    "steep": Arc((3, 0, 0), (0, 0, 0), angle=1, rise=8),
    "steep, wide": Arc((6, 0, 0), (0, 0, 0), angle=2 * pi, rise=20),
}


CASES = [(name, motion) for name in TOOLS for motion in PATHS]


@pytest.mark.parametrize(
    ("name", "motion"),
    [pytest.param(*case, marks=[pytest.mark.long] if n % 3 else []) for n, case in enumerate(CASES)],
)
@pytest.mark.slow  # 4 s
def test_solids_hold_the_points_of_the_sweep(name: str, motion: str) -> None:
    from OCP.BRepClass3d import BRepClass3d_SolidClassifier
    from OCP.gp import gp_Pnt
    from OCP.TopAbs import TopAbs_State

    path = PATHS[motion]
    sweep = Sweep.along(TOOLS[name], path)
    parts = brep.solids(sweep)
    for part in parts:
        found = brep.inspect(part.shape)
        assert found.valid and found.closed
    lo, hi = sweep.bounds
    hi[2] = lo[2] + abs(path.rise) + 4.0  # where the axis and the cusp are, rather than the shaft
    points = np.random.default_rng(3).uniform(lo, hi, (800, 3))
    distance = sweep.signed_distance(points)
    order = np.argsort(np.abs(distance))[:60]
    points, distance = points[order], distance[order]
    held = np.zeros(len(points), dtype=bool)
    for part in parts:
        sorter = BRepClass3d_SolidClassifier(part.shape)
        for k in np.flatnonzero(~held):
            sorter.Perform(gp_Pnt(*points[k].tolist()), 1e-7)
            held[k] = sorter.State() == TopAbs_State.TopAbs_IN
    clear = np.abs(distance) > 1e-5
    assert (held == (distance < 0.0))[clear].all()
    assert 10 < np.count_nonzero(held) < 50  # both kinds of points were asked


def swept_area(r: float, rc: float, theta: float) -> float:
    """mm^2 swept by a disc carried around an arc: at distance s from the axis it spans theta + 2 g(s)."""

    def spanned(s: float) -> float:
        c = (s * s + rc * rc - r * r) / (2 * s * rc)
        g = 0.0 if c >= 1.0 else pi if c <= -1.0 else float(np.arccos(c))
        return s * min(2 * pi, theta + 2 * g) if g > 0.0 else 0.0

    cos = -np.cos(theta / 2)
    root = np.sqrt(max((rc * cos) ** 2 - rc**2 + r**2, 0.0))
    stops = sorted(
        {0.0, abs(rc - r), *(x for x in (rc * cos - root, rc * cos + root) if 0 < x < rc + r), rc + r}
    )
    return sum(quad(spanned, a, b, epsabs=1e-12)[0] for a, b in pairwise(stops))


def around(truth: float) -> list[Judge]:
    """A judge that knows it to a tenth."""
    return [Judge("mesh", Removal(0.9 * truth, truth, 1.1 * truth))]


@pytest.mark.parametrize("rc", [3.0, 6.0])
def test_a_helical_entry_of_a_flat_cutter_has_its_closed_form(rc: float) -> None:
    stock = Blank("box", (-20, -20, -15), (20, 20, 0))
    # the tip comes from 0.5 above: at depth x below the top, the last 0.5 - x of the turn is deep enough
    truth = quad(lambda x: swept_area(5.0, rc, 2 * pi * x), 0.0, 0.5, epsabs=1e-11)[0]
    first = Arc((rc, 0, 0.5), (0, 0, 0), angle=2 * pi, rise=-1)
    again = Arc((rc, 0, -0.5), (0, 0, 0), angle=2 * pi)
    work = BlockChecker(stock, [[Sweep.along(TOOLS["flat"], path)] for path in (first, again)])
    entry = work.check(0, around(truth)).removed_mm3
    assert entry == pytest.approx(truth, rel=1e-7)
    whole = 0.5 * swept_area(5.0, rc, 2 * pi)
    floor = work.check(1, around(whole - truth)).removed_mm3
    assert floor is not None
    assert entry + floor == pytest.approx(whole, rel=1e-6)
