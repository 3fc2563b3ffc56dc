"""Boolean values inside the bracket that are not true, and blocks around an instant at which the grazing curve jumps."""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice
from math import inf, pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vmachining import BallNose, Bracket, BullNose, FlatEnd, Job, Sweep
from vmachining.bench.brep_chains import bar_of, chain_of
from vmachining.bench.gauntlet import gauntlet_block
from vmachining.bench.referee import referee
from vmachining.engines.brep import (
    Blank,
    Ladder,
    Status,
    Verdict,
    solids,
    volume,
)
from vmachining.engines.brep import faceted as meshes
from vmachining.engines.brep.booleans import box_of
from vmachining.engines.brep.cover import Tries, _Work
from vmachining.engines.brep.ladder import quiet
from vmachining.engines.brep.rays import FINER, FIRST, SHARP, Heard, Rays, Told
from vmachining.engines.brep.rungs import (
    FACETS,
    MESHES,
    RAYS,
    RUNGS,
    SECTIONS,
    SOLIDS,
    STEADY,
    Clock,
    Found,
)
from vmachining.engines.mesh import MeshEngine, box_stock
from vmachining.geometry import Arc, Line
from vmachining.job.blocks import group_blocks
from vmachining.job.brep import _sweeps, blank, note_of
from vmachining.job.contact import ToolParts
from vmachining.job.reading import read_job_program
from vmachining.sweep import Pose, Turn
from vmachining.sweep.folds import poses, standing

BOX = Blank("box", (0, -20, -20), (30, 20, 0))
TOOL = FlatEnd(diameter=10, length=40)


def asked(number: int, block: int, rungs: tuple[str, ...] = RUNGS) -> tuple[Verdict, Bracket, float, float]:
    """Of a block of the chain gauntlet: its verdict and bracket, what rays say and their error bar."""
    bar = bar_of([number])
    engine = MeshEngine(box_stock(tuple(bar[0]), tuple(bar[1])), 0.02, certify=True)
    chain = chain_of(1, number, engine)
    stock = Blank("box", tuple(bar[0].tolist()), tuple(bar[1].tolist()))
    quiet()
    work, bracket = Ladder(stock, [[sweep] for sweep in chain.sweeps]), chain.brackets[block]
    rays, spread = referee(chain.sweeps, block, bar, 192)
    return work.removed(block, bracket, rungs=rungs), bracket, rays, spread


@pytest.mark.parametrize("block", [5, 9])
def test_a_value_inside_the_bracket_is_held_against_meshes(block: int) -> None:
    """Grooves of a taper beside each other: plain booleans give 0, fuzzy ones of one block are 0.5 % low."""
    verdict, bracket, rays, spread = asked(21, block)
    value = verdict.removed_mm3
    assert value is not None and bracket.holds(value, verdict.slack_mm3)
    assert abs(value - rays) <= spread + abs(verdict.slack_mm3)
    assert spread < 0.1 * (bracket.hi - bracket.lo)


def test_booleans_of_a_turning_tool_give_way_to_meshes_where_rays_contradict_them() -> None:
    """A taper that turns sharply: all booleans but grown ones find 0.02 to 0.7 % too much, near the estimate."""
    verdict, bracket, rays, spread = asked(146, 4, ("plain", "fuzzy 1e-05", "fuzzy 1e-03", *STEADY))
    assert verdict.rung == "facets" and verdict.removed_mm3 is not None
    assert spread < 5e-4 * rays
    for value in verdict.tried[1:3]:  # of booleans: no bracket tells that they are wrong
        assert value is not None and bracket.holds(value) and value > rays + 4.0 * spread
    assert abs(verdict.removed_mm3 - rays) <= spread - verdict.slack_mm3
    assert -verdict.slack_mm3 < 0.1 * (bracket.hi - bracket.lo)


@pytest.mark.parametrize("block", [242, 337])
def test_a_boolean_that_loses_a_sliver_of_a_chip_does_not_stand(block: int) -> None:
    """models/mould, 1 mm blocks of a ball: plain booleans are 0.15 % too low and 0.2 % too high, well inside any bracket."""
    job = Job.load(Path(__file__).parents[2] / "models" / "mould" / "job.toml")
    program, tools = read_job_program(job), {number: ToolParts.of(tool) for number, tool in job.tools.items()}
    cuts = islice(group_blocks(program, job.machine), block + 1)
    sweeps = [_sweeps(cut, program, tools, job.machine) for cut in cuts]
    stock, box = blank(job), box_of(blank(job).shape())
    quiet()
    rays, spread = referee(
        [sweep for cut in sweeps for sweep in cut], sum(map(len, sweeps[:block])), (box[0], box[1]), 256
    )
    assert spread < 1e-3 * rays
    work, bracket = Ladder(stock, sweeps), Bracket(0.96 * rays, rays, 1.04 * rays)
    plain = work.removed(block, bracket, rungs=("plain",))
    assert plain.status is Status.REFUSED and "is not true, rays find" in plain.reason
    assert abs(plain.tried[0] - rays) > spread  # type: ignore[operator]
    verdict = work.removed(block, bracket)
    assert verdict.removed_mm3 == pytest.approx(rays, abs=spread)


def test_a_bad_mesh_of_a_solid_says_so() -> None:
    """A bull nose that turns smoothly: OCCT's mesh lacks more at a sag of 2e-3 than at 4e-3, and 0.6 % of the value."""
    verdict, bracket, rays, spread = asked(5, 2, ("facets",))
    assert verdict.removed_mm3 is not None and spread < 1e-3 * rays
    assert abs(verdict.removed_mm3 - rays) <= spread - verdict.slack_mm3
    assert -verdict.slack_mm3 < 0.15 * (bracket.hi - bracket.lo)


def test_a_doubtful_helix_is_held_against_sections() -> None:
    """Far from the estimate of its bracket; OCCT's meshes of its sheets, which go up to the axis, may take minutes."""
    tool = BullNose(diameter=8, corner_radius=3, length=40)
    entry = Sweep.along(tool, Arc((17, 0, -0.2), (15, 0, 0), angle=-np.pi, rise=-0.6))
    heard = list[str]()
    work = Ladder(BOX, [[entry]])
    verdict = work.removed(0, Bracket(20.0, 21.0, 30.0), told=heard.append, barred=(RAYS,))
    assert heard == [SOLIDS, "plain", "sections"]
    rays, spread = referee([entry], 0, np.array([[0.0, -20.0, -20.0], [30.0, 20.0, 0.0]]), 96)
    assert verdict.removed_mm3 == pytest.approx(rays, abs=spread) and spread < 1e-3 * rays


def test_an_instant_at_which_the_curve_jumps_is_closed_in_on() -> None:
    """A tool that tilts as it leaves along its axis: parts ever shorter towards the instant, and poses around it.

    The union as a mesh against points by exact distances, wherever it is not nearer than mesh and poses can tell.
    """
    sweep = gauntlet_block(944)
    quiet()
    parts = [part.shape for part in solids(sweep)]
    lo, hi = sweep.bounds
    union = meshes.united(parts, [volume(part) for part in parts], 2e-3, np.stack([lo, hi])).solid
    points = np.random.default_rng(0).uniform(lo, hi, (400, 3))
    distance = sweep.signed_distance(points)
    clear = np.abs(distance) > 0.02 * sweep.profile.max_radius
    tiny = 1e-3
    for point, d in zip(points[clear], distance[clear], strict=True):
        ball = meshes.Manifold.cube([tiny] * 3, True).translate(point.tolist())
        inside = float((union ^ ball).volume()) > 0.5 * tiny**3
        assert inside == (d < 0.0), (point, d)
    assert clear.sum() > 200 and (distance[clear] < 0.0).any()


def test_poses_alone_cover_what_hardly_moves() -> None:
    """Beside the sharp rim of a flat end what poses miss falls with their distance, not with its square."""
    sweep = gauntlet_block(944)
    whole, short = sweep.path, sweep.path.part(0.5, 0.5 + 1e-6)
    assert poses(sweep.profile, whole, 3e-5, 16) is None  # type: ignore[arg-type]
    assert poses(sweep.profile, standing(whole, 0.5), 3e-5, 16) == 1  # type: ignore[arg-type]
    count = poses(sweep.profile, short, 3e-5, 16)  # type: ignore[arg-type]
    assert count is not None and 1 <= count <= 16


def test_a_body_is_not_taken_for_one_that_is_gone() -> None:
    """Bodies are remembered while the parts of a block are tried; memory that is free again holds other ones."""
    path = gauntlet_block(944).path
    work = _Work[float](path, lambda body, *_: [body.points[:, 0].max()], lambda *_: [], Tries())  # type: ignore[arg-type]
    for diameter in range(2, 40):
        assert work._built(BallNose(diameter=diameter, length=60).profile, 0.0, 1.0) == [diameter / 2]


class Says(Ladder):
    """A ladder whose steady rungs say what a test wants: (value, error) of facets, then of sections."""

    says: tuple[tuple[float, float], tuple[float, float]]

    def _faceted(self, *_: Any, told: Callable[[str], None], **__: Any) -> Found:
        told(MESHES)
        told(FACETS)
        return Found(FACETS, self.says[0][0], 1, -self.says[0][1], self.says[0][1])

    def _sectioned(self, *_: Any, **__: Any) -> Found:
        return Found(SECTIONS, self.says[1][0], 1, -self.says[1][1], self.says[1][1])


@pytest.mark.parametrize(("facets", "sections", "right", "sure"), [
    ((300.0, 1.0), (0.0, 0.0), "plain", 1.0),
    ((201.0, 101.0), (299.0, 2.0), "plain", 3.0),  # the first is too vague to tell anything
    ((199.0, 40.0), (299.0, 2.0), "plain", 3.0),  # and here it tells nothing of what is in the bracket
    ((280.0, 10.0), (0.0, 0.0), "facets", inf),  # it contradicts, and nobody else is there
    ((280.0, 101.0), (380.0, 101.0), "", inf),
])  # fmt: skip
def test_a_doubtful_value_stands_with_what_confirms_it(
    facets: tuple[float, float], sections: tuple[float, float], right: str, sure: float
) -> None:
    """Where rays are not to be had."""
    work = Says(BOX, [[Sweep.along(TOOL, Line((-10, 0, -1), (40, 0, -1)))]])
    work.says = (facets, sections)
    bracket = Bracket(200.0, 250.0, 400.0)  # 300, far from the estimate
    verdict = work.removed(0, bracket, rungs=("plain",), barred=(RAYS,))
    assert verdict.rung == right and (not right or verdict.sure_mm3 == pytest.approx(sure, abs=1e-9))
    assert right or "280 +- 1e+02 mm3 does not tell" in verdict.reason
    barred = work.removed(0, bracket, rungs=("plain",), barred=(RAYS, *STEADY))
    assert barred.status is Status.REFUSED and "facets: not asked again" in barred.reason


def test_a_value_in_a_tight_bracket_needs_nobody_to_bear_it_out() -> None:
    """300 mm3, far from the estimate for the width of the bracket, which is 3e-4 of it: meshes cannot tell as much. So does one
    of a later way, whatever tool it is of."""
    work = Says(BOX, [[Sweep.along(TOOL, Line((-10, 0, -1), (40, 0, -1)))]])
    work.says = ((300.0, 0.4), (300.0, 0.4))
    for wide, right in ((0.05, True), (0.5, False)):
        bracket = Bracket(300.0 - wide, 300.0 - 0.5 * wide, 300.0 + wide)
        for rung in ("plain", "turned"):
            verdict = work.removed(0, bracket, rungs=(rung,), barred=(RAYS,))
            assert (verdict.removed_mm3 is not None) is right
            assert not right or verdict.sure_mm3 is None


def deep(radius: float, up: float, aside: float) -> tuple[Blank, list[Sweep], float]:
    """A ball 20 mm deep in the stock that goes on along a pass it has made `up` higher, a step beside the last one: 1 mm long,
    its chip is the same curve moved, so `up` times `aside`. Swept before and by it, and the length of a mm."""
    tool = BallNose(diameter=2.0 * radius, length=60)
    rough = [Line((-10, y, up - 20), (50, y, up - 20)) for y in (-aside, 0.0, aside, 2.0 * aside)]
    fine = [
        Line((-10, -aside, -20), (50, -aside, -20)),
        Line((-10, 0, -20), (20, 0, -20)),
        Line((20, 0, -20), (21, 0, -20)),
    ]
    stock = Blank("box", (0, -20, -25), (40, 20, 0))
    return stock, [Sweep.along(tool, path) for path in (*rough, *fine)], up * aside


@pytest.mark.parametrize(("radius", "up", "aside"), [(5.0, 0.02, 0.5), (5.0, 0.05, 0.5), (3.0, 0.02, 0.2)])
def test_a_chip_much_smaller_than_the_slack_of_its_gate(radius: float, up: float, aside: float) -> None:
    """Plain cuts are 6e-4 to 1.8e-3 off. The gate is open by up to a sixth of the chip, as the cutter is deep in the stock: rays
    do not forgive that."""
    stock, sweeps, truth = deep(radius, up, aside)
    engine = MeshEngine(box_stock((0, -20, -25), (40, 20, 0)), 0.02, certify=True)
    brackets = [engine.cut(sweep, block=k) for k, sweep in enumerate(sweeps)]
    quiet()
    work, last = Ladder(stock, [[sweep] for sweep in sweeps]), len(sweeps) - 1
    plain = work.removed(last, brackets[last], rungs=("plain",))
    assert plain.status is Status.REFUSED and "is not true, rays find" in plain.reason
    assert plain.tried[0] is not None and abs(plain.tried[0] - truth) > 5e-4 * truth
    assert abs(plain.tried[0] - truth) < abs(plain.slack_mm3)
    verdict = work.removed(last, brackets[last])
    assert verdict.status is Status.RETRIED and verdict.sure_mm3 is not None
    assert (
        verdict.removed_mm3 == pytest.approx(truth, abs=verdict.sure_mm3) and verdict.sure_mm3 < 2e-3 * truth
    )


def test_a_value_that_rays_suspect_and_cannot_refute_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """300 mm3; rays tell 5e-4 of it apart and are sure of 1.2e-3 (6 standard errors): between these it stands with a note."""
    monkeypatch.setattr(
        Rays, "told", lambda self, rank: self._told.setdefault(rank, Told(300.0, 0.058, 0.0, 0.0))
    )
    work = Ladder(BOX, [[Sweep.along(TOOL, Line((-10, 0, -1), (40, 0, -1)))]])
    for value, status, sure in (
        (300.1, Status.AGREED, None),
        (300.25, Status.AGREED, 0.598),
        (300.4, Status.REFUSED, None),
    ):
        monkeypatch.setattr(Ladder, "_climb", lambda *_, v=value: Found("plain", v, 0, 1e-3, 1e-6))
        verdict = work.removed(0, Bracket(295.0, value, 305.0), rungs=("plain",))
        assert verdict.status is status
        assert verdict.sure_mm3 == (None if sure is None else pytest.approx(sure))
        assert ("within 0.6 mm3" in note_of(verdict)) is (sure is not None)


def test_meshes_that_rays_suspect_are_not_as_good_as_they_say(monkeypatch: pytest.MonkeyPatch) -> None:
    """Facets say 300.25 +- 0.01 mm3 and rays 300 +- 0.35: it stands, by itself or instead of a boolean, with a note."""
    monkeypatch.setattr(
        Rays, "told", lambda self, rank: self._told.setdefault(rank, Told(300.0, 0.058, 0.0, 0.0))
    )
    monkeypatch.setattr(Says, "_climb", lambda *_: Found("turned", 299.8, 0, 1e-3, 1e-6))
    work = Says(BOX, [[Sweep.along(TOOL, Line((-10, 0, -1), (40, 0, -1)))]])
    work.says = ((300.25, 0.01), (0.0, 0.0))
    for rung in ("facets", "turned"):
        verdict = work.removed(0, Bracket(295.0, 300.0, 305.0), rungs=(rung,))
        assert (verdict.rung, verdict.removed_mm3) == ("facets", 300.25)
        assert verdict.sure_mm3 == pytest.approx(0.25 + 6.0 * 0.058)
        assert "good to 0.01 mm3, rays alone say within 0.6 mm3" in note_of(verdict)


@pytest.mark.parametrize("off", [2e-3, 8e-3])
@pytest.mark.parametrize("rung", ["plain", "turned", FACETS])
def test_what_is_wrong_in_all_that_start_from_the_same_solids_is_told(
    rung: str, off: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A wall 0.3 mm thick across the rays' raster, of which the first rays tell a percent: solids, and so booleans, meshes
    and sections, are off by less."""
    along, aside = 20.0 * np.array([0.6, 0.8, 0.0]), 0.3 * np.array([-0.8, 0.6, 0.0])
    start = np.array([40.0, 40.0, -10.0])
    sweeps = [Sweep.along(TOOL, Line(p, p + along)) for p in (start, start + aside)]
    half = 0.15
    shared = 2.0 * (25.0 * np.arccos(half / 5.0) - half * np.sqrt(25.0 - half**2))
    truth = 10.0 * (20.0 * 0.3 + 25.0 * pi - shared)
    work = Says(Blank("box", (0, 0, -60), (100, 100, 0)), [[sweep] for sweep in sweeps])
    wrong = truth * (1.0 + off)
    monkeypatch.setattr(Says, "_climb", lambda *_: Found(rung, wrong, 1, 1e-3, 1e-6))
    work.says = ((wrong, 1e-3), (wrong, 1e-3))
    bracket = Bracket(0.9 * truth, truth, 1.1 * truth)
    verdict = work.removed(1, bracket, rungs=(rung,), longest=15.0, seconds=60.0)
    if verdict.removed_mm3 is not None:
        assert verdict.sure_mm3 is not None and verdict.sure_mm3 >= wrong - truth
        assert f"within {verdict.sure_mm3:.2g} mm3" in note_of(verdict)
    else:
        assert "is not true, rays find" in verdict.reason


@pytest.mark.parametrize("wide", [1e-4, 3e-4, 1e-3])
def test_a_skin_that_a_boolean_loses_from_a_wall_is_told(
    wide: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A ball 20 mm deep, 1 mm long, after a pass a little higher and aside: 0.7, 2 and 7 % of its chip are what its shank takes
    off the wall, up to a micrometre of 15 mm. Rays refute the rest, or say that they may miss as much."""
    tool, up = BallNose(diameter=10, length=60), 0.02
    first, last, own = (
        Line((a, y, z), (b, y, z))
        for a, b, y, z in ((-10, 50, -wide, up - 20), (-10, 20, 0, -20), (20, 21, 0, -20))
    )
    work = Ladder(
        Blank("box", (0, -20, -25), (40, 20, 0)), [[Sweep.along(tool, path)] for path in (first, last, own)]
    )
    rest, skin = 10.0 * up, 15.0 * wide  # what circle and wall are moved by, times a mm, to 1 % of the chip
    monkeypatch.setattr(Ladder, "_climb", lambda *_: Found("plain", rest, 1, 1e-3, 1e-6))
    bracket = Bracket(0.8 * rest, rest, 1.2 * rest)
    verdict = work.removed(2, bracket, rungs=("plain",), longest=15.0, seconds=60.0)
    if verdict.removed_mm3 is not None:
        assert verdict.sure_mm3 is not None and verdict.sure_mm3 > skin
    else:
        assert "is not true, rays find" in verdict.reason


@pytest.mark.parametrize("rung", ["plain", FACETS])
def test_what_may_hide_between_rays_is_told(rung: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """300 mm3, and rays that find it to 0.01; of 14 mm3 that may hide nothing is said, of 40 it is. Facets say 3 mm3 of
    themselves: that does not allow a hundred times as much."""
    work = Says(BOX, [[Sweep.along(TOOL, Line((-10, 0, -1), (40, 0, -1)))]])
    work.says = ((300.0, 3.0), (0.0, 0.0))
    for hidden, sure in ((14.0, None), (40.0, 40.06)):
        told = Told(300.0, 0.01, 0.0, hidden)
        monkeypatch.setattr(Rays, "told", lambda self, rank, told=told: self._told.setdefault(rank, told))
        verdict = work.removed(0, Bracket(270.0, 300.0, 330.0), rungs=(rung,))
        assert verdict.removed_mm3 == pytest.approx(300.0)
        assert verdict.sure_mm3 == (None if sure is None else pytest.approx(sure))
        assert ("within 40 mm3" in note_of(verdict)) is (sure is not None)


def test_meshes_are_judged_by_the_rays_that_were_asked_last(monkeypatch: pytest.MonkeyPatch) -> None:
    """Facets instead of a boolean stand for the first rays; the boolean, asked once more, has finer ones: these refute both."""
    told = [Told(301.0, 0.5, 0.0, 0.0), Told(290.0, 0.05, 0.0, 0.0)]
    asked = list[float]()

    def heard(_: Rays, value: float, error: float, *__: Any) -> Heard:
        asked.append(value)
        seen = told[asked.count(303.0) > 1]  # finer ones from the second time on
        return Heard(abs(value - seen.volume) <= error + seen.far, seen.volume, seen.far, True)

    monkeypatch.setattr(Rays, "heard", heard)
    monkeypatch.setattr(Says, "_climb", lambda *_: Found("turned", 303.0, 0, 1e-3, 1e-6))
    work = Says(BOX, [[Sweep.along(TOOL, Line((-10, 0, -1), (40, 0, -1)))]])
    work.says = ((300.0, 0.1), (0.0, 0.0))
    verdict = work.removed(0, Bracket(280.0, 300.0, 320.0), rungs=("turned",))
    assert verdict.status is Status.REFUSED and "rays find 290" in verdict.reason


def test_what_meshes_say_against_a_boolean_is_not_confirmed_without_rays() -> None:
    """By themselves or instead of it, the same is told."""
    work = Says(BOX, [[Sweep.along(TOOL, Line((-10, 0, -1), (40, 0, -1)))]])
    work.says = ((280.0, 0.01), (0.0, 0.0))
    for rung in (FACETS, "turned"):
        verdict = work.removed(0, Bracket(250.0, 300.0, 350.0), rungs=(rung,), barred=(RAYS,))
        assert (verdict.rung, verdict.removed_mm3, verdict.sure_mm3) == (FACETS, 280.0, inf)
        assert "good to 0.01 mm3, which rays cannot confirm" in note_of(verdict)


def test_a_value_is_judged_again_by_rays_that_another_one_made_be_asked(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """300 mm3 stands for the first rays. What facets find makes finer ones be asked: they refute it, whatever sections say."""
    few = Told(299.0, 0.5, 0.0, 0.0)
    told = {FIRST: few, SHARP: few, FINER: Told(297.0, 0.05, 0.0, 0.0)}

    def known(self: Rays, rank: int) -> Told:
        return self._told.setdefault(rank, told[rank])

    monkeypatch.setattr(Rays, "told", known)
    work = Says(BOX, [[Sweep.along(TOOL, Line((-10, 0, -1), (40, 0, -1)))]])
    work.says = ((295.0, 0.05), (299.9, 0.3))
    bracket = Bracket(290.0, 300.0, 310.0)
    verdict = work.removed(0, bracket, rungs=("turned",))
    assert (
        verdict.status is Status.REFUSED
        and "turned: 300 mm3 is not true, rays find 297 +- 0.3" in verdict.reason
    )
    monkeypatch.setattr(Says, "_is_turning", lambda *_: True)
    work.says = ((296.9, 0.05), (0.0, 0.0))
    verdict = work.removed(0, bracket, rungs=("plain",))
    assert (verdict.status, verdict.rung, verdict.removed_mm3) == (Status.RETRIED, "facets", 296.9)
    assert verdict.sure_mm3 == pytest.approx(0.05)


def test_meshes_for_other_blocks_do_not_count_for_this_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """As the driver counts: 100 s of meshes, 1 s of what comes before and after."""
    now, heard = [5.0], list[str]()
    monkeypatch.setattr("vmachining.engines.brep.rungs.process_time", lambda: now[0])
    clock = Clock(heard.append)
    for what, seconds in (("plain", 1.0), (FACETS, 0.0), (MESHES, 60.0), (MESHES, 40.0), (FACETS, 1.0)):
        clock.tell(what)
        now[0] += seconds
    assert clock.own() == pytest.approx(2.0) and heard == ["plain", FACETS, MESHES, MESHES, FACETS]


def test_rays_and_a_bracket_that_contradict_each_other_are_told_of(monkeypatch: pytest.MonkeyPatch) -> None:
    """A bracket without the truth of 300 mm3, and rays that find it: nobody knows which is wrong, and the note says so."""
    work = Says(BOX, [[Sweep.along(TOOL, Line((-10, 0, -1), (40, 0, -1)))]])
    monkeypatch.setattr(Says, "_climb", lambda *_: Found("plain", 270.0, 0, 1e-3, 1e-6))
    verdict = work.removed(0, Bracket(260.0, 270.0, 280.0))
    assert verdict.status is Status.AGREED and verdict.sure_mm3 == inf
    assert "rays find 30" in note_of(verdict) and "outside of the bracket" in note_of(verdict)


def test_a_doubtful_value_needs_rays_or_something_that_they_allow(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """300 mm3 and exact rays; then rays that can only say that 280 is wrong; then sections agree; then nobody can tell."""
    work = Says(BOX, [[Sweep.along(TOOL, Line((-10, 0, -1), (40, 0, -1)))]])
    work.says = ((280.0, 0.01), (280.0, 0.01))
    bracket = Bracket(200.0, 250.0, 400.0)
    verdict = work.removed(0, bracket)
    assert verdict.rung == "plain" and verdict.removed_mm3 == pytest.approx(300.0)
    assert verdict.sure_mm3 is not None and verdict.sure_mm3 < 4.0

    def heard(_: Rays, value: float, *__: Any) -> Heard:
        return Heard(abs(value - 300.5) < 15.0, 300.5, 15.0, True)

    monkeypatch.setattr(Rays, "heard", heard)
    verdict = work.removed(0, bracket)
    assert verdict.rung == "plain" and verdict.sure_mm3 == pytest.approx(15.5)
    work.says = ((280.0, 0.01), (300.0, 0.02))
    verdict = work.removed(0, bracket)
    assert verdict.rung == "plain" and verdict.sure_mm3 == pytest.approx(0.02, abs=1e-3)
    work.says = ((280.0, 0.01), (280.0, 0.01))

    def late(_: Rays, value: float, __: Any, ___: Any, want: float, *____: Any) -> Heard:
        return Heard(value > 290.0, 340.0, 50.0) if want < 50.0 else Heard(value > 290.0, 310.0, 20.0)

    monkeypatch.setattr(Rays, "heard", late)  # more of them, with less to ask for
    verdict = work.removed(0, bracket)
    assert verdict.rung == "plain" and verdict.sure_mm3 == pytest.approx(30.0)
    monkeypatch.setattr(Rays, "heard", lambda _, value, *__: Heard(value > 290.0, 340.0, 50.0))
    verdict = work.removed(0, bracket)
    assert verdict.status is Status.REFUSED
    assert verdict.reason.count("280 mm3 is not true, rays find 340 +- 50") == 2


def test_a_layer_thinner_than_the_sag_keeps_the_value_of_booleans() -> None:
    """A ball that leans and scratches 1e-3 mm deep; its bracket is a thousand times as wide as the truth."""
    radius, depth, run = 5.0, 1e-3, 24.0
    half = np.sqrt(2 * radius * depth - depth**2)
    segment = radius**2 * np.arccos(1.0 - depth / radius) - (radius - depth) * half
    truth = segment * run + pi * depth**2 * (3 * radius - depth) / 3
    axis = np.array([0.0, 0.3, 1.0]) / np.hypot(0.3, 1.0)
    first, last = (Pose(np.array([x, 0.0, radius - depth]) - radius * axis, axis) for x in (3.0, 3.0 + run))
    sweep = Sweep.along(BallNose(diameter=10, length=40), Turn.great_circle(first, last))
    verdict = Ladder(BOX, [[sweep]]).removed(0, Bracket(0.0, 0.05, 0.133))
    value, sure = verdict.removed_mm3, verdict.sure_mm3
    assert value is not None and sure is not None and abs(value - truth) < min(sure, 0.5 * truth)
