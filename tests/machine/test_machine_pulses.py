"""Paths as pulse trains: ends, feed, splitting, deviation, files, plot and the command."""

from __future__ import annotations

import csv
import json
import math
import re
from itertools import pairwise

import numpy as np
import pytest

from tests.report.pagedata import unpacked
from vmachining.cli.main import run
from vmachining.errors import KinematicsError
from vmachining.geometry import Arc, Line
from vmachining.machine import (
    Interpolator,
    write_csv,
    write_npz,
)
from vmachining.report.scene import write_pulses

PROGRAM = """\
N10 G21 G90 G17
N20 G0 X10 Y0 Z1
N30 G1 Z-0.5 F100
N40 G1 X30 Y7 F250
N50 G3 X20 Y17 I-10 J0
N60 G2 X20 Y17 I0 J-5 Z-1
N70 G4 P1
N80 G18 G2 X22 Z1 I1 K1
N90 M30
"""


@pytest.mark.parametrize(
    ("length", "feed", "frn", "clock", "seconds"), [(50, 100, 20, 666.667, 30), (12.5, 250, 200, 6666.67, 3)]
)
def test_feed_of_lines(length, feed, frn, clock, seconds):
    """Published examples with registers of 20000."""
    way = np.array([0.6, 0.8, 0.0])
    (block,) = Interpolator().blocks(Line((0, 0, 0), length * way), feed)
    assert block.frn == pytest.approx(frn) and block.clock_hz == pytest.approx(clock, rel=1e-6)
    assert block.time_s == pytest.approx(seconds)
    assert block.peak_hz == pytest.approx(0.8 * feed / 60 / 0.02)


@pytest.mark.parametrize("angle", [np.pi / 2, -np.pi / 2, 2 * np.pi, -4 * np.pi, 1.0])
def test_feed_of_arcs(angle):
    """f0 = N V / (60 R); the time is the length over the feed, within the pulses that rounding moves."""
    arc = Arc((10, 0, 0), (0, 0, 0), angle=angle)
    (block,) = Interpolator(blu_mm=0.01, register=5000).blocks(arc, 300.0)
    assert block.clock_hz == pytest.approx(5000 * 300 / (60 * 10)) and block.frn == 300.0
    assert block.time_s == pytest.approx(arc.length / 5.0, rel=5e-3)
    assert block.peak_hz == pytest.approx(5.0 / 0.01, rel=1e-3)
    assert block.deviation_blu <= block.limit_blu


def test_blocks_join_without_drift():
    """Many increments of a third of a BLU end where one long move ends."""
    tool = Interpolator(blu_mm=0.01)
    points = np.linspace(0, 1, 301)[:, None] * [1.0, -2.0, 0.5]
    sent = np.zeros(3, dtype=int)
    for a, b in pairwise(points):
        for block in tool.blocks(Line(a, b), 100.0):
            assert (block.start == sent).all()
            sent += block.train.counts
    assert sent.tolist() == [100, -200, 50]


def test_splitting_keeps_the_end():
    long = Line((0, 0, 0), (20001 * 0.02, 777 * 0.02, -3 * 0.02))
    with pytest.raises(KinematicsError, match="7: register overflow: 20001"):
        Interpolator().blocks(long, 100.0, 7)
    parts = Interpolator(split=True).blocks(long, 100.0)
    assert len(parts) == 2
    assert np.sum([p.train.counts for p in parts], axis=0).tolist() == [20001, 777, -3]
    assert (parts[1].start == parts[0].train.counts).all()
    assert sum(p.time_s for p in parts) == pytest.approx(60 * long.length / 100)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("turn", [0.3, -2.0, 3.2, -6.28, 2 * np.pi, 6.3, -12.0, 4 * np.pi])
def test_arcs_and_helices_in_any_plane(axis, turn):
    """The pulses end at the rounded end and stay within the limit of the true circle plus its rounding."""
    center = np.array([1.234, -5.678, 9.1])
    start = center + np.roll([7.0 * np.cos(0.4), 7.0 * np.sin(0.4), 0.0], axis + 1)
    for rise in (0.0, -2.5):
        path = Arc(start, center, axis, angle=turn, rise=rise)
        (block,) = Interpolator(blu_mm=0.05, register=1000).blocks(path, 200.0)
        assert not block.missing.any() and block.kind == ("helix" if rise else "arc")
        np.testing.assert_array_equal(block.start + block.train.counts, np.round(path.end / 0.05))
        assert block.deviation_blu <= block.limit_blu <= 2.5 + math.sqrt(8)
        points = block.train.positions(block.start) * 0.05 - center
        radius = np.linalg.norm(np.delete(points, axis, axis=1), axis=1)
        # rounding of start and centre: half a BLU per coordinate each
        assert np.abs(radius - 7.0).max() <= 0.05 * (block.limit_blu + math.sqrt(2))
        turned = np.unwrap(
            np.arctan2(*np.moveaxis(points[:, np.roll([0, 1, 2], -axis - 1)[:2]], 0, -1)[::-1])
        )
        assert turned[-1] - turned[0] == pytest.approx(turn, abs=0.05 / 7 * 3)


def test_arcs_smaller_than_the_lattice():
    tool = Interpolator(blu_mm=0.02)
    tiny = Arc((5.0, 0, 0), (0, 0, 0), angle=1e-4, rise=0.1)
    (block,) = tool.blocks(tiny, 100.0)
    assert block.kind == "line" and block.train.counts.tolist() == [0, 0, 5]
    assert tool.blocks(Arc((5.0, 0, 0), (0, 0, 0), angle=1e-4), 100.0) == []
    assert tool.blocks(Line((0, 0, 0), (0.004, 0, 0)), 100.0) == []
    with pytest.raises(KinematicsError, match="below one BLU"):
        tool.blocks(Arc((0.001, 0, 0), (0, 0, 0), angle=1.0), 100.0)


def test_the_engraver_keeps_its_errors():
    """Mode s1: lines within 1 BLU, z after x and y, quadrants that miss pulses."""
    tool = Interpolator(mode="s1")
    (block,) = tool.blocks(Line((0, 0, 0), (0.1, 0.06, 0)), 100.0)
    assert block.deviation_blu < 1.0 == pytest.approx(block.limit_blu, abs=0.2)
    (block,) = tool.blocks(Line((0, 0, 0), (0.1, 0.06, -0.04)), 100.0)
    assert block.train.text().split()[-2:] == ["00-", "00-"] and block.train.text().count("-") == 2
    assert block.deviation_blu <= block.limit_blu
    # a circle of 4 mm, 200 BLU: each quadrant ends (1, 1) pulses off its end, see the published sums
    (block,) = tool.blocks(Arc((4, 0, 0), (0, 0, 0), angle=-np.pi / 2), 100.0)
    assert block.train.counts.tolist() == [-199, -201, 0] and block.missing.tolist() == [-1, 1, 0]
    (whole,) = tool.blocks(Arc((4, 0, 0), (0, 0, 0), angle=2 * np.pi), 100.0)
    assert whole.train.ticks == 4 * 31400 and math.isinf(whole.limit_blu)
    assert whole.train.counts.tolist() == [0, 0, 0]
    for path in (Arc((4, 0, 0), (0, 0, 0), angle=1.0), Arc((4, 0, 0), (0, 0, 0), angle=np.pi / 2, rise=1.0)):
        with pytest.raises(KinematicsError, match="whole quadrants"):
            tool.blocks(path, 100.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Interpolator(mode="bresenham"), "expected dda or s1"),
        (lambda: Interpolator(blu_mm=0.0), "blu_mm is 0"),
        (lambda: Interpolator(register=0), "register 0"),
        (lambda: Interpolator(max_pulse_hz=math.nan), "max_pulse_hz"),
        (lambda: Interpolator().blocks(Line((0, 0, 0), (1, 0, 0)), 0.0, 3), "3: feed 0"),
        (lambda: Interpolator(max_pulse_hz=100.0).blocks(Line((0, 0, 0), (1, 0, 0)), 240.0, 3),
         "3: feed too high: 200 pulses/s, the drives follow 100; feed at most 120 mm/min"),
        (lambda: Interpolator(register=100).blocks(Arc((4, 0, 0), (0, 0, 0), angle=1.0), 100.0, 5),
         "5: register overflow"),
    ],
)  # fmt: skip
def test_refusals(make, message):
    with pytest.raises(KinematicsError, match=re.escape(message)):
        make()


@pytest.fixture
def program(tmp_path):
    path = tmp_path / "part.nc"
    path.write_text(PROGRAM)
    return path


def test_the_command_writes_what_it_says(program, tmp_path, capsys):
    names = {kind: tmp_path / f"pulses.{kind}" for kind in ("csv", "npz", "html")}
    assert run(["dda", str(program), "--json", "--out", str(names["npz"]), "--plot", str(names["html"])]) == 0
    records = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    summary = records.pop()["summary"]
    assert [r["line"] for r in records] == [2, 3, 4, 5, 6, 8] and summary["blocks"] == 6
    assert [r["kind"] for r in records] == ["line"] * 3 + ["arc", "helix", "arc"]
    assert records[3]["pulses"] == [-500, 500, 0] and records[4]["pulses"] == [0, 0, -25]
    assert summary["missing"] == [0, 0, 0] and summary["beyond_limit"] == 0
    for r in records:
        steps = np.array([[{"+": 1, "-": -1, "0": 0}[c] for c in group] for group in r["train"].split()])
        assert steps.sum(axis=0).tolist() == r["pulses"] and len(steps) == len(r["tick"])
        assert r["tick"][-1] < r["ticks"]
    stored = np.load(names["npz"])
    assert stored["steps"].sum(axis=0).tolist() == np.sum([r["pulses"] for r in records], axis=0).tolist()
    assert np.bincount(stored["block"]).tolist() == [len(r["tick"]) for r in records]
    page = names["html"].read_text()
    head, arrays = unpacked(page)
    drawn = arrays[head["scene"][1]["points"]].reshape(-1, 3)
    drawn = drawn[~np.isnan(drawn[:, 0])]
    # every block is drawn from its start on: one place more than it has ticks
    assert len(drawn) == summary["pulsing_ticks"] + summary["blocks"] and np.ptp(drawn[:, 2]) > 0
    assert not re.search(r"<script[^>]+src=", page)  # one offline file

    assert run(["dda", str(program), "--out", str(names["csv"])]) == 0
    told = capsys.readouterr()
    assert told.out == "" and "6 blocks" in told.err  # the listing is in the file
    assert run(["dda", str(program)]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 6
    rows = list(csv.DictReader(names["csv"].open()))
    assert len(rows) == summary["pulsing_ticks"]
    assert float(rows[-1]["time_s"]) == pytest.approx(summary["time_s"], rel=1e-3)
    assert [sum(int(row[a]) for row in rows) for a in "xyz"] == stored["steps"].sum(axis=0).tolist()


@pytest.mark.parametrize(
    ("options", "text", "message"),
    [
        (["--mode", "s2"], PROGRAM, "expected dda or s1"),
        (["--mode", "s1"], PROGRAM, "part.nc:6: mode s1 draws whole quadrants"),
        (["--blu", "0"], PROGRAM, "blu_mm is 0"),
        (["--blu", "1e-12", "--split"], PROGRAM, "part.nc:2: 99000000000000 pulses in one block"),
        (["--register", "9999999999"], PROGRAM, "expected a whole number"),
        (["--register", "100"], PROGRAM, "part.nc:2: register overflow"),
        (["--out", "pulses.txt"], PROGRAM, "ends in .csv or .npz"),
        (["--plot", "pulses.png"], PROGRAM, "ends in .html"),
        (["--max-rate", "10"], PROGRAM, "part.nc:2: feed too high"),
        ([], "G1 X10 F100\nG2 X20 Y0 I2\nM30\n", "part.nc:2"),
        ([], "G1 X F100\nM30\n", "part.nc:1"),
    ],
)
def test_bad_input_is_named(program, capsys, options, text, message):
    program.write_text(text)
    assert run(["dda", str(program), *options]) == 2
    told = capsys.readouterr()
    assert message in told.err and told.out == ""


def test_turning_axes_are_refused(tmp_path, capsys):
    table = tmp_path / "poses.csv"
    table.write_text("x_mm,y_mm,z_mm,i,j,k,feed_mm_min\n0,0,0,0,0,1,100\n1,0,0,0.1,0,1,100\n")
    assert run(["dda", str(table), "--dialect", "poses"]) == 2
    assert "poses.csv:3: a rotary axis moves" in capsys.readouterr().err
    tilted = tmp_path / "tilted.mpf"  # the arc leans, no axis turns
    tilted.write_text("G71 G90 G17\nG0 X0 Y0 Z0\nAROT X30\nG1 X1 F200\nG2 X4 Y4 I1.5 J2\nM30\n")
    assert run(["dda", str(tilted), "--dialect", "sinumerik"]) == 2
    assert "tilted.mpf:5: an arc in a tilted plane; dda drives X, Y and Z in" in capsys.readouterr().err
    table.write_text("x_mm,y_mm,z_mm,feed_mm_min\n0,0,0,100\n1,0,0,100\n")
    assert run(["dda", str(table), "--dialect", "poses"]) == 0
    assert "X+50 Y+0 Z+0" in capsys.readouterr().out


def test_a_flat_program_is_plotted_flat(tmp_path):
    path = Line((0, 0, 0), (1, 0.5, 0))
    blocks = Interpolator().blocks(path, 100.0)
    write_pulses(tmp_path / "flat.html", blocks, [path], 0.02)
    head, arrays = unpacked((tmp_path / "flat.html").read_text())
    asked, made = (arrays[layer["points"]].reshape(-1, 3)[:-1] for layer in head["scene"])
    assert np.ptp(made[:, 2]) == 0.0 and asked.tolist() == [[0.0, 0.0, 0.0], [1.0, 0.5, 0.0]]
    # no pulse is further than one unit of length from the line
    assert np.abs(made[:, 1] - 0.5 * made[:, 0]).max() <= 0.02 * 1.5


def test_nothing_to_do(tmp_path):
    write_csv(tmp_path / "none.csv", [])
    write_npz(tmp_path / "none.npz", [], Interpolator())
    write_pulses(tmp_path / "none.html", [], [], 0.02)
    assert np.load(tmp_path / "none.npz")["steps"].shape == (0, 3)
