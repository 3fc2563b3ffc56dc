"""The map of engagement as a page that opens offline and as a PNG, and the tables next to it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import polars as pl

from vmachining.arrays import Floats
from vmachining.engagement import Engagement, chip_table
from vmachining.job.files import atomic_path, write_table
from vmachining.job.folder import engagement_files
from vmachining.job.table import readable
from vmachining.report.figures import Panel, picture, write_page
from vmachining.report.paper.style import BLUE, GREEN, GREY, RED, canvas, look

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CELLS = 240
"""Of the picture along the edge."""

MAP_CELLS = 200
"""Of the map in the CSV file, over the whole edge."""

HEAD = 1.12
"""The picture shows the edge a little beyond its highest engaged point."""


class Drawn(NamedTuple):
    """What both pictures show.

    turn : (n,) degrees, rising. s : (m,) mm, middles of cells along the edge. chip : (m, n) chip thickness per feed
    per tooth where the edge is engaged, NaN elsewhere. ends : (k, 3) turn, LE and UE of every interval. length,
    area : (n,) mm. joints : s of the joints that are seen. top : highest s that is seen. axis : its title.
    """

    turn: Floats
    s: Floats
    chip: Floats
    ends: Floats
    length: Floats
    area: Floats
    joints: Floats
    top: float
    axis: str


def drawn(found: Engagement) -> Drawn:
    """The numbers of the picture, angles counted from the feed where it has a direction."""
    offset = found.feed_angle
    turn = np.degrees(found.phi) + (0.0 if offset is None else float(np.degrees(offset)))
    turn = np.round(turn, 9) % 360.0
    order = np.argsort(turn, kind="stable")
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    parts = found.intervals
    low = float(found.edge.joints[0])
    top = float(found.edge.joints[-1])
    if len(parts.row):
        top = min(top, low + HEAD * (float(parts.upper.max()) - low))
    borders = np.linspace(low, top, CELLS + 1)
    s = 0.5 * (borders[1:] + borders[:-1])
    chip = np.full((CELLS, len(turn)), np.nan)
    tip = float(np.linalg.norm(found.stance.velocity))
    for row, lower, upper in zip(parts.row, parts.lower, parts.upper, strict=True):
        inside = np.flatnonzero((s >= lower) & (s <= upper))
        if len(inside):
            phi = np.full(len(inside), found.phi[row])
            speed = found.stance.normal_speed(found.edge, phi, found.edge.piece_at(s[inside]), s[inside])
            chip[inside, place[row]] = speed / tip if tip > 0.0 else 1.0
    ends = np.column_stack([turn[parts.row], parts.lower, parts.upper])
    joints = found.edge.joints[1:-1]
    label = "rotation angle" if offset is None else "rotation angle from the feed, 90° straight ahead"
    return Drawn(
        turn[order], s, chip, ends, found.lengths[order], found.chip_per_feed[order],
        joints[(joints > low) & (joints < top)], top, label,
    )  # fmt: skip


def write_engagement(found: Engagement, folder: Path | str, *, name: str = "") -> list[Path]:
    """Write engagement.csv, .parquet, .html, engagement_map.csv, engagement_chips.csv (`chip_table` per mm of feed
    per tooth), and engagement.png.

    What an earlier call made there is replaced; engagement.json says what that is.

    Returns list of Path: The files written.
    Raises InputError: The directory holds a file of somebody else under one of these names, or somebody is writing
        there.
    """
    folder = Path(folder)
    with engagement_files(folder):
        return _write(found, folder, name)


def _write(found: Engagement, folder: Path, name: str) -> list[Path]:
    table, chart = found.table(), found.map(MAP_CELLS)
    paths = [folder / f"engagement.{suffix}" for suffix in ("csv", "parquet", "html", "png")]
    middles = 0.5 * (chart.s[1:] + chart.s[:-1])
    share = {f"{m:.6g}": c for m, c in zip(middles, chart.share.T, strict=True)}
    sheets = {
        paths[0]: table, folder / "engagement_map.csv": pl.DataFrame({"phi_deg": np.degrees(chart.phi), **share}),
        folder / "engagement_chips.csv": chip_table(found),
    }  # fmt: skip
    for file, rows in sheets.items():
        write_table(readable(rows.lazy()).collect(), file)
    write_table(table, paths[1])
    write_engagement_page(found, paths[2], name=name)
    write_engagement_png(found, paths[3], name=name)
    return [*paths, *list(sheets)[1:]]


def write_engagement_page(found: Engagement, path: Path, *, name: str = "") -> None:
    """One self-contained HTML file: the unrolled map coloured by chip thickness, length of cut and chip area."""
    words = "Chip thickness over rotation and edge; below, length of cut and chip area"
    with look():
        map_ = picture(_figure(found), words, kind="png")
    write_page(
        path, [Panel(title="What the edge touches", svg=map_, rows=list(found.facts.items()), head=("", ""))], kind="engagement",
        name=_title(found, name), subtitle="Lengths in mm, angles in degrees", chips=[("warn", text) for text in found.notes],
    )  # fmt: skip


def write_engagement_png(found: Engagement, path: Path, *, name: str = "") -> None:
    """The same as a PNG."""
    with look():
        figure = _figure(found, _title(found, name))
        with atomic_path(path) as temporary:
            figure.savefig(temporary, format="png", dpi=150)


def draw_engagement(found: Engagement) -> Figure:
    """The same as a matplotlib figure; a notebook shows it."""
    with look():
        return _figure(found, _title(found, ""))


def _figure(found: Engagement, title: str = "") -> Figure:
    d = drawn(found)
    figure = canvas(174.0, 120.0)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(1.7, 1.0))
    half = 180.0 / len(d.turn)
    x = np.append(d.turn - half, d.turn[-1] + half)
    y = np.linspace(d.s[0] - 0.5 * (d.s[1] - d.s[0]), d.top, CELLS + 1)
    mesh = top.pcolormesh(x, y, np.ma.masked_invalid(d.chip), cmap="viridis", vmin=0.0, vmax=1.0)
    top.plot(d.ends[:, 0], d.ends[:, 1], ".", ms=3, color=BLUE, label="LE")
    top.plot(d.ends[:, 0], d.ends[:, 2], ".", ms=3, color=RED, label="UE")
    for joint in d.joints:
        top.axhline(float(joint), color=GREY, lw=0.8, ls=":")
    top.set(ylabel="along the edge s, mm", ylim=(y[0], d.top), title=title)
    top.legend(loc="best", framealpha=0.85, edgecolor="none")
    figure.colorbar(mesh, ax=top, label="chip thickness / feed per tooth", pad=0.01)
    bottom.plot(d.turn, d.length, color=GREY, label="length of cut, mm")
    bottom.plot(d.turn, d.area, color=GREEN, label="chip area / feed per tooth, mm")
    bottom.set(xlabel=f"{d.axis}, degrees", xlim=(0, 360), xticks=range(0, 361, 30))
    bottom.set_ylim(bottom=0.0)
    bottom.legend(loc="best", framealpha=0.85, edgecolor="none")
    return figure


def _title(found: Engagement, name: str) -> str:
    place = f"block {found.block} at {found.at:g}" if found.block is not None else "engagement"
    return f"{name}: {place}, {found.method}" if name else f"{place}, {found.method}"
