"""Many straight blocks over rays along x or y, see `side/_kernels.py`."""

from __future__ import annotations

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.engines.dexel.batch.side import _kernels
from vmachining.engines.dexel.grid import Look, RayGrid, look
from vmachining.geometry import Line
from vmachining.sweep import Sweep
from vmachining.sweep.ball import ball_block
from vmachining.sweep.rotating import meridian_rows


def takes_side(sweep: Sweep) -> bool:
    """Whether this way takes the block: any cutter on a level line, a ball on any line."""
    path = sweep.path
    if not isinstance(path, Line):
        return False
    level = path.start[2] == path.end[2] and (path.start[:2] != path.end[:2]).any()
    return bool(level) or ball_block(sweep) is not None


def cut_sides(grid: RayGrid, sweep: Sweep, start: Floats, end: Floats, blocks: Ints) -> list[Look]:
    """Cut blocks of one cutter, that of `sweep`. start, end : (n, 3) mm, origins of the profile. blocks : (n,) their numbers."""
    lat, profile = grid.lattice, sweep.profile
    r = profile.max_radius
    reach = np.array([[-r, -r, profile.z_min], [r, r, profile.z_max]])
    lows, highs = np.minimum(start, end) + reach[0], np.maximum(start, end) + reach[1]
    windows = grid.windows(lows, highs)
    sizes = (windows[:, 1] - windows[:, 0]) * (windows[:, 3] - windows[:, 2])
    work, out = np.empty((3, max(1, int(sizes.max(initial=0))))), np.zeros((len(start), 6))
    ball = ball_block(sweep)
    radius, lift, shank = (0.0, 0.0, 0.0) if ball is None else (
        ball.radius, float(ball.center[2] - sweep.path.start[2]), ball.height
    )  # fmt: skip
    low, high = lows[:, lat.axis] - lat.ha, highs[:, lat.axis] + lat.ha
    done, travel, numbers = 0, np.ascontiguousarray(end - start), blocks.astype(np.int32)
    while True:
        done = _kernels.side_lines(
            lat, grid.lists, windows, start, travel, meridian_rows(profile), radius, lift, shank, numbers,
            low.copy(), high.copy(), work, out, done,
        )  # fmt: skip
        if done == len(start):
            break
        grid.grow()
    found = []
    for k, row in enumerate(out.tolist()):
        if row[4]:
            found.append(look(lat.cell, *row[:5]))
        elif row[5]:
            found.append(grid.unseen(np.stack([lows[k], highs[k]]), row[2]))
        else:
            found.append(Look(0.0, 0.0))
    return found
