"""Program text in, rows of motion out: the control that everybody has, without the machine.

Goal: say exactly where the tool goes, block by block, and refuse by name whatever is not understood. Nothing
is skipped in silence; a wrong block is left out as a whole, with its finding, and reading goes on behind it.

How a program is read
1. Bytes become lines; tape marks, the end of the program and block numbers are looked after (`reader.py`).
2. A line becomes words with their exact places (`lexer.py`); numbers may be expressions (`expressions.py`).
3. Words become a block: modal groups, words given twice, words that nothing uses (`block.py`, `codes.py`).
4. A copy of the modal state (`state.py`) executes the block in the order feed mode, F, S, T, M6, spindle,
   dwell, plane, units, tool length, work offset, distance mode, reference and G92, motion, stop
   (`interpreter.py`, `arcs.py`); it replaces the state only if all went well.
5. Blocks of nothing but N, G0 or G1, X, Y, Z, F take a short cut with the same result (`reader.py`).

| file | holds |
|---|---|
| `model.py` | `Move`, `Motion`, `Finding`, `Program` |
| `reader.py` | `read_program`, `parse_program`, `decode_program` |
| `lexer.py` | `lex_line`, `split_lines`: words, comments and errors with columns |
| `expressions.py` | parameters, brackets, functions |
| `codes.py` | modal groups; why a code is refused |
| `block.py` | one line as a block, checks E201 to E210 |
| `state.py` | modal state, the two coordinate worlds, parameters |
| `interpreter.py` | execution of one block, checks E301 to E372 |
| `arcs.py` | centre from R, radius tolerance, length of an arc |
| `catalogue.py` | every finding explained |
| `records.py` | moves and findings as JSON dictionaries |
| `tooltable.py` | LinuxCNC `.tbl` and `[[tools]]` of job files |
| `rewrite.py`, `rewrite_pieces.py` | new feeds into an old program |

Sources: RS274/NGC (Kramer, Proctor, Messina, NISTIR 6556, 2000) for grammar, modal groups and order of
execution; the documentation and observable behaviour of LinuxCNC 2.9 where that text is silent.
Departures from LinuxCNC
- Errors do not stop the program. Two signs (`X--2`) are malformed, block numbers have five digits at most.
- A radius word may be 0.002 mm short of half the chord. `M3` wants a speed, `M6` a tool.
- `G94` while G94 is in force keeps F; a change of feed mode forgets it, as there.
- `G1` alone before the first F chooses the mode without a motion.
- Tool lengths follow a change of units. G92 starts at zero. G28 and G30 go to `home`.
- A single % behind the program closes it.
Limits: three axes; no control flow, subprograms, canned cycles, G10, G52, rotation, cutter radius
compensation; parameters of the control above #5000 are not kept, except #5220, #5400 and #5420 to #5422.
"""

from vmachining.nc.catalogue import CATALOGUE, explain
from vmachining.nc.lexer import LexedLine, Word, lex_line, split_lines
from vmachining.nc.model import Finding, Motion, Move, Point, Program
from vmachining.nc.reader import decode_program, parse_program, read_program
from vmachining.nc.records import finding_record, move_record
from vmachining.nc.rewrite import BlockEdit, Rewritten, rewrite_feeds
from vmachining.nc.tooltable import ToolEntry, read_tool_table

__all__ = [
    "CATALOGUE",
    "BlockEdit",
    "Finding",
    "LexedLine",
    "Motion",
    "Move",
    "Point",
    "Program",
    "Rewritten",
    "ToolEntry",
    "Word",
    "decode_program",
    "explain",
    "finding_record",
    "lex_line",
    "move_record",
    "parse_program",
    "read_program",
    "read_tool_table",
    "rewrite_feeds",
    "split_lines",
]
