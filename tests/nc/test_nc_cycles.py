"""Canned cycles, subprograms, loops, restart: programs whose motions are known."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vmachining.nc import Motion, Move, Program, parse_program

HEAD = "G21 G90 S100 M3 F100\n"
R, F, D = Motion.RAPID, Motion.LINEAR, Motion.DWELL


def read(text: str, **options: object) -> Program:
    program = parse_program(text.encode(), "p", **{"home": (0.0, 0.0, 0.0), **options})  # type: ignore[arg-type]
    assert not [f for f in program.errors if f.code != "W401"], program.errors
    return program


def told(moves: tuple[Move, ...]) -> list[tuple[Motion, tuple[float, ...]]]:
    return [(m.motion, tuple(round(v, 6) for v in m.end)) for m in moves]


def test_deep_hole_in_steps():
    """As run by the open reference control."""
    moves = read(HEAD + "G98 G0 X0 Y0 Z20\nG83 X10 Y5 R2 Z-10 Q4").moves[1:]
    z = [(R, 20), (R, 2), (F, -2), (R, 2), (R, -1.746), (F, -6), (R, 2), (R, -5.746), (F, -10), (R, 20)]
    assert told(moves) == [(kind, (10, 5, level)) for kind, level in z]


@pytest.mark.parametrize("code", ["G73", "G83"])
@given(steps=st.integers(1, 40), step=st.integers(1, 99), level=st.integers(-300, 300), inch=st.booleans())
def test_a_depth_of_whole_steps_has_no_peck_without_depth(code, steps, step, level, inch):
    """Programs print tenths here: how many pecks there are is integer arithmetic."""
    tenths = f"R{level / 10} Z{(level - steps * step) / 10:.1f} Q{step / 10}"
    moves = read(f"G2{1 - inch} G90 G98 F100 S500 M3 G0 Z{level / 10 + 5:.1f}\n{code} X1 Y1 {tenths}").moves
    feeds = [move for move in moves if move.motion is F]
    unit = 2.54 if inch else 0.1
    wanted = [(level - k * step) * unit for k in range(1, steps + 1)]
    assert [move.end[2] for move in feeds] == pytest.approx(wanted, abs=1e-9)
    assert all(move.start[2] - move.end[2] > 0.9 * unit * step for move in feeds)


def test_increments_and_repetitions():
    moves = read(HEAD + "G98 G0 X0 Y0 Z20\nG91 G81 X10 Y5 R-15 Z-8 L3").moves[1:]
    holes = [(10 * k, 5 * k) for k in (1, 2, 3)]
    wanted = [(kind, (x, y, z)) for x, y in holes for kind, z in ((R, 20), (R, 5), (F, -3), (R, 20))]
    assert told(moves) == wanted


def test_return_to_the_clearance_plane_and_sticky_words():
    moves = read(HEAD + "G99 G0 X0 Y0 Z20\nG81 X10 Y5 R5 Z-3\nX20").moves[1:]
    first = [(R, (10, 5, 20)), (R, (10, 5, 5)), (F, (10, 5, -3)), (R, (10, 5, 5))]
    assert told(moves) == [*first, (R, (20, 5, 5)), (F, (20, 5, -3)), (R, (20, 5, 5))]


BODIES = [
    ("G82 P2", [(F, -3), (D, -3), (R, 9)]),
    ("G73 Q2", [(F, 0), (R, 0.254), (F, -2), (R, -1.746), (F, -3), (R, 9)]),
    ("G85", [(F, -3), (F, 2), (R, 9)]),
    ("G86 P1", [(F, -3), (D, -3), (R, 9)]),
    ("G89 P1", [(F, -3), (D, -3), (F, 9)]),
    ("G84", [(F, -3), (F, 9)]),
]


@pytest.mark.parametrize(("code", "body"), BODIES)
@pytest.mark.parametrize(("plane", "axis", "first"), [("G17", 2, "X"), ("G18", 1, "Z"), ("G19", 0, "Y")])
def test_every_body_in_every_plane(code, body, plane, axis, first):
    letter = "XYZ"[axis]
    text = HEAD + f"G98 {plane} G0 {letter}9\n{code} {first}4 R2 {letter}-3"
    moves = read(text, taps="axis").moves[1:]
    assert [(m.motion, round(m.end[axis], 6)) for m in moves] == [(R, 9), (R, 2), *body]
    assert all(m.end["XYZ".index(first)] == 4 for m in moves)


def test_the_spindle_of_taps_and_bores():
    taps = read(HEAD + "G98 G0 Z9\nG84 X1 R2 Z-3").moves[1:]
    assert [m.spindle_rpm for m in taps] == [100, 100, 100, -100]
    bores = read(HEAD + "G98 G0 Z9\nG86 X1 R2 Z-3 P0").moves[1:]
    assert [m.spindle_rpm for m in bores] == [100, 100, 100, 100, 0]


@pytest.mark.parametrize(("plane", "hole", "beside"), [("G18", "X4 Z5", "Y"), ("G19", "Y4 Z5", "X")])
def test_taps_outside_xy_go_where_the_reference_control_sends_them(plane, hole, beside):
    """Into the hole by coordinates in another order, and on from the hole as if nothing had been."""
    text = HEAD + f"G99 {plane} G0 {beside}9\nG84 {hole} R2 {beside}-3\nG80 G0 X0"
    program = read(text)
    down, into, out, on = [m.end for m in program.moves][2:]
    there = {"G18": lambda depth: (depth, 5, 4), "G19": lambda depth: (5, depth, 4)}[plane]
    assert (into, out) == (there(-3), there(2))
    assert down["XY".index(beside)] == 2 and on == (0, *down[1:])
    assert program.moves[-1].start == out  # the tool is beside its hole, whatever the control believes
    assert {f.code for f in program.findings} >= {"W345"}


def test_a_rigid_tap_feeds_by_its_pitch_and_comes_back():
    moves = read(HEAD + "G0 X1 Z9\nG33.1 Z-3 K1.5\nG0 X2").moves[1:]
    assert told(moves) == [(F, (1, 0, -3)), (F, (1, 0, 9)), (R, (2, 0, 9))]
    assert [m.feed_mm_min for m in moves[:2]] == [150, 150]
    assert [m.spindle_rpm for m in moves] == [100, -100, 100]


def test_g80_beside_another_motion_code_changes_nothing():
    assert told(read(HEAD + "G80 G0 X1\nG1 G80 X2").moves) == [(R, (1, 0, 0)), (F, (2, 0, 0))]


def test_cycles_follow_a_turned_offset_and_polar_words():
    moves = read(HEAD + "G98 G0 Z9\nG10 L2 P1 R90\nG81 X1 Y2 R2 Z-3").moves
    assert moves[-1].end == pytest.approx((-2, 1, 9)) and moves[-1].end_program == pytest.approx((1, 2, 9))
    assert read(HEAD + "G0 Z9\nG81 @2 ^90 R2 Z-3").moves[-1].end == pytest.approx((0, 2, 9))


@given(depth=st.floats(0.5, 50), step=st.floats(0.3, 20), code=st.sampled_from(["73", "83"]))
def test_steps_reach_the_bottom_once_and_never_pass_it(depth, step, code):
    moves = read(HEAD + f"G99 G0 Z2\nG{code} X1 R0 Z-{depth:.4f} Q{step:.4f}").moves
    feeds = [m.end[2] for m in moves if m.motion is F]
    assert feeds == sorted(feeds, reverse=True) and feeds[-1] == pytest.approx(-round(depth, 4))
    assert all(a - b <= round(step, 4) + 1e-9 for a, b in zip([0.0, *feeds], feeds, strict=False))


# ---- what steers ----


def xs(text: str, **options: object) -> list[float]:
    return [m.end[0] for m in read(text, **options).moves]


def test_loops_and_branches():
    assert xs("#1=0\no1 while [#1 LT 3]\n#1=[#1+1]\nG0 X#1\no1 endwhile") == [1, 2, 3]
    assert xs("#1=5\no1 do\nG0 X#1\n#1=[#1+1]\no1 while [#1 LT 3]") == [5]
    assert xs("o1 repeat [2]\nG91 G0 X1\no2 repeat [2]\nX10\no2 endrepeat\no1 endrepeat") == [
        1,
        11,
        21,
        22,
        32,
        42,
    ]
    branch = "o1 if [#1 EQ 1]\nG0 X1\no1 elseif [#1 EQ 2]\nG0 X2\no1 elseif [#1 EQ 3]\nG0 X3\no1 else\nG0 X4\no1 endif\n"
    assert [xs(f"#1={k}\n{branch}") for k in (1, 2, 3, 9)] == [[1], [2], [3], [4]]
    leave = "#1=0\no1 while [1]\n#1=[#1+1]\no2 if [#1 EQ 2]\no1 continue\no2 endif\no3 if [#1 GT 3]\no1 break\no3 endif\n"
    assert xs(leave + "G0 X#1\no1 endwhile") == [1, 3]


def test_calls_have_their_own_parameters():
    text = "#1=7 #<mine>=1 #<_all>=1\no<f> sub\n#<_all>=[#<_all>+#2]\nG0 X[#1+EXISTS[#<mine>]]\no<f> endsub [#1*2]\n"
    assert xs(text + "o<F> call [3] [4]\nG0 X#<_value>\nX#1\nX#<_all>") == [3, 6, 7, 5]
    assert xs("#1=3\no3 sub\nG0 X[#1*2]\no3 endsub\no#1 call [4]\no[#1] call [5]") == [8, 10]
    recursive = "o1 sub\nG0 X#1\no2 if [#1 GT 0]\no1 call [#1-1]\no2 endif\nG0 X#1\no1 endsub\no1 call [2]\n"
    assert xs(recursive) == [2, 1, 0, 0, 1, 2]
    assert xs("o1 sub\nG0 X1\no1 return [5]\nG0 X2\no1 endsub\no1 call\nG0 X#<_value>") == [1, 5]


def test_fanuc_subprograms():
    text = "O1000\nG91 M98 P7 L2\nG0 Y1 M98 P8\nM30\nO7\nG0 X1\nM98 P8\nM99\nO8\nX10\nM99"
    assert xs(text) == [1, 11, 12, 22, 22, 32]


def test_a_main_program_that_repeats_is_read_once():
    program = read("O5\nG0 X1\nM99\nO6\nG0 X9\nM99")
    assert [m.end[0] for m in program.moves] == [1] and program.ended


def test_a_line_that_runs_often_is_reported_once():
    found = parse_program(b"o1 repeat [9]\nG0 X!\nG1 X1\no1 endrepeat\nM2", "p").findings
    assert [f.code for f in found if f.line == 2] == ["E103", "E101"]
    assert [f.code for f in found if f.line == 3] == ["E301"]


def test_loops_take_the_same_way_as_their_lines_written_out():
    loop = "N1 G91 G1 X1 F100\nN2 Y2\nN3 G3 X2 Y0 I1\nN4 G81 X1 Z-1 R1\nN5 G80\n"
    once = read(HEAD + "o1 repeat [4]\n" + loop + "o1 endrepeat")
    flat = read(HEAD + loop * 4)
    assert [m[2:] for m in once.moves] == [m[2:] for m in flat.moves]
    assert not [f for f in once.findings if f.code in ("W402", "W403")]


def test_restart_at_a_line():
    text = "G21 G90 S1 M3 F100\nG0 X0 Y0 Z5\nG92 X10\nG1 Z0\n#1=7\nG91 X5\nG90 X#1 F200\nM2"
    whole, rest = read(text), read(text, start_line=7)
    assert rest.moves == whole.moves[-1:] and rest.moves[0].feed_mm_min == 200
    loop = "#1=0\no1 while [#1 LT 3]\n#1=[#1+1]\nG0 X#1\no1 endwhile\nG0 Y1\nM2"
    assert [m.end[1] for m in read(loop, start_line=6).moves] == [1]


def test_endless_programs_end():
    found = parse_program(b"#1=0\no1 while [1]\n#1=[#1+1]\nG0 X#1\no1 endwhile\nM2", "p", max_steps=1000)
    assert [f.code for f in found.errors] == ["E413"] and "1000" in found.errors[0].message
    deep = parse_program(b"O9\nG0 X1\nM98 P9\nM99", "p", max_steps=1000)
    assert [f.code for f in deep.errors] == ["E414"]


# ---- zero points ----


def test_g10_writes_offsets_and_turns_them():
    moves = read("G10 L2 P2 X10 Y20 R90\nG55 G0 X1 Y2\nG10 L20 P2 X5 Y6\nG0 X5 Y6\nG53 G0 X0 Y0").moves
    assert moves[0].end == pytest.approx((8, 21, 0)) and moves[0].end_program == pytest.approx((1, 2, 0))
    assert moves[1].end == pytest.approx(moves[0].end)
    assert moves[2].end == pytest.approx((0, 0, 0)) and moves[2].rotation_deg == 90


def test_g52_and_g28_1():
    moves = read("G0 X5 Y6\nG28.1\nG52 X2\nG0 X1\nG28 X4\nG52 X0\nG0 X1").moves
    assert [m.end[0] for m in moves] == [5, 3, 6, 5, 1]


def test_polar_words():
    ends = [m.end[:2] for m in read("G0 X3 Y4\n@10\n^90\n@5 ^0\nG91 @1 ^10").moves]
    wanted = [(3, 4), (6, 8), (0, 10), (5, 0), (5.908847, 1.041889)]
    assert all(a == pytest.approx(b, abs=1e-6) for a, b in zip(ends, wanted, strict=True))


def test_offsets_can_be_read_as_parameters():
    text = "G10 L2 P2 X1 Y2 R30\nG92 Z7\nG0 X5\nG28.1\nG53 G0 X#5241 Y[#5242 + #5250] Z#5213\nG53 G0 X#5161 Y#5181"
    moves = read(text).moves
    assert moves[1].end_machine == (1, 32, -7) and moves[2].end_machine[:2] == (5, 0)
