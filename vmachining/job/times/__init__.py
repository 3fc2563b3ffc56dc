"""Machine times against logs: what a control wrote while it ran a program, and the few numbers of a machine that follow.

| file | holds |
|---|---|
| `logs.py` | `Log`, `read_log`: four formats to columns |
| `laid.py` | `Laid`: a log laid over a program, interval by interval |
| `fit.py` | `fit`: the numbers of a machine from logs, and their file |
| `compared.py` | `compare`: predicted beside logged, per tool and block; `join`: a log beside the table of a run |
"""

from vmachining.job.times.compared import Comparison, compare, join, of_result, together
from vmachining.job.times.fit import Fitted, fit
from vmachining.job.times.laid import Laid, lay
from vmachining.job.times.logs import Log, read_log

__all__ = [
    "Comparison", "Fitted", "Laid", "Log", "compare", "fit", "join", "lay", "of_result", "read_log", "together",
]  # fmt: skip
