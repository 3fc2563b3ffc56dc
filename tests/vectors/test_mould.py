"""The mould cover of the sources (spec E.7, B2), re-created, at vectors far apart."""

from __future__ import annotations

import numpy as np
import pytest

from vmachining.bench.mould import BALL, HEIGHT, SLOT_DEPTH, TOP, blocks, vectors_mould_small


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
    upright, along = vectors_mould_small()
    assert upright["vectors"] == 840 * 802 and upright["bytes"] == 4 * upright["vectors"]
    deepest = BALL - np.sqrt(BALL**2 - 7.5**2)
    assert 5.990 - 0.15 <= upright["slots_least_mm"] <= SLOT_DEPTH - 0.9 * deepest
    assert upright["slots_most_mm"] <= 8.107 + 1e-3
    step = (
        1000.0 / 292
    )  # a chord sinks below the arc about an edge by its sagitta, over the cosine of the arc's slope
    sagitta = (step / np.cos(np.arcsin(0.5))) ** 2 / 8 / BALL
    assert 0.0 < upright["top_overcut_mm"] <= sagitta / np.cos(np.arcsin(0.5))
    assert along["vectors"] > 50_000 and along["untouched"] > 0
