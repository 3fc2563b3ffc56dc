"""One sweep against one tile: what it removes, proved by two workpieces.

A is cut by inner sweeps, B by outer ones, W the sweep:

    hi = vol(A and W_outer)      the most that can be left, cut by the most that can cut
    lo = vol(B and W_inner)      the least by the least

W_inner < W < W_outer for every block, so B < S < A by induction for the true workpiece S, hence lo <= truth <= hi.
The estimate is w vol(A and W_inner) + (1 - w) vol(B and W_outer) with a weight that cancels the error of the facets,
see `solids.balance`.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from manifold3d import Manifold, OpType

from vmachining.engines.mesh.facets import Side
from vmachining.engines.mesh.solids import HULLS, balance, checked, cutters, manifold, united
from vmachining.engines.mesh.straight import facets
from vmachining.engines.mesh.tiles import SIDES, Tile
from vmachining.engines.mesh.turning.hulls import turning_hulls
from vmachining.engines.protocol import NOTHING, Removal
from vmachining.errors import EngineError
from vmachining.sweep import Sweep, Turn
from vmachining.tolerance import VOLUME_REL

TWICE_REL = 3e-6
"""Part of a turning sweep that its meshes may count twice or leave as crevices, at most, where a disc tilts into
what it has just left; seen on hundreds of random blocks, see `turning`. Brackets are widened by it."""

MANY = 3
"""Pieces of a sweep that are united before they meet a large solid."""


UNPROVEN = "the tool turns too far for hulls of its poses, or they degenerate"
"""Note of what is not proven."""


class Solids(NamedTuple):
    """A sweep from one side: solids whose union it is, and whether it is proven to be that, see `turning`."""

    parts: list[Manifold]
    proven: bool


@dataclass(frozen=True, slots=True, eq=False)
class Cut:
    """One block on its way through the tiles.

    chord : mm, of the facets. chained : whether the cutter where the sweep starts has been removed before.
    run : id that its faces get, or None.
    """

    sweep: Sweep
    chord: float
    chained: bool = False
    run: int | None = None

    def solids(self, tile: Tile, side: Side) -> Solids:
        """The sweep from one side, as far as the tile can see it."""
        sweep, window = self.sweep, tile.window
        if isinstance(sweep.path, Turn):
            box = np.stack([window.lo, window.hi])
            with suppress(EngineError):  # a hull with slivers may not close
                meshes = turning_hulls(sweep, self.chord, side, box, chained=self.chained)
                if meshes is not None:
                    whole = united([manifold(*mesh, self.run) for mesh in meshes])
                    return Solids([] if whole.is_empty() else [whole], True)
        tool = facets(sweep.profile, self.chord, side)
        solids = cutters(sweep, tool, window, chained=self.chained, block_id=self.run)
        return Solids(solids, not isinstance(sweep.path, Turn))

    def removal(
        self, tile: Tile, lo: float, hi: float, ends: dict[Side, float], inner: Solids, outer: Solids
    ) -> Removal:
        """Bounds, widened by rounding, and the estimate between what inner sweeps take of A and outer ones of B."""
        noise, proven = _noise(tile), inner.proven and outer.proven
        if not proven:
            noise += TWICE_REL * sum(float(cutter.volume()) for cutter in outer.parts)
        tools = (facets(self.sweep.profile, self.chord, side) for side in (Side.INNER, Side.OUTER))
        weight = HULLS if proven and isinstance(self.sweep.path, Turn) else balance(self.sweep, *tools)
        estimate = weight * ends[Side.INNER] + (1.0 - weight) * ends[Side.OUTER]
        lo, hi = max(0.0, lo - noise), hi + noise
        return Removal(lo, min(max(estimate, lo), hi), hi, proven, note=None if proven else UNPROVEN)


def _nothing(outer: Solids) -> Removal:
    """Of a tile of which its outer mesh takes nothing."""
    return NOTHING if outer.proven else NOTHING._replace(proven=False, note=UNPROVEN)


def cut(tile: Tile, block: Cut) -> Removal:
    """Remove a sweep from both workpieces of a tile; exactly 0 where it takes no more than rounding."""
    outer = block.solids(tile, Side.OUTER)
    if not outer.parts:
        return _nothing(outer)
    inner_cut, outer_cut = tile.solids[Side.INNER], tile.solids[Side.OUTER]
    fresh, noise = inner_cut is outer_cut, _noise(tile)
    rest = dict.fromkeys(SIDES, inner_cut)
    if fresh:
        rest[Side.OUTER] = minus(inner_cut, outer.parts)
        hi = tile.volumes[Side.INNER] - float(rest[Side.OUTER].volume())
    else:
        hi = shared(inner_cut, outer.parts)
    if hi <= noise:  # rounding, not metal: leave the tile as it is, exactly
        return _nothing(outer)
    inner = block.solids(tile, Side.INNER)
    lo = 0.0 if fresh else shared(outer_cut, inner.parts)
    rest[Side.INNER] = minus(inner_cut, inner.parts)
    if not fresh:
        rest[Side.OUTER] = minus(outer_cut, outer.parts)
    removed = dict.fromkeys(SIDES, 0.0)
    for side in SIDES:
        loss = tile.volumes[side] - float(rest[side].volume())
        if loss > noise:
            removed[side] = loss
            tile.put(side, rest[side])
    return block.removal(tile, removed[Side.INNER] if fresh else lo, hi, removed, inner, outer)


def touch(tile: Tile, block: Cut) -> Removal:
    """What `cut` would remove; the tile stays."""
    outer = block.solids(tile, Side.OUTER)
    inner_cut, outer_cut = tile.solids[Side.INNER], tile.solids[Side.OUTER]
    hi = shared(inner_cut, outer.parts)
    if hi <= _noise(tile):
        return _nothing(outer)
    inner = block.solids(tile, Side.INNER)
    taken = {Side.INNER: shared(inner_cut, inner.parts), Side.OUTER: hi}
    lo = taken[Side.INNER]
    if outer_cut is not inner_cut:
        lo, taken[Side.OUTER] = shared(outer_cut, inner.parts), shared(outer_cut, outer.parts)
    return block.removal(tile, lo, hi, taken, inner, outer)


def _noise(tile: Tile) -> float:
    """mm^3, rounding of volumes."""
    return VOLUME_REL * (1.0 + tile.volumes[Side.INNER])


def minus(solid: Manifold, cutters: list[Manifold]) -> Manifold:
    """The solid without the cutters."""
    for cutter in cutters:
        solid = solid - cutter
    return checked(solid)


def shared(solid: Manifold, cutters: list[Manifold]) -> float:
    """mm^3 of the solid that the cutters take. One cutter: the chip is a smaller mesh than what it leaves."""
    if not cutters or solid.is_empty():
        return 0.0
    if len(cutters) == 1:
        return float(checked(solid ^ cutters[0]).volume())
    if len(cutters) > MANY:
        return float(checked(solid ^ Manifold.batch_boolean(cutters, OpType.Add)).volume())
    return float(solid.volume()) - float(minus(solid, cutters).volume())
