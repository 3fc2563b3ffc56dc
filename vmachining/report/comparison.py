"""Two results beside each other: before and after a schedule, two engines, two programs of one part. And `write_engines`: our
engines on one job, as engines.csv, engines.json and one page.

Rows are matched by where their motions end. Between two matched ends stand the same piece of the path on both sides, however
many blocks it has there: one and one as a rule, one and several where a scheduler divides, many and many where programs differ.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from vmachining.arrays import Bools, Floats, Ints
from vmachining.errors import InputError
from vmachining.interval import Interval
from vmachining.job.files import read_manifest, read_table, write_atomic, write_table
from vmachining.report.chart import Curve, chart
from vmachining.report.figures import Panel, picture, write_page
from vmachining.report.numbers import chip, duration, floats, number, percent, plural, share
from vmachining.report.page import rendered
from vmachining.report.paper.style import BLUE, canvas, look
from vmachining.report.payload import LOADS

PLACE = ("x_mm", "y_mm", "z_mm", "i", "j", "k")
SAME_MM = 1e-6
"""Ends of motions closer than this are one place."""

WORST = 10
EQUAL = ("time_s", "length_mm", "removed_mm3", "removed_lo_mm3", "removed_hi_mm3")


@dataclass(frozen=True, slots=True, eq=False)
class Side:
    """One result. name : how the page calls it. blocks : its table. removed : of all blocks, mm^3. about : what made it.

    proven : (n,) whether the interval of a block is proven; False where the table does not say.
    """

    name: str
    blocks: pl.DataFrame
    removed: Interval
    about: tuple[str, ...]
    proven: Bools

    @classmethod
    def of(cls, path: Path, name: str | None = None) -> Side:
        """A result directory, or a table of blocks.

        Raises InputError: No complete result, or no table of blocks.
        """
        about: tuple[str, ...] = ()
        file, total = path, None
        if path.is_dir():
            manifest = read_manifest(path)
            if manifest is None or not manifest.get("complete"):
                remedy = "give a directory that `run` has finished"
                raise InputError("no complete result", file=path, remedy=remedy)
            file, options = path / "blocks.parquet", manifest["options"]
            inputs = (f"{role} {entry['sha256'][:12]}" for role, entry in manifest["inputs"].items())
            about = (f"engine {options['engine']}", *inputs)
            s = json.loads((path / "summary.json").read_text(encoding="utf-8"))
            total = Interval(s["removed_lo_mm3"], s["removed_mm3"], s["removed_hi_mm3"], s["proven"])
        try:
            table = read_table(file)
            blocks = table.select(
                "block", "line", "text", "motion", *PLACE, *EQUAL, *(load for load, _, _ in LOADS)
            )
        except (OSError, pl.exceptions.PolarsError) as exc:
            remedy = "give a result directory, or its blocks.parquet or blocks.csv"
            raise InputError(
                f"no table of blocks: {str(exc).splitlines()[0]}", file=file, remedy=remedy
            ) from exc
        numbers = blocks.select(
            pl.col(*PLACE, *EQUAL).cast(pl.Float64, strict=False).is_finite().all(ignore_nulls=False)
        )
        if missing := [name for name in numbers.columns if not numbers[name][0]]:
            remedy = "give the table of a finished run"
            raise InputError(f"no values in some blocks of {', '.join(missing)}", file=file, remedy=remedy)
        proven = np.zeros(len(table), dtype=np.bool_)
        if table.schema.get("proven") == pl.Boolean:
            proven = table["proven"].fill_null(value=False).to_numpy()
        if total is None:
            lo, estimate, hi = (float(blocks[f"removed{end}_mm3"].sum()) for end in ("_lo", "", "_hi"))
            total = Interval(lo, estimate, hi, bool(proven.all()))
        return cls(name or path.name, blocks, total, about, proven)

    def sums(self, column: str, ends: Ints) -> Floats:
        """Of a column over the rows between ends (n + 1,)."""
        values = np.nan_to_num(self.blocks[column].fill_null(0.0).to_numpy())
        return np.diff(np.concatenate([[0.0], np.cumsum(values)])[ends])


@dataclass(frozen=True, slots=True, eq=False)
class Beside:
    """a, b : the results. ends_a, ends_b : (n + 1,) rows at which matched pieces end; piece k is ends[k] to ends[k + 1]."""

    a: Side
    b: Side
    ends_a: Ints
    ends_b: Ints

    @property
    def is_one_to_one(self) -> bool:
        return bool((np.diff(self.ends_a) == 1).all() and (np.diff(self.ends_b) == 1).all())

    @property
    def sides(self) -> tuple[tuple[Side, Ints], tuple[Side, Ints]]:
        """Both results with their ends."""
        return (self.a, self.ends_a), (self.b, self.ends_b)

    @property
    def seconds_of_each(self) -> tuple[float, float]:
        return float(self.a.blocks["time_s"].sum()), float(self.b.blocks["time_s"].sum())

    @property
    def volume(self) -> tuple[Floats, Floats, Floats]:
        """mm^3 that b removes more than a in every piece: lowest, estimate, highest."""
        (a_lo, a, a_hi), (b_lo, b, b_hi) = (
            [side.sums(f"removed{end}_mm3", ends) for end in ("_lo", "", "_hi")] for side, ends in self.sides
        )
        return b_lo - a_hi, b - a, b_hi - a_lo

    @property
    def differs(self) -> Any:
        """(n,) bool: pieces whose intervals exclude each other, beyond the rounding of sums."""
        low, _, high = self.volume
        slack = 1e-9 * max(self.a.removed.hi, self.b.removed.hi, 1e-300)
        return (low > slack) | (high < -slack)

    @property
    def proven(self) -> Bools:
        """(n,) whether the intervals of both sides are proven in all blocks of a piece: without that nothing differs for sure."""
        stated = [np.diff(np.concatenate([[0], np.cumsum(~side.proven)])[ends]) for side, ends in self.sides]
        return np.asarray((stated[0] == 0) & (stated[1] == 0))

    @property
    def seconds(self) -> Floats:
        """(n,) s that b takes longer than a."""
        return self.b.sums("time_s", self.ends_b) - self.a.sums("time_s", self.ends_a)

    def to_dict(self) -> dict[str, Any]:
        low, mid, high = _difference(self.a.removed, self.b.removed)
        return {
            "a": self.a.name, "b": self.b.name, "pieces": len(self.ends_a) - 1, "one_to_one": self.is_one_to_one,
            "blocks": [len(self.a.blocks), len(self.b.blocks)], "pieces_that_differ": int(self.differs.sum()),
            "pieces_that_differ_proven": int((self.differs & self.proven).sum()),
            "removed_difference_mm3": {"lo": low, "estimate": mid, "hi": high},
            "time_s": list(self.seconds_of_each),
        }  # fmt: skip


def compare_results(a: Side, b: Side) -> Beside:
    """Match two results by the ends of their motions."""
    places = [np.round(side.blocks.select(PLACE).to_numpy() / SAME_MM).astype(np.int64) for side in (a, b)]
    if np.array_equal(places[0], places[1]):
        ends = np.arange(len(places[0]) + 1)
        return Beside(a, b, ends, ends)
    one, other = ([row.tobytes() for row in np.ascontiguousarray(rows)] for rows in places)
    pairs = [
        (m.a + k + 1, m.b + k + 1)
        for m in SequenceMatcher(None, one, other, autojunk=False).get_matching_blocks()
        for k in range(m.size)
    ]
    ends = np.array(sorted({(0, 0), *pairs, (len(one), len(other))}))
    return Beside(a, b, ends[:, 0], ends[:, 1])


def _difference(a: Interval, b: Interval) -> tuple[float, float, float]:
    return b.lo - a.hi, b.estimate - a.estimate, b.hi - a.lo


def write_comparison(found: Beside, path: Path) -> None:
    """Write one page, whole or not at all."""
    a, b = found.a, found.b
    low, _, high = _difference(a.removed, b.removed)
    differ, pieces = int(found.differs.sum()), len(found.ends_a) - 1
    word = "block" if found.is_one_to_one else "piece"
    before, after = found.seconds_of_each
    same = low <= 0.0 <= high
    sure = _surely(differ == int((found.differs & found.proven).sum()))
    panels = [
        Panel(title="In short", text=" ".join(_words(found, differ, pieces, word, same)), rows=_totals(found),
              head=("", a.name, b.name, "difference")),
        *_curves(found),
        _table(found, f"Largest differences in removed volume, by {word}", np.abs(found.volume[1])),
        _table(found, f"Largest differences in time, by {word}", np.abs(found.seconds)),
    ]  # fmt: skip
    write_page(
        path, [panel for panel in panels if panel.rows or panel.svg], kind="comparison", name=f"{a.name} and {b.name}",
        subtitle=" · ".join(f"{side.name}: {', '.join(side.about) or 'a table of blocks'}" for side in (a, b)),
        chips=[("ok" if same else "warn", "removed volumes agree" if same else "removed volumes differ"),
               ("warn" if differ else "ok", f"{plural(differ, word)} {'differs' if differ == 1 else 'differ'} {sure}"),
               ("", f"time {percent(before, after)}")],
    )  # fmt: skip


def _words(found: Beside, differ: int, pieces: int, word: str, same: bool) -> list[str]:
    a, b = found.a, found.b
    low, mid, high = _difference(a.removed, b.removed)
    more = f"{number(abs(mid), 4)} mm³ {'more' if mid > 0 else 'less'} than" if mid else "as much as"
    before, after = found.seconds_of_each
    took, takes = (" ".join(duration(*pair)) for pair in ((before, after), (after, before)))
    sure = a.removed.proven and b.removed.proven
    lies = (
        "the true difference lies between" if sure else "by the intervals of both the difference lies between"
    )
    lines = [
        f"“{b.name}” removes {more} “{a.name}”; {lies} {number(low, 4)} and {number(high, 4)} mm³"
        + (", so the two agree within their brackets." if same else f", so the two differ {_surely(sure)}."),
        f"“{b.name}” takes {takes}, “{a.name}” {took} ({percent(before, after)}).",
    ]
    if found.is_one_to_one:
        lines.append("Every block of one has a counterpart in the other.")
    else:
        lines.append(
            f"{plural(len(a.blocks), 'block')} of “{a.name}” and {number(len(b.blocks))} of “{b.name}” are matched in "
            f"{plural(pieces, 'piece')} of the path that end at the same point."
        )
    lines.append(
        f"In {number(differ)} of {plural(pieces, word)} the two brackets do not overlap."
        if differ else f"There is no {word} whose two brackets do not overlap."
    )  # fmt: skip
    stated = [(side, int((~side.proven).sum())) for side in (a, b)]
    if any(count for _, count in stated):
        said = " and ".join(f"{plural(count, 'block')} of “{side.name}”" for side, count in stated if count)
        lines.append(f"The intervals of {said} are stated, not proven.")
    return lines


def _surely(proven: bool) -> str:
    return "for sure" if proven else "by intervals of which some are stated"


def _signed(value: float) -> str:
    return f"{value:+.4g}" if value else "0"


def _totals(found: Beside) -> list[tuple[str, ...]]:
    a, b = found.a, found.b
    low, mid, high = _difference(a.removed, b.removed)
    before, after = found.seconds_of_each
    told = (
        f"{number(v.estimate, 8)} ({number(v.lo, 8)} … {number(v.hi, 8)})" for v in (a.removed, b.removed)
    )
    rows = [
        ("Removed volume, mm³", *told, f"{_signed(mid)} ({_signed(low)} … {_signed(high)})"),
        ("Machining time", " ".join(duration(before, after)), " ".join(duration(after, before)), percent(before, after)),
        ("Blocks that move", number(len(a.blocks)), number(len(b.blocks)), f"{len(b.blocks) - len(a.blocks):+d}"),
    ]  # fmt: skip
    for name, label, unit in (("length_mm", "path", "mm"), *LOADS):
        if not (a.blocks[name].count() and b.blocks[name].count()):
            continue
        sums = name == "length_mm"
        one, other = (
            float((side.blocks[name].sum() if sums else side.blocks[name].max()) or 0.0)  # type: ignore[arg-type]
            for side in (a, b)
        )
        title = f"{'Path' if sums else f'Largest {label}'}{', ' if unit else ''}{unit}"
        rows.append((title, number(one, 6), number(other, 6), percent(one, other)))
    return rows


def _curves(found: Beside) -> list[Panel]:
    """Loads of both over the path, and what b removes more with its bracket."""
    a, b = found.a, found.b
    panels = []
    for name, label, unit in (("feed_mm_min", "Feed", "mm/min"), *LOADS[:4]):
        if not (a.blocks[name].count() and b.blocks[name].count()):
            continue
        curves = [Curve(side.name, _along(side), floats(side.blocks, name), stepped=True) for side in (a, b)]
        svg = chart(curves, x="path, mm", y=unit, zero=True, height=210)
        panels.append(Panel(title=label.capitalize(), svg=svg))
    x = _along(a)[found.ends_a[:-1].clip(max=len(a.blocks) - 1)]
    low, mid, high = found.volume
    words = (("difference", mid), ("at least", low), ("at most", high))
    curves = [Curve(word, x, y, stepped=True, dashed=y is not mid) for word, y in words]
    title = f"What “{b.name}” removes more than “{a.name}”, with its bracket"
    return [Panel(title=title, svg=chart(curves, x=f"path of “{a.name}”, mm", y="mm³", height=240)), *panels]


def _along(side: Side) -> Floats:
    """(n,) mm of path before every block."""
    length = np.nan_to_num(side.blocks["length_mm"].fill_null(0.0).to_numpy())
    return np.asarray(np.cumsum(length) - length)


def _table(found: Beside, title: str, weight: Floats) -> Panel:
    low, mid, high = found.volume
    seconds, differs, proven = found.seconds, found.differs, found.proven
    order = [k for k in np.argsort(-weight, kind="stable")[:WORST].tolist() if weight[k] > 0.0]
    rows = [
        (_piece(found.a, found.ends_a[k : k + 2]), _piece(found.b, found.ends_b[k : k + 2]), f"{_signed(mid[k])}",
         f"{_signed(low[k])} … {_signed(high[k])}",
         _surely(bool(proven[k])) if differs[k] else "within brackets", f"{_signed(seconds[k])}")
        for k in order
    ]  # fmt: skip
    head = (found.a.name, found.b.name, "removed, mm³", "between", "differs", "time, s")
    return Panel(title=title, head=head, rows=rows)


def _piece(side: Side, ends: Sequence[int] | Ints) -> str:
    """The blocks of one piece in words."""
    rows = side.blocks[int(ends[0]) : int(ends[1])]
    if not len(rows):
        return "nothing"
    first, last = rows.row(0, named=True), rows.row(-1, named=True)
    if len(rows) == 1:
        return f"block {first['block']}, line {first['line']}: {(first['text'] or '').strip()}"
    return f"blocks {first['block']} to {last['block']}, lines {first['line']} to {last['line']}"


MOST = 2000
"""Blocks on the page."""


def write_engines(told: Mapping[str, Any], folder: Path) -> None:
    """Write table and page of `EngineComparison.to_dict()` into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    write_table(pl.DataFrame(told["blocks"], infer_schema_length=None), folder / "engines.csv")
    write_atomic(folder / "engines.json", json.dumps(told, indent=1))
    names = [row["engine"] for row in told["engines"]]
    apart = [(set(each["engines"]), set(each["blocks"])) for each in told["disagreements"]]
    chips = [chip("ok", "the engines agree") if told["agrees"] else chip("bad", "the engines disagree")]
    for each in told["disagreements"]:
        text = f"{' and '.join(each['engines'])}: {plural(len(each['blocks']), 'block')} apart"
        chips.append(chip("bad" if each["proven"] else "warn", text))
    page = rendered(
        "engines.html.j2", None, name=told["job"],
        subtitle=f"{plural(len(told['blocks']), 'block')} that cut · all volumes in mm³", chips=chips,
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
