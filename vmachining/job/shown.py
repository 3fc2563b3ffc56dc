"""What a notebook shows of a run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from vmachining.htmltable import facts_html, table_html

if TYPE_CHECKING:
    from vmachining.job.result import RunResult

HEAD = (
    "block",
    "line",
    "text",
    "tool",
    "motion",
    "removed_mm3",
    "removed_lo_mm3",
    "removed_hi_mm3",
    "proven",
    "time_s",
    "warning",
)
ROWS = 5


def how_sure(summary: Mapping[str, Any]) -> str:
    """Whether the interval of the total is proven, and how many blocks are only stated."""
    stated = summary["stated_blocks"]
    word = "proven" if summary["proven"] else "stated, not proven"
    return f"{word} ({stated} of {summary['blocks']} blocks are stated)" if stated else word


def result_html(result: RunResult) -> str:
    """Sums of a run, and the head of its table."""
    s = result.summary
    facts = [
        ("removed", f"{s['removed_mm3']:.6g} mm³, between {s['removed_lo_mm3']:.6g} and {s['removed_hi_mm3']:.6g} mm³, "
         f"{how_sure(s)}"),
        ("stock", f"{s['stock_mm3']:.6g} mm³, then {s['final_mm3']:.6g} mm³"),
        ("time", f"{s['time_s']:.2f} s of the program"),
    ]  # fmt: skip
    if s["scheduled_time_s"] is not None:
        facts.append(("scheduled", f"{s['scheduled_time_s']:.2f} s"))
    if s["brep"]["asked"]:
        facts.append(("B-rep", ", ".join(f"{count} {word}" for word, count in s["brep"].items())))
    facts.append(("warnings", str(s["warnings"])))
    head = result.blocks.select(HEAD).head(ROWS)
    rows = list(head.iter_rows())
    left = s["blocks"] - len(rows)
    more = f"<p>and {left} more: <code>.blocks</code></p>" if left > 0 else ""
    return facts_html(f"{result.job.name}: {s['blocks']} blocks", facts) + table_html(HEAD, rows) + more
