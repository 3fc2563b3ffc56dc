"""Results for eyes: one HTML file that opens offline and says how far its numbers can be trusted.

1. `figures.py` draws the stock and the path in 3-D and the numbers along the program.
2. `thin.py` keeps the drawing light: fewer triangles, fewer points, and it says so when it did.
3. `page.py` gathers key figures, warnings and the honest part and fills the template.

| file | holds |
|---|---|
| `figures.py` | plotly figures as JSON |
| `thin.py` | vertex clustering of a coloured mesh, thinning of long series |
| `page.py` | `write_report(result, path)` |
| `engagement.py` | `write_engagement(engagement, folder)`: tables, map and picture of what a tool touches |
| `chips.py` | `write_chips(chip_table, folder)`: shapes of chips, cut length and chip area over time |
| `batch.py`, `batch.html.j2` | `write_index(rows, path, ledger)`: the page over all jobs of a batch |
| `engines.py`, `engines.html.j2` | `write_engines(told, folder)`: our engines beside each other |
| `numbers.py` | numbers, times and counts as the pages write them |
| `page.html.j2`, `page.css`, `page.js` | the page; every value is escaped by jinja2 |

The room reads results and computes nothing new. Known limit: the 3-D view wants WebGL in the browser; all
numbers are on the page without it.
"""

from vmachining.report.chips import chip_figure, write_chips
from vmachining.report.engagement import write_engagement
from vmachining.report.page import write_report

__all__ = ["chip_figure", "write_chips", "write_engagement", "write_report"]
