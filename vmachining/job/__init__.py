"""A job from file to result: the room that wires all the others.

Goal: one job file in, one table out, in which every number of every NC block is either there with its error
or visibly absent.

1. `Job.load` reads and checks the job file (`jobfile.py`, keys in `model.py`, places of keys in `keys.py`,
   wording of refusals in `words.py`).
2. The program is read, its motions grouped to blocks (`blocks.py`) and timed by the machine (`timing.py`).
3. `Stage` (`simulate.py`) sweeps and cuts block by block; rapids, shank and holder are checked, not cut
   (`contact.py`). Rows stream to disk (`table.py`).
4. With `[feed]` a schedule is planned, written, read back and simulated again (`schedule.py`).
5. `RunResult.write` lays the files down, the manifest last (`result.py`, `files.py`, `stock.py`).

| file | holds |
|---|---|
| `model.py`, `keys.py`, `words.py`, `jobfile.py` | the job file: `Job`, units, refusals with line and suggestion |
| `paths.py`, `blocks.py` | `move_path`: lines, arcs, five-axis turns; `Block`, `group_blocks` |
| `toolpath.py` | `Toolpath`: moves, their paths and blocks, made once and handed down |
| `timing.py` | `move_times` |
| `contact.py`, `simulate.py` | contact checks, the loop |
| `table.py`, `files.py` | `COLUMNS`, partial tables; atomic files, hashes, manifest |
| `schedule.py` | plan, rewrite, verify |
| `brep.py`, `verdicts.py` | `--brep`: which blocks, and what the B-rep engine says of them |
| `run.py`, `stopping.py`, `notes.py` | `run`; signals; warnings beside numbers |
| `result.py`, `summary.py` | `RunResult`; what summary.json says |
| `batch/` | many jobs over processes or a cluster, and the data set of all of them |
| `reading.py` | the program of a job |
| `starter.py` | `draft_job`: a job file from a program |
| `engage.py` | `engage`: what the tool touches at a fraction of a block; `Scene` for several questions |
| `heights.py` | `height_map`: the workpiece as heights over cells, for the analytic engagement |
| `alone.py` | `blocks_alone`: single blocks to any width, without a run |
| `single.py` | `swept_volume` of one sweep |

Conventions
-----------
Stock, home and all columns live in work coordinates. Rapids remove 0 by definition; a rapid that meets
material warns with the volume it would have removed. A block's time holds its dwells. `removed_lo_mm3` and
`removed_hi_mm3` of the summary are the narrower of two rigorous brackets: the sum over the blocks, and stock
before minus stock after.

Interruption: SIGINT or SIGTERM finish the block in hand, then leave `blocks.partial.csv`, a checkpoint of the
workpiece and a manifest with `complete: false`. A run that goes on makes the same rows as one that was never
stopped. Verdicts of the B-rep engine are in `brep.partial.csv` as they come and are not asked for again; refused
ones are if they had less time.

A run that is refused (bad job, program, tools, stock) leaves the result directory as it was. One that starts
removes the files of an earlier result first, so that no old file passes for a new one.

Known limits: a STEP stock with curved faces is triangulated within the chord:
`stock_slack_mm3` of the summary bounds what that can do to any volume; the totals include it, the brackets of
single blocks do not, and a note says so. Lines of several feed motions keep their feed in a schedule; their
`feed_mm_min` is the one that takes the same time. Feeds that could not be written are warnings of their block.
"""

from vmachining.job.alone import SingleBlock, blocks_alone
from vmachining.job.blocks import Block, group_blocks
from vmachining.job.engage import Scene, engage
from vmachining.job.heights import height_map
from vmachining.job.jobfile import Job, read_tools
from vmachining.job.paths import move_path
from vmachining.job.result import RunResult
from vmachining.job.run import run
from vmachining.job.schedule import ScheduleReport
from vmachining.job.simulate import Stopped
from vmachining.job.single import swept_volume
from vmachining.job.starter import Draft, draft_job
from vmachining.job.stock import check_formats
from vmachining.job.table import COLUMNS

__all__ = [
    "COLUMNS",
    "Block",
    "Draft",
    "Job",
    "RunResult",
    "Scene",
    "ScheduleReport",
    "SingleBlock",
    "Stopped",
    "blocks_alone",
    "check_formats",
    "draft_job",
    "engage",
    "group_blocks",
    "height_map",
    "move_path",
    "read_tools",
    "run",
    "swept_volume",
]
