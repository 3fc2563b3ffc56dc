"""Draws docs/vectors.png for docs/vectors.md, vectors and deviation of the half cylinder: python docs/site/deviation_picture.py

Needs matplotlib, as `pip install vmachining[notebooks]` brings it.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from benchmarks.vectors import ALLOWANCE, BALL, RADIUS, SIDE, blocks, half_cylinder
from vmachining.engines.protocol import Options, Request
from vmachining.engines.vectors import VectorEngine, VectorSettings
from vmachining.geometry import Line
from vmachining.stock import BoxStock
from vmachining.sweep import Sweep
from vmachining.tool import BallNose

HERE = Path(__file__).parents[1]

UPRIGHT, ALONG, GREY = "#2563eb", "#e08e0b", "#c3cad4"

PASSES, SHOWN = 12, (3.0, 9.0)
"""Passes that are cut, 1 mm apart, and mm along x that the map shows."""

APART = 2.0
"""mm around the cylinder, between vectors that are drawn."""

TIMES = 250.0
"""How much longer than they are vectors are drawn after the last block: ridges are 0.025 mm high."""


def main() -> None:
    """Vectors before and after, in one section, and the deviation over the unrolled surface."""
    coarse, fine = engine(0.8, 1.2), engine(0.05, 0.1)
    figure, (before, after, flat) = plt.subplots(
        1, 3, figsize=(13, 4.2), dpi=90, layout="constrained", width_ratios=(1, 1, 1.1)
    )
    section(before, coarse, 1.0, "before the first block")
    for each in (coarse, fine):
        cut(each)
    section(after, coarse, TIMES, f"after the last, lengths drawn {TIMES:g} times")
    unrolled(flat, fine)
    figure.savefig(HERE / "vectors.png")


def engine(pitch: float, spacing: float) -> VectorEngine:
    """Vectors of the hybrid on the half cylinder, theta_V = 60 degrees, not cut yet."""
    raw = BoxStock((0.0, -RADIUS - BALL, 0.0), (SIDE, RADIUS + BALL, RADIUS + BALL))
    asked = VectorSettings(pitch=pitch, spacing=spacing, theta_v=np.radians(60.0), allowance=ALLOWANCE)
    return VectorEngine(raw, Options(design=half_cylinder(720), vectors=asked))


def cut(vectors: VectorEngine) -> None:
    """The first passes."""
    tool = BallNose(diameter=2 * BALL, length=100.0).cutter
    tips = blocks()[: 1 + PASSES * 215] - [0.0, 0.0, BALL]
    vectors.answer([Request(Sweep.along(tool, Line(a, b)), k) for k, (a, b) in enumerate(pairwise(tips))])


def section(axes: Axes, vectors: VectorEngine, times: float, title: str) -> None:
    """Vectors near the plane x = 6: between two passes, where ridges stand."""
    phi = np.linspace(0.0, np.pi, 361)
    axes.fill(RADIUS * np.cos(phi), RADIUS * np.sin(phi), color=GREY, lw=0)
    found = vectors.deviation(1e-3, outside_only=False, most=10**7)
    on = np.hypot(found.point[:, 1], found.point[:, 2]) > RADIUS - 0.1
    near = on & (np.abs(found.point[:, 0] - 6.0) < np.where(found.kind == 0, 0.3, 0.7))
    for upright, colour, name in ((True, UPRIGHT, "upright (DVV)"), (False, ALONG, "along normals (DNV)")):
        chosen = np.flatnonzero(near & ((found.kind == 0) == upright))
        _, first = np.unique(np.round(around(found.point[chosen]) / APART), return_index=True)
        chosen = chosen[first]
        feet = found.point[chosen]
        ends = feet + times * found.length[chosen, None] * found.normal[chosen]
        lines = np.stack([feet[:, 1:], ends[:, 1:]], axis=1)
        axes.add_collection(LineCollection(list(lines), colors=colour, lw=1.0, label=name))
    axes.set(xlim=(-60, 60), ylim=(-2, 64), aspect="equal", xlabel="y mm", ylabel="z mm", title=title)
    axes.legend(loc="lower center", fontsize=8)


def around(point: np.ndarray) -> np.ndarray:
    """mm from the top, over the cylinder."""
    return np.asarray(RADIUS * np.arctan2(point[:, 1], point[:, 2]))


def unrolled(axes: Axes, vectors: VectorEngine) -> None:
    """Deviation over x and the way around the cylinder."""
    found = vectors.deviation(1e-3, outside_only=False, most=10**7)
    x, y, z = found.point.T
    shown = (np.hypot(y, z) > RADIUS - 0.01) & (x > SHOWN[0]) & (x < SHOWN[1])
    reach = float(np.abs(found.deviation[shown]).max())
    dots = axes.scatter(
        around(found.point[shown]), x[shown], c=1e3 * found.deviation[shown], s=2.0, lw=0, cmap="RdBu",
        vmin=-1e3 * reach, vmax=1e3 * reach,
    )  # fmt: skip
    for sign in (-1.0, 1.0):
        axes.axvline(sign * RADIUS * np.pi / 3, color=ALONG, lw=1)
    axes.figure.colorbar(dots, ax=axes, label="0.001 mm; blue: material is left")
    axes.set(
        xlabel="mm around the cylinder; beyond the lines: along normals", ylabel="x mm", title="deviation from the part"
    )  # fmt: skip


if __name__ == "__main__":
    main()
