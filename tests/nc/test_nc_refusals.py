"""What is refused, and where the finger points. Every code of the catalogue is raised once."""

from __future__ import annotations

import pytest

from vmachining.errors import NCError
from vmachining.nc import CATALOGUE, Finding, ToolEntry, finding_record, parse_program

TOOLS = {1: ToolEntry(1, 10.0, 50.0)}

CASES = [  # program, code, line, column, word
    ("G21 !", "E101", 1, 5, "!"),
    ("G0 [X1]", "E101", 1, 4, "["),
    ("O12 G1", "E101", 1, 5, "G1"),
    ("N10 G1 X1.2.3 F50", "E102", 1, 8, "X1.2.3"),
    ("G0 X--2", "E102", 1, 4, "X--2"),
    ("G0 X9999999999", "E102", 1, 4, "X9999999999"),
    ("G0 X Y1", "E103", 1, 4, "X"),
    ("G0 (a", "E104", 1, 4, "(a"),
    ("G0 X1)", "E104", 1, 6, ")"),
    ("(" + 255 * "c" + ")", "E105", 1, 257, ")"),
    ("G0 X−1", "E106", 1, 5, "−"),
    ("G0 X[1+]", "E107", 1, 4, "X[1+]"),
    ("G0 X EXISTS[1]", "E107", 1, 4, "X EXISTS[1]"),
    ("G0 X[1/0]", "E108", 1, 4, "X[1/0]"),
    ("G0 X#<nobody>", "E108", 1, 4, "X#<nobody>"),
    ("#5220 = 2", "E108", 1, 1, "#5220 = 2"),
    ("G0 N10 X1", "E201", 1, 4, "N10"),
    ("N123456 G0", "E201", 1, 1, "N123456"),
    ("G0 X1 Y2 x3", "E202", 1, 10, "x3"),
    ("G00 G01 X5 F100", "E203", 1, 5, "G01"),
    ("M3 S1 M5", "E204", 1, 7, "M5"),
    ("X1", "E206", 1, 1, "X1"),
    ("G80 X1", "E206", 1, 1, "G80"),
    ("F1 G92 G01 X5", "E206", 1, 8, "G01"),
    ("G4 G64 P1", "E206", 1, 8, "P1"),
    ("G0 X1 K3", "E207", 1, 7, "K3"),
    ("G61 R0.5", "E207", 1, 5, "R0.5"),
    ("G0 X1 G123", "E208", 1, 7, "G123"),
    ("G1.05 X1", "E208", 1, 1, "G1.05"),
    ("G41 D1 G1 X1", "E208", 1, 1, "G41"),
    ("G81 X1 Z-1 R1", "E208", 1, 1, "G81"),
    ("M98 P1", "E208", 1, 1, "M98"),
    ("G10 L2 P1 X0", "E208", 1, 1, "G10"),
    ("O100 while [1]", "E208", 1, 1, "O100"),
    ("G0 X1 A90", "E209", 1, 7, "A90"),
    ("G24", "E209", 1, 1, "G24"),
    ("G21\nG79", "E210", 2, 1, "G79"),
    ("G1 X1", "E301", 1, 1, "G1"),
    ("G1 X1 F0", "E301", 1, 7, "F0"),
    ("F100 G93 G1 X1 F1\nX2", "E202", 1, 16, "F1"),
    ("G93 G1 X1 F1\nX2", "E301", 2, 1, "X2"),
    ("G95 F1 G1 X1", "E301", 1, 8, "G1"),
    ("G2 X1 F1", "E302", 1, 1, "G2"),
    ("F1 G90.1 G2 X2 I1", "E302", 1, 10, "G2"),
    ("G2 X2 I1 R1 F1", "E303", 1, 10, "R1"),
    ("G2 X10 Y0 I5.1 F1", "E304", 1, 1, "G2"),
    ("G21 G90\nG2 X10 Y0 R4.99 F100", "E305", 2, 1, "G2"),
    ("G2 X0 Y0 R5 F1", "E306", 1, 1, "G2"),
    ("G17 G2 X1 Z1 I1 K1", "E307", 1, 17, "K1"),
    ("G2 I0 J0 F1", "E308", 1, 1, "G2"),
    ("G2 I1 P1.5 F1", "E309", 1, 7, "P1.5"),
    ("M3", "E311", 1, 1, "M3"),
    ("S-1", "E312", 1, 1, "S-1"),
    ("T9 M6", "E321", 1, 1, "T9"),
    ("T1.5", "E322", 1, 1, "T1.5"),
    ("M6", "E323", 1, 1, "M6"),
    ("G4", "E335", 1, 1, "G4"),
    ("G4 P-1", "E335", 1, 4, "P-1"),
    ("G92", "E371", 1, 1, "G92"),
    ("G91 G53 G0 X1", "E372", 1, 5, "G53"),
    ("G2 I1 F1\nG53 X1 I1", "E372", 2, 1, "G53"),
    ("G0 X1", "E401", 1, 1, ""),
    ("", "E401", 1, 1, ""),
    ("%", "E401", 1, 1, ""),
    ("!\n" * 1001, "E408", 1001, 1, ""),
    ("G20 F10", "W302", 1, 5, "F10"),
    ("G2 X10 Y0 I5.01 F1", "W304", 1, 1, "G2"),
    ("N20 G0\nN10 G0\nN20 G0", "W402", 3, 1, "N20"),
    ("N20 G0\nN10 G0\nN20 G0", "W403", 2, 1, "N10"),
    ("G0 X1\nM30\n G0 X2\nX3", "W404", 3, 2, "G0 X2"),
    ("G1 F1 X1\nX2", "W501", 1, 1, "G1"),
    ("G21\nM30", "W406", 1, 1, ""),
    ("G0 X1\n%", "I405", 2, 1, "%"),
    ("N1 G0\n" * 300, "I407", 300, 1, ""),
]


def findings(text: str, tools: dict[int, ToolEntry] | None = TOOLS) -> tuple[Finding, ...]:
    return parse_program(text.encode(), "p.nc", tools=tools).findings


@pytest.mark.parametrize(("text", "code", "line", "col", "word"), CASES)
def test_finding(text, code, line, col, word):
    found = [f for f in findings(text) if f.code == code]
    assert found, findings(text)
    first = found[0]
    assert (first.line, first.col, first.word) == (line, col, word)
    assert first.length == len(word) and first.severity == code[0] and first.message
    if word:
        assert text.split("\n")[line - 1][col - 1 :].startswith(word)


def test_every_code_is_explained_and_raised():
    raised = {case[1] for case in CASES} | {"W321"}
    assert raised == set(CATALOGUE)
    assert all(entry.title and entry.explanation for entry in CATALOGUE.values())


def test_unknown_length_is_a_warning_without_a_table_and_an_error_with_one():
    assert [f.code for f in findings("G43 H7\nG0 Z1\nM2", tools=None)] == ["W321"]
    assert [f.code for f in findings("G43 H7\nG0 Z1\nM2")] == ["E321"]


def test_wrong_block_changes_nothing():
    text = "G21 G90 S10 M3\nG1 X1 F100\n#1=7 G91 G20 X5 F5 M5 T1 G92 K1\nX2\nZ#1\nM2"
    moves = parse_program(text.encode(), "p").moves
    assert [m.end for m in moves] == [(1, 0, 100), (2, 0, 100), (2, 0, 0)]
    assert moves[1].feed_mm_min == 100 and moves[1].spindle_rpm == 10


def test_all_errors_of_a_class_and_only_the_lowest_class():
    assert [f.code for f in findings("G0 G1 X! Y\nM2")] == ["E103", "E101", "E103"]
    assert [f.code for f in findings("G0 G1 X1 X2 K1\nM2")] == ["E203", "E202", "E207"]
    assert [f.code for f in findings("G79 K1 L1\nM2")] == ["E210"]


def test_findings_are_sorted_and_serialise():
    found = findings("N5 G0 K1\nN5 X!\n")
    assert list(found) == sorted(found, key=lambda f: (f.line, f.col, f.code))
    assert set(finding_record(found[0])) == {
        "line", "col", "len", "n", "word", "code", "severity", "message", "hint"
    }  # fmt: skip


def test_spindle_warning_is_given_once_for_each_stop():
    text = "F9 G1 X1\nX2\nM3 S1\nX3\nM5\nX4\nX5\nM2"
    assert [f.line for f in findings(text)] == [1, 6]


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ("G0 X1".encode("utf-16"), "UTF-16"),
        (("G0 X1\n" * 50).encode("utf-16-le"), "UTF-16"),
        (b"\x7fELF\0\0\1", "binary"),
    ],
)
def test_files_that_are_no_text(data, message):
    with pytest.raises(NCError, match=message):
        parse_program(data, "p.nc")


def test_errors_of_the_caller(tmp_path):
    from vmachining.nc import read_program

    with pytest.raises(NCError, match="cannot read"):
        read_program(tmp_path / "none.nc")
    with pytest.raises(NCError, match="cannot read"):
        read_program(tmp_path)
    with pytest.raises(NCError, match="dialect"):
        parse_program(b"", "p", dialect="klingon")
    with pytest.raises(NCError, match="work offset"):
        parse_program(b"", "p", work_offsets={"G99": (0, 0, 0)})


def test_require_clean_names_the_place():
    program = parse_program(b"G0 X1\nG1 Y1\n", "part.nc")
    with pytest.raises(NCError, match=r"part\.nc:2:1: E301 .*\[G1\].*program F"):
        program.require_clean()
    parse_program(b"G0 X1\n", "part.nc").require_clean(allow={"E401"})
