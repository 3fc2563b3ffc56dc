"""Small pages of pictures and tables in the style of the report: rotary angles, machines, logged times, forces."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from vmachining.arrays import Floats
from vmachining.errors import InputError
from vmachining.job.files import make_folder, write_atomic, write_table
from vmachining.report.chart import Curve, Mark, chart
from vmachining.report.numbers import chip, number, plural
from vmachining.report.page import rendered

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vmachining.job.predict import Prediction
    from vmachining.job.times import Comparison
    from vmachining.machine import JointPath, Machine
    from vmachining.report.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True)
class Panel:
    """svg : our own trusted markup. head, rows : a table."""

    title: str
    svg: str = ""
    text: str = ""
    head: Sequence[str] = ()
    rows: Sequence[Sequence[Any]] = field(default_factory=tuple)


def picture(figure: Figure, words: str, *, kind: str = "svg") -> str:
    """A matplotlib figure as markup for a panel. words : what it shows. kind : "png" for many cells."""
    file = io.BytesIO()
    figure.savefig(file, format=kind, facecolor="white", metadata={"Date": None} if kind == "svg" else None)
    data = base64.b64encode(file.getvalue()).decode("ascii")
    return f'<img alt="{html.escape(words)}" src="data:image/{kind}{"+xml" * (kind == "svg")};base64,{data}">'


def html_name(path: Path, option: str) -> Path:
    """The path. InputError if its name does not end in .html."""
    if path.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{option} {path}: needs a name that ends in .html")
    return path


def write_page(
    path: Path,
    panels: Sequence[Panel],
    *,
    kind: str,
    name: str,
    subtitle: str,
    chips: Sequence[tuple[str, str]] = (),
    scene: Scene | None = None,
) -> None:
    """Write one page, whole or not at all. chips : (ok, warn, bad or "", words). scene : a view above the panels."""
    write_atomic(path, rendered(
        "figures.html.j2", None if scene is None else scene.payload(), scene=scene, kind=kind, name=name, subtitle=subtitle,
        panels=panels, chips=[chip(*words) for words in chips],
    ))  # fmt: skip


def write_joints(
    machine: Machine, path: JointPath, lines: Sequence[int], out: Path, *, name: str = "path"
) -> None:
    """Rotary angles of a posted path: curves with their travels, every rewind and pole. lines : (n,) line of every pose."""
    poses = np.arange(len(path.joints), dtype=np.float64)
    marks = [
        Mark(j.pose, f"line {lines[j.pose]}: {j.name} turns by {np.degrees(j.turn):.0f} degrees ({j.kind})")
        for j in path.jumps
    ]
    poles = np.flatnonzero(path.singular)
    panels = []
    for k in machine.rotary:
        axis, angle = machine.axes[k], np.degrees(path.joints[:, k])
        low, high = np.degrees([axis.lower, axis.upper])
        near = np.ptp(angle) + 90.0  # a travel far outside what is driven would flatten the curve
        inside = (angle.min() - near, angle.max() + near)
        levels = [(f"end of {axis.name}", end) for end in (low, high) if inside[0] <= end <= inside[1]]
        own = [m for m, j in zip(marks, path.jumps, strict=True) if j.name == axis.name]
        if k == machine.rotary[0]:
            own += [
                Mark(float(p), f"line {lines[p]}: the tool is parallel to {axis.name}", "muted")
                for p in poles[:: max(len(poles) // 200, 1)]
            ]
        travel = f"{low:g} to {high:g} degrees" if np.isfinite(low + high) else "no ends"
        curves = [Curve(f"{axis.name} of {machine.name}", poses, angle)]
        svg = chart(curves, x="pose", y="degrees", marks=own, levels=levels)
        panels.append(Panel(title=f"{axis.name} · travel: {travel}", svg=svg))
    rewinds = sum(j.kind == "rewind" for j in path.jumps)
    if path.jumps:
        panels.append(Panel(
            title="Where an axis turns far more than the tool",
            head=("pose", "line", "axis", "turns by, degrees", "tool turns by, degrees", "kind"),
            rows=[(j.pose, lines[j.pose], j.name, f"{np.degrees(j.turn):.1f}", f"{np.degrees(j.tool):.2f}", j.kind)
                  for j in path.jumps],
        ))  # fmt: skip
    write_page(
        out, panels, kind="rotary angles", name=name,
        subtitle=f"{machine.name} ({machine.chain}) · {len(poses)} poses, fewest rewinds over the whole path",
        chips=[("warn" if rewinds else "ok", f"{rewinds} rewinds"),
               ("warn" if len(path.jumps) > rewinds else "ok", f"{len(path.jumps) - rewinds} swings near a pole"),
               ("", f"{len(poles)} poses parallel to {machine.names[machine.rotary[0]]}")],
    )  # fmt: skip


def write_forces(found: Prediction, folder: Path | str, *, name: str = "") -> list[Path]:
    """Write forces.csv, forces.parquet (revolutions), force_stations.csv and forces.html: largest force and mean power at the
    stations over time, the forces over the turn with the largest one. The files written."""
    folder = Path(folder)
    make_folder(folder)
    paths = [folder / n for n in ("forces.csv", "forces.parquet", "force_stations.csv", "forces.html")]
    write_table(found.series, *paths[:2])
    write_table(found.stations, paths[2])
    s = found.stations.sort("time_s")
    worst = s.sort("peak_n", descending=True, nulls_last=True).row(0, named=True)
    mine = (pl.col("block") == worst["block"]) & (pl.col("at") == worst["at"])
    turn = found.series.filter(mine).sort("phi_deg")
    time, force, power = (s[column].to_numpy() for column in ("time_s", "peak_n", "power_w"))
    told = f"at block {worst['block']}, line {worst['line']}, {worst['at']:.3g} of its path"
    axes = (("fx_n", "along x"), ("fy_n", "along y"), ("fz_n", "along z"), ("resultant_n", "resultant"))
    curves = [Curve(label, turn["phi_deg"].to_numpy(), turn[column].to_numpy()) for column, label in axes]
    panels = [
        Panel(title="Largest force of a revolution", text=f"The largest is {number(worst['peak_n'], 5)} N, {told}.",
              svg=chart([Curve("force", time, force)], x="time, s", y="N", zero=True)),
        Panel(title="Mean power at the cutter", svg=chart([Curve("power", time, power)], x="time, s", y="W", zero=True)),
        Panel(title="Force on the tool over the revolution with the largest force", text=f"In workpiece axes, {told}.",
              svg=chart(curves, x="rotation of the first tooth, degrees", y="N")),
    ]  # fmt: skip
    if found.notes:
        panels.insert(0, Panel(title="Notes", head=("what",), rows=[(note,) for note in found.notes]))
    write_page(
        paths[3], panels, kind="forces", name=name or "Forces",
        subtitle="Forces on the tool of all teeth, at stations along the blocks",
        chips=[("", plural(len(found.stations), "station"))],
    )  # fmt: skip
    return paths


FEEDS = {"programmed_mm_min": "programmed", "reachable_mm_min": "reachable", "logged_mm_min": "logged"}

LATE_S = 1.0
"""Intervals from here on are listed, and shorter ones are drawn together: a log of a few entries a second does not
resolve them, and a mean feed over one of them says more of the clock of the log than of the machine."""


def write_times(found: Sequence[Comparison], out: Path) -> None:
    """Logs: feed as programmed, as reachable and as logged, tools, loads, and what was not compared."""
    panels = []
    for one in found:
        rows = one.blocks
        at = np.concatenate([[0.0], np.cumsum(rows["logged_s"].to_numpy().clip(min=0.0))])
        windows = mean_feeds(rows)
        edges = np.append(windows["at_s"].to_numpy(), at[-1])
        feeds = [
            Curve(words, edges, _closed(windows[name]), True, words == "programmed")
            for name, words in FEEDS.items()
        ]
        panels.append(Panel(
            title=f"{one.name}: mean feed over {LATE_S:.0f} s and more",
            svg=chart(feeds, x="logged time, s", y="mm/min", zero=True),
            text="Intervals with rapids or changes are left out. Programmed: at the overrides of the log.",
        ))  # fmt: skip
        if np.isfinite(rows["load"].to_numpy()).any():
            load = [Curve("load", at, _closed(rows["load"]), stepped=True)]
            svg = chart(load, x="logged time, s", y="of the log", zero=True)
            panels.append(Panel(title="Load of the spindle", svg=svg))
        parts = [(f"tool {t['tool']}", t["predicted_s"], t["logged_s"], t["error"]) for t in one.tools]
        parts.append(("whole", one.predicted_s, one.logged_s, one.error))
        panels.append(Panel(
            title="Predicted and logged", head=("", "predicted, s", "logged, s", "error"),
            rows=[(name, f"{told:.1f}", f"{took:.1f}", f"{100 * off:+.1f} %") for name, told, took, off in parts],
            text="; ".join(f"not compared: {s:.0f} s of {why}" for why, s in one.left_out.items()),
        ))  # fmt: skip
        late = rows.filter(pl.col("compared") & (pl.col("logged_s") > LATE_S))
        late = late.with_columns(off=pl.col("predicted_s") - pl.col("logged_s"))
        worst = late.sort(pl.col("off").abs(), descending=True).head(10)
        panels.append(Panel(
            title="Intervals that differ most", head=("lines", "tool", "predicted, s", "logged, s", "difference, s"),
            rows=[(f"{r['line']} to {r['until'] - 1}", r["tool"], f"{r['predicted_s']:.2f}", f"{r['logged_s']:.2f}",
                   f"{r['off']:+.2f}") for r in worst.iter_rows(named=True)],
        ))  # fmt: skip
    errors = [abs(one.error) for one in found]
    write_page(
        out, panels, kind="logged times", name=", ".join(one.name for one in found)[:80],
        subtitle=f"predicted {sum(one.predicted_s for one in found):.1f} s, logged {sum(one.logged_s for one in found):.1f} s",
        chips=[("ok" if max(errors) <= 0.02 else "warn", f"largest error of a program {100 * max(errors):.1f} %")],
    )  # fmt: skip


def mean_feeds(rows: pl.DataFrame) -> pl.DataFrame:
    """Mean feeds (mm/min) over windows of consecutive intervals with feeds that last `LATE_S` together: columns at_s
    (begin, in logged s) and those of `FEEDS`, NaN where an interval has no feed.

    Means are over the way: the length of a window divided by the time that it takes at each of the feeds.
    """
    keys, key, spent = [], -1, LATE_S
    for lasts, known in zip(rows["logged_s"].clip(0.0), rows["logged_mm_min"].is_finite(), strict=True):
        if not known or spent >= LATE_S:
            key, spent = key + 1, 0.0 if known else LATE_S
        keys.append(key)
        spent += lasts
    lasts = pl.col("logged_s").clip(0.0)
    way = pl.col("logged_mm_min") * lasts
    return (
        rows.with_columns(window=pl.Series(keys, dtype=pl.Int64), at_s=lasts.cum_sum() - lasts)
        .group_by("window", maintain_order=True)
        .agg(
            pl.col("at_s").first(), *((way.sum() / (way / pl.col(name)).sum()).alias(name) for name in FEEDS)
        )
    )


def _closed(column: pl.Series) -> Floats:
    """(k + 1,) values of steps; the last one ends where it began."""
    values = column.to_numpy()
    return np.append(values, values[-1:])
