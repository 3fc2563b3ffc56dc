"""Ruled faces with the side of the tool: a cone that is touched everywhere and nowhere cut, a twisted face in closed form."""

from __future__ import annotations

import json

import numpy as np
import pytest

from vmachining.cli.main import run as command
from vmachining.errors import InputError
from vmachining.toolpath import flank_path
from vmachining.toolpath.flank import Flank

R = 5.0


def cone(count: int = 121, base: float = 40.0, top: float = 30.0) -> tuple[np.ndarray, np.ndarray]:
    u = np.linspace(0.0, 1.2, count)
    ring = np.column_stack([np.cos(u), np.sin(u), 0.0 * u])
    return base * ring, top * ring + [0.0, 0.0, 20.0]


def gaps(found: Flank, face: np.ndarray) -> np.ndarray:
    """(poses, places) mm from the side of the tool to places on the face; negative within."""
    on = found.path.marks == 0
    tips, axes = found.path.tips[on], found.path.axes[on]
    off = face - tips[:, None]
    along = (off * axes[:, None]).sum(axis=2)
    return np.linalg.norm(off - along[..., None] * axes[:, None], axis=2) - R


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_cone_is_touched_everywhere_and_nowhere_cut(side):
    low, high = cone()
    found = flank_path(low, high, R, side=side)
    assert found.overcut.max() < 1e-12
    # on chords of 0.01 rad a tool outside cuts in by the sagitta of its own path, square to the cone of slope 2
    sagitta = (40.0 + R * 2.0 / np.sqrt(5.0)) * (1.0 - np.cos(0.005)) * 2.0 / np.sqrt(5.0)
    assert found.between.max() == pytest.approx(sagitta if side == "right" else 0.0, rel=1e-3, abs=1e-9)
    assert len(found.path.notes) == (side == "right")
    share = np.linspace(0.02, 0.98, 12)[:, None, None]
    face = ((1.0 - share) * low[1:-1] + share * high[1:-1]).reshape(-1, 3)
    gap = gaps(found, face)
    # the feed is counterclockwise with the apex above: left is within the cone
    assert gap.min() > -1e-9 and gap.min(axis=0).max() < 1e-9
    middle = np.hypot(*found.path.tips[60, :2])
    assert (middle < 40.0) == (side == "left")


def test_the_apex_of_a_cone_has_the_normals_of_its_rim():
    low, high = cone(top=0.0)
    found = flank_path(low, high, R, side="right")
    assert found.overcut.max() < 1e-12
    assert gaps(found, 0.5 * (low + high)).min() > -1e-9


def test_below_the_lower_rail():
    low, high = cone()
    plain, deep = (flank_path(low, high, R, side="right", below_mm=b).path for b in (0.0, 2.0))
    np.testing.assert_allclose(plain.tips[1:-1] - deep.tips[1:-1], 2.0 * plain.axes[1:-1], atol=1e-12)


def test_a_twisted_face_in_closed_form():
    """Rulings from (t, 0, 0) to (t, c t, 10): normals (0, 1, -c t / 10) and those of the tangent (1, c, 0)."""
    c, t = 0.3, np.linspace(-5.0, 5.0, 21)
    low = np.column_stack([t, 0.0 * t, 0.0 * t])
    high = np.column_stack([t, c * t, 10.0 + 0.0 * t])
    found = flank_path(low, high, R)
    d = high - low
    n0, n1 = np.cross(d, [1.0, 0.0, 0.0]), np.cross(d, [1.0, c, 0.0])
    turn = np.arccos((n0 * n1).sum(axis=1) / np.linalg.norm(n0, axis=1) / np.linalg.norm(n1, axis=1))
    np.testing.assert_allclose(found.twist, turn, rtol=1e-9)
    np.testing.assert_allclose(found.overcut, R * (1.0 - np.cos(0.5 * turn)), rtol=1e-6)
    assert "overcut" in found.path.notes[0]
    # the axis leans against the rulings, so the ends are cut as well, but less
    k, axes = np.arange(len(t)), found.path.axes[1:-1]
    for rail, n in ((low, n0), (high, n1)):
        n = n / np.linalg.norm(n, axis=1)[:, None]
        depth = R - R * np.linalg.norm(np.cross(n, axes), axis=1)
        np.testing.assert_allclose(-gaps(found, rail)[k, k], depth, atol=1e-12)
        assert (depth < found.overcut).all()


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [
        ([[0, 0, 0]], [[0, 0, 5]], "two at least"),
        ([[0, 0, 0], [1, 0, 0]], [[0, 0, 0], [1, 0, 5]], "ruling 0 has no length"),
        ([[0, 0, 0], [0, 0, 1]], [[0, 0, 5], [0, 0, 6]], "along its rail"),
        ([[0, 0, 0], [0, 0, 0]], [[0, 0, 5], [0, 0, 5]], "all rulings are one"),
    ],
)
def test_refusals(low, high, words):
    with pytest.raises(InputError, match=words):
        flank_path(low, high, R)


def test_the_command(tmp_path, capsys):
    low, high = cone(31)
    table, out = tmp_path / "rulings.csv", tmp_path / "swarf.csv"
    rows = "\n".join(",".join(f"{v:.9g}" for v in row) for row in np.hstack([low, high]))
    table.write_text(f"x1,y1,z1,x2,y2,z2\n{rows}\n")
    asked = ["toolpath", "flank", str(table), "--tool", "flat:10", "--side", "right", "--out", str(out)]
    assert command([*asked, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["rulings"] == 31 and told["overcut_at_rulings_mm"] < 1e-6
    sagitta = (40.0 + R * 2.0 / np.sqrt(5.0)) * (1.0 - np.cos(0.02)) * 2.0 / np.sqrt(5.0)
    assert told["overcut_mm"] == told["overcut_between_mm"] == pytest.approx(sagitta, rel=1e-3)
    assert "straight way" in told["warnings"][0]
    # the radius of the tips: 40 and the offset square to the cone, of slope 2
    assert np.hypot(*told["tips_mm"][16][:2]) == pytest.approx(40.0 + R * 2.0 / np.sqrt(5.0), abs=1e-5)
    assert len(out.read_text().splitlines()) == 1 + 31 + 2
    assert command(asked) == 2 and "exists" in capsys.readouterr().err
    assert command(["toolpath", "flank", str(table), "--tool", "ball:10"]) == 2
    assert "flat:D" in capsys.readouterr().err
    table.write_text(f"{rows}\n1,2,3,4,5\n")
    assert command(["toolpath", "flank", str(table), "--tool", "flat:10"]) == 2
    assert ":32" in capsys.readouterr().err


def wall(*steps: float) -> np.ndarray:
    x = np.array(steps)
    return np.column_stack([x, 0.0 * x, 0.0 * x])


UP = np.array([0.0, 0.0, 20.0])


@pytest.mark.parametrize("offset", [(0.0, 1e-8, 0.0), (0.0, 0.0, 0.0), (-1e-8, 0.0, 0.0)])
def test_a_step_of_rounding_has_no_direction(offset):
    low = wall(0, 1, 2, 2, 3, 4, 5)
    low[3] += offset
    found = flank_path(low, low + UP, R)
    np.testing.assert_allclose(found.path.tips[1:-1], low + [0.0, R, 0.0], atol=1e-7)
    assert found.between.max() < 1e-7 and found.path.notes == (
        "rulings 2 and 3 are one within 1e-05 mm: they share their normals",
    )


def test_a_fan_of_rulings_on_a_wall_and_round_a_corner():
    low, high = wall(0, 1, 2, 2, 2, 3, 4), wall(0, 1, 2, 3, 4, 5, 6) + UP
    found = flank_path(low, high, R)
    np.testing.assert_allclose(found.path.axes[1:-1, 1], 0.0, atol=1e-12)
    assert found.overcut.max() < 1e-12 and found.between.max() < 1e-12 and not found.path.notes
    # a quarter of a cone over its apex between two planes that touch it: the normals are those of the rim
    u = np.radians(np.arange(0.0, 91.0, 5.0))
    rim = 10.0 * np.column_stack([np.sin(u), -np.cos(u), 0.0 * u])
    before, after = [[-2, 0, 0], [-1, 0, 0]], [[0, 1, 0], [0, 2, 0]]
    low = np.concatenate([before, 0.0 * rim, after])
    high = np.concatenate([np.add(before, [0, -10, 0]), rim, np.add(after, [10, 0, 0])]) + UP
    found = flank_path(low, high, R, side="right")
    assert found.overcut.max() < 1e-3 and found.twist.max() < 0.05
    # normals of the cone of half angle atan(1 / 2) under it
    turn = (10.0 + R * 2.0 / np.sqrt(5.0)) * (1.0 - np.cos(np.radians(2.5))) * 2.0 / np.sqrt(5.0)
    assert found.between[4:-5].max() == pytest.approx(turn, rel=0.02)


@pytest.mark.parametrize(("side", "deep"), [("right", 25.0 * (1.0 - np.cos(np.radians(5.0)))), ("left", 0.0)])
def test_chords_round_a_cylinder_in_closed_form(side, deep):
    u = np.radians(np.arange(0.0, 181.0, 10.0))
    low = 20.0 * np.column_stack([np.cos(u), np.sin(u), 0.0 * u])
    found = flank_path(low, low + UP, R, side=side)
    assert found.overcut.max() < 1e-12
    np.testing.assert_allclose(found.between, deep, atol=1e-12)
    assert found.path.notes == (
        (f"{deep:.3g} mm of overcut on the straight way from ruling 0 to 1: give rulings closer together",)
        if deep
        else ()
    )


def test_a_ruling_with_its_ends_exchanged_is_overcut():
    low = wall(*range(6))
    high = low + UP
    low[3], high[3] = high[3].copy(), low[3].copy()
    with pytest.raises(InputError, match="the axis turns over after ruling 2"):
        flank_path(low, high, R)
