"""`Pose`: where the tool is and where it points, and the checks of both."""

from __future__ import annotations

import warnings
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, rows
from vmachining.errors import AccuracyWarning, SweepError

UNIT = 1e-6
"""An axis of another length than one by more than this is named in a warning: CL files carry six digits."""


class Pose(NamedTuple):
    """Tool tip `cl` (3,) mm and tool axis (3,), from tip to spindle; it is normalised."""

    cl: ArrayLike
    axis: ArrayLike = (0.0, 0.0, 1.0)


def tip(value: ArrayLike, name: str) -> Floats:
    """Checked point (3,), mm.

    Raises SweepError: Not three finite numbers.
    """
    try:
        return rows(value, 3, name=f"{name} tip")
    except (ValueError, TypeError) as exc:
        raise SweepError(f"{name} pose: {exc}", remedy="give three finite numbers, mm") from exc


def unit_axis(value: ArrayLike, name: str) -> Floats:
    """Checked direction (3,) of length one. Another length is corrected, with a warning beyond 1e-6.

    Raises SweepError: Not three finite numbers, or all zero.
    """
    try:
        axis = rows(value, 3, name=f"{name} axis")
    except (ValueError, TypeError) as exc:
        raise SweepError(f"{name} pose: {exc}", remedy="give three finite numbers") from exc
    largest = float(np.abs(axis).max())
    if largest == 0.0:
        raise SweepError(f"{name} axis has length zero", remedy="give the direction from tip to spindle")
    scaled = axis / largest  # neither squares that overflow nor squares that vanish
    size = float(np.linalg.norm(scaled))
    if abs(largest * size - 1.0) > UNIT:
        warnings.warn(
            AccuracyWarning(f"{name} axis has length {largest * size:.9g}, not 1: it was normalised"),
            stacklevel=4,
        )
    unit = scaled / size
    unit[np.abs(unit) < 1e-300] = 0.0
    unit.setflags(write=False)
    return np.asarray(unit)


def tool_frame(axis: Floats) -> Floats:
    """(3, 3) rotation that takes a unit axis to +z; the identity for +z."""
    x = np.eye(3)[0] - axis[0] * axis if abs(axis[0]) < 0.9 else np.eye(3)[1] - axis[1] * axis
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(axis, x), axis])
