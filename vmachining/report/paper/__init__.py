"""Figures for papers, drawn from the directory of a command: vector graphics with embedded fonts, axes with units.

1. `source.py` reads a result directory: its tables, the comparison of strategies, the finished stock.
2. `kinds.py` draws the kinds as matplotlib figures, `chips.py` the chips that `engage --chips` found, `tables.py` the workpiece
   where they end, measured forces and coefficients, and places off the design.
3. `body.py` looks at triangles along a direction, and draws a surface, a swept volume or its regions.
4. `style.py` holds sizes, colours and fonts, and writes files.

| kind | shows |
|---|---|
| `load` | volume rate, chip area, force, power: as programmed and scheduled |
| `bracket` | removed volume of every block with its bounds, and their distance |
| `feed` | feed as programmed and scheduled |
| `engagement` | axial and radial depth, engaged share of a revolution, chip thickness |
| `stock` | the finished workpiece: its height over the plan, and a view |
| `logged` | a log joined with the run: feed as programmed, reachable and logged, removal rate, power, spindle load |
| `program` | lines of the original and of the scheduled program side by side, with the load of each |
| `references` | feed and load by several references, time at feed and time saved over the reference |
| `schedule` | all feed strategies on the same job: time, peaks and spreads |

The room computes nothing new. Same directory, same bytes: files carry no date and no random names.
"""

from vmachining.report.paper.body import TIMES, draw_regions, draw_surface, draw_sweep
from vmachining.report.paper.chips import ChipTable, draw_chips
from vmachining.report.paper.kinds import KINDS, OVER, draw, draw_result
from vmachining.report.paper.source import Results
from vmachining.report.paper.style import FORMATS, is_picture, write_figure, write_figures
from vmachining.report.paper.tables import (
    draw_coefficients,
    draw_deviation,
    draw_section,
    draw_trace,
    load_deviation,
    load_section,
    load_trace,
)

__all__ = [
    "FORMATS", "KINDS", "OVER", "TIMES", "ChipTable", "Results", "draw", "draw_chips", "draw_coefficients", "draw_deviation",
    "draw_regions", "draw_result", "draw_section", "draw_surface", "draw_sweep", "draw_trace", "is_picture", "load_deviation",
    "load_section", "load_trace", "write_figure", "write_figures",
]  # fmt: skip
