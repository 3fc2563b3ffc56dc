"""Program text in, rows of motion out: the control that everybody has, without the machine.

`read_program` and `parse_program` make a `Program`: moves (`Move`, `Motion`) and findings (`Finding`), each with line and
column. Nothing is skipped in silence: what is not understood is a finding of `CATALOGUE`, which `explain` tells, and a wrong
block is left out as a whole. `lex_line` and `split_lines` are the words of a line; `read_tool_table` reads LinuxCNC's
`.tbl`; `rewrite_feeds` writes new feeds into an old program and changes nothing else. Dialects are in `DIALECTS`.

Grammar and order of execution are those of RS274/NGC (NISTIR 6556, 2000), and LinuxCNC 2.9 where that is silent.

Imports `geometry` and the shared shelf; knows G-codes, no kernels and no machine. How a program is read,
departures from LinuxCNC and limits: docs/reading_programs.md.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from vmachining.nc.dialects import DIALECTS, is_g_code, parse_program, read_program
from vmachining.nc.files import MAX_BYTES, decode_program
from vmachining.nc.findings import CATALOGUE, beyond_travel, explain, finding, finding_record, move_record
from vmachining.nc.lexer import LexedLine, Word, lex_line, split_lines
from vmachining.nc.model import Finding, Motion, Move, Point, Program
from vmachining.nc.settings import Settings, ToolEntry, read_tool_table

if TYPE_CHECKING:
    from vmachining.nc.rewrite import BlockEdit, Rewritten, rewrite_feeds

__all__ = [
    "CATALOGUE",
    "DIALECTS",
    "MAX_BYTES",
    "BlockEdit",
    "Finding",
    "LexedLine",
    "Motion",
    "Move",
    "Point",
    "Program",
    "Rewritten",
    "Settings",
    "ToolEntry",
    "Word",
    "beyond_travel",
    "decode_program",
    "explain",
    "finding",
    "finding_record",
    "is_g_code",
    "lex_line",
    "move_record",
    "parse_program",
    "read_program",
    "read_tool_table",
    "rewrite_feeds",
    "split_lines",
]


def __getattr__(name: str) -> Any:
    """PEP 562: what writes programs loads arrays; a check of a program does without."""
    if name not in ("BlockEdit", "Rewritten", "rewrite_feeds"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from vmachining.nc import rewrite

    value = globals()[name] = getattr(rewrite, name)
    return value
