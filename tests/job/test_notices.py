"""What the job makes of a program without being told is said: an assumed tool, a feed beyond all machines."""

import pytest
from tinyjob import JOB, PROGRAM, write_job

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
