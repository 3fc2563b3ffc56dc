"""Several processes on one workpiece give the numbers of one."""

import resource
from contextlib import closing

import numpy as np
import pytest

from vmachining.engines.mesh import MeshEngine, box_stock
from vmachining.engines.protocol import Options
from vmachining.engines.relay import ColumnsFirst
from vmachining.errors import EngineError, FullError
from vmachining.geometry import Arc, Line
from vmachining.job.executor import InProcess, Staff, WorkerPool, executor
from vmachining.stock import BoxStock
from vmachining.tool import BallNose, FlatEnd

BALL = BallNose(diameter=6, length=30).cutter
FLAT = FlatEnd(diameter=4, length=30).cutter
PATHS = [
    (BALL, Line((-5, 4, -1), (33, 4, -1))),
    (BALL, Line((33, 4, -1), (33, 7, -1.5))),
    (BALL, Line((33, 7, -1.5), (-5, 7, -2))),
    (FLAT, Arc((8, 10, -3), (15, 10, -3), angle=2 * np.pi)),
    (FLAT, Line((40, 10, -3), (50, 10, -3))),  # air
    (FLAT, Arc((8, 10, -3), (15, 10, -3), angle=2 * np.pi)),  # once more: nothing left
]


def stock():
    return box_stock((0, 0, -10), (30, 20, 0))


def cut(workers):
    hands = executor(MeshEngine(stock(), 0.02), workers)
    try:
        answers = [hands.cut(tool, path, k) for k, (tool, path) in enumerate(PATHS)]
        rapid = hands.touch(BALL, Line((0, 0, -2), (30, 20, -2)))
        brackets = np.array([answer().bracket for answer in answers])
        return brackets, rapid().estimate, hands.finish()
    finally:
        hands.close()


@pytest.fixture(scope="module")
def alone():
    return cut(1)


@pytest.mark.parametrize("workers", [2, 3])
@pytest.mark.slow  # 4 s
def test_numbers_do_not_depend_on_the_number_of_workers(alone, workers):
    brackets, rapid, engine = cut(workers)
    # both add the same volumes of the same tiles, in another order
    assert brackets == pytest.approx(alone[0], abs=1e-9, rel=1e-12)
    assert (brackets[4] == 0).all()
    assert rapid == pytest.approx(alone[1], rel=1e-12) and rapid > 1
    assert engine.volume == pytest.approx(alone[2].volume, rel=1e-13)
    assert engine.stock_volume.estimate - engine.volume.estimate == pytest.approx(
        brackets[:, 1].sum(), rel=1e-9
    )
    own, other = engine.surface(), alone[2].surface()
    # tiles are joined in another order, so the same solid may have other triangles
    assert engine.whole().volume() == pytest.approx(alone[2].whole().volume(), rel=1e-12)
    assert np.unique(own.block).tolist() == np.unique(other.block).tolist()


def test_answers_may_be_asked_for_in_any_order_and_while_saving(tmp_path, alone):
    with WorkerPool(MeshEngine(stock(), 0.02), 2) as hands:
        answers = [hands.cut(tool, path, k) for k, (tool, path) in enumerate(PATHS[:3])]
        last = answers[2]()
        hands.save(tmp_path / "half.npz")
        assert hands.peak_mb() > 1
        found = [answers[0]().bracket, answers[1]().bracket, last.bracket]
        assert np.array(found) == pytest.approx(alone[0][:3], abs=1e-9)
    resumed = InProcess(MeshEngine.load(tmp_path / "half.npz"))
    assert np.array(resumed.cut(*PATHS[3], 3)().bracket) == pytest.approx(alone[0][3], abs=1e-9, rel=1e-9)


def test_a_dead_worker_is_an_error_and_not_a_hang():
    with WorkerPool(MeshEngine(stock(), 0.02), 2) as hands:
        hands._workers[1][0].kill()
        with pytest.raises(EngineError, match="worker process 2 of 2 ended"):
            hands.cut(*PATHS[0], 0)()


def test_a_failure_in_a_worker_comes_back_whole():
    with WorkerPool(MeshEngine(stock(), 0.02), 2) as hands:
        answer = hands._order("dance")
        with pytest.raises(EngineError, match="mesh engine: unknown order 'dance'"):
            answer()


@pytest.mark.slow  # 8 s: five interpreters start
def test_a_worker_without_room_for_its_share_says_so(tmp_path):
    """It was an internal failure."""
    with WorkerPool(MeshEngine(stock(), 0.02), 2) as pool:
        pool.cut(*PATHS[0], 0)()
        resource.prlimit(pool._workers[1][0].pid, resource.RLIMIT_FSIZE, (100, 100))
        with pytest.raises(FullError, match=r"cannot write: File too large; .*set TMPDIR") as caught:
            pool.save(tmp_path / "whole.npz")
        assert str(pool._scratch.path) in str(caught.value)


def test_with_fixed_shares_every_number_of_workers_gives_the_same_digits(tmp_path):
    box = BoxStock((0, 0, -10), (60, 60, 0))
    lines = [Line((3 * k, -5, -1 - 0.1 * k), (57 - 2 * k, 65, -2)) for k in range(12)]
    found = {}
    for workers in (1, 2, 3):
        engine, answers = ColumnsFirst.of(box, Options(width=0.01)), []
        with closing(executor(engine, workers, shares=4)) as hands:
            for half in (lines[:6], lines[6:]):
                later = [hands.cut(BALL, path, len(answers) + k) for k, path in enumerate(half)]
                later.append(hands.touch(FLAT, Line((0, 30, -2), (60, 30, -2)), None))
                answers += [answer() for answer in later]
                hands.save(tmp_path / "state.npz")
            found[workers] = (*answers, hands.finish().volume)
    assert found[1] == found[2] == found[3]
    assert 0.0 < found[1][0].lo < found[1][0].hi  # something was cut
    # and a checkpoint continues with the same digits
    engine, saved = ColumnsFirst.of(box, Options(width=0.01)), tmp_path / "half.npz"
    first = InProcess(engine, 4)
    [first.cut(BALL, path, k) for k, path in enumerate(lines[:6])]
    first.save(saved)
    resumed = InProcess(ColumnsFirst.load(saved), 4)
    assert [resumed.cut(BALL, path, 7 + k)() for k, path in enumerate(lines[6:])] == list(found[1][7:13])


def test_processes_started_ahead_cut_and_leave(alone):
    staff = Staff()
    staff.hire(3)
    ahead = [process for process, _ in staff._waiting]
    with closing(staff), WorkerPool(MeshEngine(stock(), 0.02), 2, staff=staff) as hands:
        assert {process.pid for process, _ in hands._workers} == {process.pid for process in ahead[1:]}
        assert hands.cut(*PATHS[0], 0)().bracket == pytest.approx(alone[0][0], abs=1e-9)
    assert all(process.returncode is not None for process in ahead)


@pytest.mark.parametrize(("workers", "more"), [(1, 0), (1, 1), (2, 0)])
def test_what_is_cut_after_a_checkpoint_is_in_the_finished_workpiece(workers, more, tmp_path):
    """A workpiece that was just saved is handed out as it is, and only then."""
    with closing(
        executor(ColumnsFirst(BoxStock((0, 0, -10), (30, 20, 0)), Options()), workers, shares=2)
    ) as hands:
        for k, (tool, path) in enumerate(PATHS[:2]):
            hands.cut(tool, path, k)
        hands.save(tmp_path / "at.npz")
        for k, (tool, path) in enumerate(PATHS[2 : 2 + more], 2):
            hands.cut(tool, path, k)
        found = hands.finish()
    saved = ColumnsFirst.load(tmp_path / "at.npz")
    if more:
        assert found.volume.hi < saved.volume.lo
    else:
        assert found.volume == saved.volume
        assert np.array_equal(found.surface().vertices, saved.surface().vertices)
