"""The files of a model agree with each other: generator, program, readme, job."""

from __future__ import annotations

import re
import tomllib

import pytest

import vmachining as vm
from tests.models.shipped import MODELS, NAMES, ROOT, generator
from vmachining.nc import Motion


def made(name: str) -> str:
    make = generator(name)
    return str(make.program(make.Case()) if name == "half_cylinder" else make.program())


@pytest.mark.parametrize("name", NAMES)
def test_program_is_what_its_generator_writes(name: str) -> None:
    assert (MODELS / name / f"{name}.nc").read_text(encoding="ascii") == made(name)


def test_stock_is_what_its_generator_writes() -> None:
    make = generator("half_cylinder")
    assert (MODELS / "half_cylinder" / "stock.stl").read_bytes() == make.stock_stl(make.Case())


@pytest.mark.parametrize("name", NAMES)
def test_program_is_clean_and_complete(name: str) -> None:
    program = vm.read_program(MODELS / name / f"{name}.nc")
    assert not program.findings
    assert program.ended
    for move in program.moves:
        if move.motion not in (Motion.RAPID, Motion.DWELL):
            assert move.spindle_rpm > 0
            assert move.feed_mm_min
            assert move.tool


@pytest.mark.parametrize(
    "path",
    sorted(p for p in MODELS.rglob("*.toml") if p.name != "set.toml"),
    ids=lambda path: f"{path.parent.name}-{path.stem}",
)
def test_job_loads(path) -> None:  # type: ignore[no-untyped-def]
    assert vm.Job.load(path).tools


def numbers(name: str) -> list[str]:
    make = generator(name)
    if name == "slot":
        path = make.path()
        values = [
            sum(block.volume for block in path),
            *(path[k].volume for k in (2, 3, 4, 19, 50, 62, 73, 102)),
        ]
        return [f"{value:.6f}" for value in values]
    if name == "pocket":
        values = [
            make.pocket_volume(5),
            make.pocket_volume(10),
            make.entry_volume(),
            make.middle_volume(3, 1),
        ]
        return [f"{value:.6f}" for value in values]
    if name == "half_cylinder":
        few, many = make.Case(), make.Case(100, 1.0)
        exact = [
            make.removed_volume(few),
            make.removed_volume(many),
            make.stock_volume(few),
            make.half_width(few),
        ]
        bounds = [*make.block_bounds(few), *make.block_bounds(many)]
        ridge = [f"{make.cusp(many):.7f}", f"{make.sagitta():.7f}"]
        return [f"{value:.6f}" for value in exact] + [f"{value:.3f}" for value in bounds] + ridge
    return [f"{value:.3f}" for value in make.volume_bounds()]


@pytest.mark.parametrize("name", NAMES)
def test_readme_states_the_numbers_of_the_generator(name: str) -> None:
    text = re.sub(r"\s+", " ", (MODELS / name / "README.md").read_text(encoding="utf-8"))
    for number in numbers(name):
        assert number in text


def test_the_wheel_carries_every_model_that_runs_and_neither_what_makes_it_nor_the_reference_pack():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    wheel = project["tool"]["hatch"]["build"]["targets"]["wheel"]
    left_out = {path for pattern in wheel["exclude"] for path in ROOT.glob(pattern)}
    assert "models" in wheel["only-include"]
    assert wheel["sources"] == {"models": "vmachining/models"}
    assert {job.parent for job in MODELS.glob("*/job.toml")}.isdisjoint(left_out)
    assert MODELS / "reference_pack" in left_out
    assert set(MODELS.glob("*/*.py")) <= left_out
    assert not [path for path in left_out if path.is_file() and path.suffix != ".py"]
