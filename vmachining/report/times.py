"""Logged times as a page: feed as programmed, as reachable and as logged, tools, loads, and what was not compared."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import polars as pl

from vmachining.job.times import Comparison
from vmachining.report.chart import Curve, chart
from vmachining.report.figures import Panel, write_page

FEEDS = {"programmed_mm_min": "programmed", "reachable_mm_min": "reachable", "logged_mm_min": "logged"}

LATE_S = 1.0
"""Intervals from here on are listed, and shorter ones are drawn together: a log of a few entries a second does not
resolve them, and a mean feed over one of them says more of the clock of the log than of the machine."""


def write_times(found: Sequence[Comparison], out: Path) -> None:
    """A page of one or more logs."""
    panels = []
    for one in found:
        rows = one.blocks
        at = np.concatenate([[0.0], np.cumsum(rows["logged_s"].to_numpy().clip(min=0.0))])
        windows = mean_feeds(rows)
        edges = np.append(windows["at_s"].to_numpy(), at[-1])
        feeds = [
            Curve(words, edges, _closed(windows[name]), stepped=True, dashed=words == "programmed")
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
        worst = rows.filter(pl.col("compared") & (pl.col("logged_s") > LATE_S)).with_columns(
            off=(pl.col("predicted_s") - pl.col("logged_s"))
        )
        worst = worst.sort(pl.col("off").abs(), descending=True).head(10)
        panels.append(
            Panel(
                title="Intervals that differ most", head=("lines", "tool", "predicted, s", "logged, s", "difference, s"),
                rows=[(f"{r['line']} to {r['until'] - 1}", r["tool"], f"{r['predicted_s']:.2f}", f"{r['logged_s']:.2f}",
                       f"{r['off']:+.2f}") for r in worst.iter_rows(named=True)],
            )
        )  # fmt: skip
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


def _closed(column: pl.Series) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """(k + 1,) values of steps; the last one ends where it began."""
    values = column.to_numpy()
    return np.append(values, values[-1:])
