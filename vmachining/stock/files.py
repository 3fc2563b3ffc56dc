"""Triangle files, and what keeps triangles from enclosing a solid."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, Ints, rows
from vmachining.errors import StockError
from vmachining.memory import available_bytes
from vmachining.stock.shapes import MeshStock
from vmachining.stock.threemf import read_3mf

MEMORY_PER_BYTE = {".stl": 19, ".obj": 18, ".3mf": 15, ".ply": 42}
"""Peak memory per byte of a file (unpacked, for 3MF), measured on a sphere of 1,310,720 triangles."""


def closed_mesh(vertices: ArrayLike, triangles: ArrayLike, *, source: str = "stock") -> MeshStock:
    """Closed triangle mesh. vertices (n, 3) mm, triangles (m, 3) of indices; points at one place become one.

    Raises StockError: Not finite, not closed, or inside out; says what is wrong.
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
    """Stock from an STL, OBJ, PLY or 3MF file.

    scale : mm per unit of the file; a 3MF file states its own unit, which is used instead.

    Raises StockError: Missing, unreadable, empty or open file, of another kind, or too large for the memory available.
    """
    path = Path(path)
    if not path.is_file():
        raise StockError("no such stock file", file=str(path))
    kind = path.suffix.lower()
    if kind not in MEMORY_PER_BYTE:
        raise StockError(
            f"{kind or 'a file without a suffix'} is not a supported mesh format",
            file=str(path),
            remedy="export it as STL, 3MF, OBJ or PLY",
        )
    most, size = available_bytes() // MEMORY_PER_BYTE[kind], path.stat().st_size
    if size > most:
        raise StockError(
            f"holds {size / 2**20:.0f} MB; the memory available here reads {most / 2**20:.0f} MB",
            file=str(path),
            remedy="export it with fewer triangles",
        )
    if kind == ".3mf":
        vertices, triangles = read_3mf(path, most)
        return closed_mesh(vertices, triangles, source=str(path))
    import trimesh

    try:
        with path.open("rb") as stream:  # a stream: no library or texture that the file names is looked for
            shape = trimesh.load_mesh(stream, file_type=kind[1:], process=False)
    except Exception as error:  # trimesh raises whatever its parsers meet
        raise StockError(f"cannot be read as a mesh ({error})", file=str(path)) from error
    if not isinstance(shape, trimesh.Trimesh) or len(shape.faces) == 0:
        raise StockError("holds no triangles", file=str(path))
    if not np.isfinite(shape.vertices).all():
        raise StockError("has vertices that are not finite", file=str(path))
    if shape.faces.min() < 0 or shape.faces.max() >= len(shape.vertices):
        raise StockError("has a triangle with a vertex that is missing", file=str(path))
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
