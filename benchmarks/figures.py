"""Diagrams of what `vmachining bench` prints, for `vmachining figure FILE`: one JSON object per line."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vmachining.errors import InputError
from vmachining.report.paper.style import BLUE, GREEN, GREY, ORANGE, RED, VIOLET, WIDTH_MM, canvas, look
from vmachining.textfile import parse_json, read_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Records = Sequence[dict[str, Any]]
EXACT_MM = 1e-9
"""What an error of 0 is drawn at, on an axis of powers of ten."""


def load_bench(path: Path) -> list[dict[str, Any]]:
    """Records of a file. InputError: A line is no JSON object with a case that has a diagram."""
    found = []
    for number, line in enumerate(read_text(path, "benchmark", InputError).splitlines(), 1):
        if not line.strip():
            continue
        try:
            record = parse_json(line)
        except ValueError as exc:
            raise InputError(f"not a line of JSON: {exc}", file=str(path), line=number) from exc
        if not isinstance(record, dict) or record.get("case") not in BENCHED:
            raise InputError(
                "no record of a case that has a diagram", file=str(path), line=number,
                remedy=f"vmachining bench {' or '.join(BENCHED)} > FILE.jsonl",
            )  # fmt: skip
        found.append(record)
    if not found:
        raise InputError("there are no records", file=str(path))
    return found


def draw_bench(records: Records, *, width_mm: float = WIDTH_MM) -> dict[str, Figure]:
    """A figure for every case among the records, by its name."""
    cases = dict.fromkeys(record["case"] for record in records)
    with look():
        return {case: BENCHED[case]([r for r in records if r["case"] == case], width_mm) for case in cases}


def _zmap(records: Records, width_mm: float) -> Figure:
    """Error of the cut length over time: analytic, vertical vectors, Z-map; one panel per cutter and staircase."""
    groups: dict[tuple[Any, ...], list[dict[str, Any]]] = {}
    for r in records:
        groups.setdefault((r["tool"], *r["steps_mm"]), []).append(r)
    rows = -(-len(groups) // 2)
    figure = canvas(width_mm, 52.0 * rows + 8.0)
    grid = figure.subplots(rows, 2, sharex=True, sharey=True, squeeze=False)
    for axes, ((tool, low, high), group) in zip(grid.flat, groups.items(), strict=False):
        for method, label, colour, mark in METHODS:
            mine = [r for r in group if r["method"] == method]
            x, y = ([max(r[key], EXACT_MM) for r in mine] for key in ("ms_per_position", "rms_mm"))
            axes.loglog(x, y, mark, color=colour, label=label)
            for r, a, b in zip(mine, x, y, strict=True):
                if r["pitch_mm"] is not None:
                    axes.annotate(
                        f"{r['pitch_mm']:g}", (a, b), (3, 3), textcoords="offset points", fontsize=6
                    )
        axes.set_title(f"{tool}, steps of {low:g} to {high:g} mm")
        axes.set_ylim(EXACT_MM / 3, 3.0)
        axes.label_outer()
    figure.supxlabel("time a position (ms)", fontsize=8.0)
    figure.supylabel("error of the cut length, root mean square (mm)", fontsize=8.0)
    figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


METHODS = (
    ("analytic", "analytic (exact, drawn at 1e-9)", BLUE, "o"), ("vectors", "vertical vectors, by pitch in mm", GREEN, "s-"),
    ("zmap", "Z-map, by pitch in mm", RED, "^-"),
)  # fmt: skip


def _vectors(records: Records, width_mm: float) -> Figure:
    """Time and deviation of the half cylinder over the pitch gamma, and of vectors along normals over the error epsilon."""
    hybrid = sorted((r for r in records if r["run"] == "hybrid"), key=lambda r: r["gamma_mm"])
    upright = sorted((r for r in records if r["run"] == "pure DVV"), key=lambda r: r["gamma_mm"])
    normal = sorted((r for r in records if r["run"] == "pure DNV"), key=lambda r: r["epsilon_mm"])
    figure = canvas(width_mm, 0.42 * width_mm)
    over_gamma, over_epsilon = figure.subplots(1, 2, sharey=True)
    gamma = [r["gamma_mm"] for r in hybrid]
    for key, label, colour in (
        ("seconds", "hybrid", BLUE), ("seconds_upright", "its upright vectors", GREEN),
        ("seconds_normals", "its vectors along normals", VIOLET), ("published_seconds", "hybrid as published", GREY),
    ):  # fmt: skip
        axes_line = "--" if key.startswith("published") else "-"
        over_gamma.loglog(gamma, [r[key] for r in hybrid], f"o{axes_line}", ms=3, color=colour, label=label)
    over_gamma.loglog(
        [r["gamma_mm"] for r in upright],
        [r["seconds"] for r in upright],
        "s-",
        ms=3,
        color=ORANGE,
        label="upright alone",
    )
    known = [r for r in normal if r.get("published_seconds")]
    over_epsilon.loglog(
        [r["epsilon_mm"] for r in known], [r["published_seconds"] for r in known], "s--", ms=3, color=GREY,
        label="as published",
    )  # fmt: skip
    over_gamma.set(xlabel="pitch γ (mm)", ylabel="time (s)")
    over_epsilon.loglog(
        [r["epsilon_mm"] for r in normal],
        [r["seconds"] for r in normal],
        "s-",
        ms=3,
        color=RED,
        label="along normals alone",
    )
    over_epsilon.set(xlabel="error ε between vectors (mm)")
    for axes, places in ((over_gamma, gamma), (over_epsilon, [r["epsilon_mm"] for r in normal])):
        axes.set_xticks(places, [f"{x:g}" for x in places])
        axes.minorticks_off()
    over_gamma.legend(fontsize=6.5)
    over_epsilon.legend(fontsize=6.5)
    return figure


BENCHED: dict[str, Callable[[Records, float], Figure]] = {"zmap": _zmap, "vectors": _vectors}
