"""A reassuring sentence says what was checked, and nothing else."""

import re

import pytest
from tinyjob import FEED, PROGRAM, write_job

from vmachining.job import Job, run
from vmachining.report import write_report
from vmachining.report.numbers import difference, duration

SHANK = "flute_length_mm = 10\nshank_diameter_mm = 4\nlength_mm = 20"
HOLDER = "length_mm = 20\nholder = [[10, 20], [10, 40]]"
SECOND = 'length_mm = 20\n\n[[tools]]\nnumber = 2\ntype = "flat"\ndiameter_mm = 2\nlength_mm = 20'


def words(folder, tool="length_mm = 20", **job):
    """The warnings and the honest part of the page of a job."""
    result = run(Job.load(write_job(folder, swap={"length_mm = 20": tool}, **job)))
    write_report(result, folder / "r.html")
    text = (folder / "r.html").read_text(encoding="utf-8")
    text = text[text.index('aria-labelledby="h-tools"') :]
    return re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", text[: text.index("<footer")]))


def test_what_is_not_given_is_not_checked(tmp_path):
    text = words(tmp_path)
    assert "no shank is given, so none was checked" in text
    assert "no holder is given, so none was checked" in text
    assert "none of shank" not in text and "holder touched" not in text


@pytest.mark.parametrize(
    ("tool", "checked", "not_checked"),
    [
        (SHANK, "none of shank", "no holder is given"),
        (HOLDER, "none of holder", "no shank is given"),
        (SHANK + "\n" + HOLDER.splitlines()[1], "none of shank or holder", None),
        (SECOND.replace("length_mm = 20", SHANK, 1), "none of shank", "no shank is given for T2"),
    ],
)
def test_what_is_given_is_named(tool, checked, not_checked, tmp_path):
    text = words(tmp_path, tool)
    assert checked in text
    assert not_checked is None or not_checked in text
    if not_checked is None:
        assert "Not checked" not in text


def test_spindle_and_depth_of_a_contact(tmp_path):
    text = words(tmp_path)
    assert "no feed move with a stopped spindle" in text
    assert "shallower than about 0.2 mm (four chords)" in text  # chord 0.05


def test_the_sum_of_errors_of_several_tools_is_explained(tmp_path):
    both = PROGRAM.replace("N80", "T2 M6\nS8000 M3\nN80")
    assert "the sum over its blocks" in words(tmp_path, SECOND, program=both)
    assert "the sum over its blocks" not in words(tmp_path / "one")


def test_rounding_is_called_rounding(tmp_path):
    from tinyjob import JOB

    text = words(tmp_path, job=JOB + FEED)
    assert not re.search(r"e-1\d\s*mm³", text) and "within rounding" in text
    assert difference(3.6e-12, 720.0).startswith("0") and difference(-0.02, 720.0).startswith("-0.02")


def test_times_side_by_side_have_one_unit():
    assert duration(156.3, 67.15) == ("2:36.3", "min") and duration(67.15, 156.3) == ("1:07.2", "min")
    assert duration(67.15, None) == ("67.15", "s") and duration(119.97, 7300.0) == ("0:02:00", "h")
    assert duration(179.96) == ("3:00.0", "min")
