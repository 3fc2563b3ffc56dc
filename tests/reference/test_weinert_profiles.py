"""Envelope profiles against the tables of the closed-form solution, and against the general condition."""

from __future__ import annotations

import json
from math import pi, radians
from pathlib import Path

import numpy as np
import pytest

from vmachining.sweep import Turn
from vmachining.sweep.flux._kernels import front
from vmachining.sweep.grazing import (
    across,
    chord,
    circles,
    folding,
    grazing_angles,
    grazing_stretches,
    instant,
    normal_speed,
)
from vmachining.sweep.weinert import (
    angular_velocity,
    axis_rate,
    cylinder_angles,
    moving_frame,
    torus_arcs,
    torus_normal_speed,
    torus_profile,
)
from vmachining.tool import BullNose, FlatEnd, Taper

TABLES = json.loads(Path(__file__).with_name("weinert_profiles.json").read_text(encoding="utf-8"))
R1, V = TABLES["R1_mm"], np.array([0.0, 20.0, 0.0])
PRINTED = 1e-10
"""rad, mm: the tables carry ten decimals."""


def pose(tilt_deg, azimuth_deg=0.0, rates=(0.0, 0.0)):
    """Axis and its rate on the chain ac."""
    a, c = radians(tilt_deg), radians(azimuth_deg)
    axis = np.array([np.sin(c) * np.sin(a), -np.cos(c) * np.sin(a), np.cos(a)])
    return axis, axis_rate(axis, angular_velocity("ac", (a, c), rates))


FIG7 = [(table, k, tilt) for table in TABLES["figure_3_7"] for k, tilt in enumerate(table["tilt_deg"])]


@pytest.mark.parametrize(("table", "k", "tilt"), FIG7, ids=[f"{t['name']} {d:g}" for t, _, d in FIG7])
def test_profiles_of_figure_3_7(table, k, tilt):
    spin = table["omega_x"] if table["omega_x"] != "pi/15" else pi / 15
    axis, rate = pose(tilt, rates=(spin, 0.0))
    rows = [(u, v[k]) for u, v in zip(table["u_deg"], table["v_rad"], strict=True) if v[k] is not None]
    u, v = np.radians([r[0] for r in rows]), np.array([r[1] for r in rows])
    assert torus_profile(u, axis=axis, velocity=V, rate=rate, R1=R1) == pytest.approx(v, abs=PRINTED)
    if "arc_end_deg" in table:
        arcs = torus_arcs(axis=axis, velocity=V, rate=rate, R1=R1)
        end = radians(table["arc_end_deg"][k])
        if tilt > 0:  # at 0 the two arcs join in the meridians u = +-90 degrees
            assert min(abs(hi - lo - 2 * (pi - end)) for lo, hi in arcs) < 1e-9
            assert len(arcs) == 2
        turn = Turn.through(
            (0, 0, 0), V, "ac", (radians(tilt), 0), (radians(tilt) + spin, 0), control_height=5
        )
        d, along = chord(instant(turn, 0.0), 0.0)
        assert abs(d) == pytest.approx(abs(table["chord_mm"][k]), abs=1e-9)
        assert d * along @ V == pytest.approx(table["chord_mm"][k] * along @ V, abs=1e-7)


FIG8 = [(table, k, (0.1, 0.1) if n == 0 else (radians(36) / 5, radians(60) / 5))
        for n, table in enumerate(TABLES["figure_3_8b"]) for k in range(5)]  # fmt: skip


@pytest.mark.parametrize(("table", "k", "rates"), FIG8)
def test_profiles_of_figure_3_8(table, k, rates):
    axis, rate = pose(24 + 9 * k, 180 + 15 * k, rates)
    frame = moving_frame(axis, rate, V)
    for name, e in frame._asdict().items():
        assert e == pytest.approx(np.array(table[name][k]), abs=PRINTED)
        assert e @ V == pytest.approx(table[f"{name}·V_E"][k], abs=PRINTED)
    assert np.linalg.norm(rate) == pytest.approx(table["e3·ω=‖Ȧ‖"][k], abs=PRINTED)
    state = {"axis": axis, "velocity": V, "rate": rate}
    for u, values in table["v_rad"].items():
        v = torus_profile(radians(float(u)), R1=R1, **state)
        assert np.isnan(v) if values[k] is None else v == pytest.approx(values[k], abs=PRINTED)
    for height, values in table["cylinder_rad"].items():
        turn = cylinder_angles(float(height), **state) - values[k]
        assert np.exp(1j * turn) == pytest.approx(np.array([1, -1]), abs=PRINTED)
    (arc,) = torus_arcs(R1=R1, **state)
    printed = np.radians(table["arc_deg"][k])
    assert np.exp(1j * np.array(arc)) == pytest.approx(np.exp(1j * printed), abs=1e-8)  # seven decimals


def test_the_angular_velocity_turns_the_axis_and_the_hexapod_differs_by_spin():
    """Against the axis of `Turn`, for all chains; hexa and ac differ by -c' A."""
    rng = np.random.default_rng(1)
    for chain in ("ac", "bc", "ab", "hexa"):
        for _ in range(20):
            q, d = rng.uniform(-2, 2, 2), rng.uniform(-1, 1, 2)
            turn = Turn.rotary((0, 0, 0), (1, 0, 0), chain, q, q + d)
            omega = angular_velocity(chain, q, d)
            assert axis_rate(turn.axis(0.0), omega) == pytest.approx(turn.axis_rate(0.0), abs=1e-14)
            if chain == "hexa":
                spin = omega - angular_velocity("ac", q, d)
                assert spin == pytest.approx(-d[1] * turn.axis(0.0), abs=1e-14)


def random_instants(n):
    rng = np.random.default_rng(7)
    for _ in range(n):
        h = float(rng.uniform(-5, 20))
        turn = Turn.through(
            rng.normal(0, 10, 3), rng.normal(0, 10, 3), "ac", rng.uniform(-1.5, 1.5, 2),
            rng.uniform(-1.5, 1.5, 2), control_height=h,
        )  # fmt: skip
        yield turn, float(rng.uniform(0, 1)), rng


def test_the_general_condition_contains_the_named_ones():
    """f of `circles` on the torus is eq. 3-15 about the torus centre; its zeros are 3-16 and 3-32."""
    for turn, t, rng in random_instants(50):
        R2, offset = float(rng.uniform(0.5, 8)), float(rng.uniform(0.1, 10))
        now = instant(turn, t)
        center = now.lifted(R2)
        state = {"axis": now.axis, "velocity": center.velocity, "rate": now.axis_rate}
        frame = moving_frame(**state)
        x, y = across(now.axis)
        shift = np.arctan2(frame.e2 @ y, frame.e2 @ x)
        u, v = rng.uniform(-pi, pi, 30), rng.uniform(0, pi / 2, 30)
        of = circles(now, R2 - R2 * np.cos(v), offset + R2 * np.sin(v), np.sin(v), -np.cos(v))
        scale = np.linalg.norm(now.velocity) + 30
        assert normal_speed(of, u + shift) == pytest.approx(
            torus_normal_speed(u, v, R1=offset, **state), abs=1e-13 * scale
        )
        graze = torus_profile(u, R1=offset, **state)
        on = ~np.isnan(graze)
        assert torus_normal_speed(u[on], graze[on], R1=offset, **state) == pytest.approx(0, abs=1e-13 * scale)
        for lo, hi in torus_arcs(R1=offset, **state):
            inside = lo + (hi - lo) * np.linspace(0.01, 0.99, 15)
            assert not np.isnan(torus_profile(inside, R1=offset, **state)).any()
        k = rng.uniform(0, 40, 5)
        wall = circles(now, R2 + k, offset + R2, 1.0, 0.0)
        ours = grazing_angles(wall) - shift
        named = cylinder_angles(k, **state)
        gap = np.exp(1j * ours[:, :, None]) - np.exp(1j * named[:, None, :])
        assert np.abs(gap).min(axis=2) == pytest.approx(0, abs=1e-9)


def body_speed(now, h, rho, out, up, u):
    """N . V_P by the velocity of the point, without any of the formulas."""
    x, y = across(now.axis)
    m = np.cos(u) * x + np.sin(u) * y
    arm = h * now.axis + rho * m
    velocity = now.velocity + np.cross(np.cross(now.axis, now.axis_rate), arm)
    return float((out * m + up * now.axis) @ velocity)


def test_circles_flux_and_partition():
    for turn, t, rng in random_instants(50):
        now = instant(turn, t)
        h, rho, beta = (
            float(rng.uniform(0, 40)),
            float(rng.uniform(0, 15)),
            float(rng.uniform(-pi / 2, pi / 2)),
        )
        of = circles(now, h, rho, np.cos(beta), np.sin(beta))
        u = np.linspace(0, 2 * pi, 4001)[:-1]
        f = normal_speed(of, u)
        assert f[123] == pytest.approx(body_speed(now, h, rho, np.cos(beta), np.sin(beta), u[123]), abs=1e-11)
        # a sum over a period misses a kink by h^2 / 8 times the slope
        slope = 2 * (2 * pi / 4000) ** 2 * float(of.reach)
        assert front(float(of.reach), float(of.c)) == pytest.approx(
            np.maximum(f, 0).mean() * 2 * pi, abs=slope + 1e-12
        )
        lo, hi = grazing_angles(of)
        if np.isnan(lo):
            assert (f > 0).all() or (f < 0).all()
        else:
            assert normal_speed(of, [lo, hi]) == pytest.approx(0, abs=1e-12 * float(of.reach))
            assert normal_speed(of, 0.5 * (lo + hi)) > 0  # egress between the two


TOOLS = {
    "bull": BullNose(diameter=30, corner_radius=5, length=50).profile,
    "cone": Taper(diameter=6, corner_radius=2, taper_deg=12, length=40).profile,
    "dovetail": Taper(diameter=20, taper_deg=-15, length=30).profile,
}


@pytest.mark.parametrize("tool", TOOLS)
def test_stretches_are_where_circles_have_two_angles(tool):
    for turn, t, _ in random_instants(60):
        now = instant(turn, t)
        for s in TOOLS[tool].segments:
            found = grazing_stretches(s, now)
            lo, hi = s.beta if s.is_arc else (s.z0, s.z1)
            x = lo + (hi - lo) * np.random.default_rng(3).random(200)
            beta = x if s.is_arc else np.full(200, s.beta[0])
            h = s.cz + s.radius * np.sin(x) if s.is_arc else x
            rho = (
                s.cr + s.radius * np.cos(x) if s.is_arc else s.r0 + (s.r1 - s.r0) * (x - s.z0) / (s.z1 - s.z0)
            )
            two = ~np.isnan(grazing_angles(circles(now, h, rho, np.cos(beta), np.sin(beta)))[:, 0])
            mine = np.any([(x >= a) & (x <= b) for a, b in found], axis=0) if found else np.zeros(200, bool)
            edge = np.min([np.abs(x - e) for ab in found for e in ab], axis=0) if found else np.ones(200)
            assert (two == mine)[edge > 1e-9].all()


def test_discs_graze_along_their_chord_and_edges_between_their_fan():
    for turn, t, rng in random_instants(40):
        now = instant(turn, t)
        for h, up in ((0.0, -1.0), (50.0, 1.0)):
            d, along = chord(now, h)
            across_it = np.cross(now.axis, along)
            for reach in rng.uniform(-10, 10, 3):
                arm = d * along + reach * across_it
                velocity = now.velocity + np.cross(np.cross(now.axis, now.axis_rate), h * now.axis + arm)
                assert up * now.axis @ velocity == pytest.approx(0, abs=1e-10)
        u = np.linspace(0, 2 * pi, 200)
        R = FlatEnd(diameter=20, length=50).diameter / 2
        side, bottom = circles(now, 0.0, R, 1.0, 0.0), circles(now, 0.0, R, 0.0, -1.0)
        fan = np.linspace(0, 1, 2001)[:, None]
        n_r, n_z = np.sin(fan * pi / 2), -np.cos(fan * pi / 2)
        f = normal_speed(circles(now, 0.0, R, n_r, n_z), u)
        ends = normal_speed(side, u) * normal_speed(bottom, u)
        assert ((ends <= 0) == ((f.min(0) <= 0) & (f.max(0) >= 0))).all()


def test_folding_is_the_second_derivative_of_the_distance():
    """phi(t) of fixed grazing points of the cylinder and the ball, by central differences: error of h^2."""
    h, R, checked = 1e-3, 6.0, 0
    for turn, t, _ in random_instants(40):
        now = instant(turn, t)
        x, y = across(now.axis)
        for height, rho, out, up, bend in ((30.0, R, 1.0, 0.0, 0.0), (0.4 * R, 0.8 * R, 0.8, -0.6, 1 / R)):
            for u in grazing_angles(circles(now, height, rho, out, up)):
                if np.isnan(u):
                    continue
                point = now.tip + height * now.axis + rho * (np.cos(u) * x + np.sin(u) * y)
                s = t + h * np.array([-1, 0, 1])
                w = point - turn.position(s) - (R * turn.axis(s) if bend else 0)
                z = 0.0 if bend else (w * turn.axis(s)).sum(1)
                phi = np.sqrt((w * w).sum(1) - z * z) - R
                assert phi[1] == pytest.approx(0, abs=1e-12)
                assert (phi[2] - phi[0]) / (2 * h) == pytest.approx(0, abs=2e-3)
                second = (phi[0] - 2 * phi[1] + phi[2]) / h**2
                assert folding(now, height, rho, out, up, u, bend) == pytest.approx(
                    second, rel=1e-3, abs=5e-3
                )
                checked += 1
    assert checked > 80
