"""What stands behind figures for papers: regions of a sweep, areas that pockets leave, listings, traces, coefficients."""

from __future__ import annotations

import json
import re
from itertools import pairwise

import numpy as np
import polars as pl
import pytest
from tinyjob import FEED, JOB, write_job

import vmachining as vm
from benchmarks.figures import draw_bench, load_bench
from vmachining.cli.main import run as command
from vmachining.engines import brep
from vmachining.errors import InputError
from vmachining.force import Coefficients, SlotTests, identify
from vmachining.report.paper import (
    Results,
    draw,
    draw_coefficients,
    draw_deviation,
    draw_regions,
    draw_trace,
    load_deviation,
    load_trace,
)
from vmachining.report.paper.body import VIEW, view_frame
from vmachining.report.paper.kinds import lines_shown
from vmachining.report.paper.tables import deviations
from vmachining.report.pockets import draw_pockets, rings
from vmachining.sweep.regions import REGIONS, grazing_points, regions
from vmachining.toolpath import Triangle, advice, bare_path, coverage_shapes

R = 5.0
RAMP = np.array([30.0, 0.0, 12.0])


def on_sphere(count: int, seed: int) -> np.ndarray:
    v = np.random.default_rng(seed).normal(size=(count, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def test_regions_of_a_ball_on_a_ramp():
    """The lower half of the ball: trailing of the plane square to the motion at the start, leading of it at the end."""
    sweep = vm.Sweep(vm.BallNose(diameter=2 * R, length=40), (0, 0, 0), RAMP)
    n = on_sphere(400, 1)
    n = n[n[:, 2] < 0.0]
    ahead = n @ RAMP / np.linalg.norm(RAMP)
    low = n[:, 2] < -0.4  # the wall above covers what else leads
    first, last = R * n + [0, 0, R], R * n + [0, 0, R] + RAMP
    trailing = ahead < -0.01
    assert trailing.sum() > 20
    assert {REGIONS[k] for k in regions(sweep, first[trailing])} == {"ingress"}
    assert {REGIONS[k] for k in regions(sweep, last[(ahead > 0.01) & low])} == {"egress"}
    around = n - ahead[:, None] * RAMP / np.linalg.norm(RAMP)
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    share = np.random.default_rng(2).uniform(0.01, 0.99, (len(n), 1))
    under = (around[:, 2] < -0.1)[:, None].ravel()
    assert {REGIONS[k] for k in regions(sweep, (R * around + [0, 0, R] + share * RAMP)[under])} == {"grazing"}


@pytest.mark.parametrize("off", [-0.03, 0.03])
def test_a_facet_that_stands_off_is_told_as_rightly(off):
    sweep = vm.Sweep(vm.FlatEnd(diameter=2 * R, length=20), (0, 0, 0), (30, 0, 0))
    u = np.radians(np.arange(0.0, 360.0, 3.0) + 1.5)
    wall = np.column_stack([(R + off) * np.cos(u), (R + off) * np.sin(u), np.full(len(u), 8.0)])
    assert (regions(sweep, wall[np.cos(u) < 0.0]) == 0).all()
    assert (regions(sweep, wall[np.cos(u) > 0.0] + [30, 0, 0]) == 2).all()
    assert (regions(sweep, [[x, y, 8.0] for x in (1.0, 15.0, 29.0) for y in (R + off, -R - off)]) == 1).all()


def test_curves_are_drawn_at_the_times_asked_for():
    """Of a level ball: circles across the motion, R about the middle, at the fraction asked for."""
    sweep = vm.Sweep(vm.BallNose(diameter=2 * R, length=20), (0, 0, 0), (30, 0, 0))
    figure = draw_regions(sweep, times=(0.1, 0.6))
    frame = view_frame(VIEW)
    for t in (0.1, 0.6):
        lines = [line for line in figure.axes[0].lines if line.get_label() == f"curve at t = {t:g}"]
        assert len(lines) == 1
        seen = (
            np.array([[30.0 * t, R * np.sin(a), R - R * np.cos(a)] for a in np.radians(np.arange(0, 91))])
            @ frame.T
        )
        drawn = np.concatenate(
            [
                np.asarray(line.get_xydata())
                for line in figure.axes[0].lines
                if line.get_color() == lines[0].get_color()
            ]
        )
        away = np.linalg.norm(drawn[:, None] - seen[None, :, :2], axis=2)
        assert np.nanmin(away, axis=0).max() < 0.3  # mm, points of the curve


def test_the_grazing_curve_of_a_ball_is_a_great_circle():
    sweep = vm.Sweep(vm.BallNose(diameter=2 * R, length=40), (0, 0, 0), RAMP)
    points = np.concatenate(grazing_points(sweep, 0.25)) - 0.25 * RAMP - [0, 0, R]
    ball = points[points[:, 2] < 0.0]
    assert len(ball) > 50
    np.testing.assert_allclose(np.linalg.norm(ball, axis=1), R, atol=1e-9)
    np.testing.assert_allclose(ball @ RAMP, 0.0, atol=1e-7 * np.linalg.norm(RAMP))


def test_faces_of_a_step_file_are_named_by_region(tmp_path):
    """A flat end on a level line: two planes, two flat sides, half a cylinder at either end."""
    sweep = vm.Sweep(vm.FlatEnd(diameter=2 * R, length=20), (0, 0, 0), (30, 0, 0))
    path = tmp_path / "sweep.step"
    _, written = brep.built_sweep(sweep, step=path)
    assert written == pytest.approx((np.pi * R**2 + 2 * R * 30) * 20, rel=1e-9)
    text = path.read_text()
    assert sorted(re.findall(r"ADVANCED_FACE\('(\w*)'", text)) == ["egress", *4 * ["grazing"], "ingress"]
    assert "'vmachining'" in text[:1024]  # known as ours when it is written again


def test_sweep_draws_its_regions(tmp_path, capsys):
    pose = {"cl_mm": [0, 0, 0], "axis": [0, 0, 1]}
    tool = {"type": "flat", "diameter_mm": 10, "length_mm": 20}
    (tmp_path / "s.json").write_text(
        json.dumps({"tool": tool, "start": pose, "end": pose | {"cl_mm": [30, 0, 0]}})
    )
    words = ["sweep", str(tmp_path / "s.json"), "--no-brep", "--plot"]
    assert command([*words, str(tmp_path / "s.svg")]) == 0
    # known as ours when it is written again
    assert "vmachining" in (tmp_path / "s.svg").read_text()[:1024]
    (tmp_path / "mine.png").write_bytes(b"a picture of somebody")
    assert command([*words, str(tmp_path / "mine.png")]) == 2
    assert command([*words, str(tmp_path / "s.jpg")]) == 2
    assert command([*words, str(tmp_path / "s.html"), "--at", "0.5"]) == 2
    assert ".html, .svg, .pdf, .png" in capsys.readouterr().err
    for wrong in ("0.5,x", "1.5", "nan", ""):
        assert command([*words, str(tmp_path / "t.svg"), "--at", wrong]) == 2
        assert "fractions of the motion from 0 to 1" in capsys.readouterr().err


def shoelace(ring: np.ndarray) -> float:
    return 0.5 * sum(a[0] * b[1] - b[0] * a[1] for a, b in pairwise(ring.tolist()))


def test_what_loops_leave_in_corners_has_its_closed_form():
    """Between a sharp corner of half angle h and the round of the next loop: r^2 (cot h - pi / 2 + h); the link cuts one."""
    t = Triangle.of(100, 80, 60, 6)
    h = t.half_angles
    first = int(np.argmin(np.linalg.norm(t.corners - bare_path(t, "loops")[0], axis=1)))
    left = np.delete(t.r**2 * (1 / np.tan(h) - np.pi / 2 + h), first).sum()
    uncut, gouged = coverage_shapes(t, bare_path(t, "loops"))
    drawn = sum(shoelace(ring) for ring in rings(uncut))
    assert abs(drawn) == pytest.approx(left, abs=2e-3)  # 720 segments for a disc
    assert gouged.area < 1e-3
    titles = [axes.get_title() for axes in draw_pockets(t, advice(100, 80, 60, 6)).axes]
    assert f"uncut {left:.3g} mm²" in titles[3] and all("uncut 0 mm²" in titles[k] for k in (1, 2, 4, 5))


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder = tmp_path_factory.mktemp("job")
    return vm.run(write_job(folder, job=JOB + FEED), engine="columns")


def test_programs_stand_side_by_side_with_their_loads(result):
    figure = draw(Results.of(result), "program")
    for axes, rows in zip(figure.axes[1::2], (result.blocks, result.scheduled_blocks), strict=True):
        bars = [bar.get_width() for bar in axes.patches]
        assert bars == pytest.approx(rows["mrr_mm3_min"].fill_null(0.0).to_list())
    words = [text.get_text().split(maxsplit=1) for text in figure.axes[0].texts]
    assert [int(line) for line, _ in words] == result.blocks["line"].to_list()
    assert lines_shown(result.blocks, "mrr_mm3_min", 3)[0] >= result.blocks["line"].min()
    with pytest.raises(InputError, match="no schedule"):
        draw(Results("x", result.folder, result.blocks, None, None, {}), "program")


def test_deviations_of_a_trace(tmp_path):
    n = 200
    data = {"trace_s": np.arange(n) / 1000.0}
    for k, offset in zip("xyz", (3.0, -1.0, 0.5), strict=True):
        data |= {f"f{k}_n": np.full(n, 10.0 + offset), f"f{k}_measured_n": np.full(n, 10.0)}
    table = pl.DataFrame(data).with_columns(
        fx_n=pl.when(pl.col("trace_s") < 0.05).then(None).otherwise("fx_n")
    )
    table.write_csv(tmp_path / "forces_measured.csv")
    trace = load_trace(tmp_path)
    off = deviations(trace)
    assert np.isnan(off[0, :50]).all()  # what was not predicted has no deviation
    np.testing.assert_allclose(off[0, 50:], 3.0)
    np.testing.assert_allclose(off[1:], np.array([[-1.0], [0.5]]) * np.ones(n))
    shown = draw_trace(trace).axes[3].lines[1].get_ydata()
    np.testing.assert_allclose(shown, -100.0 / np.sqrt(300.0))
    with pytest.raises(InputError, match="no measured forces"):
        load_trace(tmp_path / "none")


def test_coefficients_are_drawn_as_they_were_found():
    """Slots of a flat end in closed form; Ktc = 800 N/mm2, Kte = 20 N/mm at every height."""
    depth, feed = (v.ravel() for v in np.meshgrid([1.0, 2.0, 4.0], [0.05, 0.1, 0.15]))
    n = 2.0
    force = np.column_stack([
        -n * (feed / 4 * 300 + 15 / np.pi) * depth, n * (feed / 4 * 800 + 20 / np.pi) * depth,
        n * (feed / np.pi * 90 + 5 / 2) * depth,
    ])  # fmt: skip
    tests = SlotTests(depth, feed, force)
    found = identify(tests, 0.0, 2, degree=1)
    figure = draw_coefficients(found, tests)
    values = [axes.lines[0].get_ydata() for axes in figure.axes[:6]]
    np.testing.assert_allclose(values[0], 800.0, rtol=1e-6)
    np.testing.assert_allclose(values[3], 20.0, rtol=1e-6)
    assert isinstance(found.coefficients, Coefficients)
    left = np.concatenate([line.get_ydata() for line in figure.axes[6].lines[:3]])
    assert np.abs(left).max() < 1e-6


def test_places_off_the_design_are_counted_and_drawn_along_their_vectors(tmp_path):
    n = 50
    columns = {
        "kind": ["upright"] * 30 + ["wall"] * 20, "x_mm": np.arange(n) * 1.0, "y_mm": np.zeros(n), "z_mm": np.full(n, 2.0),
        "nx": np.zeros(n), "ny": np.zeros(n), "nz": np.ones(n), "deviation_mm": np.linspace(-0.1, 0.098, n),
    }  # fmt: skip
    pl.DataFrame(columns).write_parquet(tmp_path / "deviation.parquet")
    rows = load_deviation(tmp_path)
    figure = draw_deviation(rows)
    bars = [bar.get_height() for axes in figure.axes for bar in axes.patches]
    assert sum(bars) == n
    side = next(axes for axes in figure.axes if axes.get_ylabel() == "z (mm)").lines[0].get_xydata()
    assert side[0] == pytest.approx([0.0, 2.0])  # the largest first
    times = (side[1, 1] - 2.0) / -0.1
    assert times > 1.0 and side[1, 0] == side[0, 0]
    np.testing.assert_allclose(
        side[4::3, 1],
        2.0 + times * rows.sort(pl.col("deviation_mm").abs(), descending=True)["deviation_mm"][1:],
    )
    with pytest.raises(InputError, match="no deviation"):
        load_deviation(tmp_path / "none")


def test_lines_of_a_benchmark_become_a_diagram(tmp_path, capsys):
    base = {"case": "zmap", "tool": "flat", "steps_mm": [1.0, 2.0]}
    rows = [base | {"method": "analytic", "pitch_mm": None, "ms_per_position": 0.1, "rms_mm": 0.0}]
    for method, slow in (("vectors", 2.0), ("zmap", 1.0)):
        rows += [
            base | {"method": method, "pitch_mm": p, "ms_per_position": slow / p, "rms_mm": p / 9}
            for p in (0.2, 0.1)
        ]
    file = tmp_path / "z.jsonl"
    file.write_text("\n".join(map(json.dumps, rows)))
    axes = draw_bench(load_bench(file))["zmap"].axes[0]
    shown = {line.get_label().split(",")[0]: line.get_xydata().tolist() for line in axes.lines}
    assert shown["Z-map"] == [[pytest.approx(1 / p), pytest.approx(p / 9)] for p in (0.2, 0.1)]
    assert shown["vertical vectors"][0] == [pytest.approx(10.0), pytest.approx(0.2 / 9)]
    for text, words in (
        ("{", "not a line of JSON"),
        ('{"case": "nc"}', "vmachining bench zmap or vectors"),
        ("", "no records"),
    ):
        file.write_text(text)
        assert command(["figure", str(file)]) == 2
        assert words in capsys.readouterr().err
