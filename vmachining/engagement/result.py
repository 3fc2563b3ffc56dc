"""`Engagement`: what a tool touches at one instant, as intervals, points, map and sums."""

from __future__ import annotations

from dataclasses import dataclass
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vmachining.arrays import Bools, Floats
from vmachining.engagement.extract import BESIDE_TOUCH, GAUSS, GRAZING, Contact, entering, nodes
from vmachining.engagement.workpiece import By
from vmachining.htmltable import facts_html
from vmachining.sweep import Stance
from vmachining.tool import Edge, EdgeParts

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.figure import Figure

JOINT_MM = 1e-9
"""Intervals on both sides of a joint of the meridian that come closer than this are one interval."""

SAME_RAD = 1e-12
"""Two angles closer than this are one; the sides of a jump are 1e-9 apart."""

FULL_TURN = 360.0

COLUMNS = (
    "block", "line", "at", "phi_deg", "phi_feed_deg", "lower_mm", "upper_mm", "length_mm",
    "le_x_mm", "le_y_mm", "le_z_mm", "ue_x_mm", "ue_y_mm", "ue_z_mm", "lower_by", "upper_by",
)  # fmt: skip
"""Columns of the table, see `Engagement.table`."""


class EngagementMap(NamedTuple):
    """phi : (n,) rad. s : (m + 1,) mm, borders of the cells along the edge. share : (n, m) engaged, 0 to 1."""

    phi: Floats
    s: Floats
    share: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Engagement:
    """Cutter-workpiece engagement at fraction `at` of a block. Lengths in mm, work coordinates, angles in rad.

    edge, stance : the cutting edge; where the tool is, how it moves, its frame.
    contact : intervals by rotation angle, as extracted.
    method : "dexel", "brep" or "analytic". block, line : of the program, where there is one.
    wall_mm : how far off the walls of the workpiece may be, as the method knows them.
    notes : what a reader must know: what is not in the numbers, how well the stock is known.

    The rotation angle phi is that of the tip of the edge in the tool frame, from its second direction (+y of an
    upright tool) towards the first (+x): clockwise seen from the spindle. phi + feed_angle is 90 degrees
    straight ahead of the feed. An interval runs from its lower engagement point LE to the upper one UE; s counts
    from the lowest point of the meridian off the bottom disc.
    """

    edge: Edge
    stance: Stance
    contact: Contact
    method: str
    at: float = 0.0
    block: int | None = None
    line: int | None = None
    notes: tuple[str, ...] = ()
    wall_mm: float = 0.0

    def __repr__(self) -> str:
        where = f"block {self.block} at {self.at:g}" if self.block is not None else f"at {self.at:g}"
        return f"Engagement({where}, {self.method}, {', '.join(map(' '.join, [*self.facts.items()][1:]))})"

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        where = "" if self.block is None else f" of block {self.block}, line {self.line},"
        notes = [("note", text) for text in self.notes]
        return facts_html(
            f"Engagement{where} at {self.at:g}, method {self.method}", [*self.facts.items(), *notes]
        )

    def plot(self) -> Figure:
        """Chip thickness over rotation angle and edge, length of cut, chip area, as a matplotlib figure; a notebook shows it."""
        return resolve_name("vmachining.report.engagement:draw_engagement")(self)  # type: ignore[no-any-return]

    @property
    def facts(self) -> dict[str, str]:
        """What is touched, in words with units."""
        s = self.summary
        fed = s["arcs_feed_deg"] is not None
        arcs = ", ".join(f"{a:.6f} to {b:.6f}" for a, b in s["arcs_feed_deg" if fed else "arcs_deg"])
        arcs += f" degrees {'from the feed (90 is straight ahead)' if fed else 'of the tool'}"
        tip, axis = (", ".join(f"{v:.6g}" for v in s[key]) for key in ("tip_mm", "axis"))
        out = {"tip": f"({tip}) mm, axis ({axis})", "engaged": "all round" if self.is_round else arcs}
        if self.is_air:
            return out | {"engaged": "nowhere: air"}
        out |= {
            "axial": f"{s['ap_mm']:.6f} mm", "radial": "the feed is axial" if s["ae_mm"] is None else f"{s['ae_mm']:.6f} mm",
            "cut": f"at most {s['length_max_mm']:.6f} mm of the edge",
            "surface": f"{s['area_mm2']:.6g} mm2, {100 * s['area_fraction']:.4g} % of what cuts",
        }  # fmt: skip
        if s["removal_mm3_per_mm"] is not None:
            out["removes"] = f"{s['removal_mm3_per_mm']:.6g} mm3 per mm of path"
        return out

    @property
    def phi(self) -> Floats:
        """(n,) rad, the grid."""
        return self.contact.phi[: self.contact.grid]

    @property
    def arcs(self) -> Floats:
        """(k, 2) rad: phi of entry and exit of every engaged arc, to 1e-9; an exit may lie beyond 2 pi."""
        return self.contact.arcs

    @property
    def feed_angle(self) -> float | None:
        """rad to add to phi, so that 90 degrees is straight ahead; None where the feed is along the axis."""
        return self.stance.feed_angle

    @property
    def is_air(self) -> bool:
        """Nothing is touched at any angle of the grid."""
        return not len(self.contact.parts.row)

    @property
    def is_round(self) -> bool:
        """Something is touched at every angle."""
        return len(self.arcs) == 1 and float(np.ptp(self.arcs)) >= 2.0 * np.pi

    @property
    def intervals(self) -> EdgeParts:
        """Engaged intervals on the grid, joined over the joints of the meridian; `piece` is the lowest one."""
        return _joined(self.contact.parts.take(self.contact.parts.row < self.contact.grid))

    def points(self, parts: EdgeParts, *, upper: bool) -> Floats:
        """(n, 3) mm: ends of intervals, LE or UE."""
        s = parts.upper if upper else parts.lower
        at = self.edge.piece_at(s)
        return self.stance.points(self.edge, self.contact.phi[parts.row], at, s)

    @property
    def lengths(self) -> Floats:
        """(n,) mm: engaged length of the edge at every angle of the grid, the length of cut."""
        return self._sum(self._edge_lengths(self.contact.parts))[: self.contact.grid]

    @property
    def chip_per_feed(self) -> Floats:
        """(n,) mm: chip area of the edge at every angle for a feed of 1 mm per tooth, first order in the feed.

        The integral of N . V / |V_tip| along the meridian. NaN where the tip rests.
        """
        return self._sum(self._integrals(self.contact.parts, around=False))[: self.contact.grid]

    @property
    def removal_per_mm(self) -> float:
        """mm^2: volume removed per mm of the tip's path at this instant, the integral of N . V over the contact.

        By trapezia over the angles, with the exact ends of the arcs and both sides of jumps: the error falls with
        the power 1.5 of the step, because lengths start like roots where a round wall is met. NaN where the tip
        rests.
        """
        return self._over_phi(self._sum(self._integrals(self.contact.parts, around=True)))

    @property
    def area(self) -> float:
        """mm^2 of the surface of the cutter that is engaged."""
        parts = self.contact.parts
        return self._over_phi(self._sum(self.edge.moment(parts.piece, parts.lower, parts.upper)))

    @property
    def area_fraction(self) -> float:
        """Engaged share of the surface that the edge draws."""
        return self.area / self.edge.area

    @property
    def ap(self) -> float:
        """mm: axial depth, extent along the tool axis of the contact that cuts (see `GRAZING`); 0 in air."""
        return float(np.ptp(self._extremes()[0])) if not self.is_air else 0.0

    @property
    def ae(self) -> float:
        """mm: radial depth, extent across feed and axis of the contact that cuts; NaN where the feed is axial, 0 in air."""
        if self.is_air:
            return 0.0
        if self.feed_angle is None:
            return float("nan")
        return float(np.ptp(self._extremes()[1]))

    def map(self, cells: int = 200) -> EngagementMap:
        """The map of engagement: share of every cell of the edge that is engaged, at every angle of the grid."""
        s = np.linspace(self.edge.joints[0], self.edge.joints[-1], cells + 1)
        share = np.zeros((self.contact.grid, cells))
        parts = self.intervals
        for row, lower, upper in zip(parts.row, parts.lower, parts.upper, strict=True):
            share[row] += np.maximum(np.minimum(s[1:], upper) - np.maximum(s[:-1], lower), 0.0)
        share /= np.diff(s)
        return EngagementMap(self.phi, s, share)

    def table(self) -> pl.DataFrame:
        """One row per interval, angles in degrees; an angle that touches nothing has one row of length 0.

        Columns: block, line, at, phi_deg, phi_feed_deg, lower_mm and upper_mm (s of LE and UE), length_mm (of
        the edge between them), le_x_mm .. ue_z_mm, lower_by and upper_by ("stock", "block 12", "facing": beyond
        it the surface leaves the material, "edge": the end of the cutting edge).
        """
        import polars as pl

        parts = self.intervals
        le, ue = self.points(parts, upper=False), self.points(parts, upper=True)
        length = self._edge_lengths(parts)
        free = np.setdiff1d(np.arange(self.contact.grid), parts.row)
        row = np.concatenate([parts.row, free])
        order = np.lexsort((np.concatenate([parts.lower, np.zeros(len(free))]), row))
        degrees = np.round(np.degrees(self.phi[row]), 12)
        turn = self.feed_angle
        blank: list[None] = [None] * len(free)
        numbers = (parts.lower, parts.upper, *le.T, *ue.T)
        lower, upper, *ends = ([*column.tolist(), *blank] for column in numbers)
        data = {
            "block": [self.block] * len(row), "line": [self.line] * len(row), "at": [self.at] * len(row),
            "phi_deg": degrees,
            "phi_feed_deg": None if turn is None else np.round((degrees + np.degrees(turn)) % FULL_TURN, 12),
            "lower_mm": lower, "upper_mm": upper, "length_mm": np.concatenate([length, np.zeros(len(free))]),
            **dict(zip(COLUMNS[8:14], ends, strict=True)),
            "lower_by": [*map(end_name, parts.lower_by), *blank],
            "upper_by": [*map(end_name, parts.upper_by), *blank],
        }  # fmt: skip
        types: dict[str, type[pl.DataType]] = {
            "block": pl.Int64, "line": pl.Int64, "lower_by": pl.String, "upper_by": pl.String
        }  # fmt: skip
        schema = {name: types.get(name, pl.Float64) for name in COLUMNS}
        return pl.DataFrame(data, schema=schema)[order]

    @property
    def summary(self) -> dict[str, Any]:
        """Sums and angles, as JSON takes them; None where there is no number."""
        turn = self.feed_angle
        arcs = np.degrees(self.arcs)
        fed = None if turn is None else _wrapped(arcs, float(np.degrees(turn)))
        lengths = self.lengths
        return {
            "block": self.block, "line": self.line, "at": self.at, "method": self.method,
            "tip_mm": self.stance.tip.tolist(), "axis": self.stance.axis.tolist(),
            "feed": _unit(self.stance.velocity), "feed_angle_deg": None if turn is None else float(np.degrees(turn)),
            "angles": self.contact.grid, "edge_mm": [float(v) for v in self.edge.joints[[0, -1]]],
            "arcs_deg": arcs.tolist(), "arcs_feed_deg": fed,
            "length_max_mm": float(lengths.max()), "length_mean_mm": float(lengths.mean()),
            "ap_mm": self.ap, "ae_mm": _number(self.ae), "area_mm2": self.area, "area_fraction": self.area_fraction,
            "removal_mm3_per_mm": _number(self.removal_per_mm), "notes": list(self.notes),
        }  # fmt: skip

    def to_dict(self) -> dict[str, Any]:
        """`summary`, and the rows of `table` without block, line and at."""
        rows = self.table().drop("block", "line", "at").to_dicts()
        return {**self.summary, "intervals": rows}

    # -- integrals -----------------------------------------------------------------------------------------

    def _sum(self, values: Floats) -> Floats:
        """(angles,) sums of values of the intervals."""
        out = np.zeros(len(self.contact.phi))
        np.add.at(out, self.contact.parts.row, values)
        return out

    def _edge_lengths(self, parts: EdgeParts) -> Floats:
        """(n,) mm of the edge in space; more than the difference of s where the edge is wound."""
        if self.edge.twist == 0.0:
            return np.asarray(parts.upper - parts.lower)
        # an interval may go over joints: each of its parts is measured, and given to it
        pieces = self.contact.parts
        _, piece, s, weight = nodes(pieces)
        p = self.edge.at(piece, s)
        rise = np.abs(p.n_r)  # dz/ds of a meridian is the radial part of its normal
        around = np.hypot(1.0, p.r * self.edge.twist * rise)
        each = (weight * around).reshape(-1, GAUSS).sum(axis=1)
        if parts is pieces:
            return np.asarray(each)
        middle = 0.5 * (pieces.lower + pieces.upper)
        out = np.zeros(len(parts.row))
        for k in range(len(out)):
            mine = (pieces.row == parts.row[k]) & (middle >= parts.lower[k]) & (middle <= parts.upper[k])
            out[k] = each[mine].sum()
        return out

    def _integrals(self, parts: EdgeParts, *, around: bool) -> Floats:
        """(n,) integrals of N . V / |V_tip| ds, times the radius if `around`."""
        tip = float(np.linalg.norm(self.stance.velocity))
        if tip == 0.0:
            return np.full(len(parts.row), np.nan)
        row, piece, s, weight = nodes(parts)
        value = self.stance.normal_speed(self.edge, self.contact.phi[row], piece, s) / tip
        if around:
            value *= self.edge.at(piece, s).r
        return np.asarray((weight * value).reshape(-1, GAUSS).sum(axis=1))

    def _over_phi(self, values: Floats) -> float:
        """Integral over a turn of values at the grid, at the ends of the arcs and beside jumps."""
        phi = self.contact.phi
        every = np.concatenate([phi, phi + 2.0 * np.pi])
        order = np.argsort(every, kind="stable")
        every, twice = every[order], np.concatenate([values, values])[order]
        total = 0.0
        for first, last in self.arcs:
            within = (every >= first - SAME_RAD) & (every <= last + SAME_RAD)
            total += float(np.trapezoid(twice[within], every[within]))
        return total

    def _extremes(self) -> tuple[Floats, Floats]:
        """Heights along the axis and distances across the feed of the ends and of the widest points between."""
        parts = self._cutting(self.contact.parts)
        if not len(parts.row):
            return np.zeros(1), np.zeros(1)
        rows_, pieces, inner, _ = nodes(parts)  # a wound edge may be widest anywhere
        row = np.concatenate([parts.row, parts.row, parts.row, rows_])
        piece = np.concatenate([parts.piece, parts.piece, parts.piece, pieces])
        s = np.concatenate([parts.lower, parts.upper, self.edge.widest(parts), inner])
        points = self.stance.points(self.edge, self.contact.phi[row], piece, s) - self.stance.tip
        sideways = np.cross(self.stance.axis, self.stance.velocity)
        size = float(np.linalg.norm(sideways))
        return points @ self.stance.axis, points @ (sideways / size if size > 0.0 else sideways)

    def _cutting(self, parts: EdgeParts) -> EdgeParts:
        """Parts that enter material. Of one that slides along a wall it is the limit of what cuts next to it; see `GRAZING`."""
        phi = self.contact.phi
        least = max(GRAZING, np.sqrt(2.0 * self.wall_mm / self.edge.profile.max_radius))
        cuts = entering(self.edge, self.stance, phi, parts, least)
        real, touch = parts.take(cuts), parts.take(~cuts)
        if not len(real.row) or not len(touch.row):
            return real
        away = (phi[real.row] - phi[touch.row][:, None] + np.pi) % (2.0 * np.pi) - np.pi
        same = touch.piece[:, None] == real.piece
        lower, upper, owner = [real.lower], [real.upper], []
        for t in range(len(touch.row)):
            for ends in _limits(away[t], same[t], real):
                low, high = max(ends[0], touch.lower[t]), min(ends[1], touch.upper[t])
                if high > low:
                    owner.append(t)
                    lower.append(np.array([low]))
                    upper.append(np.array([high]))
        both = EdgeParts._make(
            np.concatenate(pair)
            for pair in zip(real, touch.take(np.array(owner, dtype=np.int64)), strict=True)
        )
        return both._replace(lower=np.concatenate(lower), upper=np.concatenate(upper))


def _limits(away: Floats, same: Bools, real: EdgeParts) -> list[Floats]:
    """(k, 2) s: what parts of the same piece that cut tend to at an angle, `away` rad from theirs.

    Three angles on one side, asked for this, each with one part of the piece: by a parabola, off by the cube of 3e-3 rad. Else
    what cuts at the nearest angle.
    """
    out = []
    for side in (BESIDE_TOUCH[3:], -BESIDE_TOUCH[3:]):
        at = [np.flatnonzero(same & (np.abs(away - a) <= SAME_RAD)) for a in side]
        if all(len(one) == 1 for one in at):
            s = np.array([[real.lower[k], real.upper[k]] for (k,) in at])
            out.append(3.0 * s[0] - 3.0 * s[1] + s[2])
    if not out:
        near = np.abs(away) <= np.abs(away).min() + SAME_RAD
        out = [np.array([real.lower[k], real.upper[k]]) for k in np.flatnonzero(near & same)]
    return out


def end_name(code: int) -> str:
    """Name, in the table, of what ends an interval."""
    return f"block {code}" if code >= 0 else By(int(code)).name.lower()


def _joined(parts: EdgeParts) -> EdgeParts:
    """Intervals that meet at a joint of the meridian made one; ordered by row and s."""
    order = np.lexsort((parts.lower, parts.row))
    p = parts.take(order)
    if not len(p.row):
        return p
    meets = (p.row[1:] == p.row[:-1]) & (p.lower[1:] - p.upper[:-1] <= JOINT_MM) & (p.lower_by[1:] == By.EDGE)
    first = np.concatenate([[True], ~meets])
    last = np.concatenate([~meets, [True]])
    return EdgeParts(
        p.row[first], p.piece[first], p.lower[first], p.upper[last], p.lower_by[first], p.upper_by[last]
    )


def _wrapped(arcs: Floats, turn: float) -> list[list[float]]:
    """Arcs (k, 2) in degrees turned, their beginnings in [0, 360)."""
    moved = arcs + turn
    # a beginning that rounding left below 0 is 0, not 360
    shift = FULL_TURN * np.floor((moved[:, :1] + 1e-9) / FULL_TURN)
    return [[float(a), float(b)] for a, b in np.round(moved - shift, 9)]


def _unit(vector: Floats) -> list[float] | None:
    size = float(np.linalg.norm(vector))
    return (vector / size).tolist() if size > 0.0 else None


def _number(value: float) -> float | None:
    return value if np.isfinite(value) else None
