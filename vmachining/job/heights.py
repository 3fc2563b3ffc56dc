"""`height_map`: the workpiece of a job as heights over cells, after some or all of its blocks."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import rows
from vmachining.engagement.analytic import HeightStock
from vmachining.errors import InputError
from vmachining.job.engage import Scene
from vmachining.job.jobfile import Job


def height_map(
    job: Job, *, pitch: float, after: int | None = None, region: ArrayLike | None = None
) -> HeightStock:
    """The workpiece as a staircase for the analytic engagement: a rough-milled part for its semi-finish.

    Parameters
    ----------
    pitch : mm, largest size of a cell. Heights are exact on the vertical lines through the middles of cells.
    after : last block that has cut, None: all of them.
    region : (2, 2) or (2, 3) mm, corners of the part as designed; None: all of the stock.

    Raises
    ------
    InputError
        A pitch that is not positive, a region beside the stock; program, tools or stock cannot be used.
    StockError
        Too many cells.
    """
    if not (np.isfinite(pitch) and pitch > 0.0):
        raise InputError(f"a pitch of {pitch:g} mm: expected a positive number")
    scene = Scene.of(job)
    box = None
    if region is not None:
        box = np.array([[-np.inf] * 3, [np.inf] * 3])
        given = rows(region, 2, np.shape(region)[-1], name="region")
        box[:, : given.shape[1]] = given
    stock = scene.heights(pitch, box, after)
    if stock is None:
        raise InputError(
            "the region does not meet the stock", remedy="give its corners in work coordinates, mm"
        )
    return stock
