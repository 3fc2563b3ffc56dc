"""Chip geometry of every engine in one table."""

from __future__ import annotations

from math import acos

import numpy as np
import pytest
from tinyjob import write_job

import vmachining as vm
from vmachining.engagement import BoxStock, Engagement, RayWorkpiece, chip_table, contact, frames
from vmachining.engagement.analytic import Corner, HeightStock, HeightWorkpiece, engaged
from vmachining.engagement.chips import CHIP_COLUMNS
from vmachining.geometry import Line
from vmachining.job import Scene
from vmachining.sweep import Pose, Stance, Turn
from vmachining.tool import BullNose, Edge

MM = 1e-6


def test_dexel_brep_and_analytic_say_the_same_of_a_slot(tmp_path):
    """Flat D4, 1 mm deep, f 0.1: q = depth = axial = 1, h = f sin(phi)."""
    scene = Scene.of(vm.Job.load(write_job(tmp_path)))
    tables = [
        chip_table(vm.engage(scene, 2, method=m, angles=24, phase=0.5), feed_per_tooth=0.1)
        for m in ("dexel", "brep", "analytic")
    ]
    ahead = np.radians(tables[0]["phi_feed_deg"].to_numpy())
    wave = 0.1 * np.maximum(np.sin(ahead), 0.0)
    for table in tables:
        assert tuple(table.columns) == CHIP_COLUMNS
        one = (wave > 0).astype(float)
        for name in ("length_mm", "axial_mm", "depth_mm"):
            assert table[name].to_numpy() == pytest.approx(one, abs=MM)
        for name in ("thickness_mm", "area_mm2"):
            assert table[name].to_numpy() == pytest.approx(wave, abs=MM)


def test_a_leaning_bull_nose_by_three_ways():
    """A Pass, and an Engagement from heights and from exact distances; the slab of example A9, f 0.2."""
    m = frames.rotation(0.05, np.radians(10))
    tip = frames.tip_of_contact((0, 0, 0), (0, 0, 1), m[:, 2], 5, 5)
    stance = Stance.on(
        Turn.great_circle(Pose(tip - [0.5, 0, 0], m[:, 2]), Pose(tip + [0.5, 0, 0], m[:, 2])), 0.5
    )
    edge = Edge(BullNose(diameter=20, corner_radius=5, length=60))
    stairs = HeightStock.staircase((-100, 100), (2,), y=(-100, 100), floor=-50)
    works = HeightWorkpiece(stairs), RayWorkpiece(BoxStock((-100, -100, -50), (100, 100, 2)), [])
    one, two = (
        chip_table(
            Engagement(edge, stance, contact(edge, stance, w, angles=90, phase=0.5), "x"), feed_per_tooth=0.2
        )
        for w in works
    )
    phi = 2 * np.pi * (np.arange(90) + 0.5) / 90
    three = chip_table(engaged(Corner(5, 5, 55), stairs, tip, m, phi, (1, 0, 0)), feed_per_tooth=0.2)
    for name in CHIP_COLUMNS[1:]:
        want = one[name].to_numpy()
        wide = 2e-3 * 0.2 if name == "thickness_mm" else 3e-8  # asked at 17 points, and at its crest
        assert two[name].to_numpy() == pytest.approx(want, abs=wide), name
        assert three[name].to_numpy() == pytest.approx(want, abs=wide), name
    assert three["depth_mm"].max() == pytest.approx(2.0, abs=5e-3)


def test_a_path_is_numbered_and_may_do_without_a_normal():
    slab = HeightStock.staircase((-50, 50), (3,))
    found = engaged(
        Corner(12, 4), slab, [(0, 0, 0), (0, 0, 5)], np.eye(3), np.radians([45.0, 90, 270]), (5, 0, 0)
    )
    table = chip_table(found, normal=None)
    assert table["position"].to_list() == [0, 0, 0, 1, 1, 1] and table["depth_mm"].null_count() == 6
    assert table["length_mm"].to_list() == pytest.approx([4 * acos(0.25)] * 2 + [0] * 4)
    assert chip_table([]).is_empty()


def test_a_plunge_has_no_direction_of_feed(tmp_path):
    scene = Scene.of(vm.Job.load(write_job(tmp_path)))
    table = chip_table(vm.engage(scene, 5, at=0.95, bottom=True, angles=12), feed_per_tooth=0.05)
    assert table["phi_feed_deg"].null_count() == 12
    assert table["area_mm2"].to_numpy() == pytest.approx(np.full(12, 2 * 0.05), abs=1e-8)  # R f
    assert table["thickness_mm"].to_numpy() == pytest.approx(np.full(12, 0.05), abs=1e-9)
    still = Stance.on(Line((0, 0, 0), (1, 0, 0)), 0.5)._replace(velocity=np.zeros(3))
    edge = Edge(BullNose(diameter=20, corner_radius=5, length=60))
    slab = HeightWorkpiece(HeightStock.staircase((-50, 50), (3,)))
    rest = chip_table(Engagement(edge, still, contact(edge, still, slab, facing=False, angles=8), "x"))
    assert rest["area_mm2"].is_nan().all() and (rest["length_mm"] > 0).all()
