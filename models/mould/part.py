"""Writes part.step: a block whose top is one spline face with the bowl in it."""

import numpy as np
from make import DEPTH, HALF, STOCK, WAVE  # beside this file

from benchmarks.modelfiles import part_below, write_part
from vmachining.arrays import Floats


def height(x: Floats, y: Floats) -> Floats:
    """mm; the bowl ends level."""
    u, v = (np.clip(p, -HALF, HALF) for p in (x, y))
    return np.asarray(-DEPTH * np.cos(WAVE * u) ** 2 * np.cos(WAVE * v) ** 2)


SIDE = STOCK[0] / 2
part = part_below(height, (-SIDE, SIDE), (-SIDE, SIDE), bottom=-STOCK[2], cells=(124, 124))

if __name__ == "__main__":
    write_part(__file__, part)
