"""Chips of a pass for papers, from the directory that `engage --chips` wrote: bodies, lengths over angle and time."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from vmachining.arrays import Floats
from vmachining.errors import InputError
from vmachining.report.paper.style import BLUE, ORANGE, WIDTH_MM, canvas, look, shades

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["ChipTable", "draw_chips"]

SHAPES = 6
"""Chips that are drawn on their own, at even distances along what cuts."""

ALONG, AROUND = 24, 60
"""Chips along the pass, and angles of each, that are drawn in space."""

SHOWN = 0.12
"""Largest thickness of the body that is drawn on its own, as a share of its size."""


POINT = ("phi_deg", "interval", "share", "x_mm", "y_mm", "z_mm", "nx", "ny", "nz", "thickness_mm")
"""What is drawn of `chip_points`."""


@dataclass(frozen=True, slots=True, eq=False)
class ChipTable:
    """Chips of positions. angle (m,) degrees, rising, from the feed where it has a direction. length, area (n, m), mm and mm^2.

    time (n,) s. points : columns position, phi_deg, interval, share, x_mm .. nz, thickness_mm; see `chip_points`.
    fed : whether angles count from the feed. scaled : whether thickness is that of the programmed feed per tooth.
    """

    angle: Floats
    length: Floats
    area: Floats
    time: Floats
    points: pl.DataFrame
    fed: bool
    scaled: bool

    @classmethod
    def load(cls, folder: Path) -> ChipTable:
        """Raises InputError where `engage --chips` has not written, or found nothing."""
        files = folder / "chips.parquet", folder / "chip_points.parquet"
        if not all(file.is_file() for file in files):
            raise InputError(
                "no chips in this directory", file=str(folder), remedy="run engage --chips --out"
            )
        return cls.of(*(pl.read_parquet(file) for file in files))

    @classmethod
    def of(cls, table: pl.DataFrame, points: pl.DataFrame) -> ChipTable:
        """Of the two tables. Raises InputError where positions have different numbers of angles."""
        positions = table["position"].n_unique()
        if not positions or len(table) % positions:
            raise InputError(
                "chips need a table with as many angles at every position", remedy="see chip_table"
            )
        fed = table["phi_feed_deg"].null_count() == 0
        angle, length, area, time = (
            table[name].to_numpy().reshape(positions, -1)
            for name in ("phi_feed_deg" if fed else "phi_deg", "length_mm", "area_mm2", "time_s")
        )
        order = np.argsort(angle, axis=1, kind="stable")
        turned = np.take_along_axis(angle, order, axis=1)
        length, area = (np.take_along_axis(v, order, axis=1).copy() for v in (length, area))
        # the feed turns against the grid of the tool: all are drawn at the angles of the first position
        for column in (length, area):
            for k in range(1, positions):
                column[k] = np.interp(turned[0], turned[k], column[k], period=360.0)
        scaled = table["feed_per_tooth_mm"].null_count() == 0
        return cls(turned[0], length, area, time[:, 0], points, fed, scaled)

    def among(self, count: int) -> list[int]:
        """Positions evenly over those that cut, over all if none does."""
        cuts = np.flatnonzero(self.length.max(axis=1) > 0.0)
        cuts = cuts if len(cuts) else np.arange(len(self.time))
        return sorted({int(cuts[round(k)]) for k in np.linspace(0, len(cuts) - 1, min(count, len(cuts)))})

    def patches(self, position: int) -> tuple[Floats, Floats, Floats]:
        """Quadrilaterals of the engaged surface of one position: corners, normals (q, 4, 3), thickness (q, 4) mm.

        Between neighbouring angles with as many intervals.
        """
        mine = self.points.filter(pl.col("position") == position).sort("phi_deg", "interval", "share")
        angles = mine["phi_deg"].unique(maintain_order=True).to_numpy()
        if len(angles) < 2:
            return np.empty((0, 4, 3)), np.empty((0, 4, 3)), np.empty((0, 4))
        step = float(np.diff(angles).min())
        every = max(1, round(len(angles) / AROUND))
        rows = [one.to_numpy() for one in mine.select(POINT).partition_by("phi_deg", maintain_order=True)]
        found: list[Floats] = []
        ring = [(k, min(k + every, len(rows) - 1)) for k in range(0, len(rows) - 1, every)]
        if angles[0] + 360.0 - angles[-1] < 1.5 * step:
            ring.append((len(rows) - 1, 0))
        for a, b in ring:
            gap = (rows[b][0, 0] - rows[a][0, 0]) % 360.0
            if len(rows[a]) != len(rows[b]) or gap > (every + 0.5) * step:
                continue
            inside = np.flatnonzero(rows[a][1:, 1] == rows[a][:-1, 1])
            found.append(
                np.stack([rows[a][inside], rows[a][inside + 1], rows[b][inside + 1], rows[b][inside]], axis=1)
            )
        cells = np.concatenate(found) if found else np.empty((0, 4, 10))
        return cells[..., 3:6], cells[..., 6:9], cells[..., 9]


def draw_chips(d: ChipTable, *, width_mm: float = WIDTH_MM) -> Figure:
    """Bodies coloured by thickness, cut length over the angle, chip area over angle and time, lengths over time."""
    with look():
        return _chips(d, width_mm)


def _chips(d: ChipTable, width_mm: float) -> Figure:
    figure = canvas(width_mm, 1.15 * width_mm)
    rows: Any = figure.subfigures(3, 1, height_ratios=(1.25, 0.85, 0.7))
    most = float(d.points["thickness_mm"].max() or 0.0) if len(d.points) else 0.0  # type: ignore[arg-type]
    _bodies(d, rows[0], max(most, 1e-12))
    shapes, area = rows[1].subplots(1, 2)
    along = rows[2].subplots()
    picked = d.among(SHAPES)
    axis = "angle from the feed (°), 90 straight ahead" if d.fed else "rotation angle (°)"
    per = "" if d.scaled else " per mm a tooth"
    for k, colour in zip(picked, shades(len(picked)), strict=True):
        shapes.plot(d.angle, d.length[k], color=colour, label=f"{d.time[k]:.3g} s")
        along.plot(d.time[k], d.length[k].max(), "o", color=colour, ms=4, zorder=3)
    shapes.set(
        xlabel=axis, ylabel="cut length (mm)", xlim=(0, 360), xticks=range(0, 361, 90), ylim=(0.0, None)
    )
    shapes.legend(fontsize=6.5)
    mesh = area.pcolormesh(
        d.time, d.angle, d.area.T, cmap="viridis", vmin=0.0, shading="nearest", rasterized=True
    )
    area.set(
        xlabel="time (s)",
        ylabel="angle from the feed (°)" if d.fed else "rotation angle (°)",
        yticks=range(0, 361, 90),
    )
    area.grid(visible=False)
    rows[1].colorbar(mesh, ax=area, label=f"chip area (mm²{per})", pad=0.02)
    along.plot(d.time, d.length.max(axis=1), color=BLUE)
    along.set(xlabel="time (s)")
    along.set_ylim(0.0, 1.06 * along.get_ylim()[1])
    along.set_ylabel("largest cut length (mm)", color=BLUE)
    twin = along.twinx()
    twin.plot(d.time, d.area.max(axis=1), color=ORANGE)
    twin.set_ylim(bottom=0.0)
    twin.spines["right"].set_visible(True)
    twin.set_ylabel(f"largest chip area (mm²{per})", color=ORANGE)
    twin.grid(visible=False)
    return figure


def _bodies(d: ChipTable, figure: Any, most: float) -> None:
    """The chips of the pass where they were cut, and the one with the largest area as a body, its thickness enlarged."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    colour = ScalarMappable(Normalize(0.0, most), "viridis")
    space, one = figure.subplots(1, 2, subplot_kw={"projection": "3d", "computed_zorder": False})
    pass_ = [d.patches(k) for k in d.among(ALONG)]
    corners, normal, h = d.patches(int(d.area.max(axis=1).argmax()))
    size = float(np.ptp(corners.reshape(-1, 3), axis=0).max()) if len(corners) else 1.0
    times = max(1.0, float(f"{SHOWN * size / most:.1g}"))
    body = [(corners, normal, h), (corners + times * h[..., None] * normal, normal, h)]
    titles = "chips of the pass", f"largest chip, its thickness {times:g} times"
    for axes, surfaces, title in zip((space, one), (pass_, body), titles, strict=True):
        for k, (surface, _, thick) in enumerate(surfaces):
            paint = colour.to_rgba(thick.mean(axis=1), alpha=0.75 if axes is one and k else 1.0)
            axes.add_collection3d(
                Poly3DCollection(surface, facecolors=paint, edgecolors="none"), autolim=False
            )
        points = np.concatenate([surface.reshape(-1, 3) for surface, _, _ in surfaces] or [np.zeros((1, 3))])
        low, wide = (points.min(axis=0), np.ptp(points, axis=0)) if len(points) else (np.zeros(3), np.ones(3))
        wide = np.maximum(wide, 1e-3)
        axes.set(
            xlim=(low[0], low[0] + wide[0]), ylim=(low[1], low[1] + wide[1]), zlim=(low[2], low[2] + wide[2])
        )
        # a long pass is drawn shorter than it is
        axes.set_box_aspect(np.maximum(wide, wide.max() / 3.0) if axes is space else wide, zoom=0.72)
        axes.set(title=title, xlabel="x (mm)", ylabel="y (mm)", zlabel="z (mm)")
        axes.tick_params(labelsize=6, pad=-1)
        axes.locator_params(nbins=4)
        axes.view_init(elev=28.0, azim=-62.0)
    unit = "mm" if d.scaled else "mm per mm a tooth"
    figure.colorbar(colour, ax=[space, one], label=f"chip thickness ({unit})", shrink=0.7, pad=0.07)
