"""One sweep against one tile: what it removes, with a bracket, once bounded in advance and once by two workpieces.

In advance (`cut_once`): the tile's solid is cut by the inner sweep, one boolean. What inner facets leave is
bounded by frustums, see `vmachining.engines.mesh.skin`, and its mean makes the estimate. Raw stock that is not
exactly a mesh (a round one) has a larger and a smaller solid; both are cut alike, and what only the larger one
loses is not in lo.

By two workpieces (`cut_twice`): A is cut by inner sweeps, B by outer ones, W the sweep:

    hi = vol(A and W_outer)      the most that can be left, cut by the most that can cut
    lo = vol(B and W_inner)      the least by the least

W_inner < W < W_outer for every block, so B < S < A by induction for the true workpiece S, hence lo <= truth <= hi.
The estimate is that of the means on the facets of A. Where a turning tool has been, or the raw stock is round,
it is w vol(A and W_inner) + (1 - w) vol(B and W_outer) with a weight that cancels the error of the facets, see
`solids.balance`.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from manifold3d import Manifold, OpType

from vmachining.arrays import Floats
from vmachining.engines.mesh.ahead import Ahead
from vmachining.engines.mesh.curved import way
from vmachining.engines.mesh.facets import Side
from vmachining.engines.mesh.skin import Skin, thick
from vmachining.engines.mesh.solids import balance, checked, cutters, manifold, pieces
from vmachining.engines.mesh.straight import Facets, facets
from vmachining.engines.mesh.tiles import SIDES, Tile
from vmachining.engines.mesh.window import Window, above, below
from vmachining.geometry import Bracket, Line
from vmachining.sweep import Sweep, Turn
from vmachining.tolerance import VOLUME_REL

__all__ = ["AIR", "Cut", "Start", "cut_once", "cut_twice", "shared"]

TWICE_REL = 3e-6
"""Part of a turning sweep that its meshes may count twice or leave as crevices, at most, where a disc tilts into
what it has just left; seen on hundreds of random blocks, see `turning`. Brackets are widened by it."""

MANY = 3
"""Pieces of a sweep that are united before they meet a large solid."""

AIR = Bracket(0.0, 0.0, 0.0)


class Start(Enum):
    """What of the cutter at the start of a path the cut before has removed.

    SHED : so much that the rear may be left out of the mesh although places of the skin are forgotten, see `skin`.
    """

    FRESH = "nothing"
    CHAINED = "the true cutter from the true workpiece"
    SHED = "what lies deep in its mesh from the mesh too"
    CLEAN = "all of its mesh from the mesh too"


@dataclass(frozen=True, slots=True, eq=False)
class Cut:
    """One block on its way through the tiles.

    number : of the cut, in order. start : what the cut before has left where this one begins. run : id that its
    faces get, or None. bounds : (2, 3) mm, of the sweep. ahead : what a chained one can still remove.
    """

    sweep: Sweep
    chord: float
    number: int
    start: Start
    run: int | None
    bounds: Floats
    ahead: Ahead | None

    def facets(self, side: Side) -> Facets:
        """The cutter from one side."""
        return facets(self.sweep.profile, self.chord, side)

    @property
    def weight(self) -> float:
        """Of the inner solids in the estimate of `cut_twice`."""
        return balance(self.sweep, self.facets(Side.INNER), self.facets(Side.OUTER))


def _inner(view: Window, cut: Cut, *, shed: bool) -> tuple[list[Manifold], list[Skin]]:
    """Inner solids of an upright tool, with means on their facets, and what they leave."""
    solids, left = [], []
    tool, chained = cut.facets(Side.INNER), cut.start is not Start.FRESH
    for piece in pieces(cut.sweep, tool, view, chained, skinned=True, shed=shed):
        if len(piece.skin):
            left.append(Skin.of(piece.skin))
        if len(piece.triangles):
            assert piece.mean is not None and piece.kin is not None
            ids = thick(piece.triangles, piece.mean, piece.kin, cut.chord)
            solids.append(manifold(piece.points, piece.triangles, cut.run, ids))
    return solids, left


def _view(tile: Tile, cut: Cut, *, clean: bool) -> Window | None:
    """What of a tile the sweep may find material in; None where that is nothing, and the solids stay as they are.

    Of a chained block only what is ahead of the cutter counts, and what is behind may remain in the mesh; the
    tile is then dusty. Where the start is clean, mesh and skin need only be right below what is ahead.
    """
    if cut.ahead is not None:
        view = _view_ahead(tile, cut.ahead, clean=clean)
        if view is None:
            tile.dusty = cut.number
        return view
    surface = above(tile.shell, cut.bounds)
    if (cut.bounds[0] >= tile.box[0]).all() and (cut.bounds[1] <= tile.box[1]).all():
        return tile.window  # all of it may lie below the surface
    whole = way(cut.sweep, cut.chord, tile.wide_box)
    met = any(
        sweep.meets(surface.hulls, surface.boxes, slack=whole.slack, depth=np.inf)[0].any()
        for sweep in whole.sweeps
    )
    return tile.window if met else None


def _view_ahead(tile: Tile, ahead: Ahead, *, clean: bool) -> Window | None:
    """The same for a chained block."""
    box = tile.wide_box.copy()
    np.maximum(box[0], ahead.box[0], out=box[0])
    np.minimum(box[1], ahead.box[1], out=box[1])
    if (box[0] >= box[1]).any():
        return None
    surface = above(tile.shell, ahead.box, ahead.limits)
    met, over = ahead.meets(surface, tile.box)
    if not met:
        return None
    if clean and surface.top < ahead.top:
        return below(surface.hulls, over, box, tile.cell)
    return tile.window


def cut_once(tile: Tile, cut: Cut) -> Bracket:
    """Remove a sweep of an upright tool from a tile; mm^3, bounded in advance."""
    sweep = cut.sweep
    shed = cut.start in (Start.SHED, Start.CLEAN) and tile.dusty != cut.number - 1
    view = _view(tile, cut, clean=shed and cut.start is Start.CLEAN)
    if view is None:
        return AIR
    solids, left = _inner(view, cut, shed=shed)
    if not solids and not left:
        return AIR
    skin, whole = Skin.joined(left), way(sweep, cut.chord, tile.wide_box)
    if len(left) > 1 or not isinstance(sweep.path, Line):  # facets inside another piece leave nothing
        skin = skin.where(~skin.under(whole)[1])
    large, small = tile.solids[Side.INNER], tile.solids[Side.OUTER]
    noise = VOLUME_REL * (1.0 + tile.volumes[Side.INNER])
    loss = dict.fromkeys(SIDES, 0.0)
    if solids:
        rest = minus(large, solids)
        volume = float(rest.volume())
        loss[Side.INNER] = tile.volumes[Side.INNER] - volume
    if loss[Side.INNER] <= noise:  # rounding, not metal: leave the solid as it is, exactly
        if solids:
            tile.dusty = cut.number
        if not skin.total > 0.0:
            return AIR
        tile.cover(skin)
        return Bracket(0.0, 0.0, noise + skin.total)
    met, gone = tile.places.skin.under(whole)
    before = tile.lacking
    other = rest
    if small is not large:
        other = minus(small, solids)
        loss[Side.OUTER] = tile.volumes[Side.OUTER] - float(other.volume())
    else:
        loss[Side.OUTER] = loss[Side.INNER]
    tile.put(Side.INNER, rest, volume)
    tile.put(Side.OUTER, other)
    tile.places.drop(gone)
    tile.cover(skin)
    return Bracket(
        max(0.0, min(loss.values()) - met - noise),
        loss[Side.INNER] + tile.lacking - before,
        loss[Side.INNER] + skin.total + noise,
    )


def cut_twice(tile: Tile, cut: Cut) -> Bracket:
    """Remove a sweep from both workpieces of a tile; mm^3."""
    path, window = cut.sweep.path, tile.window
    if not isinstance(path, Turn) and _view(tile, cut, clean=False) is None:
        return AIR

    def solids(side: Side) -> list[Manifold]:
        chained = cut.start is not Start.FRESH
        return cutters(cut.sweep, cut.facets(side), window, chained=chained, block_id=cut.run)

    outer = solids(Side.OUTER)
    if not outer:
        return AIR
    inner_cut, outer_cut = tile.solids[Side.INNER], tile.solids[Side.OUTER]
    fresh = inner_cut is outer_cut
    noise = VOLUME_REL * (1.0 + tile.volumes[Side.INNER])
    rest = dict.fromkeys(SIDES, inner_cut)
    if fresh:
        rest[Side.OUTER] = minus(inner_cut, outer)
        hi = tile.volumes[Side.INNER] - float(rest[Side.OUTER].volume())
    else:
        hi = shared(inner_cut, outer)
    if hi <= noise:  # rounding, not metal: leave the tile as it is, exactly
        return AIR
    inner = solids(Side.INNER) if isinstance(path, Turn) else _inner(window, cut, shed=True)[0]
    lo = 0.0 if fresh else shared(outer_cut, inner)
    rest[Side.INNER] = minus(inner_cut, inner)
    if not fresh:
        rest[Side.OUTER] = minus(outer_cut, outer)
    thin = tile.thin
    removed = dict.fromkeys(SIDES, 0.0)
    for side in SIDES:
        loss = tile.volumes[side] - float(rest[side].volume())
        if loss > noise:
            removed[side] = loss
            tile.put(side, rest[side])
    if fresh:
        lo = removed[Side.INNER]
    if isinstance(path, Turn):
        tile.has_means = False
        if not path.is_steady:
            noise += TWICE_REL * sum(float(cutter.volume()) for cutter in outer)
    if tile.has_means:
        estimate = removed[Side.INNER] + tile.thin - thin
    else:
        weight = cut.weight
        estimate = weight * removed[Side.INNER] + (1.0 - weight) * removed[Side.OUTER]
    lo, hi = max(0.0, lo - noise), hi + noise
    return Bracket(lo, min(max(estimate, lo), hi), hi)


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
