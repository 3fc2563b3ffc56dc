"""Key figures, tables and the honest part: what the template shows, made of a result."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import polars as pl
from plotly.offline import get_plotlyjs

from vmachining.feed import UNITS
from vmachining.geometry import Arc, Bracket
from vmachining.job import RunResult, ScheduleReport
from vmachining.job.brep import disputes
from vmachining.job.files import versions, write_atomic
from vmachining.nc import Motion
from vmachining.report.contact import compared, contact_facts
from vmachining.report.figures import PathPiece, along_program, contact_along, stock_view
from vmachining.report.numbers import difference, duration, number, percent, plural, trusted
from vmachining.report.thin import MAX_POINTS, ThinMesh, thin_mesh
from vmachining.report.trust import checked, known, unknown, widest
from vmachining.sweep import Turn

__all__ = ["write_report"]

MAX_ROWS = 500
"""Rows of one table on the page; the CSV has them all."""
MAX_PATH_POINTS = 200_000


def write_report(result: RunResult, path: Path) -> None:
    """Write the page of a result to `path`, whole or not at all."""
    blocks = result.blocks
    surface = result.surface
    mesh = thin_mesh(surface.vertices, surface.triangles, surface.block)
    pieces, stride = _path_pieces(result, blocks)
    stock = stock_view(mesh, pieces)
    schedule = result.schedule
    plots = along_program(blocks, schedule.after_rate if schedule else None)
    contact = contact_along(blocks)
    payload = (
        '{"stock":' + str(stock.to_json()) + ',"plots":' + str(plots.to_json()) + ',"cut_trace":1,'
        f'"contact":{contact.to_json() if contact is not None else "null"},'
        f'"face_block":{json.dumps(_packed(mesh.block[mesh.block >= 0].astype("<i4")))},'
        f'"block_rate":{json.dumps(_packed(_rates(blocks["mrr_mm3_min"].fill_null(0.0).to_numpy())))},'
        f'"block_rate_after":{json.dumps(_packed(_rates(schedule.after_rate)) if schedule else None)}}}'
    )
    warned = _warnings(result, blocks)
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    room = files("vmachining.report")
    template = environment.from_string((room / "page.html.j2").read_text(encoding="utf-8"))
    page = template.render(
        name=result.job.name,
        subtitle=_subtitle(result),
        css=trusted((room / "page.css").read_text(encoding="utf-8")),
        js=trusted((room / "page.js").read_text(encoding="utf-8")),
        plotly=trusted(get_plotlyjs()),
        figures=trusted(_json_in_html(payload)),
        chips=_chips(result, blocks),
        disputed=disputes(blocks)[:MAX_ROWS],
        cards=_cards(result, blocks),
        view_note=_view_note(len(surface.triangles), mesh, stride),
        plot_note=_plot_note(len(blocks)),
        contact=contact_facts(blocks, result.summary.get("contact_notes", []), drawn=contact is not None),
        schedule=_schedule(result, schedule, blocks) if schedule else None,
        deviation=_deviation(result),
        design_note=result.summary.get("design_note"),
        warnings=warned[:MAX_ROWS],
        checked=checked(result),
        notes=result.summary["notes"],
        tools=_tools(result, blocks),
        more_warnings=f"{len(warned) - MAX_ROWS} more in blocks.csv." if len(warned) > MAX_ROWS else "",
        known=known(result),
        unknown=unknown(result),
        widest=widest(blocks),
        colophon=_colophon(result),
    )
    write_atomic(path, page)


def _json_in_html(text: str) -> str:
    """JSON inside a script element: no character that could end the element survives."""
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _packed(array: np.ndarray[Any, Any]) -> str:
    return base64.b64encode(array.tobytes()).decode("ascii")


def _rates(column: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Volume rate by block number, as the page looks it up; 0 where there is none."""
    return np.asarray(np.nan_to_num(np.asarray(column, dtype="<f4")))


def _warnings(result: RunResult, blocks: pl.DataFrame) -> list[tuple[Any, ...]]:
    """block, line, text, message of rows that warn, and of lines without a row."""
    rows = blocks.filter(pl.col("warning").is_not_null()).select("block", "line", "text", "warning")
    silent = [("–", line, text, message) for line, text, message in result.findings]
    return sorted([*rows.iter_rows(), *silent], key=lambda row: row[1])


def _tools(result: RunResult, blocks: pl.DataFrame) -> list[tuple[str, ...]]:
    """Sums per tool, and of all when there are several."""
    known = {tool["number"]: tool for tool in result.job.keys.tools}
    scheduled = result.schedule is not None
    groups = [(n, blocks.filter(pl.col("tool") == n)) for n in sorted(known)]
    whole = result.removed.error  # narrower than the sum of the blocks
    if len(groups) == 1:
        return [(_tool_name(known[groups[0][0]]), *_sums(blocks, scheduled, whole))]
    rows = [(_tool_name(known[n]), *_sums(part, scheduled)) for n, part in groups]
    return [*rows, ("all", *_sums(blocks, scheduled, whole))]


def _tool_name(keys: dict[str, Any]) -> str:
    size = f" {keys['diameter_mm']:g} mm" if "diameter_mm" in keys else ""
    corner = f", corner {keys['corner_radius_mm']:g} mm" if "corner_radius_mm" in keys else ""
    name = f" “{keys['name']}”" if keys.get("name") else ""
    return f"T{keys['number']} {keys['type']}{size}{corner}{name}"


def _sums(rows: pl.DataFrame, scheduled: bool, error: float | None = None) -> tuple[str, ...]:
    cut = rows.filter(pl.col("removed_mm3") > 0)
    if error is None:
        error = Bracket(*(float(rows[f"removed_{end}mm3"].sum()) for end in ("lo_", "", "hi_"))).error
    largest = float(cut["mrr_mm3_min"].fill_null(0.0).max() or 0.0) if len(cut) else 0.0  # type: ignore[arg-type]
    times = ["time_s", "scheduled_time_s"] if scheduled else ["time_s"]
    return (
        number(len(cut)),
        f"{float(cut['length_mm'].sum()):,.1f}".replace(",", "\u202f"),
        number(float(rows["removed_mm3"].sum()), 7),
        number(error, 2),
        number(largest, 5),
        *(f"{float(rows[name].sum()):,.1f}".replace(",", "\u202f") for name in times),
    )


def _path_pieces(result: RunResult, blocks: pl.DataFrame) -> tuple[list[PathPiece], int]:
    """Polylines of the path and the stride that kept their number of points drawable."""
    toolpath = result.toolpath
    moves = [
        (move, path)
        for move, path in zip(toolpath.moves, toolpath.paths, strict=True)
        if move.motion is not Motion.DWELL
    ]
    hits = set(
        blocks.filter(pl.col("warning").str.contains("rapid", literal=True).fill_null(False))[
            "line"
        ].to_list()
    )
    stride = max(1, len(moves) * 3 // MAX_PATH_POINTS)

    def pieces() -> Iterator[PathPiece]:
        kind, points = "", [np.empty((0, 3))]
        for move, path in moves[::stride]:
            rapid = move.motion is Motion.RAPID
            now = ("hit" if move.line in hits else "rapid") if rapid else "feed"
            if now != kind or stride > 1:
                if kind:
                    yield kind, np.concatenate(points)
                kind, points = now, [np.array([move.start])]
            steps = 1
            if isinstance(path, Arc):
                steps = max(2, int(np.ceil(abs(path.angle) / 0.1)))
            elif isinstance(path, Turn) and not path.is_straight:
                steps = 8
            points.append(path.position(np.linspace(0, 1, steps + 1)[1:]))
        if kind:
            yield kind, np.concatenate(points)

    return list(pieces()), stride


def _subtitle(result: RunResult) -> str:
    keys = result.job.keys
    kind = next(name for name in ("box", "cylinder", "step", "stl") if getattr(keys.stock, name) is not None)
    stock = {"box": "a box", "cylinder": "a cylinder", "step": keys.stock.step, "stl": keys.stock.stl}[kind]
    return (
        f"{keys.program.file} · {plural(len(result.job.tools), 'tool')} · stock: {stock} · all lengths in mm"
    )


def _chips(result: RunResult, blocks: pl.DataFrame) -> list[dict[str, str]]:
    summary = result.summary
    chips = [{"kind": "ok", "text": f"complete: {plural(summary['blocks'], 'block')}"}]
    count = summary["warnings"]
    chips.append(
        {"kind": "warn", "text": plural(count, "warning")}
        if count
        else {"kind": "warn", "text": "see the note on all volumes"}
        if summary["notes"]
        else {"kind": "ok", "text": "no warnings"}
    )
    chips.append({"kind": "", "text": f"{result.stock.name} engine, {_asked(result)}"})
    if result.schedule:
        chips.append({"kind": "ok", "text": "schedule simulated again"})
    second = _second_chip(summary["brep"])
    return [second, *chips] if summary["brep"]["disputed"] else [*chips, second]


def _asked(result: RunResult) -> str:
    """The knob of the engine."""
    if result.stock.name == "columns":
        return f"width {100 * result.summary['width']:.3g} %"
    return f"chord {result.job.keys.accuracy.chord_mm:g} mm"


def _second_chip(counts: dict[str, Any]) -> dict[str, str]:
    """What the B-rep engine said, in a word."""
    asked, good = counts["asked"], counts["agreed"] + counts["retried"]
    if counts["disputed"]:
        return {"kind": "bad", "text": f"DISPUTED: {plural(counts['disputed'], 'block')}"}
    if not asked:
        return {"kind": "", "text": "not certified by a second engine"}
    return {"kind": "ok" if good == asked else "warn", "text": f"B-rep agreed on {good} of {asked} blocks"}


def _cards(result: RunResult, blocks: pl.DataFrame) -> list[dict[str, str]]:
    s = result.summary
    relative = 100 * result.removed.error / s["removed_mm3"] if s["removed_mm3"] > 0 else 0.0
    cutting = int((blocks["removed_mm3"] > 0).sum())
    value, unit = duration(s["time_s"], s["scheduled_time_s"])
    cards = [
        {
            "title": "Removed volume",
            "value": number(s["removed_mm3"]),
            "unit": "mm³",
            "note": f"{number(s['removed_lo_mm3'])} … {number(s['removed_hi_mm3'])} (±{relative:.2g}\u00a0%)",
        },
        {
            "title": "Final stock",
            "value": number(s["final_mm3"]),
            "unit": "mm³",
            "note": f"of {number(s['stock_mm3'])} mm³ at the start",
        },
        {
            "title": "Machining time",
            "value": value,
            "unit": unit,
            "note": "with the acceleration limit"
            if result.job.keys.machine.max_acceleration_mm_s2
            else "ideal: no acceleration limit given",
        },
    ]
    if s["scheduled_time_s"] is not None:
        value, unit = duration(s["scheduled_time_s"], s["time_s"])
        cards.append(
            {
                "title": "Scheduled time",
                "value": value,
                "unit": unit,
                "note": f"{percent(s['time_s'], s['scheduled_time_s'])}, read back and simulated",
            }
        )
    cards.append(
        {"title": "Blocks", "value": number(s["blocks"]), "unit": "",
         "note": f"{number(cutting)} cut, {number(s['blocks'] - cutting)} remove nothing"}
    )  # fmt: skip
    cards.append(
        {
            "title": "Computed in",
            "value": f"{s['seconds']:.3g}",
            "unit": "s",
            "note": f"peak memory {s['peak_mb']:.0f} MB",
        }
    )
    return cards


def _view_note(triangles: int, mesh: ThinMesh, stride: int) -> str:
    note = f"{number(triangles)} triangles; grey is uncut stock."
    if mesh.cell:
        note = (
            f"Drawn with {number(len(mesh.triangles))} of {number(triangles)} triangles (vertices merged "
            f"within {mesh.cell:.3g} mm, for the picture only); grey is uncut stock."
        )
    if stride > 1:
        note += f" Of the tool path every {stride}th motion is drawn."
    return note + " Drag to turn, wheel to zoom, click a legend entry to hide it."


def _plot_note(count: int) -> str:
    thinned = (
        f" Thinned to about {MAX_POINTS:,} of {count:,} blocks, extremes kept." if count > MAX_POINTS else ""
    )
    return "One step per NC block; point at it to see the line of the program." + thinned


def _schedule(result: RunResult, schedule: ScheduleReport, blocks: pl.DataFrame) -> dict[str, Any]:
    s, feed = result.summary, result.job.keys.feed
    before = blocks["mrr_mm3_min"].fill_null(0.0).to_numpy()
    after = np.nan_to_num(schedule.after_rate)
    rows = [
        (
            "Machining time",
            "{} {}".format(*duration(s["time_s"], s["scheduled_time_s"])),
            "{} {}".format(*duration(s["scheduled_time_s"], s["time_s"])),
            percent(s["time_s"], s["scheduled_time_s"]),
        ),
        (
            "Largest volume rate of a block",
            f"{number(before.max())} mm³/min",
            f"{number(after.max())} mm³/min",
            percent(before.max(), after.max()),
        ),
        (
            "Blocks that move",
            number(s["blocks"]),
            number(schedule.blocks),
            f"{schedule.blocks - s['blocks']:+d}",
        ),
        (
            "Removed volume",
            f"{number(s['removed_mm3'], 8)} mm³",
            f"{number(schedule.removed_mm3, 8)} mm³",
            difference(schedule.removed_mm3 - s["removed_mm3"], s["stock_mm3"]),
        ),
    ]
    limited = [
        (index, line, text, schedule.limits[index], number(feed))
        for index, line, text, feed in blocks.select(
            "block", "line", "text", "scheduled_feed_mm_min"
        ).iter_rows()
        if schedule.limits.get(index)
    ]
    tally = [{"count": count, "name": name} for name, count in sorted(schedule.tally.items())]
    return {
        "text": schedule.text,
        "rows": rows,
        "note": f"{schedule.note[0].upper()}{schedule.note[1:]}." if schedule.note else "",
        "compared": compared(schedule.comparison),
        "force_load": "{} {}".format(*UNITS[feed.component if feed else "resultant"]),
        "limits": tally,
        "limited": limited[:MAX_ROWS],
        "more": f"{len(limited) - MAX_ROWS} more in blocks.csv." if len(limited) > MAX_ROWS else "",
    }


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
        ("entered_from_behind", "times that a sweep came from behind a vector: its length was left"),
        ("cut_beneath", "vectors that a cut crosses beneath their surface: no overcut of their own"),
        ("part_outside_stock", "places where the design has no stock above it"),
    ):
        if told[key]:
            rows.append((number(told[key]), text))
    return rows


def _colophon(result: RunResult) -> list[tuple[str, str]]:
    lines = [
        (role, f"{Path(entry['file']).name}  sha256 {entry['sha256'][:16]}…")
        for role, entry in result.inputs.items()
    ]
    if (machine := result.summary.get("machine")) is not None:
        lines.append(("machine", f"{machine['name']}: {', '.join(machine['rotary'])}"))
    return [*lines, ("made with", ", ".join(f"{name} {version}" for name, version in versions().items()))]
