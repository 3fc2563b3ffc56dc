"""Every dialect both ways: a program in one, posted in another, read again, drives the same path and removes the same volume."""

from __future__ import annotations

import numpy as np
import pytest

import vmachining as vm
from vmachining.job.paths import move_path
from vmachining.machine import load
from vmachining.nc import Motion, Program, ToolEntry, parse_program
from vmachining.toolpath.post import POSTS, post_program

HOME = (0.0, 0.0, 100.0)
TOOLS = {1: ToolEntry(1, 10.0, 0.0)}

CL = """UNITS/MM
LOADTL/1
SPINDL/2000,CLW
FROM/0,0,100
RAPID
GOTO/-8,3,20
RAPID
GOTO/-8,3,-2.123456789
FEDRAT/300,MMPM
GOTO/10,3,-2.123456789
CIRCLE/10,8,-2.123456789,0,0,1,5
GOTO/15,8,-2.123456789
GOTO/15,14.5,-3
RAPID
GOTO/15,14.5,20
CYCLE/DRILL,FEDTO,7,RAPTO,2,RTRCTO,5,MMPM,90
GOTO/30,5,0
GOTO/34.25,12,0
CYCLE/OFF
RAPID
GOTO/0,0,100
FINI
"""
ISO = """G21 G17 G90 T1 M6
S2000 M3
G0 X-8 Y3 Z20
G0 Z-2.123456789
G1 X10 F300
G3 X15 Y8 J5
G1 Y14.5 Z-3
G0 Z20
G0 X30 Y5
G0 Z2
G1 Z-7 F90
G0 Z5
G0 X34.25 Y12
G0 Z2
G1 Z-7
G0 Z5
G0 X0 Y0 Z100
M2
"""
SINUMERIK = """G71 G90 G17
T1 M6
S2000 M3
G0 X-8 Y3 Z20
Z-2.123456789
G1 X10 F300
G3 X15 Y8 CR=5
G1 Y14.5 Z-3
G0 Z20
F90
MCALL CYCLE81(5,0,2,-7)
X30 Y5
X34.25 Y12
MCALL
G0 X0 Y0 Z100
M30
"""
HEIDENHAIN = """BEGIN PGM A MM
TOOL CALL 1 Z S2000
L X-8 Y+3 Z+20 FMAX M3
L Z-2.123456789 FMAX
L X+10 F300
CR X+15 Y+8 R+5 DR+
L Y+14.5 Z-3
L Z+20 FMAX
CYCL DEF 200 Q200=2 Q201=-7 Q206=90 Q202=7 Q210=0 Q203=0 Q204=5 Q211=0
L X+30 Y+5 FMAX M99
L X+34.25 Y+12 FMAX M99
L X+0 Y+0 Z+100 FMAX
L M30
END PGM A MM
"""
SOURCES = {"apt": CL, "iso": ISO, "fanuc": ISO, "sinumerik": SINUMERIK, "heidenhain": HEIDENHAIN}


def read(text: str, dialect: str) -> Program:
    program = parse_program(text.encode(), "a", dialect=dialect, home=HOME, tools=TOOLS, rotary="ABC")
    assert program.errors == (), program.errors
    return program


def driven(program: Program, machine=None) -> list[tuple[bool, float, np.ndarray]]:
    """Feed motions and rapids that go somewhere: feed, and tip with axis at nine places; drives that continue are one."""
    rows = []
    for move in program.moves:
        if move.motion is Motion.DWELL:
            continue
        path = move_path(move, machine)
        t = np.linspace(0.0, 1.0, 9)
        axis = getattr(path, "axis", None)
        axes = [axis(float(v)) if callable(axis) else (0.0, 0.0, 1.0) for v in t]
        places = np.hstack([[path.position(float(v)) for v in t], axes])
        if np.ptp(places, axis=0).max() > 1e-10:
            rows.append((move.motion is Motion.RAPID, move.feed_mm_min or 0.0, places))
    return rows


def compare(one: list, two: list) -> None:
    assert [row[:2] for row in one] == [(rapid, pytest.approx(feed, rel=1e-9)) for rapid, feed, _ in two]
    assert max(np.abs(a[2] - b[2]).max() for a, b in zip(one, two, strict=True)) < 1e-9


@pytest.mark.parametrize("target", POSTS)
@pytest.mark.parametrize("dialect", SOURCES)
def test_a_program_in_one_dialect_posted_in_another_drives_the_same_path(dialect, target):
    source = read(SOURCES[dialect], dialect)
    posted = post_program(source.moves, target, name="t", decimals=12)
    compare(driven(source), driven(read(posted.text, target)))


LEANING = """UNITS/MM
MULTAX/ON
LOADTL/1
SPINDL/2000,CLW
FROM/0,0,100,0,0,1
RAPID
GOTO/-10,8,40,0.6,0,0.8
FEDRAT/300,MMPM
GOTO/-10,8,-1,0.6,0,0.8
GOTO/40,9,-2,0.6,0,0.8
{}
RAPID
GOTO/40,9,60,0.6,0,0.8
FINI
"""


@pytest.mark.parametrize("target", POSTS)
def test_a_leaning_tool_in_any_dialect_drives_the_same_path(target):
    """Three and two axes: exact by angles too. The turning block is exact where the dialect has tool axes."""
    machine = load("ac-table") if target in ("iso", "fanuc") else None
    turning = "GOTO/30,2,-2,0,0.6,0.8\nGOTO/40,9,-2,0.6,0,0.8" if machine is None else ""
    source = read(LEANING.format(turning), "apt")
    posted = post_program(source.moves, target, machine=machine, decimals=14)
    one, two = driven(source), driven(read(posted.text, target), machine)
    feeds = [[row for row in rows if not row[0]] for rows in (one, two)]
    compare(*feeds)


def volumes(folder, program: str, name: str, dialect: str) -> list[float]:
    (folder / name).write_text(program)
    data = {
        "name": name, "program": {"file": name, "dialect": dialect, "home": list(HOME)},
        "tools": [{"number": 1, "type": "bull", "diameter_mm": 10, "corner_radius_mm": 2, "length_mm": 40}],
        "stock": {"box": {"min": [0, 0, -12], "max": [40, 20, 0]}},
    }  # fmt: skip
    blocks = vm.run(vm.Job.from_mapping(data, folder), contact="none").blocks
    return [v for v in blocks["removed_mm3"].to_list() if v > 0.0]


@pytest.mark.parametrize("target", POSTS)
def test_a_posted_cl_file_removes_the_volume_of_its_source(tmp_path, target):
    posted = post_program(read(CL, "apt").moves, target, name="t", decimals=12)
    one = volumes(tmp_path, CL, "part.cls", "apt")
    two = volumes(tmp_path, posted.text, "part.nc", target)
    assert len(one) == len(two) and min(one) > 1.0
    assert two == pytest.approx(one, rel=1e-9)
