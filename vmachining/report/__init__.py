"""Results for eyes: one HTML file that opens offline and says how far its numbers can be trusted.

1. `payload.py` packs what the page draws: columns, surface, path, tools and raw heights.
2. `thin.py` keeps it light: fewer triangles, fewer blocks, and the page says so when it did.
3. `page.py` gathers key figures, warnings and the honest part and fills the template.
4. `frontend/` is the page's own program (three.js, uPlot): one selection over workpiece, curves and program, and the
   cut as it is played. `npm ci && npm run build` there makes `static/report.js`, which is committed and pinned.

| file | holds |
|---|---|
| `payload.py` | one compressed container of bounded size |
| `thin.py` | vertex clustering of a coloured mesh, thinning of long series |
| `page.py` | `write_report(result, path)`; where loads peak, the most loaded blocks, the comparison of strategies |
| `contact_map.py` | contact, chip and force of some blocks, for the page to draw |
| `comparison.py`, `engines.html.j2` | two results beside each other, matched by where their motions end; our engines on one job |
| `trust.py` | sentences about what is known and what is not |
| `design.py` | how far the finished surface is from the design |
| `figures.py`, `chart.py`, `machine.py`, `pockets.py` | small pages of figures: rotary angles over a path, logged times, forces |
| `scene.py`, `deviation.py` | bodies, lines and points on small pages in three dimensions |
| `engagement.py` | `write_engagement(engagement, folder)`: tables, map and picture of what a tool touches |
| `batch.py`, `batch.html.j2` | `write_index(rows, path, ledger)`: the page over all jobs of a batch |
| `numbers.py` | numbers, times and counts as the pages write them |
| `page.html.j2`, `page.css` | the page; every value is escaped by jinja2, and a policy lets no other script run |

The room reads results and computes nothing new. Known limit: without WebGL the page shows a
picture of the part instead of the 3-D view; all numbers are there.
"""

from vmachining.report.engagement import write_engagement
from vmachining.report.page import write_report

__all__ = ["write_engagement", "write_report"]
