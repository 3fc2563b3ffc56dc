"""Models made by the tool path room: files agree with their generators, and a quick judge with the known truths."""

from __future__ import annotations

import re

import numpy as np
import pytest

import vmachining as vm
from tests.models.heightfield import Round, grid, removed
from tests.models.shipped import MODELS, generator
from vmachining.nc import Motion

FILES = {"triangular_pocket": "nc", "staircase": "nc", "finishing": "nc", "blade": "csv"}
NUMBER = re.compile(r"-?\d+\.?\d*")


def program(name):
    job = vm.Job.load(MODELS / name / "job.toml")
    return vm.read_program(MODELS / name / f"{name}.{FILES[name]}", dialect=job.keys.program.dialect)


@pytest.mark.parametrize("name", FILES)
def test_programs_are_what_their_generators_write(name):
    shipped = (MODELS / name / f"{name}.{FILES[name]}").read_text(encoding="ascii")
    made = generator(name).program()
    assert len(made) < 300_000
    one, two = ([float(v) for v in NUMBER.findall(text)] for text in (shipped, made))
    # other processors round sines and roots otherwise in the last digit that is written
    assert NUMBER.sub("#", shipped) == NUMBER.sub("#", made)
    assert one == pytest.approx(two, abs=2e-5)


@pytest.mark.parametrize("name", FILES)
def test_programs_are_clean(name):
    read = program(name)
    assert not [f for f in read.findings if f.severity != "I"], read.findings
    assert read.ended
    assert all(move.feed_mm_min and move.tool for move in read.moves if move.motion is not Motion.RAPID)


@pytest.mark.parametrize(
    ("name", "numbers"),
    [
        ("triangular_pocket", lambda make: [f"{make.pocket_area():.6f}", f"{make.pocket_volume():.6f}"]),
        ("staircase", lambda make: [f"{sum(row[3] for row in make.passes()):.3f}", str(len(make.passes()))]),
        ("finishing", lambda make: [f"{v:.3f}" for v in make.volume_bounds()]),
        ("blade", lambda make: [f"{v:.3f}" for v in make.volume_bounds()]),
    ],
)
def test_readmes_state_the_numbers_of_the_generators(name, numbers):
    text = re.sub(r"\s+", " ", (MODELS / name / "README.md").read_text(encoding="utf-8"))
    for number in numbers(generator(name)):
        assert number in text


def test_passes_of_the_staircase_against_a_height_map():
    make = generator("staircase")
    moves = program("staircase").moves
    # a slice of the bar, 0.5 mm long: every pass goes straight through
    cell = 0.01
    bar = grid((30.0, -15.0), (30.5, 15.0), cell, lambda x, y: np.full_like(x, make.TOP))
    volumes = removed(moves, {1: Round(3, 0), 2: Round(5, 5)}, bar, step=0.5)
    through = [abs(m.end[0] - m.start[0]) > make.LONG and m.motion is not Motion.RAPID for m in moves]
    found = volumes[through] / 0.5
    true = [row[3] / make.LONG for row in make.passes()]
    # a flat end's wall, at most 1.5 mm high, stands in one cell on each side; tips stand 0.5 mm apart: 0.5^2 / 8 r for a ball
    assert found == pytest.approx(true, abs=2 * 1.5 * cell)
    low, high = make.volume_bounds()
    assert low <= sum(true) * make.LONG <= high


def test_volume_of_the_finishing_lies_between_its_bounds():
    make = generator("finishing")
    design = make.Surface(make.design())
    cell = 0.06

    def raised(x, y):
        z, _ = design.heights(np.column_stack([x.ravel(), y.ravel()]))
        return z.reshape(x.shape) + make.ALLOWANCE

    stock = grid((0.0, 0.0), (make.WIDE, make.LONG), cell, raised)
    volume = removed(program("finishing").moves, {1: Round(3, 3)}, stock, step=0.05).sum()
    low, high = make.volume_bounds()
    assert low <= volume <= high


@pytest.mark.slow  # five axes: minutes of the mesh engine on a busy machine
@pytest.mark.parametrize("name", ["triangular_pocket", "staircase", "blade"])
def test_engines_hold_the_known_truths(name, tmp_path):
    make = generator(name)
    job = vm.Job.load(MODELS / name / "job.toml")
    s = vm.run(job, out=tmp_path).summary
    if name == "blade":
        low, high = make.volume_bounds()
        assert low <= s["removed_lo_mm3"] and s["removed_hi_mm3"] <= high
        return
    true = make.pocket_volume() if name == "triangular_pocket" else sum(row[3] for row in make.passes())
    assert s["removed_lo_mm3"] - 0.1 <= true <= s["removed_hi_mm3"] + 0.1
