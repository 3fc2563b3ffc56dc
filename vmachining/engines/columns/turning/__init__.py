"""Columns in any direction: proven removed volumes of blocks whose axis leans or turns.

Rules and proofs: docs/columns_any_direction.md. `rows`: sweeps as numbers; `engine`: directions and divided blocks; kernels:
`_kernels` one sweep over one cell (L1 to L4), `starts` shared poses (L5), `triangles` what is removed over a quarter of a cell
(L6, L7), `bends` what is removed below curved surfaces of balls (L8), `cells` one cell, `blocks` all cells of a block,
`air` where nothing is left (L9).
"""

from vmachining.engines.columns.turning.air import Air
from vmachining.engines.columns.turning.engine import AnyDirection
from vmachining.engines.columns.turning.rows import Rows, rows_of

__all__ = ["Air", "AnyDirection", "Rows", "rows_of"]
