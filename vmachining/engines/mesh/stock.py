"""Stock solids, as the two meshes that a bracket needs, and the workpiece as triangles for others.

A box or a mesh file is its own inner and outer solid. A cylinder is not: its facets are placed inside and
outside, so that the bracket holds for the round stock too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from manifold3d import Error, Manifold, Mesh64
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, Ints, rows
from vmachining.engines.mesh.facets import FACET_SHARE, Side, arc_steps
from vmachining.engines.mesh.solids import manifold
from vmachining.errors import StockError
from vmachining.tolerance import CHORD_MM

__all__ = ["StockMesh", "box_stock", "cylinder_stock", "mesh_stock", "stl_stock"]


@dataclass(frozen=True, slots=True, eq=False)
class StockMesh:
    """Raw stock. solids: the largest mesh under `Side.INNER` (it will be cut by inner sweeps), the smallest
    under `Side.OUTER`."""

    solids: dict[Side, Manifold]

    @property
    def bounds(self) -> Floats:
        """(2, 3) mm."""
        return np.array(self.solids[Side.INNER].bounding_box()).reshape(2, 3)

    @property
    def corners(self) -> Floats:
        """(n, 3, 3) mm: corners of the triangles, counterclockwise seen from outside."""
        mesh = self.solids[Side.INNER].to_mesh64()
        points = np.asarray(mesh.vert_properties, dtype=np.float64)[:, :3]
        return np.asarray(points[np.asarray(mesh.tri_verts)])


def _same(solid: Manifold) -> StockMesh:
    solid = solid.as_original()
    return StockMesh({Side.INNER: solid, Side.OUTER: solid})


def box_stock(lo: ArrayLike, hi: ArrayLike) -> StockMesh:
    """Axis-parallel box, mm.

    Raises
    ------
    StockError
        A side is zero, negative or not finite.
    """
    try:
        a, b = rows(lo, 3, name="box min"), rows(hi, 3, name="box max")
    except ValueError as error:
        raise StockError(str(error)) from error
    if not (b > a).all():
        raise StockError(f"box min {a.tolist()} is not below max {b.tolist()} on every axis")
    return _same(Manifold.cube(tuple((b - a).tolist())).translate(tuple(a.tolist())))


def cylinder_stock(
    center: Sequence[float], radius: float, z: Sequence[float], *, chord: float = CHORD_MM
) -> StockMesh:
    """Upright cylinder about `center` (x, y) from z[0] to z[1], mm.

    Raises
    ------
    StockError
        Not a positive size, or not finite.
    """
    values = np.array([*center, radius, *z], dtype=np.float64)
    if not np.isfinite(values).all() or radius <= 0 or z[1] <= z[0]:
        raise StockError(f"cylinder of radius {radius} from z {z[0]} to {z[1]} is not a solid")
    solids = {}
    # n tangents outside, 2 n corners inside: (outer + 2 inner) / 3 is Huygens' rule, fourth order in pi / n
    half = arc_steps(radius, np.pi, chord / FACET_SHARE)
    for side, steps, reach in (
        (Side.INNER, 2 * half, 1 / np.cos(np.pi / (2 * half))),
        (Side.OUTER, 4 * half, 1.0),
    ):
        angle = 2 * np.pi * np.arange(steps) / steps
        polygon = radius * reach * np.column_stack([np.cos(angle), np.sin(angle)])
        n = len(polygon)
        points = np.empty((2 * n, 3))
        points[:, :2] = np.concatenate([polygon, polygon]) + np.asarray(center)
        points[:n, 2], points[n:, 2] = z
        i, j = np.arange(n), (np.arange(n) + 1) % n
        cap = np.stack([np.zeros(n - 2, int), np.arange(1, n - 1), np.arange(2, n)], axis=1)
        triangles = np.concatenate(
            [np.stack([i, j, j + n], 1), np.stack([i, j + n, i + n], 1), cap[:, ::-1], cap + n]
        )
        solids[side] = manifold(points, triangles).as_original()
    return StockMesh(solids)


def mesh_stock(vertices: ArrayLike, triangles: ArrayLike, *, source: str = "stock") -> StockMesh:
    """Closed triangle mesh, taken as the exact stock. vertices (n, 3) mm, triangles (m, 3) of indices.

    Raises
    ------
    StockError
        Not finite, not closed, or inside out; says what is wrong.
    """
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
    return _same(solid)


def stl_stock(path: Path, *, scale: float = 1.0) -> StockMesh:
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
    return mesh_stock(np.asarray(shape.vertices) * scale, shape.faces, source=str(path))


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
