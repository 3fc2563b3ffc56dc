"""Removed volume and machine limits -> feedrate along the path.

Goal: keep the removal rate Q = V F / L at or below a reference, so that the load on the tool stays where the
user asks for, while air is crossed as fast as the machine allows. The feed is INVERSE to the removed volume.

1. `blocks.py`: what is known of each block (length, original feed, removed volume, cap), as columns.
2. `limits.py`: smallest and largest feed, the clamp rule, rounding to what is written, and one word per
   block that says which limit it hit.
3. `strategy.py`: by volume, chip area, force; `plan.py`: one feed per block, or inserted blocks where what a strategy
   needs changes sharply inside a block.
4. `schedule.py`: the answer, as columns; hands out the edits that `vmachining.nc` writes into the program.

| file | holds |
|---|---|
| `blocks.py` | `FeedBlocks`, `Kind` |
| `limits.py` | `FeedLimits`, `Limit`, `clamp`, `floor_feed` |
| `strategy.py` | `Strategy`, `Parts`; `VolumeStrategy`, `ChipAreaStrategy`, `ForceStrategy`, `sampled` |
| `plan.py` | `plan_feeds`, `references` |
| `schedule.py` | `Schedule` |
| `_kernels.py` | recursive bisection of sampled blocks |

Equations
---------
removal rate      Q_k = V_k F_k / L_k                                           (1)
feed              F_raw = Q_ref L_k / V_k;  V_k = 0 (air): the upper limit      (2)
clamp             F = min(max(F_raw, F_min), min(F_max, U_k))                   (3)
                  the cap U_k of the machine wins over F_min
sample request    req_j = clamp(Q_ref l / v_j), n samples of length l = L / n   (4)
bisection         split [a, b) at (a + b) // 2 while max(req) / min(req) > 1 + tau and b - a >= 2 n_min   (5)
leaf feed         `safe`: min(req);  `mean`: Q_ref (b - a) l / sum(v), clamped   (6)

Volume-based scheduling with F = F_0 V_ref / V_k for a reference volume is (2) for blocks of equal length.

Departures from the literature, where it is silent: the thresholds tau and n_min; air blocks take the upper
limit; written feeds are rounded down to 0.1 mm/min; two neighbouring leaves with the same written feed become
one block.

Known limits
------------
- A block's feed depends on that block and the reference only; what the machine makes of it is the business of
  `vmachining.machine`.
- Samples have equal lengths inside a block, and a block has one cap.
- A line that runs several times gets one feed, the smallest any of its runs asks for, and no inserted blocks.
"""

from vmachining.feed.blocks import FeedBlocks, Kind
from vmachining.feed.limits import FeedLimits, Limit, clamp, floor_feed
from vmachining.feed.plan import plan_feeds, references, schedulable
from vmachining.feed.schedule import Schedule
from vmachining.feed.strategy import (
    UNITS,
    ChipAreaStrategy,
    ForceStrategy,
    Parts,
    Strategy,
    VolumeStrategy,
    sampled,
)

__all__ = [
    "UNITS", "ChipAreaStrategy", "FeedBlocks", "FeedLimits", "ForceStrategy", "Kind", "Limit", "Parts", "Schedule",
    "Strategy", "VolumeStrategy", "clamp", "floor_feed", "plan_feeds", "references", "sampled", "schedulable",
]  # fmt: skip
