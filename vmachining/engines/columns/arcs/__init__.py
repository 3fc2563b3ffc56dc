"""Arcs about any coordinate direction and helices, cell by cell: the chord of those poses that can be lowest in a cell.

1. A piece of an arc is one row, no longer than `paths.pieces` says.
2. Over a cell, the height of the tool rises or falls along a part of the path, or it is not known which; lowest are poses where
   falling turns into rising, or in parts where it is not known (`_kernels.lowest`).
3. The chord of these poses, of a cutter shrunk and of one grown by how far chord and arc lie apart, is an ordinary straight
   sweep: every rule for straight sweeps holds. The smaller the cell, the shorter the chord, and what lies between the two
   cutters falls with its square.

Source: derived in `docs/columns.md`, rule R9.
"""
