"""A closed surface with fewer triangles: what lies in one plane is one face."""

from __future__ import annotations

import numpy as np
from manifold3d import Error, Manifold, Mesh64

from vmachining.engines.mesh.facets import Side
from vmachining.engines.mesh.stock import StockMesh, surface_of
from vmachining.engines.protocol import StockSurface
from vmachining.stock import Stock
from vmachining.tolerance import CHORD_MM


def thinned(
    surface: StockSurface, tolerance: float, within: Stock | None = None, chord: float = CHORD_MM
) -> StockSurface | None:
    """The same surface within `tolerance` mm; every triangle keeps its block.

    within : a stock that what lies outside of is cut off, with facets as the chord needs them. None: the kernel does not take
    the triangles for a solid (two parts that touch in an edge).
    """
    order = np.argsort(surface.block, kind="stable")
    block = surface.block[order]
    starts = np.flatnonzero(np.diff(block, prepend=block[:1] - 1))
    first = int(Manifold.reserve_ids(len(starts)))
    ids = first + np.arange(len(starts))
    mesh = Mesh64(
        vert_properties=np.ascontiguousarray(surface.vertices),
        tri_verts=surface.triangles[order].astype(np.uint64),
        run_index=np.append(3 * starts, 3 * len(order)).astype(np.uint64),
        run_original_id=ids.astype(np.uint32),
    )
    solid = Manifold(mesh)
    if solid.status() != Error.NoError:
        return None
    if within is not None:
        solid = solid ^ StockMesh.of(within, chord).solids[Side.INNER]
    solid = solid.simplify(tolerance)
    if solid.status() != Error.NoError or solid.is_empty():
        return None
    return surface_of(solid, dict(zip(ids.tolist(), block[starts].tolist(), strict=True)))
