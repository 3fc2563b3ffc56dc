"""What the job makes of a program without being told is said: an assumed tool, a feed beyond all machines."""

import json
import math

import pytest
from tinyjob import FEED, JOB, PROGRAM, write_job

from vmachining.job import Job, run
from vmachining.job.reading import read_job_program

NO_TOOL = PROGRAM.replace("N20 T1 M6\n", "")
FAST = PROGRAM.replace("F600", "F70394")
NO_LIMIT = {"max_feed_mm_min = 4000\n": ""}


def said(folder, **job):
    program = read_job_program(Job.load(write_job(folder, **job)))
    return [(f.line, f.message) for f in program.findings if f.severity == "W"]


def test_a_tool_that_nobody_called_is_a_warning_on_the_first_cut(tmp_path):
    ((line, text),) = said(tmp_path, program=NO_TOOL)
    assert line == 6 and "calls no tool" in text and "tool 1 is taken" in text
    assert said(tmp_path / "b") == []


def test_the_assumed_tool_is_in_table_and_summary(tmp_path):
    result = run(Job.load(write_job(tmp_path, program=NO_TOOL)))
    table = result.blocks
    (text,) = table["warning"].drop_nulls().to_list()
    assert text.startswith("the program calls no tool") and result.summary["warnings"] == 1


def test_a_table_of_poses_needs_no_tool(tmp_path):
    poses = "x_mm,y_mm,z_mm,i,j,k,feed_mm_min\n-4,4,-1,0,0,1,600\n14,4,-1,0,0,1,600\n"
    assert (
        said(tmp_path, program=poses, swap={'file = "tiny.nc"': 'file = "tiny.nc"\ndialect = "poses"'}) == []
    )


@pytest.mark.parametrize(
    ("limits", "warned"),
    [
        ("", True),
        ("max_feed_mm_min = 4000\n", False),
        ("axis_feed_mm_min = [1e4, 1e4, 1e4]\n", False),
        ('chain = "xyzac-trt"\n', False),  # its slides have speeds of their own
        ('chain = "ac"\n', True),
    ],
)
def test_a_feed_beyond_all_machines_is_a_warning_where_nothing_limits_it(limits, warned, tmp_path):
    found = said(tmp_path, program=FAST, swap={"max_feed_mm_min = 4000\n": limits})
    assert bool(found) == warned
    if warned:
        assert found[0][0] == 7 and "70394 mm/min" in found[0][1]


def test_a_fast_but_possible_feed_is_no_warning(tmp_path):
    assert said(tmp_path, program=FAST.replace("70394", "40000"), job=JOB, swap=NO_LIMIT) == []


def test_the_offsets_of_a_preset_are_told(tmp_path):
    job = write_job(tmp_path, swap={"rapid_mm_min = 6000": 'chain = "xyzac-trt"\nrapid_mm_min = 6000'})
    result = run(Job.load(job), out=tmp_path / "o")
    told = result.summary["machine"]
    assert told["name"] == "xyzac-trt" and told["axes"] == ["C", "A", "X", "Y", "Z"]
    assert "A turns about (1, 0, 0) through (0, 20, 10) mm" in told["rotary"]
    result.write(tmp_path / "o", stock=())
    assert json.loads((tmp_path / "o/manifest.json").read_text())["machine"] == told
    assert "through (0, 20, 10) mm" in (tmp_path / "o/report.html").read_text()


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        (
            "insert_blocks = true",
            "the largest rate of a part of a block (one of up to 64) as programmed, which may",
        ),
        ("", "the largest rate of a block as programmed"),
        ("reference = 900.0", "given in the job"),
        ('reference = "mean"', "volume over time of all that cuts"),
    ],
)
def test_the_reference_of_a_schedule_says_what_it_is(keys, words, tmp_path):
    result = run(Job.load(write_job(tmp_path, job=JOB + FEED + keys + "\n")))
    told = result.summary["schedule"]
    assert told["reference_from"].startswith(words) and words in result.schedule.text
    largest = result.blocks["mrr_mm3_min"].max()  # no limit of acceleration: times are length over feed
    assert told["largest_block_mm3_min"] == pytest.approx(largest, rel=1e-6)
    if (
        "insert" in keys
    ):  # the last of 8 parts of the plunge of 5.5 mm holds all of its 2 pi mm3, at 300 mm/min
        assert told["reference_mm3_min"] == pytest.approx(2 * math.pi / (5.5 / 8) * 300, rel=1e-3)
        assert told["reference_mm3_min"] > 1.5 * told["largest_block_mm3_min"]
    if not keys:
        assert told["reference_mm3_min"] == pytest.approx(told["largest_block_mm3_min"])
