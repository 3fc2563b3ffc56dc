"""Engines beside each other: engines.csv, engines.json and one page."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import jinja2
import plotly.graph_objects as go
import polars as pl

from vmachining.job.files import atomic_path, write_atomic
from vmachining.report.figures import FONT
from vmachining.report.numbers import number, plural, share, trusted

__all__ = ["engine_figure", "write_engines"]

MOST = 2000
"""Blocks on the page."""


def write_engines(told: Mapping[str, Any], folder: Path) -> None:
    """Write table and page of `EngineComparison.to_dict()` into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    with atomic_path(folder / "engines.csv") as temporary:
        pl.DataFrame(told["blocks"], infer_schema_length=None).write_csv(temporary)
    write_atomic(folder / "engines.json", json.dumps(told, indent=1))
    names = [row["engine"] for row in told["engines"]]
    apart = [(set(each["engines"]), set(each["blocks"])) for each in told["disagreements"]]
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    room = files("vmachining.report")
    page = environment.from_string((room / "engines.html.j2").read_text(encoding="utf-8")).render(
        name=told["job"],
        subtitle=f"{plural(len(told['blocks']), 'block')} that cut · all volumes in mm³",
        css=trusted((room / "page.css").read_text(encoding="utf-8")),
        chips=_chips(told),
        heads=["blocks", "removed mm³", "ms a block", "width", "off", "proven", "disagrees"],
        engines=[{"name": row["engine"], "cells": _cells(row)} for row in told["engines"]],
        refused=[f"{row['engine']}: {row['refused']}" for row in told["engines"] if row["refused"]],
        figure=trusted(engine_figure(told["engines"]).to_html(include_plotlyjs=True, full_html=False)),
        names=names,
        blocks=[_block(row, names, apart) for row in told["blocks"][:MOST]],
        left=max(0, len(told["blocks"]) - MOST),
    )
    write_atomic(folder / "engines.html", page)


def engine_figure(rows: Sequence[Mapping[str, Any]]) -> go.Figure:
    """Median width of the intervals over the time of a block, both logarithmic; filled: proven."""
    figure = go.Figure()
    shown = [row for row in rows if row["width"] and row["ms_per_block"]]
    for k, row in enumerate(sorted(shown, key=lambda row: float(row["ms_per_block"]))):
        beside = ("top center", "bottom center")[k % 2]  # neighbours in time do not write over each other
        symbol = "circle" if row["proven"] == row["blocks"] else "circle-open"
        figure.add_trace(
            go.Scatter(
                x=[row["ms_per_block"]], y=[100.0 * row["width"]], mode="markers+text", text=[row["engine"]],
                textposition=beside, marker={"size": 13, "symbol": symbol, "line": {"width": 2}}, name=row["engine"],
                showlegend=False,
            )
        )  # fmt: skip
    figure.update_layout(
        font=FONT, height=420, margin={"l": 60, "r": 20, "t": 20, "b": 50},
        xaxis={"type": "log", "dtick": 1, "exponentformat": "power", "title": {"text": "ms of a processor per block"}},
        yaxis={
            "type": "log", "dtick": 1, "exponentformat": "power",
            "title": {"text": "median width of the interval, % (filled: proven)"},
        },
    )  # fmt: skip
    return figure


def _chips(told: Mapping[str, Any]) -> list[dict[str, str]]:
    """The verdict, and what needs a look."""
    chips = [
        {"kind": "ok", "text": "the engines agree"}
        if told["agrees"]
        else {"kind": "bad", "text": "the engines disagree"}
    ]
    for each in told["disagreements"]:
        text = f"{' and '.join(each['engines'])}: {plural(len(each['blocks']), 'block')} apart"
        chips.append({"kind": "bad" if each["proven"] else "warn", "text": text})
    return chips


def _cells(row: Mapping[str, Any]) -> list[str]:
    width, off = (share(row[name]) for name in ("width", "off"))
    return [
        number(row["blocks"]), number(row["removed_mm3"]), number(row["ms_per_block"], 3), width, off,
        number(row["proven"]), number(row["disagrees"]),
    ]  # fmt: skip


def _block(
    row: Mapping[str, Any], names: Sequence[str], apart: Sequence[tuple[set[str], set[int]]]
) -> dict[str, Any]:
    cells = []
    for name in names:
        value, lo, hi = (row[f"{name}_{part}"] for part in ("mm3", "lo_mm3", "hi_mm3"))
        bad = any(name in pair and row["block"] in blocks for pair, blocks in apart)
        half = None if value is None else 0.5 * (hi - lo)
        cells += [
            {"text": number(value, 6), "apart": bad},
            {"text": number(half, 2), "apart": False},
            {"text": number(1e3 * row[f"{name}_s"], 3), "apart": False},
        ]
    return {"block": row["block"], "line": row["line"], "text": row["text"], "cells": cells}
