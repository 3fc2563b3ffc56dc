"""`nc check --machine`: what a program asks beyond the ranges of a machine, with line, word and remedy; machines of jobs."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from tinyjob import write_job

import vmachining as vm
from vmachining.cli.main import run
from vmachining.errors import JobError, KinematicsError
from vmachining.job.mill import Mill
from vmachining.job.paths import joint_demands, places
from vmachining.machine import load
from vmachining.nc import Motion, Move

PAGE = (Path(__file__).parents[2] / "docs" / "kinematics.md").read_text()
HEXAPOD = re.search(r"```toml\n(name = \"example hexapod\".*?)```", PAGE, re.DOTALL)[1]

MILL = """\
[machine]
max_feed_mm_min = 4000
min_feed_mm_min = 50
axis_feed_mm_min = [4000, 80, 4000]
spindle_rev_min = [100, 8000]
travel_mm = [[-200, 200], [-250, 250], [-100, 100]]
"""
PLAIN = """\
G21 G90
T1 M6
S12000 M3
G0 X0 Y0 Z5
G1 X100 F5000
G1 Y300 F100
G1 X0 Y0 F20
S50
G2 X0 Y0 I-150 F600
G1 X1 F600
M30
"""


def checked(folder, capsys, program, machine, command=("nc", "check"), **files):
    path = folder / "p.nc"
    path.write_text(program)
    if isinstance(machine, str) and "\n" in machine:
        (folder / "mill.toml").write_text(machine)
        machine = str(folder / "mill.toml")
    code = run([*command, str(path), "--machine", machine, "--json"])
    out = capsys.readouterr()
    return code, [json.loads(line) for line in out.out.splitlines()], out.err


def test_each_range_is_named_once_where_it_is_first_left(tmp_path, capsys):
    code, found, err = checked(tmp_path, capsys, PLAIN, MILL)
    assert code == 1 and "not checked" not in err
    assert [(f["line"], f["word"], f["code"]) for f in found if f["code"][1:] in ("377", "378", "373")] == [
        (3, "S12000", "W378"), (5, "F5000", "W377"), (6, "", "E373"), (6, "F100", "W377"), (7, "F20", "W377"),
        (8, "S50", "W378"), (9, "", "E373"), (9, "F600", "W377"),
    ]  # fmt: skip
    words = {(f["line"], f["code"]): f["message"] for f in found}
    assert "machine feeds at 4000" in words[5, "W377"] and "Y limits it to 80" in words[6, "W377"]
    # the circle of 150 mm radius about X-150 goes to X-300
    assert "X would go to -300 mm, its travel is -200 to 200" in words[9, "E373"]
    assert all(f["hint"] for f in found)


def test_a_clean_program_is_clean(tmp_path, capsys):
    assert checked(tmp_path, capsys, "G21 G90\nS900 M3\nG0 X0 Y0 Z5\nG1 X10 Y1 F300\nM30\n", MILL)[:2] == (
        0,
        [],
    )


def test_a_slide_counts_its_share_of_the_way(tmp_path, capsys):
    """On a line at 30 degrees Y does half of the feed: F160 is what it can, F161 is not."""
    line = f"G21 G90\nS900 M3\nG1 X0 Y0 Z0 F60\nG1 X{np.cos(np.pi / 6) * 100:.6f} Y50 F"
    assert checked(tmp_path, capsys, f"{line}160\nM30\n", MILL)[1] == []
    (found,) = checked(tmp_path, capsys, f"{line}161\nM30\n", MILL)[1]
    assert found["code"] == "W377" and "Y limits it to 160 mm/min" in found["message"]


def test_rotary_axes_and_slides_under_tool_centre_point_control(tmp_path, capsys):
    """Trunnion with A through y 20, z 10: at A-90 the place y 300, z 0 is turned to z = 10 - 280."""
    text = "G21 G90\nS100 M3\nG0 X0 Y0 Z5 A0 C0\nG1 X10 A-120 F500\nG43.4 H1\nG0 X0 Y0 Z0 A-90 C0\nG1 Y300 F5000\nM30\n"
    code, found, err = checked(tmp_path, capsys, text, "xyzac-trt", ("nc", "check", "--dialect", "fanuc"))
    words = {(f["line"], f["code"]): f["message"] for f in found}
    assert code == 1 and "A would turn to -120 degrees, its travel is -100 to 50" in words[4, "E373"]
    assert "Z would go to -270 mm, its travel is -120 to 120" in words[7, "E373"]
    assert "Z limits it to 1200 mm/min" in words[7, "W377"]  # 20 mm/s
    assert "smallest feed (min_feed_mm_min), spindle (spindle_rev_min)" in err


def test_legs(tmp_path, capsys):
    text = (
        "G21 G90\nS100 M3\nG0 X0 Y0 Z100 A0 C0\nG43.4 H1\nG1 X0 Y0 Z0 A10 C0 F500\nG1 X900\nG1 X0 A60\nM30\n"
    )
    code, found, _ = checked(
        tmp_path,
        capsys,
        text,
        HEXAPOD.replace("joint_deg = 40", "joint_deg = 90"),
        ("nc", "check", "--dialect", "fanuc"),
    )
    legs = [f for f in found if f["code"] == "E377"]
    assert code == 1 and [f["line"] for f in legs] == [6, 7]
    assert re.search(r"leg \d would be [\d.]+ mm long, it goes from 800 to 1500", legs[0]["message"])


CIRCLE = "G21 G90\nS100 M3\nG0 X{x} Y0 Z0 A0 C0\n{tcp}G2 X{x} Y0 I-{r} F{f}\nM30\n"


@pytest.mark.parametrize("tcp", ["", "G43.4 H1\n"])
def test_a_circle_counts_between_its_ends(tmp_path, capsys, tcp):
    """It ends where it begins, and goes 350 mm to the side; every slide does the whole feed somewhere on it."""
    fanuc = ("nc", "check", "--dialect", "fanuc")
    line = 4 + bool(tcp)
    legs = checked(tmp_path, capsys, CIRCLE.format(x=0, r=350, f=500, tcp=tcp), HEXAPOD, fanuc)[1]
    assert [(f["line"], f["code"]) for f in legs] == [(line, "E377")]
    assert checked(tmp_path, capsys, CIRCLE.format(x=0, r=150, f=500, tcp=tcp), HEXAPOD, fanuc)[1] == []
    (found,) = checked(tmp_path, capsys, CIRCLE.format(x=0, r=120, f=500, tcp=tcp), "xyzac-trt", fanuc)[1]
    assert found["code"] == "E373" and "X would go to -240 mm, its travel is -200 to 200" in found["message"]
    (found,) = checked(tmp_path, capsys, CIRCLE.format(x=30, r=30, f=1201, tcp=tcp), "xyzac-trt", fanuc)[1]
    assert (found["code"], found["line"]) == ("W377", line) and "X limits it to 1200" in found["message"]
    assert checked(tmp_path, capsys, CIRCLE.format(x=30, r=30, f=1200, tcp=tcp), "xyzac-trt", fanuc)[1] == []


def test_slides_on_arcs_of_a_turned_table_are_as_fast_as_their_differences_say():
    """Any arc, plane and turn of a trunnion under tool-centre-point control, against places a thousandth of it apart."""
    rng = np.random.default_rng(11)
    machine = load("xyzac-trt")
    for k in range(60):
        a, c, r, sweep = (
            rng.uniform(-90, 40),
            rng.uniform(-180, 180),
            rng.uniform(5, 40),
            rng.uniform(0.2, 6.2),
        )
        begin, ccw, rise = rng.uniform(0, 6.28), bool(k % 2), rng.uniform(-5, 5)
        plane = ("xy", "zx", "yz")[k % 3]
        first, second, out = {"xy": (0, 1, 2), "zx": (2, 0, 1), "yz": (1, 2, 0)}[plane]
        t = np.linspace(0.0, 1.0, 1001)
        theta = begin + (sweep if ccw else -sweep) * t
        tip = np.zeros((1001, 3))
        tip[:, first], tip[:, second], tip[:, out] = r * np.cos(theta), r * np.sin(theta), rise * t
        still = {"a": a, "c": c}
        move = Move(
            motion=Motion.ARC_CCW if ccw else Motion.ARC_CW, start=tuple(tip[0]), end=tuple(tip[-1]), end_machine=tuple(tip[-1]),
            end_program=tuple(tip[-1]), dwell_s=0.0,
            plane=plane, center=(0.0, 0.0), turns=1, feed_mm_min=1.0, line=1, n=None, tool=1, spindle_rpm=0.0,
            rotary_start=still, rotary_deg=still, tcp=True,
        )  # fmt: skip
        assert places(move, t) == pytest.approx(tip, abs=1e-9)
        q = machine.place(
            np.broadcast_to(machine.joints(degrees=True, **still), (1001, len(machine.axes))), tip
        )[0]
        named = machine.named(q)
        fastest = [np.abs(np.diff(named[name])).max() / np.diff(t)[0] for name in "XYZ"]
        found = joint_demands([move], machine, np.array([np.hypot(r * sweep, rise)])).slides[0]
        assert found == pytest.approx(fastest, abs=2e-2 * r)
        assert (found >= np.array(fastest) * (1.0 - 1e-9)).all()


def test_axes_that_the_machine_does_not_have(tmp_path, capsys):
    _, found, _ = checked(tmp_path, capsys, "G21 G90\nS100 M3\nG1 X1 A30 F100\nM30\n", MILL)
    assert any(f["severity"] == "E" and f["line"] == 3 for f in found)


def test_dda_says_them_too(tmp_path, capsys):
    text = "G21 G90\nS9000 M3\nG0 X0 Y0 Z5\nG1 X10 F5000\nM30\n"
    code, _, err = checked(tmp_path, capsys, text, MILL, ("dda",))
    assert code == 0 and "W378 S9000" in err and "W377 F5000" in err and "p.nc:4" in err
    code, _, err = checked(tmp_path, capsys, text.replace("X10", "X400"), MILL, ("dda",))
    assert code == 2 and "E373 X would go to 400 mm" in err


def test_pivots_of_presets_in_the_job(tmp_path):
    """A head that leans by 90 degrees about a pivot 250 mm above the tip puts the tip beside it."""
    limits = 'chain = "ca-head"\noptions = { pivot_mm = 250 }\n'
    job = vm.Job.load(write_job(tmp_path, swap={"max_feed_mm_min = 4000\n": limits}))
    tip = job.machine.forward(job.machine.joints(a=90.0)).tip
    assert tip == pytest.approx([0.0, 250.0, 250.0], abs=1e-9)
    for wrong, match in (
        ('chain = "ca-head"\noptions = { pivot = 250 }\n', "no option 'pivot'.*pivot_mm"),
        ("options = { pivot_mm = 250 }\n", "options belong to a chain"),
        ('chain = "ca-head"\noptions = { pivot_mm = "far" }\n', "options"),
    ):
        with pytest.raises(JobError, match=match) as caught:
            vm.Job.load(write_job(tmp_path, swap={"max_feed_mm_min = 4000\n": wrong}))
        assert caught.value.line


def test_a_job_takes_what_its_machine_file_says_and_it_does_not(tmp_path):
    (tmp_path / "mill.toml").write_text("[machine]\nmax_feed_mm_min = 3000\nmax_acceleration_mm_s2 = 340\n")
    job = vm.Job.load(write_job(tmp_path, swap={"max_feed_mm_min = 4000\n": 'file = "mill.toml"\n'}))
    assert job.keys.machine.max_feed_mm_min == 3000 and job.keys.machine.rapid_mm_min == 6000
    assert job.keys.machine.max_acceleration_mm_s2 == 340
    (tmp_path / "mill.toml").write_text('[machine]\nfile = "mill.toml"\n')
    with pytest.raises(KinematicsError, match="cannot name another one"):
        Mill.load(tmp_path / "mill.toml", nested=True)
    with pytest.raises(KinematicsError, match="cannot name another one"):
        Mill.load(tmp_path / "mill.toml")
    (tmp_path / "mill.toml").write_text("[machine]\nspindle_rev_min = [900, 100]\n")
    with pytest.raises(JobError, match="lower value first"):
        Mill.load(tmp_path / "mill.toml")
