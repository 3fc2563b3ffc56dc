"""Program text in, rows of motion out: the control that everybody has, without the machine.

Goal: say exactly where the tool goes, block by block, and refuse by name whatever is not understood. Nothing
is skipped in silence; a wrong block is left out as a whole, with its finding, and reading goes on behind it.

How a program is read (dialects iso and mts)
1. Bytes become lines; tape marks, the end of the program and block numbers are looked after (`blocks.py`).
2. A line becomes words with their exact places (`lexer.py`); numbers may be expressions (`expressions.py`).
3. Words become a block: modal groups, words given twice, words that nothing uses (`block.py`, `codes.py`).
4. A copy of the modal state (`state.py`) executes the block in the order feed mode, F, S, T, M6, spindle,
   dwell, plane, units, cutter compensation, tool length, work offset, distance mode, cycle return, reference
   and G92, motion or cycle, stop (`interpreter.py`); it replaces the state only if all went well.
5. Moves under cutter compensation wait for their successor (`compensation.py`).
6. Lines that steer (O words, M98, M99) say where to go on (`control.py`, `flow.py`).
7. Blocks of nothing but N, G0 or G1, X, Y, Z, F take a short cut with the same result (`blocks.py`).

| file | holds |
|---|---|
| `model.py`, `vectors.py` | `Move`, `Motion`, `Finding`, `Program`; sums of points |
| `reader.py`, `settings.py` | `read_program`, `parse_program`, `decode_program`; their options |
| `blocks.py`, `tape.py` | goes through the lines; tape marks |
| `lexer.py` | `lex_line`, `split_lines`: words, comments and errors with columns |
| `expressions.py` | parameters, brackets, functions |
| `codes.py` | modal groups; why a code is refused |
| `block.py` | one line as a block, checks E201 to E210 |
| `state.py` | modal state, the two coordinate worlds, parameters |
| `interpreter.py`, `run.py` | execution of one block; targets, feeds, the moves it makes |
| `arcs.py` | planes, centre from R, radius tolerance, length of an arc |
| `offsets.py` | G10, G28, G43, G52, G54, G92 and their families |
| `cycles.py` | canned cycles G73 to G89 |
| `compensation.py`, `offset_curves.py`, `gouge.py` | cutter radius compensation; offset lines and arcs; neighbours |
| `control.py`, `flow.py` | pairs of O words found; calls, loops and branches run |
| `subfiles.py`, `values.py` | subprograms in files of their own; numbers of a line when it runs |
| `mts.py` | stored cycles and patterns of dialect mts |
| `apt.py`, `poses.py` | cutter location files; tables of poses |
| `checks.py` | what only the moves can tell: travel, increments, feeds above the stock |
| `catalogue.py`, `catalogue_more.py`, `catalogue_entry.py` | every finding explained |
| `records.py` | moves and findings as JSON dictionaries |
| `tooltable.py` | LinuxCNC `.tbl` and `[[tools]]` of job files |
| `foreign.py` | what a text is that is no program: other controls, other files |
| `toolcomments.py` | what comments say of tools |
| `rewrite.py`, `rewrite_pieces.py`, `rewrite_regions.py` | new feeds into an old program |

Sources: RS274/NGC (Kramer, Proctor, Messina, NISTIR 6556, 2000) for grammar, modal groups and order of
execution; the documentation and observable behaviour of LinuxCNC 2.9 where that text is silent.
Departures from LinuxCNC
- Errors do not stop the program. Two signs (`X--2`) are malformed, block numbers have nine digits at most.
- A radius word may be 0.002 mm short of half the chord. `M3` wants a speed, `M6` a tool.
- `G94` while G94 is in force keeps F; a change of feed mode forgets it, as there.
- `G1` alone before the first F chooses the mode without a motion.
- Tool lengths follow a change of units. G92 starts at zero. G28 and G30 go to `home`. Cycles start with G98.
- A single % behind the program closes it.
- Units cannot change under compensation. D0 without a tool is a radius of zero only where a tool table is given.
- Sizes of the tool in the spindle (#5401 to #5410) are in units of the program.
Its errors are copied, with a warning, where its published cases hold them: taps in G18 and G19 feed beside their
holes (`taps = "axis"` feeds along the axis), compensated corners that turn by less than 0.05 rad are passed over
(`crc_corner = "exact"` looks at each).
Rotary axes are read, with their offsets, where `rotary` names them; M428, M128, G43.4 and TRAORI say that X Y Z
are the tip in work coordinates from there on. What the axes do to the tool is for the machine to say.
Limits: no G68, G16, G51, macros, splines, probing, threads, G76, G87, G88, no axes U V W; arcs lie in XY under a
rotated work offset; parameters of the control above #5000 can be read where they are offsets (#5161 to #5390), the
tool (#5400 to #5410) or the position (#5021 to #5023, #5420 to #5425, #5440 to #5442), and not be set. Comments that
print, log or ask a configuration (DEBUG, PRINT, LOG) are comments; (ABORT, ...) ends the reading.
"""

from vmachining.nc.catalogue import CATALOGUE, explain
from vmachining.nc.lexer import LexedLine, Word, lex_line, split_lines
from vmachining.nc.model import Finding, Motion, Move, Point, Program
from vmachining.nc.reader import DIALECTS, MAX_BYTES, decode_program, parse_program, read_program
from vmachining.nc.records import finding_record, move_record
from vmachining.nc.rewrite import BlockEdit, Rewritten, rewrite_feeds
from vmachining.nc.tooltable import ToolEntry, read_tool_table

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
