"""The volume of one sweep, without any stock."""

from __future__ import annotations

from vmachining.engines.mesh import solid
from vmachining.geometry import Bracket
from vmachining.sweep import Sweep
from vmachining.tolerance import CHORD_MM

__all__ = ["swept_volume"]


def swept_volume(sweep: Sweep, chord: float = CHORD_MM) -> Bracket:
    """Volume of a sweep, mm^3.

    Parameters
    ----------
    sweep : Sweep
    chord : float
        mm, about the distance between the inner and the outer solid.

    Returns
    -------
    Bracket
        lo and hi are the volumes of the inner and the outer solid of the mesh engine. estimate is the closed
        form where the sweep has one (`sweep.volume`), otherwise the volume of the fair solid.

    Raises
    ------
    EngineError
        The kernel failed.
    """
    lo, hi = (float(solid(sweep, chord=chord, side=side).volume()) for side in ("inner", "outer"))
    exact = sweep.volume
    estimate = exact if exact is not None else float(solid(sweep, chord=chord, side="fair").volume())
    return Bracket(min(lo, estimate), estimate, max(hi, estimate))
