"""The ladder: values of closed forms, of the mesh bracket, and what happens when OCCT is wrong, hangs or dies."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from itertools import pairwise
from math import pi
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np
import polars as pl
import pytest
from tinyjob import PROGRAM, SLOT_MM3, write_job

from vmachining import BallNose, Bracket, BullNose, FlatEnd, ProfileTool, Sweep
from vmachining.bench.brep_chains import bar_of, chain_of
from vmachining.cli.main import run as command
from vmachining.engines import brep
from vmachining.engines.brep import Blank, Ladder, Status, described, isolated, ladder, workers
from vmachining.engines.brep.booleans import box_of
from vmachining.engines.brep.rungs import MESHES, NEXT, RAYS, RUNGS, SOLIDS, STEADY
from vmachining.engines.brep.sections import integrated, level_area
from vmachining.engines.mesh import MeshEngine, box_stock
from vmachining.errors import EngineError, InputError, SweepError
from vmachining.geometry import Arc, Line
from vmachining.geometry.path import Path as ToolPath
from vmachining.job.brep import chosen, note_of, parse_brep
from vmachining.sweep.near import SweepIndex
from vmachining.sweep.reach import reaching

BOX = Blank("box", (0, -20, -20), (30, 20, 0))
ANY = Bracket(0.0, 0.0, 1e9)


def chain(tool: object, paths: list[ToolPath]) -> list[list[Sweep]]:
    return [[Sweep.along(tool, path)] for path in paths]  # type: ignore[arg-type]


def near(value: float, rel: float = 1e-6) -> Bracket:
    return Bracket(value * (1 - rel), value, value * (1 + rel))


def test_through_slots_have_their_closed_form() -> None:
    across = [Line((-10, 0, -1), (40, 0, -1))]
    half = np.sqrt(25 - 16)
    segment = 25 * np.arccos(4 / 5) - 4 * half
    cases = [
        (FlatEnd(diameter=10, length=40), 300.0),
        (BallNose(diameter=10, length=40), 30 * segment),
        (BullNose(diameter=10, corner_radius=1, length=40), 30 * (10 - (2 - pi / 2))),
    ]
    for tool, truth in cases:
        verdict = Ladder(BOX, chain(tool, across)).removed(0, near(truth))
        assert verdict.status is Status.AGREED
        assert verdict.removed_mm3 == pytest.approx(truth, rel=1e-9)


def test_a_bar_turns_round_and_a_second_pass_finds_nothing() -> None:
    bar = Blank("cylinder", (0, 0, -10), (0, 0, 0), center=(0, 0), radius=12)
    around = Arc((15, 0, -4), (0, 0, -4), angle=2 * pi)
    work = Ladder(bar, chain(FlatEnd(diameter=10, length=40), [around, around]))
    truth = pi * (12**2 - 10**2) * 4
    assert work.removed(0, near(truth)).removed_mm3 == pytest.approx(truth, rel=1e-9)
    again = work.removed(1, Bracket(0.0, 0.0, 0.0))
    assert again.status is Status.AGREED and again.removed_mm3 == 0.0


@pytest.mark.parametrize(
    "tool", [FlatEnd(diameter=10, length=40), BallNose(diameter=10, length=40)], ids=["flat", "ball"]
)
def test_overlapping_passes_agree_with_the_mesh_and_add_up(tool: object) -> None:
    corners = [(-10, 0, -2), (40, 0, -2), (40, 3, -2), (-10, 3, -2), (-10, 6, -3), (40, 6, -3), (20, 1, -4)]
    paths: list[ToolPath] = [Line(a, b) for a, b in pairwise(corners)]
    paths.append(Arc((20, 1, -4), (22, 1, -4), angle=2.0))
    sweeps = chain(tool, paths)
    mesh = MeshEngine(box_stock((0, -20, -20), (30, 20, 0)), 0.02)
    brackets = [mesh.cut(sweep).bracket for (sweep,) in sweeps]
    work = Ladder(BOX, sweeps)
    verdicts = [work.removed(k, bracket) for k, bracket in enumerate(brackets)]
    assert {v.status for v in verdicts} <= {Status.AGREED, Status.RETRIED}
    total = sum(v.removed_mm3 or 0.0 for v in verdicts)
    before = mesh.stock_volume
    assert before.lo - mesh.volume.hi <= total <= before.hi - mesh.volume.lo


@pytest.mark.parametrize("rung", [rung for rung in RUNGS if rung not in STEADY])
def test_every_rung_gives_the_same_value(rung: str) -> None:
    tool = BallNose(diameter=10, length=40)
    work = Ladder(BOX, chain(tool, [Line((-10, 0, -1), (40, 0, -1)), Line((-10, 3, -1.5), (40, 3, -1.5))]))
    # the second slot's segment without what the first one took: their arcs cross where both are equally deep
    y = np.linspace(-4, 8, 2_000_001)
    depth = [np.maximum(d - 5 + np.sqrt(np.maximum(25 - (y - c) ** 2, 0)), 0) for c, d in ((0, 1), (3, 1.5))]
    truth = 30 * float(np.trapezoid(np.maximum(depth[1] - depth[0], 0), y))
    verdict = work.removed(1, near(truth, 3e-4), rungs=[rung])
    assert verdict.removed_mm3 == pytest.approx(
        truth, rel=1e-4 if rung in ("grown", "fuzzy 1e-03", *STEADY) else 1e-6
    )


def test_a_wrong_boolean_is_retried_or_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    tool = FlatEnd(diameter=10, length=40)
    work = Ladder(BOX, chain(tool, [Line((-10, 0, -1), (40, 0, -1))]))
    right = ladder.common
    monkeypatch.setattr(ladder, "common", lambda a, b, fuzzy: right(a, b, fuzzy) if fuzzy else a)
    retried = work.removed(0, near(300.0))
    assert retried.status is Status.RETRIED and retried.rung == "fuzzy 1e-05"
    monkeypatch.setattr(ladder, "common", lambda a, b, fuzzy: a)
    saved = work.removed(0, near(300.0))
    assert saved.rung == "facets" and saved.removed_mm3 == pytest.approx(300.0, rel=1e-6)
    unsteady = [rung for rung in RUNGS if rung not in STEADY]
    refused = work.removed(0, near(300.0), rungs=unsteady)
    assert refused.status is Status.REFUSED and refused.removed_mm3 is None
    assert "is outside [" in refused.reason and len(refused.tried) == len(unsteady)


def test_what_the_kernel_raises_costs_a_rung_only(monkeypatch: pytest.MonkeyPatch) -> None:
    work = Ladder(BOX, chain(FlatEnd(diameter=10, length=40), [Line((-10, 0, -1), (40, 0, -1))]))
    right = ladder.common

    def raises(one: object, other: object, fuzzy: float) -> object:
        if not fuzzy:
            raise RuntimeError("Standard_OutOfRange")
        return right(one, other, fuzzy)

    monkeypatch.setattr(ladder, "common", raises)
    verdict = work.removed(0, near(300.0))
    assert verdict.rung == "fuzzy 1e-05" and verdict.tried[0] is None
    refused = work.removed(0, near(300.0), rungs=["plain"])
    assert refused.status is Status.REFUSED and "Standard_OutOfRange" in refused.reason


def test_a_wrong_boolean_does_not_widen_its_own_gate(monkeypatch: pytest.MonkeyPatch) -> None:
    work = Ladder(BOX, chain(FlatEnd(diameter=10, length=40), [Line((-10, 0, -1), (40, 0, -1))]))
    huge = Blank("box", (0, 0, 0), (1e4, 1e4, 1e4)).shape()
    monkeypatch.setattr(ladder, "common", lambda a, b, fuzzy: huge)
    verdict = work.removed(0, near(300.0), rungs=["plain"])
    assert verdict.status is Status.REFUSED
    # at most a millionth of the box 30 x 10 x 1 in which both can meet, whatever the kernel says they share
    assert 0.0 < verdict.slack_mm3 <= 1e-6 * 300.0 * (1.0 + 1e-3) + ladder.SLACK_MM3


def test_a_grown_rung_says_by_how_much_it_widened_the_bracket() -> None:
    tool = FlatEnd(diameter=10, length=40)
    work = Ladder(BOX, chain(tool, [Line((-10, 0, -1), (40, 0, -1)), Line((-10, 5, -1), (40, 5, -1))]))
    plain = work.removed(1, near(150.0), rungs=["plain"])
    grown = work.removed(1, near(150.0, 0.1), rungs=["grown"])
    moved = ladder.GROWTH_MM * 30 * 1  # the wall of the first slot that faces the second: 30 x 1 mm
    assert plain.slack_mm3 == pytest.approx(ladder.SLACK_MM3 + 1e-6 * 300)  # the slot is 300 mm3 of the stock
    assert grown.slack_mm3 >= plain.slack_mm3 + moved
    assert grown.removed_mm3 == pytest.approx(150.0 - moved, abs=0.1 * moved)
    assert f"widened by {grown.slack_mm3:.2g} mm3" in note_of(grown) and note_of(plain) == ""


def test_an_empty_answer_is_not_believed() -> None:
    work = Ladder(BOX, chain(FlatEnd(diameter=10, length=40), [Line((-10, 0, 1), (40, 0, 1))]))
    assert work.removed(0, Bracket(0, 0, 0)).removed_mm3 == 0.0
    assert work.removed(0, Bracket(10, 11, 12)).status is Status.REFUSED


def test_only_sweeps_that_reach_the_region_are_subtracted() -> None:
    tool = FlatEnd(diameter=10, length=40)
    far = [Line((-10, y, -1), (40, y, -1)) for y in (-15.0, 15.0)]
    buried = [Line((-10, 0, -1), (40, 0, -1)), Line((-10, 0, -2), (40, 0, -2))]
    sweeps = [
        sweep for block in chain(tool, [*far, *buried, Line((-10, 2, -3), (40, 2, -3))]) for sweep in block
    ]
    needed = SweepIndex(sweeps).needed(4, np.array([[0, -20, -20], [30, 20, 0]], dtype=float))
    assert needed[0] == 3 and set(needed) <= {2, 3}  # the deeper slot first; the far ones not at all


def test_a_pass_needs_the_last_one_and_few_before_it() -> None:
    """What two equal balls share beside the one halfway between them lies in that one: distances to axes are convex."""
    tool, box = BallNose(diameter=10, length=40), np.array([[0, -20, -20], [30, 20, 0]], dtype=float)
    passes = [Sweep.along(tool, Line((-10, y, -2), (40, y, -2))) for y in range(8)]
    needed = SweepIndex(passes).needed(7, box)
    assert 6 in needed and len(needed) <= 2


@pytest.mark.parametrize("number", [2, 4, 5, 13, 17, 97])
def test_sweeps_that_are_not_needed_take_nothing_from_what_is_left(number: int) -> None:
    """Random points of a block in the stock: those in any earlier sweep are in one that is needed."""

    class NoBrackets(MeshEngine):
        def cut(self, *args: Any, **kwargs: Any) -> Bracket:
            return Bracket(0.0, 0.0, 0.0)

    bar = np.array(bar_of([number]))
    sweeps = chain_of(1, number, NoBrackets(box_stock(tuple(bar[0]), tuple(bar[1])), 1.0)).sweeps
    index, rng, held = SweepIndex(sweeps), np.random.default_rng(number), 0
    for k, sweep in enumerate(sweeps):
        low, high = np.maximum(sweep.bounds[0], bar[0]), np.minimum(sweep.bounds[1], bar[1])
        points = low + rng.random((20000, 3)) * (high - low)
        points = points[sweep.signed_distance(points) < 0.0]
        needed = index.needed(k, bar)
        inside = {j: sweeps[j].signed_distance(points) < 0.0 for j in index.meets(np.stack([low, high]), k)}
        any_one = np.any([*inside.values(), np.zeros(len(points), dtype=bool)], axis=0)
        assert not any_one[~np.any([*(inside[j] for j in needed), ~any_one], axis=0)].any()
        held += int(any_one.sum())
    assert held > 1000


def test_a_rung_that_hangs_or_dies_costs_a_process_and_at_worst_its_block(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    paths: list[ToolPath] = [Line((-10, y, -1), (40, y, -1)) for y in (0.0, 5.0, 10.0, -10.0, 15.0)]
    sweeps = chain(FlatEnd(diameter=10, length=40), paths)
    asked = {0: near(300.0), 1: near(150.0), 2: Bracket(148.0, 150.0, 152.0), 3: near(300.0), 4: near(150.0)}
    real, heard = workers._Worker.ask, workers._Worker._receive
    under_way = [0]

    def stumbles(
        self: workers._Worker, block: int, bracket: Bracket, rungs: list[str], seconds: float,
        longest: float, early: float, build: float, barred: set[str],
    ) -> brep.Verdict:  # fmt: skip
        under_way[0] = block
        if block == 4:
            self._process.kill()
        return real(
            self, block, bracket, rungs, seconds, 1e-6 if block == 1 else longest, early, build, barred
        )

    def dies(self: workers._Worker, seconds: float) -> Any:
        answer = heard(self, seconds)
        if answer in ("plain", "fuzzy 1e-05") and (
            under_way[0] == 0 or (under_way[0] == 2 and answer == "plain")
        ):
            self._process.kill()
        return answer

    monkeypatch.setattr(workers._Worker, "ask", stumbles)
    monkeypatch.setattr(workers._Worker, "_receive", dies)
    found = dict(brep.check_blocks(BOX, sweeps, asked, rungs=("plain", "fuzzy 1e-05")))
    assert "fuzzy 1e-05: OCCT ended its process (signal 9)" in found[0].reason
    assert "solids: OCCT ended its process (signal 9)" in found[4].reason
    assert "no answer within" in found[1].reason
    assert [found[k].status for k in range(5)] == [
        Status.REFUSED, Status.REFUSED, Status.RETRIED, Status.AGREED, Status.REFUSED
    ]  # fmt: skip
    assert found[2].rung == "fuzzy 1e-05" and found[2].removed_mm3 == pytest.approx(150.0)
    assert found[2].sure_mm3 is not None and found[3].sure_mm3 is None  # a second try is confirmed
    monkeypatch.setattr(workers.sys, "executable", "/bin/false")
    with pytest.raises(EngineError, match="no worker process"):
        list(brep.check_blocks(BOX, sweeps, asked))


def test_what_runs_in_a_process_of_its_own_cannot_take_us_with_it() -> None:
    flat = Sweep.along(FlatEnd(diameter=10, length=40), Line((0, 0, 0), (30, 0, 0)))
    assert isolated(described, flat, seconds=60.0).solids[0].volume == pytest.approx(flat.volume, rel=1e-9)
    with pytest.raises(EngineError, match="signal 6"):
        isolated(os.abort, seconds=60.0)
    with pytest.raises(EngineError, match=r"no answer within 0\.1 s"):
        isolated(time.sleep, 60.0, seconds=0.1)


def test_a_failing_driver_is_told_and_a_stop_drops_what_is_under_way(monkeypatch: pytest.MonkeyPatch) -> None:
    sweeps = chain(FlatEnd(diameter=10, length=40), [Line((-10, 0, -1), (40, 0, -1))])

    class Odd:
        def __init__(self, hello: bytes) -> None:
            self.done, self.rung = 0, "plain"
            self.killed = Event()

        def ask(self, block: int, *rest: object) -> brep.Verdict:
            raise RuntimeError("pipes are odd")

        def kill(self) -> None:
            self.killed.set()

        def close(self) -> None:
            self.kill()

    class Slow(Odd):
        def ask(self, block: int, *rest: object) -> brep.Verdict:
            assert self.killed.wait(30.0), "nobody dropped it"
            dropped.append(block)
            raise workers._Gone("dropped")

    dropped: list[int] = []
    monkeypatch.setattr(workers, "_Worker", Odd)
    with pytest.raises(EngineError, match="RuntimeError pipes are odd"):
        list(brep.check_blocks(BOX, sweeps, {0: ANY}))
    monkeypatch.setattr(workers, "_Worker", Slow)
    assert list(brep.check_blocks(BOX, sweeps, {0: ANY}, stop=lambda: True)) == [] and dropped == [0]


def test_words_of_the_option() -> None:
    assert parse_brep("All") == "all"
    assert parse_brep("3,7-9") == (range(3, 4), range(7, 10))
    for wrong in ("some", "7-3", "1--2", "-1", "", "²", "0-99999999999"):
        with pytest.raises(InputError, match="--brep"):
            parse_brep(wrong)
    rows = pl.DataFrame(
        {"block": range(100), "motion": ["rapid"] + 99 * ["linear"], "removed_hi_mm3": 100 * [1.0]}
    )
    assert chosen("none", rows) == [] and chosen("all", rows) == list(range(1, 100))
    sample = chosen("sample", rows)
    assert len(sample) == 20 == len(set(sample)) and sample[-1] == 99 and sample == chosen("sample", rows)
    assert chosen((range(0, 3),), rows) == [1, 2]
    with pytest.raises(InputError, match="no block 100"):
        chosen((range(90, 101),), rows)


def test_run_fills_the_columns_and_the_summary(tmp_path: Path) -> None:
    file = write_job(tmp_path)
    assert command(["run", str(file), "--out", str(tmp_path / "out"), "--brep", "all", "--quiet"]) == 0
    rows = pl.read_csv(tmp_path / "out" / "blocks.csv")
    counts = json.loads((tmp_path / "out" / "summary.json").read_text())["brep"]
    checked = rows.filter(pl.col("brep_status") != "skipped")
    assert set(checked["brep_status"]) <= {"agreed", "retried"}
    assert counts["asked"] == len(checked) == counts["agreed"] + counts["retried"] and counts["refused"] == 0
    assert rows.filter(pl.col("motion") == "rapid")["brep_status"].to_list() == ["skipped"] * 5
    slot = rows.filter(pl.col("line") == 7)
    assert slot["removed_brep_mm3"].item() == pytest.approx(SLOT_MM3, rel=1e-9)
    for row in checked.iter_rows(named=True):
        slack = 1e-5
        assert row["removed_lo_mm3"] - slack <= row["removed_brep_mm3"] <= row["removed_hi_mm3"] + slack


def test_a_refusal_is_told_and_ends_with_code_1(tmp_path: Path) -> None:
    half, upright = "N100 G2 X7 Y12 I2 J0", "N100 G18 G3 X7 Z-0.5 I2 K0"
    assert half in PROGRAM
    stepped = 'type = "profile"\nprofile = [[0, 0], [1, 0.2], [1, 1], [2, 2], [2, 20]]'
    swap = {'type = "flat"\ndiameter_mm = 4': stepped}
    file = write_job(tmp_path, program=PROGRAM.replace(half, upright), swap=swap)
    assert command(["run", str(file), "--out", str(tmp_path / "out"), "--brep", "all", "--quiet"]) == 1
    rows = pl.read_csv(tmp_path / "out" / "blocks.csv").filter(pl.col("brep_status") == "refused")
    assert (
        rows["removed_brep_mm3"].null_count() == len(rows) == 2
    )  # the arc, and what needs it as a neighbour
    assert all("the envelope folds inside the sweep" in text for text in rows["warning"])


def test_the_integral_over_heights_knows_its_error_and_finds_kinks_it_is_told() -> None:
    value, error = integrated(lambda z: z**4, [0.0, 2.0], 1e-9)
    assert value == pytest.approx(2**5 / 5, rel=1e-12) and error < 1e-9
    value, error = integrated(lambda z: abs(z - 0.7), [0.0, 0.7, 2.0], 1e-9)
    assert value == pytest.approx((0.7**2 + 1.3**2) / 2, rel=1e-12) and error < 1e-9
    truth = 2.0 / 3.0
    value, error = integrated(np.sqrt, [0.0, 1.0], 1e-4)
    assert abs(value - truth) <= error <= 1e-4
    # something where the first five heights find nothing
    value, error = integrated(lambda z: max(0.0, 1.0 - ((z - 0.31) / 0.04) ** 2), [0.0, 1.0], 1e-3)
    assert abs(value - 4.0 / 3.0 * 0.04) <= error


def test_a_worker_ends_with_a_driver_that_is_killed(tmp_path: Path) -> None:
    """Although it is busy, and so does not see that nobody is there any more."""
    told = tmp_path / "pid"
    busy = (
        f"isolated(os.system, 'echo $PPID > {told}.new && mv {told}.new {told} && exec sleep 30', seconds=60)"
    )
    driver = subprocess.Popen(
        [sys.executable, "-c", f"import os; from vmachining.engines.brep import isolated; {busy}"]
    )
    try:
        until = time.monotonic() + 120.0
        while not told.exists() and time.monotonic() < until:
            time.sleep(0.1)
        worker = Path("/proc") / told.read_text().strip()
        if not worker.exists():
            pytest.skip("no /proc to look into")
    finally:
        driver.kill()
        driver.wait()

    def lives() -> bool:
        """Not gone, and not a zombie that nobody has collected."""
        try:
            return (worker / "stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
        except OSError:
            return False

    until = time.monotonic() + 20.0
    while lives() and time.monotonic() < until:
        time.sleep(0.1)
    assert not lives()


def test_steady_rungs_come_next_when_time_is_short() -> None:
    across = [Line((-10, 0, -1), (40, 0, -1))]
    work, heard = Ladder(BOX, chain(FlatEnd(diameter=10, length=40), across)), list[str]()
    verdict = work.removed(
        0, Bracket(0, 1, 2), rungs=("plain", *STEADY, "fuzzy 1e-05"), early=0.0, told=heard.append
    )
    facets, sections = STEADY
    order = [SOLIDS, facets, MESHES, NEXT, sections, "plain", "fuzzy 1e-05"]
    assert list(dict.fromkeys(heard)) == order and verdict.status is Status.REFUSED


def test_what_other_blocks_need_too_does_not_count_for_the_limit_of_one() -> None:
    """Every mesh of a sweep is told of, and what goes on after it; a driver counts the seconds between."""
    across = [Line((-10, y, -1), (40, y, -1)) for y in (0.0, 5.0)]
    work, heard = Ladder(BOX, chain(FlatEnd(diameter=10, length=40), across)), list[str]()
    verdict = work.removed(1, near(150.0, 1e-3), rungs=("facets",), told=heard.append)
    assert verdict.removed_mm3 == pytest.approx(150.0)
    sweeps_times_sags = 2 * 2
    assert heard == [SOLIDS] * 2 + ["facets"] + [MESHES, "facets"] * sweeps_times_sags + [RAYS]
    used = workers.Spent()
    for doing in heard:
        used = used.plus(1.0, doing)
    assert used == (2.0 + sweeps_times_sags, 4.0 + 2 * sweeps_times_sags)


def test_a_level_section_has_the_area_of_circles_and_ellipses() -> None:
    """What a circle leaves of another one in a plate with a hole; edges stand for arcs to 1e-5 mm, areas to 1e-6 mm^2."""
    import cadquery as cq

    radius, away = 5.0, 3.0
    one, other = (
        cq.Solid.makeCylinder(radius, 4, cq.Vector(x, 0, -2), cq.Vector(0, 0, 1)) for x in (0, away)
    )
    hole = cq.Solid.makeCylinder(0.5, 4, cq.Vector(-4, 0, -2), cq.Vector(0, 0, 1))
    plate = cq.Solid.makeBox(40, 40, 3, cq.Vector(-20, -20, -1)).cut(hole)
    lens = 2 * radius**2 * np.arccos(away / (2 * radius)) - away / 2 * np.sqrt(4 * radius**2 - away**2)
    box = np.array([[-5, -5, -1], [5, 5, 1]], dtype=float)
    found, doubt = level_area(0.3, plate.wrapped, [one.wrapped], [other.wrapped], box)
    assert found == pytest.approx(np.pi * (radius**2 - 0.25) - lens, abs=1e-6) and doubt < 1e-6
    leaning = cq.Solid.makeCylinder(2, 40, cq.Vector(0, -12, -16), cq.Vector(0, 0.6, 0.8))
    found, doubt = level_area(0.0, plate.wrapped, [leaning.wrapped], [], box)
    assert found == pytest.approx(np.pi * 2 * 2 / 0.8, abs=1e-6) and doubt < 1e-6


def test_solids_that_cannot_be_built_are_told_once_for_all_rungs() -> None:
    """A block whose neighbour has no solid is refused with that reason, whatever the rungs."""
    stepped = ProfileTool(points=[[0, 0], [1, 0.2], [1, 1], [2, 2], [2, 20]])
    sweep = Sweep.along(stepped, Arc((0, 0, 0), (0, 0, 20), 1, angle=-pi / 3))
    with pytest.raises((SweepError, EngineError)) as why:
        brep.solids(reaching(sweep, box_of(BOX.shape())))
    work = Ladder(BOX, [[sweep], [Sweep.along(stepped, Line((0, 0, -1), (30, 0, -1)))]])
    heard = list[str]()
    verdict = work.removed(1, Bracket(0.0, 1.0, 1e6), told=heard.append)
    assert heard == [SOLIDS] * 2  # the block's own, and the neighbour's
    assert verdict.status is Status.REFUSED and verdict.reason == str(why.value)
