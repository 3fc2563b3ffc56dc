"""A job from file to result: the room that wires all the others.

1. `Job.load` reads and checks the job file.
2. The program is read, its motions are grouped to blocks and timed by the machine.
3. Blocks are swept and cut one by one; rapids, shank and holder are checked, not cut. Rows stream to disk.
4. Contact, chips and forces are computed along the blocks.
5. With `[feed]` a schedule is planned, written, read back and simulated again.
6. `RunResult.write` lays the files down, the manifest last.

| file | holds |
|---|---|
| `jobfile.py`, `model.py`, `words.py` | `Job`: the job file, units, refusals with line and suggestion |
| `reading.py`, `paths.py`, `toolpath.py`, `timing.py` | the program of a job: paths, blocks, times |
| `run.py`, `course.py`, `given.py`, `cutting.py`, `simulate.py`, `executor.py` | `run`, its stages |
| `record.py`, `store.py` | manifest and checkpoints of a run, what stages cost; what may differ when it continues |
| `contact.py`, `engage.py`, `engagement_columns.py`, `stations.py` | rapids, shank and holder; what the cutting edges touch |
| `chunks.py` | chunks of blocks side by side |
| `brep.py`, `audit.py`, `verdicts.py` | `--brep`: which blocks, and what other engines say of them |
| `schedule.py`, `strategies.py`, `verified.py` | feeds: plan, compare, rewrite, verify |
| `table.py`, `files.py`, `folder.py`, `result.py`, `summary.py`, `total.py` | `COLUMNS`, the files of a result, their manifest |
| `single.py` | `blocks_alone`: single blocks to any width, without a run; `swept_volume` of one sweep |
| `batch/` | many jobs over processes or a cluster |
| `starter.py`, `asked.py` | a job file from a program; what is asked for and given in words |

Conventions: stock, home and all columns are in work coordinates. Rapids remove 0 by definition; one that meets
material warns with the volume. A block's time holds its dwells. `removed_lo_mm3` and `removed_hi_mm3` of the summary
are the narrower of two brackets, of which a proven one counts: the sum over the blocks, and stock before minus stock after.

A run that is interrupted leaves its rows, a checkpoint and a manifest with `complete: false`; one that continues from
there makes the same rows as one that was never stopped, and so does one that adds a stage to a complete result. A run that
is refused leaves the result directory as it was; one that starts removes the files of an earlier result first.

Known limits: a STEP stock with curved faces is triangulated within the chord; the totals include what that can do to
a volume (`stock_slack_mm3`), brackets of single blocks do not, and a note says so. Lines of several feed motions keep
their feed in a schedule. Feeds that could not be written are warnings of their block.

What a run does not need is loaded when it is first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vmachining.job.engage import Scene, engage, height_map
from vmachining.job.jobfile import Job
from vmachining.job.model import Feed, Force
from vmachining.job.paths import move_path
from vmachining.job.result import RunResult
from vmachining.job.run import run
from vmachining.job.schedule import ScheduleReport
from vmachining.job.simulate import Stopped
from vmachining.job.stock import check_formats
from vmachining.job.table import COLUMNS
from vmachining.job.toolpath import Block, group_blocks
from vmachining.later import later

if TYPE_CHECKING:
    from vmachining.job.single import SingleBlock, blocks_alone, swept_volume
    from vmachining.job.starter import Draft, draft_job

__all__ = [
    "COLUMNS", "Block", "Draft", "Feed", "Force", "Job", "RunResult", "Scene", "ScheduleReport", "SingleBlock", "Stopped",
    "blocks_alone", "check_formats", "draft_job", "engage", "group_blocks", "height_map", "move_path", "run", "swept_volume",
]  # fmt: skip

__getattr__ = later(
    __name__, {"single": "SingleBlock blocks_alone swept_volume", "starter": "Draft draft_job"}
)
