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

__all__ = ["CHIP_COLUMNS", "chip_table", "depths"]

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

    Parameters
    ----------
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
