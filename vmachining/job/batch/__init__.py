"""Many jobs: each in its own directory, a table, a data set and a page over all of them.

1. `run_many` (`many.py`) gives jobs to a pool as it has room, writes rows down as they come, and learns when to stop.
2. A pool is either the processes of this machine or a Dask cluster (`cluster.py`). Both have the same
   function do a job in a fresh interpreter (`one.py`), in one process per job, so the numbers do not depend on
   where and beside what it runs.
3. Finished jobs go to the data set, one hive partition each.

| file | holds |
|---|---|
| `one.py` | `Order`, `one_job`, `BATCH_COLUMNS`; `Pool`, what `run_many` needs of one; `LocalPool`, its processes |
| `cluster.py` | `ClusterPool`; admission of workers: versions, a probe file |
| `divided.py` | `on_cluster`: the parts of one job |
| `many.py` | `run_many`, `folders_of`, the ledger batch.json; `Dataset`: which of its files are ours, and how they come and go |

A process of a pool ends with whoever started it, so nobody is left who writes where a resumed batch writes; and the
lock of a job's directory keeps a second one out where it lives a little longer.
"""

from vmachining.job.batch.many import Watcher, folders_of, run_many, safe_name
from vmachining.job.batch.one import BATCH_COLUMNS

__all__ = ["BATCH_COLUMNS", "Watcher", "folders_of", "run_many", "safe_name"]
