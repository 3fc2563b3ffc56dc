"""`run --engine dexel`: rapids through material, shank and holder in the stock, against volumes in closed form; and none where
surfaces only fit."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import vmachining as vm
from tests.tinyjob import JOB, write_job

PROGRAM = """\
G21 G17 G90 G94
T1 M6
S8000 M3
G0 X-10 Y5 Z20
G0 Z-6
G1 X20 F600
G0 Z20
G0 X-10 Y15
G0 Z-3
G1 X20 F600
G0 X-10
G0 Z20
G0 Y25
G0 Z-2
G0 X20
G0 Z20
G0 X-10 Y35
G0 Z-1.5
G1 X20
G0 Z5
M30
"""
"""Through the stock at depths of 6 (shank and holder touch), 3 (only the shank), 2 in rapid motion, 1.5 with nothing wrong. The
rapid back at a depth of 3 runs in its own slot, but for the shank."""

TOOL = """diameter_mm = 4
flute_length_mm = 2
length_mm = 5
shank_diameter_mm = 6
holder = [[4, 5], [4, 30]]"""

ONTO = {
    "diameter_mm = 4\nlength_mm = 20": TOOL,
    "min = [0, 0, -4], max = [10, 18, 0]": "min = [0, 0, -8], max = [10, 40, 0]",
    "chord_mm = 0.05": "spacing_mm = 0.25\ndirections = {directions}",
}

WIDE = 10.0
"""mm of stock along every pass."""


@pytest.mark.parametrize("directions", [1, 3])
def test_contacts_by_rays(tmp_path: Path, directions: int) -> None:
    swap = {old: new.format(directions=directions) for old, new in ONTO.items()}
    job = write_job(tmp_path, job=JOB, program=PROGRAM, swap=swap)
    rows = vm.run(job, engine="dexel").blocks
    told = {line: text for line, text in rows.select("line", "warning").iter_rows() if text}
    assert sorted(told) == [6, 10, 11, 15]
    found = {
        line: {m[0]: float(m[1]) for m in re.findall(r"(tool|shank|holder)[a-z: ]*([\d.]+) mm3", text)}
        for line, text in told.items()
    }
    # 6: cutter from -6 to -4, shank of 6 mm from there to -1, a holder of 8 mm above; 10: shank from -1; 11: the same
    wanted = {
        6: {"shank": 6.0 * 3.0 * WIDE, "holder": 8.0 * 1.0 * WIDE},
        10: {"shank": 6.0 * 1.0 * WIDE},
        11: {"shank": 6.0 * 1.0 * WIDE},
        15: {"tool": 4.0 * 2.0 * WIDE},
    }
    for line, volumes in wanted.items():
        assert found[line] == pytest.approx(volumes, rel=0.02), (line, told[line])
