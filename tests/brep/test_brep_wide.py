"""Turns of 20 to 60 degrees while the tip moves 50 to 100 mm: solids against exact distances, one motion per kind of cutter."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.wide_turns import motion
from vmachining import BallNose, BullNose, FlatEnd, Taper
from vmachining.engines.brep import held, solids, volume
from vmachining.engines.brep.envelopes.pieces import turn_pieces
from vmachining.engines.brep.envelopes.pockets import pockets
from vmachining.engines.brep.occt.booleans import quiet
from vmachining.engines.brep.occt.validity import inspect
from vmachining.engines.brep.write import compared
from vmachining.errors import EngineError
from vmachining.geometry import Line
from vmachining.job.single import swept_volume
from vmachining.sweep import Sweep, Turn
from vmachining.tool import Cutter

BULL = BullNose(diameter=30, corner_radius=5, length=50)
BOOK = Turn.through((0, 0, 0), (0, 100, 0), "ac", (0.0, 0.0), (np.radians(60), 0.0))
WIDE_MM = 1e-3


def _agrees(sweep: Sweep, count: int) -> None:
    """Valid solids whose union is the sweep, at points by exact distances."""
    quiet()
    parts = solids(sweep, miss_mm=WIDE_MM)
    fit = max(part.fit_mm for part in parts)
    assert fit <= WIDE_MM
    for part in parts:
        report = inspect(part.shape)
        assert report.valid and report.closed
    lo, hi = sweep.bounds
    points = np.random.default_rng(3).uniform(lo, hi, (count, 3))
    distance = sweep.signed_distance(points)
    clear = np.abs(distance) > fit
    assert (held([part.shape for part in parts], points[clear]) == (distance[clear] < 0.0)).all()
    assert (distance < 0.0).sum() > count // 5


@pytest.mark.parametrize(
    ("cutter", "end", "tilts", "heads"),
    [
        (FlatEnd(diameter=20, length=50), (70, 0, 0), (10, 30), (80, 110)),
        (BallNose(diameter=20, length=50), (80, 20, 10), (0, 40), (0, 30)),
        (Taper(diameter=6, taper_deg=10, length=40), (60, 0, 0), (10, 40), (70, 70)),
        (BULL, (70, 0, 0), (10, 30), (80, 110)),
    ],
    ids=["flat", "ball", "cone", "bull"],
)
def test_wide_turns(
    cutter: Cutter, end: tuple[float, ...], tilts: tuple[float, ...], heads: tuple[float, ...]
) -> None:
    """Motions whose envelope does not fold are one solid each."""
    first, last = ((np.radians(a), np.radians(c)) for a, c in zip(tilts, heads, strict=True))
    _agrees(Sweep.along(cutter.profile, Turn.through((0, 0, 0), end, "ac", first, last)), 200)


def test_a_pocket_is_filled() -> None:
    """The bull nose's bottom is left and entered again: the solid without the loop has the volume of the corrected flux.

    It holds what the block sweeps but for what its first and last pose hold, at points around the bottom.
    """
    quiet()
    part = BOOK.part(0.03, 0.1)
    (pocket,) = pockets(BULL.profile, part)
    (piece,) = turn_pieces(BULL.profile, part, 1e-5, filled=pocket)
    flux = piece.sweep.flux()
    missed = pocket.flux(BULL.profile, part)
    shape = piece.built.builder.solid()
    assert missed < -1.0
    assert volume(shape) == pytest.approx(flux.body + flux.flux + missed, abs=1e-3 * abs(missed))
    whole = Sweep.along(BULL.profile, part)
    lo, hi = whole.bounds
    points = np.random.default_rng(4).uniform(lo, [*hi[:2], 6.0], (300, 3))
    distance = whole.signed_distance(points)
    poses = [Sweep.along(BULL.profile, part.part(t, t)).signed_distance(points) for t in (0.0, 1.0)]
    clear = np.abs(distance) > 0.02
    found = held([shape], points[clear]) | (np.min(poses, axis=0)[clear] < 0.0)
    assert (found == (distance[clear] < 0.0)).all() and (distance[clear] < 0.0).sum() > 50


def test_what_a_union_lacks_is_measured() -> None:
    """A ball that skips 1 mm of its way leaves a ring of depth R - sqrt(R^2 - 1/4) out."""
    quiet()
    ball = BallNose(diameter=20, length=50).profile
    shapes = [
        solids(Sweep.along(ball, Line((a, 0, 0), (b, 0, 0))))[0].shape for a, b in ((0, 9.5), (10.5, 20))
    ]
    whole, lacks = Sweep.along(ball, Line((0, 0, 0), (20, 0, 0))), 10.0 - np.sqrt(100.0 - 0.25)
    assert compared(whole, shapes, 2.0 * lacks)[0] == 2.0 * lacks
    assert 0.9 * lacks < compared(whole, shapes, 0.3 * lacks)[0] < 1.25 * lacks
    with pytest.raises(EngineError, match="lack more than"):
        compared(whole, shapes, 0.05 * lacks)
    with pytest.raises(EngineError, match="leave the sweep"):
        compared(Sweep.along(ball, Line((0, 0, 0), (19.9, 0, 0))), shapes, 1e-3)


@pytest.mark.parametrize(
    ("kind", "seed", "span", "most"), [("flat", 1, (0.5, 0.52), 3), ("bull", 0, (0.1163, 0.1246), 1)]
)
def test_parts_of_hard_turns_lie_within_their_brackets(
    kind: str, seed: int, span: tuple[float, float], most: int
) -> None:
    """A shank that folds, as few slices as may be; a grazing curve that bends sharply at the rim of the bottom."""
    quiet()
    whole = motion(kind, seed)
    assert isinstance(whole.path, Turn)
    pieces = turn_pieces(whole.profile, whole.path.part(*span), 1e-5, loose_mm=WIDE_MM)
    assert len(pieces) <= most
    for piece in pieces:
        bracket = swept_volume(piece.sweep)
        assert bracket.holds(volume(piece.built.builder.solid()), slack=1e-7 * bracket.hi)
        assert piece.built.fit_mm <= WIDE_MM


@pytest.mark.long  # 15 s of processor
def test_the_book_s_motion() -> None:
    """Both ends fold: poses and bodies cover them."""
    _agrees(Sweep.along(BULL.profile, BOOK), 400)
