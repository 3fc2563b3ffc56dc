"""Labels of the published cases of two blocks, in their corrected form: tables 5-1 (flat) and 5-2 (corner).

The tables are special cases of the general rule (`engaged`), which decides; they name what it found. Block A holds C, the
lower end of the edge; B is its neighbour, beyond the wall W at x. n_i is where the edge comes to the top S_A of A.
5-1 put right agrees with the general rule in every case of two blocks; 5-2 does not know leaning back into a taller
block, coming back after the top of A, more than two blocks or walls in y, and is right in 98 % of random cases that a row fits.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats
from vmachining.engagement import chip
from vmachining.engagement.analytic.passes import Corner
from vmachining.engagement.analytic.planes import corner_plane, cylinder_plane

__all__ = ["FlatCase", "TorusCase", "table_5_1", "table_5_2"]


class FlatCase(NamedTuple):
    """Row of table 5-1, place of the upper end ("S_A", "S_B", "W_A", "W_B" or ""), engaged intervals (k, 2) of l, mm."""

    row: str
    place: str
    intervals: Floats

    @property
    def length(self) -> float:
        """mm, l_n: length of cut."""
        return float((self.intervals[:, 1] - self.intervals[:, 0]).sum())


def table_5_1(c: ArrayLike, w: ArrayLike, z_a: float, z_b: float, wall: float) -> FlatCase:
    """A flat cutter between two blocks, put right.

    Parameters
    ----------
    c : (3,) mm, lower end C of the edge. w : (3,) unit axis, not level.
    z_a, z_b : mm, heights of the block that holds C and of the one toward which the axis leans.
    wall : mm, x of their common wall.

    Notes
    -----
    Rows in pairs are for an axis that leans to +x and to -x. Put right against the print: places of A.1 to A.4, the
    condition of B.4, the length of B.6; A.0, B.0 and "none" are missing there.
    """
    x, _, z = (float(v) for v in np.asarray(c, dtype=np.float64))
    wx, _, wz = (float(v) for v in np.asarray(w, dtype=np.float64))
    l_a, l_b = (z_a - z) / wz, (z_b - z) / wz
    l_w = (wall - x) / wx if wx != 0.0 else np.inf
    z_w = z + l_w * wz  # height of the edge at the wall
    second = wx < 0.0  # the axis leans to -x: the second row of a pair

    def case(row: str, place: str, *ends: tuple[float, float]) -> FlatCase:
        return FlatCase(row, place, np.array([e for e in ends if e[1] > e[0]]).reshape(-1, 2))

    if z > z_a:
        if z > z_b:
            return case("none", "")
        return case("B.5", "") if z_w > z_b else case("B.6", "S_B", (l_w, l_b))
    if l_a <= l_w:  # n_i is still over A
        if z_a >= z_b:
            return case("A.0", "S_A", (0.0, l_a))
        if z_w > z_b:
            return case("B.0", "S_A", (0.0, l_a))
        return case("B.4" if second else "B.3", "S_B", (0.0, l_a), (l_w, l_b))
    if z_a > z_b:
        if z_w < z_b:
            return case("A.2" if second else "A.1", "S_B", (0.0, l_b))
        return case("A.4" if second else "A.3", "W_B" if second else "W_A", (0.0, l_w))
    return case("B.2" if second else "B.1", "S_B", (0.0, l_b))


class TorusCase(NamedTuple):
    """Row of table 5-2 ("-": none fits), method of the upper end, and s of LE and UE, mm; NaN where the row has none.

    gap : s of the part of the edge that is outside between them (rows D), NaN for none.
    """

    row: str
    method: str
    le: float
    ue: float
    gap: tuple[float, float] = (float("nan"), float("nan"))


def table_5_2(
    corner: Corner, tip: ArrayLike, frame: ArrayLike, phi: float, z_a: float, z_b: float, x_a: float, x_b: float,
    *, lam0: float = 0.0,
) -> TorusCase:  # fmt: skip
    """A cutter with a corner between two blocks, put right; see the module for what the table cannot know.

    Parameters
    ----------
    z_a, z_b : mm, heights of the block that holds C and of its neighbour. x_a, x_b : mm, walls of A at smaller and at
        larger x; the neighbour lies behind the one that the edge crosses.
    lam0 : rad, of LE by the facing condition.
    """
    m, t = np.asarray(frame, dtype=np.float64), np.asarray(tip, dtype=np.float64)
    bend = corner.r * chip.QUARTER
    x, z = np.eye(3)[0], np.eye(3)[2]

    def at(s: float) -> Floats:
        return chip.edge_points(t, m, phi, s, corner.rm, corner.r)

    def torus(normal: Floats, c: float, *, larger: bool = True) -> float:
        """s of a crossing of the corner, of two the larger or the smaller."""
        found = corner_plane(normal, c, t, m, phi, corner.rm, corner.r)
        roots = [float(v) for v in (found.up, found.down) if not np.isnan(v)]
        return corner.r * (max(roots) if larger else min(roots)) if roots else float("nan")

    def rod(normal: Floats, c: float) -> float:
        along = float(cylinder_plane(normal, c, t, m, phi, corner.rm, corner.r))
        return bend + along if 0.0 <= along < np.inf else float("nan")

    def z_tor() -> float:
        return torus(z, z_b)

    def met(case: TorusCase) -> TorusCase:
        """The case if it holds anything, else none."""
        return case if case.ue > case.le else TorusCase("-", "", float("nan"), float("nan"))

    start = corner.r * lam0
    point_c, point_p = at(0.0), at(bend)
    n_i = torus(z, z_a)
    on_corner = not np.isnan(n_i)
    if not on_corner:
        n_i = rod(z, z_a)
    x_ni = float(at(n_i)[0]) if not np.isnan(n_i) else float(np.sign(m[0, 2]) * np.inf)
    high_p = point_p[2] > z_b

    if point_c[2] > z_a:  # C is above A: only a taller neighbour is met
        if not (z_a < z_b and point_c[2] < z_b):
            return TorusCase("-", "", float("nan"), float("nan"))
        le = torus(x, x_b, larger=False)
        if high_p:
            return met(TorusCase("A.6", "Z-tor", le, z_tor()))
        return met(TorusCase("A.7", "Z-cyl", rod(x, x_b) if point_p[0] < x_b else le, rod(z, z_b)))
    if x_ni > x_b and z_a < z_b:
        beyond = point_p[0] > x_b
        if beyond and high_p:
            return TorusCase("A.1", "Z-tor", start, z_tor())
        if not beyond and not high_p and on_corner:
            return TorusCase("A.2", "X-tor", start, torus(x, x_b))
        if not beyond and high_p:
            ends = [s for s in (torus(x, x_b), z_tor()) if not np.isnan(s)]
            return TorusCase("A.3", "X-tor or Z-tor", start, min(ends, default=float("nan")))
        if beyond and 0.0 < rod(x, x_b) - bend < rod(z, z_b) - bend:
            return TorusCase("A.4", "X-cyl", start, rod(x, x_b))
        return TorusCase("A.5", "Z-cyl", start, rod(z, z_b))
    if z_a > z_b and (x_ni > x_b or x_ni < x_a):
        letter, wall = ("B", x_b) if x_ni > x_b else ("C", x_a)
        beyond = point_p[0] > wall if letter == "B" else point_p[0] < wall
        if beyond and high_p:
            ends = [s for s in (torus(x, wall), z_tor()) if not np.isnan(s)]
            return TorusCase(f"{letter}.1", "X-tor or Z-tor", start, max(ends, default=float("nan")))
        if not beyond and high_p:
            return TorusCase(f"{letter}.2", "X-cyl", start, rod(x, wall))
        if not beyond:
            ends = [s for s in (rod(x, wall), rod(z, z_b)) if not np.isnan(s)]
            return TorusCase(f"{letter}.3", "X-cyl or Z-cyl", start, max(ends, default=float("nan")))
        return TorusCase(f"{letter}.4", "Z-cyl", start, rod(z, z_b))
    crossing = torus(x, x_b)
    if z_a > z_b > point_c[2] and not np.isnan(crossing) and not np.isnan(n_i):
        out = z_tor() if high_p else rod(z, z_b)
        beyond = point_p[0] > x_b
        again = rod(x, x_b) if beyond else crossing
        if out < again:
            return TorusCase(
                "D.1" if beyond else "D.2", "X-cyl" if beyond else "X-tor", start, n_i, (out, again)
            )
    return TorusCase("-", "", float("nan"), float("nan"))
