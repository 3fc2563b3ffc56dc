"""The published finish tests on surfaces of our own: methods along a pass against the surface, and the surface against a job."""

from __future__ import annotations

import re

import numpy as np
import pytest

import vmachining as vm
from tests.models.shipped import MODELS, generator

MAKE = generator("finish_tests")
FOLDER = MODELS / "finish_tests"


def test_program_is_what_its_generator_writes():
    assert (FOLDER / "pass.csv").read_text(encoding="ascii") == MAKE.program()


@pytest.mark.parametrize("name", MAKE.TESTS)
def test_the_exact_length_is_that_of_points_along_the_edge(name):
    """Four thousand points of the edge straight ahead: below the surface, inside the walls, N . V positive."""
    from vmachining.engagement import chip, frames

    test, where = MAKE.TESTS[name], MAKE.place(name, 20.5)
    tip, m, v, rate = (column[0] for column in where)
    phi = np.radians([60.0, 90.0]) - frames.feed_angle(v, m)
    c, bend = test.corner, test.corner.r * chip.QUARTER
    step = (bend + 20.0) / 4000
    s = (np.arange(4000) + 0.5) * step
    found = MAKE.exact(name, 20.5, np.array([60.0, 90.0])).cut_length[0]
    for k, angle in enumerate(phi):
        q = chip.edge_points(tip, m, np.full(len(s), angle), s, c.rm, c.r)
        speeds = chip.edge_speeds(v, m, angle, axis_rate=rate)
        inside = (q[:, 2] < test.surface.height(q[:, 0], q[:, 1])) & (q[:, 0] > 0.0) & (q[:, 0] < MAKE.LONG)
        cuts = inside & (chip.normal_speed(s, speeds, c.rm, c.r) > 1e-9 * np.linalg.norm(v))
        assert found[k] == pytest.approx(cuts.sum() * step, abs=2.0 * step)


@pytest.mark.parametrize("name", MAKE.TESTS)
def test_methods_err_as_the_page_says(name):
    """Profiles around each end reach the surface within 0.5 %; stages do where the profile ahead is what they model."""
    found = MAKE.errors(name, every=13)
    assert np.nanmax(found["model"]) < 0.5
    assert np.nanmax(found["stages"]) >= np.nanmax(found["ahead"])
    # the second station of a wave is that of another place: the largest error straight ahead that the page has
    assert np.nanmax(found["ahead"]) < 12.0


@pytest.mark.parametrize("block", [3, 36])
def test_a_job_sees_the_lengths_of_the_surface(block):
    """Facets of 1 mm lie below an arc of R 75 mm by 1 / 8 R = 0.0017 mm, and the edge leans by 15 degrees against them."""
    seen = vm.engage(vm.Job.load(FOLDER / "job.toml"), block, at=0.5, angles=36)
    where = MAKE.place(MAKE.SHOWN, block - 0.5)
    test = MAKE.TESTS[MAKE.SHOWN]
    told = MAKE.finished(
        test.corner, test.surface, where.tip, where.frame, np.radians(10.0 * np.arange(36)), where.velocity,
        axis_rate=where.axis_rate, **MAKE.WALLS,
    ).cut_length[0]  # fmt: skip
    assert seen.lengths.max() > 1.0 and np.abs(seen.lengths - told).max() < 0.002


def test_the_page_states_what_one_place_shows():
    page = (FOLDER / "README.md").read_text(encoding="utf-8")
    for name, test in MAKE.TESTS.items():
        (row,) = re.findall(rf"^\| {name} .*$", page, re.M)
        cells = [cell.strip() for cell in row.split("|")]
        assert cells[-2] == f"{test.published:g} %"
        found = MAKE.errors(name, every=39)  # both ends of the pass
        for cell, method in zip(cells[3:6], ("stages", "ahead", "model"), strict=True):
            assert np.nanmax(found[method]) <= float(cell.split()[0]) * 1.06 + 1e-6, method
