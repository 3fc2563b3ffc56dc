"""Subprograms in separate files, and modes and tools that a program writes."""

from __future__ import annotations

from pathlib import Path

import pytest

from vmachining.nc import Motion, Program, parse_program, read_program
from vmachining.nc.rewrite import BlockEdit, rewrite_feeds

HEAD = "G21 F100 S100 M3\n"


def read(folder: Path, text: str, **files: str) -> Program:
    for name, body in files.items():
        (folder / f"{name}.ngc").write_text(body)
    (folder / "main.ngc").write_text(text)
    return read_program(folder / "main.ngc", home=(0.0, 0.0, 0.0))


def ends(program: Program) -> list[tuple[int, tuple[float, ...]]]:
    return [(m.line, m.end) for m in program.moves if m.motion is not Motion.DWELL]


def test_a_sub_of_its_own_file_moves_on_the_line_that_called(tmp_path):
    hole = "o<Hole> sub\n#<deep> = #1\nG1 Z-#<deep>\nG0 Z0\no<hole> endsub [#1 + 1]\nM2\n"
    text = HEAD + "N7 G0 X5\nO<HOLE> call [3]\nG0 X#<_value>\nM2\n"
    program = read(tmp_path, text, HOLE=hole)
    program.require_clean()
    assert ends(program) == [(2, (5, 0, 0)), (3, (5, 0, -3)), (3, (5, 0, 0)), (4, (4, 0, 0))]
    assert [m.n for m in program.moves] == [7, None, None, None]
    assert program.files == (str(tmp_path / "HOLE.ngc"),)


def test_files_call_files_and_m98_finds_numbers(tmp_path):
    program = read(
        tmp_path,
        HEAD + "M98 P12 L2\nM30\n",
        **{"12": "%\nO12\nG91 G0 X1\no<in> call [2]\nM99\n%\n", "in": "o<in> sub\nG0 Y#1\no<in> endsub\n"},
    )
    program.require_clean()
    assert ends(program) == [(2, (1, 0, 0)), (2, (1, 2, 0)), (2, (2, 2, 0)), (2, (2, 4, 0))]


def test_findings_of_a_file_name_it(tmp_path):
    program = read(tmp_path, "o<a> call\nG0 X1\nM2\n", a="o<a> sub\n\nG1 X2 Q7\no<a> endsub\n")
    (error,) = program.errors
    assert (error.line, error.col, error.code) == (1, 1, "E207") and "a.ngc, line 3: Q7" in error.message
    assert ends(program) == [(2, (1, 0, 0))]


@pytest.mark.parametrize(
    ("text", "files", "code"),
    [
        ("o<b> call\nM2\n", {}, "E412"),
        ("o<b> call\nM2\n", {"b": "G0 X1\n"}, "E412"),  # holds no sub of that name
        ("o<b> call\nM2\n", {"b": "o<b> sub\nG0 X1\n"}, "E412"),  # which never ends
        ("M98 P5\nM2\n", {"5": "O5\nG0 X1\n"}, "E415"),
        ("o<b> call\nM2\n", {"b": "\0\1binary"}, "E412"),
        ("o<b> call\nM2\n", {"b": "o<b> sub\no<b> call\no<b> endsub\n"}, "E414"),
        ("o<../main> call\nM2\n", {}, "E412"),  # no way out of the folder
    ],
)
def test_refusals(tmp_path, text, files, code):
    assert code in {f.code for f in read(tmp_path, text, **files).errors}


def test_a_file_that_cannot_be_read_is_told_where_it_is_called(tmp_path):
    program = read(tmp_path, "G0 X1\no<b> call\nG0 X2\nM2\n", b="\0\1binary")
    (error,) = program.errors
    assert (error.line, error.code) == (2, "E412") and "binary" in error.message
    assert len(program.moves) == 1


def test_bytes_have_no_folder_but_those_given(tmp_path):
    (tmp_path / "s.ngc").write_text("o<s> sub\nG0 X1\no<s> endsub\n")
    assert [f.code for f in parse_program(b"o<s> call\nM2\n", "p").errors] == ["E412"]
    program = parse_program(b"o<s> call\nM2\n", "p", subroutines=[tmp_path])
    program.require_clean()
    assert len(program.moves) == 1


def test_the_program_may_end_in_a_file(tmp_path):
    program = read(tmp_path, HEAD + "o<e> call\nG0 X9\nM2\n", e="o<e> sub\nG0 X1\nM2\no<e> endsub\n")
    program.require_clean()
    assert program.ended and ends(program) == [(2, (1, 0, 0))]


def test_feeds_behind_a_file_are_left_alone(tmp_path):
    text = HEAD + "G1 X1\nG1 X2\no<f> call\nG1 X4\nM2\n"
    program = read(tmp_path, text, f="o<f> sub\nG1 X3 F50\no<f> endsub\n")
    program.require_clean()
    edits = {line: BlockEdit(line, (30.0,), (1.0,)) for line in (2, 4, 5)}
    written = rewrite_feeds(program, edits)
    assert written.untouched == (4, 5)
    again = parse_program(written.data, "again", home=(0, 0, 0), subroutines=[tmp_path])
    assert [m.feed_mm_min for m in again.moves] == [30, 100, 50, 50]


# ---- modes and tools that a program writes ----


def test_modes_come_back_by_m72_and_at_the_end_of_a_sub():
    sub = "o<m> sub\nM73\nG20 G91 G55 F9 M4\nG0 X1\no<m> endsub\n"
    text = sub + "G10 L2 P2 Y5\n" + HEAD + "M70\nG91 F7\nM72\nG1 X3\no<m> call\nG1 X3 Y1\nM2\n"
    program = parse_program(text.encode(), "p", home=(0.0, 0.0, 0.0))
    program.require_clean()
    first, inch, last = program.moves
    assert (first.end, first.feed_mm_min) == ((3, 0, 0), 100)
    assert inch.end == pytest.approx((28.4, 0, 0))
    assert (last.end, last.feed_mm_min, last.spindle_rpm) == ((3, 1, 0), 100, 100)


def test_modes_can_be_read_by_name():
    """As the reference control answers them; codes are ten times their number."""
    head = "G20 G90.1 G93 G55 G99 S100 M3\nT2\nT1 M6\n"
    asked = {"_plane": 170, "_motion_mode": 800, "_coord_system": 550, "_inverse_time": 1, "_units_per_minute": 0,
             "_retract_r_plane": 1, "_retract_old_z": 0, "_spindle_on": 0, "_ijk_absolute_mode": 1, "_selected_tool": 1,
             "_current_tool": 1, "_tool_offset": 0, "_task": 0, "_call_level": 0, "_metric": 0, "_ccomp": 400}  # fmt: skip
    text = head + "".join(f"#{k}=#<{name}>\n" for k, name in enumerate(asked, 100)) + "#99=#<_line>\n"
    text += "".join(f"G0 X#{k}\n" for k in range(99, 100 + len(asked))) + "M2\n"
    program = parse_program(text.encode(), "p", home=(0, 0, 0))
    program.require_clean()
    found = [round(m.end[0] / 25.4, 9) for m in program.moves]
    assert found == [4 + len(asked), *asked.values()]
    turned = parse_program(
        b"G41.1 D2\nG1 F1 X[#<_ccomp>/100]\nM4 S1\nY#<_spindle_cw>\nG40\nM2\n", "p", home=(0, 0, 0)
    )
    assert turned.moves[0].end_program == pytest.approx((4.1, 1, 0))


def test_tools_that_g10_writes():
    """L1 writes an offset, L10 the one with which the tool stands at the words; nothing moves before G43."""
    text = HEAD + "T1 M6 M3\nG0 Z9\nG10 L1 P1 X1 Z5 R2\nG43 H1\nG0 X0 Y0 Z1\nG49\nG53 G0 Z20\nG10 L10 P1 Z3\n"
    text += "G43\nG0 X0 Z0\nG41 D1 X9\nG0 X40\nM2\n"
    program = parse_program(text.encode(), "p", home=(0.0, 0.0, 0.0), work_offsets={"G54": (0.0, 0.0, 0.0)})
    program.require_clean()
    machine = [m.end_machine for m in program.moves]
    assert machine[1] == (1, 0, 6)  # program + offset
    assert machine[3] == (1, 0, 17)  # the tool is 17 long: at machine 20 it stands at 3
    assert program.moves[-1].end_program == pytest.approx((40, 2, 0))  # radius 2, on the left


def test_nothing_known_of_a_tool_but_its_length_is_no_radius():
    found = parse_program(b"T1 M6\nG10 L1 P1 Z5\nG41 D1\nM2\n", "p").errors
    assert [f.code for f in found] == ["E351"]


@pytest.mark.parametrize("corner", ["arc", "exact"])
@pytest.mark.parametrize("side", [41, 42])
def test_small_turns_are_passed_over_unless_every_corner_counts(corner, side):
    """A polygon of 160 corners on a circle of radius 20: turns of 0.0393 rad. The tool of radius 3 stays within
    an eight hundredth of its radius of the path that keeps 3 mm, less the sagitta of the chords."""
    from math import cos, hypot, pi, sin

    points = [(20 * sin(k * pi / 80), -20 * cos(k * pi / 80)) for k in range(121)]
    body = "\n".join(f"X{x:.9f} Y{y:.9f}" for x, y in points)
    text = f"{HEAD}G0 X-20 Y-20\nG{side}.1 D6\nG1 X-10\n{body}\nM2\n"
    program = parse_program(text.encode(), "p", home=(0, 0, 0), crc_corner=corner)
    program.require_clean()
    away = 17.0 if side == 41 else 23.0
    moves = [m for m in program.moves if m.feed_mm_min][3:-1]
    assert any(m.center for m in moves) == (corner == "exact" and side == 42)
    slack = 3 * (1 - cos(0.0393)) if corner == "arc" else 1e-6
    for move in moves:
        reach = hypot(*move.end[:2])
        assert away - 20 * (1 - cos(pi / 160)) - slack <= reach <= away + slack + 1e-6
