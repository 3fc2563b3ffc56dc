"""`NormalVectors`: vectors along the normals of features (DNV), on lattices over facets and edges.

Only lengths are kept, 4 bytes a vector and a bit; where a vector stands is computed again from its facet, and lambda is kept
once for a group of some 64 where it is the same for all. A group takes about 42 bytes, a facet with vectors 113.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.arrays import Bools, Floats, Ints
from vmachining.engines.vectors.lattice import _kernels as lattices
from vmachining.engines.vectors.lattice.balls import _kernels as ball_kernels
from vmachining.engines.vectors.part import DesignPart, Features, first_hits
from vmachining.errors import InputError
from vmachining.geometry.boxtree import box_tree, curve_order
from vmachining.stock import MeshStock, Stock
from vmachining.sweep import Sweep
from vmachining.sweep.ball import ball_block

PATCH_BYTES = 113
"""What a patch takes beside its vectors."""

MOST = 2**31 - 1
"""Vectors along normals: their numbers have 32 bits."""

PIECE = 1 << 18
"""Vectors whose feet are laid out at a time."""


class Patches(NamedTuple):
    """Facets and edges that vectors stand on, all vectors of one with one direction.

    corner : (m, 3, 3) mm, ends of the longest side, then the opposite corner. normal : (m, 3). facet : (m,) -1 on an edge.
    kind : (m,) index into `KINDS`.
    """

    corner: Floats
    normal: Floats
    facet: Ints
    kind: NDArray[np.uint8]

    @classmethod
    def of(cls, part: DesignPart, covered: Bools, found: Features, *, edges: bool) -> Patches:
        """Of some facets of a part, and of its sharp edges."""
        chosen = np.flatnonzero(covered)
        corner = part.corners[chosen]
        side = ((corner[:, [1, 2, 0]] - corner) ** 2).sum(axis=2).argmax(axis=1)
        turned = (side[:, None] + np.arange(3)) % 3
        corner = np.take_along_axis(corner, turned[:, :, None], axis=1)
        kind = np.where(found.wall[chosen], 1, np.where(found.overhang[chosen], 2, 4))
        normal, facet = part.normals[chosen], chosen
        if edges:
            a, b = found.edge[:, 0], found.edge[:, 1]
            corner = np.concatenate([corner, np.stack([a, b, a], axis=1)])
            normal = np.concatenate([normal, found.edge_normal])
            facet = np.concatenate([facet, np.full(len(a), -1)])
            kind = np.concatenate([kind, np.full(len(a), 3)])
        return cls(np.ascontiguousarray(corner), np.ascontiguousarray(normal), facet, kind.astype(np.uint8))


class Piece(NamedTuple):
    """Some vectors laid out: point, normal (n, 3), low, length (n,) mm, behind (n,), facet, kind (n,)."""

    point: Floats
    normal: Floats
    low: Floats
    length: Floats
    behind: Bools
    facet: Ints
    kind: Ints


class NormalVectors:
    """Vectors with their own direction.

    lattice : what the kernels work on. patches : what they stand on.
    """

    def __init__(self, patches: Patches, spacing: float) -> None:
        self.patches = patches
        corner = patches.corner
        at = np.zeros(len(corner) + 1, dtype=np.int64)
        lattices.count_groups(corner, spacing, at)
        at = np.cumsum(at)
        groups = int(at[-1])
        patch, place = (np.zeros(groups, dtype=np.int32) for _ in range(2))
        first = np.zeros(groups + 1, dtype=np.int32)
        middle, half = np.zeros((groups, 3), dtype=np.float32), np.zeros(groups, dtype=np.float32)
        lattices.lay_groups(corner, spacing, at, patch, place, first, middle, half)
        full = first[1:] > 0  # towards the corner of a facet some shares of rows have no vector
        patch, place = patch[full], place[full]
        middle, half, many = middle[full], half[full], first[1:][full]
        if len(middle):  # neighbours lie together
            order = curve_order(middle.astype(np.float64))
            patch, place = patch[order], place[order]
            middle, half, many = middle[order], half[order], many[order]
        groups, count = len(patch), int(many.sum())
        if count > MOST:
            what = f"{count:,} vectors along normals, more than {MOST:,}"
            raise InputError(what, remedy="take a larger spacing_mm")
        first = np.concatenate([[0], np.cumsum(many)]).astype(np.int32)
        unknown = np.zeros(1, dtype=np.float32)  # the lambda of all groups until `set_ends` gives them theirs
        self.lattice = lattices.Lattice(
            corner, patches.normal, float(spacing), patch, place, first, middle, half,
            np.zeros(groups, dtype=np.float32), np.zeros(groups + 1, dtype=np.int32), unknown,
            np.zeros(count, dtype=np.float32), np.zeros(-(-count // 8), dtype=np.uint8), np.empty((0, 6)),
        )  # fmt: skip

    def set_ends(self, low: Floats | NDArray[np.float32], length: Floats | NDArray[np.float32]) -> None:
        """Give all vectors lambda and L (n,) mm.

        Raises InputError: lambda is not below 0 and L.
        """
        bad = ~((low < 0.0) & (low < length))
        if bad.any():
            k = int(np.argmax(bad))
            ends = f"lambda {low[k]:g} mm must lie below 0 and below its length {length[k]:g} mm"
            raise InputError(f"vector {k}: {ends}")
        first = self.lattice.first
        least, most = _over(np.minimum, low, first, np.float32), _over(np.maximum, low, first, np.float32)
        kept = np.where(least == most, 1, np.diff(first))
        low_first = np.concatenate([[0], np.cumsum(kept)]).astype(np.int32)
        which = np.repeat(least == most, np.diff(first))
        lows = np.empty(int(low_first[-1]), dtype=np.float32)
        one = np.zeros(len(lows), dtype=np.bool_)
        one[low_first[:-1][least == most]] = True
        lows[one], lows[~one] = least[least == most], low[~which]
        self.lattice.length[:] = length
        reach = _over(np.maximum, self.lattice.length, first, np.float32)
        self.lattice.reach[:] = reach
        self.lattice = self.lattice._replace(low=lows, low_first=low_first)
        lo, hi = np.empty((len(first) - 1, 3)), np.empty((len(first) - 1, 3))
        lattices.ends(self.lattice, lo, hi)
        self.lattice = self.lattice._replace(boxes=box_tree(lo, hi, lattices.LEAF))

    def __len__(self) -> int:
        return len(self.lattice.length)

    @property
    def bytes_each(self) -> float:
        """Memory of everything that belongs to the vectors, bytes for each."""
        arrays = (*self.lattice, self.patches.facet, self.patches.kind)
        return sum(v.nbytes for v in arrays if isinstance(v, np.ndarray)) / max(len(self), 1)

    # -- laid out ------------------------------------------------------------------------------------------

    def pieces(self) -> Iterator[Piece]:
        """All vectors, in their order, some at a time."""
        first, start = self.lattice.first, 0
        while start < len(first) - 1:
            stop = int(np.searchsorted(first, int(first[start]) + PIECE, side="right")) - 1
            stop = max(stop, start + 1)
            yield self.piece(np.arange(start, stop))
            start = stop

    def piece(self, groups: Ints) -> Piece:
        """The vectors of some groups, rising."""
        first = self.lattice.first
        many = first[groups + 1] - first[groups]
        count = int(many.sum())
        point, low = np.empty((count, 3)), np.empty(count)
        lattices.feet(self.lattice, groups, point)
        lattices.lows(self.lattice, groups, low)
        patch = np.repeat(self.lattice.patch[groups], many)
        at = np.repeat(first[groups] - (np.cumsum(many) - many), many) + np.arange(count)
        behind = (self.lattice.behind[at // 8] >> (at % 8).astype(np.uint8)) & 1
        return Piece(
            point, self.lattice.normal[patch], low, self.lattice.length[at].astype(np.float64), behind > 0,
            self.patches.facet[patch], self.patches.kind[patch].astype(np.int64),
        )  # fmt: skip

    @property
    def laid(self) -> Piece:
        """All of them."""
        return self.piece(np.arange(len(self.lattice.patch)))

    @property
    def length(self) -> NDArray[np.float32]:
        """(n,) mm: L."""
        return self.lattice.length

    # -- blocks --------------------------------------------------------------------------------------------

    def near(self, sweep: Sweep) -> Ints:
        """Groups of which a piece from lambda to L may come into the box of a sweep (bucket, spec E.5)."""
        out = np.empty(len(self.lattice.patch), dtype=np.int64)
        if not len(self):
            return out
        return out[: lattices.near_groups(self.lattice, sweep.bounds, out)]

    def cut(self, sweep: Sweep) -> None:
        """Shorten the vectors that a sweep enters."""
        ball = ball_block(sweep)
        if ball is not None:
            self.cut_balls(np.array([ball.row]), [sweep])
        else:
            self._shorten(sweep, self.near(sweep))

    def cut_balls(self, balls: Floats, sweeps: Sequence[Sweep]) -> None:
        """The same for blocks (k, 8) of ball cutters, see `BallBlock.row`, by closed forms."""
        if not len(self) or not len(balls):
            return
        unsure = np.empty(len(self.lattice.patch), dtype=np.int64)
        left = unsure[: ball_kernels.cut_balls(self.lattice, balls, unsure)]
        if len(left):
            for sweep in sweeps:
                near = self.near(sweep)
                self._shorten(sweep, near[np.isin(near, left)])

    def _shorten(self, sweep: Sweep, groups: Ints) -> None:
        """By exact rays."""
        if not len(groups):
            return
        laid = self.piece(groups)
        ends = [laid.point + t[:, None] * laid.normal for t in (laid.low, laid.length)]
        box = sweep.bounds
        apart = (np.minimum(*ends) > box[1]) | (np.maximum(*ends) < box[0])
        at = np.flatnonzero(~apart.any(axis=1))
        if not len(at):
            return
        point, normal = np.ascontiguousarray(laid.point[at]), np.ascontiguousarray(laid.normal[at])
        rays = sweep.ray_intervals(point, normal)
        first = np.concatenate([[0], np.cumsum(rays.counts)])
        lattices.shorten(self.lattice, groups, at, first, rays.enter, rays.leave)

    # -- before the first cut ------------------------------------------------------------------------------

    def lay(
        self,
        part: DesignPart,
        stock: Stock,
        *,
        allowance: float,
        depth: float,
        chord: float,
        casting: float | None,
    ) -> None:
        """lambda and L of all vectors before the first cut, see `normal_lengths`; casting: L of all of them."""
        low, length = np.empty(len(self), dtype=np.float32), np.empty(len(self), dtype=np.float32)
        outside, _ = stock.mesh(chord)
        body = MeshStock(outside.vertices, outside.triangles)
        at = 0
        for laid in self.pieces():
            rows = slice(at, at + len(laid.point))
            inward = np.ascontiguousarray(-laid.normal)
            low[rows] = -np.minimum(part.leave(laid.point, inward, depth), depth)
            if casting is not None:
                length[rows] = casting
            else:
                length[rows] = _stock_lengths(part, stock, body, laid, allowance)
            at = rows.stop
        self.set_ends(low, length)


def _stock_lengths(part: DesignPart, stock: Stock, body: MeshStock, laid: Piece, allowance: float) -> Floats:
    """L ends at the stock's surface, where the part comes again (so no vector crosses a narrow slot), or at `allowance`.

    A point outside of the stock has L = 0.
    """
    again = part.meet(laid.point, laid.normal, allowance)
    leave = first_hits(body, laid.point, laid.normal, 1.0, 0.0, allowance)
    inside = stock.signed_distance(laid.point) < 0.0
    return np.where(inside, np.minimum(np.minimum(again, leave), allowance), 0.0)


def _over(
    ufunc: np.ufunc, values: Floats | NDArray[np.float32], first: NDArray[np.int32], kind: type[np.float32]
) -> NDArray[np.float32]:
    """Least or largest value of every group, none of which is empty; float32."""
    if len(first) == 1:
        return np.zeros(0, dtype=kind)
    return np.asarray(ufunc.reduceat(values.astype(kind), first[:-1]))
