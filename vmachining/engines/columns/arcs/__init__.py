"""Arcs and helices with upright axis, cell by cell: the chord of those poses that can be lowest in a cell.

1. A piece of an arc is one row, no longer than `paths.pieces` says.
2. In a cell only poses between two angles touch; where these lie follows from how distance and slope grow along the
   circle (`_kernels.lag`).
3. The chord of these poses, of a cutter shrunk and of one grown by how far chord and arc lie apart, is an ordinary straight
   sweep: every rule for straight sweeps holds. The smaller the cell, the shorter the chord, and what lies between the two
   cutters falls with its square.

Source: derived in `docs/columns.md`, rule R9.
"""
