"""Chip geometry of any engagement as one table: over the rotation angle at an instant, and along a path.

The same columns come from every engine: an `Engagement` (dexel, brep, analytic at an instant of a job, any cutter and edge)
and a `Pass` (analytic, many positions).

| column | is |
|---|---|
| `position` | number of the instant or position, from 0 |
| `phi_deg`, `phi_feed_deg` | rotation angle in the tool frame, and from the feed (90 straight ahead; null where it is axial) |
| `length_mm` | q, engaged length of the edge |
| `axial_mm` | engaged length along the tool axis, gaps left out |
| `depth_mm` | depth of cut, (Q_UE - Q_LE) . n; null without a design normal |
| `thickness_mm` | largest chip thickness along the edge |
| `area_mm2` | chip area |
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats
from vmachining.engagement.result import Engagement

if TYPE_CHECKING:
    import polars as pl

    from vmachining.engagement.analytic import Pass

CHIP_COLUMNS = (
    "position", "phi_deg", "phi_feed_deg", "length_mm", "axial_mm", "depth_mm", "thickness_mm", "area_mm2",
)  # fmt: skip
"""Columns of `chip_table`."""

ALONG = 17
"""Points of every interval at which the chip thickness of a general edge is asked: a wave is missed by 1e-3 of its height."""


def chip_table(
    found: Engagement | Sequence[Engagement] | Pass,
    *,
    feed_per_tooth: float = 1.0,
    normal: ArrayLike | None = (0.0, 0.0, 1.0),
) -> pl.DataFrame:
    """Chip geometry at every angle of the grid, see the module.

    feed_per_tooth : mm; 1 gives thickness and area per mm of it.
    normal : (3,) design normal of the depth; None leaves it empty.
    """
    import polars as pl

    if isinstance(found, Engagement):
        found = (found,)
    columns: dict[str, list[Any]] = {name: [] for name in CHIP_COLUMNS}
    if isinstance(found, Sequence):
        for number, one in enumerate(found):
            _add(columns, number, _of_engagement(one, feed_per_tooth, normal))
    else:
        values = _of_pass(found, feed_per_tooth, normal)
        for number in range(len(found.tip)):
            _add(columns, number, tuple(None if v is None else v[number] for v in values))
    schema = {name: pl.Int64 if name == "position" else pl.Float64 for name in CHIP_COLUMNS}
    return pl.DataFrame(columns, schema=schema)


def chip_points(
    found: Engagement, *, feed_per_tooth: float = 1.0, angles: int = 120, points: int = 9
) -> pl.DataFrame:
    """The engaged surface of an instant as points of its edge: what a picture of the chip as a body needs.

    Columns phi_deg, interval (number of it at its angle), share (of it), x_mm, y_mm, z_mm, normal nx, ny, nz, thickness_mm,
    edge_mm (s along the edge).

    angles : at most about so many of the grid. points : of every interval, both ends included.
    """
    import polars as pl

    every = max(1, round(found.contact.grid / angles))
    parts = found.contact.parts
    parts = parts.take((parts.row < found.contact.grid) & (parts.row % every == 0))
    parts = parts.take(np.lexsort((parts.lower, parts.row)))
    number = np.arange(len(parts.row)) - np.searchsorted(parts.row, parts.row)
    share = np.linspace(0.0, 1.0, points)
    s = (parts.lower[:, None] + (parts.upper - parts.lower)[:, None] * share).ravel()
    row, piece = (np.repeat(v, points) for v in (parts.row, parts.piece))
    phi = found.contact.phi[row]
    where = found.stance.points(found.edge, phi, piece, s)
    tip = float(np.linalg.norm(found.stance.velocity)) or 1.0
    thick = feed_per_tooth * np.maximum(found.stance.normal_speed(found.edge, phi, piece, s), 0.0) / tip
    at = found.edge.at(piece, s)
    normal = at.n_r[:, None] * found.stance.radial(phi - at.lag) + at.n_z[:, None] * found.stance.axis
    places = np.degrees(phi), np.repeat(number, points), np.tile(share, len(number))
    columns = *places, *where.T, *normal.T, thick, s
    names = (
        "phi_deg", "interval", "share", "x_mm", "y_mm", "z_mm", "nx", "ny", "nz", "thickness_mm", "edge_mm",
    )  # fmt: skip
    return pl.DataFrame({name: np.asarray(v, np.float32) for name, v in zip(names, columns, strict=True)})


def depths(found: Engagement, normal: ArrayLike) -> Floats:
    """(n,) mm at every angle of the grid, from the lowest to the highest engaged point of the edge along n; 0 in air."""
    parts = found.intervals
    n = np.asarray(normal, dtype=np.float64)
    low, high = (found.points(parts, upper=upper) @ n for upper in (False, True))
    out = np.zeros(found.contact.grid)
    for row in np.unique(parts.row):
        mine = np.flatnonzero(parts.row == row)
        out[row] = high[mine[-1]] - low[mine[0]]
    return out


def _add(columns: dict[str, list[Any]], number: int, values: tuple[Floats | None, ...]) -> None:
    size = next(len(v) for v in values if v is not None)
    columns["position"] += [number] * size
    for name, v in zip(CHIP_COLUMNS[1:], values, strict=True):
        columns[name] += [None] * size if v is None else v.tolist()


def _degrees(angle: Floats) -> Floats:
    return np.asarray(np.round(np.degrees(angle), 9) % 360.0)


def _of_engagement(one: Engagement, feed: float, normal: ArrayLike | None) -> tuple[Floats | None, ...]:
    turn = one.feed_angle
    parts = one.contact.parts.take(one.contact.parts.row < one.contact.grid)
    axial, thick = np.zeros((2, one.contact.grid))
    rise = one.edge.at(parts.piece, parts.upper).z - one.edge.at(parts.piece, parts.lower).z
    np.add.at(axial, parts.row, rise)
    share = np.linspace(0.0, 1.0, ALONG)
    s = (parts.lower[:, None] + (parts.upper - parts.lower)[:, None] * share).ravel()
    row, piece = (np.repeat(v, ALONG) for v in (parts.row, parts.piece))
    tip = float(np.linalg.norm(one.stance.velocity))
    if tip > 0.0:
        speed = one.stance.normal_speed(one.edge, one.contact.phi[row], piece, s) / tip
        np.maximum.at(thick, row, np.maximum(speed, 0.0))
    else:
        thick[:] = np.nan
    return (
        _degrees(one.phi), None if turn is None else _degrees(one.phi + turn), one.lengths, axial,
        None if normal is None else depths(one, normal), feed * thick, feed * one.chip_per_feed,
    )  # fmt: skip


def _of_pass(found: Pass, feed: float, normal: ArrayLike | None) -> tuple[Floats | None, ...]:
    shape = found.lower.shape[:2]
    return (
        _degrees(np.broadcast_to(found.phi, shape)), _degrees(found.phi_feed), found.cut_length, found.axial_depth,
        None if normal is None else found.depth(normal), found.thickest(feed), found.chip_area(feed),
    )  # fmt: skip
