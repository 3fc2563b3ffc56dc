"""Cutter radius compensation: published corner runs, the distance from the path, an independent offsetting."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vmachining.nc import Motion, Move, Program, ToolEntry, parse_program
from vmachining.nc.offset_curves import offset_line

TOOLS = {1: ToolEntry(1, 6.0, 0.0), 2: ToolEntry(2, 0.75 * 25.4, 0.0)}
INCH = 25.4


def read(text: str, **options: object) -> Program:
    given = {"home": (0.0, 0.0, 0.0), "tools": TOOLS, **options}
    return parse_program(text.encode(), "crc", **given)  # type: ignore[arg-type]


def near(found: list[tuple[float, ...]], wanted: list[tuple[float, ...]]) -> bool:
    """Printed with four decimals."""
    assert [len(item) for item in found] == [len(item) for item in wanted]
    return all(item == pytest.approx(other, abs=1e-4) for item, other in zip(found, wanted, strict=True))


def drawn(program: Program, unit: float = 1.0) -> list[tuple[float, ...]]:
    """Moves of the XY plane: end, and for arcs centre and sense."""
    out = []
    for move in program.moves:
        end = round(move.end_program[0] / unit, 4), round(move.end_program[1] / unit, 4)
        if move.center is None:
            out.append(end)
        else:
            shift = [e - p for e, p in zip(move.end, move.end_program, strict=True)]
            center = [round((c - s) / unit, 4) for c, s in zip(move.center, shift, strict=False)]
            out.append((*end, *center, 1 if move.motion is Motion.ARC_CCW else -1))
    return out


RUNS = [  # tool radius 3, from (-10, -10), entry rule prev; runs of the open reference control
    ("G41", "X0 Y0|Y10|X10|Y0|X0",
     [(-3, 1.2426), (-3, 10), (0, 13, 0, 10, -1), (10, 13), (13, 10, 10, 10, -1), (13, 0), (10, -3, 10, 0, -1), (0, -3)]),
    ("G42", "X0 Y0|Y20|X20|Y0|X0",
     [(2.1213, -2.1213), (3, 0, 0, 0, 1), (3, 17), (17, 17), (17, 3), (0, 3)]),
    ("G42", "X0 Y0|X10|G3 X12 Y2 R2|G1 Y20", [(1.2426, -3), (10, -3), (15, 2, 10, 2, 1), (15, 20)]),
    ("G41", "X0 Y0|X20|G3 X30 Y10 R10|G1 Y30", [(20, 3), (27, 10, 20, 10, 1), (27, 30)]),
    ("G41", "X0 Y0|X20|X40 Y20", [(18.7574, 3), (37.8787, 22.1213)]),
    ("G41", "X0 Y0|X20|X18 Y10|X10", [(16.3406, 3), (15.5406, 7), (10, 7)]),
    ("G42", "X0 Y0|X20|G2 X40 Y0 R10|G1 X50",
     [(1.2426, -3), (20, -3), (23, 0, 20, 0, 1), (37, 0, 30, 0, -1), (40, -3, 40, 0, 1), (50, -3)]),
    ("G41", "X0 Y0|X20|G2 X40 Y0 R10|G1 X50", [(17.3509, 3), (42.6491, 3, 30, 0, -1), (50, 3)]),
]  # fmt: skip


RAPIDS = [  # tool radius 1, left, from the origin; runs of the open reference control
    ("G0 X10 Y0|G0 X20|G0 Y-20", [(10, 1), (20, 1), (21, 0), (21, -20)], "RRRR"),
    ("G1 X10 Y0|G1 X20|G0 Y-20", [(10, 1), (20, 1), (21, 0), (21, -20)], "FFRR"),
    ("G0 X10 Y0|G0 X20|G1 Y-20", [(10, 1), (20, 1), (21, 0, 20, 0, -1), (21, -20)], "RRAF"),
    ("G0 X10 Y0|G0 X20|G0 Z5|G0 Y-20", [(10, 1), (20, 1), (20, 1), (21, 0), (21, -20)], "RRRRR"),
    ("G0 X10 Y0|G3 X20 Y0 I5 J0|G0 Y-20", [(10, 1), (11, 0, 10, 0, -1), (19, 0, 15, 0, 1), (21, 0), (21, -20)], "RAARR"),
]  # fmt: skip


@pytest.mark.parametrize("feed", ["", "F100 "])
@pytest.mark.parametrize(("path", "wanted", "kinds"), RAPIDS)
def test_rapids_pass_outer_corners_straight(path, wanted, kinds, feed):
    if not feed and set(kinds) != {"R"}:
        feed = "F50 "
    program = read(f"G21 G90 {feed}S100 M3\nG41.1 D2\n" + path.replace("|", "\n") + "\nG40\nM2")
    assert not program.findings
    assert near(drawn(program), wanted)
    letters = {Motion.RAPID: "R", Motion.LINEAR: "F", Motion.ARC_CW: "A", Motion.ARC_CCW: "A"}
    assert "".join(letters[move.motion] for move in program.moves) == kinds
    assert all((move.feed_mm_min is None) == (move.motion is Motion.RAPID) for move in program.moves)
    ends = [move.end for move in program.moves]
    assert [move.start for move in program.moves[1:]] == ends[:-1]


@pytest.mark.parametrize(("code", "path", "wanted"), RUNS)
def test_published_corners(code, path, wanted):
    program = read(f"T1 M6 G21 F100\nS1 M3\nG0 X-10 Y-10\n{code} G1 " + path.replace("|", "\n") + "\nM2")
    assert [f.code for f in program.findings] == ["W358"]
    assert near(drawn(program)[-len(wanted) :], wanted)


def test_an_arc_smaller_than_the_tool_is_left_out():
    program = read("T1 M6 F9\nS1 M3\nG41 G1 X10\nG3 X12 Y2 R2\nG1 Y20\nG40 Y30\nM2")
    assert [(f.code, f.line) for f in program.errors] == [("E354", 4)]
    assert not any(move.line == 4 for move in program.moves)


CONTOUR = """G20 G90
M06 T02
G92 X0 Y0 Z+2.000
S1000 F150 M03
G42 G00 X-0.750 Z0
G01 Z-1.000
G01 X3.000
G02 X5.000 R1.000
G01 X6.000
G01 X8.000 Y1.500
"""
REST = [(3, -0.375), (3.375, 0, 3, 0, 1), (4.625, 0, 4, 0, -1), (5, -0.375, 5, 0, 1), (6, -0.375),
        (6.225, -0.3, 6, 0, 1), (8.225, 1.2)]  # fmt: skip


def test_entry_against_the_first_cut_goes_round_and_says_so():
    program = read(CONTOUR, crc_entry="prev")
    assert [(f.code, f.line) for f in program.findings] == [("W353", 7), ("W401", 10)]
    start = [(-0.75, 0.375), (-0.75, 0.375), (-0.75, -0.375, -0.75, 0, 1)]
    assert near(drawn(program, INCH), start + REST)


def test_the_other_entry_goes_straight_to_the_offset_path():
    program = read(CONTOUR, crc_entry="next")
    assert [f.code for f in program.findings] == ["W401"]
    assert near(drawn(program, INCH), [(-0.75, -0.375), (-0.75, -0.375), *REST])


def test_miter_corners():
    program = read(CONTOUR, crc_entry="next", crc_corner="miter")
    assert (6.125, -0.375) in drawn(program, INCH)  # 0.375 / sin(71.565 deg) from the corner


@pytest.mark.parametrize("entry", ["prev", "next"])
def test_a_tangent_lead_in_and_out_does_not_depend_on_the_entry_rule(entry):
    program = read(
        "T1 M6 F9\nS1 M3\nG0 X-8 Y20\nG41 G1 Y8\nG3 X0 Y0 I8\nG1 X20\nG3 X28 Y8 J8\nG40 G1 Y20\nM2",
        crc_entry=entry,
    )
    path = [(-5, 8), (0, 3, 0, 8, 1), (20, 3), (25, 8, 20, 8, 1), (28, 20)]
    assert near(drawn(program)[-5:], path) and not program.errors


def test_sixteen_cases_of_a_corner():
    """G41 point P + rho / sin(psi) u(bisector), G42 the opposite, for left turns in all quadrants."""
    for axis in (180.0, 90.0, 0.0, 270.0):
        for theta, beta in ((20.0, 50.0), (70.0, 10.0)):
            back, out = math.radians(axis + theta), math.radians(axis - beta)
            psi, bisector = math.radians((theta + beta) / 2), math.radians(axis + (theta - beta) / 2)
            inside = 1 if math.sin(back - out) > 0 else -1  # the tool that is inside the wedge
            text = f"G41.1 D{2 * inside} F9 G1 X{9 * math.cos(back)} Y{9 * math.sin(back)}"
            a = f"X{30 * math.cos(back):.9f} Y{30 * math.sin(back):.9f}"
            b = f"X{60 * math.cos(back):.9f} Y{60 * math.sin(back):.9f}"
            c = f"X{30 * math.cos(out):.9f} Y{30 * math.sin(out):.9f}"
            text = f"S1 M3\nG0 {b}\nG4{1 if inside > 0 else 2}.1 D2 F9\nG1 {a}\nX0 Y0\n{c}\nM2"
            moves = [m for m in read(text).moves if m.line == 5]
            want = math.cos(bisector) / math.sin(psi), math.sin(bisector) / math.sin(psi)
            if math.cos(math.radians(theta + beta)) < 1.0 and moves:
                assert moves[-1].end[:2] == pytest.approx(want, abs=1e-6)


def test_depth_dwell_and_rapids_wait_at_the_corner():
    program = read("T1 M6 F9\nS1 M3\nG41 G1 X20\nZ5\nG4 P1\nY20\nG40 Y40\nM2")
    assert not program.errors
    assert [m.end for m in program.moves[:3]] == [(17, 3, 0), (17, 3, 5), (17, 3, 5)]


def test_other_planes_and_turned_offsets():
    zx = read("G18 F9 S1 M3\nG41.1 D25.4 G1 X20\nZ30\nX0\nG40 Z-20\nM2")
    ends = [m.end for m in zx.moves]  # as the reference control has it
    assert ends == [
        pytest.approx(p)
        for p in [(20, 0, -12.7), (32.7, 0, 0), (32.7, 0, 30), (20, 0, 42.7), (0, 0, 42.7), (0, 0, -20)]
    ]
    body = "G41.1 D6 F9 G1 X20\nY20\nG3 X0 Y40 I-20\nG1 X-20\nG40 Y90\nM2"
    straight, turned = read("S1 M3\n" + body), read("S1 M3\nG10 L2 P1 R30\n" + body)
    c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
    for a, b in zip(straight.moves, turned.moves, strict=True):
        assert b.end == pytest.approx((c * a.end[0] - s * a.end[1], s * a.end[0] + c * a.end[1], a.end[2]))
        assert b.end_program == pytest.approx(a.end_program)


def chain(draw: st.DrawFn, arcs: bool) -> tuple[list[str], list[tuple[float, float]]]:
    lines, points, heading = list[str](), [(0.0, 0.0)], 0.0
    for k in range(draw(st.integers(2, 6))):
        heading += math.radians(draw(st.integers(-160, 160))) if k else 0.0
        x, y = points[-1]
        if k and arcs and draw(st.booleans()):
            radius, sweep = draw(st.integers(2, 15)), math.radians(draw(st.integers(20, 200)))
            turn = draw(st.sampled_from([1, -1]))
            cx, cy = x - turn * radius * math.sin(heading), y + turn * radius * math.cos(heading)
            heading += turn * sweep
            points.append((cx + turn * radius * math.sin(heading), cy - turn * radius * math.cos(heading)))
            word = f"G{3 if turn > 0 else 2} X{points[-1][0]:.9f} Y{points[-1][1]:.9f}"
            lines.append(f"{word} I{cx - x:.9f} J{cy - y:.9f}")
        else:
            length = draw(st.integers(5, 40))
            points.append((x + length * math.cos(heading), y + length * math.sin(heading)))
            lines.append(f"G1 X{points[-1][0]:.9f} Y{points[-1][1]:.9f}")
    return lines, points


def sampled(program: Program) -> list[tuple[int, list[tuple[float, float]]]]:
    from vmachining.nc.rewrite_pieces import move_path

    return [
        (m.line, [tuple(path.position(t)[:2]) for t in (0.0, 0.13, 0.37, 0.5, 0.71, 0.9, 1.0)])
        for m in program.moves
        if (path := move_path(m)) is not None
    ]


@given(data=st.data(), side=st.sampled_from([41, 42]), entry=st.sampled_from(["prev", "next"]))
@settings(max_examples=150, deadline=None)
def test_the_tool_keeps_its_distance_from_neighbouring_segments(data, side, entry):
    lines, _ = chain(data.draw, arcs=data.draw(st.booleans()))
    head = "S1 M3 F9\nG0 X-30 Y0\n"
    plain = read(head + "G1 X0\n" + "\n".join(lines))
    program = read(
        f"{head}G{side}.1 D4 G1 X0\n" + "\n".join(lines) + "\nM2", crc_entry=entry, crc_corner="exact"
    )
    if program.errors:
        return
    over = {f.line - 1 for f in program.findings if f.code == "W355"}
    assert not over or any("G2" in line or "G3" in line for line in lines)
    for before, after in pairwise(program.moves):
        assert math.dist(before.end, after.start) < 1e-6
    shapes = {move.line: move for move in plain.moves[1:]}
    first = min(shapes)
    for line, points in sampled(program)[1:]:
        if line <= first or over & {line - 1, line, line + 1}:
            continue  # the entry move comes from outside; W355 says that the tool is too near
        for known in (line - 1, line):
            for point in points:
                if known in shapes and known > first:
                    assert distance(shapes[known], point) >= 2.0 - 0.05


def distance(move: Move, point: tuple[float, float]) -> float:
    """From a point to a line or an arc, in closed form."""
    a, b = move.start[:2], move.end[:2]
    if move.center is None:
        length = math.dist(a, b)
        t = ((point[0] - a[0]) * (b[0] - a[0]) + (point[1] - a[1]) * (b[1] - a[1])) / length**2
        t = min(1.0, max(0.0, t))
        return math.dist(point, (a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])))
    c = move.center
    angles = [math.atan2(p[1] - c[1], p[0] - c[0]) for p in (a, b, point)]
    sense = 1 if move.motion is Motion.ARC_CCW else -1
    sweep, here = ((sense * (angle - angles[0])) % math.tau for angle in angles[1:])
    if here <= sweep:
        return abs(math.dist(point, c) - math.dist(a, c))
    return min(math.dist(point, a), math.dist(point, b))


@given(data=st.data(), side=st.sampled_from([1, -1]))
@settings(max_examples=60, deadline=None)
def test_closed_contours_against_an_independent_offset(data, side):
    """A star-shaped polygon, offset outwards or inwards: the same area as shapely finds with round corners."""
    polygon_of = pytest.importorskip("shapely.geometry").Polygon
    count = data.draw(st.integers(3, 7))
    radii = [data.draw(st.integers(30, 50)) for _ in range(count)]
    corners = [
        (r * math.cos(math.tau * k / count), r * math.sin(math.tau * k / count)) for k, r in enumerate(radii)
    ]
    polygon = polygon_of(corners)
    middle = ((corners[0][0] + corners[-1][0]) / 2, (corners[0][1] + corners[-1][1]) / 2)
    loop = [*corners, middle]
    text = "\n".join(f"X{x:.9f} Y{y:.9f}" for x, y in loop)
    t = math.atan2(corners[0][1] - middle[1], corners[0][0] - middle[0])
    away = f"X{middle[0] - 20 * math.cos(t):.9f} Y{middle[1] - 20 * math.sin(t):.9f}"
    start = f"G0 {away}\nG4{1 if side > 0 else 2}.1 D4\nG1 X{middle[0]:.9f} Y{middle[1]:.9f}\n"
    program = read("S1 M3 F9\n" + start + text + "\nM2", crc_entry="next")
    if program.errors:
        return
    from vmachining.nc.rewrite_pieces import move_path

    points = []
    for move in program.moves[2:]:
        path = move_path(move)
        assert path is not None
        points += [path.position(k / 64)[:2] for k in range(64)] if move.center else [move.start[:2]]
    wanted = polygon.buffer(-2.0 * side, quad_segs=256, join_style="round")
    if wanted.geom_type != "Polygon":
        return
    # chords of a 64th of at most half a circle of radius 2, and of shapely's
    assert polygon_of(points).area == pytest.approx(wanted.area, abs=0.02)


def test_a_line_is_shifted_to_the_left():
    curve = offset_line((0, 0), (10, 0), 3.0)
    assert (curve.start, curve.end) == ((0, 3), (10, 3))


def test_rotary_axes_turn_once_at_a_corner():
    text = "S1 M3\nG41.1 D6\nG1 X20 F100\nG93 X40 A10 F1\nY-40 A30 F2\nG40\nG94 X0 F100\nM30"
    moves = read(text, rotary="A").moves
    assert [m.motion for m in moves[1:4]] == [Motion.LINEAR, Motion.ARC_CW, Motion.LINEAR]
    for before, after in pairwise(moves[1:]):
        assert after.rotary_start == before.rotary_deg
    assert [m.rotary_deg for m in moves[1:]] == [{"a": 10}, {"a": 30}, {"a": 30}, {"a": 30}]
    # the block lasts as long as its path at the programmed feed, 2 * 40 mm/min
    assert [m.duration_s for m in moves[1:]] == [60, None, None, None]
    assert moves[2].feed_mm_min == moves[3].feed_mm_min == pytest.approx(80)


def test_a_dwell_beside_the_path_is_seen_from_turned_coordinates():
    text = "G10 L2 P1 R90\nS1 M3\nG41.1 D6\nG1 X20 F100\nX40\nG40\nG4 P1\nX60 Y0\nM30"
    moves = read(text).moves
    assert moves[-2].motion is Motion.DWELL
    assert moves[-2].end_program == pytest.approx((40, 3, 0))  # left of the path along X of the program
    assert moves[-2].end == pytest.approx((-3, 40, 0))


def test_turning_behind_compensation_goes_at_the_feed_of_its_path():
    text = "S1 M3\nG41.1 D6\nG1 X20 F100\nX40\nG40\nG1 A10\nA20\nM30"
    leave, turn = read(text, rotary="A").moves[-2:]
    assert math.dist(leave.start, leave.end) == pytest.approx(3) and leave.duration_s is None
    assert math.dist(turn.start, turn.end) == 0 and turn.duration_s == pytest.approx(6)  # 10 deg, 100 deg/min
