"""What is known of surfaces in a cell, as arrays, and the rules in force.

E[i] of surface i, i = 0 the top of the stock, 1 sweep k, 2 ... n - 1 earlier sweeps. Columns 0-7 the upper side (of the
cutter that the sweep holds), 8-15 the lower side (of the cutter that holds it): value, gx, gy, Mxx, Mxy, Myy, radius, flag, about
the middle of the cell; radius bounds |f'' - M|. Of the top of a stock of facets: planes above and below it.
C[i] = (nx, ny, c_in, c_out) of surfaces whose border crosses the cell: there inside n.p <= c_in, absent beyond n.p >= c_out.
lines[i] the straight sweep that represents surface i in the cell, see arcs/_kernels.py. P[q] polygons, corners (x, y). W room.

Kernels are handed these arrays one by one: in one tuple of five they took a third longer (docs/measured/columns.md).
"""

import numpy as np

SMOOTH, ROUGH, PART, OUT = 3.0, 2.0, 1.0, 0.0
"""Flags: value, gradient and M hold; whole in the footprint, of the lower side value and gradient of a plane below f; the border
of the footprint crosses the cell (lower side as ROUGH); absent."""

UP, DOWN = np.int64(0), np.int64(8)
"""First column of a side; typed, see surface/_kernels.py."""

TOP, SELF, FIRST = np.int64(0), np.int64(1), np.int64(2)
"""Rows: top of the stock, sweep k, first earlier sweep."""

CURVATURE, ABOVE, BELOW = np.int64(1), np.int64(2), np.int64(4)
"""Bits of rules R3; R4 and R5 by planes and chords. Each alone may be switched off, which widens brackets: tests do it."""

COVER, FORGET, CLOSED, CROSS = np.int64(8), np.int64(16), np.int64(32), np.int64(64)
"""R7, R8, closed integrals, and those where surfaces cross."""

ALL = np.int64(127)
