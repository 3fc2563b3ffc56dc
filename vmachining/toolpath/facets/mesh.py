"""Facets as an indexed mesh: shared vertices, neighbours, normals, borders, and what is wrong with it. Source: spec D.2, D.6."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, Ints, rows
from vmachining.errors import InputError
from vmachining.geometry import rotation

Weights = Literal["resultant", "area", "angle"]
WELD = 1e-6
"""Vertices closer than this share of the diagonal are one."""

FLAT = 1e-12
"""Triangles of less area than this share of the squared diagonal are dropped."""


@dataclass(frozen=True, slots=False, eq=False)
class FacetMesh:
    """vertices : (n, 3) mm. triangles : (m, 3) indices, counterclockwise from outside. notes : what was repaired or found."""

    vertices: Floats
    triangles: Ints
    notes: tuple[str, ...] = ()

    @classmethod
    def of(
        cls, corners: ArrayLike, *, weld_mm: float | None = None, notes: tuple[str, ...] = ()
    ) -> FacetMesh:
        """Mesh of facets (m, 3, 3): close corners become one vertex, facets without area and copies are dropped and reported.

        Raises InputError: Nothing is left.
        """
        points = rows(np.asarray(corners, dtype=np.float64).reshape(-1, 3), -1, 3, name="corners")
        if not len(points):
            raise InputError("a mesh without facets")
        diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
        step = WELD * diagonal if weld_mm is None else weld_mm
        vertices, triangles = _welded(points, step)
        found = list(notes)
        same = (triangles[:, [0, 1, 2]] == triangles[:, [1, 2, 0]]).any(axis=1)
        a, b, c = (vertices[triangles[:, k]] for k in range(3))
        thin = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1) <= FLAT * diagonal**2
        if (same | thin).any():
            found.append(f"{int((same | thin).sum())} facets without area were dropped")
        triangles = triangles[~(same | thin)]
        _, first = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)
        if len(first) < len(triangles):
            found.append(f"{len(triangles) - len(first)} duplicate facets were dropped")
            triangles = triangles[np.sort(first)]
        if not len(triangles):
            raise InputError("every facet of the mesh is without area")
        mesh = cls(vertices, triangles)
        return cls(vertices, triangles, (*found, *mesh.complaints))

    def placed(
        self,
        *,
        turn_deg: tuple[float, float, float] = (0.0, 0.0, 0.0),
        to_origin: bool = False,
        move: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> FacetMesh:
        """The mesh turned about x, then y, then z through the origin; its lowest corner put there; then moved, mm (II.9)."""
        points = self.vertices
        for axis, angle in zip(np.eye(3), turn_deg, strict=True):
            # rounded: a quarter of a turn keeps upright walls upright
            points = points @ np.round(rotation(axis, np.radians(angle)), 15).T
        if to_origin:
            points = points - points.min(axis=0)
        return FacetMesh(points + np.array(move), self.triangles, self.notes)

    @cached_property
    def corners(self) -> Floats:
        """(m, 3, 3) mm."""
        return np.asarray(self.vertices[self.triangles])

    @cached_property
    def areas(self) -> Floats:
        """(m,) mm^2."""
        return np.asarray(0.5 * np.linalg.norm(self._crosses, axis=1))

    @cached_property
    def normals(self) -> Floats:
        """(m, 3), unit."""
        return np.asarray(self._crosses / np.linalg.norm(self._crosses, axis=1)[:, None])

    @cached_property
    def _crosses(self) -> Floats:
        a, b, c = (self.vertices[self.triangles[:, k]] for k in range(3))
        return np.cross(b - a, c - a)

    @cached_property
    def bounds(self) -> Floats:
        """(2, 3) mm."""
        used = self.vertices[np.unique(self.triangles)]
        return np.stack([used.min(axis=0), used.max(axis=0)])

    @cached_property
    def _edges(self) -> tuple[Ints, Ints, Ints]:
        """Edges (e, 2), rising; of each side (k is opposite vertex k) of each triangle its edge, and whether it rises."""
        sides = self.triangles[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2)
        edges, which = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True)
        return edges, which.reshape(-1, 3), (sides[:, 0] < sides[:, 1]).astype(np.int64).reshape(-1, 3)

    @property
    def edges(self) -> Ints:
        """(e, 2): every edge once."""
        return self._edges[0]

    @cached_property
    def edge_faces(self) -> Ints:
        """(e, 2): the triangles at an edge, -1 where there is only one; of more than two the first two."""
        edges, which, _ = self._edges
        out = np.full((len(edges), 2), -1, dtype=np.int64)
        order = np.argsort(which.ravel(), kind="stable")
        edge, face = which.ravel()[order], order // 3
        start = np.searchsorted(edge, np.arange(len(edges)))
        count = np.diff(np.append(start, len(edge)))
        out[:, 0] = face[start]
        two = count >= 2
        out[two, 1] = face[start[two] + 1]
        return out

    @cached_property
    def neighbours(self) -> Ints:
        """(m, 3): triangle across the edge opposite vertex k, -1 at a border."""
        _, which, _ = self._edges
        pair = self.edge_faces[which]
        mine = np.arange(len(self.triangles))[:, None]
        return np.where(pair[:, :, 0] == mine, pair[:, :, 1], pair[:, :, 0])

    @cached_property
    def border(self) -> Ints:
        """(b, 2): edges of one triangle only."""
        return self.edges[self.edge_faces[:, 1] < 0]

    @property
    def is_closed(self) -> bool:
        """Every edge has two triangles."""
        return not len(self.border)

    @property
    def euler(self) -> int:
        """Vertices - edges + triangles."""
        return len(np.unique(self.triangles)) - len(self.edges) + len(self.triangles)

    @cached_property
    def complaints(self) -> tuple[str, ...]:
        """What is wrong with the mesh, in words."""
        edges, which, rises = self._edges
        count = np.bincount(which.ravel(), minlength=len(edges))
        up = np.bincount(which.ravel(), weights=rises.ravel(), minlength=len(edges))
        out = []
        if (count == 1).any():
            out.append(f"open: {int((count == 1).sum())} edges have one triangle only")
        if (count > 2).any():
            out.append(f"{int((count > 2).sum())} edges have more than two triangles")
        wrong = (count == 2) & (up != 1)
        if wrong.any():
            # a facet that is turned over disagrees with all of its neighbours
            turned = np.flatnonzero(wrong[which].all(axis=1))
            if len(turned):
                k = int(turned[0])
                sides = "; ".join(
                    f"{_place(self.vertices[e[0]])} to {_place(self.vertices[e[1]])}" for e in edges[which[k]]
                )
                out.append(
                    f"{len(turned)} facets are turned over, first facet {k + 1} with the edges {sides}"
                )
            else:
                out.append(f"{int(wrong.sum())} edges have triangles that disagree which side is outside")
        return tuple(out)

    def fan(self, vertex: int) -> Ints:
        """Triangles at a vertex, in order around it as far as they are connected."""
        mine = np.flatnonzero((self.triangles == vertex).any(axis=1))
        if not len(mine):
            return mine
        left, out = set(mine.tolist()), []
        # begin after a border if there is one
        begin = next((k for k in mine if self._after(int(k), vertex, back=True) not in left), mine[0])
        k = int(begin)
        while k in left:
            left.remove(k)
            out.append(k)
            k = self._after(k, vertex, back=False)
        return np.array(out + sorted(left), dtype=np.int64)

    def _after(self, face: int, vertex: int, *, back: bool) -> int:
        """Triangle next to a face around a vertex, counterclockwise; -1 at a border."""
        at = int(np.flatnonzero(self.triangles[face] == vertex)[0])
        return int(self.neighbours[face, (at + 2) % 3 if back else (at + 1) % 3])

    def dihedral(self) -> Floats:
        """(e,) rad: angle between the normals of the two triangles of every edge; NaN at borders."""
        one, two = self.edge_faces.T
        cosine = np.clip((self.normals[one] * self.normals[two]).sum(axis=1), -1.0, 1.0)
        return np.where(two >= 0, np.arccos(cosine), np.nan)

    def vertex_normals(self, weights: Weights = "angle") -> Floats:
        """(n, 3), unit: sum of the normals at each vertex, as they are, by area or by angle; NaN where no facet is.

        Raises InputError: The normals at a vertex cancel.
        """
        out = np.zeros_like(self.vertices)
        np.add.at(out, self.triangles, self._weighted(weights))
        size = np.linalg.norm(out, axis=1)
        used = np.unique(self.triangles)
        if (size[used] < 1e-12).any():
            bad = int(used[np.argmax(size[used] < 1e-12)])
            raise InputError(
                f"the normal is undefined at vertex {bad}, {_place(self.vertices[bad])}: its facets cancel"
            )
        with np.errstate(invalid="ignore"):
            return np.asarray(out / size[:, None])

    def corner_normals(self, weights: Weights = "angle", *, sharp_deg: float = 180.0) -> Floats:
        """(m, 3, 3), unit: normals at the corners of each facet, mixed over the facets that it meets smoothly there.

        A corner takes the facets that are reached around its vertex without crossing an edge whose `dihedral` is
        larger than `sharp_deg`, a border, or an edge of more than two facets. Where they cancel, it keeps its own.
        """
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        smooth = np.flatnonzero(self.dihedral() <= np.radians(sharp_deg))
        faces, ends = self.edge_faces[smooth], self.edges[smooth]
        # the corner of each of both facets at each end of a smooth edge
        at = (self.triangles[faces][:, :, None, :] == ends[:, None, :, None]).argmax(axis=3) + 3 * faces[
            :, :, None
        ]
        one, two = at[:, 0].ravel(), at[:, 1].ravel()
        count = 3 * len(self.triangles)
        _, fan = connected_components(
            coo_array((np.ones(len(one), np.int8), (one, two)), (count, count)), directed=False
        )
        total = np.zeros((count, 3))
        np.add.at(total, fan, self._weighted(weights).reshape(-1, 3))
        mixed = total[fan].reshape(-1, 3, 3)
        size = np.linalg.norm(mixed, axis=2, keepdims=True)
        own = np.broadcast_to(self.normals[:, None], mixed.shape)
        return np.where(size < 1e-12, own, mixed / np.maximum(size, 1e-12))

    def _weighted(self, weights: Weights) -> Floats:
        """(m, 3, 3): normal of each facet times its weight at each of its corners."""
        if weights == "resultant":
            w = np.ones((len(self.triangles), 3))
        elif weights == "area":
            w = np.repeat(self.areas[:, None], 3, axis=1)
        else:
            u, v = (np.roll(self.corners, shift, axis=1) - self.corners for shift in (-1, -2))
            w = np.arctan2(np.linalg.norm(np.cross(u, v), axis=2), (u * v).sum(axis=2))
        return np.asarray(w[:, :, None] * self.normals[:, None])


def edge_normal(one: ArrayLike, two: ArrayLike, t: float) -> Floats:
    """(3,), unit: normal at the share t of an edge between vertices with the normals `one` and `two`."""
    mixed = (1.0 - t) * np.asarray(one, dtype=np.float64) + t * np.asarray(two, dtype=np.float64)
    size = float(np.linalg.norm(mixed))
    if size < 1e-12:
        raise InputError("the normal is undefined on this edge: those of its ends cancel")
    return np.asarray(mixed / size)


def _place(point: Floats) -> str:
    return "(" + ", ".join(f"{v:.6g}" for v in point) + ")"


def _welded(points: Floats, step: float) -> tuple[Floats, Ints]:
    """Vertices and indices; points closer than `step` in a chain of such are one, the first of them."""
    unique, first, member = np.unique(points, axis=0, return_index=True, return_inverse=True)
    member = member.reshape(-1)
    if step > 0.0 and len(unique) > 1:
        from scipy.sparse import coo_matrix
        from scipy.sparse.csgraph import connected_components
        from scipy.spatial import cKDTree

        pairs = cKDTree(unique).query_pairs(step, output_type="ndarray")
        if len(pairs):
            graph = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(len(unique), len(unique)))
            _, label = connected_components(graph, directed=False)
            _, lead = np.unique(label, return_index=True)
            return unique[lead], label[member].reshape(-1, 3).astype(np.int64)
    order = np.argsort(first, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return unique[order], rank[member].reshape(-1, 3).astype(np.int64)


def height_field(x: ArrayLike, y: ArrayLike, z: ArrayLike, *, bottom: float | None = None) -> FacetMesh:
    """Two triangles in each cell of a grid, split from its first corner to its last.

    x : (n,), y : (m,) mm, rising. z : (n, m) mm.
    bottom : mm, below all heights; walls and a flat bottom close the surface to a solid. None: it stays open.
    Raises InputError: A grid that does not rise, or a bottom that is not below the surface.
    """
    xs, ys = (np.asarray(v, dtype=np.float64) for v in (x, y))
    if min(len(xs), len(ys)) < 2 or not ((np.diff(xs) > 0.0).all() and (np.diff(ys) > 0.0).all()):
        raise InputError("a height field needs at least two rising values of x and of y")
    n, m = len(xs), len(ys)
    heights = rows(z, n, m, name="z")
    grid = np.arange(n * m).reshape(n, m)
    xx, yy = np.meshgrid(xs, ys, indexing="ij")
    points = np.stack([xx, yy, heights], axis=-1).reshape(-1, 3)
    top = _cells(grid)
    if bottom is None:
        return FacetMesh(points, top)
    if not bottom < heights.min():
        raise InputError(f"a bottom at {bottom:g} mm is not below the surface, {heights.min():g} mm")
    ring = np.concatenate([grid[:, 0], grid[-1, 1:], grid[-2::-1, -1], grid[0, -2:0:-1]])  # counterclockwise
    below = n * m + np.arange(len(ring))
    low: Floats = np.column_stack([points[ring, :2], np.full(len(ring), float(bottom))])
    follow, under = np.roll(ring, -1), np.roll(below, -1)
    walls = np.concatenate([np.column_stack([ring, below, under]), np.column_stack([ring, under, follow])])
    middle = n * m + len(ring)
    centre = np.array([[0.5 * (xs[0] + xs[-1]), 0.5 * (ys[0] + ys[-1]), bottom]])
    floor = np.column_stack([under, below, np.full(len(ring), middle)])
    return FacetMesh(np.concatenate([points, low, centre]), np.concatenate([top, walls, floor]))


def _cells(grid: Ints) -> Ints:
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    halves = [np.stack(t, axis=2).reshape(-1, 3) for t in ((a, b, c), (a, c, d))]
    return np.asarray(np.concatenate(halves))
