"""Two five-axis programs written by others for LinuxCNC's `xyzac-trt` mill, through the chain.

They belong to the LinuxCNC project and are read where they lie. Between M428 and M429 the words X Y Z are the tip
in the part and A C the table; the tool axis is then (sin c sin a, cos c sin a, cos a).
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from vmachining.machine import follow, load, tip_deviation

PROGRAMS = Path(__file__).parents[3] / "shared" / "data" / "linuxcnc" / "programs"
pytestmark = pytest.mark.skipif(not PROGRAMS.is_dir(), reason=f"no shared data: {PROGRAMS} is absent")
NUMBER = re.compile(r"([XYZAC])\s*([-+]?\d*\.?\d+)")


def records(name):
    """(n, 5) x, y, z mm and a, c rad after every line that moves, from M428 to M429."""
    text = (PROGRAMS / name).read_text(encoding="ascii", errors="replace")
    text = re.sub(r"\([^)]*\)|;[^\n]*", "", text.split("M428", 1)[1].split("M429", 1)[0])
    now, out = dict.fromkeys("XYZAC", 0.0), []
    for line in text.upper().splitlines():
        if words := NUMBER.findall(line):
            now.update((letter, float(value)) for letter, value in words)
            out.append([now[letter] for letter in "XYZAC"])
    values = np.array(out)
    values[:, 3:] = np.radians(values[:, 3:])
    return values


@pytest.fixture(scope="module", params=["impeller-7bl-xyzac.ngc", "boat-xyzac.ngc"])
def path(request):
    r = records(request.param)
    a, c = r[:, 3], r[:, 4]
    axis = np.column_stack([np.sin(c) * np.sin(a), np.cos(c) * np.sin(a), np.cos(a)])
    return request.param, r, axis


def test_poses(path):
    """Joints with the A and C of the program reach tip and axis."""
    _, r, axis = path
    assert len(r) > 1800
    m = load("xyzac-trt")
    q, det = m.place(m.joints(a=r[:, 3], c=r[:, 4], degrees=False), r[:, :3])
    np.testing.assert_allclose(det, 1.0, atol=1e-12)
    pose = m.forward(q)
    np.testing.assert_allclose(pose.tip, r[:, :3], atol=1e-10)
    np.testing.assert_allclose(pose.axis, axis, atol=1e-14)


def test_the_inverse_finds_the_angles_of_the_program(path):
    """The travel of A, -100 to 50 degrees, leaves the branch the programmer took, except near A = 0."""
    _, r, axis = path
    m = load("xyzac-trt")
    found = m.inverse(r[:, :3], axis)
    a, c = found.joints[..., 1], found.joints[..., 0]
    error = np.hypot(np.abs(a - r[:, 3:4]), np.abs(np.exp(1j * c) - np.exp(1j * r[:, 4:5])))
    clear = np.abs(r[:, 3]) > 1e-6
    assert clear.sum() > 0
    assert np.nanmin(error[clear], axis=1).max() < 1e-9
    assert (found.singular == (np.abs(np.sin(r[:, 3])) < 1e-9)).all()


def test_following_the_path_stays_in_the_travels_of_the_table(path):
    _, r, axis = path
    m = load("xyzac-trt")
    start = m.joints(a=r[0, 3], c=r[0, 4], degrees=False)
    q = follow(m, r[:, :3], axis, start=start).joints
    pose = m.forward(q)
    np.testing.assert_allclose(pose.tip, r[:, :3], atol=1e-9)
    np.testing.assert_allclose(pose.axis, axis, atol=1e-8)
    for axis, values in zip(m.axes, q.T, strict=True):
        assert axis.lower <= values.min() and values.max() <= axis.upper
    # no turn of C larger than the one the programmer took, up to the choice of turn
    asked, taken = np.diff(r[:, 4]), np.diff(q[:, 0])
    assert np.abs(taken).max() <= np.abs(asked).max() + 1e-9


def test_tip_deviation_of_joint_linear_blocks(path):
    """What the programs would cut if the joints were linear between their records."""
    _, r, _ = path
    m = load("xyzac-trt")
    q, _ = m.place(m.joints(a=r[:, 3], c=r[:, 4], degrees=False), r[:, :3])
    found = tip_deviation(m, q[:-1], q[1:], samples=17)
    assert (found.geometric <= found.parametric + 1e-9).all()
    assert (found.parametric <= found.bound + 1e-9).all()
    turning = np.abs(np.diff(q[:, :2], axis=0)).max(axis=1) > 0
    assert found.bound[~turning].max(initial=0.0) < 1e-9
