"""`flank_path`: a ruled face cut with the side of the tool, along its rulings (swarf milling).

The tool is a cylinder of radius R. Its axis goes through both ends of a ruling, each moved by R along the normal there. Where the
normals are the same along a ruling (planes, cylinders, cones, every developable face) the tool touches all of it. Where they
turn by an angle a it cuts in by R (1 - cos(a / 2)), in the middle; `Flank.overcut` says how much.

Known limit: only the ruling at which the tool stands is looked at. Hollow faces that are narrower than the tool are gouged
beside it: `--engine vectors` with the part as `[design]` measures it.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, rows
from vmachining.errors import InputError
from vmachining.toolpath.clpath import CLPath, Mark

__all__ = ["Flank", "flank_path"]

PLACES = np.linspace(0.0, 1.0, 17)
LEAST_MM = 1e-9


class Flank(NamedTuple):
    """path : of the tip, from the first ruling to the last. overcut : (n,) mm, depth of the tool in the face at each ruling.
    twist : (n,) rad between the normals of its ends."""

    path: CLPath
    overcut: Floats
    twist: Floats


def flank_path(
    lower: ArrayLike,
    upper: ArrayLike,
    radius: float,
    *,
    side: Literal["left", "right"] = "left",
    below_mm: float = 0.0,
    clear_mm: float | None = None,
) -> Flank:
    """The path along rulings from `lower` to `upper` (n, 3) mm, in the order in which they are cut.

    radius : mm, of the cutter. side : where the tool stands, seen along the feed with the spindle up.
    below_mm : how far the tip goes below the lower rail, along the axis.
    clear_mm : height of rapids; None: a radius and 5 mm above the face.
    Raises InputError: Fewer than two rulings, a ruling of no length or along the feed, a tool that would lie on its side.
    """
    low, high = rows(lower, -1, 3, name="lower"), rows(upper, -1, 3, name="upper")
    if len(low) != len(high) or len(low) < 2:
        raise InputError(
            f"{len(low)} and {len(high)} places on the rails: give as many on both, two at least"
        )
    if not (np.isfinite(radius) and radius > 0.0):
        raise InputError(f"radius {radius:g}: give a positive number of mm")
    ruling = _unit(high - low, "ruling {k} has no length")
    sign = 1.0 if side == "left" else -1.0
    own = [_normals(rail, ruling) for rail in (low, high)]
    some = own[0] if own[1] is None else own[1]  # the apex of a cone has the normals of its rim
    if some is None:
        raise InputError("neither rail has a length: all rulings are one")
    n0, n1 = (sign * (some if n is None else n) for n in own)
    first, second = low + radius * n0, high + radius * n1
    axes = _unit(second - first, "the axis of ruling {k} has no length")
    shared = PLACES[None, :, None]
    face = (1.0 - shared) * low[:, None] + shared * high[:, None]
    off = face - first[:, None]
    along = (off * axes[:, None]).sum(axis=2)
    overcut = np.maximum(radius - np.linalg.norm(off - along[:, :, None] * axes[:, None], axis=2), 0.0)
    twist = np.arccos(np.clip((n0 * n1).sum(axis=1), -1.0, 1.0))
    worst = overcut.max(axis=1)
    # the flat end stands square to the axis through the lower end of the ruling, or below it
    foot = ((low - first) * axes).sum(axis=1)
    tips = first + (np.minimum(foot, 0.0) - below_mm)[:, None] * axes
    marks = np.full(len(tips), int(Mark.CONTACT), dtype=np.int64)
    top = float(max(low[:, 2].max(), high[:, 2].max())) + radius + 5.0 if clear_mm is None else clear_mm
    piece = CLPath(tips, axes, np.zeros(len(tips), np.bool_), marks)
    notes = (
        (f"{float(worst.max()):.3g} mm of overcut where the face is twisted",)
        if worst.max() > LEAST_MM
        else ()
    )
    return Flank(CLPath.joined([piece], clear_mm=top, notes=notes), worst, twist)


def _normals(rail: Floats, ruling: Floats) -> Floats | None:
    """(n, 3): tangent x ruling turned to the left of the feed, the rulings going up; None for a rail of no length."""
    step = np.linalg.norm(np.diff(rail, axis=0), axis=1)
    if (step < LEAST_MM).all():
        return None
    at = np.concatenate([[0.0], np.cumsum(np.maximum(step, LEAST_MM))])
    tangent = np.gradient(rail, at, axis=0, edge_order=2 if len(rail) > 2 else 1)
    return _unit(np.cross(ruling, tangent), "ruling {k} goes along its rail")


def _unit(v: Floats, said: str) -> Floats:
    size = np.linalg.norm(v, axis=1)
    if (size < LEAST_MM).any():
        raise InputError(said.format(k=int(np.argmin(size))))
    return np.asarray(v / size[:, None])
