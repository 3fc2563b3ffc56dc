"""How far the numbers of a page can be trusted: what is known, with its error, and what nobody has checked."""

from __future__ import annotations

from typing import Any

import polars as pl

from vmachining.job import RunResult
from vmachining.job.contact import TURNING_CHORD_MM, ToolParts
from vmachining.job.table import CONTACT
from vmachining.nc import is_g_code
from vmachining.report.numbers import difference, number, plural


def known(result: RunResult) -> list[str]:
    """Sentences about what is known, with its error."""
    s = result.summary
    width = s["removed_hi_mm3"] - s["removed_lo_mm3"]
    share = f", {100 * width / s['removed_mm3']:.2g} % of it" if s["removed_mm3"] > 0 else ""
    balance = s["stock_mm3"] - s["final_mm3"] - s["removed_mm3"]
    word = "bracket" if s["proven"] else "interval"
    rests = f"It rests on {result.stock.proof}."
    if result.stock.name == "mesh":
        chord = result.job.keys.accuracy.chord_mm
        rests = f"It follows from facets that stay within the requested chord, {chord:g} mm, of the exact swept surface."
    shown = "The file and the picture show the larger of the two: what is undecided stays on the part."
    if result.stock.name == "columns":
        rests = (
            f"It rests on {result.stock.proof}; {100 * s['width']:.3g} % or {s['width_mm3']:g} mm³ of each block were requested; "
            f"{s['wider_blocks']} blocks are wider; the mesh engine cut {s['blocks_by_mesh']}."
        )
        shown = (
            "The file and the picture show places of the true surface, straight between them: heights on a grid or, once a tool "
            "leaned or turned, ends of rays in three directions (facets where only the mesh engine knows a block). What is "
            "thinner than their spacing may be missing."
        )
    second, counts = [], s["brep"]
    if counts["asked"]:
        won = ", ".join(f"{name} {count}" for name, count in counts["attempts"].items()) or "none"
        second.append(
            f"The B-rep engine checked {counts['asked']} blocks: {counts['agreed']} agreed, "
            f"{counts['retried']} agreed at a later attempt, {counts['refused']} it refused, {counts['disputed']} are "
            "disputed (see their warnings). The largest possible error of a value is in removed_brep_error_mm3. "
            f"Blocks per attempt: {won}."
        )
    return [
        f"Removed volume: {number(s['removed_lo_mm3'], 8)} to {number(s['removed_hi_mm3'], 8)} mm³. "
        f"The {word} is {number(width, 3)} mm³ wide{share}.",
        _sure(s),
        rests,
        "Balance: stock before minus stock after minus the sum of all blocks is "
        f"{difference(balance, s['stock_mm3'])}.",
        f"Finished stock: {number(s['final_lo_mm3'], 8)} to {number(s['final_hi_mm3'], 8)} mm³. {shown}",
        *_files(s),
        "A block that does not reach the stock removes exactly 0.",
        *_contact_known(result.blocks),
        *second,
        *_judged(s, result.blocks["removed_dexel_mm3"].count()),
    ]


def _sure(s: dict[str, Any]) -> str:
    if not s["stated_blocks"]:
        return "Both ends of the interval of every block are proven bounds" + (
            ", and so are those of the total." if s["proven"] else "; those of the total are stated."
        )
    return (
        f"The intervals of {number(s['stated_blocks'])} of {number(s['blocks'])} blocks are stated, not proven: "
        f"column proven of the table. The total is {'proven anyway' if s['proven'] else 'stated, too'}."
    )


def _files(s: dict[str, Any]) -> list[str]:
    """What the triangles of the written workpieces hold, against what is known of it."""
    return [
        f"{name} holds {number(volume, 8)}\u00a0mm³, {difference(volume - s['final_mm3'], s['stock_mm3'])} from the "
        f"estimate of the finished stock, of which {difference(volume - s['stock_mesh_mm3'], s['stock_mm3'])} is the "
        "rounding of its coordinates: compare removed volumes with this page and not with that of the file."
        for name, volume in s.get("stock_files_mm3", {}).items()
    ]


def _judged(s: dict[str, Any], looked: int) -> list[str]:
    """What exact rays were asked and said. looked : blocks of the table that have their interval."""
    told = s.get("second_judge") or {}
    if not told.get("blocks"):
        return [
            f"Exact rays judged {plural(looked, 'block')} in addition to the B-rep engine: columns removed_dexel_mm3, "
            "removed_dexel_lo_mm3 and removed_dexel_hi_mm3."
        ] if looked else []  # fmt: skip
    agrees = told["blocks"] - told["disputed_blocks"]
    return [
        f"A second engine (exact rays) checked {plural(told['blocks'], 'block')} of those that cut; its interval "
        f"and that of the table agree in {agrees} of them: columns removed_dexel_mm3, removed_dexel_lo_mm3 and "
        "removed_dexel_hi_mm3."
    ]


def _parts(result: RunResult) -> dict[str, set[int]]:
    """Numbers of the tools of which the job gives shank and holder."""
    parts = {n: ToolParts.of(tool) for n, tool in result.job.tools.items()}
    return {
        name: {n for n, of in parts.items() if getattr(of, name) is not None} for name in ("shank", "holder")
    }


def _missing_inputs(result: RunResult) -> list[str]:
    """What the job does not describe of its tools, in words for the reader."""
    tools, lacking = result.job.tools, []
    for part, given in _parts(result).items():
        if not given:
            lacking.append(f"no {part} is given, so none was checked")
        elif missing := sorted(set(tools) - given):
            names = ", ".join(f"T{n}" for n in missing)
            lacking.append(f"no {part} is given for {names}, so none was checked there")
    return lacking


def checked(result: RunResult) -> str:
    """What was looked for where there are no warnings: nothing that the job does not give."""
    said = ["no contact of a rapid with the stock was found"]
    if parts := [part for part, given in _parts(result).items() if given]:
        said.append(f"none of {' or '.join(parts)}")
    if is_g_code(result.program.dialect):
        said.append("no feed move with a stopped spindle")
    lacking = _missing_inputs(result)
    told = ", ".join(said)
    return f"{told[0].upper()}{told[1:]}." + (f" Not checked: {'; '.join(lacking)}." if lacking else "")


def _contact_known(blocks: pl.DataFrame) -> list[str]:
    """What contact, chips and forces rest on, as far as they are there."""
    if not blocks["ap_mm"].count():
        return []
    lines = [
        "Contact and chips are the largest of the stations along a block, which stand a quarter of the radius apart or "
        "17 to a block; a peak between two stations is missed. At a station they follow from exact distances to the "
        "earlier sweeps, a chip to first order in the feed."
    ]
    if blocks["force_n"].count():
        lines.append("Forces are as good as the coefficients of the job; they are not measured here.")
    return lines


def unknown(result: RunResult) -> list[str]:
    """Sentences about what nobody has checked."""
    chord, lines = result.job.keys.accuracy.chord_mm, []
    if not result.summary["brep"]["asked"]:
        lines.append(
            "The B-rep engine has not checked these volumes: columns removed_brep_mm3 and brep_status are empty."
        )
    blocks = result.blocks
    if len(empty := [name for name in CONTACT if not blocks[name].count()]) == len(CONTACT):
        lines.append("Contact, chips, forces and power are not computed: their columns are empty.")
    elif empty:
        lines.append(f"Not computed, so empty in the table: {', '.join(empty)}.")
    lines += [
        "Rapids do not cut: their contact with the stock is a warning, and so is that of a shank or holder that is "
        f"given. Contacts shallower than about {4 * chord:g} mm (four chords) may go unseen, of a tool that leans or "
        f"turns {4 * max(chord, TURNING_CHORD_MM):g} mm.",
        *(f"{text[0].upper()}{text[1:]}." for text in _missing_inputs(result)),
        "Tool, machine and stock are rigid; the tool turns without run-out or wear.",
    ]
    if result.job.keys.machine.max_acceleration_mm_s2 is None:
        lines.append("Times are length over feed: no acceleration limit was given.")
    if result.job.keys.machine.rapid_mm_min is None:
        lines.append("Rapids take no time: no rapid speed was given.")
    return lines


def widest(blocks: pl.DataFrame) -> list[tuple[Any, ...]]:
    """Rows of the table of the widest intervals."""
    width = pl.col("removed_hi_mm3") - pl.col("removed_lo_mm3")
    rows = blocks.with_columns(width.alias("width")).filter(pl.col("width") > 0).top_k(5, by="width")
    names = ("block", "line", "text", "removed_mm3", "removed_lo_mm3", "removed_hi_mm3", "width")
    rows = rows.sort("width", descending=True)
    return [(*row[:3], *(number(v, 5) for v in row[3:])) for row in rows.select(names).iter_rows()]
