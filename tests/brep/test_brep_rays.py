"""Rays that judge removed volumes: closed forms, thin skins, faces they only touch; and where they stand."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from vmachining import BallNose, Bracket, FlatEnd, Sweep
from vmachining.bench.brep_chains import bar_of, chain_of
from vmachining.engines.brep import Blank, Ladder, Status
from vmachining.engines.brep.booleans import box_of
from vmachining.engines.brep.ladder import quiet
from vmachining.engines.brep.rays import FINER, FIRST, NOTHING, SHARP, Rays, Told, _divided, left
from vmachining.engines.mesh import MeshEngine, box_stock
from vmachining.geometry import Line
from vmachining.sweep.candidates import columns

BOX = Blank("box", (0, -20, -20), (30, 20, 0))
TOOL = FlatEnd(diameter=10, length=40)


@pytest.mark.parametrize("number", [0, 1, 2, 3, 5, 6])
def test_a_block_takes_nothing_beside_its_columns(number: int) -> None:
    """Chains of the gauntlet, one family each: places all over the sweep, and what uprights lose there, as deep as is said."""
    bar = bar_of([number])
    chain = chain_of(1, number, MeshEngine(box_stock(tuple(bar[0]), tuple(bar[1])), 0.05, certify=True))
    rng, seen = np.random.default_rng(number), 0
    for k in range(1, min(len(chain.sweeps), 8)):
        sweep, earlier = chain.sweeps[k], chain.sweeps[:k]
        box = np.stack([np.maximum(sweep.bounds[0], bar[0]), np.minimum(sweep.bounds[1], bar[1])])
        places = rng.uniform(box[0, :2], box[1, :2], (4000, 2))
        lost = left(sweep, earlier, places, *box[:, 2].tolist())
        found = columns(sweep, earlier, box, 3000)
        keys = np.round((found.low - box[0, :2]) / found.side).astype(int).tolist()
        raster = {tuple(key): tall for key, tall in zip(keys, found.tall.tolist(), strict=True)}
        assert len(raster) == len(found.low)
        stands = np.floor((places[lost > 1e-9] - box[0, :2]) / found.side).astype(int).tolist()
        assert all(tuple(key) in raster for key in stands)
        assert all(
            deep <= raster[tuple(key)] for key, deep in zip(stands, lost[lost > 1e-9].tolist(), strict=True)
        )
        assert len(found.low) * found.side.prod() < 1.001 * np.ptp(box[:, :2], axis=0).prod()
        seen += len(stands)
    assert seen > 300


def test_rays_know_boxes_and_cylinders_and_what_they_miss() -> None:
    """Slots that cross: 10 x 1 x 30 mm less 10 x 1 x 10; a slot along the diameter of a bar."""
    along, across = (
        Sweep.along(TOOL, path)
        for path in (Line((-20, 0, -1), (50, 0, -1)), Line((15, -40, -1), (15, 40, -1)))
    )
    bar = Blank("cylinder", (0, 0, -20), (0, 0, 0), center=(15.0, 0.0), radius=9.0)
    slot = 2 * (5 * np.sqrt(81 - 25) + 81 * np.arcsin(5 / 9))
    for stock, earlier, truth in (
        (BOX, [], 300.0),
        (BOX, [across], 200.0),
        (bar, [], slot),
        (bar, [across], slot - 100.0),
    ):
        told = Rays([(along, earlier)], stock, box_of(stock.shape())).told(FIRST)
        assert abs(told.volume - truth) <= told.far < 1e-2 * truth


def test_rays_that_contradict_a_value_are_asked_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """100 +- 0.1 first, 100 +- 0.1 again: 2.5 of it are suspect, 6 too many; a bracket without any of that refutes them."""
    asked = list[int]()

    def told(_: Rays, count: int) -> Told:
        asked.append(count)
        return Told(100.0, 0.1, 0.0, 0.0)

    monkeypatch.setattr(Rays, "told", told)
    rays, bracket = Rays([], BOX, np.zeros((2, 3))), Bracket(90.0, 100.0, 110.0)
    assert rays.heard(100.2, 0.0, bracket).stands and asked == [FIRST]
    assert rays.heard(100.5, 0.0, bracket).stands and asked == [FIRST, FIRST, FINER]
    assert rays.heard(100.5, 0.6, bracket).stands
    assert not rays.heard(101.0, 0.0, bracket).stands
    nothing = rays.heard(101.0, 0.0, Bracket(100.7, 101.0, 110.0))
    assert (
        nothing[:3] == NOTHING[:3]
        and nothing.alarm == "rays find 100 +- 0.6 mm3, outside of the bracket: one of both is wrong"
    )
    asked.clear()
    assert rays.heard(100.0, 0.0, bracket, want=0.5).far == pytest.approx(0.6) and asked == [FIRST, FINER]
    asked.clear()
    assert rays.heard(100.0, 0.0, bracket, want=0.1).far == pytest.approx(0.6) and asked == [FIRST]  # no hope


def test_the_most_rays_asked_have_the_last_word(monkeypatch: pytest.MonkeyPatch) -> None:
    """100 +- 0.1, then 99.8 +- 0.02: a value that the first ones bear out does not stand once the finer ones were asked."""
    told = {FIRST: Told(100.0, 0.1, 0.0, 0.0), FINER: Told(99.8, 0.02, 0.0, 0.0)}
    monkeypatch.setattr(Rays, "told", lambda _, rank: told[rank])
    rays, bracket = Rays([], BOX, np.zeros((2, 3))), Bracket(90.0, 100.0, 110.0)
    assert rays.heard(100.1, 0.0, bracket).stands
    assert not rays.heard(100.1, 0.0, bracket, want=0.5).stands
    assert rays.heard(99.75, 0.0, bracket).stands
    rays._told[FINER] = told[FINER]  # asked before, for another value
    assert not rays.heard(100.1, 0.0, bracket).stands


def test_rays_get_as_sharp_as_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    """Standard errors of 0.1, 0.04, 0.01 mm3, and 2.5 of them to bear: no more are asked than need be, or can help."""
    errors, asked = {FIRST: 0.1, SHARP: 0.04, FINER: 0.01}, list[int]()

    def told(self: Rays, rank: int) -> Told:
        asked.append(rank)
        return self._told.setdefault(rank, Told(100.0, errors[rank], 0.0, 0.0))

    monkeypatch.setattr(Rays, "told", told)
    for sharp, ranks, blur in (
        (0.3, [1], 0.25),
        (0.2, [1, 2], 0.1),
        (0.05, [1, 2, 3], 0.025),
        (0.01, [1, 2], 0.1),
    ):
        asked.clear()
        seen = Rays([], BOX, np.zeros((2, 3))).heard(100.0, 0.0, Bracket(90.0, 100.0, 110.0), sharp=sharp)
        assert asked == ranks and seen.far == pytest.approx(6.0 / 2.5 * blur)
        assert seen.is_clear is (blur <= sharp)


def test_rays_of_a_pair_are_neighbours_and_change() -> None:
    """A raster of which a half is divided further: along x and along y, each place with one neighbour and with the other one."""
    corners = np.stack(np.meshgrid(np.arange(5), np.arange(4), indexing="ij"), axis=-1).reshape(-1, 2) * 0.5
    cells = _divided(corners, np.array([0.5, 0.5]), np.repeat([7.0, 9.0], 10), np.repeat([1, 2], 10))
    assert len(cells.low) == 50 and cells.side.prod(axis=1).sum() == pytest.approx(5.0)
    assert np.array_equal(cells.tall, np.where(cells.side[:, 0] == 0.5, 7.0, 9.0))
    partners = list[tuple[int, int]]()
    for turn, along in enumerate([[1, 0], [1, 0], [0, 1], [0, 1]]):
        for pair in range(int(cells.pair[:, turn].max()) + 1):
            members = np.flatnonzero(cells.pair[:, turn] == pair)
            assert len(members) <= 2
            if len(members) == 2:
                i, j = (int(member) for member in members)
                assert np.abs(cells.low[i] - cells.low[j]) == pytest.approx(cells.side[i] * along)
                assert cells.flip[i, turn] != cells.flip[j, turn]
                partners.append((i, j))
    assert len(set(partners)) == len(partners) and len({*sum(partners, ())}) == 50


def test_more_rays_stand_along_steps() -> None:
    """A slot over a slot, of flat ends: its chip ends at walls. Ranks agree with the closed form, and are ever sharper."""
    first, second = (Sweep.along(TOOL, Line((-20, y, -3), (15, y, -3))) for y in (0.0, 4.0))
    rays, truth = (
        Rays([(second, [first])], BOX, box_of(BOX.shape())),
        3.0 * (15.0 * 4.0 + 0.5 * lune(5.0, 4.0)),
    )
    told = [rays.told(rank) for rank in (FIRST, SHARP, FINER)]
    assert all(abs(each.volume - truth) <= each.far for each in told)
    assert told[0].spread > 5.0 * told[1].spread > 5.0 * told[2].spread
    assert told[2].unseen < told[0].unseen / 8.0


def test_few_rays_decide_where_many_take_too_long() -> None:
    """A groove of a ball, and a value five standard errors off: more rays refute it, and 5 % too much are always too much."""
    sweep = Sweep.along(BallNose(diameter=10, length=40), Line((-20, 0, -1), (50, 0, -1)))
    truth = 30.0 * (25.0 * np.arccos(0.8) - 12.0)  # of a circle, 1 mm of its radius of 5
    bracket = Bracket(0.9 * truth, truth, 1.1 * truth)
    for seconds, stands in ((np.inf, False), (1e-9, True)):
        rays = Rays([(sweep, [])], BOX, box_of(BOX.shape()))
        first = rays.told(FIRST)
        assert abs(first.volume - truth) <= first.far
        value = first.volume + np.sign(first.volume - truth) * 5.0 * first.spread
        assert rays.heard(value, 0.0, bracket, seconds=seconds).stands is stands
        assert (FINER in rays._told) is not stands
        assert not rays.heard(1.05 * truth, 0.0, bracket, seconds=seconds).stands


@pytest.mark.parametrize(("length", "wide", "deep", "angle"), [
    (300.0, 0.02, 20.0, 45.0), (300.0, 0.005, 20.0, 45.0), (60.0, 0.01, 20.0, 45.0), (150.0, 0.02, 15.0, 30.0),
    (300.0, 0.002, 20.0, 0.3),
])  # fmt: skip
def test_rays_do_not_contradict_a_skin_on_a_wall(
    length: float, wide: float, deep: float, angle: float
) -> None:
    """Two slots side by side at an angle to the rays' raster: few rays find the second one, some none; plain cuts are right.

    The truth is of the second slot less the first: a strip, and at its ends what a circle of the tool's radius moves.
    """
    along = length * np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0])
    start, aside = np.array([20.0, 20.0, -deep]), wide * np.array([-along[1], along[0], 0.0]) / length
    first, second = (Sweep.along(TOOL, Line(p, p + along)) for p in (start, start + aside))
    stock = Blank("box", (0, 0, -60), (400, 400, 0))
    quiet()
    truth = length * wide * deep + deep * lune(5.0, wide)
    verdict = Ladder(stock, [[first], [second]]).removed(1, Bracket(0.95 * truth, truth, 1.05 * truth))
    assert verdict.status is Status.AGREED and verdict.removed_mm3 == pytest.approx(truth, rel=1e-5)
    told = Rays([(second, [first])], stock, box_of(stock.shape())).told(FIRST)
    assert abs(told.volume - truth) <= told.far


@pytest.mark.parametrize("wide", [1e-5, 1e-6])
def test_rays_that_find_nothing_allow_what_hides_between_them(wide: float) -> None:
    """A plunge beside a plunge: 15 mm of a lune that no ray of any set meets."""
    first, second = (Sweep.along(TOOL, Line((x, 0, 5), (x, 0, -15))) for x in (15.0, 15.0 + wide))
    rays, truth = Rays([(second, [first])], BOX, box_of(BOX.shape())), 15.0 * lune(5.0, wide)
    told = rays.told(FIRST)
    assert told.volume == 0.0 and 1e3 * told.rounding < told.far
    assert rays.heard(truth, 0.0, Bracket(0.0, truth, 1.0)).stands
    assert not rays.heard(1.0, 0.0, Bracket(0.0, truth, 1.0)).stands


def lune(radius: float, shift: float) -> float:
    """mm^2 of a circle moved sideways that the circle before did not cover."""
    half = shift / 2.0
    common = 2.0 * radius**2 * np.arccos(half / radius) - half * np.sqrt(4.0 * radius**2 - shift**2)
    return float(pi * radius**2 - common)


@pytest.mark.parametrize("wide", [0.0, 0.001, 0.02, 0.05, 5.0])
def test_rays_know_a_box_to_the_last_bit(wide: float) -> None:
    """A face is skimmed, or only touched: sets of rays do not scatter there, and the box is no wider than it is."""
    skim = Sweep.along(TOOL, Line((-20, -25 + wide, -20), (50, -25 + wide, -20)))
    truth = 30.0 * wide * 20.0
    verdict = Ladder(BOX, [[skim]]).removed(0, Bracket(truth, truth, truth))
    assert verdict.rung == "plain" and verdict.removed_mm3 == pytest.approx(truth, rel=1e-6, abs=1e-6)


def test_equal_motions_of_one_block_are_asked_of_other_rays() -> None:
    """A block of eight plunges: pi/4 d^2 each, and an error that is less than eight times that of one."""
    holes = [Sweep.along(TOOL, Line((x, y, 5), (x, y, -3))) for x in (6, 17) for y in (-15, -5, 5, 15)]
    told = Rays([(hole, []) for hole in holes], BOX, box_of(BOX.shape())).told(FIRST)
    one = Rays([(holes[0], [])], BOX, box_of(BOX.shape())).told(FIRST)
    assert abs(told.volume - 8 * 75 * pi) <= told.far
    assert told.spread < 5.0 * one.spread


def test_equal_blocks_are_asked_of_other_rays() -> None:
    """A plunge, by four blocks and by one of them again: a block hears the same twice, others hear of their own rays."""
    hole = Sweep.along(TOOL, Line((6, -15, 5), (6, -15, -3)))
    told = [
        Rays([(hole, [])], BOX, box_of(BOX.shape()), block=block).told(FIRST) for block in (0, 1, 2, 3, 0)
    ]
    assert all(abs(each.volume - 75 * pi) <= each.far for each in told)
    assert told[4] == told[0] and len({each.volume for each in told}) == 4
