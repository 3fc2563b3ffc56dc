"""Five-axis programs from file to volumes: closed forms of a ball, and the same motion said in several dialects."""

import numpy as np
import pytest

import vmachining as vm
from vmachining.errors import InputError
from vmachining.job.paths import end_axis, move_path

R, DEPTH, LENGTH = 5.0, 1.0, 20.0
SEGMENT = R**2 * np.arccos(1 - DEPTH / R) - (R - DEPTH) * np.sqrt(DEPTH * (2 * R - DEPTH))
WIDTH = 2 * np.sqrt(DEPTH * (2 * R - DEPTH))


def job(folder, program, name="part.csv", dialect="poses", machine=None, chord=0.02, width=0.003):
    (folder / name).write_text(program)
    data = {
        "name": "five",
        "program": {"file": name, "dialect": dialect, "home": [0, 0, 100]},
        "tools": [{"number": 1, "type": "ball", "diameter_mm": 2 * R, "length_mm": 40}],
        "stock": {"box": {"min": [0, -12, -10], "max": [LENGTH, 12, 0]}},
        "accuracy": {"chord_mm": chord, "width": width},
    }
    if machine is not None:
        data["machine"] = {"chain": machine}
    return vm.Job.from_mapping(data, folder)


def slot(axes, start=-8.0, end=LENGTH + 8.0):
    """Poses whose ball centre goes straight along x at depth DEPTH below the top, one row per axis."""
    rows = ["x_mm,y_mm,z_mm,i,j,k,feed_mm_min,tool"]
    for x, axis in zip(np.linspace(start, end, len(axes)), axes, strict=True):
        tip = np.array([x, 0.0, R - DEPTH]) - R * axis
        rows.append(",".join(repr(float(v)) for v in (*tip, *axis)) + ",600,1")
    return "\n".join(rows) + "\n"


def tilt(degrees, towards):
    a = np.radians(degrees)
    return np.array([np.sin(a) * np.cos(towards), np.sin(a) * np.sin(towards), np.cos(a)])


@pytest.mark.parametrize("towards", [0.0, 2.0])
def test_a_leaning_ball_cuts_the_same_slot(tmp_path, towards):
    result = vm.run(job(tmp_path, slot([tilt(25, towards)] * 3)))
    summary = result.summary
    truth = SEGMENT * LENGTH
    assert summary["removed_lo_mm3"] <= truth <= summary["removed_hi_mm3"]
    assert summary["removed_mm3"] == pytest.approx(
        truth, abs=0.25 * (summary["removed_hi_mm3"] - summary["removed_lo_mm3"])
    )
    last = result.blocks.row(-1, named=True)
    assert [last["i"], last["j"], last["k"]] == pytest.approx(tilt(25, towards))
    assert last["line"] == 4


def test_a_turning_ball_whose_centre_goes_straight_cuts_the_same_slot(tmp_path):
    steps, turn = 8, np.radians(24)
    axes = [tilt(20, angle) for angle in np.linspace(0.0, turn, steps + 1)]
    summary = vm.run(job(tmp_path, slot(axes))).summary
    truth = SEGMENT * LENGTH
    # between two rows the tip is straight, not the centre: it bows by at most R angle^2 / 8
    bow = R * (turn / steps) ** 2 / 8 * WIDTH * LENGTH
    assert summary["removed_lo_mm3"] - bow <= truth <= summary["removed_hi_mm3"] + bow
    assert summary["removed_hi_mm3"] - summary["removed_lo_mm3"] < 0.1 * truth


ANGLES = [(10.0, 0.0), (14.0, 8.0), (20.0, 12.0)]
TIPS = [(-9.0, 1.0, -1.5), (10.0, 0.0, -1.0), (29.0, -1.0, -1.5)]


@pytest.mark.slow  # 6 s
def test_tables_of_angles_and_programs_with_tool_centre_control_agree(tmp_path):
    header = "x_mm,y_mm,z_mm,a_deg,c_deg,feed_mm_min,tool\n"
    table = header + "".join(
        f"{x},{y},{z},{a},{c},600,1\n" for (x, y, z), (a, c) in zip(TIPS, ANGLES, strict=True)
    )
    lines = ["G21 G90 G94", "T1 M6", "M428"]
    for k, ((x, y, z), (a, c)) in enumerate(zip(TIPS, ANGLES, strict=True)):
        lines.append(f"G1 X{x} Y{y} Z{z} A{a} C{c} F600" if k else f"G0 X{x} Y{y} Z{z} A{a} C{c}")
    program = "\n".join([*lines, "M2"]) + "\n"
    by_table = vm.run(job(tmp_path, table, machine="ac-table")).blocks
    by_code = vm.run(job(tmp_path, program, "part.nc", "iso", "ac-table")).blocks
    cut = by_code.filter(by_code["motion"] == "linear")
    assert len(by_table) == len(cut) == 2
    for column in ("x_mm", "y_mm", "z_mm", "i", "j", "k", "removed_mm3", "removed_lo_mm3", "removed_hi_mm3"):
        assert cut[column].to_list() == pytest.approx(by_table[column].to_list(), rel=1e-9, abs=1e-12)
    assert by_table["removed_mm3"].min() > 1


def test_rotary_axes_at_zero_change_nothing(tmp_path):
    three = "G21 G90\nT1 M6\nG0 X-8 Y0 Z-1\nG1 X28 F600\nM2\n"
    five = "G21 G90\nT1 M6\nG0 X-8 Y0 Z-1 A0 C0\nG1 X28 A0 C0 F600\nM2\n"
    one = vm.run(job(tmp_path, three, "three.nc", "iso", width=1e-3)).blocks
    other = vm.run(job(tmp_path, five, "five.nc", "iso", "xyzac-trt", width=1e-3)).blocks
    assert other["removed_mm3"].to_list() == one["removed_mm3"].to_list()
    assert one["removed_mm3"].sum() == pytest.approx(SEGMENT * LENGTH, rel=1e-3)
    assert one["removed_lo_mm3"].sum() <= SEGMENT * LENGTH <= one["removed_hi_mm3"].sum()


def test_a_table_that_turns_carries_the_stock_past_a_tool_at_rest(tmp_path):
    """Joints linear, no tool centre control: only C turns, so the tip runs on a circle about the table's axis."""
    program = "G21 G90\nT1 M6\nG0 X18 Y0 Z-1 A0 C-60\nG1 C60 F600\nM2\n"
    blocks = vm.run(job(tmp_path, program, "turn.nc", "iso", "ac-table")).blocks
    row = blocks.row(-1, named=True)
    # a table that turns by +60 degrees takes the tip to -60 degrees in the part; the arc is 18 * 2 pi / 3 long
    assert [row["x_mm"], row["y_mm"]] == pytest.approx([9.0, -18 * np.sin(np.pi / 3)])
    assert row["length_mm"] == pytest.approx(18 * 2 * np.pi / 3, rel=1e-4)
    arc = "G21 G90\nT1 M6\nG0 X9 Y15.588457268119896 Z-1\nG2 X9 Y-15.588457268119896 I-9 J-15.588457268119896 F600\nM2\n"
    same = vm.run(job(tmp_path, arc, "arc.nc", "iso")).blocks.row(-1, named=True)
    assert max(row["removed_lo_mm3"], same["removed_lo_mm3"]) <= min(
        row["removed_hi_mm3"], same["removed_hi_mm3"]
    )
    assert row["removed_mm3"] == pytest.approx(
        same["removed_mm3"], abs=row["removed_hi_mm3"] - row["removed_lo_mm3"]
    )


def test_rotary_words_want_a_machine(tmp_path):
    with pytest.raises(InputError, match=r"rotary|machine"):
        vm.run(job(tmp_path, "x_mm,y_mm,z_mm,a_deg,c_deg,feed_mm_min\n0,0,0,1,0,600\n5,0,0,2,0,600\n"))


TCP = "G21 G90\nT1 M6\nG0 X18 Y0 Z20 A0 C30\n{}\nM2\n"


def test_switching_tool_centre_control_does_not_move_the_tip(tmp_path):
    """The table stands at 30 degrees, so the same tip has other coordinates behind M428."""
    program = TCP.format("M428\nG0 X18 Y0 Z-1\nG1 X9 F600")
    rows = vm.run(job(tmp_path, program, "tcp.nc", "iso", "ac-table")).blocks
    before, rapid = rows.row(0, named=True), rows.row(1, named=True)
    at = [before["x_mm"], before["y_mm"], before["z_mm"]]
    assert at == pytest.approx([18 * np.cos(np.pi / 6), -18 * np.sin(np.pi / 6), 20])
    assert rapid["length_mm"] == pytest.approx(np.linalg.norm(np.subtract(at, [18, 0, -1])))


@pytest.mark.parametrize("words", ["G1 X18 Y0 Z-1 F600", "G0 Z-1"])
def test_words_of_the_old_kind_are_refused_behind_a_switch(tmp_path, words):
    with pytest.raises(InputError, match=r":5.*switched while the rotary axes are turned.*names X, Y and Z"):
        vm.run(job(tmp_path, TCP.format(f"M428\n{words}\nG1 X9 F600"), "tcp.nc", "iso", "ac-table"))


@pytest.mark.parametrize("angles", ["A0 C30", "A-90 C0", "A40 C110"])
@pytest.mark.parametrize(
    "words", ["G2 X16 Y0 I-1 J0", "G3 X18 Y0 I-3 J4 Z-2", "G18 G2 X14 Z-4 I-4 K0", "G2 X18 Y0 I-1 J0 P3"]
)
def test_an_arc_on_a_turned_table_that_stands_still(tmp_path, angles, words):
    """The circle in slide coordinates by its closed form, each place of it carried into the part by the machine's chain."""
    program = vm.nc.parse_program(
        f"G21 G90\nT1 M6\nG0 X18 Y0 Z0 {angles}\n{words} F600\nM2\n".encode(),
        "arc.nc",
        dialect="iso",
        rotary="ABC",
    )
    move, chain = program.moves[-1], vm.machine.load("ac-table")
    path = move_path(move, chain)
    assert path.length > 0.0
    start, centre = np.array(move.start), np.array(move.start)
    a, b, normal = {"xy": (0, 1, 2), "zx": (2, 0, 1)}[move.plane]
    centre[[a, b]] = move.center
    arm = (start - centre)[[a, b]]
    closed = np.linalg.norm((np.array(move.end) - start)[[a, b]]) < 1e-9
    far = (np.array(move.end) - centre)[[a, b]]
    ccw = 1.0 if move.motion.value == "arc_ccw" else -1.0
    turn = (ccw * (np.arctan2(far[1], far[0]) - np.arctan2(arm[1], arm[0]))) % (2 * np.pi)
    turn = 2 * np.pi if closed else turn
    turn = ccw * (turn + 2 * np.pi * (move.turns - 1))
    rotary = dict(move.rotary_deg)
    for t in (0.0, 0.3, 0.5, 1.0):
        c, s = np.cos(turn * t), np.sin(turn * t)
        place = centre.copy()
        place[a], place[b] = centre[a] + c * arm[0] - s * arm[1], centre[b] + s * arm[0] + c * arm[1]
        place[normal] = start[normal] + t * (move.end[normal] - start[normal])
        x, y, z = place
        pose = chain.forward(chain.joints(degrees=True, x=x, y=y, z=z, **rotary))
        assert path.position(t) == pytest.approx(pose.tip, abs=1e-9)
        assert end_axis(path) == pytest.approx(pose.axis, abs=1e-12)


def test_an_arc_while_the_table_turns_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"while the tool axis turns.*short lines"):
        vm.run(job(tmp_path, TCP.format("G2 X16 Y0 I-1 J0 A20 F600"), "arc.nc", "iso", "ac-table"))
