"""The interval of the ray engine holds closed forms as often as it says, and the engine keeps the protocol's promises."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from closedforms import FAMILIES, HI, LO, case_of, engine_for, segment, slot
from scipy.stats import binom

from vmachining import Sweep
from vmachining.arrays import Floats, Ints
from vmachining.engines.dexel.rays import CONFIDENCE, RayEngine, lengths
from vmachining.engines.protocol import Removal
from vmachining.geometry import Line
from vmachining.job.brep import RayWitness
from vmachining.stock import BoxStock
from vmachining.tool import BallNose

RISK = 1e-4
"""Of a test that fails though the statement is true."""


def misses(seeds: range, want_rel: float, most: int) -> Counter[str]:
    """How often the truth lies outside, by family."""
    found: Counter[str] = Counter()
    for seed in seeds:
        case = case_of(seed)
        engine, members = engine_for(case, want_rel=want_rel, most=most)
        removal = engine.removed(members, seed=seed)
        assert removal.lo <= removal.estimate <= removal.hi
        found[case.name] += not removal.lo <= case.truth <= removal.hi
    return found


def allowed(count: int) -> int:
    """Misses of so many blocks that a true statement exceeds with the probability `RISK`."""
    return int(binom.ppf(1.0 - RISK, count, 1.0 - CONFIDENCE))


def test_closed_forms_lie_in_the_interval() -> None:
    seeds = range(20_000, 20_000 + 15 * len(FAMILIES))
    assert misses(seeds, 0.02, 1500).total() <= allowed(len(seeds))


@pytest.mark.long
def test_closed_forms_lie_in_the_interval_as_often_as_it_says() -> None:
    """10,000 blocks, about eight minutes: the rate itself can only be seen in many."""
    seeds = range(10_000)
    assert misses(seeds, 0.02, 1500).total() <= allowed(len(seeds)) == 6


@pytest.mark.parametrize("want_rel", [0.05, 0.01, 0.004])
def test_the_width_asked_for_is_about_reached(want_rel: float) -> None:
    """Slots of one motion: the pilot is a guess, so twice of it is allowed."""
    for seed in range(3):
        case = slot(np.random.default_rng(seed))
        engine, members = engine_for(case, want_rel=want_rel, most=40_000)
        removal = engine.removed(members, seed=seed)
        assert 0.5 * (removal.hi - removal.lo) <= 2.0 * want_rel * case.truth


def test_a_first_look_at_a_thin_chip_is_brief_and_the_second_is_not() -> None:
    """A ball's slot made 0.02 mm deeper: looks of few rays, as a run takes them at tools that turn."""
    tool, box = BallNose(diameter=6, length=40).profile, BoxStock((-10, -10, -10), (10, 10, 0))
    slots = [Sweep.along(tool, Line((-20, 0, z), (20, 0, z))) for z in (-1.0, -1.02)]
    truth = 20.0 * (segment(3.0, 1.02) - segment(3.0, 1.0))
    looks = RayWitness(box, [[sweep] for sweep in slots], want_rel=4e-3, most=400)
    brief, closer = (looks(1, again).removal for again in (False, True))
    assert brief.lo <= truth <= brief.hi and closer.lo <= truth <= closer.hi
    assert brief.width >= 5.0 * closer.width


def test_what_was_cut_is_not_cut_again_and_volumes_add_up() -> None:
    case = slot(np.random.default_rng(3))
    engine, _ = engine_for(case._replace(block=[]))
    before = engine.touch(case.block[0])
    first = engine.cut(case.block[0], 0)
    again = engine.cut(case.block[0], 1)
    assert before.lo <= case.truth <= before.hi and first.lo <= case.truth <= first.hi
    assert again.estimate == 0.0 and again.hi < 1e-2 * case.truth
    whole = engine.stock_volume.estimate
    assert engine.volume.estimate == pytest.approx(whole - first.estimate, rel=1e-12)
    assert engine.volume.lo <= whole - case.truth <= engine.volume.hi


def test_rays_of_which_nothing_is_left_are_asked_of_no_other_sweep(monkeypatch: pytest.MonkeyPatch) -> None:
    """Below an upright block lie two deeper passes, whose tops are below its own; the first of them has taken all."""
    ball, box = BallNose(diameter=10, length=40).profile, BoxStock((-20, -20, -20), (20, 20, 0))
    asked, crossed = list[int](), lengths._crossed

    def counted(body: Sweep, where: Floats, which: Ints, *ends: Floats) -> lengths._Parts:
        asked.append(len(which))
        return crossed(body, where, which, *ends)

    monkeypatch.setattr(lengths, "_crossed", counted)
    where = np.random.default_rng(0).uniform((-5, -4), (5, 4), (500, 2))
    deeper = [Sweep(ball, (-20, 0, z), (20, 0, z)) for z in (-6, -5)]
    assert not lengths.material(Sweep(ball, (-5, 0, -4), (5, 0, -4)), deeper, box, where).any()
    assert asked == [500, 500, 0]


def test_air_removes_nothing_and_that_is_proven() -> None:
    case = slot(np.random.default_rng(3))
    engine, _ = engine_for(case._replace(block=[]))
    lifted = Sweep.along(case.block[0].profile.shifted(50.0), case.block[0].path)
    assert engine.cut(lifted, 0) == Removal(0.0, 0.0, 0.0, proven=True)


def test_equal_blocks_are_asked_of_other_rays() -> None:
    """So that what the rays of one miss, those of the next find."""
    case = slot(np.random.default_rng(5))
    found = []
    for seed in (0, 1, 0):
        engine, members = engine_for(case)
        found.append(engine.removed(members, seed=seed))
    assert found[0] == found[2] != found[1]


def test_an_interrupted_engine_goes_on_as_if_nothing_happened(tmp_path: Path) -> None:
    case = case_of(1)
    engine, _ = engine_for(case._replace(block=[]))
    engine.save(tmp_path / "checkpoint")
    again = RayEngine.load(tmp_path / "checkpoint")
    assert again.cut(case.block[0], 1) == engine.cut(case.block[0], 1)


def test_the_surface_has_about_the_volume_that_is_left() -> None:
    """As good as its cells: a part of one at the border of the slot, and at the edges of the stock."""
    case = slot(np.random.default_rng(3))
    engine, _ = engine_for(case)
    surface = engine.surface()
    a, b, c = surface.vertices[surface.triangles].transpose(1, 0, 2)
    volume = float((a * np.cross(b, c)).sum() / 6.0)
    whole = float((HI - LO).prod())
    assert whole - volume == pytest.approx(case.truth, rel=0.01)  # 0.3 % off
