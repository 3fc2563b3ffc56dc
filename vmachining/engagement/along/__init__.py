"""Contact along whole programs, quickly: the same question as `contact`, for the stations of many motions in one compiled walk.

1. `Sweeps` holds the motions as rows: closed-form distances for flat, bull and ball cutters that reach above the stock on lines,
   ramps, level arcs and helices (`distance_kernels.py`), exact distances for the rest (`margin_kernels.py`).
2. Tiles of the plan know which sweeps may be lowest in them (`tile_kernels.py`); a sweep that lies above another one in a whole
   tile leaves its list.
3. At a rotation angle the facing part of the meridian is closed, and of an upright tool what lies over material of the tiles
   (`stretch_kernels.py`); margins are asked at nodes of it, ends by Chandrupatla's method, what hides between two nodes where
   both sides promise it (`edge_kernels.py`).
4. Angles: every 10 degrees through the feed and some beside where facing ends; ends of arcs by the same method on the largest
   margin; intervals are halved where the values beside them promise more than the largest that is known (`turn_kernels.py`).
5. `contact_along` asks stations of any motions (`walk_kernels.py`); `Seen.sample` gives the engaged stretches at the angles that
   forces sum over, those of a wound edge interpolated between straight ones (`resample_kernels.py`).
"""

from vmachining.engagement.along.block import (
    Chips,
    Cutting,
    Sample,
    Seen,
    Teeth,
    blade,
    contact_along,
    fractions,
)
from vmachining.engagement.along.sweeps import Sweeps

__all__ = ["Chips", "Cutting", "Sample", "Seen", "Sweeps", "Teeth", "blade", "contact_along", "fractions"]
