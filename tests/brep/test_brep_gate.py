"""The gate: closed forms through real kernels, judges that exclude a value or each other, limits, processes that end."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import time
from itertools import pairwise
from math import pi
from multiprocessing.connection import Connection
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from benchmarks.brep_chains import bar_of, chain_of
from vmachining import BallNose, BullNose, FlatEnd, ProfileTool, Sweep
from vmachining.engines import brep
from vmachining.engines.brep import (
    Blank,
    BlockChecker,
    Status,
    Verdict,
    built_sweep,
    check_blocks,
    isolated,
    isolated_steps,
    process,
    solid,
)
from vmachining.engines.brep.occt.booleans import box_of
from vmachining.engines.brep.removal.attempts import ATTEMPTS
from vmachining.engines.judges import Judge, intersection
from vmachining.engines.mesh import MeshEngine
from vmachining.engines.protocol import Options, Removal
from vmachining.errors import EngineError, SweepError
from vmachining.geometry import Arc, Line
from vmachining.geometry.path import Path as ToolPath
from vmachining.job.brep import RayWitness
from vmachining.stock import BoxStock
from vmachining.sweep.reach import reaching

BOX = Blank("box", (0, -20, -20), (30, 20, 0))
FLAT = FlatEnd(diameter=10, length=40)
ACROSS = Line((-10, 0, -1), (40, 0, -1))
"""A slot of 300 mm3."""


def chain(tool: object, paths: list[ToolPath]) -> list[list[Sweep]]:
    return [[Sweep.along(tool, path)] for path in paths]  # type: ignore[arg-type]


def says(lo: float, hi: float, name: str = "mesh") -> Judge:
    return Judge(name, Removal(lo, 0.5 * (lo + hi), hi))


def near(value: float, rel: float = 1e-4) -> list[Judge]:
    return [says(value * (1 - rel), value * (1 + rel))]


def one(tool: object, *paths: ToolPath) -> BlockChecker:
    return BlockChecker(BOX, chain(tool, list(paths)))


def test_through_slots_have_their_closed_form() -> None:
    half = np.sqrt(25 - 16)
    segment = 25 * np.arccos(4 / 5) - 4 * half
    cases = [
        (FLAT, 300.0),
        (BallNose(diameter=10, length=40), 30 * segment),
        (BullNose(diameter=10, corner_radius=1, length=40), 30 * (10 - (2 - pi / 2))),
    ]
    for tool, truth in cases:
        verdict = one(tool, ACROSS).check(0, near(truth))
        assert (verdict.status, verdict.attempt, verdict.number) == (Status.AGREED, "plain", 1)
        assert verdict.removed_mm3 == pytest.approx(truth, rel=1e-9)
        assert verdict.error_mm3 == pytest.approx(1e-4 * truth, rel=0.15)  # half of the judge, and its own


def test_a_bar_turns_round_and_a_second_pass_finds_nothing() -> None:
    bar = Blank("cylinder", (0, 0, -10), (0, 0, 0), center=(0, 0), radius=12)
    around = Arc((15, 0, -4), (0, 0, -4), angle=2 * pi)
    work = BlockChecker(bar, chain(FLAT, [around, around]))
    truth = pi * (12**2 - 10**2) * 4
    assert work.check(0, near(truth)).removed_mm3 == pytest.approx(truth, rel=1e-9)
    again = work.check(1, [says(0.0, 0.0)])
    assert (again.status, again.removed_mm3, again.error_mm3) == (Status.AGREED, 0.0, 0.0)
    hardly = work.check(
        1, [says(0.0, 1e-7)]
    )  # less than a boolean may be off; else it would be a chip of unknown size
    assert (hardly.status, hardly.removed_mm3, hardly.error_mm3) == (Status.AGREED, 0.0, 1e-7)
    assert work.check(1, [says(0.0, 1e-5)], ["plain"]).status is Status.REFUSED


@pytest.mark.parametrize("tool", [FLAT, BallNose(diameter=10, length=40)], ids=["flat", "ball"])
@pytest.mark.slow  # 5 s
def test_overlapping_passes_agree_with_mesh_and_rays_and_add_up(tool: object) -> None:
    corners = [(-10, 0, -2), (40, 0, -2), (40, 3, -2), (-10, 3, -2), (-10, 6, -3), (40, 6, -3), (20, 1, -4)]
    paths: list[ToolPath] = [Line(a, b) for a, b in pairwise(corners)]
    paths.append(Arc((20, 1, -4), (22, 1, -4), angle=2.0))
    sweeps, stock = chain(tool, paths), BoxStock((0, -20, -20), (30, 20, 0))
    mesh = MeshEngine.of(stock, Options(chord=0.02))
    judges = {k: [Judge("mesh", mesh.cut(sweep))] for k, (sweep,) in enumerate(sweeps)}
    cutting = {k: said for k, said in judges.items() if said[0].removal.hi > 0.0}
    verdicts = [v for _, v in check_blocks(BOX, sweeps, cutting, witness=RayWitness(stock, sweeps))]
    assert {v.status for v in verdicts} <= {Status.AGREED, Status.RETRIED}
    assert all(
        v.error_mm3 is not None and v.removed_mm3 is not None and v.error_mm3 < v.removed_mm3
        for v in verdicts
    )
    total = sum(v.removed_mm3 or 0.0 for v in verdicts)
    before = mesh.stock_volume
    assert before.lo - mesh.volume.hi <= total <= before.hi - mesh.volume.lo


@pytest.mark.parametrize("name", ATTEMPTS)
def test_every_attempt_gives_the_same_value(name: str) -> None:
    tool = BallNose(diameter=10, length=40)
    work = one(tool, ACROSS, Line((-10, 3, -1.5), (40, 3, -1.5)))
    # the second slot's segment without what the first one took: their arcs cross where both are equally deep
    y = np.linspace(-4, 8, 2_000_001)
    depth = [np.maximum(d - 5 + np.sqrt(np.maximum(25 - (y - c) ** 2, 0)), 0) for c, d in ((0, 1), (3, 1.5))]
    truth = 30 * float(np.trapezoid(np.maximum(depth[1] - depth[0], 0), y))
    verdict = work.check(1, near(truth, 3e-4), [name])
    assert verdict.attempt == name and verdict.number == list(ATTEMPTS).index(name) + 1
    assert verdict.removed_mm3 == pytest.approx(truth, rel=1e-4 if name in ("grown", "fuzzy 1e-03") else 1e-6)
    assert verdict.error_mm3 is not None and abs((verdict.removed_mm3 or 0.0) - truth) <= verdict.error_mm3


def test_a_value_that_no_judge_allows_is_refused_and_says_what_was_tried() -> None:
    verdict = one(FLAT, ACROSS).check(0, [says(310.0, 320.0)], ["plain", "rotated"])
    assert verdict.status is Status.REFUSED and verdict.removed_mm3 is None and verdict.error_mm3 is None
    assert [name for name, _ in verdict.tried] == ["plain", "rotated"]
    assert all(value == pytest.approx(300.0) for _, value in verdict.tried)
    assert verdict.reason == "plain, rotated: 300 mm3 is outside 310 to 320"


def test_judges_that_exclude_each_other_are_disputed_whatever_occt_says() -> None:
    judges = [says(260.0, 280.0), says(299.0, 301.0, "dexel")]
    verdict = one(FLAT, ACROSS).check(0, judges)
    assert verdict.status is Status.DISPUTED and verdict.removed_mm3 is None and not verdict.tried
    assert "mesh 260 to 280 mm3, dexel 299 to 301 mm3" in verdict.reason


def test_any_number_of_judges_narrows_the_truth() -> None:
    judges = [says(200.0, 310.0), says(290.0, 400.0, "dexel"), says(299.9, 300.2, "columns")]
    truth = intersection(judges)
    assert truth is not None and truth[:3] == (299.9, pytest.approx(300.05), 300.2) and truth.proven
    verdict = one(FLAT, ACROSS).check(0, judges)
    assert verdict.status is Status.AGREED and verdict.error_mm3 == pytest.approx(0.2, rel=0.02)


def test_a_value_that_is_no_better_known_than_its_size_does_not_stand() -> None:
    """A chip of 0.3 mm3 in a bracket from nothing to three times of it."""
    chip = Line((-10, 0, -0.001), (40, 0, -0.001))
    verdict = one(FLAT, chip).check(0, [says(0.0, 0.9)], ["plain"])
    assert verdict.status is Status.REFUSED and "too little" in verdict.reason
    assert one(FLAT, chip).check(0, [says(0.2, 0.5)], ["plain"]).status is Status.AGREED


def test_rays_dispute_a_bracket_without_the_truth_in_the_worker() -> None:
    sweeps, stock = chain(FLAT, [ACROSS]), BoxStock((0, -20, -20), (30, 20, 0))
    ((_, verdict),) = check_blocks(BOX, sweeps, {0: [says(260.0, 280.0)]}, witness=RayWitness(stock, sweeps))
    assert verdict.status is Status.DISPUTED
    assert [judge.name for judge in verdict.judges] == ["mesh", "dexel"]
    rays = verdict.judges[1].removal
    assert rays.lo <= 300.0 <= rays.hi and not rays.proven


def test_an_empty_answer_is_not_believed() -> None:
    work = one(FLAT, Line((-10, 0, 1), (40, 0, 1)))
    assert work.check(0, [says(0, 0)]).removed_mm3 == 0.0
    assert work.check(0, [says(10, 12)]).status is Status.REFUSED


def hard_chain() -> tuple[Blank, list[list[Sweep]], BoxStock]:
    """A kinked chain of the gauntlet, whose booleans take minutes."""
    bar = bar_of([6])
    made = chain_of(1, 6, MeshEngine.of(BoxStock(*bar), Options(chord=0.5)))
    return (
        Blank("box", tuple(bar[0].tolist()), tuple(bar[1].tolist())),
        [[s] for s in made.sweeps],
        BoxStock(*bar),
    )


@pytest.mark.slow  # 5 s
def test_a_block_takes_no_more_than_its_time_all_told() -> None:
    """Solids of the block and of what it needs included; a processor is looked at once in a while, so half a second more."""
    stock, sweeps, raw = hard_chain()
    last = len(sweeps) - 1
    ((_, verdict),) = check_blocks(
        stock, sweeps, {last: [says(0.0, 1e9)]}, witness=RayWitness(raw, sweeps), seconds=1.0
    )
    assert verdict.status is Status.REFUSED and "no answer within" in verdict.reason
    assert verdict.seconds <= 1.5


def test_a_stock_that_is_no_solid_is_said(tmp_path: Path) -> None:
    (tmp_path / "empty.step").write_text("nothing")
    with pytest.raises(EngineError):
        list(
            check_blocks(
                Blank("step", file=str(tmp_path / "empty.step")), chain(FLAT, [ACROSS]), {0: near(300.0)}
            )
        )


def test_a_stop_drops_what_is_under_way() -> None:
    assert list(check_blocks(BOX, chain(FLAT, [ACROSS]), {0: near(300.0)}, stop=lambda: True)) == []


@pytest.mark.slow  # 5 s
def test_what_runs_in_a_separate_process_cannot_take_us_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    flat = Sweep.along(FLAT, Line((0, 0, 0), (30, 0, 0)))
    (described,) = isolated_steps(built_sweep, flat, seconds=60.0)
    assert described.solids[0].volume == pytest.approx(flat.volume, rel=1e-9)
    with pytest.raises(EngineError, match="signal 6"):
        isolated(os.abort, seconds=60.0)
    with pytest.raises(EngineError, match=r"no answer within 0\.1 s"):
        isolated(time.sleep, 60.0, seconds=0.1)
    wound = Sweep.along(FLAT, Arc((10, 0, 0), (0, 0, 0), 2, angle=2.0 * pi, rise=-2.0))
    with pytest.raises(SweepError, match=r"; take engines\.brep\.solids"):
        isolated(solid, wound, seconds=60.0)
    elsewhere = ModuleType("elsewhere")
    exec("def found_only_here(): pass", vars(elsewhere))
    monkeypatch.setitem(sys.modules, "elsewhere", elsewhere)
    with pytest.raises(EngineError, match="cannot be read: No module named 'elsewhere'"):
        isolated(vars(elsewhere)["found_only_here"], seconds=60.0)


def test_a_worker_that_cannot_be_asked_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    """What it is asked for cannot travel: whoever started it has no worker, so nobody else would end it."""
    begun, start = list[subprocess.Popen[bytes]](), process.start

    def kept(*asked: str, apart: bool) -> tuple[subprocess.Popen[bytes], Connection]:
        begun.append((both := start(*asked, apart=apart))[0])
        return both

    monkeypatch.setattr(process, "start", kept)
    with pytest.raises((AttributeError, pickle.PicklingError)) as why:
        process.WorkerProcess(lambda: None)
    assert begun[0].poll() is not None, why


@pytest.mark.long  # 15 s
def test_solids_that_cannot_be_built_are_told_once() -> None:
    """A block whose neighbour has no solid is refused with that reason, whatever the attempts."""
    stepped = ProfileTool(points=[[0, 0], [1, 0.2], [1, 1], [2, 2], [2, 20]])
    sweep = Sweep.along(stepped, Arc((0, 0, 0), (0, 0, 20), 1, angle=-pi / 3))
    with pytest.raises((SweepError, EngineError)) as why:
        brep.solids(reaching(sweep, box_of(brep.shape_of(BOX))))
    work = BlockChecker(BOX, [[sweep], [Sweep.along(stepped, Line((0, 0, -1), (30, 0, -1)))]])
    *heard, verdict = work.steps(1, [says(0.0, 1e6)], ["plain"])
    assert [what for what in heard if isinstance(what, str)] == ["judges", "solids"]
    assert isinstance(verdict, Verdict)
    assert verdict.status is Status.REFUSED and verdict.reason == str(why.value)


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
