"""A section of the workpiece in front of the tool, with the ends of the engaged edge on it, and the angle of its lower end.

Of the positions of an engagement at one rotation angle: the upright surface through their upper points UE, unrolled, and the
plane through the tool axis where the edge is engaged longest. The workpiece is known by exact distances to stock and earlier
sweeps, whatever method found the points, so that of another method is verified by it. Source: the verification of the
analytical boundary simulation [Hendriko, five-axis milling, 5.3.4.3, figures 5-11 and 5-12].
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import polars as pl

from vmachining.arrays import Floats
from vmachining.errors import InputError
from vmachining.job.engage import Scene
from vmachining.sweep import Stance
from vmachining.tool import Edge

SECTION_COLUMNS = ("part", "u", "v", "w")
"""`part` says what a row is; lengths in mm, angles in degrees. Surface: distance to the workpiece, below 0 inside.

| part | u | v | w |
|---|---|---|---|
| along | way over the plan of the UE points | z | surface before the first of the blocks |
| along_le, along_ue | the same | z | surface before the block of the point |
| across | from the tool axis | along the axis, from the tip | surface before the block |
| edge | the same | the same | 1 where the edge is engaged |
| across_le, across_ue | the same | the same | the same as of across |
| lead_le, lead_ue | angle from the feed | from the bottom to LE; to UE where the edge leaves by itself | lead |
| lead_form | the same | the same in closed form, see `facing_angle` | lead |
| angle | asked for | of the plane across | lead there |
"""

COLUMNS, ROWS = 240, 90
"""Points of a section, along and up."""

LEADS = 7
"""Positions whose angles are listed, evenly over their leads."""

MARGIN = 0.15
"""Of the height of what is shown, above and below."""


def section_table(scene: Scene, found: pl.DataFrame, angle_deg: float) -> pl.DataFrame:
    """What a picture of the section needs; see the module and `SECTION_COLUMNS`.

    found : rows of `Engagement.table` of positions of one program, in their order.
    angle_deg : from the feed, 90 straight ahead; the angle of the grid that is nearest is taken.

    Raises InputError: Nothing is engaged at that angle, or the feed goes along the axis everywhere.
    """
    engaged = found.filter(pl.col("phi_feed_deg").is_not_null() & (pl.col("length_mm") > 0.0))
    away = ((pl.col("phi_feed_deg") - angle_deg + 180.0) % 360.0 - 180.0).abs()
    step = 360.0 / max(found["phi_deg"].n_unique(), 1)
    mine = engaged.filter(away <= step / 2 + 1e-6)
    # two angles may be as near; of each position the lower one is taken
    mine = mine.filter(pl.col("phi_deg") == pl.col("phi_deg").first().over("block", "at"))
    if not len(mine):
        what = "nothing is engaged at this angle from the feed"
        raise InputError(f"--section {angle_deg:g}: {what}", remedy="90 is straight ahead")
    longest = mine.row(int(mine["length_mm"].arg_max() or 0), named=True)
    rows = [
        *_along(scene, mine), *_across(scene, mine, longest), *_leads(scene, engaged),
        ("angle", angle_deg, longest["phi_feed_deg"], _lead(_stance(scene, longest)[2])),
    ]  # fmt: skip
    kinds = dict(zip(SECTION_COLUMNS, (pl.String, *3 * [pl.Float64]), strict=True))
    return pl.DataFrame(rows, schema=kinds, orient="row")


Row = tuple[str, float, float, float]


def _rows(part: str, u: Floats, v: Floats, w: Floats | float) -> list[Row]:
    flat = (np.ravel(c).tolist() for c in np.broadcast_arrays(u, v, w))
    return [(part, *values) for values in zip(*flat, strict=True)]


def _stance(scene: Scene, row: dict[str, Any]) -> tuple[int, Edge, Stance]:
    """Place among the cuts, straight edge and tool of a position."""
    index, t = scene.place(row["block"], row["at"])
    _, number, path = scene.cuts[index]
    return index, Edge(scene.job.tools[number]), Stance.on(path, t)


def _lead(stance: Stance) -> float:
    """Degrees by which the axis leans towards the feed."""
    leans = stance.axis @ stance.velocity / np.linalg.norm(stance.velocity)
    return float(np.degrees(np.arcsin(np.clip(leans, -1, 1))))


def _points(rows: pl.DataFrame, end: str) -> Floats:
    return rows.select(f"{end}_x_mm", f"{end}_y_mm", f"{end}_z_mm").to_numpy()


def _along(scene: Scene, mine: pl.DataFrame) -> Iterator[Row]:
    """The upright surface through the highest UE of every position."""
    top = mine.filter(pl.col("upper_mm") == pl.col("upper_mm").max().over("block", "at"))
    ue = _points(top, "ue")
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(ue[:, :2], axis=0).T))])
    place = {(row["block"], row["at"]): u for row, u in zip(top.iter_rows(named=True), way, strict=True)}
    first = min(scene.place(row["block"], row["at"])[0] for row in top.iter_rows(named=True))
    u = np.linspace(0.0, max(way[-1], 1e-6), COLUMNS)
    heights = np.concatenate([_points(mine, end)[:, 2] for end in ("le", "ue")])
    margin = MARGIN * max(float(np.ptp(heights)), 1.0)
    v = np.linspace(heights.min() - margin, heights.max() + margin, ROWS)
    plan = np.column_stack([np.interp(u, way, ue[:, k]) for k in (0, 1)])
    grid = np.column_stack([np.repeat(plan, ROWS, axis=0), np.tile(v, COLUMNS)])
    yield from _rows("along", np.repeat(u, ROWS), grid[:, 2], scene.distance(first, grid))
    for row in mine.iter_rows(named=True):
        for end in ("le", "ue"):
            at = np.array([[row[f"{end}_{k}_mm"] for k in "xyz"]])
            off = scene.distance(scene.place(row["block"], row["at"])[0], at)
            yield (f"along_{end}", place[row["block"], row["at"]], float(at[0, 2]), float(off[0]))


def _across(scene: Scene, mine: pl.DataFrame, row: dict[str, Any]) -> Iterator[Row]:
    """The plane through the axis at the angle of one position."""
    index, edge, stance = _stance(scene, row)
    phi = np.radians(row["phi_deg"])
    out = stance.radial(np.array([phi]))[0]
    s = np.linspace(float(edge.joints[0]), float(edge.joints[-1]), 200)
    at = edge.at(edge.piece_at(s), s)
    here = mine.filter((pl.col("block") == row["block"]) & (pl.col("at") == row["at"]))
    inside = np.zeros(len(s))
    for low, high in here.select("lower_mm", "upper_mm").iter_rows():
        inside[(s >= low) & (s <= high)] = 1.0
    wide = 1.4 * edge.profile.max_radius
    ends = {end: _points(here, end) - stance.tip for end in ("le", "ue")}
    top = max(float((ends["ue"] @ stance.axis).max()) * 1.5, 0.5 * wide)
    sides = np.linspace(0.0, wide, COLUMNS), np.linspace(-0.35 * top, top, 2 * ROWS)
    u, v = (c.ravel() for c in np.meshgrid(*sides))
    grid = stance.tip + u[:, None] * out + v[:, None] * stance.axis
    yield from _rows("across", u, v, scene.distance(index, grid))
    shown = at.z <= top
    yield from _rows("edge", at.r[shown], at.z[shown], inside[shown])
    for end, points in ends.items():
        off = scene.distance(index, points + stance.tip)
        yield from _rows(f"across_{end}", points @ out, points @ stance.axis, off)


def facing_angle(stance: Stance, phi: Floats, rm: float, r: float) -> Floats:
    """Degrees from the bottom to the point of a corner whose surface slides along itself, at angles phi (n,) of the tool frame.

    tan = (V . A - rm rho . A') / (rho . (V + r A')), rho radial, A the axis: N . V = 0 with the velocity of the middle of the
    corner, rm from the axis and r above the tip; tan(lead) / sin(angle from the feed) where the tool does not turn. In front
    the edge cuts above it (above 0), behind below it, and nowhere behind where it is not above 0 (NaN). Source: [Hendriko,
    five-axis milling, (5-13) to (5-15)], with the rotation that (5-13) leaves out.
    """
    rho = stance.radial(phi)
    out = rho @ (stance.velocity + r * stance.axis_rate)
    up = stance.velocity @ stance.axis - rm * (rho @ stance.axis_rate)
    angle = np.degrees(np.arctan(up / out))
    return np.asarray(np.where(out > 0.0, np.maximum(angle, 0.0), np.where(angle > 0.0, angle, np.nan)))


def _leads(scene: Scene, engaged: pl.DataFrame) -> Iterator[Row]:
    """Angles of LE of some positions in front; behind, those of UE where the surface leaves the material by itself."""
    groups = engaged.partition_by("block", "at", maintain_order=True)
    known = [(_lead(_stance(scene, one.row(0, named=True))[2]), k) for k, one in enumerate(groups)]
    order = sorted(known)
    for pick in sorted({round(k) for k in np.linspace(0, len(order) - 1, min(LEADS, len(order)))}):
        lead, k = order[pick]
        _, edge, stance = _stance(scene, groups[k].row(0, named=True))
        if not edge.rows[0, 6] > 0.0:  # no round part at the bottom: the edge has one direction there
            continue
        turn = np.linspace(0.25, 359.75, 720)
        form = facing_angle(stance, np.radians(turn) - stance.feed_angle, *edge.rows[0, 4:6].tolist())
        yield from _rows("lead_form", turn, form, lead)
        ahead = pl.col("phi_feed_deg") < 180.0
        left = pl.col("upper_by") == "facing"
        for end, column, chosen in (("le", "lower_mm", ahead), ("ue", "upper_mm", ~ahead & left)):
            rows = groups[k].filter(chosen)
            first = rows.group_by("phi_feed_deg").agg(pl.col(column).min()).sort("phi_feed_deg")
            s = first[column].to_numpy()
            angle = np.degrees(np.arccos(np.clip(-edge.at(edge.piece_at(s), s).n_z, -1.0, 1.0)))
            yield from _rows(f"lead_{end}", first["phi_feed_deg"].to_numpy(), angle, lead)
