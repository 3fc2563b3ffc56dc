"""Programs of the open reference control and the calls it makes, where a copy lies beside the project."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from vmachining.nc import Motion, Move, ToolEntry, move_record, parse_program, read_program, read_tool_table

DATA = (Path(__file__).parents[2] / "../shared/data/linuxcnc").resolve()
CALL = re.compile(r"N\.*\d*\s+(\w+)\((.*)\)")
TOLERANCE_MM = 25.4 * 0.6e-4  # the calls are printed with four decimals, in inches at worst
CASES = sorted(DATA.glob("interp/*/*.ngc")) + sorted(DATA.glob("good/*.ngc"))

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason="programs of the reference control are not here")


def expected_calls(text: str) -> list[tuple[str, list[float]]]:
    """Motions in mm; arcs as end, centre, turns, third axis."""
    calls, unit = [], 1.0
    for name, raw in CALL.findall(text):
        if name == "USE_LENGTH_UNITS":
            unit = 25.4 if "INCH" in raw else 1.0
        elif name in ("STRAIGHT_TRAVERSE", "STRAIGHT_FEED"):
            calls.append((name, [unit * float(v) for v in raw.split(",")[:3]]))
        elif name == "ARC_FEED":
            values = [float(v) for v in raw.split(",")[:6]]
            calls.append((name, [v if i == 4 else unit * v for i, v in enumerate(values)]))
    return calls


def as_call(move: Move) -> tuple[str, list[float]]:
    end = list(move.end_program)
    if move.motion is Motion.RAPID:
        return "STRAIGHT_TRAVERSE", end
    if move.center is None:
        return "STRAIGHT_FEED", end
    a, b, c = {"xy": (0, 1, 2), "zx": (2, 0, 1), "yz": (1, 2, 0)}[move.plane]
    turns = move.turns if move.motion is Motion.ARC_CCW else -move.turns
    center = move_record(move, "program")["center_mm"]
    return "ARC_FEED", [end[a], end[b], *center, turns, end[c]]


@pytest.mark.parametrize("path", CASES, ids=lambda p: p.parent.name + "/" + p.name)
def test_the_same_calls(path):
    tables = list(path.parent.glob("*.tbl"))
    tools: dict[int, ToolEntry] | None = read_tool_table(tables[0], "inch") if tables else None
    program = read_program(path, tools=tools, home=(0.0, 0.0, 0.0), rotary="ABC")
    program.require_clean(allow={"W401"})
    moves = [as_call(m) for m in program.moves if m.motion is not Motion.DWELL]
    beside = path.with_name(path.name + ".expected")
    text = (beside if beside.exists() else path.with_name("expected")).read_text(errors="replace")
    expected = expected_calls(text)
    assert len(moves) == len(expected)
    for (kind, values), (wanted, numbers) in zip(moves, expected, strict=True):
        assert kind == wanted
        assert values == pytest.approx(numbers, abs=TOLERANCE_MM)


@pytest.mark.parametrize("path", sorted(DATA.glob("bad/*.ngc")), ids=lambda p: p.name)
def test_bad_programs_are_refused(path):
    errors = [f for f in read_program(path).errors if f.code != "W401"]
    assert errors


@pytest.mark.parametrize(("name", "moves"), [("cds.ngc", 266), ("3D_Chips.ngc", 4684), ("3dtest.ngc", 50)])
def test_whole_programs_read_clean(name, moves):
    program = read_program(DATA / "programs" / name)
    program.require_clean()
    assert len(program.moves) == moves and program.ended


@pytest.mark.parametrize("path", sorted(DATA.glob("bad/*.ngc")), ids=lambda p: p.name)
def test_the_reason_is_the_same(path):
    """By number, because every control has its own words."""
    (first, *_) = [f for f in read_program(path, rotary="ABC").errors if f.code != "W401"]
    assert first.code == REASON[path.name.split(".")[0]]


REASON = {
    "a-in-canned-cycle2": "E207", "bad-arc": "E304", "ccomp-gouging": "E355", "exists-1": "E107",
    "exists-3": "E108", "exists-5": "E107", "exists-7": "E107", "g64-r-on-g61": "E207", "no-feed-rate": "E301",
    "probe-no-axes": "E208",
}  # fmt: skip


def test_five_axis_programs_want_a_machine_with_these_axes():
    path = DATA / "programs" / "impeller-7bl-xyzac.ngc"
    assert {f.code for f in read_program(path).errors} == {"E209", "E408"}
    program = read_program(path, rotary="AC")
    program.require_clean(allow={"W401"})
    assert all(move.tcp for move in program.moves) and len(program.moves) > 4400
    inverse = next(move for move in program.moves if move.motion is Motion.LINEAR)
    assert inverse.duration_s is None  # its axes stand still
    assert inverse.rotary_deg == {"a": -71.841, "c": -35.93}


def test_the_same_program_without_its_line_ends():
    data = (DATA / "programs" / "cds.ngc").read_bytes().replace(b"\r\n", b"\n")
    assert parse_program(data.replace(b"\n", b"\r"), "cr").moves == parse_program(data, "lf").moves
