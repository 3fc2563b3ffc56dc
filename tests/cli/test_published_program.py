"""The published example of an NC tester (4.1), from the program to the report by `init` and `run`."""

from __future__ import annotations

import json
import re
from math import pi

from published import TESTER

from vmachining.cli.main import run


def removed_mm3():
    """A cutter of 0.5 inch, 0.4 deep, along 1.25, 1.5, a quarter of R 0.5 and 0.75: bands, both ends, and the corner once."""
    r, length = 0.25, 1.25 + 1.5 + pi / 4.0 + 0.75
    return 0.4 * (2.0 * r * length + pi * r**2 + r**2 * (pi / 4.0 - 1.0)) * 25.4**3


def started(folder, n40):
    program, job = folder / "example.nc", folder / "example.toml"
    program.write_text(TESTER.format(n40=n40), encoding="ascii")
    assert run(["init", str(program), "--out", str(job)]) == 1  # the diameter of the tool must be given
    text = job.read_text(encoding="utf-8")
    # the one thing that must be given, and the part: 0.5 inch thick, its corner an inch beside, in front and below
    text = re.sub(r"# diameter_mm =.*", "diameter_mm = 12.7", text)
    text = re.sub(r"box = \{ min.*", "box = { min = [0, -4, 4.5], max = [4, 0, 5] }", text, count=1)
    job.write_text(text, encoding="utf-8")
    return job


def test_the_program_put_right_cuts_what_its_comments_say(tmp_path, capsys):
    job, out = started(tmp_path, "Y-0.75 Z-0.9"), tmp_path / "out"
    capsys.readouterr()
    assert run(["run", str(job), "--out", str(out), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    low, high = (told[f"removed_{side}_mm3"] for side in ("lo", "hi"))
    assert low <= removed_mm3() <= high and high - low < 2e-3 * high
    assert (out / "report.html").is_file()


def test_the_program_as_printed_never_meets_the_part(tmp_path, capsys):
    """N40 with Y0.25 Z0.1: the cutter stays above the part, whose top is an inch below where it starts."""
    program = tmp_path / "example.nc"
    for n40, told in (("Y0.25 Z0.1", True), ("Y-0.75 Z-0.9", False)):
        program.write_text(TESTER.format(n40=n40), encoding="ascii")
        assert run(["nc", "check", str(program), "--dialect", "iso", "--stock-top", "-25.4"]) == 0
        seen = capsys.readouterr()
        assert ("W520" in seen.out) is told
