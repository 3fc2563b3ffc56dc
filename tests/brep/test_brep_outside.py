"""Rays through stocks of triangles and STEP: closed forms of slots in a wedge and in a drilled block."""

from __future__ import annotations

from pathlib import Path

import cadquery as cq
import numpy as np
import pytest

from vmachining import Bracket, FlatEnd, Sweep
from vmachining.arrays import Floats
from vmachining.engines.brep import Blank, Ladder
from vmachining.engines.brep.booleans import box_of
from vmachining.engines.brep.ladder import quiet
from vmachining.engines.brep.outside import MOST, Outside
from vmachining.engines.brep.rays import FIRST, Rays
from vmachining.geometry import Line

TOOL = FlatEnd(diameter=10, length=40)


def slot(depth: float) -> Sweep:
    """Along x through whatever lies between x = 0 and 30, 10 mm wide."""
    return Sweep.along(TOOL, Line((-20, 0, -depth), (50, 0, -depth)))


def wedge() -> Floats:
    """(8, 3, 3): between y = -20 and 20 and over z = -20; its roof rises from z = -2 at x = 0 to 0 at x = 30."""
    side = np.array([(0.0, -20.0), (30.0, -20.0), (30.0, 0.0), (0.0, -2.0)])
    near, far = (np.column_stack([side[:, 0], np.full(4, y), side[:, 1]]) for y in (-20.0, 20.0))
    faces = [near[[0, 1, 2]], near[[0, 2, 3]], far[[0, 2, 1]], far[[0, 3, 2]]]
    for i, j in ((0, 1), (1, 2), (2, 3), (3, 0)):
        faces += [np.stack([near[i], far[i], far[j]]), np.stack([near[i], far[j], near[j]])]
    return np.stack(faces)


def test_lines_outside_of_a_wedge_end_at_its_faces() -> None:
    """Beside it, and at two places of its roof, from origins of other heights; a line along a corner is either of them."""
    places = np.array([(-1.0, 0.0, 5.0), (7.5, 3.0, 5.0), (15.0, -19.0, 0.0), (30.0, 20.0, 0.0)])
    counts, enter, leave = Outside(wedge()).ray_intervals(places, (0.0, 0.0, 1.0))
    assert counts.tolist()[:3] == [1, 2, 2] and counts[3] in (1, 2)
    assert enter[:5].tolist() == [-np.inf, -np.inf, pytest.approx(-6.5), -np.inf, pytest.approx(-1.0)]
    assert leave[:5].tolist() == [np.inf, -25.0, np.inf, -20.0, np.inf]
    assert len(enter) == len(leave) == counts.sum()


def test_neighbours_agree_whose_a_line_is() -> None:
    """A fan over a square: lines at places of its edges, to the last bit, go through two triangles as everywhere else."""
    rng = np.random.default_rng(5)
    ring = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]) + 0.1 * rng.random((4, 2))
    apex, foot = np.array([0.5, 0.4, 1.0]), np.array([0.4, 0.5, -1.0])
    corner = np.column_stack([ring, np.zeros(4)])
    skin = [np.stack([corner[i], corner[(i + 1) % 4], apex]) for i in range(4)]
    skin += [np.stack([corner[(i + 1) % 4], corner[i], foot]) for i in range(4)]
    share = rng.random((4000, 1))
    on_edges = apex + share * (corner[rng.integers(4, size=4000)] - apex)
    found = Outside(np.stack(skin)).ray_intervals(on_edges * (1.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    assert (found.counts == 2).all()
    assert np.allclose(found.enter[1::2], on_edges[:, 2], atol=1e-12)


def test_long_triangles_across_the_raster_keep_it_small() -> None:
    """A double cone of 2 x 10,000 slices: boxes of them cover it a thousand times. Its heights are those of cones, to 5e-8."""
    angle = np.linspace(0.0, 2.0 * np.pi, 10_000, endpoint=False)
    here = np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    there = np.roll(here, -1, axis=0)
    tips = np.broadcast_to([[[0.0, 0.0, 1.0]], [[0.0, 0.0, -1.0]]], (2, *here.shape))
    outside = Outside(
        np.concatenate([np.stack([here, there, tips[0]], axis=1), np.stack([there, here, tips[1]], axis=1)])
    )
    assert len(outside._member) <= MOST
    places = np.random.default_rng(3).uniform(-0.7, 0.7, (2000, 3)) * (1.0, 1.0, 0.0)
    found = outside.ray_intervals(places, (0.0, 0.0, 1.0))
    height = 1.0 - np.hypot(*places[:, :2].T)
    assert (found.counts == 2).all()
    assert np.abs(found.enter[1::2] - height).max() < 1e-7 > np.abs(found.leave[::2] + height).max()


def test_a_slot_in_a_wedge_of_triangles() -> None:
    """At 1 mm deep it is 15 mm long and 0 to 1 mm deep; a slot across it takes 10 mm of that."""
    stock = Blank("triangles", triangles=tuple(map(tuple, wedge().reshape(-1, 9).tolist())))
    across = Sweep.along(TOOL, Line((25, -40, -1), (25, 40, -1)))
    outside = Outside.of(stock)
    for earlier, truth in (([], 75.0), ([across], 75.0 - 10.0 * 10.0 * (5.0 + 15.0) / 2.0 / 15.0)):
        told = Rays([(slot(1.0), earlier)], stock, box_of(stock.shape()), outside).told(FIRST)
        assert abs(told.volume - truth) <= told.far < 0.4
    quiet()
    work = Ladder(stock, [[slot(1.0)]])
    assert work.removed(0, Bracket(70.0, 75.0, 80.0)).removed_mm3 == pytest.approx(75.0, rel=1e-6)


def test_a_step_stock_is_exact_away_from_its_curved_faces(tmp_path: Path) -> None:
    """A block with a hole through it: a slot beside the hole, and one that meets it, of which rays say nothing."""
    part = cq.Workplane("XY").box(30, 40, 20, centered=(False, True, False)).translate((0, 0, -20))
    part = part.faces(">Z").workplane(origin=(15, 14, 0)).hole(6.0)
    file = tmp_path / "part.step"
    cq.exporters.export(part, str(file))
    stock = Blank("step", file=str(file))
    outside, box = Outside.of(stock), box_of(stock.shape())
    beside, through = (Line((-20, y, -1), (50, y, -1)) for y in (0, 10))
    bracket = Bracket(285.0, 300.0, 315.0)
    heard = Rays([(Sweep.along(TOOL, beside), [])], stock, box, outside).heard(300.0, 0.0, bracket)
    assert heard.stands and abs(heard.volume - 300.0) <= heard.far < 1.5
    hole = 9.0 * np.arccos(-1.0 / 3.0) + np.sqrt(8.0)  # of radius 3, as far as 1 mm beyond its centre
    assert (
        Rays([(Sweep.along(TOOL, through), [])], stock, box, outside).heard(1.0, 0.0, bracket).far == np.inf
    )
    quiet()
    work = Ladder(stock, [[Sweep.along(TOOL, beside)], [Sweep.along(TOOL, through)]])
    verdict = work.removed(0, bracket)
    assert verdict.removed_mm3 == pytest.approx(300.0, rel=1e-6) and verdict.sure_mm3 is None
    verdict = work.removed(1, Bracket(275.0 - hole, 300.0 - hole, 325.0 - hole))
    assert verdict.removed_mm3 == pytest.approx(300.0 - hole, rel=1e-6) and verdict.sure_mm3 == np.inf


def test_a_value_of_a_step_stock_that_lies_in_its_bracket_is_held_against_rays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What all ways of cutting find is made 1 % too large: rays contradict them, and meshes and sections are right."""
    file = tmp_path / "block.step"
    cq.exporters.export(cq.Workplane("XY").box(30, 40, 20).translate((15, 0, -10)), str(file))
    quiet()
    work = Ladder(Blank("step", file=str(file)), [[slot(1.0)]])
    real = work._climb
    monkeypatch.setattr(work, "_climb", lambda plans, rung: (1.01 * real(plans, rung)[0], 0, 1e-3))
    verdict = work.removed(0, Bracket(285.0, 300.0, 315.0))
    assert verdict.rung in ("facets", "sections")
    assert verdict.removed_mm3 == pytest.approx(300.0, abs=-verdict.slack_mm3)
    assert len(verdict.tried) > 2
