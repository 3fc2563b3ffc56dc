"""The stock, cut into tiles only where the cutter comes.

A tile holds two solids, one object as long as they are equal:

    INNER   stock minus the inner sweeps: holds the true workpiece
    OUTER   stock minus the outer sweeps: is held by the true workpiece

Tiles form a binary tree. A tile larger than the wanted size is halved the first time a sweep reaches it, so
that untouched stock stays in few large pieces and a block costs what its neighbourhood costs, however many
blocks came before.

Tiles know nothing of each other, so several processes can cut one workpiece: all of them halve alike, and each
cuts the tiles of its own colour. A tile is coloured when it first has the wanted size, as the squares of a
chessboard are; neighbours then mostly differ, and both sides of a path are busy. `joined` takes every tile from
the process that cut it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from manifold3d import Manifold

from vmachining.arrays import Floats
from vmachining.engines.mesh.facets import Side
from vmachining.engines.mesh.solids import checked
from vmachining.engines.mesh.window import Window, roofed
from vmachining.engines.protocol import Share

SHAPE = np.array([1.0, 1.0, 1.0 / 8.0])
"""Tiles are columns: walls along the tool axis are few tall facets, so cutting them in height only adds tiles."""

ROOF_CELLS = 54
"""Cells of the grid of heights along the longer side of a tile: a ball sees its contact in two dozen."""

SIDES = (Side.INNER, Side.OUTER)


@dataclass(slots=True, eq=False)
class Tile:
    """Part of the stock. solids and volumes are by `Side`; box (2, 3) holds the larger of the solids.

    place : number along each axis, counted from below in tiles of its size. color : says who cuts it, None until
    it is small enough.
    """

    solids: dict[Side, Manifold]
    volumes: dict[Side, float]
    box: Floats
    halves: tuple[Tile, Tile] | None = None
    place: tuple[int, ...] = (0, 0, 0)
    color: int | None = None
    _window: Window | None = None

    @classmethod
    def of(cls, solids: dict[Side, Manifold]) -> Tile | None:
        """Tile of two solids, None if nothing is left in it."""
        if solids[Side.INNER].is_empty():
            return None
        tile = cls(solids, {}, np.empty((2, 3)))
        for side in SIDES:
            tile.put(side, solids[side])
        return tile

    def put(self, side: Side, result: Manifold) -> None:
        """Replace one solid and what is known about it; INNER before OUTER."""
        self.solids[side] = result
        if side is Side.OUTER and result is self.solids[Side.INNER]:
            self.volumes[side] = self.volumes[Side.INNER]
            return
        self.volumes[side] = float(result.volume())
        if side is Side.INNER:
            self.box = np.array(result.bounding_box()).reshape(2, 3)
            self._window = None

    @property
    def is_empty(self) -> bool:
        """Whether nothing is left of it; it may have been halved."""
        return not self.solids or self.solids[Side.INNER].is_empty()

    @property
    def window(self) -> Window:
        """What it lets be seen, made when it is requested."""
        if self._window is None:
            mesh = self.solids[Side.INNER].to_mesh64()
            margin = 1e-6 * (1.0 + float(np.abs(self.box).max()))
            cell = max(float((self.box[1] - self.box[0])[:2].max()) / ROOF_CELLS, 1e-3)
            wide = self.box + [[-margin], [margin]]
            self._window = roofed(mesh.vert_properties, mesh.tri_verts, wide, cell)
        return self._window

    def halve(self) -> None:
        """Split across the longest side, in the middle."""
        axis = int(np.argmax((self.box[1] - self.box[0]) * SHAPE))
        at = float(self.box[:, axis].mean())
        normal = tuple(float(k == axis) for k in range(3))
        upper, lower = {}, {}
        shared: dict[int, tuple[Manifold, Manifold]] = {}
        for side, part in self.solids.items():
            if id(part) not in shared:
                above, below = part.split_by_plane(normal, at)
                shared[id(part)] = checked(above), checked(below)
            upper[side], lower[side] = shared[id(part)]
        halves = Tile.of(upper), Tile.of(lower)
        if halves[0] is None or halves[1] is None:  # all on one side: its box was not tight
            only = halves[0] or halves[1]
            assert only is not None
            self.box = only.box
            return
        self.halves = (halves[0], halves[1])
        for k, half in enumerate(self.halves):
            half.place = tuple(2 * n + 1 - k if i == axis else n for i, n in enumerate(self.place))
            half.color = self.color
        self.solids.clear()
        self._window = None

    def leaves(self) -> Iterator[Tile]:
        """Tiles that are not halved, in a fixed order."""
        stack = [self]
        while stack:
            tile = stack.pop()
            if tile.halves is not None:
                stack.extend(reversed(tile.halves))
            elif not tile.is_empty:
                yield tile


def reached(root: Tile, box: Floats, size: float | None, share: Share) -> list[Tile]:
    """Leaves of a share that the box (2, 3) overlaps, halved down to `size` (mm) where it does.

    A share cuts the tiles whose colour leaves `part` when divided by `parts`.
    With None the tiles stay as they are, and those without a colour are for the first process.
    """
    found: list[Tile] = []
    stack = [root]
    (x0, y0, z0), (x1, y1, z1) = box.tolist()
    while stack:
        tile = stack.pop()
        if tile.is_empty and tile.halves is None:
            continue
        if tile.color is not None and tile.color % share.parts != share.part:
            continue
        (a0, b0, c0), (a1, b1, c1) = tile.box.tolist()
        if not (x0 < a1 and a0 < x1 and y0 < b1 and b0 < y1 and z0 < c1 and c0 < z1):
            continue
        if tile.halves is None:
            if size is None:
                if tile.color is not None or share.part == 0:
                    found.append(tile)
                continue
            if max(a1 - a0, b1 - b0, (c1 - c0) * SHAPE[2]) <= size:
                if tile.color is None:
                    tile.color = sum(tile.place)
                    if tile.color % share.parts != share.part:
                        continue
                found.append(tile)
                continue
            tile.halve()
            if tile.halves is None:
                stack.append(tile)
                continue
        stack.extend(reversed(tile.halves))
    return found


def joined(roots: Sequence[Tile]) -> Tile:
    """One tree of the trees of all shares, in their order."""
    tile = roots[0]
    if tile.color is not None:
        return roots[tile.color % len(roots)]
    if tile.halves is not None:
        pairs = [root.halves for root in roots if root.halves is not None]
        tile.halves = joined([pair[0] for pair in pairs]), joined([pair[1] for pair in pairs])
    return tile
