"""Legs of a hexapod head against closed forms of a regular one; the orientation against eq. (3-10)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from oracles.head_models import ca_axis, hexapod_matrix

from vmachining.errors import KinematicsError
from vmachining.machine import Hexapod, read_parts

R, P, H = 800.0, 300.0, 1000.0
AROUND = np.radians(60.0) * np.arange(6)
RING = np.column_stack([np.cos(AROUND), np.sin(AROUND), np.zeros(6)])


def regular(**given):
    """Both rings regular hexagons, one above the other; the gauge point in the middle of the lower one."""
    limits = {"length": (700.0, 1500.0), **given}
    return Hexapod(R * RING + [0, 0, H], P * RING, np.zeros(3), **limits)


def test_lengths_of_a_regular_one():
    """Straight up by z: sqrt((R - P)^2 + (H - z)^2) for all six."""
    z = np.array([-200.0, 0.0, 100.0])
    found = regular().legs(np.column_stack([0 * z, 0 * z, z]), np.tile([0.0, 0.0, 1.0], (3, 1)))
    assert found.length == pytest.approx(np.repeat(np.hypot(R - P, H - z)[:, None], 6, axis=1), rel=1e-14)
    home = np.arctan2(R - P, H)
    lean = np.abs(np.arctan2(R - P, H - z) - home)
    assert found.base == pytest.approx(np.repeat(lean[:, None], 6, axis=1), abs=1e-12)
    assert found.platform == pytest.approx(found.base, abs=1e-12)  # nothing turns


def test_lengths_of_a_tilted_one():
    """About x by a: the leg at angle t spans (R - P) cos t, R sin t - P sin t cos a, H - P sin t sin a."""
    a = np.radians(20.0)
    sin, cos = np.sin(AROUND), np.cos(AROUND)
    length = np.sqrt(
        ((R - P) * cos) ** 2 + (R * sin - P * sin * np.cos(a)) ** 2 + (H - P * sin * np.sin(a)) ** 2
    )
    found = regular().legs([[0.0, 0.0, 0.0]], [[0.0, -np.sin(a), np.cos(a)]])
    assert found.length[0] == pytest.approx(length, rel=1e-14)


def test_the_platform_turns_without_torsion():
    """Any pose: joints by the matrices of eq. (3-10), here with a tool below the gauge point."""
    rng = np.random.default_rng(4)
    hexapod = regular(tool=150.0)
    for _ in range(50):
        a, c = rng.uniform(0.0, 1.2), rng.uniform(-np.pi, np.pi)
        tip, turn = rng.normal(size=3) * 100.0, hexapod_matrix(a, c)
        joints = tip + (P * RING + [0, 0, 150.0]) @ turn.T
        legs = joints - R * RING - [0, 0, H]
        found = hexapod.legs([tip], [ca_axis(a, c)])
        assert found.length[0] == pytest.approx(np.linalg.norm(legs, axis=1), rel=1e-12)
        home = P * RING - R * RING - [0, 0, H]
        way = legs / np.linalg.norm(legs, axis=1)[:, None]
        at_home = home / np.linalg.norm(home, axis=1)[:, None]
        assert np.cos(found.base[0]) == pytest.approx((way * at_home).sum(axis=1), abs=1e-12)
        assert np.cos(found.platform[0]) == pytest.approx(((way @ turn) * at_home).sum(axis=1), abs=1e-12)


def test_the_workspace_ends_where_the_first_leg_does():
    """Upright at height z: the leg across is (R - P + r)^2 + (H - z)^2 long, the one on the near side as short."""
    low, high = 900.0, 1400.0
    heights = np.array([-100.0, 0.0, 60.0])
    far = np.sqrt(high**2 - (H - heights) ** 2) - (R - P)
    near = R - P - np.sqrt(np.maximum(low**2 - (H - heights) ** 2, 0.0))
    near[(H - heights) >= low] = np.inf  # high enough above it, a leg never gets too short
    found = regular(length=(low, high)).workspace(heights, 0.0, step_mm=1.0, headings=24)
    assert (found <= np.minimum(far, near)).all() and (found > np.minimum(far, near) - 1.0).all()


def test_limits_are_named():
    hexapod = regular(length=(900.0, 1400.0), base_cone=np.radians(30.0), platform_cone=np.radians(35.0))
    up = [0.0, 0.0, 1.0]
    assert hexapod.reached([[0, 0, 0], [600, 0, 0]], [up, up]).tolist() == [True, False]
    assert hexapod.complaint([[0, 0, 0]], [up]) is None
    pose, words = hexapod.complaint([[0, 0, 0], [600, 0, 0]], [up, up])
    assert pose == 1 and "leg 4 would be 1486.61 mm long, it goes from 900 to 1400" in words
    _, words = hexapod.complaint([[0, 0, 0]], [[0.0, -np.sin(0.8), np.cos(0.8)]])
    assert "on the platform would lean" in words
    for wrong, match in (({"length": (100.0, 900.0)}, "at home"), ({"length": (1200.0, 1100.0)}, "at home")):
        with pytest.raises(KinematicsError, match=match):
            regular(**wrong)
    with pytest.raises(KinematicsError, match="upside down"):
        hexapod.legs([[0, 0, 0]], [[0, 0, -1]])


PAGE = (Path(__file__).parents[2] / "docs" / "kinematics.md").read_text()
EXAMPLE = re.search(r"```toml\n(name = \"example hexapod\".*?)```", PAGE, re.DOTALL)[1]


def test_the_example_of_the_page(tmp_path):
    file = tmp_path / "hexapod.toml"
    file.write_text(EXAMPLE)
    chain, legs, keys = read_parts(file)
    assert chain.names == ("X", "Y", "Z", "C", "A") and keys["max_feed_mm_min"] == 10000
    assert (legs.workspace([0.0], np.radians(15.0)) > 100.0).all()


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("[850, -150, 1100], ", "", "base_mm: six joint positions"),
        ("length_mm = [800, 1500]", "length_mm = 800", "shortest and longest"),
        ("length_mm = [800, 1500]", "length_mm = [100, 200]", "home must lie within"),
        ("base_joint_deg", "base_joints_deg", "did you mean base_joint_deg"),
        ("[850, -150, 1100]", '["a", 0, 0]', "three finite numbers"),
    ],
)
def test_what_is_wrong_with_legs_is_said(old, new, match, tmp_path):
    file = tmp_path / "hexapod.toml"
    file.write_text(EXAMPLE.replace(old, new, 1))
    with pytest.raises(KinematicsError, match=match) as caught:
        read_parts(file)
    assert caught.value.file == str(file) and caught.value.line
