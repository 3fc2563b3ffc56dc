"""`HeightWorkpiece`: what an edge meets, as heights over cells, met in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vmachining.arrays import Floats
from vmachining.engagement.analytic import _kernels
from vmachining.engagement.analytic.passes import Corner, found_intervals
from vmachining.engagement.analytic.stairs import HeightStock
from vmachining.engagement.workpiece import SLIVER_MM, By
from vmachining.errors import ToolError
from vmachining.sweep import Stance
from vmachining.tolerance import LENGTH_EPS_MM
from vmachining.tool import Edge, EdgeParts, Profile


def corner_of(profile: Profile) -> Corner:
    """The cutter of a meridian as `Corner`.

    Raises ToolError: Not a flat, bull or ball cutter with its tip at z = 0.
    """
    segments = list(profile.segments)
    r = segments[0].radius if segments[0].is_arc else 0.0
    rm = profile.max_radius - r
    rod = segments[1:] if r > 0.0 else segments
    first = segments[0]
    fits = first.z0 == 0.0 and abs(first.r0 - rm) <= LENGTH_EPS_MM
    if r > 0.0:
        fits &= abs(first.cr - rm) <= LENGTH_EPS_MM and abs(first.cz - r) <= LENGTH_EPS_MM
        fits &= abs(first.z1 - r) <= LENGTH_EPS_MM or not rod
    fits &= len(rod) <= 1 and all(abs(s.r0 - s.r1) <= LENGTH_EPS_MM and not s.is_arc for s in rod)
    if not fits:
        what = "method analytic works for flat, bull and ball cutters only"
        raise ToolError(what, remedy="take dexel or brep for this tool")
    return Corner(rm, r, rod[0].z1 - r if rod else 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class HeightWorkpiece:
    """Heights over cells as the `Workpiece` of an edge; None is air.

    Raises ToolError: Of `holds`: a cutter that `corner_of` does not know, or a wound edge.
    """

    stock: HeightStock | None

    def holds(self, edge: Edge, stance: Stance, phi: Floats, parts: EdgeParts) -> EdgeParts:
        """See `Workpiece`."""
        corner = corner_of(edge.profile)
        if edge.twist != 0.0:
            what = "method analytic works with the straight edge only"
            raise ToolError(what, remedy="take dexel or brep for a helix")
        stock = self.stock
        if stock is None or not len(parts.row):
            return parts.take(np.zeros(0, dtype=np.int64))
        disc = len(edge.segments) > 1 and edge.joints[0] < 0.0
        first = 0 if disc else (1 if corner.r > 0.0 else 2)
        kinds = np.array([k for k in range(first, 3) if k != 1 or corner.r > 0.0], dtype=np.int64)
        e_r = stance.radial(phi[parts.row])
        lower, upper = found_intervals(
            len(parts.row),
            lambda room: _kernels.clipped(
                stance.tip, e_r, stance.axis, float(corner.rm), float(corner.r), kinds[parts.piece], parts.lower,
                parts.upper, stock.rows(), room,
            ),
        )  # fmt: skip
        mine, number = np.nonzero(~np.isnan(lower))
        a, b = lower[mine, number], upper[mine, number]
        # ends that did not move keep what ended them
        was = parts.take(mine)
        kept = np.abs(a - was.lower) <= _kernels.SHORT, np.abs(b - was.upper) <= _kernels.SHORT
        by = (np.where(k, v, By.STOCK) for k, v in zip(kept, (was.lower_by, was.upper_by), strict=True))
        found = EdgeParts(was.row, was.piece, a, b, *by)
        short = np.flatnonzero(b - a <= SLIVER_MM)
        if not len(short):
            return found
        few = found.take(short)
        middle = stance.points(edge, phi[few.row], few.piece, 0.5 * (few.lower + few.upper))
        real = np.ones(len(a), dtype=np.bool_)  # a touch goes no deeper than rounding
        real[short] = stock.signed_height(middle) < -LENGTH_EPS_MM
        return found.take(real)
