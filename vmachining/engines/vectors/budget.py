"""Memory of vectors before there are any, and what would fit (spec: 4 bytes an upright vector, more along normals)."""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from vmachining.engines.vectors.along import PATCH_BYTES, Patches
from vmachining.engines.vectors.grid._kernels import TILE
from vmachining.engines.vectors.lattice._kernels import count_vectors
from vmachining.engines.vectors.upright import KEPT, grid_shape
from vmachining.errors import InputError
from vmachining.memory import available_bytes

if TYPE_CHECKING:
    from vmachining.engines.vectors.engine import VectorEngine

UPRIGHT_BYTES, NORMAL_BYTES, BASE_BYTES = 4, 17, 16
"""Lengths alone; lengths and lambda, twice while they are laid, and a share of a group; a cell of a tile that is kept."""

EXACT_BELOW = 1e7
"""Vectors along normals up to which they are counted, above they are estimated from areas."""

SHARE = 0.7
"""Of the memory that is free, for vectors."""


def refuse_too_many(engine: VectorEngine, patches: Patches) -> None:
    """Refuse densities whose vectors do not fit into memory, before any of them is made.

    Raises InputError: Says how many there would be, what they take, and which pitch fits.
    """
    both = np.stack([engine.part.bounds, np.asarray(engine._stock.bounds)])
    size = both[:, 1].max(axis=0) - both[:, 0].min(axis=0)
    nx, ny = grid_shape(size, engine.pitch)
    upright = (nx + TILE) * (ny + TILE)
    c = patches.corner
    area = float(np.linalg.norm(np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]), axis=1).sum() / 2.0)
    line = float(np.linalg.norm(c[:, 1] - c[:, 0], axis=1)[patches.facet < 0].sum())
    along = area / engine.spacing**2 + line / engine.spacing
    if along < EXACT_BELOW:
        along = count_vectors(c, engine.spacing)
    fixed = KEPT * TILE**2 * BASE_BYTES + PATCH_BYTES * len(c)
    need = UPRIGHT_BYTES * upright + NORMAL_BYTES * along + fixed
    have = SHARE * available_bytes()
    if need <= have:
        return
    room = max(have - fixed, 1.0)
    grid, normals = UPRIGHT_BYTES * upright, NORMAL_BYTES * along
    if normals < 0.5 * room:  # the grid alone is too dense
        pitch, spacing = grid / (room - normals), 1.0
    elif grid < 0.5 * room:
        pitch, spacing = 1.0, normals / (room - grid)
    else:
        pitch = spacing = (grid + normals) / room
    fits = [
        f"{name}_mm = {float(f'{1.05 * sqrt(coarser) * value:.2g}'):g}"
        for name, coarser, value in (("pitch", pitch, engine.pitch), ("spacing", spacing, engine.spacing))
        if coarser > 1.0
    ]
    raise InputError(
        f"{nx * ny:,} upright vectors at a pitch of {engine.pitch:.3g} mm and about {along:,.0f} along normals at a spacing of "
        f"{engine.spacing:.3g} mm need {need / 1e9:.3g} GB, and {have / 1e9:.3g} GB can be had",
        remedy=f"take {' and '.join(fits)}, or more",
    )
