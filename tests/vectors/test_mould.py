"""The mould cover of the sources (spec E.7, B2), re-created, at vectors far apart."""

from __future__ import annotations

import numpy as np
import pytest

import vmachining as vm
from benchmarks.mould import BALL, HEIGHT, SLOT_DEPTH, TOP, blocks, body, vectors_mould_small, write_job
from vmachining.job.stock import read_part


def test_the_body_and_the_path() -> None:
    path = blocks()
    assert len(path) - 1 == 78_524
    assert pytest.approx([924.007, 879.007], abs=1e-3) == 2 * TOP
    inside = (np.abs(path[:, :2]) < TOP).all(axis=1)
    lowest, highest = path[inside, 2].min() - BALL, path[inside, 2].max() - BALL
    assert highest == pytest.approx(HEIGHT)
    deepest = BALL - np.sqrt(BALL**2 - 7.5**2)  # between the two edges of a slot
    assert HEIGHT - deepest <= lowest <= HEIGHT - 0.9 * deepest


def test_slots_stay_and_the_top_is_gouged_by_less_than_its_chords_can() -> None:
    upright = next(vectors_mould_small())
    assert upright["vectors"] == 840 * 802 and upright["bytes_per_vector"] == 4
    deepest = BALL - np.sqrt(BALL**2 - 7.5**2)
    assert 5.990 - 0.15 <= upright["slots_least_mm"] <= SLOT_DEPTH - 0.9 * deepest
    assert upright["slots_most_mm"] <= 8.107 + 1e-3
    step = (
        1000.0 / 292
    )  # a chord sinks below the arc about an edge by its sagitta, over the cosine of the arc's slope
    sagitta = (step / np.cos(np.arcsin(0.5))) ** 2 / 8 / BALL
    assert 0.0 < upright["top_overcut_mm"] <= sagitta / np.cos(np.arcsin(0.5))


def test_the_body_has_the_area_of_its_walls() -> None:
    """Spec E.7: lips 78,200, slot walls 381,840, drafted walls 1,194,309 mm^2."""
    corners = body().corners
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2.0
    area = np.linalg.norm(normal, axis=1)
    slope = np.degrees(np.arccos(normal[:, 2] / area))
    z = corners[:, :, 2].mean(axis=1)
    upright = np.abs(slope - 90.0) < 1e-6
    assert area[upright & (z < 20.0)].sum() == pytest.approx(78_200.0)
    assert area[upright & (z > 20.0)].sum() == pytest.approx(381_840.0)
    assert area[np.abs(slope - 85.0) < 1e-6].sum() == pytest.approx(1_194_309.0, abs=1.0)


def test_the_job_at_its_size(tmp_path) -> None:
    path = blocks()[100:160]
    job = vm.Job.load(write_job(tmp_path / "mould", path=path))
    moves = vm.read_program(tmp_path / "mould" / "mould.nc").moves
    ends = np.array([move.end for move in moves[2:-1]])
    np.testing.assert_allclose(ends, path - [0.0, 0.0, BALL], atol=5.1e-5)
    assert job.keys.vectors is not None and job.keys.vectors.spacing_mm == 0.547654
    a, b, c = read_part(tmp_path / "mould" / "part.stl").corners.transpose(1, 0, 2)
    volume = float((a * np.cross(b, c)).sum()) / 6.0
    # lips, a frustum of a pyramid over a rectangle, less 111 slots
    h, t, x, y = 320.0, 2.0 * np.tan(np.radians(5.0)), 980.0, 935.0
    frustum = x * y * h - (x + y) * t * h**2 / 2.0 + t**2 * h**3 / 3.0
    exact = 1000.0 * 955.0 * 20.0 + frustum - 111 * 15.0 * 200.0 * 8.0
    assert volume == pytest.approx(exact, rel=1e-7)
