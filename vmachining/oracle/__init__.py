"""Other people's volumes against ours, and ours in a folder that needs no installation.

Goal: somebody who writes a fast engine can ask "is it right?" per NC block, and gets an answer that a bracket
proves: a value outside `removed_lo_mm3 .. removed_hi_mm3` is wrong, whatever else is true.

1. A table of results is read (`results.py`): keyed by `block`, or by `line` and then summed per line.
2. The reference is read (`results.py`): a folder of `vmachining run`, a pack, or a `RunResult`.
3. Both are joined and judged (`compare.py`): error, side and distance outside the bracket, totals, verdict.
4. A pack (`pack.py`) is a job with all its inputs and the volumes of every block, hashed file by file.
5. A set (`compare.py`) is a directory of packs, made in a clone (`benchmarks/sets.py`) and compared with by one command.
6. Tables of engagement are joined by block, instant and rotation angle; what only one of two tables calls
   engaged is measured along the edge (`engagements.py`).
7. Our engines are judged like those of others, one beside the other: intervals, distances, time (`engines.py`).

| file | holds |
|---|---|
| `results.py` | `read_results`, `read_reference`: strict reading, refusals with file and line |
| `compare.py` | `compare`, and `compare_set` of many cases |
| `engagements.py` | `compare_engagement`: engaged intervals of the cutting edge, angle by angle |
| `engines.py` | `compare_engines`: all of our engines on one job |
| `pack.py`, `readme.py` | `write_pack`; the words that go into a pack |

Rules
-----
A feed block without a result is missing, which is a finding; a rapid removes 0 by definition and may be left
out. A result for a block or line that the reference does not have is extra; it is a finding unless it is 0.
Brackets are taken as they are: a tolerance widens them only if it is requested, and the verdict then says so.

Known limits: inside the bracket is not proof of being right, only of not being provably wrong by more than
its width; a smaller `chord_mm` narrows it. Where a curved STEP stock was triangulated, every bracket is
widened by `stock_slack_mm3`, because the brackets of single blocks do not contain that.
"""

from vmachining.oracle.compare import Comparison, SetComparison, compare, compare_set, is_set
from vmachining.oracle.engagements import EngagementComparison, compare_engagement, is_engagement_table
from vmachining.oracle.engines import EngineComparison, compare_engines, engine_names
from vmachining.oracle.pack import write_pack
from vmachining.oracle.results import Results

__all__ = [
    "Comparison", "EngagementComparison", "EngineComparison", "Results", "SetComparison", "compare", "compare_engagement",
    "compare_engines", "compare_set", "engine_names", "is_engagement_table", "is_set", "write_pack",
]  # fmt: skip
