"""Draws docs/slot.png, the picture in README.md: python docs/picture.py"""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import polars as pl
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

import vmachining as vm

HERE = Path(__file__).parent


def main() -> None:
    """Run models/slot; left the finished stock coloured by block, right rate and feed."""
    result = vm.run(vm.Job.load(HERE.parent / "models" / "slot" / "job.toml"))
    surface = result.surface
    corners = surface.vertices[surface.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    light = 0.55 + 0.45 * np.clip(normals @ np.array([-0.3, -0.5, 0.81]), 0.0, 1.0)
    rate = result.blocks["mrr_mm3_min"].fill_null(0.0).to_numpy()
    colours = plt.get_cmap("viridis")(rate[np.maximum(surface.block, 0)] / rate.max())
    colours[surface.block < 0] = (0.75, 0.75, 0.75, 1.0)
    colours[:, :3] *= light[:, None]

    figure = plt.figure(figsize=(9, 3.6), dpi=90, layout="constrained")
    left, right = figure.subfigures(1, 2, width_ratios=(1.25, 1))
    box = left.add_subplot(projection="3d")
    box.add_collection3d(Poly3DCollection(corners, facecolors=colours, edgecolors="none", antialiased=False))
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    box.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    box.set_box_aspect(high - low, zoom=1.05)
    box.view_init(elev=52, azim=-75)
    box.set_axis_off()

    before = result.blocks.filter(pl.col("motion") != "rapid")
    after = result.scheduled_blocks
    assert after is not None
    after = after.filter(pl.col("motion") != "rapid")
    block = np.arange(len(before))
    top, bottom = right.subplots(2, 1, sharex=True)
    for axes, column in ((top, "mrr_mm3_min"), (bottom, "feed_mm_min")):
        axes.step(block, before[column], where="mid", lw=1, label="as programmed")
        axes.step(block, after[column], where="mid", lw=1, label="scheduled")
    top.set_ylabel("mm³/min")
    top.legend(fontsize=7)
    bottom.set(ylabel="feed mm/min", xlabel="feed block")
    figure.savefig(HERE / "slot.png", pil_kwargs={"optimize": True})


if __name__ == "__main__":
    main()
