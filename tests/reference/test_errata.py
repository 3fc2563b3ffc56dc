"""Misprints that a few lines prove: numbers of a source against each other, or against a closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest

from docs.site.errata import SOURCES, errata


def test_every_erratum_names_a_source_and_is_told_once():
    found = list(errata())
    assert len(found) > 50 and {e.source for e in found} == set(SOURCES)
    assert len({(e.source, e.place, e.printed) for e in found}) == len(found)


@pytest.mark.erratum(
    "book", "7.2.1.2", "13.7 % saved", "13.5 %: 5.26 s become 4.55 s; 13.7 lies outside of their rounding"
)
def test_time_saved_by_areas():
    least, most = (1.0 - a / b for a, b in ((4.555, 5.255), (4.545, 5.265)))
    assert pytest.approx(0.13498, abs=5e-6) == 1.0 - 4.55 / 5.26
    assert least < 0.135 < most < 0.1368


@pytest.mark.erratum(
    "book",
    "5.3.4",
    "3.33e-5 s a revolution",
    "3.33e-5 s a degree at 5000 rev/min; a revolution takes 0.012 s",
)
def test_time_of_a_degree():
    assert pytest.approx(3.33e-5, abs=5e-8) == 60.0 / 5000.0 / 360.0


@pytest.mark.erratum(
    "book",
    "table 4-2",
    "6 130 291 normal vectors",
    "613 291: only these add up to 67 981 291, and to 17 MB of 28 bytes",
)
def test_vectors_of_the_mould():
    assert 67_368_000 + 613_291 == 67_981_291 != 67_368_000 + 6_130_291
    assert round(613_291 * 28 / 1e6) == 17


@pytest.mark.erratum(
    "book",
    "table 4-2",
    "a part of 1000 x 955 mm at 0.1 mm",
    "67 368 000 vectors cover 840 x 802 mm; the part asks for 95.5 million",
)
def test_size_of_the_mould():
    assert 8400 * 8020 == 67_368_000 and 10_000 * 9_550 == 95_500_000


@pytest.mark.erratum(
    "book", "table 4-1, test 2", "218 + 92 s, 243 s in all", "310 s; the other columns add up"
)
def test_times_of_the_half_cylinder():
    parts, whole = ((555, 15), (218, 92), (128, 190), (47, 688)), (570, 243, 318, 735)
    assert [sum(p) == w for p, w in zip(parts, whole, strict=True)] == [True, False, True, True]


@pytest.mark.erratum(
    "book",
    "table 4-2",
    "delta 0.387 with theta 79.5 degrees at 0.1 mm",
    "acos(0.1 / 0.387) = 75 degrees; 79.5 needs delta 0.548, R = 10",
)
def test_angle_of_the_walls_of_the_mould():
    assert math.degrees(math.acos(0.1 / 0.387)) == pytest.approx(75.0, abs=0.05)
    assert math.degrees(math.acos(0.1 / math.sqrt(6 * 10 * 0.005))) == pytest.approx(79.5, abs=0.05)


@pytest.mark.erratum(
    "book", "3-5", "first component sin C cos A", "sin C sin A: the printed axis is no unit vector"
)
def test_axis_of_a_head():
    a, c = np.radians(40.0), np.radians(75.0)
    axis = np.array([np.sin(c) * np.sin(a), -np.cos(c) * np.sin(a), np.cos(a)])
    printed = np.array([np.sin(c) * np.cos(a), *axis[1:]])
    assert np.linalg.norm(axis) == pytest.approx(1.0) and abs(np.linalg.norm(printed) - 1.0) > 0.05


@pytest.mark.erratum(
    "book",
    "3-38",
    "a norm of lengths and angles over the feed: 5.83 s for the data of the figure",
    "|dC| / v: 5 s",
)
def test_time_of_a_block():
    assert math.hypot(100.0, 60.0) / 20.0 == pytest.approx(5.83, abs=5e-3) and 100.0 / 20.0 == 5.0


@pytest.mark.erratum("book", "figure 3-7", "60 degrees in 5 s, omega = 0.1 rad/s", "0.2094 rad/s")
def test_rate_of_the_figure():
    assert math.radians(60.0) / 5.0 == pytest.approx(0.2094, abs=5e-5)


@pytest.mark.erratum(
    "tester", "3.6, G81", "last move of Z + W = +20", "+20 and +10: Z + W of Z-20 W10 would be -10"
)
def test_moves_of_a_drilling_cycle():
    assert abs(-20) + 10 == 30 and -20 + 10 == -10


@pytest.mark.erratum(
    "tester", "3.9", "corner point at Rp sin(psi / 2)", "Rp / sin(psi / 2): both walls are Rp away only there"
)
def test_corner_of_an_offset():
    radius = 4.0
    for psi in np.radians([40.0, 90.0, 140.0]):
        bisector = np.array([np.cos(psi / 2), np.sin(psi / 2)])
        for reach, right in ((radius / np.sin(psi / 2), True), (radius * np.sin(psi / 2), False)):
            x, y = reach * bisector
            away = abs(y), abs(x * np.sin(psi) - y * np.cos(psi))
            assert bool(np.allclose(away, radius)) is right


@pytest.mark.erratum(
    "dda",
    "circular interpolation",
    "1.57 N iterations of a quadrant",
    "N pi / 2: 12 steps are missing at a radius of 15000 units",
)
def test_iterations_of_a_quadrant():
    radius = 15_000
    assert (np.pi / 2 - 1.57) * radius == pytest.approx(12.0, abs=0.1)


@pytest.mark.erratum(
    "dda",
    "flow charts",
    "overflow if the register exceeds the capacity",
    "reaches it, as the listing has it: else pulses come late",
)
def test_overflow_of_a_register():
    counts, capacity = 32, 64
    register, pulses = 0, 0
    for _ in range(capacity):
        register += counts
        if register > capacity:
            register, pulses = register - capacity, pulses + 1
    assert pulses == counts - 1  # the last pulse never comes


@pytest.mark.erratum(
    "dda",
    "work area",
    "200 x 300 mm, and a table of 275 x 385 mm",
    "a capacity of 20000 covers 385 mm at 0.02 mm",
)
def test_capacity_of_the_engraver():
    assert 385.0 / 0.02 == 19_250 < 20_000


@pytest.mark.erratum(
    "facets", "II.7, II.8", "E = B + n (C - B) with BC = n BE", "E = B + m (C - B), BE = m BC"
)
@pytest.mark.erratum("facets", "II.9", "D = A + n (E - A)", "D = A + (E - A) / n")
def test_points_along_an_edge():
    a, b, c, share = np.zeros(3), np.array([4.0, 0, 0]), np.array([0, 4.0, 0]), 0.25
    e = b + share * (c - b)
    assert np.linalg.norm(e - b) == pytest.approx(share * np.linalg.norm(c - b))
    inside, outside = a + (e - a) / 3.0, a + 3.0 * (e - a)
    assert inside[:2].sum() < 4.0 < outside[:2].sum()


@pytest.mark.erratum(
    "facets",
    "II.3 to II.5",
    "clockwise triangles, inside where F > 0",
    "F > 0 is left of an edge: counterclockwise",
)
def test_side_of_an_edge():
    (x1, y1), (x2, y2) = (0.0, 0.0), (1.0, 0.0)
    f, g, h = -(y2 - y1), x2 - x1, x1 * y2 - x2 * y1
    assert f * 0.5 + g * 0.2 + h > 0.0  # above the edge from left to right: left of it
