"""A checkpoint is numbers and texts: whoever wrote it, reading it runs nothing; and what was saved continues as it was."""

from __future__ import annotations

import io
import json
import os
import pickle
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import polars.testing
import pytest
from tinyjob import JOB, write_job

from vmachining import BallNose, FlatEnd, Sweep
from vmachining.checkpoint import Saved, opened
from vmachining.cli.main import run as command
from vmachining.engines import ENGINES, engine_class
from vmachining.engines.packed import packed_stock, packed_sweeps, stock_of, sweeps_of
from vmachining.engines.protocol import Options
from vmachining.errors import EngineError, JobError
from vmachining.geometry import Arc, Line
from vmachining.job import Job, Stopped, engagement_columns, run
from vmachining.job.files import sha256
from vmachining.stock import BoxStock, CylinderStock, MeshStock, StepStock
from vmachining.sweep import Pose, Turn

DESIGN = '\n[design]\nstl = "part.stl"\n'

STOPS = {
    "columns": "program", "mesh": "program", "dexel": "program", "rays": "program", "vectors": "program",
    "contact": "engagement",
}  # fmt: skip
"""Whose checkpoint, and the pass that is stopped for it."""


class Evil:
    """Unpickled, it makes a directory."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        return os.mkdir, (str(self.mark),)


def dotted(mark: Path) -> bytes:
    """Protocol 4: STACK_GLOBAL walks attributes from an allowed module to `os.mkdir`."""
    out = io.BytesIO()
    out.write(pickle.PROTO + bytes([4]))
    for text in ("numpy.lib._npyio_impl", "os.mkdir"):
        raw = text.encode()
        out.write(pickle.SHORT_BINUNICODE + bytes([len(raw)]) + raw)
    out.write(pickle.STACK_GLOBAL)
    raw = str(mark).encode()
    out.write(pickle.SHORT_BINUNICODE + bytes([len(raw)]) + raw + pickle.TUPLE1 + pickle.REDUCE + pickle.STOP)
    return out.getvalue()


def objects(mark: Path, kind: str = "rays") -> bytes:
    """An archive in our own format whose array is a pickle."""
    out, array = io.BytesIO(), io.BytesIO()
    np.lib.format.write_array(array, np.array([Evil(mark)], dtype=object), allow_pickle=True)
    with zipfile.ZipFile(out, "w") as package:
        package.writestr("state.json", json.dumps({"format": 1, "kind": kind, "state": {}}))
        package.writestr("rows.npy", array.getvalue())
    return out.getvalue()


FORMS = {
    "pickle": lambda mark: pickle.dumps(Evil(mark)),
    "pickle of text": lambda mark: pickle.dumps(Evil(mark), protocol=0),
    "dotted name": dotted,
    "array of objects": objects,
}


@pytest.mark.parametrize("form", ["pickle", "dotted name"])
def test_the_forms_would_have_run_code(form: str, tmp_path: Path) -> None:
    pickle.loads(FORMS[form](tmp_path / "run"))
    assert (tmp_path / "run").is_dir()


def test_the_array_of_objects_would_have_run_code(tmp_path: Path) -> None:
    with np.load(io.BytesIO(objects(tmp_path / "run")), allow_pickle=True) as found:
        assert found["rows"].shape == (1,)
    assert (tmp_path / "run").is_dir()


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("engine", ENGINES)
def test_no_engine_runs_what_a_checkpoint_holds(engine: str, form: str, tmp_path: Path) -> None:
    kind = "columns and mesh" if engine == "columns" else engine
    made = objects(tmp_path / "run", kind) if form == "array of objects" else FORMS[form](tmp_path / "run")
    (tmp_path / "bad").write_bytes(made)
    with pytest.raises(EngineError, match=r"it is a pickle|it is not a checkpoint|allow_pickle=False"):
        engine_class(engine).load(tmp_path / "bad")
    assert not (tmp_path / "run").exists()


@pytest.fixture(scope="module")
def stopped(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], tuple[Job, Path]]:
    """A job and the directory of its run, stopped in the pass of `STOPS`; a fresh one each time."""

    def made(whose: str) -> tuple[Job, Path]:
        folder = tmp_path_factory.mktemp(whose)
        (folder / "part.stl").write_text(box_stl((0, 0, -4), (10, 18, -1)))
        job = Job.load(write_job(folder, job=JOB + (DESIGN if whose == "vectors" else "")))
        engine, under_way, asked = whose if whose in ENGINES else "columns", [""], []

        def stop() -> bool:
            asked.extend(["x"] * (under_way[-1] == STOPS[whose]))
            return len(asked) > 3

        with pytest.raises(Stopped), pytest.MonkeyPatch.context() as patch:
            patch.setattr(engagement_columns, "CHUNK", 1)  # contact stops between chunks of blocks
            run(
                job, out=folder / "out", engine=engine, stop=stop, progress=lambda name, done, total: under_way.append(name),
            )  # fmt: skip
        return job, folder / "out"

    return made


def box_stl(low: tuple[float, ...], high: tuple[float, ...]) -> str:
    outer, _ = BoxStock(low, high).mesh(0.1)
    facets = [
        "facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {x} {y} {z}\n" for x, y, z in corners) + "endloop\nendfacet\n"
        for corners in outer.vertices[outer.triangles].tolist()
    ]  # fmt: skip
    return "solid part\n" + "".join(facets) + "endsolid part\n"


@pytest.mark.parametrize("whose", ["rays", "vectors", "contact"])
def test_resume_refuses_a_stranger_s_checkpoint(
    whose: str, stopped: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Also one whose manifest was made to fit. Exit code 2, one message that names the file, nothing run."""
    job, out = stopped(whose)
    manifest = json.loads((out / "manifest.json").read_text())
    name = manifest["checkpoints"][STOPS[whose]]["file"]
    (out / name).write_bytes(dotted(tmp_path / "run"))
    manifest["files"][name] = sha256(out / name)
    (out / "manifest.json").write_text(json.dumps(manifest))
    engine = whose if whose in ENGINES else "columns"
    with pytest.raises(
        JobError, match=r"checkpoint\.\w+\.\d+\.npz.*pickle, which could run code.*without --resume"
    ):
        run(job, out=out, engine=engine, resume=True)
    words = [
        "run",
        str(out.parent / "job.toml"),
        "--out",
        str(out),
        "--engine",
        engine,
        "--resume",
        "--quiet",
    ]
    assert command(words) == 2
    assert name in capsys.readouterr().err and not (tmp_path / "run").exists()


@pytest.mark.parametrize("whose", ["rays", "vectors"])
def test_it_continues_to_the_same_table(whose: str, stopped: Any, tmp_path: Path) -> None:
    job, out = stopped(whose)
    whole = run(job, out=tmp_path, engine=whose)
    again = run(job, out=out, engine=whose, resume=True)
    polars.testing.assert_frame_equal(again.blocks, whole.blocks, check_exact=True)
    assert again.summary.get("deviation") == whole.summary.get("deviation")


SWEEPS = [
    Sweep(BallNose(diameter=6, length=30), (0, 0, 0), (5, 1, 2)),
    Sweep.along(FlatEnd(diameter=4, length=20), Arc((3, 0, 0), (0, 0, 0), angle=-6.0, rise=0.7)),
    Sweep.along(FlatEnd(diameter=4, length=20), Arc((3, 0, 0), (0, 0, 0), 1, angle=1.1)),
    Sweep.along(
        BallNose(diameter=6, length=30),
        Turn.great_circle(Pose((0, 0, 0), (0, 0, 1)), Pose((4, 1, 0), (0.3, 0.1, 0.9))),
    ),
    Sweep.along(
        FlatEnd(diameter=4, length=20), Turn.rotary((0, 0, 0), (1, 2, 3), "ac", (0.1, 0.2), (0.4, 1.0))
    ),
    Sweep.along(FlatEnd(diameter=4, length=20), Line((0, 0, 0), (1, 0, 0))),
]


@pytest.mark.parametrize("chosen", [slice(None), slice(0, 3), slice(3, 4), slice(0, 0)])
def test_sweeps_come_back_to_the_last_digit(chosen: slice, tmp_path: Path) -> None:
    points = np.random.default_rng(1).uniform(-8, 12, (200, 3))
    Saved("test", {}, packed_sweeps(SWEEPS[chosen])).write(tmp_path / "file")
    with opened(tmp_path / "file", "test") as saved:
        back = sweeps_of(saved.arrays)
    for sweep, again in zip(SWEEPS[chosen], back, strict=True):
        assert type(again.path) is type(sweep.path)
        np.testing.assert_array_equal(again.signed_distance(points), sweep.signed_distance(points))
        np.testing.assert_array_equal(again.bounds, sweep.bounds)


def test_stocks_come_back(tmp_path: Path) -> None:
    outer, _ = BoxStock((0, 0, 0), (1, 2, 3)).mesh(0.1)
    mesh = MeshStock(outer.vertices, outer.triangles)
    step = StepStock(mesh, file="part.step", exact_mm3=6.0, curved=mesh.corners[:2], chord=0.01)
    points = np.random.default_rng(2).uniform(-2, 4, (50, 3))
    for stock in (BoxStock((0, 0, 0), (1, 2, 3)), CylinderStock((1, 2), 3.0, (0, 4)), mesh, step):
        state, arrays = packed_stock(stock)
        Saved("test", state, arrays).write(tmp_path / "file")
        with opened(tmp_path / "file", "test") as saved:
            again = stock_of(saved.state, saved.arrays)
        assert type(again) is type(stock)
        np.testing.assert_array_equal(again.signed_distance(points), stock.signed_distance(points))
        assert again.slack_near(stock.bounds) == stock.slack_near(stock.bounds)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_torn_file_is_said(engine: str, tmp_path: Path) -> None:
    """Cut anywhere, empty, or of another engine: refused, never half read."""
    outer, _ = BoxStock((0, 0, -4), (10, 10, -1)).mesh(0.1)
    part = MeshStock(outer.vertices, outer.triangles)
    work = engine_class(engine).of(BoxStock((0, 0, -4), (10, 10, 0)), Options(design=part))
    work.cut(Sweep(FlatEnd(diameter=4, length=20), (0, 5, -1), (10, 5, -1)), 3)
    work.save(tmp_path / "whole")
    content = (tmp_path / "whole").read_bytes()
    assert engine_class(engine).load(tmp_path / "whole").volume == work.volume
    for size in (0, 1, 50, len(content) // 2, len(content) - 1):
        (tmp_path / "torn").write_bytes(content[:size])
        with pytest.raises(EngineError, match="cannot be read"):
            engine_class(engine).load(tmp_path / "torn")
    Saved("another", {}).write(tmp_path / "other")
    with pytest.raises(EngineError, match="belongs to 'another'"):
        engine_class(engine).load(tmp_path / "other")


def test_places_beyond_the_arrays_are_refused(tmp_path: Path) -> None:
    """Kernels do not check bounds: a file with numbers of tiles or sweeps that are not there never reaches them."""
    work = engine_class("columns").of(BoxStock((0, 0, -4), (10, 10, 0)), Options())
    work.cut(Sweep(FlatEnd(diameter=4, length=20), (0, 5, -1), (10, 5, -1)), 3)
    work.save(tmp_path / "file")
    for name in ("columns/tiles_tile", "columns/tiles_sweep"):
        with opened(tmp_path / "file", "columns and mesh") as saved:
            saved.arrays[name][-1] = 10**9
            saved.write(tmp_path / "bad")
        with pytest.raises(EngineError, match="tiles list sweeps that are not there"):
            engine_class("columns").load(tmp_path / "bad")


def test_nothing_on_disk_is_unpickled() -> None:
    """Pickles travel through pipes to processes of one's own, and nowhere else."""
    package = Path(__file__).parents[2] / "vmachining"
    words = (
        "import pickle",
        "from pickle",
        "allow_pickle=True",
        "cloudpickle",
        "marshal",
        "shelve",
        "joblib",
        "yaml",
    )
    found = {
        path.relative_to(package).as_posix()
        for path in package.rglob("*.py")
        if any(word in path.read_text(encoding="utf-8") for word in words)
    }
    assert found == set()
