"""Writes bull.csv, flat.csv and stock.stl: stairs that roughing left over a wave, semi-finished by a pass in five axes.

See `benchmarks.modelfiles` for how to call it; `make.py --table` takes 10 s.

The conditions are those of the published test of the analytic method (lead 10, tilt 5 degrees, two teeth, D20, 5000 rev/min,
0.3 mm a tooth, 47 contact points, 5.26 s); its part was not published, this one is ours.
"""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from math import ceil, pi

import numpy as np
from manifold3d import CrossSection
from scipy.optimize import brentq

from benchmarks.modelfiles import write_model
from vmachining.arrays import Floats
from vmachining.engagement import frames
from vmachining.engagement.analytic import Corner, HeightStock, Pass, Records, engaged
from vmachining.toolpath.clpath import CLPath, Mark, pose_table
from vmachining.toolpath.facets import FacetMesh

LEAD, TILT = 10.0, 5.0  # degrees
CONTACTS, TEETH, REV_MIN, PER_TOOTH = 47, 2, 5000.0, 0.3
FEED = PER_TOOTH * TEETH * REV_MIN  # mm/min
SECONDS = 5.26  # as published: 263 mm of path
CUTTERS = {"bull": Corner(5.0, 5.0, 30.0), "flat": Corner(10.0, 0.0, 30.0)}
WAVE, LONG = 8.0, 264.0  # mm, amplitude and length of the design
STEP, LEVEL, LEFT = 8.0, 0.5, 0.5  # mm: length of a step, distance of levels of roughing, least allowance
HALF, BOTTOM, START = 15.0, -16.0, -1.0  # mm; the first contact point lies before the stock


def height(x: Floats) -> Floats:
    """mm of the design."""
    return np.asarray(WAVE * np.sin(2.0 * pi * x / LONG))


def stairs() -> tuple[Floats, Floats]:
    """Breaks in x and tops, mm: each step on the lowest level that leaves the allowance."""
    x = np.arange(0.0, LONG + STEP, STEP)
    tops = [ceil((float(height(np.linspace(a, b, 65)).max()) + LEFT) / LEVEL) * LEVEL for a, b in pairwise(x)]
    return x, np.array(tops)


def analytic() -> HeightStock:
    """The stock as the analytic method has it."""
    return HeightStock.staircase(*stairs(), y=(-HALF, HALF), floor=BOTTOM)


def stock() -> FacetMesh:
    """The stock as triangles: coordinates are exact in single precision."""
    x, tops = stairs()
    outline = [(x[0], BOTTOM), (x[-1], BOTTOM)]
    for k in range(len(tops) - 1, -1, -1):
        outline += [(x[k + 1], tops[k]), (x[k], tops[k])]
    mesh = CrossSection([outline]).extrude(2.0 * HALF).to_mesh()
    section, depth = np.asarray(mesh.vert_properties)[:, :2], np.asarray(mesh.vert_properties)[:, 2]
    return FacetMesh(
        np.column_stack([section[:, 0], HALF - depth, section[:, 1]]).astype(np.float64),
        np.asarray(mesh.tri_verts),
    )


def poses(cutter: str, pitch: float) -> tuple[Floats, Floats]:
    """Tips and axes at contact points `pitch` mm apart in x, lead and tilt about the normal."""
    corner = CUTTERS[cutter]
    x = START + pitch * np.arange(CONTACTS)
    slope = WAVE * 2.0 * pi / LONG * np.cos(2.0 * pi * x / LONG)
    tips, axes = [], []
    for k in range(CONTACTS):
        n = frames.unit([-slope[k], 0.0, 1.0])
        axis = frames.axis_of_lean(
            np.radians(LEAD), np.radians(TILT), frames.feed_direction((1.0, 0.0, slope[k]), n), n
        )
        tips.append(frames.tip_of_contact((x[k], 0.0, float(height(x[k]))), n, axis, corner.rm, corner.r))
        axes.append(axis)
    return np.array(tips), np.array(axes)


@cache
def path(cutter: str) -> CLPath:
    """Down at the first contact point, the pass, and up: the pass takes `SECONDS`, as written."""

    def over(pitch: float) -> float:
        tips = poses(cutter, pitch)[0]
        return float(np.linalg.norm(np.diff(tips, axis=0), axis=1).sum()) - FEED * SECONDS / 60.0

    tips, axes = poses(cutter, brentq(over, 5.0, 6.0))
    piece = CLPath(tips, axes, np.zeros(CONTACTS, np.bool_), np.full(CONTACTS, int(Mark.CONTACT), np.int64))
    return CLPath.joined([piece], clear_mm=40.0)


def program(cutter: str) -> str:
    """The text of a table of poses."""
    return pose_table(path(cutter), feed_mm_min=FEED)


def records(cutter: str) -> Records:
    """The pass as the analytic method has it, of the numbers as written."""
    found = path(cutter)
    return Records.of_axes(np.round(found.tips[1:-1], 5), np.round(found.axes[1:-1], 9))


def chips(cutter: str, *, per_block: int = 16, angles: int = 360) -> Pass:
    """The engagement at `per_block` + 1 even places of every block, both ends included, by the exact rule."""
    where = records(cutter).at(
        np.linspace(0.0, CONTACTS - 1.0, (CONTACTS - 1) * per_block + 1), feed_mm_min=FEED
    )
    phi = 2.0 * pi * np.arange(angles) / angles
    return engaged(
        CUTTERS[cutter], analytic(), where.tip, where.frame, phi, where.velocity, axis_rate=where.axis_rate
    )


def largest_areas(cutter: str) -> Floats:
    """(46,) mm^2: largest chip area of every block."""
    area = chips(cutter).chip_area(PER_TOOTH).max(axis=1)
    return np.asarray([area[k : k + 17].max() for k in range(0, len(area) - 1, 16)])


def scheduled_seconds(cutter: str, every: int = 6) -> float:
    """Time of the pass with one feed for every six blocks, in proportion to their largest chip, the largest of all kept."""
    area = largest_areas(cutter)
    groups = [area[k : k + every].max() for k in range(0, len(area), every)]
    feeds = FEED * max(groups) / np.repeat(groups, every)[: len(area)]
    return float((records(cutter).lengths / feeds * 60.0).sum())


def table() -> str:
    """The known truths."""
    lines = []
    for cutter in CUTTERS:
        seconds = scheduled_seconds(cutter)
        lines.append(
            f"{cutter}: largest chip {largest_areas(cutter).max():.4f} mm^2; "
            f"{SECONDS} s become {seconds:.3f} s, {100.0 * (1.0 - seconds / SECONDS):.1f} % less"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    write_model(
        __file__,
        lambda: {"bull.csv": program("bull"), "flat.csv": program("flat"), "stock.stl": stock()},
        table,
    )
