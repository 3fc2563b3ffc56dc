"""Job files: every refusal is one message with file, line and key."""

from __future__ import annotations

from pathlib import Path

import pytest
from tinyjob import FEED, JOB, write_job

from vmachining.errors import JobError, NCError
from vmachining.force import shipped
from vmachining.job import Job
from vmachining.job.reading import read_job_program
from vmachining.tomlplaces import key_positions, nearest

BOX = "box = { min = [0, 0, -4], max = [10, 18, 0] }"

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
        22,
        ["p.step", "no such file"],
    ),
    "two designs": (
        {"[accuracy]": '[design]\nstep = "p.step"\nstl = "p.stl"\n[accuracy]'},
        21,
        ["exactly one of step, stl, got both"],
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
    "key twice": (
        {'units = "mm"': 'units = "mm"\nunits = "mm"'},
        3,
        ["units is given twice, first in line 2"],
    ),
    "tool key twice": (
        {"diameter_mm = 4": "diameter_mm = 4\ndiameter_mm = 5"},
        16,
        ["tools[0].diameter_mm is given twice", "line 15"],
    ),
    "section twice": ({"[accuracy]": "[stock]\n[accuracy]"}, 21, ["stock is given twice", "line 18"]),
    "inline key twice": (
        {BOX: "box = { min = [0, 0, 0], min = [1, 1, 1] }"},
        19,
        ["stock.box.min is given twice"],
    ),
    "decimal comma": ({"diameter_mm = 4": "diameter_mm = 4,5"}, 15, ["decimal comma", "write 4.5"]),
    "no quotes": ({'file = "tiny.nc"': "file = tiny.nc"}, 5, ["quotes", 'file = "tiny.nc"']),
    "cylinder z": (
        {BOX: "cylinder = { center = [0, 0], radius = 5, z = -20 }"},
        19,
        ["z = -20", "z = [-20, 0]: lowest and highest"],
    ),
    "cylinder z alone": (
        {BOX: "cylinder = { center = [0, 0], radius = 5, z = [-20] }"},
        19,
        ["only 1 number", "lowest and highest z"],
    ),
    "cylinder centre": (
        {BOX: "cylinder = { center = 0, radius = 5, z = [-20, 0] }"},
        19,
        ["center = 0", "[0, 0]: axis of the bar"],
    ),
    "cylinder diameter": (
        {BOX: "cylinder = { center = [0, 0], diameter = 5, z = [-20, 0] }"},
        19,
        ["'diameter'", "radius, half of it"],
    ),
    "cylinder height": (
        {BOX: "cylinder = { center = [0, 0], radius = 5, height = 20 }"},
        19,
        ["'height'", "z = [lowest, highest]"],
    ),
    "box size": (
        {BOX: "box = { min = [0, 0, 0], size = [1, 1, 1] }"},
        19,
        ["'size'", "max, the opposite corner"],
    ),
    "box huge": (
        {"max = [10, 18, 0]": "max = [10, 18, 1e99]"},
        19,
        ["stock.box.max[2] = 1e+99", "out of range"],
    ),
    "tool huge": ({"diameter_mm = 4": "diameter_mm = 1e99"}, 15, ["tools[0].diameter_mm", "out of range"]),
    "five axes by their letters": (
        {"[machine]": '[machine]\nchain = "xyzac"'},
        9,
        ["did you mean xyzac-trt?"],
    ),
    "five axes in capitals": ({"[machine]": '[machine]\nchain = "XYZBC"'}, 9, ["did you mean xyzbc-trt?"]),
    "other axes": ({"[machine]": '[machine]\nchain = "xyzab"'}, 9, ["ab-table", "ab-head"]),
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
    "strategy": ({'"volume"': '"force"'}, ["needs a [force] table"]),
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


def test_rotary_axes_without_a_machine_are_told_what_is_missing(tmp_path):
    path = write_job(tmp_path)
    (tmp_path / "tiny.nc").write_text("G21 G90 F100 S100 M3 T1 M6\nG1 X1 A10\nC5 X3\nM2\n")
    with pytest.raises(NCError, match=r'turns A and C.*chain = "xyzac-trt"') as caught:
        read_job_program(Job.load(path))
    assert caught.value.line == 2 and "ac-table" in str(caught.value.remedy)


def test_programs_that_are_not_read_whole_run_in_no_job(tmp_path):
    path = write_job(tmp_path, swap={"[program]": '[program]\ndialect = "fanuc"'})
    turned = "O1\nG21 G99 G97 S1000 M3\nT0101\nG0 X40. Z2.\nG1 Z-9. F.2\nM30\n"
    lost = "G21 G90 S1000 M3 T1 M6\nM98 P8077\nG1 X9. F90.\nM30\n"
    for text, said in ((turned, "for turning"), (lost, "no program O8077")):
        (tmp_path / "tiny.nc").write_text(text)
        with pytest.raises(NCError, match=said):
            read_job_program(Job.load(path))


def test_the_limit_of_loops_and_the_unit_of_dwells_are_keys(tmp_path):
    loop = "G21 G90 S100 M3 T1 M6\n#1 = 0\no1 while [#1 LT 300]\n#1 = [#1 + 1]\no1 endwhile\nG4 P500\nG0 X#1\nM2\n"
    path = write_job(tmp_path, swap={"[machine]": "max_steps = 200\n[machine]"})
    (tmp_path / "tiny.nc").write_text(loop)
    with pytest.raises(NCError, match=r"E413.*max_steps"):
        read_job_program(Job.load(path))
    path = write_job(tmp_path, swap={"[machine]": 'max_steps = 2000\ndwell = "ms"\n[machine]'})
    (tmp_path / "tiny.nc").write_text(loop)
    assert [move.dwell_s for move in read_job_program(Job.load(path)).moves] == [0.5, 0.0]


def test_a_program_given_as_a_job_is_named(tmp_path):
    write_job(tmp_path)
    with pytest.raises(JobError, match=r"an NC program, not a job file; vmachining init .*tiny\.nc writes"):
        Job.load(tmp_path / "tiny.nc")


def test_angles_of_poses_without_a_machine_are_told_with_their_file(tmp_path):
    path = write_job(tmp_path, swap={'file = "tiny.nc"': 'file = "tiny.csv"\ndialect = "poses"'})
    (tmp_path / "tiny.csv").write_text("x_mm,y_mm,z_mm,b_deg,c_deg,feed_mm_min\n0,0,0,0,0,9\n5,0,-1,10,5,9\n")
    with pytest.raises(NCError, match=r"tiny.csv:3.*turns B and C.*xyzbc-trt"):
        read_job_program(Job.load(path))


def test_a_force_table_without_coefficients_names_the_shipped_sets(tmp_path):
    path = write_job(tmp_path, job=JOB + "\n[force]\nspindle_rev_min = 1000\n")
    with pytest.raises(JobError, match=r"force\.coefficients is missing") as caught:
        Job.load(path)
    names = shipped()
    assert names and all(f'"{name}"' in str(caught.value) for name in names)
    page = Path(__file__).parents[2] / "docs" / "forces.md"
    assert all(f'`"{name}"`' in page.read_text(encoding="utf-8") for name in names)
