"""Solids on disk: what one process built another one has, refusals included."""

from __future__ import annotations

import pickle
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from manifold3d import Error, Manifold

from vmachining import BallNose, Bracket, FlatEnd, Sweep
from vmachining.engines.brep import Blank, Status, check_blocks, inspect, solids, store
from vmachining.engines.brep.faceted import Lack, Meshed
from vmachining.engines.brep.store import Store
from vmachining.errors import EngineError, SweepError
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


def test_meshes_that_took_long_come_back_as_they_were(tmp_path: Path) -> None:
    """A ball without an octant and a square hole: triangles large and small."""
    built = Meshed(
        Manifold.sphere(5, 64) - Manifold.cube((9, 9, 9)) - Manifold.cube((1, 1, 20), True),
        (Lack(0.5, 9.0), Lack(0.25, 4.0)),
    )

    def slow() -> Meshed:
        slowly([])
        return built

    assert Store(tmp_path).mesh(3, 2e-3, slow) is built
    back = Store(tmp_path).mesh(3, 2e-3, lambda: never()[0])
    assert back.solid.status() == Error.NoError and back.solid.num_tri() == built.solid.num_tri()
    assert back.solid.volume() == pytest.approx(built.solid.volume(), rel=1e-13) and back.lacks == built.lacks
    with pytest.raises(AssertionError, match="twice"):
        Store(tmp_path).mesh(3, 5e-4, lambda: never()[0])
    # triangles that do not close would pass for nothing in the next boolean: they are made again
    (file,) = tmp_path.iterdir()
    points, triangles, volume, lacks = pickle.loads(file.read_bytes())
    for spoilt in ((points, triangles[1:], volume, lacks), (points, triangles, 1.001 * volume, lacks)):
        file.write_bytes(pickle.dumps(spoilt))
        assert Store(tmp_path).mesh(3, 2e-3, lambda: built) is built


def test_a_mesh_over_which_a_process_ended_is_not_begun_again(tmp_path: Path) -> None:
    """Another sweep's, another sag's, and one that a living process builds are."""
    if not Path("/proc/self").exists():
        pytest.skip("no /proc to look into")
    child = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    (tmp_path / f"3 0.002 begun {child.pid}").touch()
    built, store = Meshed(Manifold.cube(), ()), Store(tmp_path)
    assert store.mesh(3, 2e-3, lambda: built) is built
    child.communicate(b"\n")
    with pytest.raises(EngineError, match="came to its end over this mesh"):
        store.mesh(3, 2e-3, lambda: built)
    assert store.mesh(13, 2e-3, lambda: built) is store.mesh(3, 4e-3, lambda: built) is built


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
    asked = {0: Bracket(299.9, 300.0, 300.1)}
    seen = []
    for _, verdict in check_blocks(box, [[sweep]], asked):
        seen = list(tmp_path.iterdir())
        assert verdict.status is Status.AGREED
    assert len(seen) == 1 and not list(tmp_path.iterdir())
