"""Programs for turning: smallest programs, their paths worked by hand from the Fanuc 0i-T and Okuma OSP manuals."""

from __future__ import annotations

from math import pi

import pytest

from vmachining.errors import NCError
from vmachining.job.reading import refuse_turning
from vmachining.nc import parse_program

HEAD = "O1\nG21 G99 G97 S1000 M3\nT0101\n"


def read(text, dialect="fanuc", **options):
    return parse_program(text.encode(), "p", dialect=dialect, **options)


def path(text, dialect="fanuc", **options):
    """(line, radius, z) of the ends of all moves."""
    program = read(text, dialect, **options)
    assert not program.errors, program.errors
    assert "W380" in {item.code for item in program.findings}
    assert all(move.end[1] == 0.0 for move in program.moves)
    return [(move.line, round(move.end[0], 4), round(move.end[2], 4)) for move in program.moves]


def test_x_is_a_diameter_and_u_and_w_are_steps():
    text = f"{HEAD}G0 X40. Z2.\nG1 Z-10. F.2\nU4. W-1.\nU6.\nM30\n"
    assert path(text) == [(4, 20.0, 2.0), (5, 20.0, -10.0), (6, 22.0, -11.0), (7, 25.0, -11.0)]
    control = {"lathe": "radius"}
    assert path(text, control=control)[-1] == (7, 50.0, -11.0)


def test_arcs_lie_in_z_x_and_count_centres_as_radii():
    """A convex quarter from face to shaft, radius 5: G3 seen with X up and Z to the right."""
    program = read(f"{HEAD}G0 X20. Z0\nG3 X30. Z-5. I0 K-5. F.1\nG1 Z-20.\nM30\n")
    arc = program.moves[1]
    assert (arc.plane, arc.motion, arc.center) == ("zx", "arc_ccw", (-5.0, 10.0))
    assert arc.end == (15.0, 0.0, -5.0)


def test_arcs_tell_radii_from_diameters_and_their_sense():
    """The same quarter in radii, and with G2 and G3 exchanged: the other reading has no such circle, or one of 270 degrees."""
    head = f"{HEAD}G0 X10. Z0\n"
    for text, swapped in (("G3 X15. Z-5. I0 K-5. F.1", False), ("G2 X15. Z-5. I0 K-5. F.1", True)):
        program = read(f"{head}{text}\nM30\n")
        assert not program.errors and program.moves[-1].end == (15.0, 0.0, -5.0)
        assert program.moves[-1].motion == "arc_ccw" and program.moves[-1].center == (-5.0, 10.0)
        assert any("counted from below" in item.message for item in program.findings) is swapped


@pytest.mark.parametrize(
    ("cycle", "path_of"),
    [  # from radius 30, z 2: along, with a taper of 2 mm, across, and the modal second pass
        ("G90 X40. Z-20. F.2", [(20, 2), (20, -20), (30, -20), (30, 2)]),
        ("G90 X40. Z-20. R-2. F.2", [(18, 2), (20, -20), (30, -20), (30, 2)]),
        ("G94 X20. Z-3. F.2", [(30, -3), (10, -3), (10, 2), (30, 2)]),
        ("G92 X38. Z-20. F1.5", [(19, 2), (19, -20), (30, -20), (30, 2)]),
    ],
)
def test_single_passes_end_where_they_began(cycle, path_of):
    text = f"{HEAD}G0 X60. Z2.\n{cycle}\nG0 X80.\nM30\n"
    expected = [(5, r, z) for r, z in path_of]
    assert path(text)[1:-1] == expected
    more = path(text.replace("G0 X80.", "X36."))[5:]
    assert [(r, z) for _, r, z in more][1 if "G94" not in cycle else 2] == (
        (18, -20) if "G94" not in cycle else (18, 2)
    )


def test_threads_take_their_lead_as_the_feed_of_a_turn():
    program = read(f"{HEAD}G98\nG0 X20. Z5.\nG32 Z-20. F1.5\nX19.5\nG1 X30. F100\nM30\n")
    assert not program.errors
    feeds = [move.feed_mm_min for move in program.moves if move.feed_mm_min]
    assert feeds == pytest.approx([1500.0, 1500.0, 100.0])
    okuma = read(f"{HEAD}G0 X20. Z5.\nG33 Z-20. K1.5\nM30\n")
    assert okuma.moves[-1].feed_mm_min == pytest.approx(1500.0)


def test_system_b_has_the_modes_of_a_mill():
    text = "O1\nG21 G97 S1000 M3\nT0101\nG90 G95 G0 X40. Z2.\nG77 X36. Z-5. F.2\nG91 G1 X2. Z-1. F.1\nM30\n"
    ends_ = [(20, 2), (18, 2), (18, -5), (20, -5), (20, 2), (21, 1)]
    assert [(r, z) for _, r, z in path(text)] == ends_


def test_the_spindle_follows_the_surface_speed_up_to_its_limit():
    """v = pi d n: 100 m/min at diameter 50 are 636.6 rev/min; nearer than diameter 15.9 the limit of 2000 holds."""
    program = read("O1\nG21 G99\nG50 S2000\nT0101\nG96 S100 M3\nG0 X50. Z0\nG1 Z-1. X50. F.1\nX4.\nX0\nM30\n")
    assert not program.errors
    at = [move.spindle_rpm for move in program.moves]
    assert at[1] == pytest.approx(100_000.0 / (pi * 50.0))
    assert at[2] == pytest.approx(100_000.0 / (pi * 27.0)) and at[3] == 2000.0
    assert program.moves[1].feed_mm_min == pytest.approx(0.1 * at[1])


CONTOUR = "N10 G0 X20.\nG1 Z-10. F.1\nX30. Z-15.\nN20 X40.\n"


def test_the_finishing_cycle_runs_the_contour_and_roughing_is_named():
    text = f"{HEAD}G0 X60. Z2.\nG71 U2. R1.\nG71 P10 Q20 U.5 W.1 F.3\n{CONTOUR}G70 P10 Q20\nG0 X90.\nM30\n"
    assert path(text)[1:] == [
        *((11, r, z) for r, z in [(10, 2), (10, -10), (15, -15), (20, -15), (30, 2)]),
        (12, 45.0, 2.0),
    ]
    assert [item.line for item in read(text).findings if item.code == "W379"] == [6]
    assert [item.code for item in read(text.replace("G70 P10", "G70 P11")).errors] == ["E208"]


def test_a_cycle_takes_its_own_contour_and_no_more():
    """N numbers that come again, and a contour in a subprogram: the cycle takes the blocks after it, the main program goes on."""
    again = "N10 G0 X30.\nG1 Z-5. F.1\nN20 X44.\n"
    text = f"{HEAD}G0 X60. Z2.\nG71 P10 Q20 U.5 F.3\n{CONTOUR}G70 P10 Q20\nG71 P10 Q20 U.5\n{again}G70 P10 Q20\nM30\n"
    assert [(r, z) for line, r, z in path(text) if line == 15] == [(15, 2), (15, -5), (22, -5), (30, 2)]
    assert [(r, z) for line, r, z in path(text) if line == 10] == [
        (10, 2),
        (10, -10),
        (15, -15),
        (20, -15),
        (30, 2),
    ]
    sub = f"M98 P2\nG0 X80.\nG1 Z-9. F.2\nM30\nO2\nG71 P10 Q20 U.5\n{CONTOUR}M99\n"
    assert path(f"{HEAD}G0 X60. Z2.\n{sub}")[1:] == [(6, 40.0, 2.0), (7, 40.0, -9.0)]
    other = f"{HEAD}G0 X60. Z2.\nG71 P10 Q20 U.5\nM30\nO2\n{CONTOUR}M99\n"
    assert [item.code for item in read(other).errors] == ["E208"]


def test_blocks_of_a_contour_are_read_as_any_others():
    """A dwell is no move, a slash skips, R of a line rounds (r 3 at z -10), words without a point count 0.001."""
    more = "N10 G0 X20.\nG4 X1.\n/X26.\nG1 Z-10. R3. F.1\nX30.\nN20 X40.\n"
    text = f"{HEAD}G0 X60. Z2.\n{more.replace('N10', 'GOTO 30' + chr(10) + 'N10')}N30 G70 P10 Q20\nM30\n"
    program = read(text, block_delete=True)
    assert not program.errors
    ends_ = [(round(m.end[0], 6), round(m.end[2], 6)) for m in program.moves[1:] if m.motion != "dwell"]
    assert ends_ == [(10, 2), (10, -7), (13, -10), (15, -10), (20, -10), (30, 2)]
    least = f"{HEAD}G0 X60. Z2.\nG71 P10 Q20 U.5 W.1\nN10 G0 X20000\nG1 Z-10000 F.1\nN20 X40000\nG70 P10 Q20\nM30\n"
    assert [(r, z) for _, r, z in path(least, control={"increments": "IS-B"})][1:] == [
        (10, 2),
        (10, -10),
        (20, -10),
        (30, 2),
    ]


def test_what_stands_beside_a_cycle_is_not_lost():
    """The feed of a cycle is that of the blocks after it; warnings of its motions are told."""
    text = f"{HEAD}G0 X60. Z2.\nG71 P10 Q20 U.5 F.3\n{CONTOUR}G1 X58.\nM30\n"
    assert read(text).moves[-1].feed_mm_min == pytest.approx(300.0)
    deep = read("O1\nG21 G99\nT0101\nG0 X0 Z5.\nG83 Z-20. R-3. F.1\nG80\nM30\n")
    assert {"W381"} <= {item.code for item in deep.findings}


def test_laps_of_okuma_skip_their_contour_and_finish_it():
    lap = f"{HEAD}G0 X60. Z2.\nG85 N0010 D7 F0.4 U0.4 W0.1\nN0010 G81\nG0 X20.\nG1 Z-10. F.1\nG80\n"
    text = f"{lap}G87 N0010\nM2\n"
    for begin in ("G81", "G82"):
        assert [(r, z) for _, r, z in path(text.replace("G81", begin), "okuma")][1:] == [
            (10, 2),
            (10, -10),
            (30, 2),
        ]
    corner = f"{HEAD}G0 X20. Z0\nG76 G1 X40. L5. F.1\nZ-20.\nM2\n"
    assert [(r, z) for _, r, z in path(corner, "okuma")][1:] == [(15, 0), (20, -5), (20, -20)]


def test_holes_along_z_and_across():
    """R is a distance from the initial level: from z 5 the tool feeds from z 2 on, across from radius 30 it feeds from 27."""
    deep = f"{HEAD}G0 X0 Z5.\nG83 Z-20. R-3. F.1\nG80\nG0 Z50.\nM30\n"
    assert [(r, z) for _, r, z in path(deep)][1:] == [(0, 2), (0, -20), (0, 2), (0, 5), (0, 50)]
    program = read(f"{HEAD}G0 X60. Z-10. C0.\nG87.6 X40. R-3. F.1\nC90.\nG80\nM30\n")
    assert not program.errors
    assert [m.end[0] for m in program.moves if m.feed_mm_min] == [20.0, 20.0]
    assert [m.rotary_deg["c"] for m in program.moves if m.feed_mm_min] == [0.0, 90.0]


def test_a_hole_or_a_cycle_ends_single_passes():
    """After G90 a hole is one, from z 5 to the R level at z 2 along the axis, and U of G71 is a depth."""
    text = f"{HEAD}G0 X40. Z5.\nG90 X38. Z-9. F.2\nG85 X0 Z-20. R-3. F.1\nG80\nM30\n"
    assert [(r, z) for line, r, z in path(text) if line == 6] == [(0, 5), (0, 2), (0, -20), (0, 2), (0, 5)]
    assert len(path(f"{HEAD}G0 X40. Z5.\nG90 X38. Z-9. F.2\nG71 U2. R1.\nM30\n")) == 5


def test_polar_interpolation_turns_c_into_a_length():
    program = read(
        f"{HEAD}G98 G0 X40. Z2. C0\nG112\nG1 X20. C-5. F100\nG2 X10. C-10. I-5. J0\nG1 C0\nG113\nM30\n"
    )
    assert not program.errors
    line, arc = program.moves[-3:-1]
    assert line.end[:2] == (10.0, -5.0) and arc.end[:2] == (5.0, -10.0)
    assert (arc.plane, arc.center) == ("xy", (5.0, -5.0))


WRONG = [  # dialect, block at diameter 40, z 2: what would be read as something else is refused
    ("okuma", "G33 X38. Z-20. F1.5"), ("okuma", "G31 X38. Z-20. F1.5"), ("okuma", "G71 X38. Z-20. H2. F2."),
    ("okuma", "G77 X38. Z-20. F2."), ("okuma", "G20"), ("okuma", "G28"),
    ("okuma", "G83 Z-20. F.1"), ("okuma", "G50 X0 Z0"), ("okuma", "G1 U2. F.1"),
    ("fanuc", "G50 U2. W1."),
    ("fanuc", "G1 A135. F.1"), ("fanuc", "G1 ,A135. F.1"), ("fanuc", "G1 X50. A0 F.1"), ("fanuc", "G1 V2. F.1"),
    ("fanuc", "G88 Z-5. R1. F.1"), ("fanuc", "G83 X0 R-1. F.1"),
    ("fanuc", "G112\nG1 X20. C-5. F.1\nG113"),
]  # fmt: skip


@pytest.mark.parametrize(("dialect", "block"), WRONG)
def test_what_would_be_read_as_something_else_is_refused(dialect, block):
    assert [item.code for item in read(f"{HEAD}G0 X40. Z2. C0\n{block}\nM30\n", dialect).errors] == ["E208"]


def test_words_of_okuma_and_of_system_b_are_modes():
    """G90 and G94 are no passes: from diameter 40, z 2 one line to 36, -5 at 100 mm/min; G94 alone tells system B."""
    text = f"{HEAD}G0 X40. Z2.\nG94\nG90 G1 X36. Z-5. F100\nM2\n"
    for dialect in ("okuma", "fanuc"):
        program = read(text, dialect)
        assert not program.errors and program.moves[-1].end == (18.0, 0.0, -5.0)
        assert program.moves[-1].feed_mm_min == 100.0 and len(program.moves) == 2


def test_lines_by_their_angle():
    """From radius 20, z 2 at 135 degrees from +Z to radius 25: 5 to the left; with or without a comma."""
    for word in ("A", ",A"):
        assert path(f"{HEAD}G0 X40. Z2.\nG1 X50. {word}135. F.1\nM30\n")[-1] == (5, 25.0, -3.0)


def test_steps_of_c_and_the_mode_after_the_way_home():
    """H turns on from C30 by 45 degrees, and on to the next hole; after G0 G28 a block without a code is a rapid."""
    program = read(f"{HEAD}G0 X40. Z2. C30.\nG0 H45.\nG87 X30. R-3. F.1\nH90.\nG80\nM30\n")
    assert not program.errors
    assert [m.rotary_deg["c"] for m in program.moves if m.feed_mm_min] == [75.0, 165.0]
    assert program.moves[1].rotary_deg["c"] == 75.0
    home = read(f"{HEAD}G0 X40. Z2.\nG1 Z-9. F.2\nG0 G28 U0 W0\nX40. Z2.\nM30\n")
    assert not home.errors and [m.motion for m in home.moves if m.line == 7] == ["rapid"]


def test_shifts_of_the_work_zero_are_said():
    """Each may place what is cut after it elsewhere: the path is that of one zero."""
    for dialect, block in (
        ("fanuc", "G10 P0 Z-50."),
        ("fanuc", "G10 L2 P1 Z-50."),
        ("okuma", "VZOFZ=-50"),
        ("okuma", "VZSHZ=50"),
    ):
        program = read(f"{HEAD}G0 X40. Z2.\n{block}\nG1 Z-9. F.2\nM2\n", dialect)
        assert [item.line for item in program.findings if item.code == "W368"] == [5] and not program.errors
        assert program.moves[-1].end == (20.0, 0.0, -9.0)
    wear = read(f"{HEAD}G10 P3 X.1\nG0 X40. Z2.\nM2\n")
    assert not any(item.code == "W368" for item in wear.findings)


def test_a_turret_without_tool_changes_and_no_y_is_a_lathe():
    """Nothing but T0101 tells it: as a mill the diameter would be a radius, and .2 mm a turn .2 mm a minute."""
    program = read("O1\nG21 S1000 M3\nT0101\nG0 X40. Z2.\nG1 Z-9. F.2\nM30\n", "auto")
    assert program.moves[-1].end == (20.0, 0.0, -9.0) and program.moves[-1].feed_mm_min == 200.0
    mill = read("O1\nG21 S1000 M3\nT0101\nG0 X40. Z2.\nG1 Z-9. F.2\nM30\n", control={"lathe": "mill"})
    assert mill.moves[-1].end == (40.0, 0.0, -9.0)
    assert not any(item.code == "W380" for item in mill.findings)


def test_no_job_runs_a_program_for_turning():
    with pytest.raises(NCError, match="a program for turning"):
        refuse_turning(read(f"{HEAD}G0 X40. Z1.\nM30\n"))
    refuse_turning(read("O1\nG21 S1 M3 F9\nG1 X40. Y1.\nM30\n"))
