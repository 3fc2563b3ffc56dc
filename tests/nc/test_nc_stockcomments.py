"""Stock in the comments of programs: each format as its CAM system prints it, with the corners that it means."""

import pytest

from vmachining.nc import parse_program
from vmachining.nc.stockcomments import StockNote, placed, stock_note
from vmachining.nc.toolcomments import tool_notes

PLACED = [
    # CutViewer: the zero lies at (0, 0, 10) from the lowest corner, so the top is zero
    (["(STOCK/BLOCK,100,50,10,0,0,10)"], 1.0, (0, 0, -10), (100, 50, 0)),
    (["%", "(STOCK/BLOCK, 4, 2, 1, 2, 1, 0)"], 25.4, (-50.8, -25.4, 0), (50.8, 25.4, 25.4)),
    (["(stockMin:0.00mm, -23.00mm, -12.70mm)", "(stockMax:60.00mm, 0.00mm, 0.00mm)"], 25.4, (0, -23, -12.7), (60, 0, 0)),
    # Vectric, with the words for its zero
    (["( Material Size)", "( X= 300.000, Y= 200.000, Z= 12.000)", "( Z Origin for Material  = Material Surface)",
      "( XY Origin for Material = Bottom Left Corner)"], 1.0, (0, 0, -12), (300, 200, 0)),
    (["( Material Size)", "( X= 300, Y= 200, Z= 12)", "(Z Origin for Material = Machine Bed)",
      "(XY Origin for Material = Center)"], 1.0, (-150, -100, 0), (150, 100, 12)),
]  # fmt: skip


@pytest.mark.parametrize(("lines", "scale", "low", "high"), PLACED)
def test_stock_that_comments_place(lines, scale, low, high):
    first, second, sure = placed(stock_note(lines, scale), (0.0, 0.0, -1.0), (1.0, 1.0, 0.0))
    assert (first, second, sure) == (pytest.approx(low), pytest.approx(high), True)


SIZES = [
    (["INSERT/Stock Size X150. Y100. Z8."], 1.0, (150, 100, 8)),
    (["( STOCK SIZE - X150 Y100 Z8 )"], 1.0, (150, 100, 8)),
    (['(Material Thickness: 3/4")', '(Material length: 7" X width: 5")'], 25.4, (177.8, 127.0, 19.05)),
]


@pytest.mark.parametrize(("lines", "scale", "size"), SIZES)
def test_a_size_alone_is_laid_at_the_zero_that_holds_the_motion(lines, scale, size):
    note = stock_note(lines, scale)
    assert note.size == pytest.approx(size)
    x, y, z = size
    # motion over x from zero on and y about zero, down to -4
    low, high, sure = placed(note, (1.0, -0.4 * y, -4.0), (x - 1.0, 0.4 * y, -1.0))
    assert (low, high, sure) == (pytest.approx((0, -y / 2, -z)), pytest.approx((x, y / 2, 0)), False)


def test_comments_that_name_no_stock_give_none():
    assert stock_note(["(MATERIAL - ALUMINUM MM - 2024)", "(STOCK TO LEAVE 0.2)", "G1 X5 Y5 Z5"], 1.0) is None


@pytest.mark.parametrize(
    ("lines", "number", "kind", "diameter", "angle"),
    [
        (["(TOOL/MILL,3.175,0.000,0.000,0.00)", "M6T102"], 102, "flat", 3.175, None),
        (["(TOOL/DRILL, 5, 118, 40)", "M6 T3"], 3, "drill", 5, 118),
        (["; shape = CylindricalCutter", ";tool_radius = 0.5"], 1, "flat", 1.0, None),
        (["( T0 : 1.5 )", "G0 X1"], 1, None, 1.5, None),
        (["T3 Z S900", "T4", ";DIA OUTIL = 10. RAYON = 1."], 4, None, 10, None),
        (['( 1/4" DIA. 2 FLUTE STUBBY E.M. )', "( REV. )", "N102 T3"], 3, "flat", 6.35, None),
        (["T2M6S1527F244.3( 10. END_MILL_SPHER DIA. 10. )"], 2, "ball", 10, None),
    ],
)
def test_tools_of_more_systems(lines, number, kind, diameter, angle):
    note = tool_notes(lines, [number], 1.0)[number]
    assert (note.kind, note.diameter_mm, note.angle_deg) == (kind, diameter, angle)


BOX = {"box": {"min": [-10.0, -20.0, -30.0], "max": [90.0, 40.0, 2.0]}}
ROUND = {"cylinder": {"center": [0.0, 0.0], "radius": 50.0, "z": [-105.0, 0.0]}}


@pytest.mark.parametrize(
    ("text", "stock"),
    [
        # bit 64: the second level absolute, 16 and 32: the second corner in X and Y
        ('WORKPIECE(,"",,"BOX",112,2,-30,-80,-10,-20,90,40)\nG1 G710 X1 F9 S1 M3\nM30\n', BOX),
        ('WORKPIECE(,,,"BOX",0,2,-32,-80,-10,-20,100,60)\nG1 G710 X1 F9 S1 M3\nM30\n', BOX),
        ('WORKPIECE(,,,"CYLINDER",64,0,-105,-80,100)\nG1 G710 X1 F9 S1 M3\nM30\n', ROUND),
        (
            "BEGIN PGM A MM\nBLK FORM 0.1 Z X-10 Y-20 Z-30\nBLK FORM 0.2 IX+100 IY+60 IZ+32\nEND PGM A MM\n",
            BOX,
        ),
        ("BEGIN PGM A MM\nBLK FORM CYLINDER Z R50 L105\nEND PGM A MM\n", ROUND),
    ],
)
def test_stock_of_controls(text, stock):
    assert parse_program(text.encode(), "a", dialect="auto").declared.stock == stock


@pytest.mark.parametrize(
    ("text", "kind", "diameter"),
    [
        ("| 5.0 DRILL | H3 | D3", "drill", 5.0),
        ("DRILL D3 H03", "drill", None),
        ("OFFSET D3 END MILL", "flat", None),
        ("STICKOUT 40MM, 10MM END MILL", "flat", 10.0),
        ("0.5MM STEPOVER BALL END MILL 6MM", "ball", 6.0),
        ("HOLDER D40 END MILL D10", "flat", 10.0),
        ("END MILL SHANK DIA = 6 CUTTER DIA = 3", "flat", 3.0),
        ("DRILL DEPTH 25 MM", "drill", None),
        ("10 MM LONG REACH END MILL", "flat", 10.0),
    ],
)
def test_other_lengths_and_registers_are_no_diameter(text, kind, diameter):
    note = tool_notes([f"(T3 {text})", "T3 M6"], [3], 1.0)[3]
    assert (note.kind, note.diameter_mm) == (kind, diameter)


@pytest.mark.parametrize(
    "text", ["(STOCK/BLOCK,1.2.3,5,1)", "(STOCK SIZE X. Y. Z.)", "(STOCK/BLOCK,0,5,1,0,0,1)"]
)
def test_stock_that_holds_no_numbers_is_passed_over(text):
    assert stock_note([text], 1.0) is None


@pytest.mark.parametrize(
    ("datum", "low", "sure"),
    [
        (("UPPER RIGHT", "TOP"), (-10, -20, -4), True),
        (("CENTER", "CENTER"), (-5, -10, -2), True),
        (("X=5 Y=5", "TOP"), (0, 0, -4), False),
        (("BOTTOM LEFT", "10MM ABOVE BED"), (0, 0, -4), False),
    ],
)
def test_a_zero_in_words_that_are_not_known_is_a_guess(datum, low, sure):
    first, _, known = placed(StockNote(1, "", size=(10.0, 20.0, 4.0), datum=datum), (0, 0, -1), (1, 1, 0))
    assert (first, known) == (pytest.approx(low), sure)


def test_a_cut_below_zero_speaks_for_a_top_at_zero():
    """From 0.2 above the zero to 1/8 inch below it, in a board of 3/4 inch; and through one that lies upon the zero."""
    note = stock_note(["( Material Size)", "( X= 12.0, Y= 6.0, Z= 0.75)"], 25.4)
    assert placed(note, (50.0, 30.0, -3.175), (120.0, 75.0, 5.08))[1][2] == 0.0
    assert placed(note, (50.0, 30.0, -0.5), (120.0, 75.0, 20.0))[0][2] == 0.0
