"""Solids of a block whose tool axis turns: cut in time where the grazing curve changes its shape, each gated.

1. `vmachining.sweep.topology.changes` finds the instants at which the curve reaches a joint, a chord of a disc is
   born or dies, two arcs merge. Between the pieces before and after lies `GAP_MM` of motion; their own time is
   slow there, so that the square roots that births are made of become smooth.
2. Where a valley of a flat face cannot be drawn in one go, or a chord begins to lie inside, the piece is halved.
3. Where a sheet lies inside the sweep (phi_tt < 0, sampled) the piece crosses itself along the line in which its
   first and last pose meet: halfway between them, -phi_tt / 8 above the sheet. If that is more than `MISS_MM`, or
   than what such a piece may miss, it is cut in equal parts: the depth falls with the square of their number. More
   than `PARTS` are refused.
4. What the tool reaches in the motion left out between two pieces, beyond its poses there, is measured in exact
   distances (`Slab`, `uncovered`); more than `GAP_MM` is refused, less is part of `fit_mm`.
5. Every piece must be valid and closed, and its volume must be the one of the flux identity V(K) + Phi - W to
   1e-5. A solid whose boundary runs through itself has V(K) + Phi instead, so what is entered twice cannot be lost.

Known limits, refused by name here, while `decomposition.py` looks for parts that can be built: pivots in the tool or close
to it (the envelope folds, or turns too fast to follow), motions that stay in a plane through the axis with no speed
along it, chords of a flat face with a round corner that lie deep inside, two arcs that merge there (too sharp for a
tensor product), centres of a ball on a path that bends more than the ball. Where the shape changes at the very start
or end, edges may be as short as 5e-7 mm.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.brep.envelopes.grazing_curve import Divide, GrazingCurve
from vmachining.engines.brep.envelopes.lens import lens_opens
from vmachining.engines.brep.envelopes.pockets import Pocket
from vmachining.engines.brep.envelopes.rings import Ring, rings_of
from vmachining.engines.brep.envelopes.segments import CurveSegment, EdgeSpan, Moving
from vmachining.engines.brep.envelopes.sheets import Built, enveloped
from vmachining.engines.brep.occt.tolerances import END_GAP_MM, FLAT_MM, GAP_MM, MISS_MM, SHORT_PIECE_MM
from vmachining.engines.brep.translations.caps import Tool
from vmachining.errors import SweepError
from vmachining.sweep import Sweep, Turn
from vmachining.sweep.folds import Slab, uncovered
from vmachining.sweep.topology import changes
from vmachining.tool import Profile

PARTS = 64
"""Most pieces of one block before it is refused."""

SLICES = 8
"""The same of a part that may miss the truth: slices of a fold almost coincide, poses take less."""

SAME_BETA = 1e-3
"""rad: normals so far beyond those of a face are not of it. They show where rounding decides, as about a corner of
the grazing curve, which a torus has where its way begins level."""

LOOKS, FINE = 17, 257
"""Places along a sheet at which it is looked at for folds, and corners of the polygon that its length is taken of."""


class Piece(NamedTuple):
    """sweep : the exact sweep of a part of the block in time. built : its faces."""

    sweep: Sweep
    built: Built


def turn_pieces(
    profile: Profile,
    path: Turn,
    fit_mm: float,
    take: Callable[[], None] = lambda: None,
    *,
    loose_mm: float = 0.0,
    soft: tuple[float, float] = (np.inf, np.inf),
    filled: Pocket | None = None,
) -> list[Piece]:
    """Parts of a block of a convex profile, in order of time. take : told of every envelope that is tried.

    loose_mm : what sheets may miss that do not come within `fit_mm`. soft : as of `Moving`, for both ends of the block.
    filled : a pocket whose loop is left out.

    Raises SweepError: A sheet folds inside the sweep, or the grazing curve is of a shape that has no solid here.
    Raises EngineError: Edges do not fit.
    """
    cuts = cuts_of(profile, path)
    if filled is not None:
        lo, hi = sorted(filled.heights(profile))
        cuts = [c.t for c in changes(Sweep.along(profile, path)) if c.t in cuts and not lo <= c.z < hi]
        cuts = sorted(set(cuts))
    work = _Work(profile, path, fit_mm, take, loose_mm=loose_mm, soft=soft, filled=filled)
    stops = [0.0, *cuts, 1.0]
    for k in range(len(stops) - 1):
        work.add(stops[k], stops[k + 1], k > 0, k + 1 < len(stops) - 1)
    return work.joined()


def cuts_of(profile: Profile, path: Turn) -> list[float]:
    """Instants at which the grazing curve changes its shape, in a way that changes the sheets."""
    ends = (profile.z_min, profile.z_max)
    found = changes(Sweep.along(profile, path))
    swaps = {c.t for c in found if c.kind == "swap"} if not path.is_steady else set()
    moving, rings = Moving(path), rings_of(Tool.of(profile))[0]
    has_round_tip = profile.points[0, 0] <= FLAT_MM and profile.segments[0].is_arc
    out = set()
    for c in found:
        # the chord of a disc passes its middle, the curve the tip of a ball
        passes = c.t in swaps and (c.kind in ("swap", "merge") or c.z in ends)
        if passes or (c.kind == "merge" and c.z in ends):
            continue
        is_end = c.kind == "end" and c.z in ends
        if is_end and ((c.z == profile.z_min and has_round_tip) or _is_lens(moving, c.t, c.z, rings)):
            continue
        out.add(c.t)
    return sorted(out)


def _is_lens(moving: Moving, t: float, z: float, rings: list[Ring]) -> bool:
    """Whether the chord of a disc opens or closes as a lens, which needs no cut."""
    for k, ring in enumerate(rings):
        if ring.disc and ring.z == z:
            beside = k - ring.disc
            if 0 <= beside < len(rings) and rings[beside].joint == ring.joint:
                return lens_opens(moving, t, ring, rings[beside])
    return False


class _Work:
    """Pieces in the making."""

    def __init__(
        self, profile: Profile, path: Turn, fit_mm: float, take: Callable[[], None], *,
        loose_mm: float, soft: tuple[float, float], filled: Pocket | None,
    ) -> None:  # fmt: skip
        self.profile, self.path, self.fit, self.take = profile, path, fit_mm, take
        self.loose, self.soft, self.filled = loose_mm, soft, filled
        self.deep = max(MISS_MM, loose_mm)
        self.tool = Tool.of(profile)
        self.out: list[Piece] = []
        self.spans: list[tuple[float, float]] = []
        reach = float(np.abs(profile.points[:, 1]).max() + profile.max_radius)
        self.speed = path.tip_series.bound(1) + reach * path.axis_series.bound(1)

    def add(self, a: float, b: float, soft_a: bool, soft_b: bool) -> None:
        """The part from t = a to b; soft ends are changes of shape."""
        self.take()
        shares = [0.5 * GAP_MM if 0.0 < t < 1.0 else END_GAP_MM for t in (a, b)]
        gaps = [share / self.speed * s for share, s in zip(shares, (soft_a, soft_b), strict=True)]
        lo, hi = a + gaps[0], b - gaps[1]
        if (hi - lo) * self.speed < SHORT_PIECE_MM or len(self.out) >= PARTS:
            raise SweepError("the grazing curve changes its shape too often for solids")
        part = self.path if (lo, hi) == (0.0, 1.0) else self.path.part(lo, hi)
        outside = (self.soft[0] if a == 0.0 else np.inf, self.soft[1] if b == 1.0 else np.inf)
        before, after = (
            gap / (hi - lo) if soft else known / (hi - lo)
            for gap, soft, known in zip(gaps, (soft_a, soft_b), outside, strict=True)
        )
        moving = Moving(part, (before, after))
        try:
            grazing = GrazingCurve(self.tool, moving, self.filled, self.deep)
            depth = _depth(grazing, SLICES if self.loose else PARTS)
            built = enveloped(grazing, self.fit, self.loose)
        except Divide as found:
            self._divide(found, a, b, soft_a, soft_b)
            return
        lost = [gap * self.speed for gap, t in zip(gaps, (a, b), strict=True) if t in (0.0, 1.0)]
        built = built._replace(fit_mm=max(built.fit_mm, depth, *lost))
        self.out.append(Piece(Sweep.along(self.profile, part), built))
        self.spans.append((lo, hi))

    def joined(self) -> list[Piece]:
        """All pieces, with what is missing between them as an error of the later one."""
        whole = Slab(self.profile.z_min, self.profile.z_max, ())
        for k in range(1, len(self.out)):
            last, first = self.spans[k - 1][1], self.spans[k][0]
            if first <= last:
                continue
            missing = uncovered(self.profile, self.path.part(last, first), whole, 1)
            if missing > GAP_MM:
                raise SweepError(f"{missing:.2g} mm are missing where the block is cut in time")
            piece = self.out[k]
            built = piece.built._replace(fit_mm=max(piece.built.fit_mm, missing))
            self.out[k] = piece._replace(built=built)
        return self.out

    def _divide(self, found: Divide, a: float, b: float, soft_a: bool, soft_b: bool) -> None:
        """Where a piece says that it has to be cut."""
        if found.at in (0.0, 1.0):
            again = soft_a if found.at == 0.0 else soft_b
            if again:
                raise SweepError(str(found))
            self.add(a, b, soft_a or found.at == 0.0, soft_b or found.at == 1.0)
            return
        shares = [found.at] if found.parts == 2 else [k / found.parts for k in range(1, found.parts)]
        stops = [a, *(a + share * (b - a) for share in shares), b]
        for k in range(len(stops) - 1):
            first, last = k == 0, k + 2 == len(stops)
            self.add(stops[k], stops[k + 1], soft_a if first else found.soft, soft_b if last else found.soft)


def _depth(grazing: GrazingCurve, most: int) -> float:
    """mm by which a sheet may lie below the line in which the first and the last pose meet; halves up to `most` parts.

    Raises SweepError: Too deep: `Divide` if halves may do.
    """
    w = np.linspace(0.0, 1.0, 5)
    deepest = 0.0
    for segment in grazing.segments:
        if isinstance(segment, EdgeSpan):
            continue  # edges never fold by themselves
        looks = _looks(grazing, segment, w)
        depth = -0.125 * float(grazing.fold(segment, w, looks).min())
        if depth > grazing.deep:
            text = _reason(grazing, segment, w, looks)
            parts = int(np.ceil(1.05 * np.sqrt(depth / grazing.deep)))
            raise Divide(text, 0.5, soft=False, parts=parts) if parts < most else SweepError(text)
        deepest = max(deepest, depth)
    return deepest


def _reason(grazing: GrazingCurve, segment: CurveSegment, w: Floats, looks: Floats) -> str:
    """Why a sheet that seems to fold cannot be made."""
    g = grazing.elements[segment.element].segment
    _, _, beta, _ = segment.place(grazing, grazing.moving.state(w), looks)
    within = (beta >= min(g.beta) - SAME_BETA) & (beta <= max(g.beta) + SAME_BETA)
    what = "the envelope folds inside the sweep" if within.all() else "the grazing curve has a corner"
    return f"{what}, between heights {g.z0:.6g} and {g.z1:.6g} mm of the tool"


def _looks(grazing: GrazingCurve, segment: CurveSegment, w: Floats) -> Floats:
    """Where to look at a sheet: at even shares, and at even shares of its length at all times.

    With a pivot in the tool the curve runs half around it within a hundredth of its height, and folds there.
    """
    even, fine = np.linspace(0.0, 1.0, 9), np.linspace(0.0, 1.0, FINE)
    steps = np.linalg.norm(np.diff(segment.points(grazing, grazing.moving.state(w), fine), axis=1), axis=2)
    if not np.isfinite(steps).all():
        return even
    lengths = np.concatenate([np.zeros((len(w), 1)), np.cumsum(steps, axis=1)], axis=1)
    found = [np.interp(np.linspace(0.0, row[-1], LOOKS), row, fine) for row in lengths]
    return np.unique(np.concatenate([even, *found]))
