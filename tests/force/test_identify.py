"""Coefficients from mean forces: known ones come back, and intervals cover the truth as often as they say."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from oracles.force_closed import slot_means

from vmachining.errors import InputError
from vmachining.force import (
    NAMES,
    Coefficients,
    SlotTests,
    identify,
    layer_coefficients,
    read_tests,
    shipped,
    smoothed,
)
from vmachining.force.identify import layer_integrals

R, TEETH = 4.0, 2
DEPTHS = np.array([1, 2, 3, 4, 5, 8, 10.0])
MEANS = {
    0.1: [(-29.0817801817, 82.3511188818, 51.4501740320), (-55.1983397413, 138.659572351, 64.7573111904),
          (-80.2188471220, 191.476446075, 66.0714660128), (-103.524718100, 243.136350670, 58.4549534052),
          (-125.550775141, 294.734943841, 46.8619952262), (-190.469086946, 449.940582671, 12.1110081431),
          (-232.974721938, 553.684248103, -11.0377249432)],
    0.3: [(-50.4412299082, 151.351118882, 73.3949775198), (-103.209296028, 275.659572351, 97.1291792647),
          (-156.308900859, 395.476446075, 99.8051917998), (-207.430824408, 513.136350670, 85.3991876707),
          (-256.956881449, 629.734943841, 63.6203131339), (-405.875193254, 976.940582671, 1.36735188450),
          (-505.380828246, 1206.68424810, -38.0788473744)],
}  # fmt: skip
"""Cumulative means of layers i = 1..7 with Ktc = 700 - 10 i, Krc = 250 + 5 i, Kac = 120 - 8 i, Kte = 25 + i, Kre = 18 - i,
Kae = 4 + i / 2 (reference numbers of the specification)."""


def published_tests() -> SlotTests:
    depth = np.tile(DEPTHS, 2)
    feed = np.repeat(list(MEANS), len(DEPTHS))
    return SlotTests(depth, feed, np.concatenate(list(MEANS.values())))


def made(coefficients: Coefficients, feeds=(0.1, 0.3), slices=4000) -> SlotTests:
    """Means summed over thin layers of constant coefficients: no formula of the fit is used."""
    rows = []
    for depth in DEPTHS:
        # in the angle: layers near the tip are long along the edge
        corner = R * (1.0 - np.cos(np.linspace(0.0, np.arccos(1.0 - min(depth, R) / R), slices + 1)))
        z = np.concatenate([corner, np.linspace(R, depth, slices // 4 + 1)[1:]]) if depth > R else corner
        middle = coefficients.at(0.5 * (z[1:] + z[:-1])).T
        layers = [layer_integrals(a, b, R) for a, b in pairwise(z)]
        for feed in feeds:
            force = sum(slot_means(part, feed, TEETH, k) for part, k in zip(layers, middle, strict=True))
            rows.append((depth, feed, *force))
    table = np.array(rows)
    return SlotTests(table[:, 0], table[:, 1], table[:, 2:])


def test_layers_of_constant_coefficients_come_back():
    fit = layer_coefficients(published_tests(), R, TEETH)
    i = np.arange(1, 8)
    wanted = np.column_stack([700 - 10 * i, 250 + 5 * i, 120 - 8 * i, 25 + i, 18 - i, 4 + i / 2])
    np.testing.assert_allclose(fit.values, wanted, rtol=1e-7)


def test_the_cubic_of_the_layers():
    values = np.repeat(np.array([[660, 575, 548, 520, 530, 560, 575.0]]).T, 6, axis=1)
    fit = layer_coefficients(published_tests(), R, TEETH)
    found = smoothed(type(fit)(fit.low, DEPTHS, values), ref="top").powers[0]
    wanted = (-0.95047942924255, 20.022463933248, -123.82856241345, 760.05796097954)
    np.testing.assert_allclose(found, wanted, rtol=1e-10)
    assert ((np.polyval(found, DEPTHS) - values[:, 0]) ** 2).sum() == pytest.approx(235.70997598471)


def test_known_coefficients_come_back():
    """Constant ones from closed forms to 1e-7; a cubic as well as thin layers are integrals."""
    constant = Coefficients.constant(700, 250, 120, 25, 18, 4)
    depth, feed = (v.ravel() for v in np.meshgrid(DEPTHS, [0.1, 0.2, 0.3]))
    k = constant.powers[:, 0]
    force = [slot_means(layer_integrals(0.0, d, R), f, TEETH, k) for d, f in zip(depth, feed, strict=True)]
    found = identify(SlotTests(depth, feed, force), R, TEETH, degree=3).coefficients
    np.testing.assert_allclose(found.at([0.5, 3.0, 9.5]), np.repeat(k[:, None], 3, axis=1), rtol=1e-7)
    truth = shipped("bull_d32_r4_published")
    again = identify(made(truth), R, TEETH).coefficients
    z = np.array([0.5, 2.0, 6.0, 9.5])
    np.testing.assert_allclose(again.at(z), truth.at(z), rtol=1e-4, atol=1e-4)


def test_intervals_cover_the_truth_as_often_as_they_say():
    """5 % noise of every component, 1,000 draws from a fixed seed: 90 to 98 % for intervals of 95 %."""
    truth = shipped("bull_d32_r4_published")
    clean = made(truth, slices=400)
    z = np.array([0.5, 2.5, 4.5, 9.0])
    rng = np.random.default_rng(5)
    hit = np.zeros((6, len(z)))
    for _ in range(1000):
        noisy = clean.force * (1.0 + 0.05 * rng.standard_normal(clean.force.shape))
        found = identify(SlotTests(clean.depth, clean.feed, noisy), R, TEETH)
        hit += np.abs(found.coefficients.at(z) - truth.at(z)) <= found.half_width(z)
    assert (hit >= 900).all() and (hit <= 980).all(), hit


def test_a_file_comes_back(tmp_path):
    found = identify(published_tests(), R, TEETH, name='a "set"')
    path = tmp_path / "k.toml"
    path.write_text(found.to_toml(), encoding="utf-8")
    again = Coefficients.load(path)
    assert again.name == 'a "set"' and (again.powers == found.coefficients.powers).all()
    assert again.height_mm == (0.0, 10.0)


HEADER = "depth_mm, feed_mm_per_tooth, fx_n, fy_n, fz_n\n"
BAD = {
    "missing": ("depth_mm,feed_mm_per_tooth,fx_n,fy_n\n1,0.1,2,3\n", ["'fz_n' is missing"]),
    "unit": ("depth,feed_mm_per_tooth,fx_n,fy_n,fz_n\n1,0.1,2,3,4\n", ["'depth' has no unit", "'depth_mm'"]),
    "other unit": ("depth_mm,feed_mm_per_tooth,fx_kn,fy_n,fz_n\n1,0.1,2,3,4\n", ["'fx_kn'", "'fx_n'"]),
    "word": (HEADER + "1,0.1,2,3,4\n2,0.1,x,3,4\n", [":3:", "fx_n = 'x'"]),
    "cut off": (HEADER + "1,0.1,2\n", [":2:", "fy_n"]),
    "zero": (HEADER + "0,0.1,2,3,4\n", ["above zero"]),
    "empty": (HEADER, ["no rows"]),
    "nothing": ("", ["missing"]),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_tables_are_refused(case, tmp_path):
    text, words = BAD[case]
    path = tmp_path / "slots.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_tests(path)
    assert all(word in str(caught.value) for word in words), str(caught.value)


@pytest.mark.parametrize(
    ("tests", "words"),
    [
        (SlotTests([1, 2, 3], [0.1, 0.2, 0.1], np.ones((3, 3))), "3 depths"),
        (SlotTests([1, 2, 3, 4], [0.1] * 4, np.ones((4, 3))), "one feed"),
    ],
)
def test_too_few_tests_are_refused(tests, words):
    with pytest.raises(InputError, match=words):
        identify(tests, R, TEETH)


@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_forces_on_the_workpiece_have_the_other_sign(mark, tmp_path):
    path = tmp_path / "slots.csv"
    path.write_text((HEADER + "1, 0.1, 2, -3, 4, \n\n").replace(",", mark), encoding="utf-8")
    assert read_tests(path, on="workpiece").force.tolist() == [[-2, 3, -4]]
    assert len(NAMES) == 6
