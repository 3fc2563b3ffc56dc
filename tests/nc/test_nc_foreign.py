"""What is not a program of the dialect is named: other controls, other files, numbers as people write them."""

from __future__ import annotations

from pathlib import Path

import pytest

from vmachining.errors import NCError
from vmachining.nc import ToolEntry, decode_program, parse_program, split_lines
from vmachining.nc.files import recognised

ROOT = Path(__file__).parents[2]
TOOLS = {1: ToolEntry(1, 10.0, 50.0)}

OTHERS = [  # text, dialect it is read in, line, words of the message
    ("0 BEGIN PGM PLATE MM\n1 BLK FORM 0.1 Z X+0 Y+0 Z-20\n4 L X+10 Y+10 R0 FMAX M3\n", "iso", 1, "Heidenhain"),
    ("L X+10 FMAX\nL Y+20 F200\n", "iso", 1, "Heidenhain"),
    ("G0 X1\n4 L IX-10,5 RL F200\nM2\n", "iso", 2, "Heidenhain"),
    ("N10 G90 G54\nN40 CYCLE81(50,0,2,-10,10)\nM30\n", "iso", 2, "Siemens"),
    ("DEF REAL DEPTH=-10\nG0 Z1\nM30\n", "iso", 1, "Siemens"),
    ("G90\nN70 G1 X=IC(5) F100\nM30\n", "iso", 2, "Siemens"),
    ("G90\nG2 X10 Y0 CR=5 F100\nM30\n", "iso", 2, "Siemens"),
    ("G90\nIF [#1 GT 2] GOTO 10\nM30\n", "iso", 2, "Fanuc custom macros"),
    ("#1=0\nWHILE [#1 LT 5] DO1\n#1=#1+1\nEND1\nM30\n", "iso", 2, "Fanuc custom macros"),
    ("PARTNO X\nLOADTL/1\nGOTO/1,2,3\nFINI\n", "iso", 2, "dialect apt"),
    ("x_mm,y_mm,z_mm\n1,2,3\n", "iso", 1, "dialect poses"),
    ("G21 G90\nG0 X1\nM2\n", "apt", 1, "dialect iso"),
    ("G21 G90\nG0 X1\nM2\n", "poses", 1, "dialect iso"),
    ('name = "a"\n[program]\nfile = "a.nc"\n', "iso", 2, "job file"),
    ("ISO-10303-21;\nHEADER;\n", "iso", 1, "STEP"),
    ("solid part\nfacet normal 0 0 1\n", "iso", 1, "STL"),
    ('CGTECH_MACRO "SubroutineSequence" "CGT_CYCL_DEF204"\nL ZQ200+Q203 FMAX\n', "heidenhain", 1, "VERICUT"),
    (";VERICUT SAMPLE CONTROL MCD SUBROUTINE FILE: sin840d.sub\n%SPF6\nG17\nM6\nM17\n", "sinumerik", 1, "VERICUT"),
    ("%MPF 90\n( SINUMERIK 850 )\nR11=384.5\nN1 @371 R52 K2 K0\nN40 G0 X-5\n", "sinumerik", 4, "SINUMERIK 8xx"),
    ('MACHINE mill\nEVENT part_takeover\n{\n   UI_LABEL "Takeover"\n}\n', "iso", 2, "CDL"),
    ("<!DOCTYPE html>\n<html>\n", "iso", 1, "web page"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "dialect", "line", "words"), OTHERS)
def test_one_finding_names_what_it_is(text, dialect, line, words):
    program = parse_program(text.encode(), "p", dialect=dialect, tools=TOOLS)
    (found,) = program.errors
    assert (found.code, found.line) == ("E211", line) and words in f"{found.message}; {found.hint}"
    assert text.split("\n")[line - 1][found.col - 1 :].startswith(found.word) and found.word
    assert not program.moves


@pytest.mark.parametrize("path", sorted(ROOT.glob("models/**/*.nc")), ids=lambda path: path.name)
def test_no_line_of_a_right_program_bears_a_mark_of_another(path):
    lines = split_lines(decode_program(path.read_bytes(), path.name))
    assert recognised(lines, range(1, len(lines) + 1), "iso") is None


def test_marks_in_comments_do_not_count():
    text = "(L X+10 FMAX) G0 X1 V2\nG0 X1 V1 ; CYCLE81(1) CR=5\nM2"
    assert {f.code for f in parse_program(text.encode(), "p", tools=TOOLS).errors} == {"E209"}


NUMBERS = [  # line, word, what is meant
    ("G0 X10,5", "X10,5", "decimal comma", "write X10.5"),
    ("G0 X-,5 Y1", "X-,5", "decimal comma", "write X-.5"),
    ("G0 X1O", "X1O", "letter O", "write X10"),
    ("G0 XO.5", "XO.5", "letter O", "write X0.5"),
    ("GO Z1", "GO", "letter O", "write G0"),
    ("G1 X1 F1OO", "F1OO", "letter O", "write F100"),
    ("G0 X1e99", "X1e99", "exponent", "write the number out"),
    ("G0 X2.5E-3", "X2.5E-3", "exponent", "write the number out"),
]


@pytest.mark.parametrize(("text", "word", "what", "remedy"), NUMBERS)
def test_numbers_as_people_write_them(text, word, what, remedy):
    (found,) = parse_program(f"{text}\nM2".encode(), "p", tools=TOOLS).errors
    assert (found.code, found.word, found.hint) == ("E102", word, remedy) and what in found.message
    assert text[found.col - 1 : found.col - 1 + found.length] == word


def test_words_that_look_like_exponents_and_letters_o_are_read():
    program = parse_program(b"N10O1 if [1]\nM67E1Q2\nN20O1 endif\nG0X1\nM2", "p", tools=TOOLS)
    assert not program.errors and program.moves[-1].end[0] == 1.0


def test_letters_in_a_row_are_one_finding():
    (found,) = parse_program(b"G0 X1 HELLO\nM2", "p", tools=TOOLS).errors
    assert (found.code, found.word) == ("E110", "HELLO")
    (found,) = parse_program(b"G0 X1 SOFT\nM2", "p", tools=TOOLS).errors
    assert found.code == "E110" and "Siemens" in found.message
    (found,) = parse_program(b"G1 X10,C2 F9\nM2", "p", tools=TOOLS).errors
    assert found.code == "E208" and "chamfer" in found.message


@pytest.mark.parametrize(
    ("data", "kind"),
    [
        (b"\x7fELF\x02\x01\x01\0\0abc", "an executable"),
        (b"PK\3\4\x14\0\0\0", "a ZIP archive"),
        (b"%PDF-1.7\n1 0 obj\n", "a PDF document"),
        (b"\0" * 80 + (1).to_bytes(4, "little") + b"\0" * 50, "a binary STL mesh"),
        (bytes(range(1, 256)) * 4, ""),
    ],
)
def test_binary_files_are_named(data, kind):
    with pytest.raises(NCError, match=f"binary.*{kind}.*not a program"):
        parse_program(data, "p")


@pytest.mark.parametrize(
    "data", [b"\x13%\nG0 X1\nM2\n\x1a", "(Größe) G0 X1\nM2".encode("latin-1"), b"\x01G0 X1\nM2"]
)
def test_tape_codes_and_code_pages_are_text(data):
    parse_program(data, "p", tools=TOOLS)


@pytest.mark.parametrize("line", ["CYCLE90(5,0,1,-10,,20,17,1.5,300,2,0,10,10)", "G41 G147 DISR=5 X0 Y0"])
def test_what_a_named_dialect_lacks_is_no_other_control(line):
    """No word of this program but the wrong line says Sinumerik; the job does."""
    program = parse_program(f"G17 G90\nG1 X1 F9\n{line}\nM30".encode(), "p", dialect="sinumerik", tools=TOOLS)
    assert {f.code for f in program.errors} == {"E208"} and len(program.moves) == 1
