"""Heights of a faceted part, and how far a tool can be lowered on it. Source: spec D.3, D.4."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Bools, Floats, Ints, rows
from vmachining.errors import InputError, ToolError
from vmachining.geometry.boxtree import box_tree, curve_order
from vmachining.tool import BallNose, BullNose, FlatEnd, Tool
from vmachining.toolpath.facets import _kernels
from vmachining.toolpath.facets.mesh import FacetMesh

UPRIGHT = 1e-9
"""A facet whose unit normal has less of z has no height."""


VALLEY = 1e-9
"""Sides that rise by less than this share of the size of the part make no valley."""


class Contact(IntEnum):
    """What a tool rests on."""

    NONE = 0
    VERTEX = 1
    EDGE = 2
    FACET = 3


class Dropped(NamedTuple):
    """z : (n,) mm, of the tip; -inf, or the floor, where nothing is touched. triangle : (n,), -1 there. kind : (n,) `Contact`."""

    z: Floats
    triangle: Ints
    kind: Ints

    @property
    def touches(self) -> Bools:
        """(n,)."""
        return np.asarray(self.triangle >= 0)


def radii(tool: Tool) -> tuple[float, float]:
    """Radius and corner radius of a flat, ball or bull nose cutter, mm.

    Raises ToolError: Another kind of cutter.
    """
    if isinstance(tool, FlatEnd):
        return tool.diameter / 2.0, 0.0
    if isinstance(tool, BallNose):
        return tool.diameter / 2.0, tool.diameter / 2.0
    if isinstance(tool, BullNose):
        return tool.diameter / 2.0, tool.corner_radius
    raise ToolError(
        f"{type(tool).__name__} cannot be dropped on facets", remedy="take a flat, ball or bull nose cutter"
    )


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Surface:
    """A faceted part, ready to be asked many times; the order of its triangles is its own.

    Known limits: the cutter has no shank above its flutes; overhangs are not seen, the tool comes from above.
    """

    mesh: FacetMesh
    _order: Ints
    _corners: Floats
    _planes: Floats
    _once: Floats
    _boxes: Floats

    def __init__(self, mesh: FacetMesh) -> None:
        corners = mesh.corners
        order = curve_order(np.ascontiguousarray(corners.mean(axis=1)[:, :2]))
        corners = np.ascontiguousarray(corners[order])
        normals = mesh.normals[order]
        planes = np.zeros((len(order), 11))
        level = np.abs(normals[:, 2]) >= UPRIGHT
        slope = -normals[level, :2] / normals[level, 2:]
        planes[level, :2] = slope
        planes[level, 2] = corners[level, 0, 2] - (slope * corners[level, 0, :2]).sum(axis=1)
        planes[level, 3] = 1.0
        planes[level, 4] = np.linalg.norm(slope, axis=1)
        planes[:, 5] = np.sqrt(1.0 + planes[:, 4] ** 2)
        planes[level, 6:8] = slope / np.maximum(planes[level, 4], 1e-300)[:, None]
        planes[:, 8:] = _valleys(mesh)[order]
        once = planes.copy()
        once[:, 8:] = np.maximum(planes[:, 8:], _asked_before(mesh, order))
        boxes = box_tree(corners.min(axis=1), corners.max(axis=1), _kernels.LEAF)
        values = (mesh, order, corners.reshape(-1, 9), planes, once, boxes)
        for name, value in zip(self.__slots__, values, strict=True):
            object.__setattr__(self, name, value)

    @property
    def sorted(self) -> tuple[Floats, Floats, Floats]:
        """What kernels read: corners (m, 9), planes (m, 11), boxes of the tree over them."""
        return self._corners, self._planes, self._boxes

    def heights(self, points: ArrayLike) -> tuple[Floats, Ints]:
        """Highest z over every point (n, 2), -inf off the part, and its triangle, -1 there."""
        where = np.ascontiguousarray(rows(points, -1, 2, name="points"))
        z, which = np.empty(len(where)), np.empty(len(where), dtype=np.int64)
        _kernels.heights(where, self._corners, self._planes, self._boxes, z, which)
        return z, np.where(which >= 0, self._order[which], -1)

    def drop(
        self, points: ArrayLike, radius: float, corner_radius: float, *, floor: float = -np.inf
    ) -> Dropped:
        """The tip's height where a tool that comes down along z touches the part first.

        points : (n, 2) mm, of the tool axis. radius, corner_radius : mm; 0 is a flat end, `radius` a ball.
        floor : mm; the tip goes no lower.
        Raises InputError: Radii that are not a cutter.
        """
        if not (0.0 <= corner_radius <= radius and 0.0 < radius < np.inf):
            raise InputError(
                f"radius {radius:g} mm with a corner radius of {corner_radius:g} mm is not a cutter"
            )
        where = np.ascontiguousarray(rows(points, -1, 2, name="points"))
        z = np.empty(len(where))
        which, kind = np.empty(len(where), dtype=np.int64), np.empty(len(where), dtype=np.int64)
        sizes = float(radius), float(corner_radius), float(floor)
        _kernels.drop(where, self._corners, self._once, self._boxes, *sizes, z, which, kind)
        # a corner stands at the end of two edges: where the tool meets it tells which
        vertex = self._is_vertex(where, z, which, kind, radius, corner_radius)
        kind[vertex] = Contact.VERTEX
        return Dropped(z, np.where(which >= 0, self._order[which], -1), kind)

    def lift(self, tips: ArrayLike, axes: ArrayLike, radius: float, corner_radius: float) -> Floats:
        """(n,) mm: how far a tool has to move along its own axis until it leaves the part; 0 where it does not cut into it.

        tips, axes : (n, 3), mm and of any length. The drop cutter in the frame of each tool; the shank is endless.
        """
        points = np.ascontiguousarray(rows(tips, -1, 3, name="tips"))
        along = rows(axes, len(points), 3, name="axes")
        along = np.ascontiguousarray(along / np.linalg.norm(along, axis=1)[:, None])
        out, which = np.empty(len(points)), np.empty(len(points), dtype=np.int64)
        _kernels.lift_along(
            points, along, self._corners, self._boxes, float(radius), float(corner_radius), out, which
        )
        return out

    def _is_vertex(
        self, points: Floats, z: Floats, which: Ints, kind: Ints, radius: float, corner_radius: float
    ) -> Bools:
        """Whether a contact with an edge is one with its end."""
        out = np.zeros(len(points), dtype=np.bool_)
        asked = np.flatnonzero(kind == Contact.EDGE)
        if not len(asked):
            return out
        corners = self._corners[which[asked]].reshape(-1, 3, 3)
        rho = np.linalg.norm(corners[:, :, :2] - points[asked, None], axis=2)
        over = np.clip(rho - (radius - corner_radius), 0.0, corner_radius)
        tip = corners[:, :, 2] - (corner_radius - np.sqrt(corner_radius**2 - over**2))
        tip[rho > radius] = -np.inf
        out[asked] = (tip >= z[asked, None] - 1e-13 * (1.0 + np.abs(z[asked, None]))).any(axis=1)
        return out


def _valleys(mesh: FacetMesh) -> Bools:
    """(m, 3): whether the edge from corner k to the next lies in a valley, seen from above.

    Both sides rise from it, so over the edge the surface is the higher of two planes, a convex function. Such a function has
    its largest excess over a convex tool, or along a smooth rim, beside the edge and not on it: the sides are touched first.
    Edges that are level to rounding stay, as do those of facets that are upright or lie over one another.
    """
    normals, corners = mesh.normals, mesh.corners
    level = np.abs(normals[:, 2]) >= UPRIGHT
    scale = float(np.ptp(mesh.bounds, axis=0).max())
    out = np.zeros((len(normals), 3), dtype=np.bool_)
    mine = np.arange(len(normals))
    for k in range(3):
        other = mesh.neighbours[:, (k + 2) % 3]
        back = (mesh.neighbours[other] == mine[:, None]) & (other >= 0)[:, None]
        p, q, s = (corners[:, (k + j) % 3] for j in range(3))
        # the corner of the other triangle that is not on the edge lies opposite the side it has in common
        far = corners[other, back.argmax(axis=1)]
        one, two = (_side(p, q, v) for v in (s, far))
        n = np.where(normals[:, 2:] < 0.0, -normals, normals)
        above = ((far - p) * n).sum(axis=1) > VALLEY * scale
        apart = np.minimum(np.abs(one), np.abs(two)) > VALLEY * scale**2 * 1e-3
        out[:, k] = (back.sum(axis=1) == 1) & level & level[other] & (one * two < 0.0) & apart & above
    return out


def _asked_before(mesh: FacetMesh, order: Ints) -> Bools:
    """(m, 3), in an order: edges that the neighbour, which comes earlier, asks; the first of two is the one that does."""
    place, mine = np.argsort(order), np.arange(len(order))
    out = np.zeros((len(order), 3), dtype=np.bool_)
    for k in range(3):
        other = mesh.neighbours[:, (k + 2) % 3]
        shared = (mesh.neighbours[other] == mine[:, None]).sum(axis=1) == 1
        out[:, k] = (other >= 0) & shared & (place[other] < place)
    return out[order]


def _side(p: Floats, q: Floats, v: Floats) -> Floats:
    """Twice the signed area of triangles in plan."""
    return np.asarray((q[:, 0] - p[:, 0]) * (v[:, 1] - p[:, 1]) - (q[:, 1] - p[:, 1]) * (v[:, 0] - p[:, 0]))
