"""Triangular pockets: the source's numbers, true lengths, paths and coverage of spec C.3 and C.4."""

from __future__ import annotations

import json
from math import pi, sqrt

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import vmachining as vm
from vmachining.cli.main import run
from vmachining.errors import InputError
from vmachining.toolpath import STRATEGIES, Triangle, advice, pocket_lengths

ONE, TWO = (100.0, 100.0, 100.0, 10.0), (100.0, 80.0, 60.0, 5.0)
ROUNDED = (90.0, 53.0, 37.0)


@pytest.mark.parametrize(
    ("triangle", "strategy", "mode", "angles", "length"),
    [
        (ONE, "dp", "book", None, 388.2309),
        (ONE, "dpi", "book", None, 293.1096),
        (ONE, "cp", "book", None, 251.2693),
        (ONE, "cpi", "book", None, 196.0770),
        (TWO, "dp", "book", ROUNDED, 407.8469),
        (TWO, "dp", "book", None, 407.5),
        (TWO, "dpi", "book", ROUNDED, 323.588),
        (TWO, "dpi", "book", None, 323.428),
        (TWO, "dpi", "book_corrected", ROUNDED, 318.064),
        (TWO, "dpi", "book_corrected", None, 317.803),
        (TWO, "cp", "book", ROUNDED, 316.4493),
        (TWO, "cp", "book", None, 316.2413),
        (TWO, "cpi", "book", ROUNDED, 288.2942),
        (TWO, "cpi", "book", None, 288.1256),
        (ONE, "dp", "true", None, 388.2309),
        (ONE, "dpi", "true", None, 293.1096),
        (ONE, "cp", "true", None, 251.2693),
        (ONE, "cpi", "true", None, 264.7521),
        (TWO, "dp", "true", None, 408.3333),
        (TWO, "dpi", "true", None, 315.3575),
        (TWO, "cp", "true", None, 316.2413),
        (TWO, "cpi", "true", None, 288.1256),
        ((90, 90, 90, 8), "dp", "true", None, 387.4462),
        ((90, 90, 90, 8), "dpi", "true", None, 307.1853),
        ((90, 90, 90, 8), "cp", "true", None, 261.0155),
        ((90, 90, 90, 8), "cpi", "true", None, 271.4462),
        ((150, 130, 40, 4), "dp", "true", None, 525.0),
        ((150, 130, 40, 4), "dpi", "true", None, 382.2931),
        ((150, 130, 40, 4), "cp", "true", None, 425.2394),
        ((150, 130, 40, 4), "cpi", "true", None, 374.6681),
    ],
)
@pytest.mark.erratum(
    "pocket",
    "6.1, contour parallel, improved",
    "276.08 mm; the printed formula gives 196.077 mm",
    "264.752 mm, measured on the path that clears the pocket",
)
@pytest.mark.erratum(
    "pocket", "6.1 and 6.2, direction parallel, improved", "297.175 and 318.347 mm", "293.110 and 315.358 mm"
)
@pytest.mark.erratum("pocket", "6.2, contour parallel, improved", "296.578 mm", "288.126 mm")
@pytest.mark.erratum(
    "pocket",
    "6.2, prose",
    "direction parallel, improved, is shorter than contour parallel",
    "318.347 > 316.018 as printed; true lengths agree with the prose",
)
def test_lengths_of_the_specification(triangle, strategy, mode, angles, length):
    digits = (
        5e-5 if length != round(length, 3) or length == round(length, 1) else 5e-4
    )  # as many as are printed
    found = pocket_lengths(*triangle, strategy=strategy, mode=mode, angles=angles)
    assert found.length == pytest.approx(length, abs=max(digits, 1e-4))


def test_paths_of_the_specification():
    root = pocket_lengths(*TWO, strategy="dpi").path
    wanted = [
        (10, 5), (85, 5), (215 / 3, 15), (27.5, 15), (10, 5), (17.5, 15), (25, 25), (130 / 3, 25), (215 / 3, 15),
        (175 / 3, 25), (45, 35), (42.5, 35), (25, 25), (32.5, 35), (37, 41), (45, 35),
    ]  # fmt: skip
    assert root == pytest.approx(np.array(wanted, dtype=float), abs=1e-4)
    wanted = [
        (85, 5), (10, 5), (37, 41), (85, 5), (55, 15), (30, 15), (24.4721, 12.2361), (30, 15), (39, 27),
        (38.7071, 29.0503), (39, 27), (55, 15),
    ]  # fmt: skip
    assert pocket_lengths(*TWO, strategy="cpi").path == pytest.approx(np.array(wanted, dtype=float), abs=5e-5)


def test_the_pocket_itself():
    one, two = Triangle.of(*ONE), Triangle.of(*TWO)
    assert one.sides == pytest.approx((65.358984,) * 3, abs=1e-6)
    assert (one.height, one.inset, one.area) == pytest.approx((56.602540, 18.867513, 4124.6710), abs=1e-4)
    assert two.sides == pytest.approx((75.0, 60.0, 45.0), abs=1e-9)
    assert (two.height, two.inset, two.area) == pytest.approx((36.0, 15.0, 2328.5398), abs=1e-4)


@pytest.mark.erratum(
    "pocket",
    "chapters 4 and 5",
    "the centre is not looked at",
    "408.588 mm^2 stay uncut in the first example, if the innermost inradius exceeds the radius of the cutter",
)
def test_loops_may_leave_the_centre_and_say_so():
    side = 2.0 * sqrt(3.0) * (13.0 + 10.0)  # inradius of the pocket: 13 + 10
    assert pocket_lengths(side, side, side, 10.0, strategy="cp").uncovered_area == pytest.approx(
        3.0 * sqrt(3.0) * 9.0, abs=1e-2
    )
    side = 2.0 * sqrt(3.0) * (8.1 + 6.0)
    alone = pocket_lengths(side, side, side, 6.0, strategy="cp")
    linked = pocket_lengths(side, side, side, 6.0, strategy="cp", centre=True)
    assert (alone.length, alone.uncovered_area) == pytest.approx((84.177669, 22.915032), abs=1e-2)
    assert (linked.length, linked.uncovered_area) == pytest.approx((92.277669, 0.0), abs=1e-2)


@settings(max_examples=60)
@given(
    beta=st.floats(8.0, 100.0), gamma=st.floats(8.0, 100.0), share=st.floats(0.03, 0.9),
    strategy=st.sampled_from(sorted(STRATEGIES)),
)  # fmt: skip
def test_every_path_clears_its_pocket_and_no_more(beta, gamma, share, strategy):
    assume(beta + gamma < 172.0)
    alpha = 180.0 - beta - gamma
    sines = np.sin(np.radians([alpha, beta, gamma]))
    b, c, a = np.sort(100.0 * sines)
    triangle = (float(a), float(b), float(c))
    r = share * Triangle.of(*triangle, 1e-9).inradius
    found = pocket_lengths(*triangle, r, strategy=strategy, centre=True)
    # polygons with n segments per quarter: each of at most `turns` arcs lacks (pi/4 - n sin(pi/2n)/2) r^2 per quarter
    arcs = 4.0 * len(found.path) * (pi / 4 - 180 * np.sin(pi / 360) / 2) * r * r
    assert max(found.uncovered_area, found.gouge_area) < 1e-2 + arcs
    assert found.path == pytest.approx(found.path)  # finite


def test_advice_ranks_as_the_true_lengths_do():
    assert [p.strategy for p in advice(*ONE)] == ["cp", "cpi", "dpi", "dp"]
    assert [p.strategy for p in advice(*TWO)] == ["cpi", "dpi", "cp", "dp"]
    assert max(p.uncovered_area for p in advice(*TWO)) < 1e-2


@pytest.mark.parametrize(
    ("sides", "words"),
    [
        ((10.0, 10.0, 10.0, 10.0), "-24.641"),
        ((10.0, 5.0, 5.0, 1.0), "no triangle"),
        ((5.0, 6.0, 5.0, 1.0), "longest"),
        ((float("nan"), 6.0, 5.0, 1.0), "positive"),
        ((6.0, 6.0, 5.0, 0.0), "positive"),
    ],
)
def test_refusals(sides, words):
    with pytest.raises(InputError, match=words):
        pocket_lengths(*sides, strategy="dp")


def test_angles_that_do_not_fit_are_told():
    found = pocket_lengths(*TWO, strategy="dp", mode="book", angles=ROUNDED)
    assert "53.1301" in found.warnings[0]
    assert not pocket_lengths(*TWO, strategy="dp").warnings


@pytest.mark.slow  # four runs of a job
@pytest.mark.parametrize("strategy", sorted(STRATEGIES))
def test_an_engine_cuts_area_times_depth(tmp_path, strategy, capsys):
    words = ["100", "80", "60", "--radius", "5", "--strategy", strategy, "--depth", "4", "--step", "2"]
    assert run(["toolpath", "pocket", *words, "--out", str(tmp_path / "pocket.nc"), "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["chosen"] == strategy and record["shortest"] == "cpi"
    result = vm.run(vm.Job.load(tmp_path / "pocket.toml").with_chord(0.1), workers=1)
    truth = 4.0 * Triangle.of(*TWO).area
    slack = 4.0 * 7.1e-5 * 2.0 * Triangle.of(*TWO).perimeter  # four decimals in the program
    assert result.summary["removed_lo_mm3"] - slack <= truth <= result.summary["removed_hi_mm3"] + slack


def test_command_shows_published_and_true_lengths(capsys, tmp_path):
    assert run(["toolpath", "pocket", "100", "80", "60", "--radius", "5", "--angles", "90,53,37"]) == 0
    out, err = capsys.readouterr()
    assert "407.8469" in out and "408.3333" in out and "shortest: cpi" in out and "inconsistent" in err
    (tmp_path / "mine.nc").write_text("(mine)")
    assert (
        run(["toolpath", "pocket", "100", "80", "60", "--radius", "5", "--out", str(tmp_path / "mine.nc")])
        == 2
    )
    assert (tmp_path / "mine.nc").read_text() == "(mine)"


def test_page_of_paths(tmp_path, capsys):
    page = tmp_path / "pocket.html"
    assert run(["toolpath", "pocket", "100", "80", "60", "--radius", "5", "--plot", str(page)]) == 0
    assert "Which strategy is shortest" in page.read_text(encoding="utf-8")


def test_the_wall_that_is_drawn_encloses_the_pocket():
    for sides, r in (((60.0, 50.0, 40.0), 4.0), ((100.0, 80.0, 60.0), 5.0), ((150.0, 130.0, 40.0), 4.0)):
        triangle = Triangle.of(*sides, r)
        x, y = triangle.wall(2000).T
        area = 0.5 * float((x[:-1] * y[1:] - x[1:] * y[:-1]).sum())
        assert area == pytest.approx(triangle.area, rel=1e-6)
        assert y.min() == pytest.approx(0.0, abs=1e-9)
