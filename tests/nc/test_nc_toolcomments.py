"""Tools in comments, as post-processors print them."""

from __future__ import annotations

import pytest

from vmachining.nc.toolcomments import tool_notes

SAID = [  # comment, unit in mm; kind, diameter, corner, angle
    ("(T1 D=10. CR=0. - ZMIN=-5. - flat end mill)", 1.0, ("flat", 10.0, 0.0, None)),
    ("(T1  D=8. CR=4. - ZMIN=-12.3 - ball end mill)", 1.0, ("ball", 8.0, 4.0, None)),
    ("(T1 D=12. CR=1.5 - ZMIN=-3 - bullnose end mill)", 1.0, ("bull", 12.0, 1.5, None)),
    (";  #1 D=10 CR=5 - ZMIN=-20 - ZMAX=+30 - ball end mill", 1.0, ("ball", 10.0, 5.0, None)),
    ("(T1 D=0.25 CR=0. - ZMIN=-0.2 - flat end mill)", 25.4, ("flat", 6.35, 0.0, None)),
    ("(T1 D=6.8 CR=0. TAPER=118deg - ZMIN=-20. - drill)", 1.0, ("drill", 6.8, 0.0, 118.0)),
    ("(T1 D=10 CR=0. TAPER=45deg - chamfer mill)", 1.0, ("chamfer", 10.0, 0.0, 45.0)),
    ("( T1 | 1/2 FLAT ENDMILL | H1 | D1 | WEAR COMP | TOOL DIA. - .5 | Z STOCK - 0. )", 25.4, ("flat", 12.7, None, None)),
    ("(T1|10. BALL ENDMILL|H1)", 1.0, ("ball", 10.0, None, None)),
    ("(TOOL - 1  DIA. OFF. - 1  LEN. - 1  TOOL DIA. - .5)", 25.4, (None, 12.7, None, None)),
    ("(1/2 FLAT ENDMILL TOOL - 1 DIA. OFF. - 21 LEN. - 1 DIA. - .5)", 25.4, ("flat", 12.7, None, None)),
    ("(T1 1/2 FLAT ENDMILL TOOL - 1 DIA. OFF. - 21 LEN. - 1 DIA. - .5)", 25.4, ("flat", 12.7, None, None)),
    ("(T1 ENDMILL 10MM REACH 30MM)", 1.0, ("flat", 10.0, None, None)),
    ("(T1 1.0 DEEP 1/2 EM)", 25.4, ("flat", 12.7, None, None)),
    ("(T1 .030 RAD BULL .5 EM)", 25.4, ("bull", 12.7, None, None)),
    ("(T1 0.5 STOCK ROUGH EM 12)", 1.0, ("flat", 12.0, None, None)),
    ("(T1 = End Mill {1/4 inch})", 1.0, ("flat", 6.35, None, None)),
    ("( TOOL: T1 = 10.0 dia. ENDMILL)", 1.0, ("flat", 10.0, None, None)),
    ("; T1 = Drill {6 mm}", 25.4, ("drill", 6.0, None, None)),
    ("(1 1/2 INCH SHELL MILL)\nT1 M6", 1.0, ("flat", 38.1, None, None)),
    ("T1 M6 (BALL R5)", 1.0, ("ball", 10.0, 5.0, None)),
    ("(TOOL NAME : MILL_D10_R1)\nT1 M6", 1.0, (None, 10.0, 1.0, None)),
    ("(POCKET, BULL NOSE D12 R3, TWO LEVELS)\n" + "G0 X1\n" * 9 + "T1 M6", 1.0, ("bull", 12.0, 3.0, None)),
    ("(T1 1/4 DRILL)", 1.0, ("drill", 6.35, None, None)),
    ("(1-1/4 FACE MILL)\nT1 M6", 25.4, ("flat", 31.75, None, None)),
    ("(TOOL 1 5/16 4FL BALL)", 25.4, ("ball", 7.9375, None, None)),
    ("(TOOL 1/4 DRILL)\nT1 M6", 25.4, ("drill", 6.35, None, None)),
    ("(T1 1/2 3 FLUTE CARBIDE END MILL)", 25.4, ("flat", 12.7, None, None)),
    ("(T1 6.8 DRILL)", 1.0, ("drill", 6.8, None, None)),
    ("(T1 1/4-20 TAP)", 25.4, ("tap", 6.35, None, None)),
    ("T1 M6\n( MILL_6.0_DIA )", 1.0, (None, 6.0, None, None)),
    ("T1 M6 ( D12 )\nT2\n( DRILL-45 )\nT2 M6 ( D8 )\nT1\n( DRILL_PLUS45 )", 1.0, (None, 12.0, None, None)),
    ("( T1 | 90 SPOT DRILL | H1 )", 1.0, ("drill", None, None, 90.0)),
    ("( T1 | 90. CHAMFER MILL | H1 | D1 )", 25.4, ("chamfer", None, None, 45.0)),
    ("( T1 | 10. SPOT DRILL | H1 )", 1.0, ("drill", 10.0, None, None)),
    ("(T1 V-BIT 60 DEG 6MM)", 1.0, ("chamfer", 6.0, None, 30.0)),
    ("T1 M6 (.500 EM)", 25.4, ("flat", 12.7, None, None)),
    ("T1 M6 (1/2 EM)", 25.4, ("flat", 12.7, None, None)),
    ("T1 M6 (.75 RGH EM .03R)", 25.4, ("flat", 19.05, None, None)),
    ("T1 M6 (FRESA DE TOPO 10MM)", 1.0, (None, 10.0, None, None)),
    ("T1 M6 (FRAISE DIAM 20)", 1.0, (None, 20.0, None, None)),
    ("T1 M6 (FREZA FI10)", 1.0, (None, 10.0, None, None)),
    ("T1 M6 (СВЕРЛО D8.5)", 1.0, ("drill", 8.5, None, None)),
    ("T1 M6 (平刀D10)", 1.0, ("flat", 10.0, None, None)),
    ("T1 M6 (球刀R3)", 1.0, ("ball", 6.0, 3.0, None)),
    ("T1 M6 (SPIRALBOHRER D8,5)", 1.0, ("drill", 8.5, None, None)),
    ("T1 M6 (D10,4FL END MILL)", 1.0, ("flat", 10.0, None, None)),
    ("T1 M6 (10MM CARBIDE 4FL R0.5)", 1.0, (None, 10.0, 0.5, None)),
    ("(T1 3 FLUTE END MILL)", 1.0, ("flat", None, None, None)),
    ("(T1 D6)\n(CHAMFER EDGES)\nT1 M6", 1.0, ("chamfer", 6.0, None, None)),
]  # fmt: skip


@pytest.mark.parametrize(("text", "unit", "wanted"), SAID)
def test_what_a_comment_says(text, unit, wanted):
    note = tool_notes(text.split("\n"), [1], unit)[1]
    kind, diameter, corner, angle = wanted
    assert (note.kind, note.angle_deg) == (kind, angle)
    assert note.diameter_mm == pytest.approx(diameter) and note.corner_mm == corner
    assert note.text in text.split("\n")[note.line - 1]


@pytest.mark.parametrize(
    ("text", "flutes"), [("(T1 2 FLUTE .5 END MILL)", 2), ("(T1 D10 4FL)", 4), ("(T1 D10 FLAT)", None)]
)
def test_flutes_that_a_comment_counts(text, flutes):
    assert tool_notes([text], [1], 25.4)[1].flutes == flutes


@pytest.mark.parametrize(
    "text",
    [
        "(T1 hello)",
        "(FINISH FEED 10 MM)\nT1 M6",
        "(MILL POCKET 10MM)\nT1 M6",
        "(FRESATURA 10MM)\nT1 M6",
        "(STEP 3)\nT1 M6",
        "T1 M6",
    ],
)
def test_nothing_is_read_into_other_comments(text):
    assert tool_notes(text.split("\n"), [1], 1.0) == {}


def test_every_tool_gets_its_own_comment():
    text = "(T1 D=4. CR=0. - flat end mill)\n(T12 D=6. CR=3. - ball end mill)\n(2 MM DRILL)\nT3 M6\nT12 M6\nT1 M6"
    notes = tool_notes(text.split("\n"), [1, 3, 12], 1.0)
    assert {n: (note.kind, note.diameter_mm) for n, note in notes.items()} == {
        1: ("flat", 4.0), 12: ("ball", 6.0), 3: ("drill", 2.0)
    }  # fmt: skip


@pytest.mark.parametrize(
    ("text", "size", "guess"),
    [
        ("ENDMILL 10", 10.0, "ENDMILL 10"), ("ENDMILL 1/2", 12.7, "ENDMILL 1/2"), ("BOHRER 6.8", 6.8, "BOHRER 6.8"),
        ("3 FLUTE ENDMILL 10", 10.0, "ENDMILL 10"), ("TAP M8X1.25", 8.0, "M8"), ("CUTTER 16", 16.0, "CUTTER 16"),
        ("ENDMILL 10 R0.5", 10.0, "ENDMILL 10"), ("D12 ENDMILL 3", 12.0, None), ("FRESA 10", 10.0, "FRESA 10"),
        ("EM10R1", 10.0, "EM10"), ("FRESA D.10", 10.0, "D.10"), ("D.1 CUTTER", None, None), ("ФРЕЗА 8", 8.0, "ФРЕЗА 8"),
        ("FLAT END MILL 2", None, None), ("|  #7 DRILL | H3", 5.1054, "#7 DRILL"), ("NO. 43 STUB DRILL", 2.2606,
        "NO. 43 STUB DRILL"), ("LETTER F DRILL", 6.5278, "LETTER F DRILL"), ("#7 ENDMILL", None, None),
        ("DRILL 4 HOLES", None, None), ("SPOT DRILL 90 DEG", None, None), ("ENDMILL 1234", None, None),
    ],
)  # fmt: skip
def test_a_number_beside_the_name_of_a_cutter_is_a_guess(text, size, guess):
    """Whole numbers below 3 mm may count flutes or operations; a diameter that is told by its letter is no guess."""
    note = tool_notes([f"(T1 {text})", "T1 M6"], [1], 1.0).get(1)
    assert ((note.diameter_mm, note.guess) if note else (None, None)) == (size, guess)


@pytest.mark.parametrize(
    ("text", "unit", "size"),
    [
        ("SPOT DRILL 90", 1.0, None), ("CHAMFER MILL 45", 1.0, None), ("DRILL 118", 1.0, None), ("DRILL 12", 1.0, 12.0),
        ("ENDMILL 45", 1.0, 45.0), ("DRILL 2", 25.4, None), ("ENDMILL 4", 25.4, None), ("ENDMILL .5", 25.4, 12.7),
        ("ENDMILL 2.", 25.4, 50.8), ("ENDMILL 3/8", 25.4, 9.525),
    ],
)  # fmt: skip
def test_angles_and_counts_are_no_diameters(text, unit, size):
    """What stands beside a drill or a chamfer mill may be its angle; sizes in inches are fractions or decimals."""
    note = tool_notes([f"(T1 {text})", "T1 M6"], [1], unit).get(1)
    assert (note.diameter_mm if note else None) == (size if size is None else pytest.approx(size))


def test_what_is_told_stands_against_a_guess():
    for lines in (["(T1 ENDMILL 10)", "(T1 D=12.)"], ["(T1 D=12.)", "(T1 ENDMILL 10)"]):
        note = tool_notes([*lines, "T1 M6"], [1], 1.0)[1]
        assert (note.diameter_mm, note.guess) == (12.0, None)


def test_a_sheet_of_sizes_is_that_of_the_next_call():
    """NX writes one before each call, further away than loose comments may stand; a list of several tools tells none."""
    sheet = ";TOOL NAME  : X\n;TOOL DIAMETER     : {}\n;TOOL CORNER RADIUS: {}\n" + ";Intol : 0.05\n" * 4
    text = f"{sheet}T1\nG1 X1\n{sheet}T2".format(10, 1, 6, 3)
    notes = tool_notes(text.splitlines(), [1, 2], 1.0)
    assert [note[2:5] for note in notes.values()] == [(None, 10, 1), (None, 6, 3)]
    text = f"{sheet}{sheet}T1\nG1 X1\nT2".format(10, 1, 6, 3)
    assert not tool_notes(text.splitlines(), [1, 2], 1.0)
