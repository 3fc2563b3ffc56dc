"""Key figures, tables and the honest part: what the template shows, made of a result."""

from __future__ import annotations

import base64
import hashlib
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import polars as pl

from vmachining.feed import UNITS
from vmachining.interval import Interval
from vmachining.job import RunResult, ScheduleReport
from vmachining.job.brep import disputes
from vmachining.job.files import versions, write_atomic
from vmachining.job.record import in_words
from vmachining.job.strategies import LOADS as STRATEGIES
from vmachining.report.design import deviation_of, worst_places
from vmachining.report.numbers import card, chip, difference, duration, number, percent, plural
from vmachining.report.paper.body import png
from vmachining.report.payload import LOADS, Payload, load_column, payload
from vmachining.report.thin import ThinMesh, thin_mesh
from vmachining.report.trust import checked, known, unknown, widest

MAX_ROWS = 500
"""Rows of one table on the page; the CSV has them all."""

PLOT_NOTE = (
    "One step per NC block. Click a step to mark its block; drag to zoom in, double click to zoom out."
)


def write_report(result: RunResult, path: Path) -> None:
    """Write the page of a result to `path`, whole or not at all."""
    blocks, surface = result.blocks, result.surface
    mesh = thin_mesh(surface.vertices, surface.triangles, surface.block)
    deviation = deviation_of(result, mesh)
    data = payload(result, blocks, mesh, deviation)
    schedule = result.schedule
    rows = blocks.filter(pl.col("warning").is_not_null()).select("block", "line", "text", "warning").rows()
    silent = [("–", line, text, message) for line, text, message in result.findings]
    warned = sorted([*rows, *silent], key=lambda row: row[1])
    drawn, count = number(data.rows), len(blocks)
    thinned = f" {drawn} of {number(count)} blocks are drawn, extremes kept." if data.rows < count else ""
    keys = result.job.keys
    stock = keys.stock.step or keys.stock.stl or ("a box" if keys.stock.box is not None else "a cylinder")
    about = (
        f"{keys.program.file} · {plural(len(result.job.tools), 'tool')} · stock: {stock} · all lengths in mm"
    )
    page = rendered(
        "page.html.j2", data, name=result.job.name, subtitle=about,
        picture=base64.b64encode(png(mesh.vertices, mesh.triangles)).decode("ascii"), chips=_chips(result, blocks),
        disputed=disputes(blocks)[:MAX_ROWS], cards=_cards(result, blocks), mapped=data.maps > 0, peaks=peaks(blocks),
        doubt=doubtful(blocks), loaded=loaded(blocks), load=load_column(blocks),
        view_note=_view_note(len(surface.triangles), mesh, data), plot_note=PLOT_NOTE + thinned,
        contact_notes=list(result.summary.get("contact_notes", [])),
        schedule=_schedule(result, schedule, blocks) if schedule else None, deviation=_deviation(result),
        places=[] if deviation is None else worst_places(mesh, deviation),
        tolerance=None if deviation is None else deviation.tolerance, design_note=result.summary.get("design_note"),
        warnings=warned[:MAX_ROWS], checked=checked(result), notes=result.summary["notes"],
        guesses=result.summary.get("guesses", []), tools=_tools(result, blocks),
        more_warnings=f"{len(warned) - MAX_ROWS} more in blocks.parquet." if len(warned) > MAX_ROWS else "",
        known=known(result), unknown=unknown(result), widest=widest(blocks), colophon=_colophon(result),
    )  # fmt: skip
    write_atomic(path, page)


@cache
def environment() -> jinja2.Environment:
    """Templates of this room; every word is escaped."""
    loader = jinja2.PackageLoader("vmachining", "report")
    return jinja2.Environment(loader=loader, autoescape=True, undefined=jinja2.StrictUndefined)


def rendered(template: str, data: Payload | None, *, script: str = "report.js", **words: Any) -> str:
    """A page with its style, its code (of `static`) and what it draws; every word is escaped."""
    room = files("vmachining.report")
    css, code = ((room / name).read_text(encoding="utf-8") for name in ("page.css", f"static/{script}"))
    policy = f"sha256-{base64.b64encode(hashlib.sha256(code.encode()).digest()).decode()}"
    drawn = "" if data is None else data.text
    return (
        environment()
        .get_template(template)
        .render(css=css, js=code, policy=policy, data=drawn, **{"live": False} | words)
    )


def _tools(result: RunResult, blocks: pl.DataFrame) -> list[tuple[str, ...]]:
    """Sums per tool, and of all when there are several."""
    known = {tool["number"]: tool for tool in result.job.keys.tools}
    scheduled = result.schedule is not None
    whole = _sums(blocks, scheduled, result.removed.error)  # narrower than the sum of the blocks
    if len(known) == 1:
        return [(_tool_name(*known.values()), *whole)]
    rows = [
        (_tool_name(known[n]), *_sums(blocks.filter(pl.col("tool") == n), scheduled)) for n in sorted(known)
    ]
    return [*rows, ("all", *whole)]


def _tool_name(keys: dict[str, Any]) -> str:
    size = f" {keys['diameter_mm']:g} mm" if "diameter_mm" in keys else ""
    corner = f", corner {keys['corner_radius_mm']:g} mm" if "corner_radius_mm" in keys else ""
    name = f" “{keys['name']}”" if keys.get("name") else ""
    return f"T{keys['number']} {keys['type']}{size}{corner}{name}"


def _sums(rows: pl.DataFrame, scheduled: bool, error: float | None = None) -> tuple[str, ...]:
    cut = rows.filter(pl.col("removed_mm3") > 0)
    lo, removed, hi = (float(rows[f"removed_{end}mm3"].sum()) for end in ("lo_", "", "hi_"))
    error = Interval(lo, removed, hi).error if error is None else error
    largest = float(cut["mrr_mm3_min"].max() or 0.0)  # type: ignore[arg-type]
    times = [rows["time_s"], rows["scheduled_time_s"]] if scheduled else [rows["time_s"]]
    way, *spent = (f"{float(one.sum()):,.1f}".replace(",", "\u202f") for one in (cut["length_mm"], *times))
    return (number(len(cut)), way, number(removed, 7), number(error, 2), number(largest, 5), *spent)


def _chips(result: RunResult, blocks: pl.DataFrame) -> list[dict[str, str]]:
    summary = result.summary
    chips = [chip("ok", f"complete: {plural(summary['blocks'], 'block')}")]
    if count := summary["warnings"]:
        chips.append(chip("warn", plural(count, "warning")))
    else:
        chips.append(
            chip("warn", "see the note on all volumes") if summary["notes"] else chip("ok", "no warnings")
        )
    if guessed := summary.get("guesses"):
        chips.append(chip("warn", f"{plural(len(guessed), 'line')} of the job guessed"))
    fine = f"chord {result.job.keys.accuracy.chord_mm:g} mm"
    fine = f"width {100 * summary['width']:.3g} %" if result.stock.name == "columns" else fine
    chips.append(chip("", f"{result.stock.name} engine, {fine}"))
    if stated := summary["stated_blocks"]:
        chips.append(chip("warn", f"{plural(stated, 'block')} stated, not proven"))
    if result.schedule:
        chips.append(chip("ok", "schedule simulated again"))
    second = _second_chip(summary["brep"], (summary.get("second_judge") or {}).get("blocks", 0))
    return [second, *chips] if summary["brep"]["disputed"] else [*chips, second]


def _second_chip(counts: dict[str, Any], judged: int) -> dict[str, str]:
    """What the B-rep engine said, in a word; what exact rays said where it was not asked. judged : blocks that these saw."""
    asked, good = counts["asked"], counts["agreed"] + counts["retried"]
    if counts["disputed"]:
        return chip("bad", f"DISPUTED: {plural(counts['disputed'], 'block')}")
    if not asked and judged:
        return chip("ok", f"a second engine agrees on {plural(judged, 'block')}")
    if not asked:
        return chip("", "not certified by a second engine")
    return chip("ok" if good == asked else "warn", f"B-rep agreed on {good} of {asked} blocks")


def _cards(result: RunResult, blocks: pl.DataFrame) -> list[dict[str, str]]:
    s = result.summary
    relative = 100 * result.removed.error / s["removed_mm3"] if s["removed_mm3"] > 0 else 0.0
    cut = blocks.filter(pl.col("removed_mm3") > 0)
    value, unit = duration(s["time_s"], s["scheduled_time_s"])
    between = f"{number(s['removed_lo_mm3'])} … {number(s['removed_hi_mm3'])} (±{relative:.2g}\u00a0%)"
    if len(cut):  # which the total does not tell
        half = (cut["removed_hi_mm3"] - cut["removed_lo_mm3"]) / cut["removed_mm3"] / 2
        between += f"; single blocks ±{100 * float(half.median()):.2g}\u00a0% in the median"  # type: ignore[arg-type]
    limited = result.job.keys.machine.max_acceleration_mm_s2
    times = "with the acceleration limit" if limited else "ideal: no acceleration limit given"
    cards = [
        card("Removed volume", number(s["removed_mm3"]), "mm³", between),
        card("Final stock", number(s["final_mm3"]), "mm³", f"of {number(s['stock_mm3'])} mm³ at the start"),
        card("Machining time", value, unit, times),
    ]
    if s["scheduled_time_s"] is not None:
        value, unit = duration(s["scheduled_time_s"], s["time_s"])
        less = percent(s["time_s"], s["scheduled_time_s"])
        cards.append(card("Scheduled time", value, unit, f"{less}, read back and simulated"))
    for label, size, block, line, second, _ in peaks(blocks)[:1]:
        value, _, unit = size.rpartition(" ")
        place = f"block {block}, line {line}, after {second}."
        cards.append(card(f"Largest {label}", value, unit, place, block=str(block)))
    idle = number(s["blocks"] - len(cut))
    return [*cards, card("Blocks", number(s["blocks"]), "", f"{number(len(cut))} cut, {idle} remove nothing")]


def _view_note(triangles: int, mesh: ThinMesh, data: Payload) -> str:
    note = f"{number(triangles)} triangles; grey is uncut stock."
    if mesh.cell:
        note = (
            f"Drawn with {number(len(mesh.triangles))} of {number(triangles)} triangles (vertices merged "
            f"within {mesh.cell:.3g} mm, for the picture only); grey is uncut stock."
        )
    if data.stride > 1:
        note += f" One motion in {data.stride} of the tool path is drawn."
    return note + " Drag to turn, wheel to zoom; click a face or the path to mark its block. " + data.played


def _schedule(result: RunResult, schedule: ScheduleReport, blocks: pl.DataFrame) -> dict[str, Any]:
    s, feed = result.summary, result.job.keys.feed
    before = blocks["mrr_mm3_min"].fill_null(0.0).to_numpy()
    after = np.nan_to_num(schedule.after_rate)
    took, takes = s["time_s"], s["scheduled_time_s"]
    rates = (f"{number(rate.max())} mm³/min" for rate in (before, after))
    volumes = (f"{number(volume, 8)} mm³" for volume in (s["removed_mm3"], schedule.removed_mm3))
    apart = difference(schedule.removed_mm3 - s["removed_mm3"], s["stock_mm3"])
    rows = [
        ("Machining time", *(" ".join(duration(*pair)) for pair in ((took, takes), (takes, took))), percent(took, takes)),
        ("Largest volume rate of a block", *rates, percent(before.max(), after.max())),
        ("Blocks that move", number(s["blocks"]), number(schedule.blocks), f"{schedule.blocks - s['blocks']:+d}"),
        ("Removed volume", *volumes, apart),
    ]  # fmt: skip
    named = blocks.select("block", "line", "text", "scheduled_feed_mm_min").iter_rows()
    limited = [(*row[:3], word, number(row[3])) for row in named if (word := schedule.limits.get(row[0]))]
    return {
        "text": schedule.text, "rows": rows, "compared": compared(schedule.comparison), "limited": limited[:MAX_ROWS],
        "note": f"{schedule.note[0].upper()}{schedule.note[1:]}." if schedule.note else "",
        "force_load": "{} {}".format(*UNITS[feed.component if feed else "resultant"]),
        "limits": [{"count": count, "name": name} for name, count in sorted(schedule.tally.items())],
        "more": f"{len(limited) - MAX_ROWS} more in blocks.parquet." if len(limited) > MAX_ROWS else "",
    }  # fmt: skip


def _deviation(result: RunResult) -> list[tuple[str, str]] | None:
    """Rows about the design; None where nothing was measured against one."""
    told = result.summary.get("deviation")
    if told is None:
        return None
    share = told["within_tolerance"]
    rows = [
        ("largest overcut", f"{told['max_overcut_mm']:.4g} mm"),
        ("largest undercut", f"{told['max_undercut_mm']:.4g} mm"),
        ("within tolerance", "–" if share is None else f"{100.0 * share:.2f} % (± {told['tolerance_mm']:g} mm)"),
        ("vectors", f"{number(told['upright_vectors'])} upright at {told['pitch_mm']:.3g} mm, "
         f"{number(told['normal_vectors'])} along normals at {told['spacing_mm']:.3g} mm"),
    ]  # fmt: skip
    for key, text in (
        ("consumed", "vectors inside of a sweep from end to end: more is gone than they measure"),
        ("entered_from_behind", "times that a sweep reached a vector from behind, which leaves its length"),
        ("cut_beneath", "vectors that a cut crosses beneath their surface, which do not count as overcut"),
        ("part_outside_stock", "places where the design has no stock above it"),
    ):
        if told[key]:
            rows.append((number(told[key]), text))
    return rows


def _colophon(result: RunResult) -> list[tuple[str, str]]:
    s, inputs = result.summary, result.inputs.items()
    lines = [(role, f"{Path(entry['file']).name}  sha256 {entry['sha256'][:16]}…") for role, entry in inputs]
    if (machine := s.get("machine")) is not None:
        lines.append(("machine", f"{machine['name']}: {', '.join(machine['rotary'])}"))
    took = f"{s['seconds']:.3g} s: {in_words(s['stage_seconds'])}; peak memory {s['peak_mb']:.0f} MB"
    made = ", ".join(f"{name} {version}" for name, version in versions().items())
    return [*lines, ("computed in", took), ("made with", made)]


MOST_MM3_MIN = 2e7
"""Removal rates beyond it are questioned: large machines for aluminium reach about half of it."""

MOST = 10
"""Blocks in the table of the most loaded ones."""


def peaks(blocks: pl.DataFrame) -> list[tuple[Any, ...]]:
    """Largest value of every load: name, value with unit, block, line, s into the program, program text."""
    begin = blocks["time_s"].fill_null(0.0).cum_sum() - blocks["time_s"].fill_null(0.0)
    rows = []
    for name, label, unit in LOADS:
        if name.endswith("feed_mm_min") or name == "engaged_fraction" or not blocks[name].count():
            continue
        at = int(blocks[name].fill_null(-1.0).arg_max() or 0)
        row = blocks.row(at, named=True)
        value, second = f"{number(row[name], 5)} {unit}", "{} {}".format(*duration(float(begin[at])))
        rows.append((label, value, row["block"], row["line"], second, row["text"].strip()))
    return rows


def doubtful(blocks: pl.DataFrame) -> str:
    """A question where a block removes more than machines do; empty where none does."""
    odd = blocks.filter(pl.col("mrr_mm3_min") > MOST_MM3_MIN).sort("mrr_mm3_min", descending=True)
    if not len(odd):
        return ""
    block, line, rate = odd.select("block", "line", "mrr_mm3_min").row(0)
    return (
        f"{plural(len(odd), 'block')} would remove more than {number(MOST_MM3_MIN)} mm³/min, which no milling machine does: "
        f"block {block} (line {line}) {number(rate, 3)} mm³/min. Check the feed and its unit."
    )


def loaded(blocks: pl.DataFrame) -> list[tuple[Any, ...]]:
    """The blocks with the largest load: block, line, program text, load, removal rate (once), ap, ae."""
    name, _, _ = load_column(blocks)
    top = blocks.filter(pl.col(name) > 0).top_k(MOST, by=name).sort([name, "block"], descending=[True, False])
    loads = dict.fromkeys((name, "mrr_mm3_min", "ap_mm", "ae_mm"))
    return [
        (row["block"], row["line"], row["text"].strip(), *(number(row[load], 4) for load in loads))
        for row in top.iter_rows(named=True)
    ]


def compared(comparison: pl.DataFrame) -> list[tuple[str, ...]]:
    rows = []
    for row in comparison.iter_rows(named=True):
        goal = "–" if row["reference"] is None else f"{number(row['reference'], 5)} {row['unit']}"
        names = (
            (f"{name}_{kind}", digits) for name in STRATEGIES for kind, digits in (("peak", 5), ("spread", 3))
        )
        title = row["strategy"].replace("_", " ") + (" (asked for)" if row["asked_for"] else "")
        times = (number(row[name], 5) for name in ("time_s", "machine_time_s"))
        loads = (number(row[name], digits) for name, digits in names)
        rows.append((title, goal, row["judged"], *times, str(row["inserted"]), *loads))
    return rows
