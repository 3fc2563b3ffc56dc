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
    ("G0 X1 HELLO", "E110", 1, 7, "HELLO"),
    ("G0 X1\nL X+10 FMAX", "E211", 2, 1, "L X+10 FMAX"),
    ("G0 X1)", "E104", 1, 6, ")"),
    ("(" + 255 * "c" + ")", "E105", 1, 257, ")"),
    ("G0 X−1", "E106", 1, 5, "−"),
    ("G0 X[1+]", "E107", 1, 4, "X[1+]"),
    ("G0 X EXISTS[1]", "E107", 1, 4, "X EXISTS[1]"),
    ("G0 X[1/0]", "E108", 1, 4, "X[1/0]"),
    ("G0 X#<nobody>", "E108", 1, 4, "X#<nobody>"),
    ("#5220 = 2", "E108", 1, 1, "#5220 = 2"),
    ("G0 N10 X1", "E201", 1, 4, "N10"),
    ("N1234567890 G0", "E102", 1, 1, "N1234567890"),
    ("N-5 G0", "E201", 1, 1, "N-5"),
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
    ("G87 X1 Z-1 R1", "E208", 1, 1, "G87"),
    ("G68 R1", "E208", 1, 1, "G68"),
    ("G81 X1 Z-1 R1 W2", "E207", 1, 15, "W2"),
    ("G81 X1 Z-1 R1 @2", "E207", 1, 15, "@2"),
    ("G0 X1 @2", "E207", 1, 7, "@2"),
    ("G10 L2 P1 X0 Q1", "E207", 1, 14, "Q1"),
    ("G10 L2 P1 Z1 @3", "E207", 1, 14, "@3"),
    ("G92 Z0 ^30", "E207", 1, 8, "^30"),
    ("G28 @5", "E207", 1, 5, "@5"),
    ("G0 @5", "E362", 1, 4, "@5"),
    ("G91 G0 @5 ^3", "E362", 1, 8, "@5"),
    ("G10 G1 L2 P1 X0", "E206", 1, 5, "G1"),
    ("G10 L20 P1 R3", "E207", 1, 12, "R3"),
    ("M98 P1 X1", "E206", 1, 8, "X1"),
    ("O1 if [1] G0\nO1 endif", "E101", 1, 11, "G0"),
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
    ("T9 M6\nG1 X1 F100", "E321", 1, 1, "T9"),
    ("T9 M6\nG0 X1", "W321", 1, 1, "T9"),
    ("T1.5", "E322", 1, 1, "T1.5"),
    ("M6", "E323", 1, 1, "M6"),
    ("G4", "E335", 1, 1, "G4"),
    ("G4 P-1", "E335", 1, 4, "P-1"),
    ("G81 X1 R1 F1", "E331", 1, 1, "G81"),
    ("G81 Z-15\nG79", "E332", 1, 1, "G81"),
    ("G81 Z-15\nG79", "E210", 2, 1, "G79"),
    ("F1 G81 X1 Y1 Z3 R1", "E333", 1, 17, "R1"),
    ("F1 G83 X1 Z-3 R1 Q0", "E334", 1, 18, "Q0"),
    ("F1 G73 X1 Z-3 R1", "E334", 1, 4, "G73"),
    ("F1 G82 X1 Z-3 R1", "E335", 1, 4, "G82"),
    ("F1 G81 X1 Z-3 R1 L0", "E336", 1, 18, "L0"),
    ("F1 G84 X1 Z-3 R1", "E311", 1, 4, "G84"),
    ("F1 G93 G81 X1 Z-3 R1", "E301", 1, 8, "G81"),
    ("G41.1 D2 F1\nG81 X1 Z-3 R1", "E344", 2, 1, "G81"),
    ("G41 D0", "W351", 1, 5, "D0"),
    ("G41", "E351", 1, 1, "G41"),
    ("G41.1 F1\nG1 X3", "E351", 1, 1, "G41.1"),
    ("G41.1 D2 F1\nG1 X9\nG40\nG2 X12 I1", "E352", 4, 1, "G2"),
    ("G41.1 D6 F1\nG1 X2.9", "E353", 2, 1, "G1"),
    ("F1 S1 M3 G18\nG84 X1 Z1 R1 Y-1", "W345", 2, 1, "G84"),
    ("M2\nO1\nM99\nO01\nM99", "W411", 4, 1, "O01"),
    ("G0 X1 (abort, no tool)", "E418", 1, 1, ""),
    ("M62", "E376", 1, 1, "M62"),
    ("M67 E.5 Q1", "E376", 1, 5, "E.5"),
    ("M66 P1 E1", "E376", 1, 1, "M66"),
    ("M66 P1 L3", "E376", 1, 8, "L3"),
    ("M19 R360", "E376", 1, 5, "R360"),
    ("M72", "E376", 1, 1, "M72"),
    ("G64 M19 R5", "E206", 1, 9, "R5"),
    ("S1 M3\nG33.1 Z1", "E334", 2, 1, "G33.1"),
    ("G33.1 Z1 K1", "E311", 1, 1, "G33.1"),
    ("G10 L1 P0 Z1", "E375", 1, 8, "P0"),
    ("G41.1 D6 F1 G1 X-9\nX9", "W353", 2, 1, "X9"),
    ("F1 G41.1 D6 G1 X9\nG3 X13 I2", "E354", 2, 1, "G3"),
    ("F1 G41.1 D6 G1 X9\nY5\nX7\nY0", "E355", 3, 1, "X7"),
    ("F1 G41.1 D4 G1 X9\nX20\nG2 X16 I-2\nG1 Y9", "W355", 4, 1, "G1"),
    ("G41.1 D6\nG18", "E356", 2, 1, "G18"),
    ("G41.1 D6\nG42.1 D6", "E357", 2, 1, "G42.1"),
    ("G41.1 D6\nM2", "W358", 2, 1, "M2"),
    ("G41.1 D6\nG92 X0", "E359", 2, 1, "G92"),
    ("G41.1 D6\nG55", "E359", 2, 1, "G55"),
    ("G41.1 D6\nG28", "E359", 2, 1, "G28"),
    ("G41.1 D6\nT1 M6", "E359", 2, 4, "M6"),
    ("G10 L7 P1", "E375", 1, 5, "L7"),
    ("G10 L2 P12", "E375", 1, 8, "P12"),
    ("O1 sub\nG0 X1", "E411", 1, 1, "O1"),
    ("O1 endif", "E411", 1, 1, "O1"),
    ("O1 while [1]\nO2 endwhile", "E411", 1, 1, "O1"),
    ("O1 break", "E411", 1, 1, "O1"),
    ("O<x> call", "E412", 1, 1, "O<x>"),
    ("M98 P7", "E412", 1, 5, "P7"),
    ("O1 while [1]\nO1 endwhile", "E413", 2, 1, ""),
    ("O1 sub\nO1 call\nO1 endsub\nO1 call", "E414", 2, 1, ""),
    ("G0 X1\nM99\nG0 X2", "W415", 2, 1, "M99"),
    ("F1 G83 X1 Z-900 R1 Q.1 L90000", "E413", 1, 1, ""),
    ("o1 sub\nM99\no1 endsub\no1 call", "E415", 2, 1, "M99"),
    ("o#1 sub\no1 endsub", "E416", 1, 1, "o#1"),
    ("o[1+] call", "E107", 1, 1, "o[1+] call"),
    ("M98 P9\nM2\nO9\nG0 X1", "E415", 3, 1, ""),
    ("O1 if\nO1 endif", "E416", 1, 1, "O1"),
    ("O1 repeat [0.5]\nO1 endrepeat", "E108", 1, 1, "O1"),
    ("G92", "E371", 1, 1, "G92"),
    ("G52", "E371", 1, 1, "G52"),
    ("G91 G53 G0 X1", "E372", 1, 5, "G53"),
    ("G2 I1 F1\nG53 X1 I1", "E372", 2, 1, "G53"),
    ("G0 X1", "W401", 1, 1, ""),
    ("", "W401", 1, 1, ""),
    ("%", "W401", 1, 1, ""),
    ("!\n" * 1001, "E408", 1001, 1, ""),
    ("G20 F10", "W302", 1, 5, "F10"),
    ("G2 X10 Y0 I5.01 F1", "W304", 1, 1, "G2"),
    ("N20 G0\nN10 G0\nN20 G0", "W402", 3, 1, "N20"),
    ("N20 G0\nN10 G0\nN20 G0", "W403", 2, 1, "N10"),
    ("N60 G0\nN70 G0\nN60 G0", "W403", 3, 1, "N60"),
    ("N60 G0\nN70 G0\nN60 G0", "W402", 3, 1, "N60"),
    ("G4 P1000", "W335", 1, 4, "P1000"),
    ("F1 G82 X1 Z-3 R1 P500", "W335", 1, 18, "P500"),
    ("G41.1 D2 L57.7", "E209", 1, 10, "L57.7"),
    ("G18 G42.1 D2 L7", "E209", 1, 14, "L7"),
    ("G0 X1\nM30\n G0 X2\nX3", "W404", 3, 2, "G0 X2"),
    ("G1 F1 X1\nX2", "W501", 1, 1, "G1"),
    ("G21\nM30", "W406", 1, 1, ""),
    ("G0 X1\n%", "I405", 2, 1, "%"),
    ("N1 G0\n" * 300, "I407", 300, 1, ""),
]


OTHERS = [  # dialect, program, code, line
    ("mts", "G81 W1", "E331", 1),
    ("mts", "G81 Z15", "E337", 1),
    ("mts", "G81 Z-15 W-1", "E338", 1),
    ("mts", "G82 Z-47 K0 D5", "E339", 1),
    ("mts", "G83 Z-47 K3 D-5", "E339", 1),
    ("mts", "G79", "E340", 1),
    ("mts", "G78 X0 Y0 D10 S2\nG79", "E341", 2),
    ("mts", "G78 X0 Y0 D10 S2.5", "E342", 1),
    ("mts", "G78 X0 Y0 D0 S3", "E343", 1),
    ("mts", "G77 X0 Y0 D9 S3", "E332", 1),
    ("mts", "G81 Z-15 R3", "E207", 1),
    ("mts", "G81 Z-15 X3", "E207", 1),
    ("heidenhain", "BEGIN PGM T MM\nL X+1 FMAX M8\nEND PGM T MM", "I408", 2),
    ("heidenhain", "BEGIN PGM T MM\nCYCL DEF 247 DATUM Q339=1\nL X+1 FMAX\nEND PGM T MM", "I409", 2),
    ("heidenhain", "BEGIN PGM T MM\nPLANE SPATIAL SPA90 SPB0 SPC0 STAY\nL X+1 FMAX\nEND PGM T MM", "W365", 4),
    ("heidenhain", "BEGIN PGM T MM\nL Z-1 FMAX M91\nEND PGM T MM", "W366", 2),
    ("heidenhain", 'BEGIN PGM T MM\nTOOL CALL "D10" Z S1\nL X+1 FMAX\nEND PGM T MM', "W367", 2),
    (
        "heidenhain",
        "BEGIN PGM T MM\nCYCL DEF 7.1 X+1\nCYCL DEF 10.1 ROT+9\nCYCL DEF 7.1 X+2\nL X+1 FMAX\nEND PGM T MM",
        "E367",
        4,
    ),
    ("heidenhain", "BEGIN PGM T MM\nCYCL DEF 247 D Q339=1\nCYCL DEF 247 D Q339=2\nEND PGM T MM", "W368", 3),
    ("heidenhain", "BEGIN PGM T MM\nCALL PGM TNC:\\NOWHERE.H\nL X+1 FMAX\nEND PGM T MM", "W383", 2),
    ("fanuc", "O1\nG65 P9021\nM30", "W382", 2),
    ("sinumerik", "G54 G0 X1\nG500 X2", "E368", 2),
    ("heidenhain", "BEGIN PGM T MM\nL X+1 M103 F20 FMAX\nEND PGM T MM", "W372", 2),
    ("heidenhain", "BEGIN PGM T MM\nPLANE AXIAL B+30 STAY\nEND PGM T MM", "W374", 2),
    (
        "heidenhain",
        "BEGIN PGM T MM\nTOOL DEF 1 L+0 R+1\nTOOL CALL 1 Z S9\nCYCL DEF 262 Q335=90 Q239=1 Q201=-1 Q355=0 Q253=9 Q351=1 Q200=1"
        " Q203=0 Q204=9 Q207=9\nCYCL CALL\nEND PGM T MM",
        "W373",
        5,
    ),
    ("sinumerik", "TRAORI\nORIAXES\nG0 X1 A3=0 B3=0 C3=1\nM30", "W375", 3),
    ("sinumerik", "TRAORI\nG0 A90\nAROT X90\nG0 X1 Y1 Z1\nM30", "W369", 3),
    ("sinumerik", "G70 G0 X1\nM30", "W370", 1),
    ("sinumerik", "X1 Y1\nM30", "W371", 1),
    ("fanuc", "O1\nG96 S9 M3\nG71 U1\nG71 P1 Q2\nN1 G0 X1 Z1\nN2 X2\nM30", "W379", 4),
    ("fanuc", "O1\nG96 S9 M3\nG1 X1 Z2 F9\nM30", "W380", 1),
    ("fanuc", "O1\nG95 G1 X1 F9\nM30", "W381", 2),
    (
        "sinumerik",
        "G710\n$TC_DP6[1,1]=5\nT1 M6\nS9 M3 F9\nPOCKET4(9,0,2,-5,8,0,0,9,0,0,9,9,0,1)\nM30",
        "W384",
        5,
    ),
    ("apt", "GOTO/1,2", "E109", 1),
    ("apt", "GOTO/1,2,3x3", "E102", 1),
    ("apt", "SPLINE/1,2", "E208", 1),
    ("apt", "FEDRAT/1\nGOTO/1,2,3,0,0,0", "E363", 2),
    ("apt", "MULTAX\nRAPID\nGOTO/1,2,3,0,3,4", "W363", 3),
    ("apt", "RAPID\nGOTO/1,2,3,0,0.6,0.8", "W364", 2),
    ("apt", "RAPID\nGOTO/1,2,3,0,0,-1", "E364", 2),
    ("apt", "UNITS/MM\nFEDRAT/1\nGOTO/5,0,0\nCIRCLE/0,0,0,0,1,1,5\nGOTO/-5,0,0", "I361", 5),
    ("apt", "FEDRAT/1,MMPM\nGOTO/5,0,0", "I213", 1),
    ("apt", "UNITS/MM\nFEDRAT/1\nGOTO/5,0,0\nCUTCOM/LEFT", "I214", 4),
    ("apt", "GOTO/1,2,3", "E301", 1),
    ("apt", "FINI\nGOTO/1,2,3", "W404", 2),
    ("poses", "x_mm,y_mm\n1,2", "E109", 1),
    ("poses", "x_mm,y_mm,z_mm,rapid\n1,2,3,1\n1,nan,3,1", "E102", 3),
    ("poses", "x_mm,y_mm,z_mm,rapid\n1,2,3,1\n1,1e99,3,1", "E102", 3),
    ("poses", "x_mm;y_mm;z_mm\n1,5;2;3", "E109", 1),
    ("poses", "x_mm,y_mm,z_mm\n1,2,3\n1,2,4", "E301", 3),
]


@pytest.mark.parametrize(("dialect", "text", "code", "line"), OTHERS)
def test_finding_in_another_dialect(dialect, text, code, line):
    found = parse_program(text.encode(), "p", dialect=dialect, tools=TOOLS).findings
    assert (code, line) in {(f.code, f.line) for f in found}, found


HAL = "o<x> sub\no100 if [#<_hal[a.b]> EQ 5]\nG92.1\no100 endif\no<x> endsub\nG0 X1\nM2"


@pytest.mark.parametrize(
    ("text", "code", "line"),
    [
        (HAL, "E107", 2),
        (HAL.replace("G0 X1", "o<x> call"), "E107", 2),
        ("o1 do\nG0 X1\no1 while\nM2", "E416", 3),
        ("o1 while [1+]\no1 break\no1 endwhile\nM2", "E107", 1),
        ("o1 if [0]\no1 elseif\nG0 X1\no1 else\no1 endif\nM2", "E416", 2),
        ("o1 sub\no1 endsub [1+]\no1 call\nM2", "E107", 2),
    ],
)
def test_the_cause_alone_is_told_and_not_its_pair(text, code, line):
    found = parse_program(text.encode(), "p", tools=TOOLS).errors
    assert [(f.code, f.line) for f in found] == [(code, line)]


def test_block_numbers_of_posts_that_count_by_ten():
    program = parse_program(b"N99990 G21 G90\nN100000 G0 X1\nN999999990 G0 X2\nM2", "p", tools=TOOLS)
    assert not program.findings
    assert [(move.n, move.end[0]) for move in program.moves] == [(100000, 1.0), (999999990, 2.0)]


def test_dwells_in_seconds_and_in_milliseconds():
    text = b"G4 P0.5\nF100 S100 M3 G82 X1 Y1 Z-1 R1 P500\nM2"
    seconds = parse_program(text, "p", tools=TOOLS)
    assert [m.dwell_s for m in seconds.moves if m.motion == "dwell"] == [0.5, 500.0]
    assert [(f.code, f.line) for f in seconds.findings] == [("W335", 2)]
    milliseconds = parse_program(text, "p", tools=TOOLS, dwell="ms")
    assert [m.dwell_s for m in milliseconds.moves if m.motion == "dwell"] == [0.0005, 0.5]
    assert not milliseconds.findings
    with pytest.raises(NCError, match="dwell 'min'; s or ms"):
        parse_program(text, "p", dwell="min")


def test_a_long_loop_may_be_given_more_steps():
    text = b"#1 = 0\no1 while [#1 LT 200]\n#1 = [#1 + 1]\no1 endwhile\nG0 X#1\nM2"
    assert [f.code for f in parse_program(text, "p", max_steps=100).errors] == ["E413"]
    assert "--max-steps" in parse_program(text, "p", max_steps=100).errors[0].hint
    assert parse_program(text, "p", max_steps=1000).moves[-1].end[0] == 200.0


def test_findings_that_need_to_know_more():
    text = b"F1 S1 M3\nG1 X1.015 Z3\nM2"
    found = parse_program(text, "p", stock_top_mm=2.0, travel_mm=((0, 0, 0), (1, 1, 9)), blu_mm=0.01).findings
    assert {(f.code, f.line) for f in found} == {("E373", 2), ("I374", 2), ("W520", 2)}
    restart = parse_program(b"O1 if [0]\nG0 X1\nO1 endif\nG0 X2\nM2", "p", start_line=2)
    assert [f.code for f in restart.errors] == ["E417"] and not restart.moves


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
    raised = (
        {case[1] for case in CASES}
        | {case[2] for case in OTHERS}
        | {"W321", "E373", "I374", "W520", "E417", "I212", "W213", "W214", "E361"}
        | {"W368"}  # tests/nc/test_nc_controls.py
        | {"W333"}  # tests/nc/test_nc_posts.py
        | {"W376"}  # tests/nc/test_nc_sinumerik_more.py
        | {"W377", "W378", "E377", "E378"}  # tests/job/test_ranges.py
    )
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
    parse_program(b"G0 X1\n", "part.nc").require_clean(allow={"W401"})
