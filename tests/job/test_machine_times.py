"""Machine times of jobs: what the program says of its pace, changes, and machines with limits of their own."""

from __future__ import annotations

import numpy as np
import pytest
from tinyjob import FEED, JOB, write_job

import vmachining as vm
from vmachining.job.timing import machine_limits, move_times
from vmachining.job.toolpath import Toolpath
from vmachining.machine import MachineLimits, preset
from vmachining.nc import read_program

LIMITS = "max_feed_mm_min = 4000\n"
HEAD = "G21 G90 G17 T1 M6\nS1000 M3\nF6000\nG1 X0 Y0 Z0\n"
A = 1000.0


def times(folder, text, machine="max_acceleration_mm_s2 = 1000\n"):
    job = vm.Job.load(write_job(folder, swap={LIMITS: machine}, program=text))
    return move_times(Toolpath.of(read_program(job.program_path, home=(0, 0, 0))), machine_limits(job))


def corner(tolerance):
    """mm/s at a corner of 90 degrees."""
    c = np.sqrt(0.5)
    return np.sqrt(A * tolerance * c / (1 - c))


@pytest.mark.parametrize(
    ("words", "tolerance"),
    [
        ("", 0.01),
        ("G64 P0.05\n", 0.05),
        ("G61\n", 0.0),
        ("G61.1\n", 0.0),
        ("G61\nG64\n", 0.01),
    ],
)
def test_words_of_the_program_set_the_speed_at_corners(words, tolerance, tmp_path):
    """Two strokes of 10 mm about a corner, from rest to rest: closed form of the ramps."""
    found = times(tmp_path, HEAD + words + "G1 X10\nG1 Y10\nM30\n").seconds[-2:]
    v = corner(tolerance)
    ramps = (100 + (100 - v)) / A
    steady = 10 - (100**2 + 100**2 - v**2) / (2 * A)
    assert found == pytest.approx([ramps + steady / 100] * 2, rel=1e-9)


def test_a_tolerance_is_in_the_unit_of_the_program(tmp_path):
    inch = times(
        tmp_path / "a", "G20 G90 T1 M6\nS1 M3\nF200\nG64 P0.001\nG1 X0 Y0 Z0\nG1 X1\nG1 Y1\nM30\n"
    ).seconds
    metric = times(
        tmp_path / "b", "G21 G90 T1 M6\nS1 M3\nF5080\nG64 P0.0254\nG1 X0 Y0 Z0\nG1 X25.4\nG1 Y25.4\nM30\n"
    ).seconds
    assert inch == pytest.approx(metric, rel=1e-9)


def test_a_dwell_of_nothing_is_a_stop(tmp_path):
    plain = times(tmp_path / "a", HEAD + "G1 X10\nG1 X20\nM30\n").seconds.sum()
    stopped = times(tmp_path / "b", HEAD + "G1 X10\nG4 P0\nG1 X20\nM30\n").seconds.sum()
    assert stopped - plain == pytest.approx(100 / A, rel=1e-9)


def test_changes_cost_what_the_machine_says(tmp_path):
    text = HEAD + "G1 X10\nM5\nT2 M6\nS2000 M3\nG1 X20\nM60\nG1 X30\nM30\n"
    limits = "max_acceleration_mm_s2 = 1000\n"
    plain = times(tmp_path / "a", text, limits)
    more = "tool_change_s = 5\nspindle_start_s = 2\nspindle_s_per_1000_rev_min = 0.5\ntable_change_s = 30\n"
    full = times(tmp_path / "b", text, limits + more)
    # the first tool and start (1000 rev/min) belong to the first move, then stop, tool and start (2000) to the move after them
    assert full.seconds - plain.seconds == pytest.approx([7.5, 0.0, 2.5 + 5.0 + 3.0, 30.0])
    assert (full.ideal_s == plain.ideal_s).all()


def test_a_tool_that_is_in_the_spindle_is_not_changed(tmp_path):
    """T1 M6 twice is one change, T2 between them makes three."""
    limits = "tool_change_s = 7\n"
    feeds = times(tmp_path / "a", HEAD + "G1 X10\nM30\n", limits).seconds.sum()
    again = times(tmp_path / "b", HEAD + "G1 X5\nT1 M6\nG1 X10\nM30\n", limits).seconds.sum()
    assert again == pytest.approx(feeds, rel=1e-9)
    there_and_back = HEAD + "G1 X5\nT1\nT2 M6\nG1 X8\nT1\nM6\nG1 X10\nM30\n"
    assert times(tmp_path / "c", there_and_back, limits).seconds.sum() == pytest.approx(feeds + 14, rel=1e-9)


def test_rapids_have_an_acceleration_of_their_own(tmp_path):
    """From rest to rest twice: 20 mm at 400 mm/s^2 in a rapid of the job's speed, 10 mm at 1000 mm/s^2 and F6000 at feed."""
    limits = "max_acceleration_mm_s2 = 1000\nrapid_acceleration_mm_s2 = 400\n"  # rapids of 10 m/min
    found = times(tmp_path, HEAD + "M5\nG61.1\nG0 X20\nG1 X30\nM30\n", limits).seconds[-2:]
    assert found == pytest.approx([2 * np.sqrt(20 / 400), 0.2], rel=1e-9)


def test_overrides_scale_feeds_and_rapids(tmp_path):
    text = HEAD + "G1 X60\nG0 X0\nM30\n"
    plain = times(tmp_path / "a", text, "").seconds
    slow = times(tmp_path / "b", text, "feed_override_percent = 50\nrapid_override_percent = 25\n").seconds
    assert slow[-2:] == pytest.approx([2 * plain[-2], 4 * plain[-1]])


def test_a_preset_drives_plain_rapids_within_its_slides(tmp_path):
    """xyzac-trt: slides of 20 mm/s and 300 mm/s^2; G0 X100 takes 100 / 20 + 20 / 300 s."""
    path = tmp_path / "rapid.nc"
    path.write_text("G21 G90\nG0 X100\nM30\n")
    machine = preset("xyzac-trt")
    program = read_program(path, home=(0, 0, 0))
    found = move_times(Toolpath.of(program, machine), machine_limits_of_nothing())
    assert found.seconds.sum() == pytest.approx(100 / 20 + 20 / 300, rel=1e-9)


def machine_limits_of_nothing():
    return MachineLimits(rapid_mm_min=7800.0)


@pytest.mark.parametrize(("a", "c"), [(0, 0), (-30, 0), (-30, 40), (25, -110)])
def test_a_circle_lasts_as_long_under_a_leaning_tool(tmp_path, a, c):
    """Of 20 mm between its tangents: no stop at its ends. Of 2 mm: v^2 / r is within what the machine accelerates at.

    The lines of 40 mm begin and end at rest; without limits of slides (a head without any) all is known in closed form.
    """
    path = tmp_path / "circle.nc"
    for r, rate in ((20.0, 1000.0 / 60.0), (2.0, np.sqrt(150.0 * 2.0))):
        text = "G21 G90\nS100 M3\nG0 X20 Y40 Z0 A{a} C{c}\nG43.4 H1\nG0 X20 Y40 Z0\nG1 Y0 F{f}\nG2 X20 Y0 I-{r}\nG1 Y-40\nM30\n"
        path.write_text(text.format(a=a, c=c, f=1000 if r > 10 else 3000, r=r))
        program = read_program(path, home=(20, 40, 0), dialect="fanuc", rotary="AC")
        limits = MachineLimits(max_acceleration_mm_s2=150.0, rapid_mm_min=7800.0)
        found = move_times(Toolpath.of(program, preset("ca-head")), limits)
        assert found.seconds[-2] == pytest.approx(2.0 * np.pi * r / rate, rel=1e-3), r


def test_why_a_feed_is_not_reached(tmp_path):
    """A stroke too short for its feed, an arc too small for it, and a slide too slow for it."""
    text = HEAD + "G1 X0.5\nG1 Y0.5\nG2 X2.5 Y0.5 I1 J0\nG1 Z-40\nG1 X80\nM30\n"
    limits = "max_acceleration_mm_s2 = 1000\naxis_feed_mm_min = [9000, 9000, 1200]\n"
    found = times(tmp_path, text, limits)
    assert [str(w) for w in found.why[-5:]] == ["corner", "corner", "arc", "axis limit", ""]
    assert found.reached_mm_min[-2] == pytest.approx(1200.0) and found.reached_mm_min[-1] == pytest.approx(
        6000.0
    )
    assert 0.0 < found.below_share < 1.0


def test_a_schedule_writes_no_feed_that_corners_forbid(tmp_path):
    """Strokes of 1 mm between reversals at 1000 mm/s^2 reach sqrt(a L) = 31.6 mm/s; more is neither written nor promised."""
    text = (
        "G21 G90 G17\nT1 M6\nS8000 M3\nG0 X4 Y4 Z5\nG1 Z-1 F120\n"
        + "G1 X5 F600\nG1 X4\n" * 4
        + "G0 Z5\nM30\n"
    )
    swap = {LIMITS: "max_acceleration_mm_s2 = 1000\n"}
    found = vm.run(
        vm.Job.load(write_job(tmp_path, job=JOB + FEED, swap=swap, program=text)), out=tmp_path / "out"
    )
    feeds = found.scheduled_blocks.filter(found.scheduled_blocks["text"].str.starts_with("G1 X"))[
        "feed_mm_min"
    ].to_list()
    reach = 60 * np.sqrt(1000 * 1.0)
    # the largest rate is that of the plunge and of the first stroke; air after them is crossed as fast as corners allow
    assert max(feeds[2:-1]) <= reach  # between two reversals
    assert feeds[-3] == pytest.approx(np.floor(10 * reach) / 10)
    told = found.summary["times"]
    assert told["tools"][0]["seconds"] == pytest.approx(found.summary["time_s"])
    assert told["below_feed_share"] == 0.0 and any("0.01 mm" in text for text in told["assumed"])
