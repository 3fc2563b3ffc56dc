"""Job files: every refusal is one message with file, line and key."""

from __future__ import annotations

import pytest
from tinyjob import FEED, JOB, write_job

from vmachining.errors import JobError
from vmachining.job import Job
from vmachining.job.keys import key_positions, nearest

BAD = {
    "misspelt key": ({"rapid_mm_min": "rapid_mm_mni"}, 9, ["rapid_mm_mni", "did you mean 'rapid_mm_min'"]),
    "misspelt section": ({"[accuracy]": "[acuracy]"}, 21, ["'acuracy'", "did you mean 'accuracy'"]),
    "misspelt tool key": ({"diameter_mm": "diamter_mm"}, 15, ["diamter_mm", "did you mean 'diameter_mm'"]),
    "misspelt inline key": ({"max = [10": "mx = [10"}, 19, ["'mx'"]),
    "two stocks": ({"[stock]": '[stock]\nstl = "x.stl"'}, 18, ["exactly one", "box and stl"]),
    "no stock": ({"box = { min = [0, 0, -4], max = [10, 18, 0] }": ""}, 18, ["exactly one", "none"]),
    "box upside down": ({"max = [10, 18, 0]": "max = [10, 18, -5]"}, 19, ["must lie below"]),
    "chord 0": ({"chord_mm = 0.05": "chord_mm = 0"}, 22, ["chord_mm", "greater than 0"]),
    "chord nan": ({"chord_mm = 0.05": "chord_mm = nan"}, 22, ["chord_mm", "finite"]),
    "chord text": ({"chord_mm = 0.05": 'chord_mm = "fine"'}, 22, ["chord_mm", "number"]),
    "home too short": ({"home = [0, 0, 20]": "home = [0, 0]"}, 6, ["home"]),
    "home infinite": ({"home = [0, 0, 20]": "home = [0, 0, inf]"}, 6, ["home", "finite"]),
    "unit": ({'units = "mm"': 'units = "cm"'}, 2, ["units", "'mm' or 'inch'"]),
    "negative rapid": ({"rapid_mm_min = 6000": "rapid_mm_min = -1"}, 9, ["rapid_mm_min"]),
    "no program file": ({'file = "tiny.nc"': 'file = "other.nc"'}, 5, ["other.nc", "no such file"]),
    "tool number twice": (
        {"[stock]": '[[tools]]\nnumber = 1\ntype = "flat"\n\n[stock]'},
        19,
        ["tool 1", "twice"],
    ),
    "tool number text": ({"number = 1": 'number = "one"'}, 13, ["number", "whole number"]),
    "tool type": ({'type = "flat"': 'type = "round"'}, 14, ["round"]),
    "tool impossible": ({"diameter_mm = 4": "diameter_mm = -4"}, 15, ["tool 1", "diameter"]),
    "design": (
        {"[accuracy]": '[design]\nstep = "p.step"\n[accuracy]'},
        21,
        ["[design]", "not supported yet"],
    ),
    "dialect": ({'file = "tiny.nc"': 'file = "tiny.nc"\ndialect = "klingon"'}, 6, ["iso", "poses"]),
    "chain": (
        {"[machine]": '[machine]\nchain = "ac-tabel"'},
        9,
        ["no machine 'ac-tabel'", "did you mean ac-table"],
    ),
    "machine file": ({"[machine]": '[machine]\nfile = "m.toml"'}, 9, ["cannot read the machine file"]),
    "two machines": ({"[machine]": '[machine]\nchain = "ac"\nfile = "m.toml"'}, 10, ["exclude each other"]),
    "syntax": ({"[stock]": "[stock"}, 18, ["not valid TOML"]),
    "key twice": ({'units = "mm"': 'units = "mm"\nunits = "mm"'}, 3, ["not valid TOML"]),
    "no tools": ({"[[tools]]": "[[tool]]"}, 12, ["'tool'", "did you mean 'tools'"]),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_job_file_is_refused_with_its_line(case, tmp_path):
    swap, line, words = BAD[case]
    path = write_job(tmp_path, swap=swap)
    with pytest.raises(JobError) as caught:
        Job.load(path)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(f"{path}:{line}:"), message
    for word in words:
        assert word in message


BAD_FEED = {
    "min above max": ({"min_mm_min = 60": "min_mm_min = 6000"}, ["above"]),
    "strategy": ({'"volume"': '"force"'}, ["force", "not supported yet"]),
    "reference": ({"min_mm_min = 60": "reference = -3"}, ["reference"]),
    "reference word": ({"min_mm_min = 60": 'reference = "best"'}, ["reference"]),
    "nan": ({"min_mm_min = 60": "min_mm_min = nan"}, ["finite"]),
    "insert": ({"min_mm_min = 60": "insert_blocks = 1"}, ["insert_blocks", "boolean"]),
}


@pytest.mark.parametrize("case", BAD_FEED)
def test_a_bad_feed_section_is_refused(case, tmp_path):
    swap, words = BAD_FEED[case]
    path = write_job(tmp_path, job=JOB + FEED, swap=swap)
    with pytest.raises(JobError) as caught:
        Job.load(path)
    for word in (str(path), *words):
        assert word in str(caught.value)


def test_missing_and_unreadable_files(tmp_path):
    with pytest.raises(JobError, match="No such file"):
        Job.load(tmp_path / "none.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(JobError, match="UTF-8"):
        Job.load(tmp_path / "binary.toml")
    with pytest.raises(JobError, match="directory"):
        Job.load(tmp_path)


def test_a_job_made_in_python_equals_the_file(tmp_path):
    import tomllib

    path = write_job(tmp_path)
    job = Job.from_mapping(tomllib.loads(path.read_text()), tmp_path)
    assert job.keys == Job.load(path).keys
    with pytest.raises(JobError, match="unknown key 'nme'"):
        Job.from_mapping({"nme": "x"}, tmp_path)


def test_inch_scales_what_names_no_unit(tmp_path):
    swap = {'units = "mm"': 'units = "inch"', "home = [0, 0, 20]": "home = [0, 0, 2]"}
    tool = '[[tools]]\nnumber = 2\ntype = "profile"\nprofile = [[0, 0], [1, 1]]\n\n[stock]'
    job = Job.load(write_job(tmp_path, swap={**swap, "[stock]": tool}))
    assert job.home == (0.0, 0.0, 50.8)
    assert job.tools[1].profile.max_radius == 2.0  # diameter_mm says mm
    assert job.tools[2].profile.max_radius == 25.4


def test_positions_survive_strings_comments_and_arrays():
    text = (
        'a = "x = 1 # [no]"\n# b = 2\nc = [\n  1,\n  2,\n]\n[t.u]\nd = """\ne = 3\n"""\n'
        'f = { g = 1, "h" = 2 }\n[[v]]\ni = 1\n[[v]]\ni = 2\n'
    )
    found = key_positions(text)
    assert found[("a",)] == (1, 1) and ("b",) not in found and found[("c",)][0] == 3
    assert found[("t", "u", "d")][0] == 8 and ("t", "u", "e") not in found
    assert found[("t", "u", "f", "g")] == (11, 7) and found[("t", "u", "f", "h")][0] == 11
    assert found[("v", 0, "i")][0] == 13 and found[("v", 1, "i")][0] == 15


def test_nearest_word():
    assert nearest("insert_block", ["insert_blocks", "rule"]) == "insert_blocks"
    assert nearest("zzz", ["insert_blocks"]) is None
