"""Writes part.step: the channel as one spline face over a block."""

import numpy as np
from build123d import Box, Face, Pos, Vector, extrude
from make import BOTTOM, HALF, LONG, height  # beside this file

from vmachining.job.modelfiles import write_part

x, y = np.linspace(-1.0, LONG + 1.0, 41), np.linspace(-HALF - 1.0, HALF + 1.0, 49)
z = height(x[:, None], y)
points = [[Vector(a, b, z[i, j]) for j, b in enumerate(y)] for i, a in enumerate(x)]
below = extrude(Face.make_surface_from_array_of_points(points), amount=30.0, dir=(0.0, 0.0, -1.0))
block = Pos(LONG / 2.0, 0.0, BOTTOM / 2.0 + 5.0) * Box(LONG, 2.0 * HALF, -BOTTOM + 10.0)
part = block & below

if __name__ == "__main__":
    write_part(__file__, part)
