"""Cycles that mill a shape by themselves: what is left, worked out by hand and by another kind of geometry.

Rules: SINUMERIK 840D sl/828D, Programming Manual Cycles, "Milling cycles"; HEIDENHAIN TNC 640, user's manual cycle
programming, "Pocket milling / stud milling / slot milling" (public). The area that passes cover is the union of the tool's
circles along them (shapely), against the closed form of the shape.
"""

from __future__ import annotations

import math

import pytest
from shapely.geometry import LineString, Point, Polygon, box
from shapely.ops import unary_union

from vmachining.nc import Motion, Program, ToolEntry, parse_program

FINE = 0.02


def sinumerik(body: str, tool: float = 10.0, **more) -> Program:
    text = f"G17 G90 G710 G40\nT1 M6\nS1000 M3 F200\nG0 X0 Y0 Z50\n{body}\nM30\n"
    options = {"tools": {1: ToolEntry(1, tool, 0.0)}, **more}
    return parse_program(text.encode(), "t.mpf", dialect="sinumerik", home=(0.0, 0.0, 100.0), **options)


def points(move) -> list[tuple[float, float]]:
    """A move seen from above."""
    if move.center is None:
        return [move.start[:2], move.end[:2]]
    (x, y), (a, b) = move.center, (move.start[0] - move.center[0], move.start[1] - move.center[1])
    radius, first = math.hypot(a, b), math.atan2(b, a)
    sweep = (math.atan2(move.end[1] - y, move.end[0] - x) - first) % math.tau or math.tau
    if move.motion is Motion.ARC_CW:
        sweep = sweep - math.tau or -math.tau
    count = max(2, math.ceil(abs(sweep) * radius / FINE / 5))
    return [(x + radius * math.cos(first + sweep * k / count), y + radius * math.sin(first + sweep * k / count))
            for k in range(count + 1)]  # fmt: skip


def covered(program: Program, level: float, radius: float = 5.0):
    """Area that the tool covers at one level."""
    cuts = [m for m in program.moves if m.motion is not Motion.RAPID and abs(m.end[2] - level) < 1e-9]
    return unary_union([LineString(points(m)).buffer(radius, quad_segs=90) for m in cuts])


def rounded(along: float, across: float, corner: float, turn: float = 0.0, at=(0.0, 0.0)):
    """The shape itself."""
    inner = box(-along / 2 + corner, -across / 2 + corner, along / 2 - corner, across / 2 - corner)
    shape = inner.buffer(corner, quad_segs=90) if corner else inner
    from shapely import affinity

    return affinity.translate(affinity.rotate(shape, turn, origin=(0, 0)), *at)


def says(program: Program) -> list[str]:
    return [f.code for f in program.findings if f.severity != "I"]


# ---- Sinumerik ----


def test_a_circular_pocket_of_one_pass_by_hand():
    """POCKET4: radius 8, tool of radius 5: the pass has radius 3. Two cuts of 2.5 for 5 deep with at most 3."""
    program = sinumerik("POCKET4(10,0,2,-5,8,20,30,3,0,0,300,100,0,1)")
    assert says(program) == ["W384"]
    rows = [(m.motion.value, *(round(v, 6) for v in m.end), m.feed_mm_min) for m in program.moves[2:]]
    level = lambda z: [  # noqa: E731
        ("linear", 20, 30, z, 100), ("linear", 23, 30, z, 300), ("arc_ccw", 23, 30, z, 300),
    ]  # fmt: skip
    assert program.moves[0].end == (0, 0, 50)
    assert rows == [
        ("rapid", 20, 30, 2, None), *level(-2.5), ("rapid", 23, 30, -0.5, None),
        ("rapid", 20, 30, -0.5, None), *level(-5), ("rapid", 23, 30, -3, None),
        ("rapid", 23, 30, 2, None), ("rapid", 20, 30, 2, None), ("rapid", 20, 30, 10, None),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("call", "shape", "allowance"),
    [
        ("POCKET3(10,0,2,-5,60,40,8,10,20,30,5,0,0,300,100,0,11,5)", rounded(60, 40, 8, 30, (10, 20)), 0.0),
        ("POCKET3(10,0,2,-5,60,40,8,0,0,0,5,0.5,0,300,100,0,21,8)", rounded(60, 40, 8), 0.5),
        ("POCKET3(10,0,2,-5,30,10,5,0,0,90,5,0,0,300,100,0,31,5)", rounded(30, 10, 5, 90), 0.0),
        ("POCKET4(10,0,2,-5,25,5,6,5,0,0,300,100,0,21,5)", rounded(50, 50, 25, 0, (5, 6)), 0.0),
        ("POCKET1(10,0,2,-5,,60,40,8,0,0,0,100,300,5,2,0,1)", rounded(60, 40, 8), 0.0),
        ("POCKET2(10,0,2,,5,25,0,0,100,300,5,2,0.4,1)", rounded(50, 50, 25), 0.4),
    ],
)
def test_roughing_covers_the_pocket_and_no_more(call: str, shape, allowance: float):
    program = sinumerik(call)
    assert says(program) == ["W384"]
    ideal = shape.buffer(-allowance, quad_segs=90)
    assert covered(program, -5.0).symmetric_difference(ideal).area < 2e-3 * ideal.area
    assert min(m.end[2] for m in program.moves) == -5.0
    assert program.moves[-1].end[2] == 10.0


def test_a_corner_sharper_than_the_tool_is_left_with_its_radius():
    program = sinumerik("POCKET3(10,0,2,-5,60,40,0,0,0,0,5,0,0,300,100,0,1,8)")
    assert covered(program, -5.0).symmetric_difference(rounded(60, 40, 5)).area < 5.0
    told = sinumerik("POCKET3(10,0,2,-5,60,40,3,0,0,0,5,0,0,300,100,0,1,8)")
    assert [
        f.message for f in told.findings if "corners of 3 mm keep the radius of the tool, 5 mm" in f.message
    ]
    assert not [f for f in program.findings if "corners of" in f.message]


def test_a_tool_that_does_not_fit_and_a_tool_that_is_not_known():
    assert says(sinumerik("POCKET4(10,0,2,-5,4,0,0,3,0,0,300,100,0,1)")) == ["E354", "W384"]
    program = sinumerik("POCKET4(10,0,2,-5,8,20,30,3,0,0,300,100,0,1)", tools=None)
    assert says(program) == ["W379"]
    assert min(m.end[2] for m in program.moves) == 2.0
    assert program.moves[-1].end == (20, 30, 10)


def test_finishing_goes_along_the_wall_by_quarter_circles():
    program = sinumerik("POCKET4(10,0,2,-5,20,0,0,3,0.5,0.2,300,100,0,2)")
    wall = [
        m for m in program.moves if m.motion is Motion.ARC_CCW and m.center == (0, 0) and m.end == (15, 0, -5)
    ]
    assert len(wall) == 1  # the floor keeps off the wall by its allowance
    on = program.moves[program.moves.index(wall[-1]) - 1]
    assert on.center == pytest.approx((10, 0)) and on.start == pytest.approx((10, -5, -5))


@pytest.mark.parametrize(
    ("cdir", "m", "word"),
    [(0, 3, "arc_ccw"), (1, 3, "arc_cw"), (2, 3, "arc_cw"), (3, 4, "arc_ccw"), (0, 4, "arc_cw")],
)
def test_the_sense_of_a_pocket(cdir: int, m: int, word: str):
    """CDIR 0 is climb: the tool has the wall on its right with M3; 2 and 3 are G2 and G3."""
    program = sinumerik(f"M{m}\nPOCKET4(10,0,2,-5,8,0,0,5,0,0,300,100,{cdir},1)")
    assert [x.motion.value for x in program.moves if x.center is not None] == [word]


def test_newer_controls_say_depth_and_step_by_digits_and_give_the_diameter():
    """AMODE 111: depth below the plane, step in percent of the tool; the fifth value is the diameter."""
    old = sinumerik("POCKET4(10,0,2,-5,20,0,0,5,0,0,300,100,0,1,5)")
    new = sinumerik("POCKET4(10,0,2,5,40,0,0,5,0,0,300,100,0,1,50,0,0,0,0,0,0,0,0,111,111)")
    assert [m.end for m in new.moves] == [m.end for m in old.moves]
    assert says(new) == ["W384", "W384"]


@pytest.mark.parametrize(
    ("call", "finished", "blank"),
    [
        (
            "CYCLE77(10,0,2,-5,,40,10,20,5,0,0,300,100,0,1,70)",
            rounded(40, 40, 20, 0, (10, 20)),
            rounded(70, 70, 35, 0, (10, 20)),
        ),
        ("CYCLE76(10,0,2,-5,,40,30,5,0,0,0,5,0,0,300,100,0,1,60,50)", rounded(40, 30, 5), rounded(60, 50, 5)),
    ],
)
def test_a_stud_is_left_and_its_blank_is_gone(call: str, finished, blank):
    program = sinumerik(call)
    area = covered(program, -5.0)
    assert area.intersection(finished).area < 1e-3 * finished.area
    assert blank.difference(finished).difference(area).area < 1e-3 * blank.area
    senses = {m.motion for m in program.moves if m.center is not None}
    assert senses == {Motion.ARC_CW}  # climb about a stud


@pytest.mark.parametrize(
    ("tool", "finished", "blank", "side", "step"),
    [(4, 20, 24, 3, 0.3), (16, 55, 55, 0.3, 0.3), (4, 30, 40, 0, 1.9), (10, 30, 32, 0, 1)],
)
def test_passes_about_a_stud_reach_its_blank_and_never_into_it(tool, finished, blank, side, step):
    """Steps that are smaller or larger than the tool needs: all of the blank goes, and nothing within the allowance."""
    cycle = f"257 Z Q215=1 Q223={finished} Q222={blank} Q368={side} Q376=0 Q370={step}"
    area = covered(heidenhain(f"CYCL DEF {cycle} {COMMON}", tool), -5.0, tool / 2)
    left = Point(10, 20).buffer(finished / 2 + side, quad_segs=180)
    assert area.intersection(left.buffer(-FINE)).area < 1e-9
    assert Point(10, 20).buffer(blank / 2).difference(left.buffer(FINE)).difference(area).area < 1e-9


@pytest.mark.parametrize(
    "call",
    [
        "POCKET1(10,0,2,-5,3,60,40,8,0,0,0,100,300,5,2,0,1)",
        "CYCLE81(10,0,2,-5,3)",
        "POCKET4(10,0,2,5,8,5,0,5,0,0,300,100,3,1)",
        "POCKET4(-10,0,2,-5,8,5,0,5,0,0,300,100,3,1)",
    ],
)
def test_two_depths_and_a_return_plane_on_the_wrong_side(call: str):
    """DPR is the distance from RFP to DP; RTP lies on the side that the tool comes from."""
    program = sinumerik(call)
    assert says(program) == ["E333"] and len(program.moves) == 1
    assert says(sinumerik("CYCLE81(10,1,2,-5,6)")) == []


def test_the_floor_about_a_stud_is_finished():
    """257 with Q215=0: all of the ring ends at the depth, Q369 is taken after roughing."""
    cycle = f"257 Z Q215=0 Q223=40 Q222=70 Q368=0.5 Q376=0 Q370=1 {COMMON.replace('Q369=0', 'Q369=0.2')}"
    program = heidenhain(f"CYCL DEF {cycle}")
    ring = Point(10, 20).buffer(35).difference(Point(10, 20).buffer(20 + FINE, quad_segs=90))
    assert ring.difference(covered(program, -5.0)).area < 1e-9 < covered(program, -4.8).area


@pytest.mark.parametrize(
    "call",
    [
        "POCKET3(10,0,2,-5,60,40,8,10,20,30,5,-1,0,300,100,0,1)",
        "POCKET3(10,0,2,-5,60,40,8,10,20,30,-5,0,0,300,100,0,1)",
        "POCKET3(10,0,2,-5,60,40,8,10,20,30,5,0,7,300,100,0,1)",
        "CYCLE71(10,0,2,-2,5,6,60,40,0,2,8,3,5,300,11)",
        "SLOT2(10,0,2,-4,,1,0,12,0,0,30,0,180,100,300,4,3,0,1)",
        "SLOT2(10,0,2,-4,,1,400,12,0,0,30,0,180,100,300,4,3,0,1)",
    ],
)
def test_allowances_cuts_and_arcs_that_no_control_takes(call: str):
    program = sinumerik(call)
    assert "E339" in says(program) and min(m.end[2] for m in program.moves) >= 0.0


def test_a_pocket_by_its_corner_in_another_plane_or_with_an_unknown_depth_is_refused():
    """The fourth digit of GMODE: 1 its centre, 2 to 5 a corner; the first of DMODE: 1 G17; the first of AMODE: 1 below RFP."""
    call = "POCKET3(10,0,2,5,60,40,8,10,20,30,5,0,0,300,100,0,1,50,0,0,0,0,0,0,0,0,{},{},{})"
    assert says(sinumerik(call.format(11100, 11, 111))) == ["W384"]
    for digits in ((12100, 11, 111), (11100, 12, 111), (11100, 11, 112)):
        assert says(sinumerik(call.format(*digits))) == ["E208"]


def test_slots_along_an_arc():
    """SLOT2: two slots of 12 on a circle of 30, from 0 and 180 degrees, 60 degrees long between the centres of their ends."""
    program = sinumerik("SLOT2(10,0,2,-4,,2,60,12,0,0,30,0,180,100,300,4,3,0,1)")
    line = LineString([(30 * math.cos(math.radians(a)), 30 * math.sin(math.radians(a))) for a in range(61)])
    slot = line.buffer(6, quad_segs=90)
    both = slot.union(Polygon([(-x, -y) for x, y in slot.exterior.coords]))
    assert covered(program, -4.0).symmetric_difference(both).area < 0.01 * both.area
    assert {m.motion for m in program.moves if m.center == (0, 0) and math.hypot(*m.end[:2]) > 30.5} == {
        Motion.ARC_CCW
    }


@pytest.mark.parametrize(
    ("call", "fro"),
    [
        ("CYCLE71(10,0,2,-2,5,6,60,40,0,2,8,3,0,300,11)", False),
        ("CYCLE71(10,0,2,-2,5,6,60,40,0,2,8,3,0,300,31)", True),
        ("CYCLE71(10,0,2,-2,5,6,60,40,0,2,8,3,0,300,41)", True),
    ],
)
def test_a_face_is_covered(call: str, fro: bool):
    program = sinumerik(call)
    area = covered(program, -2.0)
    face = Polygon([(5, 6), (65, 6), (65, 46), (5, 46)])
    assert face.difference(area).area < 1e-9
    cuts = [m for m in program.moves if m.motion is Motion.LINEAR and m.end[2] == -2.0 and m.start[2] == -2.0]
    long = [m for m in cuts if math.dist(m.start, m.end) > 30]
    assert len(long) == (8 if "41" in call[-3:] else 5)
    ways = {math.copysign(1, (m.end[0] - m.start[0]) or (m.end[1] - m.start[1])) for m in long}
    assert ways == ({1, -1} if fro else {1})


def test_a_face_by_its_second_corner():
    """CYCLE61: the fourth and fifth digit of AMODE say that the second corner is a place; without AMODE that is open."""
    assert says(sinumerik("CYCLE61(10,0,2,-1,0,0,60,40,2,80,0,300,31,0,1,10)")) == ["W384"]
    assert says(sinumerik("CYCLE61(10,0,2,-1,5,0,60,40,2,80,0,300,31,0)")) == ["E208"]
    place = sinumerik("CYCLE61(10,0,2,-1,-24,2,20,35,2,80,0,300,31,0,1,11010)")
    length = sinumerik("CYCLE61(10,0,2,-1,-24,2,44,33,2,80,0,300,31,0,1,10)")
    assert says(place) == ["W384", "W384"] and [m.end for m in place.moves] == [m.end for m in length.moves]


@pytest.mark.parametrize(
    "call",
    [
        "POCKET4(10,0,2,-500,800,0,0,.1,0,0,300,100,0,1,.1)",
        "POCKET4(10,0,2,-1e6,8,0,0,.1,0,0,300,100,0,1)",
        "CYCLE71(10,0,2,-20,5,6,6000,4000,0,.1,.1,3,0,300,11)",
    ],
)
def test_a_slip_of_the_pen_ends_at_a_number_of_passes(call: str):
    assert "E339" in says(sinumerik(call.replace("1e6", "1000000")))


def test_a_pocket_at_every_position_is_refused():
    program = sinumerik("MCALL POCKET4(10,0,2,-5,8,0,0,5,0,0,300,100,0,1)\nX1\nX2\nMCALL\nG0 X3")
    assert says(program) == ["E208"]
    assert program.moves[-1].end[0] == 3


def test_covered_knows_a_disc():
    """The judge: a full circle of radius 3 with a tool of 5 covers a disc of 8 about its centre."""
    program = sinumerik("G0 X3 Y0\nG1 Z-1 F9\nG3 X3 Y0 I-3 J0")
    assert covered(program, -1.0).symmetric_difference(Point(0, 0).buffer(8, quad_segs=90)).area < 0.2


# ---- Heidenhain ----


def heidenhain(body: str, tool: float = 10.0, **more) -> Program:
    text = f"BEGIN PGM T MM\nTOOL CALL 1 Z S1000 F200\nM3\nL X+10 Y+20 Z+50 R0 FMAX\n{body}\nCYCL CALL\nEND PGM T MM\n"
    options = {"tools": {1: ToolEntry(1, tool, 0.0)}, **more}
    return parse_program(text.encode(), "t.h", dialect="heidenhain", home=(0.0, 0.0, 100.0), **options)


COMMON = "Q207=300 Q351=+1 Q201=-5 Q202=5 Q369=0 Q206=100 Q338=0 Q200=2 Q203=+0 Q204=20"


@pytest.mark.parametrize(
    ("cycle", "shape"),
    [
        (
            "251 R Q215=1 Q218=60 Q219=40 Q220=8 Q368=0 Q224=0 Q367=0 Q370=1 Q366=1",
            rounded(60, 40, 8, 0, (10, 20)),
        ),
        # the tool stands at the lower left corner, and the pocket turns about it
        (
            "251 R Q215=1 Q218=60 Q219=40 Q220=8 Q368=0 Q224=90 Q367=1 Q370=1 Q366=0",
            rounded(60, 40, 8, 90, (-10, 50)),
        ),
        (
            "251 R Q215=1 Q218=60 Q219=40 Q220=8 Q368=0 Q224=0 Q367=3 Q370=1 Q366=0",
            rounded(60, 40, 8, 0, (-20, 0)),
        ),
        ("252 K Q215=1 Q223=50 Q368=0 Q370=1.4 Q366=1", rounded(50, 50, 25, 0, (10, 20))),
        ("253 N Q215=1 Q218=60 Q219=14 Q368=0 Q374=0 Q367=1 Q366=2", rounded(60, 14, 7, 0, (40, 20))),
        ("253 N Q215=1 Q218=60 Q219=14 Q368=0 Q374=90 Q367=2 Q366=0", rounded(60, 14, 7, 90, (10, 43))),
    ],
)
def test_pockets_and_slots_of_tnc_controls(cycle: str, shape):
    program = heidenhain(f"CYCL DEF {cycle} {COMMON}")
    assert says(program) == ["W384"]
    assert covered(program, -5.0).symmetric_difference(shape).area < 3e-3 * shape.area
    assert program.moves[-1].end[2] == 20.0


def test_a_whole_pocket_leaves_its_allowance_and_takes_it():
    """251 with Q215=0: roughing stays 0.5 off wall and floor, finishing takes both."""
    program = heidenhain(f"CYCL DEF 251 R Q215=0 Q218=60 Q219=40 Q220=8 Q368=0.5 Q224=0 Q367=0 Q370=1 Q366=0 Q385=250 "
                         f"{COMMON.replace('Q369=0', 'Q369=0.2')}")  # fmt: skip
    ideal = rounded(60, 40, 8, 0, (10, 20))
    rough = ideal.buffer(-0.5, quad_segs=90)
    assert covered(program, -4.8).symmetric_difference(rough).area < 2e-3 * rough.area
    assert covered(program, -5.0).symmetric_difference(ideal).area < 2e-3 * ideal.area
    assert {m.feed_mm_min for m in program.moves if m.feed_mm_min} == {100.0, 300.0, 250.0}


def test_studs_of_tnc_controls():
    program = heidenhain(f"CYCL DEF 257 Z Q223=40 Q222=70 Q368=0 Q376=0 Q370=1 {COMMON}")
    area = covered(program, -5.0)
    ring = rounded(70, 70, 35, 0, (10, 20)).difference(rounded(40, 40, 20, 0, (10, 20)))
    assert ring.difference(area).area < 1e-3 * ring.area
    assert area.intersection(rounded(40, 40, 20, 0, (10, 20))).area < 1.5
    program = heidenhain(
        f"CYCL DEF 256 Z Q218=40 Q424=60 Q219=30 Q425=50 Q220=5 Q368=0 Q224=0 Q367=0 Q370=1 {COMMON}"
    )
    ring = rounded(60, 50, 0, 0, (10, 20)).difference(rounded(40, 30, 5, 0, (10, 20)))
    assert ring.difference(covered(program, -5.0)).area < 1e-3 * ring.area


def test_arcs_of_cycle_254():
    cycle = (
        "254 B Q215=1 Q219=12 Q368=0 Q375=60 Q367=0 Q216=+10 Q217=+20 Q376=0 Q248=60 Q378=180 Q377=2 Q366=0"
    )
    program = heidenhain(f"CYCL DEF {cycle} {COMMON}")
    line = LineString(
        [(10 + 30 * math.cos(math.radians(a)), 20 + 30 * math.sin(math.radians(a))) for a in range(61)]
    )
    slot = line.buffer(6, quad_segs=90)
    both = slot.union(Polygon([(20 - x, 40 - y) for x, y in slot.exterior.coords]))
    assert covered(program, -5.0).symmetric_difference(both).area < 0.01 * both.area


@pytest.mark.parametrize("way", [0, 1, 2])
def test_a_face_of_cycle_232(way: int):
    """From X10 Y5 over 60 by 40, 2 mm in cuts of 1 with 0.2 left for the last; Q357 lies beside both ends but for Q389=1."""
    cycle = (f"232 F Q389={way} Q225=10 Q226=5 Q227=2 Q386=0 Q218=60 Q219=40 Q202=1 Q369=0.2 Q370=1 Q207=300 Q385=250 Q253=750 "
             "Q200=2 Q357=3 Q204=20")  # fmt: skip
    program = heidenhain(f"CYCL DEF {cycle}")
    assert says(program) == ["W384"]
    cuts = [m for m in program.moves if m.motion is Motion.LINEAR and m.start[2] == m.end[2] == 0.0]
    reach = 0 if way == 1 else 8
    low, high = (15, 65) if way == 1 else (10 - reach, 70 + reach)
    ends = [x for m in cuts for x in (m.start[0], m.end[0])]
    assert (min(ends), max(ends)) == (low, high)
    rest = Polygon([(10, 5), (70, 5), (70, 45), (10, 45)]).difference(covered(program, 0.0))
    assert rest.area < (
        22 if way == 1 else 1e-6
    )  # under Q389=1 the corners keep the radius of the tool: 4 (1 - pi/4) 25
    assert sorted({round(m.end[2], 6) for m in program.moves if m.feed_mm_min}) == [0.0, 0.2, 1.1]


def test_a_pocket_at_every_point_of_a_pattern():
    body = (f"CYCL DEF 252 K Q215=1 Q223=16 Q368=0 Q370=1 Q366=0 {COMMON}\n"
            "CYCL DEF 221 P Q225=0 Q226=0 Q237=40 Q238=0 Q242=2 Q243=1 Q224=0 Q200=2 Q203=0 Q204=20 Q301=1")  # fmt: skip
    program = heidenhain(body)
    assert {m.center for m in program.moves if m.center} == {(0, 0), (40, 0)} | {
        m.center for m in program.moves[-6:] if m.center
    }
