"""Chips of a pass for papers, from the directory that `engage --chips` wrote: bodies, lengths over angle and time."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import polars as pl

from vmachining.arrays import Floats
from vmachining.errors import InputError
from vmachining.report.paper.source import stored
from vmachining.report.paper.style import BLUE, ORANGE, WIDTH_MM, canvas, look, shades

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHAPES = 6
"""Chips that are drawn on their own, at even distances along what cuts."""

ALONG, ROWS, AROUND = 72, 14, 60
"""Chips along the pass that are drawn in space and over path, angle and edge, and angles of each."""

SHOWN = 0.12
"""Largest thickness of the body that is drawn on its own, as a share of its size."""


POINT = (
    "phi_deg", "interval", "share", "x_mm", "y_mm", "z_mm", "nx", "ny", "nz", "thickness_mm", "edge_mm",
)  # fmt: skip
"""What is drawn of `chip_points`."""


class Patches(NamedTuple):
    """Quadrilaterals of the engaged surface of one position.

    corners, normals : (q, 4, 3) mm. thickness, edge : (q, 4) mm. angle : (q, 4) degrees, as `ChipTable.angle`; may pass 360.
    """

    corners: Floats
    normals: Floats
    thickness: Floats
    edge: Floats
    angle: Floats


@dataclass(frozen=True, slots=True, eq=False)
class ChipTable:
    """Chips of positions. angle (m,) degrees, rising, from the feed where it has a direction. length, area (n, m), mm and mm^2.

    time (n,) s. path (n,) mm of the tip. turn (n,) degrees to add to an angle of the tool frame to get that of `angle`.
    points : columns position and those of `chip_points`.
    fed : whether angles count from the feed. scaled : whether thickness is that of the programmed feed per tooth.
    """

    angle: Floats
    length: Floats
    area: Floats
    time: Floats
    path: Floats
    turn: Floats
    points: pl.DataFrame
    fed: bool
    scaled: bool

    @classmethod
    def load(cls, folder: Path) -> ChipTable:
        """Raises InputError where `engage --chips` has not written, found nothing, or was of an earlier version."""
        table, points = (
            stored(folder, f"{name}.parquet", "no chips in this directory", "run engage --chips --out")
            for name in ("chips", "chip_points")
        )
        if "path_mm" not in table.columns or not set(POINT) <= set(points.columns):
            remedy = "run engage --chips again"
            raise InputError(
                "the chips in this directory are of an earlier version", file=folder, remedy=remedy
            )
        return cls.of(table, points)

    @classmethod
    def of(cls, table: pl.DataFrame, points: pl.DataFrame) -> ChipTable:
        """Of the two tables. Raises InputError where positions have different numbers of angles."""
        positions = table["position"].n_unique()
        if not positions or len(table) % positions:
            raise InputError(
                "chips need a table with as many angles at every position", remedy="see chip_table"
            )
        fed = table["phi_feed_deg"].null_count() == 0
        names = (
            "phi_feed_deg" if fed else "phi_deg",
            "length_mm",
            "area_mm2",
            "time_s",
            "path_mm",
            "phi_deg",
        )
        angle, length, area, time, path, tool = (
            table[name].to_numpy().reshape(positions, -1) for name in names
        )
        turn = (angle - tool)[:, 0]
        order = np.argsort(angle, axis=1, kind="stable")
        turned = np.take_along_axis(angle, order, axis=1)
        length, area = (np.take_along_axis(v, order, axis=1).copy() for v in (length, area))
        # the feed turns against the grid of the tool: all are drawn at the angles of the first position
        for column in (length, area):
            for k in range(1, positions):
                column[k] = np.interp(turned[0], turned[k], column[k], period=360.0)
        scaled = table["feed_per_tooth_mm"].null_count() == 0
        return cls(turned[0], length, area, time[:, 0], path[:, 0], turn, points, fed, scaled)

    def among(self, count: int) -> list[int]:
        """Positions evenly over those that cut, over all if none does."""
        cuts = np.flatnonzero(self.length.max(axis=1) > 0.0)
        cuts = cuts if len(cuts) else np.arange(len(self.time))
        return sorted({int(cuts[round(k)]) for k in np.linspace(0, len(cuts) - 1, min(count, len(cuts)))})

    def patches(self, position: int) -> Patches:
        """The engaged surface of one position, between neighbouring angles with as many intervals."""
        mine = self.points.filter(pl.col("position") == position).sort("phi_deg", "interval", "share")
        angles = mine["phi_deg"].unique(maintain_order=True).to_numpy()
        if len(angles) < 2:
            return Patches(np.empty((0, 4, 3)), np.empty((0, 4, 3)), *np.empty((3, 0, 4)))
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
        cells = np.concatenate(found) if found else np.empty((0, 4, len(POINT)))
        phi = cells[..., 0] + self.turn[position]
        phi = phi - 360.0 * np.floor(phi[:, :1] / 360.0)
        phi = np.where(phi < phi[:, :1] - 180.0, phi + 360.0, phi)  # a cell over the end of the turn
        return Patches(cells[..., 3:6], cells[..., 6:9], cells[..., 9], cells[..., 10], phi)


def draw_chips(d: ChipTable, *, width_mm: float = WIDTH_MM) -> Figure:
    """Bodies coloured by thickness, cut length over the angle, chip area over angle and time, lengths over time."""
    with look():
        return _chips(d, width_mm)


def _chips(d: ChipTable, width_mm: float) -> Figure:
    figure = canvas(width_mm, 1.15 * width_mm)
    rows: Any = figure.subfigures(3, 1, height_ratios=(1.0, 0.9, 0.75))
    most = float(d.points["thickness_mm"].max() or 0.0) if len(d.points) else 0.0  # type: ignore[arg-type]
    picked = d.among(SHAPES)
    axis = "angle from the feed (°)" if d.fed else "rotation angle (°)"
    _pass(d, rows[0], max(most, 1e-12), axis)
    halves = rows[1].subfigures(1, 2, width_ratios=(0.9, 1.0))
    _largest(d, halves[0], max(most, 1e-12))
    shapes = halves[1].subplots()
    area, along = rows[2].subplots(1, 2)
    per = "" if d.scaled else " per mm a tooth"
    for k, colour in zip(picked, shades(len(picked)), strict=True):
        shapes.plot(d.angle, d.length[k], color=colour, label=f"{d.time[k]:.3g} s")
        along.plot(d.time[k], d.length[k].max(), "o", color=colour, ms=4, zorder=3)
    ahead = ", 90 straight ahead" if d.fed else ""
    shapes.set(xlabel=axis + ahead, ylabel="cut length (mm)", xlim=(0, 360), xticks=range(0, 361, 90))
    shapes.set_ylim(bottom=0.0)
    shapes.legend(fontsize=6.5)
    mesh = area.pcolormesh(
        d.time, d.angle, d.area.T, cmap="viridis", vmin=0.0, shading="nearest", rasterized=True
    )
    area.set(xlabel="time (s)", ylabel=axis, yticks=range(0, 361, 90))
    area.grid(visible=False)
    rows[2].colorbar(mesh, ax=area, label=f"chip area (mm²{per})", pad=0.02)
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


def _pass(d: ChipTable, figure: Any, most: float, angle: str) -> None:
    """The chips of the pass where they were cut, and the same body over path, angle and edge."""
    colour = _thickness(most)
    space, over = figure.subplots(1, 2, subplot_kw={"projection": "3d", "computed_zorder": False})
    cuts = [(k, d.patches(k)) for k in d.among(ALONG)]
    _fill(space, colour, [(p.corners, p.thickness) for _, p in cuts])
    space.set(title="chips of the pass", xlabel="x (mm)", ylabel="y (mm)", zlabel="z (mm)")
    rows = [(k, d.patches(k)) for k in d.among(ROWS)[::-1]]  # from the far end
    body = [
        (np.stack([p.angle, np.full_like(p.angle, d.path[k]), p.edge], axis=-1), p.thickness) for k, p in rows
    ]
    _fill(over, colour, body, aspect=(1.1, 1.5, 0.7))
    over.view_init(elev=32.0, azim=-68.0)
    over.set(title="the same over angle, path and edge", xlabel=angle, ylabel="path (mm)", zlabel="edge (mm)")
    unit = "mm" if d.scaled else "mm per mm a tooth"
    figure.colorbar(colour, ax=[space, over], label=f"chip thickness ({unit})", shrink=0.7, pad=0.06)


def _largest(d: ChipTable, figure: Any, most: float) -> None:
    """The chip with the largest area as a body, its thickness enlarged."""
    axes = figure.subplots(subplot_kw={"projection": "3d", "computed_zorder": False})
    p = d.patches(int(d.area.max(axis=1).argmax()))
    size = float(np.ptp(p.corners.reshape(-1, 3), axis=0).max()) if len(p.corners) else 1.0
    times = max(1.0, float(f"{SHOWN * size / most:.1g}"))
    outside = p.corners + times * p.thickness[..., None] * p.normals
    _fill(axes, _thickness(most), [(p.corners, p.thickness), (outside, p.thickness)], veil=0.75)
    axes.set(
        title=f"largest chip, its thickness {times:g} times",
        xlabel="x (mm)",
        ylabel="y (mm)",
        zlabel="z (mm)",
    )


def _thickness(most: float) -> Any:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    return ScalarMappable(Normalize(0.0, most), "viridis")


def _fill(
    axes: Any,
    colour: Any,
    surfaces: list[tuple[Floats, Floats]],
    *,
    aspect: tuple[float, float, float] | None = None,
    veil: float = 1.0,
) -> None:
    """Quadrilaterals (q, 4, 3) by their thickness (q, 4); the last surface under a veil. aspect : of the axes, else to scale."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    for k, (surface, thick) in enumerate(surfaces):
        paint = colour.to_rgba(thick.mean(axis=1), alpha=veil if k == len(surfaces) - 1 else 1.0)
        axes.add_collection3d(Poly3DCollection(surface, facecolors=paint, edgecolors="none"), autolim=False)
    points = np.concatenate([surface.reshape(-1, 3) for surface, _ in surfaces] or [np.zeros((1, 3))])
    low, wide = (points.min(axis=0), np.ptp(points, axis=0)) if len(points) else (np.zeros(3), np.ones(3))
    wide = np.maximum(wide, 1e-3)
    axes.set(
        **{f"{name}lim": ends for name, ends in zip("xyz", zip(low, low + wide, strict=True), strict=True)}
    )
    # a long pass is drawn shorter than it is
    axes.set_box_aspect(aspect or np.maximum(wide, wide.max() / 3.0), zoom=0.9)
    axes.patch.set_visible(False)  # it would hide words of its neighbour
    axes.tick_params(labelsize=6, pad=-2)
    for one in (axes.xaxis, axes.yaxis, axes.zaxis):
        one.labelpad = -4
    axes.locator_params(nbins=4)
    axes.view_init(elev=28.0, azim=-62.0)
