"""Triangle files, and what keeps triangles from enclosing a solid."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, Ints, rows
from vmachining.errors import StockError
from vmachining.stock.shapes import MeshStock

__all__ = ["closed_mesh", "read_mesh"]


def closed_mesh(vertices: ArrayLike, triangles: ArrayLike, *, source: str = "stock") -> MeshStock:
    """Closed triangle mesh. vertices (n, 3) mm, triangles (m, 3) of indices; points at one place become one.

    Raises
    ------
    StockError
        Not finite, not closed, or inside out; says what is wrong.
    """
    from manifold3d import Error, Manifold, Mesh64

    try:
        points = np.array(rows(vertices, -1, 3, name=f"{source}: vertices"))
    except ValueError as error:
        raise StockError(str(error)) from error
    faces = np.array(triangles, dtype=np.uint64)
    if len(faces) < 4:
        raise StockError(f"{source}: {len(faces)} triangles cannot enclose a solid")
    mesh = Mesh64(points, faces)
    mesh.merge()
    solid = Manifold(mesh)
    if solid.status() != Error.NoError:
        raise StockError(
            f"{source}: {_complaint(points, faces.astype(np.int64))}",
            remedy="repair the mesh and export it again",
        )
    if solid.is_empty() or solid.volume() <= 0.0:
        raise StockError(f"{source}: encloses no volume", remedy="check the orientation of its triangles")
    kept = solid.to_mesh64()
    return MeshStock(np.array(kept.vert_properties)[:, :3], np.array(kept.tri_verts, dtype=np.int64))


def read_mesh(path: Path, *, scale: float = 1.0) -> MeshStock:
    """Stock from an STL, 3MF, OBJ or PLY file; `scale` is mm per unit of the file.

    Raises
    ------
    StockError
        Missing, unreadable, empty or open file.
    """
    import trimesh

    path = Path(path)
    if not path.is_file():
        raise StockError("no such stock file", file=str(path))
    try:
        shape = trimesh.load_mesh(path, process=False)
    except Exception as error:  # trimesh raises whatever its parsers meet
        raise StockError(f"cannot be read as a mesh ({error})", file=str(path)) from error
    if not isinstance(shape, trimesh.Trimesh) or len(shape.faces) == 0:
        raise StockError("holds no triangles", file=str(path))
    if not np.isfinite(shape.vertices).all():
        raise StockError("has vertices that are not finite", file=str(path))
    shape.merge_vertices()
    return closed_mesh(np.asarray(shape.vertices) * scale, shape.faces, source=str(path))


def _complaint(points: Floats, faces: Ints) -> str:
    """What keeps a mesh from being closed, in numbers."""
    _, same = np.unique(points, axis=0, return_inverse=True)
    corner = same.ravel()[faces]
    edges = np.sort(np.concatenate([corner[:, [0, 1]], corner[:, [1, 2]], corner[:, [2, 0]]]), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    open_edges, crowded = int((counts == 1).sum()), int((counts > 2).sum())
    if open_edges:
        return f"the surface is open: {open_edges} edges belong to one triangle only"
    if crowded:
        return f"the surface is not manifold: {crowded} edges belong to more than two triangles"
    return "the surface is not a closed, consistently oriented solid"
