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
LATER = re.compile(r"not supported|no axis")

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
def test_calls_up_to_the_first_code_that_is_not_supported(path):
    tables = list(path.parent.glob("*.tbl"))
    tools: dict[int, ToolEntry] | None = read_tool_table(tables[0], "inch") if tables else None
    program = read_program(path, tools=tools, home=(0.0, 0.0, 0.0))
    stops = [f for f in program.errors if f.code != "E401"]
    assert all(LATER.search(f.message) for f in stops[:1]), stops[0]
    last = stops[0].line if stops else 10**9
    moves = [as_call(m) for m in program.moves if m.line < last and m.motion is not Motion.DWELL]
    beside = path.with_name(path.name + ".expected")
    text = (beside if beside.exists() else path.with_name("expected")).read_text(errors="replace")
    expected = expected_calls(text)
    if not stops:
        assert len(moves) == len(expected)
    for (kind, values), (wanted, numbers) in zip(moves, expected, strict=False):
        assert kind == wanted
        assert values == pytest.approx(numbers, abs=TOLERANCE_MM)


@pytest.mark.parametrize("path", sorted(DATA.glob("bad/*.ngc")), ids=lambda p: p.name)
def test_bad_programs_are_refused(path):
    errors = [f for f in read_program(path).errors if f.code != "E401"]
    assert errors


@pytest.mark.parametrize(("name", "moves"), [("cds.ngc", 266), ("3D_Chips.ngc", 4684), ("3dtest.ngc", 50)])
def test_whole_programs_read_clean(name, moves):
    program = read_program(DATA / "programs" / name)
    program.require_clean()
    assert len(program.moves) == moves and program.ended


def test_five_axis_programs_are_refused_by_name():
    found = read_program(DATA / "programs" / "impeller-7bl-xyzac.ngc").errors
    assert {f.code for f in found[:-1]} == {"E208", "E209"}
    assert "M428" in found[0].message


def test_the_same_program_without_its_line_ends():
    data = (DATA / "programs" / "cds.ngc").read_bytes().replace(b"\r\n", b"\n")
    assert parse_program(data.replace(b"\n", b"\r"), "cr").moves == parse_program(data, "lf").moves
