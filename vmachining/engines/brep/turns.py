"""Solids of a block whose tool axis turns: cut in time where the grazing curve changes its shape, each gated.

1. `vmachining.sweep.topology.changes` finds the instants at which the curve reaches a joint, a chord of a disc is
   born or dies, two arcs merge. Pieces end `GAP_MM` of motion before such an instant and begin as much after it;
   their own time is slow there, so that the square roots that births are made of become smooth. What no
   piece covers is thinner than `GAP_MM`.
2. Where a valley of a flat face cannot be drawn in one go, or a chord begins to lie inside, the piece is halved.
3. Every piece must be valid and closed, none of its sheets may lie inside the sweep (phi_tt < 0, sampled), and
   its volume must be the one of the flux identity V(K) + Phi - W to 1e-5. A solid whose boundary runs through
   itself has V(K) + Phi instead, so what is entered twice cannot be lost.
"""

from __future__ import annotations

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.brep.caps import FLAT
from vmachining.engines.brep.grazes import Divide, Grazes
from vmachining.engines.brep.stretches import Chord, EdgeSpan, Moving
from vmachining.engines.brep.turning import Built, turning
from vmachining.errors import SweepError
from vmachining.sweep import Sweep, Turn
from vmachining.sweep.topology import changes
from vmachining.tool import Profile

__all__ = ["GAP_MM", "Piece", "turn_pieces"]

GAP_MM = 1e-6
"""mm of motion left out at a change of shape: ten times OCCT's confusion of points."""

PARTS = 12
"""Most pieces of one block before it is refused."""

LEAST_MM = 1e-3
"""A piece that moves less is none: two changes of shape are too close to each other."""

FOLD = 1e-7
"""A fold is one if its phi_tt is below this share of what the motion could make it."""


class Piece(tuple[Sweep, Built]):
    """A part of the block in time and its faces."""

    @property
    def sweep(self) -> Sweep:
        """The exact sweep of this part."""
        return self[0]

    @property
    def built(self) -> Built:
        """Its faces."""
        return self[1]


def turn_pieces(profile: Profile, path: Turn, fit_mm: float) -> list[Piece]:
    """Parts of a block of a convex profile, in order of time.

    Raises
    ------
    SweepError
        A sheet folds inside the sweep, or the grazing curve is of a shape that has no solid here.
    EngineError
        Edges do not fit.
    """
    cuts = _cuts(profile, path)
    work = _Work(profile, path, fit_mm)
    stops = [0.0, *cuts, 1.0]
    for k in range(len(stops) - 1):
        work.add(stops[k], stops[k + 1], k > 0, k + 1 < len(stops) - 1)
    return work.out


def _cuts(profile: Profile, path: Turn) -> list[float]:
    """Instants at which the grazing curve changes its shape, in a way that changes the sheets."""
    ends = (profile.z_min, profile.z_max)
    out = []
    for c in changes(Sweep.along(profile, path)):
        if c.kind == "swap" and not path.is_steady:
            continue  # the chord of a disc passes its middle, the curve the tip of a ball
        if c.kind == "merge" and c.z in ends:
            continue  # the same
        if c.kind == "end" and c.z == profile.z_min and profile.points[0, 0] <= FLAT and _is_round(profile):
            continue
        out.append(c.t)
    return sorted(set(out))


def _is_round(profile: Profile) -> bool:
    return profile.segments[0].is_arc


class _Work:
    """Pieces in the making."""

    def __init__(self, profile: Profile, path: Turn, fit_mm: float) -> None:
        self.profile, self.path, self.fit = profile, path, fit_mm
        self.out: list[Piece] = []
        reach = float(np.abs(profile.points[:, 1]).max() + profile.max_radius)
        self.speed = path.tip_series.bound(1) + reach * path.axis_series.bound(1)

    def add(self, a: float, b: float, soft_a: bool, soft_b: bool) -> None:
        """The part from t = a to b; soft ends are changes of shape."""
        gap = 0.5 * GAP_MM / self.speed
        lo, hi = a + gap * soft_a, b - gap * soft_b
        if (hi - lo) * self.speed < LEAST_MM or len(self.out) >= PARTS:
            raise SweepError("the grazing curve changes its shape too often for solids")
        part = self.path if (lo, hi) == (0.0, 1.0) else self.path.split([lo, hi] if hi < 1.0 else [lo])[
            1 if lo > 0.0 or hi < 1.0 else 0]  # fmt: skip
        offset = gap / (hi - lo)
        moving = Moving(part, (offset if soft_a else np.inf, offset if soft_b else np.inf))
        try:
            built = turning(self.profile, moving, self.fit)
        except Divide as found:
            self._divide(found, a, b, soft_a, soft_b)
            return
        _check_folds(built.grazes)
        self.out.append(Piece((Sweep.along(self.profile, part), built)))

    def _divide(self, found: Divide, a: float, b: float, soft_a: bool, soft_b: bool) -> None:
        """Where a piece says that it has to be cut."""
        if found.at in (0.0, 1.0):
            again = soft_a if found.at == 0.0 else soft_b
            if again:
                raise SweepError(str(found))
            self.add(a, b, soft_a or found.at == 0.0, soft_b or found.at == 1.0)
            return
        middle = a + found.at * (b - a)
        self.add(a, middle, soft_a, found.soft)
        self.add(middle, b, found.soft, soft_b)


def _check_folds(grazes: Grazes) -> None:
    """Refuse sheets that lie inside the sweep."""
    w, s = np.linspace(0.0, 1.0, 7), np.linspace(0.0, 1.0, 9)
    scale = FOLD * _scale(grazes)
    for stretch in grazes.stretches:
        if isinstance(stretch, EdgeSpan | Chord):
            continue  # edges never fold by themselves; chords were looked at
        if grazes.fold(stretch, w, s).min() < -scale:
            g = grazes.elements[stretch.element].segment
            raise SweepError(
                f"the envelope folds inside the sweep, between heights {g.z0:.6g} and {g.z1:.6g} mm of the tool"
            )


def _scale(grazes: Grazes) -> float:
    """What phi_tt is made of: speed times turning, mm per unit of t squared."""
    st = grazes.dense
    fast: Floats = np.linalg.norm(st.velocity, axis=1) + grazes.tool.joints[-1, 1] * np.linalg.norm(
        st.rate, axis=1
    )
    return float((fast * np.linalg.norm(st.rate, axis=1)).max())
