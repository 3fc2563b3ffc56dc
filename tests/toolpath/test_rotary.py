"""Five-axis paths as NC programs of a machine: read back by the NC reader, the poses are those of the path."""

from __future__ import annotations

import re

import numpy as np
import pytest

from vmachining.errors import InputError, KinematicsError
from vmachining.job.paths import move_path
from vmachining.machine import load
from vmachining.nc import read_program
from vmachining.sweep import Turn
from vmachining.toolpath.clpath import CLPath
from vmachining.toolpath.facets import Surface, five_axis_raster, height_field
from vmachining.toolpath.rotary import rotary_program


@pytest.fixture(scope="module")
def path() -> CLPath:
    x = np.linspace(0.0, 12.0, 13)
    part = Surface(height_field(x, x, 1.5 * np.outer(np.sin(x / 4.0), np.cos(x / 5.0))))
    return five_axis_raster(part, 3.0, 1.0, chord=0.02, step=4.0, lead_deg=12.0, tilt_deg=8.0)


def read_back(text, machine, folder):
    """Tips and axes at the start and along every block."""
    (folder / "p.nc").write_text(text, encoding="ascii")
    program = read_program(folder / "p.nc", rotary="ABC", home=(0.0, 0.0, 60.0))
    assert not [f for f in program.findings if f.severity == "E"], program.findings
    share = np.linspace(0.0, 1.0, 5)
    rows = []
    for move in program.moves:
        way = move_path(move, machine)
        if isinstance(way, Turn):
            rows.append([(way.position(t), way.axis(t)) for t in share])
        else:
            rows.append([(way.position(t), np.array([0.0, 0.0, 1.0])) for t in share])
    return [np.array([p for p, _ in row]) for row in rows], [np.array([u for _, u in row]) for row in rows]


@pytest.mark.parametrize("chain", ["ac-table", "bc-table", "c-table-b-head", "ac"])
@pytest.mark.parametrize("tcp", [True, False])
def test_poses_come_back(path, chain, tcp, tmp_path):
    machine, tolerance, limit = load(chain), 0.005, 0.1
    text, _ = rotary_program(
        path, machine, feed_mm_min=900.0, tcp=tcp, tolerance_mm=tolerance, angle_deg=limit
    )
    assert ("M128" in text) == tcp
    tips, axes = read_back(text, machine, tmp_path)
    ends, leans = np.array([t[-1] for t in tips]), np.array([u[-1] for u in axes])
    # every pose of the path is the end of a block: five decimals of mm and degrees
    rounding = 1e-5 + 1e-5 * np.pi / 180.0 * np.abs(path.tips).max()
    for tip, axis in zip(path.tips, path.axes, strict=True):
        k = int(np.argmin(np.linalg.norm(ends - tip, axis=1) + np.linalg.norm(leans - axis, axis=1)))
        assert np.linalg.norm(ends[k] - tip) <= 4.0 * rounding
        assert np.linalg.norm(leans[k] - axis) <= 1e-6
    if tcp:
        assert max(_off_line(points) for points in tips) <= 1e-9


def _off_line(points):
    way = points[-1] - points[0]
    share = np.linspace(0.0, 1.0, len(points))[:, None]
    return np.linalg.norm(points - (points[0] + share * way), axis=1).max()


def test_joint_linear_blocks_stay_within_the_tolerance(path, tmp_path):
    machine = load("ac-table", second_point=(0.0, 0.0, -40.0))
    counts = []
    for tolerance in (0.05, 0.002):
        text, notes = rotary_program(
            path, machine, feed_mm_min=900.0, tcp=False, tolerance_mm=tolerance, angle_deg=5.0
        )
        lines = [line for line in text.splitlines() if line[0] in "GXYZABC" and "G21" not in line]
        tips, _ = read_back(text, machine, tmp_path)
        assert len(tips) == len(lines)
        mode, off = "G0", []
        for line, points in zip(lines, tips, strict=True):
            mode = line[:2] if line.startswith("G") else mode
            off.append(_off_line(points) if mode == "G1" else 0.0)
        # links turn over the pole, where C swings: those blocks are told, and how far they are off
        told = [m for note in notes if (m := re.match(r"(\d+) blocks .* by up to (\S+) mm", note))]
        beyond = [value for value in off if value > tolerance]
        assert len(beyond) <= sum(int(m[1]) for m in told) < 0.1 * len(lines)
        assert max(beyond, default=0.0) <= max((float(m[2]) for m in told), default=0.0) * 1.01
        counts.append(len(lines))
    assert counts[0] < counts[1]


def test_refusals(path):
    with pytest.raises(InputError, match="no rotary axis"):
        rotary_program(path, load("xyz"), feed_mm_min=900.0)
    with pytest.raises(InputError, match="tolerance_mm 0"):
        rotary_program(path, load("ac-table"), feed_mm_min=900.0, tolerance_mm=0.0)
    lying = CLPath(path.tips[:1], np.array([[0.0, 0.0, -1.0]]), path.rapid[:1], path.marks[:1])
    with pytest.raises(KinematicsError, match="travels"):
        rotary_program(lying, load("xyzac-trt"), feed_mm_min=900.0)
