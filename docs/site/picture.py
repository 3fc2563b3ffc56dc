"""Draws docs/slot.png and docs/engagement.png, the pictures of README and site: python docs/site/picture.py"""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import polars as pl
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from PIL import Image

import vmachining as vm
from vmachining.engagement import BoxStock, Past, RayWorkpiece, contact
from vmachining.report.engagement import write_engagement_png
from vmachining.sweep import Stance
from vmachining.tool import Edge

HERE = Path(__file__).parents[1]


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


def engagement() -> None:
    """A bull nose that leans and turns, beside two passes before it."""

    def axis(a: float, b: float) -> tuple[float, float, float]:
        return float(np.sin(b)), float(-np.sin(a) * np.cos(b)), float(np.cos(a) * np.cos(b))

    def path(y: float) -> vm.Turn:
        return vm.Turn.great_circle(
            vm.Pose((-30, y, -1.5), axis(0.10, 0.15)), vm.Pose((30, y, -1.2), axis(0.15, 0.25))
        )

    tool = vm.BullNose(diameter=12, corner_radius=3, length=30)
    before = [Past(k, vm.Sweep.along(tool, path(y))) for k, y in enumerate((8.0, 4.0))]
    edge, now = Edge(tool), Stance.on(path(0.0), 0.5)
    found = contact(edge, now, RayWorkpiece(BoxStock((-40, -40, -20), (40, 40, 0)), before))
    target = HERE / "engagement.png"
    write_engagement_png(vm.Engagement(edge, now, found, "dexel", 0.5, 2), target, name="bull nose D12 r3")
    Image.open(target).convert("P", palette=Image.Palette.ADAPTIVE, colors=128).save(target, optimize=True)


if __name__ == "__main__":
    main()
    engagement()
