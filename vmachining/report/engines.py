"""Engines compared: engines.csv, engines.json and one page."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import polars as pl

from vmachining.job.files import write_atomic, write_table
from vmachining.report.figures import picture
from vmachining.report.numbers import chip, number, plural, share
from vmachining.report.page import rendered
from vmachining.report.paper.style import BLUE, canvas, look

MOST = 2000
"""Blocks on the page."""


def write_engines(told: Mapping[str, Any], folder: Path) -> None:
    """Write table and page of `EngineComparison.to_dict()` into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    write_table(pl.DataFrame(told["blocks"], infer_schema_length=None), folder / "engines.csv")
    write_atomic(folder / "engines.json", json.dumps(told, indent=1))
    names = [row["engine"] for row in told["engines"]]
    apart = [(set(each["engines"]), set(each["blocks"])) for each in told["disagreements"]]
    page = rendered(
        "engines.html.j2", None, name=told["job"],
        subtitle=f"{plural(len(told['blocks']), 'block')} that cut · all volumes in mm³", chips=_chips(told),
        heads=["blocks", "removed mm³", "ms a block", "width", "off", "proven", "disagrees"],
        engines=[{"name": row["engine"], "cells": [
            number(row["blocks"]), number(row["removed_mm3"]), number(row["ms_per_block"], 3), share(row["width"]),
            share(row["off"]), number(row["proven"]), number(row["disagrees"]),
        ]} for row in told["engines"]],
        refused=[f"{row['engine']}: {row['refused']}" for row in told["engines"] if row["refused"]],
        figure=engine_figure(told["engines"]), names=names,
        blocks=[_block(row, names, apart) for row in told["blocks"][:MOST]], left=max(0, len(told["blocks"]) - MOST),
    )  # fmt: skip
    write_atomic(folder / "engines.html", page)


def engine_figure(rows: Sequence[Mapping[str, Any]]) -> str:
    """Median width of the intervals over the time of a block, both logarithmic; filled: proven. Markup."""
    shown = [row for row in rows if row["width"] and row["ms_per_block"]]
    words = "; ".join(f"{row['engine']} {row['ms_per_block']:.3g} ms, {share(row['width'])}" for row in shown)
    with look():
        figure = canvas(174.0, 84.0)
        axes = figure.subplots()
        axes.set(
            xscale="log",
            yscale="log",
            xlabel="ms of a processor per block",
            ylabel="median width of the interval, %",
        )
        for k, row in enumerate(sorted(shown, key=lambda row: float(row["ms_per_block"]))):
            at = row["ms_per_block"], 100.0 * row["width"]
            proven = row["proven"] == row["blocks"]
            axes.plot(*at, "o", ms=8, color=BLUE, mfc=BLUE if proven else "none", mew=1.5)
            # neighbours in time do not write over each other
            axes.annotate(row["engine"], at, (0, (9, -15)[k % 2]), textcoords="offset points", ha="center")
        axes.margins(0.12, 0.25)
        return picture(figure, f"Time of a block and width of its interval by engine: {words}")


def _chips(told: Mapping[str, Any]) -> list[dict[str, str]]:
    chips = [chip("ok", "the engines agree") if told["agrees"] else chip("bad", "the engines disagree")]
    for each in told["disagreements"]:
        text = f"{' and '.join(each['engines'])}: {plural(len(each['blocks']), 'block')} apart"
        chips.append(chip("bad" if each["proven"] else "warn", text))
    return chips


def _block(
    row: Mapping[str, Any], names: Sequence[str], apart: Sequence[tuple[set[str], set[int]]]
) -> dict[str, Any]:
    cells = []
    for name in names:
        value, lo, hi = (row[f"{name}_{part}"] for part in ("mm3", "lo_mm3", "hi_mm3"))
        bad = any(name in pair and row["block"] in blocks for pair, blocks in apart)
        half = None if value is None else 0.5 * (hi - lo)
        words = number(value, 6), number(half, 2), number(1e3 * row[f"{name}_s"], 3)
        cells += [{"text": text, "apart": bad and k == 0} for k, text in enumerate(words)]
    return {"block": row["block"], "line": row["line"], "text": row["text"], "cells": cells}
