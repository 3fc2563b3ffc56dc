"""Programs that were posted: read back they drive the path of their source."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from vmachining.cli.main import run as main
from vmachining.errors import InputError
from vmachining.job.paths import move_path
from vmachining.machine import load
from vmachining.nc import Motion, Program, ToolEntry, parse_program
from vmachining.toolpath.post import POSTS, post_program

HOME = (0.0, 0.0, 100.0)
TOOLS = {1: ToolEntry(1, 10.0, 0.0), 2: ToolEntry(2, 6.0, 0.0)}
SOURCE = """G21 G17 G90 T1 M6
S2000 M3
G0 X-20 Y5 Z50
G0 Z-2.123456789
G1 X10 F300
G3 X20 Y15 I0 J10
G2 X20 Y15 Z-8 I10 J0 P3
G4 P1.5
T2 M6
S900 M4
G0 X1 Y1 Z10
G1 Z-1.5 F77
G2 X11 Y1 Z-3 I5 J0 P2
G0 Z50
M2
"""
POSES = """x_mm,y_mm,z_mm,i,j,k,feed_mm_min,rapid,tool
0,0,30,0,0,1,500,1,1
0,0,0,0,0,1,500,0,1
20,5,-1,0.3,0.1,0.9486832980505138,500,0,1
40,-5,-2,-0.2,0.4,0.8944271909999159,500,0,1
40,-5,60,-0.2,0.4,0.8944271909999159,500,1,1
"""


def again(text: str, dialect: str) -> Program:
    program = parse_program(text.encode(), "posted", dialect=dialect, home=HOME, tools=TOOLS, rotary="ABC")
    assert program.errors == (), program.errors
    return program


def source(text: str, dialect: str) -> Program:
    program = parse_program(text.encode(), "source", dialect=dialect, home=HOME, tools=TOOLS)
    assert program.errors == ()
    return program


def sampled(program: Program, machine=None) -> list[tuple]:
    """Paths of all moves that go somewhere, at 17 places: kind, tool, feed, tips and axes."""
    out = []
    for move in program.moves:
        if move.motion is Motion.DWELL:
            continue
        path = move_path(move, machine)
        turns = hasattr(path, "axis") and callable(path.axis)
        t = np.linspace(0.0, 1.0, 17)
        tips = np.array([path.position(float(v)) for v in t])
        axes = np.array([path.axis(float(v)) if turns else (0.0, 0.0, 1.0) for v in t])
        if np.ptp(tips, axis=0).max() > 1e-12 or np.ptp(axes, axis=0).max() > 1e-12:
            out.append((move.motion is Motion.RAPID, move.tool, move.feed_mm_min, tips, axes, path.length))
    return out


@pytest.mark.parametrize("dialect", POSTS)
def test_lines_arcs_and_helices_come_back(dialect: str):
    first = source(SOURCE, "iso")
    posted = post_program(first.moves, dialect, name="t", decimals=12)
    text, notes = posted.text, posted.notes
    assert notes == ()
    second = again(text, dialect)
    # turns of a helix are blocks of their own: places along the whole path are compared
    for tool in (1, 2):
        for feed in {m.feed_mm_min for m in first.moves if m.feed_mm_min}:
            lengths = [
                sum(row[5] for row in sampled(p) if row[1] == tool and row[2] == feed)
                for p in (first, second)
            ]
            assert lengths[0] == pytest.approx(lengths[1], rel=1e-9)
    ends = [[m.end for m in p.moves if m.motion is not Motion.DWELL] for p in (first, second)]
    for end in ends[0]:
        assert min(math.dist(end, other) for other in ends[1]) < 1e-9
    assert next(m.spindle_rpm for m in second.moves if m.feed_mm_min) == 2000.0
    assert [m.spindle_rpm for m in second.moves if m.feed_mm_min][-1] == -900.0
    assert [m.dwell_s for m in second.moves if m.motion is Motion.DWELL] == [1.5]


@pytest.mark.parametrize("dialect", ["sinumerik", "heidenhain"])
def test_tool_axes_come_back_to_rounding(dialect: str):
    first = source(POSES, "poses")
    text = post_program(first.moves, dialect, decimals=14).text
    second = again(text, dialect)
    one, two = (sampled(p) for p in (first, second))
    two = two[1:]  # the way to where the table begins
    assert len(one) == len(two)
    for a, b in zip(one, two, strict=True):
        assert a[0] == b[0] and np.abs(a[3] - b[3]).max() < 1e-9 and np.abs(a[4] - b[4]).max() < 1e-9


@pytest.mark.parametrize("dialect", ["iso", "fanuc"])
@pytest.mark.parametrize("chain", ["ac-table", "bc-table"])
def test_angles_of_a_machine_keep_the_tip_and_the_axis(dialect: str, chain: str):
    machine, first = load(chain), source(POSES, "poses")
    posted = post_program(first.moves, dialect, machine=machine, angle_deg=0.02)
    text, notes = posted.text, posted.notes
    assert any("blocks were added" in note for note in notes)
    second = again(text, dialect)
    assert all(m.tcp for m in second.moves if m.rotary_deg is not None)
    feeds = [m for m in second.moves if m.motion is Motion.LINEAR]
    for move in feeds:  # on the lines of the source, the axis within the angle of a pose of the source
        turn = move_path(move, machine)
        for t in (0.0, 0.5, 1.0):
            tip, axis = (
                np.asarray(turn.position(t)),
                np.asarray(turn.axis(t) if hasattr(turn, "axis") else (0, 0, 1)),
            )
            places = [
                (np.linalg.norm(np.asarray(path.position(float(s))) - tip), s, path)
                for path in [move_path(m) for m in first.moves if m.feed_mm_min]
                for s in np.linspace(0, 1, 401)
            ]
            _, s, path = min(places, key=lambda item: item[0])
            known = np.asarray(path.axis(float(s))) if hasattr(path, "axis") else np.array((0.0, 0.0, 1.0))
            assert (
                np.degrees(np.arccos(min(1.0, float(known @ axis)))) < 0.2
            )  # 0.02 and the 400 places looked at


def test_what_has_no_words_is_refused():
    first = source(POSES, "poses")
    with pytest.raises(InputError, match="angles need a machine"):
        post_program(first.moves, "iso")
    with pytest.raises(InputError, match="not written"):
        post_program(first.moves, "mts")
    arc = source("T1 M6\nS1 M3 F1\nG18 G0 X0 Y0 Z0\nG2 X10 I5 K0\nM2", "iso")
    with pytest.raises(InputError, match="outside XY"):
        post_program(arc.moves, "heidenhain")


def test_the_door_writes_a_program(tmp_path, capsys):
    (tmp_path / "p.csv").write_text(POSES)
    out = tmp_path / "p.mpf"
    assert main(["post", str(tmp_path / "p.csv"), "--dialect", "sinumerik", "--out", str(out)]) == 0
    assert "TRAORI" in out.read_text()
    assert main(["post", str(tmp_path / "p.csv"), "--dialect", "sinumerik", "--out", str(out)]) == 2
    assert "exists already" in capsys.readouterr().err


def test_what_is_not_read_whole_is_not_written(tmp_path, capsys):
    """A program of a lathe, and one whose subprogram is missing: refused by the door as by a job."""
    lost = "G21 G90 S1000 M3 T1 M6\nM98 P77\nG1 X9. F90.\nM30\n"
    turned = "O1\nG21 G99 G97 S1000 M3\nT0101\nG0 X40. Z2.\nG1 Z-9. F.2\nM30\n"
    for text, said in (
        (turned, "a program for turning"),
        (lost, "no program O77"),
        (lost.replace("77", "8077"), "no program O8077"),
    ):
        (tmp_path / "p.nc").write_text(text)
        assert (
            main(
                ["post", str(tmp_path / "p.nc"), "--source-dialect", "fanuc", "--out", str(tmp_path / "q.nc")]
            )
            == 2
        )
        assert said in capsys.readouterr().err and not (tmp_path / "q.nc").exists()


def test_rewinds_are_told_and_drawn(tmp_path, capsys):
    """A spiral of 3 turns on a table of 2, where 1.25 turns are left from C90 on: one rewind; page and record name its line."""
    chain = tmp_path / "m.toml"
    axes = [
        ("C", "rotary", "z", "sign = -1\nmin_deg = -360\nmax_deg = 360"),
        ("A", "rotary", "x", "sign = -1\nmin_deg = 0\nmax_deg = 110"),
    ]
    axes += [(c.upper(), "linear", c, "") for c in "xyz"]
    chain.write_text("\n".join(
        f'[[axes]]\nname = "{n}"\nkind = "{k}"\ncarries = "{"work" if k == "rotary" else "tool"}"\ndirection = "{d}"\n{more}'
        for n, k, d, more in axes
    ))  # fmt: skip
    angle = np.radians(np.arange(0.0, 3.0 * 360.0 + 1.0, 10.0))
    c, s, lean = np.cos(angle), np.sin(angle), math.radians(30.0)
    rows = ["x_mm,y_mm,z_mm,i,j,k,feed_mm_min,rapid,tool"] + [
        f"{9 * a:.9f},{9 * b:.9f},0,{math.sin(lean) * a:.15f},{math.sin(lean) * b:.15f},{math.cos(lean):.15f},500,{int(n == 0)},1"
        for n, (a, b) in enumerate(zip(c, s, strict=True))
    ]
    (tmp_path / "p.csv").write_text("\n".join(rows))
    page = tmp_path / "angles.html"
    call = ["post", str(tmp_path / "p.csv"), "--machine", str(chain), "--out", str(tmp_path / "p.nc")]
    call += ["--plot", str(page), "--json"]
    assert main(call) == 0
    (jump,) = json.loads(capsys.readouterr().out)["jumps"]
    assert (jump["axis"], jump["kind"]) == ("C", "rewind") and 350.0 < abs(jump["turn_deg"]) <= 730.0
    assert f"line {jump['line']}: C turns by" in page.read_text()
    # the way to the first pose is a rapid: C unwinds there
    assert main([*call, "--force", "--start", "A30,C-270"]) == 0
    assert [jump["rapid"] for jump in json.loads(capsys.readouterr().out)["jumps"]] == [True, False]
    assert main([*call, "--force", "--start", "C"]) == 2
    assert "such as A0,C90" in capsys.readouterr().err
