"""Solids on disk: what one process built another one has, refusals included."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import pytest

from vmachining import BallNose, FlatEnd, Interval, Sweep
from vmachining.engines.brep import Blank, Status, check_blocks, solids
from vmachining.engines.brep.occt.validity import inspect
from vmachining.engines.brep.removal import store
from vmachining.engines.brep.removal.store import Store
from vmachining.errors import SweepError
from vmachining.geometry import Arc, Line

LOOP = Sweep.along(BallNose(diameter=10, length=40), Arc((3, 0, 0), (0, 0, 0), angle=-6))


def slowly(shapes: list[Any]) -> list[Any]:
    end = time.process_time() + 1.1 * store.SLOW_S
    while time.process_time() < end:
        pass
    return shapes


def never() -> list[Any]:
    raise AssertionError("built twice")


def test_solids_that_took_long_come_back_as_they_were(tmp_path: Path) -> None:
    built = [part.shape for part in solids(LOOP)]
    assert len(built) > 1
    assert Store(tmp_path).solids(3, lambda: slowly(built)) is built
    back = Store(tmp_path).solids(3, never)
    for one, other in zip(back, built, strict=True):
        found, known = inspect(one), inspect(other)
        assert found._replace(volume=0.0) == known._replace(volume=0.0) and found.valid and found.closed
        assert found.volume == pytest.approx(known.volume, rel=1e-12)
    assert Store(tmp_path).solids(4, lambda: built) is built  # quick, so not kept
    assert [file.name for file in tmp_path.iterdir()] == ["3"]


def test_a_refusal_is_kept_too_and_no_folder_keeps_nothing(tmp_path: Path) -> None:
    def refuses() -> list[Any]:
        slowly([])
        raise SweepError("it folds", remedy="split the block")

    for build in (refuses, never):
        with pytest.raises(SweepError, match="it folds; split the block"):
            Store(tmp_path).solids(0, build)
    with pytest.raises(AssertionError, match="twice"):
        [Store(None).solids(0, build) for build in (lambda: slowly([]), never)]


def test_a_run_leaves_no_folder_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    sweep = Sweep.along(FlatEnd(diameter=10, length=40), Line((-10, 0, -1), (40, 0, -1)))
    box = Blank("box", (0, -20, -20), (30, 20, 0))
    asked = {0: Interval(299.9, 300.0, 300.1)}
    seen = []
    for _, verdict in check_blocks(box, [[sweep]], asked):
        seen = list(tmp_path.iterdir())
        assert verdict.status is Status.AGREED
    assert len(seen) == 1 and not list(tmp_path.iterdir())
