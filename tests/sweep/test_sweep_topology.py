"""Changes of the grazing curve: instants known in closed form, and nothing changes between two of them."""

from __future__ import annotations

from itertools import pairwise
from math import asin, pi, sqrt

import numpy as np
import pytest
from sweep_inventions import PATHS, TOOLS
from test_sweep_turning import TURNS

from vmachining.sweep import Sweep, Turn
from vmachining.sweep.grazing import circles, grazing_stretches, instant
from vmachining.sweep.topology import breaks, changes
from vmachining.tool import BullNose, FlatEnd, Profile, Segment

N30 = BullNose(diameter=30, corner_radius=5, length=50)
TILT = Turn.through((0, 0, 0), (0, 200, 0), "ac", (0, 0), (1, 0), control_height=5)
"""Torus centre at 200 mm along y, axis tilting by 1 rad at constant rate: A . V = -200 sin t, |dA/dt| = 1."""


def test_the_second_arc_of_the_torus_and_its_chord_die_where_the_closed_form_says():
    """|A . V| = R1 |dA/dt| at sin t = 0.05 (2.8659840 degrees), for the top disc of radius 15 at 0.075."""
    found = changes(Sweep.along(N30, TILT))
    times = {(c.kind, c.z): c.t for c in found}
    assert times["end", 0.0] == pytest.approx(asin(0.05), abs=1e-12)
    assert np.degrees(times["end", 0.0]) == pytest.approx(2.8659840, abs=5e-8)
    assert times["end", 50.0] == pytest.approx(asin(0.075), abs=1e-12)


def test_the_front_of_a_ball_swaps_where_the_motion_turns_square_to_the_axis():
    turn = Turn.rotary((0, 0, 0), (0, 30, 0), "ac", (-0.4, 0), (0.6, 0))
    swap = [c.t for c in changes(Sweep.along(TOOLS["ball"], turn)) if c.kind == "swap"]
    assert swap == pytest.approx([0.4], abs=1e-12)


def test_a_pivot_inside_a_flat_tool_is_constant():
    """The axis point at 25 mm stands still: every circle keeps what it has."""
    turn = Turn.through((0, 0, 0), (0, 0, 0), "ac", (0, 0), (0.7, 0), control_height=25)
    assert len(breaks(Sweep.along(FlatEnd(diameter=20, length=50), turn))) == 0


@pytest.mark.parametrize("path", ["rest", "level", "ramp", "plunge", "arc", "helix"])
def test_motions_that_keep_their_angle_to_the_axis_have_no_changes(path):
    assert len(breaks(Sweep.along(TOOLS["bull"], PATHS[path]))) == 0


def test_an_upright_circle_changes_where_its_slope_does():
    """Circle about y by 2 rad, from the x side: after a quarter turn the motion is level."""
    times = breaks(Sweep.along(TOOLS["ball"], PATHS["upright"]))
    assert pi / 2 / 2 == pytest.approx(times[np.argmin(np.abs(times - pi / 4))], abs=1e-9)


def signature(profile: Profile, turn: Turn, t: float) -> tuple:
    """Per face: how many stretches, and whether they reach the ends."""
    now, out = instant(turn, t), []
    (r0, z0), (r1, z1) = profile.points[0], profile.points[-1]
    nan = float("nan")
    faces = [Segment(0.0, z0, r0, z0, nan, nan, 0.0)] if r0 else []
    faces += profile.segments
    faces += [Segment(r1, z1, 0.0, z1, nan, nan, 0.0)] if r1 else []
    for s in faces:
        found = grazing_stretches(s, now)
        lo, hi = s.beta if s.is_arc else ((s.z0, s.z1) if s.z1 > s.z0 else sorted((s.r0, s.r1)))
        out.append((len(found), any(a == lo for a, _ in found), any(b == hi for _, b in found)))
        for r, z, b in ((s.r0, s.z0, s.beta[0]), (s.r1, s.z1, s.beta[1])):
            of = circles(now, z, r, np.cos(b), np.sin(b))
            out.append(bool(of.reach > abs(of.c)))
    return tuple(out)


@pytest.mark.parametrize("tool", ["flat", "ball", "bull", "cone", "drill"])
@pytest.mark.parametrize("name", [*TURNS, "book"])
def test_nothing_changes_between_two_breaks(tool, name):
    turn = TILT if name == "book" else TURNS[name]
    sweep = Sweep.along(TOOLS[tool], turn)
    edges = np.concatenate([[0.0], breaks(sweep), [1.0]])
    for a, b in pairwise(edges):
        if b - a < 1e-6:
            continue
        times = a + (b - a) * np.linspace(0.003, 0.997, 9)
        if name in ("middle", "tip") and tool != "drill":
            times = times[:3]  # degenerate rows (r = |c| over a whole face) are decided by rounding
        seen = [signature(sweep.profile, turn, float(t)) for t in times]
        if name not in ("middle", "tip"):
            assert len(set(seen)) == 1


def test_breaks_do_not_depend_on_how_a_block_is_cut():
    sweep = Sweep.along(N30, TURNS["ac"])
    whole = breaks(sweep)
    cut = 1 / sqrt(7)
    first, second = sweep.split([cut])
    parts = np.concatenate([cut * breaks(first), cut + (1 - cut) * breaks(second)])
    assert parts == pytest.approx(whole, abs=1e-9)
